// Functions of an arm in addition to those of wheels: end stops, a gripper, hot windings, stored parameters.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <string>

#include "drivers/tmcl/axis_parameters.h"
#include "hal/axis_scale.h"
#include "hal/youbot_axes.h"
#include "sim/can/bench_rig.h"
#include "tests/hal/ethercat_rig.h"
#include "tests/support/lying_board.h"
#include "tests/support/no_alloc_guard.h"

namespace hal {
namespace ethercat_arm_test {

using namespace std::chrono_literals;
using drivers::tmcl::Firmware;
using sim::bus::FaultEvent;
using sim::bus::FaultKind;
using Kind = YoubotKind;
using Rig = test::EthercatRig;

constexpr std::size_t kHand = 4;         // arm joint 5, whose mailbox leads to the gripper
constexpr double kTravel_ticks = 66000;  // a bar's, closed to open

// ---- end stops ----

class ArmHoming : public ::testing::TestWithParam<Firmware> {};

TEST_P(ArmHoming, FindsTheZeroOfEveryJointOnceAfterPowerUp) {
  Rig rig(Rig::options(Kind::kArm, GetParam()), {.kind = Kind::kArm, .home_arms = true});
  rig.robot->activate();
  rig.run(10ms);
  EXPECT_FALSE(rig.sample.joints[0].homed);
  rig.command.enable = true;
  rig.run_until([&] { return rig.sample.enabled; }, 60s);
  ASSERT_TRUE(rig.sample.enabled) << describe(rig.status.fault) << ": "
                                  << ::testing::PrintToString(rig.robot->report());

  // Zero is the end stop: the true joint is there, within the degree that homing allows, and so is the
  // sample.
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_TRUE(rig.sample.joints[i].homed) << i;
    EXPECT_NEAR(rig.emulation.position_rad(i), 0.0, 0.0175) << i;
    EXPECT_NEAR(rig.sample.joints[i].position_rad, 0.0, 0.0175) << i;
  }

  // Known from now on, until its power goes.
  std::array<double, 5> stops{};
  for (std::size_t i = 0; i < 5; ++i) stops[i] = rig.emulation.position_rad(i);
  rig.command.enable = false;
  rig.run(100ms);
  rig.command.enable = true;
  const auto again = rig.run_until([&] { return rig.sample.enabled; }, 5s);
  EXPECT_LT(again, 1s);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_TRUE(rig.sample.joints[i].homed) << i;
    EXPECT_NEAR(rig.emulation.position_rad(i), stops[i], 0.0175) << i << " moved";
  }
}

/// Without its commutation firmware 2.0 has no torque, and the arm falls: 0.2 s after power-up it is under
/// way.
TEST(EthercatArm, ThatStillSinksIsHomedOnceItRests) {
  sim::bus::YoubotBusOptions bus = Rig::options(Kind::kBaseAndArm, Firmware::k200);
  bus.coupled = true;
  Rig rig(bus, {.kind = Kind::kBaseAndArm, .home_arms = true});
  rig.robot->activate();
  rig.run(200ms);
  rig.command.enable = true;
  rig.run_until([&] { return rig.sample.enabled || !rig.status.ok(); }, 60s);
  EXPECT_TRUE(rig.sample.enabled) << testing::PrintToString(rig.robot->device_faults());
}
INSTANTIATE_TEST_SUITE_P(BothFirmwares, ArmHoming, ::testing::Values(Firmware::k148, Firmware::k200),
                         [](const auto& test) {
                           return std::string(test.param == Firmware::k148 ? "k148" : "k200");
                         });

