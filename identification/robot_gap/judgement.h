/// @file
/// How a fitted model does on recordings: residuals by channel, recording and block, intervals, and whether a
/// correction holds on every kind of motion.
#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "identification/fit/statistics.h"
#include "identification/robot_gap/search.h"

namespace identification::robot_gap {

/// Residuals of a model in the rows of the data, each in the unit of its channel.
Eigen::VectorXd residual_of(const View& view, const Fitted& fitted);

/// Over the rows of one channel; 0 without rows.
double rms_of_channel(const Eigen::VectorXd& residual, const RowPlan& plan, Eigen::Index channel);

/// Squares in units of each channel's sigma, summed over each block; only rows of `channel`, −1: of all.
std::vector<double> block_squares(const Eigen::VectorXd& residual, const View& view,
                                  Eigen::Index channel = -1);

/// A recording, and perhaps a channel, on which a correction does harm.
struct Harm {
  bool found = false;
  std::string place;  ///< "fast, joint2"
  std::string unit;   ///< of both: the channel's, or "noise floors" over all channels
  double before = 0;  ///< rms residual without the correction
  double after = 0;
};
/// The worst of the recordings on which `after` is significantly worse than `before`, over all channels or in
/// one of those with `counts`.
Harm worst_harm(const Eigen::VectorXd& before, const Eigen::VectorXd& after, const View& view,
                const std::vector<bool>& counts);

/// Values of the chosen terms with 95 % intervals, for each candidate in turn, from blocks drawn with
/// repetition.
std::vector<std::vector<fit::Estimate>> intervals(const View& view, const Fitted& fitted,
                                                  const Chosen& chosen, std::uint64_t seed);

}  // namespace identification::robot_gap
