/// @file
/// An operator's hand on a haptic device.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <chrono>
#include <cstdint>
#include <optional>

#include "hal/hand_plant.h"

namespace sim {

/// Mechanical limits of the handle: a spheroid, and a plane behind and below. Rubber stops, which only push
/// back. The defaults are an omega.6's: the spheroid and the planes that the thesis fitted to the handle's
/// travel (3.4.3) bound rate control and therefore lie within it; here each semi-axis is 15 % longer and each
/// plane 2 cm further out [assumption].
struct GripTravel {
  Eigen::Vector3d centre_H_m{-0.08, 0.0, 0.008};
  Eigen::Vector3d semi_axes_m{0.161, 0.115, 0.115};
  double lowest_x_m = -0.062;
  double lowest_z_m = -0.086;
  double stiffness_N_per_m = 14'500.0;  ///< closed-loop stiffness from the maker's brochure; assumption here
  double damping_N_s_per_m = 60.0;      ///< assumption: half of critical for the free handle
};

/// The hand pulls the handle to its intended position with a spring and a damper; after a release, only the
/// device's own mass and drag remain. Values for a relaxed arm that holds a pen; the device is gravity
/// compensated.
struct HandParameters {
  double device_mass_kg = 0.3;
  double device_drag_N_s_per_m = 0.5;
  double hand_mass_kg = 0.5;
  double hand_stiffness_N_per_m = 300.0;
  double hand_damping_N_s_per_m = 12.0;
  std::optional<GripTravel> travel{};  ///< empty: unlimited
};

/// The device measures the handle's orientation and has no motor for it: while held, the handle follows the
/// hand's rotation; after a release it stays until flipped. One thread. Cycle: all but the constructor.
class Hand final : public hal::HandPlant {
 public:
  /// @throws std::invalid_argument naming the parameter that is not finite, negative, or zero as a divisor.
  explicit Hand(const HandParameters& parameters);

  void hold_at(const Eigen::Vector3d& p_HD_m) noexcept { move_to(p_HD_m, {}); }
  /// Reaches for a position: the intended position moves there in this time, on a straight line with minimum
  /// jerk, as in human reaching (Flash and Hogan, J. Neuroscience 5:1688, 1985).
  void move_to(const Eigen::Vector3d& p_HD_m, std::chrono::nanoseconds duration) noexcept;
  /// Turns the handle to a unit quaternion in this time, by the shorter arc with minimum jerk. Takes hold.
  void turn_to(const Eigen::Quaterniond& q_HD, std::chrono::nanoseconds duration) noexcept;
  /// Releases the handle: position and orientation stay.
  void let_go() noexcept;
  /// Grasps the handle at its position and orientation; no effect if already held.
  void take_hold() noexcept;
  bool holds() const noexcept { return holding_; }
  /// A released handle tips over, like turn_to(). A held one does not.
  void flip(const Eigen::Quaterniond& q_HD, std::chrono::nanoseconds duration) noexcept;
  /// Additional force until changed: a push, or another person's hand.
  void push(const Eigen::Vector3d& force_N) noexcept { push_N_ = force_N; }
  /// Bit i: button i.
  void press(std::uint32_t buttons) noexcept { buttons_ |= buttons; }
  void release(std::uint32_t buttons) noexcept { buttons_ &= ~buttons; }

  void measure(hal::HapticSample& sample) noexcept override;
  void advance(const Eigen::Vector3d& f_D_H_N, std::chrono::nanoseconds duration) noexcept override;

  /// True values, for the operator, for tests and for two-port measurements.
  const Eigen::Vector3d& p_HD_m() const noexcept { return p_HD_m_; }
  const Eigen::Vector3d& v_HD_H_m_per_s() const noexcept { return v_HD_H_m_per_s_; }
  Eigen::Quaterniond q_HD() const noexcept;
  /// Intended position of the hand; undefined after let_go().
  Eigen::Vector3d intended_p_HD_m() const noexcept;
  /// Of the motors on the handle, as last applied.
  const Eigen::Vector3d& device_force_N() const noexcept { return f_D_H_N_; }
  /// Force of the hand and of push() on the handle: the value of a sensor between them. Mean over the last
  /// advance(); the velocity is displacement over duration.
  const Eigen::Vector3d& grip_force_N() const noexcept { return grip_force_N_; }

 private:
  void turn(const Eigen::Quaterniond& to, std::chrono::nanoseconds duration) noexcept;
  Eigen::Vector3d stop_force_N() const noexcept;

  HandParameters parameters_;
  bool holding_ = true;
  std::uint32_t buttons_ = 0;
  Eigen::Vector3d push_N_ = Eigen::Vector3d::Zero();
  // Intended position: between two points, at `reached_s_` of `reach_s_`.
  Eigen::Vector3d from_p_HD_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d to_p_HD_m_ = Eigen::Vector3d::Zero();
  double reach_s_ = 0.0;
  double reached_s_ = 0.0;
  // Orientation of the handle, likewise.
  Eigen::Quaterniond from_q_HD_ = Eigen::Quaterniond::Identity();
  Eigen::Quaterniond to_q_HD_ = Eigen::Quaterniond::Identity();
  double turn_s_ = 0.0;
  double turned_s_ = 0.0;
  Eigen::Vector3d p_HD_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d v_HD_H_m_per_s_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d f_D_H_N_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d grip_force_N_ = Eigen::Vector3d::Zero();
};

}  // namespace sim
