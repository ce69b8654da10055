#include "live/web_server.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <charconv>
#include <deque>
#include <list>
#include <stdexcept>
#include <thread>
#include <utility>

#include "hal/setup_error.h"
#include "live/host_name.h"
#include "runtime/log.h"
#include "runtime/program/build_info.h"
#include "runtime/start_thread.h"

namespace live {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using Tcp = asio::ip::tcp;
using Error = beast::error_code;
// Instead of any executor, and without compression of WebSockets: a quarter less code to compile.
using Executor = asio::io_context::executor_type;
using Acceptor = asio::basic_socket_acceptor<Tcp, Executor>;
using Socket = asio::basic_stream_socket<Tcp, Executor>;
using Stream = beast::basic_stream<Tcp, Executor>;
using SocketStream = beast::websocket::stream<Stream, false>;
using Timer = asio::basic_waitable_timer<std::chrono::steady_clock,
                                         asio::wait_traits<std::chrono::steady_clock>, Executor>;

constexpr std::chrono::seconds kHttpPatience{10};
constexpr std::chrono::seconds kWebSocketPatience{30};
constexpr std::chrono::milliseconds kAcceptRetry{200};

std::string text_of(const Tcp::endpoint& endpoint) {
  const std::string address = endpoint.address().to_string();
  return (endpoint.address().is_v6() ? "[" + address + "]" : address) + ":" + std::to_string(endpoint.port());
}

std::vector<std::string> offered_protocols(const http::request<http::string_body>& request) {
  std::vector<std::string> protocols;
  for (const auto& token : http::token_list(request[http::field::sec_websocket_protocol]))
    protocols.emplace_back(token);
  return protocols;
}

}  // namespace

/// Owns every connection; all on one thread.
class WebServer::Listener {
 public:
  Listener(const Tcp::endpoint& endpoint, Site& site);
  ~Listener();

  void start() {
    thread_ = runtime::start_thread("the page", [this] { run(); });
  }
  Tcp::endpoint endpoint() const { return acceptor_.local_endpoint(); }
  void post(std::function<void()> work) { asio::post(context_, std::move(work)); }

 private:
  class Connection;
  class HttpConnection;
  class SocketConnection;
  using Connections = std::list<std::shared_ptr<Connection>>;

  void run();
  void accept();
  void tick();
  bool make_room();
  void remove(const Connection& connection);
  std::size_t web_sockets() const;

  asio::io_context context_{1};
  Acceptor acceptor_;
  Timer timer_;
  Timer accept_again_;
  Site& site_;
  Connections connections_;  // the longest known first
  std::jthread thread_;      // last: uses all of the above
};

class WebServer::Listener::Connection {
 public:
  explicit Connection(Listener& listener) : listener_(listener) {}
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  virtual ~Connection() = default;
  virtual bool is_web_socket() const = 0;
  virtual void start() = 0;
  virtual void shut() = 0;

 protected:
  Listener& listener_;
};

/// A WebSocket after its HTTP request.
class WebServer::Listener::SocketConnection final : public Connection,
                                                    public WebSocket,
                                                    public std::enable_shared_from_this<SocketConnection> {
 public:
  SocketConnection(Listener& listener, Stream&& stream, std::string client)
      : Connection(listener), stream_(std::move(stream)), client_(std::move(client)) {}

  void accept(const http::request<http::string_body>& request, Site::Opening opening) {
    conversation_ = opening.converse(*this);
    beast::get_lowest_layer(stream_).expires_never();
    stream_.set_option(beast::websocket::stream_base::timeout{kHttpPatience, kWebSocketPatience, true});
    stream_.read_message_max(kMaxMessage_bytes);
    stream_.set_option(beast::websocket::stream_base::decorator(
        [protocol = std::move(opening.protocol)](beast::websocket::response_type& response) {
          if (!protocol.empty()) response.set(http::field::sec_websocket_protocol, protocol);
        }));
    stream_.async_accept(request, [self = shared_from_this()](Error error) {
      if (error) return self->end();
      self->open_ = true;
      self->conversation_->begin();
      self->read();
    });
  }

  bool is_web_socket() const override { return true; }
  void start() override {}
  void shut() override { beast::get_lowest_layer(stream_).close(); }
  const std::string& client() const override { return client_; }

  void send(std::string message, Format format, Need need) override {
    if (!open_) return;
    if (need == Need::kMay && waiting_bytes_ > kDropAbove_bytes) return;
    waiting_bytes_ += message.size();
    if (waiting_bytes_ > kCloseAbove_bytes) {
      open_ = false;
      return shut();
    }
    waiting_.push_back({std::move(message), format});
    if (waiting_.size() == 1) write();
  }

 private:
  struct Message {
    std::string bytes;
    Format format;
  };

  void read() {
    stream_.async_read(buffer_, [self = shared_from_this()](Error error, std::size_t) {
      if (error || !self->open_) return self->end();
      const auto data = self->buffer_.cdata();
      try {
        self->conversation_->hear({static_cast<const char*>(data.data()), data.size()});
      } catch (const std::exception& failed) {
        spdlog::error("page: {}: {}", self->client_, failed.what());
        self->shut();
        return self->end();
      }
      self->buffer_.consume(self->buffer_.size());
      self->read();
    });
  }

  void write() {
    stream_.binary(waiting_.front().format == Format::kBinary);
    stream_.async_write(asio::buffer(waiting_.front().bytes),
                        [self = shared_from_this()](Error error, std::size_t) {
                          if (error || !self->open_) return self->end();
                          self->waiting_bytes_ -= self->waiting_.front().bytes.size();
                          self->waiting_.pop_front();
                          if (!self->waiting_.empty()) self->write();
                        });
  }

  void end() {
    open_ = false;
    shut();
    conversation_.reset();
    listener_.remove(*this);
  }

  SocketStream stream_;
  std::string client_;
  std::unique_ptr<Conversation> conversation_;
  beast::flat_buffer buffer_;
  std::deque<Message> waiting_;  // its first one is being written
  std::size_t waiting_bytes_ = 0;
  bool open_ = false;
};

