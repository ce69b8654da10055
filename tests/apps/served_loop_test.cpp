// The cycle that executes orders, with observable runs.
#include "apps/youbotd/served_loop.h"

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <variant>
#include <vector>

#include "tests/support/no_alloc_guard.h"

namespace served_loop_test {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;
using youbotd::LoopReport;
using youbotd::Orders;
using youbotd::ServedLoop;

class IdleRobot final : public hal::Robot {
 public:
  std::span<const hal::JointInfo> joints() const noexcept override { return {}; }
  void activate() override {}
  void deactivate() noexcept override {}
  hal::CycleStatus exchange(const hal::RobotCommand& command, hal::RobotSample& sample) noexcept override {
    sample = measured;
    ++exchanges;
    was_enabled = was_enabled || command.enable;
    return status;
  }
  int exchanges = 0;
  bool was_enabled = false;
  hal::CycleStatus status{};
  hal::RobotSample measured{};
};

/// Comes to rest three steps after the request, because a real one takes time.
class ScriptedRun final : public operation::Run {
 public:
  void step(nanoseconds) noexcept override {
    ++steps;
    was_stopping_in_step = stopping;
    if (stopping && --left == 0) over = true;
  }
  void request_stop() noexcept override { stopping = true; }
  void switch_off() noexcept override { over = off = true; }
  bool finished() const noexcept override { return over; }
  void keep() noexcept override { longest_step = std::max(longest_step, times_.step); }
  operation::Progress progress() const noexcept override {
    operation::Progress progress;
    progress.phase = "running";
    return progress;
  }
  void wrap_up(const drivers::ethercat::PcapRing*) override {}
  operation::RunSummary& summary() noexcept override { return summary_; }

  int steps = 0;
  int left = 3;
  bool stopping = false;
  bool was_stopping_in_step = false;
  bool off = false;
  bool over = false;
  nanoseconds longest_step{};

 private:
  operation::RunSummary summary_;
};

struct ServedLoopTest : testing::Test {
  void cycle(int count = 1) {
    for (int i = 0; i < count; ++i) {
      loop.step(now += 1ms);
      loop.record() = {.wake_up = 1us, .step = 7us};
      loop.keep();
    }
    (void)loop.take(report);
  }
  Orders begin() {
    const Orders orders{.number = 1, .run = &run};
    loop.order(orders);
    cycle();
    return orders;
  }

