/// @file
/// Command and sample of a gripper.
#pragma once
#include <cstdint>

namespace hal {

/// Both bars of the youBot together, from closed (URDF: 0 to 11.5 mm each).
inline constexpr double kGripperTravel_m = 0.023;

struct GripperCommand {
  bool move = false;       ///< false: no change
  double opening_m = 0.0;  ///< between the bars, 0 closed; values beyond the travel are limited to it
};

enum class GripperState : std::uint8_t {
  kAbsent,  ///< not present or not answering; the arm works without it
  kIdle,    ///< arrived, stopped, or never commanded
  kMoving,  ///< moving, or not yet confirmed as stopped; the first motion after power-up goes to both ends,
            ///< to find the closed position
  kFailed,  ///< did not arrive; a new opening tries again
};

/// The youBot's bars count steps and have no force sensor: a bar that holds an object "arrives" all the same.
struct GripperSample {
  GripperState state = GripperState::kAbsent;
  double opening_m = 0.0;  ///< as of the last arrival
};

}  // namespace hal
