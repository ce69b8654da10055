#include "drivers/tmcl/request_batch.h"

#include <gtest/gtest.h>

#include "drivers/tmcl/axis_parameters.h"
#include "tests/drivers/tmcl_fakes.h"
#include "tests/support/no_alloc_guard.h"

namespace drivers::tmcl {
namespace tmcl_request_batch_test {

constexpr Request kTarget = set(drive_parameter("target_current"), 250);
constexpr Request kPosition = get(drive_parameter("actual_position"));
constexpr Request kCurrent = get(drive_parameter("actual_motor_current"));
constexpr Request kStop{kDriveModule, Command::kMotorStop, 0, 0, 0};

struct TmclBatch : testing::Test {
  TmclBatch() {
    module.values[{1, 0}] = 5;
    module.values[{150, 0}] = 700;
  }
  void post_all() {
    for (const Request& request : {kTarget, kPosition, kCurrent}) ASSERT_TRUE(batch.post(module, request));
  }
  std::size_t step() {
    batch.step(module);
    return batch.take().size();
  }
  fake::Module module;
  RequestBatch batch{3};
};

TEST_F(TmclBatch, AllAnswersComeTogetherInOrder) {
  EXPECT_TRUE(batch.free());
  post_all();
  EXPECT_FALSE(batch.free());
  EXPECT_EQ(module.requests.size(), 3U) << "all at once";
  batch.step(module);
  const auto done = batch.take();
  ASSERT_EQ(done.size(), 3U);
  EXPECT_EQ(done[0].request, kTarget);
  EXPECT_EQ(done[1].reply.value, 5);
  EXPECT_EQ(done[2].reply.value, 700);
  EXPECT_TRUE(done[2].done());
  EXPECT_TRUE(batch.free());
  EXPECT_EQ(step(), 0U);
}

TEST_F(TmclBatch, PartOfTheAnswersIsNoAnswer) {
  post_all();
  const auto last = module.pending.back();
  module.pending.pop_back();
  EXPECT_EQ(step(), 0U);
  EXPECT_FALSE(batch.free());
  module.pending.push_back(last);
  EXPECT_EQ(step(), 3U) << "in the step after";
}

TEST_F(TmclBatch, ADroppedRequestNeverGivesTheNextAnswerItsMeaning) {
  post_all();
  module.pending.erase(module.pending.begin() + 1);  // the position's: the current's stands in its place
  for (int i = 0; i < 3; ++i) EXPECT_EQ(step(), 0U);
  EXPECT_EQ(batch.lost(), 1U);
  // Late replies have as long to arrive, and are discarded.
  module.pending.emplace_back(0, module.answer(kPosition));
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(step(), 0U);
    EXPECT_FALSE(batch.free());
  }
  EXPECT_EQ(step(), 0U);
  EXPECT_TRUE(batch.free());
  post_all();
  EXPECT_EQ(step(), 3U);
}

TEST_F(TmclBatch, AnAnswerOutOfOrderEndsTheBatchAtOnce) {
  post_all();
  std::swap(module.pending[0], module.pending[1]);
  EXPECT_EQ(step(), 0U);
  EXPECT_EQ(batch.lost(), 1U);
  EXPECT_FALSE(batch.free());
}

TEST_F(TmclBatch, AnAnswerTooManyMakesAllOfThemDoubtful) {
  post_all();
  module.pending.insert(module.pending.begin() + 1, {0, module.answer(kPosition)});
  EXPECT_EQ(step(), 0U);
  EXPECT_EQ(batch.lost(), 1U);
}

TEST_F(TmclBatch, ARefusalIsAnAnswer) {
  module.script.emplace_back(Reply{0, 0, Status::kInvalidValue, Command::kSetAxisParameter, 250, {}});
  post_all();
  batch.step(module);
  const auto done = batch.take();
  ASSERT_EQ(done.size(), 3U);
  EXPECT_EQ(done[0].outcome, Outcome::kRefused);
  EXPECT_TRUE(done[1].done());
}

TEST_F(TmclBatch, AStopJoinsWhatIsOnItsWay) {
  post_all();
  ASSERT_TRUE(batch.post(module, kStop));
  EXPECT_EQ(module.requests.back(), kStop);
  EXPECT_EQ(step(), 4U);
}

TEST_F(TmclBatch, AStopAfterALossProlongsTheRest) {
  post_all();
  module.pending.clear();
  for (int i = 0; i < 5; ++i) EXPECT_EQ(step(), 0U);
  ASSERT_TRUE(batch.post(module, kStop)) << "it goes out nevertheless";
  EXPECT_EQ(step(), 0U);
  EXPECT_EQ(step(), 0U);
  EXPECT_FALSE(batch.free());
  EXPECT_EQ(step(), 0U);
  EXPECT_TRUE(batch.free());
}

TEST_F(TmclBatch, WhatTheTransportDoesNotTakeIsNotWaitedFor) {
  ASSERT_TRUE(batch.post(module, kTarget));
  module.refuse_posts = 1;
  EXPECT_FALSE(batch.post(module, kPosition));
  EXPECT_EQ(step(), 1U);
}

TEST_F(TmclBatch, StraysAreDropped) {
  module.pending.emplace_back(0, module.answer(kPosition));
  EXPECT_EQ(step(), 0U);
  EXPECT_TRUE(batch.free());
  EXPECT_EQ(batch.lost(), 0U);
}

TEST_F(TmclBatch, ARequestTooManyGoesOutAndGivesTheBatchUp) {
  for (std::size_t i = 0; i < RequestBatch::kCapacity; ++i) ASSERT_TRUE(batch.post(module, kPosition));
  EXPECT_EQ(batch.lost(), 0U);
  ASSERT_TRUE(batch.post(module, kStop));
  EXPECT_EQ(module.requests.back(), kStop);
  EXPECT_EQ(batch.lost(), 1U);
  EXPECT_EQ(step(), 0U) << "nothing of it is believed";
}

TEST_F(TmclBatch, AStepTakesUpToTwoBatchesOfReplies) {
  for (std::size_t i = 0; i <= 2 * RequestBatch::kCapacity; ++i)
    module.pending.emplace_back(0, module.answer(kPosition));
  batch.step(module);
  EXPECT_EQ(module.pending.size(), 1U);
}

}  // namespace tmcl_request_batch_test
}  // namespace drivers::tmcl
