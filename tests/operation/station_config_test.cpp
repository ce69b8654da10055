// role and [link] of the daemon's configuration.
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <string>

#include "operation/config.h"
#include "runtime/configuration/toml_reader.h"
#include "tests/support/temporary_directory.h"

namespace operation {
namespace station_config_test {

using namespace std::chrono_literals;

struct StationConfig : testing::Test {
  Config load(const std::string& text) const { return load_config(folder.write("c.toml", text)); }
  void refused(const std::string& text, const std::string& reason) const {
    try {
      (void)load(text);
      ADD_FAILURE() << text << " was read";
    } catch (const runtime::ConfigError& error) {
      EXPECT_NE(std::string(error.what()).find(reason), std::string::npos) << error.what();
    }
  }
  const support::TemporaryDirectory folder;
};

TEST_F(StationConfig, OneComputerIsTheDefault) {
  const Config config = load("robot = \"loopback\"\n");
  EXPECT_EQ(config.role, runtime::Role::kBoth);
  EXPECT_FALSE(config.teleoperated);
  EXPECT_EQ(load("role = \"both\"\n").role, runtime::Role::kBoth);
}

TEST_F(StationConfig, TheRobotsStationIsTeleoperatedByTheOperators) {
  const Config config = load(
      "role = \"robot\"\n[link]\nlisten = \"0.0.0.0:7777\"\nkey_file = \"link.key\"\nsilence_s = 0.3\n"
      "redundancy_max = 2\npassivity = false\nreserve_J = 0.01\nsurplus_J = 0.2\ndamping_N_s_per_m = 4\n");
  EXPECT_EQ(config.role, runtime::Role::kRobot);
  EXPECT_TRUE(config.teleoperated);
  EXPECT_EQ(config.haptic.name, runtime::kRemoteHaptic);
  const runtime::LinkOptions& link = config.haptic.link;
  EXPECT_EQ(link.listen, "0.0.0.0:7777");
  EXPECT_EQ(link.key_file, folder / "link.key") << "beside the configuration";
  EXPECT_EQ(link.endpoint.silence, 300ms);
  EXPECT_EQ(link.endpoint.most_repeated, 2);
  EXPECT_FALSE(link.port.active);
  EXPECT_EQ(link.port.tank.reserve_J, 0.01);
  EXPECT_EQ(link.port.surplus_J, 0.2);
  EXPECT_EQ(link.port.tank.damping_N_s_per_m, 4);
}

TEST_F(StationConfig, TheOperatorsStationHasADevice) {
  const Config config = load(
      "role = \"operator\"\n[haptic]\ndevice = \"omega.6\"\n[link]\npeer = \"robot.local:7777\"\n"
      "key_file = \"/etc/link.key\"\n");
  EXPECT_EQ(config.role, runtime::Role::kOperator);
  EXPECT_EQ(config.haptic.name, "omega.6");
  EXPECT_EQ(config.haptic.link.peer, "robot.local:7777");
  EXPECT_EQ(config.haptic.link.key_file, "/etc/link.key");
}

TEST_F(StationConfig, NoStationListensWithoutAKey) {
  refused("role = \"robot\"\n[link]\nlisten = \"127.0.0.1:7777\"\n", "key_file");
  refused("role = \"operator\"\n[link]\npeer = \"127.0.0.1:7777\"\n", "key_file");
}

TEST_F(StationConfig, WhatARoleLacksOrCannotHaveIsNamed) {
  refused("role = \"robot\"\n[link]\nkey_file = \"k\"\n", "listen");
  refused("role = \"operator\"\n[link]\nkey_file = \"k\"\n", "peer");
  refused("role = \"robot\"\n[haptic]\ndevice = \"falcon\"\n[link]\nlisten = \"a:1\"\nkey_file = \"k\"\n",
          "haptic.device");
  refused("role = \"spectator\"\n", "role");
  refused("[link]\nsilence_s = 0.6\n", "silence_s");
  refused("[link]\nredundancy_max = 9\n", "redundancy_max");
  refused("[link]\nport = 7777\n", "port");
}

}  // namespace station_config_test
}  // namespace operation
