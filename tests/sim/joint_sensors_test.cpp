// Reports of a motor controller: counts, differences of counts, noise.
#include "sim/joint_sensors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

namespace joint_sensors_test {

using sim::JointSensors;
using sim::SensorParameters;

constexpr SensorParameters kNoiseless{.velocity_noise_rad_per_s = 0, .torque_noise_Nm = 0};
constexpr SensorParameters kIdeal{0, 0, 0, 0, 0};

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}
double deviation(const std::vector<double>& values) {
  const double centre = mean(values);
  double sum = 0;
  for (const double value : values) sum += (value - centre) * (value - centre);
  return std::sqrt(sum / static_cast<double>(values.size()));
}
void expect_multiple(double value, double of) {
  EXPECT_NEAR(value / of, std::round(value / of), 1e-6) << value << " of " << of;
}

TEST(JointSensors, ResolutionsAreOneTickOneRpmAndOneMilliampereOfAWheel) {
  const double gear = 9405.0 / 364.0;
  const double turn_rad = 2 * std::numbers::pi;
  const SensorParameters parameters;
  // Five digits are given.
  EXPECT_NEAR(parameters.position_resolution_rad, turn_rad / (4000 * gear), 1e-9);
  EXPECT_NEAR(parameters.velocity_resolution_rad_per_s, turn_rad / (60 * gear), 1e-7);
  EXPECT_NEAR(parameters.torque_resolution_Nm, 1e-3 * 0.0335 * gear, 1e-7);
}

TEST(JointSensors, IdealOnesShowTheTruth) {
  JointSensors sensors(kIdeal, 1);
  sensors.update(0.123456789, 0.0314159, 1e-3);
  sensors.update(0.123456789 + 0.0005, -0.0314159, 1e-3);
  EXPECT_EQ(sensors.position_rad(), 0.123456789 + 0.0005);
  EXPECT_EQ(sensors.torque_Nm(), -0.0314159);
  EXPECT_NEAR(sensors.velocity_rad_per_s(), 0.5, 1e-12);
}

TEST(JointSensors, PositionIsCountedInTicksToTheNearest) {
  JointSensors sensors(kNoiseless, 1);
  const double tick_rad = kNoiseless.position_resolution_rad;
  for (const auto& [position_ticks, count] :
       {std::pair{0.0, 0.0}, {0.49, 0.0}, {0.51, 1.0}, {-0.51, -1.0}, {-1.4, -1.0}, {16448.6, 16449.0}}) {
    sensors.update(position_ticks * tick_rad, 0, 1e-3);
    EXPECT_NEAR(sensors.position_rad(), count * tick_rad, 1e-12) << position_ticks;
  }
}

TEST(JointSensors, VelocityIsMadeOfWholeTickDifferences) {
  // 0.04 rad/s is two thirds of a tick per millisecond: readings of none or one tick, right in the mean.
  JointSensors sensors(kNoiseless, 1);
  const double tick_rad = kNoiseless.position_resolution_rad;
  std::vector<double> readings;
  for (int i = 1; i <= 10000; ++i) {
    sensors.update(0.04 * 1e-3 * i, 0, 1e-3);
    readings.push_back(sensors.velocity_rad_per_s());
    // 61 mrad/s per tick, then rounded to motor rpm of 4 mrad/s each: 15 of them.
    const double ticks = sensors.velocity_rad_per_s() * 1e-3 / tick_rad;
    ASSERT_NEAR(ticks, std::round(ticks), 0.5 * 4.06e-3 * 1e-3 / tick_rad);
    ASSERT_LE(ticks, 1.04);
    expect_multiple(sensors.velocity_rad_per_s(), kNoiseless.velocity_resolution_rad_per_s);
  }
  EXPECT_NEAR(mean(readings), 0.04,
              0.5 * 4.06e-3);  // rounding to rpm is the same for every reading of a tick
}

TEST(JointSensors, TheIntervalCountsInTheVelocity) {
  JointSensors sensors(kIdeal, 1);
  sensors.update(0.0, 0, 1e-3);
  sensors.update(0.01, 0, 2e-3);
  EXPECT_NEAR(sensors.velocity_rad_per_s(), 5.0, 1e-12);
}

TEST(JointSensors, TorqueIsCountedInMilliamperes) {
  JointSensors sensors(kNoiseless, 1);
  for (const double torque_Nm : {0.0, 0.0301, -0.2, 1.7}) {
    sensors.update(0, torque_Nm, 1e-3);
    EXPECT_NEAR(sensors.torque_Nm(), torque_Nm, 0.5 * kNoiseless.torque_resolution_Nm * (1 + 1e-9));
    expect_multiple(sensors.torque_Nm(), kNoiseless.torque_resolution_Nm);
  }
}

TEST(JointSensors, NoiseIsWhiteAndAsStrongAsAsked) {
  SensorParameters parameters = kIdeal;
  parameters.velocity_noise_rad_per_s = 0.03;
  parameters.torque_noise_Nm = 0.0015;
  JointSensors sensors(parameters, 42);
  std::vector<double> velocity, torque, product;
  constexpr int kCount = 20000;
  for (int i = 0; i < kCount; ++i) {
    sensors.update(1.0, 0.1, 1e-3);
    if (i == 0) continue;  // the first difference counts from zero
    velocity.push_back(sensors.velocity_rad_per_s());
    torque.push_back(sensors.torque_Nm() - 0.1);
    if (velocity.size() > 1) product.push_back(velocity.back() * velocity[velocity.size() - 2]);
    EXPECT_EQ(sensors.position_rad(), 1.0) << "encoders do not hiss";
  }
  // Standard errors: σ/√(2n) = 0.5 % of a deviation, σ/√n = 0.7 % of σ for a mean; four of them.
  EXPECT_NEAR(deviation(velocity), 0.03, 0.02 * 0.03);
  EXPECT_NEAR(deviation(torque), 0.0015, 0.02 * 0.0015);
  EXPECT_NEAR(mean(velocity), 0, 0.03 * 0.03);
  EXPECT_NEAR(mean(torque), 0, 0.03 * 0.0015);
  EXPECT_NEAR(mean(product), 0, 0.03 * 0.03 * 0.03);  // neighbours are independent
}

TEST(JointSensors, EqualSeedsGiveEqualNoiseAndOthersDoNot) {
  JointSensors a(SensorParameters{}, 7), b(SensorParameters{}, 7), c(SensorParameters{}, 8);
  bool differs = false;
  for (int i = 0; i < 100; ++i) {
    a.update(0.01 * i, 0.1, 1e-3);
    b.update(0.01 * i, 0.1, 1e-3);
    c.update(0.01 * i, 0.1, 1e-3);
    ASSERT_EQ(a.velocity_rad_per_s(), b.velocity_rad_per_s());
    ASSERT_EQ(a.torque_Nm(), b.torque_Nm());
    differs = differs || a.torque_Nm() != c.torque_Nm() || a.velocity_rad_per_s() != c.velocity_rad_per_s();
  }
  EXPECT_TRUE(differs);
}

}  // namespace joint_sensors_test
