// The capture in Wireshark's format: the blocks of draft-ietf-opsawg-pcapng, parsed here byte by byte, and by
// tshark where it is installed.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "drivers/ethercat/bus_error.h"
#include "drivers/ethercat/frame.h"
#include "drivers/ethercat/pcap_ring.h"
#include "tests/support/no_alloc_guard.h"
#include "tests/support/run_command.h"
#include "tests/support/skip.h"
#include "tests/support/temporary_directory.h"

namespace drivers::ethercat {
namespace ethercat_pcap_ring_test {

using std::chrono::nanoseconds;
using Bytes = std::vector<std::uint8_t>;
using namespace std::chrono_literals;

nanoseconds fake_now{};
nanoseconds fake_clock() noexcept { return fake_now; }

struct Block {
  std::uint32_t type = 0;
  Bytes body;
};

struct Packet {
  std::uint64_t stamp_ns = 0;
  std::uint32_t original = 0;
  Bytes bytes;
  std::uint32_t flags = 0;
};

/// Both lengths of each block must agree and the blocks must fill the file.
std::vector<Block> blocks_of(const Bytes& file) {
  std::vector<Block> blocks;
  std::size_t at = 0;
  while (at + 12 <= file.size()) {
    const auto length = load_le<std::uint32_t>(&file[at + 4]);
    EXPECT_EQ(length % 4, 0U);
    if (length < 12 || at + length > file.size()) break;
    EXPECT_EQ(load_le<std::uint32_t>(&file[at + length - 4]), length);
    blocks.push_back({load_le<std::uint32_t>(&file[at]),
                      Bytes(file.begin() + static_cast<std::ptrdiff_t>(at) + 8,
                            file.begin() + static_cast<std::ptrdiff_t>(at + length) - 4)});
    at += length;
  }
  EXPECT_EQ(at, file.size());
  return blocks;
}

std::map<std::uint16_t, Bytes> options_of(const Bytes& body, std::size_t at) {
  std::map<std::uint16_t, Bytes> options;
  while (at + 4 <= body.size()) {
    const auto code = load_le<std::uint16_t>(&body[at]);
    const auto length = load_le<std::uint16_t>(&body[at + 2]);
    if (code == 0) {
      EXPECT_EQ(length, 0);
      EXPECT_EQ(at + 4, body.size());
      return options;
    }
    const auto begin = body.begin() + static_cast<std::ptrdiff_t>(at) + 4;
    options[code] = Bytes(begin, begin + length);
    at += 4 + (std::size_t{length} + 3) / 4 * 4;
  }
  ADD_FAILURE() << "the options do not end";
  return options;
}

Packet packet_of(const Block& block) {
  EXPECT_EQ(block.type, 6U);
  EXPECT_EQ(load_le<std::uint32_t>(&block.body[0]), 0U) << "interface";
  Packet packet;
  packet.stamp_ns =
      std::uint64_t{load_le<std::uint32_t>(&block.body[4])} << 32 | load_le<std::uint32_t>(&block.body[8]);
  const auto kept = load_le<std::uint32_t>(&block.body[12]);
  packet.original = load_le<std::uint32_t>(&block.body[16]);
  packet.bytes.assign(block.body.begin() + 20, block.body.begin() + 20 + kept);
  const auto options = options_of(block.body, 20 + (kept + 3) / 4 * 4);
  packet.flags = load_le<std::uint32_t>(options.at(2).data());
  return packet;
}

Bytes written(const PcapRing& ring, nanoseconds offset = {}, const std::string& comment = {}) {
  std::ostringstream out;
  ring.write(out, offset, comment);
  const std::string text = out.str();
  return {text.begin(), text.end()};
}

std::vector<Packet> packets_of(const PcapRing& ring, nanoseconds offset = {}) {
  std::vector<Packet> packets;
  for (const Block& block : blocks_of(written(ring, offset)))
    if (block.type == 6) packets.push_back(packet_of(block));
  return packets;
}

std::string text_of(const Bytes& bytes) { return {bytes.begin(), bytes.end()}; }

TEST(PcapRing, WritesTheBytesOfThePcapngSpecification) {
  fake_now = 0x1'2345'6789ns;
  PcapRing ring({.interface = "eth0", .frames = 4, .bytes = 64, .clock = fake_clock});
  ring.frame(Direction::kReceived, Bytes{0xDE, 0xAD, 0xBE, 0xEF, 0x01});
  const Bytes file = written(ring, 0x1'0000'0000ns, "");

  const std::vector<Block> blocks = blocks_of(file);
  ASSERT_EQ(blocks.size(), 3U);
  EXPECT_EQ(Bytes(file.begin(), file.begin() + 4), (Bytes{0x0A, 0x0D, 0x0D, 0x0A}));
  EXPECT_EQ(Bytes(blocks[0].body.begin(), blocks[0].body.begin() + 16),
            (Bytes{0x4D, 0x3C, 0x2B, 0x1A, 1, 0, 0, 0, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF}));

  // Interface: Ethernet, snap length 64, name, resolution 10^-9, no frame check sequence.
  EXPECT_EQ(blocks[1].type, 1U);
  EXPECT_EQ(blocks[1].body, (Bytes{1,  0, 0, 0, 64,  0,   0,   0,    //
                                   2,  0, 4, 0, 'e', 't', 'h', '0',  //
                                   9,  0, 1, 0, 9,   0,   0,   0,    //
                                   13, 0, 1, 0, 0,   0,   0,   0,   0, 0, 0, 0}));

  // Packet: interface 0, high and low half of the stamp, 5 of 5 bytes, padding, inbound.
  EXPECT_EQ(blocks[2].type, 6U);
  EXPECT_EQ(blocks[2].body,
            (Bytes{0,    0,    0,    0,    2,    0, 0, 0, 0x89, 0x67, 0x45, 0x23, 5, 0, 0, 0, 5, 0, 0, 0,  //
                   0xDE, 0xAD, 0xBE, 0xEF, 0x01, 0, 0, 0,                                                  //
                   2,    0,    4,    0,    1,    0, 0, 0, 0,    0,    0,    0}));
}

TEST(PcapRing, DistinguishesSentFromReceived) {
  PcapRing ring({.interface = "eth0", .frames = 2, .bytes = 8});
  ring.frame(Direction::kSent, Bytes{1});
  ring.frame(Direction::kReceived, Bytes{2});
  const std::vector<Packet> packets = packets_of(ring);
  ASSERT_EQ(packets.size(), 2U);
  EXPECT_EQ(packets[0].flags, 2U);  // outbound
  EXPECT_EQ(packets[1].flags, 1U);  // inbound
}

TEST(PcapRing, KeepsTheLastFramesInOrder) {
  constexpr std::size_t kFrames = 5;
  for (std::uint8_t sent = 0; sent < 14; ++sent) {
    PcapRing ring({.interface = "eth0", .frames = kFrames, .bytes = 8, .clock = fake_clock});
    for (std::uint8_t i = 0; i < sent; ++i) {
      fake_now = nanoseconds(1000 + i);
      ring.frame(Direction::kSent, Bytes{i});
    }
    const std::vector<Packet> packets = packets_of(ring);
    ASSERT_EQ(packets.size(), std::min<std::size_t>(sent, kFrames));
    EXPECT_EQ(ring.size(), packets.size());
    EXPECT_EQ(ring.seen(), sent);
    for (std::size_t k = 0; k < packets.size(); ++k) {
      const std::size_t i = sent - packets.size() + k;
      EXPECT_EQ(packets[k].bytes, Bytes{static_cast<std::uint8_t>(i)});
      EXPECT_EQ(packets[k].stamp_ns, 1000 + i);
    }
  }
}

TEST(PcapRing, CutsLongFramesAndSaysHowLongTheyWere) {
  PcapRing ring({.interface = "eth0", .frames = 2, .bytes = 16});
  Bytes frame(1514);
  for (std::size_t i = 0; i < frame.size(); ++i) frame[i] = static_cast<std::uint8_t>(i);
  ring.frame(Direction::kSent, frame);
  ring.frame(Direction::kReceived, Bytes{});
  const std::vector<Packet> packets = packets_of(ring);
  ASSERT_EQ(packets.size(), 2U);
  EXPECT_EQ(packets[0].original, 1514U);
  EXPECT_EQ(packets[0].bytes, Bytes(frame.begin(), frame.begin() + 16));
  EXPECT_EQ(packets[1].original, 0U);
  EXPECT_EQ(packets[1].bytes, Bytes{});
}

TEST(PcapRing, SaysWhyItWasWrittenAndHowMuchIsMissing) {
  PcapRing ring({.interface = "eth0", .frames = 2, .bytes = 16});
  for (int i = 0; i < 7; ++i) ring.frame(Direction::kSent, Bytes{1});
  const std::vector<Block> blocks = blocks_of(written(ring, {}, "slave 3 lost"));
  EXPECT_EQ(text_of(options_of(blocks[0].body, 16).at(1)), "slave 3 lost; the last 2 of 7 frames");
}

TEST(PcapRing, SurvivesACommentLongerThanAnOption) {
  PcapRing ring({.interface = "eth0", .frames = 2, .bytes = 16});
  EXPECT_EQ(blocks_of(written(ring, {}, std::string(70'000, 'x'))).size(), 2U);
}

TEST(PcapRing, StopsSomeFramesAfterTheFault) {
  PcapRing ring({.interface = "eth0", .frames = 8, .bytes = 8});
  for (std::uint8_t i = 0; i < 4; ++i) ring.frame(Direction::kSent, Bytes{i});
  ring.stop_after(2);
  EXPECT_FALSE(ring.stopped());
  for (std::uint8_t i = 4; i < 10; ++i) {
    ring.frame(Direction::kSent, Bytes{i});
    ring.stop_after(5);  // the first fault counts
  }
  EXPECT_TRUE(ring.stopped());
  const std::vector<Packet> packets = packets_of(ring);
  ASSERT_EQ(packets.size(), 6U);
  EXPECT_EQ(packets.back().bytes, Bytes{5});

  ring.resume();
  EXPECT_FALSE(ring.stopped());
  EXPECT_EQ(ring.size(), 0U);
  ring.frame(Direction::kSent, Bytes{99});
  ASSERT_EQ(packets_of(ring).size(), 1U);
  ring.stop_after(0);
  EXPECT_TRUE(ring.stopped());
}

TEST(PcapRing, OnceStoppedAnotherThreadWritesWhileTheCycleGoesOn) {
  PcapRing ring({.interface = "eth0", .frames = 64, .bytes = 64});
  std::thread writer([&] {
    while (!ring.stopped()) std::this_thread::yield();
    EXPECT_EQ(packets_of(ring).size(), 64U);
  });
  for (int i = 0; i < 100; ++i) ring.frame(Direction::kSent, Bytes(60, 1));
  ring.stop_after(10);
  for (int i = 0; i < 10'000; ++i) ring.frame(Direction::kReceived, Bytes(60, 2));
  writer.join();
}

TEST(PcapRing, RecordingDoesNotAllocateOrLock) {
  PcapRing ring({.interface = "eth0", .frames = 16});
  const Bytes frame(1522);
  const support::NoAllocGuard guard;
  for (int i = 0; i < 100; ++i) {
    ring.frame(Direction::kSent, frame);
    ring.frame(Direction::kReceived, frame);
  }
  ring.stop_after(3);
  for (int i = 0; i < 5; ++i) ring.frame(Direction::kSent, frame);
  ring.resume();
  EXPECT_EQ(guard.violations(), 0);
}

TEST(PcapRing, RefusesToBeEmpty) {
  EXPECT_THROW(PcapRing({.interface = "eth0", .frames = 0}), std::invalid_argument);
  EXPECT_THROW(PcapRing({.interface = "eth0", .frames = 4, .bytes = 0}), std::invalid_argument);
}

TEST(PcapRing, StampsLieOnTheWallClock) {
  PcapRing ring({.interface = "eth0", .frames = 4});
  const auto wall = [] {
    return static_cast<std::uint64_t>(
        std::chrono::duration_cast<nanoseconds>(std::chrono::system_clock::now().time_since_epoch()).count());
  };
  std::uint64_t before = 0;
  std::uint64_t after = 0;
  std::vector<Packet> packets;
  std::int64_t step_ns = 0;
  do {  // again when the wall clock was set meanwhile
    const auto offset = wall_clock_minus_monotonic();
    before = wall();
    ring.frame(Direction::kSent, Bytes(60));
    after = wall();
    packets = packets_of(ring, wall_clock_minus_monotonic());
    step_ns = std::chrono::nanoseconds(wall_clock_minus_monotonic() - offset).count();
  } while (std::abs(step_ns) > 500'000);
  // A clock under NTP runs up to 500 ppm off the other, and three readings of it take less than 1 ms.
  EXPECT_GE(packets.back().stamp_ns + 1'000'000, before);
  EXPECT_LE(packets.back().stamp_ns, after + 1'000'000);
}

/// A cycle as the master sends it: process data, AL status, supervision, a TMCL mailbox.
void record_cycle(PcapRing& ring, std::uint8_t index) {
  FrameWriter writer;
  (void)writer.add(Command::kLrw, index, 0, 75);
  (void)writer.add(Command::kBrd, index, address_of(0, 0x0130), 2);
  (void)writer.add(Command::kFprd, index, address_of(0x1002, 0x0300), 20);
  const Datagram mailbox = writer.add(Command::kFpwr, index, address_of(0x1003, 0x1000), 8);
  mailbox.data[1] = 6;  // TMCL GAP
  ring.frame(Direction::kSent, writer.bytes());
  store_le<std::uint16_t>(mailbox.counter, 1);
  Bytes back(writer.bytes().begin(), writer.bytes().end());
  back[6] |= kReturnedBit;
  ring.frame(Direction::kReceived, back);
}

TEST(PcapRing, WritesAFile) {
  const support::TemporaryDirectory directory;
  PcapRing ring({.interface = "eth0", .frames = 8});
  for (std::uint8_t i = 0; i < 3; ++i) record_cycle(ring, i);
  const std::string path = directory / "fault.pcapng";
  ring.write(path, "first");
  ring.write(path);  // replaces it
  std::ifstream file(path, std::ios::binary);
  const Bytes bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  EXPECT_EQ(blocks_of(bytes).size(), 2U + 6U);
}

TEST(PcapRing, SaysWhereItCouldNotWrite) {
  PcapRing ring({.interface = "eth0", .frames = 8});
  try {
    ring.write("/nowhere/fault.pcapng");
    FAIL();
  } catch (const BusError& error) {
    EXPECT_STREQ(error.what(), "/nowhere/fault.pcapng: write the capture of eth0: No such file or directory");
  }
}

TEST(PcapRing, NoticesAFullDisk) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "needs /dev/full";
  PcapRing ring({.interface = "eth0", .frames = 64});
  for (std::uint8_t i = 0; i < 32; ++i) record_cycle(ring, i);
  EXPECT_THROW(ring.write("/dev/full"), BusError);
}

TEST(PcapRing, TsharkDecodesEveryFrame) {
  SKIP_UNLESS(std::system("command -v tshark > /dev/null 2>&1") == 0, "tshark is not installed");
  const support::TemporaryDirectory directory;
  PcapRing ring({.interface = "eth0", .frames = 64});
  for (std::uint8_t i = 0; i < 20; ++i) record_cycle(ring, i);
  const std::string path = directory / "fault.pcapng";
  ring.write(path, "a test");
  const std::string command = "tshark -r " + path +
                              " --disable-protocol ecat_mailbox -T fields -e frame.interface_name"
                              " -e frame.packet_flags_direction -e ecat.cmd -e _ws.malformed 2>/dev/null";
  const support::CommandResult result = support::run_command(command);
  ASSERT_EQ(result.exit_code, 0);
  std::vector<std::string> lines;
  std::istringstream text(result.output);
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  ASSERT_EQ(lines.size(), 40U);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    std::istringstream fields(lines[i]);
    std::string interface;
    std::string direction;
    std::string command_numbers;
    std::getline(fields, interface, '\t');
    std::getline(fields, direction, '\t');
    std::getline(fields, command_numbers, '\t');
    EXPECT_EQ(interface, "eth0");
    EXPECT_EQ(std::stoul(direction, nullptr, 0), i % 2 == 0 ? 2U : 1U) << lines[i];
    std::istringstream numbers(command_numbers);  // hexadecimal or not, as the version likes
    std::vector<std::uint8_t> commands;
    for (std::string number; std::getline(numbers, number, ',');)
      commands.push_back(static_cast<std::uint8_t>(std::stoul(number, nullptr, 0)));
    EXPECT_EQ(commands, (Bytes{12, 7, 4, 5})) << lines[i];
    EXPECT_EQ(lines[i].find("alformed"), std::string::npos) << lines[i];
  }
}

}  // namespace ethercat_pcap_ring_test
}  // namespace drivers::ethercat
