/// @file
/// Pieces of MJCF that exports share. Format: MuJoCo's XML reference, elements joint, dcmotor, general and
/// tendon.
#pragma once
#include <Eigen/Core>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "analysis/sliding_fit.h"

namespace analysis::mjcf {

/// Of XML in general.
std::string number(double value);
std::string numbers(const Eigen::VectorXd& values);
std::string escaped(std::string_view text);
/// A comment for each line.
std::string comments(std::span<const std::string> lines, std::string_view indent);

/// Opens <mujoco>, with the options of the simulation.
std::string head(std::string_view name, double timestep_s, std::span<const std::string> remarks,
                 const Eigen::Vector3d& gravity_m_per_s2 = Eigen::Vector3d::Zero());

/// Attributes of a joint: damping, and a frictionloss that does not creep. `share` of the sliding friction.
std::string damping(double share, const SlidingFit& sliding);
std::string friction_loss(double torque_Nm, double timestep_s);

/// Stiffness and damping of the bristles that carry a friction.
struct Contact {
  double stiffness_Nm_per_rad;
  double damping_Nm_s_per_rad;
};
/// As stiff as the time step allows. `lightest_kg_m2`: the least inertia for the whole friction.
Contact step_contact(double lightest_kg_m2, double timestep_s);
/// The largest stiffness of a spring on this inertia that does not ring with the time step.
double stiffest_Nm_per_rad(double inertia_kg_m2, double timestep_s);
/// Passive actuators that carry `share` of the friction of `all`.
std::string bristles(std::string_view joint, double share, const std::vector<Bristle>& all,
                     const Contact& contact);

/// A·sin(periods·θ + phase) in the direction of motion. `cogging` has whole numbers of poles; a gear, which
/// multiplies the angle and the torque, allows every number.
std::string ripple(std::string_view joint, double amplitude_Nm, double periods_per_rev, double phase_rad);
std::string constant(std::string_view joint, double torque_Nm);
/// A tendon of length joint − load. `attributes`: what acts along it.
std::string shaft(std::string_view name, std::string_view joint, std::string_view load,
                  std::string_view attributes);

}  // namespace analysis::mjcf
