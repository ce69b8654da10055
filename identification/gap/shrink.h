/// @file
/// How much of a gap a model closes, how sure that is, and what is left as a share of the torque.
#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace identification::gap {

/// Share of the rms residual that is gone, 1 - after/before, with its 95 % interval; below zero where it
/// grew.
struct Shrink {
  double share = 0;
  double lower = 0;
  double upper = 0;
};

/// One held-out recording; residuals are those of the torque, rms.
struct RecordingGap {
  std::string recording;
  double before_Nm = 0;
  double after_Nm = 0;
  double nrmse_before = 0;  ///< over the standard deviation of the torque
  double nrmse_after = 0;
  double vaf_before = 0;  ///< variance accounted for: 1 - var(residual)/var(torque)
  double vaf_after = 0;
};

/// Rows of held-out data in the order of time, recording after recording.
struct HeldOutRows {
  std::vector<std::size_t> recording;  ///< of each row
  Eigen::VectorXd torque_Nm;
  Eigen::VectorXd before_Nm;  ///< what the given model leaves
  Eigen::VectorXd after_Nm;   ///< what the new one leaves
};

/// Interval by resampling recordings, and in each of them blocks of rows, as residuals near each other are
/// alike (H. Künsch, Annals of Statistics 17, 1989). The same seed gives the same interval.
Shrink shrink_of(const HeldOutRows& rows, std::uint64_t seed);

/// `names`: of recordings by their number. Those without rows are left out; the last entry is of all rows and
/// has no name.
std::vector<RecordingGap> recording_gaps(const HeldOutRows& rows, const std::vector<std::string>& names);

}  // namespace identification::gap
