// Bring-up of the emulated youBot, and its error messages.
#include "drivers/ethercat/pre_op_bus.h"

#include <gtest/gtest.h>

#include "tests/drivers/ethercat_fakes.h"

namespace drivers::ethercat::test {
namespace ethercat_pre_op_bus_test {

TEST(PreOpBus, TakesTheYoubotToPreOpThenToOpWithZeroOutputs) {
  EmulatedRobot robot(youbot());
  PreOpBus setup(robot.connect({.timed = true}), nullptr, impatient());
  check_topology(setup.slaves(), expected_youbot(), "eth7");
  setup.enter_pre_op();
  for (std::size_t i = 0; i < 11; ++i) EXPECT_EQ(robot.state(i), AlState::kPreOp);
  OpBus bus = std::move(setup).start();
  ASSERT_EQ(bus.size(), 11U);
  for (std::size_t i = 0; i < 11; ++i) {
    EXPECT_EQ(robot.state(i), AlState::kOp);
    EXPECT_EQ(bus.health(i).condition, SlaveCondition::kOperational);
    EXPECT_EQ(robot.board(i).set_values, 0);
    for (const std::uint8_t byte : bus.outputs(i)) EXPECT_EQ(byte, 0);
  }
}

TEST(PreOpBus, StartsFromWhateverAnotherMasterLeft) {
  for (const auto state_change_time : {0us, 800us}) {
    EmulatedRobot robot(youbot(), {.state_change_time = state_change_time});
    PreOpBus::Options options;
    options.access.frame_timeout = 1s;
    options.cyclic.frame_timeout = 1s;
    Link& link = robot.connect({.timed = true});
    {
      PreOpBus first(link, nullptr, options);
      first.enter_pre_op();
      OpBus left_running = std::move(first).start();
    }
    robot.bus.slave(3).report_error(AlState::kSafeOp, 0x001B);
    robot.bus.slave(8).report_error(AlState::kInit, 0x0020);
    PreOpBus second(link, nullptr, options);
    second.enter_pre_op();
    const OpBus bus = std::move(second).start();
    for (std::size_t i = 0; i < 11; ++i) EXPECT_EQ(robot.state(i), AlState::kOp) << i;
  }
}

TEST(PreOpBus, IsRefusedWhileAnotherMasterIsAtWork) {
  EmulatedRobot robot(youbot());
  MeddlingLink link(robot.connect({.timed = true}));
  link.on_send = [&](Bytes&) {
    robot.wire->send(frame_of_another_master(Command::kBrd, address_of(0, reg::kAlStatus)));
    robot.wire->advance(1ms);
    return false;
  };
  const std::string error = error_of([&] { PreOpBus(link, nullptr, impatient()); });
  EXPECT_TRUE(contains(error, "another EtherCAT master is on this bus"));
  EXPECT_TRUE(contains(error, "frames from 01:01:01:01:01:01): end that program"));
  for (std::size_t i = 0; i < 11; ++i) EXPECT_EQ(robot.state(i), AlState::kInit);
}

TEST(PreOpBus, ExchangesParametersInPreOp) {
  EmulatedRobot robot(youbot());
  PreOpBus setup(robot.connect({.timed = true}), nullptr, impatient());
  setup.enter_pre_op();
  robot.board(3).value = -7;
  EXPECT_EQ(tmcl_value(setup.mailbox_exchange(3, tmcl(0, 6, 1, 0, 0))), -7);
  robot.board(3).value = 9;
  EXPECT_EQ(tmcl_value(setup.mailbox_exchange(3, tmcl(0, 6, 1, 0, 0))), 9);
}

TEST(PreOpBus, AMailboxThatFailsNamesSlaveAndReason) {
  EmulatedRobot robot(youbot());
  PreOpBus setup(robot.connect({.timed = true}), nullptr, impatient());
  setup.enter_pre_op();
  EXPECT_EQ(error_of([&] { setup.mailbox_exchange(0, Bytes(8)); }),
            "slave 1 (KR-845): use its mailbox: it has none");
  EXPECT_EQ(error_of([&] { setup.mailbox_exchange(1, Bytes(33)); }),
            "slave 2 (TMCM-1632): use its mailbox: the request is longer than the mailbox");
  robot.bus.slave(1).hang_mailbox(true);
  EXPECT_EQ(error_of([&] { setup.mailbox_exchange(1, Bytes(8)); }),
            "slave 2 (TMCM-1632): wait for its mailbox: no reply in time");
}

TEST(PreOpBus, ASlaveThatRestartedUnnoticedIsNamed) {
  EmulatedRobot robot(youbot());
  PreOpBus setup(robot.connect({.timed = true}), nullptr, impatient(300ms));
  setup.enter_pre_op();
  robot.bus.slave(6).set_power(false);  // too short for anybody to notice, but its address is gone
  robot.bus.slave(6).set_power(true);
  robot.bus.set_cable(6, false);
  robot.bus.set_cable(6, true);
  const std::string error = error_of([&] { OpBus bus = std::move(setup).start(); });
  EXPECT_TRUE(contains(error, "slave 7 (TMCM-1610): change state: write to register 0x0810: no answer for "));
}

TEST(PreOpBus, ARefusedStateIsReported) {
  EmulatedRobot robot(youbot());
  PreOpBus setup(robot.connect({.timed = true}), nullptr, impatient());
  setup.enter_pre_op();
  robot.bus.slave(6).report_error(AlState::kInit, 0x0022);
  const std::string error = error_of([&] { OpBus bus = std::move(setup).start(); });
  EXPECT_TRUE(contains(error,
                       "slave 7 (TMCM-1610): change state: SAFE-OP refused: it is in INIT with error, AL "
                       "status code (register 0x0134) 0x0011 invalid requested state change, after "));
}

TEST(PreOpBus, ASlaveThatNeverReachesOpIsReported) {
  EmulatedRobot robot({drive("TMCM-1610")});
  MeddlingLink link(robot.connect({.timed = true}));
  PreOpBus setup(link, nullptr, impatient(300ms));
  setup.enter_pre_op();
  link.on_send = [](Bytes& frame) {
    (void)find_datagram(frame, [](const Datagram& datagram) {
      if (datagram.command == Command::kFpwr && datagram.offset() == reg::kAlControl && datagram.data[0] == 8)
        datagram.data[0] = 4;  // it understands SAFE-OP
      return false;
    });
    return false;
  };
  const std::string error = error_of([&] { OpBus bus = std::move(setup).start(); });
  EXPECT_TRUE(contains(error, "slave 1 (TMCM-1610): change state: OP "));
  EXPECT_TRUE(contains(error, "it is in SAFE-OP, AL status code (register 0x0134) 0x0000 no error, after "));
}

TEST(PreOpBus, ARefusedOpIsReportedWithItsCode) {
  EmulatedRobot robot({drive("TMCM-1610")});
  MeddlingLink link(robot.connect({.timed = true}));
  PreOpBus setup(link, nullptr, impatient());
  setup.enter_pre_op();
  link.on_send = [](Bytes& frame) {
    (void)find_datagram(frame, [](const Datagram& datagram) {
      if (datagram.command == Command::kFpwr && datagram.offset() == reg::kAlControl && datagram.data[0] == 8)
        datagram.data[0] = 3;  // it understands BOOT, which it has not
      return false;
    });
    return false;
  };
  EXPECT_TRUE(
      contains(error_of([&] { OpBus bus = std::move(setup).start(); }),
               "slave 1 (TMCM-1610): change state: OP refused: it is in SAFE-OP with error, AL status code "
               "(register 0x0134) 0x0011 invalid requested state change, after "));
}

TEST(PreOpBus, FramesLostOnTheWayToOpOnlyDelayIt) {
  for (const int lost_frames : {1, 3, 20}) {
    EmulatedRobot robot(youbot());
    MeddlingLink link(robot.connect({.timed = true}));
    PreOpBus setup(link, nullptr, impatient());
    setup.enter_pre_op();
    int left = lost_frames;
    link.on_receive = [&](std::span<std::uint8_t>) { return robot.state(3) != AlState::kOp || left-- <= 0; };
    const OpBus bus = std::move(setup).start();
    EXPECT_LT(left, 0);
    for (std::size_t i = 0; i < 11; ++i) EXPECT_EQ(robot.state(i), AlState::kOp) << i;
  }
}

TEST(PreOpBus, AWatchdogThatExpiresMeanwhileIsClearedOnce) {
  EmulatedRobot robot(youbot());
  MeddlingLink link(robot.connect({.timed = true}));
  PreOpBus setup(link, nullptr, impatient());
  setup.enter_pre_op();
  int left = 20;
  link.on_receive = [&](std::span<std::uint8_t>) {
    if (left == 20 && robot.state(3) != AlState::kOp) return true;
    if (left == 10) robot.bus.slave(3).report_error(AlState::kSafeOp, 0x001B);
    return left-- <= 0;
  };
  const OpBus bus = std::move(setup).start();
  EXPECT_LT(left, 0);
  for (std::size_t i = 0; i < 11; ++i) EXPECT_EQ(robot.state(i), AlState::kOp) << i;
}

TEST(PreOpBus, ASlaveThatKeepsFallingOutOfOpIsNamedWithItsCode) {
  EmulatedRobot robot(youbot());
  MeddlingLink link(robot.connect({.timed = true}));
  PreOpBus setup(link, nullptr, impatient(300ms));
  setup.enter_pre_op();
  link.on_send = [&](Bytes&) {
    if (robot.state(3) == AlState::kOp) robot.bus.slave(3).report_error(AlState::kSafeOp, 0x001B);
    return false;
  };
  const std::string error = error_of([&] { OpBus bus = std::move(setup).start(); });
  EXPECT_TRUE(contains(error, "slave 4 (TMCM-1632): change state: OP "));
  EXPECT_TRUE(contains(error, "0x001B sync manager watchdog"));
}

TEST(PreOpBus, AWorkingCounterThatStaysShortIsNoSilentStart) {
  EmulatedRobot robot({drive("TMCM-1610"), drive("TMCM-1610")});
  MeddlingLink link(robot.connect({.timed = true}));
  PreOpBus setup(link, nullptr, impatient(300ms));
  setup.enter_pre_op();
  link.on_receive = [](std::span<std::uint8_t> frame) {
    (void)find_datagram(frame, [](const Datagram& datagram) {
      if (datagram.command == Command::kLrw) store_le<std::uint16_t>(datagram.counter, 2);
      return false;
    });
    return true;
  };
  EXPECT_TRUE(
      contains(error_of([&] { OpBus bus = std::move(setup).start(); }), "the working counter stays short"));
}

TEST(PreOpBus, ImagesThatDoNotFitAFrameAreRefusedWithNumbers) {
  std::vector<SlaveDescription> slaves(4, drive("big"));
  for (SlaveDescription& slave : slaves) {
    slave.outputs = {.start = 0x1100, .bytes = 180};
    slave.inputs = {.start = 0x1400, .bytes = 180};
  }
  EmulatedRobot robot(slaves);
  PreOpBus setup(robot.connect({.timed = true}), nullptr, impatient());
  setup.enter_pre_op();
  // 16 frame header, 1440 image, 8 datagrams of 12, 10 supervision, 32 mailbox.
  EXPECT_EQ(error_of([&] { OpBus bus = std::move(setup).start(); }),
            "emulated bus: lay out the process image: 1440 bytes of 4 slaves, with supervision and a mailbox "
            "of 32, "
            "need a frame of 1594 bytes: 1514 are possible");
}

}  // namespace ethercat_pre_op_bus_test
}  // namespace drivers::ethercat::test
