#include "tests/faults/campaign.h"

#include <algorithm>

#include "tests/faults/checker.h"
#include "tests/faults/commander.h"

namespace faults {
namespace {

using namespace std::chrono_literals;

/// An enable has to be granted so soon after the last fault.
constexpr auto kRecovery = 2s;
/// A daemon that ended is started again, and again while what its bus needs is not there.
constexpr auto kRestart = 10s;
/// Firmware that lost its power has its commutation to find, and an arm its end stops and its pose.
constexpr auto kStartUp = 60s;

/// One run of a script.
class Play {
 public:
  Play(const Script& script, const Sabotage& sabotage)
      : script_(script),
        world_(script.machine, script.seed, sabotage),
        checker_(world_),
        commander_(world_, script.seed),
        states_(script.events.size(), State::kWaiting),
        ends_(script.events.size()) {}

  Outcome run() {
    world_.start_daemon();
    if (!world_.daemon_runs()) checker_.violate("the daemon does not start: " + world_.start_error());
    begin_ = world_.now();
    // The daemon takes time to start: events due meanwhile start or end after it.
    while (world_.now() - begin_ < length_of(script_.machine) || !all_over()) {
      play_events();
      period();
    }
    const auto last_torque_after = checker_.last_torque_after();
    const double travel_m = checker_.travel_m();
    if (checker_.violations().empty()) expect_life();
    Outcome outcome{.violations = checker_.violations(),
                    .digest = checker_.digest(),
                    .emulated = world_.now(),
                    .last_torque_after = last_torque_after,
                    .travel_m = travel_m,
                    .fault = fault_};
    return outcome;
  }

 private:
  enum class State : std::uint8_t { kWaiting, kActive, kOver };

  void period() {
    // As the service manager does.
    if (!world_.daemon_runs() && world_.now() >= next_start_) {
      next_start_ = world_.now() + 200ms;
      if (!world_.daemon_held_down) world_.start_daemon();
    }
    commander_.act();
    world_.step();
    if (fault_.empty() && commander_.status().is_object()) fault_ = commander_.status().value("fault", "");
  }

  void play_events() {
    const nanoseconds time = world_.now() - begin_;
    for (std::size_t i = 0; i < states_.size(); ++i) {
      const Event& event = script_.events[i];
      if (states_[i] == State::kActive && time >= ends_[i]) {
        if (event.kind->end != nullptr) event.kind->end(world_, event);
        checker_.ended(event);
        states_[i] = State::kOver;
      }
      if (states_[i] == State::kWaiting && time >= event.at) {
        checker_.began(event);
        event.kind->begin(world_, event);
        states_[i] = State::kActive;
        ends_[i] = time + event.duration;
      }
    }
  }

  bool all_over() const {
    return std::ranges::all_of(states_, [](State state) { return state == State::kOver; });
  }

  template <typename Condition>
  bool comes_to(nanoseconds limit, Condition condition) {
    const nanoseconds end = world_.now() + limit;
    while (!condition()) {
      if (world_.now() >= end) return false;
      period();
    }
    return true;
  }

  /// With all faults gone.
  void expect_life() {
    commander_.rest();
    const auto say = [this](const std::string& what) {
      checker_.violate(
          what + "; enable: " + (commander_.refusal().empty() ? "granted" : commander_.refusal()) +
          "; status: " + commander_.status().dump(-1, ' ', false, json::error_handler_t::replace) +
          world_.start_error());
    };
    const std::string working = script_.machine == Machine::kBase ? "running" : "operating";
    if (!comes_to(kRestart, [this] { return world_.daemon_runs(); })) return say("the daemon does not start");
    // Whatever still runs is another client's, or comes to rest.
    commander_.ask("disable");
    if (!comes_to(1s, [this] { return !commander_.enabled(); })) return say("the drives do not go off");
    commander_.be_calm();
    const auto enabled = [this] { return commander_.enabled() && commander_.refusal().empty(); };
    if (!comes_to(kRecovery, enabled)) return say("no enable works within 2 s of the last fault");
    const auto at_work = [&] { return commander_.enabled() && commander_.status()["phase"] == working; };
    if (!comes_to(kStartUp, at_work)) return say("the enabled robot does not come to work");
    const control::PlanarPose start = world_.emulation().pose();
    if (script_.machine == Machine::kBase)
      if (!comes_to(2s, [&] {
            const control::PlanarPose& pose = world_.emulation().pose();
            return std::hypot(pose.x_m - start.x_m, pose.y_m - start.y_m) > 0.05;
          }))
        return say("the enabled robot does not drive");
    world_.commander_silent = true;
    (void)world_.ask(1, "stop");
    // An arm is lowered first.
    const auto stops_in = script_.machine == Machine::kBase ? 3s : 10s;
    if (!comes_to(stops_in, [this] { return world_.daemon_runs() && !world_.enabled(); }))
      return say("the robot does not stop");
    world_.end_daemon();
    for (int i = 0; i < 200; ++i) world_.step();
    if (world_.daemon_runs()) return say("the daemon does not end");
    checker_.check_recordings(script_.events);
  }

  const Script& script_;
  World world_;
  Checker checker_;
  Commander commander_;
  std::vector<State> states_;      // of the events
  std::vector<nanoseconds> ends_;  // of those that have begun
  nanoseconds begin_{};
  nanoseconds next_start_{};
  std::string fault_;
};

}  // namespace

Outcome run(const Script& script, const Sabotage& sabotage) { return Play(script, sabotage).run(); }

Script shrunk(const Script& script, const std::function<bool(const Script&)>& fails) {
  Script least = script;
  const auto take = [&](Script candidate) {
    if (!fails(candidate)) return false;
    least = std::move(candidate);
    return true;
  };
  for (bool smaller = true; smaller;) {
    smaller = false;
    for (std::size_t i = 0; i < least.events.size() && !smaller; ++i) {
      Script without = least;
      without.events.erase(without.events.begin() + static_cast<std::ptrdiff_t>(i));
      smaller = take(std::move(without));
    }
  }
  for (std::size_t i = 0; i < least.events.size(); ++i) {
    Script simpler = least;
    simpler.events[i].size = 1.0;
    if (simpler.events[i].size != least.events[i].size) (void)take(std::move(simpler));
    while (least.events[i].duration > 1ms) {
      Script shorter = least;
      shorter.events[i].duration /= 2;
      if (!take(std::move(shorter))) break;
    }
  }
  return least;
}

}  // namespace faults
