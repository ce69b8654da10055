// The bus in operation against the emulated youBot: faults, their reports, and recovery.
#include "drivers/ethercat/op_bus.h"

#include <gtest/gtest.h>

#include "tests/drivers/ethercat_fakes.h"

namespace drivers::ethercat::test {
namespace ethercat_op_bus_test {

using enum SlaveCondition;

constexpr std::size_t kWheel = 2;  // slave 3, the second wheel
constexpr std::size_t kHand = 10;  // the last one: no slave behind it
constexpr std::uint16_t kWholeCounter = 9 * 3;

class Operation : public ::testing::Test {
 protected:
  void start(std::vector<FaultEvent> faults = {}, std::vector<SlaveDescription> slaves = youbot(),
             const SlaveOptions& options = {}) {
    robot.emplace(slaves, options);
    link.emplace(robot->connect({.timed = timed, .faults = std::move(faults)}));
    PreOpBus setup(*link, nullptr, impatient());
    setup.enter_pre_op();
    bus.emplace(std::move(setup).start());
  }
  void TearDown() override {
    EXPECT_EQ(violations, 0) << "exchange() allocated or locked";
    EXPECT_LE(link->longest, kMaxFrameBytes);
    EXPECT_EQ(set_while_stopped, 0) << "a slave got set values before it was operational";
  }

  // A millisecond, with set values for everybody all the time.
  CycleResult cycle() {
    std::vector<int> before;
    std::vector<SlaveCondition> conditions;
    for (std::size_t i = 0; i < bus->size(); ++i) {
      std::ranges::fill(bus->outputs(i), std::uint8_t{0x77});
      before.push_back(robot->board(i).set_values);
      conditions.push_back(bus->health(i).condition);
    }
    CycleResult result;
    {
      const support::NoAllocGuard guard;
      result = bus->exchange(robot->wire->now());
      if (counting) violations += guard.violations();
    }
    for (std::size_t i = 0; i < bus->size(); ++i)
      if (conditions[i] != kOperational) set_while_stopped += robot->board(i).set_values - before[i];
    robot->wire->advance(1ms);
    return result;
  }
  void cycles(int count) {
    for (int i = 0; i < count; ++i) cycle();
  }
  // Runs cycles until slave i is in `condition`; false after a second.
  bool until(std::size_t i, SlaveCondition condition) {
    for (int left = 1000; left > 0 && bus->health(i).condition != condition; --left) cycle();
    return bus->health(i).condition == condition;
  }
  // Resumes every waiting slave, as a robot does while it is not enabled; returns the milliseconds until all
  // are well, or -1 after two seconds.
  int recover() {
    for (int cycle_number = 0; cycle_number < 2000; ++cycle_number) {
      if (cycle().all_operational) return cycle_number;
      for (std::size_t i = 0; i < bus->size(); ++i) bus->resume(i);
    }
    return -1;
  }
  SlaveCondition condition(std::size_t i) const { return bus->health(i).condition; }
  Bytes inputs(std::size_t i) const { return {bus->inputs(i).begin(), bus->inputs(i).end()}; }
  void set_product(std::size_t i, std::uint32_t product) {
    store_le(&robot->bus.slave(i).controller().sii().image()[2 * kSiiProductWord], product);
  }

