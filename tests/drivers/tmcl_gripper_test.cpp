#include "drivers/tmcl/gripper.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdlib>

#include "tests/drivers/tmcl_fakes.h"
#include "tests/support/no_alloc_guard.h"

namespace drivers::tmcl {
namespace tmcl_gripper_test {

// Two step counters that run at a fixed speed; the wire's sign: opening is negative.
class FakeGripper final : public Transport {
 public:
  int steps_per_ms = 30;
  bool missing = false;
  int latency = 4;  // slow: forwarded by joint 5
  std::int32_t calibrated = 0;
  std::array<std::int32_t, 2> position{1234, -77};
  std::array<std::int32_t, 2> target = position;
  std::array<std::int32_t, 2> furthest_open = position;
  int zeroed = 0;

  void step() {
    for (std::size_t i = 0; i < 2; ++i) {
      const std::int32_t left = target[i] - position[i];
      position[i] += std::clamp(left, -steps_per_ms, steps_per_ms);
      furthest_open[i] = std::min(furthest_open[i], position[i]);
    }
  }
  bool post(const Request& request) noexcept override {
    if (pending_) return false;
    pending_ = answer(request);
    wait_ = missing ? 1'000'000 : latency;
    return true;
  }
  std::optional<Reply> poll() noexcept override {
    if (!pending_ || wait_-- > 0) return std::nullopt;
    return std::exchange(pending_, std::nullopt);
  }
  const std::string& name() const noexcept override { return name_; }

 private:
  Reply answer(const Request& request) noexcept {
    Reply reply{0, 1, Status::kOk, request.command, 0, {}};  // this one does not echo
    const std::size_t bar = request.motor;
    if (request.module != kGripperModule) reply.status = Status::kWrongType;
    switch (request.command) {
      case Command::kMoveToPosition:
        target[bar] = request.value + (request.type == 1 ? position[bar] : 0);
        break;
      case Command::kGetAxisParameter:
        if (request.type == 1) reply.value = position[bar];
        if (request.type == 8) reply.value = position[bar] == target[bar] ? 1 : 0;
        break;
      case Command::kSetAxisParameter:
        if (request.type == 1) {
          position[bar] = target[bar] = request.value;
          ++zeroed;
        }
        break;
      case Command::kGetGlobalParameter: reply.value = calibrated; break;
      case Command::kSetGlobalParameter: calibrated = request.value; break;
      default: break;
    }
    return reply;
  }
  std::optional<Reply> pending_;
  int wait_ = 0;
  std::string name_ = "slave 11 (TMCM-1610), gripper";
};

struct TmclGripper : testing::Test {
  FakeGripper gripper;
  RequestQueue queue;
  bool commanded_the_joint = false;
  int requests = 0;

