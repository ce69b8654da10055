// Findings of `youbotd --check`: on machines emulated by files, and on this one without rights.
#include "apps/youbotd/check.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "apps/youbotd/check_parts.h"
#include "drivers/station/key.h"
#include "hal/ethercat_robot.h"
#include "tests/drivers/ethercat_fakes.h"
#include "tests/support/built_paths.h"
#include "tests/support/other_master.h"
#include "tests/support/run_command.h"
#include "tests/support/skip.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/veth.h"

namespace youbotd {
namespace check_test {

using namespace std::chrono_literals;
namespace fs = std::filesystem;
using Mark = Finding::Mark;
using support::Namespaces;

bool says(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

/// A kernel that is a folder.
class Machine {
 public:
  const Machine& file(const std::string& name, const std::string& text) const {
    (void)folder_.write(name, text + "\n");
    return *this;
  }
  /// Up and with a carrier.
  const Machine& interface(const std::string& name) const {
    const std::string folder = "sys/class/net/" + name + "/";
    return file(folder + "type", "1").file(folder + "flags", "0x1003").file(folder + "carrier", "1");
  }
  drivers::usb::SystemPaths paths() const {
    return {.sys = folder_ / "sys", .proc = folder_ / "proc", .dev = folder_ / "dev", .rule_directories = {}};
  }

 private:
  support::TemporaryDirectory folder_;
};

const std::string kClocks = "sys/devices/system/clocksource/clocksource0/";

TEST(CheckMachine, OnlyPreemptRtBoundsALateCycle) {
  const Machine debian;
  debian.file("proc/version", "Linux version 6.1.0-18-rt-amd64 (x@y) #1 SMP PREEMPT_RT Debian 6.1.76");
  EXPECT_EQ(check_kernel(debian.paths()).mark, Mark::kOk);
  EXPECT_EQ(check_kernel(debian.paths()).found, "kernel: 6.1.0-18-rt-amd64, PREEMPT_RT");
  const Machine older;
  older.file("proc/version", "Linux version 5.10.0-rt (x@y) #1 SMP").file("sys/kernel/realtime", "1");
  EXPECT_EQ(check_kernel(older.paths()).mark, Mark::kOk);
  const Machine stock;
  stock.file("proc/version", "Linux version 6.1.0-18-amd64 (x@y) #1 SMP PREEMPT_DYNAMIC Debian 6.1.76");
  const Finding finding = check_kernel(stock.paths());
  EXPECT_EQ(finding.mark, Mark::kWarn);
  EXPECT_TRUE(says(finding.found, "preemptible but not PREEMPT_RT")) << finding.found;
  EXPECT_TRUE(says(finding.remedy, "linux-image-rt-")) << finding.remedy;
}

TEST(CheckMachine, ASlowClockIsWarnedOfAndTheBetterOneNamed) {
  const Machine machine;
  machine.file(kClocks + "current_clocksource", "tsc")
      .file(kClocks + "available_clocksource", "tsc hpet acpi_pm");
  EXPECT_EQ(check_clock_source(machine.paths()).mark, Mark::kOk);
  machine.file(kClocks + "current_clocksource", "hpet");
  const Finding hpet = check_clock_source(machine.paths());
  EXPECT_EQ(hpet.mark, Mark::kWarn);
  EXPECT_EQ(hpet.remedy, "echo tsc | sudo tee " +
                             (machine.paths().sys / kClocks.substr(4) / "current_clocksource").string());
  machine.file(kClocks + "current_clocksource", "acpi_pm")
      .file(kClocks + "available_clocksource", "hpet acpi_pm");
  EXPECT_TRUE(says(check_clock_source(machine.paths()).remedy, "dmesg"));
}

TEST(CheckMachine, ThrottlingMattersToALoopThatTakesACore) {
  const Machine machine;
  machine.file("proc/sys/kernel/sched_rt_runtime_us", "950000")
      .file("proc/sys/kernel/sched_rt_period_us", "1000000");
  EXPECT_EQ(check_throttling(false, machine.paths()).mark, Mark::kOk);
  const Finding busy = check_throttling(true, machine.paths());
  EXPECT_EQ(busy.mark, Mark::kWarn);
  EXPECT_TRUE(says(busy.found, "950 ms of each 1000 ms")) << busy.found;
  EXPECT_EQ(busy.remedy, "sudo sysctl kernel.sched_rt_runtime_us=-1");
  machine.file("proc/sys/kernel/sched_rt_runtime_us", "-1");
  EXPECT_EQ(check_throttling(true, machine.paths()).mark, Mark::kOk);
  machine.file("proc/sys/kernel/sched_rt_runtime_us", "0");
  EXPECT_EQ(check_throttling(false, machine.paths()).mark, Mark::kFail);
}

TEST(CheckMachine, OnlyTheCoresOfTheLoopHaveToKeepTheirClock) {
  const Machine machine;
  const std::string folder = "sys/devices/system/cpu/";
  machine.file(folder + "online", "0-1");
  EXPECT_EQ(check_governor({}, machine.paths()), std::nullopt) << "the kernel does not change it";
  machine.file(folder + "cpu0/cpufreq/scaling_governor", "powersave")
      .file(folder + "cpu1/cpufreq/scaling_governor", "performance");
  EXPECT_EQ(check_governor(1, machine.paths())->mark, Mark::kOk);
  const auto all = check_governor({}, machine.paths());
  EXPECT_EQ(all->mark, Mark::kWarn);
  EXPECT_TRUE(says(all->found, "performance on 1 core powersave on 1 core")) << all->found;
  const auto slow = check_governor(0, machine.paths());
  EXPECT_EQ(slow->remedy,
            "echo performance | sudo tee " +
                (machine.paths().sys / "devices/system/cpu/cpu0/cpufreq/scaling_governor").string());
}

TEST(CheckInterface, SaysWhatKeepsItFromBeingABus) {
  const Machine machine;
  machine.interface("eth7");
  const auto judge = [&](const std::string& name = "eth7") { return check_interface(name, machine.paths()); };
  EXPECT_EQ(judge().mark, Mark::kOk) << judge().found;
  EXPECT_EQ(judge("eth8").mark, Mark::kFail);
  EXPECT_TRUE(says(judge("eth8").found, "not there; there are eth7")) << judge("eth8").found;
  EXPECT_EQ(judge("../net/eth7").mark, Mark::kFail);

  machine.file("sys/class/net/eth7/carrier", "0");
  EXPECT_TRUE(says(judge().found, "nothing at the other end")) << judge().found;
  machine.file("sys/class/net/eth7/flags", "0x1002");
  EXPECT_TRUE(says(judge().found, "down")) << judge().found;
  EXPECT_EQ(judge().remedy, "sudo ip link set eth7 up");
  fs::create_symlink("../br0", machine.paths().sys / "class/net/eth7/master");
  EXPECT_TRUE(says(judge().found, "part of br0")) << judge().found;
  EXPECT_EQ(judge().remedy, "sudo ip link set eth7 nomaster");
  machine.file("sys/class/net/eth7/phy80211/name", "phy0");
  EXPECT_TRUE(says(judge().found, "wireless")) << judge().found;
  machine.file("sys/class/net/eth7/type", "772");
  EXPECT_TRUE(says(judge().found, "not Ethernet")) << judge().found;
  EXPECT_EQ(judge().mark, Mark::kFail);
}

TEST(CheckInterface, AnAddressMeansOtherTraffic) {
  const Namespaces namespaces;
  SKIP_UNLESS(namespaces.usable(), "needs root and network namespaces");
  EXPECT_EQ(check_addresses("veth-c").mark, Mark::kOk) << "what every interface gives itself does not count";
  ASSERT_EQ(support::run_command("ip address add 192.0.2.7/24 dev veth-c").exit_code, 0);
  const Finding finding = check_addresses("veth-c");
  EXPECT_EQ(finding.mark, Mark::kWarn);
  EXPECT_TRUE(says(finding.found, "192.0.2.7")) << finding.found;
  EXPECT_TRUE(says(finding.remedy, "flush dev veth-c")) << finding.remedy;
}

TEST(CheckMaster, OneThatIsNotThereFailsWithWhatToLookAt) {
  const Machine machine;
  runtime::HapticOptions options;
  EXPECT_TRUE(check_master(options, machine.paths()).empty()) << "the simulated handle is always there";
  options.name = "falcon";
  options.falcon.port_path = "9-9.9";  // where no machine has one
  const Findings falcon = check_master(options, machine.paths());
  ASSERT_EQ(falcon.size(), 1U);
  EXPECT_EQ(falcon[0].mark, Mark::kFail);
  EXPECT_TRUE(says(falcon[0].found, "no 0403:cb48 on the bus")) << falcon[0].found;
  EXPECT_TRUE(says(falcon[0].remedy, "lsusb")) << falcon[0].remedy;

  options.name = "spacemouse";
  options.space_mouse.choice.serial = "none has this";
  const Findings mouse = check_master(options, machine.paths());
  ASSERT_EQ(mouse.size(), 1U);
  EXPECT_EQ(mouse[0].mark, Mark::kFail);
  EXPECT_FALSE(mouse[0].remedy.empty());

  options.name = "force-dimension";
  options.force_dimension.sdk.file = "/nowhere/libdrd.so.3";
  const Findings omega = check_master(options, machine.paths());
  ASSERT_EQ(omega.size(), 2U) << "the library, and the device";
  EXPECT_EQ(omega[0].mark, Mark::kFail);
  EXPECT_TRUE(says(omega[0].found, "/nowhere/libdrd.so.3")) << omega[0].found;
  EXPECT_TRUE(says(omega[0].remedy, "FDSDK")) << omega[0].remedy;
  options.force_dimension.transport = hal::ForceDimensionTransport::kUsb;
  EXPECT_TRUE(says(check_master(options, machine.paths())[0].remedy, "transport = \"sdk\""));
}

TEST(CheckLink, NamesAKeyOrAnAddressThatCannotBeUsed) {
  const support::TemporaryDirectory folder;
  runtime::LinkOptions link;
  EXPECT_TRUE(check_link(runtime::Role::kBoth, link).empty());
  link.key_file = folder / "none";
  link.listen = "127.0.0.1:0";
  const Findings robot = check_link(runtime::Role::kRobot, link);
  ASSERT_EQ(robot.size(), 2U);
  EXPECT_EQ(robot[0].mark, Mark::kFail);
  EXPECT_TRUE(says(robot[0].remedy, "--make-key")) << robot[0].remedy;
  EXPECT_EQ(robot[1].mark, Mark::kOk) << robot[1].found;
  drivers::station::make_key_file(link.key_file);
  link.peer = "127.0.0.1";
  const Findings operating = check_link(runtime::Role::kOperator, link);
  ASSERT_EQ(operating.size(), 2U);
  EXPECT_EQ(operating[0].mark, Mark::kOk) << operating[0].found;
  EXPECT_EQ(operating[1].mark, Mark::kFail) << "no port";
  EXPECT_TRUE(says(operating[1].found, "127.0.0.1")) << operating[1].found;
}

TEST(CheckRecording, LooksWhereItWouldBeMadeAndLeavesNothing) {
  const support::TemporaryDirectory folder;
  EXPECT_NE(check_recording(folder / "runs/today", false, 1ms, {}).mark, Mark::kFail);
  EXPECT_TRUE(fs::is_empty(folder.path()));
  EXPECT_EQ(check_recording(folder.path(), true, 1ms, {}).mark, Mark::kFail);
  const fs::path file = folder.write("file", "");
  const Finding below_a_file = check_recording(file / "run", false, 1ms, {});
  EXPECT_EQ(below_a_file.mark, Mark::kFail);
  EXPECT_TRUE(says(below_a_file.found, "file is not a directory")) << below_a_file.found;
  EXPECT_FALSE(says(below_a_file.remedy, "install -d")) << below_a_file.remedy;
}

TEST(CheckRecording, RoomIsCountedInHours) {
  constexpr auto kCsv = runtime::RecordingFormat::kCsv;
  constexpr auto kMcap = runtime::RecordingFormat::kMcap;
  EXPECT_TRUE(says(check_room("/runs", 28.8e9, 1ms, kMcap).found, "room for 50.0 h at 0.6 GB/h"));
  EXPECT_EQ(check_room("/runs", 2e9, 1ms, kMcap).mark, Mark::kOk);
  EXPECT_EQ(check_room("/runs", 4.7e6, 1ms, kMcap).mark, Mark::kFail) << "no room for half a minute";
  EXPECT_EQ(check_room("/runs", 29e9, 1ms, kCsv).mark, Mark::kOk);
  EXPECT_TRUE(says(check_room("/runs", 28.8e9, 1ms, kCsv).found, "room for 10.0 h at 2.9 GB/h"));
  EXPECT_EQ(check_room("/runs", 2e9, 1ms, kCsv).mark, Mark::kWarn);
  EXPECT_EQ(check_room("/runs", 23e6, 1ms, kCsv).mark, Mark::kFail) << "no room for half a minute";
  EXPECT_EQ(check_room("/runs", 2e9, 10ms, kCsv).mark, Mark::kOk) << "a slower loop writes less";
}

TEST(CheckRecording, AdviceNamesWhatExists) {
  EXPECT_TRUE(says(check_room("/none/runs", 4.7e6, 1ms, {}).remedy, "df -h /;"));
}

TEST(CheckService, WhatAnotherProgramServesFails) {
  const support::TemporaryDirectory folder;
  EXPECT_EQ(check_control(folder / "s").mark, Mark::kOk);
  EXPECT_TRUE(fs::is_empty(folder.path()));
  folder.write("s", "");
  EXPECT_TRUE(says(check_control(folder / "s").found, "there is something else of that name"));
  EXPECT_TRUE(says(check_control(folder / "none/s").found, "there is no directory"));

  const Finding free = check_page("0");
  EXPECT_EQ(free.mark, Mark::kOk) << free.found;
  EXPECT_EQ(check_page("192.0.2.1:8765").mark, Mark::kFail) << "an address of documents, of no machine";
  EXPECT_THROW((void)check_page("somewhere"), std::invalid_argument);
}

TEST(CheckReport, AProblemIsFollowedByWhatToDo) {
  const Findings findings{{Mark::kOk, "clock source: tsc", ""},
                          {Mark::kWarn, "kernel: old", "apt install new"}};
  EXPECT_EQ(report(findings, false),
            "ok    clock source: tsc\nwarn  kernel: old\n      apt install new\n2 checks: 0 FAIL, 1 warn\n");
  EXPECT_EQ(report(findings, true), "warn  kernel: old\n      apt install new\n");
  EXPECT_TRUE(passed(findings));
  EXPECT_FALSE(passed({{Mark::kFail, "core: 7", "lscpu"}}));
}

// The complete program.

const std::string kCheck =
    support::program("youbotd") + " --check --config " + support::source_dir() + "/apps/youbotd/demo.toml ";

TEST(CheckCommand, SimulationInVirtualTimeNeedsNothingOfTheMachine) {
  const support::CommandResult result = support::run_command(kCheck + "--virtual-time");
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_EQ(result.output, "ok    configuration: loopback\n1 check: 0 FAIL, 0 warn\n");
}

TEST(CheckCommand, TheArmsRobotFileIsReportedWithWhatWasTakenFromIt) {
  const support::TemporaryDirectory folder;
  std::ifstream given(support::source_dir() + "/control/youbot_arm.toml");
  std::string text{std::istreambuf_iterator<char>(given), std::istreambuf_iterator<char>()};
  std::filesystem::copy_file(support::source_dir() + "/control/youbot.urdf", folder / "youbot.urdf");
  folder.write("arm.toml", text +
                               "[[link]]\nname = \"arm_link_2\"\nmass_kg = 1.5\n"
                               "[payload]\nmass_kg = 0.25\ncentre_m = [0, 0, 0.02]\n");
  const std::string config = folder
                                 .write("lab.toml",
                                        "[ethercat]\nkind = \"base+arm\"\n[teleoperation.arm]\n"
                                        "robot_file = \"arm.toml\"\n")
                                 .string();
  const support::CommandResult result =
      support::run_command(support::program("youbotd") + " --check --virtual-time --config " + config);
  EXPECT_EQ(result.exit_code, 0) << result.output;
  for (const std::string& line :
       {"ok    arm: robot file " + (folder / "arm.toml").string(),
        std::string("ok    arm: arm_link_2: mass 1.155 -> 1.5 kg"),
        std::string("ok    arm: payload: 0.250 kg at 0.0000, 0.0000, 0.0200 m from the tip"),
        std::string("ok    arm: Coulomb friction of joints 1 to 5: 0.900, 0.900, 0.500, 0.350, 0.250 N·m")})
    EXPECT_TRUE(result.said(line)) << result.output << "lacks: " << line;
}

TEST(CheckCommand, ASimulatedArmIsReportedAndNeedsTheRobotOfTheCommandLine) {
  const support::TemporaryDirectory folder;
  const std::string config =
      folder
          .write("lab.toml",
                 "robot = \"ethercat:eth0\"\n[ethercat]\nkind = \"base+arm\"\n[simulation]\nrobot_file = \"" +
                     support::source_dir() + "/control/youbot_arm.toml\"\n")
          .string();
  const std::string check = support::program("youbotd") + " --check --virtual-time --config " + config;
  const support::CommandResult simulated = support::run_command(check + " --robot loopback");
  EXPECT_EQ(simulated.exit_code, 0) << simulated.output;
  EXPECT_TRUE(simulated.said("ok    simulated arm: Coulomb friction of joints 1 to 5: 0.900"))
      << simulated.output;
  const support::CommandResult real = support::run_command(check);
  EXPECT_EQ(real.exit_code, 2) << real.output;
  EXPECT_TRUE(real.said(config + ": 'simulation.robot_file' is for the robots loopback and wire"))
      << real.output;
}

TEST(CheckCommand, AConfigurationThatNoRunAcceptsIsAUsageError) {
  const support::TemporaryDirectory folder;
  const std::string bad = folder.write("bad.toml", "robbot = \"loopback\"\n").string();
  EXPECT_EQ(support::run_command(support::program("youbotd") + " --check --config " + bad).exit_code, 2);
  const support::CommandResult one_joint = support::run_command(kCheck + "--robot can:can0");
  EXPECT_EQ(one_joint.exit_code, 2);
  EXPECT_TRUE(one_joint.said("four wheels")) << one_joint.output;
  EXPECT_EQ(support::run_command(kCheck + "--robot wire --haptic phantom").exit_code, 2);
}

TEST(CheckCommand, WithoutRightsItFailsAndNamesTheCommandThatGivesThem) {
  SKIP_UNLESS(geteuid() == 0, "needs root, to take its rights away");
  const std::string without =
      "setpriv --bounding-set=-sys_nice,-ipc_lock,-sys_resource prlimit --memlock=0 --rtprio=0 ";
  const support::CommandResult result = support::run_command(without + kCheck);
  EXPECT_EQ(result.exit_code, 3) << result.output;
  EXPECT_TRUE(result.said("FAIL  priority: SCHED_FIFO 80 for the cycle")) << result.output;
#ifndef YOUBOT_SANITIZED  // the address sanitizer makes locking a call that does nothing
  EXPECT_TRUE(result.said("FAIL  memory lock")) << result.output;
#endif
  EXPECT_TRUE(result.said("setcap cap_net_raw,cap_sys_nice,cap_ipc_lock+ep " +
                          fs::canonical(support::program("youbotd")).string()))
      << result.output;
  const support::CommandResult waived = support::run_command(without + kCheck + "--allow-non-rt");
  EXPECT_EQ(waived.exit_code, 0) << waived.output;
  EXPECT_TRUE(waived.said("warn  priority: SCHED_FIFO 80 for the cycle")) << waived.output;
}

TEST(CheckCommand, ChecksWhatItWouldServe) {
  const support::TemporaryDirectory folder;
  const support::CommandResult result = support::run_command(
      kCheck + "--allow-non-rt --page 192.0.2.1:8765 --control " + (folder / "none/s").string());
  EXPECT_EQ(result.exit_code, 3) << result.output;
  EXPECT_TRUE(result.said("FAIL  control socket ")) << result.output;
  EXPECT_TRUE(result.said("FAIL  page at 192.0.2.1:8765: ")) << result.output;
}

TEST(CheckCommand, JoinsTheDomainThatItWouldPublishTo) {
  const std::string on_interface = "CYCLONEDDS_URI='<General><Interfaces><NetworkInterface name=\"";
  const std::string end = "\"/></Interfaces></General>' ";
  const support::CommandResult free =
      support::run_command(on_interface + "lo" + end + kCheck + "--allow-non-rt --ros2 77");
  EXPECT_TRUE(free.said("ok    ros2: domain 77 can be joined")) << free.output;
  const support::CommandResult result =
      support::run_command(on_interface + "nosuch0" + end + kCheck + "--allow-non-rt --ros2 77");
  EXPECT_EQ(result.exit_code, 3) << result.output;
  EXPECT_TRUE(result.said("FAIL  ros2: ")) << result.output;
}

TEST(CheckCommand, ABusMayHaveAnotherPeriod) {
  const support::TemporaryDirectory folder;
  const std::string slow =
      folder.write("slow.toml", "[loop]\nperiod_s = 0.002\n[[path.leg]]\nforward_m = 1\n");
  const support::CommandResult result = support::run_command(
      support::program("youbotd") + " --check --robot ethercat:nosuch0 --config " + slow);
  EXPECT_EQ(result.exit_code, 3) << result.output;
  EXPECT_TRUE(result.said("nosuch0")) << result.output;
}

TEST(CheckCommand, ACoreThatIsNotThereIsNamed) {
  const Finding finding = check_core(CPU_SETSIZE - 1, Mark::kFail);
  EXPECT_EQ(finding.mark, Mark::kFail);
  EXPECT_TRUE(says(finding.found, "core: 1023")) << finding.found;
}

TEST(CheckDevices, NamesAForeignOneBeforeAnythingChangesItsState) {
  namespace ethercat = drivers::ethercat;
  std::vector<sim::bus::SlaveDescription> slaves = ethercat::test::youbot();
  const auto look = [](const std::vector<sim::bus::SlaveDescription>& bus, hal::YoubotKind kind) {
    ethercat::test::EmulatedRobot robot(bus);
    const Finding finding = check_devices(robot.connect({.timed = true}), kind);
    for (std::size_t i = 0; i < bus.size(); ++i) EXPECT_EQ(robot.state(i), ethercat::AlState::kInit) << i;
    return finding;
  };
  EXPECT_EQ(look(slaves, hal::YoubotKind::kBaseAndArm).mark, Mark::kOk);
  EXPECT_EQ(look(slaves, hal::YoubotKind::kBase).mark, Mark::kOk) << "the arm's drives stay off";

  const Finding two_arms = look(slaves, hal::YoubotKind::kBaseAndTwoArms);
  EXPECT_EQ(two_arms.mark, Mark::kFail);
  EXPECT_TRUE(says(two_arms.found, "power board of the second arm: check the bus: missing"))
      << two_arms.found;

  slaves.push_back(slaves.back());
  slaves.back().name = "AX5203";
  slaves.back().vendor = 2;
  const Finding stranger = look(slaves, hal::YoubotKind::kBaseAndArm);
  EXPECT_EQ(stranger.mark, Mark::kFail);
  EXPECT_TRUE(says(stranger.found,
                   "slave 12 (AX5203): check that it is a youBot's board: it is another "
                   "device (vendor 0x00000002"))
      << stranger.found;
}

TEST(CheckCommand, ABusIsOpenedAsTheMasterDoes) {
  const Namespaces namespaces;
  SKIP_UNLESS(namespaces.usable(), "needs root and network namespaces");
  // It shows /sys as that namespace has it.
  const std::string there = "ip netns exec " + namespaces.control_namespace() + " ";
  const std::string bus = kCheck + "--allow-non-rt --robot ethercat:veth-c";
  const support::CommandResult nothing = support::run_command(there + bus);
  EXPECT_EQ(nothing.exit_code, 3) << nothing.output;
  EXPECT_TRUE(nothing.said("ok    raw socket: opens on veth-c")) << nothing.output;
  EXPECT_TRUE(nothing.said("FAIL  devices on veth-c: veth-c: exchange frames: no frame comes back"))
      << nothing.output;
  {
    const support::Simulator simulator(namespaces, "--robot base");
    ASSERT_TRUE(simulator.ready());
    const support::CommandResult ready = support::run_command(there + bus);
    EXPECT_EQ(ready.exit_code, 0) << ready.output;
    EXPECT_TRUE(ready.said("ok    interface veth-c")) << ready.output;
    EXPECT_TRUE(ready.said("ok    devices on veth-c: 5, all of them a youBot's boards")) << ready.output;
    const support::OtherMaster other("veth-c");
    support::CommandResult shared;
    // A busy machine may starve the other master for as long as is listened for.
    for (int attempt = 0; attempt < 20 && !shared.said("another EtherCAT master"); ++attempt)
      shared = support::run_command(there + bus);
    EXPECT_EQ(shared.exit_code, 3) << shared.output;
    EXPECT_TRUE(shared.said("another EtherCAT master is on this bus (")) << shared.output;
    EXPECT_TRUE(shared.said("take its computer off the bus")) << shared.output;
    EXPECT_FALSE(shared.said("setcap")) << shared.output;
  }

  const support::CommandResult denied =
      support::run_command(there + "setpriv --bounding-set=-net_raw " + bus + " --quiet");
  EXPECT_EQ(denied.exit_code, 3) << denied.output;
  EXPECT_TRUE(denied.said("FAIL  raw socket")) << denied.output;
  EXPECT_TRUE(denied.said("setcap cap_net_raw")) << denied.output;
  EXPECT_FALSE(denied.said("ok  ")) << denied.output;

  ASSERT_EQ(support::run_command("ip link set veth-c down").exit_code, 0);
  const support::CommandResult down = support::run_command(there + bus);
  EXPECT_EQ(down.exit_code, 3) << down.output;
  EXPECT_TRUE(down.said("sudo ip link set veth-c up")) << down.output;
  EXPECT_FALSE(down.said("raw socket")) << down.output;
}

}  // namespace check_test
}  // namespace youbotd
