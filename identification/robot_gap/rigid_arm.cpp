#include "identification/robot_gap/rigid_arm.h"

#include <Eigen/Geometry>
#include <cstddef>

namespace identification::robot_gap {
namespace {

/// [x]× y = x × y
Eigen::Matrix3d cross(const Eigen::Vector3d& x) {
  Eigen::Matrix3d result;
  result << 0, -x.z(), x.y(), x.z(), 0, -x.x(), -x.y(), x.x(), 0;
  return result;
}

/// L(w)·(xx, xy, xz, yy, yz, zz) = I·w
Eigen::Matrix<double, 3, 6> inertia_times(const Eigen::Vector3d& w) {
  Eigen::Matrix<double, 3, 6> result;
  result << w.x(), w.y(), w.z(), 0, 0, 0,  //
      0, w.x(), 0, w.y(), w.z(), 0,        //
      0, 0, w.x(), 0, w.y(), w.z();
  return result;
}

Eigen::Matrix<double, 6, 1> six_of(const Eigen::Matrix3d& tensor) {
  Eigen::Matrix<double, 6, 1> six;
  six << tensor(0, 0), tensor(0, 1), tensor(0, 2), tensor(1, 1), tensor(1, 2), tensor(2, 2);
  return six;
}

/// Derivative of c²·1 − c cᵀ, the inertia of a unit mass at c, with c along d.
Eigen::Matrix3d moved_point(const Eigen::Vector3d& c, const Eigen::Vector3d& d) {
  return 2 * c.dot(d) * Eigen::Matrix3d::Identity() - c * d.transpose() - d * c.transpose();
}

}  // namespace

InertialVector unit_mass_at(const Eigen::Vector3d& p_L_m) {
  InertialVector result;
  result << 1, p_L_m, six_of(moved_point(p_L_m, p_L_m) / 2);
  return result;
}

InertialVector inertial_vector(const control::LinkInertia& body) {
  InertialVector result = body.mass_kg * unit_mass_at(body.p_LC_m);
  result.tail<6>() += six_of(body.about_C_kg_m2);
  return result;
}

InertialChanges by_centre(const control::LinkInertia& body) {
  InertialChanges result = InertialChanges::Zero(10, 3);
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d along = Eigen::Vector3d::Unit(k);
    result.col(k).segment<3>(1) = body.mass_kg * along;
    result.col(k).tail<6>() = body.mass_kg * six_of(moved_point(body.p_LC_m, along));
  }
  return result;
}

InertialChanges by_inertia() {
  InertialChanges result = InertialChanges::Zero(10, 6);
  result.bottomRows<6>().setIdentity();
  return result;
}

RigidArm::RigidArm(const control::SerialArm& arm) : links_(arm.links), motion_(arm.links.size()) {}

void RigidArm::move(const Eigen::VectorXd& q, const Eigen::VectorXd& v, const Eigen::VectorXd& a,
                    const Eigen::Vector3d& gravity_B_m_per_s2) {
  Eigen::Vector3d w = Eigen::Vector3d::Zero();
  Eigen::Vector3d alpha = Eigen::Vector3d::Zero();
  Eigen::Vector3d linear = -gravity_B_m_per_s2;  // gravity acts like an upward acceleration
  for (std::size_t i = 0; i < links_.size(); ++i) {
    const control::ArmLink& link = links_[i];
    const auto at = static_cast<Eigen::Index>(i);
    Motion& m = motion_[i];
    m.R_PL = link.X_PL.linear();
    m.p_PL_m = link.X_PL.translation();
    if (link.slides)
      m.p_PL_m += m.R_PL * link.axis_L * q[at];
    else
      m.R_PL = m.R_PL * Eigen::AngleAxisd(q[at], link.axis_L).toRotationMatrix();
    const Eigen::Vector3d origin = linear + alpha.cross(m.p_PL_m) + w.cross(w.cross(m.p_PL_m));
    m.w_rad_per_s = m.R_PL.transpose() * w;
    m.alpha_rad_per_s2 = m.R_PL.transpose() * alpha;
    m.a_m_per_s2 = m.R_PL.transpose() * origin;
    if (link.slides) {
      m.a_m_per_s2 += a[at] * link.axis_L + 2 * v[at] * m.w_rad_per_s.cross(link.axis_L);
    } else {
      m.alpha_rad_per_s2 += a[at] * link.axis_L + v[at] * m.w_rad_per_s.cross(link.axis_L);
      m.w_rad_per_s += v[at] * link.axis_L;
    }
    w = m.w_rad_per_s;
    alpha = m.alpha_rad_per_s2;
    linear = m.a_m_per_s2;
  }
}

void RigidArm::torques(Eigen::Index link, const InertialChanges& changes, Eigen::MatrixXd& result_Nm) const {
  const Motion& own = motion_[static_cast<std::size_t>(link)];
  const Eigen::Matrix3d w_cross = cross(own.w_rad_per_s);
  // Force and moment on the link, of its parameters.
  Eigen::Matrix<double, 6, 10> wrench = Eigen::Matrix<double, 6, 10>::Zero();
  wrench.block<3, 1>(0, 0) = own.a_m_per_s2;
  wrench.block<3, 3>(0, 1) = cross(own.alpha_rad_per_s2) + w_cross * w_cross;
  wrench.block<3, 3>(3, 1) = -cross(own.a_m_per_s2);
  wrench.block<3, 6>(3, 4) = inertia_times(own.alpha_rad_per_s2) + w_cross * inertia_times(own.w_rad_per_s);
  Eigen::Matrix<double, 6, Eigen::Dynamic> carried = wrench * changes;
  result_Nm.setZero(joints(), changes.cols());
  for (auto i = static_cast<std::size_t>(link) + 1; i-- > 0;) {
    const auto at = static_cast<Eigen::Index>(i);
    result_Nm.row(at) =
        links_[i].axis_L.transpose() * (links_[i].slides ? carried.topRows<3>() : carried.bottomRows<3>());
    const Motion& m = motion_[i];
    const Eigen::Matrix<double, 3, Eigen::Dynamic> force = m.R_PL * carried.topRows<3>();
    carried.bottomRows<3>() = m.R_PL * carried.bottomRows<3>().eval() + cross(m.p_PL_m) * force;
    carried.topRows<3>() = force;
  }
}

void RigidArm::torques(const std::vector<InertialVector>& links, Eigen::VectorXd& result_Nm) const {
  result_Nm.setZero(joints());
  Eigen::Vector3d force_N = Eigen::Vector3d::Zero();
  Eigen::Vector3d moment_Nm = Eigen::Vector3d::Zero();
  for (std::size_t i = links_.size(); i-- > 0;) {
    const Motion& m = motion_[i];
    const InertialVector& body = links[i];
    const Eigen::Vector3d first = body.segment<3>(1);
    force_N += body[0] * m.a_m_per_s2 + m.alpha_rad_per_s2.cross(first) +
               m.w_rad_per_s.cross(m.w_rad_per_s.cross(first));
    moment_Nm += inertia_times(m.alpha_rad_per_s2) * body.tail<6>() +
                 m.w_rad_per_s.cross(inertia_times(m.w_rad_per_s) * body.tail<6>()) +
                 first.cross(m.a_m_per_s2);
    result_Nm[static_cast<Eigen::Index>(i)] = joint_torque(i, force_N, moment_Nm);
    const Eigen::Vector3d force_P_N = m.R_PL * force_N;
    moment_Nm = m.R_PL * moment_Nm + m.p_PL_m.cross(force_P_N);
    force_N = force_P_N;
  }
}

}  // namespace identification::robot_gap
