// The server of the page, over real sockets.
#include "live/web_server.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <future>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "hal/setup_error.h"
#include "tests/support/web_client.h"

namespace web_server_test {

using live::Request;
using live::Response;
using live::WebServer;
using live::WebSocket;
using support::port_of;
using support::WebClient;

/// Answers with what it understood; echoes on WebSockets.
struct EchoSite final : live::Site {
  struct Echo final : live::Conversation {
    Echo(EchoSite& echo_site, WebSocket& echo_socket) : site(echo_site), socket(echo_socket) {
      site.sockets.push_back(&socket);
    }
    ~Echo() override {
      std::erase(site.sockets, &socket);
      ++site.left;
    }
    void hear(std::string_view message) override {
      if (message == "throw") throw std::runtime_error("what a conversation throws");
      socket.send(std::string(message), WebSocket::Format::kText, WebSocket::Need::kMust);
    }
    EchoSite& site;
    WebSocket& socket;
  };

  Response answer(const Request& request) override {
    if (request.path == "/throw") throw std::runtime_error("what a site throws");
    if (request.path == "/missing") return {.status = 404, .body = "nothing here\n"};
    if (request.path == "/file")
      return {.type = "application/octet-stream", .body = std::string("\0\xff", 2), .file_name = "fault.csv"};
    if (request.method == Request::Method::kPost) ++posts;
    return {.body = std::string(request.method == Request::Method::kPost ? "POST " : "GET ") + request.path +
                    (request.same_origin ? "" : " from elsewhere")};
  }
  std::optional<Opening> open(const Request& request) override {
    if (request.path != "/socket") return std::nullopt;
    return Opening{[this](WebSocket& socket) { return std::make_unique<Echo>(*this, socket); },
                   request.protocols.empty() ? "" : request.protocols.back()};
  }
  void tick() override { ++ticks; }

  std::atomic<int> ticks{0};
  std::atomic<int> posts{0};
  std::atomic<int> left{0};
  std::vector<WebSocket*> sockets;  // on the server's thread
};

struct WebServerTest : testing::Test {
  WebServerTest() { server.start(); }
  /// On the server's thread.
  template <typename Work>
  auto there(const Work& work) {
    std::promise<decltype(work())> result;
    server.post([&] { result.set_value(work()); });
    return result.get_future().get();
  }
  std::size_t conversations() {
    return there([this] { return site.sockets.size(); });
  }

