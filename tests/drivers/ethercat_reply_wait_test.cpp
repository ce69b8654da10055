#include "drivers/ethercat/reply_wait.h"

#include <gtest/gtest.h>

namespace drivers::ethercat::test {
namespace ethercat_reply_wait_test {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;

/// After so many replies that each took `after`, and wake-ups that each were `late`.
ReplyWait on_a_bus(nanoseconds after, nanoseconds late, int replies = 1000) {
  ReplyWait wait;
  for (int i = 0; i < replies; ++i) {
    wait.replied(after);
    wait.woke(late);
  }
  return wait;
}

/// How many frames are sent without polling before the next one with it.
int pause_of(ReplyWait& wait) {
  int frames = 0;
  for (; !wait.plan().polls && frames < 10'000; ++frames) wait.replied(100us);
  return frames;
}

TEST(ReplyWait, FirstFramesAreWaitedForAsleep) {
  ReplyWait wait;
  EXPECT_FALSE(wait.plan().polls);
  wait.replied(100us);
  EXPECT_TRUE(wait.plan().polls);
}

TEST(ReplyWait, SleepsSoLongThatItWakesWhenTheReplyUsuallyComes) {
  for (const nanoseconds late : {0us, 5us, 20us, 60us}) {
    const ReplyWait::Plan plan = on_a_bus(100us, late).plan();
    EXPECT_TRUE(plan.polls);
    EXPECT_NEAR(static_cast<double>(plan.asleep.count()), static_cast<double>((100us - late).count()), 100.0);
  }
}

TEST(ReplyWait, DoesNotSleepWhereWakingTakesAboutAsLongAsTheReply) {
  for (const nanoseconds late : {25us, 30us, 300us}) {
    const ReplyWait::Plan plan = on_a_bus(30us, late).plan();
    EXPECT_TRUE(plan.polls);
    EXPECT_EQ(plan.asleep, 0us);
  }
}

TEST(ReplyWait, AReplyThatTookVeryLongChangesLittle) {
  ReplyWait wait = on_a_bus(100us, 0us);
  wait.replied(500ms);
  wait.woke(500ms);
  EXPECT_LE(wait.plan().asleep, 102us);
  EXPECT_GE(wait.plan().asleep, 98us);
}

TEST(ReplyWait, FollowsABusThatHasBecomeFasterWithin30Frames) {
  ReplyWait wait = on_a_bus(1ms, 0us);
  for (int i = 0; i < 30; ++i) wait.replied(100us);
  EXPECT_NEAR(static_cast<double>(wait.plan().asleep.count()), 100'000.0, 1000.0);
}

TEST(ReplyWait, FollowsABusThatHasBecomeSlower) {
  ReplyWait wait = on_a_bus(100us, 0us);
  for (int i = 0; i < 200; ++i) wait.replied(200us);
  EXPECT_NEAR(static_cast<double>(wait.plan().asleep.count()), 200'000.0, 1000.0);
}

TEST(ReplyWait, RepliesThatVaryAreWaitedForFromTheEarlyOnesOn) {
  ReplyWait wait;
  for (int i = 0; i < 1000; ++i) {
    wait.replied(i % 2 == 0 ? 80us : 120us);
    wait.woke(0us);
  }
  EXPECT_GE(wait.plan().asleep, 80us);
  EXPECT_LT(wait.plan().asleep, 100us);
}

TEST(ReplyWait, ALostFrameForgetsTheUsualTime) {
  ReplyWait wait = on_a_bus(100us, 0us);
  wait.lost();
  EXPECT_FALSE(wait.plan().polls);
  wait.replied(300us);
  EXPECT_TRUE(wait.plan().polls);
  EXPECT_GT(wait.plan().asleep, 299us);
}

TEST(ReplyWait, ThreePollsInARowThatFindNothingPauseThem) {
  ReplyWait wait = on_a_bus(100us, 0us);
  for (const bool found : {false, false, true, false, false}) wait.polled(found);
  EXPECT_TRUE(wait.plan().polls);
  wait.polled(false);
  EXPECT_FALSE(wait.plan().polls);
}

TEST(ReplyWait, PausesDoubleUpTo1024FramesUntilAPollFindsItsReply) {
  ReplyWait wait = on_a_bus(100us, 0us);
  wait.polled(false);
  wait.polled(false);
  for (const int pause : {16, 32, 64, 128, 256, 512, 1024, 1024, 1024}) {
    wait.polled(false);
    EXPECT_EQ(pause_of(wait), pause);
  }
  wait.polled(true);
  for (int i = 0; i < 3; ++i) wait.polled(false);
  EXPECT_EQ(pause_of(wait), 16);
}

// The kernel stamps frames with the wall clock, which may be set.
TEST(ReplyWait, NegativeTimesCountAsZero) {
  ReplyWait wait;
  for (int i = 0; i < 1000; ++i) {
    wait.replied(i % 2 == 0 ? -1s : 0ns);
    wait.woke(i % 2 == 0 ? -1s : 0ns);
    EXPECT_TRUE(wait.plan().polls);
    EXPECT_EQ(wait.plan().asleep, 0ns);
  }
}

}  // namespace ethercat_reply_wait_test
}  // namespace drivers::ethercat::test
