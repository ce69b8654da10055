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
  Phase phase{};                    ///< in which the cycle began
  const hal::RobotSample& sample;
  const hal::RobotCommand& sent;  ///< in this cycle's exchange: it acts from the sample on
};

/// What follows from a cycle.
struct Verdict {
  enum class Next : std::uint8_t {
    kGoOn,
    kBrake,  ///< come to rest, then off
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
  /// After a pause of this program that was long enough to stop the robot, before it goes on. False: nothing
  /// here can be braked any more, switch off at once.
  virtual bool can_brake_after_pause() noexcept = 0;
  /// While the drives do not obey.
  virtual void wait(const Moment& moment) noexcept = 0;
  /// In the first cycle in which they do.
  virtual Verdict begin(const Moment& moment, hal::RobotCommand& command) noexcept = 0;
  /// In each cycle after that: the next command.
  virtual Verdict step(const Moment& moment, hal::RobotCommand& command) noexcept = 0;
  /// Likewise, towards rest; also in the cycle whose step() says so. `fastest_rad_per_s`: of what is to rest.
  virtual Verdict brake(const Moment& moment, hal::RobotCommand& command,
                        double& fastest_rad_per_s) noexcept = 0;
};

}  // namespace runtime
