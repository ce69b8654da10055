#include "apps/youbotd/session.h"

#include <unistd.h>

#include <array>
#include <ctime>
#include <exception>
#include <stdexcept>
#include <system_error>

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
  return std::make_unique<BaseRecording>(
      BaseRecording::Description{.directory = *options.record_directory,
                                 .config_file = options.config_file,
                                 .experiment = "path",
                                 .friction_compensation = config.cycle.controller.compensate_friction,
                                 .period = config.cycle.period});
}

/// A name that no earlier report has.
std::string fault_report_name() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  std::array<char, 48> name{};
  std::strftime(name.data(), name.size(), "youbotd-fault-%Y%m%dT%H%M%SZ-", &utc);
  static int written = 0;
  return name.data() + std::to_string(getpid()) + "-" + std::to_string(++written) + ".csv";
}

/// Beside the recording where there is one, so that a lab finds both; where temporary files live if that
/// cannot be written or there is none.
void write_fault_report(const FlightRecorder& flight_recorder, const drivers::ethercat::PcapRing* frames,
                        const SessionOptions& options, Summary& summary) {
  const std::string name = fault_report_name();
  std::vector<std::filesystem::path> directories;
  if (options.record_directory) directories.push_back(*options.record_directory);
  std::error_code no_temporary;
  directories.push_back(std::filesystem::temp_directory_path(no_temporary));
  for (const std::filesystem::path& directory : directories) try {
      flight_recorder.write(directory / name, summary.stop_reason);
      summary.fault_report = directory / name;
      if (frames != nullptr)
        frames->write((directory / name).replace_extension(".pcapng").string(), summary.stop_reason);
      return;
    } catch (const std::exception& error) {
      summary.recording_problems.emplace_back(std::string("fault report: ") + error.what());
    }
}

/// Switches the robot off however the session ends.
class Activation {
 public:
  explicit Activation(hal::Robot& robot) : robot_(robot) { robot_.activate(); }
  Activation(const Activation&) = delete;
  Activation& operator=(const Activation&) = delete;
  ~Activation() { robot_.deactivate(); }

 private:
  hal::Robot& robot_;
};

void require_real_time(apps::RealTimeThread& thread, const Config& config, const SessionOptions& options,
                       Summary& summary) {
  summary.not_real_time = thread.enter(config.real_time);
  if (summary.not_real_time.empty() || options.allow_non_real_time) return;
  std::string all;
  for (const std::string& problem : summary.not_real_time) all += "\n  " + problem;
  throw hal::SetupError("youbotd", "become real-time",
                        "or run with --allow-non-rt on a robot that cannot move anybody:" + all);
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

  const std::unique_ptr<hal::Clock> clock = make_clock(options.virtual_time);
  const apps::OpenedRobot opened = apps::open_robot(config.robot, *clock, config.cycle.period);
  PathSource motion(config.path);
  Cycle cycle(config.cycle, *opened.robot, motion, opened.truth);
  FlightRecorder flight_recorder(static_cast<std::size_t>(kFlightRecorderSpan / config.cycle.period));
  const std::unique_ptr<BaseRecording> recording = make_recording(config, options);
  {
    const Activation activation(*opened.robot);
    apps::RealTimeThread real_time;  // entered last, when everything is allocated and every other thread runs
    if (!options.virtual_time) require_real_time(real_time, config, options, summary);
    run_loop(
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

  if (recording) {
    recording->close();
    summary.recorded = true;
    summary.cycles_recorded = recording->cycles_recorded();
    summary.cycles_lost = recording->cycles_lost();
    summary.recording_problems = recording->problems();
  }
  if (const StopReason& reason = cycle.stop_reason()) {
    summary.stop_reason = describe(reason, *opened.robot);
    write_fault_report(flight_recorder, opened.capture.get(), options, summary);
  }
  return summary;
}

}  // namespace youbotd
