#include "model/friction/armstrong.h"

#include <algorithm>
#include <cmath>

namespace model::friction {
namespace {

enum Slot : std::size_t {
  kSliding,     // 0 sticking, else the direction of sliding
  kDeflection,  // [rad] of the spring while sticking
  kDwell,       // [s] sticking, bounded so that no sum overflows
  kDeficit,     // [N·m] e∞ − e₀: zero after a long rest
  kExcess,      // [N·m] e of the present sliding
  kShare,       // b at the last sliding step
  kElapsed,     // [s] since the newest entry of the line
  kLine,        // velocities, oldest first, one every τL/8
};
constexpr std::size_t kIntervals = 8;
static_assert(kLine + kIntervals + 1 <= kStateCapacity);

}  // namespace

double Armstrong::stribeck_share(double velocity_rad_per_s) const noexcept {
  const double ratio = velocity_rad_per_s / parameters_.stribeck_velocity_rad_per_s;
  return 1 / (1 + ratio * ratio);
}

double Armstrong::remembered_velocity(State& state, double velocity_rad_per_s, double dt_s) const noexcept {
  const double interval_s = parameters_.memory_s / static_cast<double>(kIntervals);
  if (!(interval_s > 0)) return velocity_rad_per_s;
  double* const line = state.x.data() + kLine;
  double& elapsed_s = state.x[kElapsed];
  elapsed_s += dt_s;
  const double entries = std::floor(elapsed_s / interval_s);
  if (entries > static_cast<double>(kIntervals)) {
    std::fill_n(line, kIntervals + 1, velocity_rad_per_s);
    elapsed_s = 0;
  } else {
    if (const auto count = static_cast<std::size_t>(entries); count > 0) {
      std::copy(line + count, line + kIntervals + 1, line);
      std::fill_n(line + kIntervals + 1 - count, count, velocity_rad_per_s);
    }
    elapsed_s = std::max(0.0, elapsed_s - entries * interval_s);
  }
  return line[0] + (line[1] - line[0]) * std::min(1.0, elapsed_s / interval_s);
}

double Armstrong::step(State& state, const Contact& contact, double dt_s) const noexcept {
  if (!usable(contact, dt_s)) return 0.0;
  const double velocity = contact.velocity_rad_per_s;
  const double remembered = remembered_velocity(state, velocity, dt_s);
  double& sliding = state.x[kSliding];

  if (sliding != 0 && velocity * sliding <= 0) {  // arrested
    const double excess = state.x[kExcess] * state.x[kShare];
    state.x[kDeflection] = sliding * (parameters_.coulomb_Nm + excess) / parameters_.stiffness_Nm_per_rad;
    state.x[kDeficit] = parameters_.static_excess_Nm - excess;
    state.x[kDwell] = 0;
    sliding = 0;
  }
  double stuck_share = 0.0;  // of the step's way, and the spring's torque at its end
  double stuck_Nm = 0.0;
  if (sliding == 0) {
    state.x[kDwell] = std::min(state.x[kDwell] + dt_s, 1e12);
    const double fading =
        parameters_.dwell_s > 0 ? parameters_.dwell_s / (parameters_.dwell_s + state.x[kDwell]) : 0.0;
    const double excess = parameters_.static_excess_Nm - state.x[kDeficit] * fading;
    const double bound = (parameters_.coulomb_Nm + excess) / parameters_.stiffness_Nm_per_rad;
    state.x[kDeflection] += velocity * dt_s;
    if (std::abs(state.x[kDeflection]) < bound || velocity == 0)
      return parameters_.stiffness_Nm_per_rad * std::clamp(state.x[kDeflection], -bound, bound) +
             parameters_.viscous_Nm_s_per_rad * velocity;
    // A spring loaded against the motion cannot break: the motion unloads it.
    if (state.x[kDeflection] * velocity < 0)
      return parameters_.stiffness_Nm_per_rad * state.x[kDeflection] +
             parameters_.viscous_Nm_s_per_rad * velocity;
    sliding = std::copysign(1.0, velocity);
    if (dt_s > 0)
      stuck_share =
          std::clamp(1 - (std::abs(state.x[kDeflection]) - bound) / std::abs(velocity * dt_s), 0.0, 1.0);
    state.x[kDeflection] = sliding * bound;
    state.x[kExcess] = excess;
    stuck_Nm = parameters_.coulomb_Nm + excess;
  }
  state.x[kShare] = stribeck_share(remembered);
  const double sliding_Nm = parameters_.coulomb_Nm + state.x[kExcess] * state.x[kShare];
  return sliding * (stuck_share * stuck_Nm + (1 - stuck_share) * sliding_Nm) +
         parameters_.viscous_Nm_s_per_rad * velocity;
}

double Armstrong::steady_Nm(double velocity_rad_per_s) const noexcept {
  const double level =
      parameters_.coulomb_Nm + parameters_.static_excess_Nm * stribeck_share(velocity_rad_per_s);
  return std::copysign(level, velocity_rad_per_s) + parameters_.viscous_Nm_s_per_rad * velocity_rad_per_s;
}

double Armstrong::stored_energy_J(const State& state) const noexcept {
  return 0.5 * parameters_.stiffness_Nm_per_rad * state.x[kDeflection] * state.x[kDeflection];
}

}  // namespace model::friction