// What is commanded while drives are prepared is a guess: homing moves the zero, and replies may be lost just
// then.
TEST(EthercatArm, NothingActsThatWasCommandedBeforeASampleSaidThatTheDrivesObey) {
  const auto enabled_at = [](std::vector<FaultEvent> faults) {
    Rig rig(Rig::options(Kind::kArm, Firmware::k148, std::move(faults)),
            {.kind = Kind::kArm, .home_arms = true});
    rig.robot->activate();
    rig.command.enable = true;
    for (std::size_t i = 0; i < 5; ++i)
      rig.command.joints[i] = JointCommand::position_rad(i == 2 ? -1.0 : 1.0);
    std::chrono::nanoseconds enabled{};
    bool said = false;
    const auto obeys = [&] {
      const auto& followed = rig.emulation.board(kHand).followed();
      return followed && followed->mode == drivers::tmcl::ControllerMode::kPosition;
    };
    for (int cycle = 0; cycle < 60'000 && !obeys(); ++cycle) {
      const std::chrono::nanoseconds stamp = rig.sample.stamp;
      const bool said_before = said;
      (void)rig.step();
      if (rig.sample.enabled && enabled == 0ms) enabled = rig.emulation.wire().now();
      said = said || (rig.sample.enabled && rig.sample.stamp != stamp);
      EXPECT_TRUE(said_before || !obeys());
    }
    EXPECT_TRUE(obeys());
    return enabled;
  };
  const std::chrono::nanoseconds enabled = enabled_at({});
  for (const auto before : {1ms, 2ms, 3ms})
    (void)enabled_at({FaultEvent{.kind = FaultKind::kDropReply, .at = enabled - before, .count = 5}});
}

TEST(EthercatArm, AJointThatIsBlockedOnItsWayFailsWithItsNameAndNothingIsEnabled) {
  Rig rig(Rig::options(Kind::kArm), {.kind = Kind::kArm, .home_arms = true});
  rig.robot->activate();
  // It gives way on the first touch and is elsewhere on the second.
  rig.emulation.slave(2).set_fault(sim::bus::BoardFault::kStuckEncoder, true);
  rig.command.enable = true;
  rig.run_until([&] { return !rig.status.ok(); }, 60s);
  EXPECT_EQ(rig.status.fault, Fault::kJointFault);
  EXPECT_EQ(rig.status.joint, 2);
  EXPECT_FALSE(rig.sample.enabled);
  bool reported = false;
  for (const std::string& line : rig.robot->report())
    reported = reported || line.starts_with("arm-3: could not find its end stop: ");
  EXPECT_TRUE(reported);
}

TEST(EthercatArm, APowerCycledJointIsHomedAgainBeforeItObeys) {
  sim::bus::YoubotBusOptions bus =
      Rig::options(Kind::kArm, Firmware::k148,
                   {FaultEvent{.kind = FaultKind::kSlaveOff, .at = 40s, .duration = 200ms, .slave = 5}});
  Rig rig(bus, {.kind = Kind::kArm, .home_arms = true});
  rig.robot->activate();
  rig.command.enable = true;
  rig.run_until([&] { return rig.sample.enabled; }, 39s);
  ASSERT_TRUE(rig.sample.enabled);
  rig.run_until([&] { return !rig.status.ok(); }, 45s);
  ASSERT_EQ(rig.status.fault, Fault::kPartialBus);
  rig.command.enable = false;
  rig.run_until([&] { return rig.status.ok(); }, 5s);
  EXPECT_FALSE(rig.sample.joints[kHand].homed);
  EXPECT_TRUE(rig.sample.joints[0].homed);
  rig.command.enable = true;
  rig.run_until([&] { return rig.sample.enabled; }, 30s);
  ASSERT_TRUE(rig.sample.enabled) << describe(rig.status.fault) << ": "
                                  << ::testing::PrintToString(rig.robot->report());
  EXPECT_TRUE(rig.sample.joints[kHand].homed);
}

