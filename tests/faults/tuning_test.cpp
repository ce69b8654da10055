// Settings during a teleoperation, as a client of the daemon makes them.
#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <string>

#include "tests/faults/world.h"
#include "tests/support/recording.h"

namespace tuning_test {

using namespace std::chrono_literals;
using faults::Reply;
using faults::World;

constexpr std::uint64_t kCommander = 1;
constexpr std::uint64_t kAnother = 2;

Reply ask(World& world, const std::string& request, std::uint64_t client = kCommander) {
  return world.ask(client, request).value_or(Reply{.error = "no answer", .status = {}});
}

/// The commander stays alive until the run is in this phase.
testing::AssertionResult comes_to(World& world, const std::string& phase) {
  std::string last;
  for (int tenth = 0; tenth < 900 && last != phase; ++tenth) {
    for (int i = 0; i < 100; ++i) world.step();
    last = ask(world, "alive").status.value("phase", "");
  }
  return last == phase ? testing::AssertionSuccess() : testing::AssertionFailure() << last;
}

void run_for_three_seconds(World& world) {
  for (int tenth = 0; tenth < 30; ++tenth) {
    for (int i = 0; i < 100; ++i) world.step();
    (void)ask(world, "alive");
  }
}

/// Disables, and reads the recording of the run.
double stiffness_at_the_end(World& world) {
  EXPECT_TRUE(ask(world, "disable").ok);
  for (int i = 0; i < 500; ++i) world.step();
  return support::Recording(world.recordings() / "run-1" / "teleoperation.csv")["stiffness_N_per_m"].back();
}

bool contains(const std::string& text, const std::string& part) { return text.find(part) != text.npos; }

TEST(Tuning, ActsDuringTheRunForItsCommanderWithinTheFilesBounds) {
  World world(faults::Machine::kManipulator, 1);
  world.start_daemon();
  ASSERT_TRUE(world.daemon_runs()) << world.start_error();
  for (int i = 0; i < 2000 && !ask(world, "enable").ok; ++i) world.step();
  ASSERT_TRUE(comes_to(world, "operating"));
  const auto stiff = [&](double share) {
    return "set teleoperation.coupling.stiff_N_per_m " +
           std::to_string(share * world.config().teleoperation.stiff.translation_N_per_m);
  };

  EXPECT_TRUE(contains(ask(world, stiff(0.9), kAnother).error, "commands; stop it first"));
  EXPECT_TRUE(contains(ask(world, stiff(1.1)).error, "allows no more than"));
  EXPECT_TRUE(contains(ask(world, stiff(0.01)).error, "soft_N_per_m"));
  const Reply later = ask(world, "set teleoperation.arm.payload_kg 0");
  EXPECT_FALSE(later.ok);
  EXPECT_TRUE(contains(later.error, "acts from the next enable on")) << later.error;
  EXPECT_TRUE(contains(later.error, "teleoperation.mapping.rate_m_per_s")) << later.error;
  EXPECT_TRUE(ask(world, "status").status["settings"].empty());

  EXPECT_TRUE(ask(world, stiff(0.9)).ok);
  EXPECT_EQ(ask(world, "status").status["settings"].size(), 1);
  ASSERT_TRUE(comes_to(world, "operating"));
  run_for_three_seconds(world);
  EXPECT_NEAR(stiffness_at_the_end(world), 0.9 * world.config().teleoperation.stiff.translation_N_per_m,
              1e-3);
}

TEST(Tuning, OfAFileThatIsEditedDuringTheRunNothingActs) {
  World world(faults::Machine::kManipulator, 1);
  world.start_daemon();
  ASSERT_TRUE(world.daemon_runs()) << world.start_error();
  for (int i = 0; i < 2000 && !ask(world, "enable").ok; ++i) world.step();
  ASSERT_TRUE(comes_to(world, "operating"));
  const double stiff_N_per_m = world.config().teleoperation.stiff.translation_N_per_m;
  std::ofstream(world.folder() / "youbotd.toml",
                std::ios::app)  // in its last table, [teleoperation.coupling]
      << "stiff_N_per_m = " << 2 * stiff_N_per_m << '\n';
  const auto more = "set teleoperation.coupling.stiff_N_per_m " + std::to_string(1.5 * stiff_N_per_m);
  EXPECT_FALSE(ask(world, more).ok) << "the ceiling of the edited file";
  EXPECT_TRUE(ask(world, "set teleoperation.mapping.motion_scale 0.5").ok);
  run_for_three_seconds(world);
  EXPECT_NEAR(stiffness_at_the_end(world), stiff_N_per_m, 1e-3);
}

}  // namespace tuning_test
