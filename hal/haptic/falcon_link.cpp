#include "hal/haptic/falcon_link.h"

#include <array>
#include <utility>

#include "drivers/setup_error.h"
#include "hal/haptic/rethrow.h"

namespace hal {
namespace {

using drivers::haptic::Falcon;
using drivers::haptic::FalconFault;
using drivers::haptic::FalconSample;
using drivers::haptic::FalconStatus;

// Both frames are right-handed, so the axes only change places.
std::array<double, 3> to_falcon_axes(const Eigen::Vector3d& v) { return {v.y(), v.z(), v.x()}; }
Eigen::Vector3d from_falcon_axes(const std::array<double, 3>& v) { return {v[2], v[0], v[1]}; }

HapticFault generic(FalconFault fault) noexcept {
  switch (fault) {
    case FalconFault::kNone:
    case FalconFault::kMissed: return HapticFault::kNone;  // nothing new; for long it is stale
    case FalconFault::kIdle: return HapticFault::kNotActive;
    case FalconFault::kBadForce: return HapticFault::kBadCommand;
    case FalconFault::kNoPosition: return HapticFault::kBadSample;
    case FalconFault::kLost: return HapticFault::kDeviceFault;
    case FalconFault::kUnplugged: return HapticFault::kUnplugged;
  }
  return HapticFault::kDeviceFault;
}

}  // namespace

FalconLink::FalconLink(OpenPort open_port, drivers::haptic::FalconConfig config,
                       std::vector<std::uint8_t> image)
    : open_port_(std::move(open_port)), config_(std::move(config)), image_(std::move(image)) {
  info_ = {.name = config_.boot.device,
           .force_limit_N = config_.force_limit_N,
           .warnings = {"it has no watchdog that is known of: when this program dies the motors may keep "
                        "their last force, so keep a hand on its supply"}};
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
  FalconSample measured;
  const FalconStatus status = falcon_->exchange(to_falcon_axes(force_N), measured);
  HapticStatus told{.fault = generic(status.fault),
                    .saturated = measured.limited,
                    .detail = static_cast<std::uint32_t>(status.fault),
                    .f_D_H_N = from_falcon_axes(falcon_->force_N())};
  if (!status.ok()) return told;
  if (!measured.homed) {
    told.fault = HapticFault::kNotReady;
    return told;
  }
  sample.stamp = now;
  sample.p_HD_m = from_falcon_axes(measured.p_OG_m);
  sample.q_HD.setIdentity();
  sample.buttons = measured.buttons;
  return told;
}

std::string FalconLink::describe(const HapticStatus& status) const {
  if (status.fault == HapticFault::kNotReady)
    return "its ends are not found yet: pull the grip all the way out, then push it all the way in, until "
           "the "
           "light turns green";
  if (status.fault == HapticFault::kDeviceFault || status.fault == HapticFault::kBadSample)
    return drivers::haptic::describe(static_cast<FalconFault>(status.detail));
  return hal::describe(status.fault);
}

}  // namespace hal
