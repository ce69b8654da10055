// Exports of an arm: what another engine can hold of it, and the URDF. tests/mujoco has MuJoCo itself judge
// the files.
#include <gtest/gtest.h>
#include <urdf_parser/urdf_parser.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "analysis/export_arm.h"
#include "analysis/export_arm_parts.h"
#include "identification/robot_gap/link_motion.h"

namespace export_arm_test {

using analysis::ArmTarget;
using analysis::HeldArm;
using control::ArmDescription;
using control::ArmDrive;

constexpr const char* kUrdf = R"(<robot name="three">
  <link name="base"/>
  <joint name="lift" type="prismatic"><parent link="base"/><child link="column"/>
    <origin xyz="0 0 0.4" rpy="0.1 0 0.3"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="1" effort="1" velocity="1"/></joint>
  <link name="column"><inertial><origin xyz="0.01 0 0.1"/><mass value="3"/>
    <inertia ixx="0.04" iyy="0.05" izz="0.02" ixy="0.001" ixz="0" iyz="0"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="column"/><child link="upper"/>
    <origin xyz="0.1 0 0.2" rpy="1.2 0.2 0"/><axis xyz="0 0.6 0.8"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
  <link name="upper"><inertial><origin xyz="0 0.02 0.2"/><mass value="2"/>
    <inertia ixx="0.03" iyy="0.03" izz="0.004" ixy="0" ixz="0" iyz="0.002"/></inertial></link>
  <joint name="elbow" type="continuous"><parent link="upper"/><child link="lower"/>
    <origin xyz="0 0 0.4" rpy="0 0 0.5"/><axis xyz="0 1 0"/></joint>
  <link name="lower"><inertial><origin xyz="0 0 0.15"/><mass value="1"/>
    <inertia ixx="0.01" iyy="0.01" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="hand" type="fixed"><parent link="lower"/><child link="tip"/>
    <origin xyz="0 0.02 0.3" rpy="0.3 0 0"/></joint>
  <link name="tip"/>
</robot>)";

ArmDescription arm() {
  ArmDescription arm{.arm = control::read_serial_arm(kUrdf, "base", "tip"), .drives = {}};
  for (const control::ArmLink& link : arm.arm.links) {
    arm.drives.emplace_back();
    arm.drives.back().joint = link.joint;
  }
  return arm;
}

const analysis::ArmNames kNames{"three", "base", "tip"};

analysis::ArmOperation operation(const ArmDescription& arm) {
  std::vector<double> speeds;
  for (int i = 0; i <= 100; ++i) speeds.push_back(0.03 * i);
  return {std::vector(arm.drives.size(), speeds), {}};
}

/// Torque of links and payload with the axis' angles as the encoders show them.
Eigen::VectorXd rigid_Nm(const ArmDescription& arm, const Eigen::Vector3d& q, const Eigen::Vector3d& v,
                         const Eigen::Vector3d& a) {
  identification::robot_gap::RigidArm body(arm.arm);
  Eigen::VectorXd shown = q;
  for (Eigen::Index j = 0; j < 3; ++j) shown[j] += arm.drives[static_cast<std::size_t>(j)].encoder_zero_rad;
  body.move(shown, v, a, arm.gravity_B_m_per_s2);
  Eigen::VectorXd torque;
  body.torques(identification::robot_gap::inertial_vectors(arm), torque);
  return torque;
}

