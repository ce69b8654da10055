#include "analysis/export_arm_parts.h"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>

#include "analysis/sliding_fit.h"
#include "identification/robot_gap/link_motion.h"

namespace analysis {
namespace {

using control::ArmDescription;
using control::ArmDrive;
using control::LinkInertia;
using model::effects::DriveModel;
using model::effects::make_effect;

/// Engines refuse smaller masses and moments.
constexpr double kLeastMass_kg = 1e-9;
constexpr double kLeastMoment_kg_m2 = 1e-12;
/// Far above what the least masses and moments of some links add to a joint: below it there is nothing that
/// moves.
constexpr double kLeastInertia_kg_m2 = 1e-8;
/// Share of a moment below which a correction of it is rounding.
constexpr double kRounding = 1e-5;

/// The sliding friction of a drive. Its inertia does not matter here.
DriveModel sliding_part(const ArmDrive& drive) {
  DriveModel model{.name = drive.joint, .inertia_kg_m2 = 1};
  const auto add = [&](double size, std::string_view effect,
                       std::initializer_list<model::effects::NamedValue> values) {
    if (size != 0) model.effects.push_back(make_effect(effect, values));
  };
  add(drive.coulomb_Nm, "coulomb", {{"torque_Nm", drive.coulomb_Nm}});
  add(drive.viscous_Nm_s_per_rad, "viscous", {{"coefficient_Nm_s_per_rad", drive.viscous_Nm_s_per_rad}});
  add(drive.quadratic_drag_Nm_s2_per_rad2, "quadratic_drag",
      {{"coefficient_Nm_s2_per_rad2", drive.quadratic_drag_Nm_s2_per_rad2}});
  add(drive.stribeck_Nm, "stribeck",
      {{"static_torque_Nm", drive.coulomb_Nm + drive.stribeck_Nm},
       {"velocity_rad_per_s", drive.stribeck_speed_rad_per_s},
       {"exponent", 2},
       {"tail", 0}});
  return model;
}

/// How one thing of a drive is held. Empty: it is not.
struct DriveRow {
  std::string_view effect;  ///< as in gap.json
  bool (*is_there)(const ArmDrive& drive);
  void (*drop)(ArmDrive& drive);
  std::string_view library{};  ///< name of the effect whose places are those of a drive model
  std::string_view mujoco{}, plain{}, urdf{};
  std::string_view lost_in_urdf{};
  bool urdf_only_turning = false;  ///< URDF has no place for it at a joint that slides
};

constexpr std::string_view kLoadFriction = "load_friction";

const std::array kDriveRows{
    DriveRow{"encoder_zero", [](const ArmDrive& d) { return d.encoder_zero_rad != 0; },
             [](ArmDrive& d) { d.encoder_zero_rad = 0; }, "", "the frame of the link is turned by it",
             "the frame of the link is turned by it", "the frame of the link is turned by it"},
    DriveRow{"torque_constant", [](const ArmDrive& d) { return d.torque_scale != 1; },
             [](ArmDrive& d) { d.torque_scale = 1; }, "", "gear of the motor", "gear of the motor"},
    DriveRow{"rotor_inertia", [](const ArmDrive& d) { return d.rotor_inertia_kg_m2 != 0; },
             [](ArmDrive& d) { d.rotor_inertia_kg_m2 = 0; }, "", "joint armature", "joint armature",
             "inertia of the link about the axis",
             "that it turns with this joint alone: here it loads the joints before, too", true},
    DriveRow{"elasticity", [](const ArmDrive& d) { return d.compliance_rad_per_Nm != 0; },
             [](ArmDrive& d) {
               d.compliance_rad_per_Nm = 0;
               d.friction_before_gear = false;
             },
             "", "two hinges and a tendon with stiffness"},
    DriveRow{"coulomb", [](const ArmDrive& d) { return d.coulomb_Nm != 0; },
             [](ArmDrive& d) { d.coulomb_Nm = 0; }, "", "joint frictionloss", "joint frictionloss",
             "friction"},
    DriveRow{"viscous", [](const ArmDrive& d) { return d.viscous_Nm_s_per_rad != 0; },
             [](ArmDrive& d) { d.viscous_Nm_s_per_rad = 0; }, "viscous"},
    DriveRow{"quadratic_drag", [](const ArmDrive& d) { return d.quadratic_drag_Nm_s2_per_rad2 != 0; },
             [](ArmDrive& d) { d.quadratic_drag_Nm_s2_per_rad2 = 0; }, "quadratic_drag"},
    DriveRow{"stribeck", [](const ArmDrive& d) { return d.stribeck_Nm != 0; },
             [](ArmDrive& d) { d.stribeck_Nm = 0; }, "stribeck"},
    DriveRow{"torque_offset", [](const ArmDrive& d) { return d.offset_Nm != 0; },
             [](ArmDrive& d) { d.offset_Nm = 0; }, "torque_offset"},
    DriveRow{kLoadFriction, [](const ArmDrive& d) { return d.load_friction != 0; },
             [](ArmDrive& d) { d.load_friction = 0; }},
    DriveRow{"spring", [](const ArmDrive& d) { return d.spring_Nm_per_rad != 0; },
             [](ArmDrive& d) { d.spring_Nm_per_rad = 0; }, "", "joint stiffness", "joint stiffness"},
    DriveRow{"cable_torque",
             [](const ArmDrive& d) { return d.cable_2_Nm_per_rad2 != 0 || d.cable_3_Nm_per_rad3 != 0; },
             [](ArmDrive& d) { d.cable_2_Nm_per_rad2 = d.cable_3_Nm_per_rad3 = 0; }, "",
             "joint stiffness, its polynomial"},
    DriveRow{"cogging", [](const ArmDrive& d) { return !d.ripples.empty(); },
             [](ArmDrive& d) { d.ripples.clear(); }, "cogging"},
    DriveRow{"friction_coupling",
             [](const ArmDrive& d) { return d.friction_of_previous_Nm != 0 || d.friction_of_next_Nm != 0; },
             [](ArmDrive& d) { d.friction_of_previous_Nm = d.friction_of_next_Nm = 0; }},
};

Target library_target(ArmTarget target) {
  switch (target) {
    case ArmTarget::kMujoco: return mujoco_target();
    case ArmTarget::kPlainMujoco: return plain_target("the plain file");
    case ArmTarget::kUrdf: break;
  }
  return plain_target("URDF");
}

Carriage carriage_of(const DriveRow& row, ArmTarget target, bool slides) {
  Carriage carriage{.effect = std::string(row.effect), .as = {}, .lost = "all of it"};
  if (!row.library.empty()) {
    const auto effect = row.library == "stribeck" ? make_effect("stribeck", {{"exponent", 2}, {"tail", 0}})
                                                  : make_effect(row.library);
    carriage = carriage_of(effect, library_target(target));
    carriage.effect = row.effect;
    return carriage;
  }
  if (target == ArmTarget::kUrdf && row.urdf_only_turning && slides) return carriage;
  carriage.as = target == ArmTarget::kMujoco ? row.mujoco : target == ArmTarget::kUrdf ? row.urdf : row.plain;
  if (!carriage.as.empty()) carriage.lost = target == ArmTarget::kUrdf ? row.lost_in_urdf : "";
  return carriage;
}

/// q = angle + zero, in the frame that is turned by the zero.
void turn_frames_by_zeros(ArmDescription& arm) {
  for (std::size_t j = 0; j < arm.drives.size(); ++j) {
    ArmDrive& drive = arm.drives[j];
    control::ArmLink& link = arm.arm.links[j];
    const double zero = drive.encoder_zero_rad;
    if (zero == 0) continue;
    if (link.limits) {
      link.limits->lower -= zero;
      link.limits->upper -= zero;
    }
    if (link.slides)
      link.X_PL.translate(zero * link.axis_L);
    else
      link.X_PL.rotate(Eigen::AngleAxisd(zero, link.axis_L));
    // The torques over the position, as polynomials and waves of the angle.
    const double c2 = drive.cable_2_Nm_per_rad2;
    const double c3 = drive.cable_3_Nm_per_rad3;
    drive.offset_Nm += c2 * zero * zero + c3 * zero * zero * zero;
    const double slope = 2 * c2 * zero + 3 * c3 * zero * zero;
    if (slope != 0) {
      drive.offset_Nm += drive.spring_Nm_per_rad * (zero - drive.spring_rest_rad);
      drive.spring_rest_rad = 0;
      drive.spring_Nm_per_rad += slope;
    } else {
      drive.spring_rest_rad -= zero;
    }
    drive.cable_2_Nm_per_rad2 += 3 * c3 * zero;
    for (ArmDrive::Ripple& ripple : drive.ripples) {
      const double by = ripple.periods_per_rev * zero;
      const double sine = ripple.sine_Nm;
      ripple.sine_Nm = sine * std::cos(by) - ripple.cosine_Nm * std::sin(by);
      ripple.cosine_Nm = sine * std::sin(by) + ripple.cosine_Nm * std::cos(by);
    }
    drive.encoder_zero_rad = 0;
  }
}

/// The nearest inertia of a body that is everywhere of positive density: ∫ x xᵀ dm has no negative
/// eigenvalue.
Eigen::Matrix3d possible(const Eigen::Matrix3d& inertia) {
  const Eigen::Matrix3d spread = 0.5 * inertia.trace() * Eigen::Matrix3d::Identity() - inertia;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(spread);
  const double least = std::max(kLeastMoment_kg_m2, 1e-7 * axes.eigenvalues().cwiseAbs().maxCoeff());
  const Eigen::Vector3d values = axes.eigenvalues().cwiseMax(least);
  const Eigen::Matrix3d better = axes.eigenvectors() * values.asDiagonal() * axes.eigenvectors().transpose();
  return better.trace() * Eigen::Matrix3d::Identity() - better;
}

/// Of one body. How much that changes a moment; 0 if it is rounding [kg·m²].
double make_possible(LinkInertia& body) {
  body.mass_kg = std::max(body.mass_kg, kLeastMass_kg);
  const Eigen::Matrix3d given = body.about_C_kg_m2;
  body.about_C_kg_m2 = possible(given);
  const double change = (body.about_C_kg_m2 - given).cwiseAbs().maxCoeff();
  return change > kRounding * given.cwiseAbs().maxCoeff() + 10 * kLeastMoment_kg_m2 ? change : 0;
}

void make_bodies_possible(HeldArm& held) {
  for (control::ArmLink& link : held.arm.arm.links)
    if (const double change = make_possible(link.inertia); change > 0)
      held.changes.push_back(fmt::format(
          "link {}: one moment of its inertia is negative or larger than the other two together, which "
          "no body has; the nearest that a body can have differs by {:.3g} kg·m²",
          link.link, change));
}

/// About the axes of joints that turn. Expects bodies that are possible.
void add_rotors_to_links(HeldArm& held) {
  for (std::size_t j = 0; j < held.arm.drives.size(); ++j) {
    ArmDrive& drive = held.arm.drives[j];
    control::ArmLink& link = held.arm.arm.links[j];
    link.inertia.about_C_kg_m2 += drive.rotor_inertia_kg_m2 * link.axis_L * link.axis_L.transpose();
    drive.rotor_inertia_kg_m2 = 0;
    if (const double change = make_possible(link.inertia); change > 0)
      held.changes.push_back(
          fmt::format("{} rotor_inertia: no body has so much inertia about one axis alone, so the moments of "
                      "link {} about the other axes are up to {:.3g} kg·m² larger",
                      drive.joint, link.link, change));
  }
}

/// 0 if the load is not known.
double mean_load_friction_Nm(const ArmDrive& drive, const ArmOperation& operation, std::size_t joint) {
  return operation.mean_load_Nm.empty() ? 0
                                        : std::max(0.0, drive.load_friction) * operation.mean_load_Nm[joint];
}

/// Coulomb and viscous friction in place of all that slides.
void straighten(ArmDrive& drive, std::span<const double> speeds_rad_per_s) {
  if (drive.quadratic_drag_Nm_s2_per_rad2 == 0 && drive.stribeck_Nm == 0) return;
  const SlidingFit fit = fit_sliding(sliding_part(drive), speeds_rad_per_s, SlidingTerms::kCoulombViscous);
  drive.coulomb_Nm = fit.coulomb_Nm;
  drive.viscous_Nm_s_per_rad = fit.viscous_Nm_s_per_rad;
  drive.quadratic_drag_Nm_s2_per_rad2 = 0;
  drive.stribeck_Nm = 0;
}

}  // namespace

std::vector<ArmCarriage> arm_carriages(const ArmDescription& arm, ArmTarget target,
                                       const ArmOperation& operation) {
  std::vector<ArmCarriage> all;
  for (std::size_t j = 0; j < arm.drives.size(); ++j)
    for (const DriveRow& row : kDriveRows) {
      if (!row.is_there(arm.drives[j])) continue;
      ArmCarriage one{carriage_of(row, target, arm.arm.links[j].slides), arm};
      const double mean_Nm = mean_load_friction_Nm(arm.drives[j], operation, j);
      if (row.effect == kLoadFriction && mean_Nm > 0) {
        one.carriage.as = fmt::format("Coulomb friction of {:.3g} {}, as at the mean load of the recordings",
                                      mean_Nm, arm.arm.links[j].slides ? "N" : "N·m");
        one.carriage.lost = "that it changes with the load";
      }
      one.carriage.effect = arm.drives[j].joint + " " + one.carriage.effect;
      row.drop(one.without.drives[j]);
      all.push_back(std::move(one));
    }
  return all;
}

bool is_level(const Eigen::Vector3d& gravity_B_m_per_s2) {
  constexpr double kSame_rad = 1e-9;
  return (gravity_B_m_per_s2.normalized() + Eigen::Vector3d::UnitZ()).norm() < kSame_rad;
}

std::vector<Carriage> body_carriages(const ArmDescription& arm, ArmTarget target) {
  std::vector<Carriage> all;
  all.push_back({"bodies", "mass, centre and inertia of each link with what is fixed to it",
                 "shapes, so that nothing touches"});
  if (std::ranges::any_of(arm.arm.links, [](const auto& link) { return link.limits.has_value(); }))
    all.push_back({"ranges of joints", "limits of the URDF, shifted by the encoder zeros",
                   target == ArmTarget::kUrdf ? "" : "the largest torques and speeds"});
  if (arm.payload_kg > 0) all.push_back({"payload", "a body fixed to the tip", ""});
  const double size = arm.gravity_B_m_per_s2.norm();
  if (target != ArmTarget::kUrdf)
    all.push_back({"gravity", "option gravity", ""});
  else
    all.push_back(
        {"gravity_direction",
         is_level(arm.gravity_B_m_per_s2) ? "along -z of the base" : "the base is tilted below a level link",
         std::abs(size - model::kGravity_m_per_s2) < 1e-2
             ? ""
             : fmt::format("its size, {:.4g} m/s²: the simulation's own counts", size)});
  return all;
}

HeldArm held_by(const ArmDescription& arm, ArmTarget target, const ArmOperation& operation) {
  HeldArm held{arm, {}};
  for (std::size_t j = 0; j < arm.drives.size(); ++j) {
    ArmDrive& drive = held.arm.drives[j];
    drive.coulomb_Nm += mean_load_friction_Nm(drive, operation, j);
    if (target != ArmTarget::kMujoco) straighten(drive, operation.speeds_rad_per_s[j]);
  }
  for (std::size_t j = 0; j < arm.drives.size(); ++j)
    for (const DriveRow& row : kDriveRows)
      if (carriage_of(row, target, arm.arm.links[j].slides).as.empty()) row.drop(held.arm.drives[j]);
  turn_frames_by_zeros(held.arm);
  make_bodies_possible(held);
  if (target == ArmTarget::kUrdf) add_rotors_to_links(held);
  return held;
}

std::vector<double> lightest_inertias(const ArmDescription& arm) {
  constexpr int kPoses = 200;
  const auto n = static_cast<Eigen::Index>(arm.drives.size());
  identification::robot_gap::RigidArm body(arm.arm);
  const auto links = identification::robot_gap::inertial_vectors(arm);
  std::vector<double> lightest(arm.drives.size(), std::numeric_limits<double>::infinity());
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> angle(-std::numbers::pi, std::numbers::pi);
  Eigen::VectorXd q(n);
  Eigen::VectorXd column;
  Eigen::MatrixXd mass(n, n);
  for (int pose = 0; pose < kPoses; ++pose) {
    for (double& one : q) one = angle(random);
    for (Eigen::Index j = 0; j < n; ++j) {
      body.move(q, Eigen::VectorXd::Zero(n), Eigen::VectorXd::Unit(n, j), Eigen::Vector3d::Zero());
      body.torques(links, column);
      mass.col(j) = column;
      const ArmDrive& drive = arm.drives[static_cast<std::size_t>(j)];
      if (drive.compliance_rad_per_Nm == 0) mass(j, j) += drive.rotor_inertia_kg_m2;
    }
    const Eigen::VectorXd mobility = mass.ldlt().solve(Eigen::MatrixXd::Identity(n, n)).diagonal();
    for (Eigen::Index j = 0; j < n; ++j) {
      double& least = lightest[static_cast<std::size_t>(j)];
      const double inertia = 1 / mobility[j];
      if (!(inertia > kLeastInertia_kg_m2) || !std::isfinite(inertia))
        throw std::invalid_argument(
            fmt::format("joint {} has no inertia, neither of a link nor of a rotor: a simulation cannot move "
                        "it; give rotor_inertia_kg_m2",
                        arm.drives[static_cast<std::size_t>(j)].joint));
      least = std::min(least, inertia);
    }
  }
  return lightest;
}

}  // namespace analysis
