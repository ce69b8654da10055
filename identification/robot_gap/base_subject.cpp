#include "identification/robot_gap/base_subject.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "control/base_rolling.h"
#include "identification/fit/statistics.h"
#include "identification/gap/parallel.h"
#include "identification/robot_gap/base_experiments.h"

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
/// Lengths that are tried, each so many times the one before; the longest is taken whose information is less
/// than the best's by no more than this logarithm.
constexpr double kStride = 0.5;
constexpr double kLonger = 1.25;
constexpr double kAlmost = 0.3;
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

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

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

const char* turning_name(BaseKinematics kinematics) {
  switch (kinematics) {
    case BaseKinematics::kDifferential: return "track_m";
    case BaseKinematics::kTricycle: return "wheelbase_m";
    case BaseKinematics::kOmni: return "radius_m";
    case BaseKinematics::kMecanum: return "turning_length_m";
  }
  return "";
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
  plan_rows(data_, searched_);
  plan_rows(held_, held_out_);
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
  rest_m_per_s_ = kRests * quantile(speeds, 0.95);
  std::erase_if(speeds, [&](double speed) { return speed <= rest_m_per_s_; });
  if (speeds.empty())
    throw std::invalid_argument(
        "no wheel turns in the recordings while the pose is seen: check the wheels' columns and factors");
  moving_s_ = static_cast<double>(speeds.size()) * window_s;
  speed_m_per_s_ = quantile(std::move(speeds), 0.5);
  turn_rad_per_s_ = quantile(std::move(turns), 0.95);
}

/// The longest window that is almost as informative as the best. Noise of the poses, and what comes and goes
/// when the base starts and stops, is in each window once, while what a wrong parameter does adds up: long
/// windows see more, up to where it cancels or the windows are too few. Of those that see as much, in the
/// longest most of the disagreement is not noise.
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
  for (double length_s = least_s; length_s < std::max(most_s, 1.01 * least_s); length_s *= kLonger) {
    const Windows windows = planned(data_.motions, length_s);
    double count = 0;
    for (const std::vector<PlannedWindow>& own : windows) count += static_cast<double>(own.size());
    if (kStride * count < kFewestWindows && !information.empty()) break;
    information.push_back(information_in(data_.motions, windows, what));
    lengths_s.push_back(length_s);
  }
  const auto best = std::ranges::max_element(information);
  auto chosen = best;
  while (chosen + 1 != information.end() && *(chosen + 1) >= *best - kAlmost) ++chosen;
  return lengths_s[static_cast<std::size_t>(chosen - information.begin())];
}

/// Mean over the parameters of the logarithm of how often each is determined, by itself, against what all of
/// them together leave.
double BaseSubject::information_in(const std::vector<BaseMotion>& motions, const Windows& windows,
                                   Compared what) const {
  const Eigen::Index first = what == kPlace ? 0 : 2;
  const Eigen::Index channels = what == kPlace ? 2 : 1;
  const auto own = [&](const Eigen::MatrixX3d& all) {
    return Eigen::VectorXd(all.middleCols(first, channels).reshaped());
  };
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(knobs_.size()));
  Eigen::MatrixX3d left = -displacements(motions, windows, given_, 1);
  const Eigen::Index count = left.rows();
  Eigen::Index row = 0;
  for (const std::vector<PlannedWindow>& of_motion : windows)
    for (const PlannedWindow& one : of_motion) left.row(row++) += one.window.measured;
  Eigen::MatrixXd slopes(channels * count, static_cast<Eigen::Index>(knobs_.size()) + 1);
  gap::in_parallel(knobs_.size(), [&](std::size_t k) {
    slopes.col(static_cast<Eigen::Index>(k)) = own(slope(motions, windows, none, k));
  });
  slopes.rightCols(1) =
      own(displacements(motions, windows, given_, 2) - displacements(motions, windows, given_, 0)) /
      (2 * kDelayChange_s);
  const Eigen::VectorXd residual = own(left);
  const Eigen::VectorXd by = slopes.completeOrthogonalDecomposition().solve(residual);
  const double free = std::max(1.0, static_cast<double>(residual.size() - slopes.cols()));
  const double variance =
      std::max(kSmallestFloor * kSmallestFloor, (residual - slopes * by).squaredNorm() / free);
  double sum = 0;
  double shown = 0;
  for (Eigen::Index k = 0; k + 1 < slopes.cols(); ++k) {
    const double squares = slopes.col(k).squaredNorm();
    if (!(squares > 0)) continue;
    sum += std::log(squares / variance);
    ++shown;
  }
  return shown > 0 ? sum / shown : 0;
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
  floor_.resize(3);
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
}

