// The complete system through its real interfaces: youbotctl commands youbotd, which has a haptic device on a
// mocked kernel's USB and a robot on a network interface, with youbot-sim behind it. In real time, on a
// machine that may be busy: a run may end because something was late, and is repeated from the same step on.
// The robot's time advances with the frames, so its motion does not depend on the machine; a pause of the
// daemon's loop does not pause the robot, and other tests cover such pauses.
#include <gtest/gtest.h>
#include <sched.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tests/end_to_end/comparison.h"
#include "tests/end_to_end/daemon.h"
#include "tests/end_to_end/expectations.h"
#include "tests/end_to_end/grip.h"
#include "tests/end_to_end/hand.h"
#include "tests/end_to_end/scenario.h"
#include "tests/support/built_paths.h"
#include "tests/support/held_up.h"
#include "tests/support/mock_usb_device.h"
#include "tests/support/recording.h"
#include "tests/support/skip.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/veth.h"

namespace end_to_end {
namespace teleop_end_to_end_test {

/// Of the recorded hand's way, so that it stays inside the boundary of rate control below.
constexpr double kHandScale = 0.6;
constexpr double kHandUntil_s = 9.0;
constexpr double kStiffness_N_per_m = 700;
constexpr double kForceScale = 10;
constexpr int kToleratedCycles = 2;

/// Tolerant of the machine, and quick through the start-up; the hand reaches the boundary on a Falcon.
const std::string kConfig = R"([loop]
command_timeout_s = 2.0
commander_timeout_s = 5.0
[ethercat]
kind = "base+arm"
home_arms = true
tolerated_cycles = 2
frame_timeout_s = 0.05
[haptic]
speed_limit_m_per_s = 2.0
ramp_in_s = 0.1
stale_after_s = 0.1
command_timeout_s = 0.1
[haptic.falcon]
reply_deadline_s = 0.02
lost_after_misses = 10
[haptic.force_dimension]
library = ")" + support::stand_in_library() +
                            R"("
watchdog_s = 0.0318
[limits]
force_N = 60
moment_Nm = 20
wheel_torque_Nm = 2.4
wheel_speed_rad_per_s = 16
[teleoperation.start]
unfolding_rad_per_s = 1.0
approach_s = 4
feedback_fade_s = 0.2
lowering_s = 1
[teleoperation.coupling]
stiff_N_per_m = 700
stiffening_N_per_m_s = 6000
stiffening_Nm_per_rad_s = 300
[teleoperation.mapping]
boundary_least_x_m = -0.03
[teleoperation.feedback]
force_scale = 10
)";
constexpr const char* kScene = "[[scene.wall]]\npoint_m = [0.75, 0, 0]\nnormal = [-1, 0, 0]\n";
/// The third wheel's board loses its power for half a second. Should a repetition be in its start-up then,
/// there is a second chance.
constexpr const char* kFaults = R"([[fault]]
kind = "slave_off"
slave = 4
at_frame = 42000
duration_s = 0.5
[[fault]]
kind = "slave_off"
slave = 4
at_frame = 90000
duration_s = 0.5
)";

/// The steps of the operator.
void operate(Scenario& scenario, const Daemon& daemon, Hand& hand) {
  const Recording trajectory(support::source_dir() + "/tests/data/hand_trajectory/hand_trajectory.csv");
  const Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  const Eigen::Vector3d at_the_rim(-0.036, 0, 0);
  const Eigen::Vector3d before_the_rim(-0.028, 0, 0);
  scenario.perform("position", [&] {
    hand.follow(trajectory, kHandScale, kHandUntil_s);
    hand.move_to(origin);
    return true;
  });
  scenario.perform("rate", [&] {
    hand.move_to(at_the_rim);
    const json now = daemon.wait_until([](const json& status) {
      return status["enabled"] == false || status["base_W"][0].get<double>() > 0.12;
    });
    hand.move_to(origin);
    return now.value("enabled", false);
  });
  scenario.perform("wall", [&] {
    // Continues at the boundary until the workspace limit stops the end effector.
    hand.move_to(at_the_rim);
    double before_m = -1;
    for (double x_m = 0; x_m - before_m > 0.005;) {
      before_m = x_m;
      if (!daemon.wait_cycles(500)) return false;
      const json now = daemon.status();
      if (!now.contains("tip_p_WT_m") || now["tip_p_WT_m"].is_null()) return false;
      x_m = now["tip_p_WT_m"][0].get<double>();
    }
    // The boundary pushes no more: the hand feels the workspace limit.
    hand.move_to(origin);
    hand.move_to(before_the_rim);
    return daemon.wait_cycles(1000);
  });
  scenario.perform("gripper", [&] {
    hand.move_to(origin);
    hand.press(true);
    return daemon.wait_cycles(4000);
  });
  hand.press(false);
  scenario.meet_power_cycle();
  scenario.perform("again", [&] { return daemon.wait_cycles(300); });
}

/// Power between an enable and the end of its run, and at no other time.
void expect_no_power_without_enable(const Recording& robot, int enables, int runs_that_moved) {
  int intervals = 0;
  for (std::size_t row = 1; row < robot.rows(); ++row)
    if (driven(robot, row) && !driven(robot, row - 1)) ++intervals;
  EXPECT_LE(intervals, enables);
  EXPECT_GE(intervals, runs_that_moved);
  EXPECT_FALSE(driven(robot, robot.rows() - 1));
}

