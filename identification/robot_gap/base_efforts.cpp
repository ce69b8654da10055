#include "identification/robot_gap/base_efforts.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "identification/fit/statistics.h"
#include "identification/gap/parallel.h"
#include "identification/robot_gap/base_information.h"

namespace identification::robot_gap {
namespace {

using control::BaseDescription;

constexpr double kShortestEffort_s = 0.1;
constexpr double kLongestEffort_s = 2;
/// Rows of a recording in a window.
constexpr double kLeastRows = 8;
constexpr std::size_t kFewestEfforts = 60;
constexpr double kLongestTorqueLag_s = 0.1;
constexpr double kCoarseLag_s = 0.02;
/// Halvings of the step about the best lag, before the last parabola.
constexpr int kLagHalvings = 2;
/// Smoothing for the speeds that tell motion from rest, in rows.
constexpr double kSmoothedRows = 3;
constexpr double kLeastFloor = 1e-9;
/// A torque whose power is negative by this share of its magnitude has the wrong sign.
constexpr double kAgainst = 0.3;
/// Of the windows in one direction, with the same sign of the torque as in the other.
constexpr double kOneSided = 0.95;

std::size_t count_of(const BaseEfforts::Windows& windows) {
  std::size_t count = 0;
  for (const std::vector<EffortWindow>& own : windows) count += own.size();
  return count;
}

template <class Of>
Eigen::MatrixX3d each(const BaseEfforts::Windows& windows, const std::vector<int>& floors,
                      const BaseDescription& base, const BaseDescription& given, Of of) {
  Eigen::MatrixX3d result(static_cast<Eigen::Index>(count_of(windows)), 3);
  Eigen::Index row = 0;
  for (std::size_t m = 0; m < windows.size(); ++m) {
    const BaseForces forces(base, given, floors[m]);
    for (const EffortWindow& window : windows[m]) result.row(row++) = of(forces, window);
  }
  return result;
}
Eigen::MatrixX3d excess_of(const BaseEfforts::Windows& windows, const std::vector<int>& floors,
                           const BaseDescription& base, const BaseDescription& given) {
  return each(windows, floors, base, given,
              [](const BaseForces& forces, const EffortWindow& window) { return forces.excess(window); });
}

double row_period_s(std::span<const BaseMotion> motions) {
  std::vector<double> steps;
  for (const BaseMotion& motion : motions)
    for (const BaseRun& run : motion.runs)
      for (std::size_t i = 1; i < run.time_s.size(); ++i) steps.push_back(run.time_s[i] - run.time_s[i - 1]);
  return steps.empty() ? 0 : fit::median(std::move(steps));
}

std::vector<int> floors_of(std::span<const BaseMotion> motions) {
  std::vector<int> floors;
  for (const BaseMotion& motion : motions) floors.push_back(motion.floor);
  return floors;
}

}  // namespace

std::vector<Channel> effort_channels(control::BaseKinematics kinematics) {
  if (kinematics == control::BaseKinematics::kTricycle) return {{"force along", "N"}};
  const std::vector<Channel> all{{"force forward", "N"}, {"force sideways", "N"}, {"moment", "N·m"}};
  std::vector<Channel> channels;
  for (const Eigen::Index axis : effort_axes(kinematics))
    channels.push_back(all[static_cast<std::size_t>(axis)]);
  return channels;
}

BaseEfforts::BaseEfforts(const BaseDescription& given, const BaseCatalogue& all,
                         std::span<const BaseMotion> data, std::span<const BaseMotion> held_out)
    : given_(given),
      all_(all),
      data_(data),
      floors_(floors_of(data)),
      held_floors_(floors_of(held_out)),
      rest_(rest_speeds(data, given, kSmoothedRows * row_period_s(data))) {
  choose_window();
  if (count_of(searched_) < kFewestEfforts) return;
  require_signs();
  // Each depends on the other, a little.
  find_lag();
  choose_window();
  find_lag();
  searched_ = planned(data_, window_s_);
  held_out_ = planned(held_out, window_s_);
  see_noise();
}

bool BaseEfforts::is_enough() const noexcept {
  return count_of(searched_) >= kFewestEfforts && count_of(held_out_) > 0;
}

BaseEfforts::Windows BaseEfforts::planned(std::span<const BaseMotion> motions, double window_s) const {
  Windows windows(motions.size());
  gap::in_parallel(motions.size(), [&](std::size_t m) {
    windows[m] = effort_windows(motions[m], given_, rest_, window_s, lag_s_);
  });
  return windows;
}

/// Moments count as forces at the turning length.
BaseEfforts::Rows BaseEfforts::rows_of(const Windows& windows) const {
  const std::vector<Eigen::Index> axes = effort_axes(given_.kinematics);
  const auto compared = [&](const Eigen::MatrixX3d& excess) {
    Eigen::MatrixXd own = excess(Eigen::all, axes);
    if (axes.back() == 2) own.rightCols(1) /= given_.turning_length_m;
    return Eigen::VectorXd(own.reshaped());
  };
  std::vector<std::size_t> terms;
  for (std::size_t k = 0; k < all_.terms.size(); ++k)
    if (all_.terms[k].of_forces()) terms.push_back(k);
  Rows rows;
  rows.residual = compared(excess_of(windows, floors_, given_, given_));
  rows.slopes.resize(rows.residual.size(), static_cast<Eigen::Index>(terms.size()));
  for (std::size_t k = 0; k < terms.size(); ++k) {
    Eigen::VectorXd by = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(all_.terms.size()));
    by[static_cast<Eigen::Index>(terms[k])] = all_.terms[terms[k]].step;
    rows.slopes.col(static_cast<Eigen::Index>(k)) =
        (compared(excess_of(windows, floors_, changed(given_, all_, by), given_)) - rows.residual) /
        all_.terms[terms[k]].step;
  }
  return rows;
}

