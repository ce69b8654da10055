/// @file
/// The base on its own: its task with what records and judges it.
#pragma once
#include <functional>
#include <memory>
#include <string>

#include "operation/base_task.h"
#include "operation/path_metrics.h"
#include "operation/recorded_run.h"

namespace operation {

struct Summary : RunSummary {
  PathMetrics path;
  bool fell_behind = false;  ///< stopped, as it was too far from its reference
};

class BaseRun final : public RecordedRun<Cycle, CycleRecord, Summary> {
 public:
  /// Robot and truth (may be null) outlive the run. `after_cycle` sees every cycle, as a part of it.
  /// @throws std::invalid_argument for a configuration that no part accepts, or a recording that would be
  ///         replaced; hal::SetupError when the record directory cannot be used.
  BaseRun(const Config& config, const RunOptions& options, hal::Robot& robot,
          std::unique_ptr<MotionSource> motion, const control::PlanarPose* truth,
          std::function<void(const CycleRecord&)> after_cycle = {});

  Progress progress() const noexcept override;

 private:
  bool sum_up(CycleRecord& record) noexcept override;
  std::string stop_reason() override;

  hal::Robot& robot_;
  std::unique_ptr<MotionSource> motion_;  // the cycle's, which is over when this goes
};

}  // namespace operation
