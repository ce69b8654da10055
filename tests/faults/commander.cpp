#include "tests/faults/commander.h"

#include <array>
#include <cstdio>

namespace faults {
namespace {

using namespace std::chrono_literals;

constexpr std::uint64_t kConnection = 1;

nanoseconds of_seconds(double seconds) { return std::chrono::milliseconds(std::lround(1e3 * seconds)); }

}  // namespace

void Commander::note(const std::optional<Reply>& reply) {
  if (reply) status_ = reply->status;
}

void Commander::rest() { rests_ = true; }

void Commander::be_calm() {
  rests_ = false;
  calm_ = true;
  status_ = nullptr;
  refusal_ = "not asked yet";
  next_enable_ = next_move_ = next_word_ = {};
  if (world_.hand() != nullptr) {
    world_.hand()->take_hold();
    world_.hand()->push(Eigen::Vector3d::Zero());
    world_.hand()->move_to(Eigen::Vector3d::Zero(), 300ms);
  }
}

void Commander::act() {
  const nanoseconds now = world_.now();
  if (!world_.daemon_runs()) status_ = nullptr;
  if (world_.commander_silent || now < next_word_) return;
  next_word_ = now + 100ms;
  if (enabled()) {
    note(world_.ask(kConnection, "alive"));
    next_enable_ = now + (calm_ ? 100ms : of_seconds(between(0.2, 1.0)));
    if (now >= next_move_ && !rests_) move();
  } else {
    note(world_.ask(kConnection, "status"));
    if (!rests_ && !enabled() && now >= next_enable_) try_to_enable();
  }
}

void Commander::try_to_enable() {
  if (world_.machine() == Machine::kBase) note(world_.ask(kConnection, "mode velocity"));
  if (status_.is_object() && status_.value("phase", "") == "faulted")
    note(world_.ask(kConnection, "acknowledge"));
  const auto reply = world_.ask(kConnection, "enable");
  refusal_ = !reply ? "no answer" : reply->ok ? "" : reply->error;
  note(reply);
}

void Commander::move() {
  next_move_ = world_.now() + of_seconds(calm_ ? 0.1 : between(0.2, 0.8));
  if (world_.hand() != nullptr) {
    if (!calm_)
      world_.hand()->move_to({between(-0.06, 0.03), between(-0.05, 0.05), between(-0.04, 0.04)},
                             of_seconds(between(0.4, 1.0)));
    return;
  }
  std::array<char, 80> words{};
  if (calm_)
    std::snprintf(words.data(), words.size(), "set velocity 0.2 0 0");
  else
    std::snprintf(words.data(), words.size(), "set velocity %.3f %.3f %.3f", between(-0.25, 0.25),
                  between(-0.15, 0.15), between(-0.3, 0.3));
  note(world_.ask(kConnection, words.data()));
}

}  // namespace faults
