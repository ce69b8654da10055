/// @file
/// Takes one slave to a state, one datagram at a time.
#pragma once
#include <array>
#include <chrono>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "drivers/ethercat/al_status.h"
#include "drivers/ethercat/frame.h"
#include "drivers/ethercat/slave.h"

namespace drivers::ethercat {

/// Time without process data after which a slave leaves OP: the default of the controllers, so that slaves
/// whose watchdog cannot be set have it too.
inline constexpr std::chrono::milliseconds kProcessDataWatchdog{100};

/// A register write that must be acknowledged, a number that must be in the SII, or a state to reach.
struct SetupStep {
  std::uint16_t address = 0;  ///< of a write; 0: no write
  std::uint8_t length = 0;
  std::array<std::uint8_t, 16> data{};
  std::uint16_t sii_word = 0;  ///< where `sii_value` must be; 0: request `state`
  std::uint32_t sii_value = 0;
  AlState state = AlState::kNone;
};

/// Verifies vendor, product and serial number of `slave`: before anything else is written to a device that
/// was not observed without interruption.
std::vector<SetupStep> steps_to_identify(const Slave& slave);
/// Disables the sync managers that the steps below write: an enabled one accepts no other start, length or
/// control, and another master may have left it enabled.
std::vector<SetupStep> steps_to_clear(const Slave& slave);
/// The steps that configure a slave from scratch, split at the state changes.
std::vector<SetupStep> steps_to_pre_op(const Slave& slave);
std::vector<SetupStep> steps_to_safe_op(const Slave& slave);
std::vector<SetupStep> steps_to_op();

/// Runs such steps. The caller puts one datagram into each frame and passes back its answer, so bring-up runs
/// all slaves in parallel and recovery uses the cyclic frame: the same code for both. Cycle-safe except
/// failure().
class SlaveSetup {
 public:
  enum class Status : std::uint8_t { kIdle, kRunning, kDone, kFailed };

  /// `steps` must outlive the run; `timeout` applies to each step.
  void begin(std::uint16_t station, std::span<const SetupStep> steps,
             std::chrono::nanoseconds timeout) noexcept;

  Status status() const noexcept { return status_; }
  /// Failed because the SII belongs to another device.
  bool is_another_device() const noexcept { return another_device_; }
  /// Adds the next datagram; false if there is nothing to do or it does not fit.
  bool request(FrameWriter& writer, std::uint8_t index, std::chrono::nanoseconds now) noexcept;
  /// The answer to the last request. Without one (frame lost) the request is repeated.
  void answer(const Datagram& datagram, std::chrono::nanoseconds now) noexcept;

  /// Setup: text on the failure, for Status::kFailed.
  std::string failure() const;

 private:
  enum class Ask : std::uint8_t {
    kWrite,
    kSiiRequest,
    kSiiRead,
    kSiiClearError,
    kStateRequest,
    kStateAcknowledge,
    kStateRead
  };
  /// For an error that the slave already had when it was asked.
  enum class Acknowledge : std::uint8_t { kNone, kAsked, kCleared };
  Ask first_ask() const noexcept;
  void take_sii(const Datagram& datagram, std::chrono::nanoseconds now) noexcept;
  void take_state(const Datagram& datagram, std::chrono::nanoseconds now) noexcept;
  void advance(std::chrono::nanoseconds now) noexcept;
  void fail(std::chrono::nanoseconds now) noexcept;
  void check_timeout(std::chrono::nanoseconds now) noexcept;

  std::uint16_t station_ = 0;
  std::span<const SetupStep> steps_;
  std::size_t step_ = 0;
  Status status_ = Status::kIdle;
  Ask ask_ = Ask::kWrite;
  bool started_ = false;
  Acknowledge acknowledge_ = Acknowledge::kNone;
  bool another_device_ = false;
  std::uint32_t sii_found_ = 0;
  std::chrono::nanoseconds timeout_{};
  std::chrono::nanoseconds step_begin_{};
  std::chrono::nanoseconds elapsed_{};
  std::uint8_t al_control_ = 0;  // last value written
  std::uint8_t al_status_ = 0;
  std::uint16_t al_code_ = 0;
  bool answered_ = false;
};

}  // namespace drivers::ethercat
