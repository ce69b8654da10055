/// @file
/// Page and ROS 2 topics of a run that the command line started.
#pragma once
#include <atomic>
#include <cstdint>
#include <optional>
#include <string>

#include "apps/youbotd/page.h"
#include "apps/youbotd/ros2_topics.h"
#include "hal/clock.h"
#include "operation/config.h"
#include "operation/live_feed.h"
#include "operation/run_summary.h"

namespace youbotd {

/// The page shows the run and can stop it, and nothing else; the topics show it.
class ShownRun final : private Page::Commands {
 public:
  struct Options {
    std::optional<std::string> page;        ///< where it is served, as live::WebServer
    std::optional<std::uint32_t> domain{};  ///< of ROS 2
  };

  /// A stop sets `stop`, which must outlive it. @throws as live::WebServer and ros2::Node.
  ShownRun(const Options& options, const operation::Config& config, Findings checks, std::atomic<bool>& stop);

  operation::LiveFeed& feed() noexcept { return feed_; }
  /// Shows how the run ended; waits until that is sent.
  void finish(const operation::RunSummary& summary);

 private:
  void ask(const Peer& peer, const std::string& request, Page::Reply reply) override;
  void stop(const std::string& who) override;
  void gone(const Peer& /*peer*/) override {}

  std::atomic<bool>& stop_;
  const nlohmann::json status_;  // at the start
  hal::SteadyClock clock_;
  operation::LiveFeed feed_{clock_};
  // Last: their threads use the above.
  std::optional<Page> page_;
  std::optional<Ros2Topics> topics_;
};

}  // namespace youbotd