TEST(ExportArm, TheUrdfHasTheSameDynamicsWithZerosPayloadAndATiltedBase) {
  ArmDescription corrected = arm();
  corrected.gravity_B_m_per_s2 = 9.81 * Eigen::Vector3d(0.2, -0.1, -1).normalized();
  corrected.payload_kg = 0.7;
  corrected.p_TP_m = {0.03, -0.02, 0.05};
  corrected.arm.links[1].inertia.mass_kg = 2.6;
  const double zeros[] = {0.02, 0.1, -0.3};
  for (std::size_t j = 0; j < 3; ++j) corrected.drives[j].encoder_zero_rad = zeros[j];
  corrected.drives[1].coulomb_Nm = 0.4;
  corrected.drives[1].viscous_Nm_s_per_rad = 0.2;
  const HeldArm held = analysis::held_by(corrected, ArmTarget::kUrdf, operation(corrected));
  EXPECT_TRUE(held.changes.empty()) << held.changes.front();
  const std::string text = analysis::arm_urdf_text(held.arm, kNames, {});
  ArmDescription read = arm();
  read.arm = control::read_serial_arm(text, "level", "tip");  // gravity is along -z of it
  for (const double scale : {0.0, 0.7, -1.3}) {
    const Eigen::Vector3d q = scale * Eigen::Vector3d(0.3, 0.9, -1.1);
    const Eigen::Vector3d v = scale * Eigen::Vector3d(0.5, -1.2, 0.8);
    const Eigen::Vector3d a = scale * Eigen::Vector3d(-2, 3, 4);
    EXPECT_TRUE(rigid_Nm(corrected, q, v, a).isApprox(rigid_Nm(read, q, v, a), 1e-6))
        << rigid_Nm(corrected, q, v, a).transpose() << " against " << rigid_Nm(read, q, v, a).transpose();
  }
  const auto robot = urdf::parseURDF(text);
  ASSERT_NE(robot, nullptr);
  EXPECT_DOUBLE_EQ(robot->getJoint("shoulder")->dynamics->friction, 0.4);
  EXPECT_DOUBLE_EQ(robot->getJoint("shoulder")->dynamics->damping, 0.2);
  EXPECT_EQ(robot->getJoint("lift")->type, urdf::Joint::PRISMATIC);
  EXPECT_NEAR(robot->getJoint("shoulder")->limits->lower, -2 - 0.1, 1e-9);
  EXPECT_NEAR(robot->getJoint("shoulder")->limits->upper, 2 - 0.1, 1e-9);
  EXPECT_EQ(robot->getJoint("elbow")->type, urdf::Joint::CONTINUOUS);
  EXPECT_DOUBLE_EQ(robot->getLink("payload")->inertial->mass, 0.7);
}

TEST(ExportArm, EveryEffectOfADriveIsInTheAccountOnceAndWithoutItItIsGone) {
  using Change = std::function<void(ArmDrive&)>;
  const std::vector<std::pair<std::string, Change>> changes{
      {"encoder_zero", [](ArmDrive& d) { d.encoder_zero_rad = 0.1; }},
      {"torque_constant", [](ArmDrive& d) { d.torque_scale = 1.1; }},
      {"rotor_inertia", [](ArmDrive& d) { d.rotor_inertia_kg_m2 = 0.1; }},
      {"elasticity", [](ArmDrive& d) { d.compliance_rad_per_Nm = 1e-3; }},
      {"coulomb", [](ArmDrive& d) { d.coulomb_Nm = 0.1; }},
      {"viscous", [](ArmDrive& d) { d.viscous_Nm_s_per_rad = 0.1; }},
      {"quadratic_drag", [](ArmDrive& d) { d.quadratic_drag_Nm_s2_per_rad2 = 0.1; }},
      {"stribeck", [](ArmDrive& d) { d.stribeck_Nm = 0.1; }},
      {"torque_offset", [](ArmDrive& d) { d.offset_Nm = 0.1; }},
      {"load_friction", [](ArmDrive& d) { d.load_friction = 0.1; }},
      {"spring", [](ArmDrive& d) { d.spring_Nm_per_rad = 0.1; }},
      {"cable_torque", [](ArmDrive& d) { d.cable_3_Nm_per_rad3 = 0.1; }},
      {"cogging",
       [](ArmDrive& d) {
         d.ripples.push_back({7, 0.1, 0});
       }},
      {"friction_coupling", [](ArmDrive& d) { d.friction_of_previous_Nm = 0.1; }},
  };
  const std::vector<std::string> lost{"load_friction", "friction_coupling"};
  for (const auto& [effect, change] : changes) {
    ArmDescription changed = arm();
    change(changed.drives[1]);
    for (const ArmTarget target : {ArmTarget::kMujoco, ArmTarget::kPlainMujoco, ArmTarget::kUrdf}) {
      const auto carriages = analysis::arm_carriages(changed, target, operation(changed));
      ASSERT_EQ(carriages.size(), 1U) << effect;
      EXPECT_EQ(carriages[0].carriage.effect, "shoulder " + effect);
      EXPECT_FALSE(carriages[0].carriage.as.empty() && carriages[0].carriage.lost.empty()) << effect;
      EXPECT_TRUE(analysis::arm_carriages(carriages[0].without, target, operation(changed)).empty())
          << effect;
    }
    EXPECT_EQ(analysis::arm_carriages(changed, ArmTarget::kMujoco, operation(changed))[0].carriage.as.empty(),
              std::ranges::find(lost, effect) != lost.end())
        << effect;
  }
}