void expect_recorded_what_happened(const Scenario& scenario, const Recording& robot,
                                   const std::filesystem::path& runs_folder, int enables) {
  for (std::size_t row = 0; row < robot.rows(); ++row)
    ASSERT_NEAR(robot["time_s"][row], 0.001 * static_cast<double>(row + 1), 1e-6) << "a row is missing";
  int runs_that_moved = 0;
  std::vector<std::unique_ptr<RecordedRun>> runs;
  for (int n = 1; n <= enables; ++n) {
    SCOPED_TRACE("run " + std::to_string(n));
    runs.push_back(std::make_unique<RecordedRun>(runs_folder / ("run-" + std::to_string(n)), robot));
    const Recording& run = runs.back()->recording;
    EXPECT_TRUE(std::isnan(run["true_tip_x_m"][0])) << "which only the simulator knows";
    expect_phases_in_order(run);
    expect_continuous(run);
    if (phases(run).size() < 3) continue;  // held up by this machine before it moved
    ++runs_that_moved;
    const std::vector<TeleopPhase> seen = phases(run);
    if (std::ranges::count(seen, TeleopPhase::kOperating) == 0) continue;  // held up before it did much
    ASSERT_TRUE(runs.back()->comparison.aligned()) << "the simulator has seen nothing of this run";
    expect_same(runs.back()->comparison, run.rows());
    expect_stopped_when_power_was_lost(*runs.back(), kToleratedCycles);
  }
  expect_no_power_without_enable(robot, enables, runs_that_moved);

  const auto part = [&](const std::string& name) {
    const Window& window = scenario.windows.at(name);
    return Part{*runs.at(static_cast<std::size_t>(window.run - 1)), robot, window};
  };
  expect_tip_follows_hand(part("position"));
  expect_base_drives(part("rate"));
  expect_wall_is_felt(part("wall"), kStiffness_N_per_m, kForceScale);
  expect_gripper_closes(part("gripper"));
}

/// Nothing was wrong but that something came too late again and again.
bool held_up = false;

struct TeleopEndToEnd : testing::Test {
  void SetUp() override {
    SKIP_UNLESS(support::in_mock_kernel(), "needs umockdev's library loaded first");
    SKIP_UNLESS(namespaces.usable(), "needs root and network namespaces");
    // Robot and hand are separate from this machine's programs: they have priority over builds and tests.
    const sched_param first{.sched_priority = 20};
    (void)sched_setscheduler(0, SCHED_FIFO, &first);
    bus = std::make_unique<support::MockUsbBus>();
  }
  void TearDown() override {
    const sched_param usual{.sched_priority = 0};
    (void)sched_setscheduler(0, SCHED_OTHER, &usual);
  }

  /// `ready`: the steps with the haptic device before it can be used.
  void run(const std::string& haptic, Grip& grip, const std::function<void()>& ready) {
    const std::filesystem::path robot_file = folder / "robot.csv";
    // Its kernel is not mocked.
    auto simulator = std::make_unique<support::Server>(
        namespaces,
        "env -u LD_PRELOAD " + support::program("youbot-sim") +
            " --interface veth-s --robot base+arm --lock-step --scene " +
            folder.write("scene.toml", kScene).string() + " --faults " +
            folder.write("faults.toml", kFaults).string() + " --record " + robot_file.string(),
        "serving");
    ASSERT_TRUE(simulator->ready());
    Hand hand(grip);
    Daemon daemon(folder.path(), folder.write("teleop.toml", kConfig),
                  {"--robot", "ethercat:veth-c", "--haptic", haptic});
    ASSERT_TRUE(daemon.process().wait_for("waiting for commands")) << daemon.process().finish().output;
    ready();

    Scenario scenario(daemon, hand);
    operate(scenario, daemon, hand);
    if (scenario.held_up()) {
      held_up = !HasFailure();
      FAIL() << "something came too late more than " << kMaxRepetitions << " times";
    }
    EXPECT_TRUE(scenario.power_cycled_in_operation);
    if (!scenario.broken()) {
      EXPECT_EQ(daemon.tell({"stop"}).exit_code, 0);
      const support::CommandResult commander = daemon.commander_ended();
      EXPECT_EQ(commander.exit_code, 0) << commander.output;
      for (const char* state : {"centring", "unfolding", "approaching", "operating", "lowering", "off"})
        EXPECT_TRUE(commander.said(state)) << commander.output;
    }
    daemon.process().signal(SIGTERM);
    const support::CommandResult ended = daemon.process().finish();
    ASSERT_FALSE(scenario.broken()) << ended.output;
    EXPECT_EQ(ended.exit_code, 0) << ended.output;
    EXPECT_FALSE(ended.said("recording:")) << "not all was recorded: " << ended.output;
    simulator.reset();
    expect_recorded_what_happened(scenario, Recording(robot_file), folder / "runs", daemon.enables());
  }

  const support::Namespaces namespaces;
  const support::TemporaryDirectory folder;
  std::unique_ptr<support::MockUsbBus> bus;
};

TEST_F(TeleopEndToEnd, AHandOnAFalconMovesTheRobotThroughARecordedWayTheRimAWallAndALossOfPower) {
  FalconGrip grip(*bus);
  run("falcon", grip, [&] { grip.pull_and_push(); });
}

TEST_F(TeleopEndToEnd, AHandOnAnOmegaMovesTheRobotThroughARecordedWayTheRimAWallAndALossOfPower) {
  OmegaGrip grip(*bus, folder / "hand");
  run("force-dimension", grip, [] {});
}

}  // namespace teleop_end_to_end_test
}  // namespace end_to_end

int main(int count, char** arguments) {
  testing::InitGoogleTest(&count, arguments);
  const int result = RUN_ALL_TESTS();
  return end_to_end::teleop_end_to_end_test::held_up ? support::kHeldUp : result;
}