class WebServer::Listener::HttpConnection final : public Connection,
                                                  public std::enable_shared_from_this<HttpConnection> {
 public:
  HttpConnection(Listener& listener, Socket&& socket, std::string client)
      : Connection(listener), stream_(std::move(socket)), client_(std::move(client)) {}

  bool is_web_socket() const override { return false; }
  void start() override { read(); }
  void shut() override { stream_.close(); }

 private:
  void read() {
    parser_.emplace();
    parser_->header_limit(kMaxRequest_bytes);
    parser_->body_limit(kMaxRequest_bytes);
    stream_.expires_after(kHttpPatience);
    http::async_read(stream_, buffer_, *parser_, [self = shared_from_this()](Error error, std::size_t) {
      if (error) return self->end();
      const auto& request = self->parser_->get();
      try {
        self->handle(request);
      } catch (const std::exception& failed) {
        spdlog::error("page: {}: {}", self->client_, failed.what());
        self->write({.status = 500, .body = "youbotd's log has the cause\n"}, request);
      }
    });
  }

  void handle(const http::request<http::string_body>& request) {
    const std::string_view host(request[http::field::host].data(), request[http::field::host].size());
    const std::string_view origin(request[http::field::origin].data(), request[http::field::origin].size());
    if (!names_this_machine(host))
      return write({.status = 403, .body = "open this page by an address or by the machine's host name\n"},
                   request);
    const std::string_view target(request.target().data(), request.target().size());
    Request asked{.path = std::string(target.substr(0, target.find('?'))),
                  .client = client_,
                  .same_origin = origin.empty() || origin == "http://" + std::string(host) ||
                                 origin == "https://" + std::string(host),  // by a proxy
                  .origin = std::string(origin)};
    if (beast::websocket::is_upgrade(request)) return upgrade(request, std::move(asked));
    if (request.method() == http::verb::post)
      asked.method = Request::Method::kPost;
    else if (request.method() != http::verb::get && request.method() != http::verb::head)
      return write({.status = 405, .body = "only GET and POST\n"}, request);
    write(listener_.site_.answer(asked), request);
  }

  void upgrade(const http::request<http::string_body>& request, Request asked) {
    asked.protocols = offered_protocols(request);
    if (listener_.web_sockets() >= kMaxWebSockets)
      return write({.status = 503, .body = "too many connections\n"}, request);
    auto opening = listener_.site_.open(asked);
    if (!opening) return write({.status = 404, .body = "no WebSocket for this page and protocol\n"}, request);
    const auto socket = std::make_shared<SocketConnection>(listener_, std::move(stream_), client_);
    listener_.connections_.push_back(socket);
    socket->accept(request, std::move(*opening));
    listener_.remove(*this);
  }

  void write(Response response, const http::request<http::string_body>& request) {
    http::response<http::string_body> message{static_cast<http::status>(response.status), request.version()};
    message.set(http::field::server, std::string("youbotd/") + runtime::build_version());
    message.set(http::field::content_type, response.type);
    message.set(http::field::cache_control, "no-store");
    message.set("X-Content-Type-Options", "nosniff");
    message.set("X-Frame-Options", "DENY");
    message.set("Content-Security-Policy",
                "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; "
                "connect-src 'self' ws: wss:");
    if (!response.file_name.empty())
      message.set(http::field::content_disposition, "attachment; filename=\"" + response.file_name + "\"");
    message.keep_alive(request.keep_alive());
    message.body() = std::move(response.body);
    message.prepare_payload();
    if (request.method() == http::verb::head) message.body().clear();  // Content-Length remains
    reply_ = std::move(message);
    stream_.expires_after(kHttpPatience);
    http::async_write(stream_, reply_, [self = shared_from_this()](Error error, std::size_t) {
      if (error || !self->reply_.keep_alive()) return self->end();
      self->read();
    });
  }

  void end() {
    Error ignored;
    stream_.socket().shutdown(Tcp::socket::shutdown_send, ignored);
    listener_.remove(*this);
  }

  Stream stream_;
  std::string client_;
  beast::flat_buffer buffer_{kMaxRequest_bytes};
  std::optional<http::request_parser<http::string_body>> parser_;
  http::response<http::string_body> reply_;
};

