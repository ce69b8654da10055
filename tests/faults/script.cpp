#include "tests/faults/script.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <random>
#include <sstream>
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

Event parsed_event(const std::string& word, Machine machine) {
  const auto refuse = [&word](const std::string& why) {
    throw std::invalid_argument("event '" + word + "': " + why);
  };
  const std::size_t at = word.find('@');
  long begin_ms = 0;
  long duration_ms = 0;
  int read = 0;
  Event event;
  if (at == word.npos ||
      std::sscanf(word.c_str() + at, "@%ld+%ld/%zu*%lf%n", &begin_ms, &duration_ms, &event.place, &event.size,
                  &read) != 4 ||
      at + static_cast<std::size_t>(read) != word.size())
    refuse("it is not KIND@MS+MS/PLACE*SIZE");
  event.kind = &kind_of(word.substr(0, at));
  event.at = milliseconds(begin_ms);
  event.duration = milliseconds(duration_ms);
  if (!fits(*event.kind, machine)) refuse("this machine does not have it");
  if (event.place >= places(event.kind->where, machine)) refuse("there is no such place");
  if (begin_ms < 0 || duration_ms < 0 || event.at + event.duration > length_of(machine))
    refuse("it is not within the " + std::to_string(length_of(machine).count()) + " ms of a script");
  if (!(event.size >= 0 && event.size <= 1)) refuse("its size is not from 0 to 1");
  return event;
}

bool collide(const Event& a, const Event& b) {
  const auto struck = [](const Kind& kind) { return kind.strikes.empty() ? kind.name : kind.strikes; };
  return struck(*a.kind) == struck(*b.kind) && a.at <= b.at + b.duration && b.at <= a.at + a.duration;
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
  for (int count = 1 + below(6); count > 0; --count) {
    const Event event =
        drawn_event(*fitting[below(fitting.size())], script.machine, milliseconds(below(latest)), random);
    if (std::ranges::none_of(script.events, [&](const Event& other) { return collide(event, other); }))
      script.events.push_back(event);
  }
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
  std::array<char, 16> machine{};
  unsigned long long seed = 0;
  int read = 0;
  if (std::sscanf(word.c_str(), "%15[a-z]/%llu:%n", machine.data(), &seed, &read) != 2 ||
      static_cast<std::size_t>(read) != word.size() ||
      (std::string_view(machine.data()) != "base" && std::string_view(machine.data()) != "manipulator"))
    throw std::invalid_argument("a script begins with base/SEED: or manipulator/SEED:, not with '" + word +
                                "'");
  Script script{.machine = machine[0] == 'b' ? Machine::kBase : Machine::kManipulator, .seed = seed};
  while (words >> word) script.events.push_back(parsed_event(word, script.machine));
  return script;
}

}  // namespace faults
