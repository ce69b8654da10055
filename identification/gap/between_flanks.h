/// @file
/// A motor and a load that meet on the flanks of a gap.
#pragma once
#include "model/effects/effect.h"

namespace identification::gap {

/// Sliding friction of all the drive in both directions.
struct Levels {
  double forward_Nm, backward_Nm;
};
/// Velocity after friction has worked against it, which takes what `share` of `level` says: it stops a
/// motion, it does not turn it round.
double rubbed(double velocity, const Levels& level, double share);

/// Motor and load, driven by torques. Impacts follow Hunt and Crossley, in steps short enough to resolve
/// them. Once rebounds are shorter than the data can show, both move as one mass, in steps of any length:
/// most of the time.
class BetweenFlanks {
 public:
  /// `bounce_s`: the shortest that counts. It begins in the middle of the gap.
  BetweenFlanks(const model::effects::Mechanics& mechanics, double bounce_s, double position_rad,
                double velocity_rad_per_s);

  /// Torques on them during a step.
  struct Push {
    double motor_Nm;          ///< on the motor
    double load_Nm;           ///< against positive motion of the load
    double drawn_rad_per_s2;  ///< on both
  };
  /// What a step did to the load [N·m·s].
  struct Impulse {
    double flank = 0;
    double friction = 0;  ///< and what draws it: all but the flank and `load_Nm`
  };
  /// Of bounce().
  static double longest_step_s(const model::effects::Mechanics& mechanics);
  bool in_contact() const noexcept { return side_ != 0; }
  /// False: they separate, as they would not stay together for such a time.
  bool keeps_contact(const Push& push, const Levels& level, double time_s);
  /// While they are in contact.
  Impulse step_in_contact(const Push& push, const Levels& level, double time_s);
  /// While they are not, over at most longest_step_s(); they may be in contact after it.
  Impulse bounce(const Push& push, const Levels& level, double time_s);

  bool touches() const noexcept { return touches_; }  ///< during the last step
  double motor_rad() const noexcept { return motor_rad_; }
  double motor_rad_per_s() const noexcept { return motor_rad_per_s_; }
  double load_rad_per_s() const noexcept { return load_rad_per_s_; }
  double twist_rad() const noexcept { return motor_rad_ - load_rad_; }

 private:
  double pushed_motor(const Push& push, const Levels& level, double time_s) const;
  double pushed_load(const Push& push, const Levels& level, double time_s) const;
  Impulse settle(double pressed_rad, const Push& push, const Levels& level, double time_s);

  model::effects::Mechanics mechanics_;
  double bounce_s_;
  double half_gap_rad_;
  double flank_Nm_per_rad_;
  double flank_rad_per_s_;
  double load_inertia_;
  double per_motor_inertia_;
  double per_load_inertia_;
  double load_rubs_;
  double motor_rubs_;
  double motor_rad_;
  double motor_rad_per_s_;
  double load_rad_;
  double load_rad_per_s_;
  int side_ = 0;  // of the flank in contact; 0: none
  bool touches_ = false;
};

}  // namespace identification::gap
