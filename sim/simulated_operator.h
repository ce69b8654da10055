/// @file
/// Somebody who does tasks with a robot by hand on the master: sees its tip late, feels the force, corrects
/// himself now and then.
///
/// Frames: H and D as in hal/haptic_sample.h, W and T as in control/robot_model.h. He looks the way the robot
/// does: its x (forward) is away from him, -x of H, its y (left) his left, -y of H.
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

/// What he can be asked to do. Places and directions are the robot's, in W; directions of any length but 0.
namespace tasks {

struct Wait {
  std::chrono::nanoseconds duration{};
};
/// Brings the tip to a place and sees it stay there.
struct Reach {
  Eigen::Vector3d p_WT_m = Eigen::Vector3d::Zero();
  double tolerance_m = 0.005;
  std::chrono::nanoseconds settle = std::chrono::milliseconds(500);
};
/// Goes to the first point, then leads the tip along the straight lines between the points at this speed.
struct Follow {
  std::vector<Eigen::Vector3d> points_W_m;
  double speed_m_per_s = 0.05;
  double tolerance_m = 0.01;  ///< at the first point and the last
};
/// Feels his way until something holds against him, stays on it, backs off. What goes away while he stays was
/// the robot's own drag: he goes on. At the end of his reach rate control takes the tip on.
struct Touch {
  Eigen::Vector3d direction_W = Eigen::Vector3d::UnitX();
  double felt_N = 1.5;
  std::chrono::nanoseconds hold = std::chrono::seconds(1);
  double back_off_m = 0.02;
  double speed_m_per_s = 0.04;
};
/// Moves the tip, and what is in its way, this far.
struct Push {
  Eigen::Vector3d direction_W = Eigen::Vector3d::UnitX();
  double distance_m = 0.0;
};
/// Brings the tip to a place further than the hand reaches: holds the pen at the rim towards it, where rate
/// control takes over, and brings it back to the middle in time; then as Reach.
struct DriveFar {
  Eigen::Vector3d p_WT_m = Eigen::Vector3d::Zero();
  double tolerance_m = 0.01;
};
/// Turns the pen as the tip is to turn.
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
  std::chrono::nanoseconds timeout = std::chrono::seconds(20);  ///< then he gives up and does the next
};

/// "reach", "drive far"
std::string_view name_of(const Task& task) noexcept;

enum class TaskResult { kNotBegun, kUnderWay, kDone, kTimedOut };

struct TaskOutcome {
  TaskResult result = TaskResult::kNotBegun;
  std::chrono::nanoseconds duration{};
  double largest_force_N = 0.0;  ///< of the device on the pen
  /// Distance of the tip from the path, of tasks::Follow from its first point on; NaN for others.
  double mean_path_error_m = std::numeric_limits<double>::quiet_NaN();
  double largest_path_error_m = std::numeric_limits<double>::quiet_NaN();
};

/// Round numbers of people at visually guided reaching; assumptions where nothing else is said.
struct OperatorParameters {
  /// From what happens to what he does about it, seen or felt.
  std::chrono::nanoseconds reaction = std::chrono::milliseconds(200);
  /// A corrective movement takes this long, longer ones as their peak speed demands. The next one begins when
  /// he has seen how it ended: every 0.45 s.
  std::chrono::nanoseconds correction = std::chrono::milliseconds(250);
  double peak_speed_m_per_s = 0.25;
  /// Share of the error that one movement makes good. People's first movements fall short, too.
  double correction_share = 0.7;
  /// He has learned that the tip follows the pen with about this lag, and does not correct what is still to
  /// come [such a forward model: Miall and others, J. Motor Behavior 25:203, 1993]. A robot of a lag from
  /// nothing to five times this he masters.
  std::chrono::nanoseconds expected_lag = std::chrono::milliseconds(200);
  double motion_scale = 1.0;  ///< metres of the tip for a metre of the pen
  control::RateBoundary boundary{};
  double share_of_reach = 0.92;  ///< of the way to the boundary, that he uses while the tip follows the pen
  double beyond_boundary_m = 0.012;  ///< where he holds the pen to drive
};

/// Does his tasks one after the other. One thread. Cycle: step().
class SimulatedOperator {
 public:
  /// `hand` is to outlive him.
  /// @throws std::invalid_argument naming the task, counted from 1, or the parameter that is wrong.
  SimulatedOperator(Hand& hand, std::vector<Task> tasks, const OperatorParameters& parameters = {});

  /// Each cycle before the haptic exchange: where the tip is now, `period` after the last call.
  // NOLINTNEXTLINE(bugprone-exception-escape): std::visit throws for a valueless variant, which no task is.
  void step(std::chrono::nanoseconds period, const Eigen::Isometry3d& X_WT) noexcept;

  bool finished() const noexcept { return current_ == tasks_.size(); }
  /// Index of the task under way; the number of tasks when there is none left.
  std::size_t current() const noexcept { return current_; }
  std::span<const Task> tasks() const noexcept { return tasks_; }
  std::span<const TaskOutcome> outcomes() const noexcept { return outcomes_; }

 private:
  /// What reaches his mind, late.
  struct View {
    Eigen::Vector3d p_WT_m = Eigen::Vector3d::Zero();
    Eigen::Vector3d p_HD_m = Eigen::Vector3d::Zero();
    Eigen::Vector3d expected_p_HD_m = Eigen::Vector3d::Zero();  ///< of which the tip was to show the effect
    Eigen::Vector3d f_W_N = Eigen::Vector3d::Zero();            ///< of the device on the pen
  };
  /// How far he is with a task.
  enum class Phase { kApproach, kOnTheWay, kHold, kReturn };

  void look(std::chrono::nanoseconds period, const Eigen::Vector3d& p_WT_m) noexcept;
  void begin() noexcept;
  void end(TaskResult result) noexcept;
  void measure_path(const tasks::Follow& task, const Eigen::Vector3d& p_WT_m) noexcept;

  // Each is called every cycle; true when the task is done.
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
  /// One corrective movement of the pen, when the last one has been seen to end.
  void correct_towards(const Eigen::Vector3d& p_WT_m) noexcept;
  /// Corrects until the tip was seen near the place for this long.
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

  std::vector<View> views_;  // a ring, evenly in time, the newest at `newest_`
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
  // Of the task under way.
  Phase phase_ = Phase::kApproach;
  std::chrono::nanoseconds phase_begun_{};
  Eigen::Vector3d start_p_WT_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d drive_direction_H_ = Eigen::Vector3d::UnitX();
  double path_error_sum_m_ = 0.0;
  std::size_t path_samples_ = 0;
};

}  // namespace sim
