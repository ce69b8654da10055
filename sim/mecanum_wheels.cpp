#include "sim/mecanum_wheels.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "control/positive.h"
#include "model/friction/sliding_table.h"
#include "model/gravity.h"

namespace sim {
namespace {

/// Below this sliding speed a roller's rolling resistance fades to zero at rest.
constexpr double kRollingFade_m_per_s = 0.005;

// For wheels 1 to 4: direction in which the surface pushes the body forward for a positive turn, inclination
// of the roller on the floor, and position relative to the centre in half wheelbases and half tracks.
constexpr std::array<double, 4> kForward{-1, 1, -1, 1};
constexpr std::array<double, 4> kLean{-1, 1, 1, -1};
constexpr std::array<double, 4> kAhead{1, 1, -1, -1};
constexpr std::array<double, 4> kLeft{1, -1, 1, -1};
/// Per-wheel values, computed for all at once: roots and divisions are most of a step.
using EachWheel = Eigen::Array4d;

constexpr control::RequirePositive kRequirePositive{"simulated base"};
constexpr control::RequireNotNegative kRequireNotNegative{"simulated base"};

/// A wheel whose friction is in the effects only.
Drive make_modelled_wheel(const MecanumWheelParameters& parameters, int wheel) {
  DriveParameters drive = parameters.drive;
  const auto own = static_cast<std::size_t>(wheel - 1);
  const model::effects::DriveModel& model = parameters.models[parameters.models.size() > 1 ? own : 0];
  const double rotor_kg_m2 = drive.motor.rotor_inertia_kg_m2 * drive.gear_ratio * drive.gear_ratio;
  drive.load_inertia_kg_m2 = model.inertia_kg_m2 - rotor_kg_m2;
  drive.effects.insert(drive.effects.begin(), model.effects.begin(), model.effects.end());
  if (model.torque_noise_Nm) drive.sensors.torque_noise_Nm = *model.torque_noise_Nm;
  return {drive, std::nullopt, parameters.noise_seed + static_cast<std::uint64_t>(wheel)};
}

Drive make_wheel(const MecanumWheelParameters& parameters, int wheel) {
  if (!parameters.models.empty()) return make_modelled_wheel(parameters, wheel);
  // A fine grid: the plant is the measured curve, and the compensator's coarse table is an approximation of
  // it.
  const model::friction::SlidingTable table =
      model::friction::wheel_table(wheel, {.spacing_rad_per_s = 0.005});
  const double scale =
      parameters.on_ground ? parameters.loaded_friction_scale[static_cast<std::size_t>(wheel - 1)] : 1.0;
  return {parameters.drive, table.scaled(scale), parameters.noise_seed + static_cast<std::uint64_t>(wheel)};
}

MecanumWheelParameters checked(const MecanumWheelParameters& parameters) {
  kRequireNotNegative(parameters.roller_grip, "roller_grip");
  kRequireNotNegative(parameters.roller_resistance, "roller_resistance");
  kRequirePositive(parameters.roller_give.stiffness, "roller stiffness");
  kRequirePositive(parameters.geometry.wheel_radius_m, "wheel_radius_m");
  kRequirePositive(parameters.drive.presliding.stiffness, "presliding stiffness");
  kRequirePositive(parameters.drive.gear_ratio, "gear_ratio");
  kRequirePositive(parameters.drive.motor.torque_constant_Nm_per_A, "torque_constant_Nm_per_A");
  kRequirePositive(parameters.drive.motor.inductance_H, "inductance_H");
  kRequirePositive(parameters.drive.motor.resistance_ohm, "resistance_ohm");
  if (const std::size_t models = parameters.models.size(); models > 1 && models != MecanumWheels::kCount)
    throw std::invalid_argument("simulated base: " + std::to_string(models) +
                                " drive models, expected one for all wheels or one for each of the 4");
  for (const double scale : parameters.loaded_friction_scale)
    kRequirePositive(scale, "loaded_friction_scale");
  for (const double scale : parameters.grip_scale) kRequireNotNegative(scale, "grip_scale");
  kRequireNotNegative(parameters.centre_of_mass_height_m, "centre_of_mass_height_m");
  if (!parameters.floor.slope_W.allFinite())
    throw std::invalid_argument("simulated base: the floor's slope must be finite");
  for (const FloorPatch& patch : parameters.floor.patches) {
    kRequireNotNegative(patch.grip, "grip of a floor patch");
    kRequireNotNegative(patch.resistance, "resistance of a floor patch");
  }
  return parameters;
}

}  // namespace

MecanumWheels::MecanumWheels(const MecanumWheelParameters& parameters, double carried_mass_kg)
    : parameters_(checked(parameters)),
      equal_load_N_(carried_mass_kg * model::kGravity_m_per_s2 / kCount),
      load_N_(Eigen::Array4d::Constant(equal_load_N_)),
      wheels_{make_wheel(parameters, 1), make_wheel(parameters, 2), make_wheel(parameters, 3),
              make_wheel(parameters, 4)},
      grips_{BoundedBristle(parameters.roller_give), BoundedBristle(parameters.roller_give),
             BoundedBristle(parameters.roller_give), BoundedBristle(parameters.roller_give)} {
  kRequirePositive(carried_mass_kg, "mass_kg");
}

void MecanumWheels::control(std::span<const hal::JointCommand> commands, bool powered,
                            double interval_s) noexcept {
  for (std::size_t i = 0; i < kCount; ++i) wheels_[i].control(commands[i], powered, interval_s);
}

void MecanumWheels::step(const control::PlanarPose& X_WB, const control::PlanarVector& twist_B, double step_s,
                         control::PlanarVector& wrench_B) noexcept {
  if (!parameters_.on_ground) {
    for (Drive& wheel : wheels_) wheel.step(0.0, step_s);
    return;
  }
  const double r = parameters_.geometry.wheel_radius_m;
  const EachWheel forward(kForward.data());
  const EachWheel lean(kLean.data());
  const EachWheel x = EachWheel(kAhead.data()) * (parameters_.geometry.wheelbase_m / 2);
  const EachWheel y = EachWheel(kLeft.data()) * (parameters_.geometry.track_m / 2);
  const EachWheel hub_x = twist_B[0] - twist_B[2] * y;
  const EachWheel hub_y = twist_B[1] + twist_B[2] * x;
  EachWheel speed;
  std::ranges::transform(wheels_, speed.begin(), &Drive::velocity_rad_per_s);
  const EachWheel surface_x = forward * r * speed;
  // The wheel grips along the roller's axis. The grip acts along (1, c)/√2; its x component carries the 1/√2
  // of that direction.
  const EachWheel slip = surface_x - (hub_x + lean * hub_y);
  EachWheel grip_bound_N = parameters_.roller_grip * load_N_ / std::sqrt(2.0);
  EachWheel resistance = parameters_.roller_resistance * load_N_;
  if (!parameters_.floor.is_plain()) {
    const double cosine = std::cos(X_WB.yaw_rad);
    const double sine = std::sin(X_WB.yaw_rad);
    for (Eigen::Index i = 0; i < kCount; ++i) {
      const Place place =
          place_at(X_WB.x_m + cosine * x[i] - sine * y[i], X_WB.y_m + sine * x[i] + cosine * y[i]);
      grip_bound_N[i] *= place.grip;
      resistance[i] *= place.resistance;
    }
    const Eigen::Vector2d pull_W_N = -kCount * equal_load_N_ * parameters_.floor.slope_W;
    wrench_B += control::rotated({pull_W_N.x(), pull_W_N.y(), 0}, cosine, -sine);
  }
  EachWheel grip_N;
  for (std::size_t i = 0; i < kCount; ++i) {
    const auto wheel = static_cast<Eigen::Index>(i);
    grip_N[wheel] = grips_[i].step(slip[wheel], parameters_.grip_scale[i] * grip_bound_N[wheel], step_s);
  }
  // Across it the roller rolls, along (−c, 1)/√2.
  const EachWheel rolling = (lean * (surface_x - hub_x) + hub_y) / std::sqrt(2.0);
  const EachWheel resistance_N =
      -resistance * rolling / (rolling * rolling + kRollingFade_m_per_s * kRollingFade_m_per_s).sqrt();
  const EachWheel force_x = grip_N - lean * resistance_N / std::sqrt(2.0);
  const EachWheel force_y = lean * grip_N + resistance_N / std::sqrt(2.0);
  const EachWheel moment = x * force_y - y * force_x;
  for (int i = 0; i < kCount; ++i) wrench_B += control::PlanarVector(force_x[i], force_y[i], moment[i]);
  if (const double height_m = parameters_.centre_of_mass_height_m; height_m > 0) {
    load_N_ = (equal_load_N_ -
               EachWheel(kAhead.data()) * force_x.sum() * height_m / (2 * parameters_.geometry.wheelbase_m) -
               EachWheel(kLeft.data()) * force_y.sum() * height_m / (2 * parameters_.geometry.track_m))
                  .max(0.0);
    load_N_ *= kCount * equal_load_N_ / load_N_.sum();  // a wheel that lifts leaves its load to the others
  }
  const EachWheel load_Nm = forward * r * force_x;
  for (std::size_t i = 0; i < kCount; ++i) wheels_[i].step(load_Nm[static_cast<Eigen::Index>(i)], step_s);
}

MecanumWheels::Place MecanumWheels::place_at(double x_m, double y_m) const noexcept {
  for (std::size_t i = parameters_.floor.patches.size(); i-- > 0;)
    if (const FloorPatch& patch = parameters_.floor.patches[i]; patch.contains(x_m, y_m))
      return {patch.grip, patch.resistance};
  return {};
}

void MecanumWheels::set_on_ground(bool on_ground) noexcept {
  if (std::exchange(parameters_.on_ground, on_ground) == on_ground) return;
  grips_.fill(BoundedBristle(parameters_.roller_give));
}

void MecanumWheels::sense(double interval_s) noexcept {
  for (Drive& wheel : wheels_) wheel.sense(interval_s);
}

void MecanumWheels::measure(std::span<hal::JointSample> samples) const noexcept {
  std::transform(wheels_.begin(), wheels_.end(), samples.begin(),
                 [](const Drive& wheel) { return wheel.measured(); });
}

void MecanumWheels::require_stable(double step_s) const {
  for (std::size_t i = 0; i < kCount; ++i)
    if (const double longest_s = wheels_[i].longest_step_s(); !(step_s < longest_s))
      throw std::invalid_argument("simulated wheel " + std::to_string(i + 1) + ": its friction law needs " +
                                  "steps below " + std::to_string(1e6 * longest_s) + " us, not " +
                                  std::to_string(1e6 * step_s));
}

double MecanumWheels::kinetic_energy_J() const noexcept {
  double energy_J = 0.0;
  for (const Drive& wheel : wheels_)
    energy_J += 0.5 * wheel.inertia_kg_m2() * wheel.velocity_rad_per_s() * wheel.velocity_rad_per_s();
  return energy_J;
}

}  // namespace sim
