#include "hal/haptic/force_dimension_link.h"

#include <utility>

#include "hal/haptic/from_driver.h"
#include "hal/haptic/rethrow.h"

namespace hal {

using drivers::haptic::ForceDimension;
using drivers::haptic::ForceDimensionInfo;

ForceDimensionLink::ForceDimensionLink(ForceDimensionLinkConfig config) : config_(std::move(config)) {
  info_.name = "Force Dimension omega.6";
}

void ForceDimensionLink::open() {
  close();
  if (config_.transport == ForceDimensionTransport::kUsb)
    throw SetupError(
        "Force Dimension omega.6", "open it directly over USB",
        "not supported: the vendor publishes neither its packets nor the calibration data in the "
        "device, so positions and forces would be guesses; use the vendor's SDK");
  with_hal_errors([this] {
    if (config_.look_at_bus) config_.look_at_bus();
    const drivers::haptic::ForceDimensionLibrary library(config_.sdk);
    device_ = std::make_unique<ForceDimension>(library, config_.device);
  });
  const ForceDimensionInfo& found = device_->info();
  info_ = {.name = found.name,
           .force_limit_N = found.force_limit_N,
           .senses_rotation = true,
           .warnings = found.warnings};
}

bool ForceDimensionLink::close() noexcept {
  if (device_) force_off_ = device_->stop();
  device_.reset();
  return force_off_;
}

HapticStatus ForceDimensionLink::exchange(const HapticCommand& command, std::chrono::nanoseconds now,
                                          HapticSample& sample) noexcept {
  if (!device_) return {HapticFault::kNotActive};
  drivers::haptic::DeviceSample measured;
  const drivers::haptic::DeviceStatus status =
      device_->exchange({.enable = command.enable, .f_D_H_N = to_driver(command.f_D_H_N)}, now, measured);
  return from_driver(status, measured, now, sample);
}

std::string ForceDimensionLink::describe(const HapticStatus& status) const {
  return drivers::haptic::describe_force_dimension(status.fault, static_cast<std::int32_t>(status.detail));
}

}  // namespace hal
