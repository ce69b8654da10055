/// @file
/// Commutation start-up of one drive: needed once after power-up, before any motion. Official driver
/// (doJointCommutation), with an end to every wait.
#pragma once
#include <chrono>
#include <cstdint>

#include "drivers/tmcl/sequence.h"

namespace drivers::tmcl {

struct CommutationConfig {
  Firmware firmware = Firmware::k148;
  /// Commanded afterwards. With firmware 2.0 the official driver gives arm joints zero current and wheels
  /// zero velocity, the latter because of a firmware bug with zero current after start-up.
  DriveOutput rest = kStopMotor;
  std::int32_t velocity_rpm = 100;  ///< firmware 2.0 finds its commutation while turning; the joint moves!
  std::chrono::milliseconds timeout{5000};
  std::chrono::milliseconds settle{10};  ///< between bit 15 and reading parameter 15
};

/// Reads parameter 15; a drive that is initialised is left alone. Otherwise firmware 1.48 gets mode 7,
/// firmware 2.0 a velocity, until status bit 15 is set; then parameter 15 must read 1. A joint pressed
/// against its end stop usually fails. Error flags end it at once; in particular the time-out flag is not
/// cleared here. The flag of an attempt that failed before stands until this one has begun, so it counts
/// only once it has been seen to go.
class Commutation final : public Sequence {
 public:
  explicit Commutation(const CommutationConfig& config,
                       std::chrono::nanoseconds cycle = std::chrono::milliseconds(1)) noexcept
      : Sequence(cycle), config_(config) {}

  /// Of a sequence that is done: it was before.
  bool was_initialized() const noexcept { return was_initialized_; }

 private:
  enum class State : std::uint8_t { kAsk, kStart, kSettle, kVerify };
  Action run(const DriveInput& input) noexcept override;
  std::optional<DriveOutput> rest(Progress progress) const noexcept override;

  CommutationConfig config_;
  State state_ = State::kAsk;
  bool was_initialized_ = false;
  bool old_error_ = true;  // the flag may be an earlier attempt's
};

}  // namespace drivers::tmcl
