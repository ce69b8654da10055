/// @file
/// The gap between any models and one set of recordings: without a search, and without changing the model.
#pragma once
#include <functional>
#include <memory>
#include <vector>

#include "identification/gap/prediction.h"
#include "identification/gap/signals.h"

namespace identification::gap {

/// Recordings, repaired and filtered once; then one model after another.
class MeasuredGap {
 public:
  /// @throws std::invalid_argument as analyse() does, if the recordings cannot be compared with `base`.
  MeasuredGap(const model::effects::DriveModel& base, std::vector<Source> data, const Enough& enough = {});

  /// Torque that is added to a prediction, at each sample.
  using Added = std::function<std::vector<double>(const Signals&)>;
  /// rms torque residual in the band [N·m], where the joint moves. Parameters stay as they are.
  double gap_Nm(const model::effects::DriveModel& model, const Added& added = {}) const;
  /// Speeds of all samples in motion [rad/s].
  std::vector<double> speeds_rad_per_s() const;

  const std::vector<Signals>& signals() const noexcept { return *signals_; }
  const Rows& rows() const noexcept { return rows_; }
  const std::vector<Diagnosis>& diagnosis() const noexcept { return diagnosis_; }

 private:
  std::vector<Diagnosis> diagnosis_;
  std::unique_ptr<std::vector<Signals>> signals_;  // rows_ refers to it
  Rows rows_;
};

}  // namespace identification::gap
