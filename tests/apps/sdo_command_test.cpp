// youbot-bench sdo: objects of a CoE slave as text, on an emulated slave; and its options on the emulated
// youBot, whose boards do not speak CoE.
#include "apps/youbot_bench/sdo.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "drivers/ethercat/bus_error.h"
#include "sim/bus/bus_link.h"
#include "tests/drivers/coe_board.h"
#include "tests/drivers/ethercat_fakes.h"
#include "tests/support/built_paths.h"
#include "tests/support/run_command.h"

namespace youbot_bench {
namespace sdo_command_test {

namespace ethercat = drivers::ethercat;
using ethercat::test::Bytes;
using ethercat::test::contains;
using support::CommandResult;

/// The message of its exception.
template <typename Error, typename Action>
std::string refusal(Action&& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

TEST(SdoObjects, AreNamedInHexadecimalAsTheyArePrinted) {
  EXPECT_EQ(parse_object("0x1018:01"), (ethercat::SdoObject{0x1018, 1}));
  EXPECT_EQ(parse_object("1A00:1f"), (ethercat::SdoObject{0x1A00, 0x1F}));
  EXPECT_EQ(to_string(parse_object("0x1c12:00")), "0x1C12:00");
  for (const char* text : {"", ":", "0x1018", "0x1018:", ":01", "0x1018:100", "0x11018:01", "0x1018:01 ",
                           "-1:0", "0x0x1018:01", "1018:0x01"})
    EXPECT_THROW(parse_object(text), std::invalid_argument) << text;
}

TEST(SdoValues, AreLittleEndianAndReadBack) {
  const std::vector<std::tuple<const char*, const char*, Bytes>> cases{
      {"uint8", "200", {0xC8}},
      {"uint16", "4660", {0x34, 0x12}},
      {"uint32", "305419896", {0x78, 0x56, 0x34, 0x12}},
      {"uint64", "18446744073709551615", Bytes(8, 0xFF)},
      {"int8", "-1", {0xFF}},
      {"int16", "-2", {0xFE, 0xFF}},
      {"int32", "-2147483648", {0, 0, 0, 0x80}},
      {"int64", "-9223372036854775808", {0, 0, 0, 0, 0, 0, 0, 0x80}},
      {"float", "-1.5", {0, 0, 0xC0, 0xBF}},
      {"double", "0.1", {0x9A, 0x99, 0x99, 0x99, 0x99, 0x99, 0xB9, 0x3F}},
      {"string", "EL7211", {'E', 'L', '7', '2', '1', '1'}},
      {"bytes", "01 02 ff", {1, 2, 0xFF}},
  };
  for (const auto& [type, value, bytes] : cases) {
    EXPECT_EQ(sdo_bytes(type, value), bytes) << type;
    EXPECT_EQ(sdo_value(type, bytes), value) << type;
  }
  EXPECT_EQ(sdo_bytes("uint16", "0x1234"), (Bytes{0x34, 0x12}));
  EXPECT_EQ(sdo_bytes("bytes", "0102FF"), (Bytes{1, 2, 0xFF}));
  EXPECT_EQ(sdo_value("string", Bytes{'a', 'b', 0, 0}), "ab") << "padded with zeros";
}

TEST(SdoValues, ThatDoNotFitAreRefused) {
  const std::vector<std::pair<const char*, const char*>> cases{
      {"uint8", "256"},   {"uint8", "-1"},   {"uint16", "65536"}, {"uint32", "4294967296"},
      {"int8", "128"},    {"int8", "-129"},  {"int16", "32768"},  {"int32", "1.0"},
      {"int32", ""},      {"int32", "0x-1"}, {"float", "1e39"},   {"float", "1e-50"},
      {"float", "1,5"},   {"double", "x"},   {"bytes", "123"},    {"bytes", "0g"},
      {"uint8", "0x100"}, {"uint8", "0x"},   {"bytes", "-1"},
  };
  for (const auto& each : cases) {
    const char* const type = each.first;
    const char* const value = each.second;
    EXPECT_TRUE(contains(refusal<std::invalid_argument>([&] { (void)sdo_bytes(type, value); }),
                         std::string("is not a value of type ") + type))
        << type << " " << value;
  }
  EXPECT_TRUE(
      contains(refusal<std::invalid_argument>([] { (void)sdo_bytes("word", "1"); }), "not one of uint8, "));
  EXPECT_TRUE(contains(refusal<std::invalid_argument>([] {
                         (void)sdo_value("uint32", Bytes{1, 2});
                       }),
                       "uint32 has 4 bytes, the object has 2: 01 02"));
  EXPECT_THROW((void)sdo_value("string", Bytes{1, 2}), std::invalid_argument);
}

struct SdoOnABus : testing::Test {
  static sim::bus::SlaveDescription description(const char* name, std::uint16_t protocols) {
    sim::bus::SlaveDescription slave;
    slave.name = name;
    slave.mailbox_out = {.start = 0x1000, .length = ethercat::test::kMailbox};
    slave.mailbox_in = {.start = 0x1080, .length = ethercat::test::kMailbox};
    slave.mailbox_protocols = protocols;
    return slave;
  }
  SdoOnABus() {
    board.server.objects[{0x1018, 1}] = {2, 0, 0, 0};
    board.server.objects[{0x1008, 0}] = {'E', 'L', '7', '2', '1', '1'};
  }
  /// Its output.
  std::string run(const SdoOptions& options) {
    testing::internal::CaptureStdout();
    sdo(link, options);
    return testing::internal::GetCapturedStdout();
  }

  sim::bus::EmulatedBus bus;
  sim::bus::EmulatedSlave& plain = bus.add(description("EL1008", 0));
  ethercat::test::CoeBoard board{bus.add(description("EL7211", sim::bus::mailbox_protocol::kCoE)),
                                 ethercat::test::kMailbox};
  sim::bus::EmulatedWire wire{bus, {.timed = true}};
  sim::bus::BusLink bare{wire};
  ethercat::test::MeddlingLink link{bare};  // counts frames
};

TEST_F(SdoOnABus, AnObjectIsReadAsItsTypeOrAsWhatItMayBe) {
  EXPECT_EQ(run({.slave = 2, .object = "0x1018:01", .type = "uint32"}), "2\n");
  EXPECT_EQ(run({.slave = 2, .object = "0x1018:01"}),
            "slave 2 (EL7211), 0x1018:01: 4 bytes: 02 00 00 00, unsigned 2\n");
  EXPECT_EQ(run({.slave = 2, .object = "0x1008:00"}),
            "slave 2 (EL7211), 0x1008:00: 6 bytes: 45 4c 37 32 31 31, text \"EL7211\"\n");
}

TEST_F(SdoOnABus, AnObjectIsWritten) {
  EXPECT_EQ(run({.slave = 2, .object = "0x6060:00", .type = "int8", .value = "-3"}),
            "slave 2 (EL7211), 0x6060:00: -3 written (fd)\n");
  EXPECT_EQ(board.server.objects.at({0x6060, 0}), (Bytes{0xFD}));
}

TEST_F(SdoOnABus, ARefusalNamesSlaveObjectAndReason) {
  const auto refused = [this](const SdoOptions& options) {
    return refusal<ethercat::BusError>([&] { sdo(link, options); });
  };
  EXPECT_TRUE(contains(refused({.slave = 2, .object = "0x6041:00"}),
                       "slave 2 (EL7211): read object 0x6041:00: refused with abort code 0x06020000"));
  EXPECT_TRUE(contains(refused({.slave = 2, .object = "0x1018:01", .type = "uint32", .value = "1"}),
                       "attempt to write a read-only object"));
  EXPECT_TRUE(contains(refused({.slave = 1, .object = "0x1018:01"}),
                       "slave 1 (EL1008): use CoE: its SII names no CoE among its mailbox protocols"));
}

TEST_F(SdoOnABus, WrongOptionsAreRefusedBeforeAFrameIsSent) {
  EXPECT_TRUE(contains(
      refusal<std::invalid_argument>([&] { sdo(link, {.slave = 2, .object = "0x6060:00", .value = "1"}); }),
      "--type is missing: one of uint8, "));
  EXPECT_TRUE(contains(
      refusal<std::invalid_argument>([&] { sdo(link, {.slave = 2, .object = "0x6060:00", .type = "word"}); }),
      "--type: 'word' is not one of uint8, "));
  EXPECT_EQ(link.frames, 0);
  for (const int slave : {0, 3, -1})
    EXPECT_TRUE(
        contains(refusal<std::invalid_argument>([&] { sdo(link, {.slave = slave, .object = "0x6060:00"}); }),
                 "--slave: " + std::to_string(slave) + " is not 1 to 2"));
}

TEST(SdoCommand, ReadsItsOptions) {
  const CommandResult board = support::run_command(
      support::program("youbot-bench") + " sdo --robot wire --slave 2 --object 0x1018:01 --type uint32");
  EXPECT_EQ(board.exit_code, 3) << board.output;
  EXPECT_TRUE(board.said("slave 2 (TMCM-1632): use CoE: its SII names no CoE")) << board.output;
  const CommandResult object =
      support::run_command(support::program("youbot-bench") + " sdo --robot wire --slave 2 --object 1018");
  EXPECT_EQ(object.exit_code, 2) << object.output;
  EXPECT_TRUE(object.said("'1018' is not an object: INDEX:SUBINDEX")) << object.output;
}

}  // namespace sdo_command_test
}  // namespace youbot_bench
