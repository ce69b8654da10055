/// @file
/// What of a drive model a compensator can act on.
#pragma once
#include "model/effects/drive_model.h"
#include "model/joint_resistance.h"

namespace model::effects {

/// For control::BaseController. It takes
/// - coulomb, viscous, stribeck, direction_asymmetry, midspeed_dip, quadratic_drag: together the sliding
///   friction of either direction, at rest the break-away torque;
/// - thermal_drift: whichever is less at a speed, cold or warm. Nobody tells a compensator how warm the drive
///   is, and help must not exceed friction;
/// - torque_offset, imbalance, cogging: the torque by position;
/// - torque_deadband: the least torque;
/// - an effect that the program has added: its friction and its torque by position.
/// It ignores what a torque at the right moment does not mend, or needs signals that the controller has not:
/// presliding, backlash and elasticity (what moves before the joint does), inertia (acceleration),
/// load_friction (the load), transport_delay (the future) and unsigned_current (a sensor it does not read).
/// Setup: samples the friction, allocates. @throws std::invalid_argument when friction is not finite.
model::JointResistance resistance_of(const DriveModel& model);

}  // namespace model::effects
