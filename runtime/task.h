/// @file
/// The work of a robot between enable and drives off: a path, an experiment, holding its position.
#pragma once
#include <chrono>
#include <cstdint>

#include "hal/robot.h"
#include "runtime/stop_reason.h"

namespace runtime {

enum class Phase : std::uint8_t {
  kStarting,  ///< waiting for the drives to obey
  kRunning,
  kStopping,  ///< braking to rest
  kFaulted,   ///< drives off, still cycling so that they receive it
  kOff,
};
/// "starting"
constexpr const char* name(Phase phase) noexcept {
  switch (phase) {
    case Phase::kStarting: return "starting";
    case Phase::kRunning: return "running";
    case Phase::kStopping: return "stopping";
    case Phase::kFaulted: return "faulted";
    case Phase::kOff: return "off";
  }
  return "unknown";
}
/// The drives obey.
constexpr bool moves(Phase phase) noexcept { return phase == Phase::kRunning || phase == Phase::kStopping; }

/// A cycle as seen by its task.
struct Moment {
  std::chrono::nanoseconds now{};   ///< of the loop's clock
  std::chrono::nanoseconds time{};  ///< since the first cycle
  std::chrono::nanoseconds gap{};   ///< since the last cycle
  bool paused = false;              ///< this program paused long enough to stop the robot
  Phase phase{};                    ///< at the start of the cycle
  const hal::CycleStatus& status;   ///< of this cycle's exchange
  const hal::RobotSample& sample;
  const hal::RobotCommand& sent;  ///< in this cycle's exchange: acts from the sample on
};

/// Result of a cycle for the supervisor.
struct Verdict {
  enum class Next : std::uint8_t {
    kGoOn,
    kBrake,  ///< come to rest, then off
    kRest,   ///< from brake(): at rest, off
    kFail,   ///< off at once
  };
  Next next = Next::kGoOn;
  StopReason reason{};  ///< empty: the task has finished
};

/// Stepped by a Supervisor, which alone enables, stops and switches off. One thread; all calls belong to the
/// cycle: no allocation, lock, exception, blocking call or logging.
class Task {
 public:
  Task() = default;
  Task(const Task&) = delete;
  Task& operator=(const Task&) = delete;
  virtual ~Task() = default;

  /// First call of each cycle: the robot's sample.
  virtual void read(const Moment& moment) noexcept = 0;
  /// After read() in a cycle that begins paused. False: braking is no longer possible, switch off at once.
  virtual bool can_brake_after_pause(const Moment& moment) noexcept = 0;
  /// While the drives do not obey. Only a failure verdict has an effect.
  virtual Verdict wait(const Moment& moment) noexcept = 0;
  /// In the first cycle in which they obey.
  virtual Verdict begin(const Moment& moment, hal::RobotCommand& command) noexcept = 0;
  /// In each cycle after that: computes the next command.
  virtual Verdict step(const Moment& moment, hal::RobotCommand& command) noexcept = 0;
  /// Likewise, towards rest; also in the cycle whose step() requests it. `fastest_rad_per_s`: speed of the
  /// fastest joint that must come to rest, by which the supervisor detects rest; a task that detects rest
  /// itself leaves it unchanged.
  virtual Verdict brake(const Moment& moment, hal::RobotCommand& command,
                        double& fastest_rad_per_s) noexcept = 0;

  static constexpr std::chrono::milliseconds kBrakeTimeout{2000};
  /// A joint that does not rest after braking for this long is switched off, which is a fault.
  virtual std::chrono::nanoseconds brake_timeout() const noexcept { return kBrakeTimeout; }
};

}  // namespace runtime
