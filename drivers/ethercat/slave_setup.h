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

/// How long a slave waits for process data before it leaves OP: a controller's own default, so that one whose
/// watchdog cannot be set has it too.
inline constexpr std::chrono::milliseconds kProcessDataWatchdog{100};

/// A register write that must be acknowledged, a number that must be found in the SII, or a state to be
/// reached.
struct SetupStep {
  std::uint16_t address = 0;  ///< of a write; 0: it is none
  std::uint8_t length = 0;
  std::array<std::uint8_t, 16> data{};
  std::uint16_t sii_word = 0;  ///< where `sii_value` must be; 0: `state` is asked for
  std::uint32_t sii_value = 0;
  AlState state = AlState::kNone;
};

/// Makes sure that vendor, product and serial number are those of `slave`: before anything else is written to
/// a device that was not seen without interruption.
std::vector<SetupStep> steps_to_identify(const Slave& slave);
/// Disables the sync managers that the steps below write: one that is enabled takes no other start, length or
/// control, and another master may have left it so.
std::vector<SetupStep> steps_to_clear(const Slave& slave);
/// The steps that configure a slave from scratch; the state changes split them.
std::vector<SetupStep> steps_to_pre_op(const Slave& slave);
std::vector<SetupStep> steps_to_safe_op(const Slave& slave);
std::vector<SetupStep> steps_to_op();

/// Runs such steps. The caller puts one datagram into each frame and hands back its answer, so bring-up runs
/// all slaves side by side and recovery rides in the cyclic frame: the same code for both. Cycle-safe but
/// for failure().
class SlaveSetup {
 public:
  enum class Status : std::uint8_t { kIdle, kRunning, kDone, kFailed };

  /// `steps` outlive the run; `timeout` holds for each of them.
  void begin(std::uint16_t station, std::span<const SetupStep> steps,
             std::chrono::nanoseconds timeout) noexcept;

  Status status() const noexcept { return status_; }
  /// Failed because the SII is another device's.
  bool is_another_device() const noexcept { return another_device_; }
  /// Adds the next datagram; false when nothing is to be done or it does not fit.
  bool request(FrameWriter& writer, std::uint8_t index, std::chrono::nanoseconds now) noexcept;
  /// The answer to the last request. Without one (frame lost) the request is simply made again.
  void answer(const Datagram& datagram, std::chrono::nanoseconds now) noexcept;

  /// Setup: what went wrong in words, for Status::kFailed.
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
  /// Of an error that the slave had already when it was asked.
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
  std::uint8_t al_control_ = 0;  // as written last
  std::uint8_t al_status_ = 0;
  std::uint16_t al_code_ = 0;
  bool answered_ = false;
};

}  // namespace drivers::ethercat
