#include "apps/youbotd/teleop_session.h"

#include <memory>
#include <stdexcept>

#include "apps/common/open_robot.h"
#include "apps/common/robot_session.h"
#include "apps/youbotd/run_progress.h"

namespace youbotd {
namespace {

using std::chrono::nanoseconds;

void require_simulation(const Config& config, const TeleopOptions& options) {
  if (options.virtual_time) apps::check_virtual_time(config.robot.name);
  if (options.virtual_time && !apps::is_simulated_haptic(config.haptic.name))
    throw std::invalid_argument("--virtual-time: " + config.haptic.name + " lives in real time");
  if (!options.tasks.empty() && !apps::is_simulated_haptic(config.haptic.name))
    throw std::invalid_argument("--demo: the simulated operator needs the simulated pen, --haptic loopback");
}

}  // namespace

TeleopSummary run_teleop_session(const Config& config, const TeleopOptions& options,
                                 const std::atomic<bool>& stop) {
  if (options.record_directory) check_teleop_record_directory(*options.record_directory);
  const nanoseconds period = config.cycle.period;
  const std::unique_ptr<hal::Clock> clock = apps::make_clock(options.virtual_time);
  const apps::OpenedRobot robot = apps::open_robot(config.robot, *clock, period);
  const apps::OpenedHaptic master = open_master(config, *clock);
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

  std::optional<TeleopRun> run;
  {
    const apps::HapticActivation master_activation(*master.device);
    run.emplace(config, options, *robot.robot, *master.device, robot.manipulator.get(), options.after_cycle);
    TeleopSummary& summary = run->summary();
    const apps::RobotActivation robot_activation(*robot.robot);
    RunProgress progress(options.show_progress, options.duration);
    apps::RealTimeThread real_time;  // entered last, when everything is allocated and every other thread runs
    if (!options.virtual_time)
      summary.not_real_time = apps::enter_real_time(real_time, config.real_time, options.allow_non_real_time);
    apps::run_loop(
        *clock, period, *run,
        [&](nanoseconds elapsed) {
          bool done = false;
          // While the robot comes to rest he has nothing to do.
          const bool obeys = run->phase() == control::TeleopPhase::kOperating ||
                             run->phase() == control::TeleopPhase::kLetGo;
          if (operating && obeys) {
            operating->step(period, robot.manipulator ? robot.manipulator->X_WT() : run->X_WT());
            done = operating->finished();
          }
          const bool over = options.duration && elapsed >= *options.duration;
          summary.cut_short = summary.cut_short || (!done && (over || stop.load(std::memory_order_relaxed)));
          return done || summary.cut_short;
        },
        [&](const CycleTimes& /*times*/) {
          run->keep();
          progress.publish(run->progress());
        },
        summary.loop);
    summary.robot_report = robot.robot->report();
  }
  TeleopSummary& summary = run->summary();
  for (std::string& still_moving : robot.robot->report())
    summary.robot_report.push_back(std::move(still_moving));
  if (operating)
    for (std::size_t i = 0; i < operating->tasks().size(); ++i)
      summary.tasks.push_back({std::string(sim::name_of(operating->tasks()[i])), operating->outcomes()[i]});
  run->wrap_up(robot.capture.get());
  return summary;
}

}  // namespace youbotd
