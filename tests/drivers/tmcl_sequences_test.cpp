// Commutation start-up and the clearing of flags, on a scripted drive.
#include <gtest/gtest.h>

#include "drivers/tmcl/commutation.h"
#include "drivers/tmcl/drive_reset.h"
#include "drivers/tmcl/parameter_application.h"
#include "tests/drivers/tmcl_fakes.h"
#include "tests/support/no_alloc_guard.h"

namespace drivers::tmcl {
namespace tmcl_sequences_test {

using namespace std::chrono_literals;

struct Sequences : testing::Test {
  fake::Drive drive;
  fake::Owner owner;
};
using TmclCommutation = Sequences;
using TmclReset = Sequences;

TEST_F(TmclCommutation, Firmware148StartsByMode7AndVerifies) {
  Commutation commutation({.firmware = Firmware::k148});
  owner.run(commutation, drive);
  EXPECT_EQ(commutation.progress(), Progress::kDone);
  EXPECT_FALSE(commutation.was_initialized());
  EXPECT_EQ(owner.outputs,
            (std::vector<DriveOutput>{kStopMotor, {ControllerMode::kInitialize, 0}, kStopMotor}));
}

TEST_F(TmclCommutation, Firmware200TurnsUntilBit15AndThenRests) {
  drive.firmware = Firmware::k200;
  Commutation commutation({.firmware = Firmware::k200, .rest = kHoldStill});
  owner.run(commutation, drive);
  EXPECT_EQ(commutation.progress(), Progress::kDone);
  EXPECT_EQ(owner.outputs,
            (std::vector<DriveOutput>{kStopMotor, {ControllerMode::kVelocity, 100}, kHoldStill}));
  EXPECT_GT(drive.position, -50'000) << "it moves";
}

TEST_F(TmclCommutation, InitializedDriveIsLeftAlone) {
  drive.set(StatusFlag::kInitialized);
  Commutation commutation({.firmware = Firmware::k148});
  EXPECT_LT(owner.run(commutation, drive), 20);
  EXPECT_EQ(commutation.progress(), Progress::kDone);
  EXPECT_TRUE(commutation.was_initialized());
  EXPECT_EQ(owner.outputs, std::vector<DriveOutput>{kStopMotor});
}

TEST_F(TmclCommutation, DriveThatNeverInitializesFailsAfterFiveSeconds) {
  for (const Firmware firmware : {Firmware::k148, Firmware::k200}) {
    fake::Drive stubborn;
    stubborn.firmware = firmware;
    stubborn.initializes_after_ms = -1;
    Commutation commutation({.firmware = firmware});
    const int took = fake::Owner().run(commutation, stubborn);
    EXPECT_EQ(commutation.fault(), SequenceFault::kNotInitialized);
    EXPECT_NEAR(took, 5000, 20);
  }
}

TEST_F(TmclCommutation, MotorIsStoppedAfterAFailure) {
  drive.firmware = Firmware::k200;
  drive.initializes_after_ms = -1;
  Commutation commutation({.firmware = Firmware::k200, .rest = kNoCurrent});
  owner.run(commutation, drive);
  EXPECT_EQ(owner.output, kStopMotor);
  owner.cycle(commutation, drive);
  EXPECT_EQ(owner.output, kStopMotor) << "and stays so";
}

TEST_F(TmclCommutation, Bit15WithoutParameter15IsRefused) {
  drive.parameter_15_lies = true;
  Commutation commutation({.firmware = Firmware::k148});
  owner.run(commutation, drive);
  EXPECT_EQ(commutation.fault(), SequenceFault::kNotVerified);
}

TEST_F(TmclCommutation, ErrorFlagsEndItAtOnce) {
  for (const auto& [flag, fault] : {std::pair(StatusFlag::kTimeout, SequenceFault::kTimeoutFlag),
                                    std::pair(StatusFlag::kI2tExceeded, SequenceFault::kI2tFlag),
                                    std::pair(StatusFlag::kUndervoltage, SequenceFault::kDriveError)}) {
    fake::Drive faulty;
    faulty.set(flag);
    Commutation commutation({.firmware = Firmware::k148});
    fake::Owner().run(commutation, faulty, 5);
    EXPECT_EQ(commutation.fault(), fault) << describe(fault);
    EXPECT_EQ(faulty.requests_seen[158], 0) << "never cleared unasked";
  }
}

TEST_F(TmclCommutation, TheErrorFlagOfAnEarlierAttemptStandsUntilTheNextHasBegunAndEndsNothing) {
  drive.set(StatusFlag::kInitializationError);
  Commutation commutation({.firmware = Firmware::k148});
  while (owner.output.mode != ControllerMode::kInitialize && commutation.progress() == Progress::kRunning)
    owner.cycle(commutation, drive);
  ASSERT_EQ(commutation.progress(), Progress::kRunning) << describe(commutation.fault());
  drive.set(StatusFlag::kInitializationError, false);
  owner.run(commutation, drive);
  EXPECT_EQ(commutation.progress(), Progress::kDone) << describe(commutation.fault());
}

TEST_F(TmclCommutation, ItsOwnErrorFlagEndsItAtOnceAfterAnEarlierOneToo) {
  for (const bool earlier : {false, true}) {
    fake::Drive failing;
    fake::Owner host;
    failing.initializes_after_ms = -1;
    failing.set(StatusFlag::kInitializationError, earlier);
    Commutation commutation({.firmware = Firmware::k148});
    for (int i = 0; i < 20; ++i) host.cycle(commutation, failing);
    failing.set(StatusFlag::kInitializationError, false);
    for (int i = 0; i < 20; ++i) host.cycle(commutation, failing);
    ASSERT_EQ(commutation.progress(), Progress::kRunning) << describe(commutation.fault());
    failing.set(StatusFlag::kInitializationError);
    host.cycle(commutation, failing);
    EXPECT_EQ(commutation.fault(), SequenceFault::kDriveError);
  }
}

TEST_F(TmclCommutation, SilentOrRefusingMailboxEndsIt) {
  drive.silent = true;
  Commutation commutation({.firmware = Firmware::k148});
  EXPECT_LT(owner.run(commutation, drive), 200);
  EXPECT_EQ(commutation.fault(), SequenceFault::kMailboxFailed);

  fake::Drive refusing;
  refusing.refuses = true;
  Commutation second({.firmware = Firmware::k148});
  fake::Owner().run(second, refusing);
  EXPECT_EQ(second.fault(), SequenceFault::kMailboxFailed);
}

TEST_F(TmclCommutation, OwnerThatDropsTheRequestDoesNotHangIt) {
  Commutation commutation({.firmware = Firmware::k148});
  int cycles = 0;
  for (; commutation.progress() == Progress::kRunning && cycles < 10'000; ++cycles)
    commutation.step(drive.step({}));
  EXPECT_EQ(commutation.fault(), SequenceFault::kMailboxFailed);
  EXPECT_NEAR(cycles, 5000, 10);
}

TEST_F(TmclCommutation, CancelStopsTheMotorAndKeepsTheCause) {
  drive.initializes_after_ms = -1;
  Commutation commutation({.firmware = Firmware::k148});
  owner.run(commutation, drive, 100);
  EXPECT_EQ(owner.output.mode, ControllerMode::kInitialize);
  commutation.cancel();
  owner.cycle(commutation, drive);
  EXPECT_EQ(owner.output, kStopMotor);
  EXPECT_EQ(commutation.fault(), SequenceFault::kCancelled);
}

TEST_F(TmclCommutation, AnswerToAnotherRequestIsIgnored) {
  Commutation commutation({.firmware = Firmware::k148});
  Completion other{get(drive_parameter("actual_speed")), 0, Outcome::kDone, {}};
  other.reply.value = 1;
  commutation.step(drive.step({}));
  commutation.step(drive.step({}), &other);
  EXPECT_EQ(commutation.progress(), Progress::kRunning);
  EXPECT_FALSE(commutation.was_initialized());
}

TEST_F(TmclReset, TimeoutFlagIsClearedWhileTheMotorIsCommandedToStop) {
  drive.set(StatusFlag::kTimeout);
  owner.output = {ControllerMode::kVelocity, 500};
  TimeoutReset reset;
  const int took = owner.run(reset, drive);
  EXPECT_EQ(reset.progress(), Progress::kDone);
  EXPECT_GE(took, 20);
  EXPECT_EQ(owner.outputs, std::vector<DriveOutput>{kStopMotor});
  EXPECT_EQ(drive.requests_seen[158], 1);
}

TEST_F(TmclReset, TimeoutFlagThatIsNotSetIsNotCleared) {
  TimeoutReset reset;
  owner.run(reset, drive);
  EXPECT_EQ(reset.progress(), Progress::kDone);
  EXPECT_EQ(drive.requests_seen[158], 0);
}

TEST_F(TmclReset, TimeoutFlagThatComesBackIsReported) {
  drive.set(StatusFlag::kTimeout);
  drive.timeout_sticks = true;
  TimeoutReset reset;
  owner.run(reset, drive);
  EXPECT_EQ(reset.fault(), SequenceFault::kFlagStays);
}

TEST_F(TmclReset, I2tIsClearedOnlyAfterTheThermalTime) {
  drive.thermal_time_ms = 13'200;
  drive.overheat();
  I2tReset reset;
  owner.run(reset, drive, 5000);
  EXPECT_EQ(drive.requests_seen[29], 0);
  EXPECT_GT(reset.remaining(), 8s);
  const int took = owner.run(reset, drive);
  EXPECT_EQ(reset.progress(), Progress::kDone);
  EXPECT_GE(5000 + took, 13'200);
  EXPECT_EQ(drive.requests_seen[29], 1) << "once is enough";
  EXPECT_EQ(reset.remaining(), 0s);
}

TEST_F(TmclReset, I2tThatStaysIsReported) {
  drive.overheat();
  for (int i = 0; i < 10; ++i) drive.step({});
  drive.thermal_time_ms = 1;  // what the drive says is too short
  I2tReset reset({.cooling_margin = 0ms});
  owner.run(reset, drive, 500);
  EXPECT_EQ(reset.fault(), SequenceFault::kFlagStays);
}

TEST_F(TmclReset, ImplausibleThermalTimeIsRefused) {
  for (const std::int32_t time_ms : {-1, 0, 600'001}) {
    fake::Drive odd;
    odd.overheat();
    odd.thermal_time_ms = time_ms;
    I2tReset reset;
    fake::Owner().run(reset, odd);
    EXPECT_EQ(reset.fault(), SequenceFault::kImplausible) << time_ms;
    EXPECT_EQ(odd.requests_seen[29], 0);
  }
}

TEST_F(Sequences, AParameterThatReadsBackAsAnotherValueFailsItsApplication) {
  const ParameterSetting settings[] = {{&drive_parameter("thermal_winding_time_constant"), 1000}};
  ParameterApplication kept(settings);
  owner.run(kept, drive);
  EXPECT_EQ(kept.progress(), Progress::kDone) << describe(kept.fault());

  drive.thermal_time_ms = 999;  // it accepts the value and continues with its own
  ParameterApplication ignored(settings);
  fake::Owner().run(ignored, drive);
  EXPECT_EQ(ignored.fault(), SequenceFault::kNotKept);
}

TEST(TmclSequence, EveryFaultHasWordsAndAdvice) {
  for (int i = 0; i <= static_cast<int>(SequenceFault::kNotKept); ++i) {
    EXPECT_STRNE(describe(static_cast<SequenceFault>(i)), "an unknown fault");
    EXPECT_STRNE(advice(static_cast<SequenceFault>(i)), "");
  }
}

TEST_F(TmclCommutation, CycleDoesNotAllocateOrLock) {
  Commutation commutation({.firmware = Firmware::k148});
  drive.overheat();
  I2tReset reset;
  fake::Drive cold;
  fake::Owner second;
  const support::NoAllocGuard guard;
  for (int i = 0; i < 3000; ++i) {
    owner.cycle(reset, drive);
    second.cycle(commutation, cold);
  }
  const long violations = guard.violations();
  EXPECT_EQ(commutation.progress(), Progress::kDone);
  EXPECT_EQ(reset.progress(), Progress::kDone);
  EXPECT_EQ(violations, 0);
}

}  // namespace tmcl_sequences_test
}  // namespace drivers::tmcl
