#include "operation/base_task.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "hal/clock.h"
#include "operation/hold_source.h"
#include "operation/velocity_source.h"
#include "sim/base.h"
#include "tests/support/held_up_robot.h"
#include "tests/support/lossy_robot.h"
#include "tests/support/no_alloc_guard.h"
#include "tests/support/turning_robot.h"
#include "tests/support/watched_robot.h"

namespace operation {
namespace cycle_test {

using namespace std::chrono_literals;
using runtime::StopReason;
using std::chrono::nanoseconds;

/// Braking ends with all wheels below 0.02 rad/s (1 mm/s), seen through a filter that lags 14 ms at up to
/// 0.2 m/s².
constexpr double kAtRest_m_per_s = 0.001 + 0.014 * 0.2;

const VelocitySource::Wheels kAnyWheelSpeed{control::LinkMap::with_geometry({}), 1e3};

/// Requests a pose far ahead, so that torque is needed, until changed.
class ScriptedMotion final : public MotionSource {
 public:
  void begin(nanoseconds now, const control::PlanarPose&) noexcept override { begin_ = now; }
  Motion read(nanoseconds now, const control::PlanarPose&) noexcept override {
    Motion motion{now, {}, finished};
    motion.reference.X_WB.x_m = ahead_m + speed_m_per_s * std::chrono::duration<double>(now - begin_).count();
    motion.reference.X_WB.yaw_rad = yaw_rad;
    motion.reference.twist_W.x() = speed_m_per_s;
    if (silent_after && now - begin_ > *silent_after) motion.stamp = begin_ + *silent_after;
    return motion;
  }
  double ahead_m = 1.0;
  double speed_m_per_s = 0.0;
  double yaw_rad = 0.0;
  bool finished = false;
  std::optional<nanoseconds> silent_after{};

 private:
  nanoseconds begin_{};
};

/// The simulated base on the loopback robot in virtual time, and everything a test wants to reach.
struct Rig {
  explicit Rig(const Cycle::Config& config = moving()) : cycle(config, bus, motion, &base.pose()) {
    robot.watch.allow_enables(1);
    robot.activate();
  }

  /// Enough force to overcome the friction of the loaded wheels, and a pose far ahead is no fault.
  static Cycle::Config moving() {
    Cycle::Config config;
    config.following_error_m = 10;
    config.setpoint = {{1e4, 1e7, 1e10}, {1e4, 1e7, 1e10}};
    config.controller.wrench_limits = {20.0, 5.0};
    return config;
  }
  void run(nanoseconds duration) {
    for (nanoseconds end = clock.now() + duration; clock.now() < end && !cycle.finished();) {
      clock.sleep_until(clock.now() + 1ms);
      cycle.step(clock.now());
      largest_command_Nm = 0;
      for (const double torque : cycle.record().torque_command_Nm)
        largest_command_Nm = std::max(largest_command_Nm, std::abs(torque));
    }
  }
  double speed_m_per_s() const { return base.twist().head<2>().norm(); }

