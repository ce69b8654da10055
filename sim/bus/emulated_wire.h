/// @file
/// The wire between a master and the emulated bus: frames take time and are subject to the script's faults.
#pragma once
#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "drivers/ethercat/frame.h"
#include "sim/bus/emulated_bus.h"
#include "sim/bus/fault_script.h"

namespace sim::bus {

struct WireOptions {
  /// False: a reply is available at once. True: after EmulatedBus::round_trip(), so that emulated time
  /// includes how long an exchange occupies a 100 Mbit/s line.
  bool timed = false;
  std::vector<FaultEvent> faults{};
};

/// Used by BusLink in the process, and by a server that forwards frames from a network interface. One thread.
/// Cycle: send(), receive() and advance() neither allocate, lock nor throw.
class EmulatedWire {
 public:
  static constexpr std::size_t kCapacity = 32;  ///< replies under way; more are dropped and counted

  /// `bus` must be complete and outlive the wire. @throws std::invalid_argument see FaultPlayer
  explicit EmulatedWire(EmulatedBus& bus, WireOptions options = {});

  void send(std::span<const std::uint8_t> frame) noexcept;
  /// Copies the oldest due reply into `buffer` (truncated if that is too small); returns its size, 0: none.
  std::size_t receive(std::span<std::uint8_t> buffer) noexcept;
  /// When the next reply is due, possibly already; empty if none is under way.
  std::optional<std::chrono::nanoseconds> next_reply() const noexcept;

  /// Advances emulated time on the bus, stopping at the script's events.
  void advance(std::chrono::nanoseconds step) noexcept;
  std::chrono::nanoseconds now() const noexcept { return bus_.now() - start_; }
  bool timed() const noexcept { return timed_; }

  const FaultPlayer& faults() const noexcept { return player_; }
  std::uint64_t dropped() const noexcept { return dropped_; }  ///< for lack of capacity

 private:
  struct Reply {
    std::chrono::nanoseconds due{};
    std::size_t size = 0;
    std::size_t slot = 0;  // where its bytes are
  };

  void enqueue(std::span<const std::uint8_t> frame, std::chrono::nanoseconds due) noexcept;

  EmulatedBus& bus_;
  FaultPlayer player_;
  const bool timed_;
  const std::chrono::nanoseconds start_;
  std::array<Reply, kCapacity> replies_{};  // under way, in order of arrival; followed by free slots
  std::size_t under_way_ = 0;
  std::array<std::array<std::uint8_t, drivers::ethercat::kMaxFrameBytes>, kCapacity> slots_{};
  std::uint64_t dropped_ = 0;
};

}  // namespace sim::bus
