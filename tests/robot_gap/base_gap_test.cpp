// What is wrong with a base is named from its wheels and its measured pose. The bases are simulated here,
// with their own equations.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "identification/robot_gap/base_motion.h"
#include "identification/robot_gap/base_subject.h"
#include "identification/robot_gap/robot_gap.h"

namespace base_gap_test {

using control::BaseDescription;
using control::BaseKinematics;
using identification::robot_gap::analyse;
using identification::robot_gap::BaseMotion;
using identification::robot_gap::BaseRecording;
using identification::robot_gap::BaseSubject;
using identification::robot_gap::BaseTrack;
using identification::robot_gap::Candidate;
using identification::robot_gap::Catalogue;
using identification::robot_gap::cut;
using identification::robot_gap::Part;
using identification::robot_gap::RobotResult;
using identification::robot_gap::set_aside;
using identification::robot_gap::Verdict;

constexpr double kPi = std::numbers::pi;
constexpr double kPeriod_s = 0.02;
constexpr int kStepsOfPeriod = 20;

/// Two wheels; squares to both sides with smooth changes of speed.
struct SimulatedBase {
  double radius_m = 0.05;
  double track_m = 0.4;
  double ahead_m = 0;  ///< place of the tracked point
  double delay_s = 0;  ///< of the poses behind the wheels
  double encoder_rad = 0.005;
  double noise_m = 0.001;
  double noise_rad = 0.002;

