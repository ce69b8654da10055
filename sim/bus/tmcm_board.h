/// @file
/// The youBot's motor controller (TMCM-174, -1632, -KR-841, -1610) behind an emulated slave controller, or
/// standalone for another bus.
#pragma once
#include <chrono>
#include <cstdint>
#include <optional>
#include <span>

#include "drivers/tmcl/process_data.h"
#include "drivers/tmcl/telegram.h"
#include "sim/bus/application.h"
#include "sim/bus/board_drive.h"
#include "sim/bus/emulated_slave.h"
#include "sim/bus/gripper_board.h"
#include "sim/bus/tmcm_commutation.h"
#include "sim/bus/tmcm_i2t.h"
#include "sim/bus/tmcm_motion.h"
#include "sim/bus/tmcm_parameters.h"

namespace sim::bus {

struct TmcmOptions {
  drivers::tmcl::Firmware firmware = drivers::tmcl::Firmware::k148;
  int controller = 1632;  ///< reported type: wheel 174 or 1632, arm joint 841 or 1610
  BoardAxis axis = {};
  drivers::tmcl::CurrentSign current_sign = drivers::tmcl::CurrentSign::kSigned;
  std::int32_t password = 4711;  ///< for parameter 248; the real one is not public
  /// From the end of the frame with the request; the reply waits at least for the next advance().
  std::chrono::nanoseconds reply_latency = std::chrono::milliseconds(1);
  std::chrono::nanoseconds gripper_latency =
      std::chrono::milliseconds(5);  ///< in addition, for module 1; assumption
  int zero_version_replies = 0;      ///< real boards sometimes answer command 136 with zeros (Óbuda driver)
  std::chrono::nanoseconds commutation_time = std::chrono::milliseconds(500);  ///< firmware 1.48 (same)
};

/// Reaction to commands, in order of precedence:
///   power, undervoltage, overtemperature, overvoltage with parameter 245   bridge open
///   commutation unknown          bridge open; firmware 2.0 turns on a velocity command to find it
///   I²t exceeded (flag 17)       PWM 0, which shorts the winding; until SAP 29
///   process data late (flag 16)  holds its position at that time; until SAP 158
///   mode and value of the process data, or of the mailbox while those say "no more action"
/// Interpretations, because there is no manual: the watchdog starts with the first process data after
/// power-up; motor stop holds velocity zero; "no more action" keeps the last motion; setting the reference
/// ends it. One controller period is a millisecond (parameter 133). Cycle: all hooks.
class TmcmBoard final : public Application {
 public:
  static constexpr std::chrono::nanoseconds kPeriod = std::chrono::milliseconds(1);

  /// `slave` and `drive` must outlive the board. Attaches itself.
  TmcmBoard(EmulatedSlave& slave, BoardDrive& drive, const TmcmOptions& options);
  /// Without EtherCAT: the carrier of the telegrams calls execute().
  TmcmBoard(BoardDrive& drive, const TmcmOptions& options);
  /// Setup: the gripper behind this board's mailbox.
  void attach(GripperBoard& gripper) noexcept { gripper_ = &gripper; }

  /// Executes a request to the drive at once; returns the reply in mailbox format. Cycle.
  drivers::tmcl::MailboxBytes execute(const drivers::tmcl::Request& request) noexcept;

  // ---- for scripts and tests ----

  /// Its process data before packing.
  const drivers::tmcl::DriveInput& input() const noexcept { return input_; }
  /// Command that the motor followed in the last period; empty: the bridge is open.
  const std::optional<drivers::tmcl::DriveOutput>& followed() const noexcept { return followed_; }
  /// Time since the last process data, in whole periods; before any, since power-up.
  std::chrono::nanoseconds unheard() const noexcept { return since_outputs_; }
  /// Converts between such integers and SI at the joint, with the zero of the board's counter.
  const MotorUnits& units() const noexcept { return units_; }
  const TmcmParameters& parameters() const noexcept { return parameters_; }
  bool initialized() const noexcept { return commutation_.known(); }
  const I2tMonitor& i2t() const noexcept { return i2t_; }
  /// Firmware 1.48 occasionally reports a wrong position (Óbuda driver); here: for one period in 97.
  void set_encoder_glitches(bool present) noexcept { glitches_ = present; }

