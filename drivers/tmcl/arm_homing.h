/// @file
/// Finds the zero of one arm joint at its end stop. The official driver (calibrateManipulator) treats the
/// first current above a threshold as the stop, without time limit; a blocked joint gets a false zero there.
/// Here a stop requires current and standstill together for a while, twice at the same position with free
/// travel in between:
///
///   rest -> approach -> touch -> back off -> return -> touch again -> no current -> SAP 1 = 0 -> remember
///   (user var. 16)
///
/// One joint cannot detect an obstacle as hard as the stop, at rest in front of it. Fold the arm by hand
/// first, as the manuals require, and watch.
#pragma once
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>

#include "drivers/tmcl/sequence.h"

namespace drivers::tmcl {

/// All five stops are in the positive direction of the motor, so positions are negative afterwards.
struct HomingConfig {
  std::int32_t speed_rpm = 0;             ///< of the motor
  std::int32_t threshold_mA = 0;          ///< magnitude: valid also for drives that report no sign
  std::int32_t longest_travel_ticks = 0;  ///< full travel of the joint, plus a margin
  std::int32_t back_off_ticks = 0;        ///< free travel that the joint has to show
  std::int32_t tolerance_ticks = 0;       ///< between the two touches, and while the counter is set
  /// A joint that moves less than this during `contact` is at rest. The slowest one travels 95 ticks in that
  /// time.
  std::int32_t standstill_ticks = 20;
  std::chrono::milliseconds contact{20};  ///< short, because the motor pushes with full current during it
  /// The same if the joint has hardly moved since the command: breakaway looks like a stop for a while.
  std::chrono::milliseconds contact_from_rest{200};
  /// Time-out with neither motion nor current above the threshold. The velocity controller needs time to
  /// build up current.
  std::chrono::milliseconds no_motion{2000};
  /// Standstill for this time before the joint is commanded to move: an arm that has just been powered still
  /// sinks, and would seem to move against its command.
  std::chrono::milliseconds rest{100};
  std::chrono::milliseconds release{100};  ///< without current before the counter is set (official driver)
  bool even_if_remembered = false;         ///< home even if user variable 16 says it is done
};

inline constexpr std::int32_t kTicksPerMotorRevolution = 4000;
inline constexpr std::size_t kArmJoints = 5;

/// At 6 degrees per second: one degree is speed / (6 · 60) of a motor revolution. Back-off 3 degrees,
/// tolerance 1.
constexpr HomingConfig homing_at(std::int32_t speed_rpm, std::int32_t threshold_mA,
                                 std::int32_t longest_travel_ticks) noexcept {
  const std::int32_t ticks_per_degree = speed_rpm * kTicksPerMotorRevolution / 360;
  return {.speed_rpm = speed_rpm,
          .threshold_mA = threshold_mA,
          .longest_travel_ticks = longest_travel_ticks,
          .back_off_ticks = 3 * ticks_per_degree,
          .tolerance_ticks = ticks_per_degree};
}

/// Joint 1 to 5. Speed and threshold from the official driver's configuration; travel is the range in the
/// robot description plus 5 %.
inline constexpr std::array<HomingConfig, kArmJoints> kArmHoming{
    homing_at(156, 2000, 615'000), homing_at(156, 500, 282'000), homing_at(100, 1000, 346'500),
    homing_at(71, 500, 170'000), homing_at(71, 500, 277'500)};

/// Detects current and standstill together for a while.
class ContactDetector {
 public:
  /// True once the joint has touched something for `long_enough`.
  bool update(const DriveInput& input, std::chrono::nanoseconds now, const HomingConfig& config,
              std::chrono::nanoseconds long_enough) noexcept;
  void reset() noexcept { pressing_ = false; }

 private:
  bool pressing_ = false;
  std::int32_t position_ticks_ = 0;
  std::chrono::nanoseconds since_{0};
};

/// Homes one joint; the official driver homes all five of an arm at once. The position counter jumps to zero
/// at the end: reset the PositionUnwrapper then. Ends with zero current after success, as the official driver
/// does, and with the motor stopped after failure.
class ArmHoming final : public Sequence {
 public:
  explicit ArmHoming(const HomingConfig& config,
                     std::chrono::nanoseconds cycle = std::chrono::milliseconds(1)) noexcept;

  /// For a finished sequence: user variable 16 said that the zero is still valid.
  bool was_homed() const noexcept { return was_homed_; }
  /// Travel towards the stop: the operator can compare it with the joint's initial position.
  std::int32_t travel_ticks() const noexcept { return travel_ticks_; }

 private:
  enum class State : std::uint8_t {
    kAsk,
    kSettle,
    kApproach,
    kBackOff,
    kReturn,
    kRelease,
    kZero,
    kVerify,
    kRemember
  };
  Action run(const DriveInput& input) noexcept override;
  std::optional<DriveOutput> rest(Progress progress) const noexcept override;
  void enter(State state, const DriveInput& input) noexcept;
  void settle(const DriveInput& input) noexcept;
  void approach(const DriveInput& input) noexcept;
  void go_back(const DriveInput& input) noexcept;
  void come_again(const DriveInput& input) noexcept;
  bool touches(const DriveInput& input, std::int32_t advance_ticks) noexcept;
  void await_motion(const DriveInput& input, std::int32_t advance_ticks) noexcept;
  /// Twice the nominal time for the distance, plus `no_motion` for the controller to unwind and start.
  std::chrono::nanoseconds time_for(std::int64_t distance_ticks) const noexcept;

  HomingConfig config_;
  State state_ = State::kAsk;
  ContactDetector contact_;
  bool was_homed_ = false;
  std::int32_t entry_ticks_ = 0;  // position at the start of the state
  std::int32_t touch_ticks_ = 0;  // position of the first touch
  std::int32_t travel_ticks_ = 0;
  std::int32_t advanced_to_ticks_ = 0;  // progress last seen by await_motion()
  std::chrono::nanoseconds advanced_at_{0};
  std::int32_t settled_ticks_ = 0;  // position of the last standstill, in settle()
  std::chrono::nanoseconds settled_at_{0};
};

}  // namespace drivers::tmcl
