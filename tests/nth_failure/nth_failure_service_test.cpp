// The n-th failure of youbotd as a service, and of youbotctl that commands it: two programs on a real socket.
// The loop is slow and has long time-outs, so that a busy machine only takes longer.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "tests/nth_failure/failures.h"
#include "tests/nth_failure/results.h"
#include "tests/support/built_paths.h"
#include "tests/support/process.h"
#include "tests/support/temporary_directory.h"

namespace nth_failure {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using support::CommandResult;
using support::Process;

/// Most of the time they wait.
constexpr std::size_t kAtOnce = 8;
/// Calls like poll() go on for as long as the service does.
constexpr std::size_t kAtMost = 6;

/// A daemon and its clients in a separate folder.
struct Service {
  Service()
      : config(folder.write("base.toml",
                            "[loop]\nperiod_s = 0.01\ncommand_timeout_s = 2.0\ncommander_timeout_s = 2.0\n"
                            "[compensation]\nfilter_cutoff_rad_per_s = 50\n[path]\nspeed_m_per_s = 0.2\n"
                            "acceleration_m_per_s2 = 0.4\n[[path.leg]]\nforward_m = 0.1\n")) {
    fs::create_directory(folder / "tmp");
  }
  std::vector<std::string> daemon() const {
    return {support::program("youbotd"),
            "--config",
            config,
            "--control",
            folder / "s",
            "--allow-non-rt",
            "--record-csv",
            folder / "out"};
  }
  std::vector<std::string> ctl(std::vector<std::string> words) const {
    words.insert(words.begin(), {support::program("youbotctl"), "--socket", folder / "s"});
    return words;
  }
  /// Gives up after some seconds.
  std::vector<std::string> impatient(std::vector<std::string> words) const {
    return with_failure(folder / "not-counted", {}, ctl(std::move(words)), 4);
  }
  CommandResult tell(std::vector<std::string> words) const {
    return Process(impatient(std::move(words))).finish();
  }
  bool is_at_rest() const { return tell({"status", "--json"}).said("\"enabled\": false"); }
  bool comes_to_rest() const {
    for (const auto end = std::chrono::steady_clock::now() + 15s; std::chrono::steady_clock::now() < end;
         std::this_thread::sleep_for(20ms))
      if (is_at_rest()) return true;
    return false;
  }

  support::TemporaryDirectory folder;
  fs::path config;
};

/// Then the daemon can neither receive nor answer: it logs this, and the commander is lost.
bool makes_deaf(const Failure& failure) {
  static const std::set<std::string> kCalls{"accept4", "getsockopt", "poll", "recv", "send"};
  return failure.for_ever && kCalls.contains(failure.call);
}

/// Enables, drives a little, stops, ends the daemon.
CommandResult serve_once(const Service& service, const std::optional<Failure>& failure,
                         std::vector<std::string>& flaws) {
  Process youbotd(with_failure(service.folder / "counts", failure, service.daemon(), 40));
  // Not for a line of its log, which may be what fails.
  while (!fs::exists(service.folder / "s") && !youbotd.ended()) std::this_thread::sleep_for(5ms);
  (void)service.tell({"mode", "velocity"});
  (void)service.tell({"set", "limits.force_N", "4"});
  {
    Process commander(service.impatient({"enable"}));
    // A failure may refuse it, or end the connection.
    if (commander.wait_for("running")) (void)commander.say("set velocity 0.1 0 0");
    (void)service.tell({"status"});
    (void)service.tell({"stop"});
    commander.signal(SIGINT);
    (void)commander.finish();
  }
  const bool deaf = failure && makes_deaf(*failure);
  if (!deaf && !youbotd.ended() && !service.comes_to_rest())
    flaws.emplace_back("does not come to rest, or answer");
  youbotd.signal(SIGTERM);
  CommandResult result = youbotd.finish();
  if (deaf && failure->call != "recv" && !result.said(std::strerror(failure->error)))
    flaws.emplace_back("is deaf and does not say so");
  return result;
}

/// `try_one` for each of them, some at once.
template <typename TryOne>
void for_each(const std::vector<Failure>& failures, TryOne try_one) {
  std::atomic<std::size_t> next{0};
  std::vector<std::jthread> threads;
  for (std::size_t i = 0; i < kAtOnce; ++i)
    threads.emplace_back([&] {
      for (std::size_t each = next++; each < failures.size(); each = next++) try_one(failures[each]);
    });
}

TEST(NthFailureOfAService, YoubotdComesToRestOrGoesOn) {
  std::vector<std::string> flaws;
  const Service whole;
  const CommandResult expected = serve_once(whole, {}, flaws);
  ASSERT_EQ(expected.exit_code, 0) << expected.output;
  ASSERT_TRUE(flaws.empty()) << flaws.front();
  const std::vector<Failure> failures =
      some_of(failures_of(read_counts(whole.folder / "counts"), 1, kAtMost), 24);
  for_each(failures, [](const Failure& failure) {
    const Service service;
    std::vector<std::string> found;
    const CommandResult result = serve_once(service, failure, found);
    for (const std::string& flaw : flaws_of_end(failure, result, 0)) found.push_back(flaw);
    for (const std::string& file : torn(Results::of(service.folder / "out")))
      if (failure.call != "unlink") found.push_back(file + " is torn");
    if (fs::exists(service.folder / "s") && failure.call != "unlink" && failure.call != "lstat")
      found.emplace_back("left its socket");
    report(failure, result, found);
  });
  std::printf("%zu failures\n", failures.size());
}

TEST(NthFailureOfAService, YoubotctlSaysWhyAndTheRobotComesToRest) {
  const Service service;
  Process youbotd(service.daemon());
  ASSERT_TRUE(youbotd.wait_for("waiting for commands"));
  ASSERT_EQ(service.tell({"mode", "velocity"}).exit_code, 0);
  const auto command = [&](const std::optional<Failure>& failure) {
    Process commander(with_failure(service.folder / "counts", failure, service.ctl({"enable"})));
    if (commander.wait_for("running")) commander.hang_up();
    return commander.finish();
  };
  ASSERT_EQ(command({}).exit_code, 0);
  ASSERT_TRUE(service.comes_to_rest());
  const std::vector<Failure> failures =
      some_of(failures_of(read_counts(service.folder / "counts"), 2, kAtMost), 12);
  for (const Failure& failure : failures) {
    fs::remove(service.folder / "counts");
    const CommandResult result = command(failure);
    report(failure, result, flaws_of_end(failure, result, 0));
    EXPECT_TRUE(service.comes_to_rest()) << describe(failure);
  }
  std::printf("%zu failures\n", failures.size());
  youbotd.signal(SIGTERM);
  EXPECT_EQ(youbotd.finish().exit_code, 0);
}

}  // namespace
}  // namespace nth_failure
