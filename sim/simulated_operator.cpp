#include "sim/simulated_operator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "control/haptic_mapping.h"
#include "control/master_frame.h"
#include "hal/seconds.h"

namespace sim {
namespace {

using hal::seconds;

using control::turned_H_W;
using Eigen::Vector3d;
using std::chrono::nanoseconds;
using namespace std::chrono_literals;

constexpr nanoseconds kGlance = 10ms;
/// Number of glances between the two positions used to estimate the speed of the end effector.
constexpr std::size_t kSpeedGlances = 5;
/// Ratio of peak to mean speed of a minimum-jerk movement.
constexpr double kPeakOverMean = 1.875;
constexpr nanoseconds kSettle = 300ms;
constexpr double kPushTolerance_m = 0.003;
/// Duration of one piece of a feeling movement.
constexpr nanoseconds kFeelingPiece = 400ms;
/// From the boundary to the centre, and the first part of it, in which the handle still drives.
constexpr nanoseconds kWayBack = 600ms;
constexpr double kLeaving_s = 0.2;
/// Accuracy of the operator's handle position at the boundary.
constexpr double kRimTolerance_m = 0.003;
/// Closer than this the direction to the target is not updated.
constexpr double kDirectionFrom_m = 0.05;

constexpr double kAtRest_m_per_s = 0.01;
/// Upper bound of the distance to the boundary: an arm's length.
constexpr double kLargestReach_m = 1.0;

nanoseconds from_seconds(double time_s) { return nanoseconds(std::llround(1e9 * time_s)); }

double distance_m(const Vector3d& p_m, const Vector3d& from_m, const Vector3d& to_m) {
  const Vector3d along = to_m - from_m;
  const double length2 = along.squaredNorm();
  const double share = length2 > 0.0 ? std::clamp((p_m - from_m).dot(along) / length2, 0.0, 1.0) : 0.0;
  return (p_m - from_m - share * along).norm();
}

double length_m(const std::vector<Vector3d>& points_m) {
  double length_m = 0.0;
  for (std::size_t i = 1; i < points_m.size(); ++i) length_m += (points_m[i] - points_m[i - 1]).norm();
  return length_m;
}

/// Point at this distance along the polyline, at most its end.
Vector3d place_along(const std::vector<Vector3d>& points_m, double way_m) {
  for (std::size_t i = 1; i < points_m.size(); ++i) {
    const Vector3d along_m = points_m[i] - points_m[i - 1];
    const double piece_m = along_m.norm();
    if (way_m < piece_m) return points_m[i - 1] + way_m / piece_m * along_m;
    way_m -= piece_m;
  }
  return points_m.back();
}

/// Reports errors of one task or of the operator.
struct Check {
  std::string who;

  [[noreturn]] void refuse(const std::string& what) const { throw std::invalid_argument(who + ": " + what); }
  void positive(const char* name, double value) const {
    if (!std::isfinite(value) || value <= 0.0)
      refuse(std::string(name) + " is " + std::to_string(value) + ", must be finite and positive");
  }
  void not_negative(const char* name, nanoseconds time) const {
    if (time < 0ns)
      refuse(std::string(name) + " is " + std::to_string(seconds(time)) + " s, must not be negative");
  }
  void finite(const char* name, const Vector3d& v) const {
    if (!v.allFinite()) refuse(std::string(name) + " is not finite");
  }
  void direction(const Vector3d& v) const {
    finite("direction_W", v);
    positive("length of direction_W", v.norm());
  }