  IdleRobot robot;
  static constexpr std::chrono::milliseconds kSilence{500};
  ServedLoop loop{robot, nullptr, nullptr, kSilence};
  ScriptedRun run;
  LoopReport report;
  nanoseconds now{};
};

TEST_F(ServedLoopTest, WithoutARunItKeepsTheBusAliveWithTheDrivesOff) {
  robot.status = {.fault = hal::Fault::kFrameLost};
  cycle(100);
  EXPECT_EQ(robot.exchanges, 100);
  EXPECT_FALSE(robot.was_enabled);
  EXPECT_EQ(report.cycles, 100U);
  EXPECT_EQ(report.robot.fault, hal::Fault::kFrameLost) << "a query returns the robot's state";
  EXPECT_STREQ(report.progress.phase, "off");
}

TEST_F(ServedLoopTest, DoesARunOnceHoweverOftenItIsOrdered) {
  Orders orders = begin();
  EXPECT_EQ(run.steps, 1);
  EXPECT_EQ(robot.exchanges, 0) << "the run has the robot";
  EXPECT_STREQ(report.progress.phase, "running");
  run.over = true;
  cycle();
  EXPECT_EQ(report.ended, 1U);
  for (int i = 0; i < 10; ++i) {
    loop.order(orders);
    cycle();
  }
  EXPECT_EQ(run.steps, 2);
  ScriptedRun next;
  loop.order({.number = 2, .run = &next});
  cycle();
  EXPECT_EQ(next.steps, 1);
  EXPECT_EQ(run.longest_step, 7us) << "what the loop measured reaches the run";
}

TEST_F(ServedLoopTest, StopBringsToRestAndOffSwitchesOff) {
  Orders orders = begin();
  orders.stop = true;
  loop.order(orders);
  cycle();
  EXPECT_TRUE(run.stopping);
  EXPECT_EQ(report.ended, 0U) << "it is not at rest yet";
  EXPECT_FALSE(run.off);
  orders.off = true;
  loop.order(orders);
  cycle();
  EXPECT_TRUE(run.off);
  EXPECT_EQ(report.ended, 1U);
  EXPECT_FALSE(report.unheard);
}

TEST_F(ServedLoopTest, AnOrderThatIsStoppedAtOnceIsNotBegun) {
  for (std::uint64_t number = 1; number <= 2; ++number) {
    loop.order({.number = number, .run = &run, .stop = number == 1, .off = number == 2});
    cycle(3);
    EXPECT_EQ(run.steps, 0);
    EXPECT_EQ(report.ended, number) << "it ends at once";
  }
}

TEST_F(ServedLoopTest, ComesToRestWhenOrdersStopArriving) {
  const Orders orders = begin();
  cycle(static_cast<int>(kSilence / 1ms));
  EXPECT_FALSE(run.stopping);
  cycle(2);
  EXPECT_TRUE(run.stopping);
  cycle(10);
  EXPECT_EQ(report.ended, 1U);
  EXPECT_TRUE(report.unheard) << "so that the reason has a name";
  loop.order(orders);
  cycle(10);
  EXPECT_STREQ(report.progress.phase, "off") << "it does not begin again by itself";
}

// A run that stops for the pause by itself says why, so it sees it first; one that would go on, such as one
// whose drives do not obey yet, is called off, also when new orders have come meanwhile.
TEST_F(ServedLoopTest, ARunThatTheLoopSleptThroughIsCalledOffOnceItHasSeenThePause) {
  for (const bool ordered : {false, true}) {
    SCOPED_TRACE(ordered);
    ScriptedRun own;
    const Orders orders{.number = ordered ? 2U : 1U, .run = &own};
    loop.order(orders);
    cycle();
    const int steps = own.steps;
    now += 10 * kSilence;
    if (ordered) loop.order(orders);
    cycle();
    EXPECT_EQ(own.steps, steps + 1);
    EXPECT_FALSE(own.was_stopping_in_step) << "the run is to see the pause before it is called off";
    EXPECT_TRUE(own.stopping);
    EXPECT_TRUE(report.unheard);
    cycle(10);
    EXPECT_EQ(report.ended, orders.number);
  }
}

TEST_F(ServedLoopTest, AShorterPauseOfTheLoopIsNoSilenceOfOthers) {
  const Orders orders = begin();
  now += kSilence - 1ms;
  cycle();
  EXPECT_FALSE(run.stopping);
  loop.order(orders);
  cycle(10);
  EXPECT_FALSE(run.stopping) << "both slept";
  cycle(static_cast<int>(kSilence / 1ms) + 2);
  EXPECT_TRUE(run.stopping);
}

TEST_F(ServedLoopTest, ARunThatNeverBeganIsNotEndedForWantOfOrders) {
  (void)begin();
  cycle(static_cast<int>(kSilence / 1ms) + 20);
  ASSERT_TRUE(report.unheard);
  loop.order({.number = 2, .run = &run, .stop = true});
  cycle(3);
  EXPECT_EQ(report.ended, 2U);
  EXPECT_FALSE(report.unheard);
}

/// Counts the calls to it.
class CountedMaster final : public hal::HapticDevice {
 public:
  const hal::HapticInfo& info() const noexcept override { return info_; }
  void activate() override {}
  bool deactivate() noexcept override { return true; }
  hal::HapticStatus exchange(const hal::HapticCommand&, hal::HapticSample&) noexcept override {
    ++exchanges;
    return status;
  }
  std::string describe(const hal::HapticStatus&) const override { return {}; }
  int exchanges = 0;
  hal::HapticStatus status{.fault = hal::HapticFault::kUnplugged};

