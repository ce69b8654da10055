// MCAP records and CDR payloads, byte by byte. The bytes are from the specification, put together by hand,
// with checksums by zlib; those of a payload are from @foxglove/rosmsg2-serialization 3.1.0.
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/mcap/cdr.h"
#include "runtime/mcap/crc32.h"
#include "runtime/mcap/mcap_writer.h"
#include "runtime/mcap/ros_messages.h"
#include "tests/support/hex.h"

namespace mcap_bytes_test {

using namespace runtime::mcap;
using support::hex;

/// "0a 62": blanks are for people.
std::string bytes(std::string_view text) {
  std::string result;
  std::string digits;
  for (const char c : text) {
    if (c == ' ' || c == '\n') continue;
    digits += c;
    if (digits.size() < 2) continue;
    result += static_cast<char>(std::stoi(digits, nullptr, 16));
    digits.clear();
  }
  return result;
}

TEST(Crc32, IsThatOfZlib) {
  EXPECT_EQ(crc32(""), 0U);
  EXPECT_EQ(crc32("123456789"), 0xCBF43926U) << "the check value of the CRC catalogue";
  EXPECT_EQ(crc32("56789", crc32("1234")), 0xCBF43926U) << "piece by piece";
}

TEST(McapWriter, AFileWithoutMessagesHasTheBytesOfTheSpecification) {
  std::string file;
  McapWriter writer([&file](std::string_view part) { file += part; }, {.profile = "", .library = "a"});
  writer.finish();
  const std::string data = bytes(
      "89 4d 43 41 50 30 0d 0a"                     // magic
      "01 0900000000000000 00000000 01000000 61");  // header
  EXPECT_EQ(hex(file.substr(0, 26)), hex(data));
  EXPECT_EQ(hex(file.substr(26)),
            hex(bytes("0f 0400000000000000 f586969b"                                 // data end
                      "0b 2e00000000000000 0000000000000000 0000 00000000 00000000"  // statistics
                      "   00000000 00000000 0000000000000000 0000000000000000 00000000"
                      "0e 1100000000000000 0b 2700000000000000 3700000000000000"        // summary offset
                      "02 1400000000000000 2700000000000000 5e00000000000000 ea8f56d1"  // footer
                      "89 4d 43 41 50 30 0d 0a")));
}

TEST(McapWriter, AMessageIsInAChunkWithItsIndex) {
  std::string file;
  McapWriter writer([&file](std::string_view part) { file += part; },
                    {.profile = "", .library = "", .compression = Compression::kNone});
  const std::uint16_t schema = writer.add_schema("S", "e", "d");
  const std::uint16_t channel = writer.add_channel(schema, "t", "m", {{"k", "v"}});
  const std::size_t before = file.size();
  EXPECT_EQ(hex(file.substr(25)), hex(bytes("03 1100000000000000 0100 01000000 53 01000000 65 01000000 64"
                                            "04 1c00000000000000 0100 0100 01000000 74 01000000 6d"
                                            "   0a000000 01000000 6b 01000000 76")));
  writer.add_message({channel, 2, 3, 4, "xy"});
  EXPECT_EQ(file.size(), before) << "the chunk is not complete";
  writer.end_chunk();
  EXPECT_EQ(hex(file.substr(before)),
            hex(bytes("06 4900000000000000 0300000000000000 0300000000000000 2100000000000000 d6582eeb"
                      "   00000000 2100000000000000"
                      "   05 1800000000000000 0100 02000000 0300000000000000 0400000000000000 7879"
                      "07 1600000000000000 0100 10000000 0300000000000000 0000000000000000")));
}

TEST(McapWriter, AChunkEndsAfterItsPeriodOrItsSize) {
  std::vector<std::size_t> parts;
  McapWriter writer([&parts](std::string_view part) { parts.push_back(part.size()); },
                    {.chunk_period = std::chrono::nanoseconds(100), .chunk_bytes = 1000});
  const std::uint16_t channel = writer.add_channel(0, "t", "m", {});
  const std::size_t begun = parts.size();
  for (const std::uint64_t time_ns : {1000U, 1099U}) writer.add_message({channel, 0, time_ns, time_ns, "x"});
  EXPECT_EQ(parts.size(), begun);
  writer.add_message({channel, 0, 1100, 1100, "x"});
  EXPECT_EQ(parts.size(), begun + 1) << "100 ns after the first message";
  writer.add_message({channel, 0, 1101, 1101, std::string(1000, 'x')});
  EXPECT_EQ(parts.size(), begun + 2) << "1000 bytes";
}

const std::string kJointStateBytes =
    "000100000500000080b2e60e05000000626173650000000002000000020000006100000008000000776865656c5f3200"
    "02000000000000000000f83f00000000000000c00000000002000000000000000000d03ffca9f1d24d62503f";

TEST(Cdr, AJointStateHasTheBytesOfAnotherWriter) {
  const JointState state{{5, 250'000'000}, "base", {"a", "wheel_2"}, {1.5, -2}, {}, {0.25, 1e-3}};
  CdrWriter cdr;
  write(cdr, state);
  EXPECT_EQ(hex(cdr.payload()), kJointStateBytes);
  const JointState read = read_joint_state(bytes(kJointStateBytes));
  EXPECT_EQ(read.stamp.ns(), 5'250'000'000);
  EXPECT_EQ(read.frame_id, "base");
  EXPECT_EQ(read.name, state.name);
  EXPECT_EQ(read.position_rad, state.position_rad);
  EXPECT_TRUE(read.velocity_rad_per_s.empty());
  EXPECT_EQ(read.effort_Nm, state.effort_Nm);
}

TEST(Cdr, BigEndianIsRead) {
  const std::string payload = bytes("0000 0000 00000005 00000000 3ff8000000000000");
  CdrReader cdr(payload);
  EXPECT_EQ(cdr.int32("a"), 5);
  EXPECT_EQ(cdr.float64("b"), 1.5);
}

TEST(Cdr, AnotherEncodingIsRefused) {
  EXPECT_THROW(CdrReader(bytes("0007 0000")), BadRecord) << "XCDR version 2";
  EXPECT_THROW(CdrReader(bytes("0001")), BadRecord);
}

TEST(Cdr, EveryTornPayloadIsRefused) {
  const std::string whole = bytes(kJointStateBytes);
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_THROW(read_joint_state(std::string_view(whole).substr(0, size)), BadRecord) << size;
}

TEST(Cdr, ALyingCountIsRefusedBeforeMemoryIsReserved) {
  std::string lying = bytes(kJointStateBytes);
  lying[24] = lying[25] = lying[26] = lying[27] = '\xff';  // number of names
  EXPECT_THROW(read_joint_state(lying), BadRecord);
}

TEST(RecordDefinition, HasAFieldNameOfRosForEachColumn) {
  EXPECT_EQ(
      record_definition({"time_s", "torque_command_Nm", "2nd", "a b", "a__b_", "µ"}),
      "float64 time_s\nfloat64 torque_command_nm\nfloat64 c2nd\nfloat64 a_b\nfloat64 a_b_2\nfloat64 c\n");
}

}  // namespace mcap_bytes_test
