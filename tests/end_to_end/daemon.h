/// @file
/// youbotd as a service and youbotctl, as their user has them.
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
                                         "--record",
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
  /// What the status is when `condition` holds for it, or when the patience ends.
  template <typename Condition>
  json wait_until(Condition condition) const {
    json now;
    for (const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(150);
         std::chrono::steady_clock::now() < end; std::this_thread::sleep_for(std::chrono::milliseconds(50)))
      if (now = status(); now.is_object() && condition(now)) break;
    return now;
  }
  /// Of the loop, each of which is a millisecond of the emulated robot. False when it was disabled before.
  bool wait_cycles(long count) const {
    const long from = status().value("cycles", 0L);
    const json then = wait_until([&](const json& now) {
      return now["enabled"] == false || now["cycles"].get<long>() >= from + count;
    });
    return then.value("enabled", false);
  }

  /// A commander of its own process, which stays as long as what it enabled. False when it was refused.
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
  /// So many runs there were.
  int enables() const { return enables_; }
  support::CommandResult commander_ended() { return std::exchange(commander_, nullptr)->finish(); }

 private:
  std::filesystem::path socket_;
  support::Process youbotd_;
  std::unique_ptr<support::Process> commander_;
  int enables_ = 0;
};

}  // namespace end_to_end
