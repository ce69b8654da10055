// The scan against an emulated youBot: 11 slaves in a line.
#include "drivers/ethercat/bus_scan.h"

#include <gtest/gtest.h>

#include "tests/drivers/ethercat_fakes.h"

namespace drivers::ethercat::test {
namespace ethercat_bus_scan_test {

class Scan : public ::testing::Test {
 protected:
  std::vector<Slave> scan(EmulatedRobot& robot, sim::bus::WireOptions options = {}) {
    Transceiver transceiver(robot.connect(std::move(options)));
    RegisterAccess access(transceiver, {.frame_timeout = 2ms});
    return scan_bus(access, "eth7");
  }
  std::string check(std::vector<SlaveDescription> slaves) {
    EmulatedRobot robot(slaves);
    const std::vector<Slave> found = scan(robot);
    return error_of([&] { check_topology(found, expected_youbot(), "eth7"); });
  }
};

TEST_F(Scan, FindsTheYoubotsSlavesByName) {
  EmulatedRobot robot(youbot());
  const std::vector<Slave> slaves = scan(robot);
  ASSERT_EQ(slaves.size(), 11U);
  for (std::size_t i = 0; i < 11; ++i) {
    EXPECT_EQ(slaves[i].sii.name, youbot()[i].name);
    EXPECT_EQ(slaves[i].position, i + 1);
    EXPECT_EQ(slaves[i].station, 0x1001 + i);
    EXPECT_EQ(slaves[i].parent, i) << "a line: behind the one before, the first behind the master";
    EXPECT_EQ(slaves[i].parent_port, i == 0 ? 0 : 1);
    EXPECT_EQ(slaves[i].mailbox_fits, youbot()[i].mailbox_in.length > 0);
  }
  EXPECT_EQ(slaves[2].label(), "slave 3 (TMCM-1632)");
  EXPECT_EQ(slaves[6].sii.product, 0x12U);
  check_topology(slaves, expected_youbot(), "eth7");
}

TEST_F(Scan, LaysTheImageOutSlaveBySlave) {
  EmulatedRobot robot(youbot());
  const std::vector<Slave> slaves = scan(robot);
  std::uint32_t offset = 0;
  for (const Slave& slave : slaves) {
    const bool drives = slave.sii.has_mailbox();
    EXPECT_EQ(slave.outputs.bytes, drives ? kOutputBytes : 0);
    EXPECT_EQ(slave.inputs.bytes, drives ? kInputBytes : 0);
    EXPECT_EQ(slave.outputs.image_offset, offset);
    EXPECT_EQ(slave.inputs.image_offset, offset + slave.outputs.bytes);
    offset += std::uint32_t{slave.outputs.bytes} + slave.inputs.bytes;
  }
  EXPECT_EQ(image_bytes(slaves), 9U * 25);
  EXPECT_EQ(slaves[1].outputs.sync_manager, 2);
  EXPECT_EQ(slaves[1].inputs.sync_manager, 3);
  EXPECT_EQ(slaves[1].outputs.control, 0x64);
}

TEST_F(Scan, PdosOfOddBitsAreRoundedUpToBytes) {
  SlaveDescription odd = drive("odd");
  odd.inputs.entries = {{.index = 0x6000, .subindex = 1, .bits = 3},
                        {.index = 0x6000, .subindex = 2, .bits = 6}};
  odd.inputs.bytes = 2;
  EmulatedRobot robot({odd});
  EXPECT_EQ(scan(robot)[0].inputs.bytes, 2);
}

TEST_F(Scan, BringUpKeepsTheWireBusyLessThan100ms) {
  // A 16 Kbit EEPROM at 400 kHz: 3 bytes of address and 8 of data, 9 bits each, are 250 us.
  for (const bool eight : {true, false}) {
    EmulatedRobot robot(youbot(), {.sii = {.reads_8_bytes = eight, .read_time = eight ? 250us : 160us},
                                   .state_change_time = 1ms});
    Link& link = robot.connect({.timed = true});
    // Emulated time runs faster or slower than ours: only that of the wire counts here.
    PreOpBus::Options options;
    options.access.frame_timeout = 1s;
    options.cyclic.frame_timeout = 1s;
    PreOpBus setup(link, nullptr, options);
    const auto scanned = robot.wire->now();
    setup.enter_pre_op();
    const OpBus bus = std::move(setup).start();
    EXPECT_LT(robot.wire->now(), 100ms) << "scan " << scanned.count() / 1000 << " us";
    EXPECT_GT(robot.wire->now(), 5ms) << "no time passes: this test shows nothing";
    for (std::size_t i = 0; i < 11; ++i) EXPECT_EQ(robot.state(i), AlState::kOp);
  }
}

TEST_F(Scan, SlowAndNarrowEepromsAreReadTheSame) {
  EmulatedRobot robot(youbot(), {.sii = {.reads_8_bytes = false, .read_time = 700us}});
  const std::vector<Slave> slaves = scan(robot, {.timed = true});
  check_topology(slaves, expected_youbot(), "eth7");
  EXPECT_EQ(slaves[10].sii.input_pdos.size(), 1U);
}

TEST_F(Scan, SurvivesSingleLostFrames) {
  EmulatedRobot robot(youbot());
  sim::bus::WireOptions options;
  for (const std::uint64_t frame : {0, 3, 7, 20, 21, 40})
    options.faults.push_back(
        {.kind = frame % 2 == 0 ? FaultKind::kDropRequest : FaultKind::kDropReply, .at_frame = frame});
  const std::vector<Slave> slaves = scan(robot, options);
  check_topology(slaves, expected_youbot(), "eth7");
  EXPECT_TRUE(robot.wire->faults().finished());
}

TEST_F(Scan, ABusWithoutPowerSaysSo) {
  EmulatedRobot robot(youbot());
  robot.bus.set_power(0, false);
  EXPECT_EQ(
      error_of([&] { scan(robot); }),
      "emulated bus: exchange frames: no frame comes back (10 tries); is the cable in, and the first device "
      "powered?");
}

TEST_F(Scan, AnInterfaceThatReturnsFramesUntouchedHasNoSlaves) {
  ScriptedLink link;
  link.respond = [&](const Bytes& frame) { link.incoming.push_back(frame); };
  Transceiver transceiver(link);
  RegisterAccess access(transceiver, {});
  EXPECT_EQ(error_of([&] { scan_bus(access, "eth7"); }),
            "eth7: count slaves: frames come back, but no EtherCAT slave touched them; is the other end the "
            "robot's "
            "EtherCAT socket, and no switch or looped cable?");
}

TEST_F(Scan, ASpoiledWorkingCounterIsNoBusOfThousandsOfSlaves) {
  for (const std::uint16_t counter : {std::uint16_t{257}, std::uint16_t{0xFFFF}}) {
    EmulatedRobot robot(youbot());
    MeddlingLink link(robot.connect({.timed = true}));
    link.on_receive = [counter](std::span<std::uint8_t> frame) {
      if (const auto count =
              find_datagram(frame, [](const Datagram& d) { return d.command == Command::kBrd; }))
        store_le(count->counter, counter);
      return true;
    };
    Transceiver transceiver(link);
    RegisterAccess access(transceiver, {});
    EXPECT_TRUE(contains(error_of([&] { scan_bus(access, "eth7"); }),
                         "eth7: count slaves: the reply's working counter says " + std::to_string(counter) +
                             ", more than the 256"));
    EXPECT_EQ(link.frames, 1);
  }
}

TEST_F(Scan, AnEepromThatStaysBusyEndsTheScan) {
  EmulatedRobot robot({drive("busy")});
  MeddlingLink link(robot.connect({.timed = true}));
  link.on_receive = [](std::span<std::uint8_t> frame) {
    const auto is_poll = [](const Datagram& d) { return d.command == Command::kFprd && d.data.size() == 14; };
    if (const auto poll = find_datagram(frame, is_poll)) poll->data[1] |= reg::kSiiBusy >> 8;
    return true;
  };
  Transceiver transceiver(link);
  RegisterAccess access(transceiver, {});
  EXPECT_TRUE(contains(error_of([&] { scan_bus(access, "eth7"); }), "read its SII EEPROM: it stays busy"));
  EXPECT_NEAR(link.frames, 2 * 20'000, 10) << "20,000 rounds of a request and a poll";
}

TEST_F(Scan, AnEepromThatFailsOrASlaveThatIsSilentEndsTheScanAfter500Times) {
  for (const bool silent : {false, true}) {
    EmulatedRobot robot({drive("faulty")});
    MeddlingLink link(robot.connect({.timed = true}));
    int polls = 0;
    link.on_receive = [&](std::span<std::uint8_t> frame) {
      const auto is_poll = [](const Datagram& d) {
        return (d.command == Command::kFprd && d.data.size() == 14) ||
               (d.command == Command::kFpwr && d.data.size() == 6);
      };
      const auto poll = find_datagram(frame, is_poll);
      if (!poll) return true;
      if (silent) {
        ++polls;
        store_le(poll->counter, std::uint16_t{0});
      } else if (poll->data.size() == 14) {
        ++polls;
        poll->data[1] |= 0x20;  // no acknowledgement by the EEPROM
      }
      return true;
    };
    Transceiver transceiver(link);
    RegisterAccess access(transceiver, {});
    EXPECT_TRUE(contains(error_of([&] { scan_bus(access, "eth7"); }),
                         silent ? "it does not answer any more" : "the EEPROM does not acknowledge"));
    EXPECT_EQ(polls, silent ? 501 : 251) << "each error is cleared, which counts too";
  }
}

// ---- EEPROMs ----

TEST_F(Scan, ASlaveThatForgetsItsStationWhileItsEepromIsReadIsNamedSoon) {
  EmulatedRobot robot(youbot());
  MeddlingLink link(robot.connect({.timed = true}));
  link.on_send = [&](Bytes&) {
    if (link.frames == 20) {
      robot.bus.slave(5).set_power(false);  // too short for the frames to notice
      robot.bus.slave(5).set_power(true);
      robot.bus.set_cable(5, false);
      robot.bus.set_cable(5, true);
    }
    return false;
  };
  Transceiver transceiver(link);
  RegisterAccess access(transceiver, {});
  EXPECT_TRUE(contains(error_of([&] { scan_bus(access, "eth7"); }),
                       "slave 6 (no name): read its SII EEPROM: it does not answer any more"));
  EXPECT_LT(link.frames, 3000);
}

TEST_F(Scan, ABlankEepromIsAnErrorThatNamesTheSlave) {
  EmulatedRobot robot(youbot());
  std::ranges::fill(robot.bus.slave(4).controller().sii().image(), std::uint8_t{0xFF});
  robot.bus.slave(4).controller().sii().reset();
  const std::string error = error_of([&] { scan(robot); });
  EXPECT_TRUE(contains(error, "slave 5"));
  EXPECT_TRUE(contains(error, "is the EEPROM programmed?"));
}

TEST_F(Scan, AChangedConfigurationIsAWrongChecksum) {
  EmulatedRobot robot(youbot());
  robot.bus.slave(1).controller().sii().image()[0] ^= 0x55;
  robot.bus.slave(1).controller().sii().reset();
  EXPECT_EQ(error_of([&] { scan(robot); }),
            "slave 2 (no name): read its SII EEPROM: its checksum is wrong; is the EEPROM programmed?");
}

TEST_F(Scan, AGarbledCategoryChainIsAnError) {
  EmulatedRobot robot(youbot());
  store_le<std::uint16_t>(&robot.bus.slave(9).controller().sii().image()[2 * 0x41], 0x2000);
  const std::string error = error_of([&] { scan(robot); });
  EXPECT_TRUE(
      contains(error, "slave 10 (no name): read its SII EEPROM: the category chain is not plausible"));
}

TEST_F(Scan, AnErrorThatAPreviousMasterLeftInTheSiiInterfaceIsCleared) {
  EmulatedRobot robot(youbot());
  // Command 5 does not exist: the interface refuses reads until the error is cleared.
  robot.bus.slave(3).controller().sii().write(reg::kSiiControl - reg::kSiiConfiguration,
                                              std::array<std::uint8_t, 2>{0x00, 0x05});
  EXPECT_EQ(error_of([&] { check_topology(scan(robot), expected_youbot(), "eth7"); }), "");
}

TEST_F(Scan, AnEepromThatTheFirmwareHoldsIsTakenBack) {
  EmulatedRobot robot(youbot());
  robot.bus.slave(3).controller().sii().write(0, std::array<std::uint8_t, 1>{1});
  EXPECT_EQ(error_of([&] { check_topology(scan(robot), expected_youbot(), "eth7"); }), "");
}

// ---- topology ----

TEST_F(Scan, ASlaveMayBeCalledByItsFirstStringAsSoemDoes) {
  EmulatedRobot robot(youbot());
  std::vector<Slave> slaves = scan(robot);
  slaves[2].sii.name = "Single-axis controller";
  EXPECT_EQ(error_of([&] { check_topology(slaves, expected_youbot(), "eth7"); }), "");
  slaves[2].sii.first_string = "EL1008";
  EXPECT_TRUE(contains(error_of([&] { check_topology(slaves, expected_youbot(), "eth7"); }),
                       "found 'Single-axis controller'"));
}

TEST_F(Scan, AMissingTailNamesTheSlaveAndPortBeforeIt) {
  std::vector<SlaveDescription> slaves = youbot();
  slaves.resize(5);
  EXPECT_EQ(
      check(slaves),
      "slave 6, arm power board: check the bus: missing: expected 'KR-843', but the bus ends after 5 of 11 "
      "slaves; check the cable from slave 5 (TMCM-1632), port 1 and the power of what follows");
}

TEST_F(Scan, AMissingSlaveInTheMiddleNamesTheOneBeforeIt) {
  std::vector<SlaveDescription> slaves = youbot();
  slaves.erase(slaves.begin() + 5);
  EXPECT_EQ(check(slaves),
            "slave 6, arm power board: check the bus: expected 'KR-843', found 'TMCM-1610' behind slave 5 "
            "(TMCM-1632), port 1; is a slave before it missing, or the cabling changed?");
}

TEST_F(Scan, AMissingFirstSlaveIsReportedToo) {
  std::vector<SlaveDescription> slaves = youbot();
  slaves.erase(slaves.begin());
  EXPECT_TRUE(contains(check(slaves),
                       "slave 1, base power board: check the bus: expected 'KR-845', found 'TMCM-1632';"));
}

TEST_F(Scan, AnEmptyListNamesTheInterface) {
  EXPECT_TRUE(
      contains(error_of([] { check_topology({}, expected_youbot(), "eth7"); }), "check the cable from eth7"));
}

TEST_F(Scan, AWrongNameNamesAllThatWouldDo) {
  std::vector<SlaveDescription> slaves = youbot();
  slaves[2].name = "EL1008";
  EXPECT_TRUE(contains(check(slaves),
                       "slave 3, wheel 2: check the bus: expected 'TMCM-174' or 'TMCM-1632', found "
                       "'EL1008' behind slave 2 (TMCM-1632), port 1"));
}

TEST_F(Scan, NamesAreComparedExactly) {
  std::vector<SlaveDescription> slaves = youbot();
  slaves[2].name = "TMCM-16320";
  EXPECT_TRUE(contains(check(slaves), "found 'TMCM-16320'"));
}

TEST_F(Scan, TwoSwappedSlavesAreReportedAtTheFirst) {
  std::vector<SlaveDescription> slaves = youbot();
  std::swap(slaves[0], slaves[5]);
  EXPECT_TRUE(
      contains(check(slaves), "slave 1, base power board: check the bus: expected 'KR-845', found 'KR-843'"));
}

TEST_F(Scan, AnExtraSlaveIsNotSilentlyIgnored) {
  std::vector<SlaveDescription> slaves = youbot();
  slaves.push_back(power_board("KR-843"));
  EXPECT_EQ(check(slaves), "slave 12 (KR-843): check the bus: not expected: the robot ends after 11 slaves");
}

TEST_F(Scan, BranchesAreFollowedThroughPort3Then1Then2) {
  // A slave with ports 1, 2 and 3 in use, three more on it, the one at port 3 with one behind: the frame
  // visits 1, 2 (port 3), 3 (behind 2), 4 (port 1), 5 (port 2).
  const std::array<std::uint16_t, 5> dl_status{0xAA00 | 0x00F0, 0x0A00, 0x0200, 0x0200, 0x0200};
  ScriptedLink link;
  std::array<std::uint16_t, 5> station{};
  std::array<std::uint32_t, 5> next_sii{};
  link.respond = [&](const Bytes& sent) {
    Bytes frame = sent;
    (void)find_datagram(frame, [&](const Datagram& datagram) {
      const auto count = [&](std::uint16_t n) { store_le(datagram.counter, n); };
      if (datagram.command == Command::kBrd || datagram.command == Command::kBwr) {
        count(5);
        return false;
      }
      if (datagram.command == Command::kApwr) {
        station[static_cast<std::uint16_t>(-datagram.slave())] = load_le<std::uint16_t>(datagram.data.data());
        count(1);
      }
      const auto i = static_cast<std::size_t>(std::find(station.begin(), station.end(), datagram.slave()) -
                                              station.begin());
      if (i == station.size() || datagram.command == Command::kApwr) return false;
      count(1);
      if (datagram.offset() == reg::kDlStatus) store_le(datagram.data.data(), dl_status[i]);
      // SII: never busy, always the end marker but for a vendor.
      if (datagram.command == Command::kFprd && datagram.offset() == reg::kSiiControl) {
        store_le<std::uint16_t>(datagram.data.data(), 0);
        store_le<std::uint32_t>(datagram.data.data() + 6, next_sii[i]);
      }
      if (datagram.command == Command::kFpwr && datagram.offset() == reg::kSiiControl)
        next_sii[i] = load_le<std::uint32_t>(datagram.data.data() + 2) < 0x40 ? 0 : 0xFFFF'FFFF;
      return false;
    });
    link.incoming.push_back(frame);
  };
  Transceiver transceiver(link);
  RegisterAccess access(transceiver, {});
  const std::vector<Slave> slaves = scan_bus(access, "eth7");
  ASSERT_EQ(slaves.size(), 5U);
  EXPECT_EQ(slaves[1].parent, 1);
  EXPECT_EQ(slaves[1].parent_port, 3);
  EXPECT_EQ(slaves[2].parent, 2);
  EXPECT_EQ(slaves[2].parent_port, 1);
  EXPECT_EQ(slaves[3].parent, 1);
  EXPECT_EQ(slaves[3].parent_port, 1);
  EXPECT_EQ(slaves[4].parent, 1);
  EXPECT_EQ(slaves[4].parent_port, 2);
}

}  // namespace ethercat_bus_scan_test
}  // namespace drivers::ethercat::test
