#include "identification/robot_gap/base_subject.h"

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
/// Step of the derivative by the delay.
constexpr double kDelayChange_s = 0.01;
constexpr double kShortestWindow_s = 0.25;
constexpr double kLongestWindow_s = 5;
/// Lengths that are tried, each so many times the one before; the longest with this share of the best's
/// information is taken.
constexpr double kStride = 0.5;
constexpr double kLonger = 1.25;
constexpr double kAlmost = 0.7;
/// Periods of the poses in a window.
constexpr double kLeastPoses = 2;
/// Parts of a window from which its noise is estimated.
constexpr double kParts = 8;
constexpr double kFewestWindows = 60;
constexpr double kWantedBaseBlocks = 60;
constexpr int kFewestBaseBlocks = 8;
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
  longest_delay_s_ = kLongestDelay_s;
  has_linear_delay_ = true;
  for (const bool is_searched : {true, false})
    for (const BaseRecording& recording : is_searched ? data : held_out) {
      Side& own = is_searched ? data_ : held_;
      own.motions.push_back(cut(recording, given_, kLongestDelay_s));
      (is_searched ? searched_names_ : held_out_names_).push_back(recording.name);
      const std::vector<std::string>& notes = own.motions.back().notes;
      notes_.insert(notes_.end(), notes.begin(), notes.end());
    }
  delay_s_ = best_delay_s(given_, data_.motions, kLongestDelay_s);
  for (const char* const name : kChannelNames)
    channels_.push_back({name, name == kChannelNames[2] ? "rad" : "m"});
  see_speeds();
  choose_window(window_s);
  for (Side* const own : {&data_, &held_}) {
    plan_windows(*own);
    leave_out_outliers(*own);
  }
  plan_rows(data_, searched_);
  plan_rows(held_, held_out_);
  if (searched_.blocks() < kFewestBaseBlocks)
    throw std::invalid_argument(base_text(
        "the recordings are too short: %d stretches of %.2g s in motion, at least %d are needed; record more "
        "motion",
        searched_.blocks(), window_s_, kFewestBaseBlocks));
  if (held_out_.rows.empty())
    throw std::invalid_argument("the base does not move in the held-out recordings: hold out others");
  find_floor(data);
  list_terms(data);
}

