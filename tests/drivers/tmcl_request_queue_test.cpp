#include "drivers/tmcl/request_queue.h"

#include <gtest/gtest.h>

#include "drivers/tmcl/axis_parameters.h"
#include "tests/drivers/tmcl_fakes.h"
#include "tests/support/no_alloc_guard.h"

namespace drivers::tmcl {
namespace tmcl_request_queue_test {

constexpr Request kAskPosition = get(drive_parameter("actual_position"));
constexpr Request kAskCurrent = get(drive_parameter("actual_motor_current"));

std::optional<Completion> run(RequestQueue& queue, Transport& transport, int cycles) {
  for (int i = 0; i < cycles; ++i) {
    queue.step(transport);
    if (auto completion = queue.pop()) return completion;
  }
  return std::nullopt;
}

TEST(RequestQueue, AnswersComeInOrderWithTheirTags) {
  fake::Module module;
  module.values[{1, 0}] = 5;
  module.values[{150, 0}] = 700;
  module.latency = 2;
  RequestQueue queue;
  ASSERT_TRUE(queue.push(kAskPosition, 10));
  ASSERT_TRUE(queue.push(kAskCurrent, 20));
  const auto first = run(queue, module, 20);
  const auto second = run(queue, module, 20);
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->tag, 10U);
  EXPECT_EQ(first->reply.value, 5);
  EXPECT_TRUE(first->done());
  EXPECT_EQ(second->request, kAskCurrent);
  EXPECT_EQ(second->reply.value, 700);
  EXPECT_TRUE(queue.idle());
}

TEST(RequestQueue, OneRequestIsOutAtATime) {
  fake::Module module;
  module.latency = 5;
  RequestQueue queue;
  queue.push(kAskPosition);
  queue.push(kAskCurrent);
  for (int i = 0; i < 4; ++i) queue.step(module);
  EXPECT_EQ(module.requests.size(), 1U);
}

TEST(RequestQueue, FullQueueRefusesUntilACompletionIsTaken) {
  fake::Module module;
  RequestQueue queue;
  for (std::size_t i = 0; i < RequestQueue::kCapacity; ++i) ASSERT_TRUE(queue.push(kAskPosition));
  EXPECT_FALSE(queue.push(kAskCurrent));
  for (int i = 0; i < 100; ++i) queue.step(module);
  EXPECT_TRUE(queue.idle());
  EXPECT_FALSE(queue.push(kAskCurrent)) << "completions not taken yet";
  EXPECT_TRUE(queue.pop());
  EXPECT_TRUE(queue.push(kAskCurrent));
}

TEST(RequestQueue, LostReplyTimesOutAfterTheGivenCycles) {
  fake::Module module;
  module.script = {std::nullopt};
  RequestQueue queue(10);
  queue.push(kAskPosition);
  EXPECT_FALSE(run(queue, module, 10));
  const auto completion = run(queue, module, 1);
  ASSERT_TRUE(completion);
  EXPECT_EQ(completion->outcome, Outcome::kTimedOut);
}

TEST(RequestQueue, LateReplyDoesNotAnswerTheNextRequest) {
  fake::Module module;
  module.latency = 15;
  module.values[{1, 0}] = 5;
  module.values[{150, 0}] = 700;
  RequestQueue queue(10);
  queue.push(kAskPosition);
  queue.push(kAskCurrent);
  EXPECT_EQ(run(queue, module, 20)->outcome, Outcome::kTimedOut);
  module.latency = 2;
  const auto second = run(queue, module, 30);
  ASSERT_TRUE(second);
  EXPECT_TRUE(second->done());
  EXPECT_EQ(second->reply.value, 700);
  EXPECT_EQ(queue.discarded(), 1U);
}

TEST(RequestQueue, LostReplyDelaysTheNextByOneTimeoutOnly) {
  fake::Module module;
  module.script = {std::nullopt};
  RequestQueue queue(10);
  queue.push(kAskPosition);
  queue.push(kAskCurrent);
  run(queue, module, 20);
  EXPECT_TRUE(run(queue, module, 13)->done());
}

TEST(RequestQueue, RefusalIsReported) {
  fake::Module module;
  module.script = {Reply{0, 0, Status::kProtected, Command::kSetAxisParameter, 0, {}}};
  RequestQueue queue;
  queue.push(set(drive_parameter("motor_poles"), 16));
  const auto completion = run(queue, module, 20);
  ASSERT_TRUE(completion);
  EXPECT_EQ(completion->outcome, Outcome::kRefused);
  EXPECT_EQ(completion->reply.status, Status::kProtected);
}

TEST(RequestQueue, VersionTextIsDone) {
  fake::Module module;
  RequestQueue queue;
  queue.push({0, Command::kGetFirmwareVersion, 0, 0, 0});
  EXPECT_TRUE(run(queue, module, 20)->done());
}

TEST(RequestQueue, RequestThatCannotBeSentIsGivenUp) {
  fake::Module module;
  module.refuse_posts = 1000;
  RequestQueue queue(10);
  queue.push(kAskPosition);
  EXPECT_EQ(run(queue, module, 20)->outcome, Outcome::kNotSent);
}

TEST(RequestQueue, WrongAnswersAreCountedAndIgnored) {
  fake::Module module;
  module.latency = 3;
  RequestQueue queue;
  module.pending.emplace_back(0, Reply{0, 0, Status::kOk, Command::kMotorStop, 1, {}});
  queue.push(kAskPosition);
  EXPECT_TRUE(run(queue, module, 20)->done());
  EXPECT_EQ(queue.discarded(), 1U);
}

TEST(RequestQueue, ACycleTakesUpToFourReplies) {
  fake::Module module;
  RequestQueue queue;
  for (int i = 0; i < 5; ++i)
    module.pending.emplace_back(0, Reply{0, 0, Status::kOk, Command::kMotorStop, 1, {}});
  queue.step(module);
  EXPECT_EQ(queue.discarded(), 4U);
  queue.step(module);
  EXPECT_EQ(queue.discarded(), 5U);
}

TEST(RequestQueue, ClearForgetsAndStillWaitsOutTheReply) {
  fake::Module module;
  module.latency = 4;
  module.values[{1, 0}] = 5;
  module.values[{150, 0}] = 700;
  RequestQueue queue(10);
  queue.push(kAskPosition);
  queue.step(module);
  queue.clear();
  EXPECT_EQ(queue.size(), 0U);
  queue.push(kAskCurrent);
  const auto completion = run(queue, module, 30);
  ASSERT_TRUE(completion);
  EXPECT_EQ(completion->reply.value, 700);
}

TEST(RequestQueue, CycleDoesNotAllocateOrLock) {
  fake::Drive drive;
  RequestQueue queue;
  int done = 0;
  const support::NoAllocGuard guard;
  for (int i = 0; i < 1000; ++i) {
    if (i % 7 == 0) queue.push(kAskPosition, 1);
    queue.step(drive);
    while (const auto completion = queue.pop()) done += completion->done() ? 1 : 0;
  }
  const long violations = guard.violations();
  EXPECT_GT(done, 100);
  EXPECT_EQ(violations, 0);
}

}  // namespace tmcl_request_queue_test
}  // namespace drivers::tmcl
