/// @file
/// A robot that forwards every call to another one.
#pragma once
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "hal/robot.h"

namespace hal {

/// Base of decorators: they override what they change.
class RobotWrapper : public Robot {
 public:
  /// `robot` must outlive the wrapper.
  explicit RobotWrapper(Robot& robot) : robot_(robot) {}
  explicit RobotWrapper(std::unique_ptr<Robot> robot) : owned_(std::move(robot)), robot_(*owned_) {}

  std::span<const JointInfo> joints() const noexcept override { return robot_.joints(); }
  void activate() override { robot_.activate(); }
  void deactivate() noexcept override { robot_.deactivate(); }
  CycleStatus exchange(const RobotCommand& command, RobotSample& sample) noexcept override {
    return robot_.exchange(command, sample);
  }
  std::vector<std::string> notes() const override { return robot_.notes(); }
  std::string explain(const CycleStatus& status) const override { return robot_.explain(status); }
  std::optional<BusLosses> losses() const override { return robot_.losses(); }
  std::vector<BusDevice> devices() const override { return robot_.devices(); }
  std::vector<std::string> device_faults() const override { return robot_.device_faults(); }
  std::vector<std::string> report() const override { return robot_.report(); }

 private:
  std::unique_ptr<Robot> owned_;
  Robot& robot_;
};

}  // namespace hal
