// The wire, the link and the fault script.
#include <gtest/gtest.h>

#include <array>
#include <stdexcept>

#include "sim/bus/bus_link.h"
#include "tests/sim/bus_hand_master.h"
#include "tests/support/no_alloc_guard.h"

namespace sim::bus::test {
namespace bus_fault_test {

class Script : public ::testing::Test {
 protected:
  Script() {
    for (int i = 0; i < 3; ++i) bus.add(drive());
  }
  EmulatedWire& wire(std::vector<FaultEvent> faults, bool timed = false) {
    return wire_.emplace(bus, WireOptions{.timed = timed, .faults = std::move(faults)});
  }
  // Sends a BRD with `index`; the replies that are there at once, as their index and working counter.
  using Seen = std::vector<std::pair<std::uint8_t, std::uint16_t>>;
  Seen exchange(std::uint8_t index) {
    drivers::ethercat::FrameWriter writer;
    writer.add(Command::kBrd, index, 0, 1);
    wire_->send(writer.bytes());
    return receive();
  }
  Seen receive() {
    Seen seen;
    std::array<std::uint8_t, 1514> buffer;
    while (const std::size_t size = wire_->receive(buffer)) {
      drivers::ethercat::FrameReader reader;
      drivers::ethercat::Datagram datagram;
      if (reader.parse(std::span(buffer).first(size)) != drivers::ethercat::FrameError::kNone) {
        seen.emplace_back(0xFF, 0xFFFF);
        continue;
      }
      while (reader.next(datagram)) seen.emplace_back(datagram.index, datagram.working_counter());
    }
    return seen;
  }
  EmulatedBus bus;
  std::optional<EmulatedWire> wire_;
};

TEST_F(Script, LostRepliesAreProcessedLostRequestsAreNot) {
  RecordingBoard board(bus.slave(0));
  HandMaster(bus).bring_up(AlState::kOp);
  const int before = board.output_writes;
  wire({{.kind = FaultKind::kDropReply, .at_frame = 0},
        {.kind = FaultKind::kDropRequest, .at_frame = 1, .count = 2}});
  const auto send = [this] {
    Bytes frame = HandFrame().add(Command::kLrw, kLogical, Bytes(75)).bytes();
    wire_->send(frame);
    return receive().size();
  };
  EXPECT_EQ(send(), 0U);
  EXPECT_EQ(board.output_writes, before + 1);
  EXPECT_EQ(send() + send(), 0U);
  EXPECT_EQ(board.output_writes, before + 1);
  EXPECT_FALSE(send() == 0);
  EXPECT_EQ(board.output_writes, before + 2);
  EXPECT_TRUE(wire_->faults().finished());
}

TEST_F(Script, ADelayedReplyIsOvertaken) {
  wire({{.kind = FaultKind::kDelay, .at_frame = 1, .delay = 3ms}});
  EXPECT_EQ(exchange(0), (Seen{{0, 3}}));
  EXPECT_EQ(exchange(1), Seen{});
  EXPECT_EQ(exchange(2), (Seen{{2, 3}}));
  wire_->advance(2999us);
  EXPECT_EQ(receive(), Seen{});
  wire_->advance(1us);
  EXPECT_EQ(receive(), (Seen{{1, 3}}));
}

TEST_F(Script, DuplicateTruncateCorruptAndMiscount) {
  wire({{.kind = FaultKind::kDuplicate, .at_frame = 0},
        {.kind = FaultKind::kTruncate, .at_frame = 1, .offset = 20},
        {.kind = FaultKind::kCorrupt, .at_frame = 2, .offset = 17, .mask = 0x40},
        {.kind = FaultKind::kWrongCounter, .at_frame = 3, .counter_change = -1},
        {.kind = FaultKind::kWrongCounter, .at_frame = 4, .counter_change = 7, .datagram = 1}});
  EXPECT_EQ(exchange(0), (Seen{{0, 3}, {0, 3}}));
  EXPECT_EQ(exchange(1), (Seen{{0xFF, 0xFFFF}}));
  EXPECT_EQ(exchange(2), (Seen{{0x42, 3}}));
  EXPECT_EQ(exchange(3), (Seen{{3, 2}}));
  EXPECT_EQ(exchange(4), (Seen{{4, 3}})) << "no second datagram";
  EXPECT_EQ(exchange(5), (Seen{{5, 3}}));
}

TEST_F(Script, FaultsOfOneFrameAdd) {
  wire({{.kind = FaultKind::kDuplicate, .at_frame = 0}, {.kind = FaultKind::kWrongCounter, .at_frame = 0}});
  EXPECT_EQ(exchange(0), (Seen{{0, 2}, {0, 2}}));
}

TEST_F(Script, FrameFaultsCanWaitForATime) {
  wire({{.kind = FaultKind::kDropReply, .at = 5ms, .count = 2}});
  EXPECT_EQ(exchange(0).size(), 1U);
  wire_->advance(5ms);
  EXPECT_EQ(exchange(1).size(), 0U);
  EXPECT_EQ(exchange(2).size(), 0U);
  EXPECT_EQ(exchange(3).size(), 1U);
}

TEST_F(Script, ASlaveGoesAndComesBackInInit) {
  HandMaster master(bus);
  master.bring_up(AlState::kPreOp);
  wire({{.kind = FaultKind::kSlaveOff, .at = 10ms, .duration = 50ms, .slave = 1}});
  EXPECT_EQ(exchange(0), (Seen{{0, 3}}));
  wire_->advance(10ms);
  EXPECT_EQ(exchange(1), (Seen{{1, 1}}));
  wire_->advance(49ms);
  EXPECT_EQ(exchange(2), (Seen{{2, 1}}));
  EXPECT_FALSE(wire_->faults().finished());
  wire_->advance(1ms);
  EXPECT_EQ(exchange(3), (Seen{{3, 3}}));
  EXPECT_TRUE(wire_->faults().finished());
  EXPECT_EQ(master.al_status(1), 0x0001);
  EXPECT_EQ(master.al_status(2), 0x0002);
}

TEST_F(Script, OneLongStepMeetsEveryEventAtItsTime) {
  HandMaster master(bus);
  master.bring_up(AlState::kOp);
  wire({{.kind = FaultKind::kCableOut, .at = 20ms, .duration = 30ms, .slave = 2},
        {.kind = FaultKind::kBrownOut, .at = 200ms, .duration = 1ms}});
  wire_->advance(60ms);
  EXPECT_EQ(exchange(0), (Seen{{0, 3}}));
  EXPECT_EQ(master.read(1, reg::kLostLinkCounters + 1, 1).number(), 1U);
  EXPECT_EQ(master.al_status(2), 0x0008);
  wire_->advance(140ms);
  EXPECT_EQ(exchange(1), Seen{});
  wire_->advance(1ms);
  EXPECT_EQ(exchange(2), (Seen{{2, 3}}));
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(master.al_status(i), 0x0001);
}

TEST_F(Script, BusEventsCanWaitForAFrame) {
  wire({{.kind = FaultKind::kCableOut, .at_frame = 2, .duration = 1ms, .slave = 0}});
  EXPECT_EQ(exchange(0).size() + exchange(1).size(), 2U);
  EXPECT_EQ(exchange(2).size(), 0U);
  wire_->advance(1ms);
  EXPECT_EQ(exchange(3).size(), 1U);
}

TEST_F(Script, DamageOnACableCountsThere) {
  wire({{.kind = FaultKind::kDamageOnCable, .at_frame = 1, .count = 3, .slave = 1}});
  EXPECT_EQ(exchange(0).size(), 1U);
  for (std::uint8_t i = 1; i < 4; ++i) EXPECT_EQ(exchange(i).size(), 0U);
  EXPECT_EQ(exchange(4).size(), 1U);
  HandMaster master(bus);
  EXPECT_EQ(master.read(1, reg::kRxErrorCounters, 1).number(), 3U);
  EXPECT_EQ(master.read(2, reg::kForwardedErrorCounters, 1).number(), 3U);
}

TEST_F(Script, MailboxAndBoardFaultsReachTheSlave) {
  RecordingBoard board(bus.slave(2));
  HandMaster master(bus);
  master.bring_up(AlState::kPreOp);
  wire({{.kind = FaultKind::kMailboxHung, .at = 1ms, .duration = 5ms, .slave = 2},
        {.kind = FaultKind::kBoardFault, .at = 1ms, .duration = 5ms, .slave = 2}});
  wire_->advance(1ms);
  EXPECT_TRUE(board.stuck);
  master.write(2, 0x1000, Bytes(32));
  EXPECT_TRUE(board.request.empty());
  wire_->advance(5ms);
  EXPECT_FALSE(board.stuck);
  wire_->advance(1ms);
  EXPECT_EQ(board.request.size(), 32U);
}

TEST_F(Script, AnotherMasterWritesOnceAndItsFramesAreNotSeen) {
  HandMaster master(bus);
  master.bring_up(AlState::kOp);
  wire({{.kind = FaultKind::kForeignWrite, .at = 1ms, .slave = 1, .offset = 0x0420, .value = 0x1234},
        {.kind = FaultKind::kForeignWrite, .at = 2ms, .count = 8, .slave = 2, .offset = 0x0600}});
  ASSERT_EQ(master.read(2, 0x060C, 1).number(), 1U) << "its FMMU 0 is active";
  EXPECT_EQ(master.read(1, 0x0420, 2).number(), 1000U);
  wire_->advance(2ms);
  EXPECT_EQ(exchange(0), (Seen{{0, 3}})) << "no other frame comes back";
  EXPECT_EQ(master.read(1, 0x0420, 2).number(), 0x1234U);
  EXPECT_EQ(master.read(0, 0x0420, 2).number(), 1000U) << "another slave's is as it was";
  EXPECT_EQ(master.read(2, 0x060C, 1).number(), 0U);
  EXPECT_TRUE(wire_->faults().finished());
}

TEST_F(Script, EventsThatCannotBeAreAllNamed) {
  const std::vector<FaultEvent> events{{.kind = FaultKind::kSlaveOff, .slave = 3},
                                       {.kind = FaultKind::kDropReply, .count = 0},
                                       {.kind = FaultKind::kDelay},
                                       {.kind = FaultKind::kForeignWrite, .count = 744, .offset = 0x10000}};
  try {
    const FaultPlayer player(bus, events);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(
        error.what(),
        "fault script; event 1: there is no slave 4, but 1 to 3; event 2: it spoils no frame; event "
        "3: there is no delay; event 4: it writes nothing, or more than fits a frame; event 4: there is no "
        "such register");
  }
}

TEST_F(Script, ATimedReplyComesAfterItsWayOnTheWire) {
  wire({}, true);
  BusLink link(*wire_);
  const Bytes frame = HandFrame().add(Command::kBrd, 0, Bytes(1)).bytes();
  std::array<std::uint8_t, 1514> buffer;
  EXPECT_TRUE(link.send(frame));
  EXPECT_EQ(link.receive(buffer, 0ns), 0U);
  EXPECT_EQ(wire_->now(), 0ns);
  EXPECT_EQ(link.receive(buffer, 1ms), 60U);
  // 60 bytes, preamble, check sequence and gap at 80 ns each; three slaves there and back.
  EXPECT_EQ(wire_->now(), 84 * 80ns + 6 * 450ns);
  EXPECT_EQ(link.receive(buffer, 1ms), 0U) << "nothing more: the timeout is waited out";
  EXPECT_EQ(wire_->now(), 84 * 80ns + 6 * 450ns + 1ms);
}

TEST_F(Script, TheLinkLetsItsOwnerMoveTime) {
  struct Owner : EmulatedTime {
    explicit Owner(EmulatedWire& wire) : wire_(wire) {}
    void wait(std::chrono::nanoseconds step) noexcept override {
      waited += step;
      wire_.advance(step);
    }
    EmulatedWire& wire_;
    std::chrono::nanoseconds waited{};
  };
  wire({{.kind = FaultKind::kDropReply, .at_frame = 0}});
  Owner owner(*wire_);
  BusLink link(*wire_, &owner);
  const Bytes frame = HandFrame().add(Command::kBrd, 0, Bytes(1)).bytes();
  std::array<std::uint8_t, 1514> buffer;
  link.send(frame);
  EXPECT_EQ(link.receive(buffer, 2ms), 0U);
  link.send(frame);
  EXPECT_EQ(link.receive(buffer, 2ms), 60U);
  EXPECT_EQ(owner.waited, 2ms);
  EXPECT_EQ(bus.now(), 2ms);
}

TEST_F(Script, MoreRepliesThanItHoldsAreDroppedAndCounted) {
  wire({});
  const Bytes frame = HandFrame().add(Command::kBrd, 0, Bytes(1)).bytes();
  for (std::size_t i = 0; i < EmulatedWire::kCapacity + 2; ++i) wire_->send(frame);
  EXPECT_EQ(wire_->dropped(), 2U);
  EXPECT_EQ(receive().size(), EmulatedWire::kCapacity);
}

TEST_F(Script, ACycleDoesNotAllocateOrLock) {
  HandMaster(bus).bring_up(AlState::kOp);
  wire({{.kind = FaultKind::kSlaveOff, .at = 20ms, .duration = 5ms, .slave = 1},
        {.kind = FaultKind::kDuplicate, .at_frame = 3},
        {.kind = FaultKind::kDelay, .at_frame = 4, .delay = 2ms},
        {.kind = FaultKind::kMailboxHung, .at = 10ms, .duration = 3ms, .slave = 0},
        {.kind = FaultKind::kForeignWrite, .at = 12ms, .slave = 0, .offset = 0x0420}});
  BusLink link(*wire_);
  const Bytes frame =
      HandFrame()
          .add(Command::kLrw, kLogical, Bytes(75))
          .add(Command::kApwr, drivers::ethercat::address_of(0, 0x1000), Bytes(32))
          .add(Command::kBwr, drivers::ethercat::address_of(0, reg::kDcReceiveTimes), Bytes(4))
          .add(Command::kApwr, drivers::ethercat::address_of(0, reg::kSiiControl), {0, 1, 8, 0, 0, 0})
          .bytes();
  std::array<std::uint8_t, 1514> buffer;
  std::size_t received = 0;
  {
    support::NoAllocGuard guard;
    for (int i = 0; i < 50; ++i) {
      link.send(frame);
      while (link.receive(buffer, 0ns) > 0) ++received;
      wire_->advance(1ms);
    }
    EXPECT_EQ(guard.violations(), 0);
  }
  EXPECT_EQ(received, 51U);
}

}  // namespace bus_fault_test
}  // namespace sim::bus::test
