/// @file
/// One emulated slave: a slave controller and the firmware common to all slaves. An Application adds the
/// behaviour of a board.
#pragma once
#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sim/bus/al_state_machine.h"
#include "sim/bus/application.h"
#include "sim/bus/configuration_check.h"
#include "sim/bus/slave_controller.h"
#include "sim/bus/slave_description.h"
#include "sim/bus/slave_mailbox.h"

namespace sim::bus {

/// Behaviour of one specimen, in addition to its SII.
struct SlaveOptions {
  SiiInterface::Timing sii{};
  DistributedClock::Crystal crystal{};
  /// From the end of the frame that writes AL control until the firmware reads it. 0: at once.
  std::chrono::nanoseconds state_change_time{};
  /// Time-out for outputs between SAFE-OP and OP (200 ms in the ETG's slave stack code).
  std::chrono::nanoseconds outputs_time = std::chrono::milliseconds(200);
  MailboxDemand mailbox_demand = MailboxDemand::kAlways;
};

/// Firmware rules in addition to those of AlStateMachine and configuration_check.h:
/// - The mailbox is closed in INIT, process data are closed below SAFE-OP: accesses do not count.
/// - In OP the process data watchdog takes the slave to SAFE-OP with 0x001B. It runs from the first outputs
///   on if their sync manager triggers it (control bit 6).
/// - A master that changes a sync manager in use forces the slave down: to INIT with 0x0016 for the mailbox,
///   to PRE-OP with the corresponding code for process data.
/// - Outputs are passed on in OP only; inputs are refreshed in SAFE-OP and OP.
class EmulatedSlave {
 public:
  using AlState = drivers::ethercat::AlState;

  /// Powered, in INIT, without links. @throws std::invalid_argument see validate()
  explicit EmulatedSlave(SlaveDescription description, SlaveOptions options = {});

  // ---- for the board ----

  /// Setup. `application` must outlive the last frame.
  void attach(Application& application) noexcept { application_ = &application; }
  /// A reply for the master, padded with zeros to the mailbox length. One deep: false while the previous one
  /// waits behind a full mailbox, if it is too long, below PRE-OP, and without a mailbox.
  bool post_mailbox(std::span<const std::uint8_t> reply) noexcept;
  /// The firmware leaves its state: down to `state` with the error bit and this AL status code.
  void report_error(AlState state, std::uint16_t al_status_code) noexcept;
  AlState state() const noexcept { return machine_.state(); }
  std::uint16_t al_status_code() const noexcept { return machine_.code(); }
  const SlaveDescription& description() const noexcept { return description_; }

  // ---- for scripts and tests ----

  /// Off: no reaction, memory lost. On: INIT, registers and memory cleared. The EEPROM keeps its content.
  void set_power(bool on) noexcept;
  bool powered() const noexcept { return powered_; }
  /// A hung firmware leaves requests in the mailbox and returns no replies.
  void hang_mailbox(bool hung) noexcept;
  void set_fault(BoardFault fault, bool present) noexcept { application_->fault(fault, present); }
  SlaveController& controller() noexcept { return controller_; }
  const SlaveController& controller() const noexcept { return controller_; }

  // ---- for the bus ----

  void advance(std::chrono::nanoseconds step) noexcept;
  /// The end of the frame has passed: good or damaged.
  void end_frame(bool good) noexcept;

 private:
  void look_at_al_control() noexcept;
  std::uint16_t obstacle_to(AlState state) const noexcept;
  void check_running_configuration() noexcept;
  void follow_state(AlState before) noexcept;
  void shut_or_open_managers() noexcept;
  void serve_mailbox() noexcept;
  void deliver_outputs() noexcept;
  void refresh_inputs() noexcept;
  std::optional<std::size_t> index_of(SyncManagerUse use) const noexcept;
  bool event_of(std::uint32_t events, const std::optional<std::size_t>& manager) const noexcept;

  const SlaveDescription description_;
  const SlaveOptions options_;
  const std::vector<SyncManagerSetting> settings_;
  // Indices of the sync managers; empty: the slave does not have one.
  const std::optional<std::size_t> mailbox_out_;
  const std::optional<std::size_t> mailbox_in_;
  const std::optional<std::size_t> outputs_;
  const std::optional<std::size_t> inputs_;

  SlaveController controller_;
  AlStateMachine machine_;
  SlaveMailbox mailbox_;
  Application silent_;
  Application* application_ = &silent_;

  std::chrono::nanoseconds now_{};
  bool powered_ = true;
  bool al_control_waits_ = false;
  std::chrono::nanoseconds al_control_due_{};
  bool outputs_seen_ = false;  // since SAFE-OP was entered, without a watchdog timeout since
};

}  // namespace sim::bus
