/// @file
/// How soon a lying sensor is seen, and how far the robot went until then, judged by the simulated plant.
#pragma once
#include <chrono>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "control/plausibility/checks.h"
#include "tests/sensor_campaign/sensor_faults.h"

namespace sensor_campaign {

/// What the robot does when the sensor begins to lie.
enum class Motion : std::uint8_t {
  kFromRest,  ///< the base stands, and is asked to drive
  kStarting,  ///< 0.3 s later
  kCreeping,  ///< the base drives at 0.05 m/s
  kDriving,   ///< at 0.3 m/s or 0.6 rad/s
  kApproach,  ///< the arm is brought in front of the robot
  kLed,       ///< a hand leads the arm
  kHeld,      ///< a hand has held the arm still, and begins to lead it
};
std::string name_of(Motion motion);
/// Those of the base, or of the arm.
std::span<const Motion> motions_of(std::size_t joint);

/// A motion of the base goes in metres and radians, of an arm joint in radians.
struct Way {
  double m = 0.0;
  double rad = 0.0;
  void extend(const Way& other);
  /// Of what the safety issue allows: 0.1 m, 0.2 rad.
  double share() const;
};

struct Detection {
  int runs = 0;
  int seen = 0;            ///< the monitor ended the run
  int named = 0;           ///< and named the joint that lies
  int ended = 0;           ///< something else ended it
  int beyond = 0;          ///< it came further astray than the issue allows
  double longest_s = 0.0;  ///< of those seen: from the first lie on
  Way travel;              ///< of those seen: what the robot went from the first lie on
  Way astray;              ///< of all: how far it came from where it is at that time when no sensor lies
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
  std::chrono::nanoseconds late{};  ///< each answer comes up to so much later than on a quick bus
  control::ChecksOff off{};
};

/// Every fault at every joint in every motion.
std::vector<DetectionCase> detection_cases(const std::vector<SensorFault>& faults);
/// On all cores; equal seeds give equal results. @throws std::runtime_error where a run ends before the lie.
std::vector<Detection> detect(const std::vector<DetectionCase>& cases, const Conditions& conditions);

}  // namespace sensor_campaign
