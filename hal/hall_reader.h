/// @file
/// Reads a motor's rotor angle from its Hall sensors repeatedly during operation.
#pragma once
#include <chrono>
#include <cstdint>

#include "drivers/tmcl/request_queue.h"
#include "hal/axis_scale.h"
#include "hal/joint.h"

namespace hal {

/// Process data do not include the Hall sensors, but parameter 210 does (Trinamic's BLDC modules: 65536
/// per electrical revolution). A request and its reply take some cycles; the reading includes the range of
/// encoder counts in that time. A drive that refuses the parameter is not asked again; one that does not
/// answer is asked again after a second. Cycle: all of it. One thread.
class HallReader {
 public:
  /// @param cycles_to_write after ask() until the request is on the wire: encoder counts before that do not
  /// belong to the reading.
  HallReader(const AxisConstants& axis, std::chrono::nanoseconds period, int cycles_to_write) noexcept;

  static drivers::tmcl::Request request() noexcept;
  /// Call once per cycle, with or without an answered frame. True if it is time to ask.
  bool due() noexcept;
  /// request() has been queued.
  void ask() noexcept;
  /// The result of the request.
  void answer(const drivers::tmcl::Completion& completion) noexcept;
  /// Cycles since ask(), while there is no answer.
  int unanswered_cycles() const noexcept { return asked_ && !answered_ ? cycles_ : 0; }
  /// The pending request is not going to be answered.
  void cancel() noexcept { asked_ = false; }
  /// After answer(), for each frame that came back: the encoder position.
  void pass(std::int64_t position_ticks) noexcept;
  /// Discards a pending request: the counter restarts at another value.
  void forget() noexcept;

  /// The latest reading.
  const RotorReading& reading() const noexcept { return reading_; }
  bool refused() const noexcept { return refused_; }

 private:
  int cycles_to_write_;
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
