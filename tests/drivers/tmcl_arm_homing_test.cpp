#include "drivers/tmcl/arm_homing.h"

#include <gtest/gtest.h>

#include "tests/drivers/tmcl_fakes.h"
#include "tests/support/no_alloc_guard.h"

namespace drivers::tmcl {
namespace tmcl_arm_homing_test {

struct TmclArmHoming : testing::Test {
  fake::Drive drive;
  fake::Owner owner;
  HomingConfig config = kArmHoming[0];
  TmclArmHoming() { drive.set(StatusFlag::kInitialized); }

  // Runs until the end; the fault it ended with.
  SequenceFault home() {
    ArmHoming homing(config);
    took_ms = owner.run(homing, drive);
    travel_ticks = homing.travel_ticks();
    was_homed = homing.was_homed();
    EXPECT_NE(homing.progress(), Progress::kRunning);
    return homing.fault();
  }
  void expect_refused(SequenceFault fault) {
    EXPECT_EQ(home(), fault);
    EXPECT_EQ(owner.output, kStopMotor);
    EXPECT_EQ(drive.requests_seen[1], 0) << "no false zero";
    EXPECT_EQ(drive.user_variable_16, 0) << "nor remembered";
  }
  int took_ms = 0;
  std::int32_t travel_ticks = 0;
  bool was_homed = false;
};

TEST(TmclArmHomingDefaults, FindTheStopOfEveryJointWhateverTheSignOfTheCurrent) {
  for (std::size_t joint = 0; joint < kArmJoints; ++joint) {
    for (const bool unsigned_current : {true, false}) {
      fake::Drive drive;
      drive.set(StatusFlag::kInitialized);
      drive.unsigned_current = unsigned_current;
      fake::Owner owner;
      ArmHoming homing(kArmHoming[joint]);
      owner.run(homing, drive);
      EXPECT_EQ(homing.fault(), SequenceFault::kNone) << joint;
      EXPECT_NEAR(owner.input.position_ticks, 0, 2);
      EXPECT_NEAR(drive.position, drive.stop_at, 2);
      EXPECT_NEAR(homing.travel_ticks(), 50'000, 2);
      EXPECT_EQ(drive.user_variable_16, 1);
      EXPECT_EQ(owner.output, kNoCurrent);
    }
  }
}

TEST_F(TmclArmHoming, TouchesTwiceWithFreeTravelBetween) {
  home();
  const DriveOutput towards{ControllerMode::kVelocity, 156};
  const DriveOutput away{ControllerMode::kVelocity, -156};
  EXPECT_EQ(owner.outputs, (std::vector<DriveOutput>{kHoldStill, towards, away, towards, kNoCurrent}));
}

TEST_F(TmclArmHoming, JointAlreadyAtItsStopIsHomed) {
  drive.position = drive.stop_at;
  EXPECT_EQ(home(), SequenceFault::kNone);
  EXPECT_EQ(travel_ticks, 0);
}

TEST_F(TmclArmHoming, CounterMayWrapOnTheWay) {
  drive.stop_at = 2147483647.0 + 20'000;
  drive.position = 2147483647.0 - 20'000;
  EXPECT_EQ(home(), SequenceFault::kNone);
  EXPECT_NEAR(travel_ticks, 40'000, 2);
}

TEST_F(TmclArmHoming, RememberedZeroIsKept) {
  drive.user_variable_16 = 1;
  EXPECT_EQ(home(), SequenceFault::kNone);
  EXPECT_TRUE(was_homed);
  EXPECT_EQ(drive.position, -50'000);
  EXPECT_EQ(drive.requests_seen[1], 0);
}

TEST_F(TmclArmHoming, RememberedZeroIsNotAskedForWhenForced) {
  drive.user_variable_16 = 1;
  config.even_if_remembered = true;
  EXPECT_EQ(home(), SequenceFault::kNone);
  EXPECT_EQ(drive.requests_seen[1], 1);
}

TEST_F(TmclArmHoming, BlockedJointGetsNoFalseZero) {
  drive.blocked = true;
  expect_refused(SequenceFault::kBlocked);
  EXPECT_LT(took_ms, 5000);
}

TEST_F(TmclArmHoming, StuckJointWithoutCurrentIsGivenUpSoon) {
  drive.dead = true;
  expect_refused(SequenceFault::kNotMoving);
  EXPECT_LT(took_ms, 2500);
}

TEST_F(TmclArmHoming, MissingStopEndsAtTheLongestTravel) {
  drive.stop_at = 1e9;
  expect_refused(SequenceFault::kTravelTooLong);
  EXPECT_NEAR(travel_ticks, config.longest_travel_ticks, 20);
}

TEST_F(TmclArmHoming, JointThatCrawlsRunsOutOfTime) {
  drive.obstacle_at = drive.position;  // 1 tick a ms in place of 10, with current
  config.standstill_ticks = 5;
  config.longest_travel_ticks = 40'000;
  expect_refused(SequenceFault::kTooSlow);
}

TEST_F(TmclArmHoming, ReversedEncoderIsNoticed) {
  drive.reversed = true;
  expect_refused(SequenceFault::kWrongDirection);
}

TEST_F(TmclArmHoming, AnArmThatStillSinksIsWaitedFor) {
  drive.sinking_per_ms = 40;  // four times the speed of homing; 4000 ticks in all, 2.3 degrees
  drive.sinking_share = 0.99;
  EXPECT_EQ(home(), SequenceFault::kNone);
  EXPECT_NEAR(drive.position, drive.stop_at, 2);
}

TEST_F(TmclArmHoming, AJointThatDoesNotComeToRestIsRefused) {
  drive.sinking_per_ms = 1;
  expect_refused(SequenceFault::kNotAtRest);
  EXPECT_NEAR(took_ms, 5000, 20);
  EXPECT_EQ(owner.outputs, (std::vector<DriveOutput>{kHoldStill, kStopMotor}))
      << "it is commanded to move nowhere";
}

// At the first touch it looks like a stop; at the second it has given way.
TEST_F(TmclArmHoming, ObstacleThatMovesIsNotTheStop) {
  ArmHoming homing(config);
  drive.stop_at = -30'000;
  for (int i = 0; i < 100'000 && homing.progress() == Progress::kRunning; ++i) {
    if (owner.output.value < 0) drive.stop_at = -26'000;
    owner.cycle(homing, drive);
  }
  EXPECT_EQ(homing.fault(), SequenceFault::kStopNotRepeatable);
  EXPECT_EQ(drive.requests_seen[1], 0);
}

TEST_F(TmclArmHoming, ObstacleThatComesInBetweenIsNotTheStop) {
  ArmHoming homing(config);
  for (int i = 0; i < 100'000 && homing.progress() == Progress::kRunning; ++i) {
    owner.cycle(homing, drive);
    if (owner.output.value < 0) drive.stop_at = -3000;
  }
  EXPECT_EQ(homing.fault(), SequenceFault::kStopNotRepeatable);
  EXPECT_EQ(drive.requests_seen[1], 0);
}

TEST_F(TmclArmHoming, BreakingLooseIsNotTakenForTheStop) {
  drive.break_away_ms = 80;
  EXPECT_EQ(home(), SequenceFault::kNone);
  EXPECT_NEAR(travel_ticks, 50'000, 2);
}

TEST_F(TmclArmHoming, CurrentWhileMovingIsNotTheStop) {
  ArmHoming homing(config);
  for (int i = 0; i < 100'000 && homing.progress() == Progress::kRunning; ++i) {
    owner.cycle(homing, drive);
    // A weight: always more than the threshold while on the way.
    if (drive.position < drive.stop_at) owner.input.current_mA = 2500;
  }
  EXPECT_EQ(homing.fault(), SequenceFault::kNone);
}

TEST_F(TmclArmHoming, JointThatSagsAtTheStopIsRefused) {
  drive.sag_per_ms = 30;
  expect_refused(SequenceFault::kMovedAtStop);
}

TEST_F(TmclArmHoming, CounterThatDoesNotFollowIsNoticed) {
  drive.counter_ignored = true;
  drive.stop_at = 100'000;
  drive.position = 60'000;
  EXPECT_EQ(home(), SequenceFault::kMovedAtStop);
  EXPECT_EQ(drive.user_variable_16, 0);
}

TEST_F(TmclArmHoming, FlagsEndItOnTheWay) {
  for (const auto& [flag, fault] : {std::pair(StatusFlag::kTimeout, SequenceFault::kTimeoutFlag),
                                    std::pair(StatusFlag::kI2tExceeded, SequenceFault::kI2tFlag),
                                    std::pair(StatusFlag::kEncoderError, SequenceFault::kDriveError)}) {
    fake::Drive faulty;
    faulty.set(StatusFlag::kInitialized);
    fake::Owner other;
    ArmHoming homing(config);
    other.run(homing, faulty, 1000);
    faulty.set(flag);
    EXPECT_LE(other.run(homing, faulty, 10), 1);
    EXPECT_EQ(homing.fault(), fault);
    EXPECT_EQ(other.output, kStopMotor);
  }
}

TEST_F(TmclArmHoming, NeedsCommutation) {
  drive.set(StatusFlag::kInitialized, false);
  expect_refused(SequenceFault::kNotInitialized);
}

TEST_F(TmclArmHoming, SilentMailboxEndsIt) {
  drive.silent = true;
  expect_refused(SequenceFault::kMailboxFailed);
  EXPECT_EQ(drive.position, -50'000) << "before anything moves";
}

TEST_F(TmclArmHoming, MailboxLostAtTheEndLeavesNothingRemembered) {
  ArmHoming homing(config);
  for (int i = 0; i < 100'000 && homing.progress() == Progress::kRunning; ++i) {
    if (owner.output == kNoCurrent) drive.silent = true;
    owner.cycle(homing, drive);
  }
  EXPECT_EQ(homing.fault(), SequenceFault::kMailboxFailed);
  EXPECT_EQ(drive.user_variable_16, 0);
}

TEST_F(TmclArmHoming, UnfilledConfigurationIsRefused) {
  config = {};
  expect_refused(SequenceFault::kBadTarget);
}

TEST_F(TmclArmHoming, CycleDoesNotAllocateOrLock) {
  ArmHoming homing(config);
  const support::NoAllocGuard guard;
  while (homing.progress() == Progress::kRunning) owner.cycle(homing, drive);
  const long violations = guard.violations();
  EXPECT_EQ(homing.fault(), SequenceFault::kNone);
  EXPECT_EQ(violations, 0);
}

}  // namespace tmcl_arm_homing_test
}  // namespace drivers::tmcl
