// youbot-bench parameters --set on the emulated controllers, over EtherCAT and CAN; and the values of --robot
// for scan, parameters and diagnose.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "apps/youbot_bench/controllers.h"
#include "apps/youbot_bench/diagnose.h"
#include "apps/youbot_bench/parameters.h"
#include "drivers/ethercat/op_bus.h"
#include "drivers/ethercat/pre_op_bus.h"
#include "drivers/setup_error.h"
#include "drivers/tmcl/can_transport.h"
#include "hal/clock.h"
#include "hal/ethercat_robot.h"
#include "hal/setup_error.h"
#include "sim/bus/bus_link.h"
#include "sim/bus/youbot_bus.h"
#include "tests/drivers/ethercat_fakes.h"
#include "tests/hal/can_bench.h"
#include "tests/support/built_paths.h"
#include "tests/support/run_command.h"

namespace youbot_bench {
namespace youbot_bench_parameters_test {

using namespace std::chrono_literals;
namespace ethercat = drivers::ethercat;
namespace tmcl = drivers::tmcl;
using support::CommandResult;
using tmcl::Command;

constexpr std::uint8_t kAcceleration = 11;  // motor_acceleration; the emulated boards' is 2000
const std::vector<NewParameter> kSlower{{.name = "motor_acceleration", .value = 1500}};

/// The message of its exception.
template <typename Error, typename Action>
std::string refusal(Action&& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

struct ParametersOfABase : testing::Test {
  /// The output of one run of the program.
  std::string write(bool store, const std::vector<NewParameter>& settings = kSlower) {
    ethercat::PreOpBus setup(link, nullptr, {});
    std::vector<Controller> controllers = controllers_of(setup, link.name());
    testing::internal::CaptureStdout();
    tmcl::SteadyClock clock;
    try {
      write_parameters(controllers, settings, store, clock);
    } catch (...) {
      printed = testing::internal::GetCapturedStdout();
      throw;
    }
    return testing::internal::GetCapturedStdout();
  }
  std::int32_t acceleration(std::size_t joint) { return robot.board(joint).parameters()[kAcceleration]; }
  void command(std::size_t joint, Command command, std::uint8_t type, std::int32_t value) {
    (void)robot.board(joint).execute({.command = command, .type = type, .value = value});
  }
  void switch_power_off_and_on() {
    for (const bool on : {false, true}) {
      for (std::size_t i = 0; i < robot.joint_count(); ++i) robot.bus().set_power(robot.position(i), on);
      robot.advance(10ms);
    }
  }
  std::string refused() {
    return refusal<hal::SetupError>([this] { (void)write(false); });
  }

  sim::bus::YoubotBus robot;
  sim::bus::BusLink link{robot.wire(), &robot};
  std::string printed;
};

// ---- strangers on the bus ----

/// A servo drive in place of a wheel, and the writes to it.
struct BusWithAStranger : testing::Test {
  BusWithAStranger() {
    link.on_send = [this](ethercat::test::Bytes& frame) {
      (void)ethercat::test::find_datagram(frame, [this](const ethercat::Datagram& datagram) {
        using enum ethercat::Command;
        const bool writes = datagram.command != kNop && datagram.command != kAprd &&
                            datagram.command != kFprd && datagram.command != kBrd;
        if (writes) written.insert(datagram.offset());
        return false;
      });
      return false;
    };
  }
  void expect_left_alone(const std::string& error) {
    EXPECT_TRUE(contains(error,
                         "slave 3 (AX5203): check that it is a youBot's board: it is another device (vendor "
                         "0x00000002, product 0x14536012)"))
        << error;
    for (std::size_t i = 0; i < robot.boards.size(); ++i) {
      EXPECT_EQ(robot.state(i), ethercat::AlState::kInit) << i;
      EXPECT_EQ(robot.board(i).executed, 0) << i;
    }
    // Only what the scan needs: addresses, and the interface to the EEPROM.
    for (const std::uint16_t address :
         {ethercat::reg::kStationAddress, ethercat::reg::kSiiConfiguration, ethercat::reg::kSiiControl})
      written.erase(address);
    EXPECT_TRUE(written.empty()) << *written.begin();
  }
  static std::vector<sim::bus::SlaveDescription> slaves() {
    std::vector<sim::bus::SlaveDescription> slaves = ethercat::test::youbot();
    slaves[2].name = "AX5203";
    slaves[2].vendor = 2;
    slaves[2].product = 0x14536012;
    return slaves;
  }

  ethercat::test::EmulatedRobot robot{slaves()};
  ethercat::test::MeddlingLink link{robot.connect({.timed = true})};
  std::set<std::uint16_t> written;
};

TEST_F(BusWithAStranger, ParametersRefusesItByNameAndPostsNothing) {
  ethercat::PreOpBus setup(link, nullptr, {});
  expect_left_alone(refusal<ethercat::BusError>([&] { (void)controllers_of(setup, link.name()); }));
}

TEST_F(BusWithAStranger, DiagnoseRefusesItByNameAndTakesNothingToOp) {
  hal::VirtualClock clock;
  const std::atomic<bool> stop = false;
  expect_left_alone(refusal<ethercat::BusError>([&] { (void)print_diagnosis(link, clock, {}, stop); }));
}

// The names of a youBot's boards, and not their maker.
TEST(RobotWithAStranger, IsNotStarted) {
  std::vector<sim::bus::SlaveDescription> slaves = ethercat::test::youbot();
  slaves[2].vendor = 2;
  ethercat::test::EmulatedRobot bus(slaves);
  (void)bus.connect({.timed = true});
  const hal::VirtualClock clock;
  const auto robot = hal::make_ethercat_robot([&] { return std::make_unique<sim::bus::BusLink>(*bus.wire); },
                                              {}, clock, 1ms);
  const std::string error = refusal<hal::SetupError>([&] { robot->activate(); });
  EXPECT_TRUE(contains(error, "slave 3 (TMCM-1632): check that it is a youBot's board")) << error;
  for (std::size_t i = 0; i < bus.boards.size(); ++i) EXPECT_EQ(bus.state(i), ethercat::AlState::kInit) << i;
}

TEST_F(ParametersOfABase, ASettingGoesWithThePowerAndAStoredOneStays) {
  const std::string once = write(false);
  EXPECT_TRUE(contains(once,
                       "slave 2 (TMCM-1632), wheel-1: motor_acceleration was 2000, is 1500 rpm/s until it "
                       "loses its power\n"))
      << once;
  EXPECT_TRUE(contains(once, "wheel-4: motor_acceleration was 2000, is 1500")) << once;
  EXPECT_FALSE(contains(once, "EEPROM")) << once;
  EXPECT_EQ(acceleration(0), 1500);
  switch_power_off_and_on();
  EXPECT_EQ(acceleration(0), 2000);

  const std::string for_good = write(true);
  EXPECT_TRUE(contains(for_good, "wheel-1: motor_acceleration is kept in its EEPROM\n")) << for_good;
  switch_power_off_and_on();
  for (std::size_t wheel = 0; wheel < 4; ++wheel) EXPECT_EQ(acceleration(wheel), 1500);
}

// Position mode represents current and PWM mode, too.
TEST_F(ParametersOfABase, NothingIsWrittenWhileOneOfThemIsDriven) {
  command(2, Command::kMoveToPosition, 0, 4000);
  robot.advance(10ms);
  const std::string message = refused();
  EXPECT_TRUE(contains(message, "slave 4 (TMCM-1632), wheel-3: check that it is off: it is being driven"))
      << message;
  for (std::size_t wheel = 0; wheel < 4; ++wheel) EXPECT_EQ(acceleration(wheel), 2000);
}

TEST_F(ParametersOfABase, NothingIsWrittenWhileAMotorTurnsAndAllIsWhenItStands) {
  robot.set_on_ground(false);                     // else it takes the others with it
  command(1, Command::kSetAxisParameter, 15, 1);  // finds its commutation
  robot.advance(1s);
  // A drive reports halted when it is slower than its parameter 9, also for a blocked wheel.
  for (const auto& [rpm, why] :
       {std::pair{500, "its motor turns"}, std::pair{3, "it is commanded to turn at 3 rpm"}}) {
    command(1, Command::kRotateRight, 0, rpm);
    robot.advance(1s);
    const std::string message = refused();
    EXPECT_TRUE(contains(message, std::string("wheel-2: check that it is off: ") + why)) << message;
    EXPECT_EQ(acceleration(0), 2000);
    command(1, Command::kMotorStop, 0, 0);
    robot.advance(2s);
  }
  EXPECT_EQ(refused(), "");
  EXPECT_EQ(acceleration(0), 1500);
}

TEST_F(ParametersOfABase, NothingIsWrittenToADriveThatHoldsItsPlaceSinceItsMasterIsGone) {
  {
    ethercat::PreOpBus setup(link, nullptr, {});
    setup.enter_pre_op();
    ethercat::OpBus bus = std::move(setup).start();
    for (int cycle = 0; cycle < 5; ++cycle) {
      (void)bus.exchange(robot.wire().now());
      robot.advance(1ms);
    }
  }
  robot.advance(1s);
  const std::string message = refused();
  EXPECT_TRUE(contains(message, "wheel-1: check that it is off: its watchdog expired")) << message;
  EXPECT_EQ(acceleration(0), 2000);
  switch_power_off_and_on();
  EXPECT_EQ(refused(), "");
  EXPECT_EQ(acceleration(0), 1500);
}

TEST_F(ParametersOfABase, ARefusalOfAControllerIsReportedInItsWordsWithWhatWasDoneBefore) {
  constexpr std::uint8_t kEepromLock = 73;
  command(1, Command::kSetGlobalParameter, kEepromLock, 1234);
  const std::string message = refusal<drivers::SetupError>([this] { (void)write(true); });
  EXPECT_TRUE(contains(message, "slave 3 (TMCM-1632): store motor_acceleration (11)")) << message;
  EXPECT_TRUE(contains(message, "status 5 (")) << message;
  EXPECT_TRUE(contains(printed, "wheel-1: motor_acceleration is kept in its EEPROM")) << printed;
  EXPECT_TRUE(contains(printed, "wheel-2: motor_acceleration was 2000, is 1500")) << printed;
  EXPECT_FALSE(contains(printed, "wheel-3")) << printed;
}

TEST_F(ParametersOfABase, WithoutAWheelJointsAreSlaves) {
  robot.bus().set_cable(robot.position(3), false);
  ethercat::PreOpBus setup(link, nullptr, {});
  const std::vector<Controller> controllers = controllers_of(setup, link.name());
  ASSERT_EQ(controllers.size(), 3U);
  EXPECT_EQ(controllers.front().joint, "slave-2");
  EXPECT_EQ(controllers.back().joint, "slave-4");
}

TEST(ParametersOfABenchRig, AreSetOverCanToo) {
  sim::can::BenchRig rig;
  hal::test::CanCable cable(rig);
  std::vector<Controller> controllers;
  controllers.push_back({.number = 1,
                         .name = "module",
                         .joint = "wheel-1",
                         .transport = std::make_unique<tmcl::CanTransport>(cable.open())});
  const auto write = [&](bool store) {
    testing::internal::CaptureStdout();
    const std::string message =
        refusal<hal::SetupError>([&] { write_parameters(controllers, kSlower, store, cable); });
    return testing::internal::GetCapturedStdout() + message;
  };
  const std::string done = write(true);
  EXPECT_TRUE(contains(done, "wheel-1: motor_acceleration was 2000, is 1500 rpm/s until it loses its power"))
      << done;
  EXPECT_TRUE(contains(done, "wheel-1: motor_acceleration is kept in its EEPROM")) << done;
  rig.set_power(false);
  rig.set_power(true);
  EXPECT_EQ(rig.board().parameters()[kAcceleration], 1500);

  (void)rig.board().execute({.command = Command::kMoveToPosition, .type = 0, .value = 4000});
  cable.wait(10ms);
  EXPECT_TRUE(contains(write(false), "it is being driven"));
}

TEST(ParameterSetting, IsRefusedBeforeAnythingIsSentWhenNoDriveWouldTakeIt) {
  EXPECT_EQ(read_setting("motor_acceleration=1500", true).value, 1500);
  EXPECT_EQ(read_setting("position_control_switching_threshold=-3", true).value, -3);
  const auto said = [](const std::string& text, bool store = false) {
    return refusal<std::invalid_argument>([&] { (void)read_setting(text, store); });
  };
  for (const char* text : {"motor_acceleration", "motor_acceleration=", "motor_acceleration=fast",
                           "motor_acceleration=1500.5", "motor_acceleration=99999999999", "=1", ""})
    EXPECT_TRUE(contains(said(text), "--set: '")) << text;
  EXPECT_TRUE(contains(said("motor_acceleraton=1500"), "is unknown to the drives"));
  EXPECT_TRUE(contains(said("motor_acceleration=-1"), "must be 0 to 100000, not -1"));
  EXPECT_TRUE(contains(said("actual_speed=1"), "can only be read"));
  EXPECT_TRUE(contains(said("target_speed=100"), "is a command, not a setting"));
  EXPECT_TRUE(contains(said("maximum_motor_current=1000"), "is protected by the manufacturer's password"));
  EXPECT_EQ(said("pwm_limit=100"), "");
  EXPECT_TRUE(contains(said("pwm_limit=100", true), "--store: 'pwm_limit' is not kept in EEPROM"));
}

CommandResult bench(const std::string& arguments) {
  return support::run_command(support::program("youbot-bench") + " " + arguments);
}

TEST(YoubotBenchBus, TheEmulatedRobotIsABusLikeAnyOther) {
  const CommandResult scan = bench("scan --robot wire");
  EXPECT_EQ(scan.exit_code, 0) << scan.output;
  EXPECT_TRUE(scan.said("this is a complete youBot: base+arm")) << scan.output;
  const CommandResult parameters = bench("parameters --robot wire --joint arm-5");
  EXPECT_EQ(parameters.exit_code, 0) << parameters.output;
  EXPECT_TRUE(parameters.said("\n11,TMCM-1610,148,11,motor_acceleration,2000,rpm/s\n")) << parameters.output;
  EXPECT_FALSE(parameters.said("TMCM-1632")) << parameters.output;
  const CommandResult diagnosis = bench("diagnose --robot wire --duration 0.5 --quiet");
  EXPECT_EQ(diagnosis.exit_code, 0) << diagnosis.output;
}

TEST(YoubotBenchBus, WhatHasNoSuchBusIsRefusedWithWhatHas) {
  for (const char* command : {"scan", "diagnose"})
    for (const char* robot : {"loopback", "can:can0"}) {
      const CommandResult result = bench(std::string(command) + " --robot " + robot);
      EXPECT_EQ(result.exit_code, 2) << result.output;
      EXPECT_TRUE(result.said("needs an EtherCAT bus, wire or ethercat:IFACE")) << result.output;
    }
  EXPECT_EQ(bench("parameters --robot loopback").exit_code, 2);
  const CommandResult rig = bench("parameters --robot can:nosuchif0");
  EXPECT_EQ(rig.exit_code, 3) << rig.output;
  EXPECT_TRUE(rig.said("nosuchif0")) << rig.output;
}

TEST(YoubotBenchBus, ParametersAreSetOfJointsThatAreNamed) {
  const CommandResult set =
      bench("parameters --robot wire --joint wheel-1,arm-5 --set motor_acceleration=1500");
  EXPECT_EQ(set.exit_code, 0) << set.output;
  EXPECT_TRUE(set.said("wheel-1: motor_acceleration was 2000, is 1500")) << set.output;
  EXPECT_TRUE(set.said("arm-5: motor_acceleration was 2000, is 1500")) << set.output;
  EXPECT_FALSE(set.said("wheel-2")) << set.output;
  const CommandResult which = bench("parameters --robot wire --set motor_acceleration=1500");
  EXPECT_EQ(which.exit_code, 2) << which.output;
  EXPECT_TRUE(which.said("--set: of which --joint? There are wheel-1, ")) << which.output;
  const CommandResult twice = bench(
      "parameters --robot wire --joint wheel-1 --set motor_acceleration=1500 --set motor_acceleration=1600");
  EXPECT_EQ(twice.exit_code, 2) << twice.output;
  EXPECT_TRUE(twice.said("--set: 'motor_acceleration' is given twice")) << twice.output;
  const CommandResult none = bench("parameters --robot wire --joint elbow");
  EXPECT_EQ(none.exit_code, 2) << none.output;
  EXPECT_TRUE(none.said("--joint: there is no 'elbow'; known: wheel-1, ")) << none.output;
}

}  // namespace youbot_bench_parameters_test
}  // namespace youbot_bench
