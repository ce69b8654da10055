// A drive model in the compensator: torques against hand calculations with the formulas of the effects.
#include "model/effects/resistance.h"
#include "model/effects/dissipation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "control/base_controller.h"
#include "control/friction_compensator.h"
#include "tests/support/no_alloc_guard.h"

namespace model::effects {
namespace resistance_test {

using control::FrictionCompensator;
using control::FrictionEstimate;
using control::FrictionObserver;
using model::JointResistance;

constexpr double kFull_Nm = 0.01;
constexpr double kCommand_Nm = 0.1;  // far above kFull_Nm: compensated in full

DriveModel with(std::initializer_list<AnyEffect> effects) {
  DriveModel model;
  model.effects = {make_effect("coulomb", {{"torque_Nm", 0.05}}),
                   make_effect("viscous", {{"coefficient_Nm_s_per_rad", 0.01}})};
  model.effects.insert(model.effects.end(), effects);
  return model;
}

/// The compensator's torque with the full margin, for a joint at that velocity and position.
double help_Nm(const JointResistance& resistance, double velocity_rad_per_s, double position_rad,
               double command_Nm) {
  const FrictionCompensator compensator({.margin = 1, .full_command_Nm = kFull_Nm});
  FrictionObserver observer(resistance.sliding, {}, resistance.position);
  // Up to there at constant velocity, until the filter has forgotten the beginning.
  constexpr double kPeriod_s = 1e-3;
  constexpr int kSteps = 1000;
  FrictionEstimate estimate;
  observer.reset(position_rad - kSteps * kPeriod_s * velocity_rad_per_s);
  for (int i = kSteps; i >= 0; --i)
    estimate = observer.step(position_rad - i * kPeriod_s * velocity_rad_per_s);
  return compensator.torque_Nm(command_Nm, estimate, observer);
}

TEST(Resistance, SlidingFrictionIsTheSumOfTheEffectsInEachDirection) {
  const JointResistance resistance = resistance_of(
      with({make_effect("quadratic_drag", {{"coefficient_Nm_s2_per_rad2", 0.001}}),
            make_effect("direction_asymmetry", {{"coulomb_Nm", 0.006}, {"viscous_Nm_s_per_rad", 0.002}})}));
  // At 3 rad/s: 0.05 + 0.01·3 + 0.001·9 = 0.089; the asymmetry ±(0.006 + 0.002·3) = ±0.012.
  EXPECT_NEAR(help_Nm(resistance, +3, 0, kCommand_Nm), 0.101, 1e-4);
  EXPECT_NEAR(help_Nm(resistance, -3, 0, kCommand_Nm), -0.077, 1e-4);
  // At rest, where the command points: 0.05 ± 0.006.
  EXPECT_NEAR(help_Nm(resistance, 0, 0, +kCommand_Nm), 0.056, 1e-12);
  EXPECT_NEAR(help_Nm(resistance, 0, 0, -kCommand_Nm), -0.044, 1e-12);
}

TEST(Resistance, AnEffectOfTheProgramsOwnIsCompensated) {
  add_custom_effect({.name = "cable",
                     .shows = "a torque in proportion to the position",
                     .amplitude = {"stiffness_Nm_per_rad", 0, 10, 0.01},
                     .shape = {{"rest_position_rad", -10, 10, 0}},
                     .load = [](double position, double rest) noexcept { return position - rest; }});
  const JointResistance resistance = resistance_of(
      with({make_effect("cable", {{"stiffness_Nm_per_rad", 0.02}, {"rest_position_rad", 0.5}})}));
  EXPECT_NEAR(resistance.position.at_Nm(2), 0.02 * 1.5, 1e-12);
  EXPECT_NEAR(help_Nm(resistance, +3, 2, kCommand_Nm), 0.05 + 0.03 + 0.03, 1e-4);
}

TEST(Resistance, BreakAwayIsStribecksStaticTorqueAndTheDipLowersItsBand) {
  const JointResistance stribeck = resistance_of(
      with({make_effect("stribeck", {{"static_torque_Nm", 0.08}, {"velocity_rad_per_s", 0.4}})}));
  EXPECT_NEAR(help_Nm(stribeck, 0, 0, kCommand_Nm), 0.08, 1e-12);
  // At vs: 0.05 + 0.03/e + 0.01·0.4; straight lines every 0.02 rad/s miss by less than 1e-4.
  EXPECT_NEAR(help_Nm(stribeck, 0.4, 0, kCommand_Nm), 0.054 + 0.03 / std::numbers::e, 1e-4);

  const JointResistance dip = resistance_of(with({make_effect(
      "midspeed_dip", {{"depth_Nm", 0.02}, {"centre_rad_per_s", 2}, {"width_rad_per_s", 0.5}})}));
  EXPECT_NEAR(help_Nm(dip, 2, 0, kCommand_Nm), 0.05 + 0.02 - 0.02, 1e-4);
  EXPECT_NEAR(help_Nm(dip, -2.5, 0, kCommand_Nm), -(0.05 + 0.025 - 0.02 / std::numbers::e), 1e-4);
}

TEST(Dissipation, EndsWhereTheEffectsTogetherWouldDrive) {
  EXPECT_EQ(model::effects::driving_velocity_rad_per_s(with({}), 100), std::nullopt);
  // 0.05 + 0.01·v − 0.003·v² is zero at (0.01 + √0.0007)/0.006 rad/s.
  const DriveModel bent = with({make_effect("quadratic_drag", {{"coefficient_Nm_s2_per_rad2", -0.003}})});
  EXPECT_NEAR(model::effects::driving_velocity_rad_per_s(bent, 12).value_or(0), 6.076, 0.01);
  EXPECT_EQ(model::effects::driving_velocity_rad_per_s(bent, 6.07), std::nullopt);
  // Backwards only: 0.05 − 0.02 + (0.01 − 0.015)·|v|.
  const DriveModel uneven =
      with({make_effect("direction_asymmetry", {{"coulomb_Nm", 0.02}, {"viscous_Nm_s_per_rad", 0.015}})});
  EXPECT_NEAR(model::effects::driving_velocity_rad_per_s(uneven, 12).value_or(0), -6, 0.01);
  // Warm: 0.05 − 0.08. An offset is a load and no friction.
  const DriveModel drifting =
      with({make_effect("thermal_drift", {{"coulomb_change_Nm", -0.08}, {"time_constant_s", 30}})});
  EXPECT_NEAR(model::effects::driving_velocity_rad_per_s(drifting, 12).value_or(0), 0, 0.01);
  EXPECT_EQ(model::effects::driving_velocity_rad_per_s(
                with({make_effect("torque_offset", {{"torque_Nm", 0.2}})}), 12),
            std::nullopt);
}

TEST(Resistance, TorqueByPositionIsCarriedAtRestAndInMotionWhateverTheDirection) {
  const JointResistance resistance = resistance_of(
      with({make_effect("torque_offset", {{"torque_Nm", 0.01}}),
            make_effect("imbalance", {{"torque_Nm", 0.02}, {"rest_position_rad", 0.5}}),
            make_effect("cogging", {{"amplitude_Nm", 0.004}, {"periods_per_rev", 12}, {"phase_rad", 0.3}})}));
  const double position_rad = 0.9;
  const double torque_Nm = 0.01 + 0.02 * std::sin(0.9 - 0.5) + 0.004 * std::sin(12 * 0.9 + 0.3);
  EXPECT_NEAR(help_Nm(resistance, +2, position_rad, kCommand_Nm), +0.07 + torque_Nm, 1e-4);
  EXPECT_NEAR(help_Nm(resistance, -2, position_rad, kCommand_Nm), -0.07 + torque_Nm, 1e-4);
  EXPECT_NEAR(help_Nm(resistance, 0, position_rad, +kCommand_Nm), +0.05 + torque_Nm, 1e-12);
  EXPECT_NEAR(help_Nm(resistance, 0, position_rad, -kCommand_Nm), -0.05 + torque_Nm, 1e-12);
  EXPECT_EQ(help_Nm(resistance, 2, position_rad, 0), 0.0);  // nothing without a command
  EXPECT_NEAR(help_Nm(resistance, 0, position_rad, 0.5 * kFull_Nm), 0.5 * (0.05 + torque_Nm), 1e-12);
}

TEST(Resistance, ASpringIsNotCarried) {
  const JointResistance resistance = resistance_of(with({make_effect("spring")}));
  for (const double velocity_rad_per_s : {-2.0, 0.0, 2.0})
    EXPECT_EQ(help_Nm(resistance, velocity_rad_per_s, 0.9, kCommand_Nm),
              help_Nm(resistance_of(with({})), velocity_rad_per_s, 0.9, kCommand_Nm));
}

TEST(Resistance, OfADriftItTakesTheLowerEnd) {
  for (const double change_Nm : {-0.02, 0.02}) {
    const JointResistance resistance = resistance_of(
        with({make_effect("thermal_drift", {{"coulomb_change_Nm", change_Nm}, {"time_constant_s", 30}})}));
    EXPECT_NEAR(help_Nm(resistance, 0, 0, kCommand_Nm), change_Nm < 0 ? 0.03 : 0.05, 1e-12);
  }
}

TEST(Resistance, FrictionIsNeverNegativeAndWhatACompensatorCannotActOnChangesNothing) {
  const JointResistance deep = resistance_of(with(
      {make_effect("midspeed_dip", {{"depth_Nm", 0.5}, {"centre_rad_per_s", 2}, {"width_rad_per_s", 0.5}})}));
  EXPECT_NEAR(help_Nm(deep, 2, 0, kCommand_Nm), 0, 1e-12);

  const JointResistance plain = resistance_of(with({}));
  const JointResistance same = resistance_of(
      with({make_effect("presliding"), make_effect("backlash"), make_effect("elasticity"),
            make_effect("inertia"), make_effect("load_friction"), make_effect("transport_delay"),
            make_effect("unsigned_current"), make_effect("torque_sensor_offset")}));
  for (const double velocity : {-3.0, 0.0, 0.1, 3.0})
    EXPECT_EQ(help_Nm(same, velocity, 1, kCommand_Nm), help_Nm(plain, velocity, 1, kCommand_Nm));
  EXPECT_EQ(plain.least_torque_Nm, 0.0);
}

TEST(Resistance, AGainOfTheActuatorIsRefused) {
  EXPECT_THROW(resistance_of(with({make_effect("actuator_gain", {{"gain", 1.1}})})), std::invalid_argument);
}

TEST(Resistance, AnOffsetOfTheActuatorIsTakenOffTheCommand) {
  const JointResistance offset = resistance_of(with({make_effect("actuator_offset", {{"torque_Nm", 0.01}})}));
  const JointResistance plain = resistance_of(with({}));
  EXPECT_NEAR(help_Nm(offset, 2, 0, kCommand_Nm), help_Nm(plain, 2, 0, kCommand_Nm) - 0.01, 1e-12);
}

/// At rest and at its reference but for so much along x, with these wheels.
control::BaseController controller(const DriveModel& model, double margin = 1) {
  control::BaseController::Config config;
  const JointResistance wheel = resistance_of(model);
  config.wheels = {wheel, wheel, wheel, wheel};
  config.compensator = {.margin = margin, .full_command_Nm = kFull_Nm};
  control::BaseController result(config);
  result.reset(control::WheelVector::Zero());
  return result;
}
control::BaseReference ahead(double x_m) {
  control::BaseReference reference;
  reference.X_WB = {x_m, 0, 0};
  return reference;
}

TEST(Resistance, TheBaseControllerTakesItInPlaceOfTheMeasuredCurves) {
  // 150 N/m · 0.02 m = 3 N on four wheels of 0.0475 m: 0.035625 N·m each, left wheels backward.
  control::BaseController base = controller(with({make_effect("torque_offset", {{"torque_Nm", 0.01}})}), 0.8);
  const control::WheelVector torque_Nm = base.step(control::WheelVector::Zero(), ahead(0.02)).torque_Nm;
  const double push_Nm = 150 * 0.02 * 0.0475 / 4;
  EXPECT_NEAR(torque_Nm[1], push_Nm + 0.8 * (0.05 + 0.01), 1e-12);
  EXPECT_NEAR(torque_Nm[0], -push_Nm + 0.8 * (-0.05 + 0.01), 1e-12);
}

TEST(Resistance, TorquesBelowTheDeadBandBecomePulsesWithTheirMean) {
  DriveModel model;
  model.effects = {make_effect("coulomb", {{"torque_Nm", 0.0}}),
                   make_effect("torque_deadband", {{"threshold_Nm", 0.03}})};
  control::BaseController base = controller(model);
  double sum_Nm = 0;
  constexpr int kSteps = 1000;
  for (int i = 0; i < kSteps; ++i) {
    const double torque_Nm = base.step(control::WheelVector::Zero(), ahead(0.005)).torque_Nm[1];
    EXPECT_TRUE(torque_Nm == 0 || torque_Nm == 0.03) << torque_Nm;
    sum_Nm += torque_Nm;
  }
  EXPECT_NEAR(sum_Nm / kSteps, 150 * 0.005 * 0.0475 / 4, 0.03 / kSteps);
}

TEST(Resistance, TheControllersCycleDoesNotAllocateOrLock) {
  control::BaseController base = controller(with({make_effect("imbalance"), make_effect("cogging"),
                                                  make_effect("torque_deadband"), make_effect("stribeck")}));
  const support::NoAllocGuard guard;
  for (int i = 0; i < 100; ++i) {
    (void)base.step(control::WheelVector::Constant(0.001 * i), ahead(0.01));
    (void)base.brake(control::WheelVector::Constant(0.001 * i));
  }
  EXPECT_EQ(guard.violations(), 0);
}

}  // namespace resistance_test
}  // namespace model::effects
