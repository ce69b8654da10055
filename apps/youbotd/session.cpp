#include "apps/youbotd/session.h"

#include <stdexcept>

#include "apps/common/flight_recorder.h"
#include "apps/common/open_robot.h"
#include "apps/common/robot_session.h"
#include "apps/youbotd/base_recording.h"
#include "apps/youbotd/motion_source.h"

namespace youbotd {
namespace {

constexpr std::chrono::seconds kFlightRecorderSpan{1};

std::unique_ptr<BaseRecording> make_recording(const Config& config, const SessionOptions& options) {
  if (!options.record_directory) return nullptr;
  return std::make_unique<BaseRecording>(
      BaseRecording::Description{.directory = *options.record_directory,
                                 .config_file = options.config_file,
                                 .experiment = "path",
                                 .friction_compensation = config.cycle.controller.compensate_friction,
                                 .period = config.cycle.period});
}

}  // namespace

void check_record_directory(const std::filesystem::path& directory) {
  if (BaseRecording::holds_recording(directory))
    throw std::invalid_argument("--record: " + directory.string() +
                                " holds a recording already; name a new directory");
}

Summary run_session(const Config& config, const SessionOptions& options, const std::atomic<bool>& stop) {
  if (options.record_directory) check_record_directory(*options.record_directory);
  Summary summary;
  summary.robot = config.robot.name;
  if (options.virtual_time && !apps::is_simulated(config.robot.name))
    throw std::invalid_argument("--virtual-time: " + config.robot.name + " lives in real time");
  summary.virtual_time = options.virtual_time;

  const std::unique_ptr<hal::Clock> clock = apps::make_clock(options.virtual_time);
  const apps::OpenedRobot opened = apps::open_robot(config.robot, *clock, config.cycle.period);
  PathSource motion(config.path);
  Cycle cycle(config.cycle, *opened.robot, motion, opened.truth);
  apps::FlightRecorder<CycleRecord> flight_recorder(
      static_cast<std::size_t>(kFlightRecorderSpan / config.cycle.period));
  const std::unique_ptr<BaseRecording> recording = make_recording(config, options);
  {
    const apps::RobotActivation activation(*opened.robot);
    apps::RealTimeThread real_time;  // entered last, when everything is allocated and every other thread runs
    if (!options.virtual_time)
      summary.not_real_time = apps::enter_real_time(real_time, config.real_time, options.allow_non_real_time);
    apps::run_loop(
        *clock, config.cycle.period, cycle,
        [&](std::chrono::nanoseconds elapsed) {
          const bool over = options.duration && elapsed >= *options.duration;
          summary.cut_short = summary.cut_short || over || stop.load(std::memory_order_relaxed);
          return summary.cut_short;
        },
        [&](const CycleRecord& record) {
          summary.path.add(record);
          flight_recorder.add(record);
          if (options.after_cycle) options.after_cycle(record);
          if (!recording) return;
          if (options.virtual_time) recording->wait_for_room();
          recording->add(record);
        },
        summary.loop);
    summary.robot_report = opened.robot->report();
  }
  for (std::string& still_moving : opened.robot->report())
    summary.robot_report.push_back(std::move(still_moving));

  if (recording) finish(*recording, summary);
  if (const StopReason& reason = cycle.stop_reason()) {
    summary.stop_reason = describe(reason, *opened.robot);
    summary.fault_report = apps::write_fault_report(
        options.record_directory,
        [&](const std::filesystem::path& path) {
          flight_recorder.write(path, "base", summary.stop_reason, cycle_columns(), append_cycle);
        },
        opened.capture.get(), summary.stop_reason, summary.recording_problems);
  }
  return summary;
}

}  // namespace youbotd
