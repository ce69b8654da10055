/// @file
/// Requirements on every run of teleoperation.
#pragma once
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <numbers>
#include <span>

#include "tests/operation/teleop_rig.h"

namespace teleop_rig {

inline constexpr double kStep_m = 2.5e-4;  // of the smoothing, per millisecond
inline constexpr double kThreshold_m = 5e-4;
inline constexpr double kReserve_J = 0.005;

inline Eigen::Vector3d vector(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }
inline Eigen::Quaterniond rotation(const std::array<double, 4>& q) { return {q[0], q[1], q[2], q[3]}; }

inline std::span<const TeleopRecord> in_phase(const Rig& rig, control::TeleopPhase phase) {
  const auto begin = std::find_if(rig.records.begin(), rig.records.end(),
                                  [phase](const TeleopRecord& r) { return r.phase == phase; });
  const auto end =
      std::find_if(begin, rig.records.end(), [phase](const TeleopRecord& r) { return r.phase != phase; });
  return {begin, end};
}

inline double largest_port_energy_J(const Rig& rig) {
  double most = 0;
  for (const TeleopRecord& r : rig.records) most = std::max(most, r.port_energy_J);
  return most;
}

/// From the first mapped cycle on the set-point moves in steps of the smoothing and never jumps.
inline void expect_no_jump(const Rig& rig) {
  const TeleopRecord* last = nullptr;
  double furthest_m = 0, furthest_rad = 0;
  for (const TeleopRecord& r : rig.records) {
    const bool mapped = r.phase == control::TeleopPhase::kStiffening ||
                        r.phase == control::TeleopPhase::kOperating ||
                        r.phase == control::TeleopPhase::kLetGo;
    if (mapped && last != nullptr) {
      furthest_m = std::max(furthest_m, (vector(r.setpoint_p_WT_m) - vector(last->setpoint_p_WT_m)).norm());
      furthest_rad =
          std::max(furthest_rad, rotation(r.setpoint_q_WT).angularDistance(rotation(last->setpoint_q_WT)));
    }
    last = mapped ? &r : nullptr;
  }
  EXPECT_GT(furthest_m, 0);
  EXPECT_LE(furthest_m, kThreshold_m + 1e-9);
  EXPECT_LE(furthest_rad, 0.05 * std::numbers::pi / 180 + 1e-6);
}

/// Maximum net energy of the hand: the tank's reserve, and the initial energy of the centring spring.
inline void expect_passive(const Rig& rig, double centring_J = 0.0) {
  EXPECT_LE(largest_port_energy_J(rig), kReserve_J + centring_J);
}

}  // namespace teleop_rig
