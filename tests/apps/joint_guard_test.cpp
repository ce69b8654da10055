// Conditions that stop a joint while an experiment moves it.
#include "apps/youbot_bench/joint_guard.h"

#include <gtest/gtest.h>

#include <optional>

#include "hal/youbot_axes.h"

namespace youbot_bench {
namespace joint_guard_test {

constexpr double kPeriod_s = 1e-3;
using Trip = JointGuard::Trip;
using identification::experiments::Reading;

JointGuard guard_of(std::size_t arm_joint) {
  return {hal::joint_info("arm-" + std::to_string(arm_joint + 1), hal::kArmAxes[arm_joint]), kPeriod_s};
}

/// When it trips at the latest, s; nothing when it does not within `longest_s`.
std::optional<double> trips(JointGuard guard, const Reading& reading, const hal::JointCommand& command,
                            Trip why, double longest_s = 10) {
  for (double time_s = 0; time_s < longest_s; time_s += kPeriod_s) {
    const Trip trip = guard.watch(reading, command);
    if (trip == Trip::kNone) continue;
    EXPECT_EQ(trip, why);
    return time_s;
  }
  return std::nullopt;
}

TEST(JointGuard, StopsInTimeBeforeTheEndThatItMovesTo) {
  // Joint 2 ends at 2.618 rad; from 0.5 rad/s it takes 0.125 rad to stop at 1 rad/s², and 0.015 before.
  const auto forward = hal::JointCommand::velocity_rad_per_s(0.5);
  Reading reading{.position_rad = 2.40, .velocity_rad_per_s = 0.5};
  EXPECT_EQ(guard_of(1).watch(reading, forward), Trip::kNone);
  reading.position_rad = 2.47;
  EXPECT_EQ(guard_of(1).watch(reading, forward), Trip::kNearStop);
  reading.velocity_rad_per_s = -0.5;
  EXPECT_EQ(guard_of(1).watch(reading, forward), Trip::kNone) << "it moves away";
  reading.position_rad = 0.15;
  EXPECT_EQ(guard_of(1).watch(reading, forward), Trip::kNearStop);
  reading.velocity_rad_per_s = 0.0;
  EXPECT_EQ(guard_of(1).watch(reading, forward), Trip::kNone) << "it rests there";
}

TEST(JointGuard, StopsWhatTakesMoreTorqueThanItIsMadeForButNotAPeak) {
  const auto turning = hal::JointCommand::velocity_rad_per_s(0.5);
  const Reading heavy{.position_rad = 1, .velocity_rad_per_s = 0.5, .torque_Nm = -10};
  const auto after_s = trips(guard_of(1), heavy, turning, Trip::kTorque);
  ASSERT_TRUE(after_s);
  EXPECT_LT(*after_s, 0.1);
  const Reading peak{.position_rad = 1, .velocity_rad_per_s = 0.5, .torque_Nm = 15.7};
  EXPECT_FALSE(trips(guard_of(1), peak, turning, Trip::kTorque, 0.008));
  const Reading allowed{.position_rad = 1, .velocity_rad_per_s = 0.5, .torque_Nm = 9.4};
  EXPECT_FALSE(trips(guard_of(1), allowed, turning, Trip::kTorque));
}

TEST(JointGuard, StopsWhatIsPushedAndDoesNotTurn) {
  const Reading stuck{.position_rad = 1, .torque_Nm = 6};
  for (const auto& push : {hal::JointCommand::velocity_rad_per_s(0.3), hal::JointCommand::torque_Nm(6)}) {
    const auto after_s = trips(guard_of(1), stuck, push, Trip::kBlocked);
    ASSERT_TRUE(after_s);
    EXPECT_LT(*after_s, 0.4);
  }
  // Little torque: it may still break away, as a torque ramp lets it. A velocity it has to follow.
  const Reading waiting{.position_rad = 1, .torque_Nm = 1};
  EXPECT_FALSE(trips(guard_of(1), waiting, hal::JointCommand::torque_Nm(1), Trip::kBlocked));
  const auto after_s =
      trips(guard_of(1), waiting, hal::JointCommand::velocity_rad_per_s(0.3), Trip::kBlocked);
  ASSERT_TRUE(after_s);
  EXPECT_NEAR(*after_s, 3, 0.01);
  EXPECT_FALSE(trips(guard_of(1), stuck, hal::JointCommand::velocity_rad_per_s(0), Trip::kBlocked))
      << "it holds a weight";
}

TEST(JointGuard, AWheelHasNoEndAndNoTorqueBelowItsMotorsLimit) {
  const JointGuard wheel(hal::joint_info("wheel-1", hal::kWheelAxis), kPeriod_s);
  const Reading fast{.position_rad = 1e6, .velocity_rad_per_s = 10, .torque_Nm = 2.4};
  EXPECT_FALSE(trips(wheel, fast, hal::JointCommand::velocity_rad_per_s(10), Trip::kNone));
  const Reading stuck{.position_rad = 0, .torque_Nm = 2.4};
  EXPECT_TRUE(trips(wheel, stuck, hal::JointCommand::velocity_rad_per_s(1), Trip::kBlocked));
}

}  // namespace joint_guard_test
}  // namespace youbot_bench
