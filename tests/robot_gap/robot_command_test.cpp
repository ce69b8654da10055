// The command youbot-gap robot: reads an arm and recordings of it, names the wrong part, reports errors.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "runtime/configuration/robot_file.h"
#include "tests/support/built_paths.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_directory.h"

namespace youbot_gap_robot_test {

namespace fs = std::filesystem;
using nlohmann::json;

class GapRobot : public testing::Test {
 protected:
  GapRobot() {
    for (const char* const file : {"arm.urdf", "robot.toml"}) fs::copy(data_ / file, directory_ / file);
  }
  static std::string read(const fs::path& path) {
    std::ifstream file(path);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  }
  support::CommandResult run(const std::string& arguments) {
    return support::run_command(support::program("youbot-gap") + " robot --model " + model() + " --out " +
                                out() + " --quiet " + arguments);
  }
  /// Refused with exit code 2 and this text.
  void expect_refused(const std::string& arguments, const std::string& text) {
    const support::CommandResult result = run(arguments);
    EXPECT_EQ(result.exit_code, 2) << result.output;
    EXPECT_TRUE(result.said(text)) << result.output << "lacks: " << text;
    EXPECT_FALSE(fs::exists(out()));
  }
  std::string model() const { return (directory_ / "robot.toml").string(); }
  std::string out() const { return (directory_ / "out").string(); }
  std::string recording(const std::string& name) const { return " " + (data_ / name).string(); }
  static bool names(const json& gap, const std::string& type, const std::string& part) {
    return std::ranges::any_of(gap.at("effects"), [&](const json& effect) {
      return effect.at("type") == type && effect.at("part") == part;
    });
  }
  static bool names(const json& gap, const std::string& type) {
    return std::ranges::any_of(gap.at("effects"), [&](const json& one) { return one.at("type") == type; });
  }