WebServer::Listener::Listener(const Tcp::endpoint& endpoint, Site& site)
    : acceptor_(context_), timer_(context_), accept_again_(context_), site_(site) {
  acceptor_.open(endpoint.protocol());
  acceptor_.set_option(Tcp::acceptor::reuse_address(true));
  acceptor_.bind(endpoint);
  acceptor_.listen();
  accept();
  tick();
}

WebServer::Listener::~Listener() {
  context_.stop();
  if (thread_.joinable()) thread_.join();
  connections_.clear();
}

void WebServer::Listener::run() {
  while (!context_.stopped()) {
    try {
      context_.run();
    } catch (const std::exception& error) {
      spdlog::error("page: {}", error.what());
    }
  }
}

void WebServer::Listener::accept() {
  acceptor_.async_accept([this](Error error, Socket socket) {
    if (error) {  // out of file descriptors, for one
      accept_again_.expires_after(kAcceptRetry);
      accept_again_.async_wait([this](Error) { accept(); });
      return;
    }
    accept();  // first: an exception ends this function
    Error gone;
    const Tcp::endpoint client = socket.remote_endpoint(gone);
    if (gone || !make_room()) return;
    socket.set_option(Tcp::no_delay(true), gone);
    connections_.push_back(std::make_shared<HttpConnection>(*this, std::move(socket), text_of(client)));
    connections_.back()->start();
  });
}

/// A newcomer may want to stop the robot: it replaces the oldest connection that is no WebSocket.
bool WebServer::Listener::make_room() {
  if (connections_.size() < kMaxConnections) return true;
  const auto oldest = std::ranges::find_if(connections_, [](const auto& c) { return !c->is_web_socket(); });
  if (oldest == connections_.end()) return false;
  (*oldest)->shut();
  connections_.erase(oldest);
  return true;
}

void WebServer::Listener::remove(const Connection& connection) {
  connections_.remove_if([&](const auto& c) { return c.get() == &connection; });
}

std::size_t WebServer::Listener::web_sockets() const {
  return static_cast<std::size_t>(
      std::ranges::count_if(connections_, [](const auto& c) { return c->is_web_socket(); }));
}

void WebServer::Listener::tick() {
  timer_.expires_after(kTick);
  timer_.async_wait([this](Error error) {
    if (error) return;
    tick();  // first: an exception of the site ends this function
    site_.tick();
  });
}

namespace {

Tcp::endpoint endpoint_of(const std::string& where) {
  const auto unusable = [&] {
    return std::invalid_argument(
        "--page: '" + where +
        "' is no HOST:PORT with a numeric address or localhost, and a port up to 65535");
  };
  const std::size_t colon = where.rfind(':');
  const bool only_port = !where.empty() && where.find_first_not_of("0123456789") == std::string::npos;
  const bool has_port =
      only_port || (colon != std::string::npos && where.find(']', colon) == std::string::npos);
  std::string host = only_port ? "localhost" : has_port ? where.substr(0, colon) : where;
  const std::string port = only_port ? where : has_port ? where.substr(colon + 1) : "8765";
  if (host == "localhost") host = "127.0.0.1";
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  Error error;
  const auto address = asio::ip::make_address(host, error);
  std::uint16_t number = 0;
  const auto [end, bad] = std::from_chars(port.data(), port.data() + port.size(), number);
  if (error || bad != std::errc() || end != port.data() + port.size()) throw unusable();
  return {address, number};
}

}  // namespace

WebServer::WebServer(const std::string& where, Site& site) {
  const Tcp::endpoint wanted = endpoint_of(where);
  try {
    listener_ = std::make_unique<Listener>(wanted, site);
  } catch (const boost::system::system_error& error) {
    throw hal::SetupError("page at " + text_of(wanted), "listen: " + error.code().message(),
                          error.code() == asio::error::address_in_use
                              ? "another program uses this port; choose another one, as --page 8081"
                              : "choose an address of this machine, as --page 127.0.0.1:8765");
  }
  Tcp::endpoint bound = listener_->endpoint();
  local_only_ = bound.address().is_loopback();
  url_ = "http://" + text_of(bound) + "/";
}

WebServer::~WebServer() = default;

void WebServer::start() { listener_->start(); }

void WebServer::post(std::function<void()> work) { listener_->post(std::move(work)); }

}  // namespace live
