// The whole real stack, byte by byte, against emulated boards in virtual time.
#include "hal/ethercat_robot.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "drivers/ethercat/frame_tap.h"
#include "drivers/ethercat/lock_step_link.h"
#include "drivers/ethercat/simulated_bus.h"
#include "drivers/tmcl/axis_parameters.h"
#include "hal/setup_error.h"
#include "hal/youbot_axes.h"
#include "sim/bus/bus_link.h"
#include "sim/bus/sii_image.h"
#include "tests/hal/ethercat_rig.h"
#include "tests/support/no_alloc_guard.h"

namespace hal {
namespace ethercat_robot_test {

using namespace std::chrono_literals;
using drivers::tmcl::Firmware;
using sim::bus::FaultEvent;
using sim::bus::FaultKind;
using std::chrono::nanoseconds;
using Rig = test::EthercatRig;

TEST(EthercatRobot, NamesItsJointsInBusOrderWithTheirTorqueLimits) {
  const Rig rig(YoubotKind::kBaseAndArm);
  const auto joints = rig.robot->joints();
  ASSERT_EQ(joints.size(), 9U);
  EXPECT_EQ(joints[0].name, "wheel-1");
  EXPECT_EQ(joints[3].name, "wheel-4");
  EXPECT_EQ(joints[4].name, "arm-1");
  EXPECT_EQ(joints[8].name, "arm-5");
  EXPECT_NEAR(joints[0].torque_limit_Nm, 2.85 * 0.0335 * 9405 / 364, 1e-9);
  EXPECT_NEAR(joints[8].torque_limit_Nm, 1.0 * 0.049 * 71, 1e-9);
  EXPECT_EQ(joints[0].speed_limit_rad_per_s, 16.2);
  EXPECT_EQ(joints[8].speed_limit_rad_per_s, 1.57);
  EXPECT_EQ(joints[8].rated_torque_Nm, 1.0);
  EXPECT_EQ(joints[5].range.upper_rad, kArmAxes[1].range.upper_rad);
  EXPECT_FALSE(joints[0].range.limited());
}

class EthercatRobotKinds : public ::testing::TestWithParam<std::tuple<YoubotKind, Firmware>> {};

TEST_P(EthercatRobotKinds, StartsCommutatesAndTurnsEveryJointInTheCommandedDirection) {
  const auto [kind, firmware] = GetParam();
  Rig rig(kind, firmware);
  rig.robot->activate();
  rig.run(20ms);
  EXPECT_FALSE(rig.sample.enabled) << "nothing moves before it is enabled";
  rig.enable();

  std::array<double, kMaxJoints> before{};
  const std::size_t joints = rig.robot->joints().size();
  for (std::size_t i = 0; i < joints; ++i) before[i] = rig.sample.joints[i].position_rad;
  // Arm joints stand at their start, close to one end of their range: towards its middle.
  for (std::size_t i = 0; i < joints; ++i) {
    const double direction = rig.robot->joints()[i].name.ends_with("-3") && joints != 4 ? -1.0 : 1.0;
    rig.command.joints[i] = JointCommand::velocity_rad_per_s(direction * 0.5);
  }
  rig.run(1s);
  EXPECT_TRUE(rig.status.ok());
  for (std::size_t i = 0; i < joints; ++i) {
    const double moved = rig.sample.joints[i].position_rad - before[i];
    // 0.5 rad/s for a second less the ramp up to it (the boards' acceleration limit).
    EXPECT_GT(std::copysign(1.0, rig.command.joints[i].target) * moved, 0.2) << rig.robot->joints()[i].name;
    EXPECT_LT(std::abs(moved), 0.6) << rig.robot->joints()[i].name;
  }
}
INSTANTIATE_TEST_SUITE_P(AllRobotsAndFirmwares, EthercatRobotKinds,
                         ::testing::Combine(::testing::Values(YoubotKind::kBase, YoubotKind::kArm,
                                                              YoubotKind::kBaseAndArm,
                                                              YoubotKind::kBaseAndTwoArms),
                                            ::testing::Values(Firmware::k148, Firmware::k200)));

TEST(EthercatRobot, TorqueGoesOutAndComesBackAsTorque) {
  Rig rig;
  rig.robot->activate();
  rig.enable();
  for (std::size_t i = 0; i < 4; ++i) rig.command.joints[i] = JointCommand::torque_Nm(0.3);
  rig.run(300ms);
  for (std::size_t i = 0; i < 4; ++i) {
    // Counts of 1 mA are 0.9 mN·m, the sensors' noise 1.5 mN·m, the back-EMF takes 4 % while it accelerates.
    EXPECT_NEAR(rig.sample.joints[i].torque_Nm, 0.3, 0.02) << i;
    EXPECT_GT(rig.sample.joints[i].velocity_rad_per_s, 1.0) << i;
  }
}

TEST(EthercatRobot, PositionCommandsArriveInTheJointsOwnFrame) {
  Rig rig;
  rig.robot->activate();
  rig.enable();
  for (std::size_t i = 0; i < 4; ++i)
    rig.command.joints[i] = JointCommand::position_rad(0.8 + 0.1 * static_cast<double>(i));
  rig.run(6s);
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_NEAR(rig.sample.joints[i].position_rad, 0.8 + 0.1 * static_cast<double>(i), 0.02) << i;
}

TEST(EthercatRobot, ATargetThatIsNotANumberSwitchesEverythingOff) {
  Rig rig;
  rig.robot->activate();
  rig.enable();
  rig.command_all_velocity(2.0);
  rig.run(500ms);
  rig.command.joints[2].target = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(rig.step().fault, Fault::kBadCommand);
  EXPECT_EQ(rig.status.joint, 2);
  rig.command.joints[2].target = 2.0;
  rig.run(2s);
  EXPECT_EQ(rig.status.fault, Fault::kBadCommand) << "latched";
  EXPECT_FALSE(rig.sample.enabled);
  EXPECT_LT(std::abs(rig.sample.joints[0].velocity_rad_per_s), 0.2) << "the motors stop";
}

TEST(EthercatRobot, ATargetThatIsNotANumberIsFoundAtWhicheverJoint) {
  Rig rig(YoubotKind::kBaseAndArm);
  rig.robot->activate();
  for (std::size_t i = 0; i < rig.robot->joints().size(); ++i) {
    rig.enable();
    rig.command.joints[i].target = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(rig.step().fault, Fault::kBadCommand) << i;
    EXPECT_EQ(rig.status.joint, static_cast<int>(i));
    EXPECT_FALSE(rig.sample.enabled) << i;
    rig.command.joints[i].target = 0.0;
    rig.command.enable = false;
    (void)rig.step();
  }
}

/// Last command to the first wheel. Without faults a frame begins with the image, which begins with this
/// wheel's outputs.
struct FirstWheel final : drivers::ethercat::FrameTap {
  void frame(drivers::ethercat::Direction direction, std::span<const std::uint8_t> bytes) noexcept override {
    constexpr std::size_t kOutputs = 16 + 10;
    if (direction != drivers::ethercat::Direction::kSent || bytes.size() < kOutputs + 5) return;
    (void)unpack(bytes.subspan(kOutputs, 5), received);
  }
  drivers::tmcl::DriveOutput received;
};

TEST(EthercatRobot, VelocityBeyondTheLimitOfTheAxisDoesNotGoOut) {
  FirstWheel wheel;
  Rig rig(Rig::options(YoubotKind::kBase), {.kind = YoubotKind::kBase, .tap = &wheel});
  rig.robot->activate();
  rig.enable();
  rig.run(20ms);
  for (const auto& [velocity_rad_per_s, rpm] :
       {std::pair(2.0, 493), std::pair(1e3, 3997), std::pair(-1e9, -3997), std::pair(1e300, 3997)}) {
    rig.command.joints[0] = JointCommand::velocity_rad_per_s(velocity_rad_per_s);
    EXPECT_TRUE(rig.step().ok());
    EXPECT_EQ(wheel.received, (drivers::tmcl::DriveOutput{drivers::tmcl::ControllerMode::kVelocity, rpm}));
  }
}

TEST(EthercatRobot, ACommutationThatFailedIsTriedAgainByTheNextEnable) {
  for (const Firmware firmware : {Firmware::k148, Firmware::k200})
    for (const auto broken : {700ms, 3000ms}) {
      Rig rig(YoubotKind::kBase, firmware);
      rig.robot->activate();
      rig.command.enable = true;
      rig.run(20ms);
      rig.emulation.slave(1).set_fault(sim::bus::BoardFault::kHallSensor, true);
      rig.run(broken);
      EXPECT_EQ(rig.status.fault, Fault::kJointFault);
      EXPECT_EQ(rig.status.joint, 1);
      rig.emulation.slave(1).set_fault(sim::bus::BoardFault::kHallSensor, false);
      rig.command.enable = false;
      rig.run(20ms);
      rig.enable();
      EXPECT_TRUE(rig.status.ok()) << describe(rig.status.joint_fault());
    }
}

TEST(EthercatRobot, ACommutationThatKeepsFailingIsAFaultEveryTime) {
  Rig rig;
  rig.robot->activate();
  rig.command.enable = true;
  rig.run(20ms);
  rig.emulation.slave(1).set_fault(sim::bus::BoardFault::kHallSensor, true);
  rig.run(700ms);
  for (int attempt = 0; attempt < 3; ++attempt) {
    rig.command.enable = false;
    rig.run(20ms);
    rig.command.enable = true;
    rig.run(7s);
    EXPECT_EQ(rig.status.fault, Fault::kJointFault) << attempt;
    EXPECT_EQ(rig.status.joint, 1) << attempt;
    EXPECT_FALSE(rig.sample.enabled) << attempt;
  }
}

TEST(EthercatRobot, ADriveWhoseWatchdogHoldsItIsLetGoWhenTheRobotIsDisabledAndNotBefore) {
  using drivers::tmcl::StatusFlag;
  Rig rig(YoubotKind::kBase, Firmware::k148,
          {FaultEvent{.kind = FaultKind::kCableOut, .at = 3s, .duration = 300ms, .slave = 0}});
  rig.robot->activate();
  rig.enable();
  rig.command_all_velocity(2.0);
  rig.run_until([&] { return rig.emulation.wire().now() >= 5s; });
  ASSERT_EQ(rig.status.fault, Fault::kFrameLost);
  const auto held = [&](std::size_t i) {
    return rig.emulation.board(i).input().flags.has(StatusFlag::kTimeout);
  };
  for (std::size_t i = 0; i < 4; ++i) EXPECT_TRUE(held(i)) << "not read yet: " << i;

  std::array<double, 4> before_rad{};
  for (std::size_t i = 0; i < 4; ++i) before_rad[i] = rig.emulation.position_rad(i);
  rig.command.enable = false;
  rig.run(200ms);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_FALSE(held(i)) << i;
    EXPECT_NEAR(rig.emulation.position_rad(i), before_rad[i], 0.01) << i;
    EXPECT_EQ(rig.sample.joints[i].fault, JointFault::kNone) << i;
  }
  EXPECT_TRUE(rig.status.ok());
  EXPECT_FALSE(rig.sample.enabled);
  rig.enable();
  rig.run(1s);
  EXPECT_GT(rig.sample.joints[0].velocity_rad_per_s, 1.0);
}

TEST(EthercatRobot, ALateAnswerToAnAttemptThatWasGivenUpDoesNotCountForTheNext) {
  sim::bus::YoubotBusOptions bus = Rig::options(YoubotKind::kBase);
  bus.board.reply_latency = 30ms;
  Rig rig(bus, {.kind = YoubotKind::kBase});
  rig.robot->activate();
  rig.run(100ms);
  const auto starting = [&] {
    constexpr auto kStarting = get(drivers::tmcl::drive_parameter("sine_reinitialization_state"));
    return drivers::tmcl::decode_mailbox_reply(rig.emulation.board(0).execute(kStarting))->value == 1;
  };
  rig.command.enable = true;
  const auto once = rig.run_until(starting, 1s);
  EXPECT_GT(once, 29ms) << "it asks first whether that is needed";
  ASSERT_LT(once, 100ms);

  Rig second(bus, {.kind = YoubotKind::kBase});
  second.robot->activate();
  second.run(100ms);
  second.command.enable = true;
  second.run(5ms);
  second.command.enable = false;
  second.run(2ms);
  second.command.enable = true;
  const auto starting_again = [&] {
    constexpr auto kStarting = get(drivers::tmcl::drive_parameter("sine_reinitialization_state"));
    return drivers::tmcl::decode_mailbox_reply(second.emulation.board(0).execute(kStarting))->value == 1;
  };
  EXPECT_GT(second.run_until(starting_again, 1s), once + 15ms) << "the first answer was not its own";
}

TEST(EthercatRobot, AMissingSlaveIsNamedWithItsPlaceAndNothingStarts) {
  Rig rig;
  rig.emulation.bus().set_power(3, false);  // wheel 3
  try {
    rig.robot->activate();
    FAIL() << "started incomplete";
  } catch (const SetupError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("slave 4, wheel 3 (rear-left)"), std::string::npos) << text;
    EXPECT_NE(text.find("3 of 5"), std::string::npos) << text;
    EXPECT_NE(text.find("slave 3 (TMCM-1632)"), std::string::npos) << text;
  }
  EXPECT_EQ(rig.step().fault, Fault::kNotActive);
}

