/// @file
/// A user's steps, on a machine that may delay them.
#pragma once
#include <gtest/gtest.h>

#include <cstdio>
#include <functional>
#include <map>
#include <string>

#include "tests/end_to_end/daemon.h"
#include "tests/end_to_end/hand.h"

namespace end_to_end {

inline constexpr int kMaxRepetitions = 8;

/// Part of a run, in the time of its recording.
struct Window {
  int run = 0;
  double from_s = 0;
  double to_s = 0;
};

inline bool came_too_late(const std::string& fault) {
  for (const char* late :
       {"no fresh sample in time", "no new force command in time", "replies missing in a row",
        "this program did not run for", "no answer from the bus", "no answer from the simulated bus"})
    if (fault.find(late) != fault.npos) return true;
  return false;
}

inline bool is_power_cycle(const std::string& fault) {
  return fault.find("wheel-3: some devices") != fault.npos;
}

class Scenario {
 public:
  Scenario(Daemon& daemon, Hand& hand) : daemon_(daemon), hand_(hand) {}

  /// Operates, and performs `step`, which returns whether it was done; repeats it if something was late.
  void perform(const std::string& name, const std::function<bool()>& step) {
    for (; !broken_; ++repetitions_) {
      if (!operates()) continue;
      Window window{daemon_.enables(), daemon_.status().value("time_s", 0.0), 0.0};
      const bool done = step();
      const json now = daemon_.status();
      window.to_s = now.value("time_s", 0.0);
      if (now.value("enabled", false)) {
        EXPECT_TRUE(done) << name << ": " << now.dump(2);
        broken_ = !done;
        windows[name] = window;
        return;
      }
      judge_end(name, /*operating=*/true);
    }
  }
  /// The hand stays at rest until the script has switched the slave off and on again.
  void meet_power_cycle() {
    while (!broken_ && !power_cycled_in_operation) {
      if (!operates()) {
        ++repetitions_;
        continue;
      }
      const json now = daemon_.wait_until([](const json& status) { return status["enabled"] == false; });
      broken_ = now.value("enabled", true);
      EXPECT_FALSE(broken_) << "the script's fault did not come: " << now.dump(2);
      if (!broken_) judge_end("power cycle", /*operating=*/true);
    }
  }
  bool broken() const { return broken_; }
  /// Something was late repeatedly.
  bool held_up() const { return held_up_; }

  std::map<std::string, Window> windows;
  bool power_cycled_in_operation = false;

 private:
  /// False if the run ended before.
  bool operates() {
    if (repetitions_ > kMaxRepetitions) {
      held_up_ = broken_ = true;
      return false;
    }
    if (!daemon_.status().value("enabled", false)) {
      hand_.press(false);
      hand_.move_to(Eigen::Vector3d::Zero());
      if (!daemon_.enable()) {
        const support::CommandResult refused = daemon_.commander_ended();
        std::printf("not enabled: %s\n", refused.output.c_str());
        EXPECT_TRUE(refused.exit_code == 2 || refused.exit_code == 3 || refused.exit_code == 4)
            << refused.output;
        return false;
      }
    }
    const json now = daemon_.wait_until(
        [](const json& status) { return status["enabled"] == false || status["phase"] == "operating"; });
    if (now.value("phase", "") == "operating") return true;
    if (now.value("enabled", true)) {
      ADD_FAILURE() << "it does not come to operate: " << now.dump(2);
      broken_ = true;
    } else {
      judge_end("start-up");
    }
    return false;
  }
  /// It is off: checks the cause.
  void judge_end(const std::string& during, bool operating = false) {
    const json now = daemon_.status();
    const std::string fault = now.value("fault", "");
    const support::CommandResult commander = daemon_.commander_ended();
    EXPECT_EQ(commander.exit_code, 4) << commander.output;
    EXPECT_TRUE(commander.said("stopped by a fault")) << commander.output;
    const bool scripted = is_power_cycle(fault);
    broken_ = !scripted && !came_too_late(fault);
    EXPECT_FALSE(broken_) << during << " was ended by " << fault;
    power_cycled_in_operation = power_cycled_in_operation || (scripted && operating);
    std::printf("%s was ended by %s\n", during.c_str(), fault.c_str());
    const json ready =
        daemon_.wait_until([](const json& status) { return status["robot_state"] == "ready"; });
    broken_ = broken_ || ready.value("robot_state", "") != "ready";
    EXPECT_FALSE(broken_) << "it does not recover: " << ready.dump(2);
    // Long enough to see a drive that continues by itself.
    const long from = ready.value("cycles", 0L);
    (void)daemon_.wait_until([&](const json& status) { return status["cycles"].get<long>() > from + 500; });
  }

  Daemon& daemon_;
  Hand& hand_;
  int repetitions_ = 0;
  bool broken_ = false;
  bool held_up_ = false;
};

}  // namespace end_to_end
