/// @file
/// The youBot's base: four wheel drives, mecanum rollers, a rigid body on a level floor.
#pragma once
#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <span>

#include "control/link_map.h"
#include "control/planar.h"
#include "hal/plant.h"
#include "sim/bounded_bristle.h"
#include "sim/drive.h"
#include "sim/effects/drive_model.h"

namespace sim {

struct BaseParameters {
  bool on_ground = true;  ///< false: wheels turn freely in the air, the body stays where it is
  control::BaseGeometry geometry;
  /// Robot description: base 22.0, wheels 4·0.4, arm 5.69 with gripper 0.25; yaw inertia 3.68 of the base
  /// plus arm and wheels at their places.
  double mass_kg = 29.5;
  double yaw_inertia_kg_m2 = 4.0;
  DriveParameters drive;
  /// What the wheels' drives are instead of the measured curves, all four alike: friction and inertia, and
  /// the noise of their torque sensors where it says so.
  std::optional<effects::DriveModel> model{};
  /// Times the measured curves, which were taken with the wheels off the ground: loaded bearings and rollers
  /// take more, and not each wheel the same. An assumption, so that a compensator made from the measured
  /// curves is judged where it is imperfect. In the air the curves count as measured.
  std::array<double, 4> loaded_friction_scale{1.15, 1.30, 1.10, 1.25};
  double roller_grip = 0.6;  ///< friction coefficient along a roller's axis; assumption
  /// A roller's tangential give along its axis [N/m, N·s/m]; assumption, stiff against the wheel drives.
  BoundedBristle::Parameters roller_give{5e4, 300.0};
  double roller_resistance =
      0.004;  ///< rolling resistance coefficient of a roller about its axis; assumption
  std::chrono::nanoseconds step{50'000};  ///< integration step, see the convergence test
  std::uint64_t noise_seed = 1;
};

/// Joints: the four wheels in bus order, signs kCounterClockwise (control/link_map.h).
///
/// Every roller grips the floor along its axis, at 45° to the wheel, with a bounded bristle on the slip
///   u = s·r·w − (v_x + c·v_y) at the wheel's place,  s = ∓1 left/right,  c = ∓1 by the roller's direction,
/// and rolls about its axis against a small resistance. The body obeys Newton and Euler in the base frame.
/// Wheel loads are equal and constant: load transfer and the arm's motion are left out.
/// One thread. measure() and advance() neither allocate nor lock.
class Base final : public hal::Plant {
 public:
  /// @throws std::invalid_argument naming the parameter that is not finite or not positive.
  explicit Base(const BaseParameters& parameters);

  int joint_count() const noexcept override { return kWheels; }
  void measure(std::span<hal::JointSample> samples) noexcept override;
  void advance(std::span<const hal::JointCommand> commands, bool powered,
               std::chrono::nanoseconds duration) noexcept override;

  /// Truth, for tests and the summary of a simulated run.
  const control::PlanarPose& pose() const noexcept { return X_WB_; }
  const control::PlanarVector& twist() const noexcept { return twist_B_; }
  Drive& wheel(int index) noexcept { return wheels_[static_cast<std::size_t>(index)]; }
  double kinetic_energy_J() const noexcept;
  /// From now on a hand pushes the body with this wrench.
  void push(const control::PlanarVector& wrench_B) noexcept { push_B_ = wrench_B; }
  void set_twist(const control::PlanarVector& twist_B) noexcept { twist_B_ = twist_B; }

 private:
  static constexpr int kWheels = 4;
  void step(double step_s) noexcept;

  BaseParameters parameters_;
  std::array<Drive, kWheels> wheels_;
  std::array<BoundedBristle, kWheels> grips_;
  control::PlanarPose X_WB_;
  control::PlanarVector twist_B_ = control::PlanarVector::Zero();
  control::PlanarVector push_B_ = control::PlanarVector::Zero();
};

}  // namespace sim
