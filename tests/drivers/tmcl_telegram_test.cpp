#include "drivers/tmcl/telegram.h"

#include <gtest/gtest.h>

#include <limits>
#include <string_view>
#include <vector>

#include "drivers/tmcl/axis_parameters.h"
#include "drivers/tmcl/firmware_version.h"
#include "drivers/tmcl/gripper.h"
#include "tests/support/no_alloc_guard.h"

namespace drivers::tmcl {
namespace tmcl_telegram_test {

using Bytes = std::vector<std::uint8_t>;

template <typename Array>
Bytes bytes(const Array& array) {
  return {array.begin(), array.end()};
}
Bytes bytes(const CanBytes& can) { return {can.data.begin(), can.data.begin() + can.size}; }
std::array<std::uint8_t, 8> text(std::string_view characters) {
  std::array<std::uint8_t, 8> result{};
  std::copy(characters.begin(), characters.end(), result.begin());
  return result;
}
Reply reply_to(const Request& request, std::int32_t value, Status status = Status::kOk) {
  return {2, request.module, status, request.command, value, {}};
}

// The TMCL manual's example: actual position of motor 2 of module 1, which is 711.
constexpr Request kAskPosition{1, Command::kGetAxisParameter, 1, 2, 0};
const Bytes kAskPositionSerial{0x01, 0x06, 0x01, 0x02, 0x00, 0x00, 0x00, 0x00, 0x0A};
const Bytes kPositionSerial{0x02, 0x01, 0x64, 0x06, 0x00, 0x00, 0x02, 0xC7, 0x36};

TEST(TmclTelegram, SerialRequestMatchesTheManual) {
  EXPECT_EQ(bytes(encode_serial(kAskPosition)), kAskPositionSerial);
}

TEST(TmclTelegram, SerialReplyOfTheManualIsUnderstood) {
  const auto reply = decode_serial_reply(kPositionSerial);
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->host, 2);
  EXPECT_EQ(reply->module, 1);
  EXPECT_EQ(reply->status, Status::kOk);
  EXPECT_EQ(reply->command, Command::kGetAxisParameter);
  EXPECT_EQ(reply->value, 711);
  EXPECT_TRUE(matches(kAskPosition, *reply));
  EXPECT_EQ(bytes(encode_serial(*reply)), kPositionSerial);
}

TEST(TmclTelegram, CanFormIsTheManualsWithoutAddressAndChecksum) {
  EXPECT_EQ(bytes(encode_can(kAskPosition)), (Bytes{0x06, 0x01, 0x02, 0x00, 0x00, 0x00, 0x00}));
  const Bytes data{0x01, 0x64, 0x06, 0x00, 0x00, 0x02, 0xC7};
  const auto reply = decode_can_reply(2, data);
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->host, 2);
  EXPECT_EQ(reply->value, 711);
  EXPECT_EQ(bytes(encode_can(*reply)), data);
}

TEST(TmclTelegram, MotionExamplesOfTheManual) {
  EXPECT_EQ(bytes(encode_mailbox(Request{1, Command::kRotateRight, 0, 0, 350})),
            (Bytes{0x01, 0x01, 0x00, 0x00, 0x00, 0x00, 0x01, 0x5E}));
  EXPECT_EQ(bytes(encode_mailbox(Request{1, Command::kRotateLeft, 0, 0, 1200})),
            (Bytes{0x01, 0x02, 0x00, 0x00, 0x00, 0x00, 0x04, 0xB0}));
}

// The manual prints 62 for this telegram; the eight bytes add up to 63.
TEST(TmclTelegram, ChecksumIsTheSumAndNotTheManualsMisprint) {
  const SerialBytes telegram = encode_serial(Request{1, Command::kRotateRight, 0, 2, 350});
  EXPECT_EQ(bytes(telegram), (Bytes{0x01, 0x01, 0x00, 0x02, 0x00, 0x00, 0x01, 0x5E, 0x63}));
  Bytes misprint = bytes(telegram);
  misprint.back() = 0x62;
  EXPECT_FALSE(decode_serial_request(misprint));
}

TEST(TmclTelegram, YoubotMailboxExamples) {
  EXPECT_EQ(bytes(encode_mailbox(set(drive_parameter("clear_motor_controller_timeout_flag"), 1))),
            (Bytes{0x00, 0x05, 0x9E, 0x00, 0x00, 0x00, 0x00, 0x01}));
  EXPECT_EQ(bytes(encode_mailbox(set(drive_parameter("actual_position"), 0))),
            (Bytes{0x00, 0x05, 0x01, 0x00, 0x00, 0x00, 0x00, 0x00}));
  EXPECT_EQ(bytes(encode_mailbox(get(drive_parameter("error_and_status")))),
            (Bytes{0x00, 0x06, 0x9C, 0x00, 0x00, 0x00, 0x00, 0x00}));
  EXPECT_EQ(bytes(encode_mailbox(gripper_open_by(0, 66000))),
            (Bytes{0x01, 0x04, 0x01, 0x00, 0xFF, 0xFE, 0xFE, 0x30}));
  EXPECT_EQ(bytes(encode_mailbox(get_user_variable(user_variable::kCalibrated))),
            (Bytes{0x00, 0x0A, 0x10, 0x02, 0x00, 0x00, 0x00, 0x00}));
}

