/// @file
/// The live page, and the stream that it shows (README.md, "The page").
#pragma once
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "apps/youbotd/check_parts.h"
#include "apps/youbotd/control_server.h"
#include "apps/youbotd/live_status.h"
#include "control/workspace.h"
#include "hal/robot.h"
#include "live/foxglove.h"
#include "live/web_server.h"
#include "operation/live_channels.h"
#include "operation/live_feed.h"

namespace youbotd {

/// Everyone who can open the page sees everything and can stop the robot. Other commands need the token,
/// which is part of command_url().
class Page final : public live::Site {
 public:
  /// The page gets the status once in this time.
  static constexpr std::chrono::milliseconds kStatusPeriod{200};
  using Reply = std::function<void(std::string answer)>;

  /// The other end of the page's commands. On the page's thread; replies may come from any thread.
  class Commands {
   public:
    Commands() = default;
    Commands(const Commands&) = delete;
    Commands& operator=(const Commands&) = delete;
    virtual ~Commands() = default;
    /// A request as on the control socket, which is answered in the same way.
    virtual void ask(const Peer& peer, const std::string& request, Reply reply) = 0;
    virtual void stop(const std::string& who) = 0;
    virtual void gone(const Peer& peer) = 0;
  };
  struct Options {
    std::string where;  ///< as live::WebServer
    bool teleoperated = false;
    bool commanded = false;            ///< there is a service: the page has its buttons
    std::vector<std::string> modes{};  ///< of the service
    control::Workspace workspace{};
    control::BaseGeometry geometry{};
    nlohmann::json first_status = nlohmann::json::object();  ///< until the first publish_status()
    Findings checks{};                                       ///< of `youbotd --check`
  };

  /// `feed` and `commands` must outlive it. @throws as live::WebServer.
  Page(Options options, operation::LiveFeed& feed, Commands& commands);
  ~Page() override;

  const std::string& url() const noexcept { return server_->url(); }
  std::string command_url() const { return url() + "#token=" + token_; }
  bool local_only() const noexcept { return server_->local_only(); }

  // One thread, other than the page's.
  void publish_status(nlohmann::json status);
  /// Waits until it is on its way.
  void send_last_status(nlohmann::json status);
  void set_joints(std::span<const hal::JointInfo> joints);

 private:
  class CommandSession;

  live::Response answer(const live::Request& request) override;
  std::optional<Opening> open(const live::Request& request) override;
  void tick() override;
  void send_status();
  live::Response fault_report(const std::string& extension) const;
  void post_status(nlohmann::json status, std::function<void()> then);
  nlohmann::json info() const;

  Options options_;
  operation::LiveFeed& feed_;
  operation::LiveFeed::Reader& reader_;
  Commands& commands_;
  std::string token_;
  live::FoxgloveStream stream_;
  operation::LiveChannels channels_;
  /// Read where a fault is reported: a slow disk must not delay a stop.
  struct FaultFiles {
    std::string path;
    std::map<std::string, std::string> by_extension;
  };

  nlohmann::json status_;
  std::shared_ptr<const FaultFiles> fault_ = std::make_shared<FaultFiles>();
  std::shared_ptr<const FaultFiles> reported_ = fault_;  // of the thread that publishes
  std::vector<hal::JointInfo> joints_;
  std::chrono::steady_clock::time_point published_{};
  std::uint64_t sessions_ = 0;
  LiveStatus live_status_;
  std::unique_ptr<live::WebServer> server_;  // last: its thread uses all of the above
};

/// Prints its address, and warns if it can be reached from elsewhere.
void announce(const Page& page);

}  // namespace youbotd