TEST(EthercatRobot, ABaseIsNotTakenForABaseWithAnArm) {
  sim::bus::YoubotBus base;
  VirtualClock clock;
  const auto robot = make_ethercat_robot(
      [&base]() -> std::unique_ptr<drivers::ethercat::Link> {
        return std::make_unique<sim::bus::BusLink>(base.wire(), &base);
      },
      {.kind = YoubotKind::kBaseAndArm}, clock, 1ms);
  EXPECT_THROW(robot->activate(), SetupError);
}

TEST(EthercatRobot, AFewLostFramesAreBridgedWithTheLastSample) {
  Rig rig;
  rig.robot->activate();
  rig.enable();
  rig.command_all_velocity(1.0);
  rig.run(500ms);
  rig.emulation.bus().set_cable(0, false);
  const auto stamp = rig.sample.stamp;
  rig.run(5ms);
  EXPECT_TRUE(rig.status.ok()) << describe(rig.status.fault);
  EXPECT_EQ(rig.sample.stamp, stamp) << "the age of the sample shows";
  rig.emulation.bus().set_cable(0, true);
  rig.run(50ms);
  EXPECT_TRUE(rig.status.ok());
  EXPECT_GT(rig.sample.stamp, stamp);
  EXPECT_TRUE(rig.sample.enabled);
}