// Small values are the ones a master that looks for a standard mailbox header loses.
TEST(TmclTelegram, EveryKindOfValueSurvivesEveryCarrier) {
  for (const std::int32_t value : {0, 1, -1, 3, 255, 256, 65535, 65536, -65536, -66000, 0x030000, 0x7FFFFFFF,
                                   std::numeric_limits<std::int32_t>::min()}) {
    const Request request{0, Command::kSetAxisParameter, 155, 1, value};
    EXPECT_EQ(decode_mailbox_request(encode_mailbox(request)), request);
    EXPECT_EQ(decode_serial_request(encode_serial(request)), request);
    EXPECT_EQ(decode_can_request(0, bytes(encode_can(request))), request);

    const Reply reply = reply_to(request, value);
    EXPECT_EQ(decode_mailbox_reply(encode_mailbox(reply))->value, value);
    EXPECT_EQ(decode_serial_reply(encode_serial(reply))->value, value);
    EXPECT_EQ(decode_can_reply(2, bytes(encode_can(reply)))->value, value);
  }
}

TEST(TmclTelegram, EveryPrefixIsMalformed) {
  for (std::size_t n = 0; n < kSerialBytes; ++n) {
    const auto serial = std::span(kPositionSerial).first(n);
    EXPECT_FALSE(decode_serial_reply(serial)) << n;
    EXPECT_FALSE(decode_serial_request(serial)) << n;
    if (n < kMailboxBytes) {
      EXPECT_FALSE(decode_mailbox_reply(serial)) << n;
      EXPECT_FALSE(decode_mailbox_request(serial)) << n;
    }
    if (n < 7) {
      EXPECT_FALSE(decode_can_reply(2, serial)) << n;
      EXPECT_FALSE(decode_can_request(1, serial)) << n;
    }
  }
  Bytes long_serial = kPositionSerial;
  long_serial.push_back(0);
  EXPECT_FALSE(decode_serial_reply(long_serial));
  EXPECT_FALSE(decode_can_reply(2, kPositionSerial)) << "nine bytes";
}

TEST(TmclTelegram, SerialBytesThatChangedAreRefused) {
  for (std::size_t i = 0; i < kSerialBytes; ++i) {
    Bytes spoilt = kPositionSerial;
    spoilt[i] ^= 0x10;
    EXPECT_FALSE(decode_serial_reply(spoilt)) << i;
  }
}

TEST(TmclTelegram, MailboxIsReadInFullLength) {
  Bytes mailbox(128, 0xAA);
  std::copy_n(kPositionSerial.begin(), 8, mailbox.begin());
  EXPECT_EQ(decode_mailbox_reply(mailbox)->value, 711);
}

TEST(TmclTelegram, CanReplyMayCarryTheChecksum) {
  const Bytes data{0x01, 0x64, 0x06, 0x00, 0x00, 0x02, 0xC7, 0x36};
  EXPECT_EQ(decode_can_reply(2, data)->value, 711);
}

TEST(TmclTelegram, VersionTextIsAskedForWithEightCanBytes) {
  const Request ask{0, Command::kGetFirmwareVersion, 0, 0, 0};
  EXPECT_EQ(encode_can(ask).size, 8);
  EXPECT_EQ(encode_can(Request{0, Command::kGetFirmwareVersion, 1, 0, 0}).size, 7);
  const auto reply = decode_can_reply(2, text("1610V148"));
  ASSERT_TRUE(reply);
  EXPECT_TRUE(matches(ask, *reply));
  EXPECT_TRUE(accepted(ask, *reply));
}

TEST(TmclTelegram, SetMustEchoItsValueAndGetNeedNot) {
  const Request set_current = set(drive_parameter("maximum_motor_current"), 2850);
  EXPECT_TRUE(matches(set_current, reply_to(set_current, 2850)));
  EXPECT_FALSE(matches(set_current, reply_to(set_current, 2849)));
  const Request get_current = get(drive_parameter("maximum_motor_current"));
  EXPECT_TRUE(matches(get_current, reply_to(get_current, 2850)));
  EXPECT_TRUE(matches(get_current, reply_to(get_current, 0)));
  EXPECT_FALSE(matches(get_current, reply_to(set_current, 2850))) << "another command";
}

