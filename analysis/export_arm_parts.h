/// @file
/// What another engine can hold of an arm, and what that leaves of its description.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "analysis/export_parts.h"
#include "runtime/configuration/robot_file.h"

namespace analysis {

enum class ArmTarget : std::uint8_t {
  kMujoco,
  kPlainMujoco,  ///< attributes of bodies and joints, and the gear of motors
  kUrdf,
};

/// Something of one drive that is not as in a drive without effects.
struct ArmCarriage {
  Carriage carriage;
  control::ArmDescription without;  ///< the arm without it
};
/// Whether gravity is along -z of the base.
bool is_level(const Eigen::Vector3d& gravity_B_m_per_s2);
/// Of gravity, bodies and payload, one line each.
std::vector<Carriage> body_carriages(const control::ArmDescription& arm, ArmTarget target);

/// How the arm is used, by joint.
struct ArmOperation {
  /// At which an approximation should be good. None is empty.
  std::vector<std::vector<double>> speeds_rad_per_s;
  /// Of the links, which turns load-dependent friction into Coulomb's. Empty without recordings.
  std::vector<double> mean_load_Nm;
};

/// Of all joints, in their order: "shoulder coulomb".
std::vector<ArmCarriage> arm_carriages(const control::ArmDescription& arm, ArmTarget target,
                                       const ArmOperation& operation);

/// An arm that the target can hold exactly, with no zero of an encoder: frames are turned by it.
struct HeldArm {
  control::ArmDescription arm;
  /// Sentences about what else had to change.
  std::vector<std::string> changes;
};
HeldArm held_by(const control::ArmDescription& arm, ArmTarget target, const ArmOperation& operation);

/// Least inertia that each joint can show in any pose, when the others are free to move with it [kg·m², kg].
/// A rotor before an elastic gear does not count.
/// @throws std::invalid_argument naming a joint without inertia.
std::vector<double> lightest_inertias(const control::ArmDescription& arm);

}  // namespace analysis
