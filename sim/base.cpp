#include "sim/base.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "control/positive.h"

namespace sim {
namespace {

/// The motor controllers' loops run at 1 kHz (TMCL axis parameter 133).
constexpr std::chrono::nanoseconds kControllerPeriod{1'000'000};

BaseParameters checked(const BaseParameters& parameters) {
  const control::RequirePositive require_positive{"simulated base"};
  require_positive(parameters.mass_kg, "mass_kg");
  require_positive(parameters.yaw_inertia_kg_m2, "yaw_inertia_kg_m2");
  require_positive(static_cast<double>(parameters.step.count()), "step");
  return parameters;
}

}  // namespace

Base::Base(const BaseParameters& parameters)
    : parameters_(checked(parameters)), wheels_(parameters, parameters.mass_kg) {
  wheels_.require_stable(std::chrono::duration<double>(parameters.step).count());
}

void Base::measure(std::span<hal::JointSample> samples) noexcept { wheels_.measure(samples); }

void Base::advance(std::span<const hal::JointCommand> commands, bool powered,
                   std::chrono::nanoseconds duration) noexcept {
  while (duration.count() > 0) {
    const std::chrono::nanoseconds period = std::min(duration, kControllerPeriod);
    const double period_s = std::chrono::duration<double>(period).count();
    wheels_.control(commands, powered, period_s);
    const auto steps = (period.count() + parameters_.step.count() - 1) / parameters_.step.count();
    const double step_s = period_s / static_cast<double>(steps);
    for (std::int64_t n = 0; n < steps; ++n) step(step_s);
    wheels_.sense(period_s);
    duration -= period;
  }
}

void Base::step(double step_s) noexcept {
  control::PlanarVector wrench_B = push_B_;
  wheels_.step(X_WB_, twist_B_, step_s, wrench_B);
  if (!wheels_.on_ground()) return;

  // Newton in the rotating frame B: m·(dv/dt + ω × v) = f.
  const double spin = twist_B_[2];
  const control::PlanarVector acceleration_B(wrench_B[0] / parameters_.mass_kg + spin * twist_B_[1],
                                             wrench_B[1] / parameters_.mass_kg - spin * twist_B_[0],
                                             wrench_B[2] / parameters_.yaw_inertia_kg_m2);
  twist_B_ += step_s * acceleration_B;
  X_WB_ = control::moved_by(X_WB_, step_s * twist_B_);
}

void Base::set_on_ground(bool on_ground) noexcept {
  wheels_.set_on_ground(on_ground);
  if (!on_ground) twist_B_.setZero();
}

double Base::kinetic_energy_J() const noexcept {
  return 0.5 * parameters_.mass_kg * twist_B_.head<2>().squaredNorm() +
         0.5 * parameters_.yaw_inertia_kg_m2 * twist_B_[2] * twist_B_[2] + wheels_.kinetic_energy_J();
}

}  // namespace sim
