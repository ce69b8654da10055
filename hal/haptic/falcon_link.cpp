#include "hal/haptic/falcon_link.h"

#include <utility>

#include "hal/haptic/from_driver.h"
#include "hal/haptic/rethrow.h"

namespace hal {

FalconLink::FalconLink(OpenPort open_port, drivers::haptic::FalconConfig config,
                       std::vector<std::uint8_t> image)
    : open_port_(std::move(open_port)), config_(std::move(config)), image_(std::move(image)) {
  info_ = {.name = config_.boot.device,
           .force_limit_N = config_.force_limit_N,
           .warnings = {"no watchdog of it is known: when this program dies the motors may keep their last "
                        "force, so keep a hand on its supply"}};
}

void FalconLink::open() {
  close();
  try {
    with_hal_errors([this] {
      port_ = open_port_();
      falcon_.emplace(*port_, config_);
      falcon_->activate(image_);
    });
  } catch (...) {
    close();
    throw;
  }
}

bool FalconLink::close() noexcept {
  if (falcon_) force_off_ = falcon_->deactivate();
  falcon_.reset();
  port_.reset();
  return force_off_;
}

HapticStatus FalconLink::exchange(const HapticCommand& command, std::chrono::nanoseconds now,
                                  HapticSample& sample) noexcept {
  if (!falcon_) return {HapticFault::kNotActive};
  const Eigen::Vector3d force_N = command.enable ? command.f_D_H_N : Eigen::Vector3d::Zero();
  drivers::haptic::DeviceSample measured;
  const drivers::haptic::DeviceStatus status = falcon_->exchange(to_driver(force_N), measured);
  return from_driver(status, measured, now, sample);
}

std::string FalconLink::describe(const HapticStatus& status) const {
  if (status.fault == HapticFault::kNotReady)
    return "its ends are not found yet: pull the handle all the way out, then push it all the way in, until "
           "the light turns green";
  if (status.fault == HapticFault::kBadSample) return "encoder counts fit no position in reach";
  return hal::describe(status.fault);
}

}  // namespace hal
