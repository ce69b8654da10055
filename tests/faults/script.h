/// @file
/// Faults with their time, place and severity: drawn from a seed, or written down.
#pragma once
#include <chrono>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tests/faults/world.h"

namespace faults {

struct Event;
using support::Lie;

/// A kind of fault. If its place matters: a joint, a slave on the bus, or a cable.
struct Kind {
  enum class Where : std::uint8_t { kAnywhere, kJoint, kSlave, kCable };
  enum class On : std::uint8_t { kAnyMachine, kBase, kManipulator };

  std::string_view name;
  Where where = Where::kAnywhere;
  On on = On::kAnyMachine;
  std::chrono::milliseconds longest{0};  ///< 0: over as soon as it has begun
  /// From this time after its start until its end, no torque may be commanded; if it is over at once, it must
  /// have ended the run by then. 0: no such rule.
  std::chrono::milliseconds last_torque_after{0};
  std::chrono::milliseconds lowering{0};  ///< on top where an arm is lowered first
  /// Two events that affect the same part must not overlap: the end of the first would undo the second.
  /// Empty: the kind's name.
  std::string_view strikes{};
  bool spoils_samples = false;                                  ///< the daemon sees false or late values
  bool spoils_recordings = false;                               ///< strikes their files
  Lie (*make_lie)(World& world, const Event& event) = nullptr;  ///< of kinds in which a board lies
  void (*begin)(World& world, const Event& event) = nullptr;
  void (*end)(World& world, const Event& event) = nullptr;  ///< null: it leaves no effect
};

std::span<const Kind> kinds();
/// @throws std::invalid_argument for an unknown name.
const Kind& kind_of(std::string_view name);

struct Event {
  const Kind* kind = nullptr;
  std::chrono::milliseconds at{};        ///< since the script began, in which the robot is started at 0
  std::chrono::milliseconds duration{};  ///< 0 for kinds that are over at once
  std::size_t place = 0;                 ///< from 0
  double size = 0.0;                     ///< from 0, hardly noticeable, to 1
};

struct Script {
  Machine machine = Machine::kBase;
  std::uint64_t seed = 0;  ///< of the robot, its noise and its people
  std::vector<Event> events{};
};

/// Period in which its events begin. Faults end with it at the latest.
std::chrono::milliseconds length_of(Machine machine);

/// One to six events of any kinds, in any order and overlap.
Script drawn_script(std::uint64_t seed);
/// One event of this kind, once the robot moves.
Script script_of(const Kind& kind, Machine machine, std::uint64_t seed);

/// "base/17: cable-out@1250+300/2*0.71, ..." and back.
std::string text(const Script& script);
/// @throws std::invalid_argument naming the part that cannot be parsed.
Script parsed_script(const std::string& text);

}  // namespace faults