TEST(TmclTelegram, GripperAndMotionNeedNotEcho) {
  const Request open = gripper_open_by(1, 100);
  EXPECT_TRUE(matches(open, reply_to(open, 0)));
  const Request threshold = set(gripper_parameter("stall_guard_threshold"), 50);
  EXPECT_TRUE(matches(threshold, reply_to(threshold, 0)));
}

TEST(TmclTelegram, RefusalIsAnAnswerWhateverItsValue) {
  const Request request = set(drive_parameter("motor_poles"), 16);
  for (const Status status :
       {Status::kWrongChecksum, Status::kInvalidCommand, Status::kWrongType, Status::kInvalidValue,
        Status::kEepromLocked, Status::kNotAvailable, Status::kProtected, Status::kStoredInProgram}) {
    const Reply reply = reply_to(request, 0, status);
    EXPECT_TRUE(matches(request, reply));
    EXPECT_FALSE(accepted(request, reply));
    EXPECT_STRNE(describe(status), "unknown status");
  }
  EXPECT_FALSE(matches(request, reply_to(request, 16, static_cast<Status>(7))));
}

TEST(TmclTelegram, EmptyMailboxAnswersNothing) {
  const Reply zeros = *decode_mailbox_reply(MailboxBytes{});
  EXPECT_FALSE(matches(get(drive_parameter("actual_position")), zeros));
  EXPECT_FALSE(matches(Request{0, Command::kGetFirmwareVersion, 0, 0, 0}, zeros));
}

TEST(TmclTelegram, CodecsDoNotAllocate) {
  const support::NoAllocGuard guard;
  const Request request = set(drive_parameter("target_current"), -700);
  const auto reply = decode_mailbox_reply(encode_mailbox(reply_to(request, -700)));
  const bool matched = reply && matches(request, *reply);
  const long violations = guard.violations();
  EXPECT_TRUE(matched);
  EXPECT_EQ(violations, 0);
}

struct VersionCase {
  const char* text;
  FirmwareVersion version;
};

TEST(TmclVersion, KnownFormsAreRead) {
  for (const VersionCase& example :
       {VersionCase{"1610V148", {1610, 148}}, VersionCase{"1632V148", {1632, 148}},
        VersionCase{"174V1.48", {174, 148}}, VersionCase{"841V1.48", {841, 148}},
        VersionCase{"1610V200", {1610, 200}}, VersionCase{"174V148", {174, 148}},
        VersionCase{"174V148 ", {174, 148}}, VersionCase{"KR842V20", {842, 200}},
        VersionCase{"842V2.0", {842, 200}},
        VersionCase{"\x02"
                    "842V2.0",
                    {842, 200}},
        VersionCase{"842V1.48", {842, 148}}}) {
    FirmwareVersion version;
    EXPECT_EQ(parse_version(text(example.text), version), VersionText::kValid) << example.text;
    EXPECT_EQ(version, example.version) << example.text;
  }
}

TEST(TmclVersion, OnlyTheTwoGenerationsAreSupported) {
  EXPECT_EQ(supported_firmware({1610, 148}), Firmware::k148);
  EXPECT_EQ(supported_firmware({1632, 200}), Firmware::k200);
  EXPECT_EQ(supported_firmware({1610, 147}), std::nullopt);
}

TEST(TmclVersion, ZerosMeanNoAnswerYet) {
  FirmwareVersion version;
  EXPECT_EQ(parse_version(text(""), version), VersionText::kNoAnswerYet);
}

TEST(TmclVersion, EveryPrefixIsMalformed) {
  for (const std::string_view whole : {"1610V148", "174V1.48", "1610V200"}) {
    for (std::size_t n = 0; n < whole.size(); ++n) {
      const std::vector<std::uint8_t> part(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(n));
      FirmwareVersion version{1, 2};
      EXPECT_EQ(parse_version(part, version), VersionText::kMalformed) << whole.substr(0, n);
      EXPECT_EQ(version, (FirmwareVersion{1, 2})) << "untouched";
    }
  }
}

TEST(TmclVersion, OtherTextIsMalformed) {
  for (const char* wrong : {"V148", "1610148", "1610V14x", "x610V148", "0000V148", "161OV148", "174V1..4",
                            "174V.148", "1V1481", "1610V20", "KR", "K", "\x02", "99999V1"}) {
    FirmwareVersion version;
    EXPECT_EQ(parse_version(text(wrong), version), VersionText::kMalformed) << wrong;
  }
}

}  // namespace tmcl_telegram_test
}  // namespace drivers::tmcl
