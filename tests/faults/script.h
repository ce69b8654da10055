/// @file
/// What goes wrong, when, where and how badly: drawn from a seed, or written down.
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

/// A kind of fault. Where its place counts: a joint, a slave on the bus, or a cable.
struct Kind {
  enum class Where : std::uint8_t { kAnywhere, kJoint, kSlave, kCable };
  enum class On : std::uint8_t { kAnyMachine, kBase, kManipulator };

  std::string_view name;
  Where where = Where::kAnywhere;
  On on = On::kAnyMachine;
  std::chrono::milliseconds longest{0};  ///< 0: over as soon as it has begun
  /// So long after it began, and until it ends, no torque may be commanded; where it is over at once, it must
  /// have ended the run by then. 0: no such rule.
  std::chrono::milliseconds last_torque_after{0};
  std::chrono::milliseconds lowering{0};  ///< on top where an arm is lowered first
  /// Two events that strike the same thing do not overlap: the first one's end would undo the second. Empty:
  /// the kind's name.
  std::string_view strikes{};
  bool spoils_samples = false;     ///< the daemon is shown what is not, or shown it late
  bool spoils_recordings = false;  ///< strikes their files
  Lie (*make_lie)(World& world, const Event& event) = nullptr;  ///< of kinds in which a board lies
  void (*begin)(World& world, const Event& event) = nullptr;
  void (*end)(World& world, const Event& event) = nullptr;  ///< null: nothing is left of it
};

std::span<const Kind> kinds();
/// @throws std::invalid_argument for a name that no kind has.
const Kind& kind_of(std::string_view name);

struct Event {
  const Kind* kind = nullptr;
  std::chrono::milliseconds at{};        ///< since the script began, in which the robot is started at 0
  std::chrono::milliseconds duration{};  ///< 0 for kinds that are over at once
  std::size_t place = 0;                 ///< from 0
  double size = 0.0;                     ///< from 0, hardly there, to 1
};

struct Script {
  Machine machine = Machine::kBase;
  std::uint64_t seed = 0;  ///< of the robot, its noise and what its people do
  std::vector<Event> events{};
};

/// Of the time in which its events begin. Faults last no longer than to its end.
std::chrono::milliseconds length_of(Machine machine);

/// One to six events of any kinds, in any order and overlap.
Script drawn_script(std::uint64_t seed);
/// One event of this kind, once the robot moves.
Script script_of(const Kind& kind, Machine machine, std::uint64_t seed);

/// "base/17: cable-out@1250+300/2*0.71, ..." and back.
std::string text(const Script& script);
/// @throws std::invalid_argument naming what cannot be read.
Script parsed_script(const std::string& text);

}  // namespace faults