double position_torque_Nm(const ArmDrive& d, double shown_rad) {
  const double q = shown_rad + d.encoder_zero_rad;
  double torque = d.offset_Nm + d.spring_Nm_per_rad * (q - d.spring_rest_rad) +
                  d.cable_2_Nm_per_rad2 * q * q + d.cable_3_Nm_per_rad3 * q * q * q;
  for (const ArmDrive::Ripple& r : d.ripples)
    torque += r.sine_Nm * std::sin(r.periods_per_rev * q) + r.cosine_Nm * std::cos(r.periods_per_rev * q);
  return torque;
}

TEST(ExportArm, TorquesOverThePositionAreTheSameInTurnedFrames) {
  ArmDescription given = arm();
  ArmDrive& drive = given.drives[2];
  drive.encoder_zero_rad = 0.4;
  drive.offset_Nm = 0.2;
  drive.spring_Nm_per_rad = 3;
  drive.spring_rest_rad = -0.5;
  drive.ripples = {{7, 0.8, 0.5}};
  for (const double cable : {0.0, 1.3}) {
    drive.cable_2_Nm_per_rad2 = cable;
    drive.cable_3_Nm_per_rad3 = -0.5 * cable;
    const HeldArm held = analysis::held_by(given, ArmTarget::kMujoco, operation(given));
    EXPECT_EQ(held.arm.drives[2].encoder_zero_rad, 0);
    for (const double q : {-1.0, 0.0, 0.7})
      EXPECT_NEAR(position_torque_Nm(held.arm.drives[2], q), position_torque_Nm(drive, q), 1e-12);
  }
}

TEST(ExportArm, AnInertiaThatNoBodyHasKeepsItsLargestMomentAndIsNamed) {
  ArmDescription given = arm();
  // A fit to motion in a plane finds the moment about y alone.
  given.arm.links[2].inertia.about_C_kg_m2 = Eigen::Vector3d(0.01, 0.02, 0.002).asDiagonal();
  const HeldArm held = analysis::held_by(given, ArmTarget::kMujoco, operation(given));
  const Eigen::Matrix3d& inertia = held.arm.arm.links[2].inertia.about_C_kg_m2;
  EXPECT_NEAR(inertia(1, 1), 0.02, 1e-6);
  const Eigen::Vector3d moments = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(inertia).eigenvalues();
  EXPECT_GE(moments[0] + moments[1], moments[2] - 1e-12);
  ASSERT_EQ(held.changes.size(), 1U);
  EXPECT_NE(held.changes[0].find("link lower"), std::string::npos) << held.changes[0];
}

