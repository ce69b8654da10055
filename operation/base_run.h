/// @file
/// A run of the base: its task with recording and summary.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "operation/base_task.h"
#include "operation/path_metrics.h"
#include "operation/recorded_run.h"

namespace operation {

struct Summary : RunSummary {
  PathMetrics path;
  bool fell_behind = false;  ///< stopped because it was too far from its reference
  std::optional<std::array<double, 4>>
      learned_factors{};  ///< of the wheels' friction; empty: nothing was learned
};

class BaseRun final : public RecordedRun<Cycle, CycleRecord, Summary> {
 public:
  /// Robot and truth (may be null) must outlive the run. `after_cycle` is called in every cycle, as a part of
  /// it.
  /// @throws std::invalid_argument for an invalid configuration, or if a recording would be replaced;
  /// hal::SetupError if the record directory cannot be used.
  BaseRun(const Config& config, const RunOptions& options, hal::Robot& robot,
          std::unique_ptr<MotionSource> motion, const control::PlanarPose* truth,
          std::function<void(const CycleRecord&)> after_cycle = {});

  Progress progress() const noexcept override;

 private:
  static Around around(const Config& config, const RunOptions& options,
                       std::function<void(const CycleRecord&)> after_cycle);
  bool sum_up(CycleRecord& record) noexcept override;
  std::string stop_reason() override;

  hal::Robot& robot_;
  std::unique_ptr<MotionSource> motion_;  // used by the cycle; destroyed after it
  bool adapts_ = false;
  std::uint64_t sliding_cycles_ = 0;
};

}  // namespace operation
