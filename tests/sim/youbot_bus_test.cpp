// The whole emulated robot on its bus: order, commutation, motion of base and arm, faults.
#include "sim/bus/youbot_bus.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <string>
#include <tuple>
#include <vector>

#include "drivers/tmcl/process_data.h"
#include "hal/youbot_axes.h"
#include "tests/sim/bus_hand_master.h"
#include "tests/support/no_alloc_guard.h"

namespace sim::bus::test {
namespace youbot_bus_test {

using drivers::tmcl::ControllerMode;
using drivers::tmcl::DriveInput;
using drivers::tmcl::DriveOutput;
using drivers::tmcl::Firmware;
using drivers::tmcl::StatusFlag;

std::vector<std::string> names(const YoubotBusOptions& options) {
  YoubotBus robot(options);
  std::vector<std::string> found;
  for (std::size_t i = 0; i < robot.bus().size(); ++i)
    found.push_back(robot.bus().slave(i).description().name);
  return found;
}

/// A robot in OP with a master that repeats one output per joint every millisecond.
class Driven {
 public:
  explicit Driven(const YoubotBusOptions& options) : robot(options), firmware(options.board.firmware) {
    outputs.resize(robot.joint_count());
    inputs.resize(robot.joint_count());
    master.bring_up(AlState::kOp);
  }

  void run(int cycles) {
    for (int i = 0; i < cycles; ++i) {
      Bytes image(master.image_bytes());
      for (std::size_t k = 0; k < outputs.size(); ++k) pack(outputs[k], std::span(image).subspan(40 * k, 40));
      const Answer answer = master.exchange(image);
      for (std::size_t k = 0; k < inputs.size() && answer.returned; ++k)
        unpack(firmware, std::span(answer.data).subspan(40 * (outputs.size() + k), 40), inputs[k]);
      robot.advance(1ms);
    }
  }
  void set_all(ControllerMode mode, std::int32_t value) {
    std::ranges::fill(outputs, DriveOutput{mode, value});
  }
  bool all_initialized() const {
    return std::ranges::all_of(
        inputs, [](const DriveInput& input) { return input.flags.has(StatusFlag::kInitialized); });
  }
  void commutate() {
    if (firmware == Firmware::k148) {
      set_all(ControllerMode::kInitialize, 0);
      run(600);
    } else {
      set_all(ControllerMode::kVelocity, -100);  // away from the home stops
      for (int i = 0; i < 1000 && !all_initialized(); ++i) run(1);
    }
    set_all(ControllerMode::kVelocity, 0);
    run(300);
  }

