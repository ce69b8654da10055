#include "apps/youbotd/shown_run.h"

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

ShownRun::ShownRun(const Options& options, const operation::Config& config, Findings checks,
                   std::atomic<bool>& stop)
    : stop_(stop), status_(first_status(config)) {
  if (options.page) {
    page_.emplace(Page::Options{.where = *options.page,
                                .teleoperated = config.teleoperated,
                                .commanded = false,
                                .workspace = config.teleoperated ? config.teleoperation.workspace
                                                                 : config.cycle.workspace,
                                .geometry = config.cycle.controller.geometry,
                                .first_status = status_,
                                .checks = std::move(checks)},
                  feed_, static_cast<Page::Commands&>(*this));
    announce(*page_);
  }
  if (options.domain) {
    topics_.emplace(Ros2Topics::Options{.domain = *options.domain,
                                        .teleoperated = config.teleoperated,
                                        .geometry = config.cycle.controller.geometry,
                                        .silence = config.commander_timeout,
                                        .first_status = status_},
                    feed_, nullptr);
    announce_ros2(*options.domain, /*commands=*/false);
  }
}

void ShownRun::finish(const operation::RunSummary& summary) {
  nlohmann::json status = status_;
  status["enabled"] = false;
  status["ended"] = true;
  status["fault"] = summary.stop_reason;
  status["fault_report"] = summary.fault_report.value_or("").string();
  if (topics_) topics_->publish_status(status);
  if (page_) page_->send_last_status(std::move(status));
}

void ShownRun::ask(const Peer& peer, const std::string& request, Page::Reply reply) {
  if (request == "stop") {
    stop(peer.name);
    return reply(R"({"ok": true})");
  }
  reply(nlohmann::json{{"ok", false},
                       {"error", "this run was started from the command line: the page can only stop it"}}
            .dump());
}

void ShownRun::stop(const std::string& who) {
  if (!stop_.exchange(true)) spdlog::warn("coming to rest: requested by {}", who);
}

}  // namespace youbotd