TEST(EthercatRobot, AsManyCyclesAreBridgedAsAreToleratedAndNotOneMore) {
  for (const int tolerated : {0, 3, 10}) {
    Rig rig(Rig::options(YoubotKind::kBase), {.kind = YoubotKind::kBase, .tolerated_cycles = tolerated});
    rig.robot->activate();
    rig.run(50ms);
    rig.enable();
    rig.run(50ms);
    rig.emulation.bus().set_cable(0, false);
    for (int i = 0; i < tolerated; ++i) EXPECT_TRUE(rig.step().ok()) << i + 1 << " of " << tolerated;
    EXPECT_EQ(rig.step().fault, Fault::kFrameLost) << tolerated;
  }
}

/// An interface that takes no frames while `error` is set.
class RefusingLink final : public drivers::ethercat::Link {
 public:
  RefusingLink(sim::bus::YoubotBus& emulation, const int& error)
      : link_(emulation.wire(), &emulation), error_(error) {}
  bool send(std::span<const std::uint8_t> frame) noexcept override {
    return error_ == 0 && link_.send(frame);
  }
  std::size_t receive(std::span<std::uint8_t> buffer, nanoseconds timeout) noexcept override {
    return link_.receive(buffer, timeout);
  }
  nanoseconds now() const noexcept override { return link_.now(); }
  void wait(nanoseconds duration) override { link_.wait(duration); }
  int last_error() const noexcept override { return error_; }
  const std::string& name() const noexcept override { return link_.name(); }

 private:
  sim::bus::BusLink link_;
  const int& error_;
};

TEST(EthercatRobot, AnInterfaceThatRefusesFramesIsNoFaultWhileItIsBridged) {
  int error = 0;  // outlives the rig, whose robot sends when it ends
  Rig rig;
  rig.robot =
      rig.watch.over(make_ethercat_robot([&] { return std::make_unique<RefusingLink>(rig.emulation, error); },
                                         {.kind = YoubotKind::kBase}, rig.clock, 1ms));
  rig.robot->activate();
  rig.enable();
  const auto is_reported = [&rig] {
    const std::vector<std::string> faults = rig.robot->device_faults();
    return std::ranges::any_of(faults, [](const std::string& line) {
      return line.find("bus: the network interface emulated bus went down (ENETDOWN") == 0;
    });
  };
  for (const auto& [cycles, lasts] : {std::pair{1ms, false}, std::pair{10ms, false}, std::pair{11ms, true}}) {
    error = ENETDOWN;
    rig.run(cycles);
    EXPECT_EQ(is_reported(), lasts) << cycles.count();
    EXPECT_EQ(rig.status.fault, lasts ? Fault::kLinkDown : Fault::kNone);
    error = 0;
    rig.run(20ms);
    EXPECT_FALSE(is_reported()) << "it works again";
  }
}

TEST(EthercatRobot, APeriodTooLongForACheckOfTheSensorsIsNoted) {
  const Rig rig;
  EXPECT_TRUE(rig.robot->notes().empty());
  const auto slow = make_ethercat_robot([] { return nullptr; }, {}, rig.clock, 2ms);
  ASSERT_EQ(slow->notes().size(), 1U);
  EXPECT_NE(slow->notes()[0].find("positions come every 2.00 ms: the check S3"), std::string::npos);
}

TEST(EthercatRobot, WhatIsBridgedLeavesTheLastCommandAndMoreIsOffUntilANewEnable) {
  constexpr int kTolerated = 10;
  using drivers::tmcl::ControllerMode;
  for (const int lost : {1, 4, kTolerated, kTolerated + 1, 2 * kTolerated}) {
    for (const bool requests : {true, false}) {
      const FaultKind kind = requests ? FaultKind::kDropRequest : FaultKind::kDropReply;
      Rig rig(Rig::options(YoubotKind::kBase, Firmware::k148,
                           {FaultEvent{.kind = kind, .at = 6s, .count = static_cast<std::uint32_t>(lost)}}),
              {.kind = YoubotKind::kBase, .tolerated_cycles = kTolerated});
      rig.robot->activate();
      rig.enable();
      rig.command_all_velocity(2.0);
      rig.run_until([&] { return rig.emulation.wire().now() >= 5990ms; });
      ASSERT_TRUE(rig.sample.enabled);
      int without_command = 0;
      for (int cycle = 0; cycle < 200; ++cycle) {
        (void)rig.step();
        for (std::size_t wheel = 0; wheel < 4; ++wheel) {
          const auto& followed = rig.emulation.board(wheel).followed();
          if (!followed || followed->mode != ControllerMode::kVelocity || followed->value == 0)
            ++without_command;
        }
      }
      SCOPED_TRACE(std::to_string(lost) + (requests ? " requests" : " replies"));
      if (lost <= kTolerated) {
        EXPECT_TRUE(rig.status.ok()) << describe(rig.status.fault);
        EXPECT_EQ(without_command, 0);
      } else {
        EXPECT_EQ(rig.status.fault, Fault::kFrameLost);
        EXPECT_FALSE(rig.sample.enabled);
        for (std::size_t wheel = 0; wheel < 4; ++wheel)
          EXPECT_EQ(rig.emulation.board(wheel).followed()->mode, ControllerMode::kMotorStop);
      }
    }
  }
}

TEST(EthercatRobot, WhatWasBridgedOnceIsNotCountedAgain) {
  Rig rig;
  rig.robot->activate();
  rig.enable();
  for (int again = 0; again < 10; ++again) {
    rig.emulation.bus().set_cable(0, false);
    rig.run(5ms);
    rig.emulation.bus().set_cable(0, true);
    rig.run(50ms);
    ASSERT_TRUE(rig.status.ok()) << again << ": " << describe(rig.status.fault);
  }
}

/// Temporary effect of a fault on the bus, and its report.
struct FaultCase {
  const char* name;
  FaultKind kind;
  std::uint32_t slave;
  Fault expected;
};
class EthercatRobotFaults : public ::testing::TestWithParam<FaultCase> {};

