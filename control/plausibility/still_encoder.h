/// @file
/// Notices an encoder that does not move although its motor is asked to.
#pragma once
#include "control/plausibility/sample_time.h"
#include "hal/joint.h"

namespace control {

/// No drive is rigid: below break-away the gear and the friction contact give way by microns (thesis 2.5.2
/// measured 250 N·m/rad at a wheel), so a live encoder counts whenever the torque changes, also on a base
/// that is held or an arm that leans on a wall. One that shows the very same count through such a change is
/// stuck. Only a change after its last count is judged, as one before may have moved it already. It is judged
/// by the drive's own current reading, and in torque mode also by the command; in velocity and position mode
/// a set-point that moves on is a change as well. Only time that has certainly passed counts, as a sample may
/// have been taken at any time within its bounds. One thread. Cycle: update() and restart() neither allocate
/// nor throw.
class StillEncoder {
 public:
  /// @param change_Nm of torque that moves every live joint by more than a count or two.
  explicit StillEncoder(double change_Nm) noexcept : change_Nm_(change_Nm) {}

  void restart() noexcept { samples_ = 0; }
  /// With each fresh sample. True: it is stuck.
  bool update(const hal::JointCommand& command, const hal::JointSample& sample,
              const SampleTime& time) noexcept;

 private:
  struct Range {
    double low = 0.0;
    double high = 0.0;
    void begin(double value) noexcept { low = high = value; }
    void add(double value) noexcept;
    double width() const noexcept { return high - low; }
  };
  void begin(const hal::JointCommand& command, const hal::JointSample& sample, double torque_Nm) noexcept;
  bool driven(hal::CommandMode mode) const noexcept;

  double change_Nm_;
  int samples_ = 0;
  double still_s_ = 0.0;
  bool driven_ = false;
  double driven_s_ = 0.0;  // driven_ has been true for at least so long
  double position_rad_ = 0.0;
  double torque_Nm_ = 0.0;     // smoothed
  double target_value_ = 0.0;  // likewise: N·m, rad/s or rad, as the mode says
  double asked_rad_ = 0.0;     // in velocity mode
  hal::CommandMode mode_ = hal::CommandMode::kTorque;
  Range torque_;
  Range target_;
};

}  // namespace control
