/// @file
/// Hours with a fault-free robot, under all conditions that could be mistaken for sensor faults.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "control/plausibility/checks.h"

namespace sensor_campaign {

struct SoakResult {
  std::string scenario;
  double hours = 0.0;  ///< of virtual time
  int runs = 0;
  int false_alarms = 0;
  int other_ends = 0;               ///< a wheel that spins too fast on ice, an end effector too far from the
                                    ///< hand
  std::vector<std::string> alarms;  ///< texts
};

/// On all cores; equal seeds give equal results. The hours are shared evenly among the scenarios.
/// @param only the scenario of this name; empty: all. @throws std::invalid_argument if there is none.
/// @param busy the machine delays both ends of the bus.
std::vector<SoakResult> soak(double hours, std::uint32_t seed, const std::string& only = {},
                             bool busy = false, const control::ChecksOff& off = {});

}  // namespace sensor_campaign
