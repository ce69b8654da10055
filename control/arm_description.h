/// @file
/// A serial arm with its drives: all that predicts the torques of a motion.
#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "control/serial_arm.h"
#include "model/gravity.h"

namespace control {

/// Torque that a drive spends beside the links, and how it reports torque and angle. Joint side; of a joint
/// that slides, N in place of N·m and m in place of rad.
///
///   joint torque = rigid body + rotor_inertia·q̈ + viscous·q̇ + quadratic_drag·q̇·|q̇| + offset
///                  + spring·(q − spring_rest) + cable_2·q² + cable_3·q³ + ripples
///                  + sign(q̇)·(coulomb + load_friction·|rigid body| + stribeck·exp(−(q̇/stribeck_speed)²))
///                  + Σ neighbour_friction·sign(q̇ of the neighbour)
///   reported torque = joint torque / torque_scale
///   q = reported angle + encoder_zero − compliance·rigid body: the encoder is on the motor's side of the
///   gear
///
/// Friction and rotor inertia are on that side too; everything else moves with the link, at q.
struct ArmDrive {
  std::string joint;
  double gear_ratio = 1;
  double torque_scale = 1;
  double encoder_zero_rad = 0;
  double compliance_rad_per_Nm = 0;   ///< of the gear
  bool friction_before_gear = false;  ///< true: the gear carries the torque of the rigid body alone
  double rotor_inertia_kg_m2 = 0;
  double coulomb_Nm = 0;
  double viscous_Nm_s_per_rad = 0;
  double quadratic_drag_Nm_s2_per_rad2 = 0;
  double offset_Nm = 0;
  double load_friction = 0;  ///< share of the torque that the gear carries
  double stribeck_Nm = 0;    ///< at rest, above Coulomb
  double stribeck_speed_rad_per_s = 0.1;
  double spring_Nm_per_rad = 0;
  double spring_rest_rad = 0;
  double cable_2_Nm_per_rad2 = 0;
  double cable_3_Nm_per_rad3 = 0;
  double friction_of_previous_Nm = 0;  ///< with the direction of the joint before; of the first: none
  double friction_of_next_Nm = 0;
  struct Ripple {
    double periods_per_rev = 0;
    double sine_Nm = 0;
    double cosine_Nm = 0;
  };
  std::vector<Ripple> ripples{};
};

struct ArmDescription {
  SerialArm arm;
  std::vector<ArmDrive> drives;  ///< one for each link of the arm, in that order
  Eigen::Vector3d gravity_B_m_per_s2{0, 0, -model::kGravity_m_per_s2};
  double payload_kg = 0;                             ///< a point mass
  Eigen::Vector3d p_TP_m = Eigen::Vector3d::Zero();  ///< its place from the tip
};

}  // namespace control
