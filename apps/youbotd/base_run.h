/// @file
/// The base on its own: a Cycle with what records and judges it.
#pragma once
#include <functional>
#include <memory>

#include "apps/common/flight_recorder.h"
#include "apps/youbotd/base_recording.h"
#include "apps/youbotd/config.h"
#include "apps/youbotd/cycle.h"
#include "apps/youbotd/path_metrics.h"
#include "apps/youbotd/run.h"

namespace youbotd {

struct Summary : RunSummary {
  PathMetrics path;
  bool fell_behind = false;  ///< stopped, as it was too far from its reference
};

/// Leaves nothing there. @throws std::invalid_argument when recording there would replace something,
/// hal::SetupError when it cannot work.
void check_record_directory(const std::filesystem::path& directory);

class BaseRun final : public Run {
 public:
  /// Robot and truth (may be null) outlive the run. `after_cycle` sees every cycle, as a part of it.
  /// @throws std::invalid_argument for a configuration that no part accepts, or a recording that would be
  ///         replaced; hal::SetupError when nothing can be recorded where it is told to.
  BaseRun(const Config& config, const RunOptions& options, hal::Robot& robot,
          std::unique_ptr<MotionSource> motion, const control::PlanarPose* truth,
          std::function<void(const CycleRecord&)> after_cycle = {});

  void step(std::chrono::nanoseconds now) noexcept override { cycle_.step(now); }
  void request_stop() noexcept override { cycle_.request_stop(); }
  void switch_off() noexcept override { cycle_.switch_off(); }
  bool finished() const noexcept override { return cycle_.finished(); }
  void keep() noexcept override;
  Progress progress() const noexcept override;
  std::optional<RecordingState> recording() const override {
    return recording_ ? std::optional(recording_->state()) : std::nullopt;
  }
  void wrap_up(const drivers::ethercat::PcapRing* frames) override;
  Summary& summary() noexcept override { return summary_; }

 private:
  RunOptions options_;
  hal::Robot& robot_;
  std::unique_ptr<MotionSource> motion_;
  Summary summary_;
  Cycle cycle_;
  apps::FlightRecorder<CycleRecord> flight_recorder_;
  std::unique_ptr<BaseRecording> recording_;  // null when nothing is recorded
  std::function<void(const CycleRecord&)> after_cycle_;
};

}  // namespace youbotd
