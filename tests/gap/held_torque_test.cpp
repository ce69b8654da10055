// A recording of held commands from a closed-form solution: no step size, and no convention except that of
// the file format. Nothing is missing, so no effect may be named.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "identification/gap/gap.h"
#include "model/effects/any_effect.h"

namespace held_torque_test {

constexpr double kInertia_kg_m2 = 0.01;
constexpr double kViscous_Nm_s_per_rad = 0.02;
constexpr double kTick_rad = 2 * std::numbers::pi / 100000;
constexpr double kNoise_Nm = 1e-3;

enum class Torque : std::uint8_t { kMeasured, kCommanded };

/// A rotor in grease, pushed by a sum of sines that is held for a period each and acts `late_periods` later.
/// A row's command acts from its time on; its measured torque is the one before.
identification::gap::Source rotor(double period_s, Torque torque, std::uint64_t seed, int late_periods = 0) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> phase(0, 2 * std::numbers::pi);
  std::vector<double> phases(25);
  for (double& value : phases) value = phase(random);
  const double rate = kViscous_Nm_s_per_rad / kInertia_kg_m2;
  const double kept = std::exp(-rate * period_s);

  std::vector<double> time_s;
  std::vector<double> command_Nm;
  std::vector<double> measured_Nm;
  std::vector<double> position_rad;
  double position = 0.3;
  double velocity = 0;
  for (int k = 0; k * period_s < 40; ++k) {
    const double now_s = k * period_s;
    double command = 0;
    for (std::size_t n = 0; n < phases.size(); ++n)
      command +=
          0.02 * std::sin(2 * std::numbers::pi * (0.2 + 0.7 * static_cast<double>(n)) * now_s + phases[n]);
    time_s.push_back(now_s);
    position_rad.push_back(std::floor(position / kTick_rad) * kTick_rad);
    const std::size_t acts = command_Nm.size();
    command_Nm.push_back(command);
    const auto acted = [&](std::size_t at) {
      return at >= static_cast<std::size_t>(late_periods)
                 ? command_Nm[at - static_cast<std::size_t>(late_periods)]
                 : 0.0;
    };
    measured_Nm.push_back((acts > 0 ? acted(acts - 1) : 0.0) + kNoise_Nm * normal(random));
    // v' = (τ − b·v)/J over one period, τ constant.
    const double settled = acted(acts) / kViscous_Nm_s_per_rad;
    position += settled * period_s + (velocity - settled) * (1 - kept) / rate;
    velocity = settled + (velocity - settled) * kept;
  }
  identification::gap::Source source{.name = "rotor-" + std::to_string(seed) + ".csv", .recording = {}};
  source.recording.rig = "rotor";
  source.recording.columns = {{"time_s", std::move(time_s)}, {"position_rad", std::move(position_rad)}};
  if (torque == Torque::kMeasured)
    source.recording.columns.push_back({"torque_measured_Nm", std::move(measured_Nm)});
  else
    source.recording.columns.push_back({"torque_command_Nm", std::move(command_Nm)});
  return source;
}

identification::gap::Result analysed(double period_s, Torque torque, int late_periods = 0) {
  const model::effects::DriveModel base{
      .name = "rotor",
      .inertia_kg_m2 = kInertia_kg_m2,
      .effects = {
          model::effects::make_effect("viscous", {{"coefficient_Nm_s_per_rad", kViscous_Nm_s_per_rad}})}};
  return identification::gap::analyse(
      base, std::vector{rotor(period_s, torque, 1, late_periods), rotor(period_s, torque, 2, late_periods)},
      std::vector{rotor(period_s, torque, 3, late_periods)}, {});
}

std::string named(const identification::gap::Result& result) {
  std::string names;
  for (const identification::gap::FoundEffect& found : result.effects)
    names += (names.empty() ? "" : " ") + std::string(model::effects::name_of(found.effect));
  return names;
}

class HeldTorque : public testing::TestWithParam<double> {};

TEST_P(HeldTorque, MeasuredNothingIsMissing) {
  EXPECT_EQ(named(analysed(GetParam(), Torque::kMeasured)), "");
}

TEST_P(HeldTorque, CommandedNothingIsMissing) {
  EXPECT_EQ(named(analysed(GetParam(), Torque::kCommanded)), "");
}

TEST_P(HeldTorque, CommandedADelayIsAsLongAsItIs) {
  const identification::gap::Result result = analysed(GetParam(), Torque::kCommanded, 3);
  ASSERT_EQ(named(result), "transport_delay");
  EXPECT_NEAR(model::effects::parameter_of(result.effects.front().effect, "delay_s"), 3 * GetParam(),
              0.05 * GetParam());
}

INSTANTIATE_TEST_SUITE_P(AtPeriods_s, HeldTorque, testing::Values(0.01, 0.004, 0.001));

}  // namespace held_torque_test
