// The pages of runs: limits that commands reach, and cycle times.
#include <gtest/gtest.h>

#include <chrono>
#include <string>

#include "hal/clock.h"
#include "operation/run_page.h"
#include "operation/teleop_page.h"
#include "runtime/open_robot.h"

namespace run_pages_test {

using namespace std::chrono_literals;
using operation::TeleopRecord;

bool has(const std::string& html, const std::string& text) { return html.find(text) != std::string::npos; }

TEST(TeleopPage, ListsTheJointsWhoseCommandIsAtTheLimitOfTheControl) {
  hal::VirtualClock clock;
  runtime::RobotOptions options;
  options.ethercat.kind = hal::YoubotKind::kBaseAndArm;
  const runtime::OpenedRobot robot = runtime::open_robot(options, clock, 1ms);
  const auto report = operation::teleop_report({}, *robot.robot);
  TeleopRecord record;
  record.phase = control::TeleopPhase::kOperating;
  record.arm_mode = static_cast<std::uint8_t>(control::TeleopOutput::Arm::kTorque);
  record.command = {2.4, 2.3, 0, 0,  -9.5,
                    9.4, 0,   0, 1.0};  // of the limits 2.4, 9.5 and, for arm joint 5, 1 N·m
  report->add(record);
  const std::string html = report->page({}).html();
  EXPECT_TRUE(has(html, "wheel-1 at its torque limit"));
  EXPECT_FALSE(has(html, "wheel-2 at its torque limit"));
  EXPECT_TRUE(has(html, "arm-1 at its torque limit"));
  EXPECT_FALSE(has(html, "arm-2 at its torque limit"));
  EXPECT_TRUE(has(html, "arm-5 at its torque limit"));
}

TEST(RunPage, ShowsTheCycleTimesOfARealTimeRunOnly) {
  operation::RunPage run(1ms, {});
  for (int i = 0; i < 999; ++i) run.add(i * 1ms, "running", 0, {}, {.wake_up = 10us, .step = 20us});
  run.add(999ms, "running", 0, {}, {.wake_up = 1500us, .step = 2500us});
  operation::RunSummary summary;
  report::Page real("real time");
  run.add_rest(real, summary);
  EXPECT_TRUE(has(real.html(), "1500.0")) << "the worst wake-up in µs";
  EXPECT_TRUE(has(real.html(), "2500.0")) << "the worst step in µs";
  summary.virtual_time = true;
  report::Page fast("virtual time");
  run.add_rest(fast, summary);
  EXPECT_FALSE(has(fast.html(), "2500.0"));
}

}  // namespace run_pages_test
