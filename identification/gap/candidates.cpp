#include "identification/gap/candidates.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/FFT>
#include <utility>

#include "identification/gap/parallel.h"
#include "model/effects/effect_chain.h"

namespace identification::gap {
namespace {

using model::effects::AnyEffect;
using model::effects::NamedValue;
using Samples = std::vector<double>;

constexpr double kTwoPi = 2 * std::numbers::pi;

/// value(i) at each sample.
template <class Value>
Samples each(const Signals& s, const Value& value) {
  Samples result(s.size());
  for (std::size_t i = 0; i < s.size(); ++i) result[i] = value(i);
  return result;
}

/// Friction-like columns: direction times a function of speed.
template <class Level>
auto friction_column(const Level& level) {
  return [level](const Signals& s) {
    return each(s, [&](std::size_t i) { return s.direction[i] * level(std::abs(s.velocity_rad_per_s[i])); });
  };
}

std::vector<double> geometric(double from, double to, int count) {
  std::vector<double> values;
  for (int i = 0; i < count; ++i)
    values.push_back(from * std::pow(to / from, count > 1 ? static_cast<double>(i) / (count - 1) : 0));
  return values;
}

FittedModel plus(const FittedModel& fitted, std::string_view effect, std::vector<NamedValue> values) {
  // A fit may end marginally outside the bounds of an effect.
  for (NamedValue& value : values)
    for (const auto& parameter : model::effects::effect_description(effect).parameters)
      if (parameter.name == value.name)
        value.value = std::clamp(value.value, parameter.lower, parameter.upper);
  FittedModel result = fitted;
  result.model.effects.push_back(model::effects::make_effect(effect, values));
  return result;
}

bool allowed(std::string_view effect, std::string_view name, double value) {
  return std::ranges::any_of(
      model::effects::effect_description(effect).parameters, [&](const auto& parameter) {
        return parameter.name == name && parameter.lower <= value && value <= parameter.upper;
      });
}

double coulomb_Nm(const FittedModel& fitted) {
  const auto* coulomb = fitted.model.find<model::effects::Coulomb>();
  return coulomb ? coulomb->parameters().torque_Nm : 0;
}

struct Reach {
  double slowest, fastest;  // |v| of the rows, approximately: 1 % and 99 % quantiles
  double position_span;     // maximum covered by one recording
  double longest_s;
  double band_rad_per_s;
};
Reach reach_of(const Rows& rows) {
  Eigen::VectorXd speed = rows.means([](const Signals& s) { return s.velocity_rad_per_s; }).cwiseAbs();
  std::vector<double> sorted(speed.data(), speed.data() + speed.size());
  std::ranges::sort(sorted);
  Reach reach{};
  if (!sorted.empty()) {
    reach.slowest = sorted[sorted.size() / 100];
    reach.fastest = sorted[sorted.size() - 1 - sorted.size() / 100];
  }
  reach.position_span = widest_span_rad(rows.signals());
  for (const Signals& s : rows.signals()) {
    reach.longest_s = std::max(reach.longest_s, s.running_s.back());
    reach.band_rad_per_s = kTwoPi * s.band_Hz;
  }
  return reach;
}

class Builder {
 public:
  Builder(const FittedModel& fitted, const Rows& rows)
      : fitted_(fitted), rows_(rows), reach_(reach_of(rows)) {
    for (const Signals& s : rows.signals()) modelled_Nm_.push_back(predicted_torque_Nm(fitted.model, s));
  }

  template <class E>
  bool has() const {
    return fitted_.model.find<E>() != nullptr;
  }
  /// The column there will be.
  Eigen::Index column(const std::function<Samples(const Signals&)>& quantity) {
    quantities_.push_back(quantity);
    return static_cast<Eigen::Index>(quantities_.size()) - 1;
  }
  void add(Candidate candidate) { candidates_.push_back(std::move(candidate)); }

  void friction();
  void direction();
  void drift();
  void position();
  void mechanics();
  void actuator();
  void custom();

  Dictionary finish() {
    Dictionary dictionary;
    dictionary.columns.resize(rows_.count(), static_cast<Eigen::Index>(quantities_.size()));
    in_parallel(quantities_.size(), [&](std::size_t i) {
      dictionary.columns.col(static_cast<Eigen::Index>(i)) = rows_.column(quantities_[i]);
    });
    dictionary.candidates = std::move(candidates_);
    return dictionary;
  }

