// Drives that their own servo moves: the law, and the position that drive and servo reach together.
#include "identification/gap/closed_loop.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "model/effects/any_effect.h"

namespace closed_loop_test {

using identification::gap::ServoRun;
using identification::gap::Source;
using model::Servo;
using model::ServoLaw;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr ServoLaw kVoltage{.output = ServoLaw::Output::kVoltage,
                            .position_gain = 4,
                            .limit = 7,
                            .torque_constant_Nm_per_A = 0.4,
                            .resistance_ohm = 2};
constexpr ServoLaw kTorque{
    .output = ServoLaw::Output::kTorque, .position_gain = 2, .velocity_gain = 0.2, .limit = 1};

TEST(ServoLawTest, AVoltageDrivesAgainstTheBackEmf) {
  Servo servo(kVoltage);
  // 4 V per rad, less 0.4 V per rad/s, over 2 ohm, times 0.4 N·m per A.
  EXPECT_NEAR(servo.torque_Nm({1, kNone}, 0.5, 2, 1e-3), 0.4 * (2 - 0.8) / 2, 1e-12);
  EXPECT_NEAR(servo.torque_Nm({9, kNone}, 0, 0, 1e-3), 0.4 * 7 / 2, 1e-12) << "limited to 7 V";
}

TEST(ServoLawTest, AVelocitySetPointIsFollowedWithAnIntegralThatStopsAtTheLimit) {
  Servo servo({.output = ServoLaw::Output::kTorque, .velocity_gain = 0.5, .integral_gain = 10, .limit = 1});
  EXPECT_NEAR(servo.torque_Nm({kNone, 1}, 0, 0, 1e-3), 0.5 + 10 * 1e-3, 1e-12);
  for (int i = 0; i < 10'000; ++i) (void)servo.torque_Nm({kNone, 1}, 0, 0, 1e-3);
  EXPECT_LE(servo.torque_Nm({kNone, 1}, 0, 0, 1e-3), 1);
  EXPECT_LT(servo.torque_Nm({kNone, 0}, 0, 0.2, 1e-3), 1) << "it has not wound up";
}

/// A spring of 2 N·m/rad and a damper of 0.2 N·m·s/rad on 0.02 kg m²: damping ratio 0.5 at 10 rad/s.
TEST(ClosedLoop, DriveAndServoAnswerAStepAsTheirSpringAndDamperDo) {
  ServoRun run{.name = "step", .law = kTorque};
  for (int i = 0; i < 200; ++i) {
    run.time_s.push_back(0.005 * i);
    run.goal_rad.push_back(0.1);
    run.goal_rad_per_s.push_back(kNone);
    run.position_rad.push_back(0);
    run.velocity_rad_per_s.push_back(0);
    run.enabled.push_back(1);
  }
  const model::effects::DriveModel model{.inertia_kg_m2 = 0.02};
  const std::vector<double> position = closed_loop_position_rad(model, run);
  const double damped = 10 * std::sqrt(0.75);
  for (std::size_t i = 0; i < position.size(); ++i) {
    const double t = run.time_s[i];
    const double truth =
        0.1 * (1 - std::exp(-5 * t) * (std::cos(damped * t) + 5 / damped * std::sin(damped * t)));
    EXPECT_NEAR(position[i], truth, 1e-3) << t;
  }
}

TEST(ClosedLoop, AServoThatIsOffLetsAWeightSwing) {
  ServoRun run{.name = "drop", .law = kVoltage};
  for (int i = 0; i < 600; ++i) {
    run.time_s.push_back(0.005 * i);
    run.goal_rad.push_back(1);
    run.goal_rad_per_s.push_back(kNone);
    run.position_rad.push_back(i == 0 ? 0.1 : 0);
    run.velocity_rad_per_s.push_back(0);
    run.enabled.push_back(0);
  }
  const model::effects::DriveModel model{
      .inertia_kg_m2 = 0.01, .effects = {model::effects::make_effect("imbalance", {{"torque_Nm", 0.36}})}};
  const std::vector<double> position = closed_loop_position_rad(model, run);
  // A small swing of 6 rad/s: it is back after 2π/6 s.
  const auto back = static_cast<std::size_t>(std::lround(2 * std::numbers::pi / 6 / 0.005));
  EXPECT_NEAR(position[back], 0.1, 2e-3);
  EXPECT_NEAR(position[back / 2], -0.1, 2e-3);
}

Source source(std::vector<std::pair<std::string, std::string>> comments = {}) {
  Source result{.name = "run.csv", .recording = {}};
  result.recording.comments = std::move(comments);
  result.recording.columns = {
      {"time_s", {0, 0.01, 0.02}}, {"position_rad", {0, 0, 0}}, {"position_command_rad", {0.5, 0.5, 0.5}}};
  return result;
}

TEST(ClosedLoop, ARecordingWithoutATorqueGetsThatOfItsServo) {
  std::vector<Source> sources{source(), source({{"servo.position_gain", "8"}})};
  EXPECT_EQ(add_servo_torques(sources, kVoltage), 2U);
  EXPECT_NEAR(sources[0].recording.column("torque_measured_Nm")[1], 0.4 * 4 * 0.5 / 2, 1e-12);
  EXPECT_NEAR(sources[1].recording.column("torque_measured_Nm")[1], 0.4 * 8 * 0.5 / 2, 1e-12)
      << "with its own gain";
  EXPECT_EQ(add_servo_torques(sources, kVoltage), 0U) << "a torque that is there stays";
}

TEST(ClosedLoop, AnUnknownOrWrongServoCommentIsRefused) {
  EXPECT_THROW(law_of(source({{"servo.gain", "8"}}), kVoltage), std::invalid_argument);
  EXPECT_THROW(law_of(source({{"servo.position_gain", "8 V"}}), kVoltage), std::invalid_argument);
  EXPECT_THROW(law_of(source({{"servo.limit", "-1"}}), kVoltage), std::invalid_argument);
  std::vector<Source> without{source()};
  without[0].recording.columns.pop_back();
  EXPECT_THROW(add_servo_torques(without, kVoltage), std::invalid_argument);
}

}  // namespace closed_loop_test