  EchoSite site;
  WebServer server{"localhost:0", site};
  std::uint16_t port = port_of(server.url());
};

TEST_F(WebServerTest, AnswersGetHeadAndPost) {
  WebClient client(port);
  const auto get = client.ask("GET", "/page?from=bookmark");
  EXPECT_TRUE(get.head.starts_with("HTTP/1.1 200 OK\r\n")) << get.head;
  EXPECT_EQ(get.body, "GET /page") << "without the query";
  EXPECT_EQ(get.header("Content-Type"), "text/plain; charset=utf-8");
  EXPECT_EQ(get.header("Cache-Control"), "no-store");
  EXPECT_EQ(get.header("X-Content-Type-Options"), "nosniff");
  EXPECT_EQ(get.header("X-Frame-Options"), "DENY")
      << "no click on a stop or start button inside another site";
  const auto head = client.ask("HEAD", "/page");
  EXPECT_EQ(head.status, 200);
  EXPECT_EQ(head.header("Content-Length"), "9") << "of the body that GET gets";
  client.say(client.request("POST", "/stop", "Content-Length: 4\r\n") + "body");
  EXPECT_EQ(client.hear().body, "POST /stop");
  EXPECT_EQ(site.posts, 1);
}

TEST_F(WebServerTest, AFileIsForSaving) {
  WebClient client(port);
  const auto file = client.ask("GET", "/file");
  EXPECT_EQ(file.header("Content-Disposition"), "attachment; filename=\"fault.csv\"");
  EXPECT_EQ(file.body, std::string("\0\xff", 2));
}

TEST_F(WebServerTest, RefusesWhatItDoesNotServeAndGoesOn) {
  WebClient client(port);
  EXPECT_EQ(client.ask("GET", "/missing").status, 404);
  EXPECT_EQ(client.ask("DELETE", "/").status, 405);
  EXPECT_EQ(client.ask("PUT", "/", "Content-Length: 0\r\n").status, 405);
  EXPECT_EQ(client.ask("GET", "/").status, 200) << "the same connection";
}

TEST_F(WebServerTest, AnExceptionOfTheSiteAnswers500AndTheConnectionGoesOn) {
  WebClient client(port);
  EXPECT_EQ(client.ask("GET", "/throw").status, 500);
  EXPECT_EQ(client.ask("GET", "/").status, 200);
}

TEST_F(WebServerTest, ARequestUnderAnotherNameIsRefused) {
  for (const std::string host : {"evil.example", "evil.example:8080", "127.0.0.1.evil.example", ""}) {
    WebClient client(port);
    client.say("POST /stop HTTP/1.1\r\nHost: " + host + "\r\nContent-Length: 0\r\n\r\n");
    EXPECT_EQ(client.hear().status, 403) << host;
  }
  WebClient without(port);
  without.say("GET / HTTP/1.0\r\n\r\n");
  EXPECT_EQ(without.hear().status, 403);
  EXPECT_EQ(site.posts, 0);
}

TEST_F(WebServerTest, ReportsARequestOfAnotherSite) {
  WebClient client(port);
  EXPECT_EQ(client.ask("GET", "/", "Origin: http://" + client.host() + "\r\n").body, "GET /");
  for (const std::string origin : {"http://evil.example", "https://127.0.0.1", "null", "http://127.0.0.1:1"})
    EXPECT_EQ(client.ask("GET", "/", "Origin: " + origin + "\r\n").body, "GET / from elsewhere") << origin;
}

TEST_F(WebServerTest, PipelinedRequestsAreAnsweredInOrder) {
  WebClient client(port);
  client.say(client.request("GET", "/1") + client.request("POST", "/2", "Content-Length: 0\r\n") +
             client.request("GET", "/3"));
  EXPECT_EQ(client.hear().body, "GET /1");
  EXPECT_EQ(client.hear().body, "POST /2");
  EXPECT_EQ(client.hear().body, "GET /3");
}

TEST_F(WebServerTest, EndsTheConnectionWhenAskedTo) {
  WebClient client(port);
  EXPECT_EQ(client.ask("GET", "/", "Connection: close\r\n").status, 200);
  EXPECT_TRUE(client.ended());
  WebClient old(port);
  old.say("GET / HTTP/1.0\r\nHost: localhost\r\n\r\n");
  EXPECT_EQ(old.hear().status, 200);
  EXPECT_TRUE(old.ended());
}

TEST_F(WebServerTest, ARequestAboveItsLimitEndsTheConnection) {
  const std::string header(live::kMaxRequest_bytes + 1, 'x');
  {
    WebClient client(port);
    client.say(client.request("GET", "/", "X-Long: " + header + "\r\n"));
    EXPECT_TRUE(client.ended()) << "header";
  }
  {
    WebClient client(port);
    client.say("GET /" + header);
    EXPECT_TRUE(client.ended()) << "without an end";
  }
  {
    WebClient client(port);
    client.say(client.request("POST", "/stop", "Content-Length: " + std::to_string(header.size()) + "\r\n") +
               header);
    EXPECT_TRUE(client.ended()) << "body";
  }
  {
    WebClient client(port);
    client.say(client.request("POST", "/stop", "Transfer-Encoding: chunked\r\n") + "FFFFFFFFFFFFFFFFF\r\n");
    EXPECT_TRUE(client.ended()) << "size of a chunk";
  }
  EXPECT_EQ(site.posts, 0);
  EXPECT_EQ(WebClient(port).ask("GET", "/").status, 200);
}

TEST_F(WebServerTest, GarbageEndsTheConnection) {
  for (const std::string& garbage :
       {std::string("\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", 11),
        std::string("\r\n\r\nno HTTP\r\n\r\n"), std::string(300, '\0'), std::string("GET / HTTP/9.9\r\n\r\n"),
        std::string("GET / HTTP/1.1\r\nHost localhost\r\n\r\n"),
        std::string("POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: -1\r\n\r\n"),
        std::string(
            "POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\nx")}) {
    WebClient client(port);
    client.say(garbage);
    EXPECT_TRUE(client.ended()) << garbage;
  }
  EXPECT_EQ(WebClient(port).ask("GET", "/").status, 200);
}

TEST_F(WebServerTest, OpensAWebSocketAsInRfc6455) {
  std::optional<WebClient> connection(std::in_place, port);
  WebClient& client = *connection;
  const auto opened = client.open("/socket");
  EXPECT_EQ(opened.status, 101);
  EXPECT_EQ(opened.header("Sec-WebSocket-Accept"), "s3pPLMBiTxaQ9kYGzzhZRbK+xOo=");
  EXPECT_EQ(opened.header("Sec-WebSocket-Protocol"), "");
  // Section 5.7: "Hello" in one frame, and in two.
  client.say("\x81\x85\x37\xfa\x21\x3d\x7f\x9f\x4d\x51\x58");
  auto frame = client.hear_message();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->payload, "Hello");
  EXPECT_EQ(frame->opcode, WebClient::kText);
  client.say_frame(WebClient::kText, "Hel", true, /*final=*/false);
  client.say_frame(WebClient::kPing, "between");
  client.say_frame(0, "lo");
  frame = client.hear_message();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->opcode, WebClient::kPong);
  EXPECT_EQ(frame->payload, "between");
  frame = client.hear_message();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->payload, "Hello");
  client.say_frame(WebClient::kClose, "\x03\xe8");
  frame = client.hear_message();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->opcode, WebClient::kClose);
  EXPECT_TRUE(client.ended());
  connection.reset();
  while (conversations() > 0) {  // the test hangs otherwise
  }
}

