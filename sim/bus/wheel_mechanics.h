/// @file
/// Four motor controller boards on one simulated base.
#pragma once
#include <array>
#include <chrono>
#include <cstddef>

#include "sim/base.h"
#include "sim/bus/board_drive.h"

namespace sim::bus {

/// Each board commands its own wheel; advance() moves the base under all four together. A wheel without power
/// gets zero current, because sim::Base switches all its bridges together.
class WheelMechanics {
 public:
  /// @throws std::invalid_argument see sim::Base
  explicit WheelMechanics(const BaseParameters& parameters) : base_(parameters) {}

  BoardDrive& drive(std::size_t wheel) noexcept { return wheels_[wheel]; }
  /// Cycle.
  void advance(std::chrono::nanoseconds period) noexcept;
  Base& base() noexcept { return base_; }

 private:
  class Wheel final : public BoardDrive {
   public:
    void command(const hal::JointCommand& command, bool powered) noexcept override {
      command_ = powered ? command : hal::JointCommand{};
    }
    hal::JointSample measured() const noexcept override { return sample_; }

    hal::JointCommand command_;
    hal::JointSample sample_;
  };

  Base base_;
  std::array<Wheel, 4> wheels_;
};

}  // namespace sim::bus
