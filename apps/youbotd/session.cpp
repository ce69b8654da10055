#include "apps/youbotd/session.h"

#include <memory>
#include <utility>

#include "apps/common/open_robot.h"
#include "apps/common/robot_session.h"
#include "apps/youbotd/motion_source.h"
#include "apps/youbotd/run_progress.h"

namespace youbotd {

Summary run_session(const Config& config, const SessionOptions& options, const std::atomic<bool>& stop) {
  if (options.record_directory) check_record_directory(*options.record_directory);
  if (options.virtual_time) apps::check_virtual_time(config.robot.name);

  const std::unique_ptr<hal::Clock> clock = apps::make_clock(options.virtual_time);
  const apps::OpenedRobot opened = apps::open_robot(config.robot, *clock, config.cycle.period);
  auto path = std::make_unique<PathSource>(config.path);
  const auto whole =
      options.duration.value_or(std::chrono::duration_cast<std::chrono::nanoseconds>(path->duration()));
  BaseRun run(config, options, *opened.robot, std::move(path), opened.truth, options.after_cycle);
  Summary& summary = run.summary();
  {
    RunProgress progress(options.show_progress, whole);
    const apps::RobotActivation activation(*opened.robot);
    apps::RealTimeThread real_time;  // entered last, when everything is allocated and every other thread runs
    if (!options.virtual_time)
      summary.not_real_time = apps::enter_real_time(real_time, config.real_time, options.allow_non_real_time);
    apps::run_loop(
        *clock, config.cycle.period, run,
        [&](std::chrono::nanoseconds elapsed) {
          const bool over = options.duration && elapsed >= *options.duration;
          summary.cut_short = summary.cut_short || over || stop.load(std::memory_order_relaxed);
          return summary.cut_short;
        },
        [&](const CycleTimes& /*times*/) {
          run.keep();
          progress.publish(run.progress());
        },
        summary.loop);
    summary.robot_report = opened.robot->report();
  }
  for (std::string& still_moving : opened.robot->report())
    summary.robot_report.push_back(std::move(still_moving));
  run.wrap_up(opened.capture.get());
  return summary;
}

}  // namespace youbotd
