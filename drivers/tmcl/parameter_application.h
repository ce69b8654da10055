/// @file
/// Writes a drive's configured parameters: those set at start-up are only in its RAM, so a drive that lost
/// power must get them again before it moves.
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

/// Writes them one by one and reads each back. Needs only the mailbox: works from PRE-OP on.
class ParameterApplication final : public Sequence {
 public:
  /// `settings` must outlive the sequence.
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
