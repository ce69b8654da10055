// The command youbot-gap export of a robot file: files, account, residuals, and what it refuses.
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "control/serial_arm.h"
#include "tests/support/built_paths.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_directory.h"

namespace youbot_gap_robot_export_test {

namespace fs = std::filesystem;

class RobotExport : public testing::Test {
 protected:
  RobotExport() {
    fs::copy(data_ / "arm.urdf", directory_ / "arm.urdf");
    std::ifstream given(data_ / "robot.toml");
    const std::string text{std::istreambuf_iterator<char>(given), std::istreambuf_iterator<char>()};
    // The last drive is the elbow's.
    model_ = directory_.write("robot.toml", text + "coulomb_Nm = 0.16\nload_friction = 0.05\n").string();
  }
  static std::string read(const fs::path& path) {
    std::ifstream file(path);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  }
  support::CommandResult run(const std::string& format, const std::string& arguments = {}) {
    return support::run_command(support::program("youbot-gap") + " export " + format + " " + model_ +
                                " --out " + out().string() + " " + arguments);
  }
  void expect_refused(const std::string& format, const std::string& arguments, const std::string& text) {
    const support::CommandResult result = run(format, arguments);
    EXPECT_EQ(result.exit_code, 2) << result.output;
    EXPECT_TRUE(result.said(text)) << result.output << "lacks: " << text;
    EXPECT_FALSE(fs::exists(out()));
  }
  fs::path out() const { return directory_ / "out"; }
  std::string recording() const { return "--data " + (data_ / "A_fast_1.csv").string(); }