  BaseRecording recording(const std::string& name, unsigned seed, double length_s = 240) const {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    BaseRecording result;
    result.name = name;
    result.is_speed = {false, false};
    const auto rows = static_cast<Eigen::Index>(length_s / kPeriod_s);
    result.wheel.resize(2, rows);
    double x = 0;
    double y = 0;
    double heading = 0;
    double left = 0;
    double right = 0;
    const auto late = static_cast<std::size_t>(delay_s / kPeriod_s);
    std::vector<control::PlanarPose> poses;
    for (Eigen::Index i = 0; i < rows; ++i) {
      const double t = static_cast<double>(i) * kPeriod_s;
      result.time_s.push_back(t);
      result.wheel(0, i) = std::floor(left / encoder_rad) * encoder_rad;
      result.wheel(1, i) = std::floor(right / encoder_rad) * encoder_rad;
      poses.push_back({x + ahead_m * std::cos(heading) + noise_m * normal(random),
                       y + ahead_m * std::sin(heading) + noise_m * normal(random),
                       std::remainder(heading + noise_rad * normal(random), 2 * kPi)});
      result.pose.push_back(poses[poses.size() > late ? poses.size() - 1 - late : 0]);
      for (int k = 0; k < kStepsOfPeriod; ++k) {
        const double now_s = t + kPeriod_s * k / kStepsOfPeriod;
        // 6 s straight, 2 s turning, to the left for four sides, then to the right.
        const double phase = std::fmod(now_s, 8.0);
        const double side = std::fmod(now_s, 64.0) < 32 ? 1 : -1;
        const double straight = phase < 6 ? std::sin(kPi * phase / 6) : 0;
        const double turning = phase >= 6 ? std::sin(kPi * (phase - 6) / 2) : 0;
        const double left_rad_per_s = 8 * straight - side * 5 * turning;
        const double right_rad_per_s = 8 * straight + side * 5 * turning;
        const double dt = kPeriod_s / kStepsOfPeriod;
        const double v = radius_m * (left_rad_per_s + right_rad_per_s) / 2;
        heading += dt * radius_m * (right_rad_per_s - left_rad_per_s) / track_m;
        x += dt * v * std::cos(heading);
        y += dt * v * std::sin(heading);
        left += dt * left_rad_per_s;
        right += dt * right_rad_per_s;
      }
    }
    return result;
  }
};

BaseDescription given() {
  return {.kinematics = BaseKinematics::kDifferential,
          .wheels = {{"left", 0.05}, {"right", 0.05}},
          .turning_length_m = 0.4};
}

RobotResult explained(const SimulatedBase& base) {
  const BaseSubject subject(given(), {base.recording("one", 1), base.recording("two", 2)},
                            {base.recording("three", 3)});
  return analyse(subject, {});
}

TEST(BaseGap, ABaseAsItIsDescribedHasNoGap) {
  const RobotResult result = explained({});
  EXPECT_EQ(result.verdict, Verdict::kNoGap) << result.reason;
  EXPECT_TRUE(result.effects.empty());
}

TEST(BaseGap, AWrongTrackIsTheTurningGeometry) {
  const RobotResult result = explained({.track_m = 0.412});
  ASSERT_EQ(result.effects.size(), 1U) << result.reason;
  EXPECT_EQ(result.effects[0].name.effect, "turning_geometry");
  EXPECT_EQ(result.effects[0].parameters[0].name, "track_m");
  EXPECT_NEAR(result.effects[0].parameters[0].value, 0.412, 0.001);
}

TEST(BaseGap, APointAheadOfTheCentreIsTheTrackingOffset) {
  const RobotResult result = explained({.ahead_m = 0.03});
  ASSERT_EQ(result.effects.size(), 1U) << result.reason;
  EXPECT_EQ(result.effects[0].name.effect, "tracking_offset");
  EXPECT_NEAR(result.effects[0].parameters[0].value, 0.03, 0.001);
  EXPECT_NEAR(result.effects[0].parameters[1].value, 0, 0.001);
}

TEST(BaseGap, ADelayOfThePosesIsNoError) {
  const SimulatedBase late{.delay_s = 0.12};
  const BaseSubject subject(given(), {late.recording("one", 1), late.recording("two", 2)},
                            {late.recording("three", 3)});
  const RobotResult result = analyse(subject, {});
  EXPECT_TRUE(result.effects.empty()) << result.reason;
  EXPECT_NEAR(subject.assumed_delay_s() + result.delay_s, 0.12, 0.01);
}

// A base that is larger by 1 % in all its lengths looks like a tracker whose metre is short by 1 %.
TEST(BaseGap, NoMotionDecidesBetweenALargerBaseAndAnotherScaleOfTheTracker) {
  const SimulatedBase base;
  const BaseSubject subject(given(), {base.recording("one", 1)}, {base.recording("three", 3)});
  const Catalogue& catalogue = subject.catalogue();
  const auto change = [&](std::string_view effect, double by, Eigen::VectorXd& changes) {
    for (const Candidate& one : catalogue.candidates)
      if (one.effect == effect && one.part < 0) changes[static_cast<Eigen::Index>(one.terms[0])] = by;
  };
  Eigen::VectorXd larger = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(catalogue.terms.size()));
  Eigen::VectorXd scaled = larger;
  change("wheel_radius", 0.0005, larger);
  change("turning_geometry", 0.004, larger);
  change("tracking_scale", 0.01, scaled);
  EXPECT_TRUE(subject.deciding_experiment(larger, scaled, 1).starts_with("none: "));
  Eigen::VectorXd wheels = Eigen::VectorXd::Zero(larger.size());
  change("wheel_radius", 0.0005, wheels);
  EXPECT_TRUE(subject.deciding_experiment(wheels, scaled, 1).starts_with("turning on the spot"))
      << subject.deciding_experiment(wheels, scaled, 1);
}

// With wheels that are given 1 % too small, a straight way of 10 m ends 0.1 m short.
TEST(BaseGap, ThePathOfARunEndsWhereTheWheelsSay) {
  BaseRecording straight;
  straight.name = "straight";
  straight.is_speed = {true, true};
  constexpr Eigen::Index kRows = 1001;
  straight.wheel = Eigen::MatrixXd::Constant(2, kRows, 20);
  for (Eigen::Index i = 0; i < kRows; ++i) {
    const double t = 0.01 * static_cast<double>(i);
    straight.time_s.push_back(t);
    // Along an axis that is turned by 90°, in a frame whose origin is elsewhere.
    straight.pose.push_back({3, 1 + t, kPi / 2});
  }
  BaseDescription base = given();
  for (BaseDescription::Wheel& wheel : base.wheels) wheel.radius_m = 0.0495;
  const BaseSubject subject(base, {straight}, {straight}, 0.5);
  const Eigen::VectorXd none =
      Eigen::VectorXd::Zero(static_cast<Eigen::Index>(subject.catalogue().terms.size()));
  const auto errors = subject.path_errors(Part::kHeldOut, {none, 0});
  ASSERT_EQ(errors.size(), 1U);
  EXPECT_NEAR(errors[0].length_m, 10, 1e-9);
  EXPECT_NEAR(errors[0].end_m, 0.1, 1e-9);
  EXPECT_NEAR(errors[0].rms_m, 0.1 / std::sqrt(3), 1e-4);
  EXPECT_NEAR(errors[0].end_heading_rad, 0, 1e-12);
}

