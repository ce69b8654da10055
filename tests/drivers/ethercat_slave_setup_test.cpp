// State changes of single emulated slaves, quick and slow ones.
#include "drivers/ethercat/slave_setup.h"

#include <gtest/gtest.h>

#include "tests/drivers/ethercat_fakes.h"

namespace drivers::ethercat::test {
namespace ethercat_slave_setup_test {

// Runs steps in emulated time: a frame each 100 us.
class Setup : public ::testing::Test {
 protected:
  void make(const SlaveDescription& description, const SlaveOptions& options = {}) {
    robot.emplace(std::vector{description}, options);
    transceiver.emplace(robot->connect({.timed = true}));
    RegisterAccess access(*transceiver, {});
    slave = scan_bus(access, "eth7")[0];
  }
  SlaveSetup::Status run(const std::vector<SetupStep>& steps, std::chrono::nanoseconds timeout = 50ms) {
    steps_ = steps;
    setup.begin(slave.station, steps_, timeout);
    for (int i = 0; i < 10'000 && setup.status() == SlaveSetup::Status::kRunning; ++i) frame();
    return setup.status();
  }
  void frame() {
    FrameWriter& writer = transceiver->begin();
    const bool asked = setup.request(writer, transceiver->index(), robot->wire->now());
    if (asked) {
      const std::span<const std::uint8_t> bytes = writer.bytes();
      const auto command = static_cast<Command>(bytes[16]);
      if (command == Command::kFpwr && load_le<std::uint16_t>(&bytes[20]) == reg::kAlControl)
        requests.push_back(bytes[26]);
    }
    if (asked && transceiver->exchange(50us)) {
      FrameReader answer = transceiver->answer();
      Datagram datagram;
      ASSERT_TRUE(answer.next(datagram));
      setup.answer(datagram, robot->wire->now());
    }
    robot->wire->advance(100us);
  }
  EmulatedSlave& emulated() { return robot->bus.slave(0); }
  static std::vector<SetupStep> only(AlState state) {
    SetupStep step;
    step.state = state;
    return {step};
  }

  std::optional<EmulatedRobot> robot;
  std::optional<Transceiver> transceiver;
  Slave slave;
  SlaveSetup setup;
  Bytes requests;  // values written to AL control
  std::vector<SetupStep> steps_;
};

TEST_F(Setup, TheStepsTakeASlaveToOp) {
  make(drive("TMCM-1610"));
  EXPECT_EQ(run(steps_to_pre_op(slave)), SlaveSetup::Status::kDone);
  EXPECT_EQ(robot->state(0), AlState::kPreOp);
  EXPECT_EQ(run(steps_to_safe_op(slave)), SlaveSetup::Status::kDone);
  EXPECT_EQ(robot->state(0), AlState::kSafeOp);
  // OP waits for outputs, which are never sent here.
  setup.begin(slave.station, {}, 1ms);
  EXPECT_EQ(setup.status(), SlaveSetup::Status::kDone) << "no steps: nothing to do";
}

TEST_F(Setup, SyncManagersAndFmmusAreTheSiisBytes) {
  make(drive("TMCM-1610"));
  const std::vector<SetupStep> pre_op = steps_to_pre_op(slave);
  ASSERT_EQ(pre_op.size(), 4U);
  EXPECT_EQ(pre_op[0].state, AlState::kInit);
  EXPECT_EQ(pre_op[1].address, 0x0800);
  EXPECT_EQ(Bytes(pre_op[1].data.begin(), pre_op[1].data.begin() + 8),
            (Bytes{0x00, 0x10, 32, 0, 0x26, 0, 1, 0}));
  EXPECT_EQ(pre_op[2].address, 0x0808);
  EXPECT_EQ(Bytes(pre_op[2].data.begin(), pre_op[2].data.begin() + 8),
            (Bytes{0x40, 0x10, 32, 0, 0x22, 0, 1, 0}));
  EXPECT_EQ(pre_op[3].state, AlState::kPreOp);

  const std::vector<SetupStep> safe_op = steps_to_safe_op(slave);
  ASSERT_EQ(safe_op.size(), 7U);
  EXPECT_EQ(safe_op[0].address, 0x0810);
  EXPECT_EQ(Bytes(safe_op[0].data.begin(), safe_op[0].data.begin() + 8),
            (Bytes{0x00, 0x11, 5, 0, 0x64, 0, 1, 0}));
  EXPECT_EQ(safe_op[1].address, 0x0600);
  EXPECT_EQ(Bytes(safe_op[1].data.begin(), safe_op[1].data.end()),
            (Bytes{0, 0, 0, 0, 5, 0, 0, 7, 0x00, 0x11, 0, 2, 1, 0, 0, 0}))
      << "outputs: the master writes";
  EXPECT_EQ(safe_op[3].address, 0x0610);
  EXPECT_EQ(Bytes(safe_op[3].data.begin(), safe_op[3].data.end()),
            (Bytes{5, 0, 0, 0, 20, 0, 0, 7, 0x80, 0x11, 0, 1, 1, 0, 0, 0}))
      << "inputs: the master reads";
  EXPECT_EQ(safe_op[4].address, 0x0400);
  EXPECT_EQ(Bytes(safe_op[4].data.begin(), safe_op[4].data.begin() + safe_op[4].length), (Bytes{0xC2, 0x09}))
      << "2498 + 2 times 40 ns";
  EXPECT_EQ(safe_op[5].address, 0x0420);
  EXPECT_EQ(Bytes(safe_op[5].data.begin(), safe_op[5].data.begin() + safe_op[5].length), (Bytes{0xE8, 0x03}))
      << "1000 times that";
  EXPECT_EQ(safe_op[6].state, AlState::kSafeOp) << "after the FMMUs";
}

TEST_F(Setup, APowerBoardNeedsNothingButStates) {
  make(power_board("KR-845"));
  EXPECT_EQ(steps_to_pre_op(slave).size(), 2U);
  EXPECT_EQ(steps_to_safe_op(slave).size(), 1U);
  EXPECT_EQ(run(steps_to_pre_op(slave)), SlaveSetup::Status::kDone);
  EXPECT_EQ(run(steps_to_safe_op(slave)), SlaveSetup::Status::kDone);
  EXPECT_EQ(run(steps_to_op()), SlaveSetup::Status::kDone);
  EXPECT_EQ(robot->state(0), AlState::kOp);
}

TEST_F(Setup, ARefusalSaysStatesCodeInWordsRegisterAndTime) {
  make(drive("TMCM-1610"), {.state_change_time = 5ms});
  ASSERT_EQ(run(steps_to_pre_op(slave)), SlaveSetup::Status::kDone);
  std::vector<SetupStep> steps = steps_to_safe_op(slave);
  store_le<std::uint16_t>(&steps[2].data[2], 19);  // inputs of 19 bytes
  ASSERT_EQ(run(steps), SlaveSetup::Status::kFailed);
  const std::string failure = setup.failure();
  EXPECT_TRUE(contains(failure,
                       "SAFE-OP refused: it is in PRE-OP with error, AL status code (register 0x0134) "
                       "0x001E invalid input configuration, after "));
  EXPECT_FALSE(setup.is_another_device());
  // Asked, acknowledged, asked again: three looks of 5 ms, each met by a frame every 100 us.
  const int milliseconds = std::stoi(failure.substr(failure.find("after ") + 6));
  EXPECT_GE(milliseconds, 15);
  EXPECT_LE(milliseconds, 17);
}

TEST_F(Setup, AnErrorFromBeforeIsAcknowledgedAndTheStateReached) {
  make(drive("TMCM-1610"));
  ASSERT_EQ(run(steps_to_pre_op(slave)), SlaveSetup::Status::kDone);
  emulated().report_error(AlState::kInit, 0x0020);
  requests.clear();
  ASSERT_EQ(run(steps_to_pre_op(slave)), SlaveSetup::Status::kDone) << setup.failure();
  EXPECT_EQ(robot->state(0), AlState::kPreOp);
  EXPECT_EQ(requests, (Bytes{0x01, 0x11, 0x02})) << "INIT asked for, its error acknowledged, then PRE-OP";
}

TEST_F(Setup, ASlowSlavesOldErrorIsNoRefusal) {
  make(drive("TMCM-1610"), {.state_change_time = 7ms});
  emulated().report_error(AlState::kInit, 0x0020);
  ASSERT_EQ(run(steps_to_pre_op(slave)), SlaveSetup::Status::kDone) << setup.failure();
  EXPECT_EQ(robot->state(0), AlState::kPreOp);
}

TEST_F(Setup, ARequestThatTheControllerDroppedIsMadeAgain) {
  make(drive("TMCM-1610"), {.state_change_time = 3ms});
  // A request of another master that the firmware has not read: until then AL control takes no other.
  transceiver->begin()
      .add(Command::kFpwr, transceiver->index(), address_of(slave.station, reg::kAlControl), 2)
      .data[0] = 1;
  ASSERT_TRUE(transceiver->exchange(1ms));
  EXPECT_EQ(run(only(AlState::kPreOp)), SlaveSetup::Status::kFailed) << "no mailbox configured: refused";
  EXPECT_TRUE(contains(setup.failure(), "0x0016 invalid mailbox configuration"));
}

TEST_F(Setup, ASlowChangeIsAskedForOnceAndWaitedFor) {
  make(power_board("KR-845"), {.state_change_time = 20ms});
  EXPECT_EQ(run(only(AlState::kPreOp)), SlaveSetup::Status::kDone);
  EXPECT_EQ(requests, (Bytes{0x02}));
}

TEST_F(Setup, AfterAnAcknowledgedErrorASlowChangeIsAskedForOnce) {
  make(power_board("KR-845"), {.state_change_time = 10ms});
  emulated().report_error(AlState::kInit, 0x0020);
  ASSERT_EQ(run(only(AlState::kPreOp), 500ms), SlaveSetup::Status::kDone);
  EXPECT_EQ(std::count(requests.begin(), requests.end(), 0x02), 2) << "before and after the acknowledgement";
  // Written in every second frame until the first request is taken after 10 ms, then waited for.
  EXPECT_LE(std::count(requests.begin(), requests.end(), 0x11), 50);
}

TEST_F(Setup, ASlaveThatNeverAnswersTimesOutAndSaysWhatWasAsked) {
  make(drive("TMCM-1610"));
  robot->bus.set_power(0, false);
  ASSERT_EQ(run(steps_to_pre_op(slave), 50ms), SlaveSetup::Status::kFailed);
  // The time is checked once per frame, and a frame comes every 150 us.
  EXPECT_EQ(setup.failure(), "INIT requested (register 0x0120): no answer for 50 ms");
  SetupStep write;
  write.address = 0x0810;
  write.length = 8;
  ASSERT_EQ(run({write}, 20ms), SlaveSetup::Status::kFailed);
  EXPECT_EQ(setup.failure(), "write to register 0x0810: no answer for 20 ms");
}

TEST_F(Setup, ASlaveThatGoesOnWaitingTimesOutInItsState) {
  make(drive("TMCM-1610"), {.state_change_time = 1s});
  ASSERT_EQ(run(only(AlState::kPreOp), 30ms), SlaveSetup::Status::kFailed);
  EXPECT_EQ(setup.failure(),
            "PRE-OP refused: it is in INIT, AL status code (register 0x0134) 0x0000 no error, after 30 ms");
}

TEST_F(Setup, LostFramesAreMadeUpFor) {
  make(drive("TMCM-1610"));
  sim::bus::WireOptions options;
  for (std::uint64_t frame = 0; frame < 30; frame += 3)
    options.faults.push_back(
        {.kind = frame % 2 == 0 ? FaultKind::kDropRequest : FaultKind::kDropReply, .at_frame = frame});
  transceiver.emplace(robot->connect(options));
  EXPECT_EQ(run(steps_to_pre_op(slave)), SlaveSetup::Status::kDone) << setup.failure();
  EXPECT_EQ(run(steps_to_safe_op(slave)), SlaveSetup::Status::kDone) << setup.failure();
  EXPECT_EQ(robot->state(0), AlState::kSafeOp);
}

// ---- identity ----

TEST_F(Setup, TheRightDeviceIsRecognized) {
  for (const bool eight : {true, false}) {
    make(drive("TMCM-1610"), {.sii = {.reads_8_bytes = eight, .read_time = 1ms}});
    EXPECT_EQ(run(steps_to_identify(slave)), SlaveSetup::Status::kDone);
    EXPECT_FALSE(setup.is_another_device());
  }
}

TEST_F(Setup, AnotherProductOrVendorIsNamed) {
  make(drive("TMCM-1610"));
  Slave other = slave;
  other.sii.product = 0x99;
  EXPECT_EQ(run(steps_to_identify(other)), SlaveSetup::Status::kFailed);
  EXPECT_TRUE(setup.is_another_device());
  EXPECT_EQ(setup.failure(),
            "another device is there: product (SII word 0x000A) is 0x00000011, not 0x00000099");
  other = slave;
  other.sii.vendor = 2;
  EXPECT_EQ(run(steps_to_identify(other)), SlaveSetup::Status::kFailed);
  EXPECT_EQ(setup.failure(),
            "another device is there: vendor (SII word 0x0008) is 0x00000286, not 0x00000002");
  EXPECT_EQ(run(only(AlState::kInit)), SlaveSetup::Status::kDone);
  EXPECT_FALSE(setup.is_another_device()) << "of an earlier run";
}

TEST_F(Setup, AnErrorInTheSiiInterfaceIsClearedFirst) {
  make(drive("TMCM-1610"));
  emulated().controller().sii().write(reg::kSiiControl - reg::kSiiConfiguration,
                                      std::array<std::uint8_t, 2>{0x00, 0x05});
  EXPECT_EQ(run(steps_to_identify(slave)), SlaveSetup::Status::kDone) << setup.failure();
}

TEST_F(Setup, AnEepromThatStaysBusyOrFaultyTimesOut) {
  make(drive("TMCM-1610"));
  emulated().controller().sii().image()[0] ^= 0x55;  // the checksum is wrong
  robot->bus.set_power(0, false);
  robot->bus.set_power(0, true);
  transceiver->begin().add(Command::kApwr, transceiver->index(), address_of(0, reg::kStationAddress), 2);
  Slave unaddressed = slave;
  unaddressed.station = 0;
  slave.station = 0;
  EXPECT_EQ(run(steps_to_identify(unaddressed)), SlaveSetup::Status::kFailed);
  EXPECT_FALSE(setup.is_another_device());
  EXPECT_EQ(setup.failure(), "SII word 0x0008 (register 0x0502): busy or faulty for 50 ms");
}

}  // namespace ethercat_slave_setup_test
}  // namespace drivers::ethercat::test
