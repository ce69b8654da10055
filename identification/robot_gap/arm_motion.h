/// @file
/// Recordings of an arm, filtered and evenly sampled for the comparison of torques.
#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace identification::robot_gap {

/// One recording of all joints, as measured; joints × rows.
struct ArmRecording {
  std::string name;  ///< of the file, in reports
  std::vector<double> time_s;
  Eigen::MatrixXd position_rad;
  Eigen::MatrixXd torque_Nm;
};

/// The same on an even, coarser time grid. Positions and torques have passed the same low-pass, without
/// delay; derivatives are of the filtered positions. In `band()` both sides pass a lower one.
struct ArmMotion {
  std::string name;
  double period_s = 0;
  double start_s = 0;  ///< time of the first column
  double band_Hz = 0;
  Eigen::MatrixXd position_rad;
  Eigen::MatrixXd velocity_rad_per_s;
  Eigen::MatrixXd acceleration_rad_per_s2;
  Eigen::MatrixXd torque_Nm;
  std::size_t step = 1;       ///< samples to a row of the comparison
  bool is_scattered = false;  ///< each sample is a state by itself, not one of a trajectory

  std::size_t samples() const noexcept { return static_cast<std::size_t>(position_rad.cols()); }
  /// Rows of the comparison.
  std::size_t rows() const noexcept { return samples() == 0 ? 0 : 1 + (samples() - 1) / step; }
  double row_s() const noexcept { return period_s * static_cast<double>(step); }
  /// A signal of this motion, low-passed to the band, one value for each row.
  std::vector<double> band(std::span<const double> signal) const;
};

/// Standard deviations of white noise in the samples of a recording, from what lies above the motion.
struct ArmNoise {
  Eigen::VectorXd position_rad;  ///< of each joint
  Eigen::VectorXd torque_Nm;
};

/// The band that these recordings allow, at most `wanted_Hz`.
double usable_band_Hz(std::span<const ArmRecording> recordings, double wanted_Hz);

/// Length of the shortest recording that can be compared in a band.
double shortest_recording_s(double band_Hz);

/// A recording in parts without pauses.
struct CutRecording {
  struct Stretch {
    double from_s = 0;
    double to_s = 0;
  };
  std::vector<ArmRecording> parts;
  std::vector<Stretch> left_out;  ///< too short for the band
};
/// The recording, cut at its pauses. Straight lines bridge a pause that is as short as the steps which the
/// band allows, or as five of the recording's usual steps; across a longer one they would end in
/// accelerations that never were.
/// @throws std::invalid_argument naming the recording and its first pause if no part is long enough.
CutRecording cut_at_pauses(const ArmRecording& recording, double band_Hz);

/// @throws std::invalid_argument naming the recording if it is too short for the band.
ArmMotion filtered(const ArmRecording& recording, double band_Hz);

/// Of an evenly sampled copy of the recording.
ArmNoise noise_of(const ArmRecording& recording, double band_Hz);

/// Rms of a motion's velocity from white noise of 1 rad in the positions of the recording.
double velocity_noise_gain_per_s(const ArmRecording& recording, double band_Hz);

/// Rms that white noise of 1 in the samples of the recording leaves in the rows of the comparison.
double noise_gain(const ArmRecording& recording, double band_Hz);

/// The recording with white noise of these deviations added to its positions.
ArmRecording with_position_noise(const ArmRecording& recording, const Eigen::VectorXd& sigma_rad,
                                 std::uint64_t seed);

}  // namespace identification::robot_gap