TEST_F(WebServerTest, SelectsTheSitesProtocol) {
  WebClient client(port);
  EXPECT_EQ(
      client.open("/socket", "Sec-WebSocket-Protocol: first, second\r\n").header("Sec-WebSocket-Protocol"),
      "second");
}

TEST_F(WebServerTest, RefusesAWebSocketThatTheSiteDoesNotServe) {
  WebClient client(port);
  EXPECT_EQ(client.open("/elsewhere").status, 404);
  EXPECT_EQ(client.ask("GET", "/").status, 200) << "the connection goes on";
  WebClient old(port);
  old.say(old.request("GET", "/socket",
                      "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 7\r\n"
                      "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"));
  EXPECT_EQ(old.hear().status, 426) << "another version of the protocol";
  EXPECT_TRUE(old.ended());
}

TEST_F(WebServerTest, AFrameAgainstTheProtocolEndsTheWebSocket) {
  const auto ends = [&](const char* what, const auto& say) {
    WebClient client(port);
    ASSERT_EQ(client.open("/socket").status, 101);
    say(client);
    EXPECT_TRUE(client.ended()) << what;
  };
  ends("without a mask", [](WebClient& c) { c.say_frame(WebClient::kText, "Hello", /*masked=*/false); });
  ends("unknown kind", [](WebClient& c) { c.say_frame(3, "Hello"); });
  ends("reserved bits", [](WebClient& c) { c.say_frame(0x71, "Hello"); });
  ends("no UTF-8", [](WebClient& c) { c.say_frame(WebClient::kText, "\xff\xfe"); });
  ends("ping of 126 bytes", [](WebClient& c) { c.say_frame(WebClient::kPing, std::string(126, 'x')); });
  ends("size with the highest bit",
       [](WebClient& c) { c.say("\x82\xff\xff\xff\xff\xff\xff\xff\xff\xff\x01\x02\x03\x04"); });
  EXPECT_EQ(WebClient(port).ask("GET", "/").status, 200);
}

