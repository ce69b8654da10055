/// @file
/// One cycle of teleoperation: exchange with master and robot, decide, command both.
#pragma once
#include <array>
#include <chrono>
#include <cstddef>
#include <string>

#include "control/port_energy.h"
#include "control/teleoperation.h"
#include "control/torque_rate.h"
#include "hal/haptic_device.h"
#include "hal/robot.h"
#include "operation/teleop_record.h"
#include "runtime/monitored_robot.h"
#include "runtime/recent_pause.h"
#include "runtime/sample_clock.h"

namespace operation {

/// What nobody but a simulation knows.
struct TeleopTruth {
  Eigen::Vector3d p_WT_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d contact_force_W_N = Eigen::Vector3d::Zero();
};

/// control::Teleoperation between a hal::Robot with base and arm and a hal::HapticDevice. Its phases end in
/// drives that are off: on a fault of the robot at once, on one of the master, or when this loop did not run
/// for `stall_timeout`, after base and arm have come to rest. There is no way back but a new start.
/// One thread. step() is the cycle: no allocation, lock, exception, blocking call or logging.
class TeleopCycle {
 public:
  struct Config {
    control::Teleoperation::Config control;
    double torque_rate_per_s = control::kTorqueRate_per_s;  ///< as in Cycle::Config
    std::chrono::nanoseconds stall_timeout{100'000'000};
    std::chrono::nanoseconds enable_timeout{30'000'000'000};
    control::ChecksOff checks_off{};  ///< of the sensors
  };
  /// Why it ended, with what is known of it.
  struct End {
    control::TeleopEnd end = control::TeleopEnd::kNone;
    control::TeleopExcess excess{};
    hal::CycleStatus robot{};
    hal::HapticStatus master{};
    std::chrono::nanoseconds time{};   ///< as in the recording
    std::chrono::nanoseconds pause{};  ///< of this loop, just before
    bool fault() const noexcept {
      return end != control::TeleopEnd::kNone && end != control::TeleopEnd::kRequested;
    }
  };

  /// `robot` and `master` outlive the cycle. @throws std::invalid_argument from the controller's
  /// configuration, or when the robot is not a base with one arm.
  TeleopCycle(const Config& config, hal::Robot& robot, hal::HapticDevice& master);

  void step(std::chrono::nanoseconds now) noexcept;
  /// Comes to rest, then switches off. From the cycle's thread.
  void request_stop() noexcept;
  /// Drives off with the next step: the arm falls. From the cycle's thread.
  void switch_off() noexcept;
  bool finished() const noexcept;
  control::ChecksOff silent_checks() const noexcept { return robot_.silent_checks(); }
  control::ChecksOff once_silent_checks() const noexcept { return robot_.once_silent_checks(); }
  TeleopRecord& record() noexcept { return record_; }  ///< of the last step()
  const TeleopRecord& record() const noexcept { return record_; }
  const End& end() const noexcept { return end_; }
  control::TeleopPhase phase() const noexcept { return control_.phase(); }
  const Eigen::Isometry3d& X_WT() const noexcept { return control_.robot().X_WT; }  ///< from the joints
  /// Of the simulation, into the last record.
  void tell_truth(const TeleopTruth& truth) noexcept;

 private:
  void command_robot(const control::TeleopOutput& output) noexcept;
  double torque_to_send(std::size_t joint, double wanted_Nm, bool slowed) noexcept;
  void keep_record(const control::TeleopInput& input, const control::TeleopOutput& output) noexcept;
  void note_end() noexcept;
  void end_early() noexcept;

  Config config_;
  runtime::MonitoredRobot robot_;
  hal::HapticDevice& master_;
  control::Teleoperation control_;
  control::PortEnergy energy_;
  std::chrono::nanoseconds period_;
  runtime::SampleClock sample_clock_;
  runtime::RecentPause pause_;

  std::array<control::TorqueRate, TeleopRecord::kJoints> torque_rates_;

  hal::RobotCommand robot_command_;
  hal::RobotSample robot_sample_;
  hal::HapticCommand master_command_;
  hal::HapticSample master_sample_;
  hal::CycleStatus robot_status_{};
  hal::HapticStatus master_status_{};
  Eigen::Vector3d held_H_N_ = Eigen::Vector3d::Zero();
  bool torque_rate_limited_ = false;  // in this cycle
  TeleopRecord record_;
  End end_;
  bool started_ = false;
  bool stop_before_start_ = false;
  std::chrono::nanoseconds first_{};
  std::chrono::nanoseconds now_{};
  std::chrono::nanoseconds off_since_{};
  bool off_ = false;
};

/// "12.345 s: omega.6: it was unplugged; braked, arm lowered, switched off"
std::string describe(const TeleopCycle::End& end, const hal::Robot& robot, const hal::HapticDevice& master);

}  // namespace operation
