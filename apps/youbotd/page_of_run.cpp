#include "apps/youbotd/page_of_run.h"

#include <utility>

#include "runtime/log.h"
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
  page_.send_last_status(std::move(status));
}

void PageOfRun::ask(const Peer& peer, const std::string& request, Page::Reply reply) {
  if (request == "stop") {
    stop(peer.name);
    return reply(R"({"ok": true})");
  }
  reply(nlohmann::json{{"ok", false},
                       {"error", "this run was started from the command line: the page can only stop it"}}
            .dump());
}

void PageOfRun::stop(const std::string& who) {
  if (!stop_.exchange(true)) spdlog::warn("coming to rest: requested by {}", who);
}

}  // namespace youbotd