TEST_F(WebServerTest, AMessageAboveItsLimitEndsTheWebSocket) {
  {
    WebClient client(port);
    client.open("/socket");
    const std::string longest(live::kMaxMessage_bytes, 'x');
    client.say_frame(WebClient::kText, longest);
    const auto echo = client.hear_message();
    ASSERT_TRUE(echo);
    EXPECT_EQ(echo->payload, longest);
    client.say_frame(WebClient::kText, longest + 'x');
    EXPECT_TRUE(client.ended());
  }
  WebClient client(port);
  client.open("/socket");
  for (std::size_t i = 0; i <= live::kMaxMessage_bytes / 1024; ++i)
    client.say_frame(i == 0 ? WebClient::kText : 0, std::string(1024, 'x'), true, /*final=*/false);
  EXPECT_TRUE(client.ended()) << "in fragments";
}

TEST_F(WebServerTest, AnExceptionOfAConversationEndsItsWebSocket) {
  WebClient client(port);
  client.open("/socket");
  client.say_frame(WebClient::kText, "throw");
  EXPECT_TRUE(client.ended());
  EXPECT_EQ(conversations(), 0U);
  EXPECT_EQ(site.left, 1);
}

TEST_F(WebServerTest, OneWebSocketTooManyIsRefusedAndAStopIsStillHeard) {
  std::vector<std::unique_ptr<WebClient>> clients;
  for (std::size_t i = 0; i < live::kMaxWebSockets; ++i) {
    clients.push_back(std::make_unique<WebClient>(port));
    ASSERT_EQ(clients.back()->open("/socket").status, 101);
  }
  WebClient extra(port);
  EXPECT_EQ(extra.open("/socket").status, 503);
  EXPECT_EQ(extra.ask("POST", "/stop", "Content-Length: 0\r\n").status, 200);
  EXPECT_EQ(site.posts, 1);
  for (const auto& client : clients) {
    client->say_frame(WebClient::kText, "still here");
    EXPECT_TRUE(client->hear_message());
  }
}

TEST_F(WebServerTest, OneConnectionTooManyReplacesTheOldestThatIsNoWebSocket) {
  WebClient socket(port);
  ASSERT_EQ(socket.open("/socket").status, 101);
  std::vector<std::unique_ptr<WebClient>> clients;
  while (clients.size() < live::kMaxConnections - 1) {
    clients.push_back(std::make_unique<WebClient>(port));
    ASSERT_EQ(clients.back()->ask("GET", "/").status, 200);
  }
  WebClient extra(port);
  EXPECT_EQ(extra.ask("POST", "/stop", "Content-Length: 0\r\n").status, 200);
  EXPECT_TRUE(clients.front()->ended());
  for (std::size_t i = 1; i < clients.size(); ++i) EXPECT_EQ(clients[i]->ask("GET", "/").status, 200);
  socket.say_frame(WebClient::kText, "still here");
  EXPECT_TRUE(socket.hear_message());
}

TEST_F(WebServerTest, AClientThatReadsNothingLosesWhatItCanDoWithoutThenItsConnection) {
  WebClient deaf(port, /*receive_bytes=*/4096);
  ASSERT_EQ(deaf.open("/socket").status, 101);
  WebClient other(port);
  ASSERT_EQ(other.open("/socket").status, 101);
  ASSERT_EQ(conversations(), 2U);
  // Far above both bounds, and above what the system buffers.
  const std::string message(64 * 1024, 'x');
  there([&] {
    for (int i = 0; i < 4000; ++i)
      site.sockets.front()->send(message, WebSocket::Format::kBinary, WebSocket::Need::kMay);
    return 0;
  });
  EXPECT_EQ(conversations(), 2U) << "messages are left out";
  other.say_frame(WebClient::kText, "still here");
  EXPECT_TRUE(other.hear_message());
  // What must arrive has a bound, too. The system takes a part of it.
  for (int i = 0; i < 4000 && conversations() == 2; ++i) {
    there([&] {
      site.sockets.front()->send(message, WebSocket::Format::kBinary, WebSocket::Need::kMust);
      return 0;
    });
  }
  EXPECT_EQ(conversations(), 1U);
  std::size_t received = 0;
  while (const auto frame = deaf.hear_message()) received += frame->payload.size();
  EXPECT_LT(received, std::size_t{64} << 20) << "250 MB were offered";
  other.say_frame(WebClient::kText, "still here");
  EXPECT_TRUE(other.hear_message());
}

