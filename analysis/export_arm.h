/// @file
/// An arm as MJCF, for MuJoCo 3.12 and later, and as URDF. Formats: MuJoCo's XML reference; ROS wiki,
/// urdf/XML.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "runtime/configuration/robot_file.h"

namespace analysis {

struct ArmNames {
  std::string robot;  ///< may be empty
  std::string base;   ///< links
  std::string tip;
};

/// The gear of a drive between two hinges. The spring may be softer than the drive's, and without a rotor
/// there is one, so that the time step is stable.
struct ElasticShaft {
  double rotor_kg_m2 = 0;
  double stiffness_Nm_per_rad = 0;
  double damping_Nm_s_per_rad = 0;  ///< of our own choice
};
/// `lightest_kg_m2`: the least inertia of the link.
ElasticShaft elastic_shaft(const control::ArmDrive& drive, double lightest_kg_m2, double timestep_s);

/// Of the base's body in the file: `world` is MuJoCo's own.
std::string mujoco_base(const control::ArmDescription& arm, const ArmNames& names);

/// A file that runs as it is: a body for each link, a hinge or slide for each joint, a site at the tip, and a
/// motor for each joint, of its name, whose control is the torque that the drive reports [N·m]. Behind an
/// elastic gear the link has a hinge of its own, NAME_link, and the joint NAME is that of the encoder. `arm`:
/// what MuJoCo holds of one (held_by()). @throws std::invalid_argument naming a joint without inertia.
std::string arm_mujoco_text(const control::ArmDescription& arm, const ArmNames& names, double timestep_s,
                            std::span<const std::string> remarks);

/// Links and joints with `<dynamics damping friction>`; below a level link if the base is tilted. `arm`: what
/// URDF holds of one.
std::string arm_urdf_text(const control::ArmDescription& arm, const ArmNames& names,
                          std::span<const std::string> remarks);

}  // namespace analysis
