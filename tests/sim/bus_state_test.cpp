// The state machine, its refusals and the process data watchdog.
#include <gtest/gtest.h>

#include "tests/sim/bus_hand_master.h"

namespace sim::bus::test {
namespace bus_state_test {

class States : public ::testing::Test {
 protected:
  // AL status after asking for it, then the code.
  void expect(std::uint16_t control, std::uint16_t status, std::uint16_t code, const std::string& why = "") {
    EXPECT_EQ(master.request(0, control), status) << "control " << control << " " << why;
    EXPECT_EQ(master.al_code(0), code) << "control " << control << " " << why;
  }
  EmulatedBus bus;
  EmulatedSlave& slave = bus.add(drive());
  RecordingBoard board{slave};
  HandMaster master{bus};
};

TEST_F(States, UpToOpAndDownAgain) {
  master.bring_up(AlState::kOp);
  EXPECT_EQ(master.al_status(0), 0x0008);
  expect(0x0004, 0x0004, 0);
  expect(0x0002, 0x0002, 0);
  expect(0x0001, 0x0001, 0);
  EXPECT_EQ(board.states, (std::vector{AlState::kPreOp, AlState::kSafeOp, AlState::kOp, AlState::kSafeOp,
                                       AlState::kPreOp, AlState::kInit}));
}

TEST_F(States, DownToInitFromOp) {
  master.bring_up(AlState::kOp);
  expect(0x0001, 0x0001, 0);
}

TEST_F(States, SkippingAStateIsRefused) {
  master.configure();
  expect(0x0004, 0x0011, 0x0011);
  expect(0x0011, 0x0001, 0x0000);
  expect(0x0008, 0x0011, 0x0011);
}

TEST_F(States, UnknownStateAndBootstrapAreRefused) {
  master.configure();
  expect(0x0005, 0x0011, 0x0012);
  expect(0x0011, 0x0001, 0x0000);
  expect(0x0003, 0x0011, 0x0013);
  expect(0x0012, 0x0002, 0x0000);
  expect(0x0003, 0x0012, 0x0011, "only from INIT");
}

TEST_F(States, AnErrorWaitsForItsAcknowledgeUnlessItGoesDown) {
  master.bring_up(AlState::kPreOp);
  expect(0x0008, 0x0012, 0x0011);
  expect(0x0004, 0x0012, 0x0011, "up without acknowledge: ignored");
  expect(0x0002, 0x0012, 0x0011, "so is the same state");
  expect(0x0014, 0x0004, 0x0000, "acknowledged and up in one");
  expect(0x0009, 0x0014, 0x0012);
  expect(0x0002, 0x0002, 0x0000, "down needs no acknowledge");
}

TEST_F(States, AcknowledgeWithTheSameStateOnlyClears) {
  master.bring_up(AlState::kPreOp);
  expect(0x0008, 0x0012, 0x0011);
  expect(0x0012, 0x0002, 0x0000);
}

TEST_F(States, MailboxMustBeAsInTheSii) {
  expect(0x0002, 0x0011, 0x0016, "nothing configured");
  master.configure();
  const std::vector<SyncManagerSetting> settings = sync_managers_of(drive());
  for (int spoiled = 0; spoiled < 4; ++spoiled) {
    SyncManagerSetting wrong = settings[1];
    if (spoiled == 0) wrong.start = 0x1050;
    if (spoiled == 1) wrong.length = 31;
    if (spoiled == 2) wrong.control = 0x26;  // direction
    if (spoiled == 3) wrong.control = 0x20;  // mode
    master.write(0, reg::kSyncManager + 8 + 6, {0});
    master.write_manager(0, 1, wrong);
    expect(0x0012, 0x0011, 0x0016, std::to_string(spoiled));
  }
  master.write(0, reg::kSyncManager + 8 + 6, {0});
  master.write_manager(0, 1, settings[1]);
  expect(0x0012, 0x0002, 0x0000);
}

/// A board that does without its mailbox where its SII names no protocol.
class LenientBoard : public ::testing::Test {
 protected:
  static SlaveDescription described(std::uint16_t protocols) {
    SlaveDescription description = drive();
    description.mailbox_protocols = protocols;
    return description;
  }
  EmulatedSlave& add(std::uint16_t protocols) {
    return bus.add(described(protocols), {.mailbox_demand = MailboxDemand::kWhereSiiNames});
  }
  EmulatedBus bus;
  HandMaster master{bus};
};

TEST_F(LenientBoard, ComesToOpWithoutItsMailboxWhichThenIsDead) {
  add(0);
  EXPECT_EQ(master.request(0, AlState::kPreOp), 0x0002);
  EXPECT_EQ(master.write(0, 0x1000, Bytes(32)).counter, 1) << "plain memory: nothing guards it";
  const std::vector<SyncManagerSetting> managers = sync_managers_of(drive());
  for (std::size_t i = 2; i < managers.size(); ++i) master.write_manager(0, i, managers[i]);
  EXPECT_EQ(master.request(0, AlState::kSafeOp), 0x0004);
  EXPECT_EQ(master.write(0, managers[2].start, Bytes(5)).counter, 1);
  EXPECT_EQ(master.request(0, AlState::kOp), 0x0008);
}

TEST_F(LenientBoard, HasAWholeMailboxOrNone) {
  EmulatedSlave& slave = add(0);
  RecordingBoard board(slave);
  board.reply = {7};
  const std::vector<SyncManagerSetting> managers = sync_managers_of(drive());
  master.write_manager(0, 0, managers[0]);
  EXPECT_EQ(master.request(0, AlState::kPreOp), 0x0011) << "half of it";
  EXPECT_EQ(master.al_code(0), 0x0016);
  master.write_manager(0, 1, managers[1]);
  EXPECT_EQ(master.request(0, 0x0012), 0x0002);
  // A reply that waits when the master switches the mailbox off is not found by the next master.
  master.write(0, 0x1000, Bytes(32, 1));
  EXPECT_TRUE(board.posted);
  for (const bool on : {false, true}) {
    HandFrame both;
    for (const int manager : {0, 1})
      both.add(Command::kApwr,
               drivers::ethercat::address_of(0, static_cast<std::uint16_t>(reg::kSyncManager + 8 * manager +
                                                                           reg::kSyncManagerActivate)),
               {on});
    master.run(both);
  }
  EXPECT_EQ(master.al_status(0), 0x0002);
  EXPECT_EQ(master.read(0, 0x1040, 32).counter, 0) << "empty";
  master.write(0, 0x1000, Bytes(32, 2));
  EXPECT_EQ(master.read(0, 0x1040, 32).data.front(), 7) << "and it works";
}

TEST_F(LenientBoard, InsistsWhereTheSiiNamesAProtocol) {
  add(mailbox_protocol::kCoE);
  EXPECT_EQ(master.request(0, AlState::kPreOp), 0x0011);
  EXPECT_EQ(master.al_code(0), 0x0016);
}

TEST_F(States, ProcessDataMustBeAsInTheSii) {
  master.bring_up(AlState::kPreOp);
  const std::vector<SyncManagerSetting> settings = sync_managers_of(drive());
  const auto try_with = [&](std::size_t manager, SyncManagerSetting setting, std::uint16_t code) {
    master.write(0, static_cast<std::uint16_t>(reg::kSyncManager + 8 * manager + 6), {0});
    master.write_manager(0, manager, setting);
    expect(0x0014, 0x0012, code);
    master.write(0, static_cast<std::uint16_t>(reg::kSyncManager + 8 * manager + 6), {0});
    master.write_manager(0, manager, settings[manager]);
  };
  SyncManagerSetting outputs = settings[2];
  outputs.length = 4;
  try_with(2, outputs, 0x001D);
  outputs = settings[2];
  outputs.control = 0x60;  // direction
  try_with(2, outputs, 0x001D);
  SyncManagerSetting inputs = settings[3];
  inputs.length = 21;
  try_with(3, inputs, 0x001E);
  inputs = settings[3];
  inputs.start = 0x1104;  // inside the output buffers
  master.write_fmmu(0, 1, kLogical + 5, 20, 0, 7, 0x1104, 0, 1);
  try_with(3, inputs, 0x0017);
  inputs.start = 0x2FE0;  // the third buffer ends behind the memory
  master.write_fmmu(0, 1, kLogical + 5, 20, 0, 7, 0x2FE0, 0, 1);
  try_with(3, inputs, 0x0017);
  master.write_fmmu(0, 1, kLogical + 5, 20, 0, 7, settings[3].start, 0, 1);
  expect(0x0014, 0x0004, 0x0000);
}

TEST_F(States, FmmusMustNotLeaveProcessDataOut) {
  master.bring_up(AlState::kPreOp);
  master.write_fmmu(0, 0, kLogical, 4, 0, 7, 0x1100, 0, 2);  // one byte short
  expect(0x0004, 0x0012, 0x001D);
  master.write_fmmu(0, 0, kLogical, 5, 0, 7, 0x1100, 0, 1);  // wrong way
  expect(0x0014, 0x0012, 0x001D);
  master.write_fmmu(0, 0, kLogical, 5, 0, 7, 0x1100, 0, 2);
  master.write_fmmu(0, 1, kLogical + 5, 20, 0, 6, 0x1180, 0, 1);  // one bit short
  expect(0x0014, 0x0012, 0x001E);
  master.write_fmmu(0, 3, kLogical + 24, 1, 7, 7, 0x1193, 7, 1);  // that bit
  expect(0x0014, 0x0004, 0x0000);
}

TEST_F(States, ProcessDataMayStayUnmapped) {
  // SOEM's ecx_reconfig_slave() programs the FMMUs after SAFE-OP.
  const std::vector<SyncManagerSetting> settings = sync_managers_of(drive());
  for (std::size_t i = 0; i < settings.size(); ++i) master.write_manager(0, i, settings[i]);
  expect(0x0002, 0x0002, 0x0000);
  expect(0x0004, 0x0004, 0x0000);
  EXPECT_EQ(master.write(0, 0x1100, Bytes(5)).counter, 1);
  expect(0x0008, 0x0008, 0x0000);
}

TEST_F(States, OpWaitsForOutputs) {
  master.bring_up(AlState::kSafeOp);
  expect(0x0008, 0x0004, 0x0000);
  bus.advance(100ms);
  EXPECT_EQ(master.al_status(0), 0x0004);
  master.exchange(Bytes(25, 0x44));
  EXPECT_EQ(master.al_status(0), 0x0008);
  EXPECT_EQ(board.outputs, Bytes(5, 0x44));
}

TEST_F(States, OpIsRefusedWhenNoOutputsCome) {
  master.bring_up(AlState::kSafeOp);
  expect(0x0008, 0x0004, 0x0000);
  bus.advance(200ms);
  EXPECT_EQ(master.al_status(0), 0x0014);
  EXPECT_EQ(master.al_code(0), 0x0019);
}

TEST_F(States, OutputsOfTheSameFrameWillDo) {
  master.bring_up(AlState::kSafeOp);
  master.run(HandFrame()
                 .add(Command::kApwr, drivers::ethercat::address_of(0, reg::kAlControl), {0x08, 0x00})
                 .add(Command::kLrw, kLogical, Bytes(25)));
  EXPECT_EQ(master.al_status(0), 0x0008);
}

TEST_F(States, OutputsOlderThanTheWatchdogWillNot) {
  master.bring_up(AlState::kSafeOp);
  master.exchange(Bytes(25));
  bus.advance(100ms);
  EXPECT_EQ(master.al_status(0), 0x0004) << "in SAFE-OP the watchdog is no error";
  expect(0x0008, 0x0004, 0x0000);
  master.exchange(Bytes(25));
  EXPECT_EQ(master.al_status(0), 0x0008);
}

TEST_F(States, OutputsReachTheBoardInOpOnly) {
  master.bring_up(AlState::kSafeOp);
  master.exchange(Bytes(25, 0x11));
  EXPECT_EQ(board.output_writes, 0);
  master.request(0, AlState::kOp);
  EXPECT_EQ(board.outputs, Bytes(5, 0x11));
}

TEST_F(States, WatchdogTakesItToSafeOpAfterItsTime) {
  master.bring_up(AlState::kOp);
  for (int i = 0; i < 10; ++i) {
    bus.advance(99ms);
    master.exchange(Bytes(25));
  }
  EXPECT_EQ(master.al_status(0), 0x0008);
  EXPECT_EQ(master.read(0, reg::kWatchdogStatus, 1).number(), 1U);
  bus.advance(99ms);
  EXPECT_EQ(master.al_status(0), 0x0008);
  bus.advance(1ms);
  EXPECT_EQ(master.al_status(0), 0x0014);
  EXPECT_EQ(master.al_code(0), 0x001B);
  EXPECT_EQ(master.read(0, reg::kWatchdogStatus, 1).number(), 0U);
  EXPECT_EQ(master.read(0, reg::kWatchdogCounters, 1).number(), 1U);
  EXPECT_EQ(board.watchdogs, 1);
  EXPECT_EQ(board.states.back(), AlState::kSafeOp);
  bus.advance(10s);
  EXPECT_EQ(board.watchdogs, 1) << "once";

  // Back with acknowledge and fresh outputs.
  expect(0x0018, 0x0004, 0x0000);
  master.exchange(Bytes(25));
  EXPECT_EQ(master.al_status(0), 0x0008);
  EXPECT_EQ(master.read(0, reg::kWatchdogStatus, 1).number(), 1U);
  master.write(0, reg::kWatchdogCounters, {0});
  EXPECT_EQ(master.read(0, reg::kWatchdogCounters, 1).number(), 0U);
}

TEST_F(States, WatchdogTimeIsTheMasters) {
  master.bring_up(AlState::kOp);
  master.write(0, reg::kWatchdogDivider, 248, 2);  // (248 + 2) x 40 ns = 10 us
  master.write(0, reg::kWatchdogProcessData, 50, 2);
  master.exchange(Bytes(25));
  bus.advance(499us);
  EXPECT_EQ(master.al_status(0), 0x0008);
  bus.advance(1us);
  EXPECT_EQ(master.al_status(0), 0x0014);
}

TEST_F(States, WatchdogTimeZeroSwitchesItOff) {
  master.bring_up(AlState::kOp);
  master.write(0, reg::kWatchdogProcessData, 0, 2);
  bus.advance(100s);
  EXPECT_EQ(master.al_status(0), 0x0008);
}

TEST_F(States, WithoutTriggerTheWatchdogDoesNotRun) {
  master.configure();
  master.write(0, reg::kSyncManager + 16 + 6, {0});
  master.write(0, reg::kSyncManager + 16 + 4, {0x24});
  master.write(0, reg::kSyncManager + 16 + 6, {1});
  master.request(0, AlState::kPreOp);
  master.request(0, AlState::kSafeOp);
  master.exchange(Bytes(25));
  master.request(0, AlState::kOp);
  bus.advance(10s);
  EXPECT_EQ(master.al_status(0), 0x0008);
}

TEST_F(States, SwitchingASyncManagerOffInOpIsNoticed) {
  master.bring_up(AlState::kOp);
  master.write(0, reg::kSyncManager + 24 + 6, {0});
  EXPECT_EQ(master.al_status(0), 0x0012);
  EXPECT_EQ(master.al_code(0), 0x001E);
  master.write(0, reg::kSyncManager + 6, {0});
  EXPECT_EQ(master.al_status(0), 0x0011);
  EXPECT_EQ(master.al_code(0), 0x0016);
}

TEST_F(States, ABoardCanFallBackByItself) {
  master.bring_up(AlState::kOp);
  slave.report_error(AlState::kSafeOp, 0x0050);
  EXPECT_EQ(master.al_status(0), 0x0014);
  EXPECT_EQ(master.al_code(0), 0x0050);
  slave.report_error(AlState::kOp, 0x0060);
  EXPECT_EQ(master.al_status(0), 0x0014) << "never up";
}

TEST_F(States, ABoardMayRefuseTheRequestedState) {
  struct Broken : Application {
    explicit Broken(EmulatedSlave& slave) : slave_(slave) { slave.attach(*this); }
    void state_changed(AlState state) noexcept override {
      if (state == AlState::kOp) slave_.report_error(AlState::kSafeOp, 0x0050);
    }
    void outputs_changed(std::span<const std::uint8_t>) noexcept override { ++outputs; }
    EmulatedSlave& slave_;
    int outputs = 0;
  } broken(slave);
  master.bring_up(AlState::kOp);
  EXPECT_EQ(master.al_status(0), 0x0014);
  EXPECT_EQ(master.al_code(0), 0x0050);
  EXPECT_EQ(broken.outputs, 0);
}

TEST(StateMachine, NothingKeepsItFromGoingDown) {
  AlStateMachine machine;
  machine.request(0x0002, 0, true, 0ms);
  machine.request(0x0004, 0, true, 0ms);
  machine.request(0x0002, al_code::kInvalidMailbox, true, 0ms);
  EXPECT_EQ(machine.status(), 0x0002);
  machine.request(0x0004, al_code::kInvalidInputs, true, 0ms);
  EXPECT_EQ(machine.status(), 0x0012);
}

TEST(StateTime, AlControlIsLockedUntilTheFirmwareLooked) {
  EmulatedBus bus;
  bus.add(drive(), {.state_change_time = 3ms});
  HandMaster master(bus);
  master.configure();
  EXPECT_EQ(master.request(0, AlState::kPreOp), 0x0001);
  EXPECT_EQ(master.request(0, AlState::kInit), 0x0001);
  EXPECT_EQ(master.read(0, reg::kAlControl, 2).number(), 0x0002U);
  bus.advance(2ms);
  EXPECT_EQ(master.al_status(0), 0x0001);
  bus.advance(1ms);
  EXPECT_EQ(master.al_status(0), 0x0002);
}

TEST(SlaveWithoutProcessData, GoesToOpWithoutAnyConfiguration) {
  EmulatedBus bus;
  bus.add(power_board());
  HandMaster master(bus);
  EXPECT_EQ(master.request(0, AlState::kPreOp), 0x0002);
  EXPECT_EQ(master.request(0, AlState::kSafeOp), 0x0004);
  EXPECT_EQ(master.request(0, AlState::kOp), 0x0008);
  bus.advance(10s);
  EXPECT_EQ(master.al_status(0), 0x0008);
}

}  // namespace bus_state_test
}  // namespace sim::bus::test