TEST_F(WebServerTest, ClientsThatVanishLeaveNothing) {
  for (int i = 0; i < 200; ++i) {
    WebClient client(port);
    if (i % 2 == 0) client.open("/socket");
    if (i % 3 == 0) client.say("GET / HT");
  }
  while (conversations() > 0) {  // the test hangs otherwise
  }
  EXPECT_EQ(site.left, 100);
}

TEST(WebServerStart, EndsWithOpenConnections) {
  EchoSite site;
  std::optional<WebServer> server(std::in_place, "0", site);
  server->start();
  WebClient http(port_of(server->url()));
  EXPECT_EQ(http.ask("GET", "/").status, 200);
  WebClient socket(port_of(server->url()));
  ASSERT_EQ(socket.open("/socket").status, 101);
  server.reset();
  EXPECT_TRUE(http.ended());
  EXPECT_TRUE(socket.ended());
  EXPECT_EQ(site.left, 1);
}

TEST(WebServerStart, APortInUseIsAnErrorWithItsRemedy) {
  EchoSite site;
  const WebServer first("127.0.0.1:0", site);
  const std::string where = "127.0.0.1:" + std::to_string(port_of(first.url()));
  try {
    const WebServer second(where, site);
    FAIL();
  } catch (const hal::SetupError& error) {
    const std::string what = error.what();
    EXPECT_NE(what.find(where), std::string::npos) << what;
    EXPECT_NE(what.find("--page 8081"), std::string::npos) << what;
  }
  EXPECT_THROW(WebServer("192.0.2.1:0", site), hal::SetupError) << "an address of documents, RFC 5737";
}

TEST(WebServerStart, ListensAtItsAddress) {
  EchoSite site;
  const auto url = [&](const char* where) { return WebServer(where, site).url(); };
  EXPECT_TRUE(url("localhost:0").starts_with("http://127.0.0.1:"));
  EXPECT_TRUE(url("0").starts_with("http://127.0.0.1:"));
  EXPECT_TRUE(url("0.0.0.0:0").starts_with("http://0.0.0.0:"));
  EXPECT_TRUE(WebServer("127.0.0.1:0", site).local_only());
  EXPECT_FALSE(WebServer("0.0.0.0:0", site).local_only());
  try {
    const WebServer server("[::1]:0", site);
    EXPECT_TRUE(server.url().starts_with("http://[::1]:")) << server.url();
    EXPECT_TRUE(server.local_only());
  } catch (const hal::SetupError&) {  // this machine has no IPv6
  }
}

TEST(WebServerStart, RefusesWhatIsNoAddress) {
  EchoSite site;
  for (const char* where : {"",
                            ":",
                            ":8080",
                            "65536",
                            "127.0.0.1:65536",
                            "127.0.0.1:-1",
                            "127.0.0.1:",
                            "127.0.0.1:80x",
                            "127.0.0.1:+1",
                            "localhost:",
                            "example.com:80",
                            "127.0.0.1:80:80",
                            "::1",
                            "[::1",
                            "[::1]x",
                            "[::1]:",
                            "[]:80",
                            " 8080",
                            "127.0.0.1 :80",
                            "http://127.0.0.1:80"})
    EXPECT_THROW(WebServer(where, site), std::invalid_argument) << where;
}

}  // namespace web_server_test
