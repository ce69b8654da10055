// The motor controller's mailbox: bytes, parameters, their protection, user variables.
#include <gtest/gtest.h>

#include <string>

#include "tests/sim/tmcm_bench.h"

namespace sim::bus::test {
namespace tmcm_mailbox_test {

using drivers::tmcl::Command;

constexpr std::int32_t kPassword = 4711;

class TmcmMailbox : public ::testing::Test {
 protected:
  TmcmMailbox() { bench.bring_up(AlState::kPreOp); }
  TmcmBench bench{Firmware::k148};
};

std::string text(const Telegram& reply) { return {reply.begin(), reply.end()}; }

TEST_F(TmcmMailbox, AnswersWithKnownBytes) {
  // Requests: fact sheet, section 7. Replies: host, module, status 100, command, value most significant
  // first.
  EXPECT_EQ(bench.ask({0x00, 0x05, 0x9E, 0x00, 0x00, 0x00, 0x00, 0x01}),
            (Telegram{0x02, 0x00, 0x64, 0x05, 0x00, 0x00, 0x00, 0x01}))
      << "clear the time-out";
  EXPECT_EQ(bench.ask({0x00, 0x05, 0x01, 0x00, 0x00, 0x00, 0x00, 0x00}),
            (Telegram{0x02, 0x00, 0x64, 0x05, 0x00, 0x00, 0x00, 0x00}))
      << "zero the encoder";
  EXPECT_EQ(bench.ask({0x00, 0x06, 0x9C, 0x00, 0x00, 0x00, 0x00, 0x00}),
            (Telegram{0x02, 0x00, 0x64, 0x06, 0x00, 0x00, 0x00, 0x10}))
      << "status: halted, bit 4";
  EXPECT_EQ(bench.ask({0x00, 0x05, 0x00, 0x00, 0xFF, 0xFE, 0xFE, 0x30}),
            (Telegram{0x02, 0x00, 0x64, 0x05, 0xFF, 0xFE, 0xFE, 0x30}))
      << "-66000 is echoed";
  EXPECT_EQ(bench.ask({0x00, 0x06, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00}),
            (Telegram{0x02, 0x00, 0x64, 0x06, 0xFF, 0xFE, 0xFE, 0x30}))
      << "and read back";
}

TEST_F(TmcmMailbox, RefusesWithTheStatusOfTheMatter) {
  EXPECT_EQ(bench.ask({0x00, 0x63, 0, 0, 0, 0, 0, 7}), (Telegram{0x02, 0x00, 2, 0x63, 0, 0, 0, 7}))
      << "no such command";
  EXPECT_EQ(bench.ask({0x00, 0x06, 100, 0, 0, 0, 0, 0}), (Telegram{0x02, 0x00, 3, 0x06, 0, 0, 0, 0}))
      << "no such parameter";
  EXPECT_EQ(bench.ask({0x00, 0x05, 3, 0, 0, 0, 0, 9}), (Telegram{0x02, 0x00, 3, 0x05, 0, 0, 0, 9}))
      << "read only";
  EXPECT_EQ(bench.ask({0x00, 0x05, 146, 0, 0, 0, 0, 2}), (Telegram{0x02, 0x00, 4, 0x05, 0, 0, 0, 2}))
      << "out of range";
  EXPECT_EQ(bench.ask({0x00, 0x05, 11, 1, 0, 0, 0, 2}), (Telegram{0x02, 0x00, 4, 0x05, 0, 0, 0, 2}))
      << "no second motor";
}

TEST_F(TmcmMailbox, ProtectedParametersNeedThePassword) {
  EXPECT_EQ(bench.set(90, 50), Status::kProtected);
  EXPECT_EQ(bench.get(90), 100) << "reading is free";
  EXPECT_EQ(bench.set(248, 1), Status::kInvalidValue);
  EXPECT_EQ(bench.set(90, 50), Status::kProtected);
  EXPECT_EQ(bench.set(248, kPassword), Status::kOk);
  EXPECT_EQ(bench.set(90, 50), Status::kOk);
  EXPECT_EQ(bench.get(90), 50);
  EXPECT_EQ(bench.set(248, 0), Status::kOk) << "locks again";
  EXPECT_EQ(bench.set(90, 60), Status::kProtected);
  EXPECT_EQ(bench.ask(Command::kStoreAxisParameter, 90).status, Status::kProtected);
}

TEST_F(TmcmMailbox, StoreAndRestoreEchoTheirValue) {
  EXPECT_EQ(bench.set(11, 3000), Status::kOk);
  EXPECT_EQ(bench.ask(Command::kStoreAxisParameter, 11, 42).value, 42);
  EXPECT_EQ(bench.set(11, 10), Status::kOk);
  EXPECT_EQ(bench.ask(Command::kRestoreAxisParameter, 11, 42).value, 42);
  EXPECT_EQ(bench.get(11), 3000);
  EXPECT_EQ(bench.ask(Command::kStoreAxisParameter, 1).status, Status::kWrongType)
      << "a position is not kept";
}

TEST_F(TmcmMailbox, ALockedEepromStoresNothingUntilUnlocked) {
  EXPECT_EQ(bench.ask(Command::kSetGlobalParameter, 73, 1234, 0).status, Status::kOk);
  EXPECT_EQ(bench.set(11, 3000), Status::kOk);
  EXPECT_EQ(bench.ask(Command::kStoreAxisParameter, 11).status, Status::kEepromLocked);
  EXPECT_EQ(bench.ask(Command::kStoreGlobalParameter, 20, 0, 2).status, Status::kEepromLocked);
  EXPECT_EQ(bench.ask(Command::kRestoreAxisParameter, 11).status, Status::kOk);
  EXPECT_EQ(bench.get(11), 2000) << "the factory value";
  EXPECT_EQ(bench.ask(Command::kSetGlobalParameter, 73, 4321, 0).status, Status::kOk);
  EXPECT_EQ(bench.ask(Command::kStoreAxisParameter, 11).status, Status::kOk);
}

TEST_F(TmcmMailbox, UserVariablesAreKeptByBankAndNumber) {
  EXPECT_EQ(bench.ask({0x00, 0x09, 16, 2, 0, 0, 0, 1}), (Telegram{0x02, 0x00, 0x64, 0x09, 0, 0, 0, 1}));
  EXPECT_EQ(bench.ask({0x00, 0x0A, 16, 2, 0, 0, 0, 0}), (Telegram{0x02, 0x00, 0x64, 0x0A, 0, 0, 0, 1}));
  EXPECT_EQ(bench.ask(Command::kSetGlobalParameter, 3, 1, 2).status, Status::kProtected) << "0 to 15";
  EXPECT_EQ(bench.ask(Command::kStoreGlobalParameter, 56, 0, 2).status, Status::kWrongType) << "RAM only";
  EXPECT_EQ(bench.ask(Command::kGetGlobalParameter, 16, 0, 3).status, Status::kInvalidValue)
      << "no such bank";

  EXPECT_EQ(bench.ask(Command::kSetGlobalParameter, 20, -5, 2).status, Status::kOk);
  EXPECT_EQ(bench.ask(Command::kStoreGlobalParameter, 20, 0, 2).status, Status::kOk);
  bench.bus.set_power(0, false);
  bench.bus.set_power(0, true);
  bench.bring_up(AlState::kPreOp);
  EXPECT_EQ(bench.ask(Command::kGetGlobalParameter, 20, 0, 2).value, -5);
  EXPECT_EQ(bench.ask(Command::kGetGlobalParameter, 16, 0, 2).value, 0);
}

TEST(TmcmVersion, IsEightCharactersAndNothingElse) {
  const auto version = [](int controller, Firmware firmware, int zeros) {
    TmcmOptions options = TmcmBench::options_for(firmware);
    options.controller = controller;
    options.zero_version_replies = zeros;
    TmcmBench bench(options);
    bench.bring_up(AlState::kPreOp);
    for (int i = 0; i < zeros; ++i) {
      Bytes mailbox(TmcmBench::kMailbox);
      mailbox[1] = 136;
      bench.master.write(0, 0x1000, mailbox);
      bench.pass(3);
      EXPECT_EQ(bench.master.read(0, 0x1040, TmcmBench::kMailbox).data, Bytes(TmcmBench::kMailbox));
    }
    return text(bench.ask({0x00, 136, 0, 0, 0, 0, 0, 0}));
  };
  EXPECT_EQ(version(1610, Firmware::k148, 0), "1610V148");
  EXPECT_EQ(version(1632, Firmware::k200, 2), "1632V200");
  EXPECT_EQ(version(174, Firmware::k148, 0), "174V1.48");
}

TEST_F(TmcmMailbox, TheVersionIsThereInBinaryToo) {
  EXPECT_EQ(bench.ask({0x00, 136, 1, 0, 0, 0, 0, 0}), (Telegram{0x02, 0x00, 0x64, 136, 0x06, 0x60, 1, 48}));
}

TEST_F(TmcmMailbox, TheReplyTakesItsTimeAndOneRequestIsUnderWay) {
  Bytes request(TmcmBench::kMailbox);
  request[1] = 6;
  request[2] = 156;
  ASSERT_EQ(bench.master.write(0, 0x1000, request).counter, 1);
  EXPECT_EQ(bench.master.read(0, 0x1040, TmcmBench::kMailbox).counter, 0) << "not in the same cycle";
  bench.bus.advance(500us);
  EXPECT_EQ(bench.master.write(0, 0x1000, request).counter, 1) << "the mailbox itself takes one more";
  EXPECT_EQ(bench.master.write(0, 0x1000, request).counter, 0) << "and no third";
  bench.bus.advance(500us);
  EXPECT_EQ(bench.master.read(0, 0x1040, TmcmBench::kMailbox).counter, 1);
  EXPECT_EQ(bench.master.read(0, 0x1040, TmcmBench::kMailbox).counter, 0);
  bench.pass(3);
  EXPECT_EQ(bench.master.read(0, 0x1040, TmcmBench::kMailbox).counter, 1) << "the second is answered in turn";
}

TEST_F(TmcmMailbox, NothingAnswersForAMissingGripper) {
  EXPECT_EQ(bench.ask({0x01, 0x06, 0x01, 0, 0, 0, 0, 0}), Telegram{});
}

TEST_F(TmcmMailbox, OldParametersAreGoneInFirmware200) {
  EXPECT_EQ(bench.ask(Command::kGetAxisParameter, 153).status, Status::kOk);
  TmcmBench newer(Firmware::k200);
  newer.bring_up(AlState::kPreOp);
  EXPECT_EQ(newer.ask(Command::kGetAxisParameter, 153).status, Status::kWrongType);
}

TEST_F(TmcmMailbox, MoveToPositionIsAbsoluteOrRelative) {
  ASSERT_EQ(bench.set(15, 1), Status::kOk);
  bench.pass(600);
  EXPECT_EQ(bench.ask(Command::kMoveToPosition, 0, 4000).status, Status::kOk);
  bench.pass(2000);
  EXPECT_NEAR(bench.get(1), 4000, 5);  // parameter 10
  EXPECT_EQ(bench.ask(Command::kMoveToPosition, 1, -1000).status, Status::kOk);
  bench.pass(2000);
  EXPECT_NEAR(bench.get(1), 3000, 10);  // twice parameter 10
  EXPECT_EQ(bench.ask(Command::kMoveToPosition, 2, 0).status, Status::kWrongType) << "no coordinates";
}

}  // namespace tmcm_mailbox_test
}  // namespace sim::bus::test
