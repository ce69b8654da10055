/// @file
/// Finds the rotor angle of a motor controller, once after power-up.
#pragma once
#include <chrono>
#include <cstdint>
#include <cstdlib>

#include "drivers/tmcl/firmware_version.h"

namespace sim::bus {

/// Firmware 1.48 takes a fixed time on command, at standstill. Firmware 2.0 finds it while turning: after one
/// electrical revolution. Both fail with a Hall sensor error; 2.0 also if the rotor does not get that far in
/// time, because the rotor or its encoder is blocked. How a real board fails is not documented.
class CommutationStartUp {
 public:
  enum class State : std::uint8_t { kUnknown, kSearching, kKnown, kFailed };
  /// Half of the five seconds that the official driver waits.
  static constexpr std::chrono::nanoseconds kLongestTurn = std::chrono::milliseconds(2500);

  CommutationStartUp(drivers::tmcl::Firmware firmware, std::chrono::nanoseconds standing_time,
                     std::int32_t ticks_per_electrical_rev) noexcept
      : turns_(firmware == drivers::tmcl::Firmware::k200),
        limit_(turns_ ? kLongestTurn : standing_time),
        ticks_(ticks_per_electrical_rev) {}

  State state() const noexcept { return state_; }
  bool known() const noexcept { return state_ == State::kKnown; }
  bool searching() const noexcept { return state_ == State::kSearching; }
  bool failed() const noexcept { return state_ == State::kFailed; }
  bool turns() const noexcept { return turns_; }

  void forget() noexcept { state_ = State::kUnknown; }
  /// Starts, also after a failure; no effect if the commutation is known or being searched.
  void start(std::int32_t position_ticks) noexcept {
    if (state_ == State::kKnown || state_ == State::kSearching) return;
    state_ = State::kSearching;
    from_ticks_ = position_ticks;
    elapsed_ = {};
  }
  /// The motor is no longer commanded to turn.
  void give_up() noexcept {
    if (state_ == State::kSearching) state_ = State::kUnknown;
  }
  void update(std::int32_t position_ticks, bool hall_sensors_good, std::chrono::nanoseconds step) noexcept {
    if (state_ != State::kSearching) return;
    elapsed_ += step;
    const auto moved = static_cast<std::int32_t>(static_cast<std::uint32_t>(position_ticks) -
                                                 static_cast<std::uint32_t>(from_ticks_));
    const bool found = turns_ ? std::abs(std::int64_t{moved}) >= ticks_ : elapsed_ >= limit_;
    if (found && hall_sensors_good) {
      state_ = State::kKnown;
    } else if (elapsed_ >= limit_) {
      state_ = State::kFailed;
    }
  }

 private:
  bool turns_;
  std::chrono::nanoseconds limit_;
  std::int32_t ticks_;
  State state_ = State::kUnknown;
  std::int32_t from_ticks_ = 0;
  std::chrono::nanoseconds elapsed_{};
};

}  // namespace sim::bus
