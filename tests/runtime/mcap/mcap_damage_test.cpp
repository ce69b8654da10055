// Torn and damaged MCAP files: every prefix, every damaged byte, and a program that is killed.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/mcap/compression.h"
#include "runtime/mcap/format.h"
#include "runtime/mcap/mcap_file.h"
#include "runtime/mcap/mcap_reader.h"
#include "runtime/mcap/mcap_writer.h"
#include "runtime/mcap/new_file.h"
#include "runtime/mcap/recover.h"
#include "tests/support/temporary_directory.h"

namespace mcap_damage_test {

using namespace runtime::mcap;
using namespace std::chrono_literals;

struct Messages : Visitor {
  std::vector<std::string> payloads;
  std::size_t attachments = 0;
  void message(const Message& message) override { payloads.emplace_back(message.data); }
  void attachment(const Attachment&) override { ++attachments; }
  bool wants_attachments() const override { return true; }
};

constexpr int kMessages = 12;

/// Three chunks of four messages, metadata and an attachment.
std::string small_file(Compression compression) {
  std::string file;
  McapWriter writer([&file](std::string_view part) { file += part; },
                    {.library = "test", .compression = compression, .chunk_period = 4ms});
  writer.add_metadata("recording", {{"rig", "wheel-1"}});
  const std::uint16_t schema = writer.add_schema("S", "ros2msg", "float64 x");
  const std::uint16_t channel = writer.add_channel(schema, "/x", "cdr", {});
  writer.add_attachment({.name = "a", .media_type = "text/plain", .data = "text"});
  for (std::uint64_t i = 0; i < kMessages; ++i)
    writer.add_message({channel, 0, i * 1'000'000, i * 1'000'000, "message " + std::to_string(i)});
  writer.finish();
  return file;
}

Recovered recovered_from(std::string_view torn, std::string& whole) {
  whole.clear();
  return recover([torn] { return read_from(torn); }, "f.mcap", "test",
                 [&whole](std::string_view part) { whole += part; });
}

std::string problem_of(std::string_view file) {
  Messages messages;
  try {
    read_mcap(read_from(file), "f.mcap", messages);
    return "";
  } catch (const McapError& error) {
    return error.what();
  }
}

class EachCompression : public testing::TestWithParam<Compression> {};
INSTANTIATE_TEST_SUITE_P(, EachCompression,
                         testing::Values(Compression::kNone, Compression::kLz4, Compression::kZstd),
                         [](const auto& each) {
                           return std::string(each.param == Compression::kNone ? "none" : name(each.param));
                         });

TEST_P(EachCompression, AFileTornAtAnyByteGivesAPrefix) {
  const std::string file = small_file(GetParam());
  std::size_t before = 0;
  std::size_t readable = 0;
  for (std::size_t size = 0; size <= file.size(); ++size) {
    const std::string_view torn = std::string_view(file).substr(0, size);
    std::string whole;
    try {
      const Recovered recovered = recovered_from(torn, whole);
      ++readable;
      EXPECT_EQ(recovered.complete(), problem_of(torn).empty());
    } catch (const McapError&) {
      EXPECT_LT(size, 41U) << "magic and header, with their texts, are complete";
      continue;
    }
    Messages messages;
    read_mcap(read_from(whole), "whole", messages);
    ASSERT_GE(messages.payloads.size(), before) << size;
    for (std::size_t i = 0; i < messages.payloads.size(); ++i)
      ASSERT_EQ(messages.payloads[i], "message " + std::to_string(i));
    before = messages.payloads.size();
  }
  EXPECT_EQ(before, static_cast<std::size_t>(kMessages));
  EXPECT_GT(readable, file.size() - 50);
}

TEST_P(EachCompression, ADamagedByteAnywhereIsNoticedOrChangesNothing) {
  const std::string file = small_file(GetParam());
  for (std::size_t at = 0; at < file.size(); ++at)
    for (const char change : {'\x01', '\x80', '\xff'}) {
      std::string damaged = file;
      damaged[at] = static_cast<char>(damaged[at] ^ change);
      std::string whole;
      try {
        const Recovered recovered = recovered_from(damaged, whole);
        Messages messages;
        read_mcap(read_from(whole), "whole", messages);
        // No checksum covers opcode and length of a record, so a chunk may be missing. What is there is
        // right.
        std::size_t next = 0;
        for (const std::string& payload : messages.payloads) {
          while (next < kMessages && payload != "message " + std::to_string(next)) ++next;
          EXPECT_LT(next++, static_cast<std::size_t>(kMessages)) << payload << ", byte " << at;
        }
        if (recovered.complete()) {
          EXPECT_EQ(messages.payloads.size(), static_cast<std::size_t>(kMessages)) << "byte " << at;
        }
      } catch (const McapError& error) {
        EXPECT_NE(std::string(error.what()).find("f.mcap: byte "), std::string::npos);
      }
    }
}

TEST(McapDamage, AChunkWithAWrongChecksumIsLeftOutAndTheNextOnesAreKept) {
  std::string file = small_file(Compression::kNone);
  const std::size_t at = file.find("message 5");
  file[at + 8] = '6';
  EXPECT_NE(problem_of(file).find("checksum of a chunk"), std::string::npos);
  std::string whole;
  const Recovered recovered = recovered_from(file, whole);
  EXPECT_EQ(recovered.messages, 8U);
  EXPECT_EQ(recovered.damaged_records, 2U) << "the chunk, and the checksum of the data section";
  EXPECT_FALSE(recovered.torn_at);
}

TEST(McapDamage, AQuotedTextEndsWithAWholeCharacter) {
  std::string file;
  McapWriter writer([&file](std::string_view part) { file += part; },
                    {.profile = "ros2", .library = "test", .compression = Compression::kNone});
  writer.add_schema("\xff" + std::string(38, 'n') + "ü and more", "ros2msg", "");
  writer.finish();

  std::string whole;
  const Recovered recovered = recovered_from(file, whole);
  ASSERT_EQ(recovered.problems.size(), 1U);
  EXPECT_TRUE(recovered.problems[0].ends_with("written as \\xff" + std::string(38, 'n') + "…"))
      << recovered.problems[0];
}

TEST(McapDamage, TextsThatAreNotUtf8AreMendedAndReportedAndCostNoMessage) {
  std::string file;
  McapWriter writer([&file](std::string_view part) { file += part; },
                    {.profile = "ro\xffs2", .library = "test", .compression = Compression::kNone});
  writer.add_metadata("recording", {{"rig", "wheel\xff"}});
  const std::uint16_t schema = writer.add_schema("Sch\xffma", "ros2msg", "bytes of any kind: \xff");
  const std::uint16_t channel = writer.add_channel(schema, "/\xffx", "cdr", {});
  writer.add_attachment({.name = "\xff.toml", .media_type = "text/plain", .data = "\xff"});
  writer.add_message({channel, 0, 0, 0, "message \xff"});
  writer.finish();

  std::string whole;
  const Recovered recovered = recovered_from(file, whole);
  EXPECT_EQ(recovered.messages, 1U);
  EXPECT_EQ(recovered.damaged_records, 5U);
  ASSERT_EQ(recovered.problems.size(), 5U);
  EXPECT_NE(recovered.problems[2].find("a damaged record: a text is not UTF-8; written as Sch\\xffma"),
            std::string::npos)
      << recovered.problems[2];

  struct Named : Messages {
    std::string names;
    void header(std::string_view profile, std::string_view) override { names += profile; }
    void metadata(std::string_view, const StringMap& map) override { names += ' ' + map.at("rig"); }
    void schema(const Schema& schema) override { names.append(" ").append(schema.name); }
    void channel(const Channel& channel) override { names.append(" ").append(channel.topic); }
    void attachment(const Attachment& attachment) override { names += ' ' + attachment.name; }
  } read;
  read_mcap(read_from(whole), "whole", read);
  EXPECT_EQ(read.names, R"(ro\xffs2 wheel\xff Sch\xffma /\xffx \xff.toml)");
  EXPECT_EQ(read.payloads, std::vector<std::string>{"message \xff"});
}

TEST(McapDamage, MessagesOfATornChunkAreSaved) {
  const std::string file = small_file(Compression::kNone);
  const std::size_t at = file.find("message 6");
  std::string whole;
  const Recovered recovered = recovered_from(std::string_view(file).substr(0, at + 2), whole);
  EXPECT_EQ(recovered.messages, 6U);
  ASSERT_TRUE(recovered.torn_at);
  EXPECT_LT(*recovered.torn_at, at);
}

TEST(McapDamage, UnknownRecordsAreSkipped) {
  std::string file = small_file(Compression::kZstd);
  // Before the last record of the data section, whose checksum is then that of no file of ours: 0 means none.
  const std::string data_end{"\x0f\x04\0\0\0\0\0\0\0", 9};
  const std::size_t at = file.find(data_end);
  file.replace(at + 9, 4, 4, '\0');
  file.insert(at, std::string("\xf0\x03\0\0\0\0\0\0\0abc", 12));
  Messages messages;
  read_mcap(read_from(file), "f.mcap", messages);
  EXPECT_EQ(messages.payloads.size(), static_cast<std::size_t>(kMessages));
  EXPECT_EQ(messages.attachments, 1U);
}

/// Magic, header, and a record with this opcode that states this length.
std::string file_with(char opcode, std::uint64_t length, std::string_view content) {
  std::string file(kMagic);
  file += std::string("\x01\x08\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0", 17);
  file += opcode;
  append_number(file, length);
  return file + std::string(content);
}

TEST(McapDamage, ALyingLengthReservesNoMemory) {
  EXPECT_NE(problem_of(file_with(3, kMaxRecordBytes + 1, "")).find("byte 25: the file ends"),
            std::string::npos);
  EXPECT_NE(problem_of(file_with(3, kMaxRecordBytes, "abc")).find("byte 25: the file ends"),
            std::string::npos);
  EXPECT_NE(problem_of(file_with('\xf0', ~std::uint64_t{0}, "abc")).find("the file ends"), std::string::npos);
}

/// A message, a record that is one byte too large, and another message.
TEST(McapDamage, ARecordThatIsTooLargeIsLeftOutAndTheNextOnesAreKept) {
  std::string before;
  std::string after;
  std::string* part = &before;
  McapWriter writer([&part](std::string_view bytes) { *part += bytes; }, {.library = "test"});
  const std::uint16_t channel = writer.add_channel(0, "/x", "cdr", {});
  writer.add_message({channel, 0, 0, 0, "first"});
  writer.end_chunk();
  before += '\x09';
  append_number(before, kMaxRecordBytes + 1);
  part = &after;
  writer.add_message({channel, 0, 1, 1, "second"});
  writer.end_chunk();
  after += std::string("\x0f\x04\0\0\0\0\0\0\0\0\0\0\0", 13);

  const auto open = [&]() -> ReadBytes {
    return [&before, &after, at = std::uint64_t{0}](char* buffer, std::size_t size) mutable -> std::size_t {
      const std::uint64_t end = before.size() + kMaxRecordBytes + 1;  // of the large record
      std::size_t count = 0;
      if (at >= before.size() && at < end) {
        count = std::min<std::uint64_t>(size, end - at);
        std::fill_n(buffer, count, 'x');
      } else {
        const std::string_view left =
            at < end ? std::string_view(before).substr(at) : std::string_view(after).substr(at - end);
        count = std::min(size, left.size());
        std::copy_n(left.data(), count, buffer);
      }
      at += count;
      return count;
    };
  };
  std::string whole;
  const Recovered recovered =
      recover(open, "f.mcap", "test", [&whole](std::string_view bytes) { whole += bytes; });
  EXPECT_EQ(recovered.messages, 2U);
  EXPECT_EQ(recovered.damaged_records, 1U);
  ASSERT_EQ(recovered.problems.size(), 1U);
  EXPECT_NE(recovered.problems[0].find("at most 268435456"), std::string::npos);
}

TEST(McapDamage, ADamagedMessageCostsNoneOfItsNeighbours) {
  std::string file;
  McapWriter writer([&file](std::string_view bytes) { file += bytes; },
                    {.library = "test", .compression = Compression::kNone});
  const std::uint16_t channel = writer.add_channel(0, "/x", "cdr", {});
  for (int i = 0; i < 3; ++i) writer.add_message({channel, 0, 0, 0, "message " + std::to_string(i)});
  writer.finish();
  file[file.find("message 1") - 22] = 9;  // its channel does not exist
  // Behind opcode, length, both times and the size of the chunk: no checksum.
  const std::size_t chunk = file.find(std::string("\x06", 1), kMagic.size());
  file.replace(chunk + 9 + 8 + 8 + 8, 4, 4, '\0');
  std::string whole;
  const Recovered recovered = recovered_from(file, whole);
  Messages messages;
  read_mcap(read_from(whole), "whole", messages);
  EXPECT_EQ(messages.payloads, (std::vector<std::string>{"message 0", "message 2"}));
  ASSERT_FALSE(recovered.problems.empty());
  EXPECT_NE(recovered.problems[0].find("without its channel 9"), std::string::npos) << recovered.problems[0];
}

TEST(McapDamage, ZerosAtTheEndAreATornFile) {
  const std::string file = small_file(Compression::kZstd);
  const std::size_t end = file.find(std::string("\x0f\x04\0\0\0\0\0\0\0", 9));
  std::string whole;
  const Recovered recovered = recovered_from(file.substr(0, end) + std::string(5000, '\0'), whole);
  EXPECT_EQ(recovered.messages, static_cast<std::uint64_t>(kMessages));
  EXPECT_EQ(recovered.torn_at, end);
}

TEST(McapDamage, AChunkThatContainsMoreThanItStatesIsRefused) {
  const std::string bomb = compress(Compression::kZstd, std::string(1 << 20, 'x'));
  const auto chunk = [&](std::uint64_t stated, std::string_view compression) {
    std::string content(16, '\0');
    append_number(content, stated);
    append_number(content, std::uint32_t{0});
    append_string(content, compression);
    append_number(content, static_cast<std::uint64_t>(bomb.size()));
    content += bomb;
    return problem_of(file_with(6, content.size(), content));
  };
  EXPECT_NE(chunk(1000, "zstd").find("more than the 1000 bytes"), std::string::npos);
  EXPECT_NE(chunk((1 << 20) + 1, "zstd").find("1048576 bytes, which states 1048577"), std::string::npos);
  EXPECT_NE(chunk(kMaxRecordBytes + 1, "zstd").find("at most"), std::string::npos);
  EXPECT_NE(chunk(1 << 20, "lz4").find("lz4: "), std::string::npos);
  EXPECT_NE(chunk(1 << 20, "rar").find("unknown compression 'rar'"), std::string::npos);
}

TEST(McapDamage, OnlyTheFirst20ProblemsAreListed) {
  std::string file(kMagic);
  file += std::string("\x01\x08\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0", 17);
  for (int i = 0; i < 25; ++i) file += std::string("\x03\x01\0\0\0\0\0\0\0x", 10);
  file += std::string("\x0f\x04\0\0\0\0\0\0\0\0\0\0\0", 13);
  std::string whole;
  const Recovered recovered = recovered_from(file, whole);
  EXPECT_EQ(recovered.damaged_records, 25U);
  EXPECT_EQ(recovered.problems.size(), 20U);
}

/// What is left of a file whose writer is killed after a second, with a message per millisecond.
TEST(McapDamage, AKilledProgramLosesAtMostTheLastTenthOfASecond) {
  const support::TemporaryDirectory folder;
  const pid_t child = fork();
  if (child == 0) {
    NewFile file(folder / "killed.mcap");
    McapWriter writer([&file](std::string_view part) { file.write(part); }, {.library = "test"});
    const std::uint16_t channel = writer.add_channel(0, "/x", "cdr", {});
    for (std::uint64_t i = 0; i < 1050; ++i) writer.add_message({channel, 0, i * 1'000'000, 0, "x"});
    raise(SIGKILL);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status));
  const Recovered recovered = recover(folder / "killed.mcap", folder / "whole.mcap");
  EXPECT_EQ(recovered.messages, 1000U);
  EXPECT_TRUE(recovered.torn_at);
  Messages messages;
  read_mcap(read_file(folder / "whole.mcap"), "whole", messages);
  EXPECT_EQ(messages.payloads.size(), 1000U);
}

}  // namespace mcap_damage_test
