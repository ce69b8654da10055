/// @file
/// A stream of messages by Foxglove's WebSocket protocol (github.com/foxglove/ws-protocol, docs/spec.md).
#pragma once
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "live/web_server.h"

namespace live {

/// Of one client.
inline constexpr std::size_t kMaxSubscriptions = 256;

/// Sends only: clients subscribe to channels and cannot publish, call or set anything. On the server's
/// thread.
class FoxgloveStream {
 public:
  struct Channel {
    std::string topic;
    std::string encoding;  ///< "cdr", "json"
    std::string schema_name;
    std::string schema;
    std::string schema_encoding;  ///< "ros2msg", "jsonschema"
    bool latched = false;         ///< a new subscriber gets the last message, and messages are never left out
  };

  /// Set-up. `name` is shown by the client.
  explicit FoxgloveStream(std::string name);
  FoxgloveStream(const FoxgloveStream&) = delete;
  FoxgloveStream& operator=(const FoxgloveStream&) = delete;
  ~FoxgloveStream();
  /// Set-up, before the first client. The number of the channel.
  std::size_t add(Channel channel);

  /// One of the subprotocol's names in `offered`: the present one, or the earlier one of older clients.
  static std::optional<std::string> protocol(const std::vector<std::string>& offered);
  /// `socket` must outlive the conversation, and the stream both.
  std::unique_ptr<Conversation> converse(WebSocket& socket);

  /// Whether publish() would reach a client, or keep the message for one.
  bool wanted(std::size_t channel) const;
  void publish(std::size_t channel, std::uint64_t time_ns, std::string_view payload);

 private:
  class Client;
  struct Message {
    std::uint64_t time_ns = 0;
    std::string payload;
  };

  std::string server_info_;
  std::vector<Channel> channels_;
  std::map<std::size_t, Message> latest_;  // of the latched channels
  std::vector<Client*> clients_;
};

}  // namespace live
