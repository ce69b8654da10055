// The robot's dynamics compared with another engine, DART, on states all over the workspace. DART treats
// every link of the description as a separate body and uses another method (recursions over bodies in their
// own frames).
#include <gtest/gtest.h>
#include <urdf_parser/urdf_parser.h>

#include <Eigen/Eigenvalues>
#include <dart/dynamics/BodyNode.hpp>
#include <dart/dynamics/PrismaticJoint.hpp>
#include <dart/dynamics/RevoluteJoint.hpp>
#include <dart/dynamics/Skeleton.hpp>
#include <dart/dynamics/WeldJoint.hpp>
#include <random>

#include "control/robot_model.h"

namespace robot_model_dart_test {

using control::ChainVector;
using control::kArmJoints;
using control::kBaseAxes;
using control::Link;
using control::ModelChanges;
using control::RobotModel;

constexpr double kTolerance = 1e-9;  // relative, and absolute in SI units

Eigen::Isometry3d isometry(const urdf::Pose& pose) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear() = Eigen::Quaterniond(pose.rotation.w, pose.rotation.x, pose.rotation.y, pose.rotation.z)
                   .toRotationMatrix();
  X.translation() << pose.position.x, pose.position.y, pose.position.z;
  return X;
}

dart::dynamics::Inertia inertia(const urdf::Link& link) {
  if (!link.inertial) return {1e-15, Eigen::Vector3d::Zero(), 1e-15 * Eigen::Matrix3d::Identity()};
  const urdf::Inertial& i = *link.inertial;
  const Eigen::Isometry3d X = isometry(i.origin);
  Eigen::Matrix3d tensor;
  tensor << i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz;
  return {i.mass, X.translation(), X.linear() * tensor * X.linear().transpose()};
}

template <class Joint>
dart::dynamics::BodyNode* add(dart::dynamics::SkeletonPtr& skeleton, dart::dynamics::BodyNode* parent,
                              const typename Joint::Properties& joint, const urdf::Link& link) {
  return skeleton
      ->createJointAndBodyNodePair<Joint>(
          parent, joint, dart::dynamics::BodyNode::AspectProperties(link.name, inertia(link)))
      .second;
}

void add_links(dart::dynamics::SkeletonPtr& skeleton, dart::dynamics::BodyNode* parent,
               const urdf::Link& link) {
  const auto placed = [&](auto properties) {
    properties.mName = link.parent_joint->name;
    properties.mT_ParentBodyToJoint = isometry(link.parent_joint->parent_to_joint_origin_transform);
    return properties;
  };
  const auto with_axis = [&](auto properties) {
    const urdf::Vector3& axis = link.parent_joint->axis;
    properties.mAxis << axis.x, axis.y, axis.z;
    return placed(properties);
  };
  using dart::dynamics::PrismaticJoint, dart::dynamics::RevoluteJoint, dart::dynamics::WeldJoint;
  dart::dynamics::BodyNode* body = nullptr;
  if (!link.parent_joint)
    body = add<WeldJoint>(skeleton, parent, {}, link);
  else if (link.parent_joint->type == urdf::Joint::FIXED)
    body = add<WeldJoint>(skeleton, parent, placed(WeldJoint::Properties()), link);
  else if (link.parent_joint->type == urdf::Joint::PRISMATIC)
    body = add<PrismaticJoint>(skeleton, parent, with_axis(PrismaticJoint::Properties()), link);
  else
    body = add<RevoluteJoint>(skeleton, parent, with_axis(RevoluteJoint::Properties()), link);
  for (const auto& child : link.child_links) add_links(skeleton, body, *child);
}

class RobotModelAndDart : public testing::Test {
 protected:
  RobotModelAndDart() { load(std::string(control::youbot_urdf())); }

  /// The same description into both engines.
  void load(const std::string& text) {
    model_ = RobotModel({}, text);
    skeleton_ = dart::dynamics::Skeleton::create();
    add_links(skeleton_, nullptr, *urdf::parseURDF(text)->getRoot());
    skeleton_->setGravity({0, 0, -9.81});
  }

  /// Both engines at the next state.
  void next() {
    for (int i = 0; i < kBaseAxes; ++i) q_[i] = between(-3, 3);
    for (std::size_t j = 0; j < kArmJoints; ++j)
      q_[kBaseAxes + static_cast<int>(j)] =
          between(model_.ranges()[j].lower_rad, model_.ranges()[j].upper_rad);
    for (double& v : v_) v = between(-2, 2);
    model_.update(q_);
    skeleton_->setPositions(q_);
    skeleton_->setVelocities(v_);
  }
  void expect_near(const Eigen::MatrixXd& ours, const Eigen::MatrixXd& darts) const {
    EXPECT_LT((ours - darts).norm(), kTolerance * (1 + darts.norm())) << "ours:\n"
                                                                      << ours << "\nDART's:\n"
                                                                      << darts << "\nat " << q_.transpose();
  }

  static constexpr int kStates = 200;
  RobotModel model_;
  dart::dynamics::SkeletonPtr skeleton_;
  ChainVector q_ = ChainVector::Zero(), v_ = ChainVector::Zero();

 private:
  double between(double lower, double upper) {
    return std::uniform_real_distribution<double>(lower, upper)(random_);
  }
  std::mt19937 random_{11};
};

