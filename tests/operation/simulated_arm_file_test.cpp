// [simulation] robot_file: the simulated arm of loopback and wire weighs what the file says.
#include <gtest/gtest.h>

#include <string>

#include "operation/config.h"
#include "runtime/open_robot.h"
#include "tests/support/held_arm.h"
#include "tests/support/temporary_directory.h"

namespace operation::simulated_arm_file_test {

using namespace std::chrono_literals;

class SimulatedArmFile : public testing::TestWithParam<const char*> {};
std::string name_of(const testing::TestParamInfo<const char*>& robot) { return robot.param; }
INSTANTIATE_TEST_SUITE_P(Robots, SimulatedArmFile, testing::Values("loopback", "wire"), name_of);

TEST_P(SimulatedArmFile, TheDrivesHoldItsWeight) {
  const support::TemporaryDirectory folder;
  support::write_loaded_arm(folder);
  const Config config =
      load_config(folder.write("lab.toml", std::string("robot = \"") + GetParam() +
                                               "\"\n[ethercat]\nkind = \"base+arm\"\n[simulation]\n"
                                               "robot_file = \"arm.toml\"\n"));
  hal::VirtualClock clock;
  const runtime::OpenedRobot opened = runtime::open_robot(config.robot, clock, 1ms);
  const control::ArmVector torque_Nm = support::holding_torque_Nm(*opened.robot, clock);
  support::expect_loaded_arm_held(torque_Nm, opened.manipulator->arm_rad());
  opened.robot->deactivate();
}

}  // namespace operation::simulated_arm_file_test
