/// @file
/// Commutation start-up of one drive: needed once after power-up, before any motion. As in the official
/// driver (doJointCommutation), with a time-out for every wait.
#pragma once
#include <chrono>
#include <cstdint>

#include "drivers/tmcl/sequence.h"

namespace drivers::tmcl {

struct CommutationConfig {
  Firmware firmware = Firmware::k148;
  /// Command afterwards. With firmware 2.0 the official driver commands zero current to arm joints and zero
  /// velocity to wheels, because of a firmware bug with zero current after start-up.
  DriveOutput rest = kStopMotor;
  std::int32_t velocity_rpm = 100;  ///< firmware 2.0 finds its commutation while turning; the joint moves!
  std::chrono::milliseconds timeout{5000};
  std::chrono::milliseconds settle{10};  ///< between bit 15 and reading parameter 15
};

/// Reads parameter 15; an initialised drive is left alone. Otherwise firmware 1.48 gets mode 7, firmware 2.0
/// a velocity, until status bit 15 is set; then parameter 15 must read 1. A joint pressed against its end
/// stop usually fails. Error flags end the sequence at once; in particular it does not clear the time-out
/// flag. The flag of an earlier failed attempt stays until this one has begun, so it counts only after it has
/// been seen cleared.
class Commutation final : public Sequence {
 public:
  explicit Commutation(const CommutationConfig& config,
                       std::chrono::nanoseconds cycle = std::chrono::milliseconds(1)) noexcept
      : Sequence(cycle), config_(config) {}

  /// For a finished sequence: the drive was already initialised.
  bool was_initialized() const noexcept { return was_initialized_; }

 private:
  enum class State : std::uint8_t { kAsk, kStart, kSettle, kVerify };
  Action run(const DriveInput& input) noexcept override;
  std::optional<DriveOutput> rest(Progress progress) const noexcept override;

  CommutationConfig config_;
  State state_ = State::kAsk;
  bool was_initialized_ = false;
  bool old_error_ = true;  // the flag may be from an earlier attempt
};

}  // namespace drivers::tmcl
