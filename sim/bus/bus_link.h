/// @file
/// A link of the EtherCAT master to emulated slaves in the same process.
#pragma once
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <span>
#include <string>

#include "drivers/ethercat/link.h"
#include "sim/bus/emulated_wire.h"

namespace sim::bus {

/// Advances emulated time while the master waits for a frame. The owner of a plant derives from it to advance
/// plant, clock and bus together; wait() must end with EmulatedWire::advance(step), on which the master's
/// time-outs rely.
class EmulatedTime {
 public:
  EmulatedTime() = default;
  EmulatedTime(const EmulatedTime&) = delete;
  EmulatedTime& operator=(const EmulatedTime&) = delete;
  virtual ~EmulatedTime() = default;
  virtual void wait(std::chrono::nanoseconds step) noexcept = 0;
};

/// send() lets the bus process the frame at once. receive() returns the reply that is due, waits for one due
/// within the timeout, or waits until the time-out: all in emulated time.
class BusLink final : public drivers::ethercat::Link {
 public:
  /// `wire` and `time` must outlive the link. Without `time`, waiting advances the wire itself.
  explicit BusLink(EmulatedWire& wire, EmulatedTime* time = nullptr) : wire_(wire), time_(time) {}

  bool send(std::span<const std::uint8_t> frame) noexcept override {
    wire_.send(frame);
    return true;
  }

  std::size_t receive(std::span<std::uint8_t> buffer, std::chrono::nanoseconds timeout) noexcept override {
    const std::chrono::nanoseconds until_reply =
        wire_.next_reply() ? *wire_.next_reply() - wire_.now() : std::chrono::nanoseconds::max();
    const std::chrono::nanoseconds step = std::min(until_reply, timeout);
    if (step.count() > 0) pass(step);
    return wire_.receive(buffer);
  }

  /// The emulated time, which advances in receive() and wait(). On an untimed wire it would not advance:
  /// there it is the machine's clock.
  std::chrono::nanoseconds now() const noexcept override { return wire_.timed() ? wire_.now() : Link::now(); }
  void wait(std::chrono::nanoseconds duration) override {
    wire_.timed() ? pass(duration) : Link::wait(duration);
  }
  int last_error() const noexcept override { return 0; }
  const std::string& name() const noexcept override { return name_; }

 private:
  void pass(std::chrono::nanoseconds step) noexcept {
    time_ != nullptr ? time_->wait(step) : wire_.advance(step);
  }

  EmulatedWire& wire_;
  EmulatedTime* time_;
  const std::string name_ = "emulated bus";
};

}  // namespace sim::bus
