// The arm of youbot-sim --robot-file, held by a master on the other end of a network cable.
#include <gtest/gtest.h>

#include <chrono>
#include <cstddef>
#include <string>

#include "hal/clock.h"
#include "runtime/open_robot.h"
#include "tests/support/held_arm.h"
#include "tests/support/recording.h"
#include "tests/support/skip.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/veth.h"

namespace simulated_arm_over_veth_test {

using namespace std::chrono_literals;

TEST(SimulatedArmOverVeth, TheDrivesHoldTheWeightOfItsRobotFile) {
  const support::Namespaces namespaces;
  SKIP_UNLESS(namespaces.usable(), "needs root and network namespaces");
  const support::TemporaryDirectory folder;
  control::ArmVector torque_Nm;
  {
    const support::Simulator simulator(namespaces, "--robot base+arm --lock-step --robot-file " +
                                                       support::write_loaded_arm(folder).string() +
                                                       " --record " + (folder / "robot.csv").string());
    ASSERT_TRUE(simulator.ready());
    runtime::RobotOptions options;
    options.name = "ethercat:veth-c";
    options.ethercat.kind = hal::YoubotKind::kBaseAndArm;
    hal::VirtualClock clock;
    const runtime::OpenedRobot opened = runtime::open_robot(options, clock, 1ms);
    torque_Nm = support::holding_torque_Nm(*opened.robot, clock);
    opened.robot->deactivate();
  }  // which ends the recording
  const support::Recording robot(folder / "robot.csv");
  std::size_t held = robot.rows();
  while (held > 0 && robot["arm_2_mode"][held - 1] < 0) --held;  // without power the arm sinks
  ASSERT_GT(held, 0U);
  control::ArmVector arm_rad;
  for (Eigen::Index i = 0; i < arm_rad.size(); ++i)
    arm_rad[i] = robot["arm_" + std::to_string(i + 1) + "_position_rad"][held - 1];
  support::expect_loaded_arm_held(torque_Nm, arm_rad);
}

}  // namespace simulated_arm_over_veth_test