TEST_F(RobotModelAndDart, AgreeOnWhereTheLinksAreAndHowTheyMove) {
  const std::array<std::pair<Link, const char*>, control::kLinks> links = {{{Link::kBase, "base_footprint"},
                                                                            {Link::kArm1, "arm_link_1"},
                                                                            {Link::kArm2, "arm_link_2"},
                                                                            {Link::kArm3, "arm_link_3"},
                                                                            {Link::kArm4, "arm_link_4"},
                                                                            {Link::kArm5, "arm_link_5"}}};
  for (int i = 0; i < kStates; ++i) {
    next();
    for (const auto& [link, name] : links) {
      const dart::dynamics::BodyNode* body = skeleton_->getBodyNode(name);
      expect_near(model_.X_WL(link).matrix(), body->getWorldTransform().matrix());
      const Eigen::Vector3d p_L(0.1, -0.2, 0.3);
      expect_near(model_.point_jacobian(link, model_.X_WL(link) * p_L),
                  skeleton_->getLinearJacobian(body, p_L));
    }
    const dart::dynamics::BodyNode* tip = skeleton_->getBodyNode("tip");
    expect_near(model_.X_WT().matrix(), tip->getWorldTransform().matrix());
    const Eigen::MatrixXd J = skeleton_->getWorldJacobian(tip);
    expect_near(model_.J_WT().topRows<3>(), J.bottomRows(3));
    expect_near(model_.J_WT().bottomRows<3>(), J.topRows(3));
  }
}

TEST_F(RobotModelAndDart, AgreeOnMassGravityAndCoriolisForces) {
  EXPECT_NEAR(model_.total_mass_kg(), skeleton_->getMass(), 1e-12);
  for (int i = 0; i < kStates; ++i) {
    next();
    expect_near(model_.mass(), skeleton_->getMassMatrix());
    expect_near(model_.gravity_Nm(), skeleton_->getGravityForces());
    expect_near(model_.coriolis_Nm(v_), skeleton_->getCoriolisForces());
  }
}

TEST_F(RobotModelAndDart, AgreeOnARobotThatIsNotAsDescribed) {
  const double factor = 1.3;
  const Eigen::Vector3d shift_m(0.01, -0.02, 0.03);
  ModelChanges changes;
  changes.links[static_cast<std::size_t>(Link::kArm2)] = {factor, shift_m};
  changes.payload_kg = 0.5;
  model_ = RobotModel(changes);

  dart::dynamics::BodyNode* link = skeleton_->getBodyNode("arm_link_2");
  link->setInertia(
      {factor * link->getMass(), link->getLocalCOM() + shift_m, factor * link->getInertia().getMoment()});
  skeleton_->getBodyNode("tip")->setInertia(
      {0.5, Eigen::Vector3d::Zero(), 1e-15 * Eigen::Matrix3d::Identity()});
  for (int i = 0; i < kStates; ++i) {
    next();
    expect_near(model_.mass(), skeleton_->getMassMatrix());
    expect_near(model_.gravity_Nm(), skeleton_->getGravityForces());
    expect_near(model_.coriolis_Nm(v_), skeleton_->getCoriolisForces());
  }
}

TEST_F(RobotModelAndDart, AgreeOnARobotWithNoAxisInLineWithAnyOther) {
  std::string text(control::youbot_urdf());
  for (const auto& [from, to] :
       {std::pair{"xyz=\"0.143 0 0.046\"", "xyz=\"0.143 0.1 0.046\" rpy=\"0.1 0.2 0.3\""},
        {"rpy=\"0 2.548180707911721 0\"", "rpy=\"0.4 2.5 -0.3\""},
        {"xyz=\"0 0 0.0875\"", "xyz=\"0 0.1 0.0875\" rpy=\"-0.5 0.6 0.7\""},
        {"ixz=\"0\" iyz=\"-0.000231\"", "ixz=\"0.0001\" iyz=\"-0.000231\""}}) {
    ASSERT_NE(text.find(from), std::string::npos) << from;
    text.replace(text.find(from), std::string(from).size(), to);
  }
  load(text);
  for (int i = 0; i < kStates; ++i) {
    next();
    const dart::dynamics::BodyNode* tip = skeleton_->getBodyNode("tip");
    expect_near(model_.X_WT().matrix(), tip->getWorldTransform().matrix());
    expect_near(model_.J_WT().topRows<3>(), skeleton_->getLinearJacobian(tip));
    expect_near(model_.mass(), skeleton_->getMassMatrix());
    expect_near(model_.gravity_Nm(), skeleton_->getGravityForces());
    expect_near(model_.coriolis_Nm(v_), skeleton_->getCoriolisForces());
  }
}

TEST_F(RobotModelAndDart, EveryTensorIsOneThatABodyCanHave) {
  for (const dart::dynamics::BodyNode* body : std::as_const(*skeleton_).getBodyNodes()) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(body->getInertia().getMoment());
    const Eigen::Vector3d moments = principal.eigenvalues();  // the largest last
    EXPECT_GT(moments[0], 0) << body->getName();
    EXPECT_LE(moments[2], moments[0] + moments[1]) << body->getName();
  }
}

TEST_F(RobotModelAndDart, GravityIsTheSlopeOfTheEnergyThatDartsCentreOfMassHas) {
  const double kStep = 1e-5;
  for (int i = 0; i < 20; ++i) {
    next();
    for (int j = 0; j < q_.size(); ++j) {
      const auto potential_J = [&](double step) {
        skeleton_->setPositions(q_ + step * ChainVector::Unit(j));
        return skeleton_->getMass() * 9.81 * skeleton_->getCOM().z();
      };
      EXPECT_NEAR(model_.gravity_Nm()[j], (potential_J(kStep) - potential_J(-kStep)) / (2 * kStep), 1e-7);
    }
  }
}

}  // namespace robot_model_dart_test
