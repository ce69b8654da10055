/// @file
/// Detects a joint in position mode that moves away from its target.
#pragma once
#include <array>

#include "control/plausibility/sample_time.h"
#include "hal/joint.h"

namespace control {

/// The drive's own position controller turns the motor towards the target by what the encoder shows. If the
/// encoder counts backwards, the joint shows more and more distance instead. A joint may move away from its
/// target while it brakes: after a change of mode, beyond a target, or when the target turns round. Only
/// motion that does not slow down counts therefore, and an allowance for the delay of the velocity
/// controller, with the speed at which the motion away began. A joint whose weight the controller takes over
/// sinks by less than the bound. What pushes a joint further than that, a person or an obstacle, is taken for
/// a reversed encoder. A single wrong position is left out. In the other modes, the check is silent. One
/// thread. Cycle: nothing allocates or throws.
class AwayFromTarget {
 public:
  void restart() noexcept { known_ = false; }
  /// Call with each fresh sample. True: the joint moves away from its target.
  bool update(const hal::JointCommand& command, double position_rad, const SampleTime& time) noexcept;

 private:
  bool known_ = false;
  double known_s_ = 0.0;              // time for which it has been known
  double passed_s_ = 0.0;             // since the last sample of known time
  std::array<double, 2> last_rad_{};  // the last positions, the older one first
  double position_rad_ = 0.0;         // without single wrong positions
  double velocity_rad_per_s_ = 0.0;   // smoothed
  double earlier_rad_per_s_ = 0.0;    // smoothed more: the velocity shortly before
  double away_rad_ = 0.0;             // motion away, minus motion towards the target
  double began_rad_per_s_ = 0.0;      // speed at which the motion away began
};

}  // namespace control
