#include "runtime/monitored_robot.h"

#include "hal/seconds.h"

namespace runtime {

hal::CycleStatus MonitoredRobot::exchange(const hal::RobotCommand& command,
                                          hal::RobotSample& sample) noexcept {
  if (!command.enable) latched_ = {};
  hal::RobotCommand sent = command;
  sent.enable = command.enable && latched_.ok();
  const hal::CycleStatus status = RobotWrapper::exchange(sent, sample);
  const double elapsed_s = hal::seconds(sample.stamp - stamp_);
  stamp_ = sample.stamp;
  if (!status.ok() || !sample.enabled) {
    monitor_.restart();
    return status.ok() ? latched_ : status;
  }
  if (const auto finding = monitor_.update(command, sample, elapsed_s); finding && latched_.ok())
    latched_ = {hal::Fault::kJointFault, static_cast<std::int8_t>(finding->joint),
                static_cast<std::uint32_t>(finding->fault)};
  once_silent_.add(monitor_.silent());
  if (!latched_.ok()) sample.enabled = false;  // they switch off with the next exchange
  return latched_;
}

}  // namespace runtime
