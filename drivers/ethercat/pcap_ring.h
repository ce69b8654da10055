/// @file
/// The last frames on the wire, kept in memory and written as a capture when something went wrong.
///
///   PcapRing ring({.interface = "eth0"});
///   PreOpBus setup(link, &ring, {});
///   ...                                                   // a fault: look a little further, then keep still
///   ring.stop_after(100);
///   if (ring.stopped()) ring.write("fault.pcapng", "slave 3 (TMCM-1610) lost");   // from any thread
///
/// Wireshark decodes headerless TMCL mailboxes wrongly: start it with --disable-protocol ecat_mailbox.
#pragma once
#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <span>
#include <string>
#include <vector>

#include "drivers/ethercat/frame.h"
#include "drivers/ethercat/frame_tap.h"
#include "drivers/ethercat/monotonic_clock.h"

namespace drivers::ethercat {

/// Frames are stamped with CLOCK_MONOTONIC and put on the wall clock when they are written: a clock that is
/// set meanwhile neither reorders nor stretches the capture. Cycle: frame(), stop_after(), resume(). The
/// thread of the bus calls all but stopped() and, once that is true, write(), until it calls resume().
class PcapRing final : public FrameTap {
 public:
  using Clock = std::chrono::nanoseconds (*)() noexcept;

  struct Options {
    std::string interface;               ///< as the capture calls it
    std::size_t frames = 4096;           ///< two seconds of a 1 kHz cycle, 6 MB
    std::size_t bytes = kMaxFrameBytes;  ///< kept of each frame; the rest is only counted
    Clock clock = monotonic_now;         ///< in the cycle
  };

  /// Setup: all memory is taken, and touched, here. @throws std::invalid_argument without room for a frame.
  explicit PcapRing(const Options& options);

  void frame(Direction direction, std::span<const std::uint8_t> bytes) noexcept override;

  /// Keeps so many more frames and then no more. A second call while one is pending changes nothing, so the
  /// first fault counts. `frames` below Options::frames, or what led to the fault is overwritten.
  void stop_after(std::size_t frames) noexcept;
  bool stopped() const noexcept { return stopped_.load(std::memory_order_acquire); }
  /// Forgets all frames and records again.
  void resume() noexcept;

  std::size_t size() const noexcept;                     ///< frames kept
  std::uint64_t seen() const noexcept { return seen_; }  ///< frames since construction or resume()

  /// Setup: writes a pcapng file, oldest frame first; `comment` says why. Replaces what was there.
  /// @throws BusError with the path and what the system said.
  void write(const std::string& path, const std::string& comment = {}) const;
  /// The same into a stream. `wall_clock_minus_monotonic` is added to each stamp.
  void write(std::ostream& out, std::chrono::nanoseconds wall_clock_minus_monotonic,
             const std::string& comment = {}) const;

 private:
  struct Slot {
    std::chrono::nanoseconds stamp{};
    std::uint32_t original_bytes = 0;
    std::uint32_t kept_bytes = 0;
    Direction direction = Direction::kSent;
  };

  const std::string interface_;
  const std::size_t slot_bytes_;
  const Clock clock_;
  std::vector<Slot> slots_;
  std::vector<std::uint8_t> memory_;
  std::uint64_t seen_ = 0;
  std::size_t next_ = 0;  // slot of the next frame
  bool stopping_ = false;
  std::size_t left_ = 0;  // frames until stopped, while stopping
  std::atomic<bool> stopped_ = false;
};

/// CLOCK_REALTIME minus CLOCK_MONOTONIC, now.
std::chrono::nanoseconds wall_clock_minus_monotonic() noexcept;

}  // namespace drivers::ethercat
