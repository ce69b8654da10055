/// @file
/// How a fitted arm does on recordings: residuals by joint, recording and block, intervals, and whether a
/// correction holds on every kind of motion.
#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "identification/fit/statistics.h"
#include "identification/robot_gap/arm_search.h"

namespace identification::robot_gap {

/// Residuals of a fitted arm [N·m], in the rows of the data.
Eigen::VectorXd residual_Nm(const FittedArm& fitted, const ArmData& data);

double rms_Nm(const Eigen::VectorXd& residual_Nm);
/// Over the rows of one joint; 0 without rows.
double rms_of_joint_Nm(const Eigen::VectorXd& residual_Nm, const ArmData& data, Eigen::Index joint);

/// Squares in units of each joint's sigma, summed over each block; only rows of `joint`, −1: of all.
std::vector<double> block_squares(const Eigen::VectorXd& residual_Nm, const ArmData& data,
                                  Eigen::Index joint = -1);

/// A recording, and perhaps a joint, on which a correction does harm.
struct Harm {
  bool found = false;
  std::string recording;
  std::string joint;     ///< empty: over all joints
  double before_Nm = 0;  ///< rms residual without the correction
  double after_Nm = 0;
};
/// The worst of the recordings on which `after` is significantly worse than `before`.
Harm worst_harm(const Eigen::VectorXd& before_Nm, const Eigen::VectorXd& after_Nm, const ArmData& data,
                const control::ArmDescription& arm);

/// Values of the chosen terms with 95 % intervals, for each candidate in turn, from blocks drawn with
/// repetition. `given`: the model as given, from which a tilt counts.
std::vector<std::vector<fit::Estimate>> intervals(const control::ArmDescription& given,
                                                  const FittedArm& fitted, const ArmData& data,
                                                  const Catalogue& catalogue, const Chosen& chosen,
                                                  std::uint64_t seed);

}  // namespace identification::robot_gap