  hal::VirtualClock clock;
  sim::Base base{sim::BaseParameters{}};
  support::WatchedLoopback robot{
      base, clock, 1ms, {{"wheel-1", 2.4}, {"wheel-2", 2.4}, {"wheel-3", 2.4}, {"wheel-4", 2.4}}};
  support::LossyRobot bus{robot};
  ScriptedMotion motion;
  Cycle cycle;
  double largest_command_Nm = 0;
};

TEST(Cycle, DrivesTheBaseOnceTheDrivesObey) {
  Rig rig;
  rig.run(2ms);
  EXPECT_EQ(rig.cycle.record().phase, Phase::kStarting);
  rig.run(2s);
  EXPECT_EQ(rig.cycle.record().phase, Phase::kRunning);
  EXPECT_GT(rig.base.pose().x_m, 0.1);
  EXPECT_FALSE(rig.cycle.stop_reason());
}

TEST(Cycle, AFinishedMotionBrakesToRestAndEnds) {
  Rig rig;
  rig.run(2s);
  ASSERT_GT(rig.speed_m_per_s(), 0.05);
  rig.motion.finished = true;
  rig.run(5s);
  EXPECT_TRUE(rig.cycle.finished());
  EXPECT_FALSE(rig.cycle.stop_reason());
  EXPECT_LT(rig.speed_m_per_s(), kAtRest_m_per_s);
}

TEST(Cycle, ABaseThatHoldsItsPlaceIsPushedAsideByItsStiffnessAndComesBack) {
  Rig rig;
  HoldSource hold;
  Cycle cycle(Rig::moving(), rig.robot, hold, &rig.base.pose());
  const auto run = [&](nanoseconds duration) {
    for (const nanoseconds end = rig.clock.now() + duration; rig.clock.now() < end;) {
      rig.clock.sleep_until(rig.clock.now() + 1ms);
      cycle.step(rig.clock.now());
    }
  };
  run(1s);
  EXPECT_NEAR(rig.base.pose().x_m, 0.0, 1e-3);
  rig.base.push({25, 0, 0});
  run(2s);
  const double pushed_m = rig.base.pose().x_m;
  rig.base.push({0, 0, 0});
  run(3s);
  EXPECT_FALSE(cycle.stop_reason()) << describe(cycle.stop_reason(), rig.robot);
  EXPECT_GT(pushed_m, 0.01);
  EXPECT_LT(rig.base.pose().x_m, pushed_m);
}

TEST(Cycle, ARequestedStopBrakesToRestAndEnds) {
  Rig rig;
  rig.run(2s);
  rig.cycle.request_stop();
  rig.run(5s);
  EXPECT_TRUE(rig.cycle.finished());
  EXPECT_FALSE(rig.cycle.stop_reason());
  EXPECT_LT(rig.speed_m_per_s(), kAtRest_m_per_s);
}

TEST(Cycle, SetPointsThatStopComingBrakeTheBaseWithinTheTimeout) {
  Rig rig;
  rig.motion.silent_after = 2s;
  rig.run(2s);
  ASSERT_GT(rig.speed_m_per_s(), 0.05);
  rig.run(90ms);
  EXPECT_EQ(rig.cycle.record().phase, Phase::kRunning) << "silent for less than the 100 ms allowed";
  rig.run(20ms);
  EXPECT_EQ(rig.cycle.record().phase, Phase::kStopping);
  rig.run(5s);
  EXPECT_TRUE(rig.cycle.finished());
  EXPECT_LT(rig.speed_m_per_s(), kAtRest_m_per_s);
  EXPECT_EQ(rig.cycle.stop_reason().kind, StopReason::Kind::kCommandTimeout);
  EXPECT_NE(describe(rig.cycle.stop_reason(), rig.robot).find("no new set-point for 0.101 s"),
            std::string::npos)
      << describe(rig.cycle.stop_reason(), rig.robot);
}

TEST(Cycle, ASetPointThatIsNotANumberSwitchesTheDrivesOffAndIsNamed) {
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    Rig rig;
    rig.run(1s);
    rig.motion.ahead_m = bad;
    rig.run(3ms);  // computed in one cycle, sent and refused in the next
    EXPECT_EQ(rig.cycle.record().phase, Phase::kFaulted);
    EXPECT_EQ(rig.largest_command_Nm, 0.0);
    const StopReason& reason = rig.cycle.stop_reason();
    EXPECT_EQ(reason.kind, StopReason::Kind::kRobotFault);
    EXPECT_EQ(reason.status.fault, hal::Fault::kBadCommand);
    EXPECT_EQ(describe(reason, rig.robot),
              "cycle 1002 (1.001 s): wheel-1: a command that is not a finite number; drives switched off");
    rig.motion.ahead_m = 1.0;  // a good set-point does not bring it back
    rig.run(2s);
    EXPECT_TRUE(rig.cycle.finished());
    rig.base.advance(std::array<hal::JointCommand, 4>{}, false, 5s);  // friction alone, drives off
    EXPECT_LT(rig.speed_m_per_s(), 1e-6);
  }
}

TEST(Cycle, AStallOfTheProgramBrakesInsteadOfChasingTheReference) {
  Rig rig;
  rig.run(1s);
  rig.clock.sleep_until(rig.clock.now() + 3s);  // SIGSTOP, a debugger, a starved machine
  rig.motion.ahead_m = 5.0;                     // the reference has gone on meanwhile
  rig.run(5s);
  EXPECT_TRUE(rig.cycle.finished());
  EXPECT_EQ(rig.cycle.stop_reason().kind, StopReason::Kind::kStalled);
  EXPECT_LT(rig.speed_m_per_s(), kAtRest_m_per_s);
}

TEST(Cycle, AfterAFaultTheRecordGoesOnTellingTheTruth) {
  Rig rig;
  rig.run(1s);
  const double speed_before = rig.cycle.record().velocity_rad_per_s[1];
  ASSERT_GT(speed_before, 1.0);
  rig.motion.ahead_m = std::numeric_limits<double>::quiet_NaN();
  rig.run(6ms);
  ASSERT_EQ(rig.cycle.record().phase, Phase::kFaulted);
  EXPECT_NEAR(rig.cycle.record().velocity_rad_per_s[1], speed_before, 0.3);  // a few ms of coasting
  EXPECT_GT(rig.cycle.record().odometry_W[0], 0.01);
}

TEST(Cycle, BrakingThatDoesNotBringItToRestIsAFault) {
  Rig rig;
  rig.run(1s);
  rig.base.push({200.0, 0.0, 0.0});  // a person pushes much harder than it may brake
  rig.cycle.request_stop();
  rig.run(5s);
  EXPECT_TRUE(rig.cycle.finished());
  EXPECT_NE(rig.cycle.stop_reason().kind, StopReason::Kind::kNone);
}

TEST(Cycle, AWheelThatTurnsTooFastSwitchesTheDrivesOff) {
  Cycle::Config config = Rig::moving();
  config.wheel_speed_limit_rad_per_s = 1.0;
  Rig rig(config);
  rig.run(5s);
  EXPECT_EQ(rig.cycle.stop_reason().kind, StopReason::Kind::kOverspeed);
  EXPECT_TRUE(rig.cycle.finished());
  EXPECT_EQ(rig.largest_command_Nm, 0.0);
}

/// Drives steadily at 0.4 m/s, 8.4 rad/s of the 12 that a wheel may turn at.
struct SteadyRig : Rig {
  SteadyRig() : Rig(strong()) {
    motion.ahead_m = 0;
    motion.speed_m_per_s = 0.4;
    run(4s);
  }
  static Cycle::Config strong() {
    Cycle::Config config = moving();
    config.controller.wrench_limits = {60.0, 5.0};
    return config;
  }
  /// The base continues under its torques, without a cycle.
  void pause(nanoseconds duration) { clock.sleep_until(clock.now() + duration); }
};

TEST(Cycle, APauseShorterThanTheTimeoutIsNoOverspeedAndStopsNothing) {
  for (const nanoseconds duration : {4ms, 15ms, 50ms, 95ms}) {
    SCOPED_TRACE(duration.count());
    SteadyRig rig;
    ASSERT_NEAR(rig.speed_m_per_s(), 0.4, 0.02);
    rig.pause(duration);
    for (int n = 0; n < 100; ++n) {
      rig.run(1ms);
      ASSERT_EQ(rig.cycle.record().phase, Phase::kRunning) << describe(rig.cycle.stop_reason(), rig.robot);
      for (std::size_t i = 0; i < 4; ++i)
        EXPECT_NEAR(std::abs(rig.cycle.record().velocity_rad_per_s[i]), 0.4 / 0.0475, 1.0)
            << n << " ms after";
    }
    rig.run(2s);
    EXPECT_EQ(rig.cycle.record().phase, Phase::kRunning);
    EXPECT_NEAR(rig.speed_m_per_s(), 0.4, 0.02);
    EXPECT_NEAR(rig.cycle.record().odometry_W[0], rig.base.pose().x_m, 0.02) << "the way of the pause counts";
  }
}

TEST(Cycle, AnOverspeedThatCameUpInAPauseSwitchesTheDrivesOffAtOnce) {
  SteadyRig rig;
  rig.base.push({400.0, 0.0, 0.0});
  rig.pause(90ms);
  rig.run(3ms);
  EXPECT_EQ(rig.cycle.stop_reason().kind, StopReason::Kind::kOverspeed);
  EXPECT_GT(std::abs(rig.base.wheel(0).velocity_rad_per_s()), 12.0) << "and it was one";
}

TEST(Cycle, SamplesThatDidNotComeForAWhileAreNoOverspeed) {
  SteadyRig rig;
  rig.bus.loses = [](int) { return true; };
  rig.run(40ms);
  rig.bus.loses = {};
  rig.run(1s);
  EXPECT_EQ(rig.cycle.record().phase, Phase::kRunning) << describe(rig.cycle.stop_reason(), rig.robot);
  EXPECT_NEAR(rig.speed_m_per_s(), 0.4, 0.05);
}

TEST(Cycle, SamplesThatAreLostNowAndAgainAreNoOverspeed) {
  std::mt19937 random(7);
  const std::vector<std::function<bool(int)>> buses = {
      support::LossyRobot::all_but_one_of(2), support::LossyRobot::all_but_one_of(4),
      support::LossyRobot::all_but_one_of(11), [&random](int) { return random() % 2 == 0; }};
  for (const auto& loses : buses) {
    SteadyRig rig;
    rig.bus.loses = loses;
    for (int n = 0; n < 2000; ++n) {
      rig.run(1ms);
      ASSERT_EQ(rig.cycle.record().phase, Phase::kRunning) << describe(rig.cycle.stop_reason(), rig.robot);
      for (std::size_t i = 0; i < 4; ++i)
        EXPECT_NEAR(std::abs(rig.cycle.record().velocity_rad_per_s[i]), 0.4 / 0.0475, 1.0) << n;
    }
    EXPECT_NEAR(rig.speed_m_per_s(), 0.4, 0.05);
    EXPECT_NEAR(rig.cycle.record().odometry_W[0], rig.base.pose().x_m, 0.03);
  }
}

const std::vector<hal::JointInfo> kFourWheels{{"wheel-1", 3}, {"wheel-2", 3}, {"wheel-3", 3}, {"wheel-4", 3}};

TEST(Cycle, AnOverspeedIsSeenHoweverManyFramesAreLostThatMayBe) {
  for (const int frames : {1, 2, 3, 4, 11}) {
    SCOPED_TRACE(frames);
    hal::VirtualClock clock;
    support::TurningRobot robot(clock, kFourWheels, 1, 18.0);
    support::LossyRobot bus(robot);
    bus.loses = support::LossyRobot::all_but_one_of(frames);
    ScriptedMotion motion;
    Cycle::Config config = Rig::moving();
    config.wheel_speed_limit_rad_per_s = 17.0;
    Cycle cycle(config, bus, motion, nullptr);
    for (int n = 0; n < 200 && !cycle.stop_reason(); ++n) {
      clock.sleep_until(clock.now() + 1ms);
      cycle.step(clock.now());
    }
    EXPECT_EQ(cycle.stop_reason().kind, StopReason::Kind::kOverspeed);
    // The filter knows 17 of 18 rad/s 50 ms after the drives obey, at the latest with the frame after that.
    EXPECT_LE(cycle.stop_reason().time, 50ms + 2 * frames * 1ms);
  }
}

/// A wheel that turns as fast for `duration`, on a machine that holds up both ends of the bus by up to 19 ms.
/// Why it stops, and when.
StopReason turn_on_a_busy_machine(double speed_rad_per_s, double limit_rad_per_s, nanoseconds duration,
                                  std::uint64_t seed) {
  hal::VirtualClock clock;
  support::TurningRobot robot(clock, kFourWheels, 1, speed_rad_per_s);
  support::HeldUpRobot bus(robot, clock);
  bus.hold_up(support::BusyMachine(seed));
  ScriptedMotion motion;
  Cycle::Config config = Rig::moving();
  config.allow_any_following_error();
  config.wheel_speed_limit_rad_per_s = limit_rad_per_s;
  // One wheel alone that turns is a lie.
  for (std::size_t i = 0; i < control::kPlausibilityCheckNames.size(); ++i)
    config.checks_off.add(static_cast<control::PlausibilityCheck>(i));
  Cycle cycle(config, bus, motion, nullptr);
  while (clock.now() < duration && !cycle.stop_reason()) {
    clock.sleep_until(clock.now() + 1ms);
    cycle.step(clock.now());
  }
  return cycle.stop_reason();
}

TEST(Cycle, AnswersOfABusyMachineMakeNoOverspeed) {
  for (const std::uint64_t seed : {1, 2, 3, 4, 5}) {
    const StopReason reason = turn_on_a_busy_machine(11.5, 12, 30s, seed);
    EXPECT_FALSE(reason) << seed << ": " << reason.value << " rad/s after " << reason.time / 1ms << " ms";
  }
}

TEST(Cycle, AnOverspeedOnABusyMachineIsSeenOnceNoTimesOfItsSamplesExplainIt) {
  for (const std::uint64_t seed : {1, 2, 3, 4, 5, 6, 7, 8, 9, 10}) {
    const StopReason reason = turn_on_a_busy_machine(18, 12, 5s, seed);
    EXPECT_EQ(reason.kind, StopReason::Kind::kOverspeed) << seed;
    // The filter needs 30 ms. 18 rad/s for t are more than 12 rad/s for t + 19.3 ms from 39 ms on, and a
    // sample comes after up to 21 ms.
    EXPECT_LE(reason.time, 30ms + 39ms + 2 * 21ms) << seed;
  }
}

/// A robot whose drives never obey, or whose bus fails on request.
class BrokenRobot final : public hal::Robot {
 public:
  std::span<const hal::JointInfo> joints() const noexcept override { return kFourWheels; }
  void activate() override {}
  void deactivate() noexcept override {}
  hal::CycleStatus exchange(const hal::RobotCommand& command, hal::RobotSample& sample) noexcept override {
    last_command = command;
    sample.enabled = obeys && command.enable;
    return status;
  }
  bool obeys = false;
  hal::CycleStatus status{};
  hal::RobotCommand last_command;
};

TEST(Cycle, DrivesThatNeverObeyAreAFaultAfterHalfAMinute) {
  BrokenRobot robot;
  ScriptedMotion motion;
  Cycle cycle(Rig::moving(), robot, motion, nullptr);
  int milliseconds = 0;
  for (; !cycle.finished() && milliseconds < 40'000; ++milliseconds) cycle.step(milliseconds * 1ms);
  EXPECT_NEAR(milliseconds, 30022, 2);
  EXPECT_EQ(cycle.stop_reason().kind, StopReason::Kind::kNotEnabled);
}

TEST(Cycle, TheWaitForTheDrivesIsReported) {
  BrokenRobot robot;
  ScriptedMotion motion;
  Cycle::Config config = Rig::moving();
  config.enable_timeout = 2500ms;
  Cycle cycle(config, robot, motion, nullptr);
  for (int i = 0; !cycle.finished() && i < 5000; ++i) cycle.step(i * 1ms);
  EXPECT_NE(describe(cycle.stop_reason(), robot)
                .find("did not start to obey within 2.5 s: check the emergency stop"),
            std::string::npos)
      << describe(cycle.stop_reason(), robot);
}

TEST(Cycle, AfterAStallNoOldTorqueIsSentAnyMore) {
  BrokenRobot robot;
  robot.obeys = true;
  ScriptedMotion motion;
  Cycle cycle(Rig::moving(), robot, motion, nullptr);
  nanoseconds now{};
  for (; now < 1s; now += 1ms) cycle.step(now);
  ASSERT_NE(robot.last_command.joints[0].target, 0.0) << "wheels that do not follow";
  cycle.step(now += 3s);
  EXPECT_EQ(cycle.stop_reason().kind, StopReason::Kind::kStalled);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(robot.last_command.joints[i].mode, hal::CommandMode::kTorque);
    EXPECT_EQ(robot.last_command.joints[i].target, 0.0);
  }
}

TEST(Cycle, AFaultAfterAPauseOfThisProgramNamesThePause) {
  for (const auto pause : {5ms, 90ms, 110ms, 3000ms}) {
    for (const auto later : {0ms, 50ms, 1000ms}) {
      BrokenRobot robot;
      robot.obeys = true;
      ScriptedMotion motion;
      Cycle cycle(Rig::moving(), robot, motion, nullptr);
      nanoseconds now{};
      for (; now < 100ms; now += 1ms) cycle.step(now);
      now += pause - 1ms;
      const nanoseconds fault = now + later;
      for (; now <= fault; now += 1ms) {
        if (now == fault) robot.status = {hal::Fault::kPartialBus, 1, 6};
        cycle.step(now);
      }
      const std::string text = describe(cycle.stop_reason(), robot);
      const bool named = text.find("this program did not run for") != text.npos;
      EXPECT_EQ(named, pause > 100ms) << text;
      EXPECT_EQ(text.find("some devices on the bus did not answer") != text.npos,
                pause < 100ms || later == 0ms)
          << text;
    }
  }
}

TEST(Cycle, ALostBusSwitchesOffAndTheFirstReasonIsKept) {
  BrokenRobot robot;
  robot.obeys = true;
  ScriptedMotion motion;
  Cycle cycle(Rig::moving(), robot, motion, nullptr);
  nanoseconds now{};
  for (; now < 100ms; now += 1ms) cycle.step(now);
  robot.status = {hal::Fault::kPartialBus, 2, 6};
  cycle.step(now += 1ms);
  robot.status = {hal::Fault::kFrameLost};
  cycle.step(now += 1ms);
  EXPECT_FALSE(robot.last_command.enable);
  EXPECT_EQ(cycle.stop_reason().status.fault, hal::Fault::kPartialBus);
  EXPECT_EQ(cycle.stop_reason().joint, 2);
  EXPECT_NE(describe(cycle.stop_reason(), robot).find("wheel-3"), std::string::npos);
}

/// A hand holds it: the loopback base with less force than its wheels need to break away.
Cycle::Config too_weak() {
  Cycle::Config config;
  config.controller.compensate_friction = false;
  return config;
}

TEST(Cycle, ABaseThatDoesNotFollowIsBrakedAndSaysHowFarAndWhichLimit) {
  Rig rig(too_weak());
  rig.motion.ahead_m = 0;
  rig.motion.speed_m_per_s = 0.1;
  rig.run(1400ms);
  EXPECT_EQ(rig.cycle.record().phase, Phase::kRunning) << "0.14 m behind";
  rig.run(500ms);
  EXPECT_EQ(rig.cycle.stop_reason().kind, StopReason::Kind::kBehind);
  // 0.1 m/s, for the 0.2 s that it may be further off than 0.15 m.
  EXPECT_NEAR(rig.cycle.stop_reason().value, 0.17, 0.002);
  const std::string text = describe(rig.cycle.stop_reason(), rig.robot);
  EXPECT_NE(text.find("0.170 m from its reference, more than allowed (limits.following_error_m = 0.15)"),
            std::string::npos)
      << text;
  rig.run(5s);
  EXPECT_TRUE(rig.cycle.finished());
  EXPECT_EQ(rig.largest_command_Nm, 0.0);
}

TEST(Cycle, ABaseThatIsHeldAndLetGoAfterwardsDoesNotDart) {
  Cycle::Config config;
  config.controller.wrench_limits = {20, 5};
  Rig rig(config);
  rig.motion.ahead_m = 0;
  rig.motion.speed_m_per_s = 0.1;
  rig.run(500ms);
  rig.base.push({-25, 0, 0});
  rig.run(5s);
  ASSERT_EQ(rig.cycle.stop_reason().kind, StopReason::Kind::kBehind);
  rig.base.push({0, 0, 0});
  const double held_m = rig.base.pose().x_m;
  rig.run(5s);
  EXPECT_NEAR(rig.base.pose().x_m, held_m, 0.01) << "the reference was 0.5 m further";
}

TEST(Cycle, ABaseThatIsTurnedOffItsReferenceIsStoppedToo) {
  Rig rig(too_weak());
  rig.motion.ahead_m = 0;
  rig.motion.yaw_rad = -0.35;
  rig.run(5s);
  EXPECT_EQ(rig.cycle.stop_reason().kind, StopReason::Kind::kTurnedBehind);
  const std::string text = describe(rig.cycle.stop_reason(), rig.robot);
  EXPECT_NE(text.find("0.350 rad from its reference, more than allowed (limits.following_error_rad = 0.3)"),
            std::string::npos)
      << text;
}

TEST(Cycle, AFollowingErrorThatPassesSoonStopsNothing) {
  Cycle::Config config;
  config.setpoint = Rig::moving().setpoint;  // which would not allow the jumps
  Rig rig(config);
  rig.motion.ahead_m = 0;
  rig.run(500ms);
  rig.motion.ahead_m = 0.2;
  rig.run(190ms);
  rig.motion.ahead_m = 0;
  rig.run(190ms);
  rig.motion.ahead_m = 0.2;
  rig.run(190ms);
  EXPECT_FALSE(rig.cycle.stop_reason()) << describe(rig.cycle.stop_reason(), rig.robot);
}

TEST(Cycle, ATorqueThatJumpsIsSentAtTheRateOfTheDriveAndItIsRecorded) {
  Rig rig;
  rig.motion.ahead_m = 0;
  rig.run(500ms);
  rig.motion.ahead_m = 1;
  double sent_Nm = rig.cycle.record().torque_command_Nm[0];
  double fastest_Nm = 0;
  bool limited = false;
  for (int n = 0; n < 50; ++n) {
    rig.run(1ms);
    fastest_Nm = std::max(fastest_Nm, std::abs(rig.cycle.record().torque_command_Nm[0] - sent_Nm));
    sent_Nm = rig.cycle.record().torque_command_Nm[0];
    limited = limited || (rig.cycle.record().limited & limiter::kTorqueRate) != 0;
  }
  EXPECT_TRUE(limited);
  EXPECT_NEAR(fastest_Nm, 1000.0 * 2.4 / 12 * 1e-3, 1e-9);
  EXPECT_GT(std::abs(sent_Nm), fastest_Nm);
}

TEST(Cycle, AReferenceThatJumpsIsFollowedWithinTheLimitsOfSetPointsAndItIsRecorded) {
  Cycle::Config config = Rig::moving();
  config.setpoint = {};
  config.following_error_m = Cycle::Config{}.following_error_m;
  config.wheel_speed_limit_rad_per_s = 30;
  config.controller.wrench_limits = {120, 5};  // 48 kg at 2.4 m/s²
  Rig rig(config);
  rig.motion.ahead_m = 0;
  rig.run(500ms);
  EXPECT_EQ(rig.cycle.record().limited & limiter::kSetpoint, 0);
  rig.motion.ahead_m = 0.5;
  double at_m = rig.cycle.record().reference_W[0];
  double velocity = 0, fastest = 0, hardest = 0;
  bool limited = false;
  for (int n = 0; n < 2000; ++n) {
    rig.run(1ms);
    const CycleRecord& record = rig.cycle.record();
    const double velocity_now = (record.reference_W[0] - at_m) / 1e-3;
    fastest = std::max(fastest, velocity_now);
    hardest = std::max(hardest, std::abs(velocity_now - velocity) / 1e-3);
    at_m = record.reference_W[0];
    velocity = velocity_now;
    limited = limited || (record.limited & limiter::kSetpoint) != 0;
  }
  EXPECT_TRUE(limited);
  EXPECT_EQ(rig.cycle.record().limited & limiter::kSetpoint, 0) << "arrived";
  EXPECT_LE(fastest, control::kBaseLimits.speed + 1e-9);
  EXPECT_LE(hardest, control::kBaseLimits.acceleration + 1e-6);
  EXPECT_EQ(at_m, 0.5);
  EXPECT_FALSE(rig.cycle.stop_reason()) << describe(rig.cycle.stop_reason(), rig.robot);
  EXPECT_NEAR(rig.base.pose().x_m, 0.5, 0.05);
}

TEST(Cycle, AMotionIsNotOverBeforeTheReferenceHasArrived) {
  Cycle::Config config = Rig::moving();
  config.setpoint.linear = {0.05, 1.0, 100.0};
  Rig rig(config);
  rig.motion.ahead_m = 0.3;
  rig.motion.finished = true;  // as a path that is faster than the limits of its reference
  rig.run(20s);
  EXPECT_TRUE(rig.cycle.finished());
  EXPECT_FALSE(rig.cycle.stop_reason());
  EXPECT_NEAR(rig.base.pose().x_m, 0.3, 0.05);
}

TEST(Cycle, BrakingIsNotSlowedDown) {
  Cycle::Config config = Rig::moving();
  config.torque_rate_per_s = 1;  // 2.4 mN·m a cycle
  Rig rig(config);
  rig.run(3s);
  ASSERT_GT(rig.speed_m_per_s(), 0.05);
  const double driving_Nm = rig.cycle.record().torque_command_Nm[1];
  rig.cycle.request_stop();
  rig.run(2ms);
  EXPECT_LT(rig.cycle.record().torque_command_Nm[1] * driving_Nm, 0) << "against the motion at once";
  EXPECT_EQ(rig.cycle.record().limited & limiter::kTorqueRate, 0);
}

TEST(Cycle, ABaseThatLeavesItsWorkspaceByMoreThanTheMarginIsBraked) {
  Cycle::Config config = Rig::moving();
  config.workspace.base_W_m.max().x() = 0.2;
  Rig rig(config);  // 1 m ahead
  rig.run(5s);
  EXPECT_EQ(rig.cycle.stop_reason().kind, StopReason::Kind::kOutside);
  EXPECT_TRUE(rig.cycle.finished());
  EXPECT_GT(rig.base.pose().x_m, 0.25);
  // 20 N on 48 kg took it there in 0.25 m, and need no more to stop it, as friction helps.
  EXPECT_LT(rig.base.pose().x_m, 0.25 + 0.25);
  const std::string text = describe(rig.cycle.stop_reason(), rig.robot);
  EXPECT_NE(text.find("the base was 0.050 m outside [workspace]"), std::string::npos) << text;
}

TEST(Cycle, ABaseThatWasPushedOutDrivesBackInAndNoFurtherOut) {
  Cycle::Config config;
  config.controller.wrench_limits = {20, 5};
  config.workspace.base_W_m.max().x() = 0.2;
  config.start = {.x_m = 0.3, .y_m = 0, .yaw_rad = 0};
  Eigen::AlignedBox2d walls_W_m = config.workspace.base_W_m;
  walls_W_m.extend(Eigen::Vector2d(0.3, 0));
  const auto drive = [&](double speed_m_per_s) {
    VelocitySource source({.speed_m_per_s = 0.2, .acceleration_m_per_s2 = 0.1}, kAnyWheelSpeed, 1ms,
                          {.m = 0.1, .rad = 0.2}, walls_W_m);
    source.tell({speed_m_per_s, 0, 0});
    Rig rig;
    Cycle cycle(config, rig.robot, source, nullptr);
    for (int k = 0; k < 3000; ++k) {
      rig.clock.sleep_until(rig.clock.now() + 1ms);
      cycle.step(rig.clock.now());
    }
    EXPECT_FALSE(cycle.stop_reason()) << describe(cycle.stop_reason(), rig.robot);
    EXPECT_NEAR(cycle.record().odometry_W[0] - 0.3, rig.base.pose().x_m, 0.01) << "from where it stands";
    return rig.base.pose().x_m;
  };
  EXPECT_LT(drive(-0.2), -0.2);
  EXPECT_LT(drive(0.2), 0.01);
}

/// Otherwise its walls would go along with the next enable.
TEST(Cycle, ARunThatEndsBeforeTheDrivesObeyLeavesTheBaseWhereItWas) {
  Cycle::Config config = Rig::moving();
  config.start = {.x_m = 2.0, .y_m = -1.0, .yaw_rad = 0.5};
  using Ending = void (*)(BrokenRobot&, Cycle&);
  for (const Ending end : {
           Ending{[](BrokenRobot&robot, Cycle&) { robot.status = {hal::Fault::kFrameLost}; }},
           Ending{[](BrokenRobot&, Cycle&cycle) { cycle.request_stop(); }},
           Ending{[](BrokenRobot&, Cycle&cycle) { cycle.switch_off(); }},
       }) {
    BrokenRobot robot;
    ScriptedMotion motion;
    Cycle cycle(config, robot, motion, nullptr);
    nanoseconds now{};
    for (; now < 100ms; now += 1ms) cycle.step(now);
    ASSERT_EQ(cycle.record().phase, Phase::kStarting);
    end(robot, cycle);
    for (; now < 1s; now += 1ms) cycle.step(now);
    EXPECT_TRUE(cycle.finished());
    EXPECT_EQ(cycle.record().odometry_W, (std::array{2.0, -1.0, 0.5}));
  }
}

/// A base of a service, steered by velocity.
TEST(Cycle, ABaseThatIsSteeredAtAWallStopsThereAndGoesOnWhenSteeredAway) {
  Cycle::Config config;
  config.controller.wrench_limits = {20, 5};
  config.workspace.base_W_m.max().x() = 0.3;
  VelocitySource source({.speed_m_per_s = 0.2, .acceleration_m_per_s2 = 0.1}, kAnyWheelSpeed, 1ms,
                        {.m = 0.09, .rad = 0.18}, config.workspace.base_W_m);
  hal::VirtualClock clock;
  sim::Base base{sim::BaseParameters{}};
  support::WatchedLoopback robot(base, clock, 1ms,
                                 {{"wheel-1", 2.4}, {"wheel-2", 2.4}, {"wheel-3", 2.4}, {"wheel-4", 2.4}});
  robot.activate();
  Cycle cycle(config, robot, source, &base.pose());
  const auto run = [&](nanoseconds duration) {
    for (const nanoseconds end = clock.now() + duration; clock.now() < end;) {
      clock.sleep_until(clock.now() + 1ms);
      cycle.step(clock.now());
      ASSERT_LT(base.pose().x_m, 0.3 + 0.02);
    }
  };
  source.tell({0.2, 0, 0});
  run(10s);
  EXPECT_NEAR(base.pose().x_m, 0.3, 0.03);
  EXPECT_NE(cycle.record().limited & limiter::kWorkspace, 0);
  EXPECT_FALSE(cycle.stop_reason()) << describe(cycle.stop_reason(), robot);
  source.tell({-0.2, 0, 0});
  run(2s);
  EXPECT_LT(base.pose().x_m, 0.2);
  EXPECT_EQ(cycle.record().limited & limiter::kWorkspace, 0);
}

TEST(Cycle, ARobotWithoutFourWheelsIsRefused) {
  struct Arm final : hal::Robot {
    std::span<const hal::JointInfo> joints() const noexcept override { return {}; }
    void activate() override {}
    void deactivate() noexcept override {}
    hal::CycleStatus exchange(const hal::RobotCommand&, hal::RobotSample&) noexcept override { return {}; }
  } arm;
  ScriptedMotion motion;
  EXPECT_THROW(Cycle(Cycle::Config{}, arm, motion, nullptr), std::invalid_argument);
}

TEST(Cycle, ATorqueLimitThatNoMotorDeliversIsRefused) {
  Cycle::Config config;
  config.controller.torque_limit_Nm = 2.45;  // the rig's wheels: 2.4
  EXPECT_THROW(Rig{config}, std::invalid_argument);
}

TEST(Cycle, TheWholeCycleDoesNotAllocateOrLock) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns the allocator";
  Rig rig;
  rig.run(10ms);
  const support::NoAllocGuard guard;
  rig.run(1s);
  rig.clock.sleep_until(rig.clock.now() + 50ms);  // what a pause takes, too
  rig.run(1s);
  rig.motion.ahead_m = std::numeric_limits<double>::quiet_NaN();  // the fault path is part of it
  rig.run(10ms);
  EXPECT_EQ(guard.violations(), 0);
}

}  // namespace cycle_test
}  // namespace operation
