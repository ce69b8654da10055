/// @file
/// Drives a simulated drive like a person at a rig, and records it row by row.
#pragma once
#include <cstdint>
#include <string>

#include "tests/gap_second/drive.h"
#include "tests/gap_second/recording.h"

namespace gap_second {

/// Properties of the rig, independent of the drive. SI units, joint side.
struct Rig {
  std::string name;
  double rate_Hz = 1000.0;
  int ticks_per_rev = 4096;
  double encoder_eccentricity_rad = 0.0;  ///< the encoder error is positive here, negative half a turn
                                          ///< further
  double torque_noise_Nm = 0.0;           ///< 1 sigma, of each sample
  bool torque_is_mean = false;            ///< over the period that ends with the row; else of that instant
  double usual_torque_Nm = 0.05;          ///< torque to turn the drive slowly
  double top_speed_rad_per_s = 10.0;
  double nominal_inertia_kg_m2 = 0.01;  ///< the velocity loop is tuned for it
  double highest_tone_Hz = 10.0;        ///< of multisines
};

enum class Motion : std::uint8_t {
  kStaircase,        ///< constant speeds both ways, velocity loop
  kRandomSteps,      ///< speeds at random, for a time at random, velocity loop
  kSlowReversals,    ///< triangles of velocity around zero, velocity loop
  kMultisine,        ///< torque, no loop but a weak pull towards standstill
  kTorqueTriangles,  ///< torque from below break-away to above it, no loop
};
const char* name(Motion motion);

/// The same seed gives the same recording. `noise_seed` for the sensor alone.
Recording record(const DriveTruth& truth, const Rig& rig, Motion motion, double seconds, std::uint64_t seed);

}  // namespace gap_second
