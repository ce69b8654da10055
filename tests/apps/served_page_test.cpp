// The page of a running service: what its clients may do, and what happens when they vanish. The loop is slow
// and has long time-outs, so that a busy machine only takes longer.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "tests/support/built_paths.h"
#include "tests/support/process.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/web_client.h"

namespace served_page_test {

using nlohmann::json;
using support::Process;
using support::WebClient;

struct ServedPage : testing::Test {
  void SetUp() override {
    ASSERT_TRUE(youbotd.wait_for("page with commands: "));
    const std::string& output = youbotd.output();
    token = output.substr(output.rfind("#token=") + 7, 32);
    port = support::port_of(
        output.substr(output.rfind("http://"), output.rfind("/#token") - output.rfind("http://")));
    ASSERT_TRUE(youbotd.wait_for("waiting for commands"));
  }
  static json ask(WebClient& control, const std::string& request) {
    control.say_frame(WebClient::kText, request);
    const auto answer = control.hear_message();
    return answer ? json::parse(answer->payload) : json();
  }
  /// Enabled in the mode velocity, by a client with the token.
  void enable(WebClient& control) const {
    ASSERT_EQ(control.open("/control").status, 101);
    ASSERT_EQ(ask(control, "token " + token)["ok"], true);
    ASSERT_EQ(ask(control, "mode velocity")["ok"], true);
    const json enabled = ask(control, "enable");
    ASSERT_EQ(enabled["ok"], true) << enabled;
    ASSERT_EQ(enabled["status"]["enabled"], true);
  }
  /// Asks without the token until the robot is off; the test hangs otherwise.
  void wait_for_rest() const {
    WebClient other(port);
    ASSERT_EQ(other.open("/control").status, 101);
    while (ask(other, "status").at("status").at("enabled") == true) {
    }
  }

  support::TemporaryDirectory folder;
  Process youbotd{
      {support::program("youbotd"), "--config",
       folder.write("base.toml",
                    "[loop]\nperiod_s = 0.01\ncommand_timeout_s = 2.0\ncommander_timeout_s = 10.0\n"
                    "[compensation]\nfilter_cutoff_rad_per_s = 50\n[path]\nspeed_m_per_s = "
                    "0.2\n[[path.leg]]\nforward_m = 0.1\n"),
       "--control", folder / "s", "--allow-non-rt", "--page", "localhost:0"}};
  std::string token;
  std::uint16_t port = 0;
};

TEST_F(ServedPage, WithoutTheTokenAPageMayLookAndStop) {
  WebClient watcher(port);
  ASSERT_EQ(watcher.open("/control").status, 101);
  EXPECT_EQ(ask(watcher, "status")["ok"], true);
  for (const char* refused :
       {"enable", "mode velocity", "disable", "acknowledge", "set limits.force_N 1", "unset x"}) {
    const json answer = ask(watcher, refused);
    EXPECT_EQ(answer["ok"], false) << refused;
    EXPECT_NE(answer["error"].get<std::string>().find("may look and stop"), std::string::npos) << answer;
  }
  WebClient commander(port);
  enable(commander);
  EXPECT_EQ(ask(watcher, "stop")["ok"], true);
  wait_for_rest();
}

TEST_F(ServedPage, AStopByHttpNeedsNoToken) {
  WebClient commander(port);
  enable(commander);
  EXPECT_EQ(WebClient(port).ask("POST", "/stop", "Content-Length: 0\r\n").status, 202);
  wait_for_rest();
  EXPECT_TRUE(youbotd.wait_for("requested by the page at 127.0.0.1:"));
}

TEST_F(ServedPage, TheRobotComesToRestWhenThePageThatCommandsVanishes) {
  std::optional<WebClient> commander(std::in_place, port);
  enable(*commander);
  commander.reset();
  wait_for_rest();
  EXPECT_TRUE(youbotd.wait_for("is gone"));
}

TEST_F(ServedPage, OnePageCommandsAndAnotherWithTheTokenDoesNot) {
  WebClient commander(port);
  enable(commander);
  WebClient second(port);
  ASSERT_EQ(second.open("/control").status, 101);
  ASSERT_EQ(ask(second, "token " + token)["ok"], true);
  EXPECT_EQ(ask(second, "set velocity 0.1 0 0")["ok"], false);
  EXPECT_EQ(ask(commander, "set velocity 0.1 0 0")["ok"], true);
  second.say_frame(WebClient::kClose, "");
  EXPECT_EQ(ask(commander, "alive")["status"]["enabled"], true) << "the end of another page stops nothing";
}

}  // namespace served_page_test
