#include "runtime/supervisor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "hal/clock.h"
#include "hal/robot_wrapper.h"
#include "sim/base.h"
#include "tests/support/no_alloc_guard.h"
#include "tests/support/watched_robot.h"

namespace runtime {
namespace supervisor_test {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;

/// Commands a constant torque; reports what the test sets.
class Pusher final : public Task {
 public:
  void read(const Moment& moment) noexcept override {
    phase = moment.phase;
    fastest_rad_per_s = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      fastest_rad_per_s = std::max(fastest_rad_per_s, std::abs(moment.sample.joints[i].velocity_rad_per_s));
      sent_Nm[i] = moment.sent.joints[i].target;
    }
    enabled = moment.sample.enabled;
  }
  bool can_brake_after_pause(const Moment& /*moment*/) noexcept override { return brakes_after_pause; }
  Verdict wait(const Moment& /*moment*/) noexcept override {
    ++waits;
    return while_waiting;
  }
  Verdict begin(const Moment& /*moment*/, hal::RobotCommand& /*command*/) noexcept override {
    ++begins;
    return {};
  }
  Verdict step(const Moment& /*moment*/, hal::RobotCommand& command) noexcept override {
    ++steps;
    for (std::size_t i = 0; i < 4; ++i) command.joints[i] = hal::JointCommand::torque_Nm(kPush_Nm);
    return next;
  }
  Verdict brake(const Moment& moment, hal::RobotCommand& command, double& fastest) noexcept override {
    ++brakes;
    for (std::size_t i = 0; i < 4; ++i)
      command.joints[i] = hal::JointCommand::torque_Nm(-0.2 * moment.sample.joints[i].velocity_rad_per_s);
    fastest = seen_rad_per_s.value_or(fastest_rad_per_s);
    return while_braking;
  }

  static constexpr double kPush_Nm = 1.0;
  std::chrono::nanoseconds brake_timeout() const noexcept override { return longest_brake; }

  std::chrono::nanoseconds longest_brake = kBrakeTimeout;
  Verdict while_waiting{};
  Verdict next{};
  Verdict while_braking{};
  bool brakes_after_pause = true;
  std::optional<double> seen_rad_per_s{};

  Phase phase{};
  bool enabled = false;
  std::array<double, 4> sent_Nm{};
  double fastest_rad_per_s = 0;
  int waits = 0;
  int begins = 0;
  int steps = 0;
  int brakes = 0;
};

/// Its drives go off without a fault, as by an emergency stop that only cuts their power.
class GoesOff final : public hal::RobotWrapper {
 public:
  using RobotWrapper::RobotWrapper;
  hal::CycleStatus exchange(const hal::RobotCommand& command, hal::RobotSample& sample) noexcept override {
    const hal::CycleStatus status = RobotWrapper::exchange(off ? hal::RobotCommand{} : command, sample);
    sample.enabled = sample.enabled && !off;
    return status;
  }
  bool off = false;
};

struct Rig {
  explicit Rig(const Supervisor::Config& config = {}) : supervisor(config, robot, task) {
    robot.watch.allow_enables(1);
    robot.activate();
  }
  void run(nanoseconds duration) {
    for (const nanoseconds end = clock.now() + duration; clock.now() < end && !supervisor.finished();)
      step(1ms);
  }
  void step(nanoseconds later) {
    clock.sleep_until(clock.now() + later);
    supervisor.step(clock.now());
  }

