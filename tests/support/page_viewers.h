/// @file
/// Clients of the live page's stream for as long as they exist: half of them read, half of them do not.
#pragma once
#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace support {

/// A connection to a port of this machine.
class TcpClient {
 public:
  explicit TcpClient(std::uint16_t port) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
      throw std::runtime_error("no server at port " + std::to_string(port));
  }
  TcpClient(const TcpClient&) = delete;
  TcpClient& operator=(const TcpClient&) = delete;
  ~TcpClient() { close(socket_); }

  void say(const std::string& bytes) const { (void)send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL); }
  /// Waits for bytes; 0 when the connection has ended.
  std::size_t hear() {
    const ssize_t size = recv(socket_, buffer_.data(), buffer_.size(), 0);
    return size > 0 ? static_cast<std::size_t>(size) : 0;
  }
  void shut() const { shutdown(socket_, SHUT_RDWR); }

 private:
  int socket_;
  std::array<char, 65536> buffer_{};
};

/// A WebSocket text frame of a client (RFC 6455, 5.2), masked by zeros.
inline std::string text_frame(const std::string& text) {
  std::string frame("\x81");
  frame += static_cast<char>(0x80 | 126);
  frame += static_cast<char>(text.size() >> 8);
  frame += static_cast<char>(text.size() & 0xff);
  return frame + std::string(4, '\0') + text;
}

class PageViewers {
 public:
  static constexpr int kChannels = 12;

  PageViewers(std::uint16_t port, int count) {
    std::string subscriptions;
    for (int i = 1; i <= kChannels; ++i)
      subscriptions += (i > 1 ? "," : "") + std::string(R"({"id":)") + std::to_string(i) +
                       R"(,"channelId":)" + std::to_string(i) + "}";
    for (int i = 0; i < count; ++i) {
      auto& client = clients_.emplace_back(std::make_unique<TcpClient>(port));
      client->say(
          "GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
          "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n"
          "Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n");
      if (client->hear() == 0) throw std::runtime_error("the page refuses a viewer");
      client->say(text_frame(R"({"op":"subscribe","subscriptions":[)" + subscriptions + "]}"));
      if (i % 2 == 0)
        readers_.emplace_back([this, reader = client.get()] {
          while (const std::size_t size = reader->hear()) bytes_ += size;
        });
    }
  }
  PageViewers(const PageViewers&) = delete;
  PageViewers& operator=(const PageViewers&) = delete;
  ~PageViewers() {
    for (const auto& client : clients_) client->shut();
  }

  std::uint64_t bytes() const { return bytes_; }

 private:
  std::atomic<std::uint64_t> bytes_{0};
  std::vector<std::unique_ptr<TcpClient>> clients_;
  std::vector<std::jthread> readers_;
};

}  // namespace support