  // ---- Application ----

  void power_changed(bool on) noexcept override;
  void state_changed(drivers::ethercat::AlState state) noexcept override;
  bool mailbox_received(std::span<const std::uint8_t> message) noexcept override;
  void outputs_changed(std::span<const std::uint8_t> outputs) noexcept override;
  void inputs(std::span<std::uint8_t> inputs) noexcept override;
  void advance(std::chrono::nanoseconds step) noexcept override;
  void fault(BoardFault fault, bool present) noexcept override;

 private:
  using Firmware = drivers::tmcl::Firmware;
  using MailboxBytes = drivers::tmcl::MailboxBytes;

  void tick() noexcept;
  void read_sensors() noexcept;
  std::int32_t hall_angle() const noexcept;
  void watch() noexcept;
  void drive_motor() noexcept;
  bool bridge_enabled() const noexcept;
  void publish() noexcept;
  std::uint32_t flags() const noexcept;
  bool position_reached() const noexcept;
  void set_counter(std::int32_t ticks) noexcept;
  void move(drivers::tmcl::ControllerMode mode, std::int32_t value) noexcept;

  // Telegrams, tmcm_telegrams.cpp.
  void serve_mailbox(std::chrono::nanoseconds step) noexcept;
  TmcmParameters::Answer execute_command(const drivers::tmcl::Request& request) noexcept;
  TmcmParameters::Answer get_axis_parameter(std::uint8_t number) const noexcept;
  TmcmParameters::Answer set_axis_parameter(std::uint8_t number, std::int32_t value) noexcept;
  MailboxBytes version_text() noexcept;
  std::int32_t pwm() const noexcept;

  TmcmBoard(EmulatedSlave* slave, BoardDrive& drive, const TmcmOptions& options);

  EmulatedSlave* slave_;  // null: none
  BoardDrive& drive_;
  GripperBoard* gripper_ = nullptr;
  const TmcmOptions options_;
  const MotorUnits units_;
  TmcmParameters parameters_;
  CommutationStartUp commutation_;
  I2tMonitor i2t_;
  TmcmMotion motion_;

  // Sensors.
  std::int64_t encoder_ticks_ = 0;  // of the joint, counted from the simulation's zero
  std::int64_t counter_offset_ = 0;
  MotorState motor_;
  double smooth_rpm_ = 0.0;
  double current_mA_ = 0.0;  // signed
  std::int32_t hall_angle_ = 0;

  // Commands.
  bool powered_ = true;
  drivers::tmcl::DriveOutput command_;
  std::optional<drivers::tmcl::DriveOutput> followed_;
  drivers::tmcl::ControllerMode last_mode_{};  // of the process data
  drivers::tmcl::DriveInput input_;
  std::chrono::nanoseconds since_tick_{};
  std::chrono::nanoseconds since_outputs_{};
  bool watchdog_armed_ = false;
  bool timed_out_ = false;
  std::int32_t hold_ticks_ = 0;
  bool stop_when_found_ = false;  // parameter 15 started the commutation, firmware 2.0

  // Mailbox: one request at a time.
  std::optional<drivers::tmcl::Request> request_;
  std::optional<MailboxBytes> reply_;
  std::chrono::nanoseconds reply_in_{};
  int zero_versions_left_;

  // Defects.
  bool stuck_encoder_ = false;
  bool hall_error_ = false;
  bool undervoltage_ = false;
  bool overvoltage_ = false;
  bool overtemperature_ = false;
  bool glitches_ = false;
  std::uint32_t ticks_done_ = 0;
};

}  // namespace sim::bus
