#include "drivers/ethercat/transceiver.h"

#include <gtest/gtest.h>

#include <array>
#include <cerrno>

#include "tests/drivers/ethercat_fakes.h"

namespace drivers::ethercat::test {
namespace ethercat_transceiver_test {

class Exchange : public ::testing::Test {
 protected:
  bool run(std::size_t length = 4) {
    transceiver.begin().add(Command::kFprd, transceiver.index(), address_of(0x1001, 0x0130), length);
    return transceiver.exchange(1ms);
  }
  // The answer of the slaves: the frame, counted by one slave and marked.
  static Bytes answered(Bytes frame, std::uint8_t data = 0) {
    frame[6] |= kReturnedBit;
    (void)find_datagram(frame, [&](const Datagram& datagram) {
      ++datagram.counter[0];
      if (!datagram.data.empty()) datagram.data[0] = data;
      return false;
    });
    return frame;
  }
  static MacAddress source_of(const Bytes& frame) {
    MacAddress source;
    std::copy_n(frame.begin() + kSourceMacOffset, source.size(), source.begin());
    return source;
  }
  void echo() {
    link.respond = [this](const Bytes& frame) { link.incoming.push_back(answered(frame, 0x5A)); };
  }
  const FrameCounters& counters() const { return transceiver.counters(); }

