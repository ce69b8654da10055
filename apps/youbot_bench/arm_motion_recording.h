/// @file
/// Recordings of an arm's motions: a file for each, with the columns of youbotd's.
#pragma once
#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "control/robot_model.h"
#include "runtime/recording/made_paths.h"
#include "runtime/recording/recording.h"

namespace youbot_bench {

/// A cycle of a motion.
struct ArmMotionRecord {
  double time_s = 0.0;  ///< since the motion's start
  int motion = -1;      ///< from 0
  std::array<double, control::kArmJoints> position_rad{};
  std::array<double, control::kArmJoints> position_command_rad{};
  std::array<double, control::kArmJoints> torque_Nm{};
};
template <typename Column>
void visit(const ArmMotionRecord& record, Column&& column) {
  column("time_s", "", record.time_s, 6);
  static constexpr std::array kNames{"arm_1", "arm_2", "arm_3", "arm_4", "arm_5"};
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    column(kNames[i], "_position_rad", record.position_rad[i], 6);
    column(kNames[i], "_position_command_rad", record.position_command_rad[i], 6);
    column(kNames[i], "_torque_measured_Nm", record.torque_Nm[i], 5);
  }
}

/// `DIR/motion-1.csv` … Until the first row is written, the destructor removes the files.
class ArmMotionRecording {
 public:
  /// Setup. `made`: what else is to be removed with them.
  /// @throws hal::SetupError naming path and cause.
  ArmMotionRecording(const std::filesystem::path& directory, int motions, runtime::MadePaths& made);

  static std::string file_name(int motion) { return "motion-" + std::to_string(motion + 1) + ".csv"; }

  /// Cycle.
  void add(const ArmMotionRecord& record) noexcept { recording_.add(record); }
  /// Not for a real-time cycle.
  void wait_for_room() noexcept { recording_.wait_for_room(); }
  void close() noexcept { recording_.close(); }
  std::vector<std::string> problems() const { return recording_.problems(); }

 private:
  runtime::Recording<ArmMotionRecord> recording_;
};

}  // namespace youbot_bench
