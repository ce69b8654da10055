/// @file
/// The robot as a node of ROS 2 (README.md, "ROS 2").
#pragma once
#include <chrono>
#include <cstdint>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>

#include "apps/youbotd/cmd_vel.h"
#include "apps/youbotd/live_status.h"
#include "apps/youbotd/page.h"
#include "operation/live_channels.h"
#include "operation/live_feed.h"
#include "ros2/node.h"

namespace youbotd {

/// Publishes what the page's stream shows, in a thread of its own. With `steered`, velocities of `/cmd_vel`
/// and
/// `/cmd_vel_stamped` go there as requests `steer AHEAD LEFT TURN`, the newest one in each kTick at most.
class Ros2Topics {
 public:
  static constexpr std::chrono::milliseconds kTick{10};
  /// Of `/diagnostics`.
  static constexpr std::chrono::milliseconds kStatusPeriod{200};
  /// `/cmd_vel` has 52 bytes, `/cmd_vel_stamped` the name of a frame more.
  static constexpr std::size_t kMaxCommand_bytes = 512;

  struct Options {
    std::uint32_t domain = 0;
    bool teleoperated = false;
    control::BaseGeometry geometry{};
    bool commanded = false;            ///< there is a service, which publishes its status
    std::chrono::nanoseconds silence;  ///< loop.commander_timeout_s
    nlohmann::json first_status = nlohmann::json::object();  ///< until the first publish_status()
  };

  /// `feed` and `steered` must outlive it; null: no commands. @throws hal::SetupError if the domain cannot be
  /// joined.
  Ros2Topics(const Options& options, operation::LiveFeed& feed, Page::Commands* steered);
  Ros2Topics(const Ros2Topics&) = delete;
  Ros2Topics& operator=(const Ros2Topics&) = delete;
  ~Ros2Topics();

  /// Any thread.
  void publish_status(nlohmann::json status);

 private:
  void work(const std::stop_token& stop);
  void steer();
  void log_refused();
  void send_status();

  operation::LiveFeed& feed_;
  operation::LiveFeed::Reader& reader_;
  Page::Commands* steered_;
  Peer peer_;
  CmdVel cmd_vel_;
  ros2::Node node_;
  operation::LiveChannels channels_;
  LiveStatus live_status_;
  std::chrono::steady_clock::time_point published_{};
  std::optional<std::uint64_t> publisher_;  // that steered last
  CmdVel::Refused logged_;
  std::chrono::steady_clock::time_point log_again_{};
  std::mutex mutex_;
  nlohmann::json status_;
  std::jthread thread_;  // last: uses all of the above
};

/// Prints what is open to the network.
void announce_ros2(std::uint32_t domain, bool commands);

}  // namespace youbotd
