/// @file
/// A passing frame as seen by a slave controller (ESC data sheet section I, chapter 2 and section 14.1).
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/ethercat/frame.h"

namespace sim::bus {

/// The rules are the controller's, not those of our master's parser, which checks its own answers:
/// - Datagrams follow each other by their own lengths, as long as each announces another one. The length in
///   the EtherCAT header is ignored, and so is everything behind the last datagram.
/// - A command that the controller does not know does nothing; the next datagram is processed as usual.
/// - A VLAN tag is skipped.
/// - A frame that ends before its datagrams do is damaged: complete ones are processed, but no register is
///   written and no buffer exchanged, and the frame comes back invalid.
/// - So does a frame of another EtherType or type, of which nothing is processed.
class PassingFrame {
 public:
  PassingFrame() = default;
  explicit PassingFrame(std::span<std::uint8_t> frame) noexcept { look_at(frame); }

  /// Replaces the previous frame. The datagrams are views into `frame`, which must outlive them. Clearing
  /// their array takes longer than parsing a frame: keep one object for many frames.
  void look_at(std::span<std::uint8_t> frame) noexcept;

  std::span<drivers::ethercat::Datagram> datagrams() noexcept { return std::span(datagrams_).first(count_); }
  /// False: the controller invalidates the check sequence.
  bool valid() const noexcept { return valid_; }

 private:
  static constexpr std::size_t kMaxDatagrams =
      (drivers::ethercat::kMaxFrameBytes - drivers::ethercat::kFrameHeaderBytes) /
      drivers::ethercat::kDatagramOverheadBytes;

  std::array<drivers::ethercat::Datagram, kMaxDatagrams> datagrams_;
  std::size_t count_ = 0;
  bool valid_ = false;
};

}  // namespace sim::bus
