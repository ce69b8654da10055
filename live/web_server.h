/// @file
/// HTTP and WebSocket for a page and a stream, in a thread of its own.
#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace live {

inline constexpr std::size_t kMaxConnections = 64;  ///< HTTP and WebSocket together
inline constexpr std::size_t kMaxWebSockets = 48;   ///< the rest is left for HTTP, which can stop the robot
inline constexpr std::size_t kMaxRequest_bytes = 16 * 1024;
inline constexpr std::size_t kMaxMessage_bytes = 64 * 1024;  ///< from a WebSocket client
/// Bytes that wait for a slow client. Above the first, messages that it can do without are left out; above
/// the second, the connection ends.
inline constexpr std::size_t kDropAbove_bytes = 256 * 1024;
inline constexpr std::size_t kCloseAbove_bytes = 1024 * 1024;

/// A WebSocket connection, for the conversation on it. On the server's thread.
class WebSocket {
 public:
  enum class Format : std::uint8_t { kText, kBinary };
  enum class Need : std::uint8_t {
    kMust,
    kMay,  ///< left out while the client is slow
  };
  WebSocket() = default;
  WebSocket(const WebSocket&) = delete;
  WebSocket& operator=(const WebSocket&) = delete;
  virtual ~WebSocket() = default;

  virtual void send(std::string message, Format format, Need need) = 0;
  /// "127.0.0.1:53124"
  virtual const std::string& client() const = 0;
};

/// Destroyed when its connection ends. On the server's thread.
class Conversation {
 public:
  Conversation() = default;
  Conversation(const Conversation&) = delete;
  Conversation& operator=(const Conversation&) = delete;
  virtual ~Conversation() = default;
  /// The connection is open: the first messages.
  virtual void begin() {}
  virtual void hear(std::string_view message) = 0;
};

struct Request {
  enum class Method : std::uint8_t { kGet, kPost };
  Method method = Method::kGet;
  std::string path;    ///< "/stop", without a query
  std::string client;  ///< "127.0.0.1:53124"
  /// Sent by a page of this server, or by a program: not by a page of another site in the same browser.
  bool same_origin = true;
  std::string origin{};                  ///< of the page that asks; empty: a program
  std::vector<std::string> protocols{};  ///< offered for a WebSocket
};

struct Response {
  unsigned status = 200;
  std::string type = "text/plain; charset=utf-8";
  std::string body{};
  std::string file_name{};  ///< to save it as; empty: the browser shows it
};

/// What the server serves. Called on the server's thread; exceptions answer 500.
class Site {
 public:
  Site() = default;
  Site(const Site&) = delete;
  Site& operator=(const Site&) = delete;
  virtual ~Site() = default;

  virtual Response answer(const Request& request) = 0;
  struct Opening {
    std::function<std::unique_ptr<Conversation>(WebSocket& socket)> converse;
    std::string protocol{};  ///< one of those offered; empty: none
  };
  /// For a request to open a WebSocket at this path. Nothing: refused.
  virtual std::optional<Opening> open(const Request& request) = 0;
  /// Every kTick.
  virtual void tick() = 0;
};

/// Serves from start() to its destruction. Requests must name this machine by an address, "localhost" or its
/// host name, so that no other site can reach it under a name of its own (DNS rebinding).
class WebServer {
 public:
  static constexpr std::chrono::milliseconds kTick{33};

  /// `where`: "HOST:PORT", "HOST" or "PORT"; the host is a numeric address or "localhost". Port 0: any free
  /// one. `site` must outlive it. @throws std::invalid_argument for another `where`; hal::SetupError if it
  /// cannot listen there.
  WebServer(const std::string& where, Site& site);
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;
  ~WebServer();
  /// Set-up, once.
  void start();

  /// "http://127.0.0.1:8765/"
  const std::string& url() const noexcept { return url_; }
  bool local_only() const noexcept { return local_only_; }  ///< only programs of this machine can connect
  /// Any thread: runs `work` on the server's thread.
  void post(std::function<void()> work);

 private:
  class Listener;
  std::unique_ptr<Listener> listener_;
  std::string url_;
  bool local_only_ = true;
};

/// The default of --page.
inline constexpr std::string_view kDefaultAddress = "127.0.0.1:8765";

}  // namespace live
