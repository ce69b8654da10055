#include "operation/teleop_run.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>

#include "operation/teleop_page.h"
#include "operation/teleop_recording.h"
#include "operation/tunable.h"

namespace operation {
namespace {

constexpr std::chrono::milliseconds kAfterFault{200};

/// Adapts the configuration to the kind of haptic device.
control::Teleoperation::Config fit_to_master(control::Teleoperation::Config config,
                                             const hal::HapticInfo& info) {
  config.master_has_force = info.force_limit_N > 0;
  if (config.master_has_force)
    config.feedback.force_limit_N = std::min(config.feedback.force_limit_N, info.force_limit_N);
  config.mapping.rate_only = info.rate_only;
  config.mapping.follow_rotation = config.mapping.follow_rotation && info.senses_rotation;
  return config;
}

TeleopCycle::Config cycle_config(const Config& config, const hal::HapticInfo& master) {
  TeleopCycle::Config teleoperation;
  static_cast<runtime::Supervisor::Config&>(teleoperation) = config.cycle;
  teleoperation.control = fit_to_master(config.teleoperation, master);
  teleoperation.torque_rate_per_s = config.cycle.torque_rate_per_s;
  return teleoperation;
}

double length(const std::array<double, 3>& v) noexcept { return std::hypot(v[0], v[1], v[2]); }

}  // namespace

runtime::OpenedHaptic open_master(const Config& config, const hal::Clock& clock) {
  runtime::HapticOptions options = config.haptic;
  options.hand.travel.emplace();
  if (runtime::is_simulated(config.robot.name)) runtime::bear_pauses(options);
  return runtime::open_haptic(options, clock, config.cycle.period);
}

TeleopRun::Around TeleopRun::around(const Config& config, const RunOptions& options, const hal::Robot& robot,
                                    bool simulated, std::function<void(const TeleopRecord&)> after_cycle) {
  Around around{
      .rig = "base+arm", .report = nullptr, .recording = nullptr, .after_cycle = std::move(after_cycle)};
  if (!options.record_directory) return around;
  check_record_directory(*options.record_directory, options.record_format);
  around.report = teleop_report(config.teleoperation, robot);
  TeleopRecording::Description description = teleop_recording({.directory = *options.record_directory,
                                                               .config = recording_config(config, options),
                                                               .period = config.cycle.period,
                                                               .simulated = simulated,
                                                               .workspace = config.teleoperation.workspace});
  description.also = [report = around.report.get()](const TeleopRecord& record) { report->add(record); };
  around.recording = std::make_unique<TeleopRecording>(std::move(description));
  return around;
}

TeleopRun::TeleopRun(const Config& config, const RunOptions& options, hal::Robot& robot,
                     hal::HapticDevice& master, const sim::MobileManipulator* truth,
                     std::function<void(const TeleopRecord&)> after_cycle)
    : RecordedRun(config, options, around(config, options, robot, truth != nullptr, std::move(after_cycle)),
                  cycle_config(config, master.info()), robot, master),
      tuned_(config),
      robot_(robot),
      master_(master),
      truth_(truth) {
  summary_.master = master.info().name;
  summary_.master_warnings = master.info().warnings;
  summary_.phases.reserve(64);
}

bool TeleopRun::sum_up(TeleopRecord& record) noexcept {
  if (truth_ != nullptr) add_truth(record, truth_->X_WT().translation(), truth_->contact_force_W_N());
  // A run with many releases has more phases than there is room for; the first ones are kept.
  if (summary_.phases.size() < summary_.phases.capacity() &&
      (summary_.phases.empty() || summary_.phases.back().first != record.phase))
    summary_.phases.emplace_back(record.phase, record.time);
  summary_.largest_grip_force_N = std::max(summary_.largest_grip_force_N, length(record.held_force_H_N));
  summary_.most_energy_given_J = std::max(summary_.most_energy_given_J, record.port_energy_J);
  summary_.furthest_base_m =
      std::max(summary_.furthest_base_m, std::hypot(record.base_W[0], record.base_W[1]));
  if (record.phase == control::TeleopPhase::kOperating) {
    const std::array<double, 3> error{record.setpoint_p_WT_m[0] - record.tip_p_WT_m[0],
                                      record.setpoint_p_WT_m[1] - record.tip_p_WT_m[1],
                                      record.setpoint_p_WT_m[2] - record.tip_p_WT_m[2]};
    summary_.largest_tip_error_m = std::max(summary_.largest_tip_error_m, length(error));
  }
  // The cause of the end, not the long lowering of the arm that follows.
  const runtime::StopReason& last = cycle_.cut_short_by() ? cycle_.cut_short_by() : cycle_.stop_reason();
  return !last || record.time - last.time < kAfterFault;
}

Progress TeleopRun::progress() const noexcept {
  const TeleopRecord& record = cycle_.record();
  return {.phase = control::name(record.phase),
          .time = record.time,
          .base_W = record.base_W,
          .tip_p_WT_m = record.tip_p_WT_m,
          .force_H_N = record.held_force_H_N,
          .silent_checks = cycle_.silent_checks()};
}

std::span<const std::string_view> TeleopRun::tunable() const { return tunable_keys(); }

void TeleopRun::tune(std::string_view key, const Config& config) {
  Config tuned = tuned_;
  copy_tunable(key, config, tuned);
  require_consistent(tuned);
  tuned_ = std::move(tuned);
  cycle_.task().tune(control::Teleoperation::tuning_of(fit_to_master(tuned_.teleoperation, master_.info())));
}

std::string TeleopRun::stop_reason() {
  if (!cycle_.stop_reason()) return {};
  return describe(cycle_.stop_reason(), cycle_.cut_short_by(), robot_, &master_);
}

}  // namespace operation
