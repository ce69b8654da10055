/// @file
/// What an emulated robot saw and did, to be compared with what its master recorded.
#pragma once
#include <array>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <type_traits>
#include <vector>

#include "hal/joint.h"
#include "runtime/recording/made_paths.h"
#include "runtime/recording/recording.h"
#include "sim/bus/youbot_bus.h"

namespace youbot_sim {

/// SI, joints in HAL order. Plain numbers, because it crosses threads.
struct RobotRecord {
  struct Joint {
    double mode = 0;          ///< what the motor follows: drivers::tmcl::ControllerMode, -1: no power
    double target = 0;        ///< rad, rad/s or N·m, as `mode` says; a position counts as `encoder_rad`
    double position_rad = 0;  ///< true; of an arm's link, behind the gear's give
    double encoder_rad = 0;   ///< the board's counter, as the next frame reports it to the master
  };
  std::chrono::nanoseconds time{};
  std::array<Joint, hal::kMaxJoints> joints{};
  std::array<double, 3> base_W{};             ///< x, y, yaw
  std::array<double, 3> tip_p_WT_m{};         ///< of a base with one arm, as what follows
  std::array<double, 3> contact_force_W_N{};  ///< of the surroundings on the tip
  std::array<double, hal::kMaxGrippers> gripper_opening_m{};
};
static_assert(std::is_trivially_copyable_v<RobotRecord>);

/// One file in the recording format, a row at the end of each millisecond of emulated time. In lock-step
/// row n, from 0, is what frame n led to. Columns: time_s; of each joint, wheel_1 … arm_5,
/// *_mode, *_target, *_position_rad and *_encoder_rad; base_*; true_tip_*; contact_force_*;
/// gripper_opening_m.
class RobotRecording {
 public:
  /// Takes rows from now on. `robot` outlives this. `wait`: a disk that is too slow holds the robot up, where
  /// time may stand still; otherwise rows are lost and counted.
  /// Nothing is left of a file without a row.
  /// @throws hal::SetupError when the file cannot be made, or is there already.
  RobotRecording(const std::filesystem::path& path, sim::bus::YoubotBus& robot, bool wait);
  RobotRecording(const RobotRecording&) = delete;
  RobotRecording& operator=(const RobotRecording&) = delete;
  ~RobotRecording() { close(); }

  /// Takes no further rows and writes out what is pending.
  void close() noexcept;
  /// What is missing in it, in words. After close().
  std::vector<std::string> problems() const { return recording_.problems(); }

 private:
  void take() noexcept;

  sim::bus::YoubotBus& robot_;
  bool wait_;
  runtime::MadePaths made_;                    // takes the file away unless there are rows
  runtime::Recording<RobotRecord> recording_;  // last: its thread uses what is above
};

}  // namespace youbot_sim