TEST_P(EthercatRobotFaults, StopsEverythingRecoversByItselfAndMovesOnlyAfterANewEnable) {
  const FaultCase& fault = GetParam();
  Rig rig(YoubotKind::kBase, Firmware::k148,
          {FaultEvent{.kind = fault.kind, .at = 5s, .duration = 400ms, .slave = fault.slave}});
  rig.robot->activate();
  rig.enable();
  rig.command_all_velocity(2.0);
  rig.run_until([&] { return rig.emulation.wire().now() >= 4990ms; });
  ASSERT_TRUE(rig.status.ok());
  ASSERT_GT(rig.sample.joints[0].velocity_rad_per_s, 1.0);

  // Detected within the cycles that are bridged and those that count a slave as lost.
  const auto detected = rig.run_until([&] { return !rig.status.ok(); }, 1s);
  EXPECT_LT(detected, 10ms + 30ms) << fault.name;
  EXPECT_EQ(rig.status.fault, fault.expected) << fault.name << ": " << describe(rig.status.fault);
  EXPECT_FALSE(rig.sample.enabled);

  // The fault ends by itself, without a new enable. Within 2 s the bus is whole, and no wheel moves.
  rig.run_until([&] { return rig.emulation.wire().now() >= 5400ms + 2s; });
  EXPECT_FALSE(rig.status.ok()) << "latched until disabled";
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_LT(std::abs(rig.emulation.base().wheel(static_cast<int>(i)).velocity_rad_per_s()), 0.05)
        << fault.name << ", wheel " << i + 1;

  rig.command.enable = false;
  rig.run(5ms);
  EXPECT_TRUE(rig.status.ok()) << fault.name << ": not recovered: " << describe(rig.status.fault)
                               << " at joint " << static_cast<int>(rig.status.joint);
  rig.enable();
  rig.run(1s);
  EXPECT_TRUE(rig.status.ok()) << fault.name;
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_GT(rig.emulation.base().wheel(static_cast<int>(i)).velocity_rad_per_s(), 1.0) << fault.name;
}
INSTANTIATE_TEST_SUITE_P(
    Bus, EthercatRobotFaults,
    ::testing::Values(
        FaultCase{"wheel 3 loses power", FaultKind::kSlaveOff, 3, Fault::kPartialBus},
        FaultCase{"the last wheel loses power", FaultKind::kSlaveOff, 4, Fault::kPartialBus},
        FaultCase{"the cable to wheel 2 is pulled", FaultKind::kCableOut, 2, Fault::kPartialBus},
        FaultCase{"the cable to the robot is pulled", FaultKind::kCableOut, 0, Fault::kFrameLost},
        FaultCase{"the supply breaks down", FaultKind::kBrownOut, 0, Fault::kFrameLost}),
    [](const auto& parameter) {
      std::string name = parameter.param.name;
      for (char& c : name)
        if (c == ' ') c = '_';
      return name;
    });

/// As long as the drives' own watchdog allows.
constexpr int kLongTolerance = 90;

TEST(EthercatRobot, ADriveThatLeavesOperationIsAFaultHoweverShortAndHoweverMuchIsTolerated) {
  for (const int tolerated_cycles : {10, kLongTolerance}) {
    Rig rig(Rig::options(YoubotKind::kBase),
            {.kind = YoubotKind::kBase, .tolerated_cycles = tolerated_cycles});
    rig.robot->activate();
    rig.enable();
    rig.command_all_velocity(2.0);
    rig.run(1s);
    rig.emulation.slave(1).report_error(drivers::ethercat::AlState::kSafeOp, 0x001A);
    rig.run(5ms);
    EXPECT_EQ(rig.status.fault, Fault::kPartialBus);
    EXPECT_EQ(rig.status.joint, 1);
    rig.run(2s);
    EXPECT_FALSE(rig.status.ok()) << "latched";
    for (int i = 0; i < 4; ++i)
      EXPECT_LT(std::abs(rig.emulation.base().wheel(i).velocity_rad_per_s()), 0.05) << "wheel " << i + 1;
    rig.command.enable = false;
    rig.run(5ms);
    EXPECT_TRUE(rig.status.ok());
  }
}

TEST(EthercatRobot, AnAnswerIsInTimeForAsLongAsACycleWaits) {
  for (const auto frame_timeout : {std::chrono::microseconds(500), std::chrono::microseconds(3000)}) {
    Rig rig(Rig::options(YoubotKind::kBase, Firmware::k148,
                         {FaultEvent{.kind = FaultKind::kDelay, .at = 6s, .count = 100, .delay = 2ms}}),
            {.kind = YoubotKind::kBase, .frame_timeout = frame_timeout});
    rig.robot->activate();
    rig.enable();
    rig.run_until([&] { return rig.emulation.wire().now() >= 5990ms; });
    ASSERT_TRUE(rig.sample.enabled);
    rig.run(50ms);
    EXPECT_EQ(rig.status.fault, frame_timeout > 2ms ? Fault::kNone : Fault::kFrameLost);
  }
}

TEST(EthercatRobot, APowerBlipIsAFaultAndNothingTurnsByItself) {
  for (const Firmware firmware : {Firmware::k148, Firmware::k200}) {
    Rig rig(Rig::options(YoubotKind::kBase, firmware,
                         {FaultEvent{.kind = FaultKind::kSlaveOff, .at = 6s, .duration = 15ms, .slave = 4}}),
            {.kind = YoubotKind::kBase, .tolerated_cycles = kLongTolerance});
    rig.robot->activate();
    rig.enable();
    rig.command_all_velocity(2.0);
    rig.run_until([&] { return rig.emulation.wire().now() >= 5990ms; });
    ASSERT_TRUE(rig.sample.enabled);
    rig.run(2s);
    EXPECT_EQ(rig.status.fault, Fault::kPartialBus);
    EXPECT_FALSE(rig.sample.enabled);
    for (int i = 0; i < 4; ++i)
      EXPECT_LT(std::abs(rig.emulation.base().wheel(i).velocity_rad_per_s()), 0.05) << "wheel " << i + 1;
  }
}

TEST(EthercatRobot, ADriveThatIsReadyBeforeTheOthersHoldsStill) {
  Rig rig(Rig::options(YoubotKind::kArm, Firmware::k148,
                       {FaultEvent{.kind = FaultKind::kSlaveOff, .at = 5s, .duration = 50ms, .slave = 5}}),
          {.kind = YoubotKind::kArm});
  rig.robot->activate();
  rig.enable();
  rig.run_until([&] { return !rig.status.ok(); });
  rig.command.enable = false;
  rig.run_until([&] { return rig.status.ok(); });
  rig.command_all_velocity(2.0);
  rig.command.enable = true;
  std::array<double, 5> before_rad{};
  for (std::size_t i = 0; i < 5; ++i) before_rad[i] = rig.emulation.position_rad(i);
  int waited = 0;
  for (; waited < 5000 && !rig.sample.enabled; ++waited) {
    (void)rig.step();
    const drivers::tmcl::StatusFlags flags = rig.emulation.board(1).input().flags;
    ASSERT_FALSE(flags.has(drivers::tmcl::StatusFlag::kCurrentMode)) << "without current an arm falls";
    for (std::size_t i = 0; i < 5 && !rig.sample.enabled; ++i)
      ASSERT_NEAR(rig.emulation.position_rad(i), before_rad[i], 0.002) << i << " obeys before all do";
  }
  EXPECT_GT(waited, 100) << "joint 5 had to find its commutation";
  EXPECT_TRUE(rig.sample.enabled);
}

TEST(EthercatRobot, ASlaveThatFallsBackWhileItWaitsForItsParametersIsConfiguredAgain) {
  Rig rig(Rig::options(YoubotKind::kBase, Firmware::k148,
                       {FaultEvent{.kind = FaultKind::kSlaveOff, .at = 3s, .duration = 50ms, .slave = 2}}),
          {.kind = YoubotKind::kBase, .parameters = {{"wheel-2", "motor_acceleration", 4321}}});
  rig.robot->activate();
  rig.enable();
  rig.run_until([&] { return !rig.status.ok(); });
  rig.run_until([&] { return rig.emulation.slave(1).state() == drivers::ethercat::AlState::kPreOp; });
  rig.emulation.slave(1).report_error(drivers::ethercat::AlState::kInit, 0x0011);
  rig.command.enable = false;
  EXPECT_LT(rig.run_until([&] { return rig.status.ok(); }, 5s), 3s);
  rig.enable();
  EXPECT_EQ(rig.emulation.board(1).parameters()[11], 4321);
}

