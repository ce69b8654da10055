#include "identification/gap/between_flanks.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace identification::gap {
namespace {

/// An impact is short compared with all that the data resolve: this many steps are enough.
constexpr double kStepsPerRadianOfImpact = 4;

}  // namespace

double rubbed(double velocity, const Levels& level, double share) {
  if (velocity > 0) return std::max(velocity - share * level.forward_Nm, 0.0);
  return std::min(velocity + share * level.backward_Nm, 0.0);
}

BetweenFlanks::BetweenFlanks(const model::effects::Mechanics& mechanics, double bounce_s, double position_rad,
                             double velocity_rad_per_s)
    : mechanics_(mechanics),
      bounce_s_(bounce_s),
      half_gap_rad_(0.5 * mechanics.backlash_rad),
      flank_Nm_per_rad_(mechanics.flank_Nm_per_rad()),
      flank_rad_per_s_(2 * std::numbers::pi * mechanics.flank_Hz),
      load_inertia_(mechanics.load_share * mechanics.inertia_kg_m2),
      per_motor_inertia_(1 / (mechanics.inertia_kg_m2 - load_inertia_)),
      per_load_inertia_(1 / load_inertia_),
      load_rubs_(mechanics.friction_share() * per_load_inertia_),
      motor_rubs_((1 - mechanics.friction_share()) * per_motor_inertia_),
      motor_rad_(position_rad),
      motor_rad_per_s_(velocity_rad_per_s),
      load_rad_(position_rad),
      load_rad_per_s_(velocity_rad_per_s) {}

double BetweenFlanks::longest_step_s(const model::effects::Mechanics& mechanics) {
  return 1 / (kStepsPerRadianOfImpact * 2 * std::numbers::pi * mechanics.flank_Hz);
}

double BetweenFlanks::pushed_motor(const Push& push, const Levels& level, double time_s) const {
  return rubbed(motor_rad_per_s_ + time_s * (push.drawn_rad_per_s2 + push.motor_Nm * per_motor_inertia_),
                level, time_s * motor_rubs_);
}

double BetweenFlanks::pushed_load(const Push& push, const Levels& level, double time_s) const {
  return rubbed(load_rad_per_s_ + time_s * (push.drawn_rad_per_s2 - push.load_Nm * per_load_inertia_), level,
                time_s * load_rubs_);
}

bool BetweenFlanks::keeps_contact(const Push& push, const Levels& level, double time_s) {
  if (side_ * (pushed_motor(push, level, time_s) - pushed_load(push, level, time_s)) >= 0) return true;
  load_rad_ = motor_rad_ - side_ * half_gap_rad_;
  side_ = 0;
  return false;
}

BetweenFlanks::Impulse BetweenFlanks::step_in_contact(const Push& push, const Levels& level, double time_s) {
  const double free = motor_rad_per_s_ + time_s * (push.drawn_rad_per_s2 +
                                                   (push.motor_Nm - push.load_Nm) / mechanics_.inertia_kg_m2);
  const double after = rubbed(free, level, time_s / mechanics_.inertia_kg_m2);
  Impulse given;
  given.friction = mechanics_.friction_share() * mechanics_.inertia_kg_m2 * (free - after) -
                   load_inertia_ * push.drawn_rad_per_s2 * time_s;
  given.flank = given.friction + push.load_Nm * time_s + load_inertia_ * (after - load_rad_per_s_);
  motor_rad_per_s_ = load_rad_per_s_ = after;
  motor_rad_ += time_s * after;
  load_rad_ = motor_rad_ - side_ * half_gap_rad_ - given.flank / (time_s * flank_Nm_per_rad_);
  touches_ = true;
  return given;
}

BetweenFlanks::Impulse BetweenFlanks::bounce(const Push& push, const Levels& level, double time_s) {
  const double twist = twist_rad();
  const double pressed = twist - std::clamp(twist, -half_gap_rad_, half_gap_rad_);
  touches_ = pressed != 0;
  double flank = 0;
  if (touches_) {
    const double closing = motor_rad_per_s_ - load_rad_per_s_;
    flank = mechanics_.flank_Nm(pressed, closing, time_s);
  }
  const double load_before = load_rad_per_s_;
  motor_rad_per_s_ = pushed_motor({push.motor_Nm - flank, 0, push.drawn_rad_per_s2}, level, time_s);
  load_rad_per_s_ = pushed_load({0, push.load_Nm - flank, push.drawn_rad_per_s2}, level, time_s);
  motor_rad_ += time_s * motor_rad_per_s_;
  load_rad_ += time_s * load_rad_per_s_;
  Impulse given{.flank = flank * time_s};
  given.friction = (flank - push.load_Nm) * time_s - load_inertia_ * (load_rad_per_s_ - load_before);
  if (touches_) given.flank += settle(pressed, push, level, time_s).flank;
  return given;
}

/// Gives both one velocity once the contact force exceeds the rebound.
BetweenFlanks::Impulse BetweenFlanks::settle(double pressed_rad, const Push& push, const Levels& level,
                                             double time_s) {
  const double closing = motor_rad_per_s_ - load_rad_per_s_;
  const double pressing =
      (pushed_motor(push, level, time_s) - pushed_load(push, level, time_s) - closing) / time_s;
  const bool rests = motor_rad_per_s_ == 0 && load_rad_per_s_ == 0;
  if (!rests && !(pressing * pressed_rad > 0)) return {};
  const double ringing = flank_rad_per_s_ * pressed_rad - pressing / flank_rad_per_s_;
  const double rebound = 0.5 * bounce_s_ * pressing;  // velocity at which a bounce of that length begins
  if (!rests && ringing * ringing + closing * closing > rebound * rebound) return {};
  side_ = pressed_rad > 0 ? 1 : -1;
  const double together = motor_rad_per_s_ - mechanics_.load_share * closing;
  const Impulse given{.flank = load_inertia_ * (together - load_rad_per_s_)};
  motor_rad_per_s_ = load_rad_per_s_ = together;
  return given;
}

}  // namespace identification::gap
