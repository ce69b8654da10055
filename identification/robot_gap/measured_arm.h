/// @file
/// Recordings of an arm, against which several descriptions of it are compared.
#pragma once
#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "control/arm_description.h"
#include "identification/robot_gap/arm_motion.h"
#include "identification/robot_gap/subject.h"

namespace identification::robot_gap {

class MeasuredArm {
 public:
  /// `band_Hz`: up to which torques are compared, at most. The lag of the recorded torques is fitted with
  /// `arm`.
  /// @throws std::invalid_argument if there is no recording, or naming one that is too short or stands still.
  MeasuredArm(const control::ArmDescription& arm, std::span<const ArmRecording> recordings, double band_Hz);

  /// Rms of what `arm` does not predict of the torques, over the rows in which a joint moves [N·m, N].
  double gap_Nm(const control::ArmDescription& arm) const;
  double band_Hz() const noexcept { return band_Hz_; }
  std::span<const ArmMotion> motions() const noexcept { return motions_; }
  /// Of one joint, in all rows in which it moves.
  std::vector<double> speeds_rad_per_s(Eigen::Index joint) const;
  /// Mean magnitude of the torque that the links take of each joint while it moves.
  std::vector<double> mean_load_Nm(const control::ArmDescription& arm) const;

  /// One motion in the band; joints × rows.
  struct Rows {
    std::vector<double> time_s;
    Eigen::MatrixXd position_rad;
    Eigen::MatrixXd velocity_rad_per_s;
    Eigen::MatrixXd acceleration_rad_per_s2;
    Eigen::MatrixXd torque_Nm;
    Eigen::MatrixXd predicted_Nm;
    Eigen::MatrixXd moves;  ///< 1 where the comparison counts, otherwise 0
  };
  Rows rows(const control::ArmDescription& arm, std::size_t motion) const;

 private:
  double band_Hz_ = 0;
  std::vector<ArmMotion> motions_;
  RowPlan plan_;
  double lag_s_ = 0;
};

}  // namespace identification::robot_gap
