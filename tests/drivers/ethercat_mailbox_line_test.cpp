// Headerless TMCL through the mailbox of an emulated drive, with chosen frames lost.
#include "drivers/ethercat/mailbox_line.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/drivers/ethercat_fakes.h"

namespace drivers::ethercat::test {
namespace ethercat_mailbox_line_test {

using Status = MailboxLine::Status;

enum class Loss { kBefore, kAfter };  // the slaves

class Mailbox : public ::testing::Test {
 protected:
  Mailbox() : robot({drive("TMCM-1610"), power_board("KR-845")}), link(robot.connect()) {
    PreOpBus setup(link, nullptr, impatient());
    setup.enter_pre_op();
    slaves = setup.slaves();
    line.emplace(slaves[0]);
    transceiver.emplace(link);
  }

  // One frame a millisecond.
  void frame() {
    FrameWriter& writer = transceiver->begin();
    if (line->add(writer, transceiver->index(), robot.wire->now())) {
      if (transceiver->exchange(100us)) {
        FrameReader answer = transceiver->answer();
        Datagram datagram;
        ASSERT_TRUE(answer.next(datagram));
        line->answer(datagram);
      } else {
        line->frame_lost();
      }
    }
    robot.wire->advance(1ms);
  }
  Status finish(int most_frames = 200) {
    for (frames = 0; frames < most_frames && line->status() == Status::kBusy; ++frames) frame();
    return line->status();
  }
  Status run(std::uint8_t type, std::chrono::nanoseconds timeout = 50ms) {
    EXPECT_TRUE(line->post(tmcl(0, 6, type, 0, 0), timeout));
    return finish();
  }
  // Loses the next `count` frames that access the mailbox this way.
  void lose(Command command, std::uint16_t offset, Loss loss, int count = 1) {
    left_ = count;
    const auto concerned = [this, command, offset](std::span<std::uint8_t> bytes) {
      return left_ > 0 && find_datagram(bytes, [&](const Datagram& datagram) {
               return datagram.command == command && datagram.offset() == offset;
             });
    };
    if (loss == Loss::kBefore)
      link.on_send = [this, concerned](Bytes& bytes) { return concerned(bytes) && left_-- > 0; };
    else
      link.on_receive = [this, concerned](std::span<std::uint8_t> bytes) {
        return !(concerned(bytes) && left_-- > 0);
      };
  }
  TestBoard& board() { return robot.board(0); }
  std::int32_t value() const { return tmcl_value(line->reply()); }

