// When a drive's Hall sensors are read, and the encoder counts in the meantime.
#include "hal/hall_reader.h"

#include <gtest/gtest.h>

#include "hal/ethercat_robot.h"
#include "tests/hal/ethercat_rig.h"

namespace hal {
namespace hall_reader_test {

using drivers::tmcl::Completion;
using drivers::tmcl::Outcome;

class Reader : public testing::Test {
 protected:
  /// Cycles until it asks, at most `limit`.
  int cycles_until_due(int limit) {
    int cycles = 1;
    while (!reader.due() && cycles < limit) ++cycles;
    return cycles;
  }
  /// The encoder in the frame with which it asks, and in each of the next.
  void pass(std::initializer_list<int> positions_ticks) {
    for (const int ticks : positions_ticks) {
      reader.pass(ticks);
      (void)reader.due();
    }
  }
  static Completion completion(Outcome outcome, std::int32_t value = 0) {
    Completion completion;
    completion.outcome = outcome;
    completion.reply.value = value;
    return completion;
  }

  // Eight pole pairs and 4000 counts: 500 to an electrical revolution.
  HallReader reader{
      {.gear_ratio = 26, .ticks_per_motor_rev = 4000, .pole_pairs = 8}, std::chrono::milliseconds(1), 3};
};

TEST_F(Reader, AReadingHasAllThatTheEncoderShowedWhileItWasTaken) {
  ASSERT_TRUE(reader.due());
  reader.ask();
  // The third frame behind carries the request.
  pass({700, 650, 1000, 1010, 1025, 990});
  EXPECT_EQ(reader.reading().number, 0U) << "no reply yet";
  reader.answer(completion(Outcome::kDone, -0x4000));
  reader.pass(980);
  reader.pass(5000);
  EXPECT_EQ(reader.reading().number, 1U);
  EXPECT_DOUBLE_EQ(reader.reading().hall_turn, 0.75) << "65536 to an electrical revolution";
  EXPECT_DOUBLE_EQ(reader.reading().encoder_low_turn, 980 / 500.0);
  EXPECT_DOUBLE_EQ(reader.reading().encoder_high_turn, 1025 / 500.0);
}

TEST_F(Reader, FramesThatAreLostLeaveOutNothingOfWhatItsEncoderDid) {
  // The request is written and answered in frames that do not come back: the rotor was anywhere in between.
  pass({1000});
  ASSERT_TRUE(reader.due());
  reader.ask();
  reader.pass(1010);
  for (int lost = 0; lost < 5; ++lost) (void)reader.due();
  reader.answer(completion(Outcome::kDone));
  reader.pass(1200);
  EXPECT_DOUBLE_EQ(reader.reading().encoder_low_turn, 1010 / 500.0);
  EXPECT_DOUBLE_EQ(reader.reading().encoder_high_turn, 1200 / 500.0);
}

TEST_F(Reader, AsksEveryTenMillisecondsAndOneRequestAtATime) {
  ASSERT_TRUE(reader.due());
  reader.ask();
  for (int i = 0; i < 50; ++i) EXPECT_FALSE(reader.due()) << "a request is under way";
  reader.answer(completion(Outcome::kDone));
  reader.pass(0);
  ASSERT_TRUE(reader.due());
  reader.ask();
  reader.answer(completion(Outcome::kDone));
  reader.pass(0);
  EXPECT_EQ(cycles_until_due(100), 10);
}

TEST_F(Reader, LeavesADriveAloneThatRefuses) {
  reader.ask();
  reader.answer(completion(Outcome::kRefused));
  EXPECT_TRUE(reader.refused());
  EXPECT_EQ(cycles_until_due(100'000), 100'000);
  reader.forget();  // another firmware, perhaps
  EXPECT_EQ(cycles_until_due(100'000), 1);
}

TEST_F(Reader, AsksOneThatIsSilentOnlyOnceASecond) {
  reader.ask();
  reader.answer(completion(Outcome::kTimedOut));
  EXPECT_FALSE(reader.refused());
  EXPECT_EQ(cycles_until_due(100'000), 1000);
}

/// By the emulated boards, which are written apart: the angle between encoder and Hall sensors is constant.
TEST(HallReading, FollowsTheEncoderOnTheEmulatedBus) {
  test::EthercatRig rig(YoubotKind::kBaseAndArm);
  rig.robot->activate();
  rig.enable();
  rig.command_all_velocity(0.1);
  std::array<std::uint32_t, 9> first{};
  std::array<double, 9> offset{};
  for (std::size_t i = 0; i < 9; ++i) first[i] = rig.sample.joints[i].rotor.number;
  for (int cycle = 0; cycle < 1000; ++cycle) {
    (void)rig.step();
    for (std::size_t i = 0; i < 9; ++i) {
      const RotorReading& rotor = rig.sample.joints[i].rotor;
      if (rotor.number == 0) continue;
      const double middle = (rotor.encoder_low_turn + rotor.encoder_high_turn) / 2;
      // The emulated motors count both the same way round.
      const double now = rotor.hall_turn - middle;
      if (rotor.number <= first[i] + 1) offset[i] = now;
      const double away = now - offset[i];
      EXPECT_LT(std::abs(away - std::round(away)), 1.0 / 6 + 0.1) << i << " in cycle " << cycle;
    }
  }
  for (std::size_t i = 0; i < 9; ++i) {
    const std::uint32_t count = rig.sample.joints[i].rotor.number - first[i];
    EXPECT_GT(count, 80U) << i;
    EXPECT_LE(count, 101U) << i;
  }
}

}  // namespace hall_reader_test
}  // namespace hal
