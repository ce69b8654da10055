// youbotd in a domain of ROS 2, judged by another vendor's DDS across a network of two namespaces. The loop
// is slow, so that a busy machine only takes longer.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <fstream>
#include <limits>
#include <optional>

#include "runtime/mcap/cdr.h"
#include "runtime/mcap/ros_messages.h"
#include "tests/ros2/other_dds.h"
#include "tests/support/built_paths.h"
#include "tests/support/process.h"
#include "tests/support/skip.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/veth.h"

namespace ros2_test {

using namespace std::chrono_literals;
using other_dds::newest;
using other_dds::next;
using other_dds::Participant;
using other_dds::wait_until;
using runtime::mcap::CdrReader;
using runtime::mcap::CdrWriter;
using support::Process;

constexpr std::uint32_t kDomain = 42;
constexpr const char* kTwist = "geometry_msgs::msg::dds_::Twist_";
constexpr const char* kTwistStamped = "geometry_msgs::msg::dds_::TwistStamped_";
constexpr const char* kOdometry = "nav_msgs::msg::dds_::Odometry_";

std::string twist(double ahead, double left = 0, double turn = 0) {
  CdrWriter cdr;
  for (const double number : {ahead, left, 0.0, 0.0, 0.0, turn}) cdr.number(number);
  return std::string(cdr.payload());
}

struct Odometry {
  double x_m = 0;
  double ahead_m_per_s = 0;
};
/// nav_msgs/Odometry: header, child frame, pose and its covariance, twist and its covariance.
Odometry read_odometry(const std::string& payload) {
  CdrReader cdr(payload);
  cdr.int32("sec");
  cdr.uint32("nanosec");
  EXPECT_EQ(cdr.string("frame"), "world");
  EXPECT_EQ(cdr.string("child frame"), "base_footprint");
  Odometry odometry;
  odometry.x_m = cdr.float64("x");
  for (int i = 0; i < 6 + 36; ++i) cdr.float64("pose");
  odometry.ahead_m_per_s = cdr.float64("ahead");
  for (int i = 0; i < 5 + 36; ++i) cdr.float64("twist");
  EXPECT_ANY_THROW(cdr.uint32("nothing follows"));
  return odometry;
}

struct Ros2 : testing::Test {
  void start(const std::vector<std::string>& options) {
    SKIP_UNLESS(namespaces.usable(), "needs root, for network namespaces");
    for (const std::string& step :
         {"-n " + namespaces.sim_namespace() + " link set lo up",
          "-n " + namespaces.control_namespace() + " link set lo up",
          "-n " + namespaces.sim_namespace() + " addr add 10.77.0.1/24 dev veth-s",
          "-n " + namespaces.control_namespace() + " addr add 10.77.0.2/24 dev veth-c",
          "-n " + namespaces.control_namespace() + " route add 239.255.0.0/16 dev veth-c"})
      ASSERT_EQ(support::run_command("ip " + step).exit_code, 0) << step;
    std::vector<std::string> words{"/usr/sbin/ip",
                                   "netns",
                                   "exec",
                                   namespaces.sim_namespace(),
                                   support::program("youbotd"),
                                   "--config",
                                   folder.write("base.toml",
                                                "[loop]\nperiod_s = 0.01\ncommand_timeout_s = 2\n"
                                                "commander_timeout_s = 2\n[compensation]\n"
                                                "filter_cutoff_rad_per_s = 50\n[path]\nspeed_m_per_s = 0.2\n"
                                                "acceleration_m_per_s2 = 0.5\n"),
                                   "--control",
                                   socket,
                                   "--allow-non-rt",
                                   "--ros2",
                                   std::to_string(kDomain)};
    words.insert(words.end(), options.begin(), options.end());
    youbotd.emplace(words);
    ASSERT_TRUE(youbotd->wait_for("waiting for commands")) << youbotd->output();
    other.emplace(kDomain);
  }
  support::CommandResult ask(const std::string& request) const {
    return support::run_command(support::program("youbotctl") + " --socket " + socket + " " + request);
  }
  bool enabled() const { return ask("status --json").said("\"enabled\": true"); }

