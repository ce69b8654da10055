#include "identification/gap/bench_experiments.h"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <type_traits>

#include "identification/experiments/dahl.h"
#include "identification/experiments/reversals.h"
#include "identification/experiments/staircase.h"
#include "identification/experiments/steady_state.h"
#include "identification/experiments/stick_slip.h"
#include "identification/experiments/torque_ramp.h"
#include "identification/experiments/torque_wave.h"
#include "identification/experiments/velocity_sets.h"

namespace identification::gap {
namespace {

using experiments::JointExperiment;
using experiments::Parameter;
using Settings = std::vector<std::pair<std::string, std::string>>;

/// Share of the Coulomb torque that does not break away, even if the model is slightly too strong.
constexpr double kHolds = 0.7;
/// Share of the torque limit, for a model without Coulomb friction.
constexpr double kUsualCoulomb = 0.1;
/// Share of youbot-bench's speed limit that leaves room for overshoot. It allows at most 30 rad/s.
constexpr double kUsualTop_rad_per_s = 10;
constexpr double kMaxTop_rad_per_s = 25;
constexpr double kAbove = 1.2;

/// youbot-bench's defaults.
BenchStops usual_stops(std::string_view experiment) {
  if (experiment == "dahl" || experiment == "presliding") return {2, 0.5};
  if (experiment == "torque-ramp") return {5, 3};
  if (experiment == "stick-slip") return {6, 20};
  return {.speed_rad_per_s = 12};
}

/// Two digits, rounded down, as typed by a person.
double round_down(double value) {
  if (!(value > 0)) return 0;
  const double unit = std::pow(10, std::floor(std::log10(value)) - 1);
  return std::floor(value / unit + 1e-9) * unit;
}

template <class Value>
std::string text_of(const Value& value) {
  if constexpr (std::is_same_v<Value, std::string>)
    return value;
  else
    return experiments::number_text(static_cast<double>(value));
}

/// The values of a configuration that differ from its defaults.
template <class Config>
Settings settings_of(Config config) {
  Settings defaults;
  Config{}.visit([&](const Parameter& parameter, const auto& value) {
    defaults.emplace_back(parameter.key, text_of(value));
  });
  Settings all;
  config.visit([&](const Parameter& parameter, const auto& value) {
    all.emplace_back(parameter.key, text_of(value));
  });
  std::erase_if(all,
                [&](const auto& setting) { return std::ranges::find(defaults, setting) != defaults.end(); });
  return all;
}

class Bench {
 public:
  Bench(const model::effects::DriveModel& model, const DriveLimits& limits)
      : speed_(round_down(std::min(limits.speed_rad_per_s, kMaxTop_rad_per_s))),
        torque_(round_down(limits.torque_Nm)) {
    const auto* coulomb = model.find<model::effects::Coulomb>();
    coulomb_ = coulomb != nullptr ? coulomb->parameters().torque_Nm : kUsualCoulomb * limits.torque_Nm;
    coulomb_ = std::min(coulomb_, limits.torque_Nm);
  }

  std::vector<BenchExperiment> all() {
    by_speed();
    by_torque();
    at_rest();
    return std::move(list_);
  }

 private:
  template <class Experiment, class Config, class... More>
  void add(std::string_view name, const Config& config, const Settings& extra, const More&... more) {
    Settings settings = settings_of(config);
    settings.insert(settings.end(), extra.begin(), extra.end());
    BenchStops stops = usual_stops(name);
    if (speed_ > kUsualTop_rad_per_s && std::isinf(stops.travel_rad)) {
      stops.speed_rad_per_s = round_down(kAbove * speed_);
      settings.emplace_back("max_speed_rad_per_s", text_of(stops.speed_rad_per_s));
    }
    list_.push_back({std::string(name), std::move(settings),
                     [config, more...](double period_s) -> std::unique_ptr<JointExperiment> {
                       if constexpr (std::is_constructible_v<Experiment, Config, More..., double>)
                         return std::make_unique<Experiment>(config, more..., period_s);
                       else
                         return std::make_unique<Experiment>(config, more...);
                     },
                     stops});
  }

  void by_speed() {
    for (const double share : {1.0, 0.1}) {
      const double top = round_down(share * speed_);
      if (!(top > 0)) return;
      add<experiments::Staircase>(
          "staircase",
          experiments::StaircaseConfig{.quantity = "velocity", .step = top / 8, .highest = top, .hold_s = 2},
          {});
      add<experiments::Reversals>("reversals",
                                  experiments::ReversalsConfig{.highest_rad_per_s = top,
                                                               .lowest_rad_per_s = round_down(top / 10),
                                                               .period_s = share < 1 ? 2.0 : 4.0},
                                  {});
    }
    // The recording of a friction map is coarse unless more is requested.
    for (const char* const sets : {"1,7", "4,8", "6,9"}) {
      const experiments::SteadyStateConfig config{.settle_s = 2, .measure_s = 3, .extra_s = 0, .sets = sets};
      if (std::ranges::all_of(experiments::velocities_rad_per_s(sets),
                              [&](double speed) { return std::abs(speed) <= speed_; }))
        add<experiments::SteadyState>("steady-state", config, {{"record_rate_Hz", "1000"}});
    }
    add<experiments::StickSlip>(
        "stick-slip",
        experiments::StickSlipConfig{
            .stiffness_Nm_per_rad = round_down(4 * coulomb_), .torque_limit_Nm = torque_, .duration_s = 30},
        {});
  }

  void by_torque() {
    for (const double share : {1.0, 0.5}) {
      const double peak = round_down(share * torque_);
      add<experiments::Staircase>(
          "staircase", experiments::StaircaseConfig{.step = peak / 8, .highest = peak, .hold_s = 2}, {});
      add<experiments::TorqueWave>("multisine", experiments::MultisineConfig{.peak_Nm = peak}, {});
      add<experiments::TorqueWave>(
          "multisine", experiments::MultisineConfig{.peak_Nm = peak, .lowest_Hz = 1, .highest_Hz = 25}, {});
    }
    // Five minutes, for slow changes.
    add<experiments::TorqueWave>("multisine", experiments::MultisineConfig{.peak_Nm = torque_, .periods = 30},
                                 {});
    add<experiments::TorqueRamp>("torque-ramp",
                                 experiments::TorqueRampConfig{.rate_Nm_per_s = round_down(coulomb_ / 10),
                                                               .highest_torque_Nm = torque_},
                                 {}, kEncoderStep_rad);
  }

  void at_rest() {
    const double peak = round_down(kHolds * coulomb_);
    add<experiments::TorqueWave>("presliding", experiments::PreslidingConfig{.peak_Nm = peak}, {});
    add<experiments::TorqueWave>(
        "presliding",
        experiments::PreslidingConfig{.waveform = "sine", .peak_Nm = peak, .lowest_Hz = 1, .periods = 20},
        {});
    add<experiments::Dahl>("dahl", experiments::DahlConfig{.amplitude_Nm = peak, .frequency_Hz = 0.5}, {},
                           kEncoderStep_rad);
  }

  /// Only the torques matter here, not what an experiment makes of the encoder's steps.
  static constexpr double kEncoderStep_rad = 6e-5;

  double speed_;
  double torque_;
  double coulomb_ = 0;
  std::vector<BenchExperiment> list_;
};

}  // namespace

std::vector<BenchExperiment> bench_experiments(const model::effects::DriveModel& model,
                                               const DriveLimits& limits) {
  return Bench(model, limits).all();
}

}  // namespace identification::gap