 private:
  hal::HapticInfo info_;
};

TEST_F(ServedLoopTest, ItsReportSaysWhichOrdersItFollows) {
  CountedMaster master;
  ServedLoop with_master{robot, &master, nullptr, kSilence};
  const auto step = [&] {
    with_master.step(now += 1ms);
    with_master.keep();
    (void)with_master.take(report);
  };
  with_master.order({.serial = 1, .leave_master = true});
  EXPECT_LT(report.heard, 1U);
  step();
  EXPECT_EQ(report.heard, 1U);
  EXPECT_TRUE(report.master_left);
  EXPECT_EQ(master.exchanges, 0);

  // Opened and at once to be left again, as when what came after the opening failed: that it was left once
  // is old news, and between the two orders it was not.
  with_master.order({.serial = 2});
  step();
  with_master.order({.serial = 3, .leave_master = true});
  (void)with_master.take(report);
  EXPECT_LT(report.heard, 3U);
  step();
  EXPECT_EQ(report.heard, 3U);
  EXPECT_TRUE(report.master_left);
  EXPECT_EQ(master.exchanges, 1) << "of the second order";

  // The same for a fault: it is back after it is reopened.
  EXPECT_EQ(report.master.fault, hal::HapticFault::kUnplugged);
  master.status = {};
  with_master.order({.serial = 4});
  step();
  EXPECT_EQ(report.heard, 4U);
  EXPECT_TRUE(report.master.ok());
}

TEST_F(ServedLoopTest, RestsWithoutAnOrderAndGoesOn) {
  begin();
  loop.rest();
  cycle();
  EXPECT_TRUE(run.stopping);
  cycle(5);
  EXPECT_EQ(report.ended, 1U);
  EXPECT_FALSE(report.unheard);
  ScriptedRun next;
  loop.order({.number = 2, .run = &next});
  cycle();
  EXPECT_EQ(next.steps, 0) << "no other begins";
  EXPECT_EQ(report.ended, 2U);
  EXPECT_GT(robot.exchanges, 0) << "the bus stays alive";
  EXPECT_FALSE(loop.finished());
}

TEST_F(ServedLoopTest, EndsOnlyAfterTheRunHasComeToRest) {
  begin();
  loop.request_stop();
  EXPECT_FALSE(loop.finished());
  cycle();
  EXPECT_TRUE(run.stopping);
  EXPECT_FALSE(loop.finished());
  cycle(5);
  EXPECT_TRUE(loop.finished());
}

TEST_F(ServedLoopTest, WithoutARunAPageShowsWhatTheJointsMeasure) {
  robot.measured.joints[0].position_rad = 0.25;
  robot.measured.joints[3].torque_Nm = -0.5;
  hal::SteadyClock feed_clock;
  operation::LiveFeed feed{feed_clock};
  operation::LiveFeed::Reader& reader = feed.add_reader();
  ServedLoop shown(robot, nullptr, nullptr, kSilence, &feed);
  shown.step(1ms);
  shown.record() = {.wake_up = 1us, .step = 7us};
  shown.keep();
  operation::LiveSample sample;
  ASSERT_TRUE(reader.take(sample));
  EXPECT_FALSE(sample.running);
  const auto& base = std::get<operation::CycleRecord>(sample.record);
  EXPECT_EQ(base.position_rad, (std::array<double, 4>{0.25, 0, 0, 0}));
  EXPECT_EQ(base.torque_measured_Nm, (std::array<double, 4>{0, 0, 0, -0.5}));
  EXPECT_EQ(base.phase, operation::Phase::kOff);
  EXPECT_EQ(feed.step().counts()[3], 1U) << "from 5 to 10 us";
}

TEST_F(ServedLoopTest, NeitherAllocatesNorLocks) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc";
  const support::NoAllocGuard guard;
  begin();
  cycle(100);
  loop.order({.number = 1, .run = &run, .stop = true});
  cycle(100);
  EXPECT_EQ(guard.violations(), 0);
  EXPECT_EQ(report.ended, 1U);
}

}  // namespace served_loop_test
