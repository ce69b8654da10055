// The two ends of the link over a simulated network in virtual time: sessions, measurements, and what a
// stranger who sees and sends everything can do.
#include "drivers/station/endpoint.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <set>
#include <span>
#include <vector>

#include "hal/clock.h"
#include "tests/support/channel_port.h"
#include "tests/support/direct_port.h"
#include "tests/support/no_alloc_guard.h"

namespace station_endpoint_test {

using namespace drivers::station;
using namespace std::chrono_literals;
using std::chrono::nanoseconds;
using Bytes = std::vector<std::uint8_t>;

Key key(std::uint8_t first) { return Key({first}); }

/// Both stations at 1 kHz. The operator's clock is ahead of the robot's.
struct Link {
  explicit Link(const sim::NetworkConditions& conditions = {}, Key operator_key = key(1))
      : network(conditions, 1, clock),
        robot(network.at_robot, key(1), config),
        operating(network.at_operator, operator_key, config) {
    network.at_operator.on_send = [this](std::span<const std::uint8_t> datagram) {
      recorded.emplace_back(datagram.begin(), datagram.end());
    };
  }

  void step() {
    clock.sleep_until(clock.now() + 1ms);
    if (robot.poll(clock.now())) {
      ++newer;
      const HandleMessage& message = robot.message();
      oldest = std::max(oldest, clock.now() + kAhead - nanoseconds(message.link.sent_ns));
      for (int i = 0; i < robot.new_states(); ++i)
        states.push_back(message.states[static_cast<std::size_t>(i)]);
    }
    robot.send({.enable = true}, {.force_uN = {++forces, 0, 0}}, clock.now());
    (void)operating.poll(clock.now() + kAhead);
    if (sending) operating.send({.enable = true}, {.buttons = ++sent}, clock.now() + kAhead);
  }
  void run(nanoseconds duration) {
    for (nanoseconds t{}; t < duration; t += 1ms) step();
  }
  bool connected() { return robot.connected(clock.now()) && operating.connected(clock.now() + kAhead); }

