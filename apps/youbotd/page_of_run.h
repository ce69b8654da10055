/// @file
/// The page of a run that the command line started.
#pragma once
#include <atomic>
#include <string>

#include "apps/youbotd/page.h"
#include "hal/clock.h"
#include "operation/config.h"
#include "operation/live_feed.h"
#include "operation/run_summary.h"

namespace youbotd {

/// It shows the run and can stop it, and nothing else.
class PageOfRun final : private Page::Commands {
 public:
  /// A stop sets `stop`, which must outlive it. @throws as live::WebServer.
  PageOfRun(const std::string& where, const operation::Config& config, Findings checks,
            std::atomic<bool>& stop);

  operation::LiveFeed& feed() noexcept { return feed_; }
  const Page& page() const noexcept { return page_; }
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
  Page page_;  // last: its thread uses the above
};

}  // namespace youbotd
