/// @file
/// The part of a drive model that a compensator can act on.
#pragma once
#include "model/effects/drive_model.h"
#include "model/joint_resistance.h"

namespace model::effects {

/// For control::BaseController. It uses
/// - coulomb, viscous, stribeck, direction_asymmetry, midspeed_dip, quadratic_drag: together the sliding
///   friction of either direction, at rest the breakaway torque;
/// - thermal_drift: the smaller friction at each speed, cold or warm, because a compensator does not know the
///   temperature of the drive and must not exceed friction;
/// - position_friction: its minimum over the position, for the same reason;
/// - torque_offset, imbalance, cogging: the position-dependent torque, minus actuator_offset;
/// - torque_deadband: the minimum torque;
/// - an effect that the program has added: its friction and its position-dependent torque;
/// - empirical: its position-dependent torque, and at each velocity the smallest friction that it has there
///   over position, load and time since reversal.
/// It ignores effects that an added torque cannot compensate, or that need signals the controller does not
/// have: presliding, backlash and elasticity (motion before the joint moves), inertia (acceleration),
/// load_friction (the load), torque_saturation, torque_lag and transport_delay (the future), torque_ripple
/// (within a few per cent), unsigned_current, torque_sensor_offset and encoder_eccentricity (sensors). It
/// also ignores spring: if its stiffness is too large, assistance that grows with the position drives the
/// joint away. Setup: samples the friction, allocates. @throws std::invalid_argument if friction is not
/// finite, or for an actuator_gain other than 1.
model::JointResistance resistance_of(const DriveModel& model);

}  // namespace model::effects
