/// @file
/// Qualitative measures of a teleoperation, and the limits of human perception that it meets or misses
/// (thesis 3.2.3.2 and 3.2.3.4). Units: SI. One thread; nothing throws or allocates after construction.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "control/teleoperation.h"
#include "operation/teleop_record.h"

namespace operation {

/// The thesis' values for a human operator [3.2.3.4, from H. Z. Tan and others, ASME DSC 55-1:353, 1994].
namespace human {
/// A force that changes by less than this share is felt as the same.
inline constexpr double kForceShare = 0.07;
/// A human holds a force no more exactly than this.
inline constexpr double kForceResolution_N = 0.36;
/// A stiffer object feels rigid.
inline constexpr double kHardStiffness_N_per_m = 24'200;
/// Largest controllable force, from the finger's last joint to the shoulder.
inline constexpr double kWeakestForce_N = 16.5;
inline constexpr double kStrongestForce_N = 102.3;
/// Smallest vibration that is felt, amplitude: 28 dB up to 30 Hz, from there to 300 Hz 12 dB an octave less.
/// The thesis prints no reference; that of vibrotactile thresholds is 1 µm.
double smallest_felt_vibration_m(double frequency_Hz) noexcept;
}  // namespace human

/// An octave of the handle's motion: four band-passes of second order one after the other, because a hand
/// moves a thousand times further at 1 Hz than it feels at 40, and the mean square behind them.
class VibrationBand {
 public:
  VibrationBand(double centre_Hz, double period_s) noexcept;
  double centre_Hz() const noexcept { return centre_Hz_; }
  /// At rest at zero.
  void reset() noexcept;
  void add(const Eigen::Vector3d& p_m) noexcept;
  /// Of a sine with the same mean square over all axes. NaN if the octave reaches half of the sampling rate.
  double amplitude_m() const noexcept;

 private:
  struct Section {
    Eigen::Vector3d first = Eigen::Vector3d::Zero();
    Eigen::Vector3d second = Eigen::Vector3d::Zero();
  };
  double centre_Hz_;
  bool is_measured_;
  double b_;  // of the numerator, b·(1 - z⁻²)
  double a1_;
  double a2_;
  std::array<Section, 4> sections_{};
  double squares_m2_ = 0.0;
  std::uint64_t samples_ = 0;
};

/// Of the cycles in which the hand moves the robot: in operation, without the clutch.
class TeleopMeasures {
 public:
  static constexpr std::array<double, 3> kBands_Hz{42.4, 84.9, 169.7};  ///< centres of octaves from 30 Hz

  explicit TeleopMeasures(const control::Teleoperation::Config& config);

  void add(const TeleopRecord& record) noexcept;

  /// Range of a position, NaN until there is one.
  struct Range {
    double lowest = std::numeric_limits<double>::quiet_NaN();
    double highest = std::numeric_limits<double>::quiet_NaN();
    void add(double value) noexcept;
    double length() const noexcept { return highest - lowest; }
  };
  struct End {
    std::array<Range, 3> p_m{};  ///< handle in H, end effector in W
    double largest_force_N = 0.0;
    double force_squared_N2_s = 0.0;  ///< ∫ |F|² dt, the sum of squared forces without the sampling rate
  };
  const End& hand() const noexcept { return hand_; }    ///< force held by the device
  const End& robot() const noexcept { return robot_; }  ///< force commanded to the end effector
  double largest_contact_N() const noexcept { return largest_contact_N_; }  ///< true or estimated
  double operating_s() const noexcept;
  double rms_N(const End& end) const noexcept;

  /// Share of the cycles with a force above human::kForceResolution_N in which it changed by more than
  /// human::kForceShare from the last one.
  double rough_share() const noexcept;
  double largest_force_step_N() const noexcept { return largest_step_N_; }
  double largest_felt_stiffness_N_per_m() const noexcept { return largest_stiffness_N_per_m_; }
  /// As they were set: an operator may change them during operation.
  const Range& force_scale() const noexcept { return force_scale_; }
  const Range& motion_scale() const noexcept { return motion_scale_; }
  const std::array<VibrationBand, 3>& bands() const noexcept { return bands_; }
  const control::Teleoperation::Config& config() const noexcept { return config_; }

 private:
  control::Teleoperation::Config config_;
  End hand_;
  End robot_;
  Range force_scale_;
  Range motion_scale_;
  double largest_contact_N_ = 0.0;
  double largest_stiffness_N_per_m_ = 0.0;
  double largest_step_N_ = 0.0;
  std::uint64_t cycles_ = 0;
  std::uint64_t loaded_cycles_ = 0;
  std::uint64_t rough_cycles_ = 0;
  bool was_operating_ = false;
  Eigen::Vector3d last_force_N_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d origin_m_ = Eigen::Vector3d::Zero();
  std::array<VibrationBand, 3> bands_;
};

}  // namespace operation