TEST(EthercatArm, TheFirstPositionCommandAfterHomingIsTrueEvenWhenAReplyIsLostJustThen) {
  // A joint that lost its power continues from its position, while its counter begins at zero: until it is
  // homed the two differ by this.
  constexpr double kTarget_rad = 0.5;
  const auto homed_again_at = [&](std::vector<FaultEvent> faults) {
    faults.push_back({.kind = FaultKind::kSlaveOff, .at = 12s, .duration = 200ms, .slave = kHand + 1});
    Rig rig(Rig::options(Kind::kArm, Firmware::k148, std::move(faults)),
            {.kind = Kind::kArm, .home_arms = true});
    rig.robot->activate();
    for (std::size_t i = 0; i < 5; ++i)
      rig.command.joints[i] = JointCommand::position_rad(i == 2 ? -kTarget_rad : kTarget_rad);
    rig.command.enable = true;
    rig.run_until([&] { return rig.emulation.wire().now() > 11s && !rig.status.ok(); }, 20s);
    EXPECT_EQ(rig.status.fault, Fault::kPartialBus);
    EXPECT_NEAR(rig.sample.joints[kHand].position_rad, kTarget_rad, 0.02);
    rig.command.enable = false;
    rig.run_until([&] { return rig.status.ok(); }, 5s);
    rig.command.enable = true;
    rig.run_until([&] { return rig.sample.enabled; }, 20s);
    EXPECT_TRUE(rig.sample.enabled) << describe(rig.status.fault);
    const std::chrono::nanoseconds enabled = rig.emulation.wire().now();
    const auto& followed = rig.emulation.board(kHand).followed();
    rig.run_until([&] { return followed->mode == drivers::tmcl::ControllerMode::kPosition; }, 20ms);
    constexpr auto kTarget = get(drivers::tmcl::drive_parameter("target_position"));
    const auto reply = drivers::tmcl::decode_mailbox_reply(rig.emulation.board(kHand).execute(kTarget));
    EXPECT_NEAR(AxisScale(kArmAxes[kHand].constants).position_rad(reply->value), kTarget_rad, 1e-3);
    return enabled;
  };
  const std::chrono::nanoseconds ready = homed_again_at({});
  for (const auto before : {0ms, 1ms, 2ms, 3ms})
    (void)homed_again_at({{.kind = FaultKind::kDropReply, .at = ready - before - 500us}});
}

