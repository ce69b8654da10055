#include "analysis/export_mujoco.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <string_view>

#include "analysis/mjcf.h"
#include "model/effects/effect_chain.h"

namespace analysis {
namespace {

using mjcf::number;
using model::effects::AnyEffect;
using model::effects::DriveModel;
using model::effects::Mechanics;

/// MuJoCo refuses a body without mass. Its inertia is this share of the drive's: nothing.
constexpr double kBodyShare = 1e-6;
/// Impacts at this speed lose as much with a linear damper as with Hunt and Crossley's, α·v.
constexpr double kImpact_rad_per_s = 0.4;
/// The largest damping of a flank that is stable, in its units: 2·ζ·ω·step.
constexpr double kStableDamping = 1;
/// A joint and its share of the drive.
struct Hinge {
  std::string name;
  double inertia_kg_m2;
  double friction_share;
};

/// `attributes`: further ones of the joint.
std::string body(const Hinge& hinge, const SlidingFit& sliding, double frictionloss_Nm, double timestep_s,
                 std::string_view attributes = "") {
  const double share = hinge.friction_share;
  return fmt::format(
             "    <body name=\"{0}\">\n"
             "      <inertial pos=\"0 0 0\" mass=\"0.001\" diaginertia=\"{1} {1} {1}\"/>\n"
             "      <joint name=\"{0}\" type=\"hinge\" axis=\"0 0 1\" armature=\"{2}\"",
             hinge.name, number(kBodyShare * hinge.inertia_kg_m2),
             number((1 - kBodyShare) * hinge.inertia_kg_m2)) +
         mjcf::damping(share, sliding) + mjcf::friction_loss(share * frictionloss_Nm, timestep_s) +
         std::string(attributes) + "/>\n    </body>\n";
}

/// Of the whole friction. `lightest_kg_m2`: the least inertia for its share of friction.
mjcf::Contact contact(const Mechanics& mechanics, double lightest_kg_m2, double timestep_s) {
  if (mechanics.stiffness_Nm_per_rad > 0)
    return {std::min(mechanics.stiffness_Nm_per_rad, mjcf::stiffest_Nm_per_rad(lightest_kg_m2, timestep_s)),
            mechanics.damping_Nm_s_per_rad};
  return mjcf::step_contact(lightest_kg_m2, timestep_s);
}

std::string tendon(const Mechanics& mechanics, double timestep_s) {
  std::string text;
  if (mechanics.shaft_Nm_per_rad > 0)
    text += fmt::format(R"( stiffness="{}" damping="{}" springlength="{} {}")",
                        number(mechanics.shaft_Nm_per_rad), number(mechanics.shaft_Nm_s_per_rad),
                        number(-mechanics.backlash_rad / 2), number(mechanics.backlash_rad / 2));
  else {
    // In the direct format of solref: stiffness and damping for the reduced inertia.
    const double rad_per_s = 2 * std::numbers::pi * mechanics.flank_Hz;
    const double loss = std::min(mechanics.flank_loss_s_per_rad * kImpact_rad_per_s, 0.9);
    const double ratio =
        mechanics.flank_damping_ratio - std::log(1 - loss) / std::hypot(std::numbers::pi, std::log(1 - loss));
    const double damping_per_s = std::min(2 * ratio * rad_per_s, kStableDamping / timestep_s);
    text +=
        fmt::format(R"( limited="true" range="{} {}" solreflimit="-{} -{}" solimplimit="0.999 0.999 0.001")",
                    number(-mechanics.backlash_rad / 2), number(mechanics.backlash_rad / 2),
                    number(rad_per_s * rad_per_s), number(damping_per_s));
  }
  return "  <tendon>\n" + mjcf::shaft("shaft", "drive", "drive_load", text) + "  </tendon>\n";
}

std::string position_torques(const DriveModel& model, const Hinge& motor, const Hinge& load) {
  std::string text;
  for (const AnyEffect& effect : model.effects) {
    if (const auto* cogging = std::get_if<model::effects::Cogging>(&effect)) {
      const auto& p = cogging->parameters();
      text += mjcf::ripple(motor.name, -p.amplitude_Nm, p.periods_per_rev, p.phase_rad);
    } else if (const auto* imbalance = std::get_if<model::effects::Imbalance>(&effect)) {
      const auto& p = imbalance->parameters();
      text += mjcf::ripple(load.name, -p.torque_Nm, 1, -p.rest_position_rad);
    } else if (const auto* offset = std::get_if<model::effects::TorqueOffset>(&effect)) {
      text += mjcf::constant(load.name, -offset->parameters().torque_Nm);
    }
  }
  return text;
}

/// MuJoCo limits and delays the command, filters it, and multiplies it with the gear. Its delay is a whole
/// number of steps, and its filter a step late, unless the attributes change that.
std::string motor(const DriveModel& model, double timestep_s) {
  double delay_s = 0;
  double lag_s = 0;
  double limit_Nm = std::numeric_limits<double>::infinity();  // of the command
  double gain = 1;
  double offset_Nm = 0;
  for (const AnyEffect& effect : model.effects) {
    if (const auto* late = std::get_if<model::effects::TransportDelay>(&effect)) {
      delay_s += late->parameters().delay_s;
    } else if (const auto* slow = std::get_if<model::effects::TorqueLag>(&effect)) {
      lag_s += slow->parameters().time_constant_s;
    } else if (const auto* limit = std::get_if<model::effects::TorqueSaturation>(&effect)) {
      limit_Nm = std::min(limit_Nm, limit->parameters().limit_Nm / gain);
    } else if (const auto* scale = std::get_if<model::effects::ActuatorGain>(&effect)) {
      gain *= scale->parameters().gain;
      offset_Nm *= scale->parameters().gain;
    } else if (const auto* offset = std::get_if<model::effects::ActuatorOffset>(&effect)) {
      offset_Nm += offset->parameters().torque_Nm;
    }
  }
  std::string text = fmt::format(R"(    <{} name="drive" joint="drive")", lag_s > 0 ? "general" : "motor");
  if (lag_s > 0) text += fmt::format(R"( dyntype="filterexact" dynprm="{}" actearly="true")", number(lag_s));
  if (gain != 1) text += fmt::format(R"( gear="{}")", number(gain));
  if (std::isfinite(limit_Nm))
    text += fmt::format(R"( ctrlrange="{} {}")", number(-limit_Nm), number(limit_Nm));
  if (delay_s > 0)
    text += fmt::format(R"( delay="{}" nsample="{}" interp="linear")", number(delay_s),
                        static_cast<long>(std::ceil(delay_s / timestep_s)) + 1);
  text += "/>\n";
  return offset_Nm == 0 ? text : text + mjcf::constant("drive", offset_Nm);
}

/// Attributes of the load's joint.
std::string springs(const DriveModel& model) {
  // Several act as one.
  double stiffness_Nm_per_rad = 0;
  double moment_Nm = 0;
  for (const AnyEffect& effect : model.effects)
    if (const auto* spring = std::get_if<model::effects::Spring>(&effect)) {
      stiffness_Nm_per_rad += spring->parameters().stiffness_Nm_per_rad;
      moment_Nm += spring->parameters().stiffness_Nm_per_rad * spring->parameters().rest_position_rad;
    }
  if (stiffness_Nm_per_rad == 0) return {};
  return fmt::format(R"( stiffness="{}" springref="{}")", number(stiffness_Nm_per_rad),
                     number(moment_Nm / stiffness_Nm_per_rad));
}

std::string_view name_of(const DriveModel& model) {
  return model.name.empty() ? std::string_view("drive") : std::string_view(model.name);
}

Mechanics mechanics_of(const DriveModel& model) {
  return model::effects::EffectChain(model.effects).arranged({.inertia_kg_m2 = model.inertia_kg_m2});
}

}  // namespace

std::string mujoco_text(const DriveModel& model, const SlidingFit& sliding, const MujocoOptions& options) {
  const Mechanics mechanics = mechanics_of(model);
  const bool two_masses = mechanics.two_masses();
  const double load_share = two_masses ? mechanics.load_share : 0;
  const double load_friction = two_masses ? mechanics.friction_share() : 0;
  const Hinge driven{"drive", (1 - load_share) * mechanics.inertia_kg_m2, 1 - load_friction};
  const Hinge behind{"drive_load", load_share * mechanics.inertia_kg_m2, load_friction};
  const Hinge& load = two_masses ? behind : driven;
  const double lightest = two_masses ? std::min(driven.inertia_kg_m2 / driven.friction_share,
                                                behind.inertia_kg_m2 / behind.friction_share)
                                     : driven.inertia_kg_m2;

  // A contact of its own carries all friction. Otherwise Coulomb friction is a constraint, which needs no
  // state, and bristles carry what changes with speed.
  std::vector<Bristle> carrying = sliding.bristles;
  double frictionloss_Nm = sliding.coulomb_Nm;
  if (mechanics.stiffness_Nm_per_rad > 0) {
    if (carrying.empty()) carrying.push_back({});
    double bumps_Nm = 0;
    for (const Bristle& one : carrying) bumps_Nm += std::max(one.rest_Nm, one.sliding_Nm);
    for (Bristle& one : carrying) {
      const double share = bumps_Nm > 0 ? std::max(one.rest_Nm, one.sliding_Nm) / bumps_Nm : 1;
      one.rest_Nm += share * sliding.coulomb_Nm;
      one.sliding_Nm += share * sliding.coulomb_Nm;
    }
    frictionloss_Nm = 0;
  }
  const mjcf::Contact how = contact(mechanics, lightest, options.timestep_s);

  std::string text = mjcf::head(name_of(model), options.timestep_s, options.remarks);
  const std::string sprung = springs(model);
  text += "  <worldbody>\n" +
          body(driven, sliding, frictionloss_Nm, options.timestep_s, two_masses ? "" : sprung);
  if (two_masses) text += body(behind, sliding, frictionloss_Nm, options.timestep_s, sprung);
  text += "  </worldbody>\n";
  if (two_masses) text += tendon(mechanics, options.timestep_s);
  text += "  <actuator>\n" + motor(model, options.timestep_s) +
          mjcf::bristles(driven.name, driven.friction_share, carrying, how);
  if (two_masses) text += mjcf::bristles(behind.name, behind.friction_share, carrying, how);
  text += position_torques(model, driven, load);
  if (sliding.offset_Nm != 0) {
    text += mjcf::constant(driven.name, -driven.friction_share * sliding.offset_Nm);
    if (two_masses) text += mjcf::constant(behind.name, -behind.friction_share * sliding.offset_Nm);
  }
  return text + "  </actuator>\n</mujoco>\n";
}

std::string plain_mujoco_text(const DriveModel& model, const SlidingFit& sliding,
                              const MujocoOptions& options) {
  const Hinge drive{"drive", mechanics_of(model).inertia_kg_m2, 1};
  return mjcf::head(name_of(model), options.timestep_s, options.remarks) + "  <worldbody>\n" +
         body(drive, sliding, sliding.coulomb_Nm, options.timestep_s) +
         "  </worldbody>\n  <actuator>\n    <motor name=\"drive\" joint=\"drive\"/>\n  "
         "</actuator>\n</mujoco>\n";
}

std::string urdf_text(const DriveModel& model, const SlidingFit& sliding,
                      std::span<const std::string> remarks) {
  const std::string inertia = number(mechanics_of(model).inertia_kg_m2);
  return fmt::format(
      "<?xml version=\"1.0\"?>\n<robot name=\"{}\">\n{}"
      "  <link name=\"base\"/>\n"
      "  <link name=\"load\">\n"
      "    <inertial>\n"
      "      <mass value=\"0.001\"/>\n"
      "      <inertia ixx=\"{}\" ixy=\"0\" ixz=\"0\" iyy=\"{}\" iyz=\"0\" izz=\"{}\"/>\n"
      "    </inertial>\n"
      "  </link>\n"
      "  <joint name=\"drive\" type=\"continuous\">\n"
      "    <parent link=\"base\"/>\n"
      "    <child link=\"load\"/>\n"
      "    <axis xyz=\"0 0 1\"/>\n"
      "    <dynamics damping=\"{}\" friction=\"{}\"/>\n"
      "  </joint>\n"
      "</robot>\n",
      mjcf::escaped(name_of(model)), mjcf::comments(remarks, "  "), inertia, inertia, inertia,
      number(sliding.viscous_Nm_s_per_rad), number(sliding.coulomb_Nm));
}

}  // namespace analysis
