/// @file
/// Enables a robot, steps a task, and always brings the robot to rest and switches the drives off.
#pragma once
#include <chrono>
#include <cstdint>
#include <utility>

#include "hal/robot.h"
#include "runtime/monitored_robot.h"
#include "runtime/recent_pause.h"
#include "runtime/stop_reason.h"
#include "runtime/task.h"

namespace runtime {

/// kStarting → kRunning → kStopping → kOff, any → kFaulted → finished.
/// A fault of the robot switches the drives off at once. After a pause of this program it brakes first, if
/// the task can. There is no way back: motion after a stop needs a new supervisor. One thread. step() is the
/// cycle: no allocation, lock, exception, blocking call or logging.
class Supervisor {
 public:
  struct Config {
    std::chrono::nanoseconds period{1'000'000};
    /// Older set-points stop the robot, and so does a cycle that is late by more.
    std::chrono::nanoseconds command_timeout{100'000'000};
    /// Commutation takes up to 5 s per motor controller, a hot winding 14 s to cool.
    std::chrono::nanoseconds enable_timeout{30'000'000'000};
    double rest_rad_per_s = 0.02;  ///< slower for kRestHold counts as rest
    control::PlausibilityMonitor::Wheels wheels = control::PlausibilityMonitor::Wheels::kRolling;
    control::ChecksOff checks_off{};  ///< of the sensors
    control::ModelChanges arm{};      ///< whose weight the checks expect
  };
  /// A velocity filter needs about 15 ms to detect that a joint rests.
  static constexpr std::chrono::milliseconds kRestHold{50};
  /// Cycles with the drives off before the end, so that every drive has received it.
  static constexpr std::chrono::milliseconds kOffHold{20};

  /// `robot` and `task` must outlive it.
  Supervisor(const Config& config, hal::Robot& robot, Task& task);

  void step(std::chrono::nanoseconds now) noexcept;
  /// Comes to rest, then switches off. From the cycle's thread.
  void request_stop() noexcept;
  /// Drives off with the next step. From the cycle's thread.
  void switch_off() noexcept;
  bool finished() const noexcept;

  const StopReason& stop_reason() const noexcept { return stop_reason_; }
  /// What switched the drives off before they came to rest, if the stop had another reason.
  const StopReason& cut_short_by() const noexcept { return cut_short_by_; }
  control::ChecksOff silent_checks() const noexcept { return robot_.silent_checks(); }
  control::ChecksOff once_silent_checks() const noexcept { return robot_.once_silent_checks(); }

 private:
  void follow(const Verdict& verdict, const Moment& moment) noexcept;
  void brake(const Moment& moment) noexcept;
  void enter(Phase phase) noexcept;
  void fail(const StopReason& reason) noexcept;
  void keep(StopReason reason) noexcept;

  Config config_;
  MonitoredRobot robot_;
  Task& task_;
  hal::RobotCommand command_;
  hal::RobotCommand sent_;
  hal::RobotSample sample_;
  hal::CycleStatus status_{};
  RecentPause pause_;
  StopReason stop_reason_;
  StopReason cut_short_by_;
  Phase phase_ = Phase::kStarting;
  std::uint64_t count_ = 0;
  std::chrono::nanoseconds first_{};
  std::chrono::nanoseconds now_{};
  std::chrono::nanoseconds phase_begin_{};
  std::chrono::nanoseconds last_motion_{};  // while stopping
};

/// A task and its supervisor. `T::Config` is derived from Supervisor::Config.
template <typename T>
class Supervised {
 public:
  using Config = typename T::Config;

  /// `robot`, and the references in `more`, must outlive it. @throws what the task's constructor throws.
  template <typename... More>
  Supervised(const Config& config, hal::Robot& robot, More&&... more)
      : task_(config, robot, std::forward<More>(more)...), supervisor_(config, robot, task_) {}

  void step(std::chrono::nanoseconds now) noexcept { supervisor_.step(now); }
  void request_stop() noexcept { supervisor_.request_stop(); }
  void switch_off() noexcept { supervisor_.switch_off(); }
  bool finished() const noexcept { return supervisor_.finished(); }
  const StopReason& stop_reason() const noexcept { return supervisor_.stop_reason(); }
  const StopReason& cut_short_by() const noexcept { return supervisor_.cut_short_by(); }
  control::ChecksOff silent_checks() const noexcept { return supervisor_.silent_checks(); }
  control::ChecksOff once_silent_checks() const noexcept { return supervisor_.once_silent_checks(); }
  /// Record of the last step().
  auto& record() noexcept { return task_.record(); }
  const auto& record() const noexcept { return task_.record(); }
  T& task() noexcept { return task_; }
  const T& task() const noexcept { return task_; }

 private:
  T task_;
  Supervisor supervisor_;
};

}  // namespace runtime
