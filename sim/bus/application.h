/// @file
/// What runs on a slave's own processor: the board behind an emulated slave controller.
#pragma once
#include <chrono>
#include <cstdint>
#include <span>

#include "drivers/ethercat/al_status.h"

namespace sim::bus {

/// Defects of a board that a fault script switches on and off.
enum class BoardFault : std::uint8_t {
  kStuckEncoder,  ///< the position no longer changes
  kHallSensor,
  kUndervoltage,
  kOvervoltage,
  kOvertemperature,
};

/// Derive a board from it and give it to EmulatedSlave::attach(). All calls come from the thread that runs
/// the bus, between frames, and must neither allocate nor block. Time is emulated time, never a clock's.
///
/// Life of a call: a frame ends → mailbox_received(), outputs_changed(), state_changed(); the owner of the
/// bus lets time pass → advance(), then inputs(). An answer to a mailbox therefore comes at the earliest
/// with the next frame, as on hardware: call EmulatedSlave::post_mailbox() from either hook.
class Application {
 public:
  Application() = default;
  Application(const Application&) = delete;
  Application& operator=(const Application&) = delete;
  virtual ~Application() = default;

  /// Supply switched. Off: forget everything that is not in an EEPROM. On: the slave is in INIT.
  virtual void power_changed(bool /*on*/) noexcept {}
  virtual void state_changed(drivers::ethercat::AlState /*state*/) noexcept {}
  /// The whole mailbox as the master wrote it. False: busy, the mailbox stays full and is offered again
  /// after the next advance().
  virtual bool mailbox_received(std::span<const std::uint8_t> /*message*/) noexcept { return true; }
  /// In OP, for every complete set of outputs the master wrote, changed or not; once on entering OP.
  virtual void outputs_changed(std::span<const std::uint8_t> /*outputs*/) noexcept {}
  /// In SAFE-OP and OP, after every advance(): fill in the inputs; they come zeroed.
  virtual void inputs(std::span<std::uint8_t> /*inputs*/) noexcept {}
  /// The master stopped writing outputs. In OP, state_changed(SAFE-OP) comes right after.
  virtual void watchdog_expired() noexcept {}
  virtual void advance(std::chrono::nanoseconds /*step*/) noexcept {}
  virtual void fault(BoardFault /*fault*/, bool /*present*/) noexcept {}
};

}  // namespace sim::bus
