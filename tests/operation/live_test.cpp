// Cycles on their way to a page.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "control/teleoperation.h"
#include "live/foxglove.h"
#include "operation/live_channels.h"
#include "operation/live_feed.h"
#include "runtime/mcap/cdr.h"
#include "runtime/mcap/ros_messages.h"
#include "tests/support/no_alloc_guard.h"

namespace live_test {

using namespace std::chrono_literals;
using nlohmann::json;
using operation::CycleRecord;
using operation::LiveFeed;
using operation::LiveHistogram;
using operation::LiveSample;
using operation::TeleopRecord;
using runtime::mcap::CdrReader;

TEST(LiveHistogram, CountsUpToEachBound) {
  LiveHistogram histogram;
  for (const int bound_us : LiveHistogram::kBounds_us) {
    histogram.add(std::chrono::microseconds(bound_us));
    histogram.add(std::chrono::microseconds(bound_us) + 1ns);
  }
  histogram.add(0ns);
  histogram.add(-5us);
  histogram.add(1h);
  const auto counts = histogram.counts();
  EXPECT_EQ(counts.front(), 3U) << "1 us, and two that are not above it";
  for (std::size_t i = 1; i + 1 < counts.size(); ++i) EXPECT_EQ(counts[i], 2U) << i;
  EXPECT_EQ(counts.back(), 2U) << "more than a second";
}

TEST(LiveFeed, PassesOnOneRecordInItsPeriodAndCountsEachCycle) {
  hal::VirtualClock clock;
  LiveFeed feed(clock);
  LiveFeed::Reader& reader = feed.add_reader();
  for (int i = 0; i < 1000; ++i) {
    clock.sleep_until(i * 1ms);
    feed.add(CycleRecord{.wake_up = 3us, .step = 30us});
  }
  std::size_t passed = 0;
  for (LiveSample sample; reader.take(sample);) ++passed;
  EXPECT_EQ(passed, 100U) << "of a second";
  EXPECT_EQ(feed.wake_up().counts()[2], 1000U) << "from 2 to 5 us";
  EXPECT_EQ(feed.step().counts()[5], 1000U) << "from 20 to 50 us";
  EXPECT_EQ(reader.lost(), 0U);
}

TEST(LiveFeed, ASlowReaderCostsAnotherOneNothing) {
  hal::VirtualClock clock;
  LiveFeed feed(clock);
  LiveFeed::Reader& quick = feed.add_reader();
  LiveFeed::Reader& slow = feed.add_reader();
  LiveSample sample;
  std::size_t quick_ones = 0;
  for (int i = 0; i < 1000; ++i) {
    clock.sleep_until(clock.now() + LiveFeed::kPeriod);
    feed.add(CycleRecord{});
    while (quick.take(sample)) ++quick_ones;
  }
  EXPECT_EQ(quick_ones, 1000U);
  EXPECT_EQ(quick.lost(), 0U);
  EXPECT_EQ(slow.lost(), 1000U - 256U);
}

TEST(LiveFeed, CountsWhatIsNotReadAndNeitherAllocatesNorLocks) {
  hal::VirtualClock clock;
  LiveFeed feed(clock);
  LiveFeed::Reader& reader = feed.add_reader();
  const auto add = [&](int count) {
    for (int i = 0; i < count; ++i) {
      clock.sleep_until(clock.now() + LiveFeed::kPeriod);
      feed.add(CycleRecord{.wake_up = 1us});
    }
  };
  {
    const support::NoAllocGuard guard;
    add(259);
    EXPECT_EQ(guard.violations(), 0);
  }
  EXPECT_EQ(reader.lost(), 3U);
  std::size_t kept = 0;
  for (LiveSample sample; reader.take(sample);) ++kept;
  EXPECT_EQ(kept, 256U) << "a bounded memory";
  add(1);
  LiveSample sample;
  EXPECT_TRUE(reader.take(sample)) << "there is room again";
  EXPECT_EQ(reader.lost(), 3U);
}

TEST(LiveFeed, CarriesTheRecordAsItIs) {
  hal::VirtualClock feed_clock;
  LiveFeed feed{feed_clock};
  LiveFeed::Reader& reader = feed.add_reader();
  const auto now = [] {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(
               std::chrono::system_clock::now().time_since_epoch())
        .count();
  };
  feed.add(TeleopRecord{.tank_J = 0.25}, /*running=*/false);
  LiveSample sample;
  ASSERT_TRUE(reader.take(sample));
  EXPECT_FALSE(sample.running);
  EXPECT_EQ(std::get<TeleopRecord>(sample.record).tank_J, 0.25);
  EXPECT_LT(std::abs(static_cast<std::int64_t>(sample.time_ns) - now()), 3'600'000'000'000)
      << "since 1970, whatever the steady clock counts from";
}

/// The last payload of each topic.
struct Client final : live::WebSocket {
  explicit Client(live::FoxgloveStream& stream) : conversation(stream.converse(*this)) {
    conversation->begin();
    json request{{"op", "subscribe"}, {"subscriptions", json::array()}};
    for (const auto& [id, topic] : topics)
      request["subscriptions"].push_back({{"id", id}, {"channelId", id}});
    conversation->hear(request.dump());
  }
  void send(std::string message, Format format, Need /*need*/) override {
    if (format == Format::kBinary) {
      std::uint32_t id = 0;
      std::memcpy(&id, message.data() + 1, sizeof id);
      last[topics.at(id)] = message.substr(13);
      return;
    }
    const json text = json::parse(message);
    if (text["op"] == "advertise")
      for (const json& channel : text["channels"]) topics[channel["id"]] = channel["topic"];
  }
  const std::string& client() const override { return name; }