void BaseSubject::see_speeds() {
  const double window_s = std::max(kShortestWindow_s, kLeastPoses * median_pose_period_s(data_.motions));
  std::vector<double> speeds;
  std::vector<double> turns;
  const BaseRolling rolling(given_);
  for (const BaseMotion& motion : data_.motions)
    for (const BaseWindow& window : windows_of(motion, window_s, window_s, std::abs(delay_s_))) {
      const double length_s = window.end_s - window.start_s;
      const WheelSteps wheels = wheel_steps(motion.runs[window.run], window.start_s, window.end_s, delay_s_);
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

/// The longest window that is almost as informative as the best. N windows of a length w see the share by
/// which a parameter is wrong with a variance of scatter²/(N·w²), and N is inverse to w: noise of the poses
/// is in each window once, so that long ones see more, up to where the way turns and what is wrong cancels.
/// Of those that see as much, in the longest most of the disagreement is not noise.
void BaseSubject::choose_window(double wanted_s) {
  const double pose_s = median_pose_period_s(data_.motions);
  const double least_s = std::max(kShortestWindow_s, kLeastPoses * pose_s);
  if (wanted_s > 0) {
    window_s_ = std::max(wanted_s, kLeastPoses * pose_s);
    if (window_s_ > wanted_s)
      notes_.push_back(base_text("windows are %.3g s long, not %.3g: poses are %.3g s apart", window_s_,
                                 wanted_s, pose_s));
    return;
  }
  const double most_s = std::min(kLongestWindow_s, moving_s_ / kFewestWindows);
  std::vector<double> information;
  std::vector<double> lengths_s;
  for (double length_s = least_s; length_s < std::max(most_s, 1.01 * least_s); length_s *= kLonger) {
    Side tried;
    tried.motions = data_.motions;
    window_s_ = length_s;
    plan_windows(tried);
    const BaseScatter scatter = scatter_in(tried);
    const Eigen::Vector3d in_m = scatter.rms.cwiseProduct(Eigen::Vector3d(1, 1, given_.turning_length_m));
    const auto windows = static_cast<double>(scatter.is_outlier.size());
    if (windows < kFewestWindows && !information.empty()) break;
    information.push_back(windows * length_s * length_s / std::max(1e-18, in_m.squaredNorm()));
    lengths_s.push_back(length_s);
  }
  const auto best = std::ranges::max_element(information);
  auto chosen = best;
  while (chosen + 1 != information.end() && *(chosen + 1) >= kAlmost * *best) ++chosen;
  window_s_ = lengths_s[static_cast<std::size_t>(chosen - information.begin())];
}

void BaseSubject::plan_windows(Side& side) {
  for (const BaseMotion& motion : side.motions) {
    side.windows.emplace_back();
    for (BaseWindow& window :
         windows_of(motion, window_s_, kStride * window_s_, std::abs(delay_s_) + kDelayChange_s)) {
      const BaseRun& run = motion.runs[window.run];
      PlannedWindow one;
      for (std::size_t d = 0; d < 3; ++d)
        one.wheels[d] = wheel_steps(run, window.start_s, window.end_s,
                                    delay_s_ + (static_cast<double>(d) - 1) * kDelayChange_s);
      if (rolled_m(given_, one.wheels[1]) < rest_m_per_s_ * (window.end_s - window.start_s)) continue;
      one.window = std::move(window);
      side.windows.back().push_back(std::move(one));
    }
  }
}

BaseScatter BaseSubject::scatter_in(const Side& side) const {
  std::size_t count = 0;
  for (const std::vector<PlannedWindow>& windows : side.windows) count += windows.size();
  Eigen::MatrixX3d measured(static_cast<Eigen::Index>(count), 3);
  Eigen::MatrixX3d by_wheels(measured.rows(), 3);
  const BaseRolling rolling(given_);
  Eigen::Index row = 0;
  for (std::size_t m = 0; m < side.windows.size(); ++m)
    for (const PlannedWindow& one : side.windows[m]) {
      measured.row(row) = one.window.measured;
      by_wheels.row(row++) = predicted(rolling, one.wheels[1], side.motions[m].floor);
    }
  return scatter_of(measured, by_wheels, given_.turning_length_m);
}

void BaseSubject::leave_out_outliers(Side& side) {
  const std::vector<bool> is_outlier = scatter_in(side).is_outlier;
  std::size_t next = 0;
  for (std::size_t m = 0; m < side.windows.size(); ++m) {
    const std::size_t before = side.windows[m].size();
    std::erase_if(side.windows[m], [&](const PlannedWindow&) { return is_outlier[next++]; });
    if (const std::size_t lost = before - side.windows[m].size(); lost > 0)
      notes_.push_back(
          base_text("%s: %zu of %zu windows of %.2g s are left out: the pose departs from the "
                    "wheels far more than in all others",
                    side.motions[m].name.c_str(), lost, before, window_s_));
  }
}

void BaseSubject::find_floor(std::span<const BaseRecording> recordings) {
  Eigen::Vector2d travel_m2 = Eigen::Vector2d::Zero();
  double count = 0;
  for (const std::vector<PlannedWindow>& windows : data_.windows)
    for (const PlannedWindow& one : windows) {
      travel_m2 += one.window.measured.head<2>().cwiseAbs2();
      ++count;
    }
  const double part_s = std::max(window_s_ / kParts, median_pose_period_s(data_.motions));
  const BaseNoise noise = noise_of(given_, recordings, data_.motions, part_s, delay_s_);
  // What adds up from part to part may as well cancel: no floor is above what no matrix explains.
  floor_ = floor_of(noise, window_s_, travel_m2 / count)
               .cwiseMin(scatter_in(data_).rms)
               .cwiseMax(kSmallestFloor);
}

void BaseSubject::plan_rows(const Side& side, RowPlan& plan) const {
  std::size_t all = 0;
  for (const std::vector<PlannedWindow>& windows : side.windows) all += windows.size();
  const auto size =
      static_cast<std::size_t>(std::max(1.0, std::round(static_cast<double>(all) / kWantedBaseBlocks)));
  for (std::size_t m = 0; m < side.windows.size(); ++m) {
    const std::vector<PlannedWindow>& windows = side.windows[m];
    for (std::size_t first = 0; first < windows.size();) {
      std::size_t of_run = first;
      while (of_run < windows.size() && windows[of_run].window.run == windows[first].window.run) ++of_run;
      // Equal blocks in each run.
      const std::size_t count = of_run - first;
      const std::size_t blocks = std::max<std::size_t>(1, (count + size / 2) / size);
      for (std::size_t b = 0; b < blocks; ++b) {
        for (std::size_t at = first + b * count / blocks; at < first + (b + 1) * count / blocks; ++at)
          for (Eigen::Index channel = 0; channel < 3; ++channel) {
            plan.rows.push_back({m, channel, at});
            plan.block.push_back(plan.blocks());
          }
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
  using Kind = Knob::Kind;
  constexpr double kFactor = 0.5;     // of a length or radius
  constexpr double kAngle_rad = 0.5;  // linear enough
  constexpr double kMostSlip = 0.9;
  constexpr double kSmall = 1e-4;
  const bool sideways =
      given_.kinematics == BaseKinematics::kOmni || given_.kinematics == BaseKinematics::kMecanum;
  const auto length = [](double value) { return gap::Bounds{-kFactor * value, value / kFactor}; };
  const auto slip = [](double value) { return gap::Bounds{std::min(0.0, -value), kMostSlip - value}; };

  double mean_m = 0;
  for (const BaseDescription::Wheel& wheel : given_.wheels)
    mean_m += wheel.radius_m / static_cast<double>(given_.wheels.size());
  add_term("radius_m", mean_m, length(mean_m), {Kind::kAllRadii, 0, kSmall * mean_m});
  add_candidate("wheel_radius", -1, "base", 1);
  add_term(turning_name(given_.kinematics), given_.turning_length_m, length(given_.turning_length_m),
           {Kind::kTurningLength, 0, kSmall * given_.turning_length_m});
  add_candidate("turning_geometry", -1, "base", 1);
  if (given_.wheels.size() > 1)
    for (std::size_t w = 0; w < given_.wheels.size(); ++w) {
      const double radius_m = given_.wheels[w].radius_m;
      add_term("radius_m", radius_m, length(radius_m), {Kind::kRadius, w, kSmall * radius_m});
      add_candidate("wheel_radius", static_cast<int>(w), given_.wheels[w].name, 1);
    }
  if (given_.kinematics == BaseKinematics::kTricycle) {
    add_term("steering_offset_rad", given_.steering_offset_rad, {-kAngle_rad, kAngle_rad},
             {Kind::kSteeringOffset, 0, kSmall});
    add_candidate("steering_offset", -1, "steering", 1);
  }
  const double scale = given_.tracking.scale;
  add_term("scale", scale, length(scale), {Kind::kTrackingScale, 0, kSmall * scale});
  add_candidate("tracking_scale", -1, "tracking", 1);
  add_term("yaw_rad", given_.tracking.yaw_BT_rad, {-kAngle_rad, kAngle_rad}, {Kind::kTrackingYaw, 0, kSmall});
  add_candidate("tracking_yaw", -1, "tracking", 1);
  const gap::Bounds anywhere{-10 * given_.turning_length_m, 10 * given_.turning_length_m};
  add_term("offset_x_m", given_.tracking.p_BT_m.x(), anywhere, {Kind::kTrackingX, 0, kSmall});
  add_term("offset_y_m", given_.tracking.p_BT_m.y(), anywhere, {Kind::kTrackingY, 0, kSmall});
  add_candidate("tracking_offset", -1, "tracking", 2);
  add_term("slip_forward", given_.slip_forward, slip(given_.slip_forward), {Kind::kSlipForward, 0, kSmall});
  add_candidate("slip_forward", -1, "base", 1);
  if (sideways) {
    add_term("slip_sideways", given_.slip_sideways, slip(given_.slip_sideways),
             {Kind::kSlipSideways, 0, kSmall});
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
    add_term("slip_with_load", given_.slip_with_load,
             {std::min(0.0, -given_.slip_with_load), kMostSlip / largest - given_.slip_with_load},
             {Kind::kSlipWithLoad, 0, kSmall / largest});
    add_candidate("slip_with_load", -1, "base", 1);
  } else {
    load_.clear();
  }

  for (std::size_t f = 0; f < given_.floors.size(); ++f) {
    const auto on = std::ranges::count(recordings, static_cast<int>(f), &BaseRecording::floor);
    if (on == 0 || on == static_cast<std::ptrdiff_t>(recordings.size())) continue;
    add_term("slip", given_.floors[f].slip, slip(given_.floors[f].slip), {Kind::kFloorSlip, f, kSmall});
    add_candidate("floor_slip", -1, given_.floors[f].name, 1);
  }
}

BaseDescription BaseSubject::changed(const Eigen::VectorXd& changes) const {
  using Kind = Knob::Kind;
  BaseDescription base = given_;
  for (std::size_t k = 0; k < knobs_.size(); ++k) {
    const double by = changes[static_cast<Eigen::Index>(k)];
    const std::size_t index = knobs_[k].index;
    switch (knobs_[k].kind) {
      case Kind::kAllRadii:
        for (BaseDescription::Wheel& wheel : base.wheels)
          wheel.radius_m *= 1 + by / catalogue_.terms[k].given;
        break;
      case Kind::kRadius: base.wheels[index].radius_m += by; break;
      case Kind::kTurningLength: base.turning_length_m += by; break;
      case Kind::kSteeringOffset: base.steering_offset_rad += by; break;
      case Kind::kTrackingScale: base.tracking.scale += by; break;
      case Kind::kTrackingX: base.tracking.p_BT_m.x() += by; break;
      case Kind::kTrackingY: base.tracking.p_BT_m.y() += by; break;
      case Kind::kTrackingYaw: base.tracking.yaw_BT_rad += by; break;
      case Kind::kSlipForward: base.slip_forward += by; break;
      case Kind::kSlipSideways: base.slip_sideways += by; break;
      case Kind::kSlipWithLoad: base.slip_with_load += by; break;
      case Kind::kFloorSlip: base.floors[index].slip += by; break;
    }
  }
  return base;
}

Eigen::VectorXd BaseSubject::predictions(Part part, const BaseDescription& base, std::size_t delay) const {
  const BaseRolling rolling(base);
  const RowPlan& rows = plan(part);
  const Side& own = side(part);
  Eigen::VectorXd result(static_cast<Eigen::Index>(rows.rows.size()));
  // The three channels of a window follow each other.
  for (std::size_t i = 0; i < rows.rows.size(); i += 3) {
    const RowPlan::Row& row = rows.rows[i];
    result.segment<3>(static_cast<Eigen::Index>(i)) =
        predicted(rolling, own.windows[row.motion][row.at].wheels[delay], own.motions[row.motion].floor);
  }
  return result;
}

ComparedRows BaseSubject::compare(Part part, const Fitted& at, std::span<const std::size_t> terms) const {
  const RowPlan& rows = plan(part);
  const auto count = static_cast<Eigen::Index>(rows.rows.size());
  ComparedRows result;
  result.measured.resize(count);
  for (std::size_t i = 0; i < rows.rows.size(); ++i)
    result.measured[static_cast<Eigen::Index>(i)] = window_of(part, i).measured[rows.rows[i].channel];
  const BaseDescription base = changed(at.changes);
  const auto delay = static_cast<Eigen::Index>(terms.size());
  result.columns.resize(count, delay + 1);
  gap::in_parallel(terms.size() + 2, [&](std::size_t k) {
    if (k == terms.size() + 1) {
      result.predicted = predictions(part, base, 1);
    } else if (k == terms.size()) {
      result.columns.col(delay) =
          (predictions(part, base, 2) - predictions(part, base, 0)) / (2 * kDelayChange_s);
    } else {
      const double step = knobs_[terms[k]].step;
      Eigen::VectorXd moved = at.changes;
      const auto own = static_cast<Eigen::Index>(terms[k]);
      moved[own] = at.changes[own] + step;
      const Eigen::VectorXd more = predictions(part, changed(moved), 1);
      moved[own] = at.changes[own] - step;
      result.columns.col(static_cast<Eigen::Index>(k)) =
          (more - predictions(part, changed(moved), 1)) / (2 * step);
    }
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
                          .window_s = window_s_,
                          .load = load_,
                          .noise_floor = floor_});
}

std::vector<BaseSubject::PathError> BaseSubject::path_errors(Part part, const Fitted& at) const {
  const BaseRolling rolling(changed(at.changes));
  std::vector<PathError> errors;
  for (const BaseMotion& motion : side(part).motions)
    for (const BaseRun& run : motion.runs) {
      const control::PlanarPose start = run.tracks.front().pose.front();
      const double start_s = run.tracks.front().time_s.front();
      PathError error{.recording = motion.name, .run = run.number};
      double squares = 0;
      double count = 0;
      control::PlanarPose moved;  // of the base, from its own start
      double moved_until_s = start_s;
      for (const BaseTrack& track : run.tracks)
        for (std::size_t i = 0; i < track.pose.size(); ++i) {
          if (track.time_s[i] > moved_until_s)
            moved = rolled_from(moved, rolling,
                                wheel_steps(run, moved_until_s, track.time_s[i], delay_s_ + at.delay_s),
                                motion.floor);
          moved_until_s = track.time_s[i];
          const PlanarVector by_wheels = rolling.tracked(moved);
          const PlanarVector in_W = control::rotated(by_wheels, start.yaw_rad);
          const Eigen::Vector2d off(start.x_m + in_W[0] - track.pose[i].x_m,
                                    start.y_m + in_W[1] - track.pose[i].y_m);
          squares += off.squaredNorm();
          ++count;
          error.end_m = off.norm();
          error.end_heading_rad =
              std::remainder(start.yaw_rad + by_wheels[2] - track.pose[i].yaw_rad, 2 * std::numbers::pi);
          if (i > 0)
            error.length_m += std::hypot(track.pose[i].x_m - track.pose[i - 1].x_m,
                                         track.pose[i].y_m - track.pose[i - 1].y_m);
        }
      error.rms_m = std::sqrt(squares / count);
      errors.push_back(std::move(error));
    }
  return errors;
}

}  // namespace identification::robot_gap
