// Sync managers: mailboxes with alternation and repetition, and consistent process data.
#include <gtest/gtest.h>

#include "tests/sim/bus_hand_master.h"

namespace sim::bus::test {
namespace bus_mailbox_test {

constexpr std::uint16_t kOut = 0x1000;
constexpr std::uint16_t kIn = 0x1040;
constexpr std::size_t kLength = 32;
constexpr std::uint16_t kOutStatus = 0x0805;
constexpr std::uint16_t kInStatus = 0x080D;
constexpr std::uint16_t kInActivate = 0x080E;
constexpr std::uint16_t kInPdi = 0x080F;

Bytes message(std::uint8_t first) {
  Bytes bytes(kLength);
  bytes[0] = first;
  bytes[kLength - 1] = 0xEE;
  return bytes;
}

class Mailbox : public ::testing::Test {
 protected:
  Mailbox() { master.bring_up(AlState::kPreOp); }
  bool out_full() { return (master.read(0, kOutStatus, 1).number() & reg::kMailboxFull) != 0; }
  bool in_full() { return (master.read(0, kInStatus, 1).number() & reg::kMailboxFull) != 0; }

  EmulatedBus bus;
  EmulatedSlave& slave = bus.add(drive());
  RecordingBoard board{slave};
  HandMaster master{bus};
};

TEST_F(Mailbox, IsShutInInit) {
  master.request(0, AlState::kInit);
  EXPECT_EQ(master.write(0, kOut, message(1)).counter, 0);
  EXPECT_TRUE(board.request.empty());
}

TEST_F(Mailbox, ARequestReachesTheBoardAndTheReplyTheMaster) {
  board.reply = {2, 0, 100, 5};
  EXPECT_EQ(master.read(0, kIn, kLength).counter, 0) << "empty";
  EXPECT_EQ(master.write(0, kOut, message(1)).counter, 1);
  EXPECT_EQ(board.request, message(1));
  EXPECT_FALSE(out_full());
  EXPECT_TRUE(in_full());
  const Answer answer = master.read(0, kIn, kLength);
  EXPECT_EQ(answer.counter, 1);
  Bytes expected(kLength);
  std::ranges::copy(board.reply, expected.begin());
  EXPECT_EQ(answer.data, expected);
  EXPECT_FALSE(in_full());
  EXPECT_EQ(master.read(0, kIn, kLength).counter, 0);
}

TEST_F(Mailbox, AFullOneIsNotWrittenAgain) {
  board.busy = true;
  EXPECT_EQ(master.write(0, kOut, message(1)).counter, 1);
  EXPECT_TRUE(out_full());
  EXPECT_EQ(master.write(0, kOut, message(2)).counter, 0);
  board.busy = false;
  bus.advance(1ms);
  EXPECT_EQ(board.request, message(1)) << "offered again with time";
  EXPECT_FALSE(out_full());
  EXPECT_EQ(master.write(0, kOut, message(2)).counter, 1);
}

TEST_F(Mailbox, ASecondRequestInTheSameFrameIsRefused) {
  const std::uint32_t at = drivers::ethercat::address_of(0, kOut);
  const std::vector<Answer> answers =
      master.run(HandFrame().add(Command::kApwr, at, message(1)).add(Command::kApwr, at, message(2)));
  EXPECT_EQ(answers[0].counter, 1);
  EXPECT_EQ(answers[1].counter, 0);
  EXPECT_EQ(board.request, message(1));
}

TEST_F(Mailbox, OnlyTheLastByteCompletesAnAccess) {
  EXPECT_EQ(master.write(0, kOut, Bytes(8, 0x55)).counter, 1);
  EXPECT_TRUE(board.request.empty());
  EXPECT_EQ(master.write(0, kOut + 8, Bytes(8)).counter, 1) << "it is open";
  EXPECT_EQ(master.write(0, kOut + kLength - 1, {0xEE}).counter, 1);
  ASSERT_EQ(board.request.size(), kLength);
  EXPECT_EQ(board.request[0], 0x55);

  slave.post_mailbox(Bytes{1, 2, 3});
  bus.advance(1ms);
  EXPECT_EQ(master.read(0, kIn, 8).data, (Bytes{1, 2, 3, 0, 0, 0, 0, 0}));
  EXPECT_TRUE(in_full());
  EXPECT_EQ(master.read(0, kIn + kLength - 1, 1).counter, 1);
  EXPECT_FALSE(in_full());
}

TEST_F(Mailbox, AnAccessBeginsWithTheFirstByte) {
  EXPECT_EQ(master.write(0, kOut + 1, Bytes(kLength - 1)).counter, 0);
  EXPECT_TRUE(board.request.empty());
  slave.post_mailbox(Bytes{1});
  bus.advance(1ms);
  EXPECT_EQ(master.read(0, kIn + kLength - 1, 1).counter, 0);
  EXPECT_TRUE(in_full());
}

TEST_F(Mailbox, DirectionsAreKept) {
  EXPECT_EQ(master.write(0, kIn, message(1)).counter, 0);
  board.busy = true;
  master.write(0, kOut, message(1));
  EXPECT_EQ(master.read(0, kOut, kLength).counter, 0) << "full, but not for the master";
  EXPECT_TRUE(out_full());
}

TEST_F(Mailbox, ALostReplyIsRepeatedBeforeTheNext) {
  slave.post_mailbox(Bytes{'A'});
  bus.advance(1ms);
  EXPECT_EQ(master.read(0, kIn, kLength).data[0], 'A');  // let this frame be lost on its way back
  slave.post_mailbox(Bytes{'B'});
  bus.advance(1ms);
  EXPECT_TRUE(in_full());
  master.write(0, kInActivate, {0x03});  // enabled, repeat requested
  EXPECT_EQ(master.read(0, kInPdi, 1).number() & reg::kRepeatAcknowledge, reg::kRepeatAcknowledge);
  EXPECT_EQ(master.read(0, kIn, kLength).data[0], 'A');
  EXPECT_EQ(master.read(0, kIn, kLength).data[0], 'B');
  EXPECT_EQ(master.read(0, kIn, kLength).counter, 0);
  // The other edge of the toggle.
  master.write(0, kInActivate, {0x01});
  EXPECT_EQ(master.read(0, kInPdi, 1).number() & reg::kRepeatAcknowledge, 0U);
  EXPECT_EQ(master.read(0, kIn, kLength).data[0], 'B');
}

TEST_F(Mailbox, WithNothingToRepeatTheRequestIsStillAcknowledged) {
  master.write(0, kInActivate, {0x03});
  EXPECT_EQ(master.read(0, kInPdi, 1).number() & reg::kRepeatAcknowledge, reg::kRepeatAcknowledge);
  EXPECT_FALSE(in_full());
}

TEST_F(Mailbox, RepliesWaitOneDeep) {
  EXPECT_TRUE(slave.post_mailbox(Bytes{'A'}));
  bus.advance(1ms);  // into the mailbox
  EXPECT_TRUE(slave.post_mailbox(Bytes{'B'}));
  EXPECT_FALSE(slave.post_mailbox(Bytes{'C'}));
  EXPECT_EQ(master.read(0, kIn, kLength).data[0], 'A');
  EXPECT_EQ(master.read(0, kIn, kLength).data[0], 'B');
  EXPECT_FALSE(slave.post_mailbox(Bytes(kLength + 1))) << "too long";
}

TEST_F(Mailbox, AHungOneStaysFullAndSilent) {
  slave.hang_mailbox(true);
  board.reply = {1};
  EXPECT_EQ(master.write(0, kOut, message(1)).counter, 1);
  bus.advance(1s);
  EXPECT_TRUE(out_full());
  EXPECT_EQ(master.write(0, kOut, message(2)).counter, 0);
  master.write(0, kInActivate, {0x03});
  EXPECT_EQ(master.read(0, kInPdi, 1).number() & reg::kRepeatAcknowledge, 0U);
  slave.hang_mailbox(false);
  bus.advance(1ms);
  EXPECT_FALSE(out_full());
  EXPECT_TRUE(in_full());
  EXPECT_EQ(master.read(0, kInPdi, 1).number() & reg::kRepeatAcknowledge, reg::kRepeatAcknowledge);
}

TEST_F(Mailbox, GoingToInitForgetsReplies) {
  slave.post_mailbox(Bytes{'A'});
  bus.advance(1ms);
  master.request(0, AlState::kInit);
  EXPECT_FALSE(slave.post_mailbox(Bytes{'B'}));
  master.request(0, AlState::kPreOp);
  EXPECT_EQ(master.read(0, kIn, kLength).counter, 0);
  EXPECT_TRUE(slave.post_mailbox(Bytes{'C'}));
  bus.advance(1ms);
  EXPECT_EQ(master.read(0, kIn, kLength).data[0], 'C');
}

TEST_F(Mailbox, ASyncManagerInUseKeepsItsSettings) {
  // Only the enable bit can be changed while it is enabled (data sheet section II, table 89).
  master.write(0, reg::kSyncManager, bytes_of(0x1400, 2));
  EXPECT_EQ(master.read(0, reg::kSyncManager, 2).number(), kOut);
}

class ProcessData : public ::testing::Test {
 protected:
  ProcessData() {
    board.input_data = Bytes(20, 0xA0);
    master.bring_up(AlState::kOp);
  }
  static constexpr std::uint16_t kOutputs = 0x1100;
  static constexpr std::uint16_t kInputs = 0x1180;

