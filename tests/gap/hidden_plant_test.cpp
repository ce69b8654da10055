#include "tests/gap/hidden_plant.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <vector>

#include "tests/gap/gap_cases.h"
#include "tests/gap/hidden_experiment.h"

namespace gap_test {
namespace hidden_plant_test {

constexpr double kTick_rad = 2 * std::numbers::pi / 104000;

double rms_difference(std::span<const double> a, std::span<const double> b) {
  double squares = 0;
  for (std::size_t k = 0; k < a.size(); ++k) squares += (a[k] - b[k]) * (a[k] - b[k]);
  return std::sqrt(squares / static_cast<double>(a.size()));
}

TEST(HiddenPlant, EnergyThatTheMotorGivesIsHeatAndMotion) {
  for (const Experiment experiment :
       {Experiment::kStaircase, Experiment::kMultisine, Experiment::kReversals}) {
    const Simulated run = simulate({}, {experiment, 8});
    EXPECT_NEAR(run.motor_work_J, run.friction_heat_J + run.kinetic_J, 0.002 * run.motor_work_J)
        << name_of(experiment);
    EXPECT_GT(run.friction_heat_J, 0);
  }
}

TEST(HiddenPlant, SettlesAtTheSpeedWhereFrictionTakesTheTorque) {
  const Plant plant;
  HiddenPlant hidden(plant, {}, {}, 1);
  const double torque_Nm = plant.coulomb_Nm + 4 * plant.viscous_Nm_s_per_rad;
  for (int k = 0; k < 10000; ++k) hidden.step(torque_Nm);  // ten time constants
  EXPECT_NEAR(hidden.velocity_rad_per_s(), 4, 1e-3);
}

TEST(HiddenPlant, RestsOnAContactThatTheEncoderDoesNotSee) {
  const Plant plant;
  HiddenPlant hidden(plant, {}, {}, 1);
  const double start_rad = hidden.position_rad();
  double furthest_rad = 0;
  for (int k = 0; k < 5000; ++k) {
    hidden.step(0.9 * plant.coulomb_Nm * std::sin(2 * std::numbers::pi * 1e-3 * k));
    furthest_rad = std::max(furthest_rad, std::abs(hidden.position_rad() - start_rad));
  }
  EXPECT_LT(furthest_rad, 0.1 * kTick_rad);
}

TEST(HiddenPlant, ASoftContactGivesAndComesBack) {
  const Plant plant;
  HiddenEffects effects;
  effects.contact_rad_per_Nm = 0.01;
  HiddenPlant hidden(plant, effects, {}, 1);
  const double start_rad = hidden.position_rad();
  const double torque_Nm = 0.4 * plant.coulomb_Nm;
  for (int k = 0; k < 2000; ++k) hidden.step(torque_Nm);
  EXPECT_NEAR(hidden.position_rad() - start_rad, torque_Nm * effects.contact_rad_per_Nm, 0.1 * kTick_rad);
  for (int k = 0; k < 2000; ++k) hidden.step(0);
  EXPECT_NEAR(hidden.position_rad(), start_rad, 0.1 * kTick_rad);
}

TEST(HiddenPlant, TheMotorTurnsFreelyWithinTheGap) {
  Plant plant;
  plant.load_friction_share = 0.5;
  HiddenEffects effects;
  effects.gap_rad = 0.05;
  HiddenPlant hidden(plant, effects, {}, 1);
  const double start_rad = hidden.position_rad();
  // Enough for the motor's half of the friction; the load moves a little when the motor arrives.
  for (int k = 0; k < 3000; ++k) hidden.step(0.52 * plant.coulomb_Nm);
  EXPECT_NEAR(hidden.position_rad() - start_rad, 0.5 * effects.gap_rad, 0.05 * effects.gap_rad);
  for (int k = 0; k < 3000; ++k) hidden.step(-0.52 * plant.coulomb_Nm);
  EXPECT_NEAR(hidden.position_rad() - start_rad, -0.5 * effects.gap_rad, 0.05 * effects.gap_rad);
}

TEST(HiddenPlant, ADelayedCommandComesAsLateAsItSays) {
  Drive drive;
  drive.effects.delay_s = 0.004;
  const Simulated run = simulate(drive, {Experiment::kMultisine, 4});
  const auto command = run.recording.column("torque_command_Nm");
  std::vector<double> errors;
  for (std::size_t late = 0; late < 8; ++late)
    errors.push_back(
        rms_difference(command.subspan(8 - late, 3900), std::span(run.torque_Nm).subspan(8, 3900)));
  EXPECT_EQ(std::min_element(errors.begin(), errors.end()) - errors.begin(), 4);
}

TEST(HiddenPlant, TheSensorAddsTheNoiseFloorAndNothingElse) {
  for (const Sensors& sensors :
       {Sensors{.torque_noise_Nm = 0.002}, Sensors{.torque_noise_Nm = 0.002, .noise_correlation_s = 0.004},
        Sensors{.torque_noise_Nm = 0.001, .torque_step_Nm = 0.003}}) {
    const Simulated run =
        simulate({.plant = {}, .effects = {}, .sensors = sensors}, {Experiment::kStaircase, 10});
    EXPECT_NEAR(rms_difference(run.recording.column("torque_measured_Nm"), run.torque_Nm),
                sensors.noise_floor_Nm(), 0.05 * sensors.noise_floor_Nm());
  }
}

TEST(HiddenPlant, LossOfSignLeavesMagnitudes) {
  Drive drive;
  drive.effects.unsigned_current = 1;
  const Simulated run = simulate(drive, {Experiment::kReversals, 4});
  const auto measured = run.recording.column("torque_measured_Nm");
  EXPECT_GE(*std::min_element(measured.begin(), measured.end()), 0);
  EXPECT_LT(*std::min_element(run.torque_Nm.begin(), run.torque_Nm.end()), -0.04);
}

TEST(GapCases, AreAsManyAsTheProofAsksFor) {
  const std::vector<CaseSpec> cases = gap_cases();
  const auto count = [&](CaseKind kind) {
    return std::count_if(cases.begin(), cases.end(),
                         [kind](const CaseSpec& spec) { return spec.kind == kind; });
  };
  EXPECT_GE(cases.size(), 200u);
  EXPECT_GE(count(CaseKind::kNone), 60);
  EXPECT_GE(count(CaseKind::kOutside), 30);
  EXPECT_GE(count(CaseKind::kPair), 30);
  EXPECT_GE(count(CaseKind::kTriple), 10);
}

TEST(GapCases, HideWhatTheySayInTheSizeTheySay) {
  using enum Hidden;
  for (const Hidden kind : {kStribeck, kCogging, kElasticity, kThermalDrift, kTorqueDeadband, kLoadFriction,
                            kPush, kLooseCoupling}) {
    const Case made = make_case({CaseKind::kSingle, {kind}, 4, 77}, 0.4);
    EXPECT_NEAR(made.least_size(), 4, 0.4) << name_of(kind);
  }
  const Case pair = make_case({CaseKind::kPair, {kMidspeedDip, kTorqueOffset}, 3.5, 78}, 0.4);
  ASSERT_EQ(pair.sizes.size(), 2u);
  for (const double size : pair.sizes) EXPECT_NEAR(size, 3.5, 0.35);
}

TEST(GapCases, AreTheSameEveryTime) {
  const CaseSpec spec{CaseKind::kPair, {Hidden::kStribeck, Hidden::kCogging}, 4, 9};
  const Case first = make_case(spec, 0.2);
  const Case second = make_case(spec, 0.2);
  const Case other = make_case({CaseKind::kPair, {Hidden::kStribeck, Hidden::kCogging}, 4, 10}, 0.2);
  ASSERT_EQ(first.data.size(), 5u);
  ASSERT_EQ(first.held_out.size(), 2u);
  for (std::size_t i = 0; i < first.data.size(); ++i) {
    const auto a = first.data[i].recording.column("torque_measured_Nm");
    const auto b = second.data[i].recording.column("torque_measured_Nm");
    const auto c = other.data[i].recording.column("torque_measured_Nm");
    EXPECT_TRUE(std::equal(a.begin(), a.end(), b.begin(), b.end()));
    EXPECT_FALSE(std::equal(a.begin(), a.end(), c.begin(), c.end()));
  }
}

}  // namespace hidden_plant_test
}  // namespace gap_test
