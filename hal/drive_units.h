/// @file
/// Converts between a TMCL drive's integers and a joint in SI, for every backend with such drives.
#pragma once
#include <cstdint>

#include "hal/axis_scale.h"
#include "hal/joint.h"
#include "hal/youbot_axes.h"

namespace drivers::tmcl {
class StatusFlags;
struct DriveInput;
struct DriveOutput;
}  // namespace drivers::tmcl

namespace hal {

/// The most severe error flag; kNone if no flag is set. Cycle.
JointFault joint_fault_of(drivers::tmcl::StatusFlags flags) noexcept;

/// Cycle: all but the constructor.
class DriveUnits {
 public:
  /// @param unsigned_current the drive reports only the current's magnitude
  /// @throws std::invalid_argument see AxisScale
  DriveUnits(const AxisData& axis, bool unsigned_current);

  /// Torque and velocity are limited to the axis limits.
  /// @param position_ticks the unwrapped counter; `input` holds its low 32 bits
  drivers::tmcl::DriveOutput output(const JointCommand& command, const drivers::tmcl::DriveInput& input,
                                    std::int64_t position_ticks) const noexcept;
  JointSample sample(const drivers::tmcl::DriveInput& input, const drivers::tmcl::DriveOutput& commanded,
                     std::int64_t position_ticks) const noexcept;

 private:
  AxisScale scale_;
  std::int32_t current_limit_mA_;
  double speed_limit_rad_per_s_;
  bool unsigned_current_;
};

}  // namespace hal
