/// @file
/// A node of ROS 2 without ROS: a participant of a DDS domain with ROS 2's names, types and type hashes.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "live/outlet.h"
#include "live/ros_messages.h"
#include "ros2/raw_topic.h"

namespace ros2 {

/// Of one message, in either direction; a larger one from the network is discarded.
inline constexpr std::size_t kMaxSample_bytes = 1 << 20;
/// Messages of one topic that wait for subscribers that do not confirm them; older ones are lost.
inline constexpr std::int32_t kMaxQueued = 10;
inline constexpr std::uint32_t kMaxDomain = 232;  ///< with a larger one, its UDP ports would exceed 65535

/// The names are those that rmw makes (design.ros2.org, "Topic and Service name mapping to DDS"); ROS 2 lists
/// the node because of `ros_discovery_info` and the user data of participant, publishers and subscriptions
/// (rmw_dds_common, Iron and later).
///
/// Publishing never waits: what a slow or dead subscriber does not confirm is overwritten. One thread, but
/// `Listen` is called on a thread of DDS.
class Node final : public live::Outlet {
 public:
  using Listen = std::function<void(std::uint64_t publisher, std::string_view payload)>;

  /// Joins the domain, on the interface that CYCLONEDDS_URI names or Cyclone DDS chooses.
  /// `name`: of the node, in the namespace "/". @throws hal::SetupError
  Node(std::uint32_t domain, std::string name);
  /// Leaves it: others notice at once, and no Listen is under way any more.
  ~Node() override;

  /// A publisher, for a topic with a type hash; other channels are never wanted.
  std::size_t add(live::Channel channel) override;
  /// A subscription that asks for no repetition: what was lost is late when it is repeated.
  void subscribe(const std::string& topic, const live::ros::Type& type, std::size_t max_bytes, Listen listen);
  /// After the last add() and subscribe(): makes ROS 2 list the node.
  void announce();

  bool wanted(std::size_t channel) const override;
  void publish(std::size_t channel, std::uint64_t time_ns, std::string_view payload) override;
  /// Messages that DDS did not take.
  std::uint64_t refused() const noexcept { return refused_; }
  /// The GID of a publisher that subscription number `i` heard, as `ros2 topic info --verbose` prints it.
  std::string gid(std::size_t i, std::uint64_t publisher) const;

 private:
  struct Publisher {
    dds_entity_t writer = 0;  // 0: none
    RawTopic topic{};
    bool latched = false;
  };
  struct Subscription;

  std::string name_;
  dds_entity_t domain_ = 0;
  dds_entity_t participant_ = 0;
  std::vector<Publisher> publishers_;
  std::vector<std::unique_ptr<Subscription>> subscriptions_;
  std::uint64_t refused_ = 0;
};

}  // namespace ros2
