// Reports of the EtherCAT robot during its cycles; also run under the thread sanitizer.
#include <gtest/gtest.h>

#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "tests/hal/ethercat_rig.h"

namespace hal::test {
namespace robot_report_test {

using Lines = std::vector<std::string>;

std::string text_of(const Lines& lines) { return ::testing::PrintToString(lines); }

TEST(RobotReport, ReportsAMissingSlaveWhileItIsMissingAndAfterwards) {
  EthercatRig rig;
  EXPECT_EQ(rig.robot->device_faults(), Lines{}) << "before activate()";
  rig.robot->activate();
  (void)rig.step();
  EXPECT_EQ(rig.robot->device_faults(), Lines{}) << "on its way to OP for the first time";
  rig.enable();
  EXPECT_EQ(rig.robot->device_faults(), Lines{});

  rig.emulation.bus().set_power(4, false);
  rig.run_until([&] { return rig.status.fault == Fault::kPartialBus; });
  ASSERT_EQ(rig.status.fault, Fault::kPartialBus);
  const Lines lost{"slave 5 (TMCM-1632): does not answer: check its power and the cable before it"};
  EXPECT_EQ(rig.robot->device_faults(), lost);
  EXPECT_EQ(rig.robot->device_faults(), lost) << "asked again without a cycle in between";
  EXPECT_NE(text_of(rig.robot->report()).find(lost[0]), std::string::npos) << text_of(rig.robot->report());

  rig.emulation.bus().set_power(4, true);
  rig.command.enable = false;
  rig.run_until([&] { return rig.status.ok(); });
  EXPECT_EQ(rig.robot->device_faults(), Lines{});
  EXPECT_NE(text_of(rig.robot->report()).find("slave 5 (TMCM-1632): left operation once"), std::string::npos);
}

TEST(RobotReport, IsTakenByAnotherThreadBesideTheCycle) {
  EthercatRig rig;
  rig.robot->activate();
  std::atomic<bool> over{false};
  std::thread cycles([&] {
    for (int i = 0; i < 2000; ++i) {
      if (i == 500) rig.emulation.bus().set_power(4, false);
      (void)rig.step();
    }
    over = true;
  });
  do {
    EXPECT_LE(rig.robot->device_faults().size(), 1U);
    EXPECT_FALSE(rig.robot->report().empty());
  } while (!over);
  cycles.join();
  EXPECT_EQ(rig.robot->device_faults().size(), 1U);
}

}  // namespace robot_report_test
}  // namespace hal::test
