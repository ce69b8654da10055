#include "tests/gap_second/drive.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace gap_second {
namespace {

double sign(double x) { return x > 0 ? 1.0 : (x < 0 ? -1.0 : 0.0); }

/// Towards `target` with time constant `lag_s`, exactly over one step.
double lagged(double value, double target, double lag_s) {
  return lag_s > 0 ? target + (value - target) * std::exp(-kStepS / lag_s) : target;
}

double height_of_track(std::int64_t place) {  // -1 to 1, by splitmix64
  auto x = static_cast<std::uint64_t>(place) * 0x9E3779B97F4A7C15ULL;
  x = (x ^ (x >> 30U)) * 0xBF58476D1CE4E5B9ULL;
  x = (x ^ (x >> 27U)) * 0x94D049BB133111EBULL;
  return static_cast<double>(x >> 11U) * 0x1p-52 - 1.0;
}

/// Smooth, and never the same again: a random height each 0.9 rad.
double rough_track(double position_rad) {
  const double place = position_rad / 0.9;
  const double before = std::floor(place);
  const double part = 0.5 - 0.5 * std::cos(std::numbers::pi * (place - before));
  const auto index = static_cast<std::int64_t>(before);
  return (1 - part) * height_of_track(index) + part * height_of_track(index + 1);
}

}  // namespace

Drive::Drive(const DriveTruth& truth, std::uint64_t seed)
    : truth_(truth),
      commands_under_way_(static_cast<std::size_t>(std::lround(truth.delay_s / kStepS))),
      random_(seed) {
  if (!(truth_.inertia_kg_m2 > 0)) throw std::invalid_argument("a drive needs an inertia above zero");
  const double lighter = truth_.inertia_kg_m2 * std::min(truth_.load_share, 1 - truth_.load_share);
  if (truth_.load_share > 0 && std::sqrt(truth_.coupling_stiffness_Nm_per_rad / lighter) * kStepS > 0.5)
    throw std::invalid_argument("the coupling is too stiff for the step of the integration");
}

double Drive::delivered(double command_Nm) {
  if (!commands_under_way_.empty()) {
    std::swap(command_Nm, commands_under_way_[next_command_]);
    next_command_ = (next_command_ + 1) % commands_under_way_.size();
  }
  if (std::abs(command_Nm) < truth_.deadband_Nm) command_Nm = sign(command_Nm) * truth_.deadband_Nm;
  return std::clamp(command_Nm, -truth_.largest_torque_Nm, truth_.largest_torque_Nm);
}

double Drive::weight_Nm(double position_rad) const {
  return truth_.imbalance_Nm * std::sin(position_rad - truth_.rest_position_rad);
}

/// Magnitude of what does not depend on how long it has been so, at speed `velocity` or about to move in
/// `direction`.
double Drive::sliding_friction(double velocity_rad_per_s, double direction) const {
  const double speed = std::abs(velocity_rad_per_s);
  double torque = truth_.coulomb_Nm + sign(direction) * truth_.asymmetry_coulomb_Nm;
  torque += truth_.drift_coulomb_Nm * (1 - std::exp(-time_s_ / truth_.drift_time_constant_s));
  torque *= 1 + truth_.rough_track_share * rough_track(state_.motor_rad);
  const double stribeck = speed / truth_.stribeck_rad_per_s;
  torque += truth_.static_excess_Nm * std::exp(-stribeck * stribeck);
  const double dip = (speed - truth_.dip_centre_rad_per_s) / truth_.dip_width_rad_per_s;
  torque -= truth_.dip_depth_Nm * std::exp(-dip * dip);
  torque += truth_.load_friction_share * std::abs(weight_Nm(state_.load_rad));
  torque += truth_.transmitted_share * std::abs(acting_torque_Nm_);
  torque += brake_drags_ ? truth_.brake_Nm : 0.0;
  return std::max(0.0, torque);
}

/// Elastic up to 0.7 of the largest deflection, then plastic more and more.
double Drive::bristle_torque(double velocity_rad_per_s) {
  const double stiffness = truth_.bristle_stiffness_Nm_per_rad;
  const double largest = sliding_friction(velocity_rad_per_s, velocity_rad_per_s) / stiffness;
  const double before = state_.bristle_rad;
  double plastic = 0.0;
  if (before * velocity_rad_per_s > 0) {
    const double part = std::clamp((std::abs(before) / largest - 0.7) / 0.3, 0.0, 1.0);
    plastic = 0.5 - 0.5 * std::cos(std::numbers::pi * part);
  }
  const double rate = velocity_rad_per_s * (1 - plastic * std::abs(before) / largest);
  state_.bristle_rad = std::clamp(before + kStepS * rate, -largest, largest);
  // Damped while it sticks; in fast motion the damping goes, or a reversal would be a blow.
  const double damping = 0.6 * std::sqrt(stiffness * truth_.inertia_kg_m2);
  const double slow = velocity_rad_per_s / (10 * largest * std::sqrt(stiffness / truth_.inertia_kg_m2));
  return stiffness * state_.bristle_rad +
         damping * std::exp(-slow * slow) * (state_.bristle_rad - before) / kStepS;
}

