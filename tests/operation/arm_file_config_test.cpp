// [teleoperation.arm] robot_file: an arm as youbot-gap delivers it becomes the model of the daemon's control.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "control/arm_description.h"
#include "control/base_drive.h"
#include "control/robot_model.h"
#include "control/whole_body_controller.h"
#include "model/gravity.h"
#include "operation/config.h"
#include "runtime/configuration/robot_file.h"
#include "runtime/configuration/toml_reader.h"
#include "runtime/mcap/mcap_file.h"
#include "runtime/mcap/mcap_reader.h"
#include "runtime/recording/recording_directory.h"
#include "runtime/simulated_arm.h"
#include "sim/mobile_manipulator.h"
#include "tests/support/built_paths.h"
#include "tests/support/temporary_directory.h"

namespace operation::arm_file_config_test {

namespace fs = std::filesystem;
using control::ArmDescription;
using control::ArmDrive;
using control::ArmVector;
using control::ChainVector;
using control::kArmJoints;
using control::kBaseAxes;
using control::RobotModel;
using model::kGravity_m_per_s2;

constexpr double kDegree = std::numbers::pi / 180;
const std::string kArm = "[teleoperation.arm]\nrobot_file = \"arm/model.toml\"\n";
/// Joints that hold a kilogram at the tip.
const std::string kStrongArm = kArm + "torque_limit_Nm = [15, 15, 15, 15, 15]\n";

/// Deflections from the arm that points straight up.
ArmVector pose_rad(double joint1_deg, double joint2_deg, double joint3_deg, double joint4_deg) {
  return kDegree *
         (ArmVector() << 169 + joint1_deg, 65 + joint2_deg, -146 + joint3_deg, 102.5 + joint4_deg, 167.5)
             .finished();
}
const std::array<ArmVector, 3> kPoses{pose_rad(0, 90, 0, 0), pose_rad(40, -30, 80, 50),
                                      pose_rad(-100, 20, -60, 85)};

RobotModel at(const control::ModelChanges& changes, const ArmVector& arm_rad) {
  RobotModel model(changes);
  model.update((ChainVector() << 0, 0, 0, arm_rad).finished());
  return model;
}
ArmVector weight_Nm(const control::ModelChanges& changes, const ArmVector& arm_rad) {
  return at(changes, arm_rad).gravity_Nm().tail<kArmJoints>();
}

/// Frames of the links in the arm's base.
std::vector<Eigen::Isometry3d> frames(const ArmDescription& arm, const ArmVector& arm_rad) {
  std::vector<Eigen::Isometry3d> result;
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  for (std::size_t i = 0; i < arm.arm.links.size(); ++i) {
    const control::ArmLink& link = arm.arm.links[i];
    X = X * link.X_PL * Eigen::AngleAxisd(arm_rad[static_cast<Eigen::Index>(i)], link.axis_L);
    result.push_back(X);
  }
  return result;
}

double potential_energy_J(const ArmDescription& arm, const ArmVector& arm_rad) {
  const std::vector<Eigen::Isometry3d> X = frames(arm, arm_rad);
  double energy_J = 0;
  for (std::size_t i = 0; i < X.size(); ++i) {
    const control::LinkInertia& body = arm.arm.links[i].inertia;
    energy_J += body.mass_kg * kGravity_m_per_s2 * (X[i] * body.p_LC_m).z();
  }
  return energy_J + arm.payload_kg * kGravity_m_per_s2 * (X.back() * (arm.arm.X_LT * arm.p_TP_m)).z();
}

/// Virtual work: what a small turn of each joint lifts.
ArmVector virtual_work_Nm(const ArmDescription& arm, const ArmVector& arm_rad) {
  constexpr double kTurn_rad = 1e-5;
  ArmVector torque_Nm;
  for (int i = 0; i < kArmJoints; ++i) {
    const ArmVector turn_rad = kTurn_rad * ArmVector::Unit(i);
    torque_Nm[i] =
        (potential_energy_J(arm, arm_rad + turn_rad) - potential_energy_J(arm, arm_rad - turn_rad)) /
        (2 * kTurn_rad);
  }
  return torque_Nm;
}

/// Moment of inertia of all that joint `joint` moves, about its axis: parallel axes.
double inertia_kg_m2(const ArmDescription& arm, const ArmVector& arm_rad, std::size_t joint) {
  const std::vector<Eigen::Isometry3d> X = frames(arm, arm_rad);
  const Eigen::Vector3d axis = X[joint].linear() * arm.arm.links[joint].axis_L;
  const auto distance_m = [&](const Eigen::Vector3d& p) {
    return axis.cross(p - X[joint].translation()).norm();
  };
  double sum = 0;
  for (std::size_t i = joint; i < X.size(); ++i) {
    const control::LinkInertia& body = arm.arm.links[i].inertia;
    const Eigen::Vector3d axis_L = X[i].linear().transpose() * axis;
    sum +=
        axis_L.dot(body.about_C_kg_m2 * axis_L) + body.mass_kg * std::pow(distance_m(X[i] * body.p_LC_m), 2);
  }
  return sum + arm.payload_kg * std::pow(distance_m(X.back() * (arm.arm.X_LT * arm.p_TP_m)), 2);
}

class ArmFileConfig : public testing::Test {
 protected:
  ArmFileConfig() {
    std::string urdf(control::youbot_urdf());
    directory_.write("arm/youbot.urdf", urdf);
    given_.arm = control::read_serial_arm(urdf, "arm_foot", "tip");
    for (const control::ArmLink& link : given_.arm.links) {
      control::ArmDrive drive;
      drive.joint = link.joint;
      drive.rotor_inertia_kg_m2 = 0.2;
      drive.coulomb_Nm = 0.4;
      drive.viscous_Nm_s_per_rad = 0.2;
      given_.drives.push_back(drive);
    }
  }

