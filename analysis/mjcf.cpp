#include "analysis/mjcf.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "runtime/program/printable.h"

namespace analysis::mjcf {
namespace {

/// dcmotor refuses a motor constant of zero, which would make it passive. Its shorted winding brakes with the
/// square of this: nothing.
constexpr std::string_view kPassive = R"(input="none" motorconst="1e-9" resistance="1")";
/// Friction constraint at its stiffest: Coulomb's law to a thousandth, and no creep at rest.
constexpr double kFrictionSteps = 2;  // time constant of the constraint, in time steps: MuJoCo's minimum
/// A bristle without a stiffness of its own is as stiff as the step allows, as in our simulation.
constexpr double kContactAngle_rad = 0.3;  // per step
/// A stiffer one would ring.
constexpr double kStiffestAngle_rad = 0.5;
/// dcmotor divides by the level.
constexpr double kLeastLevel = 1e-6;
/// The damping of a bristle acts on the change of its deflection, which grows without bound while its level
/// falls by orders of magnitude. Such a bristle gets none.
constexpr double kDampedLevels = 0.2;

/// XML comments may not contain two hyphens, and XML no control characters and nothing but UTF-8.
std::string comment(std::string_view line) {
  std::string text = runtime::printable(line);
  for (std::size_t at = 0; (at = text.find("--", at)) != std::string::npos;) text.insert(at + 1, " ");
  if (text.ends_with('-')) text += ' ';
  return "<!-- " + text + " -->\n";
}

}  // namespace

std::string number(double value) { return fmt::format("{:.9g}", value); }

std::string numbers(const Eigen::VectorXd& values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : " ") + number(value + 0.0);  // no "-0"
  return text;
}

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : runtime::printable(text)) {
    if (c == '\n' || c == '\t') continue;
    switch (c) {
      case '&': result += "&amp;"; break;
      case '<': result += "&lt;"; break;
      case '>': result += "&gt;"; break;
      case '"': result += "&quot;"; break;
      default: result += c;
    }
  }
  return result;
}

std::string comments(std::span<const std::string> lines, std::string_view indent) {
  std::string text;
  for (const std::string& line : lines) (text += indent) += comment(line);
  return text;
}

std::string head(std::string_view name, double timestep_s, std::span<const std::string> remarks,
                 const Eigen::Vector3d& gravity_m_per_s2) {
  return fmt::format(
      "<mujoco model=\"{}\">\n{}  <option timestep=\"{}\" integrator=\"Euler\" gravity=\"{}\"/>\n",
      escaped(name), comments(remarks, "  "), number(timestep_s), numbers(gravity_m_per_s2));
}

std::string damping(double share, const SlidingFit& sliding) {
  return fmt::format(
      " damping=\"{}{}\"", number(share * sliding.viscous_Nm_s_per_rad),
      sliding.quadratic_Nm_s2_per_rad2 == 0 ? "" : " " + number(share * sliding.quadratic_Nm_s2_per_rad2));
}

std::string friction_loss(double torque_Nm, double timestep_s) {
  if (!(torque_Nm > 0)) return {};
  return fmt::format(
      "\n             frictionloss=\"{}\" solreffriction=\"{} 1\" solimpfriction=\"0.9999 0.9999 0.001\"",
      number(torque_Nm), number(kFrictionSteps * timestep_s));
}

Contact step_contact(double lightest_kg_m2, double timestep_s) {
  return {lightest_kg_m2 * std::pow(kContactAngle_rad / timestep_s, 2), 0};
}

double stiffest_Nm_per_rad(double inertia_kg_m2, double timestep_s) {
  return inertia_kg_m2 * std::pow(kStiffestAngle_rad / timestep_s, 2);
}

std::string bristles(std::string_view joint, double share, const std::vector<Bristle>& all,
                     const Contact& contact) {
  double rest_Nm = 0;
  for (const Bristle& one : all) rest_Nm += std::max(one.rest_Nm, one.sliding_Nm);
  std::string text;
  if (!(rest_Nm > 0)) return text;  // a contact without friction
  for (const Bristle& one : all) {
    const double largest = std::max(one.rest_Nm, one.sliding_Nm);
    const double part = share * largest / rest_Nm;
    const auto level = [&](double Nm) { return number(share * std::max(Nm, kLeastLevel * largest)); };
    const double damped = std::min(one.rest_Nm, one.sliding_Nm) >= kDampedLevels * largest
                              ? part * contact.damping_Nm_s_per_rad
                              : 0;
    text += fmt::format("    <dcmotor joint=\"{}\" {} lugre=\"{} {} {} {} {}\"/>\n", joint, kPassive,
                        number(part * contact.stiffness_Nm_per_rad), number(damped), level(one.sliding_Nm),
                        level(one.rest_Nm), number(one.velocity_rad_per_s));
  }
  return text;
}

std::string ripple(std::string_view joint, double amplitude_Nm, double periods_per_rev, double phase_rad) {
  return fmt::format("    <dcmotor joint=\"{}\" {} gear=\"{}\" cogging=\"{} 1 {}\"/>\n", joint, kPassive,
                     number(periods_per_rev), number(amplitude_Nm / periods_per_rev), number(phase_rad));
}

std::string constant(std::string_view joint, double torque_Nm) {
  return fmt::format("    <general joint=\"{}\" biastype=\"affine\" gainprm=\"0\" biasprm=\"{} 0 0\"/>\n",
                     joint, number(torque_Nm));
}

std::string shaft(std::string_view name, std::string_view joint, std::string_view load,
                  std::string_view attributes) {
  return fmt::format(
      "    <fixed name=\"{}\"{}>\n      <joint joint=\"{}\" coef=\"1\"/>\n      <joint joint=\"{}\" "
      "coef=\"-1\"/>\n    </fixed>\n",
      name, attributes, joint, load);
}

}  // namespace analysis::mjcf