TEST(EthercatArm, AReadingThatWasWrongForAWhileDoesNotStayInItsPosition) {
  Rig rig(Rig::options(Kind::kArm), {.kind = Kind::kArm, .home_arms = true});
  support::LyingBoard board(rig.emulation.board(kHand), rig.emulation.slave(kHand));
  rig.robot->activate();
  rig.enable();
  rig.command.enable = false;
  rig.run(10ms);
  const double before_rad = rig.sample.joints[kHand].position_rad;
  // Each step is about a third of the counter's range, so that many of them look like a wrap.
  board.lie([turn = std::uint32_t{0}](const support::BoardInputs&, support::BoardInputs now) mutable {
    now.position = static_cast<std::int32_t>(turn += 1'500'000'000U);
    return now;
  });
  rig.run(50ms);
  EXPECT_GT(std::abs(rig.sample.joints[kHand].position_rad - before_rad), 100);
  board.tell_truth();
  rig.run(5ms);
  EXPECT_TRUE(rig.sample.joints[kHand].homed);
  EXPECT_NEAR(rig.sample.joints[kHand].position_rad, before_rad, 1e-3);
}

// ---- gripper ----

TEST(EthercatArm, TheGripperOpensWhileTheArmGoesOn) {
  Rig rig(Kind::kArm);
  rig.robot->activate();
  rig.enable();
  EXPECT_EQ(rig.sample.grippers[0].state, GripperState::kIdle);
  EXPECT_EQ(rig.sample.grippers[1].state, GripperState::kAbsent);
  const double before_rad = rig.sample.joints[0].position_rad;
  rig.command.joints[0] = JointCommand::velocity_rad_per_s(0.2);
  rig.command.grippers[0] = {.move = true, .opening_m = 0.010};
  rig.run(1s);
  EXPECT_EQ(rig.sample.grippers[0].state, GripperState::kMoving);
  EXPECT_NEAR(rig.sample.joints[0].position_rad - before_rad, 0.2, 0.06);
  rig.command.joints[0] = JointCommand::velocity_rad_per_s(0.0);
  const auto rest = rig.run_until([&] { return rig.sample.grippers[0].state == GripperState::kIdle; }, 15s);
  EXPECT_LT(rest, 15s);
  EXPECT_TRUE(rig.status.ok());
  EXPECT_NEAR(rig.sample.grippers[0].opening_m, 0.010, 1e-5);
  for (const std::size_t bar : {0U, 1U})
    EXPECT_NEAR(rig.emulation.gripper(0).opening(bar), 0.005 / 0.0115 * kTravel_ticks, 2.0);

  // It knows now where closed is, and goes straight to the next opening; beyond the end is the end.
  rig.command.grippers[0].opening_m = 1.0;
  rig.run(500ms);
  EXPECT_GT(rig.emulation.gripper(0).opening(0), 0.005 / 0.0115 * kTravel_ticks);
  rig.run_until([&] { return rig.sample.grippers[0].state == GripperState::kIdle; }, 10s);
  EXPECT_NEAR(rig.sample.grippers[0].opening_m, kGripperTravel_m, 1e-5);
  EXPECT_NEAR(rig.emulation.gripper(0).opening(1), kTravel_ticks, 2.0);
}

TEST(EthercatArm, DisablingStopsTheGripperWhereItIs) {
  Rig rig(Kind::kArm);
  rig.robot->activate();
  rig.enable();
  rig.command.grippers[0] = {.move = true, .opening_m = 0.0};
  rig.run(300ms);
  rig.command.enable = false;
  rig.run(100ms);
  const double there = rig.emulation.gripper(0).opening(0);
  rig.run(1s);
  EXPECT_EQ(rig.emulation.gripper(0).opening(0), there);
  EXPECT_NE(rig.sample.grippers[0].state, GripperState::kMoving);
}

TEST(EthercatArm, AStopThatTheGripperDoesNotHearIsRepeated) {
  for (const auto away : {1ms, 300ms}) {
    Rig rig(Rig::options(Kind::kArm, Firmware::k148,
                         {FaultEvent{.kind = FaultKind::kCableOut, .at = 4s, .duration = away, .slave = 5}}),
            {.kind = Kind::kArm});
    rig.robot->activate();
    rig.enable();
    rig.run_until([&] { return rig.emulation.wire().now() >= 3500ms; });
    rig.command.grippers[0] = {.move = true, .opening_m = kGripperTravel_m};
    rig.run_until([&] { return rig.emulation.wire().now() >= 3999ms; });
    rig.command.enable = false;
    rig.run_until([&] { return rig.sample.grippers[0].state != GripperState::kMoving; }, 5s);
    EXPECT_EQ(rig.sample.grippers[0].state, GripperState::kIdle);
    const double there = rig.emulation.gripper(0).opening(0);
    EXPECT_LT(there, kTravel_ticks - 1000) << "it went all the way";
    rig.run(1s);
    EXPECT_EQ(rig.emulation.gripper(0).opening(0), there);
    EXPECT_NEAR(rig.emulation.gripper(0).opening(1), there, 1000);
  }
}

/// Both bars on their way to closed.
struct ClosingGripper : Rig {
  ClosingGripper() : Rig(Kind::kArm) {
    robot->activate();
    enable();
    command.grippers[0] = {.move = true, .opening_m = 0.020};
    run(15s);
    command.grippers[0].opening_m = 0.0;
    run(100ms);
  }
  std::array<double, 2> openings() {
    return {emulation.gripper(0).opening(0), emulation.gripper(0).opening(1)};
  }
};
// In 300 ms.
constexpr double kClosing_ticks = 10'000;

TEST(EthercatArm, DeactivationStopsAGripperThatMoves) {
  ClosingGripper rig;
  const std::array<double, 2> before = rig.openings();
  rig.robot->deactivate();
  const std::array<double, 2> after = rig.openings();
  rig.emulation.advance(4s);
  EXPECT_EQ(rig.openings(), after) << "it goes on";
  for (const std::size_t bar : {0U, 1U}) EXPECT_LT(before[bar] - after[bar], kClosing_ticks) << bar;
  EXPECT_TRUE(rig.robot->report().empty());
}

TEST(EthercatArm, DeactivationWithAGripperThatCannotBeReachedEndsAndSaysSo) {
  ClosingGripper rig;
  rig.emulation.bus().set_cable(0, false);
  const std::chrono::nanoseconds begin = rig.emulation.wire().now();
  rig.robot->deactivate();
  EXPECT_LT(rig.emulation.wire().now() - begin, 500ms);
  ASSERT_EQ(rig.robot->report().size(), 1U);
  EXPECT_NE(rig.robot->report()[0].find("did not acknowledge its stop"), std::string::npos);
}

TEST(EthercatArm, AGripperIsStoppedThoughItsBoardFellToInitOnTheWay) {
  for (const auto later : {0ms, 4ms, 8ms, 12ms}) {
    ClosingGripper rig;
    rig.run(later);
    rig.emulation.slave(kHand).report_error(drivers::ethercat::AlState::kInit, 0x0016);
    const std::array<double, 2> before = rig.openings();
    rig.run_until([&] { return rig.sample.grippers[0].state != GripperState::kMoving; }, 5s);
    EXPECT_EQ(rig.sample.grippers[0].state, GripperState::kIdle);
    const std::array<double, 2> after = rig.openings();
    rig.run(4s);
    EXPECT_EQ(rig.openings(), after) << "it was called idle";
    for (const std::size_t bar : {0U, 1U}) EXPECT_LT(before[bar] - after[bar], kClosing_ticks) << bar;
  }
}

TEST(EthercatArm, AMissingGripperStopsNothing) {
  sim::bus::YoubotBusOptions bus = Rig::options(Kind::kArm);
  bus.gripper = false;
  Rig rig(bus, {.kind = Kind::kArm});
  rig.robot->activate();
  rig.enable();
  EXPECT_EQ(rig.sample.grippers[0].state, GripperState::kAbsent);
  rig.command.grippers[0] = {.move = true, .opening_m = 0.01};
  rig.run(1s);
  EXPECT_TRUE(rig.status.ok());
  EXPECT_EQ(rig.sample.grippers[0].state, GripperState::kAbsent);
  const std::vector<std::string> report = rig.robot->report();
  EXPECT_TRUE(std::ranges::any_of(report, [](const std::string& line) {
    return line.starts_with("arm 1 works without gripper: ") && line.find("stall_guard") != std::string::npos;
  })) << ::testing::PrintToString(report);
}

TEST(EthercatArm, AnOpeningThatIsNotANumberIsRefused) {
  Rig rig(Kind::kArm);
  rig.robot->activate();
  rig.enable();
  rig.command.grippers[0] = {.move = true, .opening_m = std::numeric_limits<double>::quiet_NaN()};
  EXPECT_EQ(rig.step().fault, Fault::kBadCommand);
  EXPECT_FALSE(rig.sample.enabled);
}

// ---- windings ----

TEST(EthercatArm, AHotWindingStopsTheRobotAndHasToCoolBeforeItIsEnabled) {
  Rig rig(Kind::kArm);
  rig.robot->activate();
  rig.enable();
  // The factory limit bears 4 A for ever; here 3 A into the end stop are too much after 5.6 s.
  using namespace drivers::tmcl;
  (void)rig.emulation.board(0).execute(set(drive_parameter("approve_protected_parameters"), 4711));
  (void)rig.emulation.board(0).execute(set(drive_parameter("i2t_limit"), 50'000));
  rig.command.joints[0] = JointCommand::torque_Nm(-3.0 * 0.0335 * 156);
  const auto heated = rig.run_until([&] { return !rig.status.ok(); }, 60s);
  EXPECT_EQ(rig.status.fault, Fault::kJointFault);
  EXPECT_EQ(rig.status.detail, static_cast<std::uint32_t>(JointFault::kI2t));
  EXPECT_EQ(rig.status.joint, 0);
  EXPECT_NEAR(std::chrono::duration<double>(heated).count(), 50.0 / 9.0, 0.5);

  rig.command.joints[0] = JointCommand::torque_Nm(0.0);
  rig.command.enable = false;
  rig.run(10ms);
  rig.command.enable = true;
  rig.run(2s);
  EXPECT_FALSE(rig.sample.enabled) << "it cannot have cooled";
  EXPECT_EQ(rig.sample.joints[0].fault, JointFault::kI2t) << "the sample says why";
  const double winding_s = rig.emulation.board(0).parameters()[25] * 1e-3;
  rig.run_until([&] { return rig.sample.enabled; },
                std::chrono::milliseconds(static_cast<int>(1e3 * winding_s) + 5000));
  EXPECT_TRUE(rig.sample.enabled) << describe(rig.status.fault);
}

// ---- parameters ----

TEST(EthercatArm, ParametersAreWrittenAtTheStartAndAgainToADriveThatLostItsPower) {
  constexpr std::uint8_t kAcceleration = 11;
  sim::bus::YoubotBusOptions bus =
      Rig::options(Kind::kBase, Firmware::k148,
                   {FaultEvent{.kind = FaultKind::kSlaveOff, .at = 3s, .duration = 200ms, .slave = 2}});
  Rig rig(bus, {.kind = Kind::kBase,
                .parameters = {{"wheel-2", "motor_acceleration", 4321},
                               {"wheel-2", "velocity_pid1_p", 1234},
                               {"wheel-4", "motor_acceleration", 5678}}});
  const std::int32_t factory = rig.emulation.board(0).parameters()[kAcceleration];
  rig.robot->activate();
  EXPECT_EQ(rig.emulation.board(1).parameters()[kAcceleration], 4321);
  EXPECT_EQ(rig.emulation.board(1).parameters()[140], 1234);
  EXPECT_EQ(rig.emulation.board(3).parameters()[kAcceleration], 5678);
  EXPECT_EQ(rig.emulation.board(0).parameters()[kAcceleration], factory);
  rig.enable();

  rig.run_until([&] { return rig.emulation.board(1).parameters()[kAcceleration] != 4321; }, 10s);
  ASSERT_EQ(rig.emulation.board(1).parameters()[kAcceleration], factory) << "the power cycle took it";
  rig.run_until([&] { return !rig.status.ok(); }, 1s);
  ASSERT_EQ(rig.status.fault, Fault::kPartialBus);
  rig.command.enable = false;
  (void)rig.step();
  const auto recovered = rig.run_until([&] { return rig.status.ok(); }, 5s);
  EXPECT_LT(recovered, 2s + 200ms);
  rig.enable();
  EXPECT_EQ(rig.emulation.board(1).parameters()[kAcceleration], 4321);
  EXPECT_EQ(rig.emulation.board(1).parameters()[140], 1234);
}

TEST(EthercatArm, AParameterThatCannotBeIsRefusedBeforeAnythingMoves) {
  const SteadyClock clock;
  const auto refused = [&clock](const char* name, std::int32_t value) -> std::string {
    try {
      (void)make_ethercat_robot("nowhere", {.parameters = {{"wheel-1", name, value}}}, clock, 1ms);
      return "taken";
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
  };
  EXPECT_NE(refused("motor_aceleration", 1).find("'motor_aceleration' of wheel-1 is unknown to the drives"),
            std::string::npos);
  EXPECT_NE(refused("actual_speed", 1).find("can only be read"), std::string::npos);
  EXPECT_NE(refused("maximum_motor_current", 1).find("protected"), std::string::npos);
  EXPECT_NE(refused("motor_acceleration", -1).find("must be 0 to 100000, not -1"), std::string::npos);
  EXPECT_NE(refused("clear_i2t_exceeded_flag", 1).find("is a command"), std::string::npos);
  EXPECT_EQ(refused("motor_acceleration", 1000), "taken");
  EXPECT_THROW(
      (void)make_ethercat_robot(
          "nowhere", {.kind = Kind::kBase, .parameters = {{"arm-1", "motor_acceleration", 1}}}, clock, 1ms),
      std::invalid_argument);
}

/// Whether the board turns writing this into something that happens at once.
bool acts_at_once(const drivers::tmcl::AxisParameter& row, Firmware firmware, bool commutated) {
  using namespace drivers::tmcl;
  sim::can::BenchRigOptions options;
  options.board.firmware = firmware;
  sim::can::BenchRig rig(options);
  const auto write = [&rig](const AxisParameter& parameter, std::int32_t value) {
    (void)rig.board().execute(set(parameter, value));
  };
  if (commutated) {
    write(drive_parameter("initialize_joint"), 1);
    rig.advance(3s);
    EXPECT_TRUE(rig.board().initialized());
  }
  write(drive_parameter("approve_protected_parameters"), 4711);
  rig.advance(100ms);
  const DriveInput before = rig.board().input();
  const double before_rad = rig.joint().position_rad();
  write(row, row.in_range(1000) ? 1000 : row.max);
  rig.advance(700ms);
  const DriveInput after = rig.board().input();
  constexpr std::uint32_t kModes = 0b1111U << 8;  // PWM, velocity, position, current
  return std::abs(rig.joint().position_rad() - before_rad) > 1e-3 ||
         std::abs(after.position_ticks - before.position_ticks) > 10 ||
         rig.board().initialized() != commutated ||
         (after.flags.raw() & kModes) != (before.flags.raw() & kModes);
}

TEST(EthercatArm, WhatMovesSomethingWhenItIsWrittenIsNoParameterForTheStart) {
  std::set<std::string> acting;
  for (const Firmware firmware : {Firmware::k148, Firmware::k200})
    for (const bool commutated : {false, true})
      for (const drivers::tmcl::AxisParameter& row : drivers::tmcl::kDriveParameters)
        if (acts_at_once(row, firmware, commutated)) acting.emplace(row.name);
  EXPECT_EQ(acting, (std::set<std::string>{"target_position", "actual_position", "target_speed",
                                           "initialize_joint", "target_pwm", "target_current"}));
  for (const std::string& name : acting)
    for (const std::int32_t value : {0, 1})
      EXPECT_EQ(check({.joint = "wheel-1", .name = name, .value = value}), "is a command, not a setting")
          << name;
  EXPECT_EQ(check({.joint = "wheel-1", .name = "pwm_limit", .value = 1000}), "");
}

TEST(EthercatArm, NoneOfThisAllocatesInTheCycle) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns the allocator";
  sim::bus::YoubotBusOptions bus =
      Rig::options(Kind::kArm, Firmware::k148,
                   {FaultEvent{.kind = FaultKind::kSlaveOff, .at = 40s, .duration = 200ms, .slave = 5}});
  Rig rig(bus,
          {.kind = Kind::kArm, .home_arms = true, .parameters = {{"arm-5", "motor_acceleration", 4321}}});
  rig.robot->activate();
  const support::NoAllocGuard guard;
  rig.command.enable = true;
  rig.command.grippers[0] = {.move = true, .opening_m = 0.01};
  rig.run(41s);
  rig.command.enable = false;
  rig.run(2s);
  rig.command.enable = true;
  rig.run(15s);
  EXPECT_EQ(guard.violations(), 0);
  EXPECT_TRUE(rig.sample.enabled) << describe(rig.status.fault);
}

}  // namespace ethercat_arm_test
}  // namespace hal
