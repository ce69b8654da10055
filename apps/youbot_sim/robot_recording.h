/// @file
/// Inputs and motion of an emulated robot, for comparison with its master's recording.
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
    double mode = 0;          ///< mode that the motor follows: drivers::tmcl::ControllerMode, -1: no power
    double target = 0;        ///< rad, rad/s or N·m, see `mode`; positions relative to the zero of
                              ///< `encoder_rad`
    double position_rad = 0;  ///< true value; for the arm of the link, behind the elastic gear
    double encoder_rad = 0;   ///< the board's counter, as reported to the master in the next frame
  };
  std::chrono::nanoseconds time{};
  std::array<Joint, hal::kMaxJoints> joints{};
  std::array<double, 3> base_W{};             ///< x, y, yaw
  std::array<double, 3> tip_p_WT_m{};         ///< for a base with one arm, like the following
  std::array<double, 3> contact_force_W_N{};  ///< of the environment on the end effector
  std::array<double, hal::kMaxGrippers> gripper_opening_m{};
};
static_assert(std::is_trivially_copyable_v<RobotRecord>);

/// One file, MCAP if its name ends in .mcap and otherwise CSV, a row at the end of each millisecond of
/// emulated time. In lock-step row n, from 0, is the result of frame n. Columns: time_s; for each joint,
/// wheel_1 … arm_5, *_mode, *_target,
/// *_position_rad and *_encoder_rad; base_*; true_tip_*; contact_force_*; gripper_opening_m.
class RobotRecording {
 public:
  /// Records from now on. `robot` must outlive this. `wait`: a slow disk delays the robot, for emulated time;
  /// otherwise rows are lost and counted. A file without rows is removed.
  /// @throws hal::SetupError if the file cannot be created, or already exists.
  RobotRecording(const std::filesystem::path& path, sim::bus::YoubotBus& robot, bool wait);
  RobotRecording(const RobotRecording&) = delete;
  RobotRecording& operator=(const RobotRecording&) = delete;
  ~RobotRecording() { close(); }

  /// Records no further rows and writes what is pending.
  void close() noexcept;
  /// Texts on what is missing in it. After close().
  std::vector<std::string> problems() const { return recording_.problems(); }

 private:
  void take() noexcept;

  sim::bus::YoubotBus& robot_;
  bool wait_;
  runtime::MadePaths made_;                    // removes the file unless there are rows
  runtime::Recording<RobotRecord> recording_;  // last: its thread uses the members above
};

}  // namespace youbot_sim
