#include "operation/session.h"

#include <memory>
#include <utility>

#include "operation/motion_source.h"
#include "runtime/open_robot.h"
#include "runtime/robot_session.h"

namespace operation {

Summary run_session(const Config& config, const SessionOptions& options, const std::atomic<bool>& stop) {
  if (options.record_directory) check_record_directory(*options.record_directory, options.record_format);
  if (options.virtual_time) runtime::check_virtual_time(config.robot.name);

  const std::unique_ptr<hal::Clock> clock = runtime::make_clock(options.virtual_time);
  const runtime::OpenedRobot opened = runtime::open_robot(config.robot, *clock, config.cycle.period);
  auto path = std::make_unique<PathSource>(config.path);
  const auto whole =
      options.duration.value_or(std::chrono::duration_cast<std::chrono::nanoseconds>(path->duration()));
  BaseRun run(config, options, *opened.robot, std::move(path), opened.truth, options.after_cycle);
  run_alone(*clock, config, options, opened, run, whole, stop);
  run.wrap_up(opened.capture.get());
  return run.summary();
}

}  // namespace operation
