#include "apps/youbotd/session.h"

#include <ctime>
#include <exception>
#include <stdexcept>

#include "apps/common/open_robot.h"
#include "apps/youbotd/base_recording.h"
#include "apps/youbotd/flight_recorder.h"
#include "apps/youbotd/motion_source.h"
#include "hal/clock.h"
#include "hal/setup_error.h"

namespace youbotd {
namespace {

constexpr std::chrono::seconds kFlightRecorderSpan{1};

std::unique_ptr<hal::Clock> make_clock(bool virtual_time) {
  if (virtual_time) return std::make_unique<hal::VirtualClock>();
  return std::make_unique<hal::SteadyClock>();
}

std::unique_ptr<BaseRecording> make_recording(const Config& config, const SessionOptions& options) {
  if (!options.record_directory) return nullptr;
  if (BaseRecording::holds_recording(*options.record_directory))
    throw std::invalid_argument("--record: " + options.record_directory->string() +
                                " holds a recording already; name a new directory");
  return std::make_unique<BaseRecording>(BaseRecording::Description{
      .directory = *options.record_directory,
      .config_file = options.config_file,
      .experiment = config.cycle.controller.compensate_friction ? "path, friction compensated" : "path",
      .period = config.cycle.period});
}

/// Beside the recording where there is one, so that a lab finds both; else where temporary files live. The
/// time in its name keeps an earlier report.
std::filesystem::path fault_report_path(const SessionOptions& options) {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char name[48];
  std::strftime(name, sizeof name, "youbotd-fault-%Y%m%dT%H%M%SZ.csv", &utc);
  return options.record_directory.value_or(std::filesystem::temp_directory_path()) / name;
}

void require_real_time(const Config& config, const SessionOptions& options, Summary& summary) {
  summary.not_real_time = enter_real_time(config.real_time);
  if (summary.not_real_time.empty() || options.allow_non_real_time) return;
  std::string all;
  for (const std::string& problem : summary.not_real_time) all += "\n  " + problem;
  throw hal::SetupError("youbotd", "become real-time",
                        "or run with --allow-non-rt on a robot that cannot move anybody:" + all);
}

}  // namespace

Summary run_session(const Config& config, const SessionOptions& options, const std::atomic<bool>& stop) {
  Summary summary;
  summary.robot = config.robot;
  summary.virtual_time = options.virtual_time;

  const std::unique_ptr<hal::Clock> clock = make_clock(options.virtual_time);
  const apps::OpenedRobot opened =
      apps::open_robot(config.robot, config.simulation, *clock, config.cycle.period);
  PathSource motion(config.path);
  Cycle cycle(config.cycle, *opened.robot, motion, opened.simulation.get());
  FlightRecorder flight_recorder(static_cast<std::size_t>(kFlightRecorderSpan / config.cycle.period));
  const std::unique_ptr<BaseRecording> recording = make_recording(config, options);

  opened.robot->activate();
  // Last, when everything is allocated and every other thread runs.
  if (!options.virtual_time) require_real_time(config, options, summary);
  run_loop(
      *clock, config.cycle.period, cycle,
      [&](std::chrono::nanoseconds elapsed) {
        return stop.load(std::memory_order_relaxed) || (options.duration && elapsed >= *options.duration);
      },
      [&](const CycleRecord& record) {
        summary.path.add(record);
        flight_recorder.add(record);
        if (!recording) return;
        if (options.virtual_time) recording->wait_for_room();
        recording->add(record);
      },
      summary.loop);
  opened.robot->deactivate();

  if (recording) {
    recording->close();
    summary.recorded = true;
    summary.cycles_recorded = recording->cycles_recorded();
    summary.cycles_lost = recording->cycles_lost();
    summary.recording_problems = recording->problems();
  }
  if (const StopReason& reason = cycle.stop_reason()) {
    summary.stop_reason = describe(reason, *opened.robot, config.cycle.period);
    const std::filesystem::path path = fault_report_path(options);
    try {
      flight_recorder.write(path, summary.stop_reason);
      summary.fault_report = path;
    } catch (const std::exception& error) {
      summary.recording_problems.emplace_back(std::string("fault report: ") + error.what());
    }
  }
  return summary;
}

}  // namespace youbotd
