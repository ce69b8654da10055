// Faults in teleoperation: haptic device, bus, loop. In virtual time.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "hal/clock.h"
#include "operation/teleop_run.h"
#include "tests/operation/teleop_expectations.h"
#include "tests/operation/teleop_rig.h"
#include "tests/support/turning_robot.h"
#include "tests/support/watched_robot.h"

namespace teleoperation_faults_test {

using namespace std::chrono_literals;
using control::TeleopEnd;
using control::TeleopPhase;
using teleop_rig::expect_no_jump;
using teleop_rig::expect_passive;
using teleop_rig::Rig;
using teleop_rig::Scene;
using teleop_rig::TeleopCycle;
using teleop_rig::TeleopRecord;
using teleop_rig::vector;

/// Of a master that can be unplugged.
class Cable final : public hal::HapticLink {
 public:
  explicit Cable(std::unique_ptr<hal::HapticLink> link) : link_(std::move(link)) {}
  const hal::HapticInfo& info() const noexcept override { return link_->info(); }
  void open() override { link_->open(); }
  bool close() noexcept override { return link_->close(); }
  hal::HapticStatus exchange(const hal::HapticCommand& command, std::chrono::nanoseconds now,
                             hal::HapticSample& sample) noexcept override {
    if (!ready) return {.fault = hal::HapticFault::kNotReady};
    if (plugged) return link_->exchange(command, now, sample);
    return {.fault = hal::HapticFault::kUnplugged};
  }
  bool plugged = true;
  bool ready = true;

 private:
  std::unique_ptr<hal::HapticLink> link_;
};

/// A robot whose bus can break.
class BreakableRobot final : public hal::RobotWrapper {
 public:
  using RobotWrapper::RobotWrapper;
  hal::CycleStatus exchange(const hal::RobotCommand& command, hal::RobotSample& sample) noexcept override {
    last_command = command;
    if (!broken) return RobotWrapper::exchange(command, sample);
    sample.enabled = false;
    return {.fault = hal::Fault::kPartialBus, .joint = 6};
  }
  bool broken = false;
  hal::RobotCommand last_command;
};

/// Rig with both.
struct Breakable {
  hal::VirtualClock clock;
  Scene scene = teleop_rig::unfolded_scene();
  sim::MobileManipulator plant{scene.robot, scene.environment};
  sim::Hand hand{scene.hand};
  support::WatchedLoopback whole{plant, clock, teleop_rig::kPeriod, teleop_rig::joints()};
  BreakableRobot robot{whole};
  Cable* cable = new Cable(std::make_unique<hal::LoopbackHapticLink>(
      hand, teleop_rig::kPeriod,
      hal::HapticInfo{.name = "pen", .force_limit_N = 8.0, .senses_rotation = true}));  // the master owns it
  hal::LockstepHapticDevice master{std::unique_ptr<hal::HapticLink>(cable), clock};
  operation::TeleopCycle cycle{teleop_rig::quick_config(), robot, master};

