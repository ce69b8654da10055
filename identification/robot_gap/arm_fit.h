/// @file
/// Fits links, rotors and friction of a whole arm together.
#pragma once
#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "control/arm_description.h"
#include "identification/robot_gap/arm_motion.h"

namespace identification::robot_gap {

/// A number with half its 95 % interval.
struct FittedNumber {
  std::string name;  ///< "coulomb_Nm of joint2"; of a combination, BaseParameters::names()
  double given = 0;
  double value = 0;
  double half_interval = 0;
};

/// Rms of the torque that a model does not predict while the joint moves [N·m, N].
struct ResidualOfJoint {
  std::string joint;
  double given = 0;
  double fitted = 0;
  double noise_floor = 0;  ///< of the sensors
};
struct Residuals {
  std::vector<ResidualOfJoint> joints;
  double given_Nm = 0;  ///< over all joints
  double fitted_Nm = 0;
};

struct ArmFit {
  control::ArmDescription arm;
  std::vector<FittedNumber> base;    ///< combinations of inertial parameters that act on torques
  std::vector<FittedNumber> drives;  ///< friction and offsets
  Residuals searched;
  Residuals held_out;
  double lag_s = 0;  ///< of the recorded torques
  double band_Hz = 0;
};

/// Weighted least squares of all arm_parameters() at once: the torques of each joint by its own scatter,
/// iterated, and the given values by theirs. What the motion does not determine keeps its given value; what
/// it determines only as a sum is shared among the parameters as their given values are uncertain. An offset
/// whose interval holds zero, or within 2 % of the joint's friction, is exactly zero, and friction is not
/// negative. Rows in which a joint turns below a fifth of its top speed do not count: around a reversal it
/// sticks. Intervals contain the
/// autocorrelation of the residuals, the uncertainty of the given values, and that of angles behind gears
/// that bend; no other error of the model.
/// `band_Hz`: up to which torques are compared, at most.
/// @throws std::invalid_argument naming the recording that is too short, or if there is none or no joint
/// moves.
ArmFit fit_arm(const control::ArmDescription& given, std::span<const ArmRecording> data,
               std::span<const ArmRecording> held_out, double band_Hz);

/// Rms over all joints of the torque that an arm does not predict, in the rows that a fit would use.
/// @throws std::invalid_argument naming a recording that is too short.
double residual_Nm(const control::ArmDescription& arm, std::span<const ArmRecording> recordings,
                   double band_Hz);

}  // namespace identification::robot_gap
