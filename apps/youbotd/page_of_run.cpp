#include "apps/youbotd/page_of_run.h"

#include <spdlog/spdlog.h>

#include <thread>
#include <utility>

#include "runtime/program/build_info.h"

namespace youbotd {
namespace {

nlohmann::json first_status(const operation::Config& config) {
  return {{"format", "youbotd-status/1"},
          {"version", runtime::build_version()},
          {"robot", config.robot.name},
          {"mode", config.teleoperated ? "teleoperation" : "path"},
          {"enabled", true},
          {"commander", "the command line"},
          {"fault", ""}};
}

}  // namespace

PageOfRun::PageOfRun(const std::string& where, const operation::Config& config, Findings checks,
                     std::atomic<bool>& stop)
    : stop_(stop),
      status_(first_status(config)),
      page_({.where = where,
             .teleoperated = config.teleoperated,
             .commanded = false,
             .workspace = config.teleoperated ? config.teleoperation.workspace : config.cycle.workspace,
             .first_status = status_,
             .checks = std::move(checks)},
            feed_, *this) {}

void PageOfRun::finish(const operation::RunSummary& summary) {
  nlohmann::json status = status_;
  status["enabled"] = false;
  status["ended"] = true;
  status["fault"] = summary.stop_reason;
  status["fault_report"] = summary.fault_report.value_or("").string();
  page_.publish_status(std::move(status));
  std::this_thread::sleep_for(2 * Page::kStatusPeriod);
}

void PageOfRun::ask(const Peer& /*peer*/, const std::string& request, Page::Reply reply) {
  if (request == "status") return reply(nlohmann::json{{"ok", true}, {"status", status_}}.dump());
  reply(nlohmann::json{{"ok", false},
                       {"error", "this run was started from the command line: the page can only stop it"}}
            .dump());
}

void PageOfRun::stop(const std::string& who) {
  spdlog::warn("coming to rest: requested by {}", who);
  stop_ = true;
}

}  // namespace youbotd