  /// As youbot-gap writes it, in arm/model.toml.
  void deliver(const ArmDescription& arm) const {
    runtime::RobotFile file;
    file.name = "youbot-arm";
    file.base = "arm_foot";
    file.tip = "tip";
    file.arm = arm;
    for (const char* joint : {"1", "2", "3", "4", "5"}) {
      file.columns.position.push_back(std::string("arm_") + joint + "_position_rad");
      file.columns.torque.push_back(std::string("arm_") + joint + "_torque_measured_Nm");
    }
    file.columns.position_factor.assign(kArmJoints, 1);
    file.columns.torque_factor.assign(kArmJoints, 1);
    write(runtime::robot_file_text(file, "youbot.urdf", given_, {}, {}));
  }
  void write(const std::string& text) const { directory_.write("arm/model.toml", text); }
  std::string delivered() const {
    std::ifstream file(directory_ / "arm/model.toml");
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  }

  Config load(const std::string& text = kArm) const {
    return load_config(directory_.write("lab.toml", text));
  }
  /// Without the directory; "" if there is none.
  std::string problems(const std::string& text = kArm) const {
    try {
      (void)load(text);
    } catch (const runtime::ConfigError& error) {
      std::string what = error.what();
      const std::string front = directory_.path().string() + "/";
      for (std::size_t found; (found = what.find(front)) != std::string::npos;)
        what.erase(found, front.size());
      return what;
    }
    return "";
  }
  void expect_refused(const std::string& message, const std::string& text = kArm) const {
    const std::string found = problems(text);
    EXPECT_NE(found.find(message), std::string::npos) << found << "\nlacks: " << message;
  }

  /// A robot that differs from the description in all that a file can say.
  ArmDescription another_arm() const {
    ArmDescription arm = given_;
    control::LinkInertia& upper = arm.arm.links[1].inertia;
    upper.mass_kg = 1.5;
    upper.p_LC_m += Eigen::Vector3d(0.004, -0.006, 0.011);
    control::LinkInertia& wrist = arm.arm.links[3].inertia;
    wrist.p_LC_m.z() -= 0.008;
    wrist.about_C_kg_m2(1, 1) += 0.0004;
    arm.payload_kg = 0.4;
    arm.p_TP_m = {0.01, -0.02, 0.03};
    for (std::size_t i = 0; i < arm.drives.size(); ++i) {
      arm.drives[i].coulomb_Nm = 0.3 + 0.1 * static_cast<double>(i);
      arm.drives[i].viscous_Nm_s_per_rad = 0.5 - 0.1 * static_cast<double>(i);
    }
    return arm;
  }