  void cycle(Sequence& sequence) {
    gripper.step();
    queue.step(gripper);
    const auto completion = queue.pop();
    const Action action = sequence.step(DriveInput{}, completion ? &*completion : nullptr);
    commanded_the_joint |= action.drive.has_value();
    if (action.ask && queue.push(*action.ask)) ++requests;
  }
  int run(Sequence& sequence) {
    int cycles = 0;
    for (; sequence.progress() == Progress::kRunning && cycles < 60'000; ++cycles) cycle(sequence);
    return cycles;
  }
};

TEST_F(TmclGripper, OpeningIsNegativeOnTheWire) {
  EXPECT_EQ(gripper_move_to(1, 66000), (Request{1, Command::kMoveToPosition, 0, 1, -66000}));
  EXPECT_EQ(gripper_open_by(0, -500), (Request{1, Command::kMoveToPosition, 1, 0, 500}));
  EXPECT_EQ(gripper_position(1), (Request{1, Command::kGetAxisParameter, 1, 1, 0}));
  EXPECT_EQ(flip(std::numeric_limits<std::int32_t>::min()), std::numeric_limits<std::int32_t>::max());
}

TEST_F(TmclGripper, MovesBothBarsAndReadsThem) {
  GripperMotion motion(40'000);
  run(motion);
  EXPECT_EQ(motion.progress(), Progress::kDone);
  EXPECT_EQ(gripper.position, (std::array<std::int32_t, 2>{-40'000, -40'000}));
  EXPECT_EQ(motion.opening(0), 40'000);
  EXPECT_EQ(motion.opening(1), 40'000);
  EXPECT_FALSE(commanded_the_joint) << "joint 5 keeps its commander";
}

TEST_F(TmclGripper, LeavesTheMailboxToOthersMostOfTheTime) {
  GripperMotion motion(60'000);
  const int cycles = run(motion);
  EXPECT_LT(requests, 2 + 2 + 2 * (cycles / 100 + 1));
}

TEST_F(TmclGripper, TargetOutOfRangeIsRefused) {
  for (const std::int32_t opening : {-1, kGripperTravel + 1}) {
    GripperMotion motion(opening);
    EXPECT_EQ(motion.fault(), SequenceFault::kBadTarget);
    run(motion);
    EXPECT_EQ(requests, 0);
  }
}

TEST_F(TmclGripper, SlowBarRunsOutOfTime) {
  gripper.steps_per_ms = 1;
  GripperMotion motion(66'000);
  EXPECT_NEAR(run(motion), 4000, 20);
  EXPECT_EQ(motion.fault(), SequenceFault::kTooSlow);
}

TEST_F(TmclGripper, MissingGripperIsReportedSoon) {
  gripper.missing = true;
  GripperCalibration calibration(GripperCalibration::Repeat::kWhenNeeded);
  EXPECT_LT(run(calibration), 200);
  EXPECT_EQ(calibration.fault(), SequenceFault::kMailboxFailed);
}

TEST_F(TmclGripper, CalibrationOpensClosesAndCallsThatZero) {
  const auto start = gripper.position;
  GripperCalibration calibration(GripperCalibration::Repeat::kWhenNeeded);
  run(calibration);
  EXPECT_EQ(calibration.progress(), Progress::kDone);
  EXPECT_EQ(gripper.furthest_open[0], start[0] - kGripperTravel);
  EXPECT_EQ(gripper.furthest_open[1], start[1] - kGripperTravel);
  EXPECT_EQ(gripper.position, (std::array<std::int32_t, 2>{0, 0}));
  EXPECT_EQ(gripper.zeroed, 2);
  EXPECT_EQ(gripper.calibrated, 1);
  EXPECT_FALSE(commanded_the_joint);
}

TEST_F(TmclGripper, CalibrationIsRememberedUnlessRepeated) {
  gripper.calibrated = 1;
  GripperCalibration when_needed(GripperCalibration::Repeat::kWhenNeeded);
  run(when_needed);
  EXPECT_EQ(when_needed.progress(), Progress::kDone);
  EXPECT_EQ(gripper.zeroed, 0);
  GripperCalibration always(GripperCalibration::Repeat::kAlways);
  run(always);
  EXPECT_EQ(gripper.zeroed, 2);
}

TEST_F(TmclGripper, CalibrationThatDoesNotArriveIsNotRemembered) {
  gripper.steps_per_ms = 1;
  GripperCalibration calibration(GripperCalibration::Repeat::kAlways);
  run(calibration);
  EXPECT_EQ(calibration.fault(), SequenceFault::kTooSlow);
  EXPECT_EQ(gripper.calibrated, 0);
  EXPECT_EQ(gripper.zeroed, 0);
}

TEST_F(TmclGripper, StallIsTheFlagWithoutStandstill) {
  EXPECT_TRUE(is_stalled(0b0000'0001));
  EXPECT_FALSE(is_stalled(0b1000'0001));
  EXPECT_TRUE(has(0b0010'0000, GripperFlag::kOpenLoadA));
  EXPECT_STREQ(name(GripperFlag::kOpenLoadA), "open load, coil A");
}

TEST_F(TmclGripper, CycleDoesNotAllocateOrLock) {
  GripperCalibration calibration(GripperCalibration::Repeat::kWhenNeeded);
  const support::NoAllocGuard guard;
  run(calibration);
  const long violations = guard.violations();
  EXPECT_EQ(calibration.progress(), Progress::kDone);
  EXPECT_EQ(violations, 0);
}

}  // namespace tmcl_gripper_test
}  // namespace drivers::tmcl
