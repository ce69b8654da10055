#include "operation/base_run.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "operation/base_page.h"
#include "operation/base_recording.h"

namespace operation {
namespace {

/// Above the blend speed of the compensation by any setting.
constexpr double kSliding_rad_per_s = 0.25;
/// A second of sliding has shown the friction.
constexpr std::uint64_t kLearnedCycles = 1000;

}  // namespace

BaseRun::Around BaseRun::around(const Config& config, const RunOptions& options,
                                std::function<void(const CycleRecord&)> after_cycle) {
  Around around{
      .rig = "base", .report = nullptr, .recording = nullptr, .after_cycle = std::move(after_cycle)};
  if (!options.record_directory) return around;
  check_record_directory(*options.record_directory, options.record_format);
  around.report = base_report(config.cycle, options.experiment);
  BaseRecording::Description description =
      base_recording({.directory = *options.record_directory,
                      .config = recording_config(config, options),
                      .experiment = options.experiment,
                      .friction_compensation = config.cycle.controller.compensate_friction,
                      .period = config.cycle.period,
                      .workspace = config.cycle.workspace});
  description.also = [report = around.report.get()](const CycleRecord& record) { report->add(record); };
  around.recording = std::make_unique<BaseRecording>(std::move(description));
  return around;
}

BaseRun::BaseRun(const Config& config, const RunOptions& options, hal::Robot& robot,
                 std::unique_ptr<MotionSource> motion, const control::PlanarPose* truth,
                 std::function<void(const CycleRecord&)> after_cycle)
    : RecordedRun(config, options, around(config, options, std::move(after_cycle)), config.cycle, robot,
                  *motion, truth),
      robot_(robot),
      motion_(std::move(motion)) {
  adapts_ = config.cycle.controller.adapt && config.cycle.controller.compensate_friction;
}

bool BaseRun::sum_up(CycleRecord& record) noexcept {
  summary_.path.add(record);
  // At rest the factors are what the next motion may need.
  const auto slides = [](double speed_rad_per_s) { return std::abs(speed_rad_per_s) > kSliding_rad_per_s; };
  if (adapts_ && record.phase == Phase::kRunning && std::ranges::all_of(record.velocity_rad_per_s, slides) &&
      ++sliding_cycles_ > kLearnedCycles)
    summary_.learned_factors = record.friction_factor;
  return true;
}

Progress BaseRun::progress() const noexcept {
  const CycleRecord& record = cycle_.record();
  return {.phase = name(record.phase),
          .time = record.time,
          .base_W = record.odometry_W,
          .silent_checks = cycle_.silent_checks()};
}

std::string BaseRun::stop_reason() {
  using Kind = runtime::StopReason::Kind;
  const runtime::StopReason& reason = cycle_.stop_reason();
  if (!reason) return {};
  summary_.fell_behind = reason.kind == Kind::kBehind || reason.kind == Kind::kTurnedBehind;
  return describe(reason, cycle_.cut_short_by(), robot_);
}

}  // namespace operation