// Wherever in its way back the loss falls, above all between two of its parameters; and whether its memory
// went again or was kept.
TEST(EthercatRobot, ADriveThatIsLostAgainOnItsWayBackGetsItsParametersAllTheSame) {
  for (const bool loses_power : {false, true})
    for (auto after = 5ms; after <= 40ms; after += 1ms) {
      const std::string when =
          std::to_string(after.count()) + " ms after its return" + (loses_power ? ", without power" : "");
      Rig rig(Rig::options(YoubotKind::kBase),
              {.kind = YoubotKind::kBase,
               .parameters = {{"wheel-4", "motor_acceleration", 1500}, {"wheel-4", "velocity_pid1_p", 777}}});
      const auto lose = [&](bool power, std::chrono::milliseconds duration) {
        sim::bus::EmulatedBus& bus = rig.emulation.bus();
        power ? bus.set_power(4, false) : bus.set_cable(0, false);
        rig.run(duration);
        power ? bus.set_power(4, true) : bus.set_cable(0, true);
      };
      rig.robot->activate();
      rig.run(50ms);
      lose(true, 100ms);
      rig.run(after);
      lose(loses_power, 6ms);
      rig.run_until([&] { return rig.status.ok(); }, 5s);
      rig.command.enable = true;
      rig.run_until([&] { return rig.sample.enabled || !rig.status.ok(); });
      EXPECT_TRUE(rig.sample.enabled) << when << ": " << describe(rig.status.fault);
      EXPECT_EQ(rig.emulation.board(3).parameters()[11], 1500) << when;
      EXPECT_EQ(rig.emulation.board(3).parameters()[140], 777) << when;
      EXPECT_TRUE(rig.robot->device_faults().empty()) << when << ": " << rig.robot->device_faults().front();
    }
}

TEST(EthercatRobot, TooLittleProcessDataIsRefusedInsteadOfWaitedFor) {
  sim::bus::YoubotBusOptions bus = Rig::options(YoubotKind::kBase);
  bus.process_data_bytes = 16;
  Rig rig(bus, {.kind = YoubotKind::kBase});
  try {
    rig.robot->activate();
    FAIL() << "started with unknown process data";
  } catch (const SetupError& error) {
    EXPECT_NE(std::string(error.what()).find("20 bytes of inputs and 5 of outputs, its EEPROM maps 16 and"),
              std::string::npos)
        << error.what();
  }
}

TEST(EthercatRobot, ADrivesErrorFlagStopsTheRobotAndSaysWhich) {
  Rig rig;
  rig.robot->activate();
  rig.enable();
  rig.command_all_velocity(1.0);
  rig.run(300ms);
  rig.emulation.slave(1).set_fault(sim::bus::BoardFault::kOvertemperature, true);
  rig.run(10ms);
  EXPECT_EQ(rig.status.fault, Fault::kJointFault);
  EXPECT_EQ(rig.status.joint, 1);
  EXPECT_EQ(rig.status.detail, static_cast<std::uint32_t>(JointFault::kOvertemperature));
  EXPECT_FALSE(rig.sample.enabled);
}

TEST(EthercatRobot, TheCycleDoesNotAllocateOrLockInAnyPhase) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns the allocator";
  Rig rig(YoubotKind::kBaseAndArm, Firmware::k148,
          {FaultEvent{.kind = FaultKind::kSlaveOff, .at = 4s, .duration = 300ms, .slave = 8}});
  rig.robot->activate();
  rig.run(10ms);
  const support::NoAllocGuard guard;
  rig.command.enable = true;
  rig.run(4500ms);  // commutation, motion, a slave lost and configured again
  rig.command.enable = false;
  rig.run(1500ms);
  rig.command.enable = true;
  rig.run(2s);
  EXPECT_EQ(guard.violations(), 0);
  EXPECT_TRUE(rig.sample.enabled) << describe(rig.status.fault);
}

TEST(EthercatRobot, DeactivationStopsTheMotorsAndItCanStartAgain) {
  Rig rig;
  rig.robot->activate();
  rig.enable();
  rig.command_all_velocity(2.0);
  rig.run(500ms);
  rig.robot->deactivate();
  for (std::size_t slave = 0; slave < 5; ++slave)
    EXPECT_EQ(rig.emulation.bus().slave(slave).state(), drivers::ethercat::AlState::kInit) << slave;
  EXPECT_EQ(rig.step().fault, Fault::kNotActive);
  rig.emulation.advance(2s);
  EXPECT_LT(std::abs(rig.emulation.base().wheel(0).velocity_rad_per_s()), 0.05);
  rig.command = {};
  rig.robot->activate();
  rig.enable();
  EXPECT_TRUE(rig.status.ok());
}

TEST(EthercatRobot, ANewActivationBeginsWithoutTheFaultsOfTheLast) {
  Rig rig;
  rig.robot->activate();
  rig.enable();
  rig.emulation.bus().set_cable(0, false);
  rig.run(50ms);
  ASSERT_EQ(rig.status.fault, Fault::kFrameLost);
  rig.robot->deactivate();
  rig.emulation.bus().set_cable(0, true);
  rig.robot->activate();
  rig.emulation.bus().set_cable(0, false);
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(rig.step().ok()) << "bridged as ever: " << i;
  rig.emulation.bus().set_cable(0, true);
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(rig.step().ok()) << i << ": " << describe(rig.status.fault);
  rig.enable();
  EXPECT_TRUE(rig.status.ok());
}

// ---- an arm that was not asked for ----

using drivers::ethercat::AlState;
constexpr std::size_t kFirstArmSlave = 5;  // its power board, behind the base's five slaves

struct BaseWithArms {
  explicit BaseWithArms(YoubotKind on_the_bus = YoubotKind::kBaseAndArm,
                        YoubotKind wanted = YoubotKind::kBase, std::vector<FaultEvent> faults = {})
      : rig(Rig::options(on_the_bus, Firmware::k148, std::move(faults)), {.kind = wanted}) {
    rig.robot->activate();
  }
  sim::bus::EmulatedSlave& slave(std::size_t i) { return rig.emulation.bus().slave(i); }
  Rig rig;
};