void BaseEfforts::choose_window() {
  std::vector<double> information;
  std::vector<double> lengths_s;
  const double least_s = std::max(kShortestEffort_s, kLeastRows * row_period_s(data_));
  for (double length_s = least_s; length_s <= kLongestEffort_s; length_s *= kLongerWindow) {
    const Windows windows = planned(data_, length_s);
    if (count_of(windows) < kFewestEfforts) break;
    const Rows rows = rows_of(windows);
    information.push_back(information_of(rows.slopes, rows.residual, rows.slopes.cols()));
    lengths_s.push_back(length_s);
  }
  window_s_ = information.empty() ? least_s : longest_informative_s(information, lengths_s);
  searched_ = planned(data_, window_s_);
}

/// The lag with which all parameters together explain most.
void BaseEfforts::find_lag() {
  const auto left_at = [&](double lag_s) {
    Windows windows = searched_;
    for (std::size_t m = 0; m < windows.size(); ++m)
      for (EffortWindow& window : windows[m])
        window.torque_Nm = mean_torque(data_[m].runs[window.run], window.start_s, window.end_s, lag_s);
    const Rows rows = rows_of(windows);
    return dense_fit_of(rows.slopes, rows.residual).variance;
  };
  const auto steps = static_cast<int>(std::floor(kLongestTorqueLag_s / kCoarseLag_s + 0.5));
  std::vector<double> left(static_cast<std::size_t>(2 * steps + 1));
  gap::in_parallel(left.size(),
                   [&](std::size_t i) { left[i] = left_at(kCoarseLag_s * (static_cast<int>(i) - steps)); });
  const auto best = std::ranges::min_element(left) - left.begin();
  double lag_s = kCoarseLag_s * static_cast<double>(best - steps);
  double here = left[static_cast<std::size_t>(best)];
  double step_s = kCoarseLag_s;
  for (int i = 0; i <= kLagHalvings; ++i) {
    step_s /= 2;
    const double before = left_at(lag_s - step_s);
    const double after = left_at(lag_s + step_s);
    if (before < here || after < here) {
      lag_s += before < after ? -step_s : step_s;
      here = std::min(before, after);
    } else if (i == kLagHalvings) {
      const double curvature = before - 2 * here + after;
      if (curvature > 0) lag_s += 0.5 * step_s * (before - after) / curvature;
    }
  }
  lag_s_ = lag_s;
}

void BaseEfforts::require_signs() const {
  for (std::size_t w = 0; w < given_.wheels.size(); ++w) {
    const auto at = static_cast<Eigen::Index>(w);
    double power = 0;
    double magnitude = 0;
    double forwards = 0;
    double backwards = 0;
    double positive_forwards = 0;
    double positive_backwards = 0;
    for (const std::vector<EffortWindow>& windows : searched_)
      for (const EffortWindow& window : windows) {
        const double torque_Nm = window.torque_Nm[at];
        power += torque_Nm * window.sign[at];
        magnitude += std::abs(torque_Nm);
        const bool is_forwards = window.sign[at] > 0;
        (is_forwards ? forwards : backwards) += 1;
        if (torque_Nm > 0) (is_forwards ? positive_forwards : positive_backwards) += 1;
      }
    const std::string of = "the torque of wheel " + given_.wheels[w].name;
    if (!(magnitude > 0))
      throw std::invalid_argument(of + " is zero wherever the wheel turns: check its torque_column");
    if (forwards > 0 && backwards > 0 && positive_forwards > kOneSided * forwards &&
        positive_backwards > kOneSided * backwards)
      throw std::invalid_argument(of +
                                  " is positive whichever way it turns: a magnitude is no torque; leave "
                                  "torque_column out of all wheels, or use load_column");
    if (power < -kAgainst * magnitude)
      throw std::invalid_argument(of + " acts against its motion: change the sign of its torque_factor");
  }
}

void BaseEfforts::see_noise() {
  if (!is_enough()) return;
  const double smooth_s = kSmoothedRows * row_period_s(data_);
  const Eigen::Vector3d of_sensors =
      effort_floor(given_, data_, searched_, effort_noise(data_, rest_, smooth_s));
  const Rows rows = rows_of(searched_);
  const Eigen::VectorXd left = dense_fit_of(rows.slopes, rows.residual).left;
  const std::vector<Eigen::Index> axes = effort_axes(given_.kinematics);
  const auto count = static_cast<Eigen::Index>(count_of(searched_));
  floor_ = of_sensors;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const double unit = axes[i] == 2 ? given_.turning_length_m : 1;
    const double rms =
        unit * std::sqrt(left.segment(static_cast<Eigen::Index>(i) * count, count).squaredNorm() /
                         static_cast<double>(count));
    floor_[axes[i]] = std::max(kLeastFloor, std::min(of_sensors[axes[i]], rms));
  }
}

Eigen::MatrixX3d BaseEfforts::pushed(Part part) const {
  return each(windows(part), part == Part::kSearched ? floors_ : held_floors_, given_, given_,
              [](const BaseForces& forces, const EffortWindow& window) { return forces.pushed(window); });
}

Eigen::MatrixX3d BaseEfforts::excess(Part part, const BaseDescription& base) const {
  return excess_of(windows(part), part == Part::kSearched ? floors_ : held_floors_, base, given_);
}

}  // namespace identification::robot_gap
