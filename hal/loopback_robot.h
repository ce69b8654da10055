/// @file
/// hal::Robot over a hal::Plant: every application runs unchanged without hardware.
#pragma once
#include <chrono>
#include <optional>
#include <vector>

#include "hal/clock.h"
#include "hal/plant.h"
#include "hal/robot.h"

namespace hal {

/// Each exchange() measures, then advances by one period with the command applied, as on a bus: the sample
/// answers the previous command. If the clock shows that cycles were skipped, the previous command first acts
/// through them (at most kMaxPeriods per exchange, so that a stop in a debugger is not simulated). A sample's
/// stamp is the plant's time: before or after the exchange, by at most a period.
class LoopbackRobot final : public Robot {
 public:
  static constexpr int kMaxPeriods = 100;

  /// `plant` and `clock` must outlive the robot. @throws hal::SetupError if `joints` does not fit the plant.
  LoopbackRobot(Plant& plant, const Clock& clock, std::chrono::nanoseconds period,
                std::vector<JointInfo> joints);

  std::span<const JointInfo> joints() const noexcept override { return joints_; }
  void activate() override;
  void deactivate() noexcept override;
  CycleStatus exchange(const RobotCommand& command, RobotSample& sample) noexcept override;

 private:
  RobotCommand within_limits(RobotCommand command) const noexcept;
  CycleStatus check(const RobotCommand& command) const noexcept;
  CycleStatus check(const RobotSample& sample) const noexcept;
  void advance(std::chrono::nanoseconds duration) noexcept;
  /// Returns the plant's time.
  std::chrono::nanoseconds catch_up(std::chrono::nanoseconds now) noexcept;

  Plant& plant_;
  const Clock& clock_;
  std::chrono::nanoseconds period_;
  std::vector<JointInfo> joints_;
  bool active_ = false;
  bool enabled_ = false;
  RobotCommand applied_{};
  CycleStatus latched_{};
  std::optional<std::chrono::nanoseconds> next_exchange_;  // end of the simulated time
};

}  // namespace hal
