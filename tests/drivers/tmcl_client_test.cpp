#include "drivers/tmcl/client.h"

#include <gtest/gtest.h>

#include <functional>

#include "tests/drivers/tmcl_fakes.h"

namespace drivers::tmcl {
namespace tmcl_client_test {

using namespace std::chrono_literals;

Reply refusal(const Request& request, Status status) { return {0, 0, status, request.command, 0, {}}; }

struct TmclClient : testing::Test {
  fake::Clock clock;
  fake::Module module;
  ClientOptions options;

  // The report of the SetupError that `action` throws.
  SetupError::Report failure(const std::function<void()>& action) {
    try {
      action();
    } catch (const SetupError& error) {
      message = error.what();
      return error.report();
    }
    ADD_FAILURE() << "nothing thrown";
    return {};
  }
  bool mentions(const std::string& words) const { return message.find(words) != std::string::npos; }
  std::string message;
};

TEST_F(TmclClient, SetsAndGetsByName) {
  Client client(module, clock);
  client.set(drive_parameter("motor_acceleration"), 2000);
  EXPECT_EQ(client.get(drive_parameter("motor_acceleration")), 2000);
  ASSERT_EQ(module.requests.size(), 2U);
  EXPECT_EQ(module.requests[0], (Request{0, Command::kSetAxisParameter, 11, 0, 2000}));
}

TEST_F(TmclClient, NegativeZeroAndSmallValuesArrive) {
  Client client(module, clock);
  for (const std::int32_t value : {-20000, -1, 0, 3, 65535 - 60000}) {
    client.set(drive_parameter("target_current"), value);
    EXPECT_EQ(client.get(drive_parameter("target_current")), value);
  }
}

TEST_F(TmclClient, GripperBarsAreAddressedByMotor) {
  Client client(module, clock);
  client.set(gripper_parameter("stall_guard_threshold"), 50, 1);
  EXPECT_EQ(module.requests[0], (Request{1, Command::kSetAxisParameter, 174, 1, 50}));
}

TEST_F(TmclClient, ReplyMayTakeItsTime) {
  module.latency = 80;
  Client client(module, clock);
  EXPECT_EQ(client.get(drive_parameter("actual_position")), 0);
  EXPECT_EQ(module.requests.size(), 1U);
}

TEST_F(TmclClient, LostReplyIsAskedForAgain) {
  module.script = {std::nullopt, std::nullopt};
  Client client(module, clock);
  module.values[{1, 0}] = -7;
  EXPECT_EQ(client.get(drive_parameter("actual_position")), -7);
  EXPECT_EQ(module.requests.size(), 3U);
}

TEST_F(TmclClient, TimeoutNamesDeviceParameterAndTries) {
  module.script.assign(10, std::nullopt);
  Client client(module, clock);
  const auto report = failure([&] { client.get(drive_parameter("actual_motor_voltage")); });
  EXPECT_EQ(report.device, "slave 3 (TMCM-1610)");
  EXPECT_EQ(report.step, "get actual_motor_voltage (151)");
  EXPECT_EQ(report.expected, "a reply within 100 ms, 3 tries");
  EXPECT_EQ(report.found, "none");
  EXPECT_FALSE(report.hint.empty());
  EXPECT_EQ(module.requests.size(), 3U);
  EXPECT_GE(clock.now(), 300ms);
  EXPECT_LT(clock.now(), 350ms);
}

TEST_F(TmclClient, RequestThatCannotBeSentSaysSo) {
  module.refuse_posts = 1'000'000;
  Client client(module, clock);
  EXPECT_EQ(failure([&] { client.get(drive_parameter("actual_speed")); }).found,
            "the request could not be sent");
}

TEST_F(TmclClient, BusyMailboxIsTriedAgain) {
  module.refuse_posts = 20;
  Client client(module, clock);
  EXPECT_EQ(client.get(drive_parameter("actual_speed")), 0);
}

TEST_F(TmclClient, StaleReplyIsNotTakenForTheAnswer) {
  module.values[{1, 0}] = 5;
  module.pending.emplace_back(0, Reply{0, 0, Status::kOk, Command::kGetAxisParameter, 99, {}});
  Client client(module, clock);
  EXPECT_EQ(client.get(drive_parameter("actual_position")), 5);
}

// GET replies do not name their request, so a late reply must not answer the next one.
TEST_F(TmclClient, LateReplyIsWaitedOut) {
  options.tries = 1;
  module.latency = 130;
  module.values[{150, 0}] = 700;
  module.values[{1, 0}] = 5;
  Client client(module, clock, options);
  EXPECT_THROW(client.get(drive_parameter("actual_motor_current")), SetupError);
  module.latency = 2;
  EXPECT_EQ(client.get(drive_parameter("actual_position")), 5);
}

TEST_F(TmclClient, ReplyToTheFirstTryDoesNotAnswerTheNextRequest) {
  options.tries = 2;
  module.latency = 120;
  module.values[{150, 0}] = 700;
  module.values[{1, 0}] = 5;
  Client client(module, clock, options);
  EXPECT_EQ(client.get(drive_parameter("actual_motor_current")), 700);
  module.latency = 2;
  EXPECT_EQ(client.get(drive_parameter("actual_position")), 5);
}

TEST_F(TmclClient, WrongEchoIsDiscardedAndReported) {
  const Reply wrong{0, 0, Status::kOk, Command::kSetAxisParameter, 1999, {}};
  module.script.assign(3, wrong);
  Client client(module, clock);
  const auto report = failure([&] { client.set(drive_parameter("motor_acceleration"), 2000); });
  EXPECT_EQ(report.step, "set motor_acceleration (11) to 2000 rpm/s");
  EXPECT_NE(report.found.find("SAP, status 100 (ok), value 1999"), std::string::npos) << report.found;
}

TEST_F(TmclClient, RefusalIsReportedInWordsAndNotRepeated) {
  const Request request = set(drive_parameter("motor_acceleration"), 2000);
  for (const Status status : {Status::kWrongChecksum, Status::kInvalidValue, Status::kEepromLocked,
                              Status::kProtected, Status::kStoredInProgram}) {
    module.requests.clear();
    module.script = {refusal(request, status)};
    Client client(module, clock);
    failure([&] { client.set(drive_parameter("motor_acceleration"), 2000); });
    EXPECT_TRUE(mentions(describe(status))) << message;
    EXPECT_EQ(module.requests.size(), 1U);
  }
  module.script = {refusal(request, Status::kEepromLocked)};
  Client client(module, clock);
  failure([&] { client.set(drive_parameter("motor_acceleration"), 2000); });
  EXPECT_TRUE(mentions("4321")) << message;
}

TEST_F(TmclClient, RangeIsCheckedBeforeAnythingIsSent) {
  Client client(module, clock);
  const auto report = failure([&] { client.set(drive_parameter("motor_acceleration"), 100001); });
  EXPECT_EQ(report.expected, "0 to 100000 rpm/s");
  EXPECT_EQ(report.found, "100001");
  EXPECT_TRUE(module.requests.empty());
}

TEST_F(TmclClient, AccessIsCheckedBeforeAnythingIsSent) {
  Client client(module, clock);
  EXPECT_THROW(client.set(drive_parameter("actual_speed"), 1), SetupError);
  EXPECT_THROW(client.get(drive_parameter("clear_i2t_exceeded_flag")), SetupError);
  EXPECT_THROW(client.store(drive_parameter("actual_position")), SetupError);
  EXPECT_THROW(client.restore(drive_parameter("target_current")), SetupError);
  EXPECT_TRUE(module.requests.empty());
}

TEST_F(TmclClient, ProtectedParametersNeedApproval) {
  Client client(module, clock);
  EXPECT_THROW(client.set(drive_parameter("maximum_motor_current"), 2850), SetupError);
  EXPECT_THROW(client.store(drive_parameter("maximum_motor_current")), SetupError);
  EXPECT_THROW(client.set_user_variable(15, 1), SetupError);
  EXPECT_TRUE(module.requests.empty());
  EXPECT_EQ(client.get(drive_parameter("maximum_motor_current")), 0) << "reading is free";

  client.approve_protected(1234567);
  client.set(drive_parameter("maximum_motor_current"), 2850);
  client.set_user_variable(15, 1);
  client.lock_protected();
  EXPECT_THROW(client.set(drive_parameter("maximum_motor_current"), 2850), SetupError);
}

TEST_F(TmclClient, PasswordStaysOutOfMessages) {
  const Request request = set(drive_parameter("approve_protected_parameters"), 1234567);
  module.script = {refusal(request, Status::kInvalidValue)};
  Client client(module, clock);
  failure([&] { client.approve_protected(1234567); });
  EXPECT_FALSE(mentions("1234567")) << message;
  EXPECT_THROW(client.set(drive_parameter("maximum_motor_current"), 2850), SetupError) << "not approved";
}

TEST_F(TmclClient, StoreSendsTheValueThatIsKept) {
  Client client(module, clock);
  module.values[{11, 0}] = 1800;
  client.store(drive_parameter("motor_acceleration"));
  EXPECT_EQ(module.requests.back(), (Request{0, Command::kStoreAxisParameter, 11, 0, 1800}));
  client.restore(drive_parameter("motor_acceleration"));
  EXPECT_EQ(module.requests.back().command, Command::kRestoreAxisParameter);
}

TEST_F(TmclClient, UserVariablesAreInBankTwo) {
  Client client(module, clock);
  client.set_user_variable(user_variable::kCalibrated, 1);
  EXPECT_EQ(client.get_user_variable(user_variable::kCalibrated), 1);
  EXPECT_EQ(module.requests[0], (Request{0, Command::kSetGlobalParameter, 16, 2, 1}));
  EXPECT_EQ(module.requests[1], (Request{0, Command::kGetGlobalParameter, 16, 2, 0}));
}

TEST_F(TmclClient, RelativeMoveIsNeverRepeated) {
  module.script.assign(5, std::nullopt);
  Client client(module, clock);
  const Request move{1, Command::kMoveToPosition, static_cast<std::uint8_t>(MoveType::kRelative), 0, -100};
  EXPECT_THROW(client.execute(move, "open the gripper"), SetupError);
  EXPECT_TRUE(failure([&] { client.execute(move, "open the gripper"); }).expected.ends_with("1 try"));
  EXPECT_EQ(module.requests.size(), 2U);
}

TEST_F(TmclClient, VersionIsReadAndUsed) {
  module.version = "1632V200";
  Client client(module, clock);
  EXPECT_EQ(client.version(), (FirmwareVersion{1632, 200}));
  EXPECT_THROW(client.get(drive_parameter("pwm_limit")), SetupError) << "not in firmware 2.0";
  EXPECT_EQ(client.get(drive_parameter("current_pid2_p")), 0);
}

TEST_F(TmclClient, VersionIsAskedForAgainAfterZeros) {
  module.script.assign(40, Reply{});
  Client client(module, clock);
  EXPECT_EQ(client.version(), (FirmwareVersion{1610, 148}));
  EXPECT_EQ(module.requests.size(), 41U);
  EXPECT_LT(clock.now(), 200ms) << "zeros are not waited for";
}

TEST_F(TmclClient, VersionGivesUpAndShowsWhatCame) {
  module.version = "gibberis";
  options.version_tries = 3;
  Client client(module, clock, options);
  const auto report = failure([&] { client.version(); });
  EXPECT_EQ(report.found, "\"gibberis\"");
  EXPECT_EQ(module.requests.size(), 3U);
}

TEST_F(TmclClient, VersionOfASilentModuleIsNotAskedForFiftyTimes) {
  module.script.assign(60, std::nullopt);
  Client client(module, clock);
  const auto report = failure([&] { client.version(); });
  EXPECT_EQ(report.expected, "text such as 1610V148, 3 tries");
  EXPECT_EQ(module.requests.size(), 3U);
}

TEST_F(TmclClient, VersionRefusedIsNotRepeated) {
  module.script = {refusal({0, Command::kGetFirmwareVersion, 0, 0, 0}, Status::kInvalidCommand)};
  Client client(module, clock);
  failure([&] { client.version(); });
  EXPECT_TRUE(mentions("invalid command")) << message;
  EXPECT_EQ(module.requests.size(), 1U);
}

// A transport that never stops delivering must not hold the client.
struct Flood final : Transport {
  bool post(const Request&) noexcept override { return true; }
  std::optional<Reply> poll() noexcept override {
    return Reply{0, 0, Status::kOk, Command::kMotorStop, 0, {}};
  }
  const std::string& name() const noexcept override { return text; }
  std::string transport_fault() const override { return "bus off"; }
  std::string text = "flood";
};

TEST_F(TmclClient, UpTo64StaleRepliesAreDroppedBeforehandAndEightALookAfterwards) {
  for (int i = 0; i < 64 + 8 + 1; ++i)
    module.pending.emplace_back(0, Reply{0, 0, Status::kOk, Command::kMotorStop, 1, {}});
  const Request request = drivers::tmcl::get(drive_parameter("actual_position"));
  const auto now = clock.now();
  const Exchange only_look = exchange(module, clock, request, now, 1ms);
  EXPECT_FALSE(only_look.reply);
  EXPECT_EQ(only_look.discarded, 8);
  EXPECT_EQ(module.pending.size(), 2U) << "one too many, and the answer";
}

TEST_F(TmclClient, FloodOfWrongRepliesEndsAtTheDeadline) {
  Flood flood;
  Client client(flood, clock);
  failure([&] { client.get(drive_parameter("actual_speed")); });
  EXPECT_TRUE(mentions("MST")) << message;
  EXPECT_TRUE(mentions("(bus off)")) << message;
}

TEST(TmclSteadyClock, AdvancesWhileWaiting) {
  SteadyClock clock;
  const auto before = clock.now();
  clock.wait(1ms);
  EXPECT_GE(clock.now() - before, 1ms);
}

}  // namespace tmcl_client_test
}  // namespace drivers::tmcl
