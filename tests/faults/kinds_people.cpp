#include <algorithm>
#include <array>
#include <string>

#include "tests/faults/kinds.h"

namespace faults {
namespace {

using namespace std::chrono_literals;

constexpr std::uint64_t kCommander = 1;
constexpr std::uint64_t kAnother = 2;

/// Of another client that may command, or of the commander itself.
std::uint64_t a_client(const Event& event) { return event.size < 0.5 ? kAnother : kCommander; }

Kind asks(std::string_view name, void (*ask)(World& world, const Event& event)) {
  return {.name = name, .begin = ask};
}

/// That ends the run.
Kind stops(std::string_view name, void (*ask)(World& world, const Event& event)) {
  return {.name = name, .last_torque_after = kStop, .lowering = kLowering, .begin = ask};
}

/// A request that no daemon may grant.
void ask_in_vain(World& world, std::uint64_t client, const std::string& request, bool may_command = true) {
  const auto reply = world.ask(client, request, may_command);
  if (reply && reply->ok) world.object("the daemon grants '" + request.substr(0, 60) + "'");
}

template <bool PenFaults::*Member>
Kind pen(std::string_view name) {
  return {.name = name,
          .on = Kind::On::kManipulator,
          .longest = 3000ms,
          .begin = [](World& world, const Event&) { world.pen.*Member = true; },
          .end = [](World& world, const Event&) { world.pen.*Member = false; }};
}

std::vector<Kind> client_kinds() {
  return {
      {.name = "commander-silent",
       .longest = 8000ms,
       .last_torque_after = 500ms + kStop,  // loop.commander_timeout_s
       .lowering = kLowering,
       .begin = [](World& world, const Event&) { world.commander_silent = true; },
       .end = [](World& world, const Event&) { world.commander_silent = false; }},
      stops("commander-gone", [](World& world, const Event&) { world.hang_up(kCommander); }),
      stops("stopped-without-rights", [](World& world, const Event&) { (void)world.ask(3, "stop", false); }),
      Kind{.name = "disabled",
           .last_torque_after = 20ms,
           .begin = [](World& world, const Event& e) { (void)world.ask(a_client(e), "disable"); }},
      stops("stopped", [](World& world, const Event& e) { (void)world.ask(a_client(e), "stop"); }),
      asks("enabled-again", [](World& world, const Event& e) { (void)world.ask(a_client(e), "enable"); }),
      asks("acknowledged-by-another",
           [](World& world, const Event&) { (void)world.ask(kAnother, "acknowledge"); }),
      asks("enabled-without-rights",
           [](World& world, const Event&) { ask_in_vain(world, 4, "enable", false); }),
      asks("disabled-without-rights",
           [](World& world, const Event&) { ask_in_vain(world, 4, "disable", false); }),
      asks("mode-changed", [](World& world, const Event& e) { (void)world.ask(a_client(e), "mode path"); }),
      asks("mode-unknown",
           [](World& world, const Event& e) { ask_in_vain(world, a_client(e), "mode dance"); }),
      asks("limit-raised",
           [](World& world, const Event& e) { ask_in_vain(world, a_client(e), "set limits.force_N 1e9"); }),
      asks("limit-not-a-number",
           [](World& world, const Event& e) { ask_in_vain(world, a_client(e), "set limits.force_N nan"); }),
      asks("setting-of-a-device",
           [](World& world, const Event& e) {
             ask_in_vain(world, a_client(e), "set compensation.model \"/dev/zero\"");
           }),
      asks("setting-with-a-table",
           [](World& world, const Event& e) {
             ask_in_vain(world, a_client(e), "set limits.force_N 4\n[ethercat]\ntolerated_cycles = 100000");
           }),
      asks("velocity-not-a-number",
           [](World& world, const Event& e) { ask_in_vain(world, a_client(e), "set velocity nan 0 0"); }),
      asks("velocity-absurd",
           [](World& world, const Event&) { (void)world.ask(kCommander, "set velocity 1e30 -1e30 1e30"); }),
      asks("velocity-reversed-at-once",
           [](World& world, const Event&) {
             (void)world.ask(kCommander, "set velocity 0.3 0 0");
             for (int i = 0; i < 200; ++i) world.step();
             (void)world.ask(kCommander, "set velocity -0.3 0.3 -0.5");
           }),
      asks("requests-of-bytes",
           [](World& world, const Event& e) {
             std::string bytes(static_cast<std::size_t>(1 + 4000 * e.size), '\0');
             for (char& byte : bytes) byte = static_cast<char>(world.random()());
             (void)world.ask(a_client(e), bytes);
           }),
      asks("requests-flood",
           [](World& world, const Event&) {
             for (int i = 0; i < 50; ++i)
               (void)world.ask(static_cast<std::uint64_t>(10 + i), "status", false);
           }),
      asks("empty-request", [](World& world, const Event& e) { (void)world.ask(a_client(e), ""); }),
  };
}

std::vector<Kind> hand_kinds() {
  return {
      {.name = "tuned",
       .on = Kind::On::kManipulator,
       .begin =
           [](World& world, const Event& e) {
             constexpr auto kSettings = std::to_array<const char*>(
                 {"coupling.stiff_N_per_m 150", "mapping.motion_scale 0.3", "feedback.enabled false",
                  "mapping.rate_m_per_s 0.02", "feedback.contact_share 0.5", "feedback.force_scale 20"});
             const auto which = static_cast<std::size_t>(e.size * kSettings.size());
             (void)world.ask(kCommander, std::string("set teleoperation.") +
                                             kSettings[std::min(which, kSettings.size() - 1)]);
           }},
      pen<&PenFaults::unplugged>("pen-unplugged"),
      pen<&PenFaults::broken>("pen-broken"),
      pen<&PenFaults::stale>("pen-stale"),
      pen<&PenFaults::frozen>("pen-frozen"),
      pen<&PenFaults::not_finite>("pen-not-finite"),
      pen<&PenFaults::not_ready>("pen-not-ready"),
      pen<&PenFaults::refuses_force>("pen-without-force"),
      pen<&PenFaults::buttons_bounce>("buttons-bounce"),
      {.name = "pen-jumps",
       .on = Kind::On::kManipulator,
       .longest = 1000ms,
       .begin =
           [](World& world, const Event& e) {
             world.pen.jump_m = {0.1 * e.size, -0.05 * e.size, 0.02};
           },
       .end = [](World& world, const Event&) { world.pen.jump_m.setZero(); }},
      {.name = "pen-reversed",
       .on = Kind::On::kManipulator,
       .longest = 2000ms,
       .begin = [](World& world, const Event&) { world.pen.scale = -1; },
       .end = [](World& world, const Event&) { world.pen.scale = 1; }},
      {.name = "button-stuck",
       .on = Kind::On::kManipulator,
       .longest = 3000ms,
       .begin = [](World& world, const Event& e) { world.pen.buttons_stuck = e.size < 0.5 ? 1 : 2; },
       .end = [](World& world, const Event&) { world.pen.buttons_stuck = 0; }},
      {.name = "hand-jerks",
       .on = Kind::On::kManipulator,
       .begin =
           [](World& world, const Event& e) {
             world.hand()->move_to({-0.08 * e.size, 0.08 * e.size, 0.06}, std::chrono::milliseconds(60));
           }},
      {.name = "hand-lets-go",
       .on = Kind::On::kManipulator,
       .longest = 2000ms,
       .begin = [](World& world, const Event&) { world.hand()->let_go(); },
       .end = [](World& world, const Event&) { world.hand()->take_hold(); }},
      {.name = "hand-pushed",
       .on = Kind::On::kManipulator,
       .longest = 500ms,
       .begin =
           [](World& world, const Event& e) {
             world.hand()->push({15 * e.size, -10, 5});
           },
       .end = [](World& world, const Event&) { world.hand()->push(Eigen::Vector3d::Zero()); }},
      {.name = "hand-at-the-rim",
       .on = Kind::On::kManipulator,
       .begin =
           [](World& world, const Event&) {
             world.hand()->move_to({-0.15, 0, 0}, std::chrono::milliseconds(300));
           }},
  };
}

}  // namespace

std::vector<Kind> people_kinds() {
  std::vector<Kind> kinds = client_kinds();
  const std::vector<Kind> hand = hand_kinds();
  kinds.insert(kinds.end(), hand.begin(), hand.end());
  return kinds;
}

std::span<const Kind> kinds() {
  static const std::vector<Kind> all = [] {
    std::vector<Kind> kinds;
    for (const auto& some : {wire_kinds(), board_kinds()})
      kinds.insert(kinds.end(), some.begin(), some.end());
    for (Kind& kind : kinds) kind.spoils_samples = true;
    for (const auto& some : {machine_kinds(), people_kinds()})
      kinds.insert(kinds.end(), some.begin(), some.end());
    return kinds;
  }();
  return all;
}

}  // namespace faults
