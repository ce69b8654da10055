/// @file
/// Keeps the last frames in memory, and writes them as a capture after a fault.
///
///   PcapRing ring({.interface = "eth0"});
///   PreOpBus setup(link, &ring, {});
///   ...                                                   // a fault: record some more frames, then stop
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

/// Frames are stamped with CLOCK_MONOTONIC and converted to wall-clock time when they are written, so that
/// setting the clock neither reorders nor stretches the capture. Cycle: frame(), stop_after(), resume(). The
/// bus thread makes all calls except stopped() and, once that is true and until resume(), write().
class PcapRing final : public FrameTap {
 public:
  using Clock = std::chrono::nanoseconds (*)() noexcept;

  struct Options {
    std::string interface;               ///< name in the capture
    std::size_t frames = 4096;           ///< two seconds of a 1 kHz cycle, 6 MB
    std::size_t bytes = kMaxFrameBytes;  ///< stored of each frame; the rest is only counted
    Clock clock = monotonic_now;         ///< used in the cycle
  };

  /// Setup: allocates and touches all memory. @throws std::invalid_argument without room for a frame.
  explicit PcapRing(const Options& options);

  void frame(Direction direction, std::span<const std::uint8_t> bytes) noexcept override;

  /// Records `frames` more frames and then stops. A second call while one is pending changes nothing, so the
  /// first fault counts. `frames` must be below Options::frames, or the frames before the fault are
  /// overwritten.
  void stop_after(std::size_t frames) noexcept;
  bool stopped() const noexcept { return stopped_.load(std::memory_order_acquire); }
  /// Drops all frames and records again.
  void resume() noexcept;

  std::size_t size() const noexcept;                     ///< frames kept
  std::uint64_t seen() const noexcept { return seen_; }  ///< frames since construction or resume()

  /// Setup: writes a pcapng file, oldest frame first; `comment` is the reason. Replaces an existing file.
  /// @throws BusError with the path and the system's error.
  void write(const std::string& path, const std::string& comment = {}) const;
  /// The same to a stream. `wall_clock_minus_monotonic` is added to each stamp.
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
