/// @file
/// A client of HTTP and WebSocket that sends what a test gives it, correct or not.
#pragma once
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>

namespace support {

/// The port of "http://127.0.0.1:8080/".
inline std::uint16_t port_of(const std::string& url) {
  return static_cast<std::uint16_t>(std::atoi(url.substr(url.rfind(':') + 1).c_str()));
}

/// One TCP connection to 127.0.0.1.
class WebClient {
 public:
  struct Response {
    int status = 0;  ///< 0: the connection ended
    std::string head;
    std::string body;

    std::string header(const std::string& name) const {
      const std::size_t at = head.find("\r\n" + name + ": ");
      if (at == std::string::npos) return "";
      const std::size_t begin = at + name.size() + 4;
      return head.substr(begin, head.find("\r\n", begin) - begin);
    }
  };
  struct Message {
    int opcode = 0;
    std::string payload;
  };
  static constexpr int kText = 1, kBinary = 2, kClose = 8, kPing = 9, kPong = 10;

  /// `receive_bytes`: the system's buffer for what the client has not read; 0: as usual.
  explicit WebClient(std::uint16_t port, int receive_bytes = 0)
      : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)), port_(port) {
    if (receive_bytes > 0) setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_bytes, sizeof receive_bytes);
    // An answer that never comes is a failure, not a test that hangs.
    const timeval patience{20, 0};
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connected_ = connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  }
  WebClient(const WebClient&) = delete;
  WebClient& operator=(const WebClient&) = delete;
  ~WebClient() { close(socket_); }

  bool connected() const { return connected_; }
  std::string host() const { return "127.0.0.1:" + std::to_string(port_); }

  bool say(std::string_view bytes) const {
    while (!bytes.empty()) {
      const ssize_t sent = send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (sent <= 0) return false;
      bytes.remove_prefix(static_cast<std::size_t>(sent));
    }
    return true;
  }
  /// "GET", "/": a request with a Host header and `headers`, each with its line end.
  std::string request(const std::string& method, const std::string& path,
                      const std::string& headers = "") const {
    return method + " " + path + " HTTP/1.1\r\nHost: " + host() + "\r\n" + headers + "\r\n";
  }
  Response ask(const std::string& method, const std::string& path, const std::string& headers = "") {
    say(request(method, path, headers));
    return hear(method != "HEAD");
  }
  Response hear(bool with_body = true) {
    Response response;
    while (heard_.find("\r\n\r\n") == std::string::npos)
      if (!more()) return response;
    response.head = take(heard_.find("\r\n\r\n") + 4);
    response.status = std::atoi(response.head.substr(response.head.find(' ') + 1).c_str());
    const std::string length = response.header("Content-Length");
    const std::size_t size = with_body ? std::strtoul(length.c_str(), nullptr, 10) : 0;
    while (heard_.size() < size)
      if (!more()) return {};
    response.body = take(size);
    return response;
  }

  /// The answer to a handshake with the key of RFC 6455, section 1.3.
  Response open(const std::string& path, const std::string& headers = "") {
    return ask("GET", path,
               "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
               "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n" +
                   headers);
  }
  /// RFC 6455, section 5.2, with a mask as clients must use it.
  bool say_frame(int opcode, std::string_view payload, bool masked = true, bool final = true) const {
    constexpr std::string_view kMask = "\x37\xfa\x21\x3d";
    std::string frame(1, static_cast<char>((final ? 0x80 : 0) | opcode));
    const int mask_bit = masked ? 0x80 : 0;
    if (payload.size() < 126) {
      frame += static_cast<char>(mask_bit | static_cast<int>(payload.size()));
    } else {
      const int bytes = payload.size() < 65536 ? 2 : 8;
      frame += static_cast<char>(mask_bit | (bytes == 2 ? 126 : 127));
      for (int i = bytes - 1; i >= 0; --i) frame += static_cast<char>(payload.size() >> (8 * i));
    }
    if (masked) frame += kMask;
    for (std::size_t i = 0; i < payload.size(); ++i)
      frame += static_cast<char>(masked ? payload[i] ^ kMask[i % 4] : payload[i]);
    return say(frame);
  }
  /// A whole message, which may come in several frames; answers pings before it. Nothing: the connection
  /// ended.
  std::optional<Message> hear_message() {
    std::optional<Message> message = hear_one();
    while (message && message->opcode == kPing) {
      say_frame(kPong, message->payload);
      message = hear_one();
    }
    while (message && !final_) {
      const std::optional<Message> more_of_it = hear_one();
      if (!more_of_it) return std::nullopt;
      message->payload += more_of_it->payload;
    }
    return message;
  }
  /// Whether the other end closed the connection; reads what came before.
  bool ended() {
    while (more()) {
    }
    return errno == 0 || errno == ECONNRESET;
  }

 private:
  std::optional<Message> hear_one() {
    const auto need = [this](std::size_t size) {
      while (heard_.size() < size)
        if (!more()) return false;
      return true;
    };
    if (!need(2)) return std::nullopt;
    std::size_t head = 2;
    std::size_t size = static_cast<unsigned char>(heard_[1]);  // a server masks nothing
    if (size >= 126) {
      head = size == 126 ? 4 : 10;
      if (!need(head)) return std::nullopt;
      size = 0;
      for (std::size_t i = 2; i < head; ++i) size = size << 8 | static_cast<unsigned char>(heard_[i]);
    }
    if (!need(head + size)) return std::nullopt;
    const int opcode = heard_[0] & 15;
    final_ = (heard_[0] & 0x80) != 0;
    take(head);
    return Message{opcode, take(size)};
  }
  bool more() {
    std::array<char, 65536> bytes{};
    errno = 0;
    const ssize_t size = recv(socket_, bytes.data(), bytes.size(), 0);
    if (size <= 0) return false;
    heard_.append(bytes.data(), static_cast<std::size_t>(size));
    return true;
  }
  std::string take(std::size_t size) {
    std::string taken = heard_.substr(0, size);
    heard_.erase(0, size);
    return taken;
  }

  int socket_;
  std::uint16_t port_;
  bool connected_ = false;
  bool final_ = true;  // the last frame ended its message
  std::string heard_;
};

}  // namespace support
