/// @file
/// A robot on a bus whose ends are delayed by a busy machine.
#pragma once
#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <random>
#include <utility>

#include "hal/clock.h"
#include "hal/robot_wrapper.h"

namespace support {

/// Frame and answer are delayed as configured, and the program with them, while robot and clock continue. The
/// joints' measurements are from the end of the first delay; the stamp, like that of youbot-sim's bus, from
/// the end of the second. Without delays it changes nothing.
class HeldUpRobot final : public hal::RobotWrapper {
 public:
  struct Delay {
    std::chrono::nanoseconds frame{};    ///< until the robot has it
    std::chrono::nanoseconds answer{};   ///< from then until the kernel has it
    std::chrono::nanoseconds program{};  ///< from then until it is processed
  };
  using Delays = std::function<Delay()>;

  /// `robot`, which uses `clock`, and `clock` must outlive it.
  HeldUpRobot(hal::Robot& robot, hal::Clock& clock) : RobotWrapper(robot), clock_(clock) {}

  void hold_up(Delays delays) { delays_ = std::move(delays); }
  hal::CycleStatus exchange(const hal::RobotCommand& command, hal::RobotSample& sample) noexcept override {
    const Delay delay = delays_ ? delays_() : Delay{};
    const std::chrono::nanoseconds sent = clock_.now();
    pass(delay.frame);
    sample.stamp = taken_;  // unchanged by the robot if it has no new sample
    const hal::CycleStatus status = RobotWrapper::exchange(command, sample);
    pass(delay.answer);
    if (sample.stamp != std::exchange(taken_, sample.stamp)) {
      sample.earliest = std::min(sent, taken_);
      answered_ = sample.latest = std::max(clock_.now(), taken_);
    }
    sample.stamp = answered_;
    pass(delay.program);
    return status;
  }

 private:
  void pass(std::chrono::nanoseconds duration) noexcept { clock_.sleep_until(clock_.now() + duration); }

  hal::Clock& clock_;
  Delays delays_;
  std::chrono::nanoseconds taken_{};     // of the last sample
  std::chrono::nanoseconds answered_{};  // likewise
};

/// Each answer is late by up to `most`. Zero: none.
class LateAnswers {
 public:
  LateAnswers(std::chrono::nanoseconds most, std::uint64_t seed) : late_(0, most.count()), random_(seed) {}
  HeldUpRobot::Delay operator()() { return {.answer = std::chrono::nanoseconds(late_(random_))}; }

 private:
  std::uniform_int_distribution<std::int64_t> late_;
  std::mt19937_64 random_;
};

/// Delays from two processes on a busy machine, up to 19 ms: alternating periods of two kinds.
class BusyMachine {
 public:
  explicit BusyMachine(std::uint64_t seed) : random_(seed) {}

  HeldUpRobot::Delay operator()() {
    if (left_-- <= 0) begin();
    HeldUpRobot::Delay delay{ms(between(0, 0.1)), ms(between(0, 0.1)), ms(between(0, 0.1))};
    const std::array<std::chrono::nanoseconds*, 3> waits{&delay.frame, &delay.answer, &delay.program};
    std::chrono::nanoseconds& wait = *waits[static_cast<std::size_t>(between(0, 2.999))];
    switch (kind_) {
      case Kind::kQuiet: break;
      case Kind::kAlways: wait += ms(between(0, most_ms_)); break;
      case Kind::kNowAndThen:
        if (between(0, 1) < share_) wait += ms(most_ms_);
        break;
      case Kind::kLaterAndLater:
        later_ms_ = later_ms_ + step_ms_ > most_ms_ ? 0 : later_ms_ + step_ms_;
        delay.answer += ms(later_ms_);
        break;
    }
    return delay;
  }

 private:
  enum class Kind : std::uint8_t { kQuiet, kAlways, kNowAndThen, kLaterAndLater };

  static std::chrono::nanoseconds ms(double value) {
    return std::chrono::nanoseconds(static_cast<std::int64_t>(1e6 * value));
  }
  double between(double low, double high) { return std::uniform_real_distribution(low, high)(random_); }
  void begin() {
    kind_ = static_cast<Kind>(static_cast<int>(between(0, 3.999)));
    left_ = static_cast<int>(between(20, 500));
    most_ms_ = between(0.5, between(1, 19));
    share_ = between(0.02, 0.5);
    step_ms_ = between(0.1, 2);
    later_ms_ = 0;
  }

  std::mt19937_64 random_;
  Kind kind_ = Kind::kQuiet;
  int left_ = 0;
  double most_ms_ = 0;
  double share_ = 0;
  double step_ms_ = 0;
  double later_ms_ = 0;
};

}  // namespace support