  const fs::path data_ = fs::path(support::source_dir()) / "tests/data/two_link_arm";
  support::TemporaryDirectory directory_;
  std::string model_;
};

TEST_F(RobotExport, WritesTwoFilesForMujocoWithWhatEachLosesAndWhatThatCosts) {
  const support::CommandResult result = run("mujoco", recording());
  ASSERT_EQ(result.exit_code, 0) << result.output;
  for (const char* const file : {"robot.xml", "robot_plain.xml"}) {
    const std::string text = read(out() / file);
    for (const char* const part :
         {"elbow coulomb: joint frictionloss", "elbow load_friction: Coulomb friction of",
          "armature=\"0.00276\"", "motor name=\"shoulder\""})
      EXPECT_NE(text.find(part), std::string::npos) << file << " lacks " << part;
  }
  EXPECT_TRUE(result.said("at the mean load of the recordings")) << result.output;
  EXPECT_FALSE(result.said("load_friction: not carried")) << result.output;
  EXPECT_TRUE(result.said("with what MuJoCo holds of it")) << result.output;
}

TEST_F(RobotExport, FrictionOfAJointThatStandsStillIsStraightenedAsWithoutRecordings) {
  std::ofstream(model_, std::ios::app) << "quadratic_drag_Nm_s2_per_rad2 = 0.01\nstribeck_Nm = 0.1\n";
  std::ifstream given(data_ / "A_fast_1.csv");
  std::string still;
  for (std::string line; std::getline(given, line);) {
    const std::size_t q2 = line.find(',', line.find(',') + 1) + 1;
    if (line.starts_with("t_s"))
      still += line + '\n';
    else
      still += line.substr(0, q2) + '0' + line.substr(line.find(',', q2)) + '\n';
  }
  const std::string data = "--data " + directory_.write("still.csv", still).string();
  for (const char* const format : {"mujoco", "urdf"}) {
    const support::CommandResult result = run(format, data + " --quiet");
    ASSERT_EQ(result.exit_code, 0) << result.output;
  }
  const std::string plain = read(out() / "robot_plain.xml");
  EXPECT_EQ(plain.find("<dcmotor"), std::string::npos) << plain;
  // The nearest straight line to 0.16 + 0.1 exp(-(v/0.1)²) + 0.01 v² has a slope.
  const std::regex damping(R"re(damping="([^"]*)")re");
  for (const char* const file : {"robot_plain.xml", "robot.urdf"}) {
    const std::string text = read(out() / file);
    double largest = 0;
    for (std::sregex_iterator at(text.begin(), text.end(), damping), end; at != end; ++at) {
      EXPECT_EQ((*at)[1].str().find(' '), std::string::npos) << file << ": a polynomial";
      largest = std::max(largest, std::stod((*at)[1]));
    }
    EXPECT_GT(largest, 0.01) << file;
  }
}

TEST_F(RobotExport, TheGapOfWhatMujocoHoldsIsThatOfTheSofterSpringAndTheAddedRotor) {
  // A spring as stiff as a rigid gear, which the time step does not allow; and no rotor.
  std::string text = read(model_);
  text =
      text.substr(0, text.rfind("rotor_inertia_kg_m2")) + "compliance_rad_per_Nm = 1e-7\ncoulomb_Nm = 0.16\n";
  std::ofstream(model_) << text;
  const support::CommandResult result = run("mujoco", recording() + " --timestep 0.002");
  ASSERT_EQ(result.exit_code, 0) << result.output;
  std::smatch account;
  ASSERT_TRUE(std::regex_search(
      result.output, account,
      std::regex("elbow elasticity: (\\S+) N·m/rad in place of 1e\\+07.*a rotor of (\\S+) kg·m²")))
      << result.output;
  std::smatch gap;
  const std::regex gaps(R"((\S+) N·m with the model, (\S+) with what MuJoCo holds of it)");
  ASSERT_TRUE(std::regex_search(result.output, gap, gaps)) << result.output;
  // The same arm with that spring and that rotor from the start.
  std::ofstream(model_) << std::regex_replace(
      text, std::regex("compliance_rad_per_Nm = 1e-7"),
      fmt::format("compliance_rad_per_Nm = {}\nrotor_inertia_kg_m2 = {}", 1 / std::stod(account[1]),
                  account[2].str()));
  fs::remove_all(out());
  const support::CommandResult same = run("mujoco", recording() + " --timestep 0.002");
  std::smatch its_gap;
  ASSERT_TRUE(std::regex_search(same.output, its_gap, gaps)) << same.output;
  EXPECT_NEAR(std::stod(gap[2]), std::stod(its_gap[1]), 2e-3 * std::stod(gap[2]));
  EXPECT_NE(gap[1].str(), gap[2].str());
}

TEST_F(RobotExport, TheSpringOfASlidingJointHasItsUnits) {
  const fs::path urdf = directory_ / "arm.urdf";
  const std::string sliding = std::regex_replace(
      read(urdf), std::regex(R"re(name="elbow" type="continuous">)re"),
      R"re(name="elbow" type="prismatic"><limit lower="0" upper="1" effort="9" velocity="9"/>)re");
  std::ofstream(urdf) << sliding;
  const std::string text = read(model_);
  std::ofstream(model_) << text.substr(0, text.rfind("rotor_inertia_kg_m2"))
                        << "compliance_rad_per_Nm = 1e-3\n";
  const support::CommandResult result = run("mujoco");
  ASSERT_EQ(result.exit_code, 0) << result.output;
  EXPECT_TRUE(std::regex_search(
      result.output, std::regex("elbow elasticity: \\S+ N/m; damping of our choice: \\S+ N·s/m; .* a "
                                "rotor of \\S+ kg is added")))
      << result.output;
}

TEST_F(RobotExport, WritesAUrdfThatItsOwnReaderReads) {
  const support::CommandResult result = run("urdf");
  ASSERT_EQ(result.exit_code, 0) << result.output;
  EXPECT_TRUE(result.said("shoulder rotor_inertia: inertia of the link about the axis; lost:"))
      << result.output;
  EXPECT_TRUE(result.said("no recordings were given")) << result.output;
  const control::SerialArm arm = control::read_serial_arm(read(out() / "robot.urdf"), "base", "tip");
  ASSERT_EQ(arm.links.size(), 2U);
  EXPECT_NEAR(arm.links[1].inertia.about_C_kg_m2(1, 1), 0.0035 + 0.00276, 1e-9);
}

TEST_F(RobotExport, SaysThatABaseNamedWorldIsRenamedForMujoco) {
  for (const fs::path& path : {directory_ / "arm.urdf", fs::path(model_)}) {
    const std::string renamed = std::regex_replace(read(path), std::regex("\"base\""), "\"world\"");
    std::ofstream(path) << renamed;
  }
  const support::CommandResult result = run("mujoco");
  ASSERT_EQ(result.exit_code, 0) << result.output;
  EXPECT_TRUE(result.said("base: its body is named world_")) << result.output;
  EXPECT_NE(read(out() / "robot.xml").find(R"(<body name="world_">)"), std::string::npos);
  EXPECT_FALSE(run("urdf").said("world_"));
}

TEST_F(RobotExport, TheResidualHasTheGapThatIsPrinted) {
  const support::CommandResult result = run("residual", recording());
  ASSERT_EQ(result.exit_code, 0) << result.output;
  std::ifstream file(out() / "A_fast_1.csv");
  std::string line;
  while (std::getline(file, line) && line.starts_with("#")) continue;
  std::vector<std::string> names;
  std::istringstream head(line);
  for (std::string name; std::getline(head, name, ',');) names.push_back(name);
  double squares = 0;
  double rows = 0;
  while (std::getline(file, line)) {
    std::map<std::string, double> row;
    std::istringstream cells(line);
    std::string cell;
    for (const std::string& name : names) {
      std::getline(cells, cell, ',');
      row[name] = std::stod(cell);
    }
    for (const char* const joint : {"joint_1", "joint_2"}) {
      const std::string of = joint;
      const double left = row.at(of + "_torque_residual_Nm");
      EXPECT_NEAR(left, row.at(of + "_torque_Nm") - row.at(of + "_torque_predicted_Nm"), 1e-9);
      if (row.at(of + "_moving") == 0) continue;
      squares += left * left;
      ++rows;
    }
  }
  ASSERT_GT(rows, 100);
  char gap[64];
  std::snprintf(gap, sizeof gap, "gap on the recordings: %.4g N·m", std::sqrt(squares / rows));
  EXPECT_TRUE(result.said(gap)) << result.output << gap;
}

TEST_F(RobotExport, RefusesWhatARobotFileDoesNotNeed) {
  expect_refused("mujoco", recording() + " --joint wheel_1", "--joint is for a drive model");
  const std::string map = directory_.write("map.toml", "").string();
  expect_refused("mujoco", recording() + " --columns " + map, "--columns is for a drive model");
  expect_refused("residual", "", "export residual needs recordings");
}

TEST_F(RobotExport, RefusesABaseWithTheReasonAndABadRobotFileWithItsLines) {
  model_ = (fs::path(support::source_dir()) / "tests/data/diff_drive_base/robot.toml").string();
  expect_refused("mujoco", "", "describes a base");
  model_ =
      directory_
          .write("bad.toml",
                 "format = \"youbot-robot-model/1\"\nurdf = \"none.urdf\"\nbase = \"base\"\ntip = \"tip\"\n")
          .string();
  expect_refused("urdf", "", "bad.toml:2:");
  model_ = directory_.write("later.toml", "format = \"youbot-robot-model/2\"\n").string();
  expect_refused("urdf", "", "this program reads 'youbot-robot-model/1'");
}

}  // namespace youbot_gap_robot_export_test
