#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "drivers/ethercat/bus_scan.h"
#include "drivers/ethercat/diagnostics.h"
#include "drivers/ethercat/registers.h"
#include "sim/bus/bus_link.h"
#include "tests/support/no_alloc_guard.h"

namespace drivers::ethercat {
namespace ethercat_diagnostics_test {

using std::chrono::nanoseconds;
using namespace std::chrono_literals;
using Registers = std::array<std::uint8_t, kErrorRegisterBytes>;
using Lines = std::vector<std::string>;

/// Slave 2 behind slave 1; slave 3 at port 3 of slave 2, slave 4 at its port 1.
std::vector<Slave> slaves() {
  std::vector<Slave> result(4);
  for (std::size_t i = 0; i < result.size(); ++i) {
    result[i].position = static_cast<std::uint16_t>(i + 1);
    result[i].station = static_cast<std::uint16_t>(0x1001 + i);
    result[i].sii.name = "TMCM-1610";
    result[i].parent = static_cast<std::uint16_t>(i);
    result[i].parent_port = 1;
  }
  result[2].parent_port = 3;
  result[3].parent = 2;
  return result;
}

Registers with(std::initializer_list<std::pair<std::uint16_t, std::uint8_t>> counters) {
  Registers registers{};
  for (const auto& [address, value] : counters) registers.at(address - reg::kRxErrorCounters) = value;
  return registers;
}

// ---- round trips ----

// ---- counters ----

TEST(Diagnostics, ReadsEachCounterFromItsRegister) {
  Diagnostics diagnostics(slaves());
  Registers registers{};
  for (std::size_t i = 0; i < registers.size(); ++i) registers[i] = static_cast<std::uint8_t>(i + 1);
  diagnostics.take(1, registers, false);
  const SlaveErrors& errors = diagnostics.errors(1);
  // Beckhoff ESC data sheet, section II: 0x0300 + 2p invalid, + 1 RX error; 0x0308 + p; 0x030C; 0x030D;
  // 0x0310 + p.
  EXPECT_EQ(errors.ports[0], (PortErrors{1, 2, 9, 17}));
  EXPECT_EQ(errors.ports[1], (PortErrors{3, 4, 10, 18}));
  EXPECT_EQ(errors.ports[2], (PortErrors{5, 6, 11, 19}));
  EXPECT_EQ(errors.ports[3], (PortErrors{7, 8, 12, 20}));
  EXPECT_EQ(errors.processing_unit, 13U);
  EXPECT_EQ(errors.pdi, 14U);
  EXPECT_EQ(errors.gaps, 0U);
}

TEST(Diagnostics, AddsUpWhatIsNewAcrossClearingAndPowerCycles) {
  Diagnostics diagnostics(slaves());
  const auto total = [&] { return diagnostics.errors(0).ports[0].invalid_frames; };
  diagnostics.take(0, with({{0x0300, 10}}), false);
  diagnostics.take(0, with({{0x0300, 10}}), false);
  diagnostics.take(0, with({{0x0300, 200}}), false);
  EXPECT_EQ(total(), 200U);
  diagnostics.take(0, with({{0x0300, 210}}), true);  // and cleared
  diagnostics.take(0, with({{0x0300, 4}}), false);
  EXPECT_EQ(total(), 214U);
  EXPECT_EQ(diagnostics.errors(0).gaps, 0U);
  diagnostics.take(0, with({{0x0300, 1}}), false);  // decreased: another party, or a power cycle
  EXPECT_EQ(total(), 215U);
  EXPECT_EQ(diagnostics.errors(0).gaps, 1U);
}

TEST(Diagnostics, ACounterAtItsEndIsALowerBound) {
  Diagnostics diagnostics(slaves());
  for (int i = 0; i < 3; ++i) diagnostics.take(3, with({{0x0300, 255}}), false);
  EXPECT_EQ(diagnostics.errors(3).ports[0].invalid_frames, 255U);
  EXPECT_EQ(diagnostics.findings(),
            (Lines{"slave 4 (TMCM-1610) port 0: at least 255 new CRC errors: check the "
                   "cable from slave 2 (TMCM-1610) port 1"}));
}

// ---- words ----

TEST(Diagnostics, SaysNothingAboutAHealthyBus) {
  Diagnostics diagnostics(slaves());
  for (std::size_t i = 0; i < 4; ++i) diagnostics.take(i, Registers{}, false);
  EXPECT_EQ(diagnostics.findings(), Lines{});
}

TEST(Diagnostics, NamesTheCableOfDamagedFrames) {
  const std::vector<std::tuple<std::size_t, std::uint16_t, std::string>> cases{
      {0, 0x0300, "slave 1 (TMCM-1610) port 0: 12 new CRC errors: check the cable from the master"},
      {1, 0x0300,
       "slave 2 (TMCM-1610) port 0: 12 new CRC errors: check the cable from slave 1 (TMCM-1610) port 1"},
      {2, 0x0300,
       "slave 3 (TMCM-1610) port 0: 12 new CRC errors: check the cable from slave 2 (TMCM-1610) port 3"},
      {1, 0x0302, "slave 2 (TMCM-1610) port 1: 12 new CRC errors: check the cable from slave 4 (TMCM-1610)"},
      {1, 0x0306, "slave 2 (TMCM-1610) port 3: 12 new CRC errors: check the cable from slave 3 (TMCM-1610)"},
      {3, 0x0302, "slave 4 (TMCM-1610) port 1: 12 new CRC errors: check what is plugged in there"},
  };
  for (const auto& [slave, address, line] : cases) {
    Diagnostics diagnostics(slaves());
    diagnostics.take(slave, with({{address, 12}, {static_cast<std::uint16_t>(address + 1), 40}}), false);
    EXPECT_EQ(diagnostics.findings(), Lines{line});
  }
}

TEST(Diagnostics, DistinguishesTheOtherFaults) {
  const std::vector<std::pair<Registers, std::string>> cases{
      {with({{0x0301, 3}}),
       "slave 2 (TMCM-1610) port 0: 3 new symbol errors between frames: check plug and shield of the cable "
       "from "
       "slave 1 (TMCM-1610) port 1"},
      {with({{0x0311, 1}}),
       "slave 2 (TMCM-1610) port 1: 1 new lost link: check the plugs of the cable from slave 4 (TMCM-1610) "
       "and "
       "the power there"},
      {with({{0x0310, 2}}),
       "slave 2 (TMCM-1610) port 0: 2 new lost links: check the plugs of the cable from slave 1 (TMCM-1610) "
       "port 1"},
      {with({{0x0308, 5}}),
       "slave 2 (TMCM-1610) port 0: 5 frames came in already damaged: the fault lies farther along, where "
       "nothing was counted"},
      {with({{0x030C, 1}}),
       "slave 2 (TMCM-1610): 1 frame without sense: does something else than this master send on the line?"},
      {with({{0x030D, 2}}),
       "slave 2 (TMCM-1610): 2 failed accesses by its own processor: the board, not the bus"},
  };
  for (const auto& [registers, line] : cases) {
    Diagnostics diagnostics(slaves());
    diagnostics.take(1, registers, false);
    EXPECT_EQ(diagnostics.findings(), Lines{line});
  }
}

TEST(Diagnostics, BlamesTheFirstCableAndNotThoseBehindIt) {
  Diagnostics diagnostics(slaves());
  diagnostics.take(1, with({{0x0300, 7}, {0x030C, 7}}), false);
  diagnostics.take(2, with({{0x0308, 7}, {0x030C, 7}}), false);  // marked by slave 2
  diagnostics.take(0, with({{0x0309, 7}}), false);               // and so they came back
  ASSERT_EQ(diagnostics.findings().size(), 1U);
  EXPECT_NE(diagnostics.findings()[0].find("slave 2 (TMCM-1610) port 0: 7 new CRC errors"),
            std::string::npos);
}

TEST(Diagnostics, OnlyWhatCameSinceTheMarkIsNew) {
  Diagnostics diagnostics(slaves());
  diagnostics.take(0, with({{0x0300, 255}}), false);
  diagnostics.mark();
  EXPECT_EQ(diagnostics.findings(), Lines{});
  diagnostics.take(0, with({{0x0300, 255}}), true);
  diagnostics.take(0, with({{0x0300, 1}}), false);
  EXPECT_EQ(diagnostics.findings(),
            Lines{"slave 1 (TMCM-1610) port 0: 1 new CRC error: check the cable from the master"});
}

TEST(Diagnostics, SummarisesFramesAndRoundTrips) {
  Diagnostics diagnostics(slaves());
  const FrameCounters counters{.sent = 1000, .received = 997, .lost = 3, .late = 1};
  EXPECT_EQ(Diagnostics::summary(counters, diagnostics.round_trips()),
            "1000 frames sent: 3 lost, 1 late, 0 duplicate, 0 malformed, 0 foreign, 0 not sent");
  for (int i = 0; i < 1000; ++i) diagnostics.round_trips().add(45us);
  EXPECT_EQ(Diagnostics::summary(counters, diagnostics.round_trips()),
            "1000 frames sent: 3 lost, 1 late, 0 duplicate, 0 malformed, 0 foreign, 0 not sent; round trip "
            "45 us at least, "
            "median 45 us, 99.9 % within 45 us, 45 us at most");
}

// ---- datagrams ----

TEST(Diagnostics, AsksOneSlaveInTurnAndReadsThemOnTheWire) {
  Diagnostics diagnostics(slaves());
  for (std::uint16_t turn = 0; turn < 8; ++turn) {
    FrameWriter writer;
    ASSERT_TRUE(diagnostics.add(writer, 1));
    std::vector<std::uint8_t> frame(writer.bytes().begin(), writer.bytes().end());
    FrameReader reader;
    ASSERT_EQ(reader.parse(frame), FrameError::kNone);
    Datagram datagram;
    ASSERT_TRUE(reader.next(datagram));
    EXPECT_EQ(datagram.command, Command::kFprd);
    EXPECT_EQ(datagram.slave(), 0x1001 + turn % 4);
    EXPECT_EQ(datagram.offset(), 0x0300);
    EXPECT_EQ(datagram.data.size(), 20U);
    datagram.data[0] = 3;
    store_le<std::uint16_t>(datagram.counter, turn < 4 ? 1 : 0);  // does not answer later on
    diagnostics.answer(datagram);
  }
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(diagnostics.errors(i).ports[0].invalid_frames, 3U);
}

TEST(Diagnostics, AFullFrameAndAnEmptyBusAreNoProblem) {
  Diagnostics none({});
  FrameWriter writer;
  EXPECT_FALSE(none.add(writer, 0));
  none.answer(Datagram{});
  none.mark();
  EXPECT_EQ(none.findings(), Lines{});

  Diagnostics diagnostics(slaves());
  (void)writer.add(Command::kLrw, 0, 0, writer.free_bytes());
  EXPECT_FALSE(diagnostics.add(writer, 0));
}

TEST(Diagnostics, UpdatingDoesNotAllocateOrLock) {
  Diagnostics diagnostics(slaves());
  FrameWriter writer;
  Registers registers = with({{0x0300, 200}});
  std::array<std::uint8_t, 2> counter{1, 0};
  const support::NoAllocGuard guard;
  for (int i = 0; i < 100; ++i) {
    writer.clear();
    const bool added = diagnostics.add(writer, 0);
    Datagram datagram;
    datagram.command = Command::kFprd;
    datagram.data = registers;
    datagram.counter = counter.data();
    if (added) diagnostics.answer(datagram);
    diagnostics.round_trips().add(45us);
    diagnostics.mark();
  }
  EXPECT_EQ(guard.violations(), 0);
}

/// Against emulated slaves: cables that damage frames, and counters that would end.
class DiagnosticsOnTheBus : public ::testing::Test {
 protected:
  static sim::bus::SlaveDescription description() {
    sim::bus::SlaveDescription slave;
    slave.name = "TMCM-1610";
    return slave;
  }
  DiagnosticsOnTheBus() : wire(make(bus)), link(wire), transceiver(link), access(transceiver, {}) {}
  static sim::bus::EmulatedBus& make(sim::bus::EmulatedBus& bus) {
    for (int i = 0; i < 4; ++i) bus.add(description());
    return bus;
  }
  void look_at_all(Diagnostics& diagnostics) {
    for (std::size_t i = 0; i < diagnostics.size(); ++i) {
      FrameWriter& writer = transceiver.begin();
      ASSERT_TRUE(diagnostics.add(writer, transceiver.index()));
      ASSERT_TRUE(transceiver.exchange(1ms));
      FrameReader answer = transceiver.answer();
      Datagram datagram;
      ASSERT_TRUE(answer.next(datagram));
      diagnostics.answer(datagram);
    }
  }
  void damage(std::size_t cable, std::uint32_t frames) {
    bus.damage(cable, frames);
    for (std::uint32_t i = 0; i < frames; ++i) {
      (void)transceiver.begin().add(Command::kBrd, transceiver.index(), address_of(0, 0), 1);
      EXPECT_FALSE(transceiver.exchange(100us));
    }
  }

