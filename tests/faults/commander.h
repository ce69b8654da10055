/// @file
/// The operators: a client that commands the robot, and the hand on the handle.
#pragma once
#include <chrono>
#include <random>
#include <string>

#include "tests/faults/world.h"

namespace faults {

/// Enables, keeps the connection alive, sends velocities or moves the handle, and after a fault acknowledges
/// and enables again some time later.
class Commander {
 public:
  Commander(World& world, std::uint64_t seed) : world_(world), random_(seed) {}

  /// Each period.
  void act();
  /// From now on it only watches.
  void rest();
  /// From now on it enables as soon as possible, and drives straight ahead or holds the handle still: for the
  /// end of a script. Its knowledge of the daemon is cleared.
  void be_calm();
  void ask(const std::string& request) { note(world_.ask(1, request)); }

  const json& status() const noexcept { return status_; }
  const std::string& refusal() const noexcept { return refusal_; }  ///< of the last enable; empty: granted
  bool enabled() const { return status_.is_object() && status_.value("enabled", false); }

 private:
  void try_to_enable();
  void move();
  void note(const std::optional<Reply>& reply);
  double between(double low, double high) { return std::uniform_real_distribution<>(low, high)(random_); }

  World& world_;
  std::mt19937_64 random_;
  bool rests_ = false;
  bool calm_ = false;
  nanoseconds next_word_{};
  nanoseconds next_move_{};
  nanoseconds next_enable_{};
  json status_;
  std::string refusal_ = "not asked yet";
};

}  // namespace faults
