#include "apps/youbotd/ros2_topics.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <utility>

#include "runtime/log.h"
#include "runtime/start_thread.h"

namespace youbotd {
namespace {

/// Refused commands are logged once in this time.
constexpr std::chrono::seconds kLogPeriod{10};
/// In the order of subscription.
constexpr std::size_t kPlain = 0;
constexpr std::size_t kStamped = 1;

}  // namespace

Ros2Topics::Ros2Topics(const Options& options, operation::LiveFeed& feed, Page::Commands* steered)
    : feed_(feed),
      reader_(feed.add_reader()),
      steered_(steered),
      peer_{.connection = std::uint64_t{1} << 62,  // apart from those of control socket and pages
            .name = "/cmd_vel of ROS 2",
            .may_steer = true},
      cmd_vel_(options.silence),
      node_(options.domain, "youbotd"),
      channels_(node_, options.teleoperated, options.geometry),
      live_status_(feed_, reader_, options.commanded),
      status_(options.first_status) {
  if (steered_ != nullptr) {
    const auto hear = [this](CmdVel::Form form) {
      return [this, form](std::uint64_t publisher, std::string_view payload) {
        cmd_vel_.hear(publisher, form, payload, std::chrono::steady_clock::now());
      };
    };
    node_.subscribe("/cmd_vel", live::ros::kTwist, kMaxCommand_bytes, hear(CmdVel::Form::kTwist));
    node_.subscribe("/cmd_vel_stamped", live::ros::kTwistStamped, kMaxCommand_bytes,
                    hear(CmdVel::Form::kTwistStamped));
  }
  node_.announce();
  thread_ = runtime::start_thread("the topics of ROS 2", [this](const std::stop_token& stop) { work(stop); });
}

Ros2Topics::~Ros2Topics() = default;

void Ros2Topics::publish_status(nlohmann::json status) {
  const std::lock_guard lock(mutex_);
  status_ = std::move(status);
}

void Ros2Topics::work(const std::stop_token& stop) {
  auto next = std::chrono::steady_clock::now();
  while (!stop.stop_requested()) {
    operation::LiveSample sample;
    while (reader_.take(sample)) {
      channels_.publish(sample);
      live_status_.hear(sample);
    }
    if (steered_ != nullptr) {
      steer();
      log_refused();
    }
    if (std::chrono::steady_clock::now() - published_ >= kStatusPeriod) send_status();
    // A thread that was delayed does not catch up.
    next = std::max(next + kTick, std::chrono::steady_clock::now());
    std::this_thread::sleep_until(next);
  }
  send_status();  // how it ended
}

void Ros2Topics::steer() {
  const auto command = cmd_vel_.take();
  if (!command) return;
  if (publisher_ != command->publisher) {
    publisher_ = command->publisher;
    const std::size_t subscription = command->form == CmdVel::Form::kTwist ? kPlain : kStamped;
    peer_.name = "/cmd_vel of ROS 2, GID " + node_.gid(subscription, command->publisher);
    spdlog::info("ros2: velocities come from {}", peer_.name);
  }
  const control::PlanarVector& v = command->twist_B;
  // The service refuses it unless it is enabled in the mode ros2. ROS 2 has no answers on a topic.
  steered_->ask(peer_, fmt::format("steer {} {} {}", v[0], v[1], v[2]), [](const std::string&) {});
}

void Ros2Topics::log_refused() {
  const CmdVel::Refused refused = cmd_vel_.refused();
  const auto now = std::chrono::steady_clock::now();
  if (refused == logged_ || now < log_again_) return;
  spdlog::warn(
      "ros2: ignored on /cmd_vel: {} messages that are no velocity, {} of other publishers than the one "
      "that steers",
      refused.invalid - logged_.invalid, refused.others - logged_.others);
  logged_ = refused;
  log_again_ = now + kLogPeriod;
}

void Ros2Topics::send_status() {
  published_ = std::chrono::steady_clock::now();
  nlohmann::json status;
  {
    const std::lock_guard lock(mutex_);
    status = status_;
  }
  live_status_.complete(status);
  status["ros2_messages_refused"] = node_.refused();
  channels_.publish_status(feed_.now_ns(), status);
}

void announce_ros2(std::uint32_t domain, bool commands) {
  spdlog::info("ros2: node /youbotd in domain {}", domain);
  spdlog::warn("ros2: everyone on the network can read these topics{}",
               commands ? ", and in the mode ros2 steer the robot by /cmd_vel" : "");
}

}  // namespace youbotd
