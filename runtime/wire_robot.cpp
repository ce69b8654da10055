#include "runtime/wire_robot.h"

#include <memory>

#include "sim/bus/bus_link.h"

namespace runtime {

WireRobot::WireRobot(sim::bus::YoubotBus& emulation, const hal::EthercatOptions& options,
                     const hal::Clock& clock, std::chrono::nanoseconds period)
    : RobotWrapper(hal::make_ethercat_robot(
          [&emulation]() -> std::unique_ptr<drivers::ethercat::Link> {
            return std::make_unique<sim::bus::BusLink>(emulation.wire(), &emulation);
          },
          options, clock, period)),
      emulation_(emulation),
      period_(period) {}

void WireRobot::activate() {
  RobotWrapper::activate();
  due_ = emulation_.wire().now();
}

hal::CycleStatus WireRobot::exchange(const hal::RobotCommand& command, hal::RobotSample& sample) noexcept {
  due_ += period_;
  const hal::CycleStatus status = RobotWrapper::exchange(command, sample);
  const std::chrono::nanoseconds rest = due_ - emulation_.wire().now();
  if (rest.count() > 0) emulation_.advance(rest);
  return status;
}

}  // namespace runtime
