// The lag of torques is taken from the data only where they determine it.
#include "identification/robot_gap/torque_lag.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "identification/robot_gap/base_subject.h"
#include "identification/robot_gap/robot_gap.h"

namespace torque_lag_test {

using identification::robot_gap::BaseRecording;
using identification::robot_gap::BaseSubject;
using identification::robot_gap::LeftByLag;
using identification::robot_gap::RobotResult;
using identification::robot_gap::torque_lag;
using identification::robot_gap::TorqueLag;

constexpr double kLongest_s = 0.1;

/// Noise of 1 in each of ten stretches, and squares that grow with the distance from a lag. Some stretches
/// show more of it than others.
std::vector<double> squares_about(double lag_s, double at_s, double per_s2) {
  std::vector<double> squares;
  for (int k = 0; k < 10; ++k)
    squares.push_back(1 + per_s2 * (1 + 0.1 * k) * (at_s - lag_s) * (at_s - lag_s));
  return squares;
}

TEST(TorqueLag, ALagThatItsNeighboursDoNotExplainIsFoundBetweenTheSteps) {
  const TorqueLag lag = torque_lag(
      [](double at_s) {
        return LeftByLag{.by_all = squares_about(0.0237, at_s, 1e4), .by_given = squares_about(0, at_s, 1e4)};
      },
      kLongest_s);
  EXPECT_TRUE(lag.is_determined);
  EXPECT_NEAR(lag.lag_s, 0.0237, 1e-5);
  EXPECT_LE(lag.shortest_s, 0.0237);
  EXPECT_GE(lag.longest_s, 0.0237);
}

TEST(TorqueLag, WhereEveryLagFitsItIsTheOneThatTheGivenModelNeeds) {
  const auto needs = [](double lag_s) {
    return torque_lag(
        [lag_s](double at_s) {
          // Stretches disagree about the best lag.
          LeftByLag left{.by_all = squares_about(0.054, at_s, 0.01),
                         .by_given = squares_about(lag_s, at_s, 1e4)};
          for (std::size_t k = 0; k < left.by_all.size(); ++k) left.by_all[k] += (k % 2 == 0 ? 1 : -1) * at_s;
          return left;
        },
        kLongest_s);
  };
  const TorqueLag late = needs(0.01);
  EXPECT_FALSE(late.is_determined);
  EXPECT_NEAR(late.lag_s, 0.01, 1e-5);
  EXPECT_NEAR(late.shortest_s, -kLongest_s, 1e-12);
  EXPECT_NEAR(late.longest_s, kLongest_s, 1e-12);
  EXPECT_EQ(needs(0).lag_s, 0);
}

TEST(TorqueLag, ALagBeyondTheBoundIsNotDeterminedAndStaysWithin) {
  for (const double lag_s : {0.118, -0.3, 0.0999}) {
    const TorqueLag lag = torque_lag(
        [lag_s](double at_s) {
          return LeftByLag{.by_all = squares_about(lag_s, at_s, 1e4), .by_given = squares_about(0, at_s, 1)};
        },
        kLongest_s);
    EXPECT_FALSE(lag.is_determined);
    EXPECT_LE(std::abs(lag.lag_s), kLongest_s);
  }
}

/// Two wheels that speed up and slow down; torques are what 10 kg and friction need, `lag_s` late.
BaseRecording speeding(const std::string& name, double lag_s, const std::vector<double>& rates_rad_per_s,
                       Eigen::Index rows = 3000) {
  BaseRecording recording;
  recording.name = name;
  recording.is_speed = {true, true};
  recording.wheel.resize(2, rows);
  recording.torque_Nm.resize(2, rows);
  const auto speed = [&](double t) {
    double sum = 0;
    for (const double rate : rates_rad_per_s)
      sum += 10 * std::sin(rate * t) / static_cast<double>(rates_rad_per_s.size());
    return sum;
  };
  double x = 0;
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double t = 0.02 * static_cast<double>(i);
    recording.time_s.push_back(t);
    const double noise = 0.001 * std::sin(static_cast<double>(7919 * i * i % 10007));
    for (Eigen::Index w = 0; w < 2; ++w) {
      recording.wheel(w, i) = speed(t);
      const double then = t - lag_s;
      const double acceleration = (speed(then + 1e-4) - speed(then - 1e-4)) / 2e-4;
      recording.torque_Nm(w, i) = 0.5 * 10 * 0.05 * 0.05 * acceleration +
                                  0.02 * std::tanh(speed(then) / 0.01) + (w == 0 ? noise : -0.7 * noise);
    }
    recording.pose.push_back({x + noise, 0, 0});
    x += 0.02 * 0.05 * (speed(t) + speed(t + 0.02)) / 2;
  }
  return recording;
}

