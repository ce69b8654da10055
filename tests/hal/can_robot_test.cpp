// The whole CAN stack, byte by byte, against the simulated bench rig in virtual time.
#include "hal/can_robot.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "drivers/tmcl/axis_parameters.h"
#include "hal/setup_error.h"
#include "tests/hal/can_bench.h"
#include "tests/support/no_alloc_guard.h"

namespace hal {
namespace can_robot_test {

using namespace std::chrono_literals;
using drivers::tmcl::Firmware;
using sim::can::BenchRigOptions;
using test::CanBench;
using Data = std::vector<std::uint8_t>;

std::string refusal_of(CanBench& bench) {
  try {
    bench.robot->activate();
  } catch (const SetupError& error) {
    return error.what();
  }
  return "activated";
}
bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

BenchRigOptions rig_with(Firmware firmware, int controller) {
  BenchRigOptions options;
  options.board.firmware = firmware;
  options.board.controller = controller;
  return options;
}
BenchRigOptions frictionless() {
  BenchRigOptions options;
  options.joint.coulomb_Nm = options.joint.viscous_Nm_s_per_rad = 0;
  return options;
}

// ---- set-up ----

TEST(CanRobot, HasOneJointWithTheTorqueItsCurrentLimitGives) {
  const CanBench bench;
  ASSERT_EQ(bench.robot->joints().size(), 1U);
  EXPECT_EQ(bench.robot->joints()[0].name, "wheel-1");
  EXPECT_NEAR(bench.robot->joints()[0].torque_limit_Nm, 2.85 * 0.0335 * 9405 / 364, 1e-9);
  const CanBench arm({.joint_name = "arm-5", .axis = kArmAxes[4]});
  EXPECT_EQ(arm.robot->joints()[0].name, "arm-5");
}

TEST(CanRobot, SetUpAsksForTheVersionAndStopsTheMotorFirst) {
  CanBench bench;
  bench.cable.record();
  const std::vector<can_frame>& sent = bench.cable.recorded();
  bench.robot->activate();
  ASSERT_GE(sent.size(), 2U);
  EXPECT_EQ(sent[0].can_id, 1U);
  EXPECT_EQ(Data(sent[0].data, sent[0].data + sent[0].can_dlc), (Data{136, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(Data(sent[1].data, sent[1].data + sent[1].can_dlc), (Data{3, 0, 0, 0, 0, 0, 0}));
}

TEST(CanRobot, EveryKnownModuleStartsAndObeys) {
  struct Case {
    int controller;
    Firmware firmware;
  };
  for (const Case& known : {Case{174, Firmware::k148}, Case{1632, Firmware::k148}, Case{841, Firmware::k148},
                            Case{1610, Firmware::k148}, Case{1610, Firmware::k200}}) {
    CanBench bench({}, rig_with(known.firmware, known.controller));
    bench.robot->activate();
    bench.run(20ms);
    EXPECT_TRUE(bench.status.ok()) << describe_can(bench.status);
    EXPECT_FALSE(bench.sample.enabled) << "nothing moves before it is enabled";
    EXPECT_FALSE(bench.rig.board().initialized());
    bench.enable();
    EXPECT_TRUE(bench.rig.board().initialized());
    bench.command.joints[0] = JointCommand::velocity_rad_per_s(2);
    bench.run(1s);
    EXPECT_TRUE(bench.status.ok()) << describe_can(bench.status);
    EXPECT_NEAR(bench.velocity_rad_per_s(), 2, 0.1) << known.controller;
  }
}

TEST(CanRobot, TheSisterBoardNeedsNoCommutationStartUp) {
  CanBench bench({}, rig_with(Firmware::k200, 1630));
  bench.robot->activate();
  bench.command.enable = true;
  (void)bench.step();
  EXPECT_TRUE(bench.sample.enabled) << describe_can(bench.status);
}

TEST(CanRobot, AnUnknownModuleIsNamedAndNotTouched) {
  CanBench bench({}, rig_with(Firmware::k200, 1180));
  bench.cable.record();
  const std::vector<can_frame>& sent = bench.cable.recorded();
  const std::string text = refusal_of(bench);
  EXPECT_TRUE(has(text, "controller 1180, firmware 2.00")) << text;
  EXPECT_TRUE(has(text, "bench0, module 1")) << text;
  EXPECT_TRUE(has(text, "TMCM-1630")) << text;
  EXPECT_EQ(sent.size(), 1U);
  EXPECT_EQ(bench.step().fault, Fault::kNotActive);
}

TEST(CanRobot, ASilentModuleIsRefusedWithWhatTheBusSays) {
  CanBench bench;
  bench.rig.set_power(false);
  const std::string text = refusal_of(bench);
  EXPECT_TRUE(has(text, "get firmware version")) << text;
  EXPECT_TRUE(has(text, "no acknowledge")) << text;
}

TEST(CanRobot, ABusTooSlowForThePeriodIsRefusedWithTheWayOut) {
  CanBench bench({.bitrate_bit_per_s = 250'000});
  const std::string text = refusal_of(bench);
  EXPECT_TRUE(has(text, "3 requests and replies a cycle at 250000 bit/s need a period of 3.75 ms")) << text;
  EXPECT_TRUE(has(text, "it is 1.00 ms")) << text;
  EXPECT_TRUE(has(text, "lower requests_per_cycle")) << text;

  BenchRigOptions slow;
  slow.bit_per_s = 250'000;
  CanBench fitting({.bitrate_bit_per_s = 250'000}, slow, 4ms);
  fitting.robot->activate();
  fitting.enable();
  EXPECT_TRUE(fitting.status.ok());
}

TEST(CanRobot, ShortestPeriodIsAQuarterMillisecondAPairAndAFifthFree) {
  EXPECT_EQ(shortest_can_period(1'000'000, 3), 937'500ns);
  EXPECT_EQ(shortest_can_period(1'000'000, 4), 1'250us);
  EXPECT_EQ(shortest_can_period(500'000, 3), 1'875us);
}

TEST(CanRobot, AModuleThatTakesOneRequestAtATimeIsFoundOutAndServed) {
  BenchRigOptions strict;
  strict.buffered_requests = 1;
  strict.processing_time = 400us;
  CanBench greedy({}, strict);
  const std::string text = refusal_of(greedy);
  EXPECT_TRUE(has(text, "TMCM-1610")) << text;
  EXPECT_TRUE(has(text, "lower requests_per_cycle, to 1")) << text;

  CanBench patient({.requests_per_cycle = 1}, strict);
  patient.robot->activate();
  patient.enable();
  patient.command.joints[0] = JointCommand::velocity_rad_per_s(2);
  patient.run(1s);
  EXPECT_TRUE(patient.status.ok()) << describe_can(patient.status);
  EXPECT_NEAR(patient.velocity_rad_per_s(), 2, 0.1);
}

TEST(CanRobot, TakesOneToFiveRequestsACycle) {
  for (const int requests : {0, 6}) {
    CanBench bench({.requests_per_cycle = requests}, {}, 4ms);
    const std::string text = refusal_of(bench);
    EXPECT_TRUE(has(text, "it takes 1 to 5 requests a cycle")) << text;
  }
  CanBench most({.requests_per_cycle = 5}, {}, 4ms);
  EXPECT_NO_THROW(most.robot->activate());
}

TEST(CanRobot, ChecksThatItsReadingsAreTooSeldomForAreNoted) {
  EXPECT_TRUE(CanBench({.requests_per_cycle = 3}).robot->notes().empty());
  const auto note = [](int requests, std::chrono::milliseconds period) {
    CanBench bench({.requests_per_cycle = requests}, {}, period);
    bench.robot->activate();
    const std::vector<std::string> notes = bench.robot->notes();
    EXPECT_EQ(notes.size(), 1U);
    return notes.empty() ? "" : notes.front();
  };
  EXPECT_TRUE(has(note(2, 1ms), "positions come every 2.00 ms: the check S3 of its sensors does not run"));
  EXPECT_TRUE(has(note(1, 2ms), "positions come every 8.00 ms: the check S3 of its sensors does not run"));
  EXPECT_TRUE(has(note(1, 6ms), "positions come every 24.00 ms: no check of its sensors runs"));
}

TEST(CanRobot, AModuleTooSlowForThePatienceIsRefused) {
  BenchRigOptions slow;
  slow.processing_time = 2ms;
  CanBench bench({}, slow);
  const std::string text = refusal_of(bench);
  EXPECT_TRUE(has(text, "its answers take")) << text;
  EXPECT_TRUE(has(text, "lengthen the period")) << text;
}

TEST(CanRobot, AnotherEncoderIsRefused) {
  CanOptions options;
  options.axis.constants.ticks_per_motor_rev = 2048;
  CanBench bench(options);
  const std::string text = refusal_of(bench);
  EXPECT_TRUE(has(text, "2048")) << text;
  EXPECT_TRUE(has(text, "4000")) << text;
}

TEST(CanRobot, OptionsThatCannotBeAreRefused) {
  for (const int requests : {0, 6}) {
    CanBench bench({.requests_per_cycle = requests});
    EXPECT_THROW(bench.robot->activate(), SetupError) << requests;
  }
  CanBench same({.module_id = 3, .reply_id = 3});
  EXPECT_TRUE(has(refusal_of(same), "global parameters 71"));
}

TEST(CanRobot, AnInterfaceThatIsNotThereIsASetupErrorOfTheHal) {
  VirtualClock clock;
  const auto robot = make_can_robot("can99", {}, clock, 1ms);
  EXPECT_THROW(robot->activate(), SetupError);
}

// ---- the cycle ----

TEST(CanRobot, TheWireCarriesTargetPositionAndOneReadInTurn) {
  CanBench bench;
  bench.robot->activate();
  bench.enable();
  bench.command.joints[0] = JointCommand::torque_Nm(0.2);  // 231 mA: 0x00E7
  bench.run(20ms);
  bench.cable.record();
  const std::vector<can_frame>& sent = bench.cable.recorded();
  bench.run(8ms);
  bench.cable.record(false);
  ASSERT_EQ(sent.size(), 24U);
  std::vector<int> in_turn;
  for (std::size_t i = 0; i < sent.size(); i += 3) {
    EXPECT_EQ(sent[i].can_id, 1U);
    EXPECT_EQ(Data(sent[i].data, sent[i].data + sent[i].can_dlc), (Data{5, 155, 0, 0, 0, 0, 0xE7})) << i;
    EXPECT_EQ(Data(sent[i + 1].data, sent[i + 1].data + sent[i + 1].can_dlc), (Data{6, 1, 0, 0, 0, 0, 0}));
    in_turn.push_back(sent[i + 2].data[1]);
    if (sent[i + 2].data[1] == 55) {
      EXPECT_EQ(sent[i + 2].data[0], 10) << "GGP";
      EXPECT_EQ(sent[i + 2].data[2], 2) << "bank of the user variables";
    }
  }
  // Once in ten cycles the Hall sensors' angle takes the place of current or velocity.
  EXPECT_LE(std::count(in_turn.begin(), in_turn.end(), 210), 1);
  const auto as_planned = [](int read, int planned) {
    return read == planned || (read == 210 && (planned == 150 || planned == 3));
  };
  std::vector<int> schedule{150, 3, 150, 156, 150, 3, 150, 55};
  const bool found = std::any_of(schedule.begin(), schedule.end(), [&](int) {
    std::rotate(schedule.begin(), schedule.begin() + 1, schedule.end());
    return std::equal(in_turn.begin(), in_turn.end(), schedule.begin(), as_planned);
  });
  EXPECT_TRUE(found) << testing::PrintToString(in_turn);
}

/// The emulated module counts both the same way round: the angle between them is constant.
TEST(CanRobot, ReadsTheHallSensorsWithWhatTheEncoderShowedMeanwhile) {
  for (int requests = 1; requests <= 5; ++requests) {
    SCOPED_TRACE(requests);
    CanOptions options;
    options.requests_per_cycle = requests;
    CanBench bench(options, {}, std::max(1ms, std::chrono::milliseconds(requests - 2)));
    bench.robot->activate();
    bench.enable();
    bench.command.joints[0] = JointCommand::velocity_rad_per_s(0.5);
    bench.run(100ms);
    const RotorReading first = bench.sample.joints[0].rotor;
    const auto offset = [](const RotorReading& rotor) {
      return rotor.hall_turn - (rotor.encoder_low_turn + rotor.encoder_high_turn) / 2;
    };
    bench.run_until(
        [&] {
          const RotorReading& rotor = bench.sample.joints[0].rotor;
          const double away = offset(rotor) - offset(first);
          // Each Hall reading is the middle of one of six sectors.
          const double allowed = 1.0 / 6 + (rotor.encoder_high_turn - rotor.encoder_low_turn) / 2;
          EXPECT_LE(std::abs(away - std::round(away)), allowed);
          return testing::Test::HasFailure();
        },
        2s);
    const RotorReading& last = bench.sample.joints[0].rotor;
    EXPECT_GT(last.encoder_low_turn - first.encoder_high_turn, 20) << "electrical revolutions";
    EXPECT_GE(last.number - first.number, 90U);
    EXPECT_LE(last.number - first.number, 224U) << "each 10 ms, which are 9 where a cycle takes 3";
  }
}

TEST(CanRobot, AReplyThatIsLostWithTheHallSensorsCostsNoReading) {
  CanBench bench;
  bench.robot->activate();
  bench.enable();
  bench.command.joints[0] = JointCommand::velocity_rad_per_s(0.5);
  for (int i = 0; i < 100 && bench.status.ok(); ++i) {
    bench.rig.lose_replies(1);  // of any request, at times this one
    bench.run(37ms);
  }
  EXPECT_TRUE(bench.status.ok()) << describe_can(bench.status);
  const std::uint32_t number = bench.sample.joints[0].rotor.number;
  bench.run(200ms);
  EXPECT_GE(bench.sample.joints[0].rotor.number, number + 10) << "a second later at the latest";
}

TEST(CanRobot, PositionIsOneCycleOldAndItsStampSaysSo) {
  CanBench bench;
  bench.robot->activate();
  bench.run(10ms);
  for (int i = 0; i < 50; ++i) {
    (void)bench.step();
    EXPECT_EQ(bench.sample.stamp, bench.clock.now() - 1ms);
    EXPECT_EQ(bench.sample.earliest, bench.sample.stamp) << "it was asked for no sooner";
    EXPECT_EQ(bench.sample.latest, bench.clock.now());
  }
}

TEST(CanRobot, TorqueAcceleratesAsTorqueOverInertia) {
  CanBench bench({}, frictionless());
  bench.robot->activate();
  bench.enable();
  bench.run(100ms);
  bench.command.joints[0] = JointCommand::torque_Nm(0.2);
  bench.run(50ms);
  const double before = bench.sample.joints[0].position_rad;
  const double speed_before = bench.velocity_rad_per_s();
  bench.run(200ms);
  // Wheel 1.61e-3 and the rotor's 1.35e-5 through the gear.
  const double inertia_kg_m2 = 1.61e-3 + 1.35e-5 * std::pow(9405.0 / 364.0, 2);
  const double expected = 0.2 / inertia_kg_m2;
  // 0.2 N·m is 231.07 mA, sent as 231; the current loop falls behind the back-EMF by 4 %.
  EXPECT_NEAR((bench.velocity_rad_per_s() - speed_before) / 0.2, expected, 0.05 * expected);
  const double moved = bench.sample.joints[0].position_rad - before;
  EXPECT_NEAR(moved, speed_before * 0.2 + 0.5 * expected * 0.04, 0.07 * moved);
  EXPECT_NEAR(bench.sample.joints[0].torque_Nm, 0.2, 0.02);
  EXPECT_TRUE(bench.status.ok()) << describe_can(bench.status);
}

TEST(CanRobot, TorqueBeyondTheCurrentLimitIsCut) {
  CanBench bench;
  bench.robot->activate();
  bench.enable();
  bench.cable.record();
  const std::vector<can_frame>& sent = bench.cable.recorded();
  bench.command.joints[0] = JointCommand::torque_Nm(-100);
  (void)bench.step();
  ASSERT_FALSE(sent.empty());
  EXPECT_EQ(Data(sent[0].data, sent[0].data + 7), (Data{5, 155, 0, 0xFF, 0xFF, 0xF4, 0xDE})) << "-2850";
}

TEST(CanRobot, VelocityBeyondTheLimitOfTheAxisIsCut) {
  CanBench bench;
  EXPECT_EQ(bench.robot->joints()[0].speed_limit_rad_per_s, 16.2);
  bench.robot->activate();
  bench.enable();
  bench.cable.record();
  const std::vector<can_frame>& sent = bench.cable.recorded();
  bench.command.joints[0] = JointCommand::velocity_rad_per_s(1e300);
  (void)bench.step();
  ASSERT_FALSE(sent.empty());
  EXPECT_EQ(Data(sent[0].data, sent[0].data + 7), (Data{5, 2, 0, 0, 0, 0x0F, 0x9D})) << "3997 rpm";
}

TEST(CanRobot, VelocityAndPositionReachTheirTargets) {
  CanBench bench;
  bench.robot->activate();
  bench.enable();
  bench.command.joints[0] = JointCommand::velocity_rad_per_s(-3);
  bench.run(1500ms);
  EXPECT_NEAR(bench.velocity_rad_per_s(), -3, 0.1);
  EXPECT_NEAR(bench.sample.joints[0].velocity_rad_per_s, -3, 0.2) << "with the sensor's noise";
  bench.command.joints[0] = JointCommand::position_rad(0.7);
  bench.run(6s);
  EXPECT_NEAR(bench.sample.joints[0].position_rad, 0.7, 0.02);
  EXPECT_TRUE(bench.status.ok());
}

TEST(CanRobot, AnInvertedAxisTurnsTheMotorTheOtherWay) {
  CanOptions options;
  options.axis.constants.inverted = true;
  CanBench bench(options);
  bench.robot->activate();
  bench.enable();
  bench.command.joints[0] = JointCommand::velocity_rad_per_s(2);
  bench.run(1s);
  EXPECT_NEAR(bench.velocity_rad_per_s(), -2, 0.1) << "the rig's wheel is not inverted";
  EXPECT_NEAR(bench.sample.joints[0].velocity_rad_per_s, 2, 0.2);
}

TEST(CanRobot, ACurrentWithoutSignGetsTheCommandsOwn) {
  BenchRigOptions absolute;
  absolute.board.current_sign = drivers::tmcl::CurrentSign::kAbsolute;
  CanBench bench({.unsigned_current = true}, absolute);
  bench.robot->activate();
  bench.enable();
  bench.command.joints[0] = JointCommand::torque_Nm(-0.3);
  bench.run(100ms);
  EXPECT_NEAR(bench.sample.joints[0].torque_Nm, -0.3, 0.03);
}

TEST(CanRobot, ATimeOutFlagLeftByEtherCatIsClearedOnEnable) {
  CanBench bench;
  bench.robot->activate();
  const Data stop(5, 0);
  bench.rig.board().outputs_changed(stop);  // starts the watchdog of 100 ms
  bench.run(200ms);
  EXPECT_EQ(bench.sample.joints[0].fault, JointFault::kCommandTimeout);
  EXPECT_TRUE(bench.status.ok()) << "nothing was asked of it";
  bench.enable();
  bench.run(20ms);
  EXPECT_TRUE(bench.status.ok()) << describe_can(bench.status);
  EXPECT_EQ(bench.sample.joints[0].fault, JointFault::kNone);
}

TEST(CanRobot, DisabledItStopsAndDoesNotResumeByItself) {
  CanBench bench;
  bench.robot->activate();
  bench.enable();
  bench.command.joints[0] = JointCommand::velocity_rad_per_s(3);
  bench.run(500ms);
  bench.cable.record();
  const std::vector<can_frame>& sent = bench.cable.recorded();
  bench.command.enable = false;
  (void)bench.step();
  ASSERT_FALSE(sent.empty());
  EXPECT_EQ(Data(sent[0].data, sent[0].data + 7), (Data{3, 0, 0, 0, 0, 0, 0}));
  EXPECT_FALSE(bench.sample.enabled);
  bench.run(2s);
  EXPECT_LT(std::abs(bench.velocity_rad_per_s()), 0.05);
}

// ---- faults ----

/// Enabled and turning at 3 rad/s.
struct CanRobotMoving : testing::Test {
  CanRobotMoving() {
    bench.robot->activate();
    bench.enable();
    bench.command.joints[0] = JointCommand::velocity_rad_per_s(3);
    bench.run(500ms);
    EXPECT_GT(bench.velocity_rad_per_s(), 2);
  }
  void expect_latched_until_disabled() {
    const Fault fault = bench.status.fault;
    EXPECT_FALSE(bench.sample.enabled);
    bench.run(2s);
    EXPECT_EQ(bench.status.fault, fault) << "latched";
    EXPECT_LT(std::abs(bench.velocity_rad_per_s()), 0.05) << "motor stop";
    bench.command.enable = false;
    bench.run(30ms);
    EXPECT_TRUE(bench.status.ok()) << describe_can(bench.status);
    bench.enable();
    bench.command.joints[0] = JointCommand::velocity_rad_per_s(3);
    bench.run(1s);
    EXPECT_TRUE(bench.status.ok()) << describe_can(bench.status);
    EXPECT_NEAR(bench.velocity_rad_per_s(), 3, 0.1);
  }
  CanBench bench;
};

TEST_F(CanRobotMoving, ATargetThatIsNotANumberIsRefused) {
  bench.command.joints[0].target = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(bench.step().fault, Fault::kBadCommand);
  EXPECT_EQ(bench.status.joint, 0);
  bench.command.joints[0].target = 3;
  expect_latched_until_disabled();
}

TEST_F(CanRobotMoving, OneLostFrameIsBridgedWithTheLastSample) {
  for (const bool request : {false, true}) {
    request ? bench.rig.lose_requests(1) : bench.rig.lose_replies(1);
    auto oldest = 0ns;
    for (int i = 0; i < 30; ++i) {
      EXPECT_TRUE(bench.step().ok()) << describe_can(bench.status);
      oldest = std::max(oldest, bench.clock.now() - bench.sample.stamp);
    }
    EXPECT_GT(oldest, 3ms) << "the age of the sample shows";
    EXPECT_LE(oldest, 9ms);
    EXPECT_NEAR(bench.sample.joints[0].velocity_rad_per_s, 3, 0.3) << "no reading took another's place";
  }
}

TEST_F(CanRobotMoving, ForeignFramesUnderItsIdentifierSpoilNoReading) {
  std::mt19937 random(7);
  for (int i = 0; i < 2000; ++i) {
    can_frame frame{};
    frame.can_id = 2;
    frame.can_dlc = static_cast<std::uint8_t>(random() % 9);
    for (std::uint8_t& byte : frame.data) byte = static_cast<std::uint8_t>(random());
    if (i % 3 == 0) {  // the reply to a GAP, out of all proportion
      frame.can_dlc = 7;
      std::copy_n(Data{1, 100, 6, 0x40}.begin(), 4, frame.data);
    }
    if (i % 20 < 3) bench.cable.inject(frame);
    (void)bench.step();
    ASSERT_NEAR(bench.sample.joints[0].position_rad, bench.rig.joint().position_rad(), 0.1) << i;
    ASSERT_LT(std::abs(bench.sample.joints[0].velocity_rad_per_s), 5) << i;
    ASSERT_LT(std::abs(bench.sample.joints[0].torque_Nm), 3) << i;
  }
  bench.command.enable = false;
  bench.run(30ms);
  EXPECT_TRUE(bench.status.ok());
}

TEST_F(CanRobotMoving, APulledCableIsFrameLostAndTheMotorStopsWhenItIsBack) {
  bench.rig.set_cable(false);
  const auto detected = bench.run_until([this] { return !bench.status.ok(); }, 1s);
  EXPECT_EQ(bench.status.fault, Fault::kFrameLost);
  EXPECT_LE(detected, 12ms);
  const std::string words = describe_can(bench.status);
  EXPECT_TRUE(has(words, "no answer from the bus: no acknowledge (is the module powered")) << words;
  bench.run(500ms);
  EXPECT_GT(bench.velocity_rad_per_s(), 2) << "no watchdog: it goes on";
  bench.rig.set_cable(true);
  expect_latched_until_disabled();
}

TEST_F(CanRobotMoving, BusOffIsAFaultAtOnceInItsOwnWords) {
  bench.rig.set_bus_off(true);
  bench.run(2ms);
  EXPECT_EQ(bench.status.fault, Fault::kFrameLost);
  EXPECT_TRUE(has(describe_can(bench.status), "no answer from the bus: bus off"))
      << describe_can(bench.status);
  bench.rig.set_bus_off(false);
  expect_latched_until_disabled();
}

TEST_F(CanRobotMoving, ARestartedModuleIsDetectedAndCommutatedAgain) {
  bench.rig.set_power(false);
  bench.rig.set_power(true);
  bench.run_until([this] { return !bench.status.ok(); }, 1s);
  EXPECT_EQ(bench.status.fault, Fault::kJointFault);
  EXPECT_EQ(bench.status.joint, 0);
  EXPECT_EQ(bench.status.joint_fault(), JointFault::kRestarted);
  expect_latched_until_disabled();
}

TEST(CanRobot, AStatedRangeHoldsUntilTheModuleRestarts) {
  CanOptions options;
  options.range_is_stated = true;
  CanBench bench(options);
  bench.robot->activate();
  bench.enable();
  EXPECT_TRUE(bench.sample.joints[0].homed);
  bench.rig.set_power(false);
  bench.rig.set_power(true);
  bench.run_until([&bench] { return !bench.status.ok(); }, 1s);
  bench.command.enable = false;
  bench.run(100ms);
  bench.enable();
  EXPECT_FALSE(bench.sample.joints[0].homed) << "it counts from another place now";
}

TEST_F(CanRobotMoving, AModuleThatWasAwayIsFoundOutToo) {
  bench.rig.set_power(false);
  bench.run_until([this] { return !bench.status.ok(); }, 1s);
  EXPECT_EQ(bench.status.fault, Fault::kFrameLost);
  bench.rig.set_power(true);
  expect_latched_until_disabled();
}

TEST(CanRobot, ARefusedCommandIsAFaultThatSaysWhatAndWhy) {
  CanOptions options;
  options.axis.speed_limit_rad_per_s = 1e6;  // beyond what the module takes
  CanBench bench(options);
  bench.robot->activate();
  bench.enable();
  bench.command.joints[0] = JointCommand::velocity_rad_per_s(1e6);
  bench.run(2ms);
  EXPECT_EQ(bench.status.fault, Fault::kJointFault);
  EXPECT_EQ(bench.status.joint_fault(), JointFault::kRefused);
  EXPECT_EQ(bench.status.detail >> 8, 5U << 16 | 2U << 8 | 4U);
  EXPECT_EQ(describe_can(bench.status), "SAP target_speed (2) refused: invalid value");
  EXPECT_FALSE(bench.sample.enabled);
}

TEST_F(CanRobotMoving, ADrivesErrorFlagStopsItAndSaysWhich) {
  bench.rig.board().fault(sim::bus::BoardFault::kOvertemperature, true);
  const auto detected = bench.run_until([this] { return !bench.status.ok(); }, 1s);
  EXPECT_LE(detected, 10ms) << "status comes every eight cycles";
  EXPECT_EQ(bench.status.fault, Fault::kJointFault);
  EXPECT_EQ(describe_can(bench.status), "overtemperature");
  EXPECT_EQ(bench.sample.joints[0].fault, JointFault::kOvertemperature);
  bench.rig.board().fault(sim::bus::BoardFault::kOvertemperature, false);
  expect_latched_until_disabled();
}

TEST(CanRobot, FailedCommutationIsAFault) {
  CanBench bench;
  bench.robot->activate();
  bench.rig.board().fault(sim::bus::BoardFault::kHallSensor, true);
  bench.command.enable = true;
  bench.run(1s);
  EXPECT_EQ(bench.status.fault, Fault::kJointFault);
  EXPECT_EQ(bench.status.detail, static_cast<std::uint32_t>(JointFault::kNotInitialized));
  EXPECT_FALSE(bench.sample.enabled);
}

TEST(CanRobot, ACommutationThatFailedIsTriedAgainByTheNextEnable) {
  for (const Firmware firmware : {Firmware::k148, Firmware::k200})
    for (const auto broken : {700ms, 3000ms}) {
      BenchRigOptions options;
      options.board.firmware = firmware;
      CanBench bench({}, options);
      bench.robot->activate();
      bench.command.enable = true;
      bench.run(20ms);
      bench.rig.board().fault(sim::bus::BoardFault::kHallSensor, true);
      bench.run(broken);
      EXPECT_EQ(bench.status.joint_fault(), JointFault::kNotInitialized);
      bench.rig.board().fault(sim::bus::BoardFault::kHallSensor, false);
      bench.command.enable = false;
      bench.run(20ms);
      bench.enable();
      EXPECT_TRUE(bench.status.ok()) << describe_can(bench.status);
    }
}

TEST(CanRobot, AHotWindingHasToCoolBeforeItIsEnabled) {
  using namespace drivers::tmcl;
  CanBench bench;
  bench.robot->activate();
  bench.enable();
  (void)bench.rig.board().execute(set(drive_parameter("approve_protected_parameters"), 4711));
  (void)bench.rig.board().execute(set(drive_parameter("i2t_limit"), 1000));
  bench.command.joints[0] = JointCommand::torque_Nm(1.0);
  bench.run_until([&] { return !bench.status.ok(); }, 10s);
  EXPECT_EQ(bench.status.joint_fault(), JointFault::kI2t);
  bench.command.joints[0] = JointCommand::torque_Nm(0.0);
  bench.command.enable = false;
  bench.run(20ms);
  bench.command.enable = true;
  bench.run(2s);
  EXPECT_TRUE(bench.status.ok()) << describe_can(bench.status);
  EXPECT_FALSE(bench.sample.enabled) << "it cannot have cooled";
  bench.run_until([&] { return bench.sample.enabled; }, 20s);
  EXPECT_TRUE(bench.sample.enabled) << describe_can(bench.status);
}

/// Number of cycles that command the motor to stop.
int cycles_with_stop(CanBench& bench, int cycles) {
  bench.cable.record();
  const std::vector<can_frame>& sent = bench.cable.recorded();
  int stops = 0;
  for (int i = 0; i < cycles; ++i) {
    const auto before = static_cast<std::ptrdiff_t>(sent.size());
    (void)bench.step();
    stops += std::any_of(sent.begin() + before, sent.end(),
                         [](const can_frame& frame) { return frame.data[0] == 3; })
                 ? 1
                 : 0;
  }
  bench.cable.record(false);
  return stops;
}

TEST_F(CanRobotMoving, TheStopOfTheOperatorDoesNotWaitForLateAnswers) {
  bench.rig.lose_replies(100);
  bench.run(2ms);
  ASSERT_TRUE(bench.status.ok()) << "still bridged";
  bench.command.enable = false;
  EXPECT_EQ(cycles_with_stop(bench, 1), 1);
}

TEST_F(CanRobotMoving, TheStopIsRepeatedAsLongAsAFaultLastsWhetherOrNotItIsAnswered) {
  bench.rig.board().fault(sim::bus::BoardFault::kOvertemperature, true);
  bench.run_until([this] { return !bench.status.ok(); }, 1s);
  ASSERT_EQ(bench.status.fault, Fault::kJointFault);
  EXPECT_EQ(cycles_with_stop(bench, 60), 60);
  bench.rig.lose_replies(1000);
  bench.run(20ms);
  EXPECT_GE(cycles_with_stop(bench, 60), 10) << "a silence of 3 cycles and a pause of 3";
}

TEST_F(CanRobotMoving, AnUnacknowledgedStopIsReportedAfterDeactivation) {
  bench.rig.set_cable(false);
  bench.robot->deactivate();
  const std::vector<std::string> report = bench.robot->report();
  ASSERT_EQ(report.size(), 1U);
  EXPECT_TRUE(has(report[0], "wheel-1: the motor stop was not acknowledged")) << report[0];
  bench.rig.set_cable(true);
  bench.robot->activate();
  EXPECT_TRUE(bench.robot->report().empty());
  bench.robot->deactivate();
  EXPECT_TRUE(bench.robot->report().empty()) << "acknowledged";
}

TEST_F(CanRobotMoving, DeactivationStopsTheMotorThroughLostFramesAndItCanStartAgain) {
  bench.rig.lose_requests(2);
  bench.robot->deactivate();
  EXPECT_EQ(bench.step().fault, Fault::kNotActive);
  bench.cable.wait(2s);
  EXPECT_LT(std::abs(bench.velocity_rad_per_s()), 0.05);
  bench.command = {};
  bench.robot->activate();
  bench.enable();
  EXPECT_TRUE(bench.status.ok());
}

TEST_F(CanRobotMoving, DeactivationOnADeadBusEnds) {
  bench.rig.set_cable(false);
  const auto begin = bench.rig.now();
  bench.robot->deactivate();
  EXPECT_LT(bench.rig.now() - begin, 400ms) << "300 ms for all tries";
}

TEST_F(CanRobotMoving, DestructionStopsTheMotor) {
  bench.robot.reset();
  bench.cable.wait(2s);
  EXPECT_LT(std::abs(bench.velocity_rad_per_s()), 0.05);
}

TEST(CanRobot, TheCycleDoesNotAllocateOrLockInAnyPhase) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns the allocator";
  CanBench bench;
  bench.robot->activate();
  bench.run(10ms);
  const support::NoAllocGuard guard;
  bench.command.enable = true;
  bench.run(1s);  // commutation
  bench.command.joints[0] = JointCommand::velocity_rad_per_s(2);
  bench.run(500ms);
  bench.rig.set_cable(false);
  bench.run(100ms);
  bench.rig.set_cable(true);
  bench.rig.set_power(false);
  bench.rig.set_power(true);
  bench.command.enable = false;
  bench.run(100ms);
  bench.command.enable = true;
  bench.run(1s);
  EXPECT_EQ(guard.violations(), 0);
  EXPECT_TRUE(bench.sample.enabled) << static_cast<int>(bench.status.fault);
}

}  // namespace can_robot_test
}  // namespace hal
