/// @file
/// A joint that a servo swings within a stroke, as an arm's does, for hidden data. It shares no code with the
/// library's models.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "identification/gap/gap.h"
#include "model/effects/drive_model.h"

namespace gap_test {

/// Joint side and SI. Amounts of 0 are absent.
struct SwingingJoint {
  double inertia_kg_m2 = 0.05;
  double coulomb_Nm = 0.2;
  double viscous_Nm_s_per_rad = 0.05;
  double ticks_per_rev = 65536;
  double torque_noise_Nm = 0.005;
  double spring_Nm_per_rad = 0;
  double spring_rest_rad = 0;
  double weight_Nm = 0;
  double weight_rest_rad = 0;
  double offset_Nm = 0;          ///< against positive motion
  bool unsigned_torque = false;  ///< the sensor reports magnitudes
};
/// About `centre_rad`, at most `half_stroke_rad` to both sides.
struct Swing {
  double centre_rad = 0;
  double half_stroke_rad = 0.8;
  double fastest_Hz = 2;  ///< of the sines that are its set-point
  double seconds = 30;
};
identification::gap::Source swing(const SwingingJoint& joint, const Swing& motion, std::uint64_t seed);

/// Inertia, Coulomb and viscous friction of the joint.
model::effects::DriveModel known_of(const SwingingJoint& joint);
/// Two recordings to search in and two to judge with.
identification::gap::Result analysed(const SwingingJoint& joint, const Swing& motion, std::uint64_t seed = 1);
/// "ambiguous: spring or imbalance 0.31 Nm, coulomb"
std::string words(const identification::gap::Result& result);
/// Names, in alphabetical order; rivals by '/': "cogging spring/imbalance".
std::string names(const identification::gap::Result& result);

}  // namespace gap_test