  support::Namespaces namespaces;
  support::TemporaryDirectory folder;
  const std::string socket = folder / "s";
  std::optional<Process> youbotd;
  std::optional<Participant> other;
};

struct Expected {
  std::string topic;
  std::string type;
  std::string hash;
};
/// As `ros2 topic info --verbose` prints them on ROS 2 Jazzy.
const std::vector<Expected> kExpected{
    {"rt/joint_states", "sensor_msgs::msg::dds_::JointState_",
     "RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e"},
    {"rt/odom", kOdometry, "RIHS01_3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0"},
    {"rt/tf", "tf2_msgs::msg::dds_::TFMessage_",
     "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"},
    {"rt/diagnostics", "diagnostic_msgs::msg::dds_::DiagnosticArray_",
     "RIHS01_5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e"},
    {"rt/robot_description", "std_msgs::msg::dds_::String_",
     "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"},
    {"ros_discovery_info", "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_",
     "RIHS01_91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e"},
};

std::string read_gid(CdrReader& cdr) {
  // uint8[16] is not aligned; sixteen bytes are four words at any multiple of four, and every gid here is at
  // one.
  std::string gid;
  for (int i = 0; i < 4; ++i) {
    const std::uint32_t word = cdr.uint32("gid");
    gid.append(reinterpret_cast<const char*>(&word), 4);
  }
  return gid;
}

TEST_F(Ros2, AnotherDdsSeesTheNodeItsTopicsTypesAndHashes) {
  start({});
  if (IsSkipped() || HasFatalFailure()) return;
  wait_until([&] {
    const auto found = other->publishers();
    return std::ranges::all_of(kExpected, [&](const Expected& topic) { return found.contains(topic.topic); });
  });
  const auto publishers = other->publishers();
  for (const Expected& expected : kExpected) {
    const auto& found = publishers.at(expected.topic);
    EXPECT_EQ(found.type, expected.type);
    EXPECT_EQ(found.user_data, "typehash=" + expected.hash + ";") << expected.topic;
    EXPECT_TRUE(found.reliable) << "a reliable subscription matches: " << expected.topic;
    EXPECT_EQ(found.latched,
              expected.topic == "rt/robot_description" || expected.topic == "ros_discovery_info");
  }
  EXPECT_FALSE(publishers.contains("rt/youbot/record")) << "a type that ROS 2 does not know";
  EXPECT_TRUE(other->subscriptions().empty()) << "no commands unless asked for";

  // rmw_dds_common: the participant, then each node with its subscriptions and publishers.
  auto* const graph = other->subscribe("ros_discovery_info", kExpected.back().type, /*latched=*/true);
  const std::string info = next(*graph);
  CdrReader cdr(info);
  const std::string participant = read_gid(cdr);
  ASSERT_TRUE(other->participants().contains(participant));
  EXPECT_EQ(other->participants().at(participant), "enclave=/;");
  EXPECT_EQ(cdr.uint32("nodes"), 1U);
  EXPECT_EQ(cdr.string("namespace"), "/");
  EXPECT_EQ(cdr.string("name"), "youbotd");
  EXPECT_EQ(cdr.uint32("subscriptions"), 0U);
  std::set<std::string> gids;
  for (std::uint32_t left = cdr.uint32("publishers"); left > 0; --left) gids.insert(read_gid(cdr));
  std::set<std::string> discovered;
  for (const auto& [topic, publisher] : publishers)
    if (topic.starts_with("rt/")) discovered.insert(publisher.gid);
  EXPECT_EQ(gids, discovered);

  // A subscriber that comes late gets the description, and the rest as it is published.
  auto* const description = other->subscribe("rt/robot_description", "std_msgs::msg::dds_::String_", true);
  const std::string urdf = next(*description);
  EXPECT_NE(CdrReader(urdf).string("data").find("<robot"), std::string::npos);
  auto* const joints = other->subscribe("rt/joint_states", "sensor_msgs::msg::dds_::JointState_");
  const auto state = runtime::mcap::read_joint_state(next(*joints));
  EXPECT_EQ(state.name, (std::vector<std::string>{"wheel_1", "wheel_2", "wheel_3", "wheel_4"}));
  EXPECT_EQ(state.position_rad.size(), 4U);
  EXPECT_EQ(state.velocity_rad_per_s.size(), 4U);
  EXPECT_EQ(state.effort_Nm.size(), 4U);
  auto* const diagnostics =
      other->subscribe("rt/diagnostics", "diagnostic_msgs::msg::dds_::DiagnosticArray_");
  const std::string status = next(*diagnostics);
  CdrReader array(status);
  array.int32("sec");
  array.uint32("nanosec");
  array.string("frame");
  EXPECT_GE(array.uint32("statuses"), 1U);
}

struct Ros2Commands : Ros2 {
  void SetUp() override {
    start({"--ros2-commands"});
    if (IsSkipped() || HasFatalFailure()) return;
    odometry = other->subscribe("rt/odom", kOdometry);
    cmd_vel = other->advertise("rt/cmd_vel", kTwist);
    wait_until([&] { return other->subscriptions().contains("rt/cmd_vel"); });
  }
  /// By a client that keeps it enabled, as youbotctl does.
  void enable() {
    ASSERT_EQ(ask("mode ros2").exit_code, 0);
    client.emplace(std::vector<std::string>{support::program("youbotctl"), "--socket", socket, "enable"});
    wait_until([&] { return enabled(); });
  }
  /// A publisher at 50 Hz until `is_so`.
  void publish_until(const std::string& payload, const std::function<bool()>& is_so) const {
    std::string message = payload;
    wait_until([&] {
      cmd_vel->write(&message);
      std::this_thread::sleep_for(20ms);
      return is_so();
    });
  }
  double ahead_m_per_s() const { return read_odometry(newest(*odometry)).ahead_m_per_s; }

