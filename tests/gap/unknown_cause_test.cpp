// A cause that is not in the library: a gear with friction proportional to the transmitted torque. An inertia
// and a compliance each explain a little of it, and must not be named.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "identification/gap/gap.h"
#include "model/effects/any_effect.h"

namespace unknown_cause_test {

constexpr double kInertia_kg_m2 = 0.0112;
constexpr double kCoulomb_Nm = 0.045;
constexpr double kViscous_Nm_s_per_rad = 0.0125;
constexpr double kPeriod_s = 2e-3;
constexpr double kStep_s = 2e-5;

/// A sum of sines, or steps up and down, for half a minute. `rubs`: that share.
identification::gap::Source recording(double rubs, bool steps, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<double> phases(20);
  for (double& phase : phases) phase = std::numbers::pi * uniform(random);
  std::vector<double> levels(30);
  for (double& level : levels) level = 0.2 * uniform(random);

  identification::gap::Source source{.name = "gear-" + std::to_string(seed) + ".csv", .recording = {}};
  source.recording.rig = "gear";
  source.recording.columns = {
      {"time_s", {}}, {"torque_command_Nm", {}}, {"torque_measured_Nm", {}}, {"position_rad", {}}};
  double position = 0;
  double velocity = 0;
  double before_Nm = 0;
  for (int k = 0; k * kPeriod_s < 30; ++k) {
    const double now_s = k * kPeriod_s;
    double command = levels[static_cast<std::size_t>(now_s)];
    if (!steps) {
      command = 0;
      for (std::size_t n = 0; n < phases.size(); ++n)
        command +=
            0.045 * std::sin(2 * std::numbers::pi * (0.1 + 0.4 * static_cast<double>(n)) * now_s + phases[n]);
    }
    const double values[] = {now_s, command, before_Nm + 1.5e-3 * normal(random),
                             std::floor(position * 16550) / 16550};
    for (std::size_t c = 0; c < 4; ++c) source.recording.columns[c].values.push_back(values[c]);
    for (int i = 0; i < static_cast<int>(kPeriod_s / kStep_s + 0.5); ++i) {
      const double friction_Nm = kCoulomb_Nm + rubs * std::abs(command);
      const double free = velocity + kStep_s * (command - kViscous_Nm_s_per_rad * velocity) / kInertia_kg_m2;
      const double stops = kStep_s * friction_Nm / kInertia_kg_m2;  // as much velocity as friction can take
      velocity = std::copysign(std::max(std::abs(free) - stops, 0.0), free);
      position += kStep_s * velocity;
    }
    before_Nm = command;
  }
  return source;
}

class UnknownCause : public testing::TestWithParam<double> {};

TEST_P(UnknownCause, AGearThatRubsByWhatItTransmitsIsNotCalledAnythingElse) {
  const model::effects::DriveModel base{
      .name = "gear",
      .inertia_kg_m2 = kInertia_kg_m2,
      .effects = {
          model::effects::make_effect("coulomb", {{"torque_Nm", kCoulomb_Nm}}),
          model::effects::make_effect("viscous", {{"coefficient_Nm_s_per_rad", kViscous_Nm_s_per_rad}})}};
  const identification::gap::Result result = identification::gap::analyse(
      base, std::vector{recording(GetParam(), false, 1), recording(GetParam(), true, 2)},
      std::vector{recording(GetParam(), false, 3), recording(GetParam(), true, 4)}, {});
  std::string named;
  for (const identification::gap::FoundEffect& found : result.effects)
    named += std::string(model::effects::name_of(found.effect)) + " ";
  EXPECT_EQ(named, "");
  EXPECT_EQ(result.verdict, identification::gap::Verdict::kUnexplained);
}

INSTANTIATE_TEST_SUITE_P(Shares, UnknownCause, testing::Values(0.2, 0.3, 0.5));

}  // namespace unknown_cause_test
