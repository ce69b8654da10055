/// @file
/// Requirements on the daemon's recording and the simulator's.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "control/teleoperation.h"
#include "drivers/tmcl/process_data.h"
#include "tests/end_to_end/comparison.h"
#include "tests/end_to_end/scenario.h"
#include "tests/support/recording.h"

namespace end_to_end {

using control::TeleopPhase;
using drivers::tmcl::ControllerMode;

inline std::vector<TeleopPhase> phases(const Recording& run) {
  std::vector<TeleopPhase> phases;
  for (const double number : run["phase"])
    if (const auto phase = static_cast<TeleopPhase>(number); phases.empty() || phases.back() != phase)
      phases.push_back(phase);
  return phases;
}

/// First row at or after that time.
inline std::size_t row_at(const Recording& recording, double time_s) {
  const std::vector<double>& times = recording["time_s"];
  return static_cast<std::size_t>(std::lower_bound(times.begin(), times.end(), time_s) - times.begin());
}

inline double mean(const std::vector<double>& values, std::size_t from, std::size_t to) {
  double sum = 0;
  for (std::size_t i = from; i < to; ++i) sum += values[i];
  return sum / static_cast<double>(to - from);
}

inline double covariance(const std::vector<double>& a, const std::vector<double>& b) {
  const double mean_a = mean(a, 0, a.size());
  const double mean_b = mean(b, 0, b.size());
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - mean_a) * (b[i] - mean_b);
  return sum / static_cast<double>(a.size());
}
inline double deviation(const std::vector<double>& values) { return std::sqrt(covariance(values, values)); }
inline double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  return covariance(a, b) / (deviation(a) * deviation(b));
}

/// Whether any motor is commanded and has power.
inline bool driven(const Recording& robot, std::size_t row) {
  return std::any_of(kJointNames.begin(), kJointNames.end(), [&](const char* name) {
    return robot[std::string(name) + "_mode"][row] > static_cast<double>(ControllerMode::kMotorStop);
  });
}

/// Rows of a step, in the run and in the simulator.
struct Part {
  Part(const RecordedRun& run, const Recording& simulated, const Window& window)
      : rows(run.recording),
        robot(simulated),
        from(row_at(rows, window.from_s)),
        to(std::min(row_at(rows, window.to_s), rows.rows())),
        robot_from(run.comparison.robot_row(from)),
        robot_to(run.comparison.robot_row(to)) {}
  const Recording& rows;
  const Recording& robot;
  std::size_t from, to, robot_from, robot_to;
};

inline void expect_phases_in_order(const Recording& run) {
  const std::vector<TeleopPhase> all{
      TeleopPhase::kCentring,  TeleopPhase::kUnfolding, TeleopPhase::kApproaching, TeleopPhase::kStiffening,
      TeleopPhase::kOperating, TeleopPhase::kStopping,  TeleopPhase::kLowering,    TeleopPhase::kOff};
  const std::vector<TeleopPhase> seen = phases(run);
  // A fault of the robot ends any phase at once; everything else goes through stopping.
  std::size_t next = 0;
  for (const TeleopPhase phase : seen) {
    if (phase == TeleopPhase::kFaulted) {
      EXPECT_EQ(seen.back(), phase);
      return;
    }
    if (phase == TeleopPhase::kStopping || (phase == TeleopPhase::kOff && next == 1)) {
      next = static_cast<std::size_t>(std::find(all.begin(), all.end(), phase) - all.begin());
    }
    ASSERT_LT(next, all.size());
    EXPECT_EQ(phase, all[next]) << control::name(phase) << " instead of " << control::name(all[next]);
    ++next;
  }
  EXPECT_EQ(next, all.size()) << "ended in " << control::name(seen.back());
}

/// Time increases, and the set-point moves in steps allowed by smoothing.
inline void expect_continuous(const Recording& run) {
  constexpr double kThreshold_m = 5e-4;  // nearer targets pass; a step is half of it
  const std::vector<double>& times_s = run["time_s"];
  for (std::size_t row = 1; row < run.rows(); ++row) {
    const double passed_ms = 1e3 * (times_s[row] - times_s[row - 1]);
    ASSERT_GT(passed_ms, 0.0) << "row " << row;
    const double phase = run["phase"][row];
    if (phase != run["phase"][row - 1] || phase != static_cast<double>(TeleopPhase::kOperating)) continue;
    for (const char* axis : {"setpoint_x_m", "setpoint_y_m", "setpoint_z_m"})
      ASSERT_LE(std::abs(run[axis][row] - run[axis][row - 1]), kThreshold_m + 2e-6)
          << axis << ", row " << row;
  }
}

