/// @file
/// Base and arm follow a hand on a haptic device.
#pragma once
#include <array>
#include <chrono>
#include <cstddef>

#include "control/port_energy.h"
#include "control/teleoperation.h"
#include "control/torque_rate.h"
#include "hal/haptic_device.h"
#include "hal/newest_value.h"
#include "hal/robot.h"
#include "operation/teleop_record.h"
#include "runtime/sample_clock.h"
#include "runtime/supervisor.h"
#include "runtime/task.h"

namespace operation {

/// Connects control::Teleoperation with a hal::Robot with base and arm and a hal::HapticDevice. A fault of
/// the haptic device, or a pause of the program, brings base and arm to rest and lowers the arm; a fault of
/// the robot switches the drives off at once. In both cases the force on the hand is off.
class TeleopTask final : public runtime::Task {
 public:
  struct Config : runtime::Supervisor::Config {
    control::Teleoperation::Config control;
    double torque_rate_per_s = control::kTorqueRate_per_s;  ///< as in BaseTask::Config
  };

  /// `master` must outlive the task. @throws std::invalid_argument from the controller's configuration, or if
  /// the robot is not a base with one arm.
  TeleopTask(const Config& config, const hal::Robot& robot, hal::HapticDevice& master);

  void read(const runtime::Moment& moment) noexcept override;
  bool can_brake_after_pause(const runtime::Moment& moment) noexcept override;
  runtime::Verdict wait(const runtime::Moment& moment) noexcept override;
  runtime::Verdict begin(const runtime::Moment& moment, hal::RobotCommand& command) noexcept override;
  runtime::Verdict step(const runtime::Moment& moment, hal::RobotCommand& command) noexcept override;
  runtime::Verdict brake(const runtime::Moment& moment, hal::RobotCommand& command,
                         double& fastest_rad_per_s) noexcept override;
  /// Braking the base and lowering the arm have their own times.
  std::chrono::nanoseconds brake_timeout() const noexcept override { return brake_timeout_; }

  /// From another thread: in force from the next cycle on, as Teleoperation::tune() describes.
  void tune(const control::TeleopTuning& tuning) noexcept { tuning_.publish(tuning); }

  TeleopRecord& record() noexcept { return record_; }  ///< of the last cycle
  const TeleopRecord& record() const noexcept { return record_; }
  control::TeleopPhase phase() const noexcept { return control_.phase(); }
  control::TeleopEnd end() const noexcept { return control_.end(); }
  const Eigen::Isometry3d& X_WT() const noexcept { return control_.robot().X_WT; }  ///< from the joints

 private:
  void control(const runtime::Moment& moment) noexcept;
  void apply(hal::RobotCommand& command) noexcept;
  double torque_to_send(std::size_t joint, double wanted_Nm, bool slowed) noexcept;
  runtime::StopReason reason() const noexcept;
  void keep_record(const runtime::Moment& moment) noexcept;

  hal::HapticDevice& master_;
  control::Teleoperation control_;
  control::PortEnergy energy_;
  std::chrono::nanoseconds period_;
  std::chrono::nanoseconds brake_timeout_;
  runtime::SampleClock sample_clock_;
  std::array<control::TorqueRate, TeleopRecord::kJoints> torque_rates_;

  hal::NewestValue<control::TeleopTuning> tuning_;
  control::TeleopTuning tuned_;  // in force
  control::TeleopInput input_;
  control::TeleopOutput output_;
  std::optional<control::ArmVector> acting_Nm_;  // on the arm since the last sample
  hal::HapticCommand master_command_;
  hal::HapticSample master_sample_;
  hal::HapticStatus master_status_{};
  Eigen::Vector3d held_H_N_ = Eigen::Vector3d::Zero();
  TeleopRecord record_;
  bool started_ = false;
  bool controlled_ = false;  // in this cycle
};

using TeleopCycle = runtime::Supervised<TeleopTask>;

}  // namespace operation