  void operator()(const tasks::Wait& task) const { not_negative("duration", task.duration); }
  void operator()(const tasks::Reach& task) const {
    finite("p_WT_m", task.p_WT_m);
    positive("tolerance_m", task.tolerance_m);
    not_negative("settle", task.settle);
  }
  void operator()(const tasks::Follow& task) const {
    if (task.points_W_m.size() < 2) refuse("points_W_m needs two points or more");
    for (const Vector3d& point_m : task.points_W_m) finite("a point of points_W_m", point_m);
    positive("speed_m_per_s", task.speed_m_per_s);
    positive("tolerance_m", task.tolerance_m);
  }
  void operator()(const tasks::Touch& task) const {
    direction(task.direction_W);
    positive("felt_N", task.felt_N);
    not_negative("hold", task.hold);
    positive("back_off_m", task.back_off_m);
    positive("speed_m_per_s", task.speed_m_per_s);
  }
  void operator()(const tasks::Push& task) const {
    direction(task.direction_W);
    positive("distance_m", task.distance_m);
  }
  void operator()(const tasks::DriveFar& task) const {
    finite("p_WT_m", task.p_WT_m);
    positive("tolerance_m", task.tolerance_m);
  }
  void operator()(const tasks::Turn& task) const {
    finite("rotation_W_rad", task.rotation_W_rad);
    not_negative("duration", task.duration);
  }
  void operator()(const tasks::Button& task) const {
    if (task.index < 0 || task.index > 31)
      refuse("index is " + std::to_string(task.index) + ", must be 0 to 31");
  }
  void operator()(const tasks::LetGo&) const {}
  void operator()(const tasks::TakeHold&) const {}
};

void check(const OperatorParameters& p) {
  const Check check{"operator"};
  check.not_negative("reaction", p.reaction);
  check.positive("correction [s]", seconds(p.correction));
  check.positive("peak_speed_m_per_s", p.peak_speed_m_per_s);
  check.positive("correction_share", p.correction_share);
  check.positive("expected_lag [s]", seconds(p.expected_lag));
  check.positive("motion_scale", p.motion_scale);
  check.positive("share_of_reach", p.share_of_reach);
  check.positive("beyond_boundary_m", p.beyond_boundary_m);
  if (!p.boundary.inside(Vector3d::Zero())) check.refuse("the handle's origin is outside the boundary");
}

}  // namespace

std::string_view name_of(const Task& task) noexcept {
  constexpr std::array<std::string_view, 10> kNames{"wait",      "reach", "follow", "touch",  "push",
                                                    "drive far", "turn",  "button", "let go", "take hold"};
  static_assert(kNames.size() == std::variant_size_v<decltype(Task::what)>);
  return kNames[task.what.index()];
}

SimulatedOperator::SimulatedOperator(Hand& hand, std::vector<Task> tasks,
                                     const OperatorParameters& parameters)
    : hand_(hand), tasks_(std::move(tasks)), parameters_(parameters), outcomes_(tasks_.size()) {
  check(parameters);
  for (std::size_t i = 0; i < tasks_.size(); ++i) {
    const Check check{"task " + std::to_string(i + 1) + " (" + std::string(name_of(tasks_[i])) + ")"};
    std::visit(check, tasks_[i].what);
    check.positive("timeout [s]", seconds(tasks_[i].timeout));
  }
  views_.resize(static_cast<std::size_t>(parameters.reaction / kGlance) + kSpeedGlances + 1);
}

// NOLINTNEXTLINE(bugprone-exception-escape): as said at its declaration.
void SimulatedOperator::step(nanoseconds period, const Eigen::Isometry3d& X_WT) noexcept {
  const Vector3d p_WT_m = X_WT.translation();
  look(period, p_WT_m);
  time_ += period;
  if (finished()) return;
  if (outcomes_[current_].result == TaskResult::kNotBegun) begin();
  TaskOutcome& outcome = outcomes_[current_];
  outcome.duration = time_ - begun_;
  outcome.largest_force_N = std::max(outcome.largest_force_N, hand_.device_force_N().norm());
  const Task& task = tasks_[current_];
  if (const auto* follow = std::get_if<tasks::Follow>(&task.what)) measure_path(*follow, p_WT_m);
  if (std::visit([this](const auto& what) { return act(what); }, task.what))
    end(TaskResult::kDone);
  else if (outcome.duration >= task.timeout)
    end(TaskResult::kTimedOut);
}

void SimulatedOperator::look(nanoseconds period, const Vector3d& p_WT_m) noexcept {
  const Vector3d meant_m = hand_.holds() ? hand_.intended_p_HD_m() : hand_.p_HD_m();
  const double share = seconds(period) / seconds(parameters_.expected_lag + period);
  expected_p_HD_m_ += (looked_ ? share : 1.0) * (meant_m - expected_p_HD_m_);
  const View now{p_WT_m, hand_.p_HD_m(), expected_p_HD_m_, turned_H_W(hand_.device_force_N())};
  if (!looked_) std::fill(views_.begin(), views_.end(), now);
  looked_ = true;
  for (since_glance_ += period; since_glance_ >= kGlance; since_glance_ -= kGlance) {
    newest_ = (newest_ + 1) % views_.size();
    views_[newest_] = now;
  }
  const View& earlier = views_[(newest_ + 1) % views_.size()];
  seen_ = views_[(newest_ + 1 + kSpeedGlances) % views_.size()];
  seen_v_WT_m_per_s_ = (seen_.p_WT_m - earlier.p_WT_m) / seconds(static_cast<int>(kSpeedGlances) * kGlance);
}

void SimulatedOperator::begin() noexcept {
  outcomes_[current_].result = TaskResult::kUnderWay;
  begun_ = time_;
  start_p_WT_m_ = seen_.p_WT_m;
  path_error_sum_m_ = 0.0;
  path_samples_ = 0;
  enter(Phase::kApproach);
}

void SimulatedOperator::enter(Phase phase) noexcept {
  phase_ = phase;
  phase_begun_ = settled_since_ = time_;
}

void SimulatedOperator::end(TaskResult result) noexcept {
  // A handle left at the boundary would drive forever.
  const bool drives = std::holds_alternative<tasks::DriveFar>(tasks_[current_].what);
  if (drives && phase_ == Phase::kOnTheWay) move_hand(Vector3d::Zero(), kWayBack);
  outcomes_[current_].result = result;
  ++current_;
}

void SimulatedOperator::measure_path(const tasks::Follow& task, const Vector3d& p_WT_m) noexcept {
  if (phase_ != Phase::kOnTheWay) return;
  double error_m = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < task.points_W_m.size(); ++i)
    error_m = std::min(error_m, distance_m(p_WT_m, task.points_W_m[i - 1], task.points_W_m[i]));
  TaskOutcome& outcome = outcomes_[current_];
  outcome.largest_path_error_m = std::fmax(outcome.largest_path_error_m, error_m);
  path_error_sum_m_ += error_m;
  outcome.mean_path_error_m = path_error_sum_m_ / static_cast<double>(++path_samples_);
}