/// One step under `torque` and Coulomb friction, which may stop the mass but never turn it round.
void Drive::move(double& velocity_rad_per_s, double torque_Nm, double inertia_kg_m2, double friction_share) {
  const double speed = std::abs(velocity_rad_per_s);
  double viscous = truth_.viscous_Nm_s_per_rad;
  viscous += sign(velocity_rad_per_s) * truth_.asymmetry_viscous_Nm_s_per_rad;
  torque_Nm -= friction_share * (viscous + truth_.drag_Nm_s2_per_rad2 * speed) * velocity_rad_per_s;
  if (truth_.bristle_stiffness_Nm_per_rad > 0) {
    if (friction_share > 0.5) torque_Nm -= friction_share * bristle_torque(velocity_rad_per_s);
    velocity_rad_per_s += kStepS * torque_Nm / inertia_kg_m2;
    return;
  }
  const double free = velocity_rad_per_s + kStepS * torque_Nm / inertia_kg_m2;
  const double friction = friction_share * sliding_friction(velocity_rad_per_s, free);
  const double most_change = kStepS * friction / inertia_kg_m2;
  velocity_rad_per_s = std::abs(free) <= most_change ? 0.0 : free - sign(free) * most_change;
}

double Drive::coupling_torque_Nm() const {
  const double twist = state_.motor_rad - state_.load_rad;
  const double rate = state_.motor_rad_per_s - state_.load_rad_per_s;
  if (truth_.gap_rad <= 0)
    return truth_.coupling_stiffness_Nm_per_rad * twist + truth_.coupling_damping_Nm_s_per_rad * rate;
  const double pressed = std::abs(twist) - truth_.gap_rad / 2;
  if (pressed <= 0) return 0.0;
  const double closing = sign(twist) * rate;
  const double torque =
      truth_.coupling_stiffness_Nm_per_rad * pressed * (1 + truth_.impact_loss_s_per_rad * closing) +
      truth_.coupling_damping_Nm_s_per_rad * closing;
  return sign(twist) * std::max(0.0, torque);  // flanks push and never pull
}

double Drive::energy_J() const {
  const double motor = truth_.inertia_kg_m2 * (1 - truth_.load_share);
  const double load = truth_.inertia_kg_m2 * truth_.load_share;
  const double twist = std::max(0.0, std::abs(state_.motor_rad - state_.load_rad) - truth_.gap_rad / 2);
  const double spring = truth_.load_share > 0 ? truth_.coupling_stiffness_Nm_per_rad * twist * twist : 0.0;
  return 0.5 * (motor * state_.motor_rad_per_s * state_.motor_rad_per_s +
                load * state_.load_rad_per_s * state_.load_rad_per_s + spring);
}

void Drive::step(double command_Nm) {
  motor_torque_Nm_ = lagged(motor_torque_Nm_, delivered(command_Nm), truth_.current_lag_s);
  double acting = motor_torque_Nm_;
  if (truth_.soft_limit_Nm > 0) acting = truth_.soft_limit_Nm * std::tanh(acting / truth_.soft_limit_Nm);
  acting_torque_Nm_ = lagged(acting_torque_Nm_, acting, truth_.hidden_lag_s);
  if (truth_.brake_Nm > 0 && time_s_ >= brake_changes_at_s_) {
    brake_drags_ = !brake_drags_;
    brake_changes_at_s_ = time_s_ + std::exponential_distribution<double>(1.0)(random_);
  }
  const double cogging =
      truth_.cogging_Nm * std::sin(truth_.cogging_per_rev * state_.motor_rad + truth_.cogging_phase_rad);
  const double hum = truth_.hum_Nm * std::sin(2 * std::numbers::pi * truth_.hum_Hz * time_s_);
  const double on_motor = acting_torque_Nm_ - cogging - truth_.offset_Nm - hum;
  if (truth_.load_share <= 0) {
    move(state_.motor_rad_per_s, on_motor - weight_Nm(state_.motor_rad), truth_.inertia_kg_m2, 1.0);
    state_.motor_rad += kStepS * state_.motor_rad_per_s;
    state_.load_rad = state_.motor_rad;
    state_.load_rad_per_s = state_.motor_rad_per_s;
  } else {
    const double passed_on = coupling_torque_Nm();
    const double load = truth_.inertia_kg_m2 * truth_.load_share;
    move(state_.motor_rad_per_s, on_motor - passed_on, truth_.inertia_kg_m2 - load,
         1 - truth_.friction_share_of_load);
    move(state_.load_rad_per_s, passed_on - weight_Nm(state_.load_rad), load, truth_.friction_share_of_load);
    state_.motor_rad += kStepS * state_.motor_rad_per_s;
    state_.load_rad += kStepS * state_.load_rad_per_s;
  }
  time_s_ += kStepS;
}

}  // namespace gap_second
