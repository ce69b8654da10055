#include "operation/teleop_session.h"

#include <memory>
#include <optional>
#include <stdexcept>

#include "runtime/open_robot.h"
#include "runtime/robot_session.h"

namespace operation {
namespace {

using std::chrono::nanoseconds;

void require_simulation(const Config& config, const TeleopOptions& options) {
  if (options.virtual_time) runtime::check_virtual_time(config.robot.name);
  if (options.virtual_time && !runtime::is_simulated_haptic(config.haptic.name))
    throw std::invalid_argument("--virtual-time: " + config.haptic.name + " lives in real time");
  if (!options.tasks.empty() && !runtime::is_simulated_haptic(config.haptic.name))
    throw std::invalid_argument(
        "--demo: the simulated operator needs the simulated handle, --haptic loopback");
}

}  // namespace

TeleopSummary run_teleop_session(const Config& config, const TeleopOptions& options,
                                 const std::atomic<bool>& stop) {
  if (options.record_directory) check_record_directory(*options.record_directory, options.record_format);
  const nanoseconds period = config.cycle.period;
  const std::unique_ptr<hal::Clock> clock = runtime::make_clock(options.virtual_time);
  const runtime::OpenedRobot robot = runtime::open_robot(config.robot, *clock, period);
  const runtime::OpenedHaptic master = open_master(config, *clock);
  require_simulation(config, options);  // unknown names were rejected above; no device has been touched
  std::optional<sim::SimulatedOperator> operating;
  if (master.hand && !options.tasks.empty()) {
    // They know the motion scale between end effector and handle, and the boundary.
    const control::HapticMapping::Config& mapping = config.teleoperation.mapping;
    sim::OperatorParameters knows;
    knows.motion_scale = mapping.motion_scale;
    knows.boundary = mapping.boundary;
    operating.emplace(*master.hand, options.tasks, knows);
  }

  std::optional<TeleopRun> run;
  {
    const runtime::HapticActivation master_activation(*master.device);
    run.emplace(config, options, *robot.robot, *master.device, robot.manipulator.get(), options.after_cycle);
    run_alone(*clock, config, options, robot, *run, options.duration, stop, [&] {
      if (!operating) return false;
      // While the robot comes to rest they have nothing to do.
      const bool obeys =
          run->phase() == control::TeleopPhase::kOperating || run->phase() == control::TeleopPhase::kLetGo;
      if (!obeys) return false;
      operating->step(period, robot.manipulator ? robot.manipulator->X_WT() : run->X_WT());
      return operating->finished();
    });
  }
  TeleopSummary& summary = run->summary();
  if (operating)
    for (std::size_t i = 0; i < operating->tasks().size(); ++i)
      summary.tasks.push_back({std::string(sim::name_of(operating->tasks()[i])), operating->outcomes()[i]});
  run->wrap_up(robot.capture.get());
  return summary;
}

}  // namespace operation
