/// @file
/// A motor and a load that collide on the flanks of a gap.
#pragma once
#include "model/effects/effect.h"

namespace identification::gap {

/// Sliding friction of the whole drive in both directions.
struct Levels {
  double forward_Nm, backward_Nm;
};
/// Velocity after friction of `share` times `level` has acted against it: friction stops a motion but does
/// not reverse it.
double rubbed(double velocity, const Levels& level, double share);

/// Motor and load, driven by torques. Impacts follow Hunt and Crossley, in steps short enough to resolve
/// them. Once rebounds are shorter than the data can show, both move as one mass, in steps of any length:
/// most of the time.
class BetweenFlanks {
 public:
  /// `bounce_s`: the shortest rebound that counts. Starts in the middle of the gap.
  BetweenFlanks(const model::effects::Mechanics& mechanics, double bounce_s, double position_rad,
                double velocity_rad_per_s);

  /// Torques on them during a step.
  struct Push {
    double motor_Nm;          ///< on the motor
    double load_Nm;           ///< against positive motion of the load
    double drawn_rad_per_s2;  ///< on both
  };
  /// Impulse on the load in a step [N·m·s].
  struct Impulse {
    double flank = 0;
    double friction = 0;  ///< friction and its acceleration: everything except the flank and `load_Nm`
  };
  /// For bounce().
  static double longest_step_s(const model::effects::Mechanics& mechanics);
  bool in_contact() const noexcept { return side_ != 0; }
  /// False: they separate for at least such a time.
  bool keeps_contact(const Push& push, const Levels& level, double time_s);
  /// During contact.
  Impulse step_in_contact(const Push& push, const Levels& level, double time_s);
  /// Without contact, over at most longest_step_s(); they may be in contact after it.
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