TEST(ExportArm, ARotorInUrdfMakesTheOtherMomentsOfItsLinkLargerAndIsNamed) {
  ArmDescription given = arm();
  given.drives[2].rotor_inertia_kg_m2 = 0.1;
  const HeldArm held = analysis::held_by(given, ArmTarget::kUrdf, operation(given));
  const Eigen::Matrix3d& inertia = held.arm.arm.links[2].inertia.about_C_kg_m2;
  // About y, beside 0.01, 0.01 and 0.002: the others have to be 0.11 together and differ as before.
  EXPECT_NEAR(inertia(1, 1), 0.11, 1e-6);
  EXPECT_NEAR(inertia(0, 0), 0.059, 1e-6);
  EXPECT_NEAR(inertia(2, 2), 0.051, 1e-6);
  ASSERT_EQ(held.changes.size(), 1U);
  EXPECT_NE(held.changes[0].find("elbow rotor_inertia: no body"), std::string::npos) << held.changes[0];
  EXPECT_NE(held.changes[0].find("up to 0.049 kg·m² larger"), std::string::npos) << held.changes[0];

  given.arm.links[2].inertia.about_C_kg_m2 = Eigen::Vector3d(0.01, 0.02, 0.002).asDiagonal();
  const HeldArm both = analysis::held_by(given, ArmTarget::kUrdf, operation(given));
  ASSERT_EQ(both.changes.size(), 2U);
  EXPECT_NE(both.changes[0].find("link lower: one moment"), std::string::npos) << both.changes[0];
  EXPECT_NE(both.changes[1].find("elbow rotor_inertia"), std::string::npos) << both.changes[1];
}

TEST(ExportArm, LoadFrictionIsCoulombFrictionAtTheMeanLoad) {
  ArmDescription given = arm();
  given.drives[1].coulomb_Nm = 0.1;
  given.drives[1].load_friction = 0.05;
  analysis::ArmOperation known = operation(given);
  known.mean_load_Nm = {1, 6, 2};
  const HeldArm held = analysis::held_by(given, ArmTarget::kMujoco, known);
  EXPECT_DOUBLE_EQ(held.arm.drives[1].coulomb_Nm, 0.1 + 0.05 * 6);
  EXPECT_EQ(held.arm.drives[1].load_friction, 0);
  EXPECT_TRUE(held.changes.empty());
  const auto carriages = analysis::arm_carriages(given, ArmTarget::kMujoco, known);
  ASSERT_EQ(carriages.size(), 2U);
  EXPECT_EQ(carriages[1].carriage.as, "Coulomb friction of 0.3 N·m, as at the mean load of the recordings");
  given.drives[0].load_friction = 0.1;
  EXPECT_NE(analysis::arm_carriages(given, ArmTarget::kMujoco, known)[0].carriage.as.find("of 0.1 N,"),
            std::string::npos);
}

TEST(ExportArm, TheRotorOfASlidingJointHasNoPlaceInUrdf) {
  ArmDescription given = arm();
  given.drives[0].rotor_inertia_kg_m2 = 5;  // kg: of a slide
  const auto carriages = analysis::arm_carriages(given, ArmTarget::kUrdf, operation(given));
  ASSERT_EQ(carriages.size(), 1U);
  EXPECT_EQ(carriages[0].carriage.effect, "lift rotor_inertia");
  EXPECT_EQ(carriages[0].carriage.as, "");
  EXPECT_EQ(carriages[0].without.drives[0].rotor_inertia_kg_m2, 0);
  EXPECT_FALSE(analysis::arm_carriages(given, ArmTarget::kMujoco, operation(given))[0].carriage.as.empty());
  const HeldArm held = analysis::held_by(given, ArmTarget::kUrdf, operation(given));
  EXPECT_EQ(held.arm.drives[0].rotor_inertia_kg_m2, 0);
  EXPECT_TRUE(held.arm.arm.links[0].inertia.about_C_kg_m2.isApprox(given.arm.links[0].inertia.about_C_kg_m2));
}

TEST(ExportArm, AJointThatNothingMovesIsRefusedByItsName) {
  ArmDescription given = arm();
  given.arm.links[2].inertia = {};
  try {
    const HeldArm held = analysis::held_by(given, ArmTarget::kMujoco, operation(given));
    analysis::arm_mujoco_text(held.arm, kNames, 5e-4, {});
    FAIL() << "accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("joint elbow"), std::string::npos) << error.what();
  }
  given.drives[2].rotor_inertia_kg_m2 = 0.01;
  const HeldArm held = analysis::held_by(given, ArmTarget::kMujoco, operation(given));
  const std::string text = analysis::arm_mujoco_text(held.arm, kNames, 5e-4, {});
  EXPECT_NE(text.find(R"(name="shoulder" armature="0" limited="true" range="-2 2")"), std::string::npos)
      << text;
}

