#include "apps/youbotd/check.h"

#include <algorithm>
#include <memory>

#include "apps/youbotd/check_parts.h"
#include "hal/clock.h"
#include "hal/setup_error.h"
#include "operation/base_task.h"
#include "operation/motion_source.h"
#include "operation/run_recording.h"
#include "operation/teleop_task.h"
#include "runtime/open_haptic.h"
#include "runtime/open_robot.h"
#include "runtime/program/printable.h"
#include "runtime/program/wording.h"
#include "runtime/robot_session.h"

namespace youbotd {
namespace {

using Mark = Finding::Mark;

/// Constructs the parts of a run; nothing is opened before activation.
Finding check_configuration(const operation::Config& config, bool virtual_time) {
  const std::unique_ptr<hal::Clock> clock = runtime::make_clock(virtual_time);
  const runtime::OpenedRobot robot = runtime::open_robot(config.robot, *clock, config.cycle.period);
  std::string found = "configuration: " + config.robot.name;
  if (!config.teleoperated) {
    operation::PathSource motion(config.path);
    const operation::Cycle cycle(config.cycle, *robot.robot, motion, robot.truth);
    return {Mark::kOk, found};
  }
  found += " by hand on " + config.haptic.name;
  try {
    const runtime::OpenedHaptic master = runtime::open_haptic(config.haptic, *clock, config.cycle.period);
    operation::TeleopCycle::Config teleoperation;
    teleoperation.control = config.teleoperation;
    const operation::TeleopCycle cycle(teleoperation, *robot.robot, *master.device);
  } catch (const hal::SetupError& error) {
    return {Mark::kFail, std::string("configuration: ") + error.what(), "set haptic.falcon.firmware"};
  }
  return {Mark::kOk, found};
}

void check_real_time(const operation::Config& config, const CheckOptions& options, Findings& findings) {
  const bool on_bus = config.robot.name.starts_with(runtime::kEthercatPrefix);
  const Mark refused = options.allow_non_real_time ? Mark::kWarn : Mark::kFail;
  findings.push_back(check_kernel(options.paths));
  findings.push_back(check_clock_source(options.paths));
  if (auto governor = check_governor(config.real_time.cpu, options.paths)) findings.push_back(*governor);
  findings.push_back(check_throttling(on_bus && config.robot.ethercat.busy_wait, options.paths));
  findings.push_back(check_memory_lock(refused));
  findings.push_back(check_priority("the cycle", config.real_time.priority, refused));
  if (config.real_time.cpu) findings.push_back(check_core(*config.real_time.cpu, refused));
  if (config.teleoperated && !runtime::is_simulated_haptic(config.haptic.name) &&
      config.haptic.thread.fifo_priority > 0)
    findings.push_back(check_priority("the haptic device", config.haptic.thread.fifo_priority, refused));
}

void check_bus(const runtime::RobotOptions& robot, const CheckOptions& options, Findings& findings) {
  const std::string interface = robot.name.substr(runtime::kEthercatPrefix.size());
  findings.push_back(check_interface(interface, options.paths));
  if (findings.back().mark != Mark::kOk) return;  // otherwise it would not open either
  findings.push_back(check_addresses(interface));
  for (Finding& finding : check_raw_socket(interface, robot.ethercat.kind))
    findings.push_back(std::move(finding));
}

const char* mark_text(Mark mark) {
  switch (mark) {
    case Mark::kOk: return "ok  ";
    case Mark::kWarn: return "warn";
    case Mark::kFail: break;
  }
  return "FAIL";
}

}  // namespace

Findings check(const operation::Config& config, const CheckOptions& options) {
  Findings findings{check_configuration(config, options.virtual_time)};
  for (const std::string& line : operation::arm_lines(config)) findings.push_back({Mark::kOk, line});
  if (!options.virtual_time) check_real_time(config, options, findings);
  if (config.robot.name.starts_with(runtime::kEthercatPrefix)) check_bus(config.robot, options, findings);
  for (Finding& finding : check_link(config.role, config.haptic.link)) findings.push_back(std::move(finding));
  if (config.teleoperated || config.role == runtime::Role::kOperator)
    for (Finding& finding : check_master(config.haptic, options.paths))
      findings.push_back(std::move(finding));
  if (options.record_directory)
    findings.push_back(check_recording(*options.record_directory,
                                       operation::holds_recording(*options.record_directory),
                                       config.cycle.period, options.record_format));
  if (!options.control_socket.empty()) findings.push_back(check_control(options.control_socket));
  if (options.page) findings.push_back(check_page(*options.page));
  if (options.ros2) findings.push_back(check_ros2(*options.ros2));
  return findings;
}

std::string report(const Findings& findings, bool only_problems) {
  std::string text;
  for (const Finding& finding : findings) {
    if (only_problems && finding.mark == Mark::kOk) continue;
    text += std::string(mark_text(finding.mark)) + "  " + runtime::printable(finding.found) + "\n";
    if (!finding.remedy.empty()) text += "      " + runtime::printable(finding.remedy) + "\n";
  }
  if (only_problems) return text;
  const auto count = [&](Mark mark) {
    return std::to_string(std::ranges::count(findings, mark, &Finding::mark));
  };
  return text + runtime::count_text(static_cast<long long>(findings.size()), "check") + ": " +
         count(Mark::kFail) + " FAIL, " + count(Mark::kWarn) + " warn\n";
}

nlohmann::json json_of(const Findings& findings) {
  nlohmann::json json = nlohmann::json::array();
  for (const Finding& finding : findings) {
    const char* const mark = finding.mark == Mark::kOk ? "ok" : finding.mark == Mark::kWarn ? "warn" : "fail";
    json.push_back({{"mark", mark}, {"found", finding.found}, {"remedy", finding.remedy}});
  }
  return json;
}

bool passed(const Findings& findings) {
  return std::ranges::none_of(findings, [](const Finding& finding) { return finding.mark == Mark::kFail; });
}

}  // namespace youbotd
