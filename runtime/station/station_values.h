/// @file
/// The only conversion between the link's integers and SI values.
#pragma once
#include <Eigen/Core>
#include <chrono>

#include "drivers/station/message.h"
#include "hal/haptic_sample.h"

namespace runtime {

/// Values that do not fit are clamped; one that is not a number becomes zero.
drivers::station::HandleState to_link(const hal::HapticSample& sample, const Eigen::Vector3d& held_N,
                                      std::chrono::nanoseconds age) noexcept;
drivers::station::ForceState to_link(const Eigen::Vector3d& force_N) noexcept;
std::int64_t energy_to_link(double energy_J) noexcept;

/// Position, rotation and buttons; nothing else.
void from_link(const drivers::station::HandleState& state, hal::HapticSample& sample) noexcept;
Eigen::Vector3d force_from_link(const std::array<std::int32_t, 3>& force_uN) noexcept;
inline double energy_from_link(std::int64_t energy_nJ) noexcept {
  return 1e-9 * static_cast<double>(energy_nJ);
}

}  // namespace runtime
