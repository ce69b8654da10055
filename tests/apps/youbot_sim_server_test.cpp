// youbot-sim's server with the test's clock.
#include "apps/youbot_sim/server.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <deque>
#include <vector>

#include "drivers/ethercat/frame.h"

namespace youbot_sim {
namespace youbot_sim_server_test {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;

/// Frames at given times, and a processor that may be taken from the server.
class ScriptedPort final : public FramePort {
 public:
  explicit ScriptedPort(sim::bus::YoubotBus& robot) : robot_(robot) {}

  struct Arrival {
    nanoseconds came{};
    nanoseconds held_up{};  ///< from then until the server runs again
  };
  std::deque<Arrival> arrivals;
  struct Answer {
    nanoseconds at{};
    nanoseconds robots_time{};
  };
  std::vector<Answer> answers;
  nanoseconds longest_sleep{};

  Frame receive(std::span<std::uint8_t> buffer, nanoseconds timeout) noexcept override {
    longest_sleep = std::max(longest_sleep, timeout);
    if (arrivals.empty() || arrivals.front().came > now_ + timeout) {
      now_ += timeout;
      return {};
    }
    const Arrival arrival = arrivals.front();
    arrivals.pop_front();
    now_ = std::max(now_, arrival.came) + arrival.held_up;
    drivers::ethercat::FrameWriter writer;
    writer.add(drivers::ethercat::Command::kBrd, 0, 0, 1);
    std::ranges::copy(writer.bytes(), buffer.begin());
    return {.size = writer.bytes().size(), .came = arrival.came};
  }
  bool send(std::span<const std::uint8_t> /*frame*/) noexcept override {
    answers.push_back({.at = now_, .robots_time = robot_.wire().now()});
    return true;
  }
  nanoseconds now() const noexcept override { return now_; }

 private:
  sim::bus::YoubotBus& robot_;
  nanoseconds now_ = 1h;
};

class Serving : public ::testing::Test {
 protected:
  ServerSummary run(nanoseconds duration) {
    const std::atomic<bool> stop = false;
    return serve(robot, port, duration, stop);
  }
  static sim::bus::YoubotBusOptions options() {
    sim::bus::YoubotBusOptions options;
    options.wire.timed = false;
    return options;
  }
  sim::bus::YoubotBus robot{options()};
  ScriptedPort port{robot};
};

TEST_F(Serving, AnAnswerIsOfNowAlsoWhenTheServerWasHeldUp) {
  for (int i = 1; i <= 40; ++i)
    port.arrivals.push_back({.came = 1h + i * 1ms + 300us, .held_up = i == 10 ? 27ms : 0ms});
  const ServerSummary summary = run(60ms);
  EXPECT_EQ(summary.answered, 40U);
  ASSERT_EQ(port.answers.size(), 40U);
  for (const ScriptedPort::Answer& answer : port.answers) EXPECT_EQ(answer.robots_time, answer.at - 1h);
  EXPECT_EQ(port.answers[9].at, 1h + 37'300us);
  EXPECT_EQ(summary.skipped, 0ns);
  // The frame that was held up, and those that queued behind it: after 27, 26, … 1 ms.
  EXPECT_EQ(summary.late.late, 27U);
  EXPECT_EQ(summary.late.longest, 27ms);
}

TEST_F(Serving, ALongHoldUpDoesNotPassForTheRobotAsAWhole) {
  port.arrivals.push_back({.came = 1h + 5500us, .held_up = 2s});
  const ServerSummary summary = run(2100ms);
  ASSERT_EQ(port.answers.size(), 1U);
  EXPECT_EQ(port.answers[0].robots_time, 55ms) << "50 ms of it: less than the boards' watchdogs";
  EXPECT_EQ(summary.skipped, 1950ms + 500us);
}

TEST_F(Serving, MechanicsMoveOnTimeBetweenFrames) {
  int periods = 0;
  robot.after_each_period([&] { ++periods; });
  const ServerSummary summary = run(20ms);
  EXPECT_EQ(periods, 20);
  EXPECT_LE(port.longest_sleep, 1ms);
  EXPECT_EQ(summary.late.late, 0U);
  EXPECT_EQ(report(summary, robot).find("later than"), std::string::npos);
}

TEST(Lateness, CountsWhatIsLaterThanAMasterWaitsAndKeepsTheLongest) {
  Lateness lateness;
  lateness.add(500us);
  EXPECT_EQ(lateness.total().late, 0U);
  EXPECT_FALSE(lateness.due(0s));
  lateness.add(501us);
  lateness.add(12ms);
  lateness.add(3ms);
  EXPECT_EQ(lateness.total().late, 3U);
  EXPECT_EQ(lateness.total().longest, 12ms);
  EXPECT_EQ(describe(lateness.total()), "3 answers came later than 0.5 ms, the longest after 12.0 ms");
}

TEST(Lateness, IsReportedAtOnceAndThenAtMostEveryFiveSeconds) {
  Lateness lateness;
  lateness.add(2ms);
  const auto first = lateness.due(100s);
  ASSERT_TRUE(first);
  EXPECT_EQ(describe(*first), "1 answer came later than 0.5 ms, the longest after 2.0 ms");
  EXPECT_FALSE(lateness.due(200s)) << "nothing new";
  lateness.add(1ms);
  const auto second = lateness.due(200s);
  ASSERT_TRUE(second);
  EXPECT_EQ(second->longest, 1ms) << "only what is new";
  lateness.add(9ms);
  EXPECT_FALSE(lateness.due(204999ms));
  lateness.add(4ms);
  const auto third = lateness.due(205s);
  ASSERT_TRUE(third);
  EXPECT_EQ(third->late, 2U);
  EXPECT_EQ(third->longest, 9ms);
  EXPECT_EQ(lateness.total().late, 4U);
}

}  // namespace youbot_sim_server_test
}  // namespace youbot_sim
