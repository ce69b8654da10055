#include "runtime/loop.h"

#include <gtest/gtest.h>

#include <vector>

#include "operation/base_recording.h"
#include "operation/base_task.h"
#include "operation/path_metrics.h"
#include "runtime/recording/flight_recorder.h"
#include "runtime/recording/recorder.h"
#include "sim/base.h"
#include "tests/support/no_alloc_guard.h"
#include "tests/support/watched_robot.h"

namespace operation {
namespace loop_test {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;

/// Time passes only by sleeping and by the delays a test puts into chosen cycles.
class ScriptedClock final : public hal::Clock {
 public:
  nanoseconds now() const noexcept override { return now_; }
  void sleep_until(nanoseconds deadline) noexcept override {
    deadlines.push_back(deadline);
    if (deadline > now_) now_ = deadline;
    now_ += wake_up_delay;
  }
  void pass(nanoseconds duration) noexcept { now_ += duration; }
  std::vector<nanoseconds> deadlines;
  nanoseconds wake_up_delay{};

 private:
  nanoseconds now_{100s};
};

class IdleRobot final : public hal::Robot {
 public:
  std::span<const hal::JointInfo> joints() const noexcept override { return joints_; }
  void activate() override {}
  void deactivate() noexcept override {}
  hal::CycleStatus exchange(const hal::RobotCommand& command, hal::RobotSample& sample) noexcept override {
    sample.enabled = command.enable;
    return {};
  }

 private:
  std::vector<hal::JointInfo> joints_{4, {"wheel", 3.0}};
};

struct Holding final : MotionSource {
  void begin(nanoseconds, const control::PlanarPose&) noexcept override {}
  Motion read(nanoseconds now, const control::PlanarPose&) noexcept override { return {now, {}, false}; }
};

struct Loop {
  ScriptedClock clock;
  IdleRobot robot;
  Holding motion;
  Cycle cycle{Cycle::Config{}, robot, motion, nullptr};
  runtime::LoopStatistics statistics;

  /// Runs for `cycles` periods of robot time; `disturb(n)` acts after cycle n, counted from 1.
  template <typename Disturb>
  void run(int cycles, Disturb&& disturb) {
    int n = 0;
    runtime::run_loop(
        clock, 1ms, cycle, [&](nanoseconds elapsed) { return elapsed >= cycles * 1ms; },
        [&](const CycleRecord&) { disturb(++n); }, statistics);
  }
};

TEST(Loop, DeadlinesAreAbsoluteSoLateWakeUpsDoNotDrift) {
  Loop loop;
  loop.clock.wake_up_delay = 300us;
  loop.run(50, [](int) {});
  for (std::size_t i = 0; i < loop.clock.deadlines.size(); ++i)
    EXPECT_EQ(loop.clock.deadlines[i], 100s + static_cast<int>(i + 1) * 1ms);
  EXPECT_EQ(loop.statistics.overruns, 0U);
  EXPECT_EQ(loop.statistics.wake_up.worst(), 300us);
}

TEST(Loop, AnOverrunSkipsTheMissedDeadlinesKeepsThePhaseAndCounts) {
  Loop loop;
  loop.run(50, [&](int n) {
    if (n == 10) loop.clock.pass(3500us);  // over the next three deadlines, before the fourth
  });
  EXPECT_EQ(loop.statistics.overruns, 3U);
  EXPECT_EQ(loop.clock.deadlines[9], 100s + 10ms);
  EXPECT_EQ(loop.clock.deadlines[10], 100s + 14ms);
}

TEST(Loop, AllThatAYoubotdCycleDoesNeitherAllocatesNorLocks) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns the allocator";
  hal::VirtualClock clock;
  sim::Base base{sim::BaseParameters{}};
  support::WatchedLoopback robot(base, clock, 1ms, {{"1", 2.4}, {"2", 2.4}, {"3", 2.4}, {"4", 2.4}});
  robot.activate();
  PathSource motion({{}, {{0.05, 0.02, 0.3}}, 0.1, {}});
  Cycle cycle(Cycle::Config{}, robot, motion, &base.pose());
  PathMetrics metrics;
  runtime::FlightRecorder<CycleRecord> flight_recorder(1000);
  std::uint64_t written = 0;
  runtime::Recorder<CycleRecord> recorder(
      65536, [&written](const CycleRecord&) { ++written; }, [] {});
  runtime::LoopStatistics statistics;
  {
    const support::NoAllocGuard guard;
    runtime::run_loop(
        clock, 1ms, cycle, [](nanoseconds) { return false; },
        [&](const CycleRecord& record) {
          metrics.add(record);
          flight_recorder.add(record);
          recorder.push(record);
        },
        statistics);
    EXPECT_EQ(guard.violations(), 0);
  }
  recorder.stop();
  EXPECT_GT(statistics.cycles, 5000U);  // the path takes some seconds
  EXPECT_EQ(written, statistics.cycles);
  EXPECT_TRUE(metrics.first_motion().has_value());
}

TEST(Loop, EveryCycleIsCountedAndTimed) {
  Loop loop;
  int seen = 0;
  loop.run(200, [&](int n) { seen = n; });
  EXPECT_EQ(loop.statistics.cycles, static_cast<std::uint64_t>(seen));
  EXPECT_EQ(loop.statistics.step.count(), loop.statistics.cycles);
  EXPECT_EQ(loop.statistics.robot_time, loop.clock.deadlines.back() - 100s);
}

}  // namespace loop_test
}  // namespace operation
