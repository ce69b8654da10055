/// @file
/// A drive model as MJCF, for MuJoCo 3.12 and later; and as URDF. Formats: MuJoCo's XML reference, elements
/// joint, dcmotor and general; ROS wiki, urdf/XML/joint.
#pragma once
#include <span>
#include <string>

#include "analysis/sliding_fit.h"
#include "model/effects/drive_model.h"

namespace analysis {

struct MujocoOptions {
  double timestep_s = 5e-4;
  /// Comments at the head of the file, a line each.
  std::span<const std::string> remarks{};
};

/// A file that runs as it is: a hinge "drive" with all of the inertia as its armature, a motor actuator of
/// that name whose control is the torque command [N·m], and passive actuators for friction, ripple and
/// constant torques. With a gap or a spring the load is a second hinge, "drive_load". The integrator is
/// Euler: MuJoCo's implicit ones count the damping of a LuGre bristle as viscous friction of the sliding
/// joint, too (3.14). `sliding`: fit_sliding() of the model. Effects without a place are left out.
/// @throws std::invalid_argument if no inertia is left.
std::string mujoco_text(const model::effects::DriveModel& model, const SlidingFit& sliding,
                        const MujocoOptions& options);
/// Armature, damping and frictionloss only, for engines that do not read the rest.
std::string plain_mujoco_text(const model::effects::DriveModel& model, const SlidingFit& sliding,
                              const MujocoOptions& options);
/// A continuous joint "drive" with `<dynamics damping friction>`, between a fixed base and a link with the
/// inertia about the joint's axis: URDF has no place for the inertia of a rotor.
std::string urdf_text(const model::effects::DriveModel& model, const SlidingFit& sliding,
                      std::span<const std::string> remarks);

}  // namespace analysis
