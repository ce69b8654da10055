/// @file
/// The youBot's gripper: two bars on stepper motors with self-locking spindles, behind the mailbox of arm
/// joint 5 (module 1, motor 0 and 1). It has no process data; everything here is a few telegrams.
///
/// Openings are microsteps per bar, 0 closed, positive open; on the wire opening is negative (official
/// driver). The motors count steps and have no sensors: a bar that holds an object still "reaches" its
/// target.
#pragma once
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "drivers/tmcl/axis_parameters.h"
#include "drivers/tmcl/sequence.h"

namespace drivers::tmcl {

inline constexpr std::size_t kGripperBars = 2;
/// 11.5 mm per bar (configuration of the official driver; its class default is 67000).
inline constexpr std::int32_t kGripperTravel = 66000;

/// Parameter 208 of the gripper; values are bit numbers.
enum class GripperFlag : std::uint8_t {
  kStallGuard = 0,
  kOvertemperature = 1,
  kOvertemperatureWarning = 2,
  kShortToGroundA = 3,
  kShortToGroundB = 4,
  kOpenLoadA = 5,
  kOpenLoadB = 6,
  kStandstill = 7,
};
const char* name(GripperFlag flag) noexcept;
constexpr bool has(std::int32_t flags, GripperFlag flag) noexcept {
  return (static_cast<std::uint32_t>(flags) >> static_cast<unsigned>(flag) & 1U) != 0;
}
constexpr bool is_stalled(std::int32_t flags) noexcept {
  return has(flags, GripperFlag::kStallGuard) && !has(flags, GripperFlag::kStandstill);
}

/// Converts between opening and wire value, in both directions.
constexpr std::int32_t flip(std::int32_t microsteps) noexcept {
  return microsteps == std::numeric_limits<std::int32_t>::min() ? std::numeric_limits<std::int32_t>::max()
                                                                : -microsteps;
}
constexpr Request gripper_move_to(std::uint8_t bar, std::int32_t opening) noexcept {
  return {kGripperModule, Command::kMoveToPosition, static_cast<std::uint8_t>(MoveType::kAbsolute), bar,
          flip(opening)};
}
constexpr Request gripper_open_by(std::uint8_t bar, std::int32_t microsteps) noexcept {
  return {kGripperModule, Command::kMoveToPosition, static_cast<std::uint8_t>(MoveType::kRelative), bar,
          flip(microsteps)};
}
/// Pass the reply's value to flip().
constexpr Request gripper_position(std::uint8_t bar) noexcept {
  return get(gripper_parameter("actual_position"), bar);
}

struct GripperConfig {
  std::chrono::milliseconds timeout{4000};       ///< per motion of both bars (official driver)
  std::chrono::milliseconds poll_interval{100};  ///< leaves the mailbox of joint 5 free for others in between
  std::int32_t travel = kGripperTravel;
};

/// Common part of the two sequences: starts both bars, and polls whether they have arrived. Others command
/// arm joint 5, whose mailbox is used, at the same time: Action::drive stays empty.
class GripperSequence : public Sequence {
 protected:
  GripperSequence(const GripperConfig& config, std::chrono::nanoseconds cycle) noexcept
      : Sequence(cycle), config_(config) {}

  std::optional<DriveOutput> rest(Progress /*progress*/) const noexcept override { return std::nullopt; }
  using BarRequests = std::array<Request, kGripperBars>;
  /// True in the cycle in which all have been answered. Call it every cycle until then.
  bool ask_both(const BarRequests& requests, Action& action) noexcept;
  /// True once both bars report their target reached. Fails with kTooSlow.
  bool both_arrived(Action& action) noexcept;
  std::int32_t value(std::size_t bar) const noexcept { return values_[bar]; }

  GripperConfig config_;

 private:
  std::size_t bar_ = 0;
  std::array<std::int32_t, kGripperBars> values_{};
  std::chrono::nanoseconds next_poll_{0};
};

/// Moves both bars to the same opening, then reads their positions.
class GripperMotion final : public GripperSequence {
 public:
  explicit GripperMotion(std::int32_t opening, const GripperConfig& config = {},
                         std::chrono::nanoseconds cycle = std::chrono::milliseconds(1)) noexcept;

  /// For a finished sequence.
  std::int32_t opening(std::size_t bar) const noexcept { return flip(value(bar)); }

 private:
  enum class State : std::uint8_t { kMove, kWait, kRead };
  Action run(const DriveInput& input) noexcept override;

  std::int32_t opening_;
  State state_ = State::kMove;
};

/// Stops both bars with acknowledgement: a lost telegram fails the sequence.
class GripperStop final : public GripperSequence {
 public:
  explicit GripperStop(std::chrono::nanoseconds cycle = std::chrono::milliseconds(1)) noexcept
      : GripperSequence({}, cycle) {}

 private:
  Action run(const DriveInput& input) noexcept override;
};

/// Finds the closed position, as the official driver does: opens by the whole travel, closes by it, losing
/// steps at the stop, and defines that as zero. User variable 16 of the gripper stores this until power-off.
class GripperCalibration final : public GripperSequence {
 public:
  enum class Repeat : std::uint8_t { kWhenNeeded, kAlways };
  explicit GripperCalibration(Repeat repeat, const GripperConfig& config = {},
                              std::chrono::nanoseconds cycle = std::chrono::milliseconds(1)) noexcept
      : GripperSequence(config, cycle), repeat_(repeat) {}

 private:
  enum class State : std::uint8_t { kAsk, kOpen, kWaitOpen, kClose, kWaitClosed, kZero, kRemember };
  Action run(const DriveInput& input) noexcept override;

  Repeat repeat_;
  State state_ = State::kAsk;
};

}  // namespace drivers::tmcl
