#include "drivers/haptic/falcon_packet.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <random>
#include <string_view>
#include <vector>

#include "drivers/usb/ftdi_serial.h"
#include "tests/support/no_alloc_guard.h"

namespace drivers::haptic::falcon {
namespace falcon_packet_test {

using Bytes = std::vector<std::uint8_t>;

Bytes bytes(std::string_view characters) { return {characters.begin(), characters.end()}; }
Bytes bytes(const Packet& packet) { return {packet.begin(), packet.end()}; }

/// Counts 100, -100, 0; forward button; axes 0 and 2 homed: 0b101'0010 + 'A'.
const Bytes kReply = bytes(
    "<EGAAMJPPAAAA\x93"
    "A>");
constexpr Reply kReplyMeaning{{100, -100, 0}, 0b0010, 0b101};

TEST(FalconPacket, CommandOfTheWorkedExample) {
  const Command command{{100, -100, 0}, {.green = true}, false};
  EXPECT_EQ(bytes(encode(command)), (Bytes{0x3C, 0x45, 0x47, 0x41, 0x41, 0x4D, 0x4A, 0x50, 0x50, 0x41, 0x41,
                                           0x41, 0x41, 0x43, 0x41, 0x3E}));
}

TEST(FalconPacket, StateByteOfTheCommandHasHomingGreenBlueRed) {
  const auto state = [](bool homing, Leds leds) { return encode({{}, leds, homing})[13] - 'A'; };
  EXPECT_EQ(state(false, {}), 0);
  EXPECT_EQ(state(true, {}), 1);
  EXPECT_EQ(state(false, {.green = true}), 2);
  EXPECT_EQ(state(false, {.blue = true}), 4);
  EXPECT_EQ(state(false, {.red = true}), 8);
  EXPECT_EQ(state(true, {true, true, true}), 15);
}

TEST(FalconPacket, HomingIsAskedForUnlessSaidOtherwise) { EXPECT_EQ(encode({})[13], 'B'); }

TEST(FalconPacket, ReplyIsUnderstood) {
  const auto reply = decode_reply(kReply);
  ASSERT_TRUE(reply);
  EXPECT_EQ(*reply, kReplyMeaning);
  EXPECT_TRUE(reply->pressed(Button::kForward));
  EXPECT_FALSE(reply->pressed(Button::kPlus));
  EXPECT_FALSE(reply->all_homed());
}

TEST(FalconPacket, CountsCoverSixteenBits) {
  EXPECT_EQ(decode_reply(bytes("<PPPHAAAIPPPPAA>")).value().counts,
            (std::array<std::int16_t, 3>{32767, -32768, -1}));
}

TEST(FalconPacket, AllAxesHomed) {
  Bytes homed = kReply;
  homed[13] = 'A' + 0b111'0000;
  EXPECT_TRUE(decode_reply(homed).value().all_homed());
}

TEST(FalconPacket, MotorsBeyondTheLimitKeepTheirRatio) {
  using Motors = std::array<std::int32_t, 3>;
  EXPECT_EQ(within_motor_limit({4096, -4096, 1}), (Motors{4096, -4096, 1}));
  EXPECT_EQ(within_motor_limit({8192, -4096, 2048}), (Motors{4096, -2048, 1024}));
  EXPECT_EQ(within_motor_limit({0, -40960, 20}), (Motors{0, -4096, 2}));
  constexpr std::int32_t kLowest = std::numeric_limits<std::int32_t>::min();
  EXPECT_EQ(within_motor_limit({kLowest, kLowest, 0}), (Motors{-4096, -4096, 0}));
}

// 32768 in sixteen bits is -32768: the force would turn around.
TEST(FalconPacket, LargeMotorValuesNeverWrap) {
  EXPECT_EQ(encode({{32768, 0, 0}, {}, true}), encode({{4096, 0, 0}, {}, true}));
  EXPECT_EQ(encode({{-65536, 65536, 0}, {}, true}), encode({{-4096, 4096, 0}, {}, true}));
}

TEST(FalconPacket, EveryOtherLengthIsMalformed) {
  for (std::size_t n = 0; n < kReply.size(); ++n) EXPECT_FALSE(decode_reply(std::span(kReply).first(n))) << n;
  Bytes longer = kReply;
  longer.push_back('>');
  EXPECT_FALSE(decode_reply(longer));
}

TEST(FalconPacket, BytesThatCannotStandThereAreMalformed) {
  for (std::size_t i = 0; i < kReply.size(); ++i) {
    for (const std::uint8_t wrong : Bytes{0x00, 0x40, 0xC1, 0xFF}) {
      if (i == 14 && wrong > 'A') continue;  // not used
      Bytes spoilt = kReply;
      spoilt[i] = wrong;
      EXPECT_FALSE(decode_reply(spoilt)) << i << ' ' << int{wrong};
    }
  }
}

TEST(FalconReplyStream, SplitAnywhereTheReplyIsFoundOnce) {
  for (std::size_t cut = 1; cut < kReply.size(); ++cut) {
    ReplyStream stream;
    EXPECT_FALSE(stream.feed(std::span(kReply).first(cut))) << cut;
    EXPECT_EQ(stream.feed(std::span(kReply).subspan(cut)), kReplyMeaning) << cut;
    EXPECT_EQ(stream.discarded_bytes(), 0U);
  }
}

TEST(FalconReplyStream, LatestOfSeveralCounts) {
  Bytes both = bytes("<AAAAAAAAAAAAAA>");
  both.insert(both.end(), kReply.begin(), kReply.end());
  ReplyStream stream;
  EXPECT_EQ(stream.feed(both), kReplyMeaning);
}

TEST(FalconReplyStream, PacketWithALostOrAnAddedByteCostsOnlyItself) {
  for (std::size_t i = 0; i < kReply.size(); ++i) {
    for (const bool added : {false, true}) {
      for (const std::uint8_t garbage : bytes("<>B\xFF\x01")) {
        Bytes spoilt = kReply;
        const auto place = spoilt.begin() + static_cast<std::ptrdiff_t>(i);
        if (added) {
          spoilt.insert(place, garbage);
        } else {
          spoilt.erase(place);
        }
        ReplyStream stream;
        (void)stream.feed(spoilt);
        EXPECT_EQ(stream.feed(kReply), kReplyMeaning) << i << ' ' << added << ' ' << int{garbage};
      }
    }
  }
}

TEST(FalconReplyStream, NoiseNeverHidesTheReplyBehindIt) {
  std::mt19937 random(1);
  for (int run = 0; run < 2000; ++run) {
    Bytes noise(random() % 200);
    std::ranges::generate(noise, [&random] { return static_cast<std::uint8_t>(random() % 96 + 0x30); });
    noise.insert(noise.end(), kReply.begin(), kReply.end());
    ReplyStream stream;
    std::optional<Reply> latest;
    for (std::span<const std::uint8_t> left = noise; !left.empty();) {
      const auto chunk = left.first(std::min<std::size_t>(left.size(), 1 + random() % 40));
      if (const auto reply = stream.feed(chunk)) latest = reply;
      left = left.subspan(chunk.size());
    }
    EXPECT_EQ(latest, kReplyMeaning) << "run " << run;
  }
}

TEST(FalconReplyStream, BytesOfNoReplyAreCounted) {
  ReplyStream stream;
  (void)stream.feed(bytes("xy<AB<AB-z"));
  EXPECT_EQ(stream.discarded_bytes(), 2U + 3U + 4U + 1U);
  EXPECT_EQ(stream.feed(kReply), kReplyMeaning);
  EXPECT_EQ(stream.discarded_bytes(), 10U);
}

TEST(FalconReplyStream, RepliesAreCountedAlsoWhenOnlyTheLatestIsHandedOut) {
  Bytes three = kReply;
  for (int i = 0; i < 2; ++i) three.insert(three.end(), kReply.begin(), kReply.end());
  ReplyStream stream;
  EXPECT_TRUE(stream.feed(three));
  EXPECT_EQ(stream.replies(), 3U);
  EXPECT_FALSE(stream.feed(std::span(kReply).first(15)));
  EXPECT_EQ(stream.replies(), 3U);
}

TEST(FalconReplyStream, DoesNotAllocateOrLock) {
  const support::NoAllocGuard guard;
  ReplyStream stream;
  const auto reply = stream.feed(kReply);
  const Packet packet = encode({{1, 2, 3}, {}, true});
  const long violations = guard.violations();
  EXPECT_TRUE(reply);
  EXPECT_EQ(packet[1], 'B');
  EXPECT_EQ(violations, 0);
}

Bytes stripped(Bytes packets) {
  const auto data = usb::ftdi::strip_modem_status(packets);
  return {data.begin(), data.end()};
}

TEST(FtdiModemStatus, IsTakenOffOnePacket) {
  EXPECT_EQ(stripped({0x01, 0x60, 'a', 'b'}), bytes("ab"));
  EXPECT_EQ(stripped({0x01, 0x60}), Bytes{});
  EXPECT_EQ(stripped({0x01}), Bytes{});
  EXPECT_EQ(stripped({}), Bytes{});
}

TEST(FtdiModemStatus, IsTakenOffEachPacketOfALongRead) {
  Bytes packets(2 * 64 + 3, 0x60);
  Bytes data;
  std::uint8_t value = 0;
  for (std::size_t i = 0; i < packets.size(); ++i) {
    if (i % 64 < 2) continue;
    packets[i] = ++value;
    data.push_back(value);
  }
  EXPECT_EQ(data.size(), 62U + 62U + 1U);
  EXPECT_EQ(stripped(packets), data);
}

TEST(FtdiModemStatus, TornLastPacketHoldsNothing) {
  for (const std::size_t rest : {1U, 2U}) EXPECT_EQ(stripped(Bytes(64 + rest, 7)), Bytes(62, 7)) << rest;
}

}  // namespace falcon_packet_test
}  // namespace drivers::haptic::falcon