  EmulatedBus bus;
  RecordingBoard board{bus.add(drive())};
  HandMaster master{bus};
};

TEST_F(ProcessData, HalfASetOfOutputsIsNeverSeen) {
  master.write(0, kOutputs, {1, 2, 3, 4, 5});
  EXPECT_EQ(board.outputs, (Bytes{1, 2, 3, 4, 5}));
  const int before = board.output_writes;
  master.write(0, kOutputs, {9, 9, 9});
  bus.advance(1ms);
  EXPECT_EQ(board.output_writes, before);
  EXPECT_EQ(board.outputs, (Bytes{1, 2, 3, 4, 5}));
  master.write(0, kOutputs + 3, {8, 8});
  EXPECT_EQ(board.outputs, (Bytes{9, 9, 9, 8, 8}));
}

TEST_F(ProcessData, InputsReadInPiecesAreOfOneMoment) {
  bus.advance(1ms);
  EXPECT_EQ(master.read(0, kInputs, 10).data, Bytes(10, 0xA0));
  board.input_data = Bytes(20, 0xB0);
  bus.advance(1ms);
  EXPECT_EQ(master.read(0, kInputs + 10, 10).data, Bytes(10, 0xA0));
  EXPECT_EQ(master.read(0, kInputs, 20).data, Bytes(20, 0xB0));
}

TEST_F(ProcessData, TheSameInputsAreReadAgainUntilThereAreNewOnes) {
  board.input_data = Bytes(20, 0xC0);
  bus.advance(1ms);
  for (int i = 0; i < 4; ++i) EXPECT_EQ(master.read(0, kInputs, 20).data, Bytes(20, 0xC0));
  for (std::uint8_t i = 0; i < 7; ++i) {
    board.input_data = Bytes(20, i);
    bus.advance(1ms);
  }
  EXPECT_EQ(master.read(0, kInputs, 20).data, Bytes(20, 6));
}

TEST_F(ProcessData, HiddenBuffersAreOutOfReach) {
  EXPECT_EQ(master.write(0, kOutputs + 5, Bytes(10)).counter, 0);
  EXPECT_EQ(master.read(0, kInputs + 20, 4).counter, 0);
}

TEST_F(ProcessData, StatusNamesTheLastWrittenBuffer) {
  const auto buffer = [this] { return master.read(0, 0x0815, 1).number() >> 4 & 3U; };
  const std::uint64_t first = buffer();
  EXPECT_NE(first, 3U);
  master.write(0, kOutputs, Bytes(5));
  EXPECT_NE(buffer(), first);
  master.request(0, AlState::kPreOp);
  EXPECT_EQ(buffer(), 3U) << "none since it was opened again";
}

}  // namespace bus_mailbox_test
}  // namespace sim::bus::test
