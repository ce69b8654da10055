// The motor against its data sheet and the closed forms of its circuit.
#include "sim/motor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace motor_test {

using sim::Motor;
using sim::MotorParameters;

// maxon EC 45 flat 50 W, 251601, data sheet: R 0.978 Ω, L 0.573 mH, k_t 33.5 mN·m/A, J 135 g·cm²,
// 285 rpm/V at 24 V.
constexpr double kR_ohm = 0.978;
constexpr double kL_H = 0.573e-3;
constexpr double kKt = 0.0335;
constexpr double kSupply_V = 24;

/// The current controller asks for more than the supply can give, at once and always.
MotorParameters full_voltage() {
  MotorParameters parameters;
  parameters.current_limit_A = 1e6;
  return parameters;
}

TEST(Motor, ParametersAreTheDataSheets) {
  const MotorParameters parameters;
  EXPECT_EQ(parameters.resistance_ohm, kR_ohm);
  EXPECT_EQ(parameters.inductance_H, kL_H);
  EXPECT_EQ(parameters.torque_constant_Nm_per_A, kKt);
  EXPECT_EQ(parameters.rotor_inertia_kg_m2, 135e-7);  // 135 g·cm²
  EXPECT_EQ(parameters.supply_V, kSupply_V);
}

TEST(Motor, StallCurrentIsSupplyOverResistance) {
  Motor motor(full_voltage());
  double torque_Nm = 0;
  for (int i = 0; i < 20000; ++i) torque_Nm = motor.step(1e6, 0.0, 1e-6);  // 34 time constants
  EXPECT_NEAR(motor.current_A(), kSupply_V / kR_ohm, 1e-9);
  EXPECT_NEAR(torque_Nm, kKt * kSupply_V / kR_ohm, 1e-9);
  for (int i = 0; i < 20000; ++i) motor.step(-1e6, 0.0, 1e-6);
  EXPECT_NEAR(motor.current_A(), -kSupply_V / kR_ohm, 1e-9);
}

TEST(Motor, AtFullVoltageTheCurrentRisesWithTheTimeConstantOfTheWinding) {
  Motor motor(full_voltage());
  constexpr double kStep_s = 1e-7;
  for (int i = 1; i <= 20000; ++i) {
    motor.step(1e6, 0.0, kStep_s);
    const double expected_A = kSupply_V / kR_ohm * (1 - std::exp(-kStep_s * i * kR_ohm / kL_H));
    // Implicit Euler: half a step per time constant of 5.9e-4 s at most, of 24.5 A.
    ASSERT_NEAR(motor.current_A(), expected_A, 24.6 * kStep_s / 2 / 5.8e-4) << i;
  }
}

TEST(Motor, NoLoadSpeedIsTheDataSheets285RpmPerVolt) {
  Motor motor(full_voltage());
  double speed_rad_per_s = 0;
  for (int i = 0; i < 1000000; ++i)  // 10 s; mechanical time constant R·J/k² = 12 ms
    speed_rad_per_s += 1e-5 / 135e-7 * motor.step(1e6, speed_rad_per_s, 1e-5);
  const double rpm_per_V = speed_rad_per_s * 60 / (2 * std::numbers::pi) / kSupply_V;
  EXPECT_NEAR(rpm_per_V, 285, 0.01 * 285);
  EXPECT_NEAR(motor.current_A(), 0.0, 1e-6);
}

TEST(Motor, TheCurrentLoopIsFirstOrderWithItsBandwidth) {
  // 1 A needs L·ω_b·1 A = 1.1 V at first: far from the supply's limit.
  for (const double bandwidth : {500.0, 2000.0}) {
    MotorParameters parameters;
    parameters.current_bandwidth_rad_per_s = bandwidth;
    Motor motor(parameters);
    constexpr double kStep_s = 1e-7;
    for (int i = 1; i <= 50000; ++i) {
      motor.step(1.0, 0.0, kStep_s);
      ASSERT_NEAR(motor.current_A(), 1 - std::exp(-bandwidth * kStep_s * i), bandwidth * kStep_s) << i;
    }
  }
}