TEST(ExportArm, TheLightestInertiaOfAPendulumIsItsOwn) {
  ArmDescription given = arm();
  given.arm.links.resize(1);
  given.drives.resize(1);
  // A slide: 3 kg of its own.
  EXPECT_NEAR(analysis::lightest_inertias(given)[0], 3, 1e-9);
}

TEST(ExportArm, AnElasticGearIsStableInTheTimeStep) {
  ArmDrive drive;
  drive.compliance_rad_per_Nm = 1e-5;
  drive.rotor_inertia_kg_m2 = 0.001;
  const analysis::ElasticShaft stiff = analysis::elastic_shaft(drive, 0.01, 5e-4);
  EXPECT_LT(stiff.stiffness_Nm_per_rad, 1e5);
  const double reduced_kg_m2 = 1 / (1 / 0.001 + 1 / 0.01);
  EXPECT_LE(std::sqrt(stiff.stiffness_Nm_per_rad / reduced_kg_m2) * 5e-4, 0.5 + 1e-9);
  drive.compliance_rad_per_Nm = 1e-2;
  EXPECT_DOUBLE_EQ(analysis::elastic_shaft(drive, 0.01, 5e-4).stiffness_Nm_per_rad, 100);
  drive.rotor_inertia_kg_m2 = 0;
  EXPECT_GT(analysis::elastic_shaft(drive, 0.01, 5e-4).rotor_kg_m2, 0);
}

TEST(ExportArm, NamesThatXmlCannotHoldAreEscapedAndNoneIsTwice) {
  ArmDescription given = arm();
  given.payload_kg = 0.1;
  given.drives[1].compliance_rad_per_Nm = 1e-3;
  given.arm.links[2].link = "payload";
  given.arm.links[2].joint = given.drives[2].joint = "shoulder_link";
  const std::string text = analysis::arm_mujoco_text(given, {"<a&\x01>", "base", "tip"}, 5e-4, {});
  EXPECT_NE(text.find(R"(model="&lt;a&amp;\x01&gt;")"), std::string::npos) << text;
  for (const char* const name : {R"(<body name="payload")", R"(<body name="payload_")",
                                 R"( name="shoulder_link")", R"( name="shoulder_link_")"})
    EXPECT_NE(text.find(name), std::string::npos) << name << " is not in\n" << text;
}

TEST(ExportArm, TheAccountOfGravityIsThatOfTheFile) {
  for (const double tilt_rad : {0.0, 5e-5}) {
    ArmDescription given = arm();
    given.gravity_B_m_per_s2 = 9.81 * Eigen::Vector3d(std::sin(tilt_rad), 0, -std::cos(tilt_rad));
    const bool has_level = analysis::arm_urdf_text(given, kNames, {}).find("\"level\"") != std::string::npos;
    const auto carriages = analysis::body_carriages(given, ArmTarget::kUrdf);
    const auto gravity =
        std::ranges::find(carriages, "gravity_direction", [](const auto& one) { return one.effect; });
    ASSERT_NE(gravity, carriages.end());
    EXPECT_EQ(has_level, tilt_rad != 0);
    EXPECT_EQ(gravity->as.find("level link") != std::string::npos, has_level) << gravity->as;
  }
}

TEST(ExportArm, ABaseOfMujocosOwnNameGetsAnother) {
  const std::string text = analysis::arm_mujoco_text(arm(), {"three", "world", "tip"}, 5e-4, {});
  EXPECT_EQ(text.find(R"(<body name="world")"), std::string::npos) << text;
  EXPECT_NE(text.find(R"(<body name="world_")"), std::string::npos) << text;
  EXPECT_NE(analysis::arm_urdf_text(arm(), {"three", "world", "tip"}, {}).find(R"(<link name="world"/>)"),
            std::string::npos);
}

}  // namespace export_arm_test