  Breakable() {
    whole.watch.allow_enables(1);
    robot.activate();
    master.activate();
  }
  void run(std::chrono::milliseconds duration) {
    for (std::chrono::milliseconds t{}; t < duration; t += teleop_rig::kPeriod) {
      clock.sleep_until(clock.now() + teleop_rig::kPeriod);
      cycle.step(clock.now());
    }
  }
  bool operate() {
    for (int n = 0; n < 40 && cycle.task().phase() != TeleopPhase::kOperating; ++n) run(1s);
    return cycle.task().phase() == TeleopPhase::kOperating;
  }
};

TEST(TeleoperationFaults, AnUnpluggedMasterBrakesTheRobotAndHoldsTheArm) {
  Breakable rig;
  ASSERT_TRUE(rig.operate());
  rig.hand.move_to({-0.055, 0, 0}, 500ms);
  rig.run(3s);
  ASSERT_GT(rig.plant.twist()[0], 0.05) << "it drives";
  rig.cable->plugged = false;
  rig.run(5ms);
  EXPECT_EQ(rig.cycle.task().phase(), TeleopPhase::kStopping);
  EXPECT_TRUE(rig.robot.last_command.enable) << "the base is braked, the arm held";
  for (int i = 4; i < 9; ++i)
    EXPECT_EQ(rig.robot.last_command.joints[static_cast<std::size_t>(i)].mode, hal::CommandMode::kPosition);
  const double z_m = rig.plant.X_WT().translation().z();
  for (int n = 0; n < 2000 && rig.cycle.task().phase() == TeleopPhase::kStopping; ++n) rig.run(1ms);
  EXPECT_EQ(rig.cycle.task().phase(), TeleopPhase::kLowering);
  EXPECT_LT(rig.plant.twist().norm(), 0.02);
  EXPECT_NEAR(rig.plant.X_WT().translation().z(), z_m, 0.02);
  // Without power it would fall; so it sinks.
  double fastest_rad_per_s = 0;
  for (int n = 0; n < 12000 && !rig.cycle.finished(); ++n) {
    rig.run(1ms);
    fastest_rad_per_s = std::max(fastest_rad_per_s, rig.plant.velocity().tail<5>().cwiseAbs().maxCoeff());
  }
  EXPECT_LT(fastest_rad_per_s, 1.2);
  EXPECT_TRUE(rig.cycle.finished());
  EXPECT_FALSE(rig.robot.last_command.enable);
  rig.run(1s);
  EXPECT_LT(rig.plant.velocity().tail<5>().norm(), 0.05) << "nothing is left to fall";
  EXPECT_EQ(rig.cycle.task().end(), TeleopEnd::kMasterFault);
  EXPECT_NE(describe(rig.cycle.stop_reason(), rig.robot, &rig.master).find("unplugged"), std::string::npos)
      << describe(rig.cycle.stop_reason(), rig.robot, &rig.master);
  // Plugged in again, nothing moves by itself.
  rig.cable->plugged = true;
  rig.run(500ms);
  EXPECT_FALSE(rig.robot.last_command.enable);
}

TEST(TeleoperationFaults, ALostSlaveSwitchesTheDrivesAndTheForceOffAtOnce) {
  Breakable rig;
  ASSERT_TRUE(rig.operate());
  rig.hand.move_to({-0.03, 0.03, 0}, 500ms);
  rig.run(250ms);
  ASSERT_GT(rig.hand.device_force_N().norm(), 0.1);
  rig.robot.broken = true;
  rig.run(2ms);
  EXPECT_EQ(rig.cycle.task().phase(), TeleopPhase::kFaulted);
  EXPECT_FALSE(rig.robot.last_command.enable);
  EXPECT_EQ(rig.hand.device_force_N().norm(), 0);
  EXPECT_NE(describe(rig.cycle.stop_reason(), rig.robot, &rig.master).find("arm-3"), std::string::npos)
      << describe(rig.cycle.stop_reason(), rig.robot, &rig.master);
  rig.robot.broken = false;
  rig.run(500ms);
  EXPECT_TRUE(rig.cycle.finished());
  EXPECT_FALSE(rig.robot.last_command.enable);
}

TEST(TeleoperationFaults, AStartAfterAFaultBeginsAtTheBeginning) {
  control::Teleoperation teleoperation(teleop_rig::quick_config().control);
  control::TeleopInput input;
  input.drives_obey = input.master_ready = input.grip_fresh = true;
  input.arm_position_rad = (control::ArmVector() << 2.9, 1.1, -2.5, 1.75, 2.9).finished();
  teleoperation.request_start();
  for (int n = 0; n < 300; ++n) (void)teleoperation.step(input);
  ASSERT_EQ(teleoperation.phase(), TeleopPhase::kUnfolding);
  input.robot_fault = true;
  EXPECT_FALSE(teleoperation.step(input).enable_drives);
  input.robot_fault = false;
  EXPECT_EQ(teleoperation.step(input).phase, TeleopPhase::kFaulted);
  EXPECT_TRUE(teleoperation.finished());
  teleoperation.request_start();
  EXPECT_EQ(teleoperation.step(input).phase, TeleopPhase::kCentring);
}

TEST(TeleoperationFaults, ALoopThatStoppedBrakesLowersTheArmAndSwitchesOff) {
  Rig rig;
  ASSERT_TRUE(rig.run_until(TeleopPhase::kOperating));
  rig.hand.move_to({-0.055, 0, 0}, 500ms);
  rig.run(3s);
  ASSERT_GT(rig.plant.twist()[0], 0.05);
  rig.clock.sleep_until(rig.clock.now() + 300ms);
  rig.run(15s);
  EXPECT_TRUE(rig.cycle.finished());
  EXPECT_EQ(rig.cycle.task().end(), TeleopEnd::kStalled);
  std::vector<TeleopPhase> order;
  for (const TeleopRecord& r : rig.records)
    if (order.empty() || order.back() != r.phase) order.push_back(r.phase);
  ASSERT_GE(order.size(), 3U);
  EXPECT_EQ(std::vector(order.end() - 3, order.end()),
            (std::vector{TeleopPhase::kStopping, TeleopPhase::kLowering, TeleopPhase::kOff}));
  expect_passive(rig);
}

/// Base and arm move, the fastest joint at half of its limit.
struct MovingRig : Rig {
  explicit MovingRig(const hal::HapticLimits& limits) : Rig(config(), teleop_rig::unfolded_scene(), limits) {
    moving = run_until(TeleopPhase::kOperating);
    run(500ms);
    hand.move_to({-0.02, 0.07, 0.05}, 400ms);
    run(300ms);
  }
  static operation::TeleopCycle::Config config() {
    auto config = teleop_rig::quick_config();
    config.control.joint_speed_limit_rad_per_s = 1.2;
    return config;
  }
  double fastest_rad_per_s() const { return plant.velocity().tail<5>().cwiseAbs().maxCoeff(); }
  void pause(std::chrono::nanoseconds duration) { clock.sleep_until(clock.now() + duration); }
  /// With the motion, which the end effector has followed.
  void expect_goes_on() const {
    EXPECT_EQ(cycle.task().phase(), TeleopPhase::kOperating) << describe(cycle.stop_reason(), robot, &master);
    EXPECT_LT((vector(last().true_tip_p_WT_m) - vector(last().setpoint_p_WT_m)).norm(), 0.02);
    expect_no_jump(*this);
    expect_passive(*this);
  }
  bool moving = false;
};

TEST(OpenMaster, BesideASimulatedRobotAPenBearsAPauseOfATenthOfASecond) {
  const auto bears = [](const std::string& robot, std::chrono::nanoseconds pause) {
    hal::VirtualClock clock;
    operation::Config config;
    config.robot.name = robot;
    const runtime::OpenedHaptic opened = operation::open_master(config, clock);
    opened.device->activate();
    hal::HapticSample sample;
    for (const std::chrono::nanoseconds wait : {std::chrono::nanoseconds(1ms), pause}) {
      clock.sleep_until(clock.now() + wait);
      if (opened.device->exchange({.enable = true}, sample).fault != hal::HapticFault::kNone) return false;
    }
    return true;
  };
  EXPECT_TRUE(bears("loopback", 100ms));
  EXPECT_FALSE(bears("loopback", 101ms));
  EXPECT_TRUE(bears("ethercat:eth1", 20ms));
  EXPECT_FALSE(bears("ethercat:eth1", 21ms)) << "the robot may be a real one";
}

/// Of a master that bears a pause.
constexpr hal::HapticLimits kPatient{.stale_after = 100ms, .command_timeout = 100ms};

TEST(TeleoperationFaults, APauseShorterThanTheTimeoutIsNoOverspeedAndTheMotionGoesOn) {
  for (const auto duration : {5ms, 15ms, 50ms, 95ms}) {
    SCOPED_TRACE(duration.count());
    MovingRig rig(kPatient);
    ASSERT_TRUE(rig.moving);
    ASSERT_GT(rig.fastest_rad_per_s(), 0.5);
    rig.pause(duration);
    rig.run(3s);
    rig.expect_goes_on();
  }
}

TEST(TeleoperationFaults, AMasterThatGoesStaleInAPauseBrakesTheRobotAndLowersTheArm) {
  for (const auto duration : {30ms, 50ms, 95ms}) {
    SCOPED_TRACE(duration.count());
    MovingRig rig({});
    ASSERT_TRUE(rig.moving);
    rig.pause(duration);
    const auto begin = rig.records.size();
    rig.run(15s);
    EXPECT_EQ(rig.cycle.task().end(), TeleopEnd::kMasterFault)
        << describe(rig.cycle.stop_reason(), rig.robot, &rig.master);
    std::vector<TeleopPhase> order;
    for (std::size_t i = begin; i < rig.records.size(); ++i)
      if (order.empty() || order.back() != rig.records[i].phase) order.push_back(rig.records[i].phase);
    EXPECT_EQ(order, (std::vector{TeleopPhase::kStopping, TeleopPhase::kLowering, TeleopPhase::kOff}));
    EXPECT_LT(rig.plant.velocity().norm(), 0.05) << "nothing is left to fall";
  }
}

TEST(TeleoperationFaults, AnOverspeedThatCameUpInAPauseSwitchesTheDrivesOffAtOnce) {
  MovingRig rig(kPatient);
  ASSERT_TRUE(rig.moving);
  rig.plant.push_tip({0, 150, 0});
  rig.pause(90ms);
  rig.run(3ms);
  EXPECT_GT(rig.fastest_rad_per_s(), 1.2) << "and it was one";
  EXPECT_EQ(rig.cycle.task().end(), TeleopEnd::kJointTooFast);
  EXPECT_EQ(rig.cycle.task().phase(), TeleopPhase::kFaulted);
}

TEST(TeleoperationFaults, SamplesThatAreLostNowAndAgainAreNoOverspeedAndTheMotionGoesOn) {
  for (const int frames : {2, 4, 11}) {
    SCOPED_TRACE(frames);
    MovingRig rig({});
    ASSERT_TRUE(rig.moving);
    ASSERT_GT(rig.fastest_rad_per_s(), 0.5);
    rig.bus.loses = support::LossyRobot::all_but_one_of(frames);
    rig.run(3s);
    rig.expect_goes_on();
  }
}

/// Positions of all joints with the arm unfolded.
std::vector<double> unfolded() {
  const control::ArmVector arm_rad = teleop_rig::config().control.unfolded_rad;
  std::vector<double> positions(4, 0.0);
  positions.insert(positions.end(), arm_rad.begin(), arm_rad.end());
  return positions;
}

TEST(TeleoperationFaults, AnArmThatReadsAPositionBeyondItsEndStopIsNeverEnabled) {
  struct Case {
    std::size_t joint;
    double read_rad;
  };
  for (const Case& beyond : {Case{7, -3.9}, Case{7, 60.0}, Case{4, -0.3}, Case{8, std::nan("")}}) {
    SCOPED_TRACE(beyond.read_rad);
    hal::VirtualClock clock;
    std::vector<double> positions = unfolded();
    positions[beyond.joint] = beyond.read_rad;
    support::TurningRobot robot(clock, teleop_rig::joints(), 0, 0.0, positions);
    sim::Hand hand({});
    hal::LockstepHapticDevice master(
        std::make_unique<hal::LoopbackHapticLink>(hand, teleop_rig::kPeriod,
                                                  hal::HapticInfo{.name = "pen", .force_limit_N = 8.0}),
        clock);
    master.activate();
    TeleopCycle cycle(teleop_rig::config(), robot, master);
    for (int n = 0; n < 20; ++n) {
      clock.sleep_until(clock.now() + 1ms);
      cycle.step(clock.now());
    }
    EXPECT_FALSE(robot.was_enabled);
    EXPECT_EQ(cycle.task().end(), TeleopEnd::kJointOutside);
    EXPECT_EQ(cycle.task().phase(), TeleopPhase::kFaulted);
    const std::string text = describe(cycle.stop_reason(), robot, &master);
    EXPECT_NE(text.find(robot.joints()[beyond.joint].name + " read "), std::string::npos) << text;
  }
}

TEST(TeleoperationFaults, AnOverspeedIsSeenHoweverManyFramesAreLostThatMayBe) {
  struct Case {
    std::size_t joint;
    double speed_rad_per_s;
    TeleopEnd end;
  };
  for (const Case& turning :
       {Case{1, 18.0, TeleopEnd::kWheelTooFast}, Case{6, 3.4, TeleopEnd::kJointTooFast}})
    for (const int frames : {1, 2, 3, 4, 11}) {
      SCOPED_TRACE(testing::Message() << turning.joint << ", " << frames);
      hal::VirtualClock clock;
      support::TurningRobot robot(clock, teleop_rig::joints(), turning.joint, turning.speed_rad_per_s,
                                  unfolded());
      support::LossyRobot bus(robot);
      sim::Hand hand({});
      hal::LockstepHapticDevice master(
          std::make_unique<hal::LoopbackHapticLink>(hand, teleop_rig::kPeriod,
                                                    hal::HapticInfo{.name = "pen", .force_limit_N = 8.0}),
          clock);
      master.activate();
      TeleopCycle cycle(teleop_rig::config(), bus, master);
      for (int n = 0; n < 150 && cycle.task().end() == TeleopEnd::kNone; ++n) {
        if (n == 5) bus.loses = support::LossyRobot::all_but_one_of(frames);
        clock.sleep_until(clock.now() + 1ms);
        cycle.step(clock.now());
      }
      EXPECT_EQ(cycle.task().end(), turning.end);
      EXPECT_EQ(cycle.task().phase(), TeleopPhase::kFaulted);
      EXPECT_EQ(cycle.stop_reason().joint, static_cast<int>(turning.joint));
      EXPECT_GT(cycle.stop_reason().value, cycle.stop_reason().limit);
      EXPECT_LT(cycle.stop_reason().value, 1.1 * turning.speed_rad_per_s);
      const std::string text = describe(cycle.stop_reason(), robot, &master);
      EXPECT_NE(text.find(robot.joints()[turning.joint].name + " turned at "), std::string::npos) << text;
    }
}

TEST(TeleoperationFaults, APenThatIsLetGoIsFoundOutWhateverTheBusLoses) {
  for (const int frames : {1, 2, 3, 4, 11}) {
    SCOPED_TRACE(frames);
    Rig rig;
    ASSERT_TRUE(rig.run_until(TeleopPhase::kOperating));
    rig.hand.move_to({-0.02, 0.04, 0.03}, 400ms);
    rig.run(300ms);
    rig.bus.loses = support::LossyRobot::all_but_one_of(frames);
    rig.hand.let_go();
    rig.run(1s);
    EXPECT_EQ(rig.cycle.task().phase(), TeleopPhase::kLetGo) << control::name(rig.cycle.task().phase());
  }
}

TEST(TeleoperationFaults, ABusThatBreaksWhileTheArmIsLoweredIsNoSuccess) {
  Breakable rig;
  ASSERT_TRUE(rig.operate());
  rig.cycle.request_stop();
  rig.run(1s);
  ASSERT_EQ(rig.cycle.task().phase(), TeleopPhase::kLowering);
  rig.robot.broken = true;
  rig.run(50ms);
  EXPECT_TRUE(rig.cycle.stop_reason());
  EXPECT_EQ(rig.cycle.task().end(), TeleopEnd::kRobotFault);
}

TEST(TeleoperationFaults, ABusThatBreaksWhileTheArmIsLoweredForAnotherReasonIsReportedToo) {
  Breakable rig;
  ASSERT_TRUE(rig.operate());
  rig.cable->plugged = false;
  rig.run(1s);
  ASSERT_EQ(rig.cycle.task().phase(), TeleopPhase::kLowering);
  rig.robot.broken = true;
  rig.run(50ms);
  EXPECT_TRUE(rig.cycle.finished());
  EXPECT_EQ(rig.cycle.stop_reason().kind, runtime::StopReason::Kind::kMasterFault);
  EXPECT_EQ(rig.cycle.cut_short_by().kind, runtime::StopReason::Kind::kRobotFault) << "the arm fell";
}

TEST(TeleoperationFaults, AMasterThatFailsBeforeAnythingMovedEndsItAtOnce) {
  Breakable rig;
  rig.run(10ms);
  ASSERT_EQ(rig.cycle.task().phase(), TeleopPhase::kCentring);
  rig.cable->plugged = false;
  rig.run(50ms);
  EXPECT_TRUE(rig.cycle.finished());
  EXPECT_FALSE(rig.robot.last_command.enable);
  EXPECT_NE(describe(rig.cycle.stop_reason(), rig.robot, &rig.master).find("nothing has moved"),
            std::string::npos);
}

TEST(TeleoperationFaults, AMasterThatLosesItsPositionIsNotFollowed) {
  Breakable rig;
  ASSERT_TRUE(rig.operate());
  rig.hand.move_to({-0.055, 0, 0}, 500ms);
  rig.run(2s);
  rig.cable->ready = false;
  rig.run(5ms);
  EXPECT_EQ(rig.cycle.task().phase(), TeleopPhase::kStopping);
  EXPECT_EQ(rig.cycle.task().end(), TeleopEnd::kMasterFault);
}

TEST(TeleoperationFaults, AMasterThatIsStillHomedIsWaitedFor) {
  Breakable rig;
  rig.cable->ready = false;
  rig.run(40s);
  EXPECT_EQ(rig.cycle.task().phase(), TeleopPhase::kCentring);
  rig.cable->ready = true;
  EXPECT_TRUE(rig.operate());
}

TEST(TeleoperationFaults, AStopBeforeTheStartMovesNothing) {
  Breakable rig;
  rig.cycle.request_stop();
  rig.run(100ms);
  EXPECT_TRUE(rig.cycle.finished());
  EXPECT_FALSE(rig.robot.last_command.enable);
  EXPECT_FALSE(rig.cycle.stop_reason());
}

}  // namespace teleoperation_faults_test
