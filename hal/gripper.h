/// @file
/// What a gripper is told and what it tells.
#pragma once
#include <cstdint>

namespace hal {

/// The youBot's two bars together, from closed (URDF: 0 to 11.5 mm each).
inline constexpr double kGripperTravel_m = 0.023;

struct GripperCommand {
  bool move = false;       ///< false: leave it as it is
  double opening_m = 0.0;  ///< between the bars, 0 closed; beyond the travel: its end
};

enum class GripperState : std::uint8_t {
  kAbsent,  ///< none there, or it does not answer; the arm works without it
  kIdle,    ///< arrived, stopped, or never told to move
  kMoving,  ///< on its way, or not yet known to have stopped; the first time since power-up to both ends, to
            ///< find where closed is
  kFailed,  ///< did not get there; a new opening tries again
};

/// The youBot's bars count steps and feel nothing: one that holds an object "arrives" all the same.
struct GripperSample {
  GripperState state = GripperState::kAbsent;
  double opening_m = 0.0;  ///< as of the last arrival
};

}  // namespace hal
