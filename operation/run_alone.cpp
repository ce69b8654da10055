#include "operation/run_alone.h"

#include <optional>
#include <string>
#include <utility>

#include "operation/live_feed.h"
#include "operation/run_progress.h"
#include "runtime/loop.h"
#include "runtime/real_time.h"
#include "runtime/robot_session.h"

namespace operation {
namespace {

/// Shows the robot to a page, as long as it lives.
class ShownRobot {
 public:
  ShownRobot(LiveFeed* feed, const hal::Robot& robot) : feed_(feed) {
    if (feed_ != nullptr) feed_->show(&robot);
  }
  ShownRobot(const ShownRobot&) = delete;
  ShownRobot& operator=(const ShownRobot&) = delete;
  ~ShownRobot() {
    if (feed_ != nullptr) feed_->show(nullptr);
  }

 private:
  LiveFeed* feed_;
};

}  // namespace

void run_alone(hal::Clock& clock, const Config& config, const AloneOptions& options,
               const runtime::OpenedRobot& robot, Run& run, std::optional<std::chrono::nanoseconds> whole,
               const std::atomic<bool>& stop, const std::function<bool()>& is_done) {
  RunSummary& summary = run.summary();
  {
    RunProgress progress(options.show_progress, whole);
    const runtime::RobotActivation activation(*robot.robot);
    std::optional<ShownRobot> shown(std::in_place, options.live, *robot.robot);
    runtime::RealTimeThread
        real_time;  // entered last, when everything is allocated and all other threads run
    if (!options.virtual_time)
      summary.not_real_time =
          runtime::enter_real_time(real_time, config.real_time, options.allow_non_real_time);
    runtime::run_loop(
        clock, config.cycle.period, run,
        [&](std::chrono::nanoseconds elapsed) {
          const bool done = is_done();
          const bool over = options.duration && elapsed >= *options.duration;
          summary.cut_short = summary.cut_short || (!done && (over || stop.load(std::memory_order_relaxed)));
          return done || summary.cut_short;
        },
        [&](const runtime::CycleTimes& /*times*/) {
          run.keep();
          progress.publish(run.progress());
        },
        summary.loop);
    shown.reset();  // one thread at a time may call report()
    summary.robot_report = robot.robot->report();
  }
  for (std::string& still_moving : robot.robot->report())
    summary.robot_report.push_back(std::move(still_moving));
}

}  // namespace operation