  const fs::path data_ = fs::path(support::source_dir()) / "tests/data/two_link_arm";
  support::TemporaryDirectory directory_;
};

// The measured arm: what its slow recording supports, by the README of its folder.
TEST_F(GapRobot, OfTheMeasuredArmIsFrictionOnBothJointsInOneKindOfMotion) {
  const support::CommandResult result = run("--data" + recording("A_slow_75s.csv"));
  ASSERT_EQ(result.exit_code, 0) << result.output;
  const json gap = json::parse(read(fs::path(out()) / "gap.json"));
  EXPECT_EQ(gap.at("verdict"), "partly explained");
  EXPECT_TRUE(names(gap, "coulomb", "shoulder")) << gap.at("effects");
  EXPECT_TRUE(names(gap, "coulomb", "elbow")) << gap.at("effects");
  EXPECT_TRUE(names(gap, "load_friction", "shoulder")) << gap.at("effects");
  for (const char* const wrong : {"stribeck", "torque_offset", "viscous"})
    EXPECT_FALSE(names(gap, wrong)) << wrong;
  const json& torques = gap.at("gap");
  EXPECT_EQ(torques.at("unit"), "Nm");
  EXPECT_LT(torques.at("after"), torques.at("before"));

  const runtime::RobotFile better = runtime::read_robot_file(fs::path(out()) / "model.toml");
  EXPECT_GT(better.arm.drives[0].coulomb_Nm, 0.05);
  EXPECT_GT(better.arm.drives[1].coulomb_Nm, 0.1);
  EXPECT_TRUE(fs::exists(fs::path(out()) / "report.html"));
}

TEST_F(GapRobot, RefusesTheFrictionOfTheShoulderThatDoesNotTransferToFastMotion) {
  const support::CommandResult result = run("--data" + recording("A_slow_75s.csv") + " --held-out" +
                                            recording("A_fast_1.csv") + recording("A_fast_2.csv"));
  ASSERT_EQ(result.exit_code, 0) << result.output;
  const json gap = json::parse(read(fs::path(out()) / "gap.json"));
  EXPECT_EQ(gap.at("data"), json({"A_slow_75s.csv"}));
  EXPECT_EQ(gap.at("held_out"), json({"A_fast_1.csv", "A_fast_2.csv"}));
  EXPECT_TRUE(names(gap, "coulomb", "elbow")) << gap.at("effects");
  for (const json& effect : gap.at("effects")) EXPECT_NE(effect.at("part"), "shoulder") << effect;
  EXPECT_NE(gap.at("reason").get<std::string>().find("parameters do not transfer"), std::string::npos);
}

TEST_F(GapRobot, RefusesAJointThatTheUrdfDoesNotHaveWithItsLine) {
  directory_.write("robot.toml", read(data_ / "robot.toml") + "[[drive]]\njoint = \"wrist\"\n");
  expect_refused("--data" + recording("A_fast_1.csv"), "robot.toml:");
  expect_refused("--data" + recording("A_fast_1.csv"), "shoulder, elbow");
}

TEST_F(GapRobot, RefusesAnUnknownKeyAndAMissingUrdfWithTheirLines) {
  directory_.write("robot.toml",
                   "format = \"youbot-robot-model/1\"\nurdf = \"none.urdf\"\nbase = \"base\"\ntip = \"tip\"\n"
                   "masses = 3\n[[drive]]\njoint = \"shoulder\"\n");
  expect_refused("--data" + recording("A_fast_1.csv"), "robot.toml:2:");
  expect_refused("--data" + recording("A_fast_1.csv"), "robot.toml:5:");
}

TEST_F(GapRobot, RefusesATableWithoutAColumnOrWithANumberThatIsNone) {
  const std::string head = "t_s,q1_rad,q2_rad,tau1_Nm,tau2_Nm\n0,0,0,0,0\n";
  const std::string missing =
      directory_.write("missing.csv", "t_s,q1_rad,tau1_Nm,tau2_Nm\n0,0,0,0\n").string();
  expect_refused("--data " + missing, "missing.csv:1:");
  expect_refused("--data " + missing, "q2_rad");
  const std::string broken = directory_.write("broken.csv", head + "0.01,0,nan,0,0\n0.02,0,0,0,0\n").string();
  expect_refused("--data " + broken, "broken.csv:3:");
  const std::string torn = directory_.write("torn.csv", head + "0.01,0,0\n0.02,0,0,0,0\n").string();
  expect_refused("--data " + torn, "torn.csv:3:");
}

TEST_F(GapRobot, NamesTheLineOfABadTimeWhateverTheFileIsCalled) {
  const std::string head = "t_s,q1_rad,q2_rad,tau1_Nm,tau2_Nm\n0,0,0,0,0\n";
  const std::string bad = directory_.write("left_slow.csv", head + "nan,0,0,0,0\n0.02,0,0,0,0\n").string();
  expect_refused("--data " + bad, "left_slow.csv:3:");
  const std::string torn = directory_.write("left_s.csv", head + "0.01,0,0\n0.02,0,0,0,0\n").string();
  expect_refused("--data " + torn, "left_s.csv:3:");
}

TEST_F(GapRobot, RefusesARecordingOfPauses) {
  std::string rows = "t_s,q1_rad,q2_rad,tau1_Nm,tau2_Nm\n";
  for (int i = 0; i < 3000; ++i)
    rows += std::to_string(0.01 * i + static_cast<double>(i / 100)) + ",0.1,0.2,0.3,0.4\n";
  const std::string paused = directory_.write("paused.csv", rows).string();
  expect_refused("--data " + paused, "paused.csv: after 0.990 s there is a pause of 1.01 s, and no part");
}

TEST_F(GapRobot, RefusesColumnsThatTwoJointsShareAndFactorsOfZero) {
  const std::string good = read(data_ / "robot.toml");
  directory_.write("robot.toml", good + "[columns]\nposition = \"q1_rad\"\n");
  expect_refused("--data" + recording("A_fast_1.csv"), "write {} for the number of the joint");
  directory_.write("robot.toml", good + "torque_factor = 0\n");
  expect_refused("--data" + recording("A_fast_1.csv"), "torque_factor' is zero");
}

TEST_F(GapRobot, RefusesAnInertiaThatNoBodyHas) {
  std::string urdf = read(data_ / "arm.urdf");
  const std::size_t at = urdf.find("ixx=\"");
  ASSERT_NE(at, std::string::npos);
  directory_.write("arm.urdf", urdf.insert(at + 5, "-"));
  expect_refused("--data" + recording("A_fast_1.csv"), "has a negative moment of inertia");
}

TEST_F(GapRobot, RefusesAUrdfWithARing) {
  const auto joint = [](const char* name, const char* type, const char* parent, const char* child) {
    return std::string(R"(<joint name=")") + name + R"(" type=")" + type + R"("><parent link=")" + parent +
           R"("/><child link=")" + child + R"("/><axis xyz="0 0 1"/></joint>)";
  };
  directory_.write("arm.urdf", R"(<robot name="ring"><link name="world"/><link name="a"/><link name="b"/>)" +
                                   joint("one", "continuous", "a", "b") + joint("two", "fixed", "b", "a") +
                                   "</robot>");
  directory_.write("robot.toml",
                   "format = \"youbot-robot-model/1\"\nurdf = \"arm.urdf\"\nbase = \"world\"\ntip = \"b\"\n"
                   "[[drive]]\njoint = \"one\"\n");
  expect_refused("--data" + recording("A_fast_1.csv"), "its joints form a ring");
}

