/// @file
/// Windows of the torques of a base's recordings, their lag and their noise.
#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "control/base_description.h"
#include "identification/robot_gap/base_effort.h"
#include "identification/robot_gap/base_effort_windows.h"
#include "identification/robot_gap/base_terms.h"
#include "identification/robot_gap/subject.h"
#include "identification/robot_gap/torque_lag.h"

namespace identification::robot_gap {

/// Length of the windows, lag of the torques and rest speeds of the directions are from the searched data.
class BaseEfforts {
 public:
  using Windows = std::vector<std::vector<EffortWindow>>;  // of each motion

  /// @throws std::invalid_argument as check_torque_signs()
  BaseEfforts(const control::BaseDescription& given, const BaseCatalogue& all,
              std::span<const BaseMotion> data, std::span<const BaseMotion> held_out);

  /// Whether there are enough windows to compare.
  bool is_enough() const noexcept;
  const Windows& windows(Part part) const noexcept { return part == Part::kSearched ? searched_ : held_out_; }
  double window_s() const noexcept { return window_s_; }
  /// Of the torques behind the motion of the wheels; 0 if there are too few windows to find it.
  double lag_s() const noexcept { return lag_ ? lag_->lag_s : 0; }
  /// The lag, what looks odd, or why forces are not compared, in words.
  std::vector<std::string> notes() const;
  /// Rms of each axis that noise leaves [N, N, N·m].
  const Eigen::Vector3d& floor() const noexcept { return floor_; }

  /// Window after window, as BaseForces says.
  Eigen::MatrixX3d pushed(Part part) const;
  Eigen::MatrixX3d excess(Part part, const control::BaseDescription& base) const;

 private:
  struct Rows {
    Eigen::MatrixXd slopes;
    Eigen::VectorXd residual;
  };
  std::vector<std::size_t> terms() const;
  Eigen::VectorXd compared(const Windows& windows, const control::BaseDescription& base) const;
  Eigen::VectorXd slope(const Windows& windows, std::size_t term, const Eigen::VectorXd& residual) const;
  Rows rows_of(const Windows& windows) const;
  Windows planned(std::span<const BaseMotion> motions, double window_s) const;
  void choose_window();
  void find_lag();
  void find_rest_twist();
  void see_noise();

  control::BaseDescription given_;
  const BaseCatalogue& all_;
  std::span<const BaseMotion> data_;
  std::vector<int> floors_;  // of the motions
  std::vector<int> held_floors_;
  RestSpeeds rest_;
  Windows searched_;
  Windows held_out_;
  double window_s_ = 0;
  std::optional<TorqueLag> lag_;  // none: not tested
  std::vector<std::string> sign_notes_;
  Eigen::Vector3d floor_ = Eigen::Vector3d::Zero();
};

/// Names and units of the axes of a kinematics.
std::vector<Channel> effort_channels(control::BaseKinematics kinematics);

}  // namespace identification::robot_gap
