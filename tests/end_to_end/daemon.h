/// @file
/// youbotd as a service and youbotctl, used like a user does.
#pragma once
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/support/built_paths.h"
#include "tests/support/process.h"
#include "tests/support/spawn.h"
#include "tests/support/temporary_directory.h"

namespace end_to_end {

using nlohmann::json;

class Daemon {
 public:
  Daemon(const std::filesystem::path& folder, const std::filesystem::path& config,
         const std::vector<std::string>& more)
      : socket_(folder / "socket"), youbotd_([&] {
          std::vector<std::string> words{support::program("youbotd"),
                                         "--control",
                                         socket_,
                                         "--config",
                                         config,
                                         "--allow-non-rt",
                                         "--record-csv",
                                         folder / "runs"};
          words.insert(words.end(), more.begin(), more.end());
          return words;
        }()) {}

  support::Process& process() { return youbotd_; }
  support::SpawnResult tell(std::vector<std::string> words) const {
    words.insert(words.begin(), {support::program("youbotctl"), "--socket", socket_});
    return support::spawn(std::move(words));
  }
  json status() const {
    return json::parse(tell({"status", "--json"}).output, nullptr, /*allow_exceptions=*/false);
  }
  /// The status as soon as it meets `condition`, or at the time-out.
  template <typename Condition>
  json wait_until(Condition condition) const {
    json now;
    for (const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(150);
         std::chrono::steady_clock::now() < end; std::this_thread::sleep_for(std::chrono::milliseconds(50)))
      if (now = status(); now.is_object() && condition(now)) break;
    return now;
  }
  /// Cycles of the loop, each a millisecond of the emulated robot. False if it was disabled before.
  bool wait_cycles(long count) const {
    const long from = status().value("cycles", 0L);
    const json then = wait_until([&](const json& now) {
      return now["enabled"] == false || now["cycles"].get<long>() >= from + count;
    });
    return then.value("enabled", false);
  }

  /// A commanding client in its own process, which stays as long as the run. False if it was refused.
  bool enable() {
    if (const json fault = status().value("fault", json()); fault.is_string() && !fault.empty())
      std::printf("acknowledged: %s\n", fault.get<std::string>().c_str());
    (void)tell({"acknowledge"});
    commander_ = std::make_unique<support::Process>(
        std::vector<std::string>{support::program("youbotctl"), "--socket", socket_, "enable"});
    const json now = wait_until(
        [&](const json& status) { return commander_->ended() || status["run"].get<int>() > enables_; });
    const bool enabled = now.is_object() && now["run"].get<int>() > enables_;
    if (enabled) ++enables_;
    return enabled;
  }
  /// Number of runs so far.
  int enables() const { return enables_; }
  support::CommandResult commander_ended() { return std::exchange(commander_, nullptr)->finish(); }

 private:
  std::filesystem::path socket_;
  support::Process youbotd_;
  std::unique_ptr<support::Process> commander_;
  int enables_ = 0;
};

}  // namespace end_to_end
