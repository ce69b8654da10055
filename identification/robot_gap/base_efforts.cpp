#include "identification/robot_gap/base_efforts.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "identification/fit/statistics.h"
#include "identification/gap/parallel.h"
#include "identification/robot_gap/base_effort_signs.h"
#include "identification/robot_gap/base_information.h"
#include "identification/robot_gap/least_near.h"

namespace identification::robot_gap {
namespace {

using control::BaseDescription;

constexpr double kShortestEffort_s = 0.1;
constexpr double kLongestEffort_s = 2;
/// Rows of a recording in a window.
constexpr double kLeastRows = 8;
constexpr std::size_t kFewestEfforts = 60;
/// Fewer windows that are held out are reported.
constexpr std::size_t kFewHeldOut = 20;
constexpr double kLongestTorqueLag_s = 0.1;
/// Stretches of time in which lags are compared.
constexpr std::size_t kLagStretches = 30;
constexpr double kLeastFloor = 1e-9;
/// The rest speed of a direction is searched up to so many doublings and halvings of the assumed one.
constexpr double kDoublings = 2;

std::size_t count_of(const BaseEfforts::Windows& windows) {
  std::size_t count = 0;
  for (const std::vector<EffortWindow>& own : windows) count += own.size();
  return count;
}

/// Axis of the twist against which a term is a resistance.
std::optional<Eigen::Index> resisted_axis(const BaseTerm& term) {
  if (term.kind == BaseTerm::Kind::kSidewaysResistance) return 1;
  if (term.kind == BaseTerm::Kind::kTurningResistance) return 2;
  return std::nullopt;
}

/// Squares of what is left, of one axis after the other, in stretches of as many windows.
std::vector<double> in_stretches(const Eigen::VectorXd& left, std::size_t windows) {
  std::vector<double> squares(kLagStretches, 0);
  for (std::size_t i = 0; i < static_cast<std::size_t>(left.size()); ++i) {
    const double one = left[static_cast<Eigen::Index>(i)];
    squares[i % windows * kLagStretches / windows] += one * one;
  }
  return squares;
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
  // Each depends on the other, a little.
  find_lag();
  find_rest_twist();
  choose_window();
  find_lag();
  searched_ = planned(data_, window_s_);
  held_out_ = planned(held_out, window_s_);
  if (!is_enough()) return;
  sign_notes_ = check_torque_signs(given_, searched_);
  see_noise();
}

bool BaseEfforts::is_enough() const noexcept {
  return count_of(searched_) >= kFewestEfforts && count_of(held_out_) > 0;
}

std::vector<std::string> BaseEfforts::notes() const {
  if (!is_enough()) {
    const bool searched = count_of(searched_) < kFewestEfforts;
    return {std::string("forces are not compared: in the ") + (searched ? "searched" : "held-out") +
            " recordings all wheels turn together for too short a time; record longer motions in which no "
            "wheel stands still"};
  }
  std::vector<std::string> notes = sign_notes_;
  char text[400];
  for (const BaseTerm& term : all_.terms) {
    const std::optional<Eigen::Index> axis = resisted_axis(term);
    if (!axis || std::isfinite(rest_.twist[*axis])) continue;
    const char* const name = *axis == 1 ? "sideways" : "turning";
    std::snprintf(text, sizeof text,
                  "%s motion of the base is not above the noise of its wheels: the %s resistance is not "
                  "determined, and the given one does not count; record such motion",
                  name, name);
    notes.emplace_back(text);
  }
  if (!lag_)
    std::snprintf(
        text, sizeof text,
        "too few windows lie %.3g s inside the recordings to find the lag of the torques; record longer",
        kLongestTorqueLag_s);
  else if (!lag_->is_determined)
    std::snprintf(
        text, sizeof text,
        "the lag of the torques is not determined: from %.3g s to %.3g s behind the wheels all explain "
        "them as well; %.3g s is taken, with which the given model explains most; record motions "
        "that speed up and slow down in other ways",
        lag_->shortest_s, lag_->longest_s, lag_->lag_s);
  else if (lag_->lag_s == 0)
    std::snprintf(text, sizeof text, "torques show no lag behind the wheels' motion");
  else
    std::snprintf(text, sizeof text,
                  "torques are %.3g s %s the wheels' motion; they are compared without this lag",
                  std::abs(lag_->lag_s), lag_->lag_s > 0 ? "behind" : "ahead of");
  notes.emplace_back(text);
  if (count_of(held_out_) < kFewHeldOut) {
    std::snprintf(
        text, sizeof text,
        "held-out recordings have only %zu windows of %.3g s for forces: they say little about them; "
        "hold out longer motions in which no wheel stands still",
        count_of(held_out_), window_s_);
    notes.emplace_back(text);
  }
  return notes;
}

BaseEfforts::Windows BaseEfforts::planned(std::span<const BaseMotion> motions, double window_s) const {
  Windows windows(motions.size());
  gap::in_parallel(motions.size(), [&](std::size_t m) {
    windows[m] = effort_windows(motions[m], given_, rest_, window_s, lag_s());
  });
  return windows;
}

/// Excess in rows, one axis after the other. Moments count as forces at the turning length.
Eigen::VectorXd BaseEfforts::compared(const Windows& windows, const BaseDescription& base) const {
  const std::vector<Eigen::Index> axes = effort_axes(given_.kinematics);
  Eigen::MatrixXd own = excess_of(windows, floors_, base, given_)(Eigen::all, axes);
  if (axes.back() == 2) own.rightCols(1) /= given_.turning_length_m;
  return own.reshaped();
}

/// Derivative by a term; `residual`: of the given base.
Eigen::VectorXd BaseEfforts::slope(const Windows& windows, std::size_t term,
                                   const Eigen::VectorXd& residual) const {
  const double step = all_.terms[term].step;
  Eigen::VectorXd by = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(all_.terms.size()));
  by[static_cast<Eigen::Index>(term)] = step;
  return (compared(windows, changed(given_, all_, by)) - residual) / step;
}

/// Terms of forces.
std::vector<std::size_t> BaseEfforts::terms() const {
  std::vector<std::size_t> terms;
  for (std::size_t k = 0; k < all_.terms.size(); ++k)
    if (all_.terms[k].of_forces()) terms.push_back(k);
  return terms;
}

BaseEfforts::Rows BaseEfforts::rows_of(const Windows& windows) const {
  const std::vector<std::size_t> terms = this->terms();
  Rows rows;
  rows.residual = compared(windows, given_);
  rows.slopes.resize(rows.residual.size(), static_cast<Eigen::Index>(terms.size()));
  for (std::size_t k = 0; k < terms.size(); ++k)
    rows.slopes.col(static_cast<Eigen::Index>(k)) = slope(windows, terms[k], rows.residual);
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

/// From windows whose torques were recorded at every lag; too few of them leave it as it was.
void BaseEfforts::find_lag() {
  Windows windows = searched_;
  for (std::size_t m = 0; m < windows.size(); ++m)
    std::erase_if(windows[m], [&](const EffortWindow& window) {
      const std::vector<double>& time_s = data_[m].runs[window.run].time_s;
      return window.start_s - kLongestTorqueLag_s < time_s.front() ||
             window.end_s + kLongestTorqueLag_s > time_s.back();
    });
  if (count_of(windows) < kFewestEfforts) return;
  lag_ = torque_lag(
      [&](double lag_s) {
        Windows shifted = windows;
        for (std::size_t m = 0; m < shifted.size(); ++m)
          for (EffortWindow& window : shifted[m])
            window.torque_Nm = mean_torque(data_[m].runs[window.run], window.start_s, window.end_s, lag_s);
        const Rows rows = rows_of(shifted);
        return LeftByLag{
            .by_all = in_stretches(dense_fit_of(rows.slopes, rows.residual).left, count_of(shifted)),
            .by_given = in_stretches(rows.residual, count_of(shifted))};
      },
      kLongestTorqueLag_s);
}

/// Takes the rest speeds with which all parameters together leave least. Below its rest speed a resistance
/// goes with the speed, and a base that drives straight on turns slowly to and fro: with half the true rest
/// speed the resistance is 9 % too small, with twice of it 4 % too large, in every recording alike.
void BaseEfforts::find_rest_twist() {
  const std::vector<std::size_t> terms = this->terms();
  Rows rows = rows_of(planned(data_, window_s_));
  for (std::size_t k = 0; k < terms.size(); ++k) {
    const std::optional<Eigen::Index> axis = resisted_axis(all_.terms[terms[k]]);
    if (!axis || !std::isfinite(rest_.twist[*axis])) continue;
    const double assumed = rest_.twist[*axis];
    const auto left_at = [&](double doublings) {
      rest_.twist[*axis] = assumed * std::exp2(doublings);
      const Windows windows = planned(data_, window_s_);
      rows.residual = compared(windows, given_);
      rows.slopes.col(static_cast<Eigen::Index>(k)) = slope(windows, terms[k], rows.residual);
      return dense_fit_of(rows.slopes, rows.residual).left.squaredNorm();
    };
    left_at(least_near(0, {-kDoublings, kDoublings, kDoublings}, left_at));
  }
}

void BaseEfforts::see_noise() {
  const Eigen::Vector3d of_sensors = effort_floor(given_, data_, searched_, effort_noise(data_, rest_));
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