Vector3d SimulatedOperator::intended_m() noexcept {
  hand_.take_hold();
  return hand_.intended_p_HD_m();
}

void SimulatedOperator::move_hand(const Vector3d& p_HD_m, nanoseconds at_least) noexcept {
  const double way_m = (p_HD_m - intended_m()).norm();
  const nanoseconds duration =
      std::max(at_least, from_seconds(kPeakOverMean * way_m / parameters_.peak_speed_m_per_s));
  hand_.move_to(p_HD_m, duration);
  next_move_ = time_ + duration + parameters_.reaction;
}

void SimulatedOperator::correct_towards(const Vector3d& p_WT_m) noexcept {
  if (!ready()) return;
  const Vector3d missing_m = turned_H_W(p_WT_m - will_rest_at_m()) / parameters_.motion_scale;
  move_hand(within_reach(intended_m() + parameters_.correction_share * missing_m), parameters_.correction);
}

bool SimulatedOperator::bring_to(const Vector3d& p_WT_m, double tolerance_m, nanoseconds settle) noexcept {
  // Within half the tolerance no correction is made.
  if ((will_rest_at_m() - p_WT_m).norm() > 0.5 * tolerance_m) correct_towards(p_WT_m);
  if ((seen_.p_WT_m - p_WT_m).norm() > tolerance_m) settled_since_ = time_ + 1ns;
  return time_ - settled_since_ >= settle;
}

