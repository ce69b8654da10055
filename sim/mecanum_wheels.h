/// @file
/// Four wheel drives and their mecanum rollers on the floor: the wrench on the body.
///
/// Units: SI; wrenches and twists planar, in B (control/planar.h). Errors: std::invalid_argument from the
/// constructor. One thread; the cycle neither allocates nor locks.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "control/link_map.h"
#include "control/planar.h"
#include "hal/joint.h"
#include "model/effects/drive_model.h"
#include "sim/bounded_bristle.h"
#include "sim/drive.h"
#include "sim/floor.h"

namespace sim {

struct MecanumWheelParameters {
  bool on_ground = true;  ///< false: wheels turn freely in the air, the body stays where it is
  control::BaseGeometry geometry;
  DriveParameters drive;
  /// Replaces the measured curves of the wheels: friction and inertia, and the noise of their torque sensors
  /// if given. None, one for all wheels, or one for each.
  std::vector<model::effects::DriveModel> models{};
  /// Factor on the measured curves, which were taken with lifted wheels: loaded bearings and rollers have
  /// more friction, and not all wheels the same. An assumption, so that a compensator based on the measured
  /// curves is tested with model errors. When lifted, the curves apply as measured.
  std::array<double, 4> loaded_friction_scale{1.15, 1.30, 1.10, 1.25};
  double roller_grip = 0.6;  ///< friction coefficient along a roller's axis; assumption
  /// Factor on `roller_grip` per wheel: a wet patch; 0: a wheel over a hole, without load.
  std::array<double, 4> grip_scale{1, 1, 1, 1};
  /// A roller's tangential compliance along its axis [N/m, N·s/m]; assumption, stiff compared with the wheel
  /// drives.
  BoundedBristle::Parameters roller_give{5e4, 300.0};
  double roller_resistance =
      0.004;  ///< rolling resistance coefficient of a roller about its axis; assumption
  /// Of all that the wheels carry, above the floor: what accelerates the body moves load between the wheels.
  /// 0: the loads stay equal.
  double centre_of_mass_height_m = 0;
  Floor floor{};
  std::uint64_t noise_seed = 1;
};

/// In bus order, signs kCounterClockwise (control/link_map.h).
///
/// Every roller grips the floor along its axis, at 45° to the wheel, with a bounded bristle on the slip
///   u = s·r·w − (v_x + c·v_y) at the wheel's position,  s = ∓1 left/right,  c = ∓1 by the roller's
///   direction,
/// and rolls about its axis against a small resistance. Unaccelerated, the wheels carry equal loads. What the
/// floor's force F moves between them follows from the moments about the centre of mass at height h:
///   N = m·g/4 − a·F_x·h/(2·wheelbase) − l·F_y·h/(2·track),  a = ±1 front/rear,  l = ±1 left/right,
/// with the force of the step before. A wheel that lifts leaves its load to the others; the body does not
/// tip.
class MecanumWheels {
 public:
  static constexpr int kCount = 4;

  /// @throws std::invalid_argument naming the parameter that is not finite or not positive.
  MecanumWheels(const MecanumWheelParameters& parameters, double carried_mass_kg);

  /// Starts a controller period, like Drive::control(). One command for each wheel.
  void control(std::span<const hal::JointCommand> commands, bool powered, double interval_s) noexcept;
  /// Integrates one step of the wheels under a body at `X_WB` that moves with `twist_B`, and adds their force
  /// on it, and that of a slope, to `wrench_B`.
  void step(const control::PlanarPose& X_WB, const control::PlanarVector& twist_B, double step_s,
            control::PlanarVector& wrench_B) noexcept;
  /// Ends a controller period, like Drive::sense().
  void sense(double interval_s) noexcept;
  void measure(std::span<hal::JointSample> samples) const noexcept;
  /// Lifts them off the ground, or sets them down. The scale of measured curves stays as at the start.
  void set_on_ground(bool on_ground) noexcept;
  bool on_ground() const noexcept { return parameters_.on_ground; }

  /// Load that the floor carries under this wheel [N].
  double load_N(std::size_t index) const noexcept {
    return on_ground() ? load_N_[static_cast<Eigen::Index>(index)] : 0;
  }

  Drive& operator[](std::size_t index) noexcept { return wheels_[index]; }
  double kinetic_energy_J() const noexcept;
  /// @throws std::invalid_argument if a wheel's friction law needs shorter steps.
  void require_stable(double step_s) const;

 private:
  /// Factors of the place under a wheel.
  struct Place {
    double grip = 1;
    double resistance = 1;
  };
  Place place_at(double x_m, double y_m) const noexcept;

  MecanumWheelParameters parameters_;
  double equal_load_N_;
  Eigen::Array4d load_N_;
  std::array<Drive, kCount> wheels_;
  std::array<BoundedBristle, kCount> grips_;
};

}  // namespace sim
