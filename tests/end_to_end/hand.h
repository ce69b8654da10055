/// @file
/// The operator's hand: strong, so that the handle follows it.
#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <chrono>
#include <cstddef>
#include <thread>
#include <vector>

#include "tests/end_to_end/grip.h"
#include "tests/support/recording.h"

namespace end_to_end {

using support::Recording;

/// A busy machine makes the hand slower and never lets it jump.
class Hand {
 public:
  explicit Hand(Grip& grip) : grip_(grip) { put(Eigen::Vector3d::Zero()); }

  void move_to(const Eigen::Vector3d& p_HD_m, double speed_m_per_s = 0.05) {
    while (p_HD_m_ != p_HD_m) {
      const Eigen::Vector3d way_m = p_HD_m - p_HD_m_;
      const double step_m = speed_m_per_s * pause_s();
      put(way_m.norm() <= step_m ? p_HD_m : Eigen::Vector3d(p_HD_m_ + way_m * (step_m / way_m.norm())));
    }
  }
  /// A recorded hand motion, scaled by `scale`, from its beginning to `until_s`.
  void follow(const Recording& trajectory, double scale, double until_s) {
    const std::vector<double>& times_s = trajectory["time_s"];
    const auto place_m = [&](std::size_t i) -> Eigen::Vector3d {
      return scale * Eigen::Vector3d(trajectory["x_m"][i], trajectory["y_m"][i], trajectory["z_m"][i]);
    };
    move_to(place_m(0));
    double time_s = 0;
    for (std::size_t i = 0; i + 1 < trajectory.rows() && time_s < until_s;) {
      time_s += pause_s();
      while (i + 1 < trajectory.rows() && times_s[i + 1] <= time_s) ++i;
      if (i + 1 == trajectory.rows()) break;
      const double share = (time_s - times_s[i]) / (times_s[i + 1] - times_s[i]);
      put(place_m(i) + share * (place_m(i + 1) - place_m(i)));
    }
  }
  void press(bool gripper_button) { grip_.press(gripper_button); }

 private:
  /// Step that the hand may make now.
  static double pause_s() {
    using Clock = std::chrono::steady_clock;
    const Clock::time_point before = Clock::now();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return std::min(0.004, std::chrono::duration<double>(Clock::now() - before).count());
  }
  void put(const Eigen::Vector3d& p_HD_m) {
    p_HD_m_ = p_HD_m;
    grip_.put(p_HD_m);
  }

  Grip& grip_;
  Eigen::Vector3d p_HD_m_;
};

}  // namespace end_to_end