TEST(EthercatRobot, ABaseIsDrivenAlsoWithAnArmOnItWhoseDrivesStayOff) {
  for (const auto arms : {YoubotKind::kBaseAndArm, YoubotKind::kBaseAndTwoArms}) {
    BaseWithArms base(arms);
    Rig& rig = base.rig;
    ASSERT_EQ(rig.robot->joints().size(), 4U);
    rig.enable();
    rig.command_all_velocity(2.0);
    rig.run(2s);
    EXPECT_TRUE(rig.status.ok()) << describe(rig.status.fault);
    for (std::size_t wheel = 0; wheel < 4; ++wheel) EXPECT_GT(rig.sample.joints[wheel].position_rad, 1.0);
    for (std::size_t i = 0; i < kFirstArmSlave; ++i) EXPECT_EQ(base.slave(i).state(), AlState::kOp);
    for (std::size_t i = kFirstArmSlave; i < rig.emulation.bus().size(); ++i)
      EXPECT_EQ(base.slave(i).state(), AlState::kPreOp) << "slave " << i + 1;
    rig.robot->deactivate();
    // Their watchdogs have seen no process data, so they do not make them hold the arm now either.
    rig.emulation.advance(500ms);
    for (std::size_t joint = 4; joint < rig.emulation.joint_count(); ++joint) {
      const auto followed = rig.emulation.board(joint).followed();
      EXPECT_TRUE(!followed || followed->mode == drivers::tmcl::ControllerMode::kMotorStop)
          << "joint " << joint << " is held";
    }
    for (std::size_t i = 0; i < rig.emulation.bus().size(); ++i) {
      EXPECT_EQ(base.slave(i).state(), AlState::kInit) << "slave " << i + 1;
      EXPECT_EQ(base.slave(i).al_status_code(), 0) << "asked for a state that it refuses: slave " << i + 1;
    }
  }
}

TEST(EthercatRobot, AnArmThatIsLeftOffIsNoted) {
  const auto notes = [](YoubotKind on_the_bus, YoubotKind wanted) {
    return BaseWithArms(on_the_bus, wanted).rig.robot->notes();
  };
  using enum YoubotKind;
  for (const auto& [on_the_bus, wanted, drives] :
       {std::tuple(kBaseAndArm, kBase, "5"), std::tuple(kBaseAndTwoArms, kBase, "10"),
        std::tuple(kBaseAndTwoArms, kBaseAndArm, "5")}) {
    const std::vector<std::string> lines = notes(on_the_bus, wanted);
    ASSERT_EQ(lines.size(), 1U);
    EXPECT_NE(lines[0].find(std::string("the ") + drives + " drives"), std::string::npos) << lines[0];
    EXPECT_NE(lines[0].find("stay off"), std::string::npos) << lines[0];
  }
  EXPECT_TRUE(notes(kBase, kBase).empty());
  EXPECT_TRUE(notes(kBaseAndArm, kBaseAndArm).empty());
}

TEST(EthercatRobot, TheBaseDrivesOnWhateverBecomesOfTheArmThatIsLeftOff) {
  BaseWithArms base(YoubotKind::kBaseAndArm, YoubotKind::kBase,
                    {FaultEvent{.kind = FaultKind::kSlaveOff, .at = 6s, .duration = 1s, .slave = 7}});
  base.rig.enable();
  base.rig.command_all_velocity(2.0);
  base.rig.run_until([&] { return base.rig.emulation.wire().now() >= 9s; });
  EXPECT_TRUE(base.rig.status.ok()) << describe(base.rig.status.fault);
  EXPECT_TRUE(base.rig.sample.enabled);
  EXPECT_TRUE(base.rig.robot->device_faults().empty());
  EXPECT_EQ(base.slave(7).state(), AlState::kInit) << "back, and left alone";
}

TEST(EthercatRobot, WithAnArmLeftOffEachSlaveOfTheBaseIsWatchedAsEver) {
  for (const AlState state : {AlState::kSafeOp, AlState::kPreOp, AlState::kInit}) {
    for (std::size_t slave = 1; slave < kFirstArmSlave; ++slave) {
      BaseWithArms base;
      base.rig.enable();
      base.slave(slave).report_error(state, 0x001B);
      base.rig.run(3ms);
      EXPECT_EQ(base.rig.status.fault, Fault::kPartialBus) << "slave " << slave + 1;
      EXPECT_EQ(base.rig.status.joint, static_cast<int>(slave) - 1);
      EXPECT_FALSE(base.rig.sample.enabled);
    }
  }
}

