/// @file
/// Clears the two latched status flags. Nothing clears them automatically: create one of these on the
/// operator's explicit request. The motor is commanded to stop throughout, because the drive follows any
/// command as soon as its flag is cleared.
#pragma once
#include <chrono>
#include <cstdint>

#include "drivers/tmcl/sequence.h"

namespace drivers::tmcl {

struct ResetConfig {
  std::chrono::milliseconds stop_first{20};  ///< process data with "stop" before the flag is cleared
  std::chrono::milliseconds patience{200};   ///< time-out for the flag to clear
  /// Added to the thermal winding time, whose end the drive does not report.
  std::chrono::milliseconds cooling_margin{500};
};

/// Status bit 16, the drive's watchdog: SAP 158 = 1.
class TimeoutReset final : public Sequence {
 public:
  explicit TimeoutReset(const ResetConfig& config = {},
                        std::chrono::nanoseconds cycle = std::chrono::milliseconds(1)) noexcept
      : Sequence(cycle), config_(config) {}

 private:
  enum class State : std::uint8_t { kStop, kClear, kVerify };
  Action run(const DriveInput& input) noexcept override;
  std::optional<DriveOutput> rest(Progress /*progress*/) const noexcept override { return kStopMotor; }

  ResetConfig config_;
  State state_ = State::kStop;
};

/// Status bit 17, I²t: reads the thermal winding time (parameter 25), waits for it, then SAP 29 = 1. The
/// drive does not accept it earlier (TMCM-1630 manual); the microblx driver's immediate clearing fails.
class I2tReset final : public Sequence {
 public:
  explicit I2tReset(const ResetConfig& config = {},
                    std::chrono::nanoseconds cycle = std::chrono::milliseconds(1)) noexcept
      : Sequence(cycle), config_(config) {}

  /// Remaining cooling time, for a progress display; zero before it begins.
  std::chrono::nanoseconds remaining() const noexcept;

 private:
  enum class State : std::uint8_t { kReadTime, kCool, kClear, kVerify };
  Action run(const DriveInput& input) noexcept override;
  std::optional<DriveOutput> rest(Progress /*progress*/) const noexcept override { return kStopMotor; }

  ResetConfig config_;
  State state_ = State::kReadTime;
  std::chrono::nanoseconds cooling_{0};
};

}  // namespace drivers::tmcl
