/// @file
/// Program of a slave's own processor: the board behind an emulated slave controller.
#pragma once
#include <chrono>
#include <cstdint>
#include <span>

#include "drivers/ethercat/al_status.h"

namespace sim::bus {

/// Defects of a board that a fault script switches on and off.
enum class BoardFault : std::uint8_t {
  kStuckEncoder,  ///< the position does not change
  kHallSensor,
  kUndervoltage,
  kOvervoltage,
  kOvertemperature,
};

/// Derive a board from it and pass it to EmulatedSlave::attach(). All calls come from the thread that runs
/// the bus, between frames, and must neither allocate nor block. Time is emulated time, not a clock's.
///
/// Sequence: a frame ends → mailbox_received(), outputs_changed(), state_changed(); the owner of the bus
/// advances time → advance(), then inputs(). The earliest answer to a mailbox is therefore in the next frame,
/// as on hardware: call EmulatedSlave::post_mailbox() from either hook.
class Application {
 public:
  Application() = default;
  Application(const Application&) = delete;
  Application& operator=(const Application&) = delete;
  virtual ~Application() = default;

  /// Supply switched. Off: forget everything that is not in an EEPROM. On: the slave is in INIT.
  virtual void power_changed(bool /*on*/) noexcept {}
  virtual void state_changed(drivers::ethercat::AlState /*state*/) noexcept {}
  /// The whole mailbox as written by the master. False: busy; the mailbox stays full and is offered again
  /// after the next advance().
  virtual bool mailbox_received(std::span<const std::uint8_t> /*message*/) noexcept { return true; }
  /// In OP, for every complete set of outputs, changed or not; once when OP is entered.
  virtual void outputs_changed(std::span<const std::uint8_t> /*outputs*/) noexcept {}
  /// In SAFE-OP and OP, after every advance(): fill in the inputs, which are zeroed before.
  virtual void inputs(std::span<std::uint8_t> /*inputs*/) noexcept {}
  /// The master stopped writing outputs. In OP, state_changed(SAFE-OP) follows.
  virtual void watchdog_expired() noexcept {}
  virtual void advance(std::chrono::nanoseconds /*step*/) noexcept {}
  virtual void fault(BoardFault /*fault*/, bool /*present*/) noexcept {}
};

}  // namespace sim::bus