  YoubotBus robot;
  Firmware firmware;
  HandMaster master{robot.bus()};
  std::vector<DriveOutput> outputs;
  std::vector<DriveInput> inputs;
};

TEST(YoubotBus, StandsInTheOrderOfTheRobot) {
  const std::string w = "TMCM-1632", j = "TMCM-1610", b = "KR-845", a = "KR-843";
  EXPECT_EQ(names({.robot = YoubotKind::kBase}), (std::vector{b, w, w, w, w}));
  EXPECT_EQ(names({.robot = YoubotKind::kArm}), (std::vector{a, j, j, j, j, j}));
  EXPECT_EQ(names({.robot = YoubotKind::kBaseAndArm}), (std::vector{b, w, w, w, w, a, j, j, j, j, j}));
  EXPECT_EQ(names({.robot = YoubotKind::kBaseAndTwoArms}).size(), 17U);
  const std::string w0 = "TMCM-174", j0 = "TMCM-KR-841";
  EXPECT_EQ(names({.robot = YoubotKind::kBaseAndArm, .hardware = Hardware::kFirst}),
            (std::vector{b, w0, w0, w0, w0, a, j0, j0, j0, j0, j0}));
}

TEST(YoubotBus, PowerBoardsHaveNoProcessDataAndMotorBoardsFortyBytesEachWay) {
  YoubotBus robot({.robot = YoubotKind::kBaseAndArm});
  for (std::size_t i = 0; i < robot.bus().size(); ++i) {
    const SlaveDescription& slave = robot.bus().slave(i).description();
    const int bytes = slave.name.starts_with("KR") ? 0 : 40;
    EXPECT_EQ(slave.outputs.bytes, bytes) << slave.name;
    EXPECT_EQ(slave.inputs.bytes, bytes) << slave.name;
    EXPECT_EQ(slave.vendor, 0x286U);
  }
  EXPECT_EQ(robot.joint_count(), 9U);
  EXPECT_EQ(robot.position(0), 1U);
  EXPECT_EQ(robot.position(4), 6U);
}

TEST(YoubotBus, HasTheAxesThatTheDriverSoftwareExpects) {
  const auto compare = [](const BoardAxis& ours, const hal::AxisData& theirs) {
    EXPECT_DOUBLE_EQ(ours.gear_ratio, theirs.constants.gear_ratio);
    EXPECT_EQ(ours.ticks_per_motor_rev, theirs.constants.ticks_per_motor_rev);
    EXPECT_DOUBLE_EQ(ours.torque_constant_Nm_per_A, theirs.constants.torque_constant_Nm_per_A);
    EXPECT_EQ(ours.inverted, theirs.constants.inverted);
    EXPECT_EQ(ours.motor_poles, 2 * theirs.constants.pole_pairs);
    EXPECT_DOUBLE_EQ(ours.current_limit_A, theirs.current_limit_A);
  };
  compare(kWheelBoardAxis, hal::kWheelAxis);
  for (std::size_t i = 0; i < 5; ++i) compare(kArmJointData[i].axis, hal::kArmAxes[i]);
}

class EveryRobot : public ::testing::TestWithParam<std::tuple<YoubotKind, Firmware>> {
 protected:
  YoubotBusOptions options() const {
    YoubotBusOptions result{.robot = std::get<0>(GetParam())};
    result.board.firmware = std::get<1>(GetParam());
    return result;
  }
};
INSTANTIATE_TEST_SUITE_P(Robots, EveryRobot,
                         ::testing::Combine(::testing::Values(YoubotKind::kBase, YoubotKind::kArm,
                                                              YoubotKind::kBaseAndArm,
                                                              YoubotKind::kBaseAndTwoArms),
                                            ::testing::Values(Firmware::k148, Firmware::k200)));

TEST_P(EveryRobot, ComesToOpAndFindsItsCommutation) {
  Driven driven(options());
  for (std::size_t i = 0; i < driven.robot.bus().size(); ++i) EXPECT_EQ(driven.master.al_status(i), 8) << i;
  driven.run(10);
  EXPECT_FALSE(driven.all_initialized());
  driven.commutate();
  EXPECT_TRUE(driven.all_initialized());
  for (const DriveInput& input : driven.inputs) EXPECT_TRUE(input.flags.has(StatusFlag::kMotorHalted));
}

TEST(YoubotBus, FourWheelsOnOneBaseDriveItForward) {
  for (const Firmware firmware : {Firmware::k148, Firmware::k200}) {
    YoubotBusOptions options;
    options.board.firmware = firmware;
    Driven driven(options);
    driven.commutate();
    const auto from = driven.robot.base().pose();
    // Forward: left wheels turn negative (official driver). 247 rpm are 1 rad/s at the wheel.
    for (std::size_t i = 0; i < 4; ++i)
      driven.outputs[i] = {ControllerMode::kVelocity, i % 2 == 0 ? -494 : 494};
    driven.run(2000);
    EXPECT_NEAR(driven.inputs[1].velocity_rpm, 494, 40);  // five sigma of the sensor's noise, 7.4 rpm
    const auto to = driven.robot.base().pose();
    // 2 rad/s on wheels of 0.0475 m for 2 s, less the ramp of 0.25 s; friction differs from wheel to wheel.
    const double radius_m = BaseParameters{}.geometry.wheel_radius_m;
    EXPECT_NEAR(std::hypot(to.x_m - from.x_m, to.y_m - from.y_m), 2.0 * radius_m * 1.87, 0.02);
    EXPECT_GT((to.x_m - from.x_m) * std::cos(from.yaw_rad), 0.1);
    EXPECT_NEAR(driven.robot.position_rad(1), 2.0 * 1.87, 0.5);
  }
}

TEST(YoubotBus, CurrentOnAllWheelsTurnsTheBaseCounterClockwise) {
  Driven driven({});
  driven.commutate();
  driven.set_all(ControllerMode::kCurrent, 800);
  driven.run(500);
  EXPECT_GT(driven.robot.base().twist()[2], 0.1);
  EXPECT_NEAR(driven.inputs[0].current_mA, 800, 20);  // ten sigma of the sensor's noise, 1.7 mA
}

TEST(YoubotBus, AnArmJointDrivenIntoItsHomeStopDrawsTheCurrentThatHomingLooksFor) {
  // Speeds and thresholds of the official driver; all motors turn positive.
  constexpr std::array<std::int32_t, 5> kSpeed_rpm{156, 156, 100, 71, 71};
  constexpr std::array<std::int32_t, 5> kThreshold_mA{2000, 500, 1000, 500, 500};
  Driven driven({.robot = YoubotKind::kArm});
  driven.commutate();
  for (std::size_t i = 0; i < 5; ++i) driven.outputs[i] = {ControllerMode::kVelocity, kSpeed_rpm[i]};
  driven.run(1000);  // 6 degrees a second: 0.1 of the 0.2 rad
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_LT(std::abs(driven.inputs[i].current_mA), kThreshold_mA[i])
        << "joint " << i + 1 << " moves freely";
    EXPECT_NEAR(std::abs(driven.robot.position_rad(i)), 0.1, 0.03) << "joint " << i + 1;
  }
  int cycles = 0;
  std::array<bool, 5> touched{};
  while (!std::ranges::all_of(touched, std::identity{}) && cycles++ < 5000) {
    driven.run(1);
    for (std::size_t i = 0; i < 5; ++i) {
      if (touched[i] || std::abs(driven.inputs[i].current_mA) <= kThreshold_mA[i]) continue;
      touched[i] = true;
      driven.outputs[i] = {ControllerMode::kCurrent, 0};
    }
  }
  EXPECT_LT(cycles, 3000);
  driven.run(100);
  for (std::size_t i = 0; i < 5; ++i) {
    // Within a quarter of a degree: the stop gives a milliradian, and pushes back.
    EXPECT_NEAR(driven.robot.position_rad(i), 0.0, 0.004) << "joint " << i + 1;
    EXPECT_NEAR(driven.inputs[i].current_mA, 0, 10);
  }
}

TEST(YoubotBus, AnArmJointStopsAtItsFarEndToo) {
  YoubotBusOptions options{.robot = YoubotKind::kArm};
  options.arm_start_rad = {5.8, 2.6, -5.1, 3.5, 5.8};  // all less than 0.12 rad away from it
  Driven driven(options);
  driven.commutate();
  for (std::size_t i = 0; i < 5; ++i) driven.outputs[i] = {ControllerMode::kVelocity, -150};
  driven.run(3000);
  const double far[] = {5.8992, 2.7053, -5.1836, 3.5779, 5.8469};  // 338, 155, -297, 205, 335 degrees
  for (std::size_t i = 0; i < 5; ++i)
    EXPECT_NEAR(driven.robot.position_rad(i), far[i], 0.002) << "joint " << i + 1;
}

TEST(YoubotBus, ABlockedJointStopsBeforeItsHomeStop) {
  Driven driven({.robot = YoubotKind::kArm});
  driven.commutate();
  driven.robot.arm_joint(0, 0).block_at(0.1);
  driven.outputs[0] = {ControllerMode::kVelocity, 156};
  driven.run(3000);
  EXPECT_NEAR(driven.robot.position_rad(0), 0.1, 0.002);  // 3 A press the obstacle in by 0.8 mrad
}

TEST(YoubotBus, AFaultScriptTakesASlaveAwayAndItComesBackWithoutCommutation) {
  YoubotBusOptions options;
  options.wire.faults = {{.kind = FaultKind::kSlaveOff, .at = 1s, .duration = 500ms, .slave = 2}};
  Driven driven(options);
  driven.commutate();
  EXPECT_TRUE(driven.robot.board(1).initialized());
  driven.run(1000);
  EXPECT_TRUE(driven.robot.slave(1).powered());
  EXPECT_FALSE(driven.robot.board(1).initialized());
  EXPECT_TRUE(driven.robot.board(0).initialized());
  EXPECT_TRUE(driven.robot.board(3).input().flags.has(StatusFlag::kTimeout)) << "out of reach meanwhile";
}

TEST(YoubotBus, TheSizeOfTheStepsDoesNotMatter) {
  const auto pose_after = [](std::chrono::nanoseconds step) {
    YoubotBus robot;
    HandMaster master(robot.bus());
    master.bring_up(AlState::kOp);
    const auto exchange = [&](ControllerMode mode, std::int32_t value, int cycles) {
      Bytes image(master.image_bytes());
      for (std::size_t i = 0; i < 4; ++i)
        pack(DriveOutput{mode, value}, std::span(image).subspan(40 * i, 40));
      for (int i = 0; i < cycles; ++i) {
        master.exchange(image);
        for (std::chrono::nanoseconds left = 10ms; left.count() > 0; left -= std::min(left, step))
          robot.advance(std::min(left, step));
      }
    };
    exchange(ControllerMode::kInitialize, 0, 60);
    exchange(ControllerMode::kVelocity, 300, 50);
    return robot.base().pose().yaw_rad;
  };
  const double whole = pose_after(10ms);
  EXPECT_GT(whole, 0.01);
  EXPECT_EQ(pose_after(1ms), whole);
  EXPECT_EQ(pose_after(70us), whole);
}

TEST(YoubotBus, AdvanceDoesNotAllocateOrLock) {
  Driven driven({.robot = YoubotKind::kBaseAndTwoArms});
  driven.commutate();
  const support::NoAllocGuard guard;
  for (int i = 0; i < 200; ++i) driven.robot.advance(1ms);
  EXPECT_EQ(guard.violations(), 0);
}

// ---- base and arm as one body ----

YoubotBusOptions coupled(Firmware firmware = Firmware::k148) {
  YoubotBusOptions options{.robot = YoubotKind::kBaseAndArm, .coupled = true};
  options.board.firmware = firmware;
  return options;
}
constexpr std::size_t kWheels = 4;

TEST(CoupledYoubotBus, ComesToOpAndFindsItsCommutation) {
  for (const Firmware firmware : {Firmware::k148, Firmware::k200}) {
    Driven driven(coupled(firmware));
    driven.run(10);
    EXPECT_FALSE(driven.all_initialized());
    driven.commutate();
    EXPECT_TRUE(driven.all_initialized());
    EXPECT_EQ(driven.robot.arm_count(), 1U);
    EXPECT_EQ(driven.inputs.size(), kWheels + 5);
  }
}

TEST(CoupledYoubotBus, BoardsCountTheJointsOfTheOneRobot) {
  Driven driven(coupled());
  driven.commutate();
  const std::vector<DriveInput> before = driven.inputs;
  std::vector<double> before_rad;
  for (std::size_t i = 0; i < 9; ++i) before_rad.push_back(driven.robot.position_rad(i));
  driven.set_all(ControllerMode::kVelocity, -150);  // arm joints away from their home stops
  driven.run(800);
  driven.set_all(ControllerMode::kVelocity, 0);
  driven.run(500);
  for (std::size_t i = 0; i < 9; ++i) {
    const MotorUnits units(i < kWheels ? kWheelBoardAxis : kArmJointData[i - kWheels].axis);
    const double way_rad = driven.robot.position_rad(i) - before_rad[i];
    EXPECT_GT(std::abs(way_rad), 0.05) << i;
    // The encoders are on the motors: 5 N·m of weight bend a gear by 2 mrad.
    EXPECT_NEAR(driven.inputs[i].position_ticks - before[i].position_ticks,
                static_cast<double>(units.ticks(way_rad)), std::abs(static_cast<double>(units.ticks(0.004))))
        << i;
  }
}

TEST(CoupledYoubotBus, AnArmWithoutPowerSinksOntoItsStops) {
  Driven driven(coupled());
  driven.run(2000);  // bridges stay open until the commutation is known
  EXPECT_NEAR(driven.robot.position_rad(kWheels + 1), 0.0, 0.005);
  EXPECT_NEAR(driven.robot.position_rad(kWheels + 2), 0.0, 0.005);
  EXPECT_NEAR(driven.robot.position_rad(kWheels), 0.2, 0.005) << "it turns about the vertical";
}

TEST(CoupledYoubotBus, AJointThatLosesItsPowerSinksAndTheOthersHoldThemselves) {
  constexpr std::size_t kElbow = kWheels + 2;
  for (const bool lost : {false, true}) {
    Driven driven(coupled());
    driven.commutate();
    driven.outputs[kWheels + 1] = {ControllerMode::kVelocity, -500};  // 0.34 rad/s
    driven.outputs[kElbow] = {ControllerMode::kVelocity, -500};       // 0.52 rad/s
    driven.run(1500);
    driven.set_all(ControllerMode::kVelocity, 0);
    driven.run(1000);
    std::array<double, 9> before_rad{};
    for (std::size_t i = 0; i < 9; ++i) before_rad[i] = driven.robot.position_rad(i);
    driven.robot.slave(kElbow).set_fault(BoardFault::kUndervoltage, lost);
    driven.run(1000);
    for (std::size_t i = kWheels; i < 9; ++i) {
      const double way_rad = std::abs(driven.robot.position_rad(i) - before_rad[i]);
      if (lost && i == kElbow)
        EXPECT_GT(way_rad, 0.2);
      else
        EXPECT_LT(way_rad, 0.05) << "arm " << i - kWheels + 1;
    }
  }
}

TEST(CoupledYoubotBus, TheArmsSwingTurnsABaseWhoseWheelsCoast) {
  YoubotBusOptions options = coupled();
  options.base.roller_grip = 0;  // on ice
  options.base.roller_resistance = 0;
  Driven driven(options);
  driven.commutate();
  const double before_rad = driven.robot.pose().yaw_rad;
  driven.outputs[kWheels] = {ControllerMode::kVelocity, -1000};
  driven.run(1500);
  EXPECT_GT(std::abs(driven.robot.pose().yaw_rad - before_rad), 0.005);
  EXPECT_EQ(driven.robot.pose().yaw_rad, driven.robot.manipulator()->pose().yaw_rad);
}

TEST(CoupledYoubotBus, AdvanceDoesNotAllocateOrLock) {
  Driven driven(coupled());
  driven.commutate();
  const support::NoAllocGuard guard;
  for (int i = 0; i < 200; ++i) driven.robot.advance(1ms);
  EXPECT_EQ(guard.violations(), 0);
}

TEST(CoupledYoubotBus, NeedsABaseWithOneArmThatStartsBetweenItsEndStops) {
  for (const YoubotKind kind : {YoubotKind::kBase, YoubotKind::kArm, YoubotKind::kBaseAndTwoArms})
    EXPECT_THROW(YoubotBus({.robot = kind, .coupled = true}), std::invalid_argument);
  EXPECT_EQ(YoubotBus({.robot = YoubotKind::kBaseAndArm}).manipulator(), nullptr);
  YoubotBusOptions options = coupled();
  options.arm_start_rad[2] = 0.5;
  EXPECT_THROW(YoubotBus{options}, std::invalid_argument);
}

TEST(YoubotBus, RefusesAStartOutsideTheEndStops) {
  YoubotBusOptions options{.robot = YoubotKind::kArm};
  options.arm_start_rad[2] = 0.5;
  EXPECT_THROW(YoubotBus{options}, std::invalid_argument);
}

}  // namespace youbot_bus_test
}  // namespace sim::bus::test