  runtime::mcap::JointState joints(const std::string& topic) const {
    return runtime::mcap::read_joint_state(last.at(topic));
  }
  /// `count` numbers after the header and the strings.
  std::vector<double> numbers(const std::string& topic, std::size_t strings, std::size_t count,
                              std::string* frame = nullptr) const {
    CdrReader cdr(last.at(topic));
    (void)cdr.int32("sec");
    (void)cdr.uint32("nanosec");
    for (std::size_t i = 0; i < strings; ++i) {
      const std::string_view text = cdr.string("name");
      if (frame != nullptr && i == 0) *frame = text;
    }
    std::vector<double> values;
    while (values.size() < count) values.push_back(cdr.float64("number"));
    return values;
  }

  std::string name = "a test";
  std::map<std::uint32_t, std::string> topics;
  std::map<std::string, std::string> last;
  std::unique_ptr<live::Conversation> conversation;
};

struct LiveChannelsTest : testing::Test {
  static constexpr std::uint64_t kTime_ns = 1'700'000'000'250'000'000;
  static constexpr double kTurn = std::numbers::pi / 2;

  live::FoxgloveStream stream{"test"};
};

TEST_F(LiveChannelsTest, ABaseRecordAsMessages) {
  operation::LiveChannels channels(stream, /*teleoperated=*/false, {});
  const Client client(stream);
  CycleRecord record{.time = 2s};
  record.torque_command_Nm = {1, 2, 3, 4};
  record.torque_measured_Nm = {5, 6, 7, 8};
  record.position_rad = {9, 10, 11, 12};
  record.velocity_rad_per_s = {13, 14, 15, 16};
  record.odometry_W = {0.5, -0.25, kTurn};
  channels.publish({.time_ns = kTime_ns, .running = true, .record = record});

  const auto states = client.joints("/joint_states");
  EXPECT_EQ(states.stamp.sec, 1'700'000'000);
  EXPECT_EQ(states.stamp.nanosec, 250'000'000U);
  EXPECT_EQ(states.name, (std::vector<std::string>{"wheel_1", "wheel_2", "wheel_3", "wheel_4"}));
  EXPECT_EQ(states.position_rad, (std::vector<double>{9, 10, 11, 12}));
  EXPECT_EQ(states.velocity_rad_per_s, (std::vector<double>{13, 14, 15, 16}));
  EXPECT_EQ(states.effort_Nm, (std::vector<double>{5, 6, 7, 8}));
  const auto commands = client.joints("/joint_commands");
  EXPECT_EQ(commands.effort_Nm, (std::vector<double>{1, 2, 3, 4}));
  EXPECT_TRUE(commands.position_rad.empty());

  std::vector<double> row(channels.columns().size());
  runtime::mcap::CdrReader cdr(client.last.at("/youbot/record"));
  for (double& value : row) value = cdr.float64("a column");
  EXPECT_EQ(channels.columns().at(0), "time_s");
  EXPECT_EQ(row.at(0), 2.0);
  EXPECT_FALSE(client.last.contains("/end_effector/pose"));
  EXPECT_TRUE(client.last.at("/robot_description").find("<robot") != std::string::npos) << "latched";
}

TEST_F(LiveChannelsTest, OdometryHasItsVelocityInTheFrameOfTheBase) {
  operation::LiveChannels channels(stream, false, {});
  const Client client(stream);
  CycleRecord record;
  record.odometry_W = {1, 2, kTurn};
  channels.publish({.time_ns = kTime_ns, .record = record});
  auto odometry = client.numbers("/odom", 2, 85);
  EXPECT_EQ(odometry[43], 0.0) << "no velocity yet";
  EXPECT_EQ(odometry[49], 1e6) << "its variance";
  record.odometry_W = {1, 2.01,
                       kTurn + 0.002};  // 0.01 m in the world's y is ahead for a base that looks there
  channels.publish({.time_ns = kTime_ns + 10'000'000, .record = record});
  std::string frame;
  odometry = client.numbers("/odom", 2, 85, &frame);
  EXPECT_EQ(frame, "world");
  EXPECT_EQ(odometry[0], 1.0);
  EXPECT_EQ(odometry[1], 2.01);
  EXPECT_NEAR(odometry[5], std::sin((kTurn + 0.002) / 2), 1e-12) << "z of the rotation";
  EXPECT_NEAR(odometry[6], std::cos((kTurn + 0.002) / 2), 1e-12) << "w";
  EXPECT_NEAR(odometry[43], 1.0, 1e-5) << "m/s ahead";
  EXPECT_NEAR(odometry[44], -0.002, 1e-4) << "m/s to the left, of which it has turned 2 mrad";
  EXPECT_NEAR(odometry[48], 0.2, 1e-9) << "rad/s";
  // Four wheels that each rolled 0.475 m, with a percent of error: half of that along x.
  EXPECT_EQ(odometry[7], 1e-6) << "variance of x: the start is known to a millimetre";
  record.position_rad = {-10, 10, -10, 10};
  channels.publish({.time_ns = kTime_ns + 20'000'000, .record = record});
  odometry = client.numbers("/odom", 2, 85);
  EXPECT_NEAR(odometry[7], 1e-6 + std::pow(0.475 * 0.01 / 2, 2), 1e-7);
  EXPECT_LT(odometry[49], 0.1) << "the velocity is known";
  EXPECT_EQ(odometry[7 + 14], 1e6) << "the height is not measured";
}

TEST_F(LiveChannelsTest, ATeleoperationRecordAsMessages) {
  operation::LiveChannels channels(stream, /*teleoperated=*/true, {});
  const Client client(stream);
  TeleopRecord record;
  record.tip_p_WT_m = {1, 2, 3};
  record.tip_q_WT = {std::sqrt(0.5), 0, 0, std::sqrt(0.5)};  // w first
  record.setpoint_p_WT_m = {4, 5, 6};
  record.setpoint_q_WT = {1, 0, 0, 0};
  record.wrench_W = {1, 2, 3, 4, 5, 6};
  record.held_force_H_N = {7, 8, 9};
  record.position_rad = {1, 2, 3, 4, 5, 6, 7, 8, 9};
  record.torque_measured_Nm = {9, 8, 7, 6, 5, 4, 3, 2, 1};
  channels.publish({.time_ns = kTime_ns, .running = true, .record = record});

  std::string frame;
  const auto tip = client.numbers("/end_effector/pose", 1, 7, &frame);
  EXPECT_EQ(frame, "world");
  EXPECT_EQ(std::vector<double>(tip.begin(), tip.begin() + 3), (std::vector<double>{1, 2, 3}));
  EXPECT_NEAR(tip[5], std::sqrt(0.5), 1e-12) << "z";
  EXPECT_NEAR(tip[6], std::sqrt(0.5), 1e-12) << "w last";
  EXPECT_EQ(client.numbers("/end_effector/setpoint", 1, 7), (std::vector<double>{4, 5, 6, 0, 0, 0, 1}));
  EXPECT_EQ(client.numbers("/end_effector/wrench", 1, 6), (std::vector<double>{1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(client.numbers("/haptic/force", 1, 6), (std::vector<double>{7, 8, 9, 0, 0, 0}));
  const auto states = client.joints("/joint_states");
  EXPECT_EQ(states.name.back(), "arm_5");
  EXPECT_EQ(states.position_rad, (std::vector<double>{1, 2, 3, 4, 5, 6, 7, 8, 9}));
  EXPECT_EQ(states.effort_Nm, (std::vector<double>{9, 8, 7, 6, 5, 4, 3, 2, 1}));
}

TEST_F(LiveChannelsTest, APoseThatIsNotKnownYetIsTheOrigin) {
  operation::LiveChannels channels(stream, true, {});
  const Client client(stream);
  TeleopRecord record;  // quaternions of zeros
  record.tip_p_WT_m = {TeleopRecord::kNaN, 0, 0};
  channels.publish({.time_ns = kTime_ns, .record = record});
  EXPECT_EQ(client.numbers("/end_effector/pose", 1, 7), (std::vector<double>{0, 0, 0, 0, 0, 0, 1}));
}

TEST_F(LiveChannelsTest, CommandsOfTheArmAreTorquesOrPositionsByItsMode) {
  operation::LiveChannels channels(stream, true, {});
  const Client client(stream);
  TeleopRecord record;
  record.command = {1, 2, 3, 4, 5, 6, 7, 8, 9};
  record.arm_mode = static_cast<std::uint8_t>(control::TeleopOutput::Arm::kTorque);
  channels.publish({.time_ns = kTime_ns, .record = record});
  auto commands = client.joints("/joint_commands");
  EXPECT_EQ(commands.effort_Nm, (std::vector<double>{1, 2, 3, 4, 5, 6, 7, 8, 9}));
  EXPECT_TRUE(commands.position_rad.empty());
  record.arm_mode = static_cast<std::uint8_t>(control::TeleopOutput::Arm::kPosition);
  channels.publish({.time_ns = kTime_ns, .record = record});
  commands = client.joints("/joint_commands");
  for (std::size_t i = 0; i < 9; ++i) {
    const double value = static_cast<double>(i + 1);
    EXPECT_EQ(std::isnan(commands.effort_Nm.at(i)), i >= 4) << i;
    EXPECT_EQ(std::isnan(commands.position_rad.at(i)), i < 4) << i;
    EXPECT_EQ(i < 4 ? commands.effort_Nm[i] : commands.position_rad[i], value);
  }
}

TEST_F(LiveChannelsTest, AStatusIsAlsoADiagnostic) {
  operation::LiveChannels channels(stream, false, {});
  const Client client(stream);
  const json status{{"robot", "wire"},
                    {"phase", "faulted"},
                    {"fault", "wheel-2: too hot"},
                    {"robot_trouble", {"arm-1: undervoltage", 7}}};
  channels.publish_status(kTime_ns, status);
  EXPECT_EQ(json::parse(client.last.at("/youbot/status")), status);
  CdrReader cdr(client.last.at("/diagnostics"));
  EXPECT_EQ(cdr.int32("sec"), 1'700'000'000);
  (void)cdr.uint32("nanosec");
  EXPECT_EQ(cdr.string("frame"), "");
  EXPECT_EQ(cdr.uint32("states"), 2U) << "the whole, and one line of trouble";
  const std::string& bytes = client.last.at("/diagnostics");
  EXPECT_EQ(bytes.at(4 + 20), '\2') << "ERROR";
  for (const char* text : {"youbotd", "wheel-2: too hot", "wire", "youbotd: arm-1", "arm-1: undervoltage"})
    EXPECT_NE(bytes.find(std::string(text) + '\0'), std::string::npos) << text;
}

TEST_F(LiveChannelsTest, AnyStatusCanBePublished) {
  operation::LiveChannels channels(stream, false, {});
  const Client client(stream);
  for (const json& status :
       {json::object(), json{{"commander", nullptr}}, json{{"robot_trouble", "too long for an answer"}}})
    EXPECT_NO_THROW(channels.publish_status(kTime_ns, status)) << status;
}

}  // namespace live_test
