/// @file
/// What a robot is to do between an enable and drives that are off: a path, an experiment, to hold its place.
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
  kFaulted,   ///< drives off, still cycling so that they hear it
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

/// A cycle as its task sees it.
struct Moment {
  std::chrono::nanoseconds now{};   ///< of the loop's clock
  std::chrono::nanoseconds time{};  ///< since the first cycle
  std::chrono::nanoseconds gap{};   ///< since the last cycle
  bool paused = false;              ///< this program paused for long enough to stop the robot
  Phase phase{};                    ///< in which the cycle began
  const hal::CycleStatus& status;   ///< of this cycle's exchange
  const hal::RobotSample& sample;
  const hal::RobotCommand& sent;  ///< in this cycle's exchange: it acts from the sample on
};

/// What follows from a cycle.
struct Verdict {
  enum class Next : std::uint8_t {
    kGoOn,
    kBrake,  ///< come to rest, then off
    kRest,   ///< from brake(): at rest, off
    kFail,   ///< off at once
  };
  Next next = Next::kGoOn;
  StopReason reason{};  ///< none: the task has come to its end
};

/// Stepped by a Supervisor, which alone enables, stops and switches off. One thread; all calls belong to the
/// cycle: no allocation, lock, exception, blocking call or logging.
class Task {
 public:
  Task() = default;
  Task(const Task&) = delete;
  Task& operator=(const Task&) = delete;
  virtual ~Task() = default;

  /// Once in each cycle, first of all: what the robot reports.
  virtual void read(const Moment& moment) noexcept = 0;
  /// After read() in a cycle that begins paused. False: nothing here can be braked any more, switch off at
  /// once.
  virtual bool can_brake_after_pause(const Moment& moment) noexcept = 0;
  /// While the drives do not obey. Only a failure before they do counts.
  virtual Verdict wait(const Moment& moment) noexcept = 0;
  /// In the first cycle in which they do.
  virtual Verdict begin(const Moment& moment, hal::RobotCommand& command) noexcept = 0;
  /// In each cycle after that: the next command.
  virtual Verdict step(const Moment& moment, hal::RobotCommand& command) noexcept = 0;
  /// Likewise, towards rest; also in the cycle whose step() says so. `fastest_rad_per_s`: of what is to rest,
  /// by which the supervisor finds that it does; a task that finds that itself leaves it as it is.
  virtual Verdict brake(const Moment& moment, hal::RobotCommand& command,
                        double& fastest_rad_per_s) noexcept = 0;

  static constexpr std::chrono::milliseconds kBrakeTimeout{2000};
  /// What does not rest after braking for so long is switched off, which is a fault.
  virtual std::chrono::nanoseconds brake_timeout() const noexcept { return kBrakeTimeout; }
};

}  // namespace runtime
