// [simulation] robot_file: the simulated arm of loopback and wire weighs what the file says.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "control/robot_model.h"
#include "operation/config.h"
#include "runtime/open_robot.h"
#include "tests/support/built_paths.h"
#include "tests/support/temporary_directory.h"

namespace operation::simulated_arm_file_test {

using namespace std::chrono_literals;
using control::ArmVector;
using control::kArmJoints;
using control::kBaseAxes;

/// control/youbot_arm.toml without friction, which would carry a part of the weight, and with 1 kg in the
/// hand.
Config configuration(const support::TemporaryDirectory& folder, const std::string& robot) {
  const std::filesystem::path control = std::filesystem::path(support::source_dir()) / "control";
  std::filesystem::copy_file(control / "youbot.urdf", folder / "youbot.urdf");
  std::ifstream shipped(control / "youbot_arm.toml");
  std::string arm;
  for (std::string line; std::getline(shipped, line);)
    arm += line.substr(0, line.starts_with("coulomb_Nm") ? 0 : std::string::npos) + "\n";
  folder.write("arm.toml", arm + "[payload]\nmass_kg = 1\n");
  return load_config(folder.write("lab.toml", "robot = \"" + robot +
                                                  "\"\n[ethercat]\nkind = \"base+arm\"\n[simulation]\n"
                                                  "robot_file = \"arm.toml\"\n"));
}

ArmVector weight_Nm(const control::ModelChanges& changes, const ArmVector& arm_rad) {
  control::RobotModel model(changes);
  model.update((control::ChainVector() << 0, 0, 0, arm_rad).finished());
  return model.gravity_Nm().tail<kArmJoints>();
}

class SimulatedArmFile : public testing::TestWithParam<const char*> {};
std::string name_of(const testing::TestParamInfo<const char*>& robot) { return robot.param; }
INSTANTIATE_TEST_SUITE_P(Robots, SimulatedArmFile, testing::Values("loopback", "wire"), name_of);

TEST_P(SimulatedArmFile, TheDrivesHoldItsWeight) {
  const support::TemporaryDirectory folder;
  const Config config = configuration(folder, GetParam());
  hal::VirtualClock clock;
  const runtime::OpenedRobot opened = runtime::open_robot(config.robot, clock, 1ms);
  hal::RobotCommand command;
  hal::RobotSample sample;
  opened.robot->activate();
  const auto step = [&](double velocity_rad_per_s) {
    clock.sleep_until(clock.now() + 1ms);
    command.joints.fill(hal::JointCommand::velocity_rad_per_s(0));
    for (std::size_t i = 4; i < 9; ++i)  // joint 3 is folded at the other end of its range
      command.joints[i].target = i == 6 ? -velocity_rad_per_s : velocity_rad_per_s;
    ASSERT_TRUE(opened.robot->exchange(command, sample).ok());
  };
  command.enable = true;
  for (int i = 0; i < 20'000 && !sample.enabled; ++i) step(0);
  ASSERT_TRUE(sample.enabled);
  for (int i = 0; i < 2000; ++i) step(0.4);
  for (int i = 0; i < 1000; ++i) step(0);
  constexpr int kMean = 200;
  ArmVector torque_Nm = ArmVector::Zero();
  for (int i = 0; i < kMean; ++i) {
    step(0);
    for (int joint = 0; joint < kArmJoints; ++joint)
      torque_Nm[joint] += sample.joints[static_cast<std::size_t>(4 + joint)].torque_Nm / kMean;
  }
  opened.robot->deactivate();
  control::ModelChanges payload;
  payload.payload_kg = 1;
  const ArmVector arm_rad = opened.manipulator->arm_rad();
  const ArmVector needed_Nm = weight_Nm(payload, arm_rad);
  EXPECT_GT((needed_Nm - weight_Nm({}, arm_rad)).cwiseAbs().maxCoeff(), 1.5) << "of the payload";
  EXPECT_LT((torque_Nm - needed_Nm).cwiseAbs().maxCoeff(), 0.2)
      << torque_Nm.transpose() << "\nnot " << needed_Nm.transpose();
}

}  // namespace operation::simulated_arm_file_test
