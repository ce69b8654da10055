#include "identification/robot_gap/arm_noise.h"

#include <cmath>
#include <vector>

#include "identification/fit/statistics.h"
#include "identification/robot_gap/arm_rows.h"

namespace identification::robot_gap {
namespace {

constexpr std::uint64_t kPositionSeed = 7;

/// What the noise of the positions adds to the prediction of each joint, in the band.
Eigen::VectorXd of_positions_Nm(const control::ArmDescription& arm, const ArmRecording& recording,
                                const ArmNoise& noise, double band_Hz) {
  const ArmMotion clean = filtered(recording, band_Hz);
  const ArmMotion noisy =
      filtered(with_position_noise(recording, noise.position_rad, kPositionSeed), band_Hz);
  const Eigen::MatrixXd difference = predicted_torque_Nm(arm, noisy) - predicted_torque_Nm(arm, clean);
  Eigen::VectorXd result(difference.rows());
  for (Eigen::Index j = 0; j < difference.rows(); ++j) {
    const Eigen::VectorXd own = difference.row(j);
    // Robust: a reversal that moves by a sample is no noise of all rows.
    result[j] = fit::robust_sigma(clean.band({own.data(), static_cast<std::size_t>(own.size())}));
  }
  return result;
}

}  // namespace

Eigen::VectorXd noise_floor_Nm(const control::ArmDescription& arm, std::span<const ArmRecording> recordings,
                               double band_Hz) {
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(recordings.front().position_rad.rows());
  double seconds = 0;
  for (const ArmRecording& recording : recordings) {
    const ArmNoise noise = noise_of(recording, band_Hz);
    const double length_s = recording.time_s.back() - recording.time_s.front();
    const Eigen::VectorXd of_torque = noise_gain(recording, band_Hz) * noise.torque_Nm;
    squares +=
        length_s * (of_torque.cwiseAbs2() + of_positions_Nm(arm, recording, noise, band_Hz).cwiseAbs2());
    seconds += length_s;
  }
  return (squares / seconds).cwiseSqrt();
}

}  // namespace identification::robot_gap
