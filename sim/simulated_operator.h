/// @file
/// A person who performs tasks in teleoperation: sees the end effector with a delay, feels the force, and
/// corrects at intervals.
///
/// Frames: H and D as in hal/haptic_sample.h, W and T as in control/robot_model.h. The operator looks in the
/// robot's direction: its x (forward) is away from the operator, -x of H, its y (left) is the operator's
/// left, -y of H.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <chrono>
#include <cstddef>
#include <limits>
#include <span>
#include <string_view>
#include <variant>
#include <vector>

#include "control/rate_boundary.h"
#include "sim/hand.h"

namespace sim {

/// Tasks. Positions and directions are the robot's, in W; directions of any non-zero length.
namespace tasks {

struct Wait {
  std::chrono::nanoseconds duration{};
};
/// Moves the end effector to a position and sees it stay there.
struct Reach {
  Eigen::Vector3d p_WT_m = Eigen::Vector3d::Zero();
  double tolerance_m = 0.005;
  std::chrono::nanoseconds settle = std::chrono::milliseconds(500);
};
/// Goes to the first point, then leads the end effector along the straight lines between the points at this
/// speed.
struct Follow {
  std::vector<Eigen::Vector3d> points_W_m;
  double speed_m_per_s = 0.05;
  double tolerance_m = 0.01;  ///< at the first point and the last
};
/// Feels forward until something resists, stays on it, backs off. If the resistance vanishes during the stay,
/// it was the robot's own drag: the search continues. At the end of the handle's travel rate control moves
/// the end effector on.
struct Touch {
  Eigen::Vector3d direction_W = Eigen::Vector3d::UnitX();
  double felt_N = 1.5;
  std::chrono::nanoseconds hold = std::chrono::seconds(1);
  double back_off_m = 0.02;
  double speed_m_per_s = 0.04;
};
/// Moves the end effector, and anything in its way, this far.
struct Push {
  Eigen::Vector3d direction_W = Eigen::Vector3d::UnitX();
  double distance_m = 0.0;
};
/// Moves the end effector further than the hand reaches: holds the handle at the boundary in that direction,
/// where rate control starts, and returns it to the centre in time; then as Reach.
struct DriveFar {
  Eigen::Vector3d p_WT_m = Eigen::Vector3d::Zero();
  double tolerance_m = 0.01;
};
/// Turns the handle as the end effector should turn.
struct Turn {
  Eigen::Vector3d rotation_W_rad = Eigen::Vector3d::Zero();  ///< axis times angle
  std::chrono::nanoseconds duration = std::chrono::seconds(1);
};
struct Button {
  int index = 0;
  bool down = true;
};
struct LetGo {};
struct TakeHold {};

}  // namespace tasks

struct Task {
  std::variant<tasks::Wait, tasks::Reach, tasks::Follow, tasks::Touch, tasks::Push, tasks::DriveFar,
               tasks::Turn, tasks::Button, tasks::LetGo, tasks::TakeHold>
      what;
  std::chrono::nanoseconds timeout = std::chrono::seconds(20);  ///< then this task is abandoned and the next
                                                                ///< one starts
};

/// "reach", "drive far"
std::string_view name_of(const Task& task) noexcept;

enum class TaskResult { kNotBegun, kUnderWay, kDone, kTimedOut };

struct TaskOutcome {
  TaskResult result = TaskResult::kNotBegun;
  std::chrono::nanoseconds duration{};
  double largest_force_N = 0.0;  ///< of the device on the handle
  /// Distance of the end effector from the path, for tasks::Follow from its first point on; NaN for others.
  double mean_path_error_m = std::numeric_limits<double>::quiet_NaN();
  double largest_path_error_m = std::numeric_limits<double>::quiet_NaN();
};

/// Typical values of humans in visually guided reaching; assumptions unless stated otherwise.
struct OperatorParameters {
  /// From an event to the reaction, seen or felt.
  std::chrono::nanoseconds reaction = std::chrono::milliseconds(200);
  /// Duration of a corrective movement; longer ones depend on their peak speed. The next one starts once its
  /// end has been seen: every 0.45 s.
  std::chrono::nanoseconds correction = std::chrono::milliseconds(250);
  double peak_speed_m_per_s = 0.25;
  /// Share of the error that one movement corrects. Humans' first movements fall short, too.
  double correction_share = 0.7;
  /// Learned lag of the end effector behind the handle; the pending motion is not corrected [such a forward
  /// model: Miall and others, J. Motor Behavior 25:203, 1993]. The operator copes with lags from zero to five
  /// times this.
  std::chrono::nanoseconds expected_lag = std::chrono::milliseconds(200);
  double motion_scale = 1.0;  ///< metres of the end effector per metre of the handle
  control::RateBoundary boundary{};
  double share_of_reach = 0.92;  ///< share of the distance to the boundary that is used in position control
  double beyond_boundary_m = 0.012;  ///< position of the handle during rate control
};

/// Performs the tasks in order. One thread. Cycle: step().
class SimulatedOperator {
 public:
  /// Each cycle before the haptic exchange: pose of the end effector now, `period` after the last call.
  /// NOLINTNEXTLINE(bugprone-exception-escape): std::visit throws for a valueless variant, which no task is.
  SimulatedOperator(Hand& hand, std::vector<Task> tasks, const OperatorParameters& parameters = {});

