#include "apps/youbotd/base_run.h"

#include <stdexcept>
#include <utility>

#include "apps/common/output_directory.h"
#include "apps/common/plausibility_config.h"
#include "apps/common/robot_session.h"
#include "apps/youbotd/check_recording.h"

namespace youbotd {
namespace {

constexpr std::chrono::seconds kFlightRecorderSpan{1};

std::unique_ptr<BaseRecording> make_recording(const Config& config, const RunOptions& options) {
  if (!options.record_directory) return nullptr;
  check_record_directory(*options.record_directory);
  return std::make_unique<BaseRecording>(
      BaseRecording::Description{.directory = *options.record_directory,
                                 .config = {options.config_file, options.settings},
                                 .experiment = options.experiment,
                                 .friction_compensation = config.cycle.controller.compensate_friction,
                                 .period = config.cycle.period,
                                 .workspace = config.cycle.workspace});
}

}  // namespace

void check_record_directory(const std::filesystem::path& directory) {
  if (BaseRecording::holds_recording(directory))
    throw std::invalid_argument("--record: " + directory.string() +
                                " holds a recording already; name a new directory");
  apps::try_output_directory(directory);
  require_room(directory);
}

BaseRun::BaseRun(const Config& config, const RunOptions& options, hal::Robot& robot,
                 std::unique_ptr<MotionSource> motion, const control::PlanarPose* truth,
                 std::function<void(const CycleRecord&)> after_cycle)
    : options_(options),
      robot_(robot),
      motion_(std::move(motion)),
      cycle_(config.cycle, robot, *motion_, truth),
      flight_recorder_(static_cast<std::size_t>(kFlightRecorderSpan / config.cycle.period)),
      recording_(make_recording(config, options)),
      after_cycle_(std::move(after_cycle)) {
  summary_.robot = config.robot.name;
  summary_.virtual_time = options.virtual_time;
  apps::warn_of(config.cycle.checks_off);
}

void BaseRun::keep() noexcept {
  CycleRecord& record = cycle_.record();
  record.wake_up = times_.wake_up;
  record.step = times_.step;
  summary_.path.add(record);
  count_limiters(record.limited, summary_);
  flight_recorder_.add(record);
  if (after_cycle_) after_cycle_(record);
  if (!recording_) return;
  if (options_.virtual_time) recording_->wait_for_room();
  recording_->add(record);
}

Progress BaseRun::progress() const noexcept {
  const CycleRecord& record = cycle_.record();
  return {.phase = name(record.phase),
          .time = record.time,
          .base_W = record.odometry_W,
          .silent_checks = cycle_.silent_checks()};
}

void BaseRun::wrap_up(const drivers::ethercat::PcapRing* frames) {
  if (recording_) finish(*recording_, summary_);
  summary_.once_silent_checks = cycle_.once_silent_checks();
  const StopReason& reason = cycle_.stop_reason();
  if (!reason) return;
  summary_.fell_behind =
      reason.kind == StopReason::Kind::kBehind || reason.kind == StopReason::Kind::kTurnedBehind;
  summary_.stop_reason = describe(reason, robot_);
  summary_.fault_report = apps::write_fault_report(
      options_.record_directory,
      [&](const std::filesystem::path& path) {
        flight_recorder_.write(path, "base", summary_.stop_reason, cycle_columns(), append_cycle);
      },
      frames, summary_.stop_reason, summary_.recording_problems);
}

}  // namespace youbotd