  bool timed = false;  // the wire has its own time
  std::optional<EmulatedRobot> robot;
  std::optional<MeddlingLink> link;
  std::optional<OpBus> bus;
  ScriptedLink none_;
  long violations = 0;
  bool counting = true;  // false: the test's own hooks allocate
  int set_while_stopped = 0;
};

TEST_F(Operation, OneFrameACycleCarriesAllData) {
  start();
  const int before = link->frames;
  for (std::size_t i = 0; i < 11; ++i) robot->board(i).mark = static_cast<std::uint8_t>(0xA0 + i);
  cycles(2);
  const CycleResult result = cycle();
  EXPECT_EQ(link->frames, before + 3);
  EXPECT_TRUE(result.answered);
  EXPECT_TRUE(result.all_operational);
  EXPECT_EQ(result.working_counter, kWholeCounter);
  EXPECT_EQ(result.expected_working_counter, kWholeCounter);
  for (std::size_t i = 0; i < 11; ++i) {
    EXPECT_TRUE(bus->health(i).inputs_fresh);
    EXPECT_EQ(bus->health(i).state, AlState::kOp);
    if (bus->slave(i).inputs.bytes == 0) continue;
    EXPECT_EQ(bus->inputs(i)[5], 0xA0 + i);
    EXPECT_EQ(load_le<std::uint32_t>(bus->inputs(i).data()), robot->board(i).refreshes - 1)
        << "of this cycle: refreshed once more since, with the time that passed";
    EXPECT_EQ(robot->board(i).outputs[4], 0x77);
  }
}

TEST_F(Operation, WithoutSlavesThereIsNoBus) {
  link.emplace(none_);
  ScriptedLink& none = none_;
  EXPECT_EQ(error_of([&] { OpBus(std::make_unique<Transceiver>(none), {}, {}); }),
            "scripted: start: there are no slaves");
}

TEST_F(Operation, ASingleLostFrameStopsNothing) {
  for (const FaultKind kind : {FaultKind::kDropReply, FaultKind::kDropRequest}) {
    start({{.kind = kind, .at = 10ms}});
    cycles(10);
    const Bytes before = inputs(kWheel);
    const CycleResult lost = cycle();
    EXPECT_FALSE(lost.answered);
    EXPECT_FALSE(lost.all_operational);
    EXPECT_FALSE(bus->health(kWheel).inputs_fresh);
    EXPECT_EQ(inputs(kWheel), before);
    EXPECT_EQ(condition(kWheel), kOperational);
    EXPECT_TRUE(cycle().all_operational);
    EXPECT_TRUE(bus->health(kWheel).inputs_fresh);
    EXPECT_EQ(bus->counters().lost, 1U);
    cycles(10);
    for (std::size_t i = 0; i < 11; ++i) EXPECT_EQ(bus->health(i).times_lost, 0U);
  }
}

TEST_F(Operation, AShortCounterIsBrokenDownToTheSlave) {
  start();
  counting = false;
  cycles(3);
  // One wheel takes its outputs, but gives no inputs, although it is in OP: 2 of 3.
  const ProcessDataWindow window = bus->slave(kWheel).outputs;
  link->on_receive = [&window](std::span<std::uint8_t> frame) {
    (void)find_datagram(frame, [&](const Datagram& d) {
      if (d.command != Command::kLrw) return false;
      if (d.data.size() > 25 || d.address == window.image_offset) {
        store_le(d.counter, static_cast<std::uint16_t>(d.working_counter() - 1));
        std::ranges::fill(d.data, std::uint8_t{0xEE});
      }
      return false;
    });
    return true;
  };
  const Bytes before = inputs(kWheel);
  EXPECT_EQ(cycle().working_counter, kWholeCounter - 1);
  for (std::size_t i = 1; i < 5; ++i) EXPECT_FALSE(bus->health(i).inputs_fresh) << "whose is it?";
  for (int n = 0; n < 5; ++n) {
    const CycleResult result = cycle();
    EXPECT_EQ(result.working_counter, kWholeCounter - 1);
    EXPECT_FALSE(result.all_operational);
    for (std::size_t i = 0; i < 11; ++i) EXPECT_EQ(bus->health(i).inputs_fresh, i != kWheel) << i;
  }
  EXPECT_EQ(inputs(kWheel), before) << "what came for it was not good";
  link->on_receive = nullptr;
  cycles(2);
  EXPECT_TRUE(cycle().all_operational);
}

TEST_F(Operation, ACounterThatIsTooHighDoesNotMakeTheImageWhole) {
  start();
  counting = false;
  cycles(3);
  link->on_receive = [](std::span<std::uint8_t> frame) {
    (void)find_datagram(frame, [](const Datagram& d) {
      if (d.command != Command::kLrw) return false;
      store_le(d.counter, static_cast<std::uint16_t>(d.working_counter() + 1));
      std::ranges::fill(d.data, std::uint8_t{0xEE});
      return false;
    });
    return true;
  };
  const Bytes before = inputs(kWheel);
  for (int n = 0; n < 3; ++n) {
    EXPECT_FALSE(cycle().all_operational);
    EXPECT_FALSE(bus->health(kWheel).inputs_fresh);
    EXPECT_EQ(inputs(kWheel), before);
  }
}

TEST_F(Operation, InputsBelowSafeOpAreNotTaken) {
  start();
  counting = false;
  cycles(3);
  // It reports PRE-OP, but still answers with its memory.
  const std::uint16_t station = bus->slave(kWheel).station;
  const std::uint32_t image = bus->slave(kWheel).outputs.image_offset;
  link->on_receive = [=](std::span<std::uint8_t> frame) {
    (void)find_datagram(frame, [&](const Datagram& d) {
      const std::uint8_t pre_op = static_cast<std::uint8_t>(AlState::kPreOp);
      if (d.command == Command::kBrd) d.data[0] |= pre_op;
      if (d.command == Command::kFprd && d.address == address_of(station, reg::kAlStatus)) d.data[0] = pre_op;
      if (d.command == Command::kLrw && d.address == image) std::ranges::fill(d.data, std::uint8_t{0xEE});
      return false;
    });
    return true;
  };
  cycles(12);  // until its turn for supervision
  ASSERT_EQ(condition(kWheel), kStopped);
  const Bytes before = inputs(kWheel);
  for (int n = 0; n < 5; ++n) {
    cycle();
    EXPECT_FALSE(bus->health(kWheel).inputs_fresh);
    EXPECT_TRUE(bus->health(kWheel + 1).inputs_fresh);
    EXPECT_EQ(inputs(kWheel), before);
  }
}

TEST_F(Operation, InputsOfAMissingSlaveAreKeptAndNotFresh) {
  start();
  robot->board(kHand).mark = 0x5C;
  cycles(5);
  const Bytes before = inputs(kHand);
  robot->bus.set_power(kHand, false);
  for (int n = 0; n < 20; ++n) {
    const CycleResult result = cycle();
    EXPECT_TRUE(result.answered);
    EXPECT_FALSE(result.all_operational);
    EXPECT_EQ(result.working_counter, kWholeCounter - 3);
    EXPECT_FALSE(bus->health(kHand).inputs_fresh);
    EXPECT_EQ(inputs(kHand), before);
    if (n > 0) {
      for (std::size_t i = 0; i < kHand; ++i) EXPECT_TRUE(bus->health(i).inputs_fresh) << n;
    }
  }
  EXPECT_EQ(condition(kHand), kLost);
  EXPECT_EQ(bus->health(kHand).state, AlState::kNone);
  EXPECT_EQ(bus->health(kHand).times_lost, 1U);
}

TEST_F(Operation, APowerCycledSlaveComesBackByParametersAndResume) {
  start();
  cycles(5);
  robot->bus.set_power(kHand, false);
  std::vector<SlaveCondition> seen{condition(kHand)};
  int stale = 0;
  const auto watch = [&](int count) {
    for (int n = 0; n < count; ++n) {
      cycle();
      if (condition(kHand) != seen.back()) seen.push_back(condition(kHand));
      for (std::size_t i = 0; i < kHand; ++i) {
        EXPECT_EQ(condition(i), kOperational);
        if (!bus->health(i).inputs_fresh) ++stale;
      }
    }
  };
  watch(20);
  robot->bus.set_power(kHand, true);
  watch(100);
  EXPECT_EQ(seen, (std::vector{kOperational, kLost, kRestarting, kNeedsParameters}));
  EXPECT_EQ(robot->state(kHand), AlState::kPreOp);
  watch(100);
  EXPECT_EQ(condition(kHand), kNeedsParameters) << "it waits";

  ASSERT_TRUE(bus->mailbox(kHand).post(tmcl(0, 5, 7, 0, 0), 50ms));
  watch(5);
  ASSERT_EQ(bus->mailbox(kHand).status(), MailboxLine::Status::kReplied);
  EXPECT_EQ(tmcl_value(bus->mailbox(kHand).reply()), 7001);

  bus->resume(kHand);
  watch(50);
  EXPECT_EQ(seen, (std::vector{kOperational, kLost, kRestarting, kNeedsParameters, kResuming, kOperational}));
  EXPECT_TRUE(cycle().all_operational);
  EXPECT_TRUE(bus->health(kHand).inputs_fresh);
  EXPECT_EQ(robot->board(kHand).outputs[0], 0x77);
  // The frame in which it first fails is one for all slaves: no slave's data counts in it.
  EXPECT_LE(stale, 10);
  EXPECT_EQ(bus->failure(kHand), "");
}

TEST_F(Operation, ASlaveInTheMiddleTakesThoseBehindItAlong) {
  start();
  cycles(5);
  robot->bus.set_power(5, false);
  cycles(10);
  for (std::size_t i = 0; i < 11; ++i) EXPECT_EQ(condition(i), i < 5 ? kOperational : kLost);
  robot->bus.set_power(5, true);
  cycles(50);
  EXPECT_EQ(condition(5), kNeedsParameters);
  for (std::size_t i = 6; i < 11; ++i) EXPECT_EQ(condition(i), kStopped) << "still powered and addressed";
  const int milliseconds = recover();
  EXPECT_GE(milliseconds, 0);
  EXPECT_LT(milliseconds, 50);
}

TEST_F(Operation, ACableThatComesBackSoonNeedsNoNewConfiguration) {
  start();
  cycles(5);
  robot->bus.set_cable(6, false);
  cycles(20);
  for (std::size_t i = 6; i < 11; ++i) EXPECT_EQ(condition(i), kLost);
  robot->bus.set_cable(6, true);
  // Resumed in the very cycle in which it is found, as the robot does.
  for (std::size_t i = 6; i < 11; ++i) ASSERT_TRUE(until(i, kStopped));
  for (std::size_t i = 6; i < 11; ++i) {
    EXPECT_NE(bus->health(i).state, AlState::kNone) << "stopped, but in what state?";
    bus->resume(i);
    EXPECT_EQ(condition(i), kResuming);
  }
  for (std::size_t i = 6; i < 11; ++i) EXPECT_TRUE(until(i, kOperational));
  cycles(2);
  EXPECT_TRUE(cycle().all_operational);
}

TEST_F(Operation, ACableOutLongerThanTheWatchdogLeavesSafeOpWithItsCode) {
  start();
  cycles(5);
  robot->bus.set_cable(kHand, false);
  cycles(150);  // the watchdog runs 100 ms
  EXPECT_EQ(robot->board(kHand).watchdogs, 1);
  robot->bus.set_cable(kHand, true);
  ASSERT_TRUE(until(kHand, kStopped));
  EXPECT_EQ(bus->health(kHand).state, AlState::kSafeOp);
  EXPECT_TRUE(bus->health(kHand).al_error);
  EXPECT_EQ(bus->health(kHand).al_code, 0x001B);
  cycles(100);
  EXPECT_EQ(condition(kHand), kStopped) << "it waits for resume()";
  bus->resume(kHand);
  ASSERT_TRUE(until(kHand, kOperational));
  cycles(2);
  EXPECT_TRUE(cycle().all_operational);
}

TEST_F(Operation, ASlaveThatDropsToSafeOpStopsAloneAndIsResumed) {
  start();
  cycles(5);
  robot->bus.slave(kWheel).report_error(AlState::kSafeOp, 0x001B);
  cycles(3);
  EXPECT_EQ(condition(kWheel), kStopped);
  EXPECT_EQ(bus->health(kWheel).al_code, 0x001B);
  EXPECT_EQ(bus->health(kWheel).times_lost, 1U);
  for (std::size_t i = 0; i < 11; ++i) {
    if (i != kWheel) {
      EXPECT_EQ(condition(i), kOperational);
      EXPECT_TRUE(bus->health(i).inputs_fresh);
    }
  }
  bus->resume(kWheel);
  EXPECT_EQ(condition(kWheel), kResuming);
  ASSERT_TRUE(until(kWheel, kOperational));
  EXPECT_EQ(robot->state(kWheel), AlState::kOp);
}

TEST_F(Operation, ASlaveThatDropsToSafeOpIsNoticedWithinTwoCycles) {
  start();
  cycles(5);
  robot->bus.slave(kWheel).report_error(AlState::kSafeOp, 0x001B);
  cycles(2);
  EXPECT_EQ(condition(kWheel), kStopped) << "its working counter alone is still right";
}

TEST_F(Operation, ASlaveThatFallsToInitIsConfiguredFromScratch) {
  start();
  cycles(5);
  robot->bus.slave(kWheel).report_error(AlState::kInit, 0x0016);
  ASSERT_TRUE(until(kWheel, kStopped));
  ASSERT_TRUE(bus->mailbox(kWheel).post(tmcl(0, 6, 1, 0, 0), 10s));
  bus->resume(kWheel);
  EXPECT_EQ(condition(kWheel), kRestarting);
  EXPECT_EQ(bus->mailbox(kWheel).status(), MailboxLine::Status::kIdle) << "its mailbox is reset";
  ASSERT_TRUE(until(kWheel, kNeedsParameters));
  bus->resume(kWheel);
  ASSERT_TRUE(until(kWheel, kOperational));
}

TEST_F(Operation, ASlaveThatFallsToPreOpKeepsItsParameters) {
  start();
  cycles(5);
  robot->bus.slave(kWheel).report_error(AlState::kPreOp, 0x001E);
  ASSERT_TRUE(until(kWheel, kStopped));
  bus->resume(kWheel);
  EXPECT_EQ(condition(kWheel), kResuming);
  ASSERT_TRUE(until(kWheel, kOperational));
}

TEST_F(Operation, ResumeDoesNothingToThoseWhoDoNotWaitForIt) {
  start();
  cycles(2);
  bus->resume(kWheel);
  EXPECT_EQ(condition(kWheel), kOperational);
  robot->bus.set_power(kHand, false);
  ASSERT_TRUE(until(kHand, kLost));
  bus->resume(kHand);
  EXPECT_EQ(condition(kHand), kLost);
}

TEST_F(Operation, ARefusedResumeSaysWhy) {
  start();
  counting = false;
  cycles(2);
  robot->bus.slave(kHand).report_error(AlState::kPreOp, 0x001E);
  ASSERT_TRUE(until(kHand, kStopped));
  link->on_send = [](Bytes& frame) {  // its input sync manager gets a wrong length
    (void)find_datagram(frame, [](const Datagram& d) {
      if (d.command == Command::kFpwr && d.offset() == 0x0818) d.data[2] = 19;
      return false;
    });
    return false;
  };
  robot->bus.slave(kHand).set_power(false);  // or the old configuration would still be locked
  robot->bus.set_power(kHand, false);
  robot->bus.set_power(kHand, true);
  ASSERT_TRUE(until(kHand, kNeedsParameters));
  bus->resume(kHand);
  ASSERT_TRUE(until(kHand, kStopped));
  EXPECT_TRUE(contains(bus->failure(kHand),
                       "SAFE-OP refused: it is in PRE-OP with error, AL status code (register "
                       "0x0134) 0x001E invalid input configuration, after "));
}

// ---- detection ----

TEST_F(Operation, ADamagedCableIsFoundWhileTheBusWorks) {
  start({FaultEvent{.kind = FaultKind::kDamageOnCable, .at_frame = 400, .count = 2, .slave = 3}});
  cycles(1000);
  ASSERT_TRUE(cycle().all_operational);
  EXPECT_EQ(bus->diagnostics().errors(3).ports[0].invalid_frames, 2U);
  const std::vector<std::string> findings = bus->findings();
  ASSERT_FALSE(findings.empty());
  EXPECT_TRUE(contains(findings.front(), "slave 4 (")) << findings.front();
  EXPECT_TRUE(contains(findings.front(), "port 0: 2 new CRC errors: check the cable from slave 3 ("));
}

TEST_F(Operation, NothingIsFoundOnASoundBus) {
  start();
  cycles(500);
  EXPECT_EQ(bus->findings(), std::vector<std::string>{});
  EXPECT_GE(bus->diagnostics().round_trips().count(), 500U);
  EXPECT_GT(bus->diagnostics().round_trips().best(), 0ns);
}

TEST_F(Operation, FindingsTellWhoIsMissingAndHowOftenItWas) {
  start();
  cycles(5);
  robot->bus.set_power(kHand, false);
  ASSERT_TRUE(until(kHand, kLost));
  EXPECT_TRUE(contains(bus->findings().back(), "does not answer: check its power and the cable before it"));
  robot->bus.set_power(kHand, true);
  ASSERT_GE(recover(), 0);
  ASSERT_EQ(bus->findings().size(), 1U);
  EXPECT_EQ(bus->findings().front(), bus->slave(kHand).label() + ": left operation once");
}

TEST_F(Operation, ADevicePluggedInLaterIsReportedAndDisturbsNothing) {
  start();
  cycles(5);
  counting = false;
  robot->bus.set_power(kHand, false);
  bus.reset();
  {
    PreOpBus setup(*link, nullptr, impatient());
    setup.enter_pre_op();
    bus.emplace(std::move(setup).start());
  }
  counting = true;
  ASSERT_EQ(bus->size(), 10U);
  cycles(20);
  robot->bus.set_power(kHand, true);
  cycles(100);
  EXPECT_TRUE(cycle().all_operational);
  ASSERT_FALSE(bus->findings().empty());
  EXPECT_TRUE(contains(bus->findings().back(), "11 slaves answer, 10 were there at the start"));
}

// ---- another device ----

TEST_F(Operation, ABoardOfTheSameKindWithAnotherSerialNumberIsNotTaken) {
  start();
  cycles(5);
  robot->bus.set_power(kHand, false);
  ASSERT_TRUE(until(kHand, kLost));
  store_le(&robot->bus.slave(kHand).controller().sii().image()[2 * kSiiSerialWord], std::uint32_t{4712});
  robot->bus.set_power(kHand, true);
  ASSERT_TRUE(until(kHand, kForeign));
  EXPECT_TRUE(contains(bus->failure(kHand),
                       "another device is there: serial number (SII word 0x000E) is 0x00001268, not 0x"));
}

TEST_F(Operation, AnotherDeviceInALostSlavesPlaceIsNotTakenIntoOperation) {
  start();
  cycles(5);
  robot->bus.set_power(kHand, false);
  ASSERT_TRUE(until(kHand, kLost));
  set_product(kHand, 0x4711);
  robot->bus.set_power(kHand, true);
  ASSERT_TRUE(until(kHand, kForeign));
  EXPECT_EQ(bus->failure(kHand),
            "another device is there: product (SII word 0x000A) is 0x00004711, not 0x00000012");
  for (int n = 0; n < 200; ++n) {
    const CycleResult result = cycle();
    EXPECT_FALSE(result.all_operational);
    EXPECT_EQ(condition(kHand), kForeign);
    EXPECT_FALSE(bus->health(kHand).inputs_fresh);
    bus->resume(kHand);
    for (std::size_t i = 0; i < kHand; ++i) EXPECT_TRUE(bus->health(i).inputs_fresh);
  }
  EXPECT_EQ(robot->state(kHand), AlState::kInit);
  for (std::uint16_t sm = 0; sm < 4; ++sm)
    EXPECT_EQ(robot->bus.slave(kHand).controller().get<std::uint8_t>(
                  static_cast<std::uint16_t>(reg::kSyncManager + 8 * sm + reg::kSyncManagerActivate)),
              0)
        << "nothing was configured in it";
}

TEST_F(Operation, AnotherDevicesCableOutAndBackMakesItNoneOfOurs) {
  start();
  cycles(5);
  robot->bus.set_power(kHand, false);
  ASSERT_TRUE(until(kHand, kLost));
  set_product(kHand, 0x4711);
  robot->bus.set_power(kHand, true);
  ASSERT_TRUE(until(kHand, kForeign));
  robot->bus.set_cable(kHand, false);
  ASSERT_TRUE(until(kHand, kLost));
  robot->bus.set_cable(kHand, true);
  for (int n = 0; n < 100; ++n) {
    cycle();
    EXPECT_NE(condition(kHand), kStopped);
    bus->resume(kHand);
  }
  EXPECT_EQ(condition(kHand), kForeign);
}

TEST_F(Operation, TheRightDeviceAfterAWrongOneIsTaken) {
  start();
  cycles(5);
  robot->bus.set_power(kHand, false);
  ASSERT_TRUE(until(kHand, kLost));
  set_product(kHand, 0x4711);
  robot->bus.set_power(kHand, true);
  ASSERT_TRUE(until(kHand, kForeign));
  robot->bus.set_power(kHand, false);
  ASSERT_TRUE(until(kHand, kLost));
  set_product(kHand, 0x12);
  robot->bus.set_power(kHand, true);
  ASSERT_TRUE(until(kHand, kNeedsParameters));
  EXPECT_GE(recover(), 0);
}

TEST_F(Operation, ADeviceWithAnothersAddressIsNotTouched) {
  start();
  cycles(5);
  robot->bus.set_power(kHand, false);
  ASSERT_TRUE(until(kHand, kLost));
  robot->bus.set_power(kHand, true);
  // Before we look: another master's address.
  FrameWriter writer;
  const Datagram address =
      writer.add(Command::kApwr, 1, address_of(position_address(kHand), reg::kStationAddress), 2);
  store_le<std::uint16_t>(address.data.data(), 0x2222);
  Bytes frame(writer.bytes().begin(), writer.bytes().end());
  ASSERT_TRUE(robot->bus.process(frame));
  cycles(50);
  EXPECT_EQ(condition(kHand), kTampered);
  EXPECT_EQ(robot->bus.slave(kHand).controller().get<std::uint16_t>(reg::kStationAddress), 0x2222);
}

// ---- mailboxes ----

TEST_F(Operation, BusyMailboxesChangeNothingInTheCycle) {
  struct Run {
    std::vector<std::uint16_t> counters;
    std::vector<Bytes> inputs;
    int replies = 0;
  };
  const auto run = [this](bool busy) {
    start();
    Run result;
    for (int n = 0; n < 300; ++n) {
      for (std::size_t i = 0; busy && i < 11; ++i) {
        MailboxLine& line = bus->mailbox(i);
        if (line.status() == MailboxLine::Status::kReplied) {
          // Its own reply, not another slave's: each answers with the type that was asked for.
          EXPECT_EQ(tmcl_value(line.reply()) / 1000, static_cast<int>(i));
          ++result.replies;
        }
        EXPECT_NE(line.status(), MailboxLine::Status::kTimedOut);
        if (!line.exists() || line.status() == MailboxLine::Status::kBusy) continue;
        EXPECT_TRUE(line.post(tmcl(0, 6, static_cast<std::uint8_t>(i), 0, 0), 100ms));
      }
      const CycleResult cycle_result = cycle();
      EXPECT_TRUE(cycle_result.all_operational);
      result.counters.push_back(cycle_result.working_counter);
      for (std::size_t i = 0; i < 11; ++i) result.inputs.push_back(inputs(i));
    }
    EXPECT_EQ(bus->counters().lost, 0U);
    return result;
  };
  const Run quiet = run(false);
  const Run busy = run(true);
  EXPECT_EQ(quiet.counters, busy.counters);
  EXPECT_EQ(quiet.inputs, busy.inputs);
  EXPECT_EQ(busy.replies, 9 * 74) << "each of 9 slaves: a reply every four cycles";
}

TEST_F(Operation, ALostFrameDoesNotConfuseAnyMailbox) {
  std::vector<FaultEvent> faults;
  for (int n = 0; n < 40; ++n)
    faults.push_back(
        {.kind = n % 2 == 0 ? FaultKind::kDropReply : FaultKind::kDropRequest, .at = (10 + 7 * n) * 1ms});
  start(faults);
  std::array<int, 11> posted{};
  std::array<int, 11> replied{};
  for (int n = 0; n < 400; ++n) {
    for (std::size_t i = 0; i < 11; ++i) {
      MailboxLine& line = bus->mailbox(i);
      if (!line.exists() || line.status() == MailboxLine::Status::kBusy) continue;
      if (line.status() == MailboxLine::Status::kReplied) {
        ++replied[i];
        EXPECT_EQ(tmcl_value(line.reply()) / 1000, posted[i] % 100) << "another request's reply";
      }
      ++posted[i];
      line.post(tmcl(0, 6, static_cast<std::uint8_t>(posted[i] % 100), 0, 0), 30ms);
    }
    cycle();
  }
  for (std::size_t i = 1; i < 5; ++i) {
    EXPECT_GT(replied[i], 40);
    EXPECT_LE(robot->board(i).executed, posted[i]) << "one was executed twice";
  }
}

TEST_F(Operation, AMailboxOfALostSlaveTimesOutToo) {
  start();
  robot->bus.set_power(kHand, false);
  ASSERT_TRUE(until(kHand, kLost));
  ASSERT_TRUE(bus->mailbox(kHand).post(tmcl(0, 6, 1, 0, 0), 20ms));
  cycles(30);
  EXPECT_EQ(bus->mailbox(kHand).status(), MailboxLine::Status::kTimedOut);
}

TEST_F(Operation, AMailboxWorksAfterARepeatAndAPowerCycle) {
  start();
  counting = false;
  const auto request = [this](std::uint8_t type) {
    EXPECT_TRUE(bus->mailbox(kHand).post(tmcl(0, 6, type, 0, 0), 50ms));
    for (int n = 0; n < 100 && bus->mailbox(kHand).status() == MailboxLine::Status::kBusy; ++n) cycle();
    return bus->mailbox(kHand).status() == MailboxLine::Status::kReplied
               ? tmcl_value(bus->mailbox(kHand).reply()) / 1000
               : -1;
  };
  const auto lose_one_read = [this] {
    link->on_receive = [this](std::span<std::uint8_t> frame) {
      if (!find_datagram(frame, [](const Datagram& d) {
            return d.command == Command::kFprd && d.offset() == kMailboxIn;
          }))
        return true;
      link->on_receive = nullptr;
      return false;
    };
  };
  lose_one_read();
  EXPECT_EQ(request(1), 1);
  robot->bus.set_power(kHand, false);
  cycles(10);
  robot->bus.set_power(kHand, true);
  ASSERT_TRUE(until(kHand, kNeedsParameters));
  lose_one_read();
  EXPECT_EQ(request(2), 2) << "its repeat bit is back to zero";
}

// ---- faults of the script, one of each kind ----

struct Case {
  const char* name;
  FaultEvent event;
  int lost_most;  // frames
};
void PrintTo(const Case& fault, std::ostream* out) { *out << fault.name; }

class EveryFault : public Operation, public ::testing::WithParamInterface<Case> {};

TEST_P(EveryFault, IsSurvivedAndRecoveredFromWithin2s) {
  FaultEvent event = GetParam().event;
  event.at = 20ms;
  start({event});
  bool noticed = false;
  for (int n = 0; n < 1000 && !robot->wire->faults().finished(); ++n) {
    const CycleResult result = cycle();
    noticed = noticed || !result.all_operational;
    EXPECT_FALSE(result.all_operational && result.working_counter != kWholeCounter);
    for (std::size_t i = 0; i < 11; ++i) bus->resume(i);
  }
  ASSERT_TRUE(robot->wire->faults().finished());
  const int milliseconds = recover();
  EXPECT_GE(milliseconds, 0);
  cycles(5);
  EXPECT_TRUE(cycle().all_operational);
  for (std::size_t i = 0; i < 11; ++i) {
    EXPECT_TRUE(bus->health(i).inputs_fresh);
    EXPECT_EQ(robot->board(i).outputs[0], bus->slave(i).outputs.bytes > 0 ? 0x77 : 0);
  }
  const FrameCounters& counters = bus->counters();
  EXPECT_LE(counters.lost, static_cast<std::uint64_t>(GetParam().lost_most));
  EXPECT_EQ(counters.sent, counters.received + counters.lost) << "every frame has one fate";
  const std::uint32_t count = event.count;
  switch (event.kind) {
    case FaultKind::kDropRequest:
    case FaultKind::kDropReply: EXPECT_EQ(counters.lost, count); break;
    case FaultKind::kDelay:
      EXPECT_EQ(counters.lost, count);
      EXPECT_EQ(counters.late, count);
      break;
    case FaultKind::kDuplicate:
      EXPECT_EQ(counters.duplicate, count);
      EXPECT_FALSE(noticed) << "a duplicate has no effect";
      break;
    case FaultKind::kTruncate:
      EXPECT_EQ(counters.malformed, count);
      EXPECT_EQ(counters.lost, count);
      break;
    case FaultKind::kCorrupt: EXPECT_EQ(counters.malformed + counters.duplicate, count); break;
    case FaultKind::kWrongCounter: EXPECT_TRUE(noticed); break;
    case FaultKind::kDamageOnCable:
      EXPECT_EQ(counters.lost, count);
      EXPECT_EQ(robot->bus.slave(event.slave).controller().get<std::uint8_t>(reg::kRxErrorCounters), count);
      break;
    case FaultKind::kSlaveOff:
    case FaultKind::kCableOut:
    case FaultKind::kBrownOut: EXPECT_EQ(bus->health(event.slave).times_lost, 1U); break;
    case FaultKind::kMailboxHung:
    case FaultKind::kBoardFault: EXPECT_FALSE(noticed) << "not a matter of the bus"; break;
    case FaultKind::kForeignWrite: EXPECT_TRUE(bus->other_master_present()); break;
  }
}

INSTANTIATE_TEST_SUITE_P(
    OfTheScript, EveryFault,
    ::testing::Values(
        Case{"one_request", {.kind = FaultKind::kDropRequest}, 1},
        Case{"ten_requests", {.kind = FaultKind::kDropRequest, .count = 10}, 10},
        Case{"one_reply", {.kind = FaultKind::kDropReply}, 1},
        Case{"ten_replies", {.kind = FaultKind::kDropReply, .count = 10}, 10},
        Case{"delay", {.kind = FaultKind::kDelay, .count = 3, .delay = 7ms}, 3},
        Case{"duplicate", {.kind = FaultKind::kDuplicate, .count = 5}, 0},
        Case{"truncate", {.kind = FaultKind::kTruncate, .offset = 100}, 1},
        Case{"corrupt_command", {.kind = FaultKind::kCorrupt, .offset = 16}, 1},
        Case{"corrupt_index", {.kind = FaultKind::kCorrupt, .offset = 17}, 1},
        Case{"corrupt_length", {.kind = FaultKind::kCorrupt, .offset = 14}, 1},
        Case{"wrong_counter", {.kind = FaultKind::kWrongCounter, .count = 4}, 0},
        Case{"damage", {.kind = FaultKind::kDamageOnCable, .count = 2, .slave = 4}, 2},
        Case{"slave_off", {.kind = FaultKind::kSlaveOff, .duration = 300ms, .slave = 4}, 0},
        Case{"last_slave_off", {.kind = FaultKind::kSlaveOff, .duration = 300ms, .slave = 10}, 0},
        Case{"slave_off_briefly", {.kind = FaultKind::kSlaveOff, .duration = 1ms, .slave = 4}, 0},
        Case{"first_slave_off", {.kind = FaultKind::kSlaveOff, .duration = 300ms, .slave = 0}, 300},
        Case{"cable", {.kind = FaultKind::kCableOut, .duration = 300ms, .slave = 6}, 0},
        Case{"cable_briefly", {.kind = FaultKind::kCableOut, .duration = 10ms, .slave = 6}, 0},
        Case{"first_cable", {.kind = FaultKind::kCableOut, .duration = 300ms, .slave = 0}, 300},
        Case{"brown_out", {.kind = FaultKind::kBrownOut, .duration = 50ms}, 50},
        Case{"mailbox", {.kind = FaultKind::kMailboxHung, .duration = 50ms, .slave = 3}, 0},
        Case{"board", {.kind = FaultKind::kBoardFault, .duration = 50ms, .slave = 3}, 0},
        Case{"foreign_write",
             {.kind = FaultKind::kForeignWrite, .count = 16, .slave = 3, .offset = reg::kFmmu},
             0}),
    [](const auto& test) { return test.param.name; });

TEST_F(Operation, SlowSlavesRecoverAsWell) {
  SlaveOptions slow{.sii = {.reads_8_bytes = false, .read_time = 1ms}, .state_change_time = 0ms};
  robot.emplace(youbot(), slow);
  link.emplace(robot->connect(
      {.timed = true, .faults = {{.kind = FaultKind::kBrownOut, .at = 1s, .duration = 50ms}}}));
  PreOpBus::Options options;
  options.access.frame_timeout = 1s;
  options.cyclic.frame_timeout = 900us;
  PreOpBus setup(*link, nullptr, options);
  setup.enter_pre_op();
  bus.emplace(std::move(setup).start());
  while (!robot->wire->faults().finished()) cycle();
  const int milliseconds = recover();
  EXPECT_GE(milliseconds, 0) << "not within 2 s";
}

// ---- many slaves, large images ----

TEST_F(Operation, ManySlavesAreNotLostForWantOfRoomToAskThem) {
  // Split, 40 slaves need 16 + 40 * 20 bytes; to ask all of them another 40 * 18, which is too much.
  std::vector<SlaveDescription> slaves(40, drive("small"));
  for (SlaveDescription& slave : slaves) slave.outputs.bytes = 2, slave.inputs.bytes = 6;
  start({{.kind = FaultKind::kDropReply, .at = 10ms}}, slaves);
  cycles(100);
  for (std::size_t i = 0; i < 40; ++i) {
    EXPECT_EQ(condition(i), kOperational) << i;
    EXPECT_EQ(bus->health(i).times_lost, 0U) << i;
  }
  EXPECT_TRUE(cycle().all_operational);
  robot->bus.set_power(39, false);
  cycles(200);
  EXPECT_EQ(condition(39), kLost);
  for (std::size_t i = 0; i < 39; ++i) EXPECT_EQ(condition(i), kOperational) << i;
  robot->bus.set_power(39, true);
  EXPECT_GE(recover(), 0);
}

TEST_F(Operation, TheLargestImageThatIsTakenCanBeRepaired) {
  // 16 frame, 4 * 344 image, 8 * 12 datagrams, 10 supervision, a step of 22 or mailbox of 32: at most 1514.
  std::vector<SlaveDescription> slaves(4, drive("big"));
  for (SlaveDescription& slave : slaves) {
    slave.mailbox_out.length = slave.mailbox_in.length = 16;
    slave.outputs = {.start = 0x1100, .bytes = 172};
    slave.inputs = {.start = 0x1400, .bytes = 170};
  }
  slaves[3].inputs.bytes = 172;
  start({}, slaves);
  cycles(5);
  robot->bus.set_power(1, false);
  cycles(20);
  robot->bus.set_power(1, true);
  EXPECT_GE(recover(), 0);
  EXPECT_GT(link->longest, 1500U) << "not large at all";
  MailboxLine& line = bus->mailbox(2);
  ASSERT_TRUE(line.post(Bytes(16), 100ms));
  for (int n = 0; n < 50 && line.status() == MailboxLine::Status::kBusy; ++n) cycle();
  EXPECT_EQ(line.status(), MailboxLine::Status::kReplied);
}

TEST_F(Operation, LeavingOpZeroesOutputsAndGoesDownToInit) {
  start();
  cycles(5);
  EXPECT_EQ(robot->board(kWheel).outputs[0], 0x77);
  bus->leave_op();
  for (std::size_t i = 0; i < 11; ++i) {
    EXPECT_EQ(robot->state(i), AlState::kInit);
    EXPECT_EQ(robot->board(i).outputs, (std::array<std::uint8_t, 5>{}));
  }
}

TEST_F(Operation, SlowSlavesAreWaitedForOnTheWayDown) {
  robot.emplace(youbot(), SlaveOptions{.state_change_time = 300us});
  link.emplace(robot->connect({.timed = true}));
  PreOpBus setup(*link, nullptr, {});
  setup.enter_pre_op();
  bus.emplace(std::move(setup).start());
  cycles(5);
  bus->leave_op();
  for (std::size_t i = 0; i < 11; ++i) EXPECT_EQ(robot->state(i), AlState::kInit);
}

TEST_F(Operation, LeavingOpGetsThroughWhenTheFirstFrameIsLost) {
  start();
  cycles(5);
  counting = false;
  int frame = 0;
  link->on_send = [&frame](Bytes&) { return frame++ == 0; };
  bus->leave_op();
  for (std::size_t i = 1; i < 5; ++i) {
    EXPECT_EQ(robot->state(i), AlState::kInit);
    EXPECT_EQ(robot->board(i).outputs[0], 0);
  }
}

// ---- another master ----

TEST_F(Operation, FramesOfAnotherMasterAreCountedAndNamedUntilASecondAfterItHasLeft) {
  timed = true;
  start();
  for (int i = 0; i < 12; ++i) {  // a millisecond each
    robot->wire->send(frame_of_another_master(Command::kBrd, address_of(0, reg::kAlStatus)));
    EXPECT_TRUE(cycle().answered);
  }
  while (robot->wire->next_reply()) cycle();
  EXPECT_EQ(bus->counters().foreign, 12U);
  EXPECT_EQ(bus->counters().late + bus->counters().duplicate + bus->counters().malformed, 0U);
  EXPECT_TRUE(bus->other_master_present());
  BusState state;
  bus->copy_state(state);
  ASSERT_FALSE(bus->device_faults(state).empty());
  EXPECT_EQ(bus->device_faults(state)[0], "bus: another EtherCAT master is on it: 01:01:01:01:01:01");
  ASSERT_FALSE(bus->findings(state).empty());
  EXPECT_TRUE(contains(bus->findings(state)[0], "(12 frames from 01:01:01:01:01:01)"));
  cycles(1000);
  EXPECT_FALSE(bus->other_master_present());
}

/// What another master does below our socket: its frames are not seen here.
class HiddenMaster : public Operation {
 protected:
  void start_and_work() {
    timed = true;
    start();
    cycles(200);
    ASSERT_TRUE(cycle().all_operational);
  }
  void write(std::size_t i, std::uint16_t register_address, std::uint16_t value, std::size_t count = 1) {
    robot->bus.write_as_another_master(i, register_address, value, count);
  }
  /// The cycles until it is; -1 when it is not within `count`.
  int named_after(int count, const std::string& evidence) {
    for (int n = 1; n <= count; ++n) {
      cycle();
      if (!bus->other_master_present()) continue;
      EXPECT_TRUE(contains(bus->other_master().describe(), "(" + evidence));
      return n;
    }
    return -1;
  }
  /// As a robot does: nothing while another master is there.
  bool comes_back_once_it_has_left() {
    for (int n = 0; n < 1500; ++n) {
      const bool whole = cycle().all_operational;
      if (bus->other_master_present()) continue;
      if (whole) return true;
      for (std::size_t i = 0; i < bus->size(); ++i) bus->resume(i);
    }
    return false;
  }
  Bytes registers(std::size_t i, std::uint16_t first, std::uint16_t count) {
    Bytes bytes;
    for (std::uint16_t n = 0; n < count; ++n)
      bytes.push_back(
          robot->bus.slave(i).controller().get<std::uint8_t>(static_cast<std::uint16_t>(first + n)));
    return bytes;
  }
  std::uint16_t station(std::size_t i) {
    return robot->bus.slave(i).controller().get<std::uint16_t>(reg::kStationAddress);
  }
};

// The second wheel's data are in the image behind the first one's 25 bytes. 4: what the slave has there when
// the master has configured it (ESC data sheet section II, FMMU).
const Bytes kWheelOutputs{25, 0, 0, 0, 5, 0, 0, 7, 0x00, 0x11, 0, 2, 1, 0, 0, 0};
const Bytes kWheelInputs{30, 0, 0, 0, 20, 0, 0, 7, 0x80, 0x11, 0, 1, 1, 0, 0, 0};
const Bytes kHundredMilliseconds{0xE8, 0x03};  // in ticks of
const Bytes kTick{0xC2, 0x09};                 // 100 us: 2500 times 40 ns

TEST_F(HiddenMaster, ShowsByAnUnrequestedState) {
  for (const AlState state : {AlState::kInit, AlState::kPreOp, AlState::kSafeOp}) {
    start();
    cycles(5);
    write(kWheel, reg::kAlControl, static_cast<std::uint16_t>(state));
    EXPECT_GT(named_after(20, "slave 3 has a state that this program did not set"), 0)
        << static_cast<int>(state);
  }
}

// Silicon sets the flag then; a board's firmware may clear it again before anybody looks.
TEST_F(HiddenMaster, IsNoSafeOpWithoutFlagAfterAPauseAsLongAsTheWatchdog) {
  timed = true;
  start();
  cycles(5);
  for (int i = 0; i < 150; ++i) robot->wire->advance(1ms);
  ASSERT_EQ(robot->state(kWheel), AlState::kSafeOp);
  for (std::size_t i = 0; i < bus->size(); ++i)
    if (robot->state(i) == AlState::kSafeOp) write(i, reg::kAlControl, 0x0014);  // acknowledges the flag
  cycles(50);
  EXPECT_EQ(condition(kWheel), kStopped);
  EXPECT_EQ(robot->state(kWheel), AlState::kSafeOp);
  EXPECT_FALSE(bus->other_master_present());
}

// While its process data flow it is no slave that lost its power.
TEST_F(HiddenMaster, ShowsByAStationAddressThatThisMasterDidNotAssign) {
  for (const std::uint16_t address : {std::uint16_t{0}, std::uint16_t{7}}) {
    for (const std::size_t i : {std::size_t{0}, kWheel, kHand}) {
      start_and_work();
      const std::uint16_t own = station(i);
      write(i, reg::kStationAddress, address);
      const std::string slave = std::to_string(i + 1);
      EXPECT_GT(named_after(35, "it wrote register 0x0010 (station address) of slave " + slave), 0)
          << "each slave is asked in turn, then its place, and again";
      EXPECT_EQ(condition(i), kTampered);
      cycles(500);
      EXPECT_EQ(station(i), address) << "it is left to that master while that is there";
      EXPECT_TRUE(comes_back_once_it_has_left());
      EXPECT_EQ(station(i), own);
    }
  }
}

TEST_F(HiddenMaster, ShowsByAnAddressThatTwoSlavesHave) {
  start_and_work();
  const std::uint16_t own = station(kWheel);
  write(kWheel, reg::kStationAddress, station(kHand));
  EXPECT_GT(named_after(35, "it wrote register 0x0010 (station address) of slave 3"), 0);
  EXPECT_EQ(condition(kWheel), kTampered);
  EXPECT_EQ(condition(kHand), kOperational);
  EXPECT_TRUE(comes_back_once_it_has_left());
  EXPECT_EQ(station(kWheel), own);
  EXPECT_EQ(bus->health(kHand).times_lost, 0U) << "it kept its own";
}

// Each answers where the other is asked.
TEST_F(HiddenMaster, ShowsByAddressesThatAreExchanged) {
  start_and_work();
  const std::uint16_t own = station(kWheel);
  const std::uint16_t others = station(kHand);
  write(kWheel, reg::kStationAddress, others);
  write(kHand, reg::kStationAddress, own);
  EXPECT_GT(named_after(220, "it wrote register 0x0010 (station address) of slave "), 0);
  EXPECT_TRUE(comes_back_once_it_has_left());
  EXPECT_EQ(station(kWheel), own);
  EXPECT_EQ(station(kHand), others);
}

// A sync manager that is enabled takes no other start (section II, table 89), so it is disabled first.
TEST_F(HiddenMaster, ShowsByASyncManagerThatIsMovedAndEnabledAgain) {
  start_and_work();
  const Bytes before = registers(kWheel, 0x0810, 5);
  ASSERT_EQ(before[1], 0x11) << "the outputs at 0x1100";
  write(kWheel, 0x0816, 0);
  write(kWheel, 0x0810, 0x1400);
  write(kWheel, 0x0816, 1);
  EXPECT_GT(named_after(220, "it wrote register 0x0810 (sync manager) of slave 3"), 0);
  EXPECT_TRUE(comes_back_once_it_has_left());
  EXPECT_EQ(registers(kWheel, 0x0810, 5), before);
}

TEST_F(HiddenMaster, ShowsByDataThatAreNotMappedAnyMore) {
  struct Cleared {
    std::uint16_t first;
    std::size_t words;
    const char* evidence;
  };
  for (const Cleared& cleared : {Cleared{0x0600, 8, "it wrote register 0x0600 (FMMU) of slave 3"},
                                 Cleared{0x0610, 8, "it wrote register 0x0610 (FMMU) of slave 3"},
                                 Cleared{0x0600, 16, "it wrote register 0x0600 (FMMU) of slave 3"}}) {
    start_and_work();
    write(kWheel, cleared.first, 0, cleared.words);
    EXPECT_GT(named_after(10, cleared.evidence), 0) << "before a gap would be too long to be bridged";
    EXPECT_TRUE(comes_back_once_it_has_left());
    EXPECT_EQ(registers(kWheel, 0x0600, 16), kWheelOutputs);
    EXPECT_EQ(registers(kWheel, 0x0610, 16), kWheelInputs);
    cycle();
    EXPECT_EQ(robot->board(kWheel).outputs[0], 0x77);
  }
}

TEST_F(HiddenMaster, ShowsByDataThatAreMappedToAnotherPlace) {
  start_and_work();
  write(kWheel, 0x0610, 5);  // over the first wheel's inputs: all counters stay
  EXPECT_GT(named_after(220, "it wrote register 0x0610 (FMMU) of slave 3"), 0);
  EXPECT_TRUE(comes_back_once_it_has_left());
  EXPECT_EQ(registers(kWheel, 0x0610, 16), kWheelInputs);
}

TEST_F(HiddenMaster, ShowsByAWatchdogThatIsOff) {
  start_and_work();
  write(kWheel, 0x0420, 0);
  EXPECT_GT(named_after(220, "it wrote register 0x0420 (process data watchdog) of slave 3"), 0);
  cycle();
  EXPECT_EQ(robot->board(kWheel).outputs[0], 0) << "it is stopped";
  EXPECT_TRUE(comes_back_once_it_has_left());
  EXPECT_EQ(registers(kWheel, 0x0420, 2), kHundredMilliseconds);
  for (int i = 0; i < 101; ++i) robot->wire->advance(1ms);
  EXPECT_EQ(robot->state(kWheel), AlState::kSafeOp) << "it works again";
}

TEST_F(HiddenMaster, ShowsByAWatchdogThatExpiresAtOnce) {
  start_and_work();
  write(kWheel, 0x0400, 0);
  EXPECT_GT(named_after(20, "it wrote register 0x0400 (watchdog divider) of slave 3"), 0);
  EXPECT_TRUE(comes_back_once_it_has_left());
  EXPECT_EQ(registers(kWheel, 0x0400, 2), kTick);
}

TEST_F(HiddenMaster, ShowsByASyncManagerThatIsOff) {
  for (int manager = 0; manager < 4; ++manager) {
    start_and_work();
    const auto first = static_cast<std::uint16_t>(0x0800 + 8 * manager);
    write(kWheel, static_cast<std::uint16_t>(first + 6), 0);
    const std::string number = std::array{"00", "08", "10", "18"}[static_cast<std::size_t>(manager)];
    EXPECT_GT(named_after(20, "it wrote register 0x08" + number + " (sync manager) of slave 3"), 0);
    EXPECT_TRUE(comes_back_once_it_has_left()) << manager;
    EXPECT_EQ(registers(kWheel, static_cast<std::uint16_t>(first + 6), 1), Bytes{1});
  }
}

TEST_F(HiddenMaster, MayHaveWrittenAllSlavesAtOnce) {
  start_and_work();
  for (std::size_t i = 0; i < bus->size(); ++i) {
    write(i, reg::kStationAddress, 0);
    write(i, 0x0600, 0, 16);
    write(i, 0x0420, 0);
  }
  EXPECT_GT(named_after(220, "it wrote register 0x"), 0);
  EXPECT_TRUE(comes_back_once_it_has_left());
  EXPECT_EQ(registers(kWheel, 0x0600, 16), kWheelOutputs);
  EXPECT_EQ(registers(kWheel, 0x0420, 2), kHundredMilliseconds);
}

// The previous user of the bus may have left any value there.
TEST_F(HiddenMaster, BeforeTheStartIsOverwritten) {
  robot.emplace(youbot());
  link.emplace(robot->connect());
  write(kWheel, 0x0420, 0);
  write(kWheel, 0x0400, 7);
  PreOpBus setup(*link, nullptr, impatient());
  setup.enter_pre_op();
  bus.emplace(std::move(setup).start());
  EXPECT_EQ(registers(kWheel, 0x0420, 2), kHundredMilliseconds);
  EXPECT_EQ(registers(kWheel, 0x0400, 2), kTick);
  cycles(200);
  EXPECT_FALSE(bus->other_master_present());
}

// A network card lets no damaged frame through; a cable that is simulated in software does.
TEST_F(HiddenMaster, IsNoByteThatIsDamagedOnTheWayBack) {
  counting = false;
  start_and_work();
  int damaged = 0;
  link->on_receive = [&](std::span<std::uint8_t> frame) {
    const auto look = find_datagram(frame, [](const Datagram& d) {
      return d.command == Command::kAprd && (d.offset() == 0x0420 || d.offset() == 0x0600);
    });
    if (look && damaged++ % 2 == 0) look->data[0] ^= 0x10;
    return true;
  };
  for (int i = 0; i < 500; ++i) {
    cycle();
    ASSERT_FALSE(bus->other_master_present()) << i;
  }
  EXPECT_GT(damaged, 10);
}

TEST_F(HiddenMaster, IsNoDeviceThatIsPluggedInBeforeTheOthers) {
  counting = false;
  start_and_work();
  // As the places read then: a new device is in the first, and everybody else one further.
  link->on_receive = [this](std::span<std::uint8_t> frame) {
    FrameReader reader;
    Datagram datagram;
    if (reader.parse(frame) != FrameError::kNone) return true;
    while (reader.next(datagram)) {
      if (datagram.command == Command::kBrd) ++datagram.counter[0];
      if (datagram.command != Command::kAprd || datagram.offset() != reg::kStationAddress) continue;
      const auto address = load_le<std::uint16_t>(datagram.data.data());
      store_le<std::uint16_t>(datagram.data.data(),
                              static_cast<std::uint16_t>(address == station(0) ? 0 : address - 1));
    }
    return true;
  };
  cycles(500);
  EXPECT_FALSE(bus->other_master_present());
  for (std::size_t i = 0; i < bus->size(); ++i) EXPECT_EQ(bus->health(i).times_lost, 0U);
}

TEST_F(HiddenMaster, CostsAFrameInTwoASmallDatagramToBeSeen) {
  counting = false;
  start_and_work();
  int looks = 0;
  link->on_send = [&](Bytes& frame) {
    FrameReader reader;
    Datagram datagram;
    EXPECT_EQ(reader.parse(frame), FrameError::kNone);
    int in_this_frame = 0;
    while (reader.next(datagram)) {
      const bool look = datagram.command == Command::kAprd;
      in_this_frame += look ? 1 : 0;
      EXPECT_TRUE(!look || datagram.data.size() <= 16U);
    }
    EXPECT_LE(in_this_frame, 1);
    looks += in_this_frame;
    return false;
  };
  cycles(100);
  EXPECT_EQ(looks, 50);
}

// The other faults that take slaves out of operation are not laid at another master's door.
TEST_F(HiddenMaster, IsNotAWatchdogThatExpiredNorALossOfPower) {
  start({{.kind = FaultKind::kDropRequest, .at = 100ms, .count = 200},
         {.kind = FaultKind::kSlaveOff, .at = 600ms, .duration = 100ms, .slave = kWheel},
         {.kind = FaultKind::kBrownOut, .at = 1s, .duration = 100ms}});
  for (int i = 0; i < 2000; ++i) {
    cycle();
    for (std::size_t slave = 0; slave < bus->size(); ++slave) bus->resume(slave);
    ASSERT_FALSE(bus->other_master_present()) << i;
  }
}

TEST_F(Operation, AnImageThatIsOneByteLargerIsRefused) {
  std::vector<SlaveDescription> slaves(4, drive("big"));
  for (SlaveDescription& slave : slaves) {
    slave.mailbox_out.length = slave.mailbox_in.length = 16;
    slave.outputs = {.start = 0x1100, .bytes = 172};
    slave.inputs = {.start = 0x1400, .bytes = 170};
  }
  slaves[3].inputs.bytes = 173;
  EmulatedRobot large(slaves);
  PreOpBus setup(large.connect({}), nullptr, impatient());
  setup.enter_pre_op();
  EXPECT_TRUE(contains(error_of([&] { OpBus refused = std::move(setup).start(); }),
                       "need a frame of 1515 bytes: 1514 are possible"));
}

TEST_F(Operation, LeavingOpIsTriedForABoundedNumberOfFrames) {
  start();
  cycles(2);
  // Each of three states 200 frames; one without an answer counts for 21.
  const auto frames_to_leave = [this] {
    const int before = link->frames;
    bus->leave_op();
    return link->frames - before;
  };
  link->on_receive = [](std::span<std::uint8_t> frame) {
    const auto is_state = [](const Datagram& d) { return d.command == Command::kBrd; };
    if (const auto state = find_datagram(frame, is_state)) state->data[0] = 0x08;  // OP, for ever
    return true;
  };
  counting = false;
  EXPECT_EQ(frames_to_leave(), 3 * 200);
  link->on_receive = [](std::span<std::uint8_t>) { return false; };
  EXPECT_EQ(frames_to_leave(), 3 * 10);
}

TEST_F(Operation, LeavingOpDoesNotAllocateEvenWithoutABus) {
  start();
  cycles(2);
  robot->bus.set_power(0, false);
  const support::NoAllocGuard guard;
  bus->leave_op();
  const long found = guard.violations();
  EXPECT_EQ(found, 0);
}

// ---- bystanders ----

class WithBystanders : public Operation {
 protected:
  static constexpr std::size_t kDriven = 5;
  WithBystanders() {
    robot.emplace(youbot());
    link.emplace(robot->connect());
    PreOpBus setup(*link, nullptr, impatient());
    setup.enter_pre_op();
    bus.emplace(std::move(setup).start(kDriven));
  }
};

TEST_F(WithBystanders, StayInPreOpGetNoOutputsAndGoDownWithTheOthers) {
  ASSERT_EQ(bus->size(), kDriven);
  for (int i = 0; i < 100; ++i) {
    const CycleResult result = cycle();
    EXPECT_TRUE(result.all_operational);
    EXPECT_EQ(result.working_counter, 4 * 3);
  }
  for (std::size_t i = kDriven; i < robot->bus.size(); ++i) {
    EXPECT_EQ(robot->state(i), AlState::kPreOp) << i;
    EXPECT_EQ(robot->board(i).output_writes, 0) << i;
  }
  EXPECT_TRUE(bus->findings().empty()) << ::testing::PrintToString(bus->findings());
  bus->leave_op();
  for (std::size_t i = 0; i < robot->bus.size(); ++i) {
    EXPECT_EQ(robot->state(i), AlState::kInit) << i;
    EXPECT_EQ(robot->bus.slave(i).al_status_code(), 0) << "was asked for more than PRE-OP: " << i;
  }
}

TEST_F(WithBystanders, DoNotHideASlaveThatLeavesOpWithoutAWord) {
  cycles(20);
  // Another master's request, which no error bit shows; the power board has no process data either.
  FrameWriter writer;
  const Datagram request = writer.add(Command::kApwr, 0, address_of(0, reg::kAlControl), 2);
  request.data[0] = static_cast<std::uint8_t>(AlState::kPreOp);
  Bytes frame(writer.bytes().begin(), writer.bytes().end());
  ASSERT_TRUE(robot->bus.process(frame));
  ASSERT_EQ(robot->state(0), AlState::kPreOp);
  cycles(static_cast<int>(kDriven));  // each is asked in its turn
  EXPECT_EQ(bus->health(0).condition, kStopped);
  EXPECT_EQ(bus->health(0).state, AlState::kPreOp);
}

TEST_F(WithBystanders, MayComeAndGoWhileTheOthersWork) {
  cycles(20);
  robot->bus.set_power(7, false);
  for (int i = 0; i < 100; ++i) EXPECT_TRUE(cycle().all_operational) << i;
  robot->bus.set_power(7, true);
  for (int i = 0; i < 100; ++i) EXPECT_TRUE(cycle().all_operational) << i;
  EXPECT_EQ(robot->state(7), AlState::kInit);
}

}  // namespace ethercat_op_bus_test
}  // namespace drivers::ethercat::test
