/// @file
/// How much of a gap a model closes, with its uncertainty, and the rest relative to the torque.
#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace identification::gap {

/// Removed share of the rms residual, 1 - after/before, with its 95 % interval; negative if it grew.
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

/// Rows of held-out data in time order, recording after recording.
struct HeldOutRows {
  std::vector<std::size_t> recording;  ///< of each row
  Eigen::VectorXd torque_Nm;
  Eigen::VectorXd before_Nm;  ///< residual of the given model
  Eigen::VectorXd after_Nm;   ///< residual of the new one
};

/// Interval by resampling recordings, and blocks of rows within them, because neighbouring residuals are
/// correlated (H. Künsch, Annals of Statistics 17, 1989). The same seed gives the same interval.
Shrink shrink_of(const HeldOutRows& rows, std::uint64_t seed);

/// `names`: of recordings by their number. Those without rows are left out; the last entry covers all rows
/// and has no name.
std::vector<RecordingGap> recording_gaps(const HeldOutRows& rows, const std::vector<std::string>& names);

}  // namespace identification::gap
