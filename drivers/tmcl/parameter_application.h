/// @file
/// Gives a drive the parameters its owner wants it to run with: those that were set at start-up are in its
/// RAM only, so a drive that lost power has to be given them again before it moves.
#pragma once
#include <chrono>
#include <cstdint>
#include <span>

#include "drivers/tmcl/axis_parameter.h"
#include "drivers/tmcl/sequence.h"

namespace drivers::tmcl {

struct ParameterSetting {
  const AxisParameter* parameter = nullptr;  ///< of a table in axis_parameters.h
  std::int32_t value = 0;
};

/// Writes them one by one and reads each back. Needs the mailbox only: works from PRE-OP on.
class ParameterApplication final : public Sequence {
 public:
  /// `settings` outlive the sequence.
  explicit ParameterApplication(std::span<const ParameterSetting> settings,
                                std::chrono::nanoseconds cycle = std::chrono::milliseconds(1)) noexcept
      : Sequence(cycle), settings_(settings) {}

 private:
  Action run(const DriveInput& input) noexcept override;
  std::optional<DriveOutput> rest(Progress /*progress*/) const noexcept override { return kStopMotor; }

  std::span<const ParameterSetting> settings_;
  std::size_t next_ = 0;
  bool written_ = false;
};

}  // namespace drivers::tmcl
