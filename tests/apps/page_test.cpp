// The page of youbotd, as a browser and other programs meet it, and its requests on their way to a service.
#include "apps/youbotd/page.h"
#include "apps/youbotd/freshness.h"

#include <gtest/gtest.h>
#include <poll.h>

#include <array>
#include <filesystem>
#include <limits>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "apps/youbotd/page_requests.h"
#include "runtime/program/control_socket.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/web_client.h"

namespace page_test {

using nlohmann::json;
using support::port_of;
using support::WebClient;
using youbotd::Page;
using youbotd::PageRequests;
using youbotd::Peer;

/// Notes what the page asks, and answers at once.
struct FakeCommands final : Page::Commands {
  void ask(const Peer& peer, const std::string& request, Page::Reply reply) override {
    {
      const std::lock_guard lock(mutex);
      asked.emplace_back(peer, request);
    }
    reply("answer to " + request);
  }
  void stop(const std::string& who) override {
    const std::lock_guard lock(mutex);
    stops.push_back(who);
  }
  void gone(const Peer& peer) override {
    const std::lock_guard lock(mutex);
    left.push_back(peer);
  }
  template <typename Value>
  Value get(const Value& value) {
    const std::lock_guard lock(mutex);
    return value;
  }

  std::mutex mutex;
  std::vector<std::pair<Peer, std::string>> asked;
  std::vector<std::string> stops;
  std::vector<Peer> left;
};

struct PageTest : testing::Test {
  std::string token() const {
    const std::string url = page.command_url();
    return url.substr(url.find("#token=") + 7);
  }
  json info() { return json::parse(WebClient(port).ask("GET", "/info.json").body); }
  static std::string ask(WebClient& control, const std::string& request) {
    control.say_frame(WebClient::kText, request);
    const auto answer = control.hear_message();
    return answer ? answer->payload : "";
  }

