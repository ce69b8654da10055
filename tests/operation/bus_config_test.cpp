// The bus configuration: [ethercat] and [can].
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "hal/youbot_axes.h"
#include "operation/config.h"
#include "runtime/configuration/can_config.h"
#include "runtime/configuration/ethercat_config.h"
#include "runtime/configuration/toml_reader.h"
#include "tests/support/temporary_directory.h"

namespace operation {
namespace bus_config_test {

struct BusConfig : testing::Test {
  hal::CanOptions can(const std::string& text) { return load_config(write(text)).robot.can; }
  /// Without the directory.
  std::vector<std::string> problems(const std::string& text) {
    try {
      (void)load_config(write(text));
    } catch (const runtime::ConfigError& error) {
      std::vector<std::string> all = error.problems();
      for (std::string& problem : all) problem.erase(0, directory.path().string().size() + 1);
      return all;
    }
    return {};
  }
  std::filesystem::path write(const std::string& text) const {
    return directory.write("lab.toml", text.empty() ? "robot = \"loopback\"\n" : text);
  }
  support::TemporaryDirectory directory;
};

TEST_F(BusConfig, ABenchRigIsWhatItsTableSays) {
  const hal::CanOptions said =
      can("[can]\njoint = \"arm-4\"\nmodule_id = 5\nreply_id = 6\nmotor = 1\nbitrate_bit_per_s = 250000\n"
          "requests_per_cycle = 1\npatience_cycles = 4\ntolerated_cycles = 20\nunsigned_current = true\n");
  EXPECT_EQ(said.joint_name, "arm-4");
  EXPECT_EQ(said.axis.constants.gear_ratio, hal::kArmAxes[3].constants.gear_ratio);
  EXPECT_EQ(said.module_id, 5U);
  EXPECT_EQ(said.reply_id, 6U);
  EXPECT_EQ(said.motor, 1);
  EXPECT_EQ(said.bitrate_bit_per_s, 250'000U);
  EXPECT_EQ(said.requests_per_cycle, 1);
  EXPECT_EQ(said.patience_cycles, 4);
  EXPECT_EQ(said.tolerated_cycles, 20);
  EXPECT_TRUE(said.unsigned_current);
  EXPECT_EQ(runtime::can_text(can(runtime::can_text(said))), runtime::can_text(said));
  EXPECT_EQ(runtime::can_text(can("")), runtime::can_text({}));
  EXPECT_EQ(can("[can]\njoint = \"wheel-3\"\n").axis.current_limit_A, hal::kWheelAxis.current_limit_A);
}

TEST_F(BusConfig, TheJointOnARigMayHaveLimitsOfItsOwn) {
  const hal::CanOptions youbots = can("[can]\njoint = \"arm-2\"\n");
  EXPECT_EQ(youbots.axis.rated_torque_Nm, 9.5);
  EXPECT_EQ(youbots.axis.range.upper_rad, hal::kArmAxes[1].range.upper_rad);
  EXPECT_FALSE(youbots.range_is_stated);
  const hal::CanOptions said =
      can("[can]\njoint = \"arm-2\"\nrated_torque_Nm = 4.5\nspeed_limit_rad_per_s = 1\nrange_rad = [-0.5, "
          "0.25]\n");
  EXPECT_EQ(said.axis.rated_torque_Nm, 4.5);
  EXPECT_EQ(said.axis.speed_limit_rad_per_s, 1);
  EXPECT_EQ(said.axis.range.lower_rad, -0.5);
  EXPECT_EQ(said.axis.range.upper_rad, 0.25);
  EXPECT_TRUE(said.range_is_stated);
  EXPECT_EQ(runtime::can_text(can(runtime::can_text(said))), runtime::can_text(said));
  EXPECT_EQ(
      problems("[can]\nrange_rad = [1, 0]\n"),
      std::vector<std::string>{"lab.toml:2: 'can.range_rad' must be [lower, upper], the lower one first"});
}

TEST_F(BusConfig, WhatNoModuleCanBeIsRefusedWithItsLine) {
  EXPECT_EQ(problems("[can]\njoint = \"elbow\"\nmodule_id = 2048\nreply_id = 1\nrequests_per_cycle = 6\n"
                     "bitrate_bit_per_s = 2000000\nmodul_id = 2\n"),
            (std::vector<std::string>{
                "lab.toml:2: 'can.joint' = 'elbow' is none of wheel-1 to wheel-4 and arm-1 to arm-5",
                "lab.toml:3: 'can.module_id' is 2048, allowed is 1 to 2047",
                "lab.toml:5: 'can.requests_per_cycle' is 6, allowed is 1 to 5",
                "lab.toml:6: 'can.bitrate_bit_per_s' is 2000000, allowed is 0 to 1000000",
                "lab.toml:7: unknown key 'can.modul_id': did you mean 'module_id'?"}));
}

TEST_F(BusConfig, OneIdentifierForRequestsAndRepliesIsRefusedWithTheDefaults) {
  const auto refused = [](const std::string& where) {
    return std::vector<std::string>{
        "lab.toml:" + where + ", too: requests and replies need one each; without the keys they are 1 and 2"};
  };
  EXPECT_EQ(problems("[can]\nmodule_id = 2\n"), refused("2: 'can.module_id' = 2 is 'can.reply_id'"));
  EXPECT_EQ(problems("[can]\njoint = \"arm-1\"\nreply_id = 1\n"),
            refused("3: 'can.reply_id' = 1 is 'can.module_id'"));
  EXPECT_EQ(problems("[can]\nmodule_id = 7\nreply_id = 7\n"),
            refused("3: 'can.reply_id' = 7 is 'can.module_id'"));
  EXPECT_EQ(problems("[can]\nmodule_id = 3000\nreply_id = 1\n"),
            std::vector<std::string>{"lab.toml:2: 'can.module_id' is 3000, allowed is 1 to 2047"});
  EXPECT_EQ(problems("[can]\nmodule_id = 2\nreply_id = 0\n"),
            std::vector<std::string>{"lab.toml:3: 'can.reply_id' is 0, allowed is 1 to 2047"});
}

TEST_F(BusConfig, LossesWarnBeforeTheyStopAndOneBridgeDoesNeither) {
  EXPECT_EQ(
      problems("[ethercat]\nloss_warning = 0.3\n"),
      std::vector<std::string>{
          "lab.toml:2: 'ethercat.loss_warning' = 0.3 comes after 'ethercat.loss_fault' = 0.2: lower it"});
  EXPECT_EQ(
      problems("[ethercat]\nloss_fault = 0.05\ntolerated_cycles = 50\n"),
      std::vector<std::string>{"lab.toml:2: 'ethercat.loss_fault' = 0.05 of the last 1000 cycles is a fault "
                               "before 50 in a row are: raise it, or lower 'ethercat.tolerated_cycles'"});
  EXPECT_EQ(problems("[ethercat]\nloss_fault = 1.5\nloss_warning = 0\n"),
            (std::vector<std::string>{"lab.toml:2: 'ethercat.loss_fault' is 1.5, allowed is 0.001 to 1",
                                      "lab.toml:3: 'ethercat.loss_warning' is 0, allowed is 0.001 to 1"}));
  EXPECT_EQ(problems("[ethercat]\nloss_fault = 0.051\nloss_warning = 0.051\ntolerated_cycles = 50\n"),
            std::vector<std::string>{});
}

TEST_F(BusConfig, ABridgeLongerThanTheDrivesWatchdogSaysHowLongItIs) {
  EXPECT_EQ(problems("[ethercat]\ntolerated_cycles = 10\nframe_timeout_s = 0.05\n"),
            std::vector<std::string>{
                "lab.toml:2: 'ethercat.tolerated_cycles' = 10 bridges 10 × 0.05 s "
                "('ethercat.frame_timeout_s') = 0.5 s, and the drives stop by themselves after 0.1 s: lower "
                "one of the two"});
  EXPECT_EQ(
      problems("[loop]\nperiod_s = 0.01\n[compensation]\nfilter_cutoff_rad_per_s = 50\n"
               "[ethercat]\ntolerated_cycles = 11\n"),
      std::vector<std::string>{
          "lab.toml:6: 'ethercat.tolerated_cycles' = 11 bridges 11 × 0.01 s ('loop.period_s') = 0.11 s, "
          "and the drives stop by themselves after 0.1 s: lower one of the two"});
}

}  // namespace bus_config_test
}  // namespace operation
