// youbotd as a service and youbotctl, as two programs on a real socket. The loop is slow and has long
// time-outs, so that a busy machine only takes longer.
#include <gtest/gtest.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "runtime/program/control_socket.h"
#include "tests/support/built_paths.h"
#include "tests/support/hostile_clients.h"
#include "tests/support/process.h"
#include "tests/support/skip.h"
#include "tests/support/temporary_directory.h"

namespace youbotctl_test {

using namespace std::chrono_literals;
using nlohmann::json;
using support::CommandResult;
using support::Process;

struct Youbotctl : testing::Test {
  Youbotctl()
      : config(folder.write("base.toml",
                            "[loop]\nperiod_s = 0.01\ncommand_timeout_s = 2.0\ncommander_timeout_s = 2.0\n"
                            "[workspace]\nbase_x_m = [-2.5, 1.5]\nbase_y_m = [-1.2, 1.2]\n"
                            "[compensation]\nfilter_cutoff_rad_per_s = 50\n[path]\nspeed_m_per_s = 0.2\n"
                            "acceleration_m_per_s2 = 0.2\n[[path.leg]]\nforward_m = 0.1\n")) {}

  std::vector<std::string> daemon(std::vector<std::string> more = {}) const {
    // youbotd writes fault reports to the directory for temporary files.
    std::vector<std::string> words{"/usr/bin/env",
                                   "TMPDIR=" + folder.path().string(),
                                   support::program("youbotd"),
                                   "--config",
                                   config,
                                   "--control",
                                   folder / "s",
                                   "--allow-non-rt"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  std::vector<std::string> ctl(std::vector<std::string> words) const {
    words.insert(words.begin(), {support::program("youbotctl"), "--socket", folder / "s"});
    return words;
  }
  CommandResult tell(std::vector<std::string> words) const { return Process(ctl(std::move(words))).finish(); }
  json status() const {
    const CommandResult result = tell({"status", "--json"});
    EXPECT_EQ(result.exit_code, 0) << result.output;
    return json::parse(result.output, nullptr, false);
  }
  template <typename Condition>
  testing::AssertionResult comes_to(Condition condition) const {
    json now;
    for (const auto end = std::chrono::steady_clock::now() + 60s; std::chrono::steady_clock::now() < end;
         std::this_thread::sleep_for(20ms))
      if (condition(now = status())) return testing::AssertionSuccess();
    return testing::AssertionFailure() << now.dump(2);
  }
  static bool ends(const Process& process) {
    for (const auto end = std::chrono::steady_clock::now() + 60s; std::chrono::steady_clock::now() < end;
         std::this_thread::sleep_for(20ms))
      if (process.ended()) return true;
    return false;
  }
  testing::AssertionResult comes_to_rest() const {
    return comes_to([](const json& now) { return now["enabled"] == false; });
  }

  support::TemporaryDirectory folder;
  std::filesystem::path config;
};

TEST_F(Youbotctl, EnablesNothingThatCannotBeRecorded) {
  Process youbotd(daemon({"--record", folder / "runs"}));
  ASSERT_TRUE(youbotd.wait_for("waiting for commands"));
  folder.write("runs", "a file has taken its place");
  const CommandResult refused = tell({"enable"});
  EXPECT_EQ(refused.exit_code, 2) << refused.output;
  EXPECT_TRUE(refused.said("runs/run-1: cannot be the directory for the results")) << refused.output;
  EXPECT_EQ(status()["enabled"], false);
  EXPECT_EQ(status()["phase"], "off");
  std::filesystem::remove(folder / "runs");
  EXPECT_EQ(tell({"enable"}).exit_code, 0) << "and once it can, it does";
  EXPECT_TRUE(std::filesystem::exists(folder / "runs/run-1/base.mcap"));

  std::filesystem::rename(folder / "runs/run-1", folder / "runs/run-9");
  std::filesystem::create_directory(folder / "runs/run-10-notes");
  EXPECT_EQ(tell({"enable"}).exit_code, 0);
  EXPECT_TRUE(std::filesystem::exists(folder / "runs/run-10/base.mcap"))
      << "numbers are in the order of the runs";
}

/// Runs `words` with standard output and standard error into a full pipe that has no reader.
std::vector<std::string> into_a_full_pipe(const std::vector<std::string>& words) {
  std::string command = "head -c 65536 /dev/zero; exec";
  for (const std::string& word : words) command += " '" + word + "'";
  return {"/bin/sh", "-c", command};
}

TEST_F(Youbotctl, AnUnreadLogDelaysNeitherStartNorRunNorStop) {
  Process youbotd(into_a_full_pipe(daemon()));
  const auto end = std::chrono::steady_clock::now() + 60s;
  while (tell({"status"}).exit_code != 0 && std::chrono::steady_clock::now() < end)
    std::this_thread::sleep_for(20ms);
  ASSERT_EQ(tell({"enable"}).exit_code, 0);
  EXPECT_TRUE(comes_to_rest());
  youbotd.signal(SIGTERM);
  EXPECT_TRUE(ends(youbotd));
}

TEST_F(Youbotctl, ARefusedStartEndsEvenIfItsLogIsNotRead) {
  config = folder.write("wrong.toml", "[limits]\nforce_N = \"much\"\n");
  Process youbotd(into_a_full_pipe(daemon()));
  ASSERT_TRUE(ends(youbotd));
  EXPECT_EQ(youbotd.finish().exit_code, 2);
}

/// A separate file system, which a test fills up. Needs root.
class SmallDisk {
 public:
  explicit SmallDisk(const std::filesystem::path& where) : where_(where) {
    std::filesystem::create_directories(where);
    mounted_ = mount("tmpfs", where.c_str(), "tmpfs", 0, "size=40m") == 0;
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;
  ~SmallDisk() {
    if (mounted_) umount2(where_.c_str(), MNT_DETACH);
  }
  bool mounted() const { return mounted_; }
  /// Leaves so much of it.
  void fill_up_to(std::uintmax_t bytes) const {
    std::ofstream file(where_ / "filling", std::ios::binary | std::ios::app);
    const std::vector<char> chunk(64 << 10);
    while (std::filesystem::space(where_).available > bytes && file)
      file.write(chunk.data(), static_cast<std::streamsize>(chunk.size())).flush();
  }
  void make_room() const { std::filesystem::remove(where_ / "filling"); }

 private:
  std::filesystem::path where_;
  bool mounted_ = false;
};

TEST_F(Youbotctl, AFullDiskRefusesTheEnable) {
  const SmallDisk disk(folder / "disk");
  SKIP_UNLESS(disk.mounted(), "needs root, to mount a small disk");
  Process youbotd(daemon({"--record", folder / "disk/runs"}));
  ASSERT_TRUE(youbotd.wait_for("waiting for commands"));
  disk.fill_up_to(1 << 20);
  const CommandResult refused = tell({"enable"});
  EXPECT_EQ(refused.exit_code, 2) << refused.output;
  EXPECT_TRUE(refused.said("disk/runs/run-1: cannot be recorded to: its disk has")) << refused.output;
  EXPECT_EQ(status()["phase"], "off");
  EXPECT_FALSE(std::filesystem::exists(folder / "disk/runs"));
  disk.make_room();
  EXPECT_EQ(tell({"enable"}).exit_code, 0) << "and once it can, it does";
}

TEST_F(Youbotctl, ADiskThatFillsUpDuringARunIsInTheStatusWhileItGoesOn) {
  const SmallDisk disk(folder / "disk");
  SKIP_UNLESS(disk.mounted(), "needs root, to mount a small disk");
  Process youbotd(daemon({"--record", folder / "disk/runs"}));
  ASSERT_TRUE(youbotd.wait_for("waiting for commands"));
  EXPECT_TRUE(status()["recording"].is_null());
  EXPECT_EQ(tell({"mode", "velocity"}).exit_code, 0);
  Process commander(ctl({"enable"}));
  ASSERT_TRUE(commander.wait_for("running"));
  EXPECT_EQ(status()["recording"]["state"], "ok");
  EXPECT_EQ(status()["recording"]["directory"], (folder / "disk/runs/run-1").string());
  disk.fill_up_to(0);
  EXPECT_TRUE(comes_to([](const json& now) { return now["recording"]["state"] == "failing"; }));
  const json now = status();
  EXPECT_EQ(now["enabled"], true) << "the robot continues";
  EXPECT_NE(now["recording"]["problems"].dump().find("No space left on device"), std::string::npos)
      << now.dump(2);
  EXPECT_GT(now["recording"]["cycles_lost"], 0);
  EXPECT_TRUE(youbotd.wait_for("No space left on device"));
  EXPECT_TRUE(tell({"status"}).said("recording  failing"));
  EXPECT_EQ(tell({"stop"}).exit_code, 0);
}

TEST_F(Youbotctl, WhoSleptThroughTheEndOfHisRunDoesNotTakeTheNextForHis) {
  Process youbotd(daemon());
  ASSERT_TRUE(youbotd.wait_for("waiting for commands"));
  Process sleeper(ctl({"enable"}));
  ASSERT_TRUE(sleeper.wait_for("running"));
  sleeper.signal(SIGSTOP);
  EXPECT_TRUE(comes_to_rest());
  EXPECT_EQ(status()["run"], 1);
  Process next(ctl({"enable"}));
  ASSERT_TRUE(next.wait_for("running"));
  sleeper.signal(SIGCONT);
  const CommandResult result = sleeper.finish();
  EXPECT_EQ(result.exit_code, 2) << result.output;
  EXPECT_TRUE(result.said("another client has enabled the next one")) << result.output;
  EXPECT_EQ(next.finish().exit_code, 0);
}

TEST_F(Youbotctl, DrivesThePathOnceItIsEnabledAndThenTheDrivesAreOff) {
  Process youbotd(daemon({"--record", folder / "runs"}));
  ASSERT_TRUE(youbotd.wait_for("waiting for commands"));
  const json before = status();
  EXPECT_EQ(before["phase"], "off");
  EXPECT_EQ(before["mode"], "path");
  EXPECT_EQ(before["robot_state"], "ready");
  EXPECT_TRUE(before["commander"].is_null());
  EXPECT_FALSE(std::filesystem::exists(folder / "runs")) << "nothing is recorded before it is enabled";

  EXPECT_EQ(tell({"set", "limits.force_N", "4"}).exit_code, 0);
  for (const char* run : {"run-1", "run-2"}) {
    const CommandResult result = tell({"enable"});
    EXPECT_EQ(result.exit_code, 0) << result.output;
    EXPECT_TRUE(result.said("running")) << result.output;
    EXPECT_TRUE(result.said("off")) << result.output;
    EXPECT_TRUE(std::filesystem::exists(folder / "runs" / run / "base.mcap"));
    std::ifstream settings(folder / "runs" / run / "settings.toml");
    std::string line;
    EXPECT_TRUE(std::getline(settings, line) && line == "limits.force_N = 4") << line;
  }
  youbotd.signal(SIGTERM);
  const CommandResult end = youbotd.finish();
  EXPECT_EQ(end.exit_code, 0) << end.output;
  EXPECT_FALSE(std::filesystem::exists(folder / "s")) << "the socket goes with it";
}

TEST_F(Youbotctl, HoldKeepsTheBaseWhereItStandsUntilAStop) {
  Process youbotd(daemon());
  ASSERT_TRUE(youbotd.wait_for("waiting for commands"));
  EXPECT_EQ(tell({"mode", "hold"}).exit_code, 0);
  Process commander(ctl({"enable"}));
  ASSERT_TRUE(commander.wait_for("running"));
  EXPECT_TRUE(comes_to([](const json& now) { return now["time_s"] > 1.0; }));
  const json now = status();
  EXPECT_EQ(now["mode"], "hold");
  EXPECT_NEAR(now["base_W"][0].get<double>(), 0.0, 0.001);
  EXPECT_EQ(tell({"stop"}).exit_code, 0);
  EXPECT_EQ(commander.finish().exit_code, 0);
  EXPECT_TRUE(comes_to_rest());
}

TEST_F(Youbotctl, OneCommandsAndEveryoneMayStop) {
  Process youbotd(daemon());
  ASSERT_TRUE(youbotd.wait_for("waiting for commands"));
  EXPECT_EQ(tell({"mode", "velocity"}).exit_code, 0);
  Process commander(ctl({"enable"}));
  ASSERT_TRUE(commander.wait_for("running"));
  EXPECT_NE(status()["commander"].get<std::string>().find(std::to_string(commander.pid())),
            std::string::npos);
  for (const std::vector<std::string>& refused :
       {std::vector<std::string>{"enable"}, {"mode", "path"}, {"set", "limits.force_N", "1"}}) {
    const CommandResult result = tell(refused);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_TRUE(result.said(std::to_string(commander.pid()))) << result.output;
  }
  ASSERT_TRUE(commander.say("set velocity 0.2 0 0"));
  EXPECT_TRUE(comes_to([](const json& now) { return now["enabled"] == true && now["base_W"][0] > 0.05; }));
  EXPECT_EQ(tell({"stop"}).exit_code, 0);
  const CommandResult ended = commander.finish();
  EXPECT_EQ(ended.exit_code, 0) << ended.output;
  EXPECT_TRUE(ended.said("off: requested by ")) << ended.output;
  EXPECT_TRUE(comes_to_rest());
  EXPECT_EQ(status()["stopped"].get<std::string>().rfind("requested by ", 0), 0U);
}

TEST_F(Youbotctl, TheEndOfTheDaemonIsNoCrashToItsCommander) {
  Process youbotd(daemon());
  ASSERT_TRUE(youbotd.wait_for("waiting for commands"));
  EXPECT_EQ(tell({"mode", "velocity"}).exit_code, 0);
  Process commander(ctl({"enable"}));
  ASSERT_TRUE(commander.wait_for("running"));
  youbotd.signal(SIGTERM);
  const CommandResult ended = commander.finish();
  EXPECT_EQ(ended.exit_code, 0) << ended.output;
  EXPECT_TRUE(ended.said("off: youbotd ends")) << ended.output;
  EXPECT_EQ(youbotd.finish().exit_code, 0);
}

TEST_F(Youbotctl, AnEditOfWhatOpenedTheRobotNeedsARestart) {
  Process youbotd(daemon());
  ASSERT_TRUE(youbotd.wait_for("waiting for commands"));
  std::ofstream(config, std::ios::app) << "[ethercat]\nloss_fault = 0.4\n[simulation]\nmass_kg = 30\n";
  const CommandResult refused = tell({"enable"});
  EXPECT_EQ(refused.exit_code, 2) << refused.output;
  EXPECT_TRUE(refused.said("has changed at 'ethercat' and 'simulation', which youbotd reads when it starts"))
      << refused.output;
}

TEST_F(Youbotctl, AnEditOfWhatTheCommandLineGivesNeedsNone) {
  Process youbotd(daemon({"--robot", "loopback"}));
  ASSERT_TRUE(youbotd.wait_for("waiting for commands"));
  std::ifstream before(config);
  const std::string text{std::istreambuf_iterator<char>(before), {}};
  std::ofstream(config) << "robot = \"wire\"\n" << text;
  const CommandResult done = tell({"enable"});
  EXPECT_EQ(done.exit_code, 0) << done.output;
  EXPECT_EQ(status()["robot"], "loopback");
  EXPECT_TRUE(tell({"set", "robot", "\"wire\""}).said("read once"));
}

TEST_F(Youbotctl, AnEditOfTheHapticDeviceThatTheCommandLineGivesNeedsNone) {
  const std::string rest =
      "[loop]\ncommand_timeout_s = 2.0\ncommander_timeout_s = 2.0\n"
      "[ethercat]\nkind = \"base+arm\"\n[teleoperation]\n";
  config = folder.write("teleop.toml", rest);
  Process youbotd(daemon({"--haptic", "loopback"}));
  ASSERT_TRUE(youbotd.wait_for("waiting for commands"));
  std::ofstream(config) << rest << "[haptic]\ndevice = \"spacemouse\"\n";
  Process commander(ctl({"enable"}));
  EXPECT_TRUE(commander.wait_for("enabled: "));
  commander.signal(SIGINT);
  EXPECT_NE(commander.finish().exit_code, 2);
  EXPECT_TRUE(comes_to_rest());
  std::ofstream(config) << rest << "[haptic]\ndevice = \"spacemouse\"\nforce_limit_N = 3\n";
  (void)tell({"acknowledge"});  // a busy machine may have ended the run by a fault
  const CommandResult refused = tell({"enable"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_TRUE(refused.said("has changed at 'haptic'")) << refused.output;
}

TEST_F(Youbotctl, WallsStayWhereTheyAreHoweverOftenItIsEnabled) {
  config = folder.write(
      "walled.toml",
      "[loop]\nperiod_s = 0.01\ncommand_timeout_s = 2.0\ncommander_timeout_s = 2.0\n"
      "[workspace]\nbase_x_m = [-1, 0.15]\n[compensation]\nfilter_cutoff_rad_per_s = 50\n"
      "[path]\nspeed_m_per_s = 0.2\nacceleration_m_per_s2 = 0.2\n[[path.leg]]\nforward_m = 0.1\n");
  Process youbotd(daemon());
  ASSERT_TRUE(youbotd.wait_for("waiting for commands"));
  EXPECT_EQ(tell({"mode", "velocity"}).exit_code, 0);
  for (int run = 1; run <= 2; ++run) {
    Process commander(ctl({"enable"}));
    ASSERT_TRUE(commander.wait_for("running"));
    EXPECT_EQ(run == 2, status()["base_W"][0] > 0.1) << "the second begins where the first left it";
    ASSERT_TRUE(commander.say("set velocity 0.2 0 0"));
    EXPECT_TRUE(comes_to([](const json& now) { return now["enabled"] == true && now["time_s"] > 3; }));
    EXPECT_GT(status()["base_W"][0], 0.1);
    EXPECT_LT(status()["base_W"][0], 0.2);
    EXPECT_EQ(tell({"stop"}).exit_code, 0);
    EXPECT_EQ(commander.finish().exit_code, 0);
    ASSERT_TRUE(comes_to_rest());
  }
  EXPECT_EQ(tell({"mode", "path"}).exit_code, 0);
  const CommandResult refused = tell({"enable"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_TRUE(refused.said("from where the base stands")) << refused.output;
}

TEST_F(Youbotctl, TheRobotComesToRestWhenItsCommanderDies) {
  Process youbotd(daemon());
  ASSERT_TRUE(youbotd.wait_for("waiting for commands"));
  EXPECT_EQ(tell({"mode", "velocity"}).exit_code, 0);
  Process commander(ctl({"enable"}));
  ASSERT_TRUE(commander.wait_for("running"));
  commander.signal(SIGKILL);
  EXPECT_TRUE(comes_to_rest());
  EXPECT_TRUE(youbotd.wait_for("coming to rest"));
  Process again(ctl({"enable"}));
  EXPECT_TRUE(again.wait_for("running")) << "the next one may";
  again.signal(SIGINT);
  EXPECT_EQ(again.finish().exit_code, 0);
}

TEST_F(Youbotctl, TheRobotComesToRestWhenItsCommanderHangs) {
  Process youbotd(daemon());
  ASSERT_TRUE(youbotd.wait_for("waiting for commands"));
  EXPECT_EQ(tell({"mode", "velocity"}).exit_code, 0);
  Process commander(ctl({"enable"}));
  ASSERT_TRUE(commander.wait_for("running"));
  commander.signal(SIGSTOP);
  EXPECT_TRUE(comes_to_rest());
  EXPECT_TRUE(youbotd.wait_for("is silent"));
}

TEST_F(Youbotctl, AnEnableThatWaitedWhileTheDaemonStoodStillStartsNothing) {
  Process youbotd(daemon());
  ASSERT_TRUE(youbotd.wait_for("waiting for commands"));
  EXPECT_EQ(status()["enabled"], false);
  youbotd.signal(SIGSTOP);
  Process waiting(ctl({"enable"}));
  std::this_thread::sleep_for(1500ms);
  youbotd.signal(SIGCONT);
  const CommandResult refused = waiting.finish();
  EXPECT_EQ(refused.exit_code, 2) << refused.output;
  EXPECT_TRUE(refused.said("youbotd was held up for")) << refused.output;
  EXPECT_EQ(status()["enabled"], false);
  EXPECT_TRUE(comes_to([this](const json&) { return tell({"enable"}).exit_code == 0; }))
      << "a fresh one does";
}

TEST_F(Youbotctl, APauseLongerThanTheDeadManIsAFaultThatNamesThePause) {
  Process youbotd(daemon());
  ASSERT_TRUE(youbotd.wait_for("waiting for commands"));
  EXPECT_EQ(tell({"mode", "velocity"}).exit_code, 0);
  Process commander(ctl({"enable"}));
  ASSERT_TRUE(commander.wait_for("running"));
  youbotd.signal(SIGSTOP);
  std::this_thread::sleep_for(3s);  // the dead-man is 2 s here
  youbotd.signal(SIGCONT);
  EXPECT_TRUE(comes_to([](const json& now) { return now["phase"] == "faulted"; })) << status().dump(2);
  EXPECT_NE(status()["fault"].get<std::string>().find("this program did not run for "), std::string::npos)
      << status()["fault"];
}

TEST_F(Youbotctl, AVelocityStopsWithTheProgramThatCommandsIt) {
  Process youbotd(daemon());
  ASSERT_TRUE(youbotd.wait_for("waiting for commands"));
  EXPECT_EQ(tell({"mode", "velocity"}).exit_code, 0);
  Process commander(ctl({"enable"}));
  ASSERT_TRUE(commander.wait_for("running"));
  ASSERT_TRUE(commander.say("set velocity 0.2 0 0"));
  commander.hang_up();
  const CommandResult ended = commander.finish();
  EXPECT_EQ(ended.exit_code, 0) << ended.output;
  EXPECT_TRUE(ended.said("off")) << ended.output;
}

TEST_F(Youbotctl, DisableSwitchesOffAtOnce) {
  Process youbotd(daemon());
  ASSERT_TRUE(youbotd.wait_for("waiting for commands"));
  EXPECT_EQ(tell({"mode", "velocity"}).exit_code, 0);
  Process commander(ctl({"enable"}));
  ASSERT_TRUE(commander.wait_for("running"));
  EXPECT_EQ(tell({"disable"}).exit_code, 0);
  const CommandResult ended = commander.finish();
  EXPECT_EQ(ended.exit_code, 0) << ended.output;
  EXPECT_FALSE(ended.said("stopping")) << "no braking: " << ended.output;
}

TEST_F(Youbotctl, AFaultEndsTheRunAndNotTheService) {
  // The mass feedforward is four times too large, and nothing holds the base back.
  config = folder.write(
      "fast.toml",
      "[loop]\nperiod_s = 0.01\ncommand_timeout_s = 2.0\ncommander_timeout_s = 2.0\n[compensation]\n"
      "filter_cutoff_rad_per_s = 50\n[controller]\nstiffness_N_per_m = 0\n"
      "damping_N_s_per_m = 0\nfeedforward_mass_kg = 200\n[limits]\nforce_N = 50\n"
      "[path]\nturn_speed_rad_per_s = 0.01\n[[path.leg]]\nforward_m = 1\n");
  Process youbotd(daemon());
  ASSERT_TRUE(youbotd.wait_for("waiting for commands"));
  EXPECT_EQ(tell({"set", "limits.wheel_speed_rad_per_s", "2.3"}).exit_code, 0);
  const CommandResult result = tell({"enable"});
  EXPECT_EQ(result.exit_code, 4) << result.output;
  const json after = status();
  EXPECT_EQ(after["phase"], "faulted");
  EXPECT_NE(after["fault"].get<std::string>().find("more than allowed"), std::string::npos) << after.dump();
  const std::filesystem::path report = after["fault_report"].get<std::string>();
  EXPECT_TRUE(std::filesystem::exists(report)) << report;
  EXPECT_EQ(report.parent_path(), folder.path() / ("youbotd-faults-" + std::to_string(geteuid())));
  EXPECT_EQ(tell({"unset", "limits.wheel_speed_rad_per_s"}).exit_code, 0);
  EXPECT_EQ(status()["phase"], "faulted") << "until it is acknowledged";

  const CommandResult refused = tell({"enable"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_TRUE(refused.said("more than allowed")) << refused.output;
  EXPECT_TRUE(refused.said("youbotctl acknowledge")) << refused.output;
  EXPECT_EQ(tell({"acknowledge"}).exit_code, 0);
  const json acknowledged = status();
  EXPECT_EQ(acknowledged["phase"], "off");
  EXPECT_EQ(acknowledged["enabled"], false) << "to acknowledge is not to enable";
  EXPECT_EQ(acknowledged["fault_acknowledged"], true);
  EXPECT_EQ(acknowledged["fault"], after["fault"]) << "it stays readable until the next run";
  EXPECT_EQ(tell({"acknowledge"}).exit_code, 0) << "twice is no mistake";
  // A clean run, whose end leaves nothing to acknowledge.
  EXPECT_EQ(tell({"set", "controller.feedforward_mass_kg", "10"}).exit_code, 0);
  EXPECT_EQ(tell({"mode", "velocity"}).exit_code, 0);
  for (int run = 0; run < 2; ++run) {
    Process commander(ctl({"enable"}));
    ASSERT_TRUE(commander.wait_for("running"));
    commander.signal(SIGINT);
    EXPECT_EQ(commander.finish().exit_code, 0);
  }
}

TEST_F(Youbotctl, WhatIsWrongIsRefusedWithTheReason) {
  const CommandResult unserved = tell({"status"});
  EXPECT_EQ(unserved.exit_code, 3);
  EXPECT_TRUE(unserved.said("no youbotd serves there")) << unserved.output;

  Process youbotd(daemon());
  ASSERT_TRUE(youbotd.wait_for("waiting for commands"));
  const auto refusal = [&](const std::vector<std::string>& words) {
    const CommandResult result = tell(words);
    EXPECT_EQ(result.exit_code, 2);
    return result.output;
  };
  const auto says = [](const std::string& text, const char* part) {
    return text.find(part) != std::string::npos ? testing::AssertionSuccess()
                                                : testing::AssertionFailure() << text;
  };
  EXPECT_TRUE(says(refusal({"set", "limits.force_N", "1000"}), "allowed is 0.1 to 200"));
  EXPECT_TRUE(says(refusal({"set", "limits.forse_N", "10"}), "force_N")) << "what may be meant";
  EXPECT_TRUE(says(refusal({"set", "limits.force_N", "ten"}), "limits.force_N"));
  EXPECT_TRUE(says(refusal({"set", "robot", "\"wire\""}), "read once"));
  EXPECT_TRUE(says(refusal({"set", "loop.period_s", "0.002"}), "read once"));
  EXPECT_TRUE(says(refusal({"set", "can.module_id", "5"}), "read once"));
  EXPECT_TRUE(says(refusal({"set", "velocity", "0.1", "0", "0"}),
                   "not enabled in the mode velocity: choose that mode, then enable"));
  EXPECT_TRUE(says(refusal({"mode", "teleoperation"}), "path, velocity, hold"));
  EXPECT_TRUE(says(refusal({"set", "path", "5"}), "'path' is a table"));
  EXPECT_TRUE(says(refusal({"set", "path.leg.forward_m", "5"}), "'leg' is no table"));
  EXPECT_TRUE(says(refusal({"unset", "limits.force_N"}), "'limits.force_N' is not set"));
  EXPECT_TRUE(says(refusal({"set", "teleoperation.feedback.force_limit_N", "0.2"}), "is for teleoperation"));
  EXPECT_TRUE(status()["settings"].empty()) << "what was refused is not kept";
  EXPECT_EQ(tell({"enable", "now"}).exit_code, 2);
  EXPECT_EQ(tell({}).exit_code, 2);

  const CommandResult second = Process(daemon()).finish();
  EXPECT_EQ(second.exit_code, 3) << second.output;
  EXPECT_TRUE(second.said("another youbotd serves it")) << second.output;
  EXPECT_EQ(Process(daemon({"--virtual-time"})).finish().exit_code, 2);
}

TEST_F(Youbotctl, WhatAClientSendsReachesLogAndTerminalAsText) {
  Process youbotd(daemon());
  ASSERT_TRUE(youbotd.wait_for("waiting for commands"));
  const CommandResult refused = tell({"set", "limits.\x1b[2Jforce\xff_N", "4"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_TRUE(refused.said("limits.\\x1b[2Jforce")) << refused.output;
  EXPECT_FALSE(refused.said("\x1b") || refused.said("\xff")) << refused.output;
  EXPECT_TRUE(youbotd.wait_for("limits.\\x1b[2Jforce\\xff_N' is not the name of a key"));
  youbotd.signal(SIGTERM);
  const CommandResult ended = youbotd.finish();
  EXPECT_FALSE(ended.said("\x1b") || ended.said("\xff")) << ended.output;
}

TEST_F(Youbotctl, NoSettingGoesAboveAnyLimitOfTheFile) {
  Process youbotd(daemon());
  ASSERT_TRUE(youbotd.wait_for("waiting for commands"));
  // The values of the fixture's file, and the defaults of missing keys.
  const auto limits =
      std::to_array<std::array<const char*, 3>>({{"path.speed_m_per_s", "0.21", "0.19"},
                                                 {"limits.force_N", "199", "1"},
                                                 {"limits.moment_Nm", "49", "0.1"},
                                                 {"limits.wheel_torque_Nm", "2.49", "0.1"},
                                                 {"limits.wheel_speed_rad_per_s", "29", "11"},
                                                 {"limits.torque_rate_per_s", "900", "50"},
                                                 {"limits.setpoint_m_per_s", "4.9", "0.5"},
                                                 {"limits.setpoint_rad_per_s", "9", "1"},
                                                 {"workspace.base_x_m", "[-3, 1]", "[-2, 1]"},
                                                 {"workspace.base_y_m", "[-1, 3]", "[-1, 1]"},
                                                 {"limits.following_error_m", "1", "0.05"},
                                                 {"limits.following_error_rad", "1", "0.1"},
                                                 {"path.turn_speed_rad_per_s", "0.6", "0.1"}});
  for (const auto& [key, above, below] : limits) {
    const CommandResult refused = tell({"set", key, above});
    EXPECT_EQ(refused.exit_code, 2) << key << refused.output;
    EXPECT_TRUE(refused.said("allows no ")) << refused.output;
    ASSERT_EQ(tell({"set", key, below}).exit_code, 0) << key;
    EXPECT_TRUE(youbotd.wait_for(std::string(" set ") + key + " = " + below)) << "who set what is in the log";
    EXPECT_EQ(tell({"unset", key}).exit_code, 0) << key;
  }
  // With more acceleration a motion is faster, with less it stops later.
  for (const auto& [key, above, below] :
       std::to_array<std::array<const char*, 3>>({{"path.acceleration_m_per_s2", "0.3", "0.1"},
                                                  {"path.turn_acceleration_rad_per_s2", "19", "0.01"},
                                                  {"limits.setpoint_m_per_s2", "49", "1"},
                                                  {"limits.setpoint_m_per_s3", "49000", "500"},
                                                  {"limits.setpoint_rad_per_s2", "99", "9"},
                                                  {"limits.setpoint_rad_per_s3", "99000", "900"}}))
    for (const char* value : {above, below})
      EXPECT_TRUE(tell({"set", key, value}).said("allows nothing but")) << key << " = " << value;
  EXPECT_TRUE(status()["settings"].empty());
}

TEST_F(Youbotctl, NoSettingWeakensWhatProtectsTheHandAndTheArm) {
  config = support::source_dir() + "/apps/youbotd/teleop.toml";
  Process youbotd(daemon());
  ASSERT_TRUE(youbotd.wait_for("waiting for commands"));
  for (const auto& [key, value] : {std::pair{"arm.torque_limit_Nm", "[9.5, 9.5, 6, 2, 14]"},
                                   {"arm.joint_speed_limit_rad_per_s", "9.9"},
                                   {"arm.following_error_rad", "0.9"},
                                   {"arm.setpoint_rad_per_s", "4.9"},
                                   {"arm.setpoint_rad_per_s2", "49"},
                                   {"arm.setpoint_rad_per_s3", "49000"},
                                   {"mapping.smoothing_m_per_s", "1.9"},
                                   {"mapping.smoothing_m_per_s2", "49"},
                                   {"mapping.smoothing_m_per_s3", "49000"},
                                   {"mapping.smoothing_deg_per_s", "300"},
                                   {"mapping.smoothing_deg_per_s2", "4900"},
                                   {"mapping.smoothing_deg_per_s3", "4900000"},
                                   {"coupling.setpoint_distance_limit_m", "1.9"},
                                   {"coupling.setpoint_turn_limit_deg", "150"},
                                   {"coupling.force_limit_N", "199"},
                                   {"coupling.moment_limit_Nm", "49"},
                                   {"feedback.force_limit_N", "11.9"}}) {
    const CommandResult refused = tell({"set", std::string("teleoperation.") + key, value});
    EXPECT_EQ(refused.exit_code, 2) << key;
    EXPECT_TRUE(refused.said("allows no more than") || refused.said("allows nothing but"))
        << key << ": " << refused.output;
  }
  for (const char* key : {"passivity", "detect_release"})
    EXPECT_TRUE(tell({"set", std::string("teleoperation.feedback.") + key, "false"}).said("has it on"))
        << key;
  const CommandResult check_off = tell({"set", "plausibility.off", "[\"wheel_agreement\"]"});
  EXPECT_EQ(check_off.exit_code, 2);
  EXPECT_TRUE(check_off.said("switches off a check")) << check_off.output;
  EXPECT_EQ(tell({"set", "teleoperation.feedback.force_limit_N", "0.5"}).exit_code, 0);
  EXPECT_TRUE(tell({"set", "geometry.wheel_radius_m", "0.2"}).said("read once"));
}

TEST_F(Youbotctl, NoSettingReadsAnythingButFilesBesideTheConfiguration) {
  Process youbotd(daemon());
  ASSERT_TRUE(youbotd.wait_for("waiting for commands"));
  ASSERT_EQ(mkfifo((folder / "pipe").c_str(), 0600), 0);
  std::filesystem::create_symlink("/dev/zero", folder / "link");
  const auto refusal = [&](const std::string& name) {
    const std::string four = "[\"" + name + "\", \"" + name + "\", \"" + name + "\", \"" + name + "\"]";
    const CommandResult result = tell({"set", "compensation.models", four});
    EXPECT_EQ(result.exit_code, 2) << name;
    return result;
  };
  for (const char* outside : {"/dev/zero", "/proc/kmsg", "../model.toml", "link"})
    EXPECT_TRUE(refusal(outside).said("outside the configuration's folder")) << outside;
  EXPECT_TRUE(refusal("pipe").said("is a device or pipe, expected a file"));
  folder.write("endless.toml", std::string(5 << 20, '#'));
  EXPECT_TRUE(refusal("endless.toml").said("bytes that are expected"));
  EXPECT_EQ(status()["phase"], "off");
}

TEST_F(Youbotctl, SettingsNeverOutgrowAnAnswer) {
  Process youbotd(daemon());
  ASSERT_TRUE(youbotd.wait_for("waiting for commands"));
  const std::string padding = " # " + std::string(3500, '"');  // a comment of TOML, and twice as long as JSON
  bool refused = false;
  for (const char* key : {"limits.force_N", "limits.moment_Nm", "path.speed_m_per_s", "path.rest_s",
                          "controller.stiffness_N_per_m", "controller.damping_N_s_per_m"})
    refused = refused || tell({"set", key, "0.1" + padding}).said("unset some");
  EXPECT_TRUE(refused);
  EXPECT_EQ(status()["phase"], "off");
  EXPECT_EQ(tell({"unset", "limits.force_N"}).exit_code, 0);
  EXPECT_EQ(tell({"unset", "limits.moment_Nm"}).exit_code, 0);
  // Nearly a thousand mistakes in one line.
  std::string ones = "[1";
  while (ones.size() < 1900) ones += ",1";
  const CommandResult mistakes = tell({"set", "compensation.models", ones + "]"});
  EXPECT_EQ(mistakes.exit_code, 2) << mistakes.output.substr(0, 200);
  EXPECT_TRUE(mistakes.said("'compensation.models[0]' should be a string")) << mistakes.output.substr(0, 200);
}

TEST_F(Youbotctl, ARequestIsUpTo4096BytesLong) {
  Process youbotd(daemon());
  ASSERT_TRUE(youbotd.wait_for("waiting for commands"));
  const std::string key = "path.rest_s";
  const std::string longest =
      "1 #" + std::string(runtime::kLongestRequest - ("set " + key + " 1 #").size(), 'x');
  EXPECT_EQ(tell({"set", key, longest}).exit_code, 0);
  const CommandResult refused = tell({"set", key, longest + "x"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_TRUE(refused.said("the request has 4097 bytes, at most 4096 are possible")) << refused.output;

  EXPECT_EQ(tell({"mode", "velocity"}).exit_code, 0);
  Process commander(ctl({"enable"}));
  ASSERT_TRUE(commander.wait_for("running"));
  ASSERT_TRUE(commander.say(std::string(30'000, 'x')));
  ASSERT_TRUE(commander.wait_for("a line of more than 4096 bytes is ignored"));
  ASSERT_TRUE(commander.say("set velocity 0.2 0 0"));
  EXPECT_TRUE(comes_to([](const json& now) { return now["enabled"] == true && now["base_W"][0] > 0.05; }))
      << "the commander stays, and so does the run";
}

TEST_F(Youbotctl, AmidHostileClientsTheCommanderIsHeardAndEveryoneMayStop) {
  config = folder.write("patient.toml",
                        "[loop]\nperiod_s = 0.01\ncommand_timeout_s = 2.0\ncommander_timeout_s = 5.0\n"
                        "[compensation]\nfilter_cutoff_rad_per_s = 50\n[[path.leg]]\nforward_m = 0.1\n");
  Process youbotd(daemon());
  ASSERT_TRUE(youbotd.wait_for("waiting for commands"));
  EXPECT_EQ(tell({"mode", "velocity"}).exit_code, 0);
  Process commander(ctl({"enable"}));
  ASSERT_TRUE(commander.wait_for("running"));
  {
    const support::HostileClients hostile(folder / "s");
    ASSERT_TRUE(commander.say("set velocity 0.2 0 0"));
    // Five seconds of silence would bring it to rest.
    EXPECT_TRUE(comes_to([](const json& now) { return now["enabled"] == false || now["time_s"] > 7; }));
    EXPECT_EQ(status()["enabled"], true);
    EXPECT_GT(status()["base_W"][0], 0.1);
    EXPECT_GT(hostile.requests(), 0U);
    EXPECT_EQ(tell({"stop"}).exit_code, 0);
    EXPECT_TRUE(comes_to_rest());
    EXPECT_EQ(tell({"disable"}).exit_code, 0);
  }
  EXPECT_EQ(commander.finish().exit_code, 0);
}

TEST_F(Youbotctl, AnUnreadLogDelaysNoStop) {
  Process youbotd(daemon());
  ASSERT_TRUE(youbotd.wait_for("waiting for commands"));
  ASSERT_TRUE(youbotd.shrink_output());
  for (int i = 0; i < 40; ++i)
    ASSERT_EQ(tell({"set", "path.rest_s", "1 # " + std::string(500, 'x')}).exit_code, 0) << i;
  EXPECT_EQ(tell({"mode", "velocity"}).exit_code, 0);
  Process commander(ctl({"enable"}));
  ASSERT_TRUE(commander.wait_for("running"));
  EXPECT_EQ(tell({"stop"}).exit_code, 0);
  EXPECT_TRUE(comes_to_rest());
  EXPECT_EQ(commander.finish().exit_code, 0);
  EXPECT_TRUE(youbotd.wait_for("coming to rest"));
  youbotd.signal(SIGTERM);
  EXPECT_TRUE(youbotd.wait_for("ended after")) << "nothing is lost while there is room in the queue";
  EXPECT_EQ(youbotd.finish().exit_code, 0);
}

TEST_F(Youbotctl, ArmAndBaseByHandAreServedToo) {
  std::ostringstream as_shipped;
  as_shipped << std::ifstream(support::source_dir() + "/apps/youbotd/teleop.toml").rdbuf();
  // A busy machine may stall a loop of 1 kHz, or the simulated handle.
  std::string patient = as_shipped.str();
  const std::string table = "[haptic]\n";
  ASSERT_NE(patient.find(table), patient.npos);
  patient.replace(patient.find(table), table.size(),
                  table + "stale_after_s = 0.1\ncommand_timeout_s = 0.1\n");
  config =
      folder.write("teleop.toml", patient + "\n[loop]\ncommand_timeout_s = 2.0\ncommander_timeout_s = 2.0\n");
  Process youbotd(daemon());
  ASSERT_TRUE(youbotd.wait_for("waiting for commands"));
  EXPECT_EQ(status()["master_state"], "ready");
  EXPECT_EQ(tell({"set", "teleoperation.feedback.enabled", "false"}).exit_code, 0);
  // Where that was not enough, the run ends with a fault, and the operator enables again.
  CommandResult ended;
  for (int attempt = 0; attempt < 20 && ended.exit_code != 0; ++attempt) {
    Process commander(ctl({"enable"}));
    const bool unfolds = commander.wait_for("unfolding");
    commander.signal(SIGINT);
    ended = commander.finish();
    ASSERT_TRUE((ended.exit_code == 0 && unfolds) ||
                (ended.exit_code == 4 && ended.said("stopped by a fault")))
        << ended.output;
    EXPECT_EQ(tell({"acknowledge"}).exit_code, 0);
  }
  EXPECT_EQ(ended.exit_code, 0) << ended.output;
  EXPECT_TRUE(comes_to_rest());
}

}  // namespace youbotctl_test
