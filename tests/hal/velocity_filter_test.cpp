// Handle velocity: closed forms of a first-order low pass.
#include "hal/velocity_filter.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <numbers>

namespace velocity_filter_test {

using namespace std::chrono_literals;
using Eigen::Vector3d;
using hal::VelocityFilter;
using std::chrono::nanoseconds;

constexpr double kTau_s = 1.0 / (2.0 * std::numbers::pi * 40.0);

double seconds(nanoseconds time) { return std::chrono::duration<double>(time).count(); }

TEST(VelocityFilter, TheFirstPositionHasNoVelocity) {
  VelocityFilter filter;
  EXPECT_EQ(filter.update({1, 2, 3}, 5s), Vector3d::Zero());
  filter.update({2, 2, 3}, 5001ms);
  filter.reset();
  EXPECT_EQ(filter.update({-9, 2, 3}, 5002ms), Vector3d::Zero());
}

TEST(VelocityFilter, ASteadyVelocityComesOutWithTheTimeConstantOfTheCutoff) {
  VelocityFilter filter(40.0);
  for (nanoseconds t = 0ms; t <= 100ms; t += 1ms) {
    const double v = filter.update({0.2 * seconds(t), -0.1 * seconds(t), 0}, t).x();
    EXPECT_NEAR(v, 0.2 * (1.0 - std::exp(-seconds(t) / kTau_s)), 1e-12) << t.count();
  }
  EXPECT_NEAR(filter.update({0.2 * 0.2, -0.1 * 0.2, 0}, 200ms).y(), -0.1, 1e-9);
}

TEST(VelocityFilter, UnevenTimesGiveTheSameVelocity) {
  VelocityFilter filter(40.0);
  nanoseconds t = 0ms;
  for (int i = 0; i < 200; ++i) {
    t += i % 3 == 0 ? 300us : 1700us;
    filter.update({0.3 * seconds(t), 0, 0}, t);
  }
  t += 1ms;
  EXPECT_NEAR(filter.update({0.3 * seconds(t), 0, 0}, t).x(), 0.3, 1e-9);
}

TEST(VelocityFilter, WhileItAcceleratesItLagsByTheTimeConstant) {
  VelocityFilter filter(40.0);
  double v = 0;
  for (nanoseconds t = 0ms; t <= 200ms; t += 1ms)
    v = filter.update({0.5 * 4.0 * seconds(t) * seconds(t), 0, 0}, t).x();
  // The filter's own is tau - dt/2 + dt^2/(12 tau), the difference's dt/2.
  const double lag_s = (4.0 * 0.2 - v) / 4.0;
  EXPECT_NEAR(lag_s, kTau_s, 0.03e-3);
}

TEST(VelocityFilter, AnEncoderStepShowsAsCountTimesCutoff) {
  VelocityFilter filter(40.0);
  filter.update(Vector3d::Zero(), 0ms);
  filter.update(Vector3d::Zero(), 1ms);
  const double v = filter.update({0.01e-3, 0, 0}, 2ms).x();
  EXPECT_NEAR(v, 0.01e-3 / kTau_s, 0.12 * 0.01e-3 / kTau_s);  // dt / 2 tau of it less
}

TEST(VelocityFilter, TimeThatDoesNotPassChangesNothing) {
  VelocityFilter filter;
  filter.update({0, 0, 0}, 10ms);
  const Vector3d v = filter.update({0.001, 0, 0}, 11ms);
  EXPECT_EQ(filter.update({5, 0, 0}, 11ms), v);
  EXPECT_EQ(filter.update({5, 0, 0}, 3ms), v);
  EXPECT_GT(filter.update({0.002, 0, 0}, 12ms).x(), v.x());
}

}  // namespace velocity_filter_test