  EmulatedRobot robot;
  MeddlingLink link;
  std::vector<Slave> slaves;
  std::optional<MailboxLine> line;
  std::optional<Transceiver> transceiver;
  int frames = 0;
  int left_ = 0;
};

TEST_F(Mailbox, CarriesARequestAndItsReplyWithoutHeader) {
  board().value = 42;
  ASSERT_EQ(run(133), Status::kReplied);
  EXPECT_EQ(board().last_type, 133);
  ASSERT_EQ(line->reply().size(), kMailboxBytes);
  EXPECT_EQ(Bytes(line->reply().begin(), line->reply().begin() + 8), (Bytes{2, 0, 100, 6, 0, 0, 0, 42}));
  EXPECT_EQ(frames, 4) << "seen empty, written, seen full, read";
}

TEST_F(Mailbox, SmallZeroAndNegativeValuesArrive) {
  // A master that expects a header reads byte 5 of such replies as the type.
  for (const std::int32_t number :
       {0, 1, 255, 256, 65535, 65536, 0x30000, -1, -65536, -1000000, std::numeric_limits<std::int32_t>::min(),
        std::numeric_limits<std::int32_t>::max()}) {
    board().value = number;
    ASSERT_EQ(run(1), Status::kReplied);
    EXPECT_EQ(value(), number);
  }
}

TEST_F(Mailbox, WaitsForASlowBoard) {
  board().reply_time = 20ms;
  ASSERT_EQ(run(3), Status::kReplied);
  EXPECT_EQ(value(), 3001);
  EXPECT_GE(frames, 20);
}

TEST_F(Mailbox, ALostReadIsRepeatedAndNotExecutedTwice) {
  for (int i = 1; i <= 5; ++i) {  // the repeat bit toggles: odd and even repeats
    lose(Command::kFprd, kMailboxIn, Loss::kAfter);
    ASSERT_EQ(run(4), Status::kReplied) << i;
    EXPECT_EQ(left_, 0) << "nothing was lost";
    EXPECT_EQ(value(), 4000 + i);
    EXPECT_EQ(board().executed, i);
  }
}

TEST_F(Mailbox, AReadLostBeforeTheSlaveIsReadAgainAndNotTheReplyBefore) {
  ASSERT_EQ(run(4), Status::kReplied);
  lose(Command::kFprd, kMailboxIn, Loss::kBefore);
  ASSERT_EQ(run(5), Status::kReplied);
  EXPECT_EQ(left_, 0);
  EXPECT_EQ(value(), 5002);
}

TEST_F(Mailbox, FramesLostWhileASlowBoardWorksDoNotBringTheReplyBefore) {
  ASSERT_EQ(run(4), Status::kReplied);
  board().reply_time = 10ms;
  ASSERT_TRUE(line->post(tmcl(0, 6, 5, 0, 0), 50ms));
  frame();
  for (int i = 0; i < 3; ++i) {
    link.on_receive = [](std::span<std::uint8_t>) { return false; };
    frame();
    link.on_receive = nullptr;
    frame();
  }
  ASSERT_EQ(finish(), Status::kReplied);
  EXPECT_EQ(value(), 5002);
}

TEST_F(Mailbox, ARepeatSurvivesLossesOfItsOwn) {
  for (const std::uint16_t offset : {std::uint16_t{0x080E}, std::uint16_t{0x080F}}) {
    for (const Loss loss : {Loss::kBefore, Loss::kAfter}) {
      const int before = board().executed;
      int reads = 0;
      link.on_receive = [&reads](std::span<std::uint8_t> bytes) {
        return !(find_datagram(bytes, [](const Datagram& d) { return d.offset() == kMailboxIn; }) &&
                 ++reads == 1);
      };
      int others = 0;
      const auto concerned = [&others, offset](std::span<std::uint8_t> bytes) {
        return find_datagram(bytes, [&](const Datagram& d) { return d.offset() == offset; }) && ++others <= 2;
      };
      if (loss == Loss::kBefore) link.on_send = [&](Bytes& bytes) { return concerned(bytes); };
      const auto reading = link.on_receive;
      if (loss == Loss::kAfter)
        link.on_receive = [&](std::span<std::uint8_t> bytes) { return reading(bytes) && !concerned(bytes); };
      ASSERT_EQ(run(9), Status::kReplied);
      EXPECT_EQ(value(), 9000 + before + 1);
      EXPECT_EQ(board().executed, before + 1);
      EXPECT_GE(others, 2);
      link.on_send = nullptr;
      link.on_receive = nullptr;
    }
  }
}

TEST_F(Mailbox, ANewLineFindsTheRepeatBitAsTheLastOneLeftIt) {
  lose(Command::kFprd, kMailboxIn, Loss::kAfter);
  ASSERT_EQ(run(4), Status::kReplied);
  line.emplace(slaves[0]);  // as when set-up hands over to operation
  left_ = 1;
  ASSERT_EQ(run(5), Status::kReplied);
  EXPECT_EQ(left_, 0);
  EXPECT_EQ(value(), 5002);
}

TEST_F(Mailbox, AWriteThatGotThroughThoughItsAnswerWasLostIsNotExecutedTwice) {
  lose(Command::kFpwr, kMailboxOut, Loss::kAfter);
  ASSERT_EQ(run(6), Status::kReplied);
  EXPECT_EQ(left_, 0);
  EXPECT_EQ(value(), 6001);
  EXPECT_EQ(board().executed, 1);
}

TEST_F(Mailbox, AWriteLostBeforeTheSlaveTimesOutAndTheNextWorks) {
  lose(Command::kFpwr, kMailboxOut, Loss::kBefore);
  ASSERT_EQ(run(6), Status::kTimedOut);
  EXPECT_EQ(board().executed, 0);
  line->clear();
  ASSERT_EQ(run(7), Status::kReplied);
  EXPECT_EQ(value(), 7001);
}

TEST_F(Mailbox, AFullOneIsWrittenWhenThereIsRoom) {
  board().busy = true;
  // A request of another master fills it and is taken later; its reply is not ours.
  transceiver->begin()
      .add(Command::kFpwr, transceiver->index(), address_of(0x1001, kMailboxOut), kMailboxBytes)
      .data[2] = 99;
  ASSERT_TRUE(transceiver->exchange(1ms));
  ASSERT_TRUE(line->post(tmcl(0, 6, 8, 0, 0), 50ms));
  for (int i = 0; i < 10; ++i) frame();
  EXPECT_EQ(line->status(), Status::kBusy);
  EXPECT_EQ(board().executed, 0);
  board().busy = false;
  ASSERT_EQ(finish(), Status::kReplied);
  EXPECT_EQ(board().executed, 2);
  EXPECT_EQ(value(), 8002) << "not 99001, the reply to the request before";
}

TEST_F(Mailbox, TheReplyToAnOldRequestIsDroppedEvenIfTheBoardIsSlow) {
  board().busy = true;
  board().reply_time = 5ms;
  ASSERT_EQ(run(9, 10ms), Status::kTimedOut);
  ASSERT_TRUE(line->post(tmcl(0, 6, 8, 0, 0), 80ms));
  for (int i = 0; i < 5; ++i) frame();
  board().busy = false;
  ASSERT_EQ(finish(), Status::kReplied);
  EXPECT_EQ(value(), 8002);
}

TEST_F(Mailbox, AHungOneTimesOutAndItsLateReplyIsDropped) {
  robot.bus.slave(0).hang_mailbox(true);
  ASSERT_EQ(run(6, 30ms), Status::kTimedOut);
  EXPECT_EQ(frames, 32) << "the 32nd frame is the first later than 30 ms after the first";
  EXPECT_TRUE(line->reply().empty());
  robot.bus.slave(0).hang_mailbox(false);
  robot.wire->advance(5ms);
  ASSERT_EQ(board().executed, 1);
  ASSERT_EQ(run(7), Status::kReplied);
  EXPECT_EQ(value(), 7002) << "not 6001";
}

TEST_F(Mailbox, UnrequestedMailIsNotTakenForAnyReplyAfterIt) {
  const Bytes stray{2, 0, 100, 6, 0, 0, 0, 99};
  ASSERT_TRUE(robot.bus.slave(0).post_mailbox(stray));
  robot.wire->advance(2ms);
  for (std::int32_t i = 1; i <= 3; ++i) {
    ASSERT_EQ(run(7), Status::kReplied);
    EXPECT_EQ(value(), 7000 + i);
  }
}

TEST_F(Mailbox, ASlaveOutOfReachTimesOut) {
  robot.bus.set_power(0, false);
  EXPECT_EQ(run(6, 30ms), Status::kTimedOut);
}

TEST_F(Mailbox, ExpiresWithoutFrames) {
  ASSERT_TRUE(line->post(tmcl(0, 6, 8, 0, 0), 10ms));
  line->expire(100ms);
  line->expire(110ms);
  EXPECT_EQ(line->status(), Status::kBusy);
  line->expire(111ms);
  EXPECT_EQ(line->status(), Status::kTimedOut);
}

TEST_F(Mailbox, OnlyWhatFitsAndOneAtATimeIsTaken) {
  EXPECT_EQ(line->request_capacity(), kMailboxBytes);
  EXPECT_FALSE(line->post(Bytes(kMailboxBytes + 1), 10ms));
  EXPECT_EQ(line->status(), Status::kIdle);
  EXPECT_TRUE(line->post(Bytes(kMailboxBytes), 10ms));
  EXPECT_FALSE(line->post(Bytes(8), 10ms)) << "one is under way";
  EXPECT_FALSE(line->listen(10ms));
}

TEST_F(Mailbox, ASlaveWithoutOneRefuses) {
  MailboxLine none(slaves[1]);
  EXPECT_FALSE(none.exists());
  EXPECT_FALSE(none.post(Bytes(8), 10ms));
  EXPECT_FALSE(none.post({}, 10ms));
  EXPECT_FALSE(none.listen(10ms));
}

TEST_F(Mailbox, TheRestOfTheMailboxIsZeros) {
  ASSERT_TRUE(line->post(Bytes(kMailboxBytes, 0xEE), 10ms));
  line->clear();
  ASSERT_TRUE(line->post(tmcl(0, 6, 8, 0, 0), 10ms));
  Bytes written;
  link.on_send = [&](Bytes& bytes) {
    if (const auto d =
            find_datagram(bytes, [](const Datagram& each) { return each.offset() == kMailboxOut; }))
      written.assign(d->data.begin(), d->data.end());
    return false;
  };
  finish();
  ASSERT_EQ(written.size(), kMailboxBytes);
  EXPECT_EQ(std::count(written.begin() + 8, written.end(), 0), kMailboxBytes - 8);
}

TEST_F(Mailbox, AcceptsUnrequestedMail) {
  ASSERT_TRUE(line->listen(20ms));
  frame();
  robot.bus.slave(0).post_mailbox(Bytes{1, 2, 3});
  ASSERT_EQ(finish(), Status::kReplied);
  EXPECT_EQ(line->reply()[2], 3);
}

TEST_F(Mailbox, WaitsForRoomInTheFrame) {
  ASSERT_TRUE(line->post(tmcl(0, 6, 8, 0, 0), 50ms));
  FrameWriter full;
  full.add(Command::kLrw, 0, 0, 1480 - kDatagramOverheadBytes);
  const std::size_t before = full.bytes().size();
  frame();  // the look before it, which fits
  EXPECT_FALSE(line->add(full, 0, robot.wire->now()));
  EXPECT_EQ(full.bytes().size(), before);
  ASSERT_EQ(finish(), Status::kReplied);
}

TEST_F(Mailbox, DoesNotAllocateOrLock) {
  const Bytes request = tmcl(0, 6, 8, 0, 0);
  lose(Command::kFprd, kMailboxIn, Loss::kAfter, 0);
  for (int i = 0; i < 3; ++i) {
    left_ = i == 1 ? 1 : 0;
    FrameWriter writer;
    long violations = 0;
    {
      const support::NoAllocGuard guard;
      line->post(request, 50ms);
      line->add(writer, 1, robot.wire->now());
      line->frame_lost();
      line->add(writer, 1, robot.wire->now());
      violations = guard.violations();
    }
    EXPECT_EQ(violations, 0);
    line->clear();
  }
}

}  // namespace ethercat_mailbox_line_test
}  // namespace drivers::ethercat::test
