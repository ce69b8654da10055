#include "apps/youbotd/run_alone.h"

#include <string>
#include <utility>

#include "apps/common/loop.h"
#include "apps/common/real_time.h"
#include "apps/common/robot_session.h"
#include "apps/youbotd/run_progress.h"

namespace youbotd {

void run_alone(hal::Clock& clock, const Config& config, const AloneOptions& options,
               const apps::OpenedRobot& robot, Run& run, std::optional<std::chrono::nanoseconds> whole,
               const std::atomic<bool>& stop, const std::function<bool()>& is_done) {
  RunSummary& summary = run.summary();
  {
    RunProgress progress(options.show_progress, whole);
    const apps::RobotActivation activation(*robot.robot);
    apps::RealTimeThread real_time;  // entered last, when everything is allocated and every other thread runs
    if (!options.virtual_time)
      summary.not_real_time = apps::enter_real_time(real_time, config.real_time, options.allow_non_real_time);
    apps::run_loop(
        clock, config.cycle.period, run,
        [&](std::chrono::nanoseconds elapsed) {
          const bool done = is_done();
          const bool over = options.duration && elapsed >= *options.duration;
          summary.cut_short = summary.cut_short || (!done && (over || stop.load(std::memory_order_relaxed)));
          return done || summary.cut_short;
        },
        [&](const apps::CycleTimes& /*times*/) {
          run.keep();
          progress.publish(run.progress());
        },
        summary.loop);
    summary.robot_report = robot.robot->report();
  }
  for (std::string& still_moving : robot.robot->report())
    summary.robot_report.push_back(std::move(still_moving));
}

}  // namespace youbotd