Vector3d SimulatedOperator::will_rest_at_m() const noexcept {
  if (!hand_.holds()) return seen_.p_WT_m;
  const Vector3d to_come_m = hand_.intended_p_HD_m() - seen_.expected_p_HD_m;
  return seen_.p_WT_m + parameters_.motion_scale * turned_H_W(to_come_m);
}

/// Distance of the boundary from the origin in this direction of length 1.
double SimulatedOperator::boundary_m(const Vector3d& direction_H) const noexcept {
  double inside_m = 0.0;
  double outside_m = kLargestReach_m;
  for (int i = 0; i < 30; ++i) {  // to a nanometre
    const double middle_m = 0.5 * (inside_m + outside_m);
    (parameters_.boundary.inside(middle_m * direction_H) ? inside_m : outside_m) = middle_m;
  }
  return inside_m;
}

Vector3d SimulatedOperator::within_reach(const Vector3d& p_HD_m) const noexcept {
  const double far_m = p_HD_m.norm();
  if (far_m == 0.0) return p_HD_m;
  const double reach_m = parameters_.share_of_reach * boundary_m(p_HD_m / far_m);
  return std::min(1.0, reach_m / far_m) * p_HD_m;
}

Vector3d SimulatedOperator::up_to_the_rim(const Vector3d& p_HD_m) const noexcept {
  const double far_m = p_HD_m.norm();
  if (far_m == 0.0) return p_HD_m;
  const double rim_m = boundary_m(p_HD_m / far_m) + parameters_.beyond_boundary_m;
  return std::min(1.0, rim_m / far_m) * p_HD_m;
}

bool SimulatedOperator::act(const tasks::Wait& task) noexcept { return time_ - begun_ >= task.duration; }

bool SimulatedOperator::act(const tasks::Reach& task) noexcept {
  return bring_to(task.p_WT_m, task.tolerance_m, task.settle);
}

bool SimulatedOperator::act(const tasks::Follow& task) noexcept {
  if (phase_ == Phase::kApproach) {
    if (bring_to(task.points_W_m.front(), task.tolerance_m, kSettle)) enter(Phase::kOnTheWay);
    return false;
  }
  const double gone_m = task.speed_m_per_s * seconds(time_ - phase_begun_);
  if (gone_m >= length_m(task.points_W_m)) return bring_to(task.points_W_m.back(), task.tolerance_m, kSettle);
  // To where the path will be when the end of this movement is seen.
  const double ahead_m = task.speed_m_per_s * seconds(parameters_.correction + parameters_.reaction);
  correct_towards(place_along(task.points_W_m, gone_m + ahead_m));
  settled_since_ = time_;
  return false;
}

bool SimulatedOperator::act(const tasks::Touch& task) noexcept {
  const Vector3d direction_W = task.direction_W.normalized();
  const double against_N = -seen_.f_W_N.dot(direction_W);
  switch (phase_) {
    case Phase::kApproach:
    case Phase::kOnTheWay:
      if (against_N >= task.felt_N) {
        hand_.hold_at(intended_m());
        next_move_ = time_ + parameters_.reaction;
        enter(Phase::kHold);
      } else if (ready()) {
        const Vector3d piece_m = turned_H_W(direction_W) * task.speed_m_per_s * seconds(kFeelingPiece);
        hand_.move_to(up_to_the_rim(intended_m() + piece_m), kFeelingPiece);
        next_move_ = time_ + kFeelingPiece;
      }
      return false;
    case Phase::kHold:
      if (against_N < 0.5 * task.felt_N) {
        enter(Phase::kOnTheWay);
      } else if (time_ - phase_begun_ >= task.hold) {
        start_p_WT_m_ = seen_.p_WT_m;
        enter(Phase::kReturn);
      }
      return false;
    case Phase::kReturn: break;
  }
  return bring_to(start_p_WT_m_ - task.back_off_m * direction_W, 0.25 * task.back_off_m, 0ns);
}

