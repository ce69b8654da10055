#include "identification/robot_gap/link_motion.h"

#include <cstddef>

#include "identification/gap/zero_phase.h"

namespace identification::robot_gap {
namespace {

using control::ArmDescription;
using control::ArmDrive;

Eigen::MatrixXd rigid_torque_Nm(const ArmDescription& arm, const LinkMotion& link) {
  RigidArm body(arm.arm);
  const std::vector<InertialVector> links = inertial_vectors(arm);
  Eigen::MatrixXd result(link.q_rad.rows(), link.q_rad.cols());
  Eigen::VectorXd torque;
  for (Eigen::Index i = 0; i < result.cols(); ++i) {
    body.move(link.q_rad.col(i), link.v_rad_per_s.col(i), link.a_rad_per_s2.col(i), arm.gravity_B_m_per_s2);
    body.torques(links, torque);
    result.col(i) = torque;
  }
  return result;
}

Eigen::RowVectorXd rate_of(const Eigen::RowVectorXd& signal, double period_s) {
  const std::vector<double> rate =
      gap::derivative({signal.data(), static_cast<std::size_t>(signal.size())}, period_s);
  return Eigen::Map<const Eigen::RowVectorXd>(rate.data(), signal.size());
}

LinkMotion of_stiff_gears(const ArmDescription& arm, const ArmMotion& motion) {
  LinkMotion link{motion.position_rad, motion.velocity_rad_per_s, motion.acceleration_rad_per_s2, {}};
  for (std::size_t j = 0; j < arm.drives.size(); ++j)
    link.q_rad.row(static_cast<Eigen::Index>(j)).array() += arm.drives[j].encoder_zero_rad;
  return link;
}

/// What the gear carries, as measured: then an error of the links' model does not deflect it.
Eigen::RowVectorXd spring_torque_Nm(const ArmDrive& drive, const ArmMotion& motion, const LinkMotion& link,
                                    Eigen::Index joint) {
  if (drive.friction_before_gear) return link.rigid_Nm.row(joint);
  return drive.torque_scale * motion.torque_Nm.row(joint) -
         drive.rotor_inertia_kg_m2 * motion.acceleration_rad_per_s2.row(joint);
}

}  // namespace

std::vector<InertialVector> inertial_vectors(const ArmDescription& arm) {
  std::vector<InertialVector> links;
  for (const control::ArmLink& link : arm.arm.links) links.push_back(inertial_vector(link.inertia));
  links.back() += arm.payload_kg * unit_mass_at(arm.arm.X_LT * arm.p_TP_m);
  return links;
}

LinkMotion link_motion(const ArmDescription& arm, const ArmMotion& motion) {
  LinkMotion link = of_stiff_gears(arm, motion);
  link.rigid_Nm = rigid_torque_Nm(arm, link);
  bool is_stiff = true;
  for (std::size_t k = 0; k < arm.drives.size(); ++k) {
    const ArmDrive& drive = arm.drives[k];
    if (drive.compliance_rad_per_Nm == 0) continue;
    is_stiff = false;
    const auto j = static_cast<Eigen::Index>(k);
    const Eigen::RowVectorXd deflection_rad =
        drive.compliance_rad_per_Nm * spring_torque_Nm(drive, motion, link, j);
    link.q_rad.row(j) -= deflection_rad;
    if (motion.is_scattered) continue;
    const Eigen::RowVectorXd rate = rate_of(deflection_rad, motion.period_s);
    link.v_rad_per_s.row(j) -= rate;
    link.a_rad_per_s2.row(j) -= rate_of(rate, motion.period_s);
  }
  if (!is_stiff) link.rigid_Nm = rigid_torque_Nm(arm, link);
  return link;
}

}  // namespace identification::robot_gap