  other_dds::dds::DataReader* odometry = nullptr;
  other_dds::dds::DataWriter* cmd_vel = nullptr;
  std::optional<Process> client;
};

TEST_F(Ros2Commands, SteerWhatAClientEnabledAndEndWithTheirPublisher) {
  if (IsSkipped() || HasFatalFailure()) return;
  EXPECT_EQ(other->subscriptions().at("rt/cmd_vel").user_data,
            "typehash=RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a;");
  EXPECT_EQ(other->subscriptions().at("rt/cmd_vel_stamped").user_data,
            "typehash=RIHS01_5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64;");
  int sent = 0;
  publish_until(twist(0.1), [&] { return ++sent > 40; });
  EXPECT_FALSE(enabled()) << "the network enables nothing";

  enable();
  publish_until(twist(0.1), [&] { return std::abs(ahead_m_per_s() - 0.1) < 0.01; });
  // The limit of [path], 0.2 m/s, is not exceeded by much, whatever the network asks for.
  double fastest = 0;
  publish_until(twist(90), [&] {
    fastest = std::max(fastest, ahead_m_per_s());
    return fastest > 0.19;
  });
  EXPECT_LT(fastest, 0.25);
  // Its publisher dies, and says nothing.
  wait_until([&] { return std::abs(ahead_m_per_s()) < 0.005; });
  EXPECT_TRUE(youbotd->wait_for("/cmd_vel of ROS 2 is silent"));
  EXPECT_TRUE(enabled()) << "the client is still there";
  publish_until(twist(-0.1), [&] { return std::abs(ahead_m_per_s() + 0.1) < 0.01; });
  // The client that enabled it dies.
  client.reset();
  publish_until(twist(-0.1), [&] { return !enabled(); });
}

std::size_t resident_kB(pid_t pid) {
  std::ifstream status("/proc/" + std::to_string(pid) + "/status");
  for (std::string word; status >> word;)
    if (word == "VmRSS:") {
      std::size_t kB = 0;
      status >> kB;
      return kB;
    }
  return 0;
}

TEST_F(Ros2Commands, AHostileParticipantMovesNothingAndFillsNoMemory) {
  if (IsSkipped() || HasFatalFailure()) return;
  enable();
  publish_until(twist(0.1), [&] { return std::abs(ahead_m_per_s() - 0.1) < 0.01; });
  // ip became youbotd.
  const std::size_t before_kB = resident_kB(youbotd->pid());
  ASSERT_GT(before_kB, 0U);

  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::vector<std::string> messages{twist(kNaN),
                                    twist(0, kInfinity),
                                    twist(0, 0, -kInfinity),
                                    twist(1e300),
                                    twist(0.2, 0.2, 1),
                                    twist(0.1).substr(0, 51),
                                    std::string("\0\1\0\0", 4),
                                    std::string(52, '\xff'),
                                    twist(0.1) + std::string(100'000, 'x')};
  messages.push_back(twist(5));
  messages.back()[1] = '\7';  // XCDR version 2
  CdrWriter lying;
  lying.number(std::int32_t{0});
  lying.number(std::uint32_t{0});
  lying.number(std::uint32_t{0xffffffff});  // length of the frame's name
  std::vector<std::string> stamped{std::string(lying.payload()), std::string(2'000'000, '\0')};

  std::atomic<bool> end{false};
  std::atomic<int> flood{0};
  std::jthread hostile([&] {
    Participant enemy(kDomain);
    auto* const plain = enemy.advertise("rt/cmd_vel", kTwist);
    auto* const with_header = enemy.advertise("rt/cmd_vel_stamped", kTwistStamped);
    auto* const graph = enemy.advertise("ros_discovery_info", kExpected.back().type);
    wait_until([&] { return enemy.subscriptions().contains("rt/cmd_vel_stamped"); });
    for (; !end; ++flood) {
      for (std::string& message : messages) plain->write(&message);
      for (std::string& message : stamped) with_header->write(&message);
      graph->write(&messages[static_cast<std::size_t>(flood) % messages.size()]);
    }
  });
  // Meanwhile the base obeys the one that steers, and no other publisher.
  double fastest = 0;
  double slowest = 1;
  publish_until(twist(0.1), [&] {
    const double ahead = ahead_m_per_s();
    fastest = std::max(fastest, ahead);
    slowest = std::min(slowest, ahead);
    return flood >= 300;
  });
  // It overshoots after its start. Obeying the others, it would drive at 0.2 m/s, the limit, or stop.
  EXPECT_NEAR(fastest, 0.1, 0.06);
  EXPECT_NEAR(slowest, 0.1, 0.06);
  end = true;
  hostile.join();
  EXPECT_TRUE(youbotd->wait_for("ignored on /cmd_vel"));
  EXPECT_TRUE(enabled());
  EXPECT_LT(resident_kB(youbotd->pid()), before_kB + 32'000) << "kB";
}

}  // namespace ros2_test
