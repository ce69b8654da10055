/// @file
/// One joint of the arm between its end stops, and the drive that it shares with the whole simulated arm
/// (sim/mobile_manipulator.h).
#pragma once
#include <chrono>
#include <cstdint>

#include "model/friction/sliding_table.h"
#include "sim/bus/axis_data.h"
#include "sim/bus/board_drive.h"
#include "sim/drive.h"
#include "sim/end_stops.h"

namespace sim::bus {

/// Motor, gear, sensors and the controller's loops, tuned for the joint's own load inertia.
DriveParameters arm_drive_parameters(const ArmJointData& data);
/// Coulomb and viscous from rest on. A wheel's breakaway band would hide the viscous part at the speeds of an
/// arm.
model::friction::SlidingTable arm_friction(const ArmJointData& data);

/// A geared drive with Coulomb and viscous friction and a constant load inertia; no gravity, no coupling. The
/// end stops are damped springs that only push and are stiff compared with the drive: 3 A of motor current
/// compress joint 1's by less than a milliradian.
class ArmJoint final : public BoardDrive {
 public:
  /// @throws std::invalid_argument if `start_rad` is not between the stops.
  ArmJoint(const ArmJointData& data, double start_rad, std::uint64_t noise_seed);

  void command(const hal::JointCommand& command, bool powered) noexcept override;
  hal::JointSample measured() const noexcept override;
  /// Cycle.
  void advance(std::chrono::nanoseconds period) noexcept;

  /// True value, in the official driver's angles.
  double position_rad() const noexcept { return start_rad_ + drive_.position_rad(); }
  double velocity_rad_per_s() const noexcept { return drive_.velocity_rad_per_s(); }
  /// The joint cannot pass this angle towards the home stop: for homing that finds an obstacle instead of the
  /// stop.
  void block_at(double position_rad) noexcept;

 private:
  double start_rad_;
  EndStops stops_;
  bool homes_upwards_;
  Drive drive_;
  hal::JointCommand command_;
  bool powered_ = false;
};

}  // namespace sim::bus