bool SimulatedOperator::act(const tasks::Push& task) noexcept {
  const Vector3d direction_W = task.direction_W.normalized();
  correct_towards(start_p_WT_m_ + task.distance_m * direction_W);
  return (seen_.p_WT_m - start_p_WT_m_).dot(direction_W) >= task.distance_m - kPushTolerance_m;
}

bool SimulatedOperator::act(const tasks::DriveFar& task) noexcept {
  const double scale = parameters_.motion_scale;
  const Vector3d missing_m = turned_H_W(task.p_WT_m - seen_.p_WT_m);
  switch (phase_) {
    case Phase::kApproach: {
      const Vector3d needed_m = intended_m() + turned_H_W(task.p_WT_m - will_rest_at_m()) / scale;
      const bool within = (needed_m - within_reach(needed_m)).norm() * scale < 0.5 * task.tolerance_m;
      // A moving end effector may still arrive.
      if (within || !ready() || seen_v_WT_m_per_s_.norm() > kAtRest_m_per_s)
        return bring_to(task.p_WT_m, task.tolerance_m, kSettle);
      drive_direction_H_ = missing_m.stableNormalized();
      enter(Phase::kOnTheWay);
      return false;
    }
    case Phase::kOnTheWay: {
      if (missing_m.norm() > kDirectionFrom_m) drive_direction_H_ = missing_m.normalized();
      const double rim_m = boundary_m(drive_direction_H_) + parameters_.beyond_boundary_m;
      // On the way back to the centre, the end effector moves back with the handle. The operator stops half
      // of that way past the target, which leaves equal corrections in both directions.
      const double ahead_m = seen_v_WT_m_per_s_.dot(turned_H_W(drive_direction_H_)) *
                             (seconds(parameters_.reaction + parameters_.expected_lag) + kLeaving_s);
      if (missing_m.dot(drive_direction_H_) + 0.5 * scale * rim_m <= ahead_m) {
        move_hand(Vector3d::Zero(), kWayBack);
        enter(Phase::kReturn);
        return false;
      }
      // The robot pulls at the handle; the operator feels its position and pushes further, within a limit.
      const Vector3d aside_m = rim_m * drive_direction_H_ - seen_.p_HD_m;
      if (!ready() || aside_m.norm() < kRimTolerance_m) return false;
      const Vector3d next_m = intended_m() + aside_m;
      move_hand(std::min(1.0, 2.0 * rim_m / next_m.norm()) * next_m, parameters_.correction);
      return false;
    }
    case Phase::kHold:
    case Phase::kReturn: break;
  }
  if (ready()) enter(Phase::kApproach);
  return false;
}

bool SimulatedOperator::act(const tasks::Turn& task) noexcept {
  if (phase_ == Phase::kApproach) {
    const double angle_rad = task.rotation_W_rad.norm();
    const Vector3d axis_H = turned_H_W(task.rotation_W_rad).stableNormalized();
    hand_.turn_to(Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, axis_H)) * hand_.q_HD(), task.duration);
    enter(Phase::kHold);
  }
  return time_ - begun_ >= task.duration;
}

bool SimulatedOperator::act(const tasks::Button& task) noexcept {
  const std::uint32_t button = std::uint32_t{1} << task.index;
  if (task.down)
    hand_.press(button);
  else
    hand_.release(button);
  return true;
}

bool SimulatedOperator::act(const tasks::LetGo&) noexcept {
  hand_.let_go();
  return true;
}

bool SimulatedOperator::act(const tasks::TakeHold&) noexcept {
  hand_.take_hold();
  return true;
}

}  // namespace sim