inline void expect_same(const Comparison& comparison, std::size_t rows) {
  const Comparison::Count positions = comparison.positions();
  EXPECT_EQ(positions.wrong, 0U) << positions.first_wrong;
  EXPECT_GT(positions.equal, positions.kept) << "of " << rows << " rows";
  const Comparison::Count torques = comparison.torques();
  EXPECT_EQ(torques.wrong, 0U) << torques.first_wrong;
}

/// Once a board receives nothing, all other drives are commanded to stop within this many more cycles.
inline void expect_stopped_when_power_was_lost(const RecordedRun& run, int tolerated_cycles) {
  const std::size_t lost = run.comparison.power_lost_row();
  const std::size_t last = lost + static_cast<std::size_t>(tolerated_cycles) + 1;
  for (std::size_t row = last; row < run.recording.rows(); ++row)
    ASSERT_EQ(run.recording["phase"][row], static_cast<double>(TeleopPhase::kFaulted)) << "row " << row;
}

/// The operator looks along the robot's x: ahead is away from the operator, and the operator's right is the
/// robot's right. The set-point follows the hand, and the end effector follows it as far as friction lets a
/// soft spring pull it.
inline void expect_tip_follows_hand(const Part& part) {
  const auto of_run = [&](const std::string& column) {
    const std::vector<double>& all = part.rows[column];
    return std::vector<double>(all.begin() + static_cast<long>(part.from),
                               all.begin() + static_cast<long>(part.to));
  };
  for (const double rate : of_run("rate_control")) ASSERT_EQ(rate, 0.0);
  for (const auto& [axis, sign] : {std::pair{"x", -1.0}, {"y", -1.0}, {"z", 1.0}}) {
    const std::vector<double> hand_m = of_run("grip_" + std::string(axis) + "_m");
    const std::vector<double> setpoint_m = of_run("setpoint_" + std::string(axis) + "_m");
    EXPECT_GT(sign * correlation(hand_m, setpoint_m), 0.99) << axis;
    EXPECT_NEAR(deviation(setpoint_m) / deviation(hand_m), 1.0, 0.05) << axis;
    const std::vector<double>& tip_m = part.robot["true_tip_" + std::string(axis) + "_m"];
    const std::vector<double> followed_m(tip_m.begin() + static_cast<long>(part.robot_from),
                                         tip_m.begin() + static_cast<long>(part.robot_to));
    EXPECT_GT(correlation(setpoint_m, followed_m), 0.85) << axis;
    std::vector<double> squares_m2;
    for (std::size_t i = 0; i < setpoint_m.size(); ++i)
      squares_m2.push_back(std::pow(setpoint_m[i] - followed_m[i], 2));
    EXPECT_LT(std::sqrt(mean(squares_m2, 0, squares_m2.size())), 0.02) << axis;
  }
}

inline void expect_base_drives(const Part& part) {
  const std::vector<double>& x_m = part.robot["base_x_m"];
  EXPECT_GT(x_m[part.robot_to] - x_m[part.robot_from], 0.1);
  const std::vector<double>& rate = part.rows["rate_control"];
  EXPECT_GT(mean(rate, part.from, part.to), 0.3);
}

/// At the end of the step the handle is at rest, inside the boundary, and the end effector at the wall in
/// front of the robot: the hand feels the spring between set-point and end effector, scaled down.
inline void expect_wall_is_felt(const Part& part, double stiffness_N_per_m, double force_scale) {
  constexpr std::size_t kStill = 500;
  ASSERT_GT(part.to - part.from, kStill);
  const double wall_N = mean(part.robot["contact_force_x_N"], part.robot_to - kStill, part.robot_to);
  EXPECT_LT(wall_N, -2.0);
  const double before_m = mean(part.rows["setpoint_x_m"], part.to - kStill, part.to) -
                          mean(part.robot["true_tip_x_m"], part.robot_to - kStill, part.robot_to);
  const double felt_N = stiffness_N_per_m * before_m / force_scale;
  EXPECT_GT(felt_N, 0.2);
  EXPECT_NEAR(mean(part.rows["grip_force_held_x_N"], part.to - kStill, part.to), felt_N, 0.15 * felt_N)
      << "towards the operator, with the wall at " << wall_N << " N";
}

inline void expect_gripper_closes(const Part& part) {
  EXPECT_NEAR(part.rows["gripper_opening_m"][part.to - 10], 0.010, 1e-6) << "commanded";
  EXPECT_NEAR(part.robot["gripper_opening_m"][part.robot_to], 0.010, 1e-4) << "done";
  EXPECT_NE(part.robot["gripper_opening_m"][part.robot_from], part.robot["gripper_opening_m"][part.robot_to]);
}

}  // namespace end_to_end
