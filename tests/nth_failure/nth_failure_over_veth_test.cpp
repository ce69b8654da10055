// The n-th failure of programs on a bus: youbotd and youbot-bench with youbot-sim, in two namespaces. The
// simulation is in lock-step, a millisecond per frame, so that its record of the drives is exact on any
// machine.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "drivers/ethercat/frame.h"
#include "drivers/ethercat/raw_socket_link.h"
#include "drivers/ethercat/registers.h"
#include "tests/nth_failure/failures.h"
#include "tests/nth_failure/results.h"
#include "tests/support/built_paths.h"
#include "tests/support/process.h"
#include "tests/support/recorded_robot.h"
#include "tests/support/skip.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/veth.h"

namespace nth_failure {
namespace {

namespace fs = std::filesystem;
using support::CommandResult;
using support::Process;

/// The boards' watchdog time, twice: once for the observation.
constexpr int kAfterwards_ms = 200;
constexpr std::size_t kLookedAt_ms = 90;
/// Of the calls that are made with every frame.
constexpr std::size_t kAtMostPerFrame = 12;

const char* const kVeryShortPath =
    "[path]\nrest_s = 0.02\nspeed_m_per_s = 0.2\nacceleration_m_per_s2 = 1.0\n[[path.leg]]\nforward_m = "
    "0.005\n";

class NthFailureOverVeth : public testing::Test {
 protected:
  void SetUp() override {
    SKIP_UNLESS(namespaces.usable(), "needs root and network namespaces");
    fs::create_directory(folder / "tmp");
  }
  std::vector<std::string> daemon() const {
    return {support::program("youbotd"), "--config",       folder / "path.toml", "--robot",
            "ethercat:veth-c",           "--virtual-time", "--record-csv",       folder / "out"};
  }
  std::vector<std::string> simulator() const {
    return {
        support::program("youbot-sim"), "--interface", "veth-s", "--robot", "base", "--lock-step", "--record",
        folder / "sim/seen.csv"};
  }
  /// In the simulator's namespace.
  std::vector<std::string> there(std::vector<std::string> words) const {
    words.insert(words.begin(), {"/usr/bin/env", "ip", "netns", "exec", namespaces.sim_namespace()});
    return words;
  }
  void clean() const {
    for (const char* left : {"out", "tmp", "counts", "sim"}) fs::remove_all(folder / left);
    for (const char* needed : {"tmp", "sim"}) fs::create_directory(folder / needed);
  }

  support::Namespaces namespaces;
  support::TemporaryDirectory folder;
  fs::path config = folder.write("path.toml", kVeryShortPath);
};

/// Lets the simulated robot's time go on after its master has gone, by frames that command nothing.
void let_time_pass(int milliseconds) {
  using namespace drivers::ethercat;
  RawSocketLink link("veth-c", RawSocketLink::Wait::kBlock);
  std::array<std::uint8_t, kMaxFrameBytes> reply{};
  for (int i = 0; i < milliseconds; ++i) {
    FrameWriter writer(MacAddress{2, 0, 0, 0, 0, 1});
    (void)writer.add(Command::kBrd, static_cast<std::uint8_t>(i), reg::kAlStatus, 2);
    if (link.send(writer.bytes())) (void)link.receive(reply, std::chrono::seconds(1));
  }
}

TEST_F(NthFailureOverVeth, NoTorqueIsLeftOnceYoubotdHasEnded) {
  const auto drive = [&](const std::optional<Failure>& failure, std::vector<std::string>& violations) {
    clean();
    CommandResult result;
    {
      const support::Server robot(
          namespaces,
          "env" +
              [&] {
                std::string words;
                for (const std::string& word : simulator()) words += " " + word;
                return words;
              }(),
          "serving");
      EXPECT_TRUE(robot.ready());
      result = Process(with_failure(folder / "counts", failure, daemon())).finish();
      let_time_pass(kAfterwards_ms);
    }
    violations = support::violations_of_record(support::Recording(folder / "sim/seen.csv"), 1, kLookedAt_ms);
    return result;
  };
  std::vector<std::string> violations;
  const CommandResult expected = drive({}, violations);
  ASSERT_EQ(expected.exit_code, 0) << expected.output;
  ASSERT_EQ(violations, std::vector<std::string>{});
  const std::vector<Failure> failures =
      some_of(failures_of(read_counts(folder / "counts"), 2, kAtMostPerFrame), 14);
  for (const Failure& failure : failures) {
    const CommandResult result = drive(failure, violations);
    std::vector<std::string> flaws = flaws_of_end(failure, result, 0);
    flaws.insert(flaws.end(), violations.begin(), violations.end());
    if (failure.call != "unlink" && failure.call != "remove")
      for (const std::string& file : torn(Results::of(folder / "out"))) flaws.push_back(file + " is torn");
    const bool refused = result.exit_code == 2 || result.exit_code == 3;
    if (refused && failure.call != "unlink" && failure.call != "remove" && failure.call != "rmdir" &&
        fs::exists(folder / "out"))
      flaws.emplace_back("did not begin and left its folder");
    report(failure, result, flaws);
  }
  std::printf("%zu failures\n", failures.size());
}

TEST_F(NthFailureOverVeth, YoubotSimEndsOrServes) {
  const auto serve = [&](const std::optional<Failure>& failure, CommandResult& master) {
    clean();
    Process robot(there(with_failure(folder / "counts", failure, simulator())));
    if (robot.wait_for("serving"))
      master = Process(with_failure(folder / "not-counted", {}, daemon())).finish();
    robot.signal(SIGTERM);
    return robot.finish();
  };
  CommandResult master;
  const CommandResult expected = serve({}, master);
  ASSERT_EQ(expected.exit_code, 0) << expected.output;
  ASSERT_EQ(master.exit_code, 0) << master.output;
  const std::vector<Failure> failures =
      some_of(failures_of(read_counts(folder / "counts"), 2, kAtMostPerFrame), 10);
  for (const Failure& failure : failures) {
    master = {.exit_code = 0};
    const CommandResult result = serve(failure, master);
    std::vector<std::string> flaws = flaws_of_end(failure, result, 0);
    if (!std::set{0, 3, 4}.contains(master.exit_code))
      flaws.push_back("its master ended with " + std::to_string(master.exit_code) + ": " + master.output);
    if (failure.is_silent() && master.exit_code != 0) flaws.push_back("its master noticed: " + master.output);
    for (const std::string& file : torn(Results::of(folder / "sim"))) flaws.push_back(file + " is torn");
    report(failure, result, flaws);
  }
  std::printf("%zu failures\n", failures.size());
}

TEST_F(NthFailureOverVeth, YoubotBenchScansOrSaysWhyNot) {
  const support::Simulator robot(namespaces, "--robot base --lock-step");
  ASSERT_TRUE(robot.ready());
  const auto scan = [&](const std::optional<Failure>& failure) {
    clean();
    return Process(with_failure(folder / "counts", failure,
                                {support::program("youbot-bench"), "scan", "--robot", "ethercat:veth-c"}))
        .finish();
  };
  const CommandResult expected = scan({});
  ASSERT_EQ(expected.exit_code, 0) << expected.output;
  const std::vector<Failure> failures =
      some_of(failures_of(read_counts(folder / "counts"), 4, kAtMostPerFrame), 24);
  for (const Failure& failure : failures) {
    const CommandResult result = scan(failure);
    report(failure, result, flaws_of_end(failure, result, 0));
  }
  std::printf("%zu failures\n", failures.size());
}

}  // namespace
}  // namespace nth_failure