// What youbot-gap writes, it reads again.
TEST(RobotFile, EveryParameterOfAnArmSurvivesWritingAndReading) {
  const fs::path data = fs::path(support::source_dir()) / "tests/data/two_link_arm";
  const runtime::RobotFile given = runtime::read_robot_file(data / "robot.toml");
  runtime::RobotFile changed = given;
  control::ArmDrive& drive = changed.arm.drives[1];
  drive.torque_scale = 1.1;
  drive.encoder_zero_rad = -0.03;
  drive.coulomb_Nm = 0.17;
  drive.load_friction = 0.06;
  drive.stribeck_Nm = 0.02;
  drive.stribeck_speed_rad_per_s = 0.4;
  drive.spring_Nm_per_rad = 0.5;
  drive.friction_of_previous_Nm = 0.01;
  drive.ripples.push_back({6, 0.1, -0.2});
  changed.arm.arm.links[0].inertia.mass_kg = 0.7;
  changed.arm.payload_kg = 0.25;
  changed.arm.p_TP_m = {0.01, 0, -0.02};
  changed.arm.gravity_B_m_per_s2 = {0.5, 0, -9.79};
  const std::vector<runtime::RobotRemark> remarks{{"elbow", "coulomb of elbow: 0.17 N·m"}};
  const support::TemporaryDirectory directory;
  const fs::path file = directory.write(
      "model.toml", runtime::robot_file_text(changed, data / "arm.urdf", given.arm, {}, remarks));
  const runtime::RobotFile again = runtime::read_robot_file(file);
  const control::ArmDrive& other = again.arm.drives[1];
  EXPECT_EQ(other.torque_scale, drive.torque_scale);
  EXPECT_EQ(other.encoder_zero_rad, drive.encoder_zero_rad);
  EXPECT_EQ(other.coulomb_Nm, drive.coulomb_Nm);
  EXPECT_EQ(other.load_friction, drive.load_friction);
  EXPECT_EQ(other.stribeck_speed_rad_per_s, drive.stribeck_speed_rad_per_s);
  EXPECT_EQ(other.spring_Nm_per_rad, drive.spring_Nm_per_rad);
  EXPECT_EQ(other.friction_of_previous_Nm, drive.friction_of_previous_Nm);
  ASSERT_EQ(other.ripples.size(), 1U);
  EXPECT_EQ(other.ripples[0].cosine_Nm, -0.2);
  EXPECT_EQ(again.arm.arm.links[0].inertia.mass_kg, 0.7);
  EXPECT_EQ(again.arm.arm.links[1].inertia.mass_kg, given.arm.arm.links[1].inertia.mass_kg);
  EXPECT_EQ(again.arm.payload_kg, 0.25);
  EXPECT_EQ(again.arm.p_TP_m, changed.arm.p_TP_m);
  EXPECT_EQ(again.arm.gravity_B_m_per_s2, changed.arm.gravity_B_m_per_s2);
}

}  // namespace youbot_gap_robot_test
