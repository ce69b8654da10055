/// @file
/// Forces that the wheels of a base exert, against those that its motion needs.
#pragma once
#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "control/base_description.h"
#include "identification/robot_gap/base_effort_windows.h"

namespace identification::robot_gap {

/// One force or moment for each motion that the kinematics allows: of the list [forward, sideways, moment].
std::vector<Eigen::Index> effort_axes(control::BaseKinematics kinematics);

/// The motion of a base by Newton and Euler, about its centre B, in its own axes, with u, v, r the twist, c
/// the centre of mass and g the slope as gravity in these axes:
///
///   forward:  m·(u' − v·r − c_y·r' − c_x·r²) + m·g_x
///   sideways: m·(v' + u·r + c_x·r' − c_y·r²) + m·g_y + sideways_resistance·sign(v)
///   moment:   (I + m·c²)·r' + m·c_x·(v' + u·r) − m·c_y·(u' − v·r) + m·(c_x·g_y − c_y·g_x)
///             + turning_resistance·sign(r)
///
/// is what the wheels push, by the power of their torques less friction and the inertia of the wheels. Of a
/// tricycle the steered wheel's direction is the only one.
class BaseForces {
 public:
  /// `floor`: of the recording. `given`: whose geometry and torque_scale the forces are reported by.
  /// Otherwise larger wheels, or a smaller torque, would shrink what is wrong with all forces.
  BaseForces(const control::BaseDescription& base, const control::BaseDescription& given, int floor);

  /// What the reported torques push by their torque_scale, without friction or inertia [N, N, N·m].
  Eigen::Vector3d pushed(const EffortWindow& window) const;
  /// Torques that the wheels would report; among more wheels than directions of motion, forces are shared
  /// with the least squares of the torques.
  Eigen::VectorXd reported_torques(const EffortWindow& window) const;
  /// Pushed minus needed, as the given base would report it.
  Eigen::Vector3d excess(const EffortWindow& window) const;

 private:
  Eigen::VectorXd lost_torque(const EffortWindow& window) const;
  Eigen::Vector3d needed(const EffortWindow& window) const;
  double needed_along(const EffortWindow& window) const;

  control::BaseDescription base_;
  double floor_resistance_N_ = 0;
  double moved_turning_ = 1;  // share of the motion that slip leaves
  double moved_along_ = 1;
  Eigen::MatrixX3d rates_;    // of the wheels, by the twist without slip
  Eigen::Matrix3Xd twists_;   // by the rates
  Eigen::VectorXd scales_;    // of the torques
  Eigen::Vector3d reported_;  // of a force
};

/// Rms of each axis that the noise of the samples leaves in these windows.
Eigen::Vector3d effort_floor(const control::BaseDescription& base, std::span<const BaseMotion> motions,
                             std::span<const std::vector<EffortWindow>> windows, const EffortNoise& noise);

}  // namespace identification::robot_gap