TEST(EthercatRobot, WhatIsNoWholeArmBehindTheBaseIsRefused) {
  const auto refusal = [](std::size_t unplugged) {
    Rig rig(Rig::options(YoubotKind::kBaseAndArm), {.kind = YoubotKind::kBase});
    rig.emulation.bus().set_cable(unplugged, false);
    try {
      rig.robot->activate();
    } catch (const SetupError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(refusal(10).find("slave 6 (KR-843): check the bus: not expected"), std::string::npos)
      << refusal(10);
  EXPECT_EQ(refusal(kFirstArmSlave), "") << "no arm at all";
}

// ---- simulations by the clock, which may be late ----

/// A base whose emulator does not answer for `lost` cycles in motion; the robot as it is then.
struct LateAnswers {
  explicit LateAnswers(std::string_view mark, int lost, std::optional<int> tolerated = {},
                       FaultKind kind = FaultKind::kDropReply)
      : rig(bus(mark, lost, kind), {.kind = YoubotKind::kBase, .tolerated_cycles = tolerated}) {}
  static sim::bus::YoubotBusOptions bus(std::string_view mark, int lost, FaultKind kind) {
    sim::bus::YoubotBusOptions options = Rig::options(
        YoubotKind::kBase, Firmware::k148,
        {FaultEvent{.kind = kind, .at = 6s, .count = static_cast<std::uint32_t>(lost), .slave = 3}});
    options.mark = mark;
    return options;
  }
  Fault drive() {
    rig.robot->activate();
    rig.enable();
    rig.command_all_velocity(2.0);
    rig.run_until([&] { return rig.emulation.wire().now() >= 6500ms; });
    return rig.status.fault;
  }
  Rig rig;
};

TEST(EthercatRobot, ASimulatedBusThatSaysSoIsWaitedForAHundredMilliseconds) {
  using drivers::ethercat::kSimulatedMark;
  for (const int lost : {10, 11, 50, 100}) {
    LateAnswers late(kSimulatedMark, lost);
    EXPECT_EQ(late.drive(), Fault::kNone) << lost;
    EXPECT_TRUE(late.rig.sample.enabled);
    EXPECT_GT(late.rig.sample.joints[0].velocity_rad_per_s, 1.0) << "it drives on";
  }
  LateAnswers too_late(kSimulatedMark, 101);
  EXPECT_EQ(too_late.drive(), Fault::kSimulatorSilent);
  EXPECT_FALSE(too_late.rig.sample.enabled);
  EXPECT_NE(std::string(describe(Fault::kSimulatorSilent)).find("youbot-sim was late"), std::string::npos);
}

TEST(EthercatRobot, ARobotIsWaitedForTenCyclesWhateverElseItsEepromsSay) {
  for (const std::string_view mark :
       {std::string_view(), drivers::ethercat::kLockStepMark, drivers::ethercat::kSimulatedMark.substr(1),
        std::string_view("youBot"), std::string_view("simulated")}) {
    EXPECT_EQ(LateAnswers(mark, 10).drive(), Fault::kNone) << mark;
    EXPECT_EQ(LateAnswers(mark, 11).drive(), Fault::kFrameLost) << mark;
  }
}

/// Writes another letter into the group of one board's EEPROM, as its manufacturer could.
void spoil_mark(sim::bus::EmulatedSlave& slave) {
  const std::vector<std::uint8_t> image = sim::bus::build_sii_image(slave.description());
  const std::string_view text(reinterpret_cast<const char*>(image.data()), image.size());
  const std::size_t word = text.find(drivers::ethercat::kSimulatedMark) / 2 + 1;
  const std::array<std::uint8_t, 8> write_word{
      0x01, 0x02, static_cast<std::uint8_t>(word), static_cast<std::uint8_t>(word >> 8), 0, 0, 'x', 'x'};
  slave.controller().sii().write(2, write_word);
}

TEST(EthercatRobot, OneBoardThatDoesNotSayItIsSimulatedMakesTheBusARobot) {
  for (std::size_t slave = 0; slave < 5; ++slave) {
    LateAnswers late(drivers::ethercat::kSimulatedMark, 11);
    spoil_mark(late.rig.emulation.bus().slave(slave));
    EXPECT_EQ(late.drive(), Fault::kFrameLost) << "slave " << slave + 1;
  }
}

/// Every other answer comes two cycles late for a second and a half.
TEST(EthercatRobot, LateAnswersOfASimulatedBusAreNoLostFrames) {
  const auto drive = [](std::string_view mark) {
    std::vector<FaultEvent> late;
    for (int n = 0; n < 750; ++n)
      late.push_back({.kind = FaultKind::kDelay, .at = 6s + n * 2ms, .delay = 2200us});
    sim::bus::YoubotBusOptions bus = Rig::options(YoubotKind::kBase, Firmware::k148, late);
    bus.mark = mark;
    Rig rig(bus, {.kind = YoubotKind::kBase});
    rig.robot->activate();
    rig.enable();
    rig.command_all_velocity(2.0);
    rig.run_until([&] { return rig.emulation.wire().now() >= 7500ms; });
    EXPECT_GT(rig.robot->losses()->lost, 400);
    return rig.status.fault;
  };
  EXPECT_EQ(drive(drivers::ethercat::kSimulatedMark), Fault::kNone);
  EXPECT_EQ(drive("youBot"), Fault::kFrameLoss);
}

/// The fault that such answers of a simulated bus end with within a second, the window of losses.
Fault drive_simulated(std::vector<FaultEvent> faults) {
  sim::bus::YoubotBusOptions bus = Rig::options(YoubotKind::kBase, Firmware::k148, std::move(faults));
  bus.mark = drivers::ethercat::kSimulatedMark;
  Rig rig(bus, {.kind = YoubotKind::kBase});
  rig.robot->activate();
  rig.enable();
  rig.command_all_velocity(2.0);
  rig.run_until([&] { return rig.emulation.wire().now() >= 7000ms; });
  return rig.status.fault;
}

/// A quarter of the answers is lost, and the others come twice.
TEST(EthercatRobot, OnASimulatedBusASecondAnswerExcusesNoLoss) {
  std::vector<FaultEvent> faults;
  for (int n = 0; n < 375; ++n) {
    faults.push_back({.kind = FaultKind::kDropReply, .at = 6s + n * 4ms});
    faults.push_back({.kind = FaultKind::kDuplicate, .at = 6001ms + n * 4ms, .count = 3});
  }
  EXPECT_EQ(drive_simulated(std::move(faults)), Fault::kFrameLoss);
}

/// A hold-up of 90 cycles whose answers all come later, and then as many lost answers as are allowed.
TEST(EthercatRobot, OnASimulatedBusALateAnswerExcusesItsOwnCycleAlone) {
  const auto drive = [](int lost) {
    std::vector<FaultEvent> faults{{.kind = FaultKind::kDelay, .at = 6s, .count = 90, .delay = 25ms}};
    for (int n = 0; n < lost; ++n) faults.push_back({.kind = FaultKind::kDropReply, .at = 6200ms + n * 2ms});
    return drive_simulated(std::move(faults));
  };
  EXPECT_EQ(drive(190), Fault::kNone);
  EXPECT_EQ(drive(205), Fault::kFrameLoss);
}

TEST(EthercatRobot, AConfiguredToleranceHoldsOnASimulatedBusToo) {
  EXPECT_EQ(LateAnswers(drivers::ethercat::kSimulatedMark, 20, 20).drive(), Fault::kNone);
  EXPECT_EQ(LateAnswers(drivers::ethercat::kSimulatedMark, 21, 20).drive(), Fault::kSimulatorSilent);
}

TEST(EthercatRobot, OnASimulatedBusAMissingSlaveIsNoLateAnswer) {
  LateAnswers missing(drivers::ethercat::kSimulatedMark, 1, {}, FaultKind::kSlaveOff);
  missing.rig.robot->activate();
  missing.rig.enable();
  missing.rig.run_until([&] { return missing.rig.emulation.wire().now() >= 6000ms; });
  EXPECT_TRUE(missing.rig.status.ok());
  missing.rig.run(12ms);
  EXPECT_EQ(missing.rig.status.fault, Fault::kPartialBus);
  EXPECT_EQ(missing.rig.status.joint, 2);
}

// ---- simulations in lock-step ----

/// An interface that takes its time, before it has sent and until it has fetched.
class SlowLink final : public drivers::ethercat::Link {
 public:
  SlowLink(std::unique_ptr<drivers::ethercat::Link> link, VirtualClock& clock)
      : link_(std::move(link)), clock_(clock) {}
  bool send(std::span<const std::uint8_t> frame) noexcept override {
    clock_.sleep_until(clock_.now() + 300us);
    sent_at = clock_.now();
    return link_->send(frame);
  }
  std::size_t receive(std::span<std::uint8_t> buffer, std::chrono::nanoseconds timeout) noexcept override {
    clock_.sleep_until(clock_.now() + 400us);
    return link_->receive(buffer, timeout);
  }
  std::chrono::nanoseconds now() const noexcept override { return link_->now(); }
  void wait(std::chrono::nanoseconds duration) override { link_->wait(duration); }
  int last_error() const noexcept override { return link_->last_error(); }
  const std::string& name() const noexcept override { return link_->name(); }
  std::chrono::nanoseconds sent_at{};

 private:
  std::unique_ptr<drivers::ethercat::Link> link_;
  VirtualClock& clock_;
};

TEST(EthercatRobot, ASamplesStampIsWhenItsFrameHadBeenSent) {
  Rig rig;
  const SlowLink* link = nullptr;
  rig.robot = rig.watch.over(make_ethercat_robot(
      [&]() -> std::unique_ptr<drivers::ethercat::Link> {
        auto slow = std::make_unique<SlowLink>(
            std::make_unique<sim::bus::BusLink>(rig.emulation.wire(), &rig.emulation), rig.clock);
        link = slow.get();
        return slow;
      },
      {.kind = YoubotKind::kBase}, rig.clock, 1ms));
  rig.robot->activate();
  rig.enable();
  for (int n = 0; n < 10; ++n) {
    ASSERT_TRUE(rig.step().ok());
    EXPECT_EQ(rig.sample.stamp, link->sent_at);
    // The boards had it somewhere between.
    EXPECT_EQ(rig.sample.earliest, link->sent_at - 300us);
    EXPECT_EQ(rig.sample.latest, link->sent_at + 400us);
  }
}

/// On a clock as the machine's, on which the loop is late.
TEST(EthercatRobot, ASimulationInLockStepGoesByItsFramesAndNotByTheClock) {
  sim::bus::YoubotBusOptions bus = Rig::options(YoubotKind::kBase);
  bus.mark = drivers::ethercat::kLockStepMark;
  Rig rig(bus, {.kind = YoubotKind::kBase});
  rig.robot->activate();
  rig.enable();
  for (const auto late : {0ms, 0ms, 10ms, 0ms, 30ms, 1ms}) {
    const std::chrono::nanoseconds before = rig.sample.stamp;
    rig.clock.sleep_until(rig.clock.now() + late);
    ASSERT_TRUE(rig.step().ok());
    EXPECT_EQ(rig.sample.stamp - before, 1ms);
    EXPECT_EQ(rig.sample.earliest, rig.sample.stamp);
    EXPECT_EQ(rig.sample.latest, rig.sample.stamp);
  }
}

/// To a simulation that can go away, and nothing comes back.
class Forsaken final : public drivers::ethercat::Link {
 public:
  struct State {
    bool gone = false;
    int gone_after = -1;  // that many frames; none: it is not
    int sent_since = 0;
  };
  Forsaken(std::unique_ptr<drivers::ethercat::Link> link, State& state)
      : link_(std::move(link)), state_(state) {}
  bool send(std::span<const std::uint8_t> frame) noexcept override {
    state_.gone = state_.gone || state_.gone_after == 0;
    if (state_.gone_after > 0) --state_.gone_after;
    if (!state_.gone) return link_->send(frame);
    ++state_.sent_since;
    return true;
  }
  std::size_t receive(std::span<std::uint8_t> buffer, std::chrono::nanoseconds timeout) noexcept override {
    return state_.gone ? 0 : link_->receive(buffer, timeout);
  }
  std::chrono::nanoseconds now() const noexcept override { return link_->now(); }
  void wait(std::chrono::nanoseconds duration) override { link_->wait(duration); }
  int last_error() const noexcept override { return link_->last_error(); }
  const std::string& name() const noexcept override { return link_->name(); }

 private:
  std::unique_ptr<drivers::ethercat::Link> link_;
  State& state_;
};

/// A simulation in lock-step over a link in lock-step.
struct LockStepRig : Rig {
  explicit LockStepRig(YoubotKind kind, std::string_view mark = drivers::ethercat::kLockStepMark)
      : Rig(marked(kind, mark), {.kind = kind}) {
    robot = watch.over(make_ethercat_robot(
        [this]() -> std::unique_ptr<drivers::ethercat::Link> {
          return std::make_unique<drivers::ethercat::LockStepLink>(
              std::make_unique<Forsaken>(std::make_unique<sim::bus::BusLink>(emulation.wire(), &emulation),
                                         simulation),
              /*lifted=*/true);
        },
        {.kind = kind}, clock, 1ms));
  }
  static sim::bus::YoubotBusOptions marked(YoubotKind kind, std::string_view mark) {
    sim::bus::YoubotBusOptions bus = options(kind);
    bus.mark = mark;
    return bus;
  }

  Forsaken::State simulation;
};

TEST(EthercatRobot, InLockStepItLeavesABusAloneThatDoesNotSayItIsSimulated) {
  LockStepRig rig(YoubotKind::kBase, "");
  try {
    rig.robot->activate();
    ADD_FAILURE() << "it took a robot that may be real";
  } catch (const SetupError& error) {
    EXPECT_NE(std::string(error.what()).find("slave 1 (KR-845)"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("youbot-sim --lock-step"), std::string::npos) << error.what();
  }
  for (std::size_t slave = 0; slave < rig.emulation.bus().size(); ++slave)
    EXPECT_EQ(rig.emulation.bus().slave(slave).state(), drivers::ethercat::AlState::kInit);
  rig.command.enable = true;
  EXPECT_EQ(rig.step().fault, Fault::kNotActive);
}

TEST(EthercatRobot, InLockStepItDrivesASimulationThatSaysSo) {
  LockStepRig rig(YoubotKind::kBase);
  rig.robot->activate();
  rig.enable();
  rig.command_all_velocity(2.0);
  rig.run(500ms);
  EXPECT_GT(rig.sample.joints[3].position_rad, 0.3);
}

TEST(EthercatRobot, InLockStepItTakesNothingBackThatLeftOperation) {
  LockStepRig rig(YoubotKind::kBase);
  rig.robot->activate();
  rig.enable();
  rig.emulation.slave(2).report_error(drivers::ethercat::AlState::kSafeOp, 0x001B);
  rig.run(500ms);
  EXPECT_EQ(rig.status.fault, Fault::kPartialBus);
  // Without lock-step this brings it back; here it may be another robot by now.
  rig.command.enable = false;
  rig.run(2s);
  EXPECT_EQ(rig.emulation.slave(2).state(), drivers::ethercat::AlState::kSafeOp);
}

TEST(EthercatRobot, InLockStepASimulationThatIsGoneIsWaitedForOnce) {
  LockStepRig rig(YoubotKind::kBase);
  rig.robot->activate();
  rig.enable();
  rig.simulation.gone = true;
  rig.run(11ms);
  EXPECT_EQ(rig.status.fault, Fault::kLinkDown);
  EXPECT_NE(rig.robot->explain(rig.status).find("simulation in lock-step on emulated bus does not answer"),
            std::string::npos)
      << rig.robot->explain(rig.status);
  EXPECT_FALSE(rig.sample.enabled);
  rig.command.enable = false;
  rig.run(50ms);
  EXPECT_EQ(rig.status.fault, Fault::kLinkDown);
  rig.robot->deactivate();
  EXPECT_EQ(rig.simulation.sent_since, 1) << "each frame would be waited for";
  rig.simulation.gone = false;
  rig.robot->activate();
  rig.enable();
  EXPECT_TRUE(rig.status.ok());
}

/// A simulation in lock-step that goes away; `frames` of the way out are still answered.
int sent_to_the_dead(bool gripper_moves, int frames) {
  LockStepRig rig(YoubotKind::kArm);
  rig.robot->activate();
  rig.enable();
  if (gripper_moves) {
    rig.command.grippers[0] = {.move = true, .opening_m = 0.0};
    rig.run(200ms);
    EXPECT_EQ(rig.sample.grippers[0].state, GripperState::kMoving);
  }
  rig.simulation.gone_after = frames;
  rig.robot->deactivate();
  return rig.simulation.sent_since;
}

TEST(EthercatRobot, InLockStepASimulationThatGoesWhileItIsLeftIsWaitedForOnce) {
  for (const int frames : {0, 1, 2, 3})
    EXPECT_EQ(sent_to_the_dead(/*gripper_moves=*/false, frames), 1) << frames;
  // The gripper is stopped first, in cycles; then the slaves would be taken down.
  for (const int frames : {0, 1, 2, 3})
    EXPECT_EQ(sent_to_the_dead(/*gripper_moves=*/true, frames), 1) << frames;
}

TEST(EthercatRobot, InVirtualTimeAnInterfaceIsRefused) {
  const VirtualClock clock;
  EXPECT_THROW((void)make_ethercat_robot("eth0", {}, clock, 1ms), std::invalid_argument);
}

}  // namespace ethercat_robot_test
}  // namespace hal
