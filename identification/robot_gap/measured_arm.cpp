#include "identification/robot_gap/measured_arm.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <stdexcept>

#include "identification/gap/zero_phase.h"
#include "identification/robot_gap/arm_rows.h"
#include "identification/robot_gap/arm_subject.h"
#include "identification/robot_gap/link_motion.h"

namespace identification::robot_gap {
namespace {

/// One block: there is no resampling here.
constexpr double kWhole_s = 1e9;

std::vector<double> joint_row(const Eigen::MatrixXd& matrix, Eigen::Index row) {
  std::vector<double> values(static_cast<std::size_t>(matrix.cols()));
  Eigen::Map<Eigen::RowVectorXd>(values.data(), matrix.cols()) = matrix.row(row);
  return values;
}

Eigen::MatrixXd in_band(const ArmMotion& motion, const Eigen::MatrixXd& samples) {
  Eigen::MatrixXd rows(samples.rows(), static_cast<Eigen::Index>(motion.rows()));
  for (Eigen::Index j = 0; j < samples.rows(); ++j) {
    const std::vector<double> band = motion.band(joint_row(samples, j));
    rows.row(j) = Eigen::Map<const Eigen::RowVectorXd>(band.data(), rows.cols());
  }
  return rows;
}

ComparedRows torques_with_lag(const control::ArmDescription& arm, std::span<const ArmMotion> motions,
                              const RowPlan& plan) {
  const std::array lag{ArmTerm{ArmTerm::Kind::kLag}};
  return compare(arm, motions, plan, lag);
}

}  // namespace

MeasuredArm::MeasuredArm(const control::ArmDescription& arm, std::span<const ArmRecording> recordings,
                         double band_Hz)
    : band_Hz_(usable_band_Hz(recordings, band_Hz)) {
  if (recordings.empty()) throw std::invalid_argument("there is no recording");
  for (const ArmRecording& recording : recordings) motions_.push_back(filtered(recording, band_Hz_));
  plan_ = plan_rows(motions_, rest_speeds_rad_per_s(motions_, recordings, band_Hz_), kWhole_s);
  if (plan_.rows.empty()) throw std::invalid_argument("no joint moves in the recordings: record motion");
  const ComparedRows rows = torques_with_lag(arm, motions_, plan_);
  const Eigen::VectorXd lag = rows.columns.col(0);
  if (const double square = lag.squaredNorm(); square > 0)
    lag_s_ = std::clamp(lag.dot(rows.measured - rows.predicted) / square, -kLongestLag_s, kLongestLag_s);
}

double MeasuredArm::gap_Nm(const control::ArmDescription& arm) const {
  const ComparedRows rows = torques_with_lag(arm, motions_, plan_);
  return std::sqrt((rows.measured - rows.predicted - lag_s_ * rows.columns.col(0)).squaredNorm() /
                   static_cast<double>(rows.measured.size()));
}

std::vector<double> MeasuredArm::speeds_rad_per_s(Eigen::Index joint) const {
  std::vector<double> speeds;
  for (const RowPlan::Row& row : plan_.rows) {
    if (row.channel != joint) continue;
    const ArmMotion& motion = motions_[row.motion];
    speeds.push_back(
        std::abs(motion.velocity_rad_per_s(joint, static_cast<Eigen::Index>(row.at * motion.step))));
  }
  return speeds;
}

std::vector<double> MeasuredArm::mean_load_Nm(const control::ArmDescription& arm) const {
  std::vector<LinkMotion> links;
  for (const ArmMotion& motion : motions_) links.push_back(link_motion(arm, motion));
  std::vector<double> sum(arm.drives.size());
  std::vector<double> count(arm.drives.size());
  for (const RowPlan::Row& row : plan_.rows) {
    const auto at = static_cast<Eigen::Index>(row.at * motions_[row.motion].step);
    const auto joint = static_cast<std::size_t>(row.channel);
    sum[joint] += std::abs(links[row.motion].rigid_Nm(row.channel, at));
    ++count[joint];
  }
  for (std::size_t j = 0; j < sum.size(); ++j) sum[j] /= std::max(1.0, count[j]);
  return sum;
}

MeasuredArm::Rows MeasuredArm::rows(const control::ArmDescription& arm, std::size_t motion) const {
  const ArmMotion& m = motions_[motion];
  Eigen::MatrixXd predicted_Nm = predicted_torque_Nm(arm, m);
  for (Eigen::Index j = 0; j < predicted_Nm.rows(); ++j) {
    const std::vector<double> rate = gap::derivative(joint_row(m.torque_Nm, j), m.period_s);
    predicted_Nm.row(j) -= lag_s_ * Eigen::Map<const Eigen::RowVectorXd>(rate.data(), predicted_Nm.cols());
  }
  Rows rows{.time_s = {},
            .position_rad = in_band(m, m.position_rad),
            .velocity_rad_per_s = in_band(m, m.velocity_rad_per_s),
            .acceleration_rad_per_s2 = in_band(m, m.acceleration_rad_per_s2),
            .torque_Nm = in_band(m, m.torque_Nm),
            .predicted_Nm = in_band(m, predicted_Nm),
            .moves = Eigen::MatrixXd::Zero(predicted_Nm.rows(), static_cast<Eigen::Index>(m.rows()))};
  for (std::size_t i = 0; i < m.rows(); ++i)
    rows.time_s.push_back(m.start_s + static_cast<double>(i) * m.row_s());
  for (const RowPlan::Row& row : plan_.rows)
    if (row.motion == motion) rows.moves(row.channel, static_cast<Eigen::Index>(row.at)) = 1;
  return rows;
}

}  // namespace identification::robot_gap