  sim::bus::EmulatedBus bus;
  sim::bus::EmulatedWire wire;
  sim::bus::BusLink link;
  Transceiver transceiver;
  RegisterAccess access;
};

TEST_F(DiagnosticsOnTheBus, FindsTheBadCable) {
  Diagnostics diagnostics(scan_bus(access, "emulated"));
  (void)access.broadcast_write(reg::kRxErrorCounters, Registers{});
  look_at_all(diagnostics);
  diagnostics.mark();
  damage(3, 12);
  look_at_all(diagnostics);
  EXPECT_EQ(diagnostics.findings(),
            Lines{"slave 4 (TMCM-1610) port 0: 12 new CRC errors: check the cable from "
                  "slave 3 (TMCM-1610) port 1"});
}

TEST_F(DiagnosticsOnTheBus, CountsPastTheEndOfTheCountersByClearingThem) {
  Diagnostics diagnostics(scan_bus(access, "emulated"));
  (void)access.broadcast_write(reg::kRxErrorCounters, Registers{});
  for (int i = 0; i < 20; ++i) {
    damage(1, 60);
    look_at_all(diagnostics);
  }
  EXPECT_EQ(diagnostics.errors(1).ports[0].invalid_frames, 1200U);
  EXPECT_EQ(diagnostics.errors(1).gaps, 0U);
}

}  // namespace ethercat_diagnostics_test
}  // namespace drivers::ethercat
