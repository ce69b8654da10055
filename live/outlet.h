/// @file
/// Where messages go: a stream for browsers, the topics of ROS 2.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace live {

struct Channel {
  std::string topic;
  std::string encoding;  ///< "cdr", "json"
  std::string schema_name;
  std::string schema;
  std::string schema_encoding;  ///< "ros2msg", "jsonschema"
  bool latched = false;         ///< a new subscriber gets the last message, and messages are never left out
  std::string type_hash{};      ///< of ROS 2 (REP 2011); empty: no type that ROS 2 knows
};

/// One thread.
class Outlet {
 public:
  Outlet() = default;
  Outlet(const Outlet&) = delete;
  Outlet& operator=(const Outlet&) = delete;
  virtual ~Outlet() = default;

  /// Set-up, before the first client. The number of the channel.
  virtual std::size_t add(Channel channel) = 0;
  /// Whether publish() would reach a client, or keep the message for one.
  virtual bool wanted(std::size_t channel) const = 0;
  virtual void publish(std::size_t channel, std::uint64_t time_ns, std::string_view payload) = 0;
};

}  // namespace live
