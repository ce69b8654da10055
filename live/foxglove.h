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

#include "live/outlet.h"
#include "live/web_server.h"

namespace live {

/// Of one client.
inline constexpr std::size_t kMaxSubscriptions = 256;

/// Sends only: clients subscribe to channels and cannot publish, call or set anything. On the server's
/// thread.
class FoxgloveStream final : public Outlet {
 public:
  /// Set-up. `name` is shown by the client.
  explicit FoxgloveStream(std::string name);
  ~FoxgloveStream() override;
  std::size_t add(Channel channel) override;

  /// One of the subprotocol's names in `offered`: the present one, or the earlier one of older clients.
  static std::optional<std::string> protocol(const std::vector<std::string>& offered);
  /// `socket` must outlive the conversation, and the stream both.
  std::unique_ptr<Conversation> converse(WebSocket& socket);

  bool wanted(std::size_t channel) const override;
  void publish(std::size_t channel, std::uint64_t time_ns, std::string_view payload) override;

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
