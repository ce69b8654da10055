/// @file
/// One joint of the simulated arm: a drive that moves its link through an elastic gear.
///
/// Units: SI at the joint; angles are the official driver's. Errors: std::invalid_argument from the
/// constructor. One thread; the cycle neither allocates nor locks.
#pragma once
#include <cstdint>

#include "hal/joint.h"
#include "sim/bus/axis_data.h"
#include "sim/drive.h"
#include "sim/end_stops.h"

namespace sim {

/// Compliance between motor and link.
struct GearGive {
  /// Assumption: 5 N·m twist the gear by 2 mrad.
  double stiffness_Nm_per_rad = 2500.0;
  /// Damping ratio of the oscillation of motor against link; assumption: a tenth of critical.
  double damping_ratio = 0.1;
};

/// The motor side is sim::Drive with the rotor as its only inertia: friction and sensors are there, as on the
/// youBot. The link belongs to the arm; it has its own damped end stops.
class ElasticJoint {
 public:
  /// `joint`: 1 to 5. `link_kg_m2`: effective inertia of the link in oscillation, for the damping of gear and
  /// stops.
  /// @throws std::invalid_argument naming the joint and the parameter that is not finite or not positive.
  ElasticJoint(int joint, const bus::ArmJointData& data, const GearGive& gear, double link_kg_m2,
               double start_rad, std::uint64_t noise_seed);

  /// As Drive::control() and Drive::sense().
  void control(const hal::JointCommand& command, bool powered, double interval_s) noexcept;
  void sense(double interval_s) noexcept;
  hal::JointSample measured() const noexcept;

  /// One step of the drive at this state of its link; returns the torque on the link.
  double step(double link_rad, double link_rad_per_s, double step_s) noexcept;

  /// True value.
  double motor_rad() const noexcept { return start_rad_ + drive_.position_rad(); }
  const Drive& drive() const noexcept { return drive_; }
  double kinetic_energy_J() const noexcept;
  /// In the twisted gear and in the end stop.
  double elastic_energy_J(double link_rad) const noexcept;
  double motor_work_J() const noexcept { return motor_work_J_; }  ///< since the start, after the winding

 private:
  double start_rad_;
  Drive drive_;
  double gear_Nm_per_rad_;
  double gear_Nm_s_per_rad_;
  EndStops stops_;
  double motor_work_J_ = 0.0;
};

}  // namespace sim
