/// @file
/// Compares the daemon's recording with the simulator's.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "control/teleoperation.h"
#include "drivers/tmcl/process_data.h"
#include "hal/youbot_axes.h"
#include "tests/support/recording.h"

namespace end_to_end {

using support::Recording;

inline constexpr std::size_t kJoints = 9;
inline constexpr std::array<const char*, kJoints> kJointNames{
    "wheel_1", "wheel_2", "wheel_3", "wheel_4", "arm_1", "arm_2", "arm_3", "arm_4", "arm_5"};

/// Rows of one run and of the simulator. Each cycle is a frame, and each frame a row of the simulator, so
/// they differ by a constant offset unless a row is missing.
class Comparison {
 public:
  Comparison(const Recording& run, const Recording& robot) : run_(run), robot_(robot) {
    for (std::size_t i = 0; i < kJoints; ++i) {
      const std::string name = kJointNames[i];
      positions_[i] = &run[name + "_position_rad"];
      commands_[i] = &run[name + (i < 4 ? "_torque_command_Nm" : "_command")];
      encoders_[i] = &robot[name + "_encoder_rad"];
      modes_[i] = &robot[name + "_mode"];
      targets_[i] = &robot[name + "_target"];
    }
    align();
  }
  bool aligned() const { return shift_.has_value(); }
  /// The simulator's row for a row of the run.
  std::size_t robot_row(std::size_t row) const { return row + *shift_; }

  /// Rows with the position that the boards reported in that cycle's frame, and rows that kept the previous
  /// one because the answer was late.
  struct Count {
    std::size_t equal = 0;
    std::size_t kept = 0;
    std::size_t wrong = 0;
    std::string first_wrong{};
  };
  Count positions() const {
    Count count;
    const std::size_t first = first_row();
    // A wheel that lost power continues from its position, and its board from zero.
    std::array<double, kJoints> offset{};
    for (std::size_t i = 0; i < 4; ++i) offset[i] = (*positions_[i])[first] - reported(first, i);
    for (std::size_t row = first; row < run_.rows(); ++row) {
      bool equal = true;
      bool kept = row > 0;
      for (std::size_t i = 0; i < kJoints; ++i) {
        equal = equal && std::abs((*positions_[i])[row] - reported(row, i) - offset[i]) < kRounding;
        kept = kept && (*positions_[i])[row] == (*positions_[i])[row - 1];
      }
      ++(equal ? count.equal : kept ? count.kept : count.wrong);
      if (!equal && !kept && count.first_wrong.empty()) count.first_wrong = "row " + std::to_string(row);
    }
    return count;
  }
  /// Torque commands while operating, compared with those followed by the boards one cycle later, up to the
  /// row in which a board lost power: the boards behind it receive no more.
  Count torques() const {
    Count count;
    for (std::size_t row = first_row(); row < power_lost_row() && row + 1 < run_.rows(); ++row) {
      if (!operating(row) || !operating(row + 1)) continue;
      for (std::size_t i = 0; i < kJoints; ++i) {
        const hal::AxisConstants& axis = i < 4 ? hal::kWheelAxis.constants : hal::kArmAxes[i - 4].constants;
        const double half_mA_Nm = 0.5e-3 * axis.torque_constant_Nm_per_A * axis.gear_ratio;
        const std::size_t there = robot_row(row) + 1;
        const bool equal =
            (*modes_[i])[there] == static_cast<double>(drivers::tmcl::ControllerMode::kCurrent) &&
            std::abs((*commands_[i])[row] - (*targets_[i])[there]) < half_mA_Nm + 2 * kRounding;
        ++(equal ? count.equal : count.wrong);
        if (!equal && count.first_wrong.empty())
          count.first_wrong = std::string(kJointNames[i]) + ", row " + std::to_string(row) + ": " +
                              std::to_string((*commands_[i])[row]) + " N·m, followed " +
                              std::to_string((*targets_[i])[there]) + " in mode " +
                              std::to_string((*modes_[i])[there]);
      }
    }
    return count;
  }
  /// The run's first row, if any, whose frame did not reach a board without power.
  std::size_t power_lost_row() const {
    for (std::size_t row = first_row(); row < run_.rows() && robot_row(row) + 1 < robot_.rows(); ++row)
      for (const std::vector<double>* modes : modes_)
        if ((*modes)[robot_row(row) + 1] < 0) return row;
    return run_.rows();
  }

 private:
  static constexpr double kRounding = 1e-6;  // of the files; a tick is 1e-5 rad and more

  /// In the frame of that cycle, which carries the previous values.
  double reported(std::size_t row, std::size_t joint) const {
    return (*encoders_[joint])[robot_row(row) - 1];
  }
  bool operating(std::size_t row) const {
    return run_["phase"][row] == static_cast<double>(control::TeleopPhase::kOperating);
  }
  /// Homing changes the angles before this row.
  std::size_t first_row() const {
    const std::vector<double>& phase = run_["phase"];
    return static_cast<std::size_t>(
        std::find(phase.begin(), phase.end(), static_cast<double>(control::TeleopPhase::kUnfolding)) -
        phase.begin());
  }
  bool arm_reported(std::size_t row, std::size_t robot_row) const {
    for (std::size_t i = 4; i < kJoints; ++i)
      if (std::abs((*positions_[i])[row] - (*encoders_[i])[robot_row]) >= kRounding) return false;
    return true;
  }
  /// By a stretch in which the arm moves, where no two rows are equal.
  void align() {
    constexpr std::size_t kStretch = 200;
    std::size_t best = 0;
    const std::size_t middle = first_row() + 1000;
    if (middle + kStretch >= run_.rows()) return;
    for (std::size_t there = middle; there + kStretch < robot_.rows(); ++there) {
      if (!arm_reported(middle, there) && !arm_reported(middle + kStretch, there + kStretch)) continue;
      std::size_t alike = 0;
      for (std::size_t n = 0; n < kStretch; ++n) alike += arm_reported(middle + n, there + n) ? 1U : 0U;
      if (alike <= best) continue;
      best = alike;
      shift_ = there + 1 - middle;
    }
  }

  const Recording& run_;
  const Recording& robot_;
  std::array<const std::vector<double>*, kJoints> positions_{}, commands_{}, encoders_{}, modes_{},
      targets_{};
  std::optional<std::size_t> shift_;
};

/// A run from the daemon's recording.
struct RecordedRun {
  RecordedRun(const std::filesystem::path& folder, const Recording& robot)
      : recording(folder / "teleoperation.csv"), comparison(recording, robot) {}
  Recording recording;
  Comparison comparison;
};

}  // namespace end_to_end