TEST(Motor, TheCurrentReachesItsTargetAtAnySpeedTheSupplyAllows) {
  for (const double speed_rad_per_s : {-600.0, -100.0, 0.0, 250.0, 600.0}) {
    Motor motor(MotorParameters{});
    double torque_Nm = 0;
    for (int i = 0; i < 2000; ++i) torque_Nm = motor.step(1.5, speed_rad_per_s, 1e-5);
    EXPECT_NEAR(motor.current_A(), 1.5, 1e-9) << speed_rad_per_s;
    EXPECT_NEAR(torque_Nm, 1.5 * kKt, 1e-9);
    EXPECT_NEAR(motor.voltage_V(), kR_ohm * 1.5 + kKt * speed_rad_per_s, 1e-6);
  }
}

TEST(Motor, NearItsTopSpeedTheSupplyLimitsTheCurrent) {
  const double speed_rad_per_s = 700;  // back-EMF 23.45 V: 0.55 V are left
  Motor motor(MotorParameters{});
  for (int i = 0; i < 10000; ++i) motor.step(2.85, speed_rad_per_s, 1e-5);
  EXPECT_EQ(motor.voltage_V(), kSupply_V);
  EXPECT_NEAR(motor.current_A(), (kSupply_V - kKt * speed_rad_per_s) / kR_ohm, 1e-6);
}

TEST(Motor, TargetsAreHeldWithinTheCurrentLimit) {
  Motor motor(MotorParameters{});
  for (int i = 0; i < 10000; ++i) {
    motor.step(100.0, 0.0, 1e-5);
    ASSERT_LE(motor.current_A(),
              2.85 * (1 + 1e-4));  // first order: no overshoot but the step's (ω_b·h = 0.02)²
  }
  EXPECT_NEAR(motor.current_A(), 2.85, 1e-9);
  for (int i = 0; i < 10000; ++i) motor.step(-100.0, 0.0, 1e-5);
  EXPECT_NEAR(motor.current_A(), -2.85, 1e-9);
}

TEST(Motor, TheIntegratorDoesNotWindUpWhileTheVoltageIsLimited) {
  // Ten seconds at a current the supply cannot drive: wound up, the controller would need seconds to leave
  // the limit again. The loop's 0.5 ms and the winding's 0.6 ms are all it may take: 8 ms are a dozen.
  Motor motor(MotorParameters{});
  for (int i = 0; i < 1000000; ++i) motor.step(2.85, 700.0, 1e-5);
  ASSERT_EQ(motor.voltage_V(), kSupply_V);
  double lowest_A = 0;
  for (int i = 0; i < 800; ++i) {
    motor.step(0.0, 700.0, 1e-5);
    lowest_A = std::min(lowest_A, motor.current_A());
  }
  EXPECT_NEAR(motor.current_A(), 0.0, 1e-3);
  // What the integrator may lack is the proportional part that stopped it, at most L·ω_b·2.3 A = 2.6 V; it
  // drives the winding for about its time constant: 2.6 V/R · e⁻¹.
  EXPECT_GT(lowest_A, -1.0);
}

TEST(Motor, PowerOffOpensTheBridgeAndForgetsTheController) {
  Motor motor(MotorParameters{});
  for (int i = 0; i < 1000; ++i) motor.step(2.0, 100.0, 1e-5);
  motor.power_off();
  EXPECT_EQ(motor.current_A(), 0.0);
  EXPECT_EQ(motor.voltage_V(), 0.0);
  Motor fresh(MotorParameters{});
  for (int i = 0; i < 100; ++i) EXPECT_EQ(motor.step(1.0, 0.0, 1e-5), fresh.step(1.0, 0.0, 1e-5));
}

TEST(Motor, TorqueFollowsTheSignOfTheCurrent) {
  Motor forward(MotorParameters{}), backward(MotorParameters{});
  for (int i = 0; i < 100; ++i) EXPECT_EQ(forward.step(1.0, 50.0, 1e-5), -backward.step(-1.0, -50.0, 1e-5));
  EXPECT_GT(forward.current_A(), 0);
}

}  // namespace motor_test
