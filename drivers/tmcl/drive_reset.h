/// @file
/// Clearing the two status flags that stay until they are cleared. Nothing does this by itself: create one of
/// these on the operator's explicit wish. The motor is told to stop throughout, because the drive goes on
/// with whatever it is commanded the moment its flag is gone.
#pragma once
#include <chrono>
#include <cstdint>

#include "drivers/tmcl/sequence.h"

namespace drivers::tmcl {

struct ResetConfig {
  std::chrono::milliseconds stop_first{20};  ///< process data with "stop" before the flag is cleared
  std::chrono::milliseconds patience{200};   ///< for the flag to go
  /// Waited on top of the thermal winding time, whose end the drive does not announce.
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

/// Status bit 17, I²t: reads the thermal winding time (parameter 25), waits so long, then SAP 29 = 1. Cleared
/// earlier, the drive does not accept it (TMCM-1630 manual); the microblx driver's immediate clearing fails.
class I2tReset final : public Sequence {
 public:
  explicit I2tReset(const ResetConfig& config = {},
                    std::chrono::nanoseconds cycle = std::chrono::milliseconds(1)) noexcept
      : Sequence(cycle), config_(config) {}

  /// What is left of the cooling, for a progress display; zero before it begins.
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