  support::TemporaryDirectory directory_;
  ArmDescription given_;
};

TEST_F(ArmFileConfig, TheDescriptionItselfChangesNothingButTheFriction) {
  deliver(given_);
  const control::WholeBodyController::Config robot = load().teleoperation.robot;
  for (const ArmVector& pose : kPoses)
    EXPECT_LT((weight_Nm(robot.model, pose) - weight_Nm({}, pose)).norm(), 1e-12);
  for (std::size_t i = 0; i < kArmJoints; ++i) {
    EXPECT_EQ(robot.arm_friction.coulomb_Nm[i], 0.4);
    EXPECT_EQ(robot.arm_friction.viscous_Nm_s_per_rad[i], 0.2);
    EXPECT_EQ(robot.rotor_inertia_kg_m2[i], 0.2);
  }
}

TEST_F(ArmFileConfig, ADeliveredArmIsCarriedByWhatItWeighs) {
  const ArmDescription truth = another_arm();
  deliver(truth);
  const Config config = load();
  const control::WholeBodyController::Config& robot = config.teleoperation.robot;
  double without_Nm = 0;
  for (const ArmVector& pose : kPoses) {
    const ArmVector needed_Nm = virtual_work_Nm(truth, pose);
    without_Nm = std::max(without_Nm, (weight_Nm({}, pose) - needed_Nm).cwiseAbs().maxCoeff());
    EXPECT_LT((weight_Nm(robot.model, pose) - needed_Nm).cwiseAbs().maxCoeff(), 1e-8) << pose.transpose();
    RobotModel model = at(robot.model, pose);
    for (std::size_t i = 0; i < kArmJoints; ++i)
      EXPECT_NEAR(model.mass().diagonal()[static_cast<Eigen::Index>(kBaseAxes + i)],
                  inertia_kg_m2(truth, pose, i), 1e-12)
          << "joint " << i + 1;
  }
  EXPECT_GT(without_Nm, 2.0);
  EXPECT_EQ(robot.arm_friction.coulomb_Nm[4], 0.7);
  EXPECT_EQ(robot.arm_friction.viscous_Nm_s_per_rad[0], 0.5);
  ASSERT_TRUE(config.arm_file.has_value());
  EXPECT_EQ(config.arm_file->path, directory_ / "arm/model.toml");
}

TEST_F(ArmFileConfig, TheRecordingOfARunIsEnoughToRunItAgain) {
  const ArmDescription truth = another_arm();
  deliver(truth);
  // The wrist's inertia comes from the file's own URDF, and the payload is given from another tip.
  std::string text = delivered();
  const auto wrist = text.find("\n[[link]]\nname = \"arm_link_4\"");
  ASSERT_NE(wrist, std::string::npos);
  text.erase(wrist, text.find("\n[", wrist + 3) - wrist);
  text.replace(text.find("tip = \"tip\""), 11, "tip = \"arm_link_5\"");
  write(text);
  std::string urdf(control::youbot_urdf());
  const auto link = urdf.find("<mass", urdf.find("<link name=\"arm_link_4\">"));
  urdf.replace(link, urdf.find("/>", link) - link, "<mass value=\"0.9\"");
  directory_.write("arm/youbot.urdf", urdf);

  const std::string all =
      "[ethercat]\nkind = \"base+arm\"\n[simulation]\nrobot_file = \"arm/model.toml\"\n" + kArm;
  const Config ran = load(all);
  std::vector<std::string> problems;
  runtime::NewRecording recording(
      directory_ / "run",
      {.file = directory_ / "lab.toml", .models = ran.models, .format = runtime::RecordingFormat::kCsv},
      problems);
  recording.keep();
  EXPECT_EQ(problems, std::vector<std::string>{});
  fs::remove_all(directory_ / "arm");
  const Config again = load_config(directory_ / "run/config.toml");
  const control::WholeBodyController::Config& robot = again.teleoperation.robot;
  ASSERT_TRUE(again.robot.arm.has_value());
  for (const ArmVector& pose : kPoses) {
    const ArmVector needed_Nm = weight_Nm(ran.teleoperation.robot.model, pose);
    EXPECT_LT((weight_Nm(robot.model, pose) - needed_Nm).norm(), 1e-12);
    EXPECT_LT((weight_Nm(again.robot.arm->changes, pose) - needed_Nm).norm(), 1e-12);
    EXPECT_LT((at(robot.model, pose).mass() - at(ran.teleoperation.robot.model, pose).mass()).norm(), 1e-12);
  }
  EXPECT_EQ(robot.arm_friction.coulomb_Nm, ran.teleoperation.robot.arm_friction.coulomb_Nm);
  EXPECT_EQ(robot.rotor_inertia_kg_m2, ran.teleoperation.robot.rotor_inertia_kg_m2);
  EXPECT_EQ(again.opened_once, ran.opened_once);
}

TEST_F(ArmFileConfig, AModelOutsideOfTheFolderOfTheConfigurationIsReportedNotCopied) {
  const fs::path file = directory_.write("lab.toml", "robot = \"loopback\"\n");
  std::vector<std::string> problems;
  const runtime::NewRecording recording(directory_ / "run",
                                        {.file = file,
                                         .models = {{"../arm.toml", "a"}, {"/arm.toml", "b"}},
                                         .format = runtime::RecordingFormat::kCsv},
                                        problems);
  EXPECT_EQ(problems, std::vector<std::string>{"files outside the configuration's folder are not copied: "
                                               "../arm.toml, /arm.toml; keep them with the recording"});
  EXPECT_FALSE(fs::exists(directory_ / "arm.toml"));
}

TEST_F(ArmFileConfig, AnMcapFileHasAModelOutsideOfTheFolderAndThatIsReported) {
  const fs::path file = directory_.write("lab.toml", "robot = \"loopback\"\n");
  std::vector<std::string> problems;
  runtime::NewRecording recording(
      directory_ / "run",
      {.file = file, .models = {{"../arm.toml", "a"}, {"arm/in.toml", "b"}, {"../youbot.urdf", "c"}}},
      problems);
  EXPECT_EQ(problems,
            std::vector<std::string>{
                "attachments outside the configuration's folder: ../arm.toml, ../youbot.urdf; to repeat the "
                "run, extract them to these paths relative to config.toml"});
  EXPECT_FALSE(fs::exists(directory_ / "run/arm/in.toml"));
  recording.open("base", {}, {{"time_s"}})->close();
  recording.keep();
  struct : runtime::mcap::Visitor {
    std::map<std::string, std::string> texts;
    bool wants_attachments() const override { return true; }
    void attachment(const runtime::mcap::Attachment& attachment) override {
      texts[attachment.name] = attachment.data;
    }
  } attachments;
  runtime::mcap::read_mcap(runtime::mcap::read_file(directory_ / "run/base.mcap"), "base.mcap", attachments);
  EXPECT_EQ(attachments.texts["../arm.toml"], "a");
  EXPECT_EQ(attachments.texts["arm/in.toml"], "b");
  EXPECT_EQ(attachments.texts["../youbot.urdf"], "c");
}

TEST_F(ArmFileConfig, AFileThatIsNamedInTwoWaysIsKeptOnce) {
  deliver(given_);
  const Config config = load(
      "[ethercat]\nkind = \"base+arm\"\n[simulation]\nrobot_file = \"./arm/model.toml\"\n"
      "[teleoperation.arm]\nrobot_file = \"arm/../arm/model.toml\"\n");
  ASSERT_EQ(config.models.size(), 2U);
  EXPECT_EQ(config.models[0].name, "arm/model.toml");
  EXPECT_EQ(config.models[1].name, "arm/youbot.urdf");
}

TEST_F(ArmFileConfig, TwoFilesThatALinkGivesOneNameAreBothKeptAndTheSecondIsReported) {
  fs::create_directories(directory_ / "real/sub");
  fs::create_directory_symlink("real/sub", directory_ / "link");
  for (const auto& [name, arm] : {std::pair{"a.toml", given_}, {"real/a.toml", another_arm()}}) {
    deliver(arm);
    directory_.write(name, delivered());
  }
  for (const char* name : {"youbot.urdf", "real/youbot.urdf"})
    directory_.write(name, std::string(control::youbot_urdf()));
  const Config config = load(
      "[ethercat]\nkind = \"base+arm\"\n[simulation]\nrobot_file = \"link/../a.toml\"\n"
      "[teleoperation.arm]\nrobot_file = \"a.toml\"\n");
  EXPECT_EQ(std::ranges::count(config.models, "a.toml", &runtime::RecordingFile::Attachment::name), 2);
  const auto problems_as = [&](runtime::RecordingFormat format, const char* folder) {
    std::vector<std::string> problems;
    const runtime::NewRecording recording(
        directory_ / folder, {.file = directory_ / "lab.toml", .models = config.models, .format = format},
        problems);
    return problems;
  };
  EXPECT_EQ(problems_as(runtime::RecordingFormat::kCsv, "csv"),
            std::vector<std::string>{"copy of a.toml: is there already"});
  EXPECT_EQ(
      problems_as(runtime::RecordingFormat::kMcap, "mcap"),
      std::vector<std::string>{"attachment a.toml: another file of the configuration has the same name"});
}

TEST_F(ArmFileConfig, AnotherSimulatedArmNeedsARestart) {
  const std::string text = "[ethercat]\nkind = \"base+arm\"\n[simulation]\nrobot_file = \"arm/model.toml\"\n";
  deliver(given_);
  const auto opened_once = load(text).opened_once;
  EXPECT_EQ(load(text).opened_once, opened_once);
  deliver(another_arm());
  EXPECT_NE(load(text).opened_once.at("simulation"), opened_once.at("simulation"));
}

TEST_F(ArmFileConfig, TheChecksOfTheSensorsExpectTheWeightThatControlCarries) {
  const ArmDescription truth = another_arm();
  deliver(truth);
  EXPECT_LT((weight_Nm(load().cycle.arm, kPoses[1]) - virtual_work_Nm(truth, kPoses[1])).norm(), 1e-8);
  // A payload given by hand is at the tip, 0.2175 m from joint 4 (youbot.urdf), here stretched forward.
  const ArmVector more_Nm = weight_Nm(load("[teleoperation.arm]\npayload_kg = 0.2\n").cycle.arm, kPoses[0]) -
                            weight_Nm({}, kPoses[0]);
  EXPECT_NEAR(more_Nm[3], -0.2 * kGravity_m_per_s2 * 0.2175, 1e-9);
}

// Lengths of the arm from joint to joint: 0.155, 0.135 and 0.2175 m (youbot.urdf).
TEST_F(ArmFileConfig, AKilogramAtTheStretchedArmPullsWithItsLever) {
  ArmDescription arm = given_;
  arm.payload_kg = 1;
  deliver(arm);
  const ArmVector more_Nm =
      weight_Nm(load(kStrongArm).teleoperation.robot.model, kPoses[0]) - weight_Nm({}, kPoses[0]);
  // A positive angle bends these joints forward and down, so they hold the weight with a negative torque.
  EXPECT_NEAR(more_Nm[0], 0, 1e-12);
  EXPECT_NEAR(more_Nm[1], -(0.155 + 0.135 + 0.2175) * kGravity_m_per_s2, 1e-9);
  EXPECT_NEAR(more_Nm[2], -(0.135 + 0.2175) * kGravity_m_per_s2, 1e-9);
  EXPECT_NEAR(more_Nm[3], -0.2175 * kGravity_m_per_s2, 1e-9);
  EXPECT_NEAR(more_Nm[4], 0, 1e-9);
}

TEST_F(ArmFileConfig, APayloadIsWhereTheFileSeesItFromItsOwnTip) {
  ArmDescription arm = given_;
  arm.payload_kg = 1;
  deliver(arm);
  const ArmVector at_tip_Nm = weight_Nm(load(kStrongArm).teleoperation.robot.model, kPoses[1]);
  std::string text = delivered();
  text.replace(text.find("tip = \"tip\""), 11, "tip = \"arm_link_5\"");
  text.replace(text.find("centre_m = [0.0, 0.0, 0.0]"), 26, "centre_m = [0.0, 0.0, 0.0875]");
  write(text);
  EXPECT_LT((weight_Nm(load(kStrongArm).teleoperation.robot.model, kPoses[1]) - at_tip_Nm).norm(), 1e-9);
}

TEST_F(ArmFileConfig, TheArmToStartFromIsTheDaemonsOwnModel) {
  const fs::path shipped = fs::path(support::source_dir()) / "control/youbot_arm.toml";
  const control::WholeBodyController::Config robot =
      load("[teleoperation.arm]\nrobot_file = \"" + shipped.string() + "\"\n").teleoperation.robot;
  const control::WholeBodyController::Config usual;
  for (const ArmVector& pose : kPoses)
    EXPECT_LT((weight_Nm(robot.model, pose) - weight_Nm({}, pose)).norm(), 1e-12);
  EXPECT_EQ(robot.arm_friction.coulomb_Nm, usual.arm_friction.coulomb_Nm);
  EXPECT_EQ(robot.arm_friction.viscous_Nm_s_per_rad, usual.arm_friction.viscous_Nm_s_per_rad);
  for (std::size_t i = 0; i < kArmJoints; ++i)
    EXPECT_NEAR(robot.rotor_inertia_kg_m2[i], usual.rotor_inertia_kg_m2[i],
                0.005 * usual.rotor_inertia_kg_m2[i]);
}

TEST_F(ArmFileConfig, TheRotorsOfTheFileSlowTheHandDown) {
  for (const double rotor_kg_m2 : {0.2, 0.5}) {
    ArmDescription arm = given_;
    arm.drives[1].rotor_inertia_kg_m2 = rotor_kg_m2;
    deliver(arm);
    control::WholeBodyController controller(load().teleoperation.robot);
    controller.reset(control::WheelVector::Zero(), kPoses[1]);
    const control::Mobility found_W = controller.sense(control::WheelVector::Zero(), kPoses[1]).mobility_W;
    RobotModel model = at({}, kPoses[1]);
    control::ChainMatrix mass = model.mass();
    mass.diagonal() +=
        (ChainVector() << control::kReflectedWheelInertia, 0.2, rotor_kg_m2, 0.2, 0.2, 0.2).finished();
    const control::Mobility expected_W = model.J_WT() * mass.inverse() * model.J_WT().transpose();
    EXPECT_LT((found_W - expected_W).norm(), 1e-9 * expected_W.norm()) << rotor_kg_m2;
  }
}

/// Torque of joint 4 while it turns at `speed_rad_per_s` and the end effector is pulled the same way.
double pulling_Nm(const Config& config, double speed_rad_per_s) {
  control::WholeBodyController::Config robot = config.teleoperation.robot;
  robot.arm_torque_limit_Nm.fill(100);
  control::WholeBodyController controller(robot);
  control::WheelVector wheels_rad = control::WheelVector::Zero();
  ArmVector arm_rad = pose_rad(0, -10, 80, 40);
  controller.reset(wheels_rad, arm_rad);
  for (int n = 0; n < 500; ++n) {
    arm_rad[3] += speed_rad_per_s * robot.period_s;
    controller.sense(wheels_rad, arm_rad);
  }
  RobotModel model = at({}, arm_rad);
  const Eigen::Isometry3d& X_WT = controller.state().X_WT;
  const Eigen::Vector3d way_m =
      0.05 * model.J_WT().col(kBaseAxes + 3).head<3>().normalized() * (speed_rad_per_s < 0 ? -1 : 1);
  return controller
      .track({{X_WT.translation() + way_m, Eigen::Quaterniond(X_WT.linear())}, Eigen::Vector3d::Zero()},
             config.teleoperation.stiff)
      .arm_torque_Nm[3];
}

TEST_F(ArmFileConfig, CoulombFrictionOfAJointHelpsItInItsDirection) {
  for (const double speed_rad_per_s : {0.2, -0.2}) {
    ArmDescription arm = given_;
    arm.drives[3].coulomb_Nm = arm.drives[3].viscous_Nm_s_per_rad = 0;
    deliver(arm);
    const double smooth_Nm = pulling_Nm(load(), speed_rad_per_s);
    arm.drives[3].coulomb_Nm = 0.3;
    deliver(arm);
    const double help_Nm = pulling_Nm(load(), speed_rad_per_s) - smooth_Nm;
    EXPECT_NEAR(help_Nm, 0.8 * std::copysign(0.3, speed_rad_per_s), 1e-6) << "0.8: compensation_margin";
  }
}

/// How far the arm sinks in half a second if each joint gets the torque that this model needs.
double sinks_rad(const ArmDescription& truth, const control::ModelChanges& truth_changes,
                 const control::ModelChanges& carried) {
  sim::MobileManipulatorParameters parameters;
  parameters.masses = truth_changes;
  parameters.wheels.on_ground = false;
  parameters.start_rad = kPoses[1];
  for (std::size_t i = 0; i < kArmJoints; ++i)
    parameters.arm[i].coulomb_Nm = 0.02 * truth.drives[i].coulomb_Nm;
  sim::MobileManipulator robot(parameters);
  RobotModel model(carried);
  std::array<hal::JointSample, 9> samples;
  std::array<hal::JointCommand, 9> commands{};
  for (int n = 0; n < 500; ++n) {
    robot.measure(samples);
    ChainVector q = ChainVector::Zero();
    for (int i = 0; i < kArmJoints; ++i)
      q[kBaseAxes + i] = samples[static_cast<std::size_t>(4 + i)].position_rad;
    model.update(q);
    const ChainVector torque_Nm = model.gravity_Nm();
    for (int i = 0; i < kArmJoints; ++i)
      commands[static_cast<std::size_t>(4 + i)] = {hal::CommandMode::kTorque, torque_Nm[kBaseAxes + i]};
    robot.advance(commands, true, std::chrono::milliseconds(1));
  }
  return (robot.arm_rad() - parameters.start_rad).cwiseAbs().maxCoeff();
}

TEST_F(ArmFileConfig, TheSimulatedArmFloatsOnTheModelOfItsFileAndSinksOnTheDescription) {
  const ArmDescription truth = another_arm();
  deliver(truth);
  const control::ModelChanges changes = load().teleoperation.robot.model;
  EXPECT_GT(sinks_rad(truth, changes, {}), 0.1);
  EXPECT_LT(sinks_rad(truth, changes, changes), 0.01);
}

TEST_F(ArmFileConfig, TheSimulationsArmCanBeThatOfTheSameFile) {
  const ArmDescription truth = another_arm();
  deliver(truth);
  const Config config =
      load("[ethercat]\nkind = \"base+arm\"\n[simulation]\nrobot_file = \"arm/model.toml\"\n");
  EXPECT_FALSE(config.arm_file.has_value()) << "control knows nothing of it";
  ASSERT_TRUE(config.robot.arm.has_value());
  control::ModelChanges masses = sim::built_robot();
  std::array<sim::bus::ArmJointData, kArmJoints> joints = sim::bus::kArmJointData;
  runtime::build_arm(*config.robot.arm, masses, joints);
  for (const ArmVector& pose : kPoses)
    EXPECT_LT((weight_Nm(masses, pose) - virtual_work_Nm(truth, pose)).norm(), 1e-8);
  EXPECT_EQ(masses.links[0].mass_factor, sim::built_robot().links[0].mass_factor) << "the base is its own";
  EXPECT_EQ(joints[4].coulomb_Nm, 0.7);
  EXPECT_EQ(joints[0].viscous_Nm_s_per_rad, 0.5);
  EXPECT_NEAR(joints[2].rotor_inertia_kg_m2 * 100 * 100, 0.2, 1e-12) << "behind a gear of 100";
}

TEST_F(ArmFileConfig, ASimulatedArmWithoutWeightIsRefusedAFile) {
  deliver(given_);
  const std::string simulated = "[simulation]\nrobot_file = \"arm/model.toml\"\n";
  const std::string needs =
      "lab.toml:2: 'simulation.robot_file' needs 'ethercat.kind' = \"base+arm\": no other simulated arm has "
      "weight";
  EXPECT_EQ(problems(simulated), needs);
  EXPECT_EQ(problems(simulated + "[ethercat]\nkind = \"base+two-arms\"\n"), needs);
  EXPECT_EQ(problems("robot = \"wire\"\n" + simulated + "[ethercat]\nkind = \"base+arm\"\n"), "");
  // youbotd --robot may name another robot: runtime::check_robot() judges the name.
  EXPECT_EQ(problems("robot = \"ethercat:eth0\"\n" + simulated + "[ethercat]\nkind = \"base+arm\"\n"), "");
}

TEST_F(ArmFileConfig, AnEffectThatControlHasNoModelOfIsRefusedByNameWithItsLine) {
  deliver(given_);
  const std::string good = delivered();
  const auto drive = good.find("joint = \"arm_joint_2\"\n");
  ASSERT_NE(drive, std::string::npos);
  const auto line = 1 + std::count(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(drive), '\n');
  for (const runtime::DriveKey& key : runtime::drive_keys()) {
    const bool taken =
        key.key == "coulomb_Nm" || key.key == "viscous_Nm_s_per_rad" || key.key == "rotor_inertia_kg_m2";
    const bool alone_nothing =
        key.key == "gear_ratio" || key.key == "stribeck_speed_rad_per_s" || key.key == "spring_rest_rad";
    std::string text = good;
    if (taken) continue;
    write(text.insert(drive, std::string(key.key) + " = 0.3\n"));
    if (alone_nothing)
      EXPECT_EQ(problems(), "") << key.key;
    else
      expect_refused(
          "lab.toml:2: 'teleoperation.arm.robot_file' names a robot file that cannot be used: "
          "arm/model.toml:" +
          std::to_string(line) + ": 'drive[1]." + std::string(key.key) +
          "' of arm_joint_2 is an effect that control has no model of");
  }
  write(good + "[[drive]]\njoint = \"none\"\n");
  expect_refused("is 'none', which does not move");
  std::string ripple = good;
  const auto next = good.find("\n[[drive]]\njoint = \"arm_joint_3\"");
  write(ripple.insert(next, "[[drive.ripple]]\nperiods_per_rev = 12\nsine_Nm = 0.1\n"));
  expect_refused(
      "'drive[1].ripple' of arm_joint_2 is an effect that control has no model of; without a robot file, "
      "[teleoperation.arm] takes coulomb_Nm, viscous_Nm_s_per_rad and payload_kg");
}

TEST_F(ArmFileConfig, WhatCausesARefusedEffectIsRemovedOnTheRobotIfItCanBe) {
  const auto refused = [&](double ArmDrive::*key, const std::string& message) {
    ArmDescription arm = given_;
    arm.drives[1].*key = 0.3;
    deliver(arm);
    expect_refused("' of arm_joint_2 is an effect that control has no model of" + message);
  };
  refused(&ArmDrive::encoder_zero_rad, ": on the robot, correct the zero of the joint, and measure again");
  refused(&ArmDrive::spring_Nm_per_rad, ": on the robot, remove the spring, and measure again");
  refused(&ArmDrive::cable_3_Nm_per_rad3,
          ": on the robot, free the cable that pulls at this joint, and measure again");
  for (double ArmDrive::*key : {&ArmDrive::load_friction, &ArmDrive::stribeck_Nm,
                                &ArmDrive::compliance_rad_per_Nm, &ArmDrive::torque_scale})
    refused(key, "; without a robot file, [teleoperation.arm] takes coulomb_Nm, viscous_Nm_s_per_rad");
}

TEST_F(ArmFileConfig, ATiltedBaseAnotherGeometryAndAnotherRobotAreRefused) {
  ArmDescription arm = given_;
  arm.gravity_B_m_per_s2 = Eigen::AngleAxisd(0.05, Eigen::Vector3d::UnitX()) * arm.gravity_B_m_per_s2;
  deliver(arm);
  expect_refused("'gravity_m_per_s2' is 2.86 degrees off the axis of arm_joint_1");
  arm.gravity_B_m_per_s2 = {0, 0, -9.5};
  deliver(arm);
  expect_refused("'gravity_m_per_s2' has a magnitude of 9.500 m/s²; allowed is 9.810, within 0.05");
  arm.gravity_B_m_per_s2 = {0, 0, -9.81};
  deliver(arm);
  EXPECT_EQ(problems(), "");

  const std::string urdf(control::youbot_urdf());
  const auto with_urdf = [&](const std::string& from, const std::string& to) {
    std::string other = urdf;
    other.replace(other.find(from), from.size(), to);
    directory_.write("arm/youbot.urdf", other);
  };
  with_urdf("xyz=\"0 0 0.155\"", "xyz=\"0 0 0.150\"");
  expect_refused("arm/model.toml:3: 'urdf' has arm_joint_3 at another place, zero or axis");
  const std::string first =
      "<origin xyz=\"0.024 0 0.096\" rpy=\"0 0 2.949606435870417\"/>\n    <axis xyz=\"0 0 -1\"/>";
  with_urdf(first, "<origin xyz=\"0.024 0 0.096\" rpy=\"0 0 0\"/>\n    <axis xyz=\"0 0 1\"/>");
  expect_refused("'urdf' has arm_joint_1 at another place, zero or axis");
  directory_.write("arm/youbot.urdf", urdf);

  std::string short_arm = delivered();
  short_arm.replace(short_arm.find("tip = \"tip\""), 11, "tip = \"arm_link_4\"");
  short_arm.erase(short_arm.find("\n[[drive]]\njoint = \"arm_joint_5\""));
  write(short_arm);
  expect_refused(
      "'urdf' moves arm_joint_1, arm_joint_2, arm_joint_3, arm_joint_4 between base and tip; the youBot's "
      "arm "
      "moves arm_joint_1, arm_joint_2, arm_joint_3, arm_joint_4, arm_joint_5, in this order");
  fs::copy_file(support::source_dir() + "/tests/data/diff_drive_base/robot.toml",
                directory_ / "arm/model.toml", fs::copy_options::overwrite_existing);
  expect_refused("arm/model.toml:4: 'base' makes this the description of a base, and an arm is expected");
}

TEST_F(ArmFileConfig, ValuesThatNoArmHasAreRefusedWithTheirLine) {
  const auto refused = [&](const auto& change, const std::string& message) {
    ArmDescription arm = another_arm();
    change(arm);
    deliver(arm);
    expect_refused(message);
  };
  refused([](ArmDescription& arm) { arm.arm.links[1].inertia.mass_kg = 0; },
          ".mass_kg' gives arm_link_2 0 kg, allowed is 0.57");
  refused([](ArmDescription& arm) { arm.arm.links[4].inertia.mass_kg = 1; },
          ".mass_kg' gives arm_link_5 1 kg, allowed is 0.248 to 0.992: 0.5 to 2 times its mass");
  refused([](ArmDescription& arm) { arm.arm.links[1].inertia.p_LC_m.z() = 0.5; },
          ".centre_m' places the centre of mass of arm_link_2 0.39");
  refused([](ArmDescription& arm) { arm.arm.links[3].inertia.about_C_kg_m2(0, 0) = -0.01; },
          ".inertia_kg_m2' gives arm_link_4 a moment of inertia of -0.01");
  refused([](ArmDescription& arm) { arm.arm.links[3].inertia.about_C_kg_m2(0, 0) = 0.1; },
          ".inertia_kg_m2' gives arm_link_4 a moment of inertia of 0.1 kg·m², allowed is 0.01");
  refused([](ArmDescription& arm) { arm.payload_kg = 3; }, "'payload.mass_kg' is 3, allowed is 0 to 2");
  refused([](ArmDescription& arm) { arm.p_TP_m.x() = 0.4; }, "'payload.centre_m' is 0.4");
  refused([](ArmDescription& arm) { arm.drives[2].coulomb_Nm = 11; },
          "'drive[2].coulomb_Nm' of arm_joint_3 is 11, allowed is 0 to 10");
  refused([](ArmDescription& arm) { arm.drives[2].coulomb_Nm = -1; }, "'drive[2].coulomb_Nm' is -1");
  const auto rotor = [&](double value_kg_m2, const std::string& message) {
    refused([&](ArmDescription& arm) { arm.drives[2].rotor_inertia_kg_m2 = value_kg_m2; },
            "'drive[2].rotor_inertia_kg_m2' of arm_joint_3 is " + message +
                ", allowed is 0.027 to 0.675 kg·m² behind the gear");  // 0.2 and 5 times 100²·1.35e-5
  };
  rotor(1.35e-5, "1.35e-05");
  rotor(10, "10");
  rotor(0, "zero or missing");
}

// The end effector starts 30 degrees below the horizontal; joint 4 holds 2 N·m.
TEST_F(ArmFileConfig, AnArmThatJoint4CannotHoldAtItsStartIsRefused) {
  ArmDescription arm = given_;
  arm.payload_kg = 0.25;
  deliver(arm);
  EXPECT_EQ(problems(), "");
  arm.payload_kg = 2;
  arm.p_TP_m.z() = 0.1;
  deliver(arm);
  expect_refused(
      "lab.toml:2: 'teleoperation.arm.robot_file' names arm/model.toml, whose arm is too heavy: at "
      "'teleoperation.start.position_m', arm_joint_4 needs ");
  expect_refused("; its limit of 2 allows 1.80: lighten the load or choose another start");
  EXPECT_EQ(problems(kStrongArm), "");
}

TEST_F(ArmFileConfig, APayloadGivenByHandIsJudgedLikeThatOfAFile) {
  const auto by_hand = [](const std::string& keys) { return "[teleoperation.arm]\n" + keys; };
  EXPECT_EQ(problems(by_hand("payload_kg = 0.2\n")), "");
  expect_refused(
      "lab.toml:2: 'teleoperation.arm.payload_kg' makes the arm too heavy: at "
      "'teleoperation.start.position_m', arm_joint_4 needs ",
      by_hand("payload_kg = 2\n"));
  EXPECT_EQ(problems(by_hand("payload_kg = 1\ntorque_limit_Nm = [15, 15, 15, 15, 15]\n")), "");
  deliver(given_);
  const fs::path file = directory_.write("lab.toml", kArm);
  try {
    (void)load_config(file, {{"teleoperation.arm.torque_limit_Nm", "[9.5, 9.5, 6, 1, 1]"}});
    FAIL();
  } catch (const runtime::ConfigError& error) {
    EXPECT_EQ(std::string(error.what()).find("set: 'teleoperation.arm.torque_limit_Nm' is too low"), 0U)
        << error.what();
  }
}

// Joint 4 alone holds 0.92 N·m at the start.
TEST_F(ArmFileConfig, ATorqueLimitThatTheArmAloneExceedsIsTheCauseAlsoWithAPayload) {
  const auto with = [](const std::string& keys) { return "[teleoperation.arm]\n" + keys; };
  EXPECT_EQ(
      problems(with("torque_limit_Nm = [9.5, 9.5, 6, 0.5, 1]\n")),
      "lab.toml:2: 'teleoperation.arm.torque_limit_Nm' is too low: at 'teleoperation.start.position_m', "
      "arm_joint_4 needs 0.92 N·m to hold the arm, so at least 1.03");
  EXPECT_EQ(problems(with("torque_limit_Nm = [9.5, 9.5, 6, 1.03, 1]\n")), "");
  expect_refused("lab.toml:3: 'teleoperation.arm.torque_limit_Nm' is too low: ",
                 with("payload_kg = 0.02\ntorque_limit_Nm = [9.5, 9.5, 6, 0.5, 1]\n"));
  expect_refused("lab.toml:2: 'teleoperation.arm.payload_kg' makes the arm too heavy: ",
                 with("payload_kg = 0.1\ntorque_limit_Nm = [9.5, 9.5, 6, 1.03, 1]\n"));
}

TEST_F(ArmFileConfig, APostureThatASettingGivesAndTheArmCannotHoldIsRefusedThere) {
  const fs::path file = directory_.write("lab.toml", "[teleoperation.arm]\npayload_kg = 0.2\n");
  try {
    // Stretched forward.
    (void)load_config(file, {{"teleoperation.start.unfolded_deg", "[169, 155, -146, 102, 167]"}});
    FAIL();
  } catch (const runtime::ConfigError& error) {
    EXPECT_EQ(error.problems().front().find(
                  "set: 'teleoperation.start.unfolded_deg' leads to a posture that needs too much torque: at "
                  "'teleoperation.start.unfolded_deg', arm_joint_2 needs "),
              0U)
        << error.what();
  }
}

TEST_F(ArmFileConfig, LinksWithoutRotationalInertiaArePointMasses) {
  ArmDescription arm = given_;
  for (control::ArmLink& link : arm.arm.links) {
    link.inertia.about_C_kg_m2.setZero();
    link.inertia.mass_kg *= 1.1;
  }
  deliver(arm);
  RobotModel model = at(load().teleoperation.robot.model, kPoses[1]);
  for (std::size_t i = 0; i < kArmJoints; ++i)
    EXPECT_NEAR(model.mass().diagonal()[static_cast<Eigen::Index>(kBaseAxes + i)],
                inertia_kg_m2(arm, kPoses[1], i), 1e-12)
        << "joint " << i + 1;
}

TEST_F(ArmFileConfig, ALinkHasOneTable) {
  deliver(given_);
  write(delivered() +
        "[[link]]\nname = \"arm_link_2\"\nmass_kg = 1.2\n"
        "[[link]]\nname = \"arm_link_2\"\nmass_kg = 1.3\n");
  expect_refused("'link[1].name' is 'arm_link_2' again: a link has one table");
}

TEST_F(ArmFileConfig, AFactorOfAColumnOfYoubotdIsRefusedAndOfAnotherReported) {
  deliver(given_);
  const std::string good = delivered();
  const std::string column = "torque_column = \"arm_2_torque_measured_Nm\"\n";
  const auto with = [&](const std::string& lines) {
    std::string text = good;
    write(text.replace(text.find(column), column.size(), lines));
  };
  with(column + "torque_factor = 0.5\n");
  expect_refused(
      "'drive[1].torque_factor' of arm_joint_2 is 0.5, but arm_2_torque_measured_Nm is a column of");
  with("torque_column = \"current_2_A\"\ntorque_factor = 0.5\nfriction_before_gear = true\n");
  EXPECT_EQ(arm_lines(load()).back(),
            "arm: identified from recordings whose current_2_A was multiplied by torque_factor = 0.5");
}

TEST_F(ArmFileConfig, WhatTheFileChangesIsListed) {
  ArmDescription arm = given_;
  arm.arm.links[1].inertia.mass_kg = 1.1552;
  arm.arm.links[2].inertia.p_LC_m = {0.001, 0.02, 0.09};
  deliver(arm);
  const std::vector<std::string> lines = arm_lines(load());
  ASSERT_GE(lines.size(), 3U);
  EXPECT_EQ(lines[0], "arm: robot file " + (directory_ / "arm/model.toml").string());
  EXPECT_EQ(lines[1], "arm: arm_link_2: mass 1.155 -> 1.1552 kg");
  EXPECT_EQ(lines[2], "arm: arm_link_3: centre of mass -0.0001, 0.0211, 0.0967 -> 0.0010, 0.0200, 0.0900 m");
  EXPECT_EQ(lines.back(),
            "arm: rotor inertia of joints 1 to 5: 0.2000, 0.2000, 0.2000, 0.2000, 0.2000 kg·m²");
}

TEST_F(ArmFileConfig, TheListIsOfWhatControlUsesAndOfWhatTheSimulatedArmFollows) {
  ArmDescription arm = given_;
  arm.payload_kg = 0.25;
  deliver(arm);
  const fs::path file = directory_.write(
      "lab.toml", "[ethercat]\nkind = \"base+arm\"\n[simulation]\nrobot_file = \"arm/model.toml\"\n" + kArm);
  const std::vector<std::string> lines =
      arm_lines(load_config(file, {{"teleoperation.arm.payload_kg", "0.1"},
                                   {"teleoperation.arm.coulomb_Nm", "[0.1, 0.1, 0.1, 0.1, 0.1]"}}));
  for (const char* line : {"arm: payload: 0.100 kg at 0.0000, 0.0000, 0.0000 m from the tip",
                           "arm: Coulomb friction of joints 1 to 5: 0.100, 0.100, 0.100, 0.100, 0.100 N·m",
                           "simulated arm: payload: 0.250 kg at 0.0000, 0.0000, 0.0000 m from the tip",
                           "simulated arm: Coulomb friction of joints 1 to 5: 0.400, 0.400, 0.400, 0.400, "
                           "0.400 N·m"})
    EXPECT_EQ(std::ranges::count(lines, line), 1) << line;
}

TEST_F(ArmFileConfig, AValueHasOneSource) {
  deliver(given_);
  EXPECT_EQ(problems(kArm + "payload_kg = 0.1\nposture_Nm_per_rad = 5\n"),
            "lab.toml:3: 'teleoperation.arm.payload_kg' is given by the file of "
            "'teleoperation.arm.robot_file' too: "
            "remove one of the two");
  EXPECT_EQ(problems("[teleoperation.arm]\nrobot_file = \"none.toml\"\n").find("lab.toml:2: "), 0U);
  EXPECT_EQ(load("robot = \"loopback\"\n").arm_file, std::nullopt);
}

TEST_F(ArmFileConfig, ASettingWeakensTheFrictionOfTheFileAndNamesNoOther) {
  deliver(given_);
  const fs::path file = directory_.write("lab.toml", kArm);
  const auto set = [&](const std::string& key, const std::string& value) {
    return load_config(file, {{"teleoperation.arm." + key, value}});
  };
  const Config weaker = set("coulomb_Nm", "[0.1, 0.1, 0.1, 0.1, 0.1]");
  EXPECT_EQ(weaker.teleoperation.robot.arm_friction.coulomb_Nm[2], 0.1);
  EXPECT_THROW((void)set("coulomb_Nm", "[0.1, 0.1, 0.5, 0.1, 0.1]"), runtime::ConfigError);
  EXPECT_THROW((void)set("robot_file", "\"arm/model.toml\""), runtime::ConfigError);
}

}  // namespace operation::arm_file_config_test