  /// Each cycle before the haptic exchange: where the tip is now, `period` after the last call.
  // NOLINTNEXTLINE(bugprone-exception-escape): std::visit throws for a valueless variant, which no task is.
  void step(std::chrono::nanoseconds period, const Eigen::Isometry3d& X_WT) noexcept;

  bool finished() const noexcept { return current_ == tasks_.size(); }
  /// Index of the current task; the number of tasks if there is none left.
  std::size_t current() const noexcept { return current_; }
  std::span<const Task> tasks() const noexcept { return tasks_; }
  std::span<const TaskOutcome> outcomes() const noexcept { return outcomes_; }

 private:
  /// Perception, delayed.
  struct View {
    Eigen::Vector3d p_WT_m = Eigen::Vector3d::Zero();
    Eigen::Vector3d p_HD_m = Eigen::Vector3d::Zero();
    Eigen::Vector3d expected_p_HD_m = Eigen::Vector3d::Zero();  ///< whose effect on the end effector is
                                                                ///< expected
    Eigen::Vector3d f_W_N = Eigen::Vector3d::Zero();            ///< of the device on the handle
  };
  /// Progress of a task.
  enum class Phase { kApproach, kOnTheWay, kHold, kReturn };

  void look(std::chrono::nanoseconds period, const Eigen::Vector3d& p_WT_m) noexcept;
  void begin() noexcept;
  void end(TaskResult result) noexcept;
  void measure_path(const tasks::Follow& task, const Eigen::Vector3d& p_WT_m) noexcept;

  // Each is called every cycle; true once the task is done.
  bool act(const tasks::Wait& task) noexcept;
  bool act(const tasks::Reach& task) noexcept;
  bool act(const tasks::Follow& task) noexcept;
  bool act(const tasks::Touch& task) noexcept;
  bool act(const tasks::Push& task) noexcept;
  bool act(const tasks::DriveFar& task) noexcept;
  bool act(const tasks::Turn& task) noexcept;
  bool act(const tasks::Button& task) noexcept;
  bool act(const tasks::LetGo& task) noexcept;
  bool act(const tasks::TakeHold& task) noexcept;

  bool ready() const noexcept { return time_ >= next_move_; }
  Eigen::Vector3d intended_m() noexcept;
  void move_hand(const Eigen::Vector3d& p_HD_m, std::chrono::nanoseconds at_least) noexcept;
  /// One corrective movement of the handle, after the last one has been seen to end.
  void correct_towards(const Eigen::Vector3d& p_WT_m) noexcept;
  /// Corrects until the end effector has been seen near the position for this long.
  bool bring_to(const Eigen::Vector3d& p_WT_m, double tolerance_m, std::chrono::nanoseconds settle) noexcept;
  void enter(Phase phase) noexcept;
  Eigen::Vector3d will_rest_at_m() const noexcept;
  double boundary_m(const Eigen::Vector3d& direction_H) const noexcept;
  Eigen::Vector3d within_reach(const Eigen::Vector3d& p_HD_m) const noexcept;
  Eigen::Vector3d up_to_the_rim(const Eigen::Vector3d& p_HD_m) const noexcept;

  Hand& hand_;
  std::vector<Task> tasks_;
  OperatorParameters parameters_;
  std::vector<TaskOutcome> outcomes_;
  std::size_t current_ = 0;

  std::vector<View> views_;  // a ring buffer, evenly spaced in time, the newest at `newest_`
  std::size_t newest_ = 0;
  bool looked_ = false;
  std::chrono::nanoseconds since_glance_{};
  View seen_;
  Eigen::Vector3d seen_v_WT_m_per_s_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d expected_p_HD_m_ = Eigen::Vector3d::Zero();

  std::chrono::nanoseconds time_{};
  std::chrono::nanoseconds begun_{};
  std::chrono::nanoseconds next_move_{};
  std::chrono::nanoseconds settled_since_{};
  // Of the current task.
  Phase phase_ = Phase::kApproach;
  std::chrono::nanoseconds phase_begun_{};
  Eigen::Vector3d start_p_WT_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d drive_direction_H_ = Eigen::Vector3d::UnitX();
  double path_error_sum_m_ = 0.0;
  std::size_t path_samples_ = 0;
};

}  // namespace sim
