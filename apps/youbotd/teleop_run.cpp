#include "apps/youbotd/teleop_run.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "apps/common/output_directory.h"
#include "apps/common/plausibility_config.h"
#include "apps/common/robot_session.h"
#include "apps/youbotd/check_recording.h"

namespace youbotd {
namespace {

using std::chrono::nanoseconds;

constexpr std::chrono::seconds kFlightRecorderSpan{1};
constexpr std::chrono::milliseconds kAfterFault{200};

/// The kind of master decides how it is used.
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
  return {.control = fit_to_master(config.teleoperation, master),
          .torque_rate_per_s = config.cycle.torque_rate_per_s,
          .stall_timeout = config.cycle.command_timeout,
          .enable_timeout = config.cycle.enable_timeout,
          .checks_off = config.cycle.checks_off};
}

std::unique_ptr<TeleopRecording> make_recording(const Config& config, const RunOptions& options,
                                                bool simulated) {
  if (!options.record_directory) return nullptr;
  check_teleop_record_directory(*options.record_directory);
  return std::make_unique<TeleopRecording>(*options.record_directory,
                                           apps::RecordingConfig{options.config_file, options.settings},
                                           config.cycle.period, simulated, config.teleoperation.workspace);
}

double length(const std::array<double, 3>& v) noexcept { return std::hypot(v[0], v[1], v[2]); }

}  // namespace

apps::OpenedHaptic open_master(const Config& config, const hal::Clock& clock) {
  apps::HapticOptions options = config.haptic;
  options.hand.travel.emplace();
  if (apps::is_simulated(config.robot.name)) apps::bear_pauses(options);
  return apps::open_haptic(options, clock, config.cycle.period);
}

void check_teleop_record_directory(const std::filesystem::path& directory) {
  if (TeleopRecording::holds_recording(directory))
    throw std::invalid_argument("--record: " + directory.string() +
                                " holds a recording already; name a new directory");
  apps::try_output_directory(directory);
  require_room(directory);
}

TeleopRun::TeleopRun(const Config& config, const RunOptions& options, hal::Robot& robot,
                     hal::HapticDevice& master, const sim::MobileManipulator* truth,
                     std::function<void(const TeleopRecord&)> after_cycle)
    : options_(options),
      robot_(robot),
      master_(master),
      truth_(truth),
      cycle_(cycle_config(config, master.info()), robot, master),
      flight_recorder_(static_cast<std::size_t>(kFlightRecorderSpan / config.cycle.period)),
      recording_(make_recording(config, options, truth != nullptr)),
      after_cycle_(std::move(after_cycle)) {
  summary_.robot = config.robot.name;
  summary_.virtual_time = options.virtual_time;
  summary_.master = master.info().name;
  summary_.master_warnings = master.info().warnings;
  summary_.phases.reserve(64);
  apps::warn_of(config.cycle.checks_off);
}

void TeleopRun::keep() noexcept {
  TeleopRecord& record = cycle_.record();
  record.wake_up = times_.wake_up;
  record.step = times_.step;
  if (truth_ != nullptr) cycle_.tell_truth({truth_->X_WT().translation(), truth_->contact_force_W_N()});
  sum_up(record);
  count_limiters(record.limited, summary_);
  // What led to the end, and not the long lowering of the arm that follows.
  if (!cycle_.end().fault() || record.time - cycle_.end().time < kAfterFault) flight_recorder_.add(record);
  if (after_cycle_) after_cycle_(record);
  if (!recording_) return;
  if (options_.virtual_time) recording_->wait_for_room();
  recording_->add(record);
}

void TeleopRun::sum_up(const TeleopRecord& record) noexcept {
  // A run that is let go of again and again has more phases than there is room for; the first ones count.
  if (summary_.phases.size() < summary_.phases.capacity() &&
      (summary_.phases.empty() || summary_.phases.back().first != record.phase))
    summary_.phases.emplace_back(record.phase, record.time);
  summary_.largest_grip_force_N = std::max(summary_.largest_grip_force_N, length(record.held_force_H_N));
  summary_.most_energy_given_J = std::max(summary_.most_energy_given_J, record.port_energy_J);
  summary_.furthest_base_m =
      std::max(summary_.furthest_base_m, std::hypot(record.base_W[0], record.base_W[1]));
  if (record.phase != control::TeleopPhase::kOperating) return;
  const std::array<double, 3> error{record.setpoint_p_WT_m[0] - record.tip_p_WT_m[0],
                                    record.setpoint_p_WT_m[1] - record.tip_p_WT_m[1],
                                    record.setpoint_p_WT_m[2] - record.tip_p_WT_m[2]};
  summary_.largest_tip_error_m = std::max(summary_.largest_tip_error_m, length(error));
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

void TeleopRun::wrap_up(const drivers::ethercat::PcapRing* frames) {
  if (recording_) finish(*recording_, summary_);
  summary_.once_silent_checks = cycle_.once_silent_checks();
  if (!cycle_.end().fault()) return;
  summary_.stop_reason = describe(cycle_.end(), robot_, master_);
  summary_.fault_report = apps::write_fault_report(
      options_.record_directory,
      [&](const std::filesystem::path& path) {
        flight_recorder_.write(path, "base+arm", summary_.stop_reason, teleop_columns(), append_teleop);
      },
      frames, summary_.stop_reason, summary_.recording_problems);
}

}  // namespace youbotd
