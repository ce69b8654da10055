#include "sim/can/bench_rig.h"

#include <gtest/gtest.h>
#include <linux/can/error.h>

#include <optional>
#include <string>
#include <vector>

namespace sim::can {
namespace can_bench_rig_test {

using namespace std::chrono_literals;
using Data = std::vector<std::uint8_t>;

can_frame frame_of(canid_t id, const Data& data) {
  can_frame frame{};
  frame.can_id = id;
  frame.can_dlc = static_cast<std::uint8_t>(data.size());
  std::copy(data.begin(), data.end(), frame.data);
  return frame;
}
Data data_of(const can_frame& frame) { return {frame.data, frame.data + frame.can_dlc}; }

std::optional<can_frame> ask(BenchRig& rig, const can_frame& request,
                             std::chrono::nanoseconds patience = 2ms) {
  EXPECT_TRUE(rig.send(request));
  can_frame reply{};
  for (; patience > 0ns; patience -= 10us) {
    rig.advance(10us);
    if (rig.receive(reply)) return reply;
  }
  return std::nullopt;
}

TEST(CanBenchRig, AnswersWithSevenBytesUnderTheHostsIdentifier) {
  BenchRig rig({.module_id = 5, .reply_id = 6});
  const auto reply = ask(rig, frame_of(5, {6, 250, 0, 0, 0, 0, 0}));  // GAP encoder resolution
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->can_id, 6U);
  EXPECT_EQ(data_of(*reply), (Data{5, 100, 6, 0, 0, 0x0F, 0xA0})) << "4000, most significant byte first";
}

TEST(CanBenchRig, VersionNeedsEightBytesToComeWhole) {
  BenchRig rig;
  const auto eight = ask(rig, frame_of(1, {136, 0, 0, 0, 0, 0, 0, 0}));
  ASSERT_TRUE(eight);
  EXPECT_EQ(std::string(eight->data, eight->data + eight->can_dlc), "1610V148");
  const auto seven = ask(rig, frame_of(1, {136, 0, 0, 0, 0, 0, 0}));
  ASSERT_TRUE(seven);
  EXPECT_EQ(std::string(seven->data, seven->data + seven->can_dlc), "1610V14");
}

TEST(CanBenchRig, RefusesAsTheManualSays) {
  BenchRig rig;
  EXPECT_EQ(data_of(*ask(rig, frame_of(1, {6, 77, 0, 0, 0, 0, 0})))[1], 3) << "no such parameter";
  EXPECT_EQ(data_of(*ask(rig, frame_of(1, {6, 1, 1, 0, 0, 0, 0})))[1], 4) << "no such motor";
  EXPECT_EQ(data_of(*ask(rig, frame_of(1, {99, 0, 0, 0, 0, 0, 0})))[1], 2) << "no such command";
  EXPECT_EQ(data_of(*ask(rig, frame_of(1, {5, 6, 0, 0, 0, 0x0B, 0xB8}))), (Data{1, 8, 5, 0, 0, 0x0B, 0xB8}))
      << "maximum current needs the password; sets are echoed";
}

TEST(CanBenchRig, OtherIdentifiersLengthsAndRemoteRequestsAreNotItsConcern) {
  BenchRig rig;
  const Data get{6, 1, 0, 0, 0, 0, 0};
  for (const canid_t id : {canid_t{7}, 1 | CAN_EFF_FLAG, 1 | CAN_RTR_FLAG})
    EXPECT_FALSE(ask(rig, frame_of(id, get))) << id;
  EXPECT_FALSE(ask(rig, frame_of(1, {6, 1, 0})));
}

TEST(CanBenchRig, APairTakesAQuarterOfAMillisecondAtOneMegabit) {
  BenchRig rig({.processing_time = 30us});
  ASSERT_TRUE(rig.send(frame_of(1, {6, 1, 0, 0, 0, 0, 0})));
  can_frame reply{};
  rig.advance(2 * 125us + 30us - 1ns);
  EXPECT_FALSE(rig.receive(reply));
  rig.advance(1ns);
  EXPECT_TRUE(rig.receive(reply));
}

TEST(CanBenchRig, ThreePairsAtOnceFitIntoAMillisecond) {
  BenchRig rig;
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(rig.send(frame_of(1, {6, 1, 0, 0, 0, 0, 0})));
  rig.advance(1ms);
  can_frame reply{};
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(rig.receive(reply)) << i;
}

TEST(CanBenchRig, AFullBufferDropsRequests) {
  BenchRig rig({.processing_time = 2ms, .buffered_requests = 1});
  for (int i = 0; i < 4; ++i) ASSERT_TRUE(rig.send(frame_of(1, {6, 1, 0, 0, 0, 0, 0})));
  rig.advance(20ms);
  can_frame reply{};
  int answers = 0;
  while (rig.receive(reply)) ++answers;
  EXPECT_EQ(answers, 2) << "the one being carried out and one that waits";
}

TEST(CanBenchRig, WithoutAModuleNothingAcknowledgesAndTheQueueFills) {
  BenchRig rig;
  rig.set_power(false);
  std::size_t taken = 0;
  while (rig.send(frame_of(1, {6, 1, 0, 0, 0, 0, 0}))) ++taken;
  EXPECT_EQ(taken, BenchRig::kHostQueue);
  rig.advance(1ms);
  can_frame received{};
  ASSERT_TRUE(rig.receive(received));
  EXPECT_EQ(received.can_id, CAN_ERR_FLAG | CAN_ERR_ACK);
  rig.set_power(true);
  rig.advance(10ms);
  EXPECT_TRUE(rig.receive(received)) << "what waited is sent after all";
  EXPECT_EQ(received.can_id, 2U);
}

}  // namespace can_bench_rig_test
}  // namespace sim::can
