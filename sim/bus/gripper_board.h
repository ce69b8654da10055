/// @file
/// The youBot's gripper controller (TMCM-KR-842): two stepper motors on self-locking spindles. It is not a
/// slave: arm joint 5's board forwards its telegrams.
#pragma once
#include <array>
#include <chrono>
#include <cstdint>

#include "drivers/tmcl/telegram.h"

namespace sim::bus {

/// Microsteps on the wire: opening is negative (official driver).
struct GripperOptions {
  double travel = 66000;  ///< from the closed to the open stop, 11.5 mm
  /// Opening of the bars at power-up, from closed: the spindles hold them.
  std::array<double, 2> opening{20000, 20000};
};

/// The motors count steps, not motion: against a stop, or an object, steps are lost and the counter runs on.
/// Speed is constant: v = 16 MHz·speed / (2^pulse divisor · 2048 · 32), the ramp chip's formula (TMC428 data
/// sheet); acceleration is not modelled. Setting the counter moves nothing. Answers to telegrams that the
/// official driver does not use are a guess. Cycle: execute(), advance().
class GripperBoard {
 public:
  explicit GripperBoard(const GripperOptions& options = {}) noexcept;

  drivers::tmcl::MailboxBytes execute(const drivers::tmcl::Request& request) noexcept;
  void advance(std::chrono::nanoseconds step) noexcept;
  void power_changed(bool on) noexcept;

  /// True value, microsteps from closed.
  double opening(std::size_t bar) const noexcept { return bars_[bar].opening; }
  /// An object between the bars: each closes no further than this.
  void hold_object(double opening) noexcept { object_opening_ = opening; }

 private:
  struct Bar {
    std::array<std::int32_t, 256> parameters{};
    double opening = 0.0;  // true
    double counter = 0.0;  // the controller's value; negative is open
    std::int32_t target = 0;
    std::int32_t speed = 0;  // of the present motion
    bool stalled = false;
    bool moving() const noexcept { return counter != static_cast<double>(target); }
  };
  struct Answer {
    drivers::tmcl::Status status = drivers::tmcl::Status::kOk;
    std::int32_t value = 0;
  };

  void forget() noexcept;
  void advance(Bar& bar, double seconds) const noexcept;
  Answer execute_command(const drivers::tmcl::Request& request) noexcept;
  Answer execute_on_bar(const drivers::tmcl::Request& request, Bar& bar) noexcept;
  static Answer get(const Bar& bar, std::uint8_t number) noexcept;
  static Answer set(Bar& bar, std::uint8_t number, std::int32_t value) noexcept;

  GripperOptions options_;
  std::array<Bar, 2> bars_;
  std::array<std::int32_t, 256> user_variables_{};  // all RAM
  double object_opening_ = 0.0;
  bool powered_ = true;
};

}  // namespace sim::bus
