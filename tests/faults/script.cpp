#include "tests/faults/script.h"

#include <algorithm>
#include <cstdio>
#include <stdexcept>

namespace faults {
namespace {

using std::chrono::milliseconds;

bool fits(const Kind& kind, Machine machine) {
  return kind.on == Kind::On::kAnyMachine || (kind.on == Kind::On::kBase) == (machine == Machine::kBase);
}

std::size_t places(Kind::Where where, Machine machine) {
  const bool base = machine == Machine::kBase;
  switch (where) {
    case Kind::Where::kAnywhere: return 1;
    case Kind::Where::kJoint: return base ? 4 : 9;
    case Kind::Where::kSlave:
    case Kind::Where::kCable: return base ? 5 : 11;  // with the power boards
  }
  return 1;
}

Event drawn_event(const Kind& kind, Machine machine, milliseconds at, std::mt19937_64& random) {
  const auto below = [&random](auto count) {
    return std::uniform_int_distribution<decltype(count)>(0, count - 1)(random);
  };
  Event event{.kind = &kind, .at = at};
  event.place = below(places(kind.where, machine));
  event.size = static_cast<double>(below(101)) / 100;
  // Short ones are as frequent as long ones: a few periods of the loop, or seconds.
  if (kind.longest.count() > 0) {
    const double exponent = std::uniform_real_distribution<>(0, 1)(random);
    event.duration = milliseconds(
        std::max<long>(1, std::lround(std::pow(static_cast<double>(kind.longest.count()), exponent))));
    event.duration = std::min(event.duration, length_of(machine) - at);
  }
  return event;
}

}  // namespace

const Kind& kind_of(std::string_view name) {
  const std::span<const Kind> all = kinds();
  const auto found = std::ranges::find(all, name, &Kind::name);
  if (found == all.end()) throw std::invalid_argument("there is no fault '" + std::string(name) + "'");
  return *found;
}

milliseconds length_of(Machine machine) {
  return machine == Machine::kBase ? milliseconds(4000) : milliseconds(16000);
}

Script drawn_script(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto below = [&random](auto count) {
    return std::uniform_int_distribution<decltype(count)>(0, count - 1)(random);
  };
  Script script{.seed = seed};
  script.machine = below(8) == 0 ? Machine::kManipulator : Machine::kBase;
  std::vector<const Kind*> fitting;
  for (const Kind& kind : kinds())
    if (fits(kind, script.machine)) fitting.push_back(&kind);
  const long latest = length_of(script.machine).count() - 1;
  for (int count = 1 + below(6); count > 0; --count)
    script.events.push_back(
        drawn_event(*fitting[below(fitting.size())], script.machine, milliseconds(below(latest)), random));
  std::ranges::stable_sort(script.events, {}, &Event::at);
  return script;
}

Script script_of(const Kind& kind, Machine machine, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const milliseconds at = length_of(machine) / 2;
  Event event = drawn_event(kind, machine, at, random);
  event.duration = std::min(kind.longest, length_of(machine) - at);
  return {.machine = machine, .seed = seed, .events = {event}};
}

std::string text(const Script& script) {
  std::string all =
      (script.machine == Machine::kBase ? "base/" : "manipulator/") + std::to_string(script.seed) + ":";
  for (const Event& event : script.events) {
    std::array<char, 160> one{};
    std::snprintf(one.data(), one.size(), " %.*s@%ld+%ld/%zu*%.2f", static_cast<int>(event.kind->name.size()),
                  event.kind->name.data(), event.at.count(), event.duration.count(), event.place, event.size);
    all += one.data();
  }
  return all;
}

Script parsed_script(const std::string& text) {
  std::istringstream words(text);
  std::string word;
  words >> word;
  const std::size_t slash = word.find('/');
  if (slash == word.npos || !word.ends_with(':'))
    throw std::invalid_argument("a script begins with base/SEED: or manipulator/SEED:, not with '" + word +
                                "'");
  Script script{.machine = word.substr(0, slash) == "base" ? Machine::kBase : Machine::kManipulator,
                .seed = std::stoull(word.substr(slash + 1))};
  while (words >> word) {
    const std::size_t at = word.find('@');
    Event event{.kind = &kind_of(word.substr(0, at))};
    long begin_ms = 0;
    long duration_ms = 0;
    if (at == word.npos || std::sscanf(word.c_str() + at, "@%ld+%ld/%zu*%lf", &begin_ms, &duration_ms,
                                       &event.place, &event.size) != 4)
      throw std::invalid_argument("an event is KIND@MS+MS/PLACE*SIZE, not '" + word + "'");
    event.at = milliseconds(begin_ms);
    event.duration = milliseconds(duration_ms);
    script.events.push_back(event);
  }
  return script;
}

}  // namespace faults
