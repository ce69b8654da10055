// Ticks, rpm and milliampere against the published constants of the youBot's axes (fact sheet, table 4.1).
#include "hal/axis_scale.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>

#include "hal/youbot_axes.h"

namespace axis_scale_test {

using hal::AxisConstants;
using hal::AxisScale;

constexpr std::int32_t kLowest = std::numeric_limits<std::int32_t>::min();
constexpr std::int32_t kHighest = std::numeric_limits<std::int32_t>::max();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

AxisScale wheel() { return AxisScale(hal::kWheelAxis.constants); }
AxisScale arm(std::size_t number) { return AxisScale(hal::kArmAxes.at(number - 1).constants); }

/// Text that the message of an exception about `constants` must contain.
void expect_refused(const AxisConstants& constants, const std::string& name) {
  try {
    const AxisScale scale(constants);
    FAIL() << "accepted a bad " << name;
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
  }
}

TEST(AxisScale, WheelCountsAndSpeedsAreThePublishedOnes) {
  // Tolerances: half of the last published digit.
  EXPECT_NEAR(1 / wheel().position_rad(1), 16448.9, 0.05);
  EXPECT_NEAR(1 / wheel().velocity_rad_per_s(1), 246.73, 0.005);
  EXPECT_EQ(wheel().motor_ticks(1.0), 16449);
  EXPECT_EQ(wheel().motor_rpm(10.0), 2467);
}

TEST(AxisScale, ArmCountsAndSpeedsAreThePublishedOnesAndInvertedAxesTurnTheSign) {
  struct Row {
    double ticks_per_rad, rpm_per_rad_per_s;
  };
  constexpr std::array<Row, 5> kPublished{{{-99312.7, -1489.69},
                                           {-99312.7, -1489.69},
                                           {63662.0, 954.93},
                                           {-45200.0, -678.00},
                                           {-45200.0, -678.00}}};
  for (std::size_t number = 1; number <= 5; ++number) {
    SCOPED_TRACE("arm " + std::to_string(number));
    // Tolerances: half of the last published digit.
    EXPECT_NEAR(1 / arm(number).position_rad(1), kPublished[number - 1].ticks_per_rad, 0.05);
    EXPECT_NEAR(1 / arm(number).velocity_rad_per_s(1), kPublished[number - 1].rpm_per_rad_per_s, 0.005);
  }
}

TEST(AxisScale, ArmLimitsInMotorTicksAreThePublishedJointAngles) {
  struct Limit {
    std::size_t arm;
    std::int32_t ticks;
    double angle_rad;
  };
  constexpr std::array<Limit, 10> kPublished{{{1, -580000, 5.84014},
                                              {1, -1000, 0.01007},
                                              {2, -260000, 2.61799},
                                              {2, -1000, 0.01007},
                                              {3, -320000, -5.02655},
                                              {3, -1000, -0.01571},
                                              {4, -155000, 3.42920},
                                              {4, -1000, 0.02212},
                                              {5, -255000, 5.64159},
                                              {5, -5000, 0.11062}}};
  for (const Limit& limit : kPublished) {
    SCOPED_TRACE("arm " + std::to_string(limit.arm) + " at " + std::to_string(limit.ticks));
    const AxisScale scale = arm(limit.arm);
    EXPECT_NEAR(scale.position_rad(limit.ticks), limit.angle_rad, 0.5e-5);  // half of the last digit
    // Half of the last digit again, now in ticks: up to 99312.7 ticks/rad.
    EXPECT_NEAR(scale.motor_ticks(limit.angle_rad), limit.ticks, 0.5e-5 * 99312.7 + 0.5);
  }
}

TEST(AxisScale, EveryArmMotorReachesItsHomeStopTurningPositiveWithOneJointTurnPerMinute) {
  // Homing goes towards the negative end of joints 1, 2, 4, 5 and the positive end of 3, at 1/g motor rpm.
  constexpr std::array<int, 5> kHomingDirection{-1, -1, 1, -1, -1};
  constexpr std::array<std::int32_t, 5> kMotorRpm{156, 156, 100, 71, 71};
  constexpr double kOneTurnPerMinute = 2 * std::numbers::pi / 60;
  for (std::size_t number = 1; number <= 5; ++number) {
    const std::size_t i = number - 1;
    EXPECT_EQ(arm(number).motor_rpm(kHomingDirection[i] * kOneTurnPerMinute), kMotorRpm[i]) << number;
  }
}

TEST(AxisScale, TopSpeedOfTheArmIsThePublishedMotorSpeed) {
  constexpr std::array<std::int32_t, 5> kMotorRpm{2340, 2340, 1500, 1065, 1065};  // at 90 degrees per second
  for (std::size_t number = 1; number <= 5; ++number)
    EXPECT_EQ(std::abs(arm(number).motor_rpm(std::numbers::pi / 2)), kMotorRpm[number - 1]) << number;
}

TEST(AxisScale, CurrentLimitsGiveThePublishedJointTorques) {
  constexpr std::array<double, 5> kTorque_Nm{-15.7, -15.7, 10.1, -10.9, -3.5};  // sign: inverted axes
  constexpr std::array<std::int32_t, 5> kCurrent_mA{3000, 3000, 3000, 3000, 1000};
  for (std::size_t number = 1; number <= 5; ++number) {
    // Tolerance: half of the last published digit.
    EXPECT_NEAR(arm(number).torque_Nm(kCurrent_mA[number - 1]), kTorque_Nm[number - 1], 0.051) << number;
    EXPECT_DOUBLE_EQ(hal::kArmAxes[number - 1].current_limit_A, kCurrent_mA[number - 1] * 1e-3) << number;
  }
  // 2850 mA, factory limit of the wheels: 2.85 A x 0.0335 N·m/A x 9405/364 by hand.
  EXPECT_NEAR(wheel().torque_Nm(2850), 2.466875, 0.5e-6);
  EXPECT_DOUBLE_EQ(hal::kWheelAxis.current_limit_A, 2.85);
}

TEST(AxisScale, OneMotorTurnIsOneGearRatiothOfAJointTurn) {
  const AxisScale scale({.gear_ratio = 100, .ticks_per_motor_rev = 4000, .torque_constant_Nm_per_A = 0.05});
  // 4 digits below the values compared: plain double arithmetic.
  EXPECT_NEAR(scale.position_rad(4000), 2 * std::numbers::pi / 100, 1e-15);
  EXPECT_NEAR(scale.velocity_rad_per_s(60), 2 * std::numbers::pi / 100, 1e-15);
  EXPECT_NEAR(scale.torque_Nm(1000), 5.0, 1e-12);
}

TEST(AxisScale, EveryCountSurvivesTheRoundTrip) {
  for (const AxisScale& scale : {wheel(), arm(1), arm(3), arm(5)}) {
    for (const std::int32_t count : {kLowest, kLowest + 1, -580000, -1000, -2, -1, 0, 1, 2, 3, 999, 2850,
                                     16449, 104000, 123456789, kHighest - 1, kHighest}) {
      EXPECT_EQ(scale.motor_ticks(scale.position_rad(count)), count);
      EXPECT_EQ(scale.motor_rpm(scale.velocity_rad_per_s(count)), count);
      EXPECT_EQ(scale.motor_current_mA(scale.torque_Nm(count)), count);
    }
  }
}

TEST(AxisScale, ARequestIsMetWithinHalfACount) {
  // Also for current, where truncation would take up to a whole milliampere from every torque.
  const double half = 0.5 * (1 + 1e-9);  // 1e-9: rounding of the products around exact halves
  for (const AxisScale& scale : {wheel(), arm(1), arm(3)}) {
    for (int i = -1000; i <= 1000; ++i) {
      const double value = 0.00317 * i;
      EXPECT_LE(std::abs(scale.position_rad(scale.motor_ticks(value)) - value),
                half * scale.position_resolution_rad());
      EXPECT_LE(std::abs(scale.velocity_rad_per_s(scale.motor_rpm(value)) - value),
                half * scale.velocity_resolution_rad_per_s());
      EXPECT_LE(std::abs(scale.torque_Nm(scale.motor_current_mA(value)) - value),
                half * scale.torque_resolution_Nm());
    }
  }
}

TEST(AxisScale, ResolutionIsTheSizeOfOneCountAndPositiveForInvertedAxes) {
  for (const AxisScale& scale : {wheel(), arm(1), arm(3)}) {
    EXPECT_DOUBLE_EQ(scale.position_resolution_rad(), std::abs(scale.position_rad(1)));
    EXPECT_DOUBLE_EQ(scale.velocity_resolution_rad_per_s(), std::abs(scale.velocity_rad_per_s(1)));
    EXPECT_DOUBLE_EQ(scale.torque_resolution_Nm(), std::abs(scale.torque_Nm(1)));
  }
  // Thesis table 5 sees wheel positions in steps of 1e-4 rad: one tick, of 2π/(4000·25.84), fits.
  EXPECT_NEAR(wheel().position_resolution_rad(), 6.08e-5, 0.005e-5);
}

TEST(AxisScale, SaturatesBeyondInt32) {
  for (const double huge : {1e12, 1e300, kInfinity}) {
    EXPECT_EQ(wheel().motor_ticks(huge), kHighest);
    EXPECT_EQ(wheel().motor_ticks(-huge), kLowest);
    EXPECT_EQ(wheel().motor_rpm(huge), kHighest);
    EXPECT_EQ(wheel().motor_rpm(-huge), kLowest);
    EXPECT_EQ(wheel().motor_current_mA(huge), kHighest);
    EXPECT_EQ(wheel().motor_current_mA(-huge), kLowest);
    EXPECT_EQ(arm(1).motor_ticks(huge), kLowest) << "inverted";
    EXPECT_EQ(arm(1).motor_ticks(-huge), kHighest) << "inverted";
  }
}

TEST(AxisScale, NotANumberBecomesZero) {
  for (const AxisScale& scale : {wheel(), arm(1)}) {
    EXPECT_EQ(scale.motor_ticks(kNaN), 0);
    EXPECT_EQ(scale.motor_rpm(kNaN), 0);
    EXPECT_EQ(scale.motor_current_mA(kNaN), 0);
  }
}

TEST(AxisScale, RefusesConstantsThatAreNotFiniteAndPositiveByName) {
  for (const double bad : {0.0, -1.0, kNaN, kInfinity}) {
    expect_refused({.gear_ratio = bad}, "gear_ratio");
    expect_refused({.torque_constant_Nm_per_A = bad}, "torque_constant_Nm_per_A");
  }
  for (const std::int32_t bad : {0, -4000})
    expect_refused({.ticks_per_motor_rev = bad}, "ticks_per_motor_rev");
}

}  // namespace axis_scale_test
