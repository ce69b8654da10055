// Answers of a Service to every request.
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/youbotd/service.h"
#include "apps/youbotd/status_json.h"
#include "runtime/program/build_info.h"

namespace youbotd {
namespace {

using nlohmann::json;

json numbers(const std::array<double, 3>& values) {
  return std::isfinite(values[0]) ? json(values) : json(nullptr);
}

json recording_json(const std::filesystem::path& directory,
                    const std::optional<operation::RecordingState>& recording) {
  if (!recording) return nullptr;
  return {{"directory", directory.string()},
          {"state", recording->problems.empty() ? "ok" : "failing"},
          {"cycles_lost", recording->cycles_lost},
          {"problems", recording->problems}};
}

}  // namespace

/// Without a run: "wheel-2: some devices on the bus did not answer".
std::string Service::robot_state() const {
  const hal::CycleStatus& robot = loop_report_.robot;
  if (robot.ok()) return "ready";
  const std::string joint =
      robot.joint >= 0 ? robot_.robot->joints()[static_cast<std::size_t>(robot.joint)].name + ": " : "";
  return joint + robot_.robot->explain(robot);
}

json Service::status() const {
  const operation::Progress& now = loop_report_.progress;
  json status{{"format", "youbotd-status/1"},
              {"version", runtime::build_version()},
              {"robot", config_.robot.name},
              {"mode", mode_},
              {"run", orders_.number},
              {"enabled", enabled()},
              {"phase", run_        ? now.phase
                        : faulted() ? "faulted"
                                    : "off"},
              {"cycles", loop_report_.cycles},
              {"real_time", not_real_time_.empty()},
              {"settings", settings_}};
  status["commander"] = commander_ ? json(commander_->name) : json(nullptr);
  status["stopped"] = stopped_;
  status["fault"] = fault_;
  status["fault_acknowledged"] = !fault_.empty() && fault_acknowledged_;
  status["fault_report"] = fault_report_.string();
  status["fault_robot_report"] = fault_robot_report_;
  status["robot_trouble"] = device_faults_;
  status["devices"] = json_of(robot_.robot->devices());
  status["notes"] = notes_;
  status["bus"] = json_of(robot_.robot->losses());
  status["recording"] = recording_json(recorded_to_, recording_);
  if (run_) {
    status["time_s"] = std::chrono::duration<double>(now.time).count();
    status["base_W"] = numbers(now.base_W);
    status["tip_p_WT_m"] = numbers(now.tip_p_WT_m);
    status["force_H_N"] = numbers(now.force_H_N);
  } else {
    status["robot_state"] = robot_state();
  }
  if (master_.device) {
    status["master"] = master_.device->info().name;
    if (!run_)
      status["master_state"] =
          loop_report_.master.ok() ? "ready" : master_.device->describe(loop_report_.master);
  }
  if (master_.link) status["link"] = json_of(link_report_);
  return status;
}

}  // namespace youbotd
