// A resistance of a base is found as it is, however slowly the base has to move until it acts in full.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "identification/robot_gap/base_subject.h"

namespace base_resistance_test {

using control::BaseDescription;
using identification::robot_gap::BaseRecording;
using identification::robot_gap::BaseSubject;
using identification::robot_gap::Part;

constexpr double kRadius_m = 0.05;
constexpr double kTrack_m = 0.4;
constexpr double kMass_kg = 10;
constexpr double kYawInertia_kg_m2 = 0.3;
constexpr double kResistance_Nm = 1;

double turn_rad_per_s(double t) { return 0.25 * std::sin(1.1 * t) + 0.125 * std::sin(2.7 * t); }

/// What both wheels need.
Eigen::Vector2d torque_Nm(double t, double rest_rad_per_s) {
  const double change_m_per_s2 = 0.14 * std::cos(0.7 * t) + 0.215 * std::cos(4.3 * t);
  const double turn_rad_per_s2 = 0.275 * std::cos(1.1 * t) + 0.3375 * std::cos(2.7 * t);
  const double moment_Nm =
      kYawInertia_kg_m2 * turn_rad_per_s2 + kResistance_Nm * std::tanh(turn_rad_per_s(t) / rest_rad_per_s);
  return kRadius_m * (Eigen::Vector2d::Constant(kMass_kg * change_m_per_s2 / 2) +
                      moment_Nm / kTrack_m * Eigen::Vector2d(-1, 1));
}

/// Two wheels forward at changing speed, never at rest; the base turns to and fro with up to 0.375 rad/s,
/// against a moment that is in proportion to its turning below a rest speed. Torques are late.
BaseRecording turning_to_and_fro(double rest_rad_per_s) {
  constexpr double kPeriod_s = 0.02;
  constexpr double kLag_s = 0.03;
  constexpr Eigen::Index kRows = 3000;
  BaseRecording recording;
  recording.name = "to and fro";
  recording.is_speed = {true, true};
  recording.wheel.resize(2, kRows);
  recording.torque_Nm.resize(2, kRows);
  control::PlanarPose pose;
  for (Eigen::Index i = 0; i < kRows; ++i) {
    const double t = kPeriod_s * static_cast<double>(i);
    const double noise = 0.001 * std::sin(static_cast<double>(7919 * i * i % 10007));
    const double speed_m_per_s = 0.8 + 0.2 * std::sin(0.7 * t) + 0.05 * std::sin(4.3 * t);
    const double turn = turn_rad_per_s(t);
    recording.time_s.push_back(t);
    recording.wheel.col(i) =
        Eigen::Vector2d(speed_m_per_s - turn * kTrack_m / 2, speed_m_per_s + turn * kTrack_m / 2) / kRadius_m;
    recording.torque_Nm.col(i) = torque_Nm(t - kLag_s, rest_rad_per_s) + Eigen::Vector2d(noise, -0.7 * noise);
    recording.pose.push_back({pose.x_m + noise, pose.y_m, pose.yaw_rad});
    pose.x_m += kPeriod_s * speed_m_per_s * std::cos(pose.yaw_rad);
    pose.y_m += kPeriod_s * speed_m_per_s * std::sin(pose.yaw_rad);
    pose.yaw_rad += kPeriod_s * turn;
  }
  return recording;
}

// 2 % of the top speed are 0.007 rad/s.
TEST(BaseResistance, WhatTheWheelsPushIsWhatItIsAtAnyRestSpeed) {
  BaseDescription base{.kinematics = control::BaseKinematics::kDifferential,
                       .wheels = {{"left", kRadius_m}, {"right", kRadius_m}},
                       .turning_length_m = kTrack_m};
  base.body.mass_kg = kMass_kg;
  base.body.yaw_inertia_kg_m2 = kYawInertia_kg_m2;
  for (const double rest_rad_per_s : {0.007, 0.02}) {
    const BaseRecording recording = turning_to_and_fro(rest_rad_per_s);
    const BaseSubject subject(base, {recording}, {recording});
    ASSERT_NE(subject.efforts(), nullptr);
    BaseDescription resisting = base;
    resisting.body.turning_resistance_Nm = kResistance_Nm;
    const Eigen::VectorXd left = subject.efforts()->excess(Part::kSearched, resisting).col(2);
    EXPECT_LT(std::sqrt(left.squaredNorm() / static_cast<double>(left.size())), 0.01 * kResistance_Nm)
        << rest_rad_per_s;
  }
}

}  // namespace base_resistance_test
