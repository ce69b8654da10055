/// @file
/// How soon a faulty sensor is detected, and how far the robot moved until then, from the simulated plant.
#pragma once
#include <chrono>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "control/plausibility/checks.h"
#include "tests/sensor_campaign/sensor_faults.h"

namespace sensor_campaign {

/// Motion of the robot at the onset of the fault.
enum class Motion : std::uint8_t {
  kFromRest,   ///< the base is at rest, and commanded to drive
  kStarting,   ///< 0.3 s later
  kCreeping,   ///< the base drives at 0.05 m/s
  kDriving,    ///< at 0.3 m/s or 0.6 rad/s
  kUnfolding,  ///< the boards' position controllers unfold the arm: it rests, or has moved for 1.5 s
  kApproach,   ///< the arm moves to the front of the robot
  kLed,        ///< a hand leads the arm
  kHeld,       ///< a hand has held the arm still, and begins to lead it
};
std::string name_of(Motion motion);
/// Those of the base, or of the arm.
std::span<const Motion> motions_of(std::size_t joint);

/// A motion of the base goes in metres and radians, of an arm joint in radians.
struct Way {
  double m = 0.0;
  double rad = 0.0;
  void extend(const Way& other);
  /// Relative to the limits of the safety issue: 0.1 m, 0.2 rad.
  double share() const;
};

struct Detection {
  int runs = 0;
  int seen = 0;            ///< the monitor ended the run
  int named = 0;           ///< and named the joint that lies
  int misnamed = 0;        ///< and named another one
  int ended = 0;           ///< something else ended it
  int beyond = 0;          ///< it deviated more than the issue allows
  int late = 0;            ///< a reading was wrong for more than 60 ms by more than a working sensor may be
  double longest_s = 0.0;  ///< of the detected ones: time from the onset
  double longest_apparent_s = 0.0;  ///< the same from when a reading was wrong by that much
  Way travel;                       ///< of the detected ones: motion of the robot from the onset on
  Way astray;                       ///< of all: deviation from the position without the fault at that time
  void add(const Detection& other);
};

/// One row of the table.
struct DetectionCase {
  SensorFault fault;
  std::size_t joint;
  Motion motion;
};

struct Conditions {
  std::uint32_t seed = 1;
  std::chrono::nanoseconds late{};  ///< maximum delay of each answer relative to a quick bus
  control::ChecksOff off{};
};

/// Every fault at every joint in every motion.
std::vector<DetectionCase> detection_cases(const std::vector<SensorFault>& faults);
/// On all cores; equal seeds give equal results. @throws std::runtime_error if a run ends before the fault.
std::vector<Detection> detect(const std::vector<DetectionCase>& cases, const Conditions& conditions);

}  // namespace sensor_campaign
