/// @file
/// Recordings of a base, cut into stretches in which its wheels explain the measured pose, and into windows.
#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "control/base_description.h"
#include "control/base_rolling.h"
#include "control/planar.h"

namespace identification::robot_gap {

/// One recording of a base, as measured, SI.
struct BaseRecording {
  std::string name;             ///< of the file, in reports
  int floor = -1;               ///< of the description's floors; −1: none of them
  std::vector<double> time_s;   ///< increasing
  std::vector<double> run{};    ///< a new value starts a new run; empty: one run
  Eigen::MatrixXd wheel;        ///< wheels × rows: angle [rad], or speed [rad/s]
  std::vector<bool> is_speed;   ///< of each wheel
  Eigen::MatrixXd load{};       ///< wheels × rows, magnitude in any unit; empty: not measured
  Eigen::MatrixXd torque_Nm{};  ///< wheels × rows, as reported, positive with the angles; empty: not measured
  std::vector<double> steering_rad{};     ///< of a tricycle
  std::vector<control::PlanarPose> pose;  ///< of the tracked body in any fixed frame; yaw may wrap
};

/// Poses in which no jump is, each different from the one before: trackers that are slower than the wheels
/// repeat theirs.
struct BaseTrack {
  std::vector<double> time_s;
  std::vector<control::PlanarPose> pose;  ///< yaw is continuous
};

/// A stretch without pause, of one run.
struct BaseRun {
  double number = 0;  ///< of the column; 0 without
  std::vector<double> time_s;
  Eigen::MatrixXd angle_rad;   ///< wheels × rows, accumulated
  Eigen::MatrixXd loaded_rad;  ///< the same of angle times load; empty: not measured
  Eigen::MatrixXd torque_Nm;   ///< wheels × rows; empty: not measured
  bool is_speed = false;       ///< speeds of wheels were recorded, not angles
  std::vector<double> steering_rad;
  std::vector<BaseTrack> tracks;
};

struct BaseMotion {
  std::string name;
  int floor = -1;
  std::vector<BaseRun> runs;
  std::vector<std::string> notes;  ///< what was cut, in words
};

/// Cuts by runs, by pauses and by jumps of the pose that are beyond any motion of the wheels, however wrong
/// the description. `longest_delay_s`: between wheels and pose.
/// @throws std::invalid_argument naming the recording if the pose jumps everywhere, or never changes.
BaseMotion cut(const BaseRecording& recording, const control::BaseDescription& base, double longest_delay_s);

/// The last quarter of a recording, taken away from it; of eight runs and more, every fourth run.
BaseRecording set_aside(BaseRecording& whole);

/// How the wheels move in one window, in short steps.
struct WheelSteps {
  Eigen::MatrixXd angle_rad;   ///< wheels × steps
  Eigen::MatrixXd loaded_rad;  ///< empty: not measured
  Eigen::VectorXd steering_rad;
};

/// Displacement of the tracked body in its own axes at the start of a window.
struct BaseWindow {
  std::size_t run = 0;  ///< of the motion's
  std::size_t track = 0;
  double start_s = 0;
  double end_s = 0;
  control::PlanarPose start;       ///< measured
  control::PlanarVector measured;  ///< m, m, rad
};

/// Windows of about this length from pose to pose, each beginning `stride_s` after the one before. Left out:
/// those for which the wheels were not recorded, `margin_s` before and after.
std::vector<BaseWindow> windows_of(const BaseMotion& motion, double window_s, double stride_s,
                                   double margin_s);

/// The wheels' part of a window, `delay_s` earlier.
WheelSteps wheel_steps(const BaseRun& run, double start_s, double end_s, double delay_s);

/// The base's pose after these steps, from the one before.
control::PlanarPose rolled_from(control::PlanarPose pose, const control::BaseRolling& rolling,
                                const WheelSteps& steps, int floor);

/// Displacement of the tracked body by a description.
control::PlanarVector predicted(const control::BaseRolling& rolling, const WheelSteps& steps, int floor);

/// Mean distance that the circumferences of the wheels roll in it, without regard to sign.
double rolled_m(const control::BaseDescription& base, const WheelSteps& steps);

/// Moves the times of the wheels by the delay of the poses behind them: that at which the description's
/// displacements are most nearly proportional to the measured ones, of each run by itself where it stands out
/// from that of all. Returns that of all; 0 if none stands out.
double align(const control::BaseDescription& base, std::span<BaseMotion> motions, double longest_delay_s);

}  // namespace identification::robot_gap
