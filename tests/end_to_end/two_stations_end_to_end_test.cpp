// Two daemons in two network namespaces, the operator's station and the robot's, with a bad network between
// them. In real time on a machine that may be busy: the test waits for states, and a start that came to
// nothing because something was late is repeated.
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "tests/end_to_end/daemon.h"
#include "tests/support/built_paths.h"
#include "tests/support/process.h"
#include "tests/support/skip.h"
#include "tests/support/spawn.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/veth.h"

namespace end_to_end {
namespace two_stations_end_to_end_test {

/// The longest silence that can be configured, and a quick start-up.
constexpr const char* kRobot = R"(role = "robot"
[loop]
command_timeout_s = 2.0
commander_timeout_s = 5.0
[ethercat]
kind = "base+arm"
[haptic]
ramp_in_s = 0.1
command_timeout_s = 0.1
[link]
listen = "10.77.0.2:7777"
key_file = "key"
silence_s = 0.5
[limits]
force_N = 60
moment_Nm = 20
[teleoperation.start]
unfolding_rad_per_s = 1.0
approach_s = 4
feedback_fade_s = 0.2
lowering_s = 1
[teleoperation.coupling]
stiffening_N_per_m_s = 6000
stiffening_Nm_per_rad_s = 300
)";
std::string operator_config(const std::string& key) {
  return "role = \"operator\"\n[link]\npeer = \"127.0.0.1:7000\"\nsilence_s = 0.5\nkey_file = \"" + key +
         "\"\n";
}

bool shell(const std::string& command) { return std::system(command.c_str()) == 0; }

struct TwoStationsEndToEnd : testing::Test {
  void SetUp() override {
    SKIP_UNLESS(namespaces.usable(), "needs root and network namespaces");
    const std::string there = "ip -n " + namespaces.sim_namespace();
    const std::string here = "ip -n " + namespaces.control_namespace();
    ASSERT_TRUE(shell(there + " link set lo up") && shell(there + " addr add 10.77.0.1/24 dev veth-s") &&
                shell(here + " addr add 10.77.0.2/24 dev veth-c"));
    for (const char* key : {"key", "other-key"})
      ASSERT_EQ(support::spawn({support::program("youbotd"), "--make-key", folder / key}).exit_code, 0);
  }
  std::vector<std::string> at_operator(std::vector<std::string> words) const {
    words.insert(words.begin(), {"/usr/bin/env", "ip", "netns", "exec", namespaces.sim_namespace()});
    return words;
  }
  std::vector<std::string> operator_station(const std::string& key) const {
    return at_operator(
        {support::program("youbotd"), "--config", folder.write(key + ".toml", operator_config(key))});
  }
  /// False if it did not come to operation however often it was enabled.
  static bool enable(Daemon& robot) {
    for (int attempt = 0; attempt < 6; ++attempt) {
      if (!robot.enable()) continue;
      const json now = robot.wait_until(
          [](const json& status) { return status["phase"] == "operating" || status["enabled"] == false; });
      if (now.value("phase", "") == "operating") return true;
      std::printf("not in operation: %s\n", now.value("fault", "").c_str());
    }
    return false;
  }

  static bool is_silence(const json& status) {
    return status.value("fault", "").find("the operator's station was silent") != std::string::npos;
  }

  const support::Namespaces namespaces;
  const support::TemporaryDirectory folder;
};

TEST_F(TwoStationsEndToEnd, ABadNetworkIsToleratedASilenceStopsTheRobotAndOnlyTheKeyMovesIt) {
  support::Process relay(at_operator({support::udp_relay(), "7000", "10.77.0.2", "7777", "1"}));
  ASSERT_TRUE(relay.wait_for("relaying"));
  const auto network = [&relay](const std::string& conditions) {
    return relay.say(conditions) && relay.wait_for("now " + conditions);
  };
  ASSERT_TRUE(network("60 50 0.05 0.01"));
  Daemon robot(folder.path(), folder.write("robot.toml", kRobot), {});
  ASSERT_TRUE(robot.process().wait_for("waiting for commands")) << robot.process().finish().output;

  {
    // Another key: every message arrives, and none counts.
    support::Process stranger(operator_station("other-key"));
    ASSERT_TRUE(stranger.wait_for("looking for the robot's station"));
    const json now = robot.wait_until([](const json& status) { return status["link"]["refused"] > 20; });
    EXPECT_GT(now["link"]["refused"], 20);
    EXPECT_EQ(now["link"]["connected"], false);
    EXPECT_EQ(now["link"]["sessions"], 0);
  }

  support::Process station(operator_station("key"));
  ASSERT_TRUE(station.wait_for("found")) << station.output();
  ASSERT_TRUE(enable(robot));
  // The loss is known after a thousand messages.
  const json operating = robot.wait_until([](const json& status) {
    const json& link = status["link"];
    return link["repeated"] > 0 && link["late"] > 0 && link["connected"] == true;
  });
  EXPECT_EQ(operating["link"]["connected"], true);
  // Twice the least delay: the newest messages are those that overtook others.
  EXPECT_GE(operating["link"]["round_trip_s"], 0.02);
  EXPECT_GT(operating["link"]["lost"], 0.01);
  EXPECT_GT(operating["link"]["late"], 0) << "nothing was overtaken";

  // A loaded machine may stop it for another reason, before the silence.
  json stopped;
  for (int attempt = 0; attempt < 6; ++attempt) {
    if (attempt > 0) {
      ASSERT_TRUE(network("heard"));
      ASSERT_TRUE(enable(robot));
    }
    ASSERT_TRUE(network("silent"));
    stopped = robot.wait_until([](const json& status) { return status["enabled"] == false; });
    if (is_silence(stopped)) break;
    std::printf("stopped before the silence: %s\n", stopped.value("fault", "").c_str());
  }
  EXPECT_TRUE(is_silence(stopped)) << stopped.value("fault", "");
  ASSERT_TRUE(station.wait_for("is silent: the force is off"));

  // The link comes back by itself, the motion does not.
  ASSERT_TRUE(network("heard"));
  ASSERT_TRUE(station.wait_for("found"));
  const json back = robot.wait_until([](const json& status) { return status["link"]["connected"] == true; });
  EXPECT_EQ(back["link"]["connected"], true);
  EXPECT_EQ(back["enabled"], false);
  EXPECT_EQ(back["phase"], "faulted");
  (void)robot.commander_ended();

  ASSERT_TRUE(enable(robot));
  EXPECT_EQ(robot.tell({"stop"}).exit_code, 0);
  const support::CommandResult commander = robot.commander_ended();
  for (const char* state : {"centring", "unfolding", "approaching"})
    EXPECT_TRUE(commander.said(state)) << "it began without " << state << ": " << commander.output;

  station.signal(SIGTERM);
  const support::CommandResult ended = station.finish();
  EXPECT_EQ(ended.exit_code, 0) << ended.output;
  EXPECT_TRUE(ended.said("operator's station")) << ended.output;
  robot.process().signal(SIGTERM);
  EXPECT_EQ(robot.process().finish().exit_code, 0);
}

}  // namespace two_stations_end_to_end_test
}  // namespace end_to_end
