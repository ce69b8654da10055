#include "runtime/robot_session.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <ctime>
#include <exception>
#include <sstream>
#include <string_view>
#include <system_error>
#include <utility>

#include "drivers/uninterrupted.h"
#include "hal/setup_error.h"
#include "runtime/log.h"
#include "runtime/recording/file_size_signal.h"

namespace runtime {
namespace {

constexpr std::string_view kReport = "youbotd-fault-";
constexpr std::size_t kMaxReports = 20;

/// A unique name for the report.
std::string fault_report_name() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  std::array<char, 48> name{};
  std::strftime(name.data(), name.size(), "%Y%m%dT%H%M%SZ-", &utc);
  static int written = 0;
  return std::string(kReport) + name.data() + std::to_string(getpid()) + "-" + std::to_string(++written) +
         ".csv";
}

/// In the directory for temporary files, in a folder that only this user can write: otherwise another user
/// could replace a report by a link.
std::filesystem::path own_report_folder() {
  const uid_t user = geteuid();
  std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("youbotd-faults-" + std::to_string(user));
  const auto refuse = [&folder](const std::string& why) {
    throw hal::SetupError(folder.string(), "cannot take the fault report: " + why, "remove it");
  };
  if (mkdir(folder.c_str(), 0750) != 0 && errno != EEXIST) refuse(std::generic_category().message(errno));
  struct stat status {};
  if (lstat(folder.c_str(), &status) != 0) refuse(std::generic_category().message(errno));
  if (!S_ISDIR(status.st_mode) || status.st_uid != user || (status.st_mode & (S_IWGRP | S_IWOTH)) != 0)
    refuse("it is not this user's own folder");
  return folder;
}

/// Reports with their captures, oldest first.
void remove_oldest_reports(const std::filesystem::path& folder) {
  namespace fs = std::filesystem;
  std::error_code unknown;
  std::vector<std::pair<fs::file_time_type, fs::path>> reports;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, unknown))
    if (entry.path().filename().string().starts_with(kReport) && entry.path().extension() == ".csv")
      reports.emplace_back(entry.last_write_time(unknown), entry.path());
  std::sort(reports.begin(), reports.end());
  for (std::size_t i = 0; i + kMaxReports < reports.size(); ++i) {
    fs::remove(reports[i].second, unknown);
    fs::remove(reports[i].second.replace_extension(".pcapng"), unknown);
  }
}

/// Never overwrites a file and follows no link. @throws hal::SetupError naming path and cause.
void write_capture(const std::filesystem::path& path, const drivers::ethercat::PcapRing& frames,
                   const std::string& reason) {
  std::ostringstream capture;
  frames.write(capture, drivers::ethercat::wall_clock_minus_monotonic(), reason);
  const std::string bytes = capture.str();
  const int file = drivers::uninterrupted(
      [&path] { return open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0644); });
  const FileSizeSignalHeldBack held_back;
  bool whole = file >= 0;
  for (std::string_view rest = bytes; whole && !rest.empty();) {
    const ssize_t count = drivers::uninterrupted([&] { return ::write(file, rest.data(), rest.size()); });
    whole = count > 0;
    if (whole) rest.remove_prefix(static_cast<std::size_t>(count));
  }
  const int error = errno;
  if (file >= 0) close(file);
  if (!whole)
    throw hal::SetupError(path.string(), "write the last frames", std::generic_category().message(error));
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
                                         bool allow_non_real_time, const std::string& program) {
  std::vector<std::string> refused = thread.enter(config);
  if (refused.empty() || allow_non_real_time) return refused;
  std::string all;
  for (const std::string& problem : refused) all += "\n  " + problem;
  throw hal::SetupError(program, "become real-time",
                        "or run with --allow-non-rt on a robot that cannot move anybody:" + all);
}

std::optional<std::filesystem::path> write_fault_report(
    const std::optional<std::filesystem::path>& record_directory,
    const std::function<void(const std::filesystem::path&)>& write, const drivers::ethercat::PcapRing* frames,
    const std::string& reason, std::vector<std::string>& problems) {
  const std::string name = fault_report_name();
  const auto write_into = [&](const std::filesystem::path& directory) {
    std::filesystem::path path = directory / name;
    write(path);
    if (frames != nullptr)
      write_capture(std::filesystem::path(path).replace_extension(".pcapng"), *frames, reason);
    return path;
  };
  if (record_directory) try {
      return write_into(*record_directory);
    } catch (const std::exception& error) {
      problems.emplace_back(std::string("fault report: ") + error.what());
    }
  try {
    const std::filesystem::path folder = own_report_folder();
    std::filesystem::path path = write_into(folder);
    remove_oldest_reports(folder);
    return path;
  } catch (const std::exception& error) {
    problems.emplace_back(std::string("fault report: ") + error.what());
  }
  return std::nullopt;
}

}  // namespace runtime
