#include "drivers/tmcl/polled_drive.h"

#include <gtest/gtest.h>

#include <algorithm>

#include <string>

#include "drivers/tmcl/axis_parameters.h"
#include "tests/drivers/tmcl_fakes.h"

namespace drivers::tmcl {
namespace tmcl_polled_drive_test {

using namespace std::chrono_literals;

/// Requests of a cycle, in the letters of the header's table; "=" is a command.
std::string letter(const Request& request) {
  if (request.command != Command::kGetAxisParameter && request.command != Command::kGetGlobalParameter)
    return "=";
  switch (request.type) {
    case 1: return "P";
    case 150: return "C";
    case 3: return "V";
    case 156: return "S";
    case 55: return request.motor == 2 ? "M" : "?";
    default: return "?";
  }
}

struct TmclPolledDrive : testing::Test {
  TmclPolledDrive() {
    module.values[{55, 2}] = PolledDrive::kMemoryMark;
    module.values[{1, 0}] = -1234;
    module.values[{150, 0}] = 700;
    module.values[{3, 0}] = 90;
    module.values[{156, 0}] = 1 << 15;
  }
  /// The requests of one cycle.
  std::string cycle(PolledDrive& drive, const DriveOutput& output = kStopMotor) {
    module.requests.clear();
    answered = drive.receive();
    drive.send(output, now);
    now += 1ms;
    std::string letters;
    for (const Request& request : module.requests) letters += letter(request);
    return letters;
  }
  std::string cycles(PolledDrive& drive, int count) {
    std::string all;
    for (int i = 0; i < count; ++i) all += (i == 0 ? "" : " ") + cycle(drive);
    return all;
  }
  fake::Module module;
  std::chrono::nanoseconds now{0};
  bool answered = false;
};

TEST_F(TmclPolledDrive, EverySettingKeepsTheScheduleOfTheHeader) {
  const char* const expected[] = {
      "= P = C = P = V = P = C = P = S",  // and so on
      "=P =C =P =V =P =C =P =S =P =C =P =V =P =C =P =M =P",
      "=PC =PV =PC =PS =PC =PV =PC =PM =PC",
      "=PCV =PCS =PCV =PCM =PCV",
      "=PCVS =PCVM =PCVS",
  };
  const int length[] = {16, 17, 9, 5, 3};
  for (int requests = 1; requests <= PolledDrive::kMaxRequests; ++requests) {
    PolledDrive drive(module, {.requests_per_cycle = requests});
    const auto row = static_cast<std::size_t>(requests - 1);
    EXPECT_EQ(cycles(drive, length[row]), expected[row]) << requests;
    module.pending.clear();
  }
  // From one P to the next.
  for (int requests = 1; requests <= PolledDrive::kMaxRequests; ++requests) {
    const std::string schedule = expected[requests - 1];
    const std::size_t first = schedule.find('P');
    const std::size_t next = schedule.find('P', first + 1);
    EXPECT_EQ(std::count(schedule.begin() + static_cast<std::ptrdiff_t>(first),
                         schedule.begin() + static_cast<std::ptrdiff_t>(next), ' '),
              PolledDrive::cycles_between_positions(requests));
  }
}

TEST_F(TmclPolledDrive, ReadingsAreKnownACycleLaterWithTheTimeOfTheQuestion) {
  PolledDrive drive(module, {.requests_per_cycle = 3});
  now = 100ms;
  cycle(drive);
  EXPECT_FALSE(answered);
  EXPECT_FALSE(drive.position_is_fresh());
  module.age = 700us;
  cycle(drive);
  module.age = {};
  EXPECT_TRUE(answered);
  EXPECT_TRUE(drive.position_is_fresh());
  EXPECT_EQ(drive.stamp(), 100ms);
  EXPECT_EQ(drive.position_age(), 700us) << "and when it was answered";
  EXPECT_EQ(drive.input().position_ticks, -1234);
  EXPECT_EQ(drive.input().current_mA, 700);
  cycle(drive);
  EXPECT_EQ(drive.input().velocity_rpm, 90);
  cycles(drive, 2);
  EXPECT_TRUE(drive.input().flags.has(StatusFlag::kInitialized));
}

TEST_F(TmclPolledDrive, EveryModeIsARequest) {
  using enum ControllerMode;
  EXPECT_EQ(*request_for({kMotorStop, 7}, 1), (Request{0, Command::kMotorStop, 0, 1, 0}));
  EXPECT_EQ(*request_for({kPosition, 7}, 1), (Request{0, Command::kSetAxisParameter, 0, 1, 7}));
  EXPECT_EQ(*request_for({kVelocity, 7}, 1), (Request{0, Command::kSetAxisParameter, 2, 1, 7}));
  EXPECT_EQ(*request_for({kSetPositionToReference, 7}, 1), (Request{0, Command::kSetAxisParameter, 1, 1, 7}));
  EXPECT_EQ(*request_for({kPwm, 7}, 1), (Request{0, Command::kSetAxisParameter, 154, 1, 7}));
  EXPECT_EQ(*request_for({kCurrent, 7}, 1), (Request{0, Command::kSetAxisParameter, 155, 1, 7}));
  EXPECT_EQ(*request_for({kInitialize, 7}, 1), (Request{0, Command::kSetAxisParameter, 15, 1, 1}));
  EXPECT_FALSE(request_for({kNoMoreAction, 7}, 1));
}

TEST_F(TmclPolledDrive, CommutationIsStartedOnceAndAgainWhenThatMayBeLost) {
  PolledDrive drive(module, {.requests_per_cycle = 3});
  const DriveOutput start{ControllerMode::kInitialize, 0};
  EXPECT_EQ(cycle(drive, start), "=PC");
  EXPECT_EQ(cycle(drive, start), "PV");
  EXPECT_EQ(cycle(drive, start), "PC");
  module.pending.clear();
  for (int i = 0; i < 5; ++i) EXPECT_EQ(cycle(drive, start), "") << i;
  EXPECT_EQ(cycle(drive, start), "=PM");
}

TEST_F(TmclPolledDrive, QuestionsTakeTheLastReadsPlaceUntilAnswered) {
  PolledDrive drive(module, {.requests_per_cycle = 3});
  const Request question = get(drive_parameter("initialize_joint"));
  module.values[{15, 0}] = 1;
  drive.ask(question);
  EXPECT_EQ(cycle(drive), "=P?");
  EXPECT_EQ(cycle(drive), "=PV") << "each cycle reads the position, whatever else is asked";
  ASSERT_TRUE(drive.answer());
  EXPECT_EQ(drive.answer()->request, question);
  EXPECT_EQ(drive.answer()->reply.value, 1);
  cycle(drive);
  EXPECT_FALSE(drive.answer());

  drive.ask(question);
  cycle(drive);
  module.pending.clear();
  std::string all;
  for (int i = 0; i < 20 && !drive.answer(); ++i) all += cycle(drive);
  EXPECT_TRUE(drive.answer()) << "asked again: " << all;
}

TEST_F(TmclPolledDrive, AModuleWithoutTheMarkHasRestartedAndIsMarkedAgain) {
  PolledDrive drive(module, {.requests_per_cycle = 3});
  cycles(drive, 2);
  module.values[{55, 2}] = 0;
  int found_after = 0;
  while (!drive.has_restarted() && found_after < 20) {
    cycle(drive);
    ++found_after;
  }
  EXPECT_LE(found_after, 9) << "its turn comes every eight cycles";
  EXPECT_FALSE(drive.refusal());
  cycles(drive, 2);
  EXPECT_FALSE(drive.has_restarted()) << "reported once";
  EXPECT_EQ((module.values[{55, 2}]), PolledDrive::kMemoryMark);
  for (int i = 0; i < 20; ++i) {
    cycle(drive);
    EXPECT_FALSE(drive.has_restarted());
  }
}

TEST_F(TmclPolledDrive, AfterASilenceTheMarkIsLookedAtFirst) {
  PolledDrive drive(module, {.requests_per_cycle = 3});
  cycle(drive);
  module.pending.clear();
  std::string first;
  while (first.empty()) first = cycle(drive);
  EXPECT_EQ(first, "=PM");
}

TEST_F(TmclPolledDrive, RefusedCommandsAndReadsAreReported) {
  PolledDrive drive(module, {.requests_per_cycle = 3});
  const DriveOutput output{ControllerMode::kVelocity, 500'000};
  module.script.emplace_back(Reply{0, 0, Status::kInvalidValue, Command::kSetAxisParameter, 500'000, {}});
  cycle(drive, output);
  cycle(drive, output);
  ASSERT_TRUE(drive.refusal());
  EXPECT_EQ(drive.refusal()->request.type, 2);
  EXPECT_EQ(drive.refusal()->reply.status, Status::kInvalidValue);
  EXPECT_TRUE(drive.position_is_fresh()) << "the reads are answered all the same";
  cycle(drive, output);
  EXPECT_FALSE(drive.refusal());
}

TEST_F(TmclPolledDrive, StopGoesOutOfTurn) {
  PolledDrive drive(module, {.requests_per_cycle = 3});
  module.latency = 100;
  cycle(drive, {ControllerMode::kCurrent, 500});
  EXPECT_EQ(cycle(drive, {ControllerMode::kCurrent, 500}), "") << "the answers are late";
  module.requests.clear();
  drive.stop();
  ASSERT_EQ(module.requests.size(), 1U);
  EXPECT_EQ(module.requests[0].command, Command::kMotorStop);
}

}  // namespace tmcl_polled_drive_test
}  // namespace drivers::tmcl
