/// @file
/// The torque that a drive model predicts for a measured motion.
#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <vector>

#include "identification/gap/load_side.h"
#include "identification/gap/signals.h"
#include "model/effects/drive_model.h"

namespace identification::gap {

/// Inverse dynamics at each sample of `signals`, before mask and filter:
///   τ = J·a + friction(v, its history) + load(θ)
/// with the changes by backlash and elasticity. If the torque is only known as commanded: the required
/// command, including actuator effects. `known`: its load, if that needs no simulation.
std::vector<double> predicted_torque_Nm(const model::effects::DriveModel& model, const Signals& signals,
                                        const LoadSide* known = nullptr);

/// Deflection of the bristle of a model with presliding at each sample; empty without one.
std::vector<double> bristle_deflection_rad(const model::effects::DriveModel& model, const Signals& signals);

/// States of the model's friction laws with memory at a sample, from rest at the beginning of the recording.
std::vector<model::friction::State> law_states(const model::effects::DriveModel& model,
                                               const Signals& signals, std::size_t sample);

/// For a model with a gap or a spring.
LoadSide load_side_of(const model::effects::DriveModel& model, const Signals& signals);

/// Torque that the actuator effects of `model` add to the command, at the samples of `signals`, filtered.
std::vector<double> delivered_beyond_command_Nm(const model::effects::DriveModel& model,
                                                const Signals& signals);

/// Rows in which data and predictions are compared: means over stretches of half a period of the band's edge,
/// if the joint moves at least half of the time.
class Rows {
 public:
  explicit Rows(const std::vector<Signals>& signals);

  Eigen::Index count() const noexcept { return static_cast<Eigen::Index>(at_.size()); }
  /// Rows of the torque itself.
  const Eigen::VectorXd& torque_Nm() const noexcept { return torque_Nm_; }
  const Eigen::VectorXd& torque_rate_Nm_per_s() const noexcept { return torque_rate_Nm_per_s_; }
  const Eigen::VectorXd& torque_bend_Nm_per_s2() const noexcept { return torque_bend_Nm_per_s2_; }
  /// Rows of a quantity given at each sample, with the same mask and filter as the torque.
  Eigen::VectorXd column(const std::function<std::vector<double>(const Signals&)>& quantity) const;
  /// Rows of the unfiltered quantity, for maps.
  Eigen::VectorXd means(const std::function<std::vector<double>(const Signals&)>& quantity) const;

  std::size_t recording(Eigen::Index row) const { return at_[static_cast<std::size_t>(row)].recording; }
  double time_s(Eigen::Index row) const;
  double length_s() const;  ///< of one row, the same in all recordings
  /// Index of the row in its recording if none were left out.
  std::size_t slot(Eigen::Index row) const { return at_[static_cast<std::size_t>(row)].first / length_; }
  const std::vector<Signals>& signals() const noexcept { return *signals_; }

 private:
  struct At {
    std::size_t recording;
    std::size_t first;  // sample
  };
  /// For each row, the weighted samples around it, of which `reach` precede its first.
  Eigen::VectorXd weighted(const std::function<std::vector<double>(const Signals&)>& samples,
                           const Eigen::VectorXd& weights, std::size_t reach) const;

  const std::vector<Signals>* signals_;
  std::size_t length_ = 1;  // samples per row
  std::vector<At> at_;
  std::size_t reach_ = 0;
  Eigen::VectorXd filter_;  // weights of samples in the filtered mean over a row
  Eigen::VectorXd torque_Nm_;
  Eigen::VectorXd torque_rate_Nm_per_s_;
  Eigen::VectorXd torque_bend_Nm_per_s2_;
};

}  // namespace identification::gap
