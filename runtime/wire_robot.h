/// @file
/// The EtherCAT robot on an emulated bus in the same process.
#pragma once
#include <chrono>

#include "hal/ethercat_robot.h"
#include "hal/robot_wrapper.h"
#include "sim/bus/youbot_bus.h"

namespace runtime {

/// Advances the emulated robot's time with the exchanges: one period each, including the duration of the
/// frame.
class WireRobot final : public hal::RobotWrapper {
 public:
  /// `emulation` and `clock` must outlive the robot.
  WireRobot(sim::bus::YoubotBus& emulation, const hal::EthercatOptions& options, const hal::Clock& clock,
            std::chrono::nanoseconds period);

  void activate() override;
  hal::CycleStatus exchange(const hal::RobotCommand& command, hal::RobotSample& sample) noexcept override;

 private:
  sim::bus::YoubotBus& emulation_;
  std::chrono::nanoseconds period_;
  std::chrono::nanoseconds due_{};  // emulated time after the current exchange
};

}  // namespace runtime