  support::TemporaryDirectory folder;
  hal::SteadyClock feed_clock;
  operation::LiveFeed feed{feed_clock};
  FakeCommands commands;
  Page page{{.where = "localhost:0",
             .commanded = true,
             .checks = {{.mark = youbotd::Finding::Mark::kOk, .found = "fine"},
                        {.mark = youbotd::Finding::Mark::kFail, .found = "broken", .remedy = "mend it"}}},
            feed,
            commands};
  std::uint16_t port = port_of(page.url());
};

TEST_F(PageTest, ServesItsFiles) {
  WebClient client(port);
  for (const char* path : {"/", "/page.css", "/page.js", "/stream.js", "/robot.js", "/plots.js", "/three.js",
                           "/orbit.js", "/three-license.txt", "/dygraph.js", "/dygraph.css", "/robot.urdf"}) {
    const auto file = client.ask("GET", path);
    EXPECT_EQ(file.status, 200) << path;
    EXPECT_FALSE(file.body.empty()) << path;
  }
  for (const char* path : {"/no-such-file", "//", "/../etc/passwd", "/%2e%2e/etc/passwd", "/page.js/"})
    EXPECT_EQ(client.ask("GET", path).status, 404) << path;
}

TEST_F(PageTest, EveryoneMayStopAndNothingElseTakesAPost) {
  WebClient client(port);
  EXPECT_EQ(client.ask("POST", "/enable", "Content-Length: 0\r\n").status, 404);
  EXPECT_EQ(client.ask("GET", "/stop").status, 404) << "no link or image stops it";
  EXPECT_EQ(client.ask("POST", "/stop", "Content-Length: 0\r\nOrigin: http://evil.example\r\n").status, 403);
  EXPECT_TRUE(commands.get(commands.stops).empty());
  EXPECT_EQ(client.ask("POST", "/stop", "Content-Length: 0\r\n").status, 202);
  EXPECT_EQ(
      client.ask("POST", "/stop", "Content-Length: 0\r\nOrigin: http://" + client.host() + "\r\n").status,
      202);
  const auto stops = commands.get(commands.stops);
  ASSERT_EQ(stops.size(), 2U);
  EXPECT_TRUE(stops[0].starts_with("the page at 127.0.0.1:")) << stops[0];
}

TEST_F(PageTest, ItsInformationIsJsonWithoutNumbersThatJsonLacks) {
  std::array<hal::JointInfo, 1> joints;
  joints[0].name = "wheel_1";
  joints[0].torque_limit_Nm = 2;
  joints[0].rated_torque_Nm = 1.5;
  joints[0].speed_limit_rad_per_s = std::numeric_limits<double>::infinity();
  page.set_joints(joints);
  json now = info();
  while (now["joints"].empty()) now = info();
  EXPECT_EQ(now["joints"][0]["name"], "wheel_1");
  EXPECT_EQ(now["joints"][0]["torque_limit_Nm"], 1.5) << "the smaller one";
  EXPECT_TRUE(now["joints"][0]["speed_limit_rad_per_s"].is_null());
  EXPECT_EQ(now["commanded"], true);
  EXPECT_EQ(now["teleoperated"], false);
  EXPECT_EQ(now["columns"][0], "time_s");
  EXPECT_EQ(now["checks"], json::parse(R"([{"mark": "fail", "found": "broken", "remedy": "mend it"}])"));
}

TEST_F(PageTest, TheTokenIsNowhereOnThePage) {
  ASSERT_EQ(token().size(), 32U) << "128 bits";
  WebClient client(port);
  for (const char* path : {"/", "/info.json", "/page.js"})
    EXPECT_EQ(client.ask("GET", path).body.find(token()), std::string::npos) << path;
  FakeCommands others;
  const Page second({.where = "localhost:0"}, feed, others);
  EXPECT_EQ(second.command_url().find(token()), std::string::npos) << "each start has its own";
}

TEST_F(PageTest, OnlyTheTokenGivesTheRightToCommand) {
  WebClient control(port);
  ASSERT_EQ(control.open("/control").status, 101);
  EXPECT_EQ(ask(control, "enable"), "answer to enable") << "the service judges it, by may_command";
  for (const std::string& wrong :
       {std::string(), std::string(32, '0'), token().substr(1), token() + "0", token() + "\n", " " + token()})
    EXPECT_EQ(json::parse(ask(control, "token " + wrong))["ok"], false) << wrong;
  ask(control, "enable");
  EXPECT_EQ(json::parse(ask(control, "token " + token()))["ok"], true);
  ask(control, "enable");
  const auto asked = commands.get(commands.asked);
  ASSERT_EQ(asked.size(), 3U) << "no token is passed on";
  EXPECT_FALSE(asked[0].first.may_command);
  EXPECT_FALSE(asked[1].first.may_command);
  EXPECT_TRUE(asked[2].first.may_command);
  EXPECT_EQ(asked[0].first.connection, asked[2].first.connection);
  EXPECT_TRUE(asked[0].first.name.starts_with("the page at 127.0.0.1:")) << asked[0].first.name;

  WebClient other(port);
  ASSERT_EQ(other.open("/control").status, 101);
  ask(other, "status");
  EXPECT_FALSE(commands.get(commands.asked).back().first.may_command) << "the right is of one connection";
  EXPECT_NE(commands.get(commands.asked).back().first.connection, asked[0].first.connection);
}

TEST_F(PageTest, APageOfAnotherSiteGetsNoCommands) {
  WebClient control(port);
  EXPECT_EQ(control.open("/control", "Origin: http://evil.example\r\n").status, 404);
  EXPECT_EQ(control.open("/control", "Origin: null\r\n").status, 404);
  EXPECT_EQ(control.open("/control", "Origin: http://" + control.host() + "\r\n").status, 101);
}

TEST_F(PageTest, TooLongARequestIsRefused) {
  WebClient control(port);
  ASSERT_EQ(control.open("/control").status, 101);
  EXPECT_EQ(json::parse(ask(control, std::string(runtime::kLongestRequest + 1, 'x')))["ok"], false);
  EXPECT_EQ(json::parse(ask(control, ""))["ok"], false);
  EXPECT_TRUE(commands.get(commands.asked).empty());
  const std::string longest(runtime::kLongestRequest, 'x');
  EXPECT_EQ(ask(control, longest), "answer to " + longest);
}

TEST_F(PageTest, AVanishedPageIsReported) {
  {
    WebClient control(port);
    ASSERT_EQ(control.open("/control").status, 101);
    ask(control, "enable");
  }
  while (commands.get(commands.left).empty()) {  // the test hangs otherwise
  }
  EXPECT_EQ(commands.get(commands.left)[0].connection, commands.get(commands.asked)[0].first.connection);
}

TEST_F(PageTest, TheFilesOfAFaultAreThoseOfItsReport) {
  WebClient client(port);
  EXPECT_EQ(client.ask("GET", "/fault-report").status, 404) << "before the first status";
  const std::string csv = folder.write("fault-1.csv", "time_s\n1\n");
  (void)folder.write("fault-1.pcapng", "frames");
  page.publish_status({{"fault_report", csv}});
  std::filesystem::remove(csv);
  const auto report = client.ask("GET", "/fault-report");  // answered after the status
  EXPECT_EQ(report.status, 200);
  EXPECT_EQ(report.body, "time_s\n1\n");
  EXPECT_EQ(report.header("Content-Disposition"), "attachment; filename=\"fault-1.csv\"");
  EXPECT_EQ(client.ask("GET", "/fault-report.pcapng").body, "frames");

  constexpr std::uintmax_t kMax = std::uintmax_t{4} << 20;  // as in docs/bounds.md
  for (const auto& [name, size, status] :
       {std::tuple{"largest.csv", kMax, 200}, {"larger.csv", kMax + 1, 404}}) {
    const std::string path = folder.write(name, "");
    std::filesystem::resize_file(path, size);
    page.publish_status({{"fault_report", path}});
    EXPECT_EQ(client.ask("GET", "/fault-report").status, status) << name;
    EXPECT_EQ(client.ask("GET", "/fault-report.pcapng").status, 404) << "this robot has no bus";
  }
  std::filesystem::create_directory(folder / "directory");
  page.publish_status({{"fault_report", (folder / "directory").string()}});
  EXPECT_EQ(client.ask("GET", "/fault-report").status, 404);
}

TEST_F(PageTest, StreamsItsStatusToAClientOfEitherName) {
  for (const std::string name : {"foxglove.sdk.v1", "foxglove.websocket.v1"}) {
    WebClient client(port);
    // From a page of Foxglove, too: reading needs no token.
    const auto opened =
        client.open("/", "Origin: https://app.foxglove.dev\r\nSec-WebSocket-Protocol: " + name + "\r\n");
    EXPECT_EQ(opened.status, 101);
    EXPECT_EQ(opened.header("Sec-WebSocket-Protocol"), name);
    const auto server_info = client.hear_message();
    ASSERT_TRUE(server_info);
    EXPECT_EQ(json::parse(server_info->payload)["op"], "serverInfo");
    const auto advertise = client.hear_message();
    ASSERT_TRUE(advertise);
    const json message = json::parse(advertise->payload);
    for (const json& channel : message["channels"])
      if (channel["topic"] == "/youbot/status")
        client.say_frame(
            WebClient::kText,
            json{{"op", "subscribe"}, {"subscriptions", {{{"id", 1}, {"channelId", channel["id"]}}}}}.dump());
    const auto status = client.hear_message();
    ASSERT_TRUE(status);
    EXPECT_TRUE(json::parse(status->payload.substr(13)).contains("cycle_us"));
  }
  WebClient unknown(port);
  EXPECT_EQ(unknown.open("/", "Sec-WebSocket-Protocol: foxglove.sdk.v9\r\n").status, 404);
}

TEST(PageStop, APageEndsWithOpenCommands) {
  hal::SteadyClock feed_clock;
  operation::LiveFeed feed{feed_clock};
  FakeCommands commands;
  auto page = std::make_unique<Page>(Page::Options{.where = "localhost:0"}, feed, commands);
  WebClient control(port_of(page->url()));
  ASSERT_EQ(control.open("/control").status, 101);
  control.say_frame(WebClient::kText, "status");
  ASSERT_TRUE(control.hear_message());
  page.reset();
  EXPECT_EQ(commands.left.size(), 1U);
}

/// What a service would hear.
struct Heard final : youbotd::ControlServer::Listener {
  std::string answer(const Peer& peer, const std::string& request) override {
    heard.push_back(peer.name + ": " + request);
    return "answer to " + request;
  }
  void gone(const Peer& peer) override { heard.push_back(peer.name + " is gone"); }
  bool commands(const Peer& /*peer*/) const override { return false; }
  std::vector<std::string> heard;
};

struct PageRequestsTest : testing::Test {
  void ask(const std::string& request) {
    requests.ask(peer, request, [this](std::string answer) { answers.push_back(std::move(answer)); });
  }
  bool awake() const {
    pollfd wake{requests.wake_descriptor(), POLLIN, 0};
    return poll(&wake, 1, 0) == 1;
  }
  PageRequests requests;
  Heard service;
  Peer peer{.connection = 1, .name = "page", .may_command = true};
  std::vector<std::string> answers;
};

TEST_F(PageRequestsTest, ArriveInOrderAndWakeTheService) {
  EXPECT_FALSE(awake());
  ask("status");
  ask("alive");
  EXPECT_TRUE(awake());
  EXPECT_TRUE(answers.empty());
  requests.deliver(service);
  EXPECT_FALSE(awake());
  EXPECT_EQ(service.heard, (std::vector<std::string>{"page: status", "page: alive"}));
  EXPECT_EQ(answers, (std::vector<std::string>{"answer to status", "answer to alive"}));
  requests.deliver(service);
  EXPECT_EQ(service.heard.size(), 2U) << "once";
}

TEST_F(PageRequestsTest, AStopComesFirstAndWhatWasAskedBeforeItIsOutdated) {
  ask("enable");
  requests.stop("another page");
  ask("status");
  EXPECT_TRUE(awake());
  requests.deliver(service);
  EXPECT_EQ(service.heard, (std::vector<std::string>{"another page: stop", "page: status"}))
      << "an enable after the stop would move the robot again";
  ASSERT_EQ(answers.size(), 2U);
  EXPECT_EQ(json::parse(answers[0])["ok"], false);
  ask("enable");
  requests.deliver(service);
  EXPECT_EQ(service.heard.back(), "page: enable") << "a later one counts";
}

TEST_F(PageRequestsTest, AStopOutdatesAnEnableHoweverItIsWritten) {
  for (const char* request : {"enable ", " enable", "enable now", "\tenable\n", "set", "acknowledge\v"})
    ask(request);
  requests.stop("another page");
  requests.deliver(service);
  EXPECT_EQ(service.heard, (std::vector<std::string>{"another page: stop"}));
}

TEST_F(PageRequestsTest, AStopOutdatesOnlyWhatCanMove) {
  for (const char* request : {"enable", "disable", "alive", "set velocity 1 0 0", "status"}) ask(request);
  requests.stop("another page");
  requests.deliver(service);
  EXPECT_EQ(service.heard,
            (std::vector<std::string>{"another page: stop", "page: disable", "page: alive", "page: status"}));
}

TEST_F(PageRequestsTest, AStopOverTheControlConnectionHasThePlaceOfAStop) {
  for (std::size_t i = 0; i < youbotd::kMaxPageRequests; ++i) ask("alive");
  ask("stop");
  EXPECT_EQ(json::parse(answers.back())["ok"], true);
  requests.deliver(service);
  EXPECT_EQ(service.heard.front(), "page: stop");
}

TEST(Freshness, WhatFollowsALongSilenceMayHaveWaited) {
  using std::chrono::milliseconds;
  youbotd::Freshness freshness;
  const youbotd::Freshness::Time begin{milliseconds(10'000)};
  EXPECT_TRUE(freshness.hear(begin)) << "the first message of a connection";
  EXPECT_TRUE(freshness.hear(begin + milliseconds(500)));
  EXPECT_FALSE(freshness.hear(begin + milliseconds(1001)));
  EXPECT_FALSE(freshness.hear(begin + milliseconds(1500))) << "delivered together with it";
  EXPECT_TRUE(freshness.hear(begin + milliseconds(1501)));
}

TEST_F(PageRequestsTest, OnePageLeavesRoomForTheOthers) {
  for (int i = 0; i < youbotd::kMaxRequestsOfAPage; ++i) ask("status");
  EXPECT_TRUE(answers.empty());
  ask("one more");
  ASSERT_EQ(answers.size(), 1U);
  EXPECT_EQ(json::parse(answers[0])["ok"], false);
  peer.connection = 2;
  ask("alive");
  requests.deliver(service);
  EXPECT_EQ(service.heard.back(), "page: alive");
}

TEST_F(PageRequestsTest, OneTooManyIsRefusedAndAStopIsNot) {
  for (std::size_t i = 0; i < youbotd::kMaxPageRequests; ++i) {
    peer.connection = 1 + i / youbotd::kMaxRequestsOfAPage;
    ask("status");
  }
  EXPECT_TRUE(answers.empty());
  ++peer.connection;
  ask("one more");
  ASSERT_EQ(answers.size(), 1U);
  EXPECT_EQ(json::parse(answers[0])["ok"], false);
  requests.stop("another page");
  requests.gone(peer);
  requests.deliver(service);
  EXPECT_EQ(service.heard.front(), "another page: stop");
  EXPECT_EQ(service.heard.back(), "page is gone");
  EXPECT_EQ(answers.size(), youbotd::kMaxPageRequests + 1);
  ask("status");
  requests.deliver(service);
  EXPECT_EQ(answers.back(), "answer to status") << "there is room again";
}

}  // namespace page_test
