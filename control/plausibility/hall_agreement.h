/// @file
/// Compares a motor's encoder with its Hall sensors.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "hal/joint.h"

namespace control {

/// Hall sensors and encoder sit on the same shaft and share no part, so that their angles differ by a
/// constant whatever the joint does: load, friction, slip and a wall do not matter, and half an electrical
/// revolution is enough to see (15 mrad of a youBot's wheel, 2 to 7 mrad of its arm joints). Neither the
/// constant nor the sense of turning is known. So each reading excludes the constants that it contradicts,
/// and when every one has been excluded several times, one of the two sensors is wrong. What no constant
/// explains once only, as a single wrong position, is forgotten while the motor turns on.
///
/// A reading takes some milliseconds, and says nothing while the motor turns a quarter of a revolution
/// meanwhile; what begins at such a speed VelocityStep sees. Hall sensors that never change are taken for a
/// drive that does not report them. One thread. Cycle: update() and restart() neither allocate nor throw.
class HallAgreement {
 public:
  void restart() noexcept;
  /// With each sample, `elapsed_s` after the last one; a reading is judged once. True: they disagree.
  bool update(const hal::RotorReading& reading, double elapsed_s) noexcept;
  /// In which of two senses they turn alike, 1 or -1. 0: they have not turned enough to know, do not agree,
  /// or no reading has been judged for half a second.
  int sense() const noexcept;
  /// Since the last reading. Zero before the first one: not every drive reports its Hall sensors.
  double without_reading_s() const noexcept { return number_ == 0 ? 0.0 : unread_s_; }

 private:
  static constexpr std::size_t kOffsets = 32;

  void judge(const hal::RotorReading& reading) noexcept;
  bool turns(double hall_turn) noexcept;
  /// Of the constants of one sense.
  double least_contradicted(std::size_t sense) const noexcept;

  /// How often a constant was contradicted lately, by sense of turning and size.
  std::array<std::array<double, kOffsets>, 2> contradicted_{};
  std::uint32_t number_ = 0;  // of the latest reading
  double unread_s_ = 0.0;     // since it
  double unjudged_s_ = 0.0;   // since the last one that was judged
  bool begun_ = false;
  double encoder_turn_ = 0.0;     // where readings were last forgotten
  std::array<double, 2> seen_{};  // two places where the Hall sensors have been
  int places_ = 0;
};

}  // namespace control
