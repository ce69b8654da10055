/// @file
/// A line of emulated slaves, as seen by a frame.
#pragma once
#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "sim/bus/emulated_slave.h"
#include "sim/bus/passing_frame.h"

namespace sim::bus {

/// Slaves in a line: port 1 of each goes to port 0 of the next. Cable k leads into slave k; cable 0 comes
/// from the master. One thread; process() and advance() neither allocate, lock nor throw.
class EmulatedBus {
 public:
  /// Delays of 100BASE-TX: 10 m of cable and two transceivers; one pass through a slave.
  static constexpr std::chrono::nanoseconds kCableDelay{150};
  static constexpr std::chrono::nanoseconds kPassDelay{300};

  /// Setup: appends a slave. The reference stays valid. @throws std::invalid_argument see validate()
  EmulatedSlave& add(SlaveDescription description, SlaveOptions options = {});
  std::size_t size() const noexcept { return nodes_.size(); }
  EmulatedSlave& slave(std::size_t position) noexcept { return *nodes_[position].slave; }

  /// Sends `frame`, without check sequence, through all reachable slaves and back, in place. False if it does
  /// not come back: there is no powered slave to return it, it is damaged on the way, or PassingFrame finds
  /// it invalid, in which case the slave that notices invalidates its check sequence and counts it.
  bool process(std::span<std::uint8_t> frame) noexcept;
  /// Another master writes `value` `count` times to this slave, from `first_register` on, in a frame that is
  /// not visible on the wire.
  void write_as_another_master(std::size_t position, std::uint16_t first_register, std::uint16_t value,
                               std::size_t count = 1) noexcept;
  /// Advances emulated time for all slaves.
  void advance(std::chrono::nanoseconds step) noexcept;
  std::chrono::nanoseconds now() const noexcept { return now_; }
  /// From the first bit sent to the last bit back: wire time at 100 Mbit/s and the delays of the line.
  std::chrono::nanoseconds round_trip(std::size_t frame_bytes) const noexcept;

  /// Unplugs cable `position`, or plugs it in. Slaves behind it keep their power.
  void set_cable(std::size_t position, bool plugged) noexcept;
  /// A slave without power also breaks the line.
  void set_power(std::size_t position, bool on) noexcept;
  /// Damages the next `frames` frames on cable `position`.
  void damage(std::size_t position, std::uint32_t frames) noexcept {
    nodes_[position].damaged_frames += frames;
  }

 private:
  struct Node {
    std::unique_ptr<EmulatedSlave> slave;
    bool plugged = true;
    std::uint32_t damaged_frames = 0;
  };

  void update_links() noexcept;
  std::size_t reached() const noexcept;
  FrameTimes times_at(std::size_t position, std::size_t slaves) const noexcept;

  std::vector<Node> nodes_;
  std::chrono::nanoseconds now_{};
  PassingFrame passing_;
};

}  // namespace sim::bus