  hal::VirtualClock clock;
  sim::Base base{sim::BaseParameters{}};
  support::WatchedLoopback robot{
      base, clock, 1ms, {{"wheel-1", 2.4}, {"wheel-2", 2.4}, {"wheel-3", 2.4}, {"wheel-4", 2.4}}};
  Pusher task;
  Supervisor supervisor;
};

TEST(Supervisor, ATaskBeginsOnceWithDrivesThatObeyAndEndsAtRestWithDrivesThatAreOff) {
  Rig rig({.rest_rad_per_s = 0.1});  // a reported velocity is coarse
  rig.run(300ms);
  EXPECT_EQ(rig.task.phase, Phase::kRunning);
  EXPECT_EQ(rig.task.begins, 1);
  EXPECT_GE(rig.task.waits, 1) << "while the drives do not obey";
  ASSERT_GT(rig.task.fastest_rad_per_s, 0.5);
  rig.task.next = {.next = Verdict::Next::kBrake};
  rig.run(5s);
  EXPECT_TRUE(rig.supervisor.finished());
  EXPECT_EQ(rig.task.phase, Phase::kOff);
  EXPECT_FALSE(rig.supervisor.stop_reason()) << "it came to its end";
  EXPECT_LT(rig.base.twist().head<2>().norm(), 0.15 * 0.0475) << "0.1 rad/s, as a noisy reading sees it";
  EXPECT_FALSE(rig.task.enabled);
  EXPECT_EQ(rig.task.begins, 1);
}

TEST(Supervisor, ATaskThatIsToBrakeIsNotStepped) {
  Rig rig;
  rig.run(100ms);
  const int steps = rig.task.steps;
  rig.supervisor.request_stop();
  rig.run(10ms);
  EXPECT_EQ(rig.task.steps, steps);
  EXPECT_GE(rig.task.brakes, 10);
}

TEST(Supervisor, AFailureIsOffInTheNextExchangeAndItsReasonIsPutIntoTheTasksWords) {
  Rig rig;
  rig.run(100ms);
  rig.task.next = {.next = Verdict::Next::kFail,
                   .reason = {.kind = StopReason::Kind::kOverspeed,
                              .text = "{joint} turned at {value:.1f} rad/s, of which {limit:g} may be",
                              .joint = 2,
                              .value = 14.25,
                              .limit = 12}};
  rig.step(1ms);
  rig.step(1ms);
  EXPECT_FALSE(rig.task.enabled);
  EXPECT_EQ(rig.task.phase, Phase::kFaulted);
  EXPECT_EQ(what(rig.supervisor.stop_reason(), rig.robot),
            "wheel-3 turned at 14.2 rad/s, of which 12 may be");
  EXPECT_EQ(describe(rig.supervisor.stop_reason(), rig.robot),
            "cycle 101 (0.100 s): wheel-3 turned at 14.2 rad/s, of which 12 may be");
}

TEST(Supervisor, AFailureWhileBrakingIsOffAtOnceAndBothReasonsAreKept) {
  Rig rig;
  rig.run(100ms);
  rig.task.next = {.next = Verdict::Next::kBrake,
                   .reason = {.kind = StopReason::Kind::kOutside, .text = "outside"}};
  rig.task.while_braking = {.next = Verdict::Next::kFail,
                            .reason = {.kind = StopReason::Kind::kOverspeed, .text = "too fast"}};
  rig.run(2ms);
  EXPECT_EQ(rig.task.brakes, 1);
  EXPECT_EQ(rig.task.phase, Phase::kFaulted);
  EXPECT_EQ(rig.supervisor.stop_reason().kind, StopReason::Kind::kOutside);
  EXPECT_EQ(what(rig.supervisor.stop_reason(), rig.supervisor.cut_short_by(), rig.robot),
            "outside; before it came to rest, too fast");
}

TEST(Supervisor, APauseSendsNoOldTorqueThenBrakesOrIsOffAsTheTaskCan) {
  for (const bool brakes : {true, false}) {
    Rig rig;
    rig.task.brakes_after_pause = brakes;
    rig.run(100ms);
    ASSERT_EQ(rig.task.sent_Nm[0], Pusher::kPush_Nm);
    rig.step(101ms);
    EXPECT_EQ(rig.task.sent_Nm[0], 0.0);
    EXPECT_EQ(rig.task.brakes, brakes ? 1 : 0);
    EXPECT_EQ(rig.supervisor.stop_reason().kind, StopReason::Kind::kStalled);
    EXPECT_NE(what(rig.supervisor.stop_reason(), rig.robot).find("did not run for 0.101 s"),
              std::string::npos);
  }
}

TEST(Supervisor, ASpeedThatIsNotANumberIsNoRest) {
  Rig rig;
  rig.run(100ms);
  rig.task.seen_rad_per_s = std::numeric_limits<double>::quiet_NaN();
  rig.supervisor.request_stop();
  rig.run(1900ms);
  EXPECT_EQ(rig.task.phase, Phase::kStopping);
  rig.run(1s);
  EXPECT_TRUE(rig.supervisor.finished());
  EXPECT_EQ(rig.supervisor.stop_reason().kind, StopReason::Kind::kNotAtRest);
}

TEST(Supervisor, APauseWhileBrakingIsNoRestAndNoTimeToBrake) {
  Rig rig;
  rig.run(100ms);
  rig.task.seen_rad_per_s = 1;
  rig.supervisor.request_stop();
  rig.run(1900ms);
  // As a task that forgets its velocity reports it.
  rig.task.seen_rad_per_s = 0;
  rig.step(500ms);
  rig.run(20ms);
  EXPECT_EQ(rig.task.phase, Phase::kStopping) << "for 20 ms is not for kRestHold";
  EXPECT_FALSE(rig.supervisor.stop_reason()) << "1.9 s of braking, and a pause";
  rig.run(100ms);
  EXPECT_EQ(rig.task.phase, Phase::kOff);
}

TEST(Supervisor, ATaskThatFindsItsRestItselfIsOffWhenItSaysSoAndNotBefore) {
  Rig rig;
  rig.task.longest_brake = 10s;
  rig.task.seen_rad_per_s = std::numeric_limits<double>::infinity();
  rig.run(100ms);
  rig.supervisor.request_stop();
  rig.run(5s);
  EXPECT_EQ(rig.task.phase, Phase::kStopping) << "longer than other tasks may brake";
  rig.task.while_braking = {.next = Verdict::Next::kRest};
  rig.step(1ms);
  rig.step(1ms);
  EXPECT_FALSE(rig.task.enabled);
  EXPECT_EQ(rig.task.phase, Phase::kOff);
  EXPECT_FALSE(rig.supervisor.stop_reason());
}

TEST(Supervisor, ATaskMayFailBeforeTheDrivesObey) {
  Rig rig;
  rig.task.while_waiting = {.next = Verdict::Next::kFail,
                            .reason = {.kind = StopReason::Kind::kMasterFault, .text = "unplugged"}};
  rig.run(1s);
  EXPECT_TRUE(rig.supervisor.finished());
  EXPECT_EQ(rig.task.begins, 0);
  EXPECT_EQ(what(rig.supervisor.stop_reason(), rig.robot), "unplugged");
}

TEST(Supervisor, DrivesThatGoOffByThemselvesAreAFaultOfWhichTheTaskHearsInTheSameCycle) {
  Rig rig;
  GoesOff robot(rig.robot);
  Pusher task;
  Supervisor supervisor({}, robot, task);
  const auto run = [&](int cycles) {
    for (int n = 0; n < cycles; ++n) {
      rig.clock.sleep_until(rig.clock.now() + 1ms);
      supervisor.step(rig.clock.now());
    }
  };
  run(100);
  ASSERT_EQ(task.phase, Phase::kRunning);
  const int waits = task.waits;
  robot.off = true;
  run(1);
  EXPECT_EQ(task.waits, waits + 1);
  EXPECT_EQ(supervisor.stop_reason().kind, StopReason::Kind::kNotObeying);
  run(1);
  EXPECT_EQ(task.sent_Nm[0], 0.0);
}

TEST(Supervisor, APauseBeforeTheDrivesObeyStopsNothing) {
  Rig rig;
  GoesOff robot(rig.robot);
  robot.off = true;
  Pusher task;
  Supervisor supervisor({}, robot, task);
  for (const nanoseconds later : {1ms, 500ms, 1ms}) {
    rig.clock.sleep_until(rig.clock.now() + later);
    supervisor.step(rig.clock.now());
  }
  EXPECT_EQ(task.phase, Phase::kStarting);
  EXPECT_FALSE(supervisor.stop_reason());
}

TEST(Supervisor, AStopBeforeTheDrivesObeyBeginsNothing) {
  Rig rig;
  rig.step(1ms);
  rig.supervisor.request_stop();
  rig.run(1s);
  EXPECT_TRUE(rig.supervisor.finished());
  EXPECT_EQ(rig.task.begins, 0);
}

TEST(Supervisor, DoesNotAllocateOrLockInTheCycle) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the allocation guard is off under a sanitizer";
  Rig rig;
  const support::NoAllocGuard guard;
  rig.run(200ms);
  rig.task.next = {.next = Verdict::Next::kBrake,
                   .reason = {.kind = StopReason::Kind::kBehind, .text = "behind"}};
  rig.run(5s);
  EXPECT_EQ(guard.violations(), 0);
  EXPECT_TRUE(rig.supervisor.finished());
}

}  // namespace supervisor_test
}  // namespace runtime
