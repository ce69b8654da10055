#include "apps/common/robot_session.h"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <array>
#include <ctime>
#include <exception>
#include <system_error>

#include "hal/setup_error.h"

namespace apps {
namespace {

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

}  // namespace

std::unique_ptr<hal::Clock> make_clock(bool virtual_time) {
  if (virtual_time) return std::make_unique<hal::VirtualClock>();
  return std::make_unique<hal::SteadyClock>();
}

RobotActivation::RobotActivation(hal::Robot& robot) : robot_(robot) {
  robot_.activate();
  for (const std::string& note : robot_.notes()) spdlog::warn("robot: {}", note);
}

HapticActivation::~HapticActivation() {
  if (!device_.deactivate())
    spdlog::error("{}: nothing confirmed that the force is off: switch the device off", device_.info().name);
}

std::vector<std::string> enter_real_time(RealTimeThread& thread, const RealTimeConfig& config,
                                         bool allow_non_real_time) {
  std::vector<std::string> refused = thread.enter(config);
  if (refused.empty() || allow_non_real_time) return refused;
  std::string all;
  for (const std::string& problem : refused) all += "\n  " + problem;
  throw hal::SetupError("youbotd", "become real-time",
                        "or run with --allow-non-rt on a robot that cannot move anybody:" + all);
}

std::optional<std::filesystem::path> write_fault_report(
    const std::optional<std::filesystem::path>& record_directory,
    const std::function<void(const std::filesystem::path&)>& write, const drivers::ethercat::PcapRing* frames,
    const std::string& reason, std::vector<std::string>& problems) {
  const std::string name = fault_report_name();
  std::vector<std::filesystem::path> directories;
  if (record_directory) directories.push_back(*record_directory);
  std::error_code no_temporary;
  directories.push_back(std::filesystem::temp_directory_path(no_temporary));
  for (const std::filesystem::path& directory : directories) try {
      std::filesystem::path path = directory / name;
      write(path);
      if (frames != nullptr)
        frames->write(std::filesystem::path(path).replace_extension(".pcapng").string(), reason);
      return path;
    } catch (const std::exception& error) {
      problems.emplace_back(std::string("fault report: ") + error.what());
    }
  return std::nullopt;
}

}  // namespace apps
