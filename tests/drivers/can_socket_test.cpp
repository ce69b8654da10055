// This machine's kernel may lack CAN: a socket pair carries the frames, and errors of the kernel are checked
// as messages.
#include "drivers/can/socket_can.h"

#include <gtest/gtest.h>
#include <linux/can/error.h>
#include <linux/can/netlink.h>
#include <linux/if_link.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <optional>
#include <vector>

#include "drivers/can/interface_bitrate.h"
#include "drivers/packet_age.h"
#include "tests/support/no_alloc_guard.h"

namespace drivers::can {
namespace can_socket_test {

using namespace std::chrono_literals;

struct CanSocket : testing::Test {
  CanSocket() {
    int ends[2];
    EXPECT_EQ(::socketpair(AF_UNIX, SOCK_SEQPACKET, 0, ends), 0);
    other = ends[1];
    stamp_packets(ends[0]);  // as of an interface
    socket.emplace(ends[0], "can7");
  }
  ~CanSocket() override { ::close(other); }
  void arrives(const can_frame& frame, std::size_t size = sizeof(can_frame)) const {
    ASSERT_EQ(::send(other, &frame, size, 0), static_cast<ssize_t>(size));
  }
  int other = -1;
  std::optional<SocketCan> socket;
};

can_frame frame_of(canid_t id, std::vector<std::uint8_t> data) {
  can_frame frame{};
  frame.can_id = id;
  frame.can_dlc = static_cast<std::uint8_t>(data.size());
  std::copy(data.begin(), data.end(), frame.data);
  return frame;
}

TEST_F(CanSocket, SendsAndReceivesWholeFrames) {
  ASSERT_TRUE(socket->send(frame_of(1, {6, 1, 2, 0, 0, 0, 0}), 0ns));
  can_frame seen{};
  ASSERT_EQ(::recv(other, &seen, sizeof(seen), 0), static_cast<ssize_t>(sizeof(seen)));
  EXPECT_EQ(seen.can_id, 1U);
  EXPECT_EQ(seen.can_dlc, 7);
  arrives(frame_of(2, {1, 100, 6}));
  can_frame frame{};
  EXPECT_EQ(socket->receive(frame, 1s), Received::kFrame);
  EXPECT_EQ(frame.can_id, 2U);
  EXPECT_EQ(frame.data[1], 100);
}

/// Of two that are fetched together the older one is older by as much as it came earlier. Comparing two ages
/// cancels any offset between the kernel's clock and ours.
TEST_F(CanSocket, KnowsHowLongAFrameHadBeenThereBeforeItWasFetched) {
  using std::chrono::steady_clock;
  const auto begin = steady_clock::now();
  arrives(frame_of(2, {1, 100, 6}));
  const auto apart = 3ms;
  const auto first = steady_clock::now();
  while (steady_clock::now() < first + apart) {
  }
  arrives(frame_of(2, {1, 100, 7}));
  const auto fetching = steady_clock::now();
  can_frame frame{};
  ASSERT_EQ(socket->receive(frame, 1s), Received::kFrame);
  const auto older = socket->frame_age();
  ASSERT_EQ(socket->receive(frame, 1s), Received::kFrame);
  const auto younger = socket->frame_age();
  EXPECT_GE(younger, 0ns);
  EXPECT_GE(older + (steady_clock::now() - fetching), younger + 0.99 * apart);
  EXPECT_LE(older, younger + 1.01 * (fetching - begin));
}

TEST_F(CanSocket, NothingComesAndTheDeadlineHolds) {
  can_frame frame{};
  EXPECT_EQ(socket->receive(frame, 0ns), Received::kNothing);
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(socket->receive(frame, 5ms), Received::kNothing);
  EXPECT_GE(std::chrono::steady_clock::now() - begin, 5ms);
  EXPECT_EQ(socket->last_error(), 0) << "not an error";
}

TEST_F(CanSocket, FullQueueTimesOut) {
  int sent = 0;
  while (sent < 100'000 && socket->send(frame_of(1, {}), 0ns)) ++sent;
  EXPECT_LT(sent, 100'000);
  EXPECT_EQ(socket->last_error(), EAGAIN);
  EXPECT_FALSE(socket->send(frame_of(1, {}), 2ms));
}

TEST_F(CanSocket, ErrorFrameIsDecodedAndKept) {
  can_frame error =
      frame_of(CAN_ERR_FLAG | CAN_ERR_BUSOFF | CAN_ERR_CRTL | 0x200U, {0, 0x20, 0, 0, 0, 0, 255, 17});
  arrives(error);
  can_frame frame{};
  EXPECT_EQ(socket->receive(frame, 1s), Received::kBusError);
  EXPECT_TRUE(socket->bus_error().bus_off());
  EXPECT_FALSE(socket->bus_error().no_acknowledge());
  const std::string words = describe(socket->bus_error());
  EXPECT_NE(words.find("bus off"), std::string::npos) << words;
  EXPECT_NE(words.find("error passive by transmit errors"), std::string::npos) << words;
  EXPECT_NE(words.find("transmit error counter 255, receive error counter 17"), std::string::npos) << words;
  socket->clear_errors();
  EXPECT_FALSE(socket->bus_error().any());
  EXPECT_EQ(describe(socket->bus_error()), "no bus error");
}

TEST_F(CanSocket, ShortOrImpossibleFramesAreMalformed) {
  can_frame frame{};
  for (std::size_t n = 1; n < sizeof(can_frame); ++n) {
    arrives(frame_of(2, {1, 2, 3}), n);
    EXPECT_EQ(socket->receive(frame, 0ns), Received::kFailed) << n;
    EXPECT_EQ(socket->last_error(), EBADMSG);
  }
  can_frame impossible = frame_of(2, {});
  impossible.can_dlc = 9;
  arrives(impossible);
  EXPECT_EQ(socket->receive(frame, 0ns), Received::kFailed);
}

TEST_F(CanSocket, LostSocketIsAFailureAndNoSignal) {
  ::shutdown(other, SHUT_RDWR);
  can_frame frame{};
  EXPECT_FALSE(socket->send(frame, 1ms));
  EXPECT_EQ(socket->last_error(), EPIPE);
  EXPECT_EQ(socket->receive(frame, 1ms), Received::kFailed);
}

TEST_F(CanSocket, MovesLikeAValue) {
  SocketCan moved(std::move(*socket));
  EXPECT_EQ(moved.name(), "can7");
  EXPECT_TRUE(moved.send(frame_of(1, {}), 0ns));
  SocketCan other_one(-1, "none");
  other_one = std::move(moved);
  EXPECT_TRUE(other_one.send(frame_of(1, {}), 0ns));
}

TEST_F(CanSocket, CycleDoesNotAllocateOrLock) {
  can_frame frame{};
  arrives(frame_of(2, {1}));
  arrives(frame_of(CAN_ERR_FLAG | CAN_ERR_ACK, {0, 0, 0, 0, 0, 0, 0, 0}));
  const support::NoAllocGuard guard;
  const bool sent = socket->send(frame, 1ms);
  const Received first = socket->receive(frame, 1ms);
  const Received second = socket->receive(frame, 1ms);
  const Received third = socket->receive(frame, 1ms);
  const long violations = guard.violations();
  EXPECT_TRUE(sent);
  EXPECT_EQ(first, Received::kFrame);
  EXPECT_EQ(second, Received::kBusError);
  EXPECT_EQ(third, Received::kNothing);
  EXPECT_EQ(violations, 0);
}

TEST(CanBusError, EveryClassHasWords) {
  for (std::uint32_t bit = 1; bit <= CAN_ERR_RESTARTED; bit <<= 1) {
    EXPECT_NE(describe(BusError{bit, {}}), "an unknown bus error") << bit;
  }
  EXPECT_EQ(describe(BusError{1U << 20, {}}), "an unknown bus error");
  EXPECT_NE(describe(BusError{CAN_ERR_ACK, {}}).find("same bit rate"), std::string::npos);
  EXPECT_EQ(
      describe(BusError{CAN_ERR_TRX, {0, 0, 0, 0, CAN_ERR_TRX_CANH_SHORT_TO_GND | CAN_ERR_TRX_CANL_NO_WIRE}}),
      "transceiver: CAN-H shorted to ground, CAN-L not connected");
  EXPECT_EQ(describe(BusError{CAN_ERR_PROT, {0, 0, CAN_ERR_PROT_STUFF | CAN_ERR_PROT_TX}}),
            "protocol violation: bit stuffing: often a wrong bit rate, on transmission");
}

TEST(CanSetup, KernelWithoutCanIsExplained) {
  const int probe = ::socket(PF_CAN, SOCK_RAW, CAN_RAW);
  if (probe >= 0) {
    ::close(probe);
    GTEST_SKIP() << "this kernel has CAN";
  }
  try {
    SocketCan socket(SocketCanOptions{.interface = "can0"});
    FAIL() << "opened without CAN";
  } catch (const SetupError& error) {
    EXPECT_EQ(error.report().device, "can0");
    EXPECT_EQ(error.report().expected, "a kernel with PF_CAN");
    EXPECT_NE(error.report().hint.find("modprobe -a can can_raw"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("can0: open a CAN socket: expected"), std::string::npos)
        << error.what();
  }
}

TEST(CanSetup, MissingInterfaceIsExplained) {
  const int probe = ::socket(PF_CAN, SOCK_RAW, CAN_RAW);
  if (probe < 0) GTEST_SKIP() << "this kernel has no CAN";
  ::close(probe);
  EXPECT_THROW(SocketCan(SocketCanOptions{.interface = "can99"}), SetupError);
  EXPECT_THROW(SocketCan(SocketCanOptions{.interface = "lo"}), SetupError);
}

TEST(CanSetup, EveryFailureSaysWhatToDo) {
  SocketCanOptions options{.interface = "can3", .bitrate_bit_per_s = 250'000};
  const auto message = [&](OpenStep step, int error) {
    return std::string(open_error(step, error, options, 1'000'000).what());
  };
  EXPECT_NE(message(OpenStep::kSocket, EAFNOSUPPORT).find("modprobe"), std::string::npos);
  EXPECT_NE(message(OpenStep::kSocket, EPERM).find("permission"), std::string::npos);
  EXPECT_NE(message(OpenStep::kFind, ENODEV).find("ip -details link"), std::string::npos);
  EXPECT_NE(message(OpenStep::kNotCan, 0).find("another kind"), std::string::npos);
  EXPECT_NE(message(OpenStep::kDown, 0).find("ip link set can3 up type can bitrate 250000"),
            std::string::npos);
  EXPECT_NE(message(OpenStep::kBitrate, 0).find("found 1000000 bit/s"), std::string::npos);
  EXPECT_NE(message(OpenStep::kOptions, EINVAL).find("filter"), std::string::npos);
  EXPECT_NE(message(OpenStep::kBind, ENETDOWN).find("still there"), std::string::npos);
}

// The kernel's answer for a can0 at 500 kbit/s, constructed by rtnetlink's rules.
std::vector<std::byte> link_message(std::uint32_t bitrate) {
  std::vector<std::byte> bytes(NLMSG_LENGTH(sizeof(ifinfomsg)));
  const auto open = [&](unsigned short type) {
    const std::size_t at = bytes.size();
    bytes.resize(at + sizeof(rtattr));
    const rtattr header{0, type};
    std::memcpy(&bytes[at], &header, sizeof(header));
    return at;
  };
  const auto close = [&](std::size_t at) {
    const auto length = static_cast<unsigned short>(bytes.size() - at);
    std::memcpy(&bytes[at], &length, sizeof(length));
    bytes.resize(RTA_ALIGN(bytes.size()));
  };
  const auto append = [&](const void* data, std::size_t size) {
    const auto* const first = static_cast<const std::byte*>(data);
    bytes.insert(bytes.end(), first, first + size);
  };
  const std::size_t name = open(IFLA_IFNAME);
  append("can0", 5);
  close(name);
  const std::size_t info = open(IFLA_LINKINFO);
  const std::size_t kind = open(IFLA_INFO_KIND);
  append("can", 3);
  close(kind);
  const std::size_t data = open(IFLA_INFO_DATA | NLA_F_NESTED);
  can_bittiming timing{};
  timing.bitrate = bitrate;
  const std::size_t bittiming = open(IFLA_CAN_BITTIMING);
  append(&timing, sizeof(timing));
  close(bittiming);
  close(data);
  close(info);
  nlmsghdr header{};
  header.nlmsg_len = static_cast<std::uint32_t>(bytes.size());
  header.nlmsg_type = RTM_NEWLINK;
  std::memcpy(bytes.data(), &header, sizeof(header));
  return bytes;
}

TEST(CanBitrate, IsReadFromTheKernelsAnswer) {
  EXPECT_EQ(bitrate_in(link_message(500'000)), 500'000U);
  EXPECT_EQ(bitrate_in(link_message(0)), std::nullopt) << "not configured";
}

TEST(CanBitrate, EveryPrefixAndEverySpoiltByteIsSafe) {
  const std::vector<std::byte> whole = link_message(500'000);
  for (std::size_t n = 0; n + 4 < whole.size(); ++n) {
    EXPECT_NE(bitrate_in(std::vector(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(n))), 1U);
  }
  for (std::size_t i = 0; i < whole.size(); ++i) {
    for (const int value : {0, 1, 3, 127, 255}) {
      std::vector<std::byte> spoilt = whole;
      spoilt[i] = static_cast<std::byte>(value);
      bitrate_in(spoilt);
    }
  }
}

TEST(CanBitrate, InterfaceThatIsNotCanHasNone) {
  EXPECT_EQ(interface_bitrate(::if_nametoindex("lo")), std::nullopt);
}

}  // namespace can_socket_test
}  // namespace drivers::can
