// A module on CAN whose encoder lies: the same monitor judges it, with the module's Hall sensors.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include "runtime/monitored_robot.h"
#include "tests/hal/can_bench.h"

namespace lying_module_test {

using namespace std::chrono_literals;

/// A module in velocity mode with an encoder that stops counting speeds up without end.
TEST(LyingModule, AnEncoderThatStandsStillIsNamedInTimeAndByTheHallSensorsAlone) {
  using control::PlausibilityCheck;
  for (const auto& [only, within] :
       {std::pair<std::optional<PlausibilityCheck>, std::chrono::milliseconds>{std::nullopt, 60ms},
        {PlausibilityCheck::kHallAgreement, 100ms}}) {
    SCOPED_TRACE(only.has_value());
    control::ChecksOff off;
    for (std::size_t i = 0; i < control::kPlausibilityCheckNames.size(); ++i)
      if (only && static_cast<PlausibilityCheck>(i) != *only) off.add(static_cast<PlausibilityCheck>(i));
    hal::test::CanBench bench;
    runtime::MonitoredRobot robot(*bench.robot, control::PlausibilityMonitor::Wheels::kFree, off);
    robot.activate();
    hal::CycleStatus status;
    const auto step = [&](double velocity_rad_per_s) {
      bench.clock.sleep_until(bench.clock.now() + 1ms);
      bench.command.joints[0] = hal::JointCommand::velocity_rad_per_s(velocity_rad_per_s);
      status = robot.exchange(bench.command, bench.sample);
      bench.cable.wait(1ms);
    };
    bench.command.enable = true;
    for (int i = 0; i < 5000 && !bench.sample.enabled; ++i) step(0);
    for (int i = 0; i < 2000; ++i) step(0.8);
    ASSERT_TRUE(status.ok()) << describe_can(status);
    const double begin_rad = bench.rig.joint().position_rad();
    bench.rig.board().fault(sim::bus::BoardFault::kStuckEncoder, true);
    auto passed = 0ms;
    for (; passed < 500ms && status.ok(); passed += 1ms) step(0.8);
    ASSERT_EQ(status.fault, hal::Fault::kJointFault);
    EXPECT_EQ(status.joint, 0);
    if (only) {
      EXPECT_EQ(status.joint_fault(), hal::JointFault::kHallDisagrees);
    }
    EXPECT_LE(passed, within);
    EXPECT_LT(std::abs(bench.rig.joint().position_rad() - begin_rad), 0.2);
    robot.deactivate();
  }
}

}  // namespace lying_module_test
