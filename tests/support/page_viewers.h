/// @file
/// Clients of the live page's stream for as long as they exist: half of them read, half of them do not.
#pragma once
#include <atomic>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/web_client.h"

namespace support {

class PageViewers {
 public:
  static constexpr int kChannels = 12;

  PageViewers(std::uint16_t port, int count) {
    std::string subscriptions;
    for (int i = 1; i <= kChannels; ++i)
      subscriptions += (i > 1 ? "," : "") + std::string(R"({"id":)") + std::to_string(i) +
                       R"(,"channelId":)" + std::to_string(i) + "}";
    for (int i = 0; i < count; ++i) {
      auto& client = clients_.emplace_back(std::make_unique<WebClient>(port));
      if (client->open("/", "Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n").status != 101)
        throw std::runtime_error("the page refuses a viewer");
      client->say_frame(WebClient::kText, R"({"op":"subscribe","subscriptions":[)" + subscriptions + "]}");
      if (i % 2 == 0)
        readers_.emplace_back([this, reader = client.get()](const std::stop_token& stop) {
          while (!stop.stop_requested() && reader->hear_message()) ++messages_;
        });
    }
  }

  std::uint64_t messages() const { return messages_; }

 private:
  std::atomic<std::uint64_t> messages_{0};
  std::vector<std::unique_ptr<WebClient>> clients_;
  std::vector<std::jthread> readers_;  // last: they use the clients
};

}  // namespace support
