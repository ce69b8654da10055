/// @file
/// The Hall sensors of a motor as reported by its drive over a mailbox.
#pragma once
#include <algorithm>
#include <cmath>

#include "hal/joint.h"

namespace support {

/// Asked every ten cycles, written after three, read after four, answered after six.
class HallSensors {
 public:
  /// @param turns_per_rad electrical revolutions of the motor for a radian of the joint
  explicit HallSensors(double turns_per_rad) noexcept : turns_per_rad_(turns_per_rad) {}

  /// Once per cycle: rotor position, and the encoder's value.
  void update(double true_rad, double shown_rad) noexcept {
    const double shown_turn = shown_rad * turns_per_rad_;
    if (cycle_ <= 3) low_ = high_ = shown_turn;
    low_ = std::min(low_, shown_turn);
    high_ = std::max(high_, shown_turn);
    if (cycle_ == 4) {
      const double turn = true_rad * turns_per_rad_ + 0.137;  // with some mounting offset
      hall_turn_ = (std::floor(6 * (turn - std::floor(turn))) + 0.5) / 6;
    }
    if (cycle_ == 6) reading_ = {reading_.number + 1, hall_turn_, low_, high_};
    cycle_ = (cycle_ + 1) % 10;
  }
  const hal::RotorReading& reading() const noexcept { return reading_; }

 private:
  double turns_per_rad_;
  int cycle_ = 0;
  double low_ = 0.0;
  double high_ = 0.0;
  double hall_turn_ = 0.0;
  hal::RotorReading reading_;
};

}  // namespace support
