/// @file
/// What a haptic device measures at the operator's hand.
///
/// Frames: H is the device's fixed base (x towards the operator, y to the operator's right, z up), D its
/// handle.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <chrono>
#include <cstdint>
#include <optional>

namespace hal {

struct HapticSample {
  std::chrono::nanoseconds stamp{};  ///< when the device was read
  Eigen::Vector3d p_HD_m = Eigen::Vector3d::Zero();
  /// From the positions by hal::VelocityFilter, the same for every device.
  Eigen::Vector3d v_HD_H_m_per_s = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q_HD = Eigen::Quaterniond::Identity();
  std::uint32_t buttons = 0;  ///< bit i: button i is down
  /// A device at the end of a network found that no hand holds it.
  bool released = false;
  /// Of such a device: the force that acted on the hand when this was measured. Otherwise
  /// empty: it is the one of the last exchange.
  std::optional<Eigen::Vector3d> felt_f_D_H_N{};
};

}  // namespace hal
