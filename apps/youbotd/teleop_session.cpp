#include "apps/youbotd/teleop_session.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "apps/common/flight_recorder.h"
#include "apps/common/open_haptic.h"
#include "apps/common/open_robot.h"
#include "apps/common/robot_session.h"
#include "apps/youbotd/teleop_recording.h"

namespace youbotd {
namespace {

using std::chrono::nanoseconds;

constexpr std::chrono::seconds kFlightRecorderSpan{1};
constexpr std::chrono::milliseconds kAfterFault{200};

/// The pen of the loopback has an omega.6's travel.
apps::OpenedHaptic open_master(const apps::HapticOptions& options, const hal::Clock& clock,
                               nanoseconds period) {
  apps::HapticOptions with_stops = options;
  with_stops.hand.travel.emplace();
  return apps::open_haptic(with_stops, clock, period);
}

/// What the master is tells how it can be used.
control::Teleoperation::Config fit_to_master(control::Teleoperation::Config config,
                                             const hal::HapticInfo& info) {
  config.master_has_force = info.force_limit_N > 0;
  if (config.master_has_force)
    config.feedback.force_limit_N = std::min(config.feedback.force_limit_N, info.force_limit_N);
  config.mapping.rate_only = info.rate_only;
  config.mapping.follow_rotation = config.mapping.follow_rotation && info.senses_rotation;
  return config;
}

/// Sums up what a run was like.
class Observer {
 public:
  explicit Observer(TeleopSummary& summary) : summary_(summary) { summary_.phases.reserve(64); }

  void add(const TeleopRecord& record) noexcept {
    // A run that is let go of again and again has more phases than there is room for; the first ones count.
    if (summary_.phases.size() < summary_.phases.capacity() &&
        (summary_.phases.empty() || summary_.phases.back().first != record.phase))
      summary_.phases.emplace_back(record.phase, record.time);
    const auto norm = [](const std::array<double, 3>& v) { return std::hypot(v[0], v[1], v[2]); };
    summary_.largest_grip_force_N = std::max(summary_.largest_grip_force_N, norm(record.held_force_H_N));
    summary_.most_energy_given_J = std::max(summary_.most_energy_given_J, record.port_energy_J);
    summary_.furthest_base_m =
        std::max(summary_.furthest_base_m, std::hypot(record.base_W[0], record.base_W[1]));
    if (record.phase != control::TeleopPhase::kOperating) return;
    const std::array<double, 3> error{record.setpoint_p_WT_m[0] - record.tip_p_WT_m[0],
                                      record.setpoint_p_WT_m[1] - record.tip_p_WT_m[1],
                                      record.setpoint_p_WT_m[2] - record.tip_p_WT_m[2]};
    summary_.largest_tip_error_m = std::max(summary_.largest_tip_error_m, norm(error));
  }