control::BaseDescription ten_kilograms() {
  control::BaseDescription base{.kinematics = control::BaseKinematics::kDifferential,
                                .wheels = {{"left", 0.05}, {"right", 0.05}},
                                .turning_length_m = 0.4};
  base.body.mass_kg = 10;
  base.body.yaw_inertia_kg_m2 = 0.3;
  for (control::BaseDescription::Wheel& wheel : base.wheels) wheel.coulomb_Nm = 0.02;
  return base;
}

TEST(TorqueLag, UnderOneSineNoFrictionIsNamedForTheLag) {
  const BaseSubject subject(ten_kilograms(), {speeding("one", 0.01, {1.3})}, {speeding("two", 0.01, {1.3})});
  ASSERT_NE(subject.efforts(), nullptr);
  EXPECT_NEAR(subject.efforts()->lag_s(), 0.01, 0.002);
  EXPECT_NE(subject.notes().back().find("is not determined"), std::string::npos) << subject.notes().back();
  const RobotResult result = identification::robot_gap::analyse(subject, {});
  EXPECT_TRUE(result.effects.empty()) << result.effects.front().name.effect;
}

TEST(TorqueLag, SeveralRatesDetermineIt) {
  const std::vector<double> rates{0.7, 1.9, 4.3};
  const BaseSubject subject(ten_kilograms(), {speeding("one", 0.035, rates)},
                            {speeding("two", 0.035, rates)});
  ASSERT_NE(subject.efforts(), nullptr);
  EXPECT_NEAR(subject.efforts()->lag_s(), 0.035, 5e-4);
  EXPECT_NE(subject.notes().back().find("torques are 0.035 s behind"), std::string::npos)
      << subject.notes().back();
}

TEST(TorqueLag, FewHeldOutWindowsAreReported) {
  const std::vector<double> rates{0.7, 1.9, 4.3};
  const BaseSubject subject(ten_kilograms(), {speeding("one", 0, rates)}, {speeding("two", 0, rates, 60)},
                            0.5);
  ASSERT_NE(subject.efforts(), nullptr);
  EXPECT_TRUE(subject.notes().back().starts_with("held-out recordings have only ")) << subject.notes().back();
}

TEST(BaseEfforts, TorquesThatAreNotComparedAreNotJudged) {
  const std::vector<double> rates{0.7, 1.9, 4.3};
  BaseRecording negated = speeding("negated", 0, rates);
  negated.torque_Nm *= -1;
  EXPECT_THROW(BaseSubject(ten_kilograms(), {negated}, {speeding("two", 0, rates)}), std::invalid_argument);
  BaseRecording one_wheel = speeding("one wheel", 0, rates);
  one_wheel.wheel.row(1).setZero();
  const BaseSubject subject(ten_kilograms(), {negated}, {one_wheel});
  EXPECT_EQ(subject.efforts(), nullptr);
  EXPECT_TRUE(subject.notes().back().starts_with("forces are not compared")) << subject.notes().back();
}

TEST(BaseEfforts, AResistanceToTurningIsNotDeterminedByStraightLines) {
  const std::vector<double> rates{0.7, 1.9, 4.3};
  const auto has_note = [](const BaseSubject& subject) {
    return std::ranges::any_of(subject.notes(), [](const std::string& note) {
      return note.find("the turning resistance is not determined") != std::string::npos;
    });
  };
  const BaseRecording straight = speeding("straight", 0, rates);
  EXPECT_TRUE(has_note(BaseSubject(ten_kilograms(), {straight}, {straight})));
  BaseRecording turning = straight;
  turning.wheel.row(1) *= 0.9;
  EXPECT_FALSE(has_note(BaseSubject(ten_kilograms(), {turning}, {turning})));
}

TEST(TorqueLag, TooFewWindowsForItAreReported) {
  const std::vector<double> rates{0.7, 1.9, 4.3};
  std::vector<BaseRecording> searched;
  for (int k = 0; k < 7; ++k) searched.push_back(speeding("short", 0, rates, 60));
  const BaseSubject subject(ten_kilograms(), searched, {speeding("two", 0, rates)}, 0.5);
  ASSERT_NE(subject.efforts(), nullptr);
  EXPECT_EQ(subject.efforts()->lag_s(), 0);
  EXPECT_TRUE(subject.notes().back().starts_with("too few windows lie 0.1 s inside"))
      << subject.notes().back();
}

}  // namespace torque_lag_test
