/// @file
/// The EtherCAT robot on an emulated bus in the same process.
#pragma once
#include <chrono>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hal/ethercat_robot.h"
#include "hal/robot.h"
#include "sim/bus/youbot_bus.h"

namespace apps {

/// Lets the emulated robot's time go on with the exchanges: one period each, of which the frame takes its
/// part.
class WireRobot final : public hal::Robot {
 public:
  /// `emulation` and `clock` outlive the robot.
  WireRobot(sim::bus::YoubotBus& emulation, const hal::EthercatOptions& options, const hal::Clock& clock,
            std::chrono::nanoseconds period);

  std::span<const hal::JointInfo> joints() const noexcept override { return robot_->joints(); }
  void activate() override;
  void deactivate() noexcept override { robot_->deactivate(); }
  hal::CycleStatus exchange(const hal::RobotCommand& command, hal::RobotSample& sample) noexcept override;
  std::vector<std::string> notes() const override { return robot_->notes(); }
  std::string explain(const hal::CycleStatus& status) const override { return robot_->explain(status); }
  std::optional<hal::BusLosses> losses() const override { return robot_->losses(); }
  std::vector<std::string> trouble() const override { return robot_->trouble(); }
  std::vector<std::string> report() const override { return robot_->report(); }

 private:
  sim::bus::YoubotBus& emulation_;
  std::chrono::nanoseconds period_;
  std::chrono::nanoseconds due_{};  // emulated time after the exchange under way
  std::unique_ptr<hal::Robot> robot_;
};

}  // namespace apps