 private:
  const FittedModel& fitted_;
  const Rows& rows_;
  Reach reach_;
  std::vector<Samples> modelled_Nm_;  // of each recording, for the present model
  std::vector<std::function<Samples(const Signals&)>> quantities_;
  std::vector<Candidate> candidates_;
};

constexpr Bounds kNotNegative{.lower = 0};
/// For shapes without their own amplitude.
constexpr Bounds kAsItIs{.lower = 0.7, .upper = 1.3};
/// Share of inertia and friction behind a gap or spring.
constexpr Bounds kPossibleShare{.lower = 0.01, .upper = 0.95};
constexpr double kTrialShare = 0.3;
constexpr double kTrialDampingRatio = 0.05;
/// A load has friction in its bearing; motor and gear also in seals, grease and brushes.
constexpr std::array kTrialFrictionRatios{0.3, 1.0};

void Builder::friction() {
  if (!has<model::effects::Coulomb>())
    add({"coulomb",
         {column(friction_column([](double) { return 1.0; }))},
         {kNotNegative},
         [](const FittedModel& f, const Eigen::VectorXd& a) {
           return plus(f, "coulomb", {{"torque_Nm", a[0]}});
         }});
  if (!has<model::effects::Viscous>())
    add({"viscous",
         {column(friction_column([](double v) { return v; }))},
         {kNotNegative},
         [](const FittedModel& f, const Eigen::VectorXd& a) {
           return plus(f, "viscous", {{"coefficient_Nm_s_per_rad", a[0]}});
         }});
  if (!has<model::effects::QuadraticDrag>())
    add({"quadratic_drag",
         {column(friction_column([](double v) { return v * v; }))},
         {kNotNegative},
         [](const FittedModel& f, const Eigen::VectorXd& a) {
           return plus(f, "quadratic_drag", {{"coefficient_Nm_s2_per_rad2", a[0]}});
         }});
  if (!has<model::effects::Stribeck>()) {
    for (const double velocity :
         geometric(std::max(reach_.slowest, 0.01 * reach_.fastest), 0.4 * reach_.fastest, 9)) {
      for (const double exponent : {1.0, 2.0}) {
        const auto shape = [=](double v) { return model::effects::Stribeck::shape(v, velocity, exponent); };
        add({"stribeck",
             {column(friction_column(shape))},
             {kNotNegative},
             [=](const FittedModel& f, const Eigen::VectorXd& a) {
               return plus(f, "stribeck",
                           {{"static_torque_Nm", coulomb_Nm(f) + a[0]},
                            {"velocity_rad_per_s", velocity},
                            {"exponent", exponent}});
             }});
      }
    }
  }
  if (!has<model::effects::MidspeedDip>()) {
    for (const double centre : geometric(0.05, 0.65, 9)) {
      for (const double width : {0.25 * centre, 0.45 * centre, 0.8 * centre}) {
        const double at = centre * reach_.fastest;
        const double wide = width * reach_.fastest;
        add({"midspeed_dip",
             {column(friction_column(
                 [=](double v) { return -model::effects::MidspeedDip::shape(v, at, wide); }))},
             {kNotNegative},
             [=](const FittedModel& f, const Eigen::VectorXd& a) {
               return plus(f, "midspeed_dip",
                           {{"depth_Nm", a[0]}, {"centre_rad_per_s", at}, {"width_rad_per_s", wide}});
             }});
      }
    }
  }
}

void Builder::direction() {
  const bool offset = has<model::effects::TorqueOffset>();
  const bool asymmetry = has<model::effects::DirectionAsymmetry>();
  if (offset && asymmetry) return;
  const Eigen::Index constant = column([](const Signals& s) { return Samples(s.size(), 1.0); });
  if (!offset && !asymmetry)
    add({"torque_offset", {constant}, {Bounds{}}, [](const FittedModel& f, const Eigen::VectorXd& a) {
           return plus(f, "torque_offset", {{"torque_Nm", a[0]}});
         }});
  if (!asymmetry) {
    const Eigen::Index speed = column([](const Signals& s) {
      return each(s, [&](std::size_t i) { return std::abs(s.velocity_rad_per_s[i]); });
    });
    if (offset)
      // An offset that grows with speed was an asymmetry.
      add({"direction_asymmetry", {speed}, {Bounds{}}, [](const FittedModel& f, const Eigen::VectorXd& a) {
             FittedModel without = f;
             double constant_Nm = 0;
             std::erase_if(without.model.effects, [&](const AnyEffect& effect) {
               const auto* found = std::get_if<model::effects::TorqueOffset>(&effect);
               if (found) constant_Nm = found->parameters().torque_Nm;
               return found != nullptr;
             });
             return plus(without, "direction_asymmetry",
                         {{"coulomb_Nm", constant_Nm}, {"viscous_Nm_s_per_rad", a[0]}});
           }});
    else
      add({"direction_asymmetry",
           {constant, speed},
           {Bounds{}, Bounds{}},
           [](const FittedModel& f, const Eigen::VectorXd& a) {
             return plus(f, "direction_asymmetry", {{"coulomb_Nm", a[0]}, {"viscous_Nm_s_per_rad", a[1]}});
           }});
  }
}

void Builder::drift() {
  if (has<model::effects::ThermalDrift>()) return;
  for (const double share : {0.15, 0.5, 2.0}) {
    const double constant_s = std::clamp(share * reach_.longest_s, 1.0, 1e5);
    const auto warm = [=](const Signals& s, std::size_t i) {
      return model::effects::ThermalDrift::shape(s.running_s[i], constant_s);
    };
    const Eigen::Index sliding = column([=](const Signals& s) {
      return each(s, [&](std::size_t i) { return s.direction[i] * warm(s, i); });
    });
    const Eigen::Index viscous = column([=](const Signals& s) {
      return each(s, [&](std::size_t i) { return warm(s, i) * s.velocity_rad_per_s[i]; });
    });
    add({"thermal_drift",
         {sliding, viscous},
         {Bounds{}, Bounds{}},
         [=](const FittedModel& f, const Eigen::VectorXd& a) {
           return plus(f, "thermal_drift",
                       {{"coulomb_change_Nm", a[0]},
                        {"viscous_change_Nm_s_per_rad", a[1]},
                        {"time_constant_s", constant_s}});
         }});
  }
}

void Builder::position() {
  const bool turns = reach_.position_span > kMinStroke_rad;
  if (!has<model::effects::Imbalance>() && turns) {
    const auto sine = column(
        [](const Signals& s) { return each(s, [&](std::size_t i) { return std::sin(s.position_rad[i]); }); });
    const auto cosine = column(
        [](const Signals& s) { return each(s, [&](std::size_t i) { return std::cos(s.position_rad[i]); }); });
    add({"imbalance",
         {sine, cosine},
         {Bounds{}, Bounds{}},
         [](const FittedModel& f, const Eigen::VectorXd& a) {
           return plus(
               f, "imbalance",
               {{"torque_Nm", std::hypot(a[0], a[1])}, {"rest_position_rad", std::atan2(-a[1], a[0])}});
         }});
  }
  if (!has<model::effects::Spring>() && turns && reach_.position_span <= kEndlessTravel_rad)
    add({"spring",
         {column([](const Signals& s) { return s.position_rad; }),
          column([](const Signals& s) { return Samples(s.size(), 1.0); })},
         {kNotNegative, Bounds{}},
         [](const FittedModel& f, const Eigen::VectorXd& a) {
           return plus(
               f, "spring",
               {{"stiffness_Nm_per_rad", a[0]}, {"rest_position_rad", a[0] > 0 ? -a[1] / a[0] : 0.0}});
         }});
  const auto* imbalance = fitted_.model.find<model::effects::Imbalance>();
  if (imbalance && !has<model::effects::LoadFriction>()) {
    const model::effects::Imbalance load = *imbalance;
    add({"load_friction",
         {column([=](const Signals& s) {
           return each(
               s, [&](std::size_t i) { return s.direction[i] * std::abs(load.load_Nm(s.position_rad[i])); });
         })},
         {Bounds{0, 2}},
         [](const FittedModel& f, const Eigen::VectorXd& a) {
           return plus(f, "load_friction", {{"share", a[0]}});
         }});
  }
}

void Builder::mechanics() {
  const double inertia = fitted_.model.inertia_kg_m2;
  if (!has<model::effects::Inertia>())
    add({"inertia",
         {column([](const Signals& s) { return s.acceleration_rad_per_s2; })},
         {Bounds{-kMaxInertiaDecrease * inertia, kMaxInertiaIncrease * inertia}},
         [](const FittedModel& f, const Eigen::VectorXd& a) {
           FittedModel given = f;
           given.model.inertia_kg_m2 = f.given_inertia_kg_m2;
           return plus(given, "inertia",
                       {{"difference_kg_m2", a[0] + f.model.inertia_kg_m2 - f.given_inertia_kg_m2}});
         }});
  // Prediction with an effect minus that without, per `amount` of it.
  const auto difference = [&](const AnyEffect& effect, double amount) {
    return column([this, effect, amount](const Signals& s) {
      FittedModel more = fitted_;
      more.model.effects.push_back(effect);
      const Samples with = predicted_torque_Nm(more.model, s);
      const Samples& without = modelled_Nm_[static_cast<std::size_t>(&s - rows_.signals().data())];
      return each(s, [&](std::size_t i) { return (with[i] - without[i]) / amount; });
    });
  };
  // What gives shows where torque and motion reverse at different times: not if one has the other's sign.
  if (std::ranges::any_of(rows_.signals(), &Signals::signed_by_motion)) return;
  if (const double level = coulomb_Nm(fitted_); !has<model::effects::Presliding>() && level > 0) {
    // Straight until breakaway, and bent like LuGre's bristle.
    for (const double exponent : {0.0, 1.0})
      // From a few samples' travel at the slowest speeds to the size of a gap.
      for (const double bent : geometric(2e-4, 0.1, 9)) {
        if (!allowed("presliding", "stiffness_Nm_per_rad", level / bent)) continue;
        const std::vector<NamedValue> values{{"stiffness_Nm_per_rad", level / bent}, {"exponent", exponent}};
        add({"presliding",
             {difference(model::effects::make_effect("presliding", values), 1)},
             {kAsItIs},
             [=](const FittedModel& f, const Eigen::VectorXd&) { return plus(f, "presliding", values); }});
      }
  }
  if (!has<model::effects::Backlash>() && !has<model::effects::Elasticity>()) {
    // For a load behind it: its share is fitted. Torques on the load change that slightly.
    for (const double gap : geometric(1e-3, 0.2, 13)) {
      for (const double friction_ratio : kTrialFrictionRatios) {
        const auto with = [=](double share) {
          return std::vector<NamedValue>{
              {"gap_rad", gap}, {"load_share", share}, {"friction_ratio", friction_ratio}};
        };
        add({"backlash",
             {difference(model::effects::make_effect("backlash", with(kTrialShare)), kTrialShare)},
             {kPossibleShare},
             [=](const FittedModel& f, const Eigen::VectorXd& a) {
               return plus(f, "backlash", with(a[0]));
             }});
      }
    }
    for (const double resonance : geometric(0.15 * reach_.band_rad_per_s, 2 * reach_.band_rad_per_s, 13)) {
      const auto with = [=](double share) {
        const double load_inertia = share * inertia;
        return std::vector<NamedValue>{
            {"stiffness_Nm_per_rad", load_inertia * resonance * resonance},
            {"damping_Nm_s_per_rad", 2 * kTrialDampingRatio * load_inertia * resonance},
            {"load_share", share}};
      };
      if (!allowed("elasticity", "stiffness_Nm_per_rad", with(kPossibleShare.lower).front().value)) continue;
      add({"elasticity",
           {difference(model::effects::make_effect("elasticity", with(kTrialShare)), kTrialShare)},
           {kPossibleShare},
           [=](const FittedModel& f, const Eigen::VectorXd& a) {
             return plus(f, "elasticity", with(a[0]));
           }});
    }
  }
}

void Builder::actuator() {
  // With a measured torque the actuator channel covers these.
  if (!std::ranges::all_of(rows_.signals(), &Signals::torque_is_command)) return;
  const double usual_Nm = usual_command_Nm(rows_.signals());
  double shortest_s = 1;
  for (const Signals& s : rows_.signals()) shortest_s = std::min(shortest_s, s.raw_period_s);
  const auto beyond = [this](const AnyEffect& effect) {
    return column([effect](const Signals& s) {
      Samples result = delivered_beyond_command_Nm({.effects = {effect}}, s);
      for (double& value : result) value = -value;
      return result;
    });
  };
  const auto by_value = [&](std::string_view effect, std::string_view parameter, double value) {
    add({effect,
         {beyond(model::effects::make_effect(effect, {{parameter, value}}))},
         {kAsItIs},
         [=](const FittedModel& f, const Eigen::VectorXd&) {
           FittedModel as_commanded = f;
           if (effect != "torque_deadband") as_commanded.lag_s = as_commanded.smoothing_s2 = 0;
           return plus(as_commanded, effect, {{parameter, value}});
         }});
  };
  if (!has<model::effects::TorqueDeadband>() && usual_Nm > 0)
    for (const double threshold : geometric(0.025 * usual_Nm, usual_Nm, 12))
      by_value("torque_deadband", "threshold_Nm", threshold);
  if (!has<model::effects::TransportDelay>() && shortest_s < 0.5 * model::effects::DelayLine::kLongest_s)
    for (const double delay : geometric(shortest_s, std::min(0.4, 60 * shortest_s), 12))
      by_value("transport_delay", "delay_s", delay);
  if (!has<model::effects::TorqueLag>())
    for (const double lag : geometric(shortest_s, 300 * shortest_s, 12))
      by_value("torque_lag", "time_constant_s", lag);
}

/// Adds the program's own effects that the model does not have.
void Builder::custom() {
  using model::effects::CustomEffect;
  for (const CustomEffect* effect : model::effects::custom_effects()) {
    if (std::ranges::any_of(fitted_.model.effects, [&](const AnyEffect& known) {
          return model::effects::name_of(known) == effect->name;
        }))
      continue;
    const std::vector<double> shapes = effect->shape ? effect->tried_shapes : std::vector<double>{0};
    for (const double shape : shapes)
      add({effect->name,
           {column([this, effect, shape](const Signals& s) {
             const model::effects::EffectChain load(fitted_.model.effects);
             const auto level = [&](std::size_t i, double direction) {
               if (effect->level == nullptr) return 0.0;
               return effect->level({.speed_rad_per_s = std::abs(s.velocity_rad_per_s[i]),
                                     .direction = direction,
                                     .running_s = s.running_s[i],
                                     .coulomb_Nm = coulomb_Nm(fitted_),
                                     .load_Nm = std::abs(load.load_Nm(s.position_rad[i]))},
                                    shape);
             };
             return each(s, [&](std::size_t i) {
               const double forward = 0.5 + 0.5 * s.direction[i];
               const double over_position =
                   effect->load != nullptr ? effect->load(s.position_rad[i], shape) : 0;
               return forward * level(i, +1) - (1 - forward) * level(i, -1) + over_position;
             });
           })},
           {Bounds{effect->amplitude.lower, effect->amplitude.upper}},
           [effect, shape](const FittedModel& f, const Eigen::VectorXd& a) {
             std::vector<NamedValue> values{{effect->amplitude.name, a[0]}};
             if (effect->shape) values.push_back({effect->shape->name, shape});
             return plus(f, effect->name, std::move(values));
           }});
  }
}

constexpr std::size_t kRippleBins = 1 << 16;
constexpr double kMaxPeriods = 400;
constexpr double kMinTurns = 2;  // of the ripple
/// Four per ripple of the maximum number of periods, and half of all bins must be covered; the others are
/// zero.
constexpr double kRippleBin_rad = kTwoPi / (4 * kMaxPeriods);
constexpr double kRippleSpan_rad = 0.5 * kRippleBins * kRippleBin_rad;
/// For a joint that turned further, this many stretches of that length are used.
constexpr std::size_t kMaxStretches = 8;

/// Sums of a residual over position, by stretch.
std::vector<std::vector<double>> ripple_stretches(const Eigen::VectorXd& residual,
                                                  const Eigen::VectorXd& position_rad, double low,
                                                  double span, double bin) {
  const auto all = static_cast<std::size_t>(std::ceil(span / kRippleSpan_rad));
  const std::size_t count = std::min(all, kMaxStretches);
  std::vector<std::size_t> place(all + 1, count);  // which of the used ones; count: none
  for (std::size_t i = 0; i < count; ++i) place[i * all / count] = i;
  std::vector<std::vector<double>> sums(count, std::vector<double>(kRippleBins, 0));
  for (Eigen::Index i = 0; i < residual.size(); ++i) {
    const double at = position_rad[i] - low;
    const auto stretch = all == 1 ? 0 : static_cast<std::size_t>(at / kRippleSpan_rad);
    if (place[stretch] == count) continue;
    const double within = at - static_cast<double>(stretch) * kRippleSpan_rad;
    sums[place[stretch]][static_cast<std::size_t>(within / bin)] += residual[i];
  }
  return sums;
}

/// Over many turns the phase of a ripple gives its number of periods more precisely than a spectrum of a part
/// of them: among those near `coarse`, the one with constant phase.
double finer_periods_per_rev(double coarse, const Eigen::VectorXd& residual,
                             const Eigen::VectorXd& position_rad, double low, double span) {
  constexpr double kGroupsOfStretch = 8;
  const double length = kRippleSpan_rad / kGroupsOfStretch;
  std::vector<std::complex<double>> groups(static_cast<std::size_t>(span / length) + 1);
  for (Eigen::Index i = 0; i < residual.size(); ++i) {
    const double at = position_rad[i] - low;
    groups[static_cast<std::size_t>(at / length)] += std::polar(residual[i], -coarse * at);
  }
  // Four frequencies per resolution of the whole span, over the resolution of the coarse spectrum: an eighth
  // of the groups' own spectrum either way.
  std::vector<std::complex<double>> spectrum;
  const std::size_t count = groups.size();
  groups.resize(std::bit_ceil(4 * count));
  thread_local Eigen::FFT<double> fft;
  fft.fwd(spectrum, groups);
  const double step = kTwoPi / (static_cast<double>(groups.size()) * length);
  const auto reach = static_cast<std::ptrdiff_t>(groups.size() / 8);
  double best = coarse;
  double most = 0;
  for (std::ptrdiff_t k = -reach; k <= reach; ++k) {
    const double power = std::norm(spectrum[static_cast<std::size_t>(k < 0 ? k + 8 * reach : k)]);
    if (power <= most) continue;
    most = power;
    best = coarse + static_cast<double>(k) * step;
  }
  return best;
}

}  // namespace

Dictionary make_dictionary(const FittedModel& fitted, const Rows& rows) {
  Builder builder(fitted, rows);
  builder.friction();
  builder.direction();
  builder.drift();
  builder.position();
  builder.mechanics();
  builder.actuator();
  builder.custom();
  return builder.finish();
}

double ripple_periods_per_rev(const Eigen::VectorXd& residual, const Eigen::VectorXd& position_rad) {
  if (residual.size() < 16) return 0;
  const double low = position_rad.minCoeff();
  const double span = position_rad.maxCoeff() - low;
  if (!(span > 0)) return 0;
  std::vector<double> power(kRippleBins / 2, 0);
  std::vector<std::complex<double>> spectrum;
  thread_local Eigen::FFT<double> fft;  // keeps its tables for the lifetime of the thread
  const double bin = std::max(std::min(span, kRippleSpan_rad) / (0.5 * kRippleBins), kRippleBin_rad);
  for (const std::vector<double>& stretch : ripple_stretches(residual, position_rad, low, span, bin)) {
    fft.fwd(spectrum, stretch);
    for (std::size_t k = 1; k < power.size(); ++k) power[k] += std::norm(spectrum[k]);
  }
  double best = 0;
  double most = 0;
  for (std::size_t k = 1; k < power.size(); ++k) {
    const double periods = static_cast<double>(k) * kTwoPi / (static_cast<double>(kRippleBins) * bin);
    if (periods < 1.5 || periods > kMaxPeriods || periods * span < kMinTurns * kTwoPi) continue;
    if (power[k] > most) {
      most = power[k];
      best = periods;
    }
  }
  return span > kRippleSpan_rad && best > 0 ? finer_periods_per_rev(best, residual, position_rad, low, span)
                                            : best;
}

Eigen::MatrixXd ripple_columns(double periods_per_rev, const Eigen::VectorXd& position_rad,
                               const Eigen::VectorXd& velocity_rad_per_s, double band_Hz) {
  Eigen::MatrixXd columns(position_rad.size(), 2);
  for (Eigen::Index i = 0; i < position_rad.size(); ++i) {
    // Share that the band passes at this speed.
    const double over = periods_per_rev * velocity_rad_per_s[i] / (kTwoPi * band_Hz);
    const double gain = 1 / (1 + over * over * over * over);
    columns(i, 0) = gain * std::sin(periods_per_rev * position_rad[i]);
    columns(i, 1) = gain * std::cos(periods_per_rev * position_rad[i]);
  }
  return columns;
}

FittedModel with_ripple(const FittedModel& fitted, double periods_per_rev, double sine_Nm, double cosine_Nm) {
  return plus(fitted, "cogging",
              {{"amplitude_Nm", std::hypot(sine_Nm, cosine_Nm)},
               {"periods_per_rev", periods_per_rev},
               {"phase_rad", std::atan2(cosine_Nm, sine_Nm)}});
}

}  // namespace identification::gap
