#include "identification/robot_gap/base_subject.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "control/base_rolling.h"
#include "identification/fit/quantile.h"
#include "identification/fit/statistics.h"
#include "identification/gap/parallel.h"
#include "identification/robot_gap/base_experiments.h"
#include "identification/robot_gap/base_information.h"

namespace identification::robot_gap {
namespace {

using control::BaseDescription;
using control::BaseKinematics;
using control::BaseRolling;
using control::PlanarVector;

constexpr double kLongestDelay_s = 0.3;
/// Of what the steps of align() leave, and of the slope that stands for it.
constexpr double kDelayLeft_s = 0.03;
/// Step of the derivative by the delay.
constexpr double kDelayChange_s = 0.01;
constexpr double kShortestWindow_s = 0.25;
constexpr double kLongestWindow_s = 30;
constexpr double kStride = 0.5;
/// Periods of the poses in a window.
constexpr double kLeastPoses = 2;
/// Parts of a window from which its noise is estimated.
constexpr double kParts = 8;
/// That do not overlap.
constexpr double kFewestWindows = 30;
constexpr double kWantedBaseBlocks = 60;
constexpr int kFewestBaseBlocks = 8;
constexpr double kEnoughBaseBlocks = 24;
/// Below this share of its top speed a base stands still.
constexpr double kRests = 0.05;
constexpr std::array<const char*, 3> kChannelNames{"forward", "sideways", "heading"};
constexpr double kSmallestFloor = 1e-9;

double median_pose_period_s(std::span<const BaseMotion> motions) {
  std::vector<double> steps;
  for (const BaseMotion& motion : motions)
    for (const BaseRun& run : motion.runs)
      for (const BaseTrack& track : run.tracks)
        for (std::size_t i = 1; i < track.time_s.size(); ++i)
          steps.push_back(track.time_s[i] - track.time_s[i - 1]);
  return steps.empty() ? 0 : fit::median(std::move(steps));
}

template <class... Values>
std::string base_text(const char* format, Values... values) {
  char text[400];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

}  // namespace

BaseSubject::BaseSubject(const BaseDescription& given, std::vector<BaseRecording> data,
                         std::vector<BaseRecording> held_out, double window_s)
    : given_(given) {
  if (data.empty()) throw std::invalid_argument("there is no recording to search");
  if (held_out.empty())
    for (BaseRecording& whole : data) held_out.push_back(set_aside(whole));
  longest_delay_s_ = kDelayLeft_s;
  has_linear_delay_ = true;
  for (const bool is_searched : {true, false})
    for (const BaseRecording& recording : is_searched ? data : held_out) {
      Side& own = is_searched ? data_ : held_;
      own.motions.push_back(cut(recording, given_, kLongestDelay_s));
      (is_searched ? searched_names_ : held_out_names_).push_back(recording.name);
      const std::vector<std::string>& notes = own.motions.back().notes;
      notes_.insert(notes_.end(), notes.begin(), notes.end());
    }
  delay_s_ = align(given_, data_.motions, kLongestDelay_s);
  align(given_, held_.motions, kLongestDelay_s);
  for (const char* const name : kChannelNames)
    channels_.push_back({name, name == kChannelNames[2] ? "rad" : "m"});
  see_speeds();
  list_terms(data);
  for (const Compared what : {kPlace, kHeading}) {
    window_s_[what] = chosen_window_s(what, window_s);
    for (Side* const own : {&data_, &held_}) {
      own->windows[what] = planned(own->motions, window_s_[what]);
      leave_out_outliers(*own, what);
    }
  }
  compare_efforts(data, held_out);
  plan_rows(Part::kSearched, searched_);
  plan_rows(Part::kHeldOut, held_out_);
  if (searched_.blocks() < kFewestBaseBlocks)
    throw std::invalid_argument(base_text(
        "the recordings are too short: %d stretches of %.2g s in motion, at least %d are needed; record more "
        "motion",
        searched_.blocks(), window_s_[kPlace], kFewestBaseBlocks));
  if (held_out_.rows.empty())
    throw std::invalid_argument(
        base_text("no held-out recording shows the base in motion for a window of %.2g s: "
                  "hold out longer ones, or others",
                  window_s_[kPlace]));
  find_floor(data);
}

void BaseSubject::see_speeds() {
  const double window_s = std::max(kShortestWindow_s, kLeastPoses * median_pose_period_s(data_.motions));
  std::vector<double> speeds;
  std::vector<double> turns;
  const BaseRolling rolling(given_);
  for (const BaseMotion& motion : data_.motions)
    for (const BaseWindow& window : windows_of(motion, window_s, window_s, 0)) {
      const double length_s = window.end_s - window.start_s;
      const WheelSteps wheels = wheel_steps(motion.runs[window.run], window.start_s, window.end_s, 0);
      speeds.push_back(rolled_m(given_, wheels) / length_s);
      turns.push_back(std::abs(predicted(rolling, wheels, motion.floor)[2]) / length_s);
    }
  rest_m_per_s_ = kRests * fit::quantile(speeds, 0.95);
  std::erase_if(speeds, [&](double speed) { return speed <= rest_m_per_s_; });
  if (speeds.empty())
    throw std::invalid_argument(
        "no wheel turns in the recordings while the pose is seen: check the wheels' columns and factors");
  moving_s_ = static_cast<double>(speeds.size()) * window_s;
  speed_m_per_s_ = fit::quantile(std::move(speeds), 0.5);
  turn_rad_per_s_ = fit::quantile(std::move(turns), 0.95);
}

/// What comes and goes when the base starts and stops is in each window once, as is noise of the poses.
double BaseSubject::chosen_window_s(Compared what, double wanted_s) {
  const double pose_s = median_pose_period_s(data_.motions);
  const double least_s = std::max(kShortestWindow_s, kLeastPoses * pose_s);
  if (wanted_s > 0) {
    const double window_s = std::max(wanted_s, kLeastPoses * pose_s);
    if (window_s > wanted_s && what == kPlace)
      notes_.push_back(
          base_text("windows are %.3g s long, not %.3g: poses are %.3g s apart", window_s, wanted_s, pose_s));
    return window_s;
  }
  const double most_s = std::min(kLongestWindow_s, moving_s_ / kFewestWindows);
  std::vector<double> information;
  std::vector<double> lengths_s;
  for (double length_s = least_s; length_s < std::max(most_s, 1.01 * least_s); length_s *= kLongerWindow) {
    const Windows windows = planned(data_.motions, length_s);
    double count = 0;
    for (const std::vector<PlannedWindow>& own : windows) count += static_cast<double>(own.size());
    if (kStride * count < kFewestWindows && !information.empty()) break;
    information.push_back(information_in(data_.motions, windows, what));
    lengths_s.push_back(length_s);
  }
  return longest_informative_s(information, lengths_s);
}

double BaseSubject::information_in(const std::vector<BaseMotion>& motions, const Windows& windows,
                                   Compared what) const {
  const Eigen::Index first = what == kPlace ? 0 : 2;
  const Eigen::Index channels = what == kPlace ? 2 : 1;
  const auto own = [&](const Eigen::MatrixX3d& all) {
    return Eigen::VectorXd(all.middleCols(first, channels).reshaped());
  };
  const auto terms = static_cast<Eigen::Index>(
      std::ranges::count(terms_.terms, false, &BaseTerm::of_forces));  // those of forces come last
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(terms_.terms.size()));
  Eigen::MatrixX3d left = -displacements(motions, windows, given_, 1);
  const Eigen::Index count = left.rows();
  Eigen::Index row = 0;
  for (const std::vector<PlannedWindow>& of_motion : windows)
    for (const PlannedWindow& one : of_motion) left.row(row++) += one.window.measured;
  Eigen::MatrixXd slopes(channels * count, terms + 1);
  gap::in_parallel(static_cast<std::size_t>(terms), [&](std::size_t k) {
    slopes.col(static_cast<Eigen::Index>(k)) = own(slope(motions, windows, none, k));
  });
  slopes.rightCols(1) =
      own(displacements(motions, windows, given_, 2) - displacements(motions, windows, given_, 0)) /
      (2 * kDelayChange_s);
  return information_of(slopes, own(left), terms);
}

BaseSubject::Windows BaseSubject::planned(const std::vector<BaseMotion>& motions, double window_s) const {
  Windows windows;
  for (const BaseMotion& motion : motions) {
    windows.emplace_back();
    for (BaseWindow& window : windows_of(motion, window_s, kStride * window_s, kDelayChange_s)) {
      const BaseRun& run = motion.runs[window.run];
      PlannedWindow one;
      for (std::size_t d = 0; d < 3; ++d)
        one.wheels[d] =
            wheel_steps(run, window.start_s, window.end_s, (static_cast<double>(d) - 1) * kDelayChange_s);
      if (rolled_m(given_, one.wheels[1]) < rest_m_per_s_ * (window.end_s - window.start_s)) continue;
      one.window = std::move(window);
      windows.back().push_back(std::move(one));
    }
  }
  return windows;
}

BaseScatter BaseSubject::scatter_in(const std::vector<BaseMotion>& motions, const Windows& windows) const {
  const Eigen::MatrixX3d by_wheels = displacements(motions, windows, given_, 1);
  Eigen::MatrixX3d measured(by_wheels.rows(), 3);
  Eigen::Index row = 0;
  for (const std::vector<PlannedWindow>& of_motion : windows)
    for (const PlannedWindow& one : of_motion) measured.row(row++) = one.window.measured;
  return scatter_of(measured, by_wheels, given_.turning_length_m);
}

void BaseSubject::leave_out_outliers(Side& side, Compared what) {
  Windows& windows = side.windows[what];
  const std::vector<bool> is_outlier = scatter_in(side.motions, windows).is_outlier;
  std::size_t next = 0;
  for (std::size_t m = 0; m < windows.size(); ++m) {
    const std::size_t before = windows[m].size();
    std::erase_if(windows[m], [&](const PlannedWindow&) { return is_outlier[next++]; });
    const std::size_t lost = before - windows[m].size();
    if (lost == 0) continue;
    std::string note = base_text(
        "%s: %zu of %zu windows of %.2g s are left out: the pose departs from the "
        "wheels far more than in all others",
        side.motions[m].name.c_str(), lost, before, window_s_[what]);
    // Places and headings may have the same windows.
    if (std::ranges::find(notes_, note) == notes_.end()) notes_.push_back(std::move(note));
  }
}

void BaseSubject::find_floor(std::span<const BaseRecording> recordings) {
  floor_.resize(static_cast<Eigen::Index>(channels_.size()));
  for (const Compared what : {kPlace, kHeading}) {
    Eigen::Vector2d travel_m2 = Eigen::Vector2d::Zero();
    double count = 0;
    for (const std::vector<PlannedWindow>& windows : data_.windows[what])
      for (const PlannedWindow& one : windows) {
        travel_m2 += one.window.measured.head<2>().cwiseAbs2();
        ++count;
      }
    const double part_s = std::max(window_s_[what] / kParts, median_pose_period_s(data_.motions));
    const BaseNoise noise = noise_of(given_, recordings, data_.motions, part_s);
    // What adds up from part to part may as well cancel: no floor is above what no matrix explains.
    const Eigen::Vector3d floor = floor_of(noise, window_s_[what], travel_m2 / std::max(1.0, count))
                                      .cwiseMin(scatter_in(data_.motions, data_.windows[what]).rms)
                                      .cwiseMax(kSmallestFloor);
    for (Eigen::Index channel = 0; channel < 3; ++channel)
      if (compared_of(channel) == what) floor_[channel] = floor[channel];
  }
  for (std::size_t i = 0; i < axes_.size(); ++i)
    floor_[static_cast<Eigen::Index>(3 + i)] = efforts_->floor()[axes_[i]];
}

void BaseSubject::compare_efforts(std::span<const BaseRecording> data,
                                  std::span<const BaseRecording> held_out) {
  const auto has_torque = [](const BaseRecording& one) { return one.torque_Nm.size() > 0; };
  if (given_.body.mass_kg == 0 || !std::ranges::all_of(data, has_torque) ||
      !std::ranges::all_of(held_out, has_torque))
    return;
  BaseCatalogue with_forces = base_catalogue(given_, data, true);
  std::swap(terms_, with_forces);
  efforts_.emplace(given_, terms_, data_.motions, held_.motions);
  const std::vector<std::string> notes = efforts_->notes();
  notes_.insert(notes_.end(), notes.begin(), notes.end());
  if (!efforts_->is_enough()) {
    efforts_.reset();
    std::swap(terms_, with_forces);
    return;
  }
  catalogue_ = terms_.catalogue;
  axes_ = effort_axes(given_.kinematics);
  for (Channel& channel : effort_channels(given_.kinematics)) channels_.push_back(std::move(channel));
}

/// Blocks are stretches of time of one run.
void BaseSubject::plan_rows(Part part, RowPlan& plan) const {
  const Side& own = side(part);
  std::size_t all = 0;
  for (const std::vector<PlannedWindow>& windows : own.windows[kPlace]) all += windows.size();
  // Neighbours share windows: blocks are longer than those, as long as there are enough.
  const double longest =
      std::max({window_s_[kPlace], window_s_[kHeading], efforts_ ? efforts_->window_s() : 0}) /
      (kStride * window_s_[kPlace]);
  const auto size = static_cast<std::size_t>(std::max(
      {1.0, std::round(static_cast<double>(all) / kWantedBaseBlocks),
       std::min(std::round(2 * longest), std::floor(static_cast<double>(all) / kEnoughBaseBlocks))}));
  for (std::size_t m = 0; m < own.motions.size(); ++m) {
    const std::vector<PlannedWindow>& places = own.windows[kPlace][m];
    const std::vector<PlannedWindow>& headings = own.windows[kHeading][m];
    static const std::vector<EffortWindow> kNone;
    const std::vector<EffortWindow>& efforts = efforts_ ? efforts_->windows(part)[m] : kNone;
    std::size_t heading = 0;
    std::size_t effort = 0;
    for (std::size_t first = 0; first < places.size();) {
      const std::size_t run = places[first].window.run;
      std::size_t of_run = first;
      while (of_run < places.size() && places[of_run].window.run == run) ++of_run;
      // Equal blocks in each run.
      const std::size_t count = of_run - first;
      const std::size_t blocks = std::max<std::size_t>(1, (count + size / 2) / size);
      while (heading < headings.size() && headings[heading].window.run < run) ++heading;
      while (effort < efforts.size() && efforts[effort].run < run) ++effort;
      for (std::size_t b = 0; b < blocks; ++b) {
        const std::size_t end = first + (b + 1) * count / blocks;
        const auto add = [&](Eigen::Index channel, std::size_t at) {
          plan.rows.push_back({m, channel, at});
          plan.block.push_back(plan.blocks());
        };
        for (std::size_t at = first + b * count / blocks; at < end; ++at)
          for (const Eigen::Index channel : {0, 1}) add(channel, at);
        const bool is_last = b + 1 == blocks;
        for (; heading < headings.size() && headings[heading].window.run == run &&
               (is_last || headings[heading].window.start_s < places[end].window.start_s);
             ++heading)
          add(2, heading);
        for (; effort < efforts.size() && efforts[effort].run == run &&
               (is_last || efforts[effort].start_s < places[end].window.start_s);
             ++effort)
          for (std::size_t i = 0; i < axes_.size(); ++i) add(static_cast<Eigen::Index>(3 + i), effort);
        plan.block_motion.push_back(m);
      }
      first = of_run;
    }
  }
}

void BaseSubject::list_terms(std::span<const BaseRecording> recordings) {
  terms_ = base_catalogue(given_, recordings, false);
  catalogue_ = terms_.catalogue;
  load_.assign(given_.wheels.size(), 0);
  double loaded = 0;
  double largest = 0;
  for (const BaseRecording& recording : recordings) {
    if (recording.load.size() == 0) continue;
    ++loaded;
    largest = std::max(largest, recording.load.cwiseAbs().maxCoeff());
    for (std::size_t w = 0; w < load_.size(); ++w)
      load_[w] += recording.load.row(static_cast<Eigen::Index>(w)).mean();
  }
  for (double& one : load_) one /= std::max(1.0, loaded);
  if (!(largest > 0)) load_.clear();
}

BaseDescription BaseSubject::changed(const Eigen::VectorXd& changes) const {
  return robot_gap::changed(given_, terms_, changes);
}

Eigen::MatrixX3d BaseSubject::displacements(const std::vector<BaseMotion>& motions, const Windows& windows,
                                            const BaseDescription& base, std::size_t delay) const {
  const BaseRolling rolling(base);
  std::size_t count = 0;
  for (const std::vector<PlannedWindow>& of_motion : windows) count += of_motion.size();
  Eigen::MatrixX3d result(static_cast<Eigen::Index>(count), 3);
  Eigen::Index row = 0;
  for (std::size_t m = 0; m < windows.size(); ++m)
    for (const PlannedWindow& one : windows[m])
      result.row(row++) = predicted(rolling, one.wheels[delay], motions[m].floor);
  return result;
}

Eigen::MatrixX3d BaseSubject::slope(const std::vector<BaseMotion>& motions, const Windows& windows,
                                    const Eigen::VectorXd& changes, std::size_t term) const {
  const auto own = static_cast<Eigen::Index>(term);
  const double step = terms_.terms[term].step;
  Eigen::VectorXd moved = changes;
  moved[own] = changes[own] + step;
  const Eigen::MatrixX3d more = displacements(motions, windows, changed(moved), 1);
  moved[own] = changes[own] - step;
  return (more - displacements(motions, windows, changed(moved), 1)) / (2 * step);
}

template <class Of, class OfEfforts>
Eigen::VectorXd BaseSubject::in_rows(Part part, Of of, OfEfforts of_efforts) const {
  const Side& own = side(part);
  std::array<Eigen::MatrixX3d, 3> all;
  std::array<std::vector<std::size_t>, 3> first;  // of each motion
  const auto count = [&](Compared what, const auto& of_motions) {
    std::size_t next = 0;
    for (const auto& windows : of_motions) {
      first[what].push_back(next);
      next += windows.size();
    }
  };
  for (const Compared what : {kPlace, kHeading}) {
    all[what] = of(own.windows[what]);
    count(what, own.windows[what]);
  }
  if (efforts_) {
    all[kEffort] = of_efforts();
    count(kEffort, efforts_->windows(part));
  }
  const std::vector<RowPlan::Row>& rows = plan(part).rows;
  Eigen::VectorXd result(static_cast<Eigen::Index>(rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Compared what = compared_of(rows[i].channel);
    const Eigen::Index column =
        what == kEffort ? axes_[static_cast<std::size_t>(rows[i].channel - 3)] : rows[i].channel;
    result[static_cast<Eigen::Index>(i)] =
        all[what](static_cast<Eigen::Index>(first[what][rows[i].motion] + rows[i].at), column);
  }
  return result;
}

ComparedRows BaseSubject::compare(Part part, const Fitted& at, std::span<const std::size_t> terms) const {
  const std::vector<BaseMotion>& motions = side(part).motions;
  const auto measured_in = [](const Windows& windows) {
    std::vector<PlanarVector> all;
    for (const std::vector<PlannedWindow>& own : windows)
      for (const PlannedWindow& one : own) all.push_back(one.window.measured);
    Eigen::MatrixX3d result(static_cast<Eigen::Index>(all.size()), 3);
    for (std::size_t i = 0; i < all.size(); ++i) result.row(static_cast<Eigen::Index>(i)) = all[i];
    return result;
  };
  const auto no_efforts = [&] {
    std::size_t count = 0;
    for (const std::vector<EffortWindow>& own : efforts_->windows(part)) count += own.size();
    return Eigen::MatrixX3d::Zero(static_cast<Eigen::Index>(count), 3).eval();
  };
  const auto no_motion = [](const Windows& windows) {
    std::size_t count = 0;
    for (const std::vector<PlannedWindow>& own : windows) count += own.size();
    return Eigen::MatrixX3d::Zero(static_cast<Eigen::Index>(count), 3).eval();
  };
  const BaseDescription base = changed(at.changes);
  ComparedRows result;
  const auto delay = static_cast<Eigen::Index>(terms.size());
  result.columns.resize(static_cast<Eigen::Index>(plan(part).rows.size()), delay + 1);
  gap::in_parallel(terms.size() + 3, [&](std::size_t k) {
    if (k == terms.size() + 2) {
      result.measured = in_rows(part, measured_in, [&] { return efforts_->pushed(part); });
    } else if (k == terms.size() + 1) {
      result.predicted = in_rows(
          part, [&](const Windows& windows) { return displacements(motions, windows, base, 1); },
          [&] { return Eigen::MatrixX3d(efforts_->pushed(part) - efforts_->excess(part, base)); });
    } else if (k == terms.size()) {
      result.columns.col(delay) = in_rows(
          part,
          [&](const Windows& windows) {
            return Eigen::MatrixX3d(
                (displacements(motions, windows, base, 2) - displacements(motions, windows, base, 0)) /
                (2 * kDelayChange_s));
          },
          no_efforts);
    } else {
      const auto effort_slope = [&] {
        const double step = terms_.terms[terms[k]].step;
        const auto excess = [&](double by) {
          Eigen::VectorXd moved = at.changes;
          moved[static_cast<Eigen::Index>(terms[k])] += by;
          return efforts_->excess(part, changed(moved));
        };
        return terms_.terms[terms[k]].is_positive()
                   ? Eigen::MatrixX3d((excess(0) - excess(step)) / step)
                   : Eigen::MatrixX3d((excess(-step) - excess(step)) / (2 * step));
      };
      const auto column = static_cast<Eigen::Index>(k);
      result.columns.col(column) =
          terms_.terms[terms[k]].of_forces()
              ? in_rows(part, no_motion, effort_slope)
              : in_rows(
                    part,
                    [&](const Windows& windows) { return slope(motions, windows, at.changes, terms[k]); },
                    effort_slope);
    }
  });
  result.predicted += at.delay_s * result.columns.col(delay);
  return result;
}

std::vector<Coordinate> BaseSubject::coordinates(Part part, std::size_t row) const {
  constexpr std::size_t kRangesOfBase = 6;
  constexpr std::size_t kDirectionsOfTravel = 8;
  PlanarVector speed;
  control::PlanarPose pose;
  if (const EffortWindow* const effort = effort_of(part, row)) {
    speed = effort->twist;
    pose = effort->pose;
  } else {
    const BaseWindow& window = window_of(part, row);
    speed = window.measured / (window.end_s - window.start_s);
    pose = window.start;
  }
  return {{"speed", "m/s", -1, speed.head<2>().norm(), kRangesOfBase},
          {"turn rate", "rad/s", -1, speed[2], kRangesOfBase},
          {"direction of travel", "rad", -1, std::atan2(speed[1], speed[0]), kDirectionsOfTravel},
          {"x", "m", -1, pose.x_m, kRangesOfBase},
          {"y", "m", -1, pose.y_m, kRangesOfBase}};
}

double BaseSubject::time_s(Part part, std::size_t row) const {
  const EffortWindow* const effort = effort_of(part, row);
  return effort != nullptr ? effort->start_s : window_of(part, row).start_s;
}

std::string BaseSubject::deciding_experiment(const Eigen::VectorXd& one, const Eigen::VectorXd& other,
                                             std::uint64_t /*seed*/) const {
  const SeenMotion seen{.given = given_,
                        .speed_m_per_s = speed_m_per_s_,
                        .turn_rad_per_s = turn_rad_per_s_,
                        .window_s = window_s_[kPlace],
                        .load = load_,
                        .noise_floor = floor_.head<3>()};
  std::string motion = deciding_motion(changed(one), changed(other), seen);
  return efforts_ && motion.starts_with("none: ")
             ? deciding_force(changed(one), changed(other), seen, efforts_->floor())
             : motion;
}

double BaseSubject::accumulated(Part part, const Fitted& at) const {
  double sum_m2 = 0;
  for (const PathError& error : path_errors(part, at)) sum_m2 += error.rms_m * error.rms_m;
  return sum_m2;
}

std::vector<BaseSubject::PathError> BaseSubject::path_errors(Part part, const Fitted& at) const {
  const BaseRolling rolling(changed(at.changes));
  std::vector<PathError> errors;
  for (const BaseMotion& motion : side(part).motions)
    for (const BaseRun& run : motion.runs)
      for (const BaseTrack& track : run.tracks) {
        const control::PlanarPose start = track.pose.front();
        PathError error{.recording = motion.name, .run = run.number};
        double squares = 0;
        control::PlanarPose moved;  // of the base, from its own start
        for (std::size_t i = 0; i < track.pose.size(); ++i) {
          if (i > 0)
            moved =
                rolled_from(moved, rolling,
                            wheel_steps(run, track.time_s[i - 1], track.time_s[i], at.delay_s), motion.floor);
          const PlanarVector by_wheels = rolling.tracked(moved);
          const PlanarVector in_W = control::rotated(by_wheels, start.yaw_rad);
          const Eigen::Vector2d off(start.x_m + in_W[0] - track.pose[i].x_m,
                                    start.y_m + in_W[1] - track.pose[i].y_m);
          squares += off.squaredNorm();
          error.end_m = off.norm();
          error.end_heading_rad =
              std::remainder(start.yaw_rad + by_wheels[2] - track.pose[i].yaw_rad, 2 * std::numbers::pi);
          if (i > 0)
            error.length_m += std::hypot(track.pose[i].x_m - track.pose[i - 1].x_m,
                                         track.pose[i].y_m - track.pose[i - 1].y_m);
        }
        error.rms_m = std::sqrt(squares / static_cast<double>(track.pose.size()));
        errors.push_back(std::move(error));
      }
  return errors;
}

}  // namespace identification::robot_gap
