/// @file
/// What the drivers of haptic devices report, in the HAL's types.
#pragma once
#include <chrono>

#include "drivers/haptic/device_exchange.h"
#include "hal/haptic_device.h"

namespace hal {

inline drivers::haptic::Vector3 to_driver(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
inline Eigen::Vector3d from_driver(const drivers::haptic::Vector3& v) { return {v[0], v[1], v[2]}; }

/// Cycle: the status, and the sample when it is fresh, with `now` as its stamp.
inline HapticStatus from_driver(const drivers::haptic::DeviceStatus& status,
                                const drivers::haptic::DeviceSample& measured, std::chrono::nanoseconds now,
                                HapticSample& sample) noexcept {
  if (status.fresh) {
    Eigen::Matrix3d R_HD;
    for (std::size_t row = 0; row < 3; ++row)
      R_HD.row(static_cast<Eigen::Index>(row)) = from_driver(measured.R_HD[row]);
    sample.stamp = now;
    sample.p_HD_m = from_driver(measured.p_HD_m);
    sample.q_HD = Eigen::Quaterniond(R_HD).normalized();
    sample.buttons = measured.buttons;
  }
  return {.fault = status.fault,
          .withheld = status.withheld,
          .saturated = status.saturated,
          .detail = static_cast<std::uint32_t>(status.detail),
          .f_D_H_N = from_driver(status.f_D_H_N)};
}

}  // namespace hal
