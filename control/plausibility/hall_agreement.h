/// @file
/// Compares a motor's encoder with its Hall sensors.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "hal/joint.h"

namespace control {

/// Hall sensors and encoder sit on the same shaft and share no part, so their angles differ by a constant.
/// Load, friction, slip and contact do not change it, and half an electrical revolution is enough for the
/// comparison (15 mrad of a youBot's wheel, 2 to 7 mrad of its arm joints). Neither the constant nor the
/// sense of rotation is known. Each reading therefore excludes the constants that it contradicts; once every
/// constant has been excluded several times, one of the two sensors is wrong. A single contradiction, such as
/// one wrong position, is forgotten as the motor turns on.
///
/// A reading takes some milliseconds and is not judged if the motor turns by more than half a
/// revolution in that time; VelocityStep detects faults that begin at such a speed. If the Hall sensors never
/// change, the drive is assumed not to report them. One thread. Cycle: update() and restart() neither
/// allocate nor throw.
class HallAgreement {
 public:
  void restart() noexcept;
  /// Call with each sample, `elapsed_s` after the last one; each reading is judged once. True: they disagree.
  bool update(const hal::RotorReading& reading, double elapsed_s) noexcept;
  /// Relative sense of rotation of both sensors, 1 or -1. 0: they have not turned far enough, they disagree,
  /// or no reading has been judged for half a second.
  int sense() const noexcept;
  /// Whether every constant has been contradicted at least once in either sense: suspicious, but not enough
  /// for a finding.
  bool contradicted() const noexcept;
  /// Time since the last reading. Zero before the first one: not every drive reports its Hall sensors.
  double without_reading_s() const noexcept { return number_ == 0 ? 0.0 : unread_s_; }

 private:
  static constexpr std::size_t kOffsets = 32;

  void judge(const hal::RotorReading& reading) noexcept;
  bool turns(double hall_turn) noexcept;
  /// Minimum over the constants of one sense.
  double least_contradicted(std::size_t sense) const noexcept;

  /// Number of recent contradictions of each constant, by sense of rotation and size.
  std::array<std::array<double, kOffsets>, 2> contradicted_{};
  std::uint32_t number_ = 0;  // of the latest reading
  double unread_s_ = 0.0;     // time since the latest reading
  double unjudged_s_ = 0.0;   // time since the last judged reading
  bool begun_ = false;
  double encoder_turn_ = 0.0;     // encoder angle at the last reduction of the contradictions
  std::array<double, 2> seen_{};  // first two distinct angles of the Hall sensors
  int places_ = 0;
};

}  // namespace control
