#include "live/foxglove.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <nlohmann/json.hpp>
#include <utility>

#include "runtime/mcap/bytes.h"

namespace live {
namespace {

using nlohmann::json;

constexpr std::array<std::string_view, 2> kProtocols{"foxglove.sdk.v1", "foxglove.websocket.v1"};
constexpr char kMessageData = 1;
/// Levels of a status message.
constexpr int kWarning = 1;

std::string text(const json& message) { return message.dump(-1, ' ', false, json::error_handler_t::replace); }

}  // namespace

class FoxgloveStream::Client final : public Conversation {
 public:
  Client(FoxgloveStream& stream, WebSocket& socket) : stream_(stream), socket_(socket) {
    stream_.clients_.push_back(this);
  }
  ~Client() override { std::erase(stream_.clients_, this); }

  void begin() override {
    socket_.send(stream_.server_info_, WebSocket::Format::kText, WebSocket::Need::kMust);
    json channels = json::array();
    for (std::size_t i = 0; i < stream_.channels_.size(); ++i) {
      const Channel& channel = stream_.channels_[i];
      channels.push_back({{"id", i + 1},
                          {"topic", channel.topic},
                          {"encoding", channel.encoding},
                          {"schemaName", channel.schema_name},
                          {"schema", channel.schema},
                          {"schemaEncoding", channel.schema_encoding}});
    }
    socket_.send(text({{"op", "advertise"}, {"channels", channels}}), WebSocket::Format::kText,
                 WebSocket::Need::kMust);
  }

  void hear(std::string_view message) override {
    const json request = json::parse(message, nullptr, false);
    if (!request.is_object() || !request.contains("op") || !request["op"].is_string())
      return warn("a message without an \"op\" is ignored");
    const std::string op = request["op"];
    if (op == "subscribe") return subscribe(member(request, "subscriptions"));
    if (op == "unsubscribe") return unsubscribe(member(request, "subscriptionIds"));
    warn("this stream is for reading; it ignores \"" + op.substr(0, 40) + "\"");
  }

  bool subscribed(std::size_t channel) const { return by_channel_.contains(channel); }

  void send(std::size_t channel, const Message& message) {
    const auto [begin, end] = by_channel_.equal_range(channel);
    for (auto subscription = begin; subscription != end; ++subscription)
      send(subscription->second, channel, message);
  }

 private:
  /// Null if it is missing. No copy: that of deeply nested lists would need more stack than there is.
  static const json& member(const json& value, const char* name) {
    static const json null;
    if (!value.is_object()) return null;
    const auto found = value.find(name);
    return found == value.end() ? null : *found;
  }

  static std::optional<std::uint32_t> number(const json& value) {
    if (!value.is_number_unsigned() || value.get<std::uint64_t>() > UINT32_MAX) return std::nullopt;
    return value.get<std::uint32_t>();
  }

  void subscribe(const json& subscriptions) {
    if (!subscriptions.is_array()) return warn("\"subscriptions\" is no list");
    for (const json& subscription : subscriptions) {
      const auto id = number(member(subscription, "id"));
      const auto channel = number(member(subscription, "channelId"));
      if (!id || !channel || *channel < 1 || *channel > stream_.channels_.size()) {
        warn(R"(a subscription needs an "id" and the "channelId" of an advertised channel)");
        continue;
      }
      if (by_channel_.size() >= kMaxSubscriptions) return warn("no further subscriptions");
      drop(*id);
      by_channel_.emplace(*channel - 1, *id);
      const auto latest = stream_.latest_.find(*channel - 1);
      if (latest != stream_.latest_.end()) send(*id, *channel - 1, latest->second);
    }
  }

  void unsubscribe(const json& ids) {
    if (!ids.is_array()) return warn("\"subscriptionIds\" is no list");
    for (const json& id : ids)
      if (const auto known = number(id)) drop(*known);
  }

  void drop(std::uint32_t id) {
    std::erase_if(by_channel_, [id](const auto& subscription) { return subscription.second == id; });
  }

  void send(std::uint32_t id, std::size_t channel, const Message& message) {
    std::string frame(1, kMessageData);
    runtime::mcap::append_number(frame, id);
    runtime::mcap::append_number(frame, message.time_ns);
    frame += message.payload;
    socket_.send(std::move(frame), WebSocket::Format::kBinary,
                 stream_.channels_[channel].latched ? WebSocket::Need::kMust : WebSocket::Need::kMay);
  }

  void warn(const std::string& what) {
    socket_.send(text({{"op", "status"}, {"level", kWarning}, {"message", what}}), WebSocket::Format::kText,
                 WebSocket::Need::kMay);
  }

  FoxgloveStream& stream_;
  WebSocket& socket_;
  std::multimap<std::size_t, std::uint32_t> by_channel_;  // subscriptions
};

FoxgloveStream::FoxgloveStream(std::string name) {
  const auto started = std::chrono::system_clock::now().time_since_epoch();
  server_info_ = text({{"op", "serverInfo"},
                       {"name", std::move(name)},
                       {"capabilities", json::array()},
                       {"metadata", json::object()},
                       {"sessionId", std::to_string(started.count())}});
}

FoxgloveStream::~FoxgloveStream() = default;

std::size_t FoxgloveStream::add(Channel channel) {
  channels_.push_back(std::move(channel));
  return channels_.size() - 1;
}

std::optional<std::string> FoxgloveStream::protocol(const std::vector<std::string>& offered) {
  for (const std::string_view known : kProtocols)
    if (std::ranges::find(offered, known) != offered.end()) return std::string(known);
  return std::nullopt;
}

std::unique_ptr<Conversation> FoxgloveStream::converse(WebSocket& socket) {
  return std::make_unique<Client>(*this, socket);
}

bool FoxgloveStream::wanted(std::size_t channel) const {
  return channels_[channel].latched ||
         std::ranges::any_of(clients_, [&](const Client* client) { return client->subscribed(channel); });
}

void FoxgloveStream::publish(std::size_t channel, std::uint64_t time_ns, std::string_view payload) {
  const Message message{time_ns, std::string(payload)};
  for (Client* const client : clients_) client->send(channel, message);
  if (channels_[channel].latched) latest_[channel] = message;
}

}  // namespace live
