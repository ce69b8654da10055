/// @file
/// The wire between daemon and boards, with faults from a script.
#pragma once
#include <array>
#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "drivers/ethercat/link.h"

namespace faults {

/// Current faults of the wire. Probabilities are per frame.
struct WireFaults {
  bool silent = false;    ///< nothing is sent: the program is dead
  int send_error = 0;     ///< errno of each send
  int receive_error = 0;  ///< errno of each receive, which then returns nothing
  double loses_request = 0.0;
  double loses_reply = 0.0;
  double repeats = 0.0;                 ///< the reply comes twice
  double damages = 0.0;                 ///< a byte behind the Ethernet header is changed
  double truncates = 0.0;               ///< at a random position
  double miscounts = 0.0;               ///< the working counters are wrong by one
  double holds_back = 0.0;              ///< the reply comes with the next receive
  double replays = 0.0;                 ///< the reply to an earlier frame comes in its place
  double adds_strangers = 0.0;          ///< a frame of another protocol's length and content comes first
  double adds_other_master = 0.0;       ///< another master asks all slaves for their state
  double resets_by_other_master = 0.0;  ///< another master orders all slaves to INIT
};

/// Forwards frames to `wire`, except for its faults. `faults` and `random` must outlive the link.
class FaultyLink final : public drivers::ethercat::Link {
 public:
  FaultyLink(std::unique_ptr<Link> wire, const WireFaults& faults, std::mt19937_64& random)
      : wire_(std::move(wire)), faults_(faults), random_(random) {}

  bool send(std::span<const std::uint8_t> frame) noexcept override;
  std::size_t receive(std::span<std::uint8_t> buffer, std::chrono::nanoseconds timeout) noexcept override;
  std::chrono::nanoseconds now() const noexcept override { return wire_->now(); }
  void wait(std::chrono::nanoseconds duration) override { wire_->wait(duration); }
  int last_error() const noexcept override { return error_; }
  const std::string& name() const noexcept override { return wire_->name(); }

 private:
  using Bytes = std::vector<std::uint8_t>;

  bool happens(double probability) noexcept;
  /// Below `count`, which is positive.
  std::size_t any_of(std::size_t count) noexcept;
  void send_as_other_master(std::uint16_t al_control) noexcept;
  std::size_t delay(std::span<std::uint8_t> buffer, std::size_t size) noexcept;
  std::size_t damage(std::span<std::uint8_t> buffer, std::size_t size) noexcept;

  std::unique_ptr<Link> wire_;
  const WireFaults& faults_;
  std::mt19937_64& random_;
  std::deque<Bytes> waiting_;    // returned first
  std::deque<Bytes> held_back_;  // for the next receive
  Bytes earlier_;                // a reply that was delivered
  int error_ = 0;
};

}  // namespace faults
