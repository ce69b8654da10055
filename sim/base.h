/// @file
/// The youBot's base: four wheel drives, mecanum rollers, a rigid body on the floor.
#pragma once
#include <chrono>
#include <span>

#include "control/planar.h"
#include "hal/plant.h"
#include "sim/mecanum_wheels.h"

namespace sim {

struct BaseParameters : MecanumWheelParameters {
  /// Robot description: base 22.0, wheels 4·0.4, arm 5.69 with gripper 0.25; yaw inertia 3.68 of the base
  /// plus arm and wheels at their places.
  double mass_kg = 29.5;
  double yaw_inertia_kg_m2 = 4.0;
  std::chrono::nanoseconds step{50'000};  ///< integration step, see the convergence test
};

/// Joints: the four wheels, as in sim/mecanum_wheels.h. The body obeys the Newton-Euler equations in the base
/// frame; the arm's motion is not modelled.
/// One thread. measure() and advance() neither allocate nor lock.
class Base final : public hal::Plant {
 public:
  /// @throws std::invalid_argument naming the parameter that is not finite or not positive.
  explicit Base(const BaseParameters& parameters);

  int joint_count() const noexcept override { return MecanumWheels::kCount; }
  void measure(std::span<hal::JointSample> samples) noexcept override;
  void advance(std::span<const hal::JointCommand> commands, bool powered,
               std::chrono::nanoseconds duration) noexcept override;

  /// True values, for tests and the summary of a simulated run.
  const control::PlanarPose& pose() const noexcept { return X_WB_; }
  const control::PlanarVector& twist() const noexcept { return twist_B_; }
  double wheel_load_N(int index) const noexcept { return wheels_.load_N(static_cast<std::size_t>(index)); }
  Drive& wheel(int index) noexcept { return wheels_[static_cast<std::size_t>(index)]; }
  double kinetic_energy_J() const noexcept;
  /// From now on a hand pushes the body with this wrench.
  void push(const control::PlanarVector& wrench_B) noexcept { push_B_ = wrench_B; }
  /// When lifted, the body stays where it is.
  void set_on_ground(bool on_ground) noexcept;
  void set_twist(const control::PlanarVector& twist_B) noexcept { twist_B_ = twist_B; }

 private:
  void step(double step_s) noexcept;

  BaseParameters parameters_;
  MecanumWheels wheels_;
  control::PlanarPose X_WB_;
  control::PlanarVector twist_B_ = control::PlanarVector::Zero();
  control::PlanarVector push_B_ = control::PlanarVector::Zero();
};

}  // namespace sim
