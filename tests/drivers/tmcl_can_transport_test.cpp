#include "drivers/tmcl/can_transport.h"

#include <gtest/gtest.h>
#include <linux/can/error.h>
#include <sys/socket.h>
#include <unistd.h>

#include <optional>
#include <vector>

#include "drivers/tmcl/client.h"
#include "drivers/tmcl/request_queue.h"
#include "tests/support/no_alloc_guard.h"

namespace drivers::tmcl {
namespace tmcl_can_transport_test {

using namespace std::chrono_literals;

// The far end of a socket pair, as the module sees the bus.
struct TmclCan : testing::Test {
  TmclCan() {
    int ends[2];
    EXPECT_EQ(::socketpair(AF_UNIX, SOCK_SEQPACKET, 0, ends), 0);
    bus = ends[1];
    transport.emplace(can::SocketCan(ends[0], "can0"), CanIdentifiers{.module = 5, .reply = 6});
  }
  ~TmclCan() override { ::close(bus); }

  std::optional<can_frame> sent() const {
    can_frame frame{};
    if (::recv(bus, &frame, sizeof(frame), MSG_DONTWAIT) != static_cast<ssize_t>(sizeof(frame)))
      return std::nullopt;
    return frame;
  }
  void arrives(canid_t id, const std::vector<std::uint8_t>& data) const {
    can_frame frame{};
    frame.can_id = id;
    frame.can_dlc = static_cast<std::uint8_t>(data.size());
    std::copy(data.begin(), data.end(), frame.data);
    ASSERT_EQ(::send(bus, &frame, sizeof(frame), 0), static_cast<ssize_t>(sizeof(frame)));
  }
  int bus = -1;
  std::optional<CanTransport> transport;
};

TEST_F(TmclCan, RequestHasSevenBytesAndTheModulesIdentifier) {
  ASSERT_TRUE(transport->post({0, Command::kGetAxisParameter, 1, 2, 0}));
  const auto frame = sent();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->can_id, 5U);
  EXPECT_EQ(frame->can_dlc, 7);
  EXPECT_EQ(std::vector(frame->data, frame->data + 7), (std::vector<std::uint8_t>{6, 1, 2, 0, 0, 0, 0}));
  EXPECT_EQ(transport->name(), "can0, module 5");
}

TEST_F(TmclCan, RepliesOfSevenAndEightBytesAreTaken) {
  arrives(6, {5, 100, 6, 0, 0, 2, 0xC7});
  arrives(6, {5, 100, 6, 0xFF, 0xFF, 0xFF, 0xFE, 0x99});
  EXPECT_EQ(transport->poll()->value, 711);
  EXPECT_EQ(transport->poll()->value, -2);
  EXPECT_FALSE(transport->poll());
}

TEST_F(TmclCan, OtherTrafficIsSkipped) {
  arrives(7, {5, 100, 6, 0, 0, 0, 1});
  arrives(6 | CAN_EFF_FLAG, {5, 100, 6, 0, 0, 0, 2});
  arrives(6 | CAN_RTR_FLAG, {5, 100, 6, 0, 0, 0, 3});
  for (std::size_t n = 0; n < 7; ++n) arrives(6, std::vector<std::uint8_t>(n, 1));
  arrives(6, {5, 100, 6, 0, 0, 0, 4});
  std::optional<Reply> reply;
  for (int i = 0; i < 4 && !reply; ++i) reply = transport->poll();
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->value, 4);
}

TEST_F(TmclCan, FloodOfErrorFramesDoesNotHoldTheCycle) {
  for (int i = 0; i < 20; ++i) arrives(CAN_ERR_FLAG | CAN_ERR_ACK, std::vector<std::uint8_t>(8, 0));
  EXPECT_FALSE(transport->poll());
  EXPECT_NE(transport->transport_fault().find("no acknowledge"), std::string::npos);
  arrives(6, {5, 100, 6, 0, 0, 0, 4});
  EXPECT_FALSE(transport->poll()) << "sixteen of twenty";
  ASSERT_TRUE(transport->poll());
  EXPECT_EQ(transport->transport_fault(), "") << "a reply shows that the bus works";
}

TEST_F(TmclCan, ClientReportsTheBusError) {
  arrives(CAN_ERR_FLAG | CAN_ERR_BUSOFF, std::vector<std::uint8_t>(8, 0));
  SteadyClock clock;
  Client client(*transport, clock, {.timeout = 2ms, .tries = 2});
  try {
    client.get(drive_parameter("actual_speed"));
    FAIL() << "nothing answers";
  } catch (const SetupError& error) {
    EXPECT_EQ(error.report().device, "can0, module 5");
    EXPECT_NE(error.report().found.find("bus off"), std::string::npos) << error.what();
  }
}

TEST_F(TmclCan, VersionComesAsEightCharacters) {
  ASSERT_TRUE(transport->post({0, Command::kGetFirmwareVersion, 0, 0, 0}));
  EXPECT_EQ(sent()->can_dlc, 8);
  arrives(6, {'1', '6', '3', '0', 'V', '2', '0', '8'});
  FirmwareVersion version;
  EXPECT_EQ(parse_version(transport->poll()->text, version), VersionText::kValid);
  EXPECT_EQ(version, (FirmwareVersion{1630, 208}));
}

TEST_F(TmclCan, GripperIsNotOnThisBus) {
  EXPECT_FALSE(transport->post({kGripperModule, Command::kGetAxisParameter, 1, 0, 0}));
  EXPECT_FALSE(sent());
}

TEST_F(TmclCan, IdentifiersAreChecked) {
  for (const CanIdentifiers& wrong :
       {CanIdentifiers{0x800, 2}, CanIdentifiers{1, 0x800}, CanIdentifiers{3, 3}}) {
    EXPECT_THROW(CanTransport(can::SocketCan(-1, "can0"), wrong), SetupError);
  }
}

TEST_F(TmclCan, CycleDoesNotAllocateOrLock) {
  RequestQueue queue;
  const support::NoAllocGuard guard;
  queue.push(get(drive_parameter("actual_speed")));
  queue.step(*transport);
  can_frame frame{};
  const bool has_request = ::recv(bus, &frame, sizeof(frame), MSG_DONTWAIT) > 0;
  frame.can_id = 6;
  const std::uint8_t answer[7] = {5, 100, 6, 0, 0, 0, 9};
  std::copy(answer, answer + 7, frame.data);
  const bool answered = ::send(bus, &frame, sizeof(frame), 0) > 0;
  queue.step(*transport);
  const auto completion = queue.pop();
  const long violations = guard.violations();
  EXPECT_TRUE(has_request && answered && completion && completion->done());
  EXPECT_EQ(violations, 0);
}

}  // namespace tmcl_can_transport_test
}  // namespace drivers::tmcl