TEST(BaseMotion, AJumpOfTheTrackerAndAPauseAreCutAndReported) {
  BaseRecording recording = SimulatedBase{}.recording("one", 1, 60);
  recording.pose[1000].x_m += 0.5;
  for (std::size_t i = 2000; i < recording.time_s.size(); ++i) recording.time_s[i] += 3;
  const BaseMotion motion = cut(recording, given(), 0.3);
  ASSERT_EQ(motion.runs.size(), 2U);
  ASSERT_EQ(motion.runs[0].tracks.size(), 2U);
  EXPECT_EQ(motion.runs[0].tracks[0].time_s.back(), recording.time_s[999]);
  EXPECT_EQ(motion.runs[0].tracks[1].time_s.front(), recording.time_s[1001]);
  EXPECT_EQ(motion.runs[1].time_s.front(), recording.time_s[2000]);
  ASSERT_EQ(motion.notes.size(), 2U);
  EXPECT_EQ(motion.notes[0], "one: cut at 1 pause");
  EXPECT_EQ(motion.notes[1], "one: cut at 2 jumps of the pose that no wheel explains");
}

TEST(BaseMotion, ARunBeginsWhereItsNumberChangesAlthoughTimeBeginsAgain) {
  BaseRecording recording = SimulatedBase{}.recording("one", 1, 60);
  for (std::size_t i = 0; i < recording.time_s.size(); ++i) {
    recording.run.push_back(i < 1500 ? 1 : 2);
    if (i >= 1500) recording.time_s[i] -= 30;
  }
  const BaseMotion motion = cut(recording, given(), 0.3);
  ASSERT_EQ(motion.runs.size(), 2U);
  EXPECT_EQ(motion.runs[1].number, 2);
  EXPECT_TRUE(motion.notes.empty());
}

TEST(BaseMotion, PosesThatAreHeldCountOnceAndHeadingsDoNotWrap) {
  BaseRecording recording = SimulatedBase{}.recording("one", 1, 60);
  for (std::size_t i = 0; i < recording.pose.size(); ++i) recording.pose[i] = recording.pose[i - i % 5];
  const BaseMotion motion = cut(recording, given(), 0.3);
  const BaseTrack& track = motion.runs.at(0).tracks.at(0);
  EXPECT_NEAR(static_cast<double>(track.pose.size()), static_cast<double>(recording.pose.size()) / 5, 1);
  for (std::size_t i = 1; i < track.pose.size(); ++i)
    EXPECT_LT(std::abs(track.pose[i].yaw_rad - track.pose[i - 1].yaw_rad), 1);
}

TEST(BaseMotion, EveryFourthOfManyRunsIsSetAside) {
  BaseRecording recording = SimulatedBase{}.recording("one", 1, 16);
  for (std::size_t i = 0; i < recording.time_s.size(); ++i)
    recording.run.push_back(std::floor(static_cast<double>(i) / 100));
  const BaseRecording rest = set_aside(recording);
  EXPECT_EQ(rest.name, "one, every fourth run");
  EXPECT_EQ(rest.time_s.size(), 200U);
  EXPECT_EQ(rest.run.front(), 3);
  EXPECT_EQ(rest.run.back(), 7);
  EXPECT_EQ(recording.wheel.cols(), 600);
}

TEST(BaseMotion, APoseThatWheelsNeverExplainIsAWrongFactor) {
  BaseRecording recording = SimulatedBase{}.recording("one", 1, 60);
  for (control::PlanarPose& pose : recording.pose) pose.x_m *= 1000;
  try {
    cut(recording, given(), 0.3);
    ADD_FAILURE() << "accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("position_factor"), std::string::npos) << error.what();
  }
}

}  // namespace base_gap_test
