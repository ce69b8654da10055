// Virtual time over the wire: each frame advances it; the link waits for a slow simulation and fails on a
// silent one.
#include "drivers/ethercat/lock_step_link.h"

#include <gtest/gtest.h>

#include "drivers/ethercat/simulated_bus.h"
#include "drivers/ethercat/transceiver.h"
#include "tests/drivers/ethercat_fakes.h"

namespace drivers::ethercat::test {
namespace ethercat_lock_step_link_test {

std::vector<SlaveDescription> simulated(std::string_view mark = kLockStepMark) {
  std::vector<SlaveDescription> slaves = youbot();
  for (SlaveDescription& slave : slaves) slave.group = mark;
  return slaves;
}

/// The emulated robot behind a link that can be spoilt, behind one in lock-step.
struct Rig {
  explicit Rig(bool lifted = false, std::vector<SlaveDescription> slaves = simulated())
      : robot(std::move(slaves)) {
    auto meddling = std::make_unique<MeddlingLink>(robot.connect({.timed = true}));
    wire = meddling.get();
    link = std::make_unique<LockStepLink>(std::move(meddling), lifted);
  }

  EmulatedRobot robot;
  MeddlingLink* wire = nullptr;
  std::unique_ptr<LockStepLink> link;
};

bool exchange_status(Transceiver& transceiver) {
  FrameWriter& writer = transceiver.begin();
  (void)writer.add(Command::kBrd, transceiver.index(), address_of(0, reg::kAlStatus), 2);
  return transceiver.exchange(500us);
}

TEST(LockStep, ABusWithASlaveThatDoesNotSayItIsSimulatedStaysAsItIs) {
  for (const std::string_view other : {std::string_view(), kSimulatedMark}) {
    std::vector<SlaveDescription> slaves = simulated();
    slaves[7].group = other;
    EmulatedRobot robot(slaves);
    const std::string error = error_of(
        [&] { LockStepLink(std::make_unique<MeddlingLink>(robot.connect({.timed = true})), false); });
    EXPECT_TRUE(contains(error, "slave 8 (TMCM-1610): check that it is simulated in lock-step"));
    EXPECT_TRUE(contains(error, "youbot-sim --lock-step"));
    for (std::size_t i = 0; i < 11; ++i) EXPECT_EQ(robot.state(i), AlState::kInit) << i;
  }
}

TEST(LockStep, TheWheelsAreLiftedOrSetDown) {
  for (const bool lifted : {true, false}) {
    Rig rig(lifted);
    for (std::size_t i = 0; i < 11; ++i)
      EXPECT_EQ(rig.robot.bus.slave(i).controller().get<std::uint8_t>(kLiftedAddress), lifted ? 1 : 0) << i;
  }
}

TEST(LockStep, AMillisecondPassesWithEachFrameAndWithNothingElse) {
  Rig rig;
  Transceiver transceiver(*rig.link);
  const auto begin = rig.link->now();
  ASSERT_TRUE(exchange_status(transceiver));
  EXPECT_EQ(rig.link->now() - begin, 1ms);
  EXPECT_EQ(transceiver.round_trip(), 1ms);
  const int frames = rig.wire->frames;
  // To wait is to let the simulation go on.
  rig.link->wait(2500us);
  EXPECT_EQ(rig.wire->frames - frames, 3);
  EXPECT_EQ(rig.link->now() - begin, 4ms);
  Bytes buffer(kMaxFrameBytes);
  EXPECT_EQ(rig.link->receive(buffer, 2ms), 0U) << "nothing is under way";
  EXPECT_EQ(rig.wire->frames - frames, 5);
  EXPECT_EQ(transceiver.counters().lost, 0U);
}

TEST(LockStep, AnAnswerMayComeFarTooLate) {
  Rig rig;
  rig.wire->on_send = [&](Bytes&) {
    rig.robot.wire->advance(4s);  // what a machine under load takes
    return false;
  };
  Transceiver transceiver(*rig.link);
  for (int n = 0; n < 3; ++n) EXPECT_TRUE(exchange_status(transceiver));
}

TEST(LockStep, AStrangersFrameIsNotTheAnswer) {
  Rig rig;
  Transceiver transceiver(*rig.link);
  ASSERT_TRUE(exchange_status(transceiver));
  rig.wire->on_send = [&](Bytes&) {
    rig.robot.wire->send(frame_of_another_master(Command::kBrd, address_of(0, reg::kAlStatus)));
    return false;
  };
  EXPECT_TRUE(exchange_status(transceiver));
  EXPECT_EQ(transceiver.counters().foreign, 1U);
  rig.wire->on_send = nullptr;
  EXPECT_TRUE(exchange_status(transceiver)) << "each answer belongs to its frame";
}

TEST(LockStep, ASilentSimulationIsWaitedForOnce) {
  Rig rig;
  Transceiver transceiver(*rig.link);
  rig.wire->on_send = [](Bytes&) { return true; };
  const int frames = rig.wire->frames;
  const auto silent_since = rig.robot.wire->now();
  EXPECT_FALSE(exchange_status(transceiver));
  EXPECT_EQ(rig.robot.wire->now() - silent_since, kLockStepPatience);
  EXPECT_EQ(transceiver.counters().not_sent, 0U);

  rig.wire->on_send = nullptr;  // it may be another bus by now
  const auto begin = rig.link->now();
  for (int n = 0; n < 3; ++n) EXPECT_FALSE(exchange_status(transceiver));
  rig.link->wait(10ms);
  EXPECT_EQ(rig.wire->frames - frames, 1);
  EXPECT_EQ(transceiver.counters().link_error, ETIME);
  // Time-outs above the link end.
  EXPECT_EQ(rig.link->now() - begin, 13ms);
}

TEST(LockStep, ARefusedFrameEndsIt) {
  Rig rig;
  Transceiver transceiver(*rig.link);
  rig.wire->refused = ENETDOWN;
  EXPECT_FALSE(exchange_status(transceiver));
  rig.wire->refused = 0;
  EXPECT_FALSE(exchange_status(transceiver)) << "it may be another bus by now";
  EXPECT_EQ(transceiver.counters().link_error, ENETDOWN);
}

TEST(LockStep, AWaitEndsAmongFramesOfAnotherMaster) {
  Rig rig;
  const auto begin = rig.link->now();
  rig.wire->on_send = [&](Bytes&) {
    for (int n = 0; n < 100; ++n)
      rig.robot.wire->send(frame_of_another_master(Command::kBrd, address_of(0, reg::kAlStatus)));
    return true;
  };
  rig.link->wait(3ms);
  EXPECT_EQ(rig.link->now() - begin, 3ms);
}

TEST(LockStep, ASilenceDuringSetupEndsIt) {
  Rig rig;
  PreOpBus setup(*rig.link, nullptr, {});
  rig.wire->on_send = [](Bytes&) { return true; };
  const std::string error = error_of([&] { setup.enter_pre_op(); });
  EXPECT_TRUE(contains(error, "no frame comes back")) << error;
  const std::string again = error_of([&] { PreOpBus(*rig.link, nullptr, {}); });
  EXPECT_TRUE(contains(again, "Timer expired")) << again;
}

}  // namespace ethercat_lock_step_link_test
}  // namespace drivers::ethercat::test