 private:
  TeleopSummary& summary_;
};

void require_simulation(const Config& config, const TeleopOptions& options) {
  if (options.virtual_time && !apps::is_simulated(config.robot.name))
    throw std::invalid_argument("--virtual-time: " + config.robot.name + " lives in real time");
  if (options.virtual_time && !apps::is_simulated_haptic(config.haptic.name))
    throw std::invalid_argument("--virtual-time: " + config.haptic.name + " lives in real time");
  if (!options.tasks.empty() && !apps::is_simulated_haptic(config.haptic.name))
    throw std::invalid_argument("--demo: the simulated operator needs the simulated pen, --haptic loopback");
}

}  // namespace

TeleopSummary run_teleop_session(const Config& config, const TeleopOptions& options,
                                 const std::atomic<bool>& stop) {
  if (options.record_directory && TeleopRecording::holds_recording(*options.record_directory))
    throw std::invalid_argument("--record: " + options.record_directory->string() +
                                " holds a recording already; name a new directory");
  const nanoseconds period = config.cycle.period;
  TeleopSummary summary;
  summary.robot = config.robot.name;
  summary.virtual_time = options.virtual_time;

  const std::unique_ptr<hal::Clock> clock = apps::make_clock(options.virtual_time);
  const apps::OpenedRobot robot = apps::open_robot(config.robot, *clock, period);
  const apps::OpenedHaptic master = open_master(config.haptic, *clock, period);
  require_simulation(config, options);  // names nobody knows were refused above; no device was touched
  std::optional<sim::SimulatedOperator> operating;
  if (master.hand && !options.tasks.empty()) {
    // He has learned how far the tip goes for a way of the pen, and where the rim is.
    const control::HapticMapping::Config& mapping = config.teleoperation.mapping;
    sim::OperatorParameters knows;
    knows.motion_scale = mapping.motion_scale;
    knows.boundary = mapping.boundary;
    operating.emplace(*master.hand, options.tasks, knows);
  }

  std::unique_ptr<TeleopRecording> recording;
  if (options.record_directory)
    recording = std::make_unique<TeleopRecording>(*options.record_directory, options.config_file, period);
  apps::FlightRecorder<TeleopRecord> flight_recorder(static_cast<std::size_t>(kFlightRecorderSpan / period));
  Observer observer(summary);
  {
    const apps::HapticActivation master_activation(*master.device);
    summary.master = master.device->info().name;
    summary.master_warnings = master.device->info().warnings;
    const TeleopCycle::Config cycle_config{
        .control = fit_to_master(config.teleoperation, master.device->info()),
        .stall_timeout = config.cycle.command_timeout,
        .enable_timeout = config.cycle.enable_timeout};
    TeleopCycle cycle(cycle_config, *robot.robot, *master.device);
    const apps::RobotActivation robot_activation(*robot.robot);
    apps::RealTimeThread real_time;  // entered last, when everything is allocated and every other thread runs
    if (!options.virtual_time)
      summary.not_real_time = apps::enter_real_time(real_time, config.real_time, options.allow_non_real_time);
    apps::run_loop(
        *clock, period, cycle,
        [&](nanoseconds elapsed) {
          bool done = false;
          // While the robot comes to rest he has nothing to do.
          const bool obeys = cycle.phase() == control::TeleopPhase::kOperating ||
                             cycle.phase() == control::TeleopPhase::kLetGo;
          if (operating && obeys) {
            operating->step(period, robot.manipulator ? robot.manipulator->X_WT() : cycle.X_WT());
            done = operating->finished();
          }
          const bool over = options.duration && elapsed >= *options.duration;
          summary.cut_short = summary.cut_short || (!done && (over || stop.load(std::memory_order_relaxed)));
          return done || summary.cut_short;
        },
        [&](TeleopRecord& record) {
          if (robot.manipulator) {
            const sim::MobileManipulator& truth = *robot.manipulator;
            cycle.tell_truth({truth.X_WT().translation(), truth.contact_force_W_N()});
          }
          observer.add(record);
          // What led to the end, and not the long lowering of the arm that follows.
          if (!cycle.end().fault() || record.time - cycle.end().time < kAfterFault)
            flight_recorder.add(record);
          if (options.after_cycle) options.after_cycle(record);
          if (!recording) return;
          if (options.virtual_time) recording->wait_for_room();
          recording->add(record);
        },
        summary.loop);
    summary.robot_report = robot.robot->report();
    if (cycle.end().fault()) summary.stop_reason = describe(cycle.end(), *robot.robot, *master.device);
  }
  for (std::string& still_moving : robot.robot->report())
    summary.robot_report.push_back(std::move(still_moving));
  if (operating)
    for (std::size_t i = 0; i < operating->tasks().size(); ++i)
      summary.tasks.push_back({std::string(sim::name_of(operating->tasks()[i])), operating->outcomes()[i]});
  if (recording) finish(*recording, summary);
  if (!summary.stop_reason.empty())
    summary.fault_report = apps::write_fault_report(
        options.record_directory,
        [&](const std::filesystem::path& path) {
          flight_recorder.write(path, "base+arm", summary.stop_reason, teleop_columns(), append_teleop);
        },
        robot.capture.get(), summary.stop_reason, summary.recording_problems);
  return summary;
}

}  // namespace youbotd
