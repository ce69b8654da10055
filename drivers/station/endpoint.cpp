#include "drivers/station/endpoint.h"

#include "drivers/station/sodium_ready.h"

namespace drivers::station {
namespace {

/// Between two greetings.
constexpr std::chrono::milliseconds kGreetingPeriod{100};
/// Longer than a greeting, its answer and the first message take on any usable link: then a new attempt.
constexpr std::chrono::milliseconds kAttempt{2000};

const Key& with_sodium(const Key& key) {
  require_sodium();
  return key;
}

}  // namespace

RobotEndpoint::RobotEndpoint(DatagramPort& port, const Key& key, const EndpointConfig& config)
    : port_(port),
      key_(with_sodium(key)),
      config_(config),
      challenge_(random_challenge()),
      traffic_(config.most_repeated) {}

bool RobotEndpoint::poll(Time now) noexcept {
  // What was held back meanwhile may not go on with it. The first message that counts answers one of this
  // session, and therefore takes a round trip.
  const Time allowed = config_.silence + (traffic_.heard() ? Time(0) : Time(kMaxAge));
  if (traffic_.in_session() && traffic_.silence(now) > allowed) traffic_.end();
  bool newer = false;
  for (int i = 0; i < kMaxDatagramsPerPoll; ++i) {
    const std::size_t size = port_.receive(buffer_);
    if (size == 0) break;
    const std::span<const std::uint8_t> datagram = std::span(buffer_).first(size);
    if (is_datagram(datagram, DatagramType::kHello)) {
      if (!welcome(datagram, now)) traffic_.count_refused();
    } else if (traffic_.take(datagram, now)) {
      port_.adopt_sender();  // its address may change
      for (int state = 0; state < traffic_.new_states(); ++state)
        pressed_ |= traffic_.newest().states[static_cast<std::size_t>(state)].buttons;
      newer = true;
    }
  }
  return newer;
}

/// False if it is not genuine.
bool RobotEndpoint::welcome(std::span<const std::uint8_t> datagram, Time now) noexcept {
  Greeting greeting;
  if (!open_greeting(key_, Side::kOperator, datagram, greeting)) return false;
  if (traffic_.in_session()) return true;
  // A greeting that was held back for longer begins no session.
  if (now - challenge_made_ > kAttempt) renew_challenge(now);
  if (greeting.from_robot != challenge_) {
    greeting.from_robot = challenge_;
    port_.answer(seal_greeting(key_, Side::kRobot, greeting));
    return true;
  }
  traffic_.begin(Session(key_, greeting.from_operator, challenge_, Side::kRobot), now);
  renew_challenge(now);
  port_.adopt_sender();
  return true;
}

void RobotEndpoint::renew_challenge(Time now) noexcept {
  challenge_ = random_challenge();
  challenge_made_ = now;
}

OperatorEndpoint::OperatorEndpoint(DatagramPort& port, const Key& key, const EndpointConfig& config)
    : port_(port), key_(with_sodium(key)), config_(config), traffic_(config.most_repeated) {}

bool OperatorEndpoint::poll(Time now) noexcept {
  bool newer = false;
  for (int i = 0; i < kMaxDatagramsPerPoll; ++i) {
    const std::size_t size = port_.receive(buffer_);
    if (size == 0) break;
    const std::span<const std::uint8_t> datagram = std::span(buffer_).first(size);
    if (is_datagram(datagram, DatagramType::kWelcome))
      begin_session(datagram, now);
    else
      newer = traffic_.take(datagram, now) || newer;
  }
  look_for_robot(now);
  return newer;
}

void OperatorEndpoint::look_for_robot(Time now) noexcept {
  // A robot that hears but is not heard stops sooner when it is still sent that.
  if (traffic_.heard() && traffic_.silence(now) <= 2 * config_.silence) {
    looking_ = false;
    return;
  }
  if (!looking_ || now - looking_since_ > kAttempt) {
    traffic_.end();  // the robot waits until the old session is silent
    greeting_ = {.from_operator = random_challenge()};
    looking_ = true;
    looking_since_ = now;
    greeted_ = now - kGreetingPeriod;
  }
  if (now - greeted_ < kGreetingPeriod) return;
  greeted_ = now;
  const GreetingDatagram greeting = seal_greeting(key_, Side::kOperator, greeting_);
  if (traffic_.in_session())
    port_.send(greeting);
  else
    port_.send_to_all(greeting);
}

void OperatorEndpoint::begin_session(std::span<const std::uint8_t> welcome, Time now) noexcept {
  Greeting answer;
  const bool genuine = open_greeting(key_, Side::kRobot, welcome, answer);
  if (!genuine || !looking_ || answer.from_operator != greeting_.from_operator || traffic_.heard())
    return traffic_.count_refused();
  // A session is made once from a pair of random numbers: made again, its sequence would repeat.
  if (traffic_.in_session()) return;
  port_.adopt_sender();
  greeting_.from_robot = answer.from_robot;
  traffic_.begin(Session(key_, greeting_.from_operator, greeting_.from_robot, Side::kOperator), now);
  port_.send(seal_greeting(key_, Side::kOperator, greeting_));
  greeted_ = now;
}

}  // namespace drivers::station
