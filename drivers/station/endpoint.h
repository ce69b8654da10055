/// @file
/// The two ends of the link: how a session begins, goes on and ends.
///
///   operator                                  robot
///   hello(A, 0)            →
///                          ←  welcome(A, B)             B: a random number, for one session within 2 s
///   hello(A, B)            →                            a session begins; the next welcome has another B
///   messages               ⇄  messages                  sealed with keys from key, A and B
///
/// An operator whose messages are not answered begins again with another A. The robot begins another session
/// only when the last one has ended, by a silence longer than allowed: one operator at a time. A recorded
/// hello begins none, because its B is over.
#pragma once
#include <array>
#include <chrono>
#include <cstdint>
#include <utility>

#include "drivers/station/datagram_port.h"
#include "drivers/station/traffic.h"

namespace drivers::station {

struct EndpointConfig {
  std::chrono::nanoseconds silence = std::chrono::milliseconds(200);  ///< longer: the other side is lost
  int most_repeated = 4;  ///< states in a message, at most kMaxRepeated
};

/// Datagrams that one poll() takes; the rest wait for the next one.
inline constexpr int kMaxDatagramsPerPoll = 64;

/// One thread. Cycle: all but construction. `port` outlives the endpoint.
class RobotEndpoint {
 public:
  using Time = std::chrono::nanoseconds;
  RobotEndpoint(DatagramPort& port, const Key& key, const EndpointConfig& config);

  /// Receives what waits. True if there is a newer message().
  bool poll(Time now) noexcept;
  /// At the robot's rate.
  void send(const LinkState& link, const ForceState& state, Time now) noexcept {
    if (const auto datagram = traffic_.make(link, state, now); !datagram.empty()) port_.send(datagram);
  }

  /// The operator has been heard within the allowed silence.
  bool connected(Time now) const noexcept {
    return traffic_.heard() && traffic_.silence(now) <= config_.silence;
  }
  /// Since connected().
  const HandleMessage& message() const noexcept { return traffic_.newest(); }
  int new_states() const noexcept { return traffic_.new_states(); }
  /// Buttons that were pressed in any state since the last call, repeated ones included.
  std::uint32_t take_pressed() noexcept { return std::exchange(pressed_, 0); }
  LinkReport report(Time now) const noexcept { return traffic_.report(now, config_.silence); }

 private:
  bool welcome(std::span<const std::uint8_t> datagram, Time now) noexcept;
  void renew_challenge(Time now) noexcept;

  DatagramPort& port_;
  Key key_;
  EndpointConfig config_;
  Challenge challenge_;
  std::uint32_t pressed_ = 0;
  Time challenge_made_{};
  Traffic<ForceState, HandleState> traffic_;
  std::array<std::uint8_t, kMaxMessageBytes> buffer_{};
};

/// One thread. Cycle: all but construction. `port` outlives the endpoint.
class OperatorEndpoint {
 public:
  using Time = std::chrono::nanoseconds;
  OperatorEndpoint(DatagramPort& port, const Key& key, const EndpointConfig& config);

  /// Receives what waits, and looks for the robot while it is silent. True if there is a newer message().
  bool poll(Time now) noexcept;
  void send(const LinkState& link, const HandleState& state, Time now) noexcept {
    if (const auto datagram = traffic_.make(link, state, now); !datagram.empty()) port_.send(datagram);
  }

  /// The robot has been heard within the allowed silence.
  bool connected(Time now) const noexcept {
    return traffic_.heard() && traffic_.silence(now) <= config_.silence;
  }
  /// Since connected().
  const ForceMessage& message() const noexcept { return traffic_.newest(); }
  LinkReport report(Time now) const noexcept { return traffic_.report(now, config_.silence); }

 private:
  void look_for_robot(Time now) noexcept;
  void begin_session(std::span<const std::uint8_t> welcome, Time now) noexcept;

  DatagramPort& port_;
  Key key_;
  EndpointConfig config_;
  Greeting greeting_;
  bool looking_ = false;
  Time looking_since_{};
  Time greeted_{};
  Traffic<HandleState, ForceState> traffic_;
  std::array<std::uint8_t, kMaxMessageBytes> buffer_{};
};

}  // namespace drivers::station
