// Two processes, two network namespaces, real raw sockets: youbot-sim on one end of a veth pair, the real
// master on the other. The tests wait for conditions, never for a time.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "hal/clock.h"
#include "hal/ethercat_robot.h"
#include "tests/support/built_paths.h"
#include "tests/support/other_master.h"
#include "tests/support/process.h"
#include "tests/support/run_command.h"
#include "tests/support/skip.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/veth.h"

namespace ethercat_over_veth_test {

using namespace std::chrono_literals;
namespace fs = std::filesystem;
using support::Namespaces;
using support::Simulator;

/// The robot through the interface, cycled at 1 kHz as far as this machine allows.
struct Control {
  Control() : robot(hal::make_ethercat_robot("veth-c", options(), clock, 1ms)) {}
  static hal::EthercatOptions options() {
    // As long as the drives' own watchdog: a shared machine may not run us for a while.
    return {.kind = hal::YoubotKind::kBase, .tolerated_cycles = 90, .frame_timeout = 3ms};
  }
  /// A shared machine may starve either process for longer than any watchdog allows; that is a fault,
  /// rightly, and answered here as an operator would: disabled and enabled again. A slave that is missing is
  /// no such thing.
  template <typename Condition>
  bool cycle_until(Condition&& condition) {
    const auto end = clock.now() + 120s;
    const bool wanted = command.enable;
    for (auto next = clock.now(); clock.now() < end; clock.sleep_until(next += 1ms)) {
      status = robot->exchange(command, sample);
      command.enable = wanted && (status.ok() || status.fault == hal::Fault::kPartialBus);
      if (condition()) {
        command.enable = wanted;
        return true;
      }
    }
    return false;
  }
  hal::SteadyClock clock;
  std::unique_ptr<hal::Robot> robot;
  hal::RobotCommand command;
  hal::RobotSample sample;
  hal::CycleStatus status;
};

TEST(EthercatOverVeth, TheBaseStartsDrivesLosesAWheelRecoversAndMovesAgainOnlyWhenEnabled) {
  const Namespaces namespaces;
  SKIP_UNLESS(namespaces.usable(), "needs root and network namespaces");
  const support::TemporaryDirectory directory;
  const fs::path faults = directory.write(
      "faults.toml", "[[fault]]\nkind = \"slave_off\"\nat_frame = 4000\nduration_s = 1.0\nslave = 4\n");
  const Simulator simulator(namespaces, "--robot base --lock-step --faults " + faults.string());
  ASSERT_TRUE(simulator.ready());

  Control control;
  control.robot->activate();
  control.command.enable = true;
  for (std::size_t i = 0; i < 4; ++i) control.command.joints[i] = hal::JointCommand::velocity_rad_per_s(1.0);
  ASSERT_TRUE(control.cycle_until([&] { return control.sample.enabled; }))
      << hal::describe(control.status.fault);
  EXPECT_TRUE(control.cycle_until([&] { return control.sample.joints[2].position_rad > 0.5; }));

  ASSERT_TRUE(control.cycle_until([&] { return control.status.fault == hal::Fault::kPartialBus; }))
      << "the lost wheel was not noticed";
  EXPECT_EQ(control.status.joint, 2) << "slave 4 is wheel 3";
  EXPECT_FALSE(control.sample.enabled);

  control.command.enable = false;
  EXPECT_TRUE(control.cycle_until([&] { return control.status.ok(); })) << "no recovery";
  const double resting = control.sample.joints[0].position_rad;
  EXPECT_TRUE(control.cycle_until([n = 0]() mutable { return ++n == 300; }));
  EXPECT_NEAR(control.sample.joints[0].position_rad, resting, 0.2) << "it moved without being enabled";
  control.command.enable = true;
  ASSERT_TRUE(control.cycle_until([&] { return control.sample.enabled; }))
      << hal::describe(control.status.fault);
  const double before = control.sample.joints[2].position_rad;
  EXPECT_TRUE(control.cycle_until([&] { return control.sample.joints[2].position_rad > before + 0.3; }));
  control.robot->deactivate();
}

TEST(EthercatOverVeth, YoubotdDrivesTheEmulatedBaseOverARawSocket) {
  const Namespaces namespaces;
  SKIP_UNLESS(namespaces.usable(), "needs root and network namespaces");
  const Simulator simulator(namespaces, "--robot base --firmware 200");
  ASSERT_TRUE(simulator.ready());
  const support::TemporaryDirectory directory;
  const fs::path config = directory.write("config.toml",
                                          "robot = \"ethercat:veth-c\"\n[ethercat]\ntolerated_cycles = 90\n"
                                          "[loop]\ncommand_timeout_s = 2.0\ncommander_timeout_s = 2.0\n"
                                          "[path]\nrest_s = 0.1\n[[path.leg]]\nforward_m = 0.05\n");
  // Starved for longer than the drives' watchdog allows, youbotd stops with exit code 4, as it should: try
  // again.
  const std::string command = support::program("youbotd") + " --config " + config.string() +
                              " --allow-non-rt --record-csv " + (directory / "run").string();
  int result = -1;
  for (int attempt = 0; attempt < 20 && result != 0; ++attempt) {
    fs::remove_all(directory / "run");
    result = support::run_command(command).exit_code;
    ASSERT_TRUE(result == 0 || result == 4) << result;
  }
  EXPECT_EQ(result, 0);

  // The wheels' encoders, read over the bus, have gone 50 mm: about 1.05 rad each.
  std::ifstream recording(directory / "run" / "wheel-2.csv");
  std::vector<std::string> rows;
  for (std::string line; std::getline(recording, line);)
    if (line.find_first_of("0123456789") == 0) rows.push_back(line);
  ASSERT_GT(rows.size(), 1000U);
  const auto position_rad = [](const std::string& row) {
    std::size_t cell = 0;
    for (int comma = 0; comma < 3; ++comma) cell = row.find(',', cell) + 1;
    return std::stod(row.substr(cell));
  };
  EXPECT_NEAR(position_rad(rows.back()) - position_rad(rows.front()), 0.05 / 0.0475, 0.6);
}

/// The comparison of two runs, on a robot as far as the daemon knows: the limits stay in force.
support::CommandResult compare(const fs::path& config, const fs::path& out) {
  return support::run_command(support::program("youbotd") +
                              " --robot ethercat:veth-c --virtual-time --demo --config " + config.string() +
                              " --record-csv " + out.string());
}

TEST(EthercatOverVeth, ADemoWhoseBaseStaysBehindWithoutCompensationStopsItAndGoesOnWithTheOtherRun) {
  const Namespaces namespaces;
  SKIP_UNLESS(namespaces.usable(), "needs root and network namespaces");
  const support::TemporaryDirectory directory;
  const std::string leg = "[path]\n[[path.leg]]\nforward_m = 0.4\n";
  const Simulator simulator(namespaces, "--robot base --lock-step");
  ASSERT_TRUE(simulator.ready());

  const auto run = compare(directory.write("path.toml", leg), directory / "out");
  EXPECT_EQ(run.exit_code, 0) << run.output;
  EXPECT_TRUE(run.said("info: stopped at ")) << run.output;
  EXPECT_TRUE(run.said("more than allowed (limits.following_error_m = 0.15)")) << run.output;
  EXPECT_FALSE(run.said("error:")) << run.output;
  EXPECT_TRUE(run.said("the base never starts without compensation")) << run.output;
  EXPECT_TRUE(fs::exists(directory / "out/without/base.csv") && fs::exists(directory / "out/with/base.csv"));
}

TEST(EthercatOverVeth, ADemoWhoseBaseStaysBehindWithCompensationTooIsStoppedByAFault) {
  const Namespaces namespaces;
  SKIP_UNLESS(namespaces.usable(), "needs root and network namespaces");
  const support::TemporaryDirectory directory;
  const Simulator simulator(namespaces, "--robot base --lock-step");
  ASSERT_TRUE(simulator.ready());

  const auto run =
      compare(directory.write("tight.toml",
                              "[limits]\nfollowing_error_m = 0.005\n[path]\n[[path.leg]]\nforward_m = 0.4\n"),
              directory / "out");
  EXPECT_EQ(run.exit_code, 4) << run.output;
  EXPECT_TRUE(run.said("== with friction compensation")) << "a finding, and no reason to end: " << run.output;
  EXPECT_TRUE(run.said("error: stopped by a fault at ")) << run.output;
  EXPECT_FALSE(run.said("compensation            without")) << run.output;
}

TEST(EthercatOverVeth, ScanNamesEverySlaveAndTheRobot) {
  const Namespaces namespaces;
  SKIP_UNLESS(namespaces.usable(), "needs root and network namespaces");
  const Simulator simulator(namespaces, "--robot base+arm");
  ASSERT_TRUE(simulator.ready());
  const support::CommandResult scan =
      support::run_command(support::program("youbot-bench") + " scan --robot ethercat:veth-c");
  EXPECT_EQ(scan.exit_code, 0);
  EXPECT_TRUE(scan.said("this is a complete youBot: base+arm, simulated by youbot-sim")) << scan.output;
  EXPECT_TRUE(scan.said("KR-843")) << scan.output;
}

// Either would take the other's answers and reset its slaves.
TEST(EthercatOverVeth, NothingDisturbsTheMasterOfABusOrAnswersForItsSlavesTwice) {
  const Namespaces namespaces;
  SKIP_UNLESS(namespaces.usable(), "needs root and network namespaces");
  const Simulator simulator(namespaces, "--robot base");
  ASSERT_TRUE(simulator.ready());
  const support::TemporaryDirectory directory;
  const fs::path config = directory.write(
      "config.toml",
      "robot = \"ethercat:veth-c\"\n[ethercat]\ntolerated_cycles = 90\n"
      "[loop]\ncommand_timeout_s = 2.0\ncommander_timeout_s = 2.0\n[[path.leg]]\nforward_m = 1\n");
  const std::string daemon = support::program("youbotd") + " --allow-non-rt --config " + config.string();
  support::Process master({support::program("youbotd"), "--allow-non-rt", "--config", config, "--control",
                           directory / "control"});
  ASSERT_TRUE(master.wait_for("waiting for commands"));
  const std::string refusal =
      "veth-c: lock the interface: expected no other master on this bus, found youbotd (process " +
      std::to_string(master.pid()) + " of root)";
  for (const std::string& second :
       {daemon, daemon + " --check",
        std::string(support::program("youbot-bench") + " scan --robot ethercat:veth-c"),
        std::string(support::program("youbot-bench") + " diagnose --duration 0.1 --robot ethercat:veth-c")}) {
    // With the namespace's own /sys.
    const support::CommandResult result =
        support::run_command("ip netns exec " + namespaces.control_namespace() + " " + second);
    EXPECT_EQ(result.exit_code, 3) << result.output;
    EXPECT_TRUE(result.said(refusal)) << result.output;
  }
  const support::CommandResult twice =
      support::run_command("ip netns exec " + namespaces.sim_namespace() + " " +
                           support::program("youbot-sim") + " --interface veth-s");
  EXPECT_EQ(twice.exit_code, 3);
  EXPECT_TRUE(twice.said(
      "veth-s: lock the interface: expected no other emulator of slaves on it, found youbot-sim (process "))
      << twice.output;

  master.signal(SIGKILL);
  (void)master.finish();
  const support::CommandResult scan =
      support::run_command(support::program("youbot-bench") + " scan --robot ethercat:veth-c");
  EXPECT_EQ(scan.exit_code, 0) << scan.output;
}

/// A served base on veth-c, and its client.
struct ServedBase {
  ServedBase()
      : config(directory.write("config.toml",
                               "robot = \"ethercat:veth-c\"\n[ethercat]\ntolerated_cycles = 90\n"
                               "frame_timeout_s = 0.001\n[loop]\ncommand_timeout_s = "
                               "2.0\ncommander_timeout_s = 2.0\n[[path.leg]]\nforward_m = 1\n")),
        // youbotd writes fault reports to the directory for temporary files.
        daemon({"/usr/bin/env", "TMPDIR=" + directory.path().string(), support::program("youbotd"),
                "--allow-non-rt", "--config", config, "--control", directory / "control"}) {}