/// Blocks are stretches of time of one run.
void BaseSubject::plan_rows(const Side& side, RowPlan& plan) const {
  std::size_t all = 0;
  for (const std::vector<PlannedWindow>& windows : side.windows[kPlace]) all += windows.size();
  // Neighbours share windows: blocks are longer than those, as long as there are enough.
  const double longest = std::max(window_s_[kPlace], window_s_[kHeading]) / (kStride * window_s_[kPlace]);
  const auto size = static_cast<std::size_t>(std::max(
      {1.0, std::round(static_cast<double>(all) / kWantedBaseBlocks),
       std::min(std::round(2 * longest), std::floor(static_cast<double>(all) / kEnoughBaseBlocks))}));
  for (std::size_t m = 0; m < side.motions.size(); ++m) {
    const std::vector<PlannedWindow>& places = side.windows[kPlace][m];
    const std::vector<PlannedWindow>& headings = side.windows[kHeading][m];
    std::size_t heading = 0;
    for (std::size_t first = 0; first < places.size();) {
      const std::size_t run = places[first].window.run;
      std::size_t of_run = first;
      while (of_run < places.size() && places[of_run].window.run == run) ++of_run;
      // Equal blocks in each run.
      const std::size_t count = of_run - first;
      const std::size_t blocks = std::max<std::size_t>(1, (count + size / 2) / size);
      while (heading < headings.size() && headings[heading].window.run < run) ++heading;
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
        plan.block_motion.push_back(m);
      }
      first = of_run;
    }
  }
}

void BaseSubject::add_term(std::string name, double given, gap::Bounds change, Knob knob) {
  catalogue_.terms.push_back({.name = std::move(name), .given = given, .change = change, .is_linear = false});
  knobs_.push_back(knob);
}

void BaseSubject::add_candidate(std::string effect, int part, std::string part_name, std::size_t terms) {
  Candidate one{.effect = std::move(effect), .part = part, .part_name = std::move(part_name), .terms = {}};
  for (std::size_t k = terms; k > 0; --k) one.terms.push_back(catalogue_.terms.size() - k);
  catalogue_.candidates.push_back(std::move(one));
}

