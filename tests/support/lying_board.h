/// @file
/// A board whose process data differ from its measurements.
#pragma once
#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <random>
#include <span>

#include "sim/bus/tmcm_board.h"

namespace support {

/// The process data of a board on the wire; see drivers/tmcl/process_data.h, whose code is not shared.
struct BoardInputs {
  std::int32_t position = 0;
  std::int32_t current = 0;
  std::int32_t velocity = 0;
  std::uint32_t flags = 0;
  friend bool operator==(const BoardInputs&, const BoardInputs&) = default;
};

/// Replaces the board's inputs `now`; `begin` are its inputs at the onset.
using Lie = std::function<BoardInputs(const BoardInputs& begin, const BoardInputs& now)>;

/// Wraps the true board on its slave. Not for allocation-free cycles.
class LyingBoard final : public sim::bus::Application {
 public:
  /// Both must outlive this.
  LyingBoard(sim::bus::TmcmBoard& board, sim::bus::EmulatedSlave& slave) : board_(board), slave_(slave) {
    slave_.attach(*this);
  }
  LyingBoard(const LyingBoard&) = delete;
  LyingBoard& operator=(const LyingBoard&) = delete;
  ~LyingBoard() override { slave_.attach(board_); }

  void lie(Lie lie) {
    lie_ = std::move(lie);
    begin_ = now_;
  }
  void tell_truth() { lie_ = nullptr; }
  const BoardInputs& truth() const noexcept { return now_; }

  void power_changed(bool on) noexcept override { board_.power_changed(on); }
  void state_changed(drivers::ethercat::AlState state) noexcept override { board_.state_changed(state); }
  bool mailbox_received(std::span<const std::uint8_t> message) noexcept override {
    return board_.mailbox_received(message);
  }
  void outputs_changed(std::span<const std::uint8_t> outputs) noexcept override {
    board_.outputs_changed(outputs);
  }
  void watchdog_expired() noexcept override { board_.watchdog_expired(); }
  void advance(std::chrono::nanoseconds step) noexcept override { board_.advance(step); }
  void fault(sim::bus::BoardFault fault, bool present) noexcept override { board_.fault(fault, present); }
  void inputs(std::span<std::uint8_t> bytes) noexcept override {
    board_.inputs(bytes);
    if (bytes.size() < 16) return;
    now_ = {static_cast<std::int32_t>(word(bytes, 0)), static_cast<std::int32_t>(word(bytes, 4)),
            static_cast<std::int32_t>(word(bytes, 8)), word(bytes, 12)};
    if (!lie_) return;
    const BoardInputs shown = lie_(begin_, now_);
    put(bytes, 0, static_cast<std::uint32_t>(shown.position));
    put(bytes, 4, static_cast<std::uint32_t>(shown.current));
    put(bytes, 8, static_cast<std::uint32_t>(shown.velocity));
    put(bytes, 12, shown.flags);
  }

 private:
  static std::uint32_t word(std::span<const std::uint8_t> bytes, std::size_t at) noexcept {
    std::uint32_t value = 0;
    for (std::size_t i = 4; i-- > 0;) value = value << 8U | bytes[at + i];
    return value;
  }
  static void put(std::span<std::uint8_t> bytes, std::size_t at, std::uint32_t value) noexcept {
    for (std::size_t i = 0; i < 4; ++i) bytes[at + i] = static_cast<std::uint8_t>(value >> (8 * i));
  }

  sim::bus::TmcmBoard& board_;
  sim::bus::EmulatedSlave& slave_;
  Lie lie_;
  BoardInputs begin_;
  BoardInputs now_;
};

}  // namespace support