  support::CommandResult tell(const std::string& words) const {
    return support::run_command(support::program("youbotctl") + " --socket " +
                                (directory / "control").string() + " " + words);
  }
  nlohmann::json status() const {
    return nlohmann::json::parse(tell("status --json").output, nullptr, /*allow_exceptions=*/false);
  }

  support::TemporaryDirectory directory;
  fs::path config;
  support::Process daemon;
};

constexpr const char* kOtherMaster = "another EtherCAT master is on this bus (";

TEST(EthercatOverVeth, AnotherMasterThatIsAtWorkAlreadyKeepsEveryCommandAway) {
  const Namespaces namespaces;
  SKIP_UNLESS(namespaces.usable(), "needs root and network namespaces");
  const Simulator simulator(namespaces, "--robot base");
  ASSERT_TRUE(simulator.ready());
  const support::TemporaryDirectory directory;
  const fs::path config =
      directory.write("config.toml", "robot = \"ethercat:veth-c\"\n[[path.leg]]\nforward_m = 0.01\n");
  const support::OtherMaster other("veth-c");
  const std::string bench = support::program("youbot-bench");
  for (const std::string& command :
       {support::program("youbotd") + " --allow-non-rt --config " + config.string(),
        bench + " scan --robot ethercat:veth-c", bench + " diagnose --duration 0.1 --robot ethercat:veth-c",
        bench + " parameters --robot ethercat:veth-c"}) {
    support::CommandResult result;
    // A busy machine may starve the other master for as long as is listened for.
    for (int attempt = 0; attempt < 20 && !result.said(kOtherMaster); ++attempt)
      result = support::run_command(command);
    EXPECT_EQ(result.exit_code, 3) << command;
    EXPECT_TRUE(result.said(kOtherMaster)) << result.output;
    EXPECT_TRUE(result.said("frames from 01:01:01:01:01:01")) << result.output;
  }
}

TEST(EthercatOverVeth, AnotherMasterThatJoinsEndsTheRunByItsName) {
  const Namespaces namespaces;
  SKIP_UNLESS(namespaces.usable(), "needs root and network namespaces");
  const Simulator simulator(namespaces, "--robot base");
  ASSERT_TRUE(simulator.ready());
  ServedBase base;
  ASSERT_TRUE(base.daemon.wait_for("waiting for commands"));
  std::optional<support::OtherMaster> other(std::in_place, "veth-c");
  ASSERT_TRUE(base.daemon.wait_for("robot: bus: another EtherCAT master is on it: 01:01:01:01:01:01"));
  // While the other master is there, no run lasts.
  const support::CommandResult run = base.tell("enable");
  EXPECT_EQ(run.exit_code, 4) << run.output;
  const nlohmann::json status = base.status();
  ASSERT_TRUE(status.is_object());
  EXPECT_NE(status["fault"].dump().find(kOtherMaster), std::string::npos) << status.dump(2);
  EXPECT_NE(status["robot_state"].dump().find(kOtherMaster), std::string::npos) << status.dump(2);
  EXPECT_NE(status["robot_trouble"].dump().find("01:01:01:01:01:01"), std::string::npos) << status.dump(2);
  other.reset();
  EXPECT_TRUE(base.daemon.wait_for("robot: bus: works again"));
}

TEST(EthercatOverVeth, AnInterfaceThatWentDownIsNamedWithTheSystemsErrorAndWorksAgain) {
  const Namespaces namespaces;
  SKIP_UNLESS(namespaces.usable(), "needs root and network namespaces");
  const Simulator simulator(namespaces, "--robot base");
  ASSERT_TRUE(simulator.ready());
  ServedBase base;
  ASSERT_TRUE(base.daemon.wait_for("waiting for commands"));
  const auto stays_off = [&](const std::string& why) {
    EXPECT_TRUE(base.daemon.wait_for("robot: bus: " + why));
    EXPECT_EQ(base.tell("enable").exit_code, 4);
    const nlohmann::json status = base.status();
    ASSERT_TRUE(status.is_object());
    EXPECT_NE(status["fault"].dump().find(why), std::string::npos) << status.dump(2);
    EXPECT_NE(status["robot_state"].dump().find(why), std::string::npos) << status.dump(2);
    EXPECT_EQ(base.tell("acknowledge").exit_code, 0);
  };
  ASSERT_EQ(support::run_command("ip link set veth-c down").exit_code, 0);
  stays_off(
      "the network interface veth-c went down (ENETDOWN: Network is down): 'ip link set veth-c up', then "
      "enable again");
  ASSERT_EQ(support::run_command("ip link set veth-c up").exit_code, 0);
  EXPECT_TRUE(base.daemon.wait_for("robot: bus: works again"));
  EXPECT_TRUE(base.status()["bus"].is_object());

  ASSERT_EQ(support::run_command("ip link del veth-c").exit_code, 0);
  stays_off(
      "the network interface veth-c is gone (ENXIO: No such device or address): plug it in again, then "
      "restart "
      "this program");
}

// The last on the bus: without it everything else is still in reach.
constexpr const char* kWheelIsGone =
    "slave 5 (TMCM-1632): does not answer: check its power and the cable before it";

TEST(EthercatOverVeth, ServedItSaysWhichSlaveFailedAndWhatToCheck) {
  const Namespaces namespaces;
  SKIP_UNLESS(namespaces.usable(), "needs root and network namespaces");
  const support::TemporaryDirectory directory;
  const fs::path faults =
      directory.write("faults.toml", "[[fault]]\nkind = \"slave_off\"\nat_frame = 2500\nslave = 5\n");
  const Simulator simulator(namespaces, "--robot base --faults " + faults.string());
  ASSERT_TRUE(simulator.ready());
  ServedBase base;
  ASSERT_TRUE(base.daemon.wait_for("waiting for commands"));
  const support::CommandResult run = base.tell("enable");
  EXPECT_EQ(run.exit_code, 4) << run.output;
  // Unless this machine lost frames before, which is another fault.
  EXPECT_TRUE(base.daemon.wait_for(std::string("robot: ") + kWheelIsGone));
  EXPECT_EQ(base.tell("acknowledge").exit_code, 0);
  ASSERT_EQ(base.tell("enable").exit_code, 4);
  // On a busy machine others lose frames too: they have faults for a moment, and what failed meanwhile
  // stays.
  nlohmann::json status = base.status();
  const auto names_the_wheel = [&status] {
    if (!status.is_object()) return false;
    const nlohmann::json& of_robot = status["robot_trouble"];
    return std::find(of_robot.begin(), of_robot.end(), kWheelIsGone) != of_robot.end() &&
           status["robot_state"] == "wheel-4: some devices on the bus did not answer";
  };
  for (const auto end = std::chrono::steady_clock::now() + 60s;
       !names_the_wheel() && std::chrono::steady_clock::now() < end;)
    status = base.status();
  ASSERT_TRUE(names_the_wheel()) << status.dump(2);
  EXPECT_NE(status["fault_robot_report"].dump().find(kWheelIsGone), std::string::npos) << status.dump(2);
  EXPECT_TRUE(base.daemon.wait_for(std::string("robot says: ") + kWheelIsGone));
  const support::CommandResult words = base.tell("status");
  EXPECT_TRUE(words.said(kWheelIsGone)) << words.output;
}

TEST(EthercatOverVeth, ServedItSaysThatASlaveIsBack) {
  const Namespaces namespaces;
  SKIP_UNLESS(namespaces.usable(), "needs root and network namespaces");
  const support::TemporaryDirectory directory;
  const fs::path faults = directory.write(
      "faults.toml", "[[fault]]\nkind = \"slave_off\"\nat_frame = 2500\nduration_s = 3.0\nslave = 5\n");
  const Simulator simulator(namespaces, "--robot base --faults " + faults.string());
  ASSERT_TRUE(simulator.ready());
  ServedBase base;
  ASSERT_TRUE(base.daemon.wait_for(std::string("robot: ") + kWheelIsGone));
  ASSERT_TRUE(base.daemon.wait_for("robot: slave 5 (TMCM-1632): works again"));
}

}  // namespace ethercat_over_veth_test