  static constexpr nanoseconds kAhead = 1234567890ns;
  EndpointConfig config;
  hal::VirtualClock clock;
  support::ChannelPair network;
  RobotEndpoint robot;
  OperatorEndpoint operating;
  std::vector<Bytes> recorded;  // of the operator
  std::vector<HandleState> states;
  int newer = 0;
  nanoseconds oldest{};  // true age of a message that counted at the robot
  std::int32_t forces = 0;
  std::uint32_t sent = 0;
  bool sending = true;
};

TEST(Link, ConnectsAndPassesTheNewestState) {
  Link link;
  link.run(50ms);
  ASSERT_TRUE(link.connected());
  EXPECT_EQ(link.robot.message().states[0].buttons, link.sent - 1);
  EXPECT_EQ(link.operating.message().states[0].force_uN[0], link.forces);
}

TEST(Link, ConnectsOverTheWorstNetwork) {
  Link link({.delay = 150ms, .jitter = 50ms, .loss = 0.05, .repeated = 0.05});
  link.run(4s);
  EXPECT_TRUE(link.connected());
}

TEST(Link, MeasuresDelayLossAndClocks) {
  Link link({.delay = 60ms, .jitter = 10ms, .loss = 0.05});
  link.run(10s);
  const LinkReport robot = link.robot.report(link.clock.now());
  EXPECT_NEAR(robot.lost_permille, 50, 25);  // of 704 messages
  EXPECT_NEAR(robot.lost_there_permille, 50, 25);
  EXPECT_EQ(robot.repeated, 2);
  // The fastest of several thousand exchanges met nearly the least delay on both ways.
  EXPECT_NEAR(static_cast<double>(robot.shortest_round_trip.count()), 100e6, 3e6);
  EXPECT_NEAR(static_cast<double>((robot.clock_offset + Link::kAhead).count()), 0, 2e6);
  // The newest message is one that overtook others: hardly older than the shortest way, 50 ms.
  EXPECT_GE(robot.age, 49ms);
  EXPECT_LE(robot.age, 60ms);
}

TEST(Link, RepetitionsBringLostStates) {
  Link link({.delay = 20ms, .loss = 0.05});
  link.run(3s);  // the loss is known by then
  link.states.clear();
  const std::uint32_t sent = link.sent;
  link.run(20s);
  EXPECT_GT(link.robot.report(link.clock.now()).recovered, 800U);
  // 1.25 of 10,000 states are lost with all their repetitions: 2.5 of these on average.
  EXPECT_GT(link.states.size(), link.sent - sent - 12);
}

TEST(Link, SilenceEndsItAndItComesBackInAnotherSession) {
  Link link;
  link.run(100ms);
  link.network.set_silent(true);
  link.run(link.config.silence + 2ms);
  EXPECT_FALSE(link.robot.connected(link.clock.now()));
  link.run(2s);
  link.network.set_silent(false);
  link.run(1s);
  EXPECT_TRUE(link.connected());
  EXPECT_EQ(link.robot.report(link.clock.now()).sessions, 2U);
}

TEST(Link, OnlyOneOperatorAtATime) {
  Link link;
  link.run(100ms);
  OperatorEndpoint second(link.network.at_operator, key(1), link.config);
  // Both share the way back, so only the robot's side is judged.
  for (int i = 0; i < 500; ++i) {
    (void)second.poll(link.clock.now());
    link.step();
  }
  EXPECT_EQ(link.robot.report(link.clock.now()).sessions, 1U);
}

TEST(Security, AnotherKeyConnectsNothing) {
  Link link({}, key(2));
  link.run(3s);
  EXPECT_FALSE(link.robot.connected(link.clock.now()));
  EXPECT_EQ(link.newer, 0);
  EXPECT_EQ(link.robot.report(link.clock.now()).sessions, 0U);
  EXPECT_GT(link.robot.report(link.clock.now()).refused, 0U);
  EXPECT_EQ(link.network.at_robot.adopted, 0) << "the robot sends a stranger no forces";
}

TEST(Security, ReplaysInASessionMoveNothing) {
  Link link;
  link.run(500ms);
  const int newer = link.newer;
  link.sending = false;
  for (const Bytes& datagram : link.recorded) link.network.at_robot.inject(datagram);
  link.run(150ms);
  EXPECT_LE(link.newer, newer + 1) << "at most the last one was on its way";
}

TEST(Security, ARecordedSessionMovesNothingInAnotherOne) {
  Link link;
  link.run(500ms);
  const std::vector<Bytes> recorded = link.recorded;
  // The same robot, its operator gone: the whole recording again, greetings included, in order.
  link.network.set_silent(true);
  link.run(1s);
  const int newer = link.newer;
  for (const Bytes& datagram : recorded) {
    link.network.at_robot.inject(datagram);
    link.step();
  }
  EXPECT_EQ(link.newer, newer);
  EXPECT_EQ(link.robot.report(link.clock.now()).sessions, 1U);
  EXPECT_FALSE(link.robot.connected(link.clock.now()));
}

TEST(Security, ARestartedRobotKnowsNoRecordedSession) {
  Link first;
  first.run(500ms);
  Link second;
  second.network.set_silent(true);
  for (const Bytes& datagram : first.recorded) {
    second.network.at_robot.inject(datagram);
    second.step();
  }
  EXPECT_EQ(second.newer, 0);
  EXPECT_EQ(second.robot.report(second.clock.now()).sessions, 0U);
}

TEST(Security, AFloodOfRecordedGreetingsKeepsNoOperatorOut) {
  Link first;
  first.run(500ms);
  Link second;
  for (int i = 0; i < 500; ++i) {
    second.network.at_robot.inject(first.recorded.front());
    second.step();
  }
  EXPECT_TRUE(second.connected());
}

TEST(Security, AGreetingThatWasHeldBackBeginsNoSession) {
  Link link;
  link.step();  // the first greeting is on its way
  link.network.to_robot.set_silent(true);
  link.step();
  const auto last_greeting =
      std::find_if(link.recorded.rbegin(), link.recorded.rend(),
                   [](const Bytes& bytes) { return is_datagram(bytes, DatagramType::kHello); });
  ASSERT_NE(last_greeting, link.recorded.rend());
  const Bytes held_back = *last_greeting;
  ASSERT_NE(held_back, link.recorded.front()) << "the answer to the robot's";
  link.run(2500ms);
  link.network.at_robot.inject(held_back);
  link.step();
  EXPECT_EQ(link.robot.report(link.clock.now()).sessions, 0U);
  link.network.to_robot.set_silent(false);
  link.run(4s);
  EXPECT_TRUE(link.connected());
}

// A session that is made again from the same random numbers begins again with sequence 1: two messages under
// one nonce.
TEST(Security, NoTwoMessagesOfTheOperatorHaveOneNonce) {
  hal::VirtualClock clock;
  support::ChannelPair network({}, 1, clock);
  std::vector<Bytes> sent;
  network.at_operator.on_send = [&sent](std::span<const std::uint8_t> datagram) {
    sent.emplace_back(datagram.begin(), datagram.end());
  };
  OperatorEndpoint operating(network.at_operator, key(1), {});
  const auto step = [&] {
    clock.sleep_until(clock.now() + 1ms);
    (void)operating.poll(clock.now());
    operating.send({}, {}, clock.now());
  };
  step();
  Greeting greeting;
  ASSERT_TRUE(open_greeting(key(1), Side::kOperator, sent.front(), greeting));
  const Challenge first = random_challenge();
  const Challenge second = random_challenge();
  for (const Challenge& from_robot : {first, second, first, second}) {
    greeting.from_robot = from_robot;
    const GreetingDatagram welcome = seal_greeting(key(1), Side::kRobot, greeting);
    network.at_operator.inject({welcome.begin(), welcome.end()});
    step();
    step();
  }
  std::set<Bytes> heads;  // session and sequence
  std::size_t messages = 0;
  for (const Bytes& datagram : sent) {
    if (!is_datagram(datagram, DatagramType::kState)) continue;
    ++messages;
    heads.emplace(datagram.begin(), datagram.begin() + kDatagramHeaderBytes);
  }
  EXPECT_GE(messages, 8U);
  EXPECT_EQ(heads.size(), messages);
}

TEST(Link, AButtonCountsAlsoIfSeveralMessagesArriveTogether) {
  Link link;
  link.run(500ms);
  (void)link.robot.take_pressed();
  for (const std::uint32_t buttons : {0U, 1U, 0U}) {
    link.operating.send({.enable = true}, {.buttons = buttons}, link.clock.now() + Link::kAhead);
  }
  link.sending = false;
  link.step();
  EXPECT_EQ(link.robot.take_pressed() & 1U, 1U);
  EXPECT_EQ(link.robot.take_pressed(), 0U);
}

TEST(Security, AMessageThatWasHeldBackMovesNothing) {
  Link link;
  link.run(1s);
  // The stranger lets through only what is 0.6 s old, from now on.
  link.recorded.clear();
  link.network.to_robot.set_silent(true);
  link.run(150ms);
  const int newer = link.newer;
  const std::vector<Bytes> held_back = link.recorded;
  ASSERT_GT(held_back.size(), 100U);
  for (const Bytes& datagram : held_back) {
    // Each alone would keep the session alive.
    link.clock.sleep_until(link.clock.now() + (&datagram == &held_back.front() ? 600ms : 1ms));
    link.network.at_robot.inject(datagram);
    (void)link.robot.poll(link.clock.now());
  }
  EXPECT_EQ(link.newer, newer);
  EXPECT_FALSE(link.robot.connected(link.clock.now()));
}

TEST(Security, ASlowlyGrowingDelayEndsTheSession) {
  Link link;
  link.run(1s);
  sim::NetworkConditions conditions;
  for (int i = 0; i < 600; ++i) {
    conditions.delay += 1ms;
    link.network.to_robot.set(conditions);
    link.run(2ms);
  }
  link.run(1s);
  EXPECT_FALSE(link.robot.connected(link.clock.now()));
}

// The clocks' difference seems to be half of the delay, and its error grows with the delay.
TEST(Security, ADelayThatGrowsOverTwentySecondsLetsNoOldMessageCount) {
  Link link;
  link.run(1s);
  sim::NetworkConditions conditions;
  for (int i = 0; i < 10'000; ++i) {
    conditions.delay += 95us;
    link.network.to_robot.set(conditions);
    link.run(2ms);
  }
  EXPECT_GT(link.oldest, 450ms) << "it counts until then";
  EXPECT_LE(link.oldest, kMaxAge);
  EXPECT_FALSE(link.robot.connected(link.clock.now()));
}

TEST(Security, ADelayOfOneWayOnlyLetsNoOldMessageCount) {
  for (const nanoseconds delay : {600ms, 950ms}) {
    Link link;
    link.network.to_robot.set({.delay = delay});
    link.run(10s);
    EXPECT_EQ(link.newer, 0) << delay.count();
    EXPECT_FALSE(link.robot.connected(link.clock.now())) << delay.count();
  }
}

TEST(Security, NoSessionBeginsAgainOverALongerWayThanAllowed) {
  Link link;
  link.run(1s);
  link.network.set_silent(true);
  link.run(1s);
  const int newer = link.newer;
  link.network.to_robot.set({.delay = 600ms});
  link.network.set_silent(false);
  link.run(10s);
  EXPECT_EQ(link.newer, newer);
  EXPECT_LE(link.oldest, kMaxAge);
  link.network.to_robot.set({});
  link.run(4s);
  EXPECT_TRUE(link.connected()) << "it only waits for a better network";
}

// Of the right key and session: what no station sends, even so.
TEST(Security, AnAnswerToWhatWasNeverSentMovesNothing) {
  Traffic<ForceState, HandleState> robot(0);
  const Challenge challenge{1};
  robot.begin(Session(key(1), challenge, challenge, Side::kRobot), 1s);
  Session operating(key(1), challenge, challenge, Side::kOperator);
  const auto taken = [&](std::int64_t echo_ns) {
    HandleMessage message;
    message.link = {.sent_ns = 1, .echo_ns = echo_ns};
    message.count = 1;
    Bytes plain(kMaxMessageBytes);
    plain.resize(encode(message, plain));
    Bytes datagram(kMaxMessageBytes);
    datagram.resize(operating.seal(plain, datagram));
    return robot.take(datagram, 2s);
  };
  EXPECT_FALSE(taken(0)) << "of unknown age";
  EXPECT_FALSE(taken(2'000'000'001)) << "in the future";
  EXPECT_FALSE(taken(std::int64_t{1} << 62));
  EXPECT_FALSE(taken(1'499'999'999)) << "older than 0.5 s";
  EXPECT_EQ(robot.report(2s, 1s).refused, 2U);
  EXPECT_EQ(robot.report(2s, 1s).late, 1U);
  EXPECT_FALSE(robot.heard());
  EXPECT_TRUE(taken(1'500'000'000));
}

TEST(Security, RubbishIsCountedAndMovesNothing) {
  Link link;
  link.run(100ms);
  const std::uint64_t refused = link.robot.report(link.clock.now()).refused;
  link.network.at_robot.inject(Bytes(1, 0));
  link.network.at_robot.inject(Bytes(2000, 0xFF));
  link.network.at_robot.inject({'Y', 'B', 'S', 1, 1, 0, 0, 0});
  link.network.at_robot.inject({'Y', 'B', 'S', 1, 3, 0, 0, 0});
  link.run(5ms);
  EXPECT_EQ(link.robot.report(link.clock.now()).refused, refused + 4);
  EXPECT_TRUE(link.connected());
}

TEST(Link, AFloodDoesNotHoldTheCycle) {
  Link link;
  link.run(100ms);
  const std::uint64_t refused = link.robot.report(link.clock.now()).refused;
  for (int i = 0; i < 1000; ++i) link.network.at_robot.inject(Bytes(100, 0));
  link.step();
  EXPECT_EQ(link.robot.report(link.clock.now()).refused, refused + 64);
}

TEST(Link, NeitherAllocatesNorLocks) {
  support::DirectPort at_robot;
  support::DirectPort at_operator;
  at_robot.other = &at_operator;
  at_operator.other = &at_robot;
  RobotEndpoint robot(at_robot, key(1), {});
  OperatorEndpoint operating(at_operator, key(1), {});
  nanoseconds now{};
  long violations = 0;
  {
    const support::NoAllocGuard guard;
    for (int i = 0; i < 300; ++i) {
      now += 1ms;
      (void)operating.poll(now);
      operating.send({.enable = true}, {}, now);
      (void)robot.poll(now);
      robot.send({}, {}, now);
    }
    violations = guard.violations();
  }
  EXPECT_EQ(violations, 0);
  EXPECT_TRUE(robot.connected(now));
  EXPECT_TRUE(operating.connected(now));
}

}  // namespace station_endpoint_test
