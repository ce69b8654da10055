// Velocities from the network: what may steer.
#include "apps/youbotd/cmd_vel.h"

#include <gtest/gtest.h>

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "runtime/mcap/cdr.h"

namespace cmd_vel_test {

using namespace std::chrono_literals;
using control::PlanarVector;
using runtime::mcap::CdrWriter;
using youbotd::CmdVel;

constexpr std::uint64_t kFirst = 7;
constexpr std::uint64_t kSecond = 8;

/// geometry_msgs/Twist: linear x y z, angular x y z.
std::string twist(const std::vector<double>& numbers) {
  CdrWriter cdr;
  for (const double number : numbers) cdr.number(number);
  return std::string(cdr.payload());
}
std::string ahead(double m_per_s) { return twist({m_per_s, 0, 0, 0, 0, 0}); }

struct CmdVelTest : testing::Test {
  void hear(std::uint64_t publisher, const std::string& payload, CmdVel::Form form = CmdVel::Form::kTwist) {
    cmd_vel.hear(publisher, form, payload, now);
  }
  /// At 20 Hz until it may steer.
  void stream(std::uint64_t publisher, std::chrono::milliseconds duration = 600ms) {
    for (const CmdVel::Time end = now + duration; now < end; now += 50ms) hear(publisher, ahead(0.1));
    (void)cmd_vel.take();
  }

  CmdVel cmd_vel{500ms};
  CmdVel::Time now{1h};
};

TEST_F(CmdVelTest, AheadLeftAndTurnOfTheNewestMessage) {
  stream(kFirst);
  hear(kFirst, ahead(0.1));
  hear(kFirst, twist({0.2, -0.3, 9, 8, 7, 0.4}));
  const auto command = cmd_vel.take();
  ASSERT_TRUE(command);
  EXPECT_EQ(command->twist_B, PlanarVector(0.2, -0.3, 0.4));
  EXPECT_EQ(command->publisher, kFirst);
  EXPECT_FALSE(cmd_vel.take()) << "it was taken";
}

TEST_F(CmdVelTest, AStampedMessageHasTheSameNumbersBehindItsHeader) {
  stream(kFirst);
  CdrWriter cdr;
  cdr.number(std::int32_t{5});
  cdr.number(std::uint32_t{6});
  cdr.string("base_link");
  for (const double number : {0.2, -0.3, 0.0, 0.0, 0.0, 0.4}) cdr.number(number);
  hear(kFirst, std::string(cdr.payload()), CmdVel::Form::kTwistStamped);
  const auto command = cmd_vel.take();
  ASSERT_TRUE(command);
  EXPECT_EQ(command->twist_B, PlanarVector(0.2, -0.3, 0.4));
}

TEST_F(CmdVelTest, WhatFollowsASilenceMayHaveWaitedInTheNetwork) {
  for (int i = 0; i < 10; ++i, now += 50ms) {
    hear(kFirst, ahead(0.1));
    EXPECT_FALSE(cmd_vel.take()) << "the first half second of a publisher";
  }
  hear(kFirst, ahead(0.1));
  EXPECT_TRUE(cmd_vel.take());
  now += 501ms;
  hear(kFirst, ahead(0.1));
  EXPECT_FALSE(cmd_vel.take()) << "after a silence";
}

TEST_F(CmdVelTest, OnePublisherSteersUntilItIsSilent) {
  stream(kFirst);
  for (int i = 0; i < 100; ++i, now += 10ms) {
    hear(kFirst, ahead(0.1));
    hear(kSecond, ahead(-1));
    const auto command = cmd_vel.take();
    ASSERT_TRUE(command);
    EXPECT_EQ(command->publisher, kFirst);
  }
  EXPECT_EQ(cmd_vel.refused().others, 100U);
  now += 501ms;
  stream(kSecond);
  hear(kSecond, ahead(-1));
  const auto command = cmd_vel.take();
  ASSERT_TRUE(command);
  EXPECT_EQ(command->publisher, kSecond);
}

TEST_F(CmdVelTest, WhatIsNoVelocityIsNotEvenASignOfLife) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  stream(kFirst);
  const std::vector<std::string> wrong{
      ahead(kNaN),
      ahead(kInfinity),
      ahead(-101),
      twist({0, 0, 0, 0, 0, -kInfinity}),
      twist({0, 0, kNaN, 0, 0, 0}) /* also in a number that is not used */,
      twist({0.1, 0, 0, 0, 0}),
      "",
      std::string("\0\7\0\0", 4) + std::string(48, '\0') /* XCDR version 2 */};
  for (const std::string& payload : wrong) {
    hear(kFirst, payload);
    EXPECT_FALSE(cmd_vel.take());
  }
  EXPECT_EQ(cmd_vel.refused().invalid, wrong.size());
  for (int i = 0; i < 11; ++i, now += 50ms) hear(kFirst, ahead(kNaN));
  hear(kSecond, ahead(0.1));
  EXPECT_EQ(cmd_vel.refused().others, 0U) << "the first one counts as silent";
}

}  // namespace cmd_vel_test
