/// @file
/// Detects an encoder that does not count although its motor is commanded to move.
#pragma once
#include "control/plausibility/sample_time.h"
#include "hal/joint.h"

namespace control {

/// No drive is rigid: below breakaway, gear and friction contact give way by microns (thesis 2.5.2 measured
/// 250 N·m/rad at a wheel). A working encoder therefore counts whenever the torque changes, even if the base
/// is held or the arm leans on a wall. An encoder whose count stays exactly the same during such a change is
/// stuck. Only a change after its last count is judged, because an earlier one may already have moved it. The
/// change is taken from the drive's current reading, and in torque mode also from the command; in velocity
/// and position mode a moving set-point is a change as well. A sample may have been taken at any time within
/// its bounds, so only time that has certainly passed counts. One thread. Cycle: update() and restart()
/// neither allocate nor throw.
class StillEncoder {
 public:
  /// @param change_Nm change of torque that moves any working joint by more than one or two counts.
  explicit StillEncoder(double change_Nm) noexcept : change_Nm_(change_Nm) {}

  void restart() noexcept { samples_ = 0; }
  /// Call with each fresh sample. True: the encoder is stuck.
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
  double driven_s_ = 0.0;  // minimum time for which driven_ has been true
  double position_rad_ = 0.0;
  double torque_Nm_ = 0.0;     // smoothed
  double target_value_ = 0.0;  // smoothed: N·m, rad/s or rad, depending on the mode
  double asked_rad_ = 0.0;     // in velocity mode
  hal::CommandMode mode_ = hal::CommandMode::kTorque;
  Range torque_;
  Range target_;
};

}  // namespace control