  ScriptedLink link;
  Transceiver transceiver{link};
};

TEST_F(Exchange, TheAnswerIsHandedOut) {
  echo();
  ASSERT_TRUE(run());
  FrameReader answer = transceiver.answer();
  Datagram datagram;
  ASSERT_TRUE(answer.next(datagram));
  EXPECT_EQ(datagram.working_counter(), 1);
  EXPECT_EQ(datagram.data[0], 0x5A);
  EXPECT_FALSE(answer.next(datagram));
  EXPECT_EQ(counters().sent, 1U);
  EXPECT_EQ(counters().received, 1U);
}

TEST_F(Exchange, NothingIsLeftOfTheLastAnswerOnceANewFrameIsBegun) {
  echo();
  ASSERT_TRUE(run());
  transceiver.begin();
  FrameReader answer = transceiver.answer();
  Datagram datagram;
  EXPECT_FALSE(answer.next(datagram));
}

TEST_F(Exchange, ALostFrameIsCountedOnce) {
  EXPECT_FALSE(run());
  EXPECT_EQ(counters().lost, 1U);
  EXPECT_EQ(counters().received, 0U);
}

TEST_F(Exchange, ARefusedFrameIsNotWaitedFor) {
  link.refuse_errno = ENETDOWN;
  EXPECT_FALSE(run());
  EXPECT_EQ(counters().not_sent, 1U);
  EXPECT_EQ(counters().lost, 0U);
  EXPECT_EQ(link.receives, 0);
}

TEST_F(Exchange, ALateAnswerIsNotTakenForTheNext) {
  EXPECT_FALSE(run());
  link.incoming.push_back(answered(link.sent[0], 0x11));
  echo();
  ASSERT_TRUE(run());
  EXPECT_EQ(counters().late, 1U);
  EXPECT_EQ(counters().lost, 1U);
  EXPECT_EQ(counters().duplicate, 0U);
  Datagram datagram;
  FrameReader answer = transceiver.answer();
  ASSERT_TRUE(answer.next(datagram));
  EXPECT_EQ(datagram.data[0], 0x5A);
}

TEST_F(Exchange, ASecondAnswerIsADuplicate) {
  link.respond = [this](const Bytes& frame) {
    link.incoming.push_back(answered(frame));
    link.incoming.push_back(answered(frame));
  };
  ASSERT_TRUE(run());
  ASSERT_TRUE(run());
  EXPECT_EQ(counters().duplicate, 1U);
  EXPECT_EQ(counters().late, 0U);
}

TEST_F(Exchange, OneAnswerToAFrameThatWasGivenUpIsLateAndCopiesAreDuplicates) {
  EXPECT_FALSE(run());
  const Bytes lost = answered(link.sent[0]);
  echo();
  ASSERT_TRUE(run());
  const Bytes answered_before = answered(link.sent[1]);
  ASSERT_TRUE(run());
  for (const Bytes& frame : {lost, lost, answered_before}) link.incoming.push_back(frame);
  ASSERT_TRUE(run());
  EXPECT_EQ(counters().lost, 1U);
  EXPECT_EQ(counters().late, 1U);
  EXPECT_EQ(counters().duplicate, 2U);
}

TEST_F(Exchange, GarbageIsMalformedAndSkipped) {
  link.respond = [this](const Bytes& frame) {
    link.incoming.push_back(Bytes(5, 0xFF));
    Bytes cut = frame;
    cut.resize(20);
    link.incoming.push_back(cut);
    Bytes command = frame;
    command[16] = 99;
    link.incoming.push_back(command);
    link.incoming.push_back(answered(frame));
  };
  EXPECT_TRUE(run());
  EXPECT_EQ(counters().malformed, 3U);
  EXPECT_EQ(counters().received, 1U);
}

TEST_F(Exchange, TheSameIndexWithOtherDatagramsIsNoAnswer) {
  link.respond = [this](const Bytes& frame) {
    const std::uint8_t index = frame[17];
    FrameWriter writer(source_of(frame));
    writer.add(Command::kFprd, index, 0, 2);  // another length
    link.incoming.emplace_back(writer.bytes().begin(), writer.bytes().end());
    writer.clear();
    writer.add(Command::kFpwr, index, 0, 4);  // another command
    link.incoming.emplace_back(writer.bytes().begin(), writer.bytes().end());
    writer.clear();
    writer.add(Command::kFprd, index, 0, 4);
    writer.add(Command::kNop, index, 0, 0);  // one more
    link.incoming.emplace_back(writer.bytes().begin(), writer.bytes().end());
  };
  EXPECT_FALSE(run());
  EXPECT_EQ(counters().malformed, 3U);
  EXPECT_EQ(counters().lost, 1U);
}

TEST_F(Exchange, AFloodOfStrangersEnds) {
  FrameWriter writer;
  writer.add(Command::kBrd, 200, 0, 1);
  for (int i = 0; i < 1000; ++i) link.incoming.emplace_back(writer.bytes().begin(), writer.bytes().end());
  EXPECT_FALSE(run());
  EXPECT_EQ(counters().foreign, 64U);
  EXPECT_EQ(counters().lost, 1U);
}

// Another master's frame may have our index and our datagrams: the same program on another machine has both.
TEST_F(Exchange, WhatAnotherMasterSentIsNoAnswerOfOurs) {
  link.respond = [this](const Bytes& frame) {
    Bytes theirs = answered(frame, 0x11);
    theirs[11] ^= 0x40;
    link.incoming.push_back(theirs);
  };
  EXPECT_FALSE(run());
  EXPECT_EQ(counters().foreign, 1U);
  EXPECT_EQ(counters().malformed + counters().late + counters().duplicate, 0U);
  EXPECT_EQ(counters().lost, 1U);
}

TEST_F(Exchange, TwoMastersOfTheSameProgramHaveAddressesOfTheirOwn) {
  Transceiver other(link);
  other.begin().add(Command::kBrd, other.index(), 0, 1);
  ASSERT_TRUE(other.send());
  EXPECT_FALSE(run());
  const MacAddress first = source_of(link.sent[0]);
  const MacAddress second = source_of(link.sent[1]);
  EXPECT_NE(first, second);
  // Unicast, as a source has to be; and the bit that the first slave sets is free.
  for (const MacAddress& source : {first, second}) EXPECT_EQ(source[0] & 0x03, 0);
}

TEST(AnotherMaster, IsOneWhoseFramesKeepComing) {
  OtherMaster other;
  other.note_frame(kSoem, 0ms);
  other.note_frame(kSoem, 5ms);
  EXPECT_FALSE(other.present(5ms));
  other.note_frame(kSoem, 10ms);
  EXPECT_TRUE(other.present(10ms));
  EXPECT_EQ(other.source(), "01:01:01:01:01:01");
  EXPECT_TRUE(
      contains(other.describe(), "another EtherCAT master is on this bus (3 frames from 01:01:01:01:01:01)"));
}

TEST(AnotherMaster, IsTheSameBeforeAndBehindTheSlaves) {
  OtherMaster other;
  MacAddress returned{0x10, 1, 2, 3, 4, 5};
  other.note_frame(returned, 0ms);
  returned[0] |= kReturnedBit;
  other.note_frame(returned, 5ms);
  other.note_frame(returned, 10ms);
  EXPECT_TRUE(other.present(10ms));
  EXPECT_EQ(other.source(), "10:01:02:03:04:05");
}

TEST(AnotherMaster, IsNoneWhenAnEndedProgramLeftABurst) {
  OtherMaster other;
  for (int i = 0; i < 50; ++i) other.note_frame(kSoem, std::chrono::microseconds(100 * i));
  EXPECT_FALSE(other.present(6ms));
}

TEST(AnotherMaster, IsNoneWhenFramesWereDamagedHereAndThere) {
  OtherMaster other;
  MacAddress damaged = kMasterMac;
  for (int i = 0; i < 100; ++i) {
    damaged[5] = static_cast<std::uint8_t>(1U << (i % 8));
    other.note_frame(damaged, std::chrono::milliseconds(10 * i));
  }
  EXPECT_FALSE(other.present(1s));
}

TEST(AnotherMaster, ThatEndedIsNotNamedForTheOneAtWork) {
  constexpr MacAddress kAtWork{0x10, 0, 0, 0, 0, 0x02};
  OtherMaster other;
  for (int i = 0; i < 100; ++i) other.note_frame(kSoem, std::chrono::milliseconds(i));
  EXPECT_EQ(other.source(), "01:01:01:01:01:01");
  for (int i = 0; i < 20; ++i) other.note_frame(kAtWork, std::chrono::milliseconds(500 + 100 * i));
  EXPECT_TRUE(other.present(2400ms));
  EXPECT_EQ(other.source(), "10:00:00:00:00:02");
}

TEST_F(Exchange, MastersThatTakeTurnsAreEachFound) {
  constexpr std::array<MacAddress, 4> kOthers{
      kSoem, {0x10, 1, 1, 1, 1, 1}, {0x20, 2, 2, 2, 2, 2}, {0x30, 3, 3, 3, 3, 3}};
  for (std::size_t count = 1; count <= kOthers.size(); ++count) {
    Transceiver ours(link);
    for (std::size_t i = 0; i <= 2 * count; ++i) {  // until the first has sent three
      EXPECT_FALSE(ours.other_master().present(link.now())) << i << " frames of " << count << " masters";
      FrameWriter theirs(kOthers[i % count]);
      theirs.add(Command::kBrd, 0x21, address_of(0, reg::kAlStatus), 2);
      link.incoming.emplace_back(theirs.bytes().begin(), theirs.bytes().end());
      ours.begin().add(Command::kFprd, ours.index(), address_of(0x1001, reg::kAlStatus), 2);
      EXPECT_FALSE(ours.exchange(1ms));
      link.time += 10ms;
    }
    EXPECT_TRUE(ours.other_master().present(link.now())) << count << " masters";
    EXPECT_EQ(ours.other_master().source(), "01:01:01:01:01:01");
  }
}

TEST(AnotherMaster, IsFoundAmongDamagedFrames) {
  OtherMaster other;
  MacAddress damaged = kMasterMac;
  for (int i = 0; i < 100; ++i) {
    damaged[5] = static_cast<std::uint8_t>(1U << (i % 8));
    other.note_frame(damaged, std::chrono::milliseconds(10 * i));
    other.note_frame(kSoem, std::chrono::milliseconds(10 * i));
  }
  EXPECT_TRUE(other.present(1s));
  EXPECT_TRUE(contains(other.describe(), "100 frames from 01:01:01:01:01:01")) << other.describe();
}

TEST(AnotherMaster, IsForgottenASecondAfterItHasLeft) {
  OtherMaster other;
  for (int i = 0; i < 50; ++i) other.note_frame(kSoem, std::chrono::milliseconds(i));
  EXPECT_TRUE(other.present(1049ms));
  EXPECT_FALSE(other.present(1050ms));
  other.note_frame(kSoem, 2s);
  EXPECT_FALSE(other.present(2s)) << "one frame is none again";
}

TEST(AnotherMaster, ShowsByWhatItAsksOfTheSlaves) {
  OtherMaster other;
  other.note_order({.slave = 3, .register_address = reg::kAlControl}, 5ms);
  EXPECT_TRUE(other.present(5ms));
  EXPECT_FALSE(other.present(1006ms));
  EXPECT_TRUE(contains(other.describe(), "slave 3 has a state that this program did not set"));
}

TEST_F(Exchange, TheIndexWrapsAndGoesOnMatching) {
  echo();
  for (int i = 0; i < 600; ++i) {
    ASSERT_TRUE(run()) << i;
    ASSERT_EQ(transceiver.index(), (i + 1) & 0xFF);
    ASSERT_EQ(link.sent.back()[17], (i + 1) & 0xFF);
  }
  EXPECT_EQ(counters().received, 600U);
  EXPECT_EQ(counters().late + counters().duplicate + counters().malformed + counters().lost, 0U);
}

TEST_F(Exchange, AFrameTooLongForUsIsMalformed) {
  link.respond = [this](const Bytes& frame) {
    Bytes big = frame;
    big.resize(9000, 0xAA);
    store_le<std::uint16_t>(&big[14], 0x17FF);
    link.incoming.push_back(big);
  };
  EXPECT_FALSE(run());
  EXPECT_EQ(counters().malformed, 1U);
}

TEST_F(Exchange, TheTapSeesEveryFrameMalformedOnesToo) {
  struct Tap final : FrameTap {
    void frame(Direction direction, std::span<const std::uint8_t> bytes) noexcept override {
      (direction == Direction::kSent ? sent : received) += 1;
      last = bytes.size();
    }
    int sent = 0;
    int received = 0;
    std::size_t last = 0;
  } tap;
  Transceiver tapped(link, &tap);
  link.respond = [this](const Bytes& frame) {
    link.incoming.push_back(Bytes(3));
    link.incoming.push_back(answered(frame));
  };
  tapped.begin().add(Command::kBrd, tapped.index(), 0, 1);
  EXPECT_TRUE(tapped.exchange(1ms));
  EXPECT_EQ(tap.sent, 1);
  EXPECT_EQ(tap.received, 2);
  EXPECT_EQ(tap.last, 60U);
}

}  // namespace ethercat_transceiver_test
}  // namespace drivers::ethercat::test
