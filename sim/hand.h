/// @file
/// An operator's hand on a haptic master.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <chrono>
#include <cstdint>
#include <optional>

#include "hal/hand_plant.h"

namespace sim {

/// Where the device's mechanics end its grip's travel: at a spheroid, and at a plane behind and below. Stops
/// of rubber, which push back and never pull. The defaults are an omega.6's: the spheroid and the planes that
/// the thesis fitted to the grip's travel (3.4.3) bound rate control and so lie within it; here each
/// semi-axis is 15 % longer and each plane 2 cm further out [assumption].
struct GripTravel {
  Eigen::Vector3d centre_H_m{-0.08, 0.0, 0.008};
  Eigen::Vector3d semi_axes_m{0.161, 0.115, 0.115};
  double lowest_x_m = -0.062;
  double lowest_z_m = -0.086;
  double stiffness_N_per_m = 14'500.0;  ///< closed-loop stiffness by the maker's brochure; assumption here
  double damping_N_s_per_m = 60.0;      ///< assumption: half of critical for the bare grip
};

/// The hand pulls the grip to where it means to be with a spring and a damper; let go, only the device's own
/// mass and drag remain. Values for an arm at ease holding a pen; the device is gravity compensated.
struct HandParameters {
  double device_mass_kg = 0.3;
  double device_drag_N_s_per_m = 0.5;
  double hand_mass_kg = 0.5;
  double hand_stiffness_N_per_m = 300.0;
  double hand_damping_N_s_per_m = 12.0;
  std::optional<GripTravel> travel{};  ///< empty: without end
};

/// The device measures the pen's orientation and has no motor for it: held, the pen points where the hand
/// turns it; let go, it stays as it is until somebody flips it. One thread. Cycle: all but the constructor.
class Hand final : public hal::HandPlant {
 public:
  /// @throws std::invalid_argument naming the parameter that is not finite, negative, or zero where it
  /// divides.
  explicit Hand(const HandParameters& parameters);

  void hold_at(const Eigen::Vector3d& p_HD_m) noexcept { move_to(p_HD_m, {}); }
  /// Reaches for a place: where the hand means to be goes there in this time, on a straight line and with the
  /// least jerk, as people's hands do (Flash and Hogan, J. Neuroscience 5:1688, 1985).
  void move_to(const Eigen::Vector3d& p_HD_m, std::chrono::nanoseconds duration) noexcept;
  /// Turns the pen to a unit quaternion in this time, by the shorter arc and with the least jerk. Takes hold.
  void turn_to(const Eigen::Quaterniond& q_HD, std::chrono::nanoseconds duration) noexcept;
  /// The pen stays where it is and as it points.
  void let_go() noexcept;
  /// Grasps the pen where it is and as it points; nothing new for a hand that holds it.
  void take_hold() noexcept;
  bool holds() const noexcept { return holding_; }
  /// A pen that nobody holds tips over, as turn_to() would turn it. One that is held does not.
  void flip(const Eigen::Quaterniond& q_HD, std::chrono::nanoseconds duration) noexcept;
  /// On top of the above, until it is changed: a shove, or somebody else's hand.
  void push(const Eigen::Vector3d& force_N) noexcept { push_N_ = force_N; }
  /// Bit i: button i.
  void press(std::uint32_t buttons) noexcept { buttons_ |= buttons; }
  void release(std::uint32_t buttons) noexcept { buttons_ &= ~buttons; }

  void measure(hal::HapticSample& sample) noexcept override;
  void advance(const Eigen::Vector3d& f_D_H_N, std::chrono::nanoseconds duration) noexcept override;

  /// Truth, for the operator, for tests and for measuring the two-port.
  const Eigen::Vector3d& p_HD_m() const noexcept { return p_HD_m_; }
  const Eigen::Vector3d& v_HD_H_m_per_s() const noexcept { return v_HD_H_m_per_s_; }
  Eigen::Quaterniond q_HD() const noexcept;
  /// Where the hand means to be; of no meaning after let_go().
  Eigen::Vector3d intended_p_HD_m() const noexcept;
  /// Of the motors on the grip, as last applied.
  const Eigen::Vector3d& device_force_N() const noexcept { return f_D_H_N_; }
  /// Of the hand and of push() on the grip: what a sensor between them would tell. Mean over the last
  /// advance(), as displacement over duration is the velocity's.
  const Eigen::Vector3d& grip_force_N() const noexcept { return grip_force_N_; }

 private:
  void turn(const Eigen::Quaterniond& to, std::chrono::nanoseconds duration) noexcept;
  Eigen::Vector3d stop_force_N() const noexcept;

  HandParameters parameters_;
  bool holding_ = true;
  std::uint32_t buttons_ = 0;
  Eigen::Vector3d push_N_ = Eigen::Vector3d::Zero();
  // Where it means to be: from one place to the other, as far as `reached_s_` of `reach_s_`.
  Eigen::Vector3d from_p_HD_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d to_p_HD_m_ = Eigen::Vector3d::Zero();
  double reach_s_ = 0.0;
  double reached_s_ = 0.0;
  // How the pen points, likewise.
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
