/// @file
/// The way of an arm through several motions, and back to where it started.
#pragma once
#include <vector>

#include "control/robot_model.h"
#include "identification/experiments/fourier_motion.h"

namespace youbot_bench {

/// start → ready → centre of the first motion, motion, centre of the next … → ready → start; straight lines
/// in joint space, from rest to rest.
class ArmTour {
 public:
  /// Of the lines.
  static constexpr double kSpeed_rad_per_s = 0.5;
  static constexpr double kAcceleration_rad_per_s2 = 0.5;

  /// Five joints each, at least one motion.
  ArmTour(std::vector<identification::experiments::FourierMotion> motions,
          const control::ArmVector& ready_rad);

  /// Cycle: before everything else.
  void start_at(const control::ArmVector& start_rad) noexcept;
  double duration_s() const noexcept { return parts_.back().begin_s + parts_.back().duration_s; }

  struct State {
    control::ArmVector position_rad;
    control::ArmVector velocity_rad_per_s;
    int motion = -1;      ///< from 0; −1: between motions
    double time_s = 0.0;  ///< since the motion's start
  };
  /// Cycle: at rest before the start and after the end.
  State at(double time_s) const noexcept;

 private:
  struct Part {
    int motion = -1;
    control::ArmVector from_rad = control::ArmVector::Zero();
    control::ArmVector to_rad = control::ArmVector::Zero();
    double begin_s = 0.0;
    double duration_s = 0.0;
  };

  std::vector<identification::experiments::FourierMotion> motions_;
  std::vector<Part> parts_;
};

}  // namespace youbot_bench
