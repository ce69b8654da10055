#include "hal/haptic/space_mouse_link.h"

#include <array>
#include <utility>

#include "hal/haptic/rethrow.h"

namespace hal {
namespace {

Eigen::Vector3d from_space_mouse_axes(const std::array<double, 3>& v) { return {-v[1], v[0], v[2]}; }

Eigen::Quaterniond rotation(const Eigen::Vector3d& vector_rad) {
  const double angle_rad = vector_rad.norm();
  if (angle_rad == 0.0) return Eigen::Quaterniond::Identity();
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, vector_rad / angle_rad));
}

}  // namespace

SpaceMouseLink::SpaceMouseLink(SpaceMouseLinkConfig config) : config_(std::move(config)) {
  if (!(config_.travel_m > 0.0 && config_.travel_m <= 1.0))
    throw SetupError("SpaceMouse", "set travel_m", "it must be above 0 and at most 1");
  if (!(config_.turn_rad > 0.0 && config_.turn_rad <= 3.0))
    throw SetupError("SpaceMouse", "set turn_rad", "it must be above 0 and at most 3");
  info_ = {.name = "SpaceMouse", .senses_rotation = true, .rate_only = true};
}

void SpaceMouseLink::open() {
  close();
  with_hal_errors([this] { mouse_.emplace(config_.choice); });
  info_.name = drivers::haptic::describe(mouse_->info());
  info_.warnings = mouse_->info().warnings;
}

bool SpaceMouseLink::close() noexcept {
  mouse_.reset();
  return true;  // there is no force
}

HapticStatus SpaceMouseLink::exchange(const HapticCommand& /*command*/, std::chrono::nanoseconds now,
                                      HapticSample& sample) noexcept {
  if (!mouse_) return {HapticFault::kNotActive};
  drivers::haptic::SpaceMouseSample polled;
  const drivers::haptic::SpaceMouseStatus status = mouse_->poll(now, polled);
  if (!status.ok()) return {HapticFault::kUnplugged};
  sample.stamp = now;
  sample.p_HD_m = config_.travel_m * from_space_mouse_axes(polled.deflection.translation);
  sample.q_HD = rotation(config_.turn_rad * from_space_mouse_axes(polled.deflection.rotation));
  sample.buttons = polled.buttons;
  return {};
}

}  // namespace hal
