/// @file
/// Two DatagramPorts joined by a simulated network, in virtual time.
#pragma once
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <span>
#include <vector>

#include "drivers/station/datagram_port.h"
#include "hal/clock.h"
#include "sim/datagram_channel.h"

namespace support {

/// One end. What strangers inject arrives before what the network delivers.
class ChannelPort final : public drivers::station::DatagramPort {
 public:
  ChannelPort(sim::DatagramChannel& out, sim::DatagramChannel& in, const hal::Clock& clock)
      : out_(out), in_(in), clock_(clock) {}

  std::size_t receive(std::span<std::uint8_t> buffer) noexcept override {
    if (injected_.empty()) return in_.receive(buffer, clock_.now());
    const std::vector<std::uint8_t> bytes = injected_.front();
    injected_.pop_front();
    const std::size_t size = std::min(bytes.size(), buffer.size());
    std::copy_n(bytes.begin(), size, buffer.begin());
    return size;
  }
  void send(std::span<const std::uint8_t> datagram) noexcept override {
    if (on_send) on_send(datagram);
    out_.send(datagram, clock_.now());
  }
  void answer(std::span<const std::uint8_t> datagram) noexcept override { send(datagram); }
  void adopt_sender() noexcept override { ++adopted; }

  void inject(std::vector<std::uint8_t> datagram) { injected_.push_back(std::move(datagram)); }

  std::function<void(std::span<const std::uint8_t>)> on_send;  ///< sees everything that this end sends
  int adopted = 0;

 private:
  sim::DatagramChannel& out_;
  sim::DatagramChannel& in_;
  const hal::Clock& clock_;
  std::deque<std::vector<std::uint8_t>> injected_;
};

/// Both ways of a network between two ports, with independent losses.
struct ChannelPair {
  ChannelPair(const sim::NetworkConditions& conditions, std::uint64_t seed, const hal::Clock& clock)
      : to_robot(conditions, 2 * seed),
        to_operator(conditions, 2 * seed + 1),
        at_operator(to_robot, to_operator, clock),
        at_robot(to_operator, to_robot, clock) {}
  void set(const sim::NetworkConditions& conditions) {
    to_robot.set(conditions);
    to_operator.set(conditions);
  }
  void set_silent(bool silent) {
    to_robot.set_silent(silent);
    to_operator.set_silent(silent);
  }
  sim::DatagramChannel to_robot;
  sim::DatagramChannel to_operator;
  ChannelPort at_operator;
  ChannelPort at_robot;
};

}  // namespace support