void BaseSubject::list_terms(std::span<const BaseRecording> recordings) {
  using KnobKind = Knob::Kind;
  constexpr double kFactor = 0.5;     // of a length or radius
  constexpr double kAngle_rad = 0.5;  // linear enough
  constexpr double kMostSlip = 0.9;
  constexpr double kSmall = 1e-4;
  const bool sideways =
      given_.kinematics == BaseKinematics::kOmni || given_.kinematics == BaseKinematics::kMecanum;
  const auto length = [](double value) { return gap::Bounds{-kFactor * value, value / kFactor - value}; };
  const auto slip = [](double value) {
    return gap::Bounds{std::min(0.0, -value), std::max(0.0, kMostSlip - value)};
  };

  double mean_m = 0;
  for (const BaseDescription::Wheel& wheel : given_.wheels)
    mean_m += wheel.radius_m / static_cast<double>(given_.wheels.size());
  add_term("radius_m", mean_m, length(mean_m), {KnobKind::kAllRadii, 0, kSmall * mean_m});
  add_candidate("wheel_radius", -1, "base", 1);
  add_term(turning_name(given_.kinematics), given_.turning_length_m, length(given_.turning_length_m),
           {KnobKind::kTurningLength, 0, kSmall * given_.turning_length_m});
  add_candidate("turning_geometry", -1, "base", 1);
  if (given_.wheels.size() > 1)
    for (std::size_t w = 0; w < given_.wheels.size(); ++w) {
      const double radius_m = given_.wheels[w].radius_m;
      add_term("radius_m", radius_m, length(radius_m), {KnobKind::kRadius, w, kSmall * radius_m});
      add_candidate("wheel_radius", static_cast<int>(w), given_.wheels[w].name, 1);
    }
  if (given_.kinematics == BaseKinematics::kTricycle) {
    add_term("steering_offset_rad", given_.steering_offset_rad, {-kAngle_rad, kAngle_rad},
             {KnobKind::kSteeringOffset, 0, kSmall});
    add_candidate("steering_offset", -1, "steering", 1);
  }
  const double scale = given_.tracking.scale;
  add_term("scale", scale, length(scale), {KnobKind::kTrackingScale, 0, kSmall * scale});
  add_candidate("tracking_scale", -1, "tracking", 1);
  add_term("yaw_rad", given_.tracking.yaw_BT_rad, {-kAngle_rad, kAngle_rad},
           {KnobKind::kTrackingYaw, 0, kSmall});
  add_candidate("tracking_yaw", -1, "tracking", 1);
  const gap::Bounds anywhere{-10 * given_.turning_length_m, 10 * given_.turning_length_m};
  add_term("offset_x_m", given_.tracking.p_BT_m.x(), anywhere, {KnobKind::kTrackingX, 0, kSmall});
  add_term("offset_y_m", given_.tracking.p_BT_m.y(), anywhere, {KnobKind::kTrackingY, 0, kSmall});
  add_candidate("tracking_offset", -1, "tracking", 2);
  add_term("slip_forward", given_.slip_forward, slip(given_.slip_forward),
           {KnobKind::kSlipForward, 0, kSmall});
  add_candidate("slip_forward", -1, "base", 1);
  if (sideways) {
    add_term("slip_sideways", given_.slip_sideways, slip(given_.slip_sideways),
             {KnobKind::kSlipSideways, 0, kSmall});
    add_candidate("slip_sideways", -1, "base", 1);
  }

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
  if (largest > 0) {
    add_term(
        "slip_with_load", given_.slip_with_load,
        {std::min(0.0, -given_.slip_with_load), std::max(0.0, kMostSlip / largest - given_.slip_with_load)},
        {KnobKind::kSlipWithLoad, 0, kSmall / largest});
    add_candidate("slip_with_load", -1, "base", 1);
  } else {
    load_.clear();
  }

  for (std::size_t f = 0; f < given_.floors.size(); ++f) {
    const auto on = std::ranges::count(recordings, static_cast<int>(f), &BaseRecording::floor);
    if (on == 0 || on == static_cast<std::ptrdiff_t>(recordings.size())) continue;
    add_term("slip", given_.floors[f].slip, slip(given_.floors[f].slip), {KnobKind::kFloorSlip, f, kSmall});
    add_candidate("floor_slip", -1, given_.floors[f].name, 1);
  }
}

BaseDescription BaseSubject::changed(const Eigen::VectorXd& changes) const {
  using KnobKind = Knob::Kind;
  BaseDescription base = given_;
  for (std::size_t k = 0; k < knobs_.size(); ++k) {
    const double by = changes[static_cast<Eigen::Index>(k)];
    const std::size_t index = knobs_[k].index;
    switch (knobs_[k].kind) {
      case KnobKind::kAllRadii:
        for (BaseDescription::Wheel& wheel : base.wheels)
          wheel.radius_m *= 1 + by / catalogue_.terms[k].given;
        break;
      case KnobKind::kRadius: base.wheels[index].radius_m += by; break;
      case KnobKind::kTurningLength: base.turning_length_m += by; break;
      case KnobKind::kSteeringOffset: base.steering_offset_rad += by; break;
      case KnobKind::kTrackingScale: base.tracking.scale += by; break;
      case KnobKind::kTrackingX: base.tracking.p_BT_m.x() += by; break;
      case KnobKind::kTrackingY: base.tracking.p_BT_m.y() += by; break;
      case KnobKind::kTrackingYaw: base.tracking.yaw_BT_rad += by; break;
      case KnobKind::kSlipForward: base.slip_forward += by; break;
      case KnobKind::kSlipSideways: base.slip_sideways += by; break;
      case KnobKind::kSlipWithLoad: base.slip_with_load += by; break;
      case KnobKind::kFloorSlip: base.floors[index].slip += by; break;
    }
  }
  return base;
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
  const double step = knobs_[term].step;
  Eigen::VectorXd moved = changes;
  moved[own] = changes[own] + step;
  const Eigen::MatrixX3d more = displacements(motions, windows, changed(moved), 1);
  moved[own] = changes[own] - step;
  return (more - displacements(motions, windows, changed(moved), 1)) / (2 * step);
}

