/// @file
/// Reads where a motor's rotor stands by its Hall sensors, again and again, while the drive works.
#pragma once
#include <chrono>
#include <cstdint>

#include "drivers/tmcl/request_queue.h"
#include "hal/axis_scale.h"
#include "hal/joint.h"

namespace hal {

/// The process data do not have the Hall sensors, but parameter 210 does (Trinamic's BLDC modules: 65536 to
/// an electrical revolution). A request and its reply take some cycles; what the encoder counted meanwhile
/// belongs to the reading. A drive that refuses the parameter is not asked again, and one that does not
/// answer only after a second. Cycle: all of it. One thread.
class HallReader {
 public:
  HallReader(const AxisConstants& axis, std::chrono::nanoseconds period) noexcept;

  static drivers::tmcl::Request request() noexcept;
  /// Once a cycle, whether its frame came back or not: whether it is time to ask.
  bool due() noexcept;
  /// request() has been queued.
  void ask() noexcept;
  /// What came of it.
  void answer(const drivers::tmcl::Completion& completion) noexcept;
  /// After answer(), with each frame that came back: where the encoder is.
  void pass(std::int64_t position_ticks) noexcept;
  /// Whatever has been asked: the counter starts again somewhere else.
  void forget() noexcept;

  /// The latest.
  const RotorReading& reading() const noexcept { return reading_; }
  bool refused() const noexcept { return refused_; }

 private:
  double turns_per_tick_;
  int interval_cycles_;
  int patience_cycles_;
  int wait_cycles_ = 0;
  bool asked_ = false;
  int cycles_ = 0;  // since then
  bool answered_ = false;
  bool refused_ = false;
  std::int32_t hall_angle_ = 0;
  std::int64_t position_ticks_ = 0;
  std::int64_t low_ticks_ = 0;
  std::int64_t high_ticks_ = 0;
  RotorReading reading_{};
};

}  // namespace hal
