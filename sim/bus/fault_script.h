/// @file
/// Faults on an emulated bus and their times. The same script has the same effect every time.
#pragma once
#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sim/bus/emulated_bus.h"

namespace sim::bus {

enum class FaultKind : std::uint8_t {
  // For the next `count` frames. The slaves process all of them unchanged, except for the first kind.
  kDropRequest,    ///< lost before the first slave
  kDropReply,      ///< processed, then lost
  kDelay,          ///< comes back `delay` later: faster frames overtake it
  kDuplicate,      ///< comes back twice
  kTruncate,       ///< comes back as its first `offset` bytes
  kCorrupt,        ///< byte `offset` of the reply, counted from the Ethernet header, is XORed with `mask`
  kWrongCounter,   ///< `counter_change` is added to the working counter of datagram number `datagram`
  kDamageOnCable,  ///< damaged on cable `slave`: slaves from there on count an invalid frame and ignore it
  // For `duration`, forever if that is 0.
  kSlaveOff,     ///< `slave` without power, then back in INIT; everything behind it is unreachable meanwhile
  kCableOut,     ///< cable `slave` unplugged
  kBrownOut,     ///< every slave without power
  kMailboxHung,  ///< `slave` neither accepts requests nor answers
  kBoardFault,   ///< `board_fault` of the application on `slave`
  // Once.
  /// another master, whose frames are not seen, writes `count` times `value` to `slave`, from register
  /// `offset` on
  kForeignWrite,
};

struct FaultEvent {
  FaultKind kind = FaultKind::kDropReply;
  std::chrono::nanoseconds at{};            ///< emulated time since the wire was created; without `at_frame`
  std::optional<std::uint64_t> at_frame{};  ///< starts with this frame; the first one sent is number 0
  std::uint32_t count = 1;
  std::chrono::nanoseconds duration{};
  std::uint32_t slave = 0;  ///< position on the bus, from 0
  std::chrono::nanoseconds delay{};
  std::uint32_t offset = 0;
  std::uint8_t mask = 0xFF;
  std::int32_t counter_change = -1;
  std::uint32_t datagram = 0;
  std::uint16_t value = 0;
  BoardFault board_fault = BoardFault::kStuckEncoder;
};

/// Effect of the script on one frame.
struct FrameFate {
  bool request_lost = false;
  bool reply_lost = false;
  bool twice = false;
  std::chrono::nanoseconds delay{};
};

/// Executes a script. Cycle: begin_frame(), spoil() and run_until() do not allocate.
class FaultPlayer {
 public:
  /// `bus` must be complete and outlive the player.
  /// @throws std::invalid_argument listing every invalid event: a missing slave, no frames, ...
  FaultPlayer(EmulatedBus& bus, std::vector<FaultEvent> events);

  /// Before each frame that is sent, with emulated time `now`.
  FrameFate begin_frame(std::chrono::nanoseconds now) noexcept;
  /// Damages the reply to that frame; returns its new size.
  std::size_t spoil(std::span<std::uint8_t> reply) noexcept;

  /// Starts and ends what is due at `now`.
  void run_until(std::chrono::nanoseconds now) noexcept;
  /// Next time at which an event starts or ends by time alone.
  std::optional<std::chrono::nanoseconds> next_change() const noexcept;
  /// True if nothing is active and nothing will follow, so that a test knows where recovery starts.
  bool finished() const noexcept;

 private:
  enum class Phase : std::uint8_t { kWaiting, kActive, kOver };
  struct Entry {
    FaultEvent event;
    Phase phase = Phase::kWaiting;
    std::uint32_t frames_left = 0;
    std::chrono::nanoseconds end{};
    bool on_this_frame = false;
  };

  void begin(Entry& entry, std::chrono::nanoseconds now) noexcept;
  void apply_to_bus(const FaultEvent& event, bool present) noexcept;

  EmulatedBus& bus_;
  std::vector<Entry> entries_;
  std::uint64_t frames_ = 0;
};

}  // namespace sim::bus