template <class Of>
Eigen::VectorXd BaseSubject::in_rows(Part part, Of of) const {
  const Side& own = side(part);
  std::array<Eigen::MatrixX3d, 2> all;
  std::array<std::vector<std::size_t>, 2> first;  // of each motion
  for (const Compared what : {kPlace, kHeading}) {
    all[what] = of(own.windows[what]);
    std::size_t next = 0;
    for (const std::vector<PlannedWindow>& windows : own.windows[what]) {
      first[what].push_back(next);
      next += windows.size();
    }
  }
  const std::vector<RowPlan::Row>& rows = plan(part).rows;
  Eigen::VectorXd result(static_cast<Eigen::Index>(rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Compared what = compared_of(rows[i].channel);
    result[static_cast<Eigen::Index>(i)] =
        all[what](static_cast<Eigen::Index>(first[what][rows[i].motion] + rows[i].at), rows[i].channel);
  }
  return result;
}

ComparedRows BaseSubject::compare(Part part, const Fitted& at, std::span<const std::size_t> terms) const {
  const auto count = static_cast<Eigen::Index>(plan(part).rows.size());
  const std::vector<BaseMotion>& motions = side(part).motions;
  ComparedRows result;
  result.measured.resize(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto row = static_cast<std::size_t>(i);
    result.measured[i] = window_of(part, row).measured[plan(part).rows[row].channel];
  }
  const BaseDescription base = changed(at.changes);
  const auto delay = static_cast<Eigen::Index>(terms.size());
  result.columns.resize(count, delay + 1);
  gap::in_parallel(terms.size() + 2, [&](std::size_t k) {
    if (k == terms.size() + 1)
      result.predicted =
          in_rows(part, [&](const Windows& windows) { return displacements(motions, windows, base, 1); });
    else if (k == terms.size())
      result.columns.col(delay) = in_rows(part, [&](const Windows& windows) {
        return Eigen::MatrixX3d(
            (displacements(motions, windows, base, 2) - displacements(motions, windows, base, 0)) /
            (2 * kDelayChange_s));
      });
    else
      result.columns.col(static_cast<Eigen::Index>(k)) = in_rows(
          part, [&](const Windows& windows) { return slope(motions, windows, at.changes, terms[k]); });
  });
  result.predicted += at.delay_s * result.columns.col(delay);
  return result;
}

std::vector<Coordinate> BaseSubject::coordinates(Part part, std::size_t row) const {
  constexpr std::size_t kRangesOfBase = 6;
  constexpr std::size_t kDirectionsOfTravel = 8;
  const BaseWindow& window = window_of(part, row);
  const double length_s = window.end_s - window.start_s;
  const PlanarVector& moved = window.measured;
  return {{"speed", "m/s", -1, moved.head<2>().norm() / length_s, kRangesOfBase},
          {"turn rate", "rad/s", -1, moved[2] / length_s, kRangesOfBase},
          {"direction of travel", "rad", -1, std::atan2(moved[1], moved[0]), kDirectionsOfTravel},
          {"x", "m", -1, window.start.x_m, kRangesOfBase},
          {"y", "m", -1, window.start.y_m, kRangesOfBase}};
}

double BaseSubject::time_s(Part part, std::size_t row) const { return window_of(part, row).start_s; }

std::string BaseSubject::deciding_experiment(const Eigen::VectorXd& one, const Eigen::VectorXd& other,
                                             std::uint64_t /*seed*/) const {
  return deciding_motion(changed(one), changed(other),
                         {.given = given_,
                          .speed_m_per_s = speed_m_per_s_,
                          .turn_rad_per_s = turn_rad_per_s_,
                          .window_s = window_s_[kPlace],
                          .load = load_,
                          .noise_floor = floor_});
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
