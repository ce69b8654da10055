#include "identification/robot_gap/base_motion.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <numbers>
#include <stdexcept>

#include "identification/fit/quantile.h"
#include "identification/fit/statistics.h"
#include "identification/gap/parallel.h"

namespace identification::robot_gap {
namespace {

using control::BaseDescription;
using control::BaseRolling;
using control::PlanarPose;
using control::PlanarVector;

/// Longer steps than so many median ones are a pause.
constexpr double kBridgedPeriods = 5;
/// A pose jumps if it moves farther than the wheels roll times this, and this share of their top speed, and
/// so many standard deviations of the difference: a given model may be wrong by a factor.
constexpr double kWrongFactor = 2.5;
constexpr double kOfTopSpeed = 0.5;
/// Quantile of the speeds that is their top.
constexpr double kTopSpeed = 0.99;
constexpr double kDeviations = 10;
/// Where more of the steps jump, columns or factors are wrong.
constexpr double kMostJumps = 0.1;
constexpr std::size_t kSeparateRuns = 8;
constexpr double kSearchedShare = 0.75;
/// Constant twist within a step of a window costs nothing visible with so many.
constexpr double kStepsOfWindow = 32;
/// Windows from which the delay is estimated, in median periods and at least [s].
constexpr double kDelayPeriods = 4;
constexpr double kDelayWindow_s = 0.4;
constexpr double kDelayStep_s = 0.01;
/// Another delay must leave less of the squared residual than this share of what none leaves.
constexpr double kDelayStandsOut = 0.95;
/// The same of one run, compared with what the delay of all leaves: steady motions show none.
constexpr double kRunStandsOut = 0.6;

double median_period_s(const std::vector<double>& time_s) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < time_s.size(); ++i) steps.push_back(time_s[i] - time_s[i - 1]);
  return steps.empty() ? 0 : fit::median(std::move(steps));
}

/// Position of a body seen from another pose; yaw is the difference.
PlanarVector seen_from(const PlanarPose& from, const PlanarPose& to) {
  return control::rotated({to.x_m - from.x_m, to.y_m - from.y_m, to.yaw_rad - from.yaw_rad}, -from.yaw_rad);
}

/// Accumulated wheel angles and loads of rows [first, last).
BaseRun run_of(const BaseRecording& recording, std::size_t first, std::size_t last) {
  BaseRun run;
  run.number = recording.run.empty() ? 0 : recording.run[first];
  const auto from = static_cast<Eigen::Index>(first);
  const auto rows = static_cast<Eigen::Index>(last - first);
  run.time_s.assign(recording.time_s.begin() + from, recording.time_s.begin() + from + rows);
  if (!recording.steering_rad.empty())
    run.steering_rad.assign(recording.steering_rad.begin() + from,
                            recording.steering_rad.begin() + from + rows);
  const Eigen::Index wheels = recording.wheel.rows();
  run.angle_rad = recording.wheel.middleCols(from, rows);
  for (Eigen::Index w = 0; w < wheels; ++w) {
    if (!recording.is_speed[static_cast<std::size_t>(w)]) continue;
    run.angle_rad(w, 0) = 0;
    for (Eigen::Index i = 1; i < rows; ++i) {
      const auto at = static_cast<std::size_t>(i);
      const double mean = 0.5 * (recording.wheel(w, from + i) + recording.wheel(w, from + i - 1));
      run.angle_rad(w, i) = run.angle_rad(w, i - 1) + mean * (run.time_s[at] - run.time_s[at - 1]);
    }
  }
  run.is_speed = std::ranges::count(recording.is_speed, true) == wheels;
  if (recording.torque_Nm.size() > 0) run.torque_Nm = recording.torque_Nm.middleCols(from, rows);
  if (recording.load.size() == 0) return run;
  run.loaded_rad = Eigen::MatrixXd::Zero(wheels, rows);
  for (Eigen::Index w = 0; w < wheels; ++w)
    for (Eigen::Index i = 1; i < rows; ++i)
      run.loaded_rad(w, i) =
          run.loaded_rad(w, i - 1) + 0.5 * (recording.load(w, from + i) + recording.load(w, from + i - 1)) *
                                         (run.angle_rad(w, i) - run.angle_rad(w, i - 1));
  return run;
}

/// Poses of the rows that show a new one.
BaseTrack poses_of(const BaseRecording& recording, std::size_t first, std::size_t last) {
  BaseTrack track;
  for (std::size_t i = first; i < last; ++i) {
    PlanarPose pose = recording.pose[i];
    if (!track.pose.empty()) {
      const PlanarPose& before = recording.pose[i - 1];
      if (pose.x_m == before.x_m && pose.y_m == before.y_m && pose.yaw_rad == before.yaw_rad) continue;
      pose.yaw_rad = track.pose.back().yaw_rad +
                     std::remainder(pose.yaw_rad - track.pose.back().yaw_rad, 2 * std::numbers::pi);
    }
    track.time_s.push_back(recording.time_s[i]);
    track.pose.push_back(pose);
  }
  return track;
}

/// Highest speeds of the tracked body by the wheels, along the path and of the heading, row by row.
struct WheelSpeeds {
  std::vector<double> along_m_per_s;
  std::vector<double> turn_rad_per_s;
};
WheelSpeeds wheel_speeds(const BaseRolling& rolling, const BaseRun& run, int floor, double reach_s) {
  const std::size_t rows = run.time_s.size();
  WheelSpeeds own{std::vector<double>(rows, 0), std::vector<double>(rows, 0)};
  for (std::size_t i = 1; i < rows; ++i) {
    const PlanarVector moved =
        predicted(rolling, wheel_steps(run, run.time_s[i - 1], run.time_s[i], 0), floor);
    const double seconds = run.time_s[i] - run.time_s[i - 1];
    own.along_m_per_s[i] = moved.head<2>().norm() / seconds;
    own.turn_rad_per_s[i] = std::abs(moved[2]) / seconds;
  }
  WheelSpeeds nearby = own;
  std::size_t first = 0;
  std::size_t last = 0;
  for (std::size_t i = 0; i < rows; ++i) {
    while (run.time_s[first] < run.time_s[i] - reach_s) ++first;
    while (last < rows && run.time_s[last] <= run.time_s[i] + reach_s) ++last;
    for (std::size_t k = first; k < last; ++k) {
      nearby.along_m_per_s[i] = std::max(nearby.along_m_per_s[i], own.along_m_per_s[k]);
      nearby.turn_rad_per_s[i] = std::max(nearby.turn_rad_per_s[i], own.turn_rad_per_s[k]);
    }
  }
  return nearby;
}

/// Which steps of a track no wheel explains.
std::vector<bool> jumps_of(const BaseRolling& rolling, const BaseDescription& base, const BaseRun& run,
                           const BaseTrack& track, int floor, double longest_delay_s) {
  const std::size_t steps = track.pose.size() < 2 ? 0 : track.pose.size() - 1;
  std::vector<bool> jumps(steps, false);
  if (steps == 0) return jumps;
  const WheelSpeeds speeds = wheel_speeds(rolling, run, floor, longest_delay_s);
  const double top_m_per_s = fit::quantile(speeds.along_m_per_s, kTopSpeed);
  const double top_rad_per_s =
      std::max(fit::quantile(speeds.turn_rad_per_s, kTopSpeed), top_m_per_s / base.turning_length_m);
  std::vector<double> off_m(steps);
  std::vector<double> off_rad(steps);
  std::vector<double> bound_m(steps);
  std::vector<double> bound_rad(steps);
  std::vector<double> moved_m(steps);
  std::vector<double> moved_rad(steps);
  for (std::size_t k = 0; k < steps; ++k) {
    const PlanarVector moved = seen_from(track.pose[k], track.pose[k + 1]);
    const PlanarVector by_wheels =
        predicted(rolling, wheel_steps(run, track.time_s[k], track.time_s[k + 1], 0), floor);
    const double seconds = track.time_s[k + 1] - track.time_s[k];
    const auto row = static_cast<std::size_t>(std::ranges::lower_bound(run.time_s, track.time_s[k + 1]) -
                                              run.time_s.begin());
    moved_m[k] = moved.head<2>().norm();
    moved_rad[k] = std::abs(moved[2]);
    off_m[k] = std::abs(moved_m[k] - by_wheels.head<2>().norm());
    off_rad[k] = std::abs(moved_rad[k] - std::abs(by_wheels[2]));
    bound_m[k] = seconds * (kWrongFactor * speeds.along_m_per_s[row] + kOfTopSpeed * top_m_per_s);
    bound_rad[k] = seconds * (kWrongFactor * speeds.turn_rad_per_s[row] + kOfTopSpeed * top_rad_per_s);
  }
  const double sigma_m = fit::robust_sigma(off_m);
  const double sigma_rad = fit::robust_sigma(off_rad);
  for (std::size_t k = 0; k < steps; ++k)
    jumps[k] = moved_m[k] > bound_m[k] + kDeviations * sigma_m ||
               moved_rad[k] > bound_rad[k] + kDeviations * sigma_rad;
  return jumps;
}

/// Parts of a track between its jumps.
std::vector<BaseTrack> split(const BaseTrack& track, const std::vector<bool>& jumps) {
  std::vector<BaseTrack> parts(1);
  for (std::size_t k = 0; k < track.pose.size(); ++k) {
    if (k > 0 && jumps[k - 1]) parts.emplace_back();
    parts.back().time_s.push_back(track.time_s[k]);
    parts.back().pose.push_back(track.pose[k]);
  }
  std::erase_if(parts, [](const BaseTrack& part) { return part.pose.size() < 2; });
  return parts;
}

/// Of displacements over windows of this length, measured ones are within this factor of those by the wheels.
constexpr double kCompared_s = 1;
constexpr double kSameSize = 5;
constexpr double kAtRest_m = 1e-3;

void require_same_size(const BaseMotion& motion, const BaseDescription& base) {
  const BaseRolling rolling(base);
  const double lever_m = base.turning_length_m;
  double measured_m2 = 0;
  double by_wheels_m2 = 0;
  const auto square_m2 = [lever_m](const PlanarVector& one) {
    return one.head<2>().squaredNorm() + lever_m * lever_m * one[2] * one[2];
  };
  double windows = 0;
  for (const BaseWindow& window : windows_of(motion, kCompared_s, kCompared_s, 0)) {
    measured_m2 += square_m2(window.measured);
    by_wheels_m2 += square_m2(predicted(
        rolling, wheel_steps(motion.runs[window.run], window.start_s, window.end_s, 0), motion.floor));
    ++windows;
  }
  // At rest, both are noise.
  if (!(by_wheels_m2 > windows * kAtRest_m * kAtRest_m)) return;
  const double ratio = std::sqrt(measured_m2 / by_wheels_m2);
  if (ratio < kSameSize && ratio > 1 / kSameSize) return;
  char text[300];
  std::snprintf(text, sizeof text,
                ": the pose moves %.2g times as far as the wheels roll: check position_factor and "
                "heading_factor of [tracking], and radius_m and factor of the wheels",
                ratio);
  throw std::invalid_argument(motion.name + text);
}

/// A time between two rows, as a share of their interval.
struct Between {
  Eigen::Index row = 0;
  double share = 0;
};
Between between(const std::vector<double>& time_s, double t_s) {
  const auto after = std::ranges::upper_bound(time_s, t_s) - time_s.begin();
  const auto last = static_cast<std::ptrdiff_t>(time_s.size()) - 1;
  const auto row = std::clamp<std::ptrdiff_t>(after - 1, 0, std::max<std::ptrdiff_t>(0, last - 1));
  if (last < 1) return {0, 0};
  const auto at = static_cast<std::size_t>(row);
  return {row, std::clamp((t_s - time_s[at]) / (time_s[at + 1] - time_s[at]), 0.0, 1.0)};
}
void interpolate(const Eigen::MatrixXd& values, const Between& at, Eigen::VectorXd& result) {
  if (values.cols() == 1)
    result = values.col(0);
  else
    result = (1 - at.share) * values.col(at.row) + at.share * values.col(at.row + 1);
}

std::string counted(std::size_t count, const char* one, const char* several) {
  return std::to_string(count) + (count == 1 ? one : several);
}

/// The windows of a run.
struct RunWindows {
  BaseRun* run;
  int floor;
  std::vector<BaseWindow> windows;
};

/// How nearly measured displacements are predicted ones times a matrix.
struct Proportion {
  Eigen::Matrix3d gram = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d cross = Eigen::Matrix3d::Zero();
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();

  void add(const Proportion& other) {
    gram += other.gram;
    cross += other.cross;
    squares += other.squares;
  }
  /// Share of the measured squares that is left, of place and of heading.
  double left() const {
    const Eigen::Vector3d scale = gram.diagonal().cwiseMax(1e-12).cwiseSqrt().cwiseInverse();
    Eigen::Matrix3d scaled = scale.asDiagonal() * gram * scale.asDiagonal();
    scaled.diagonal().array() += 1e-6;
    const Eigen::Matrix3d scaled_cross = scale.asDiagonal() * cross;
    const Eigen::Matrix3d by = scaled.ldlt().solve(scaled_cross);
    double sum = 0;
    // Forward and sideways together: either may be small, and all noise.
    const double of_place = squares[0] + squares[1];
    const double explained = (by.transpose() * scaled_cross).diagonal().head<2>().sum();
    if (of_place > 0) sum += std::max(0.0, 1 - explained / of_place);
    if (squares[2] > 0) sum += std::max(0.0, 1 - by.col(2).dot(scaled_cross.col(2)) / squares[2]);
    return sum;
  }
};
Proportion proportion_of(const BaseRolling& rolling, const RunWindows& run, double delay_s) {
  Proportion result;
  for (const BaseWindow& window : run.windows) {
    const PlanarVector by_wheels =
        predicted(rolling, wheel_steps(*run.run, window.start_s, window.end_s, delay_s), run.floor);
    result.gram += by_wheels * by_wheels.transpose();
    result.cross += by_wheels * window.measured.transpose();
    result.squares += window.measured.cwiseAbs2();
  }
  return result;
}

}  // namespace

WheelSteps wheel_steps(const BaseRun& run, double start_s, double end_s, double delay_s) {
  const double from_s = start_s - delay_s;
  const double length_s = end_s - start_s;
  const double rows =
      static_cast<double>(between(run.time_s, end_s - delay_s).row - between(run.time_s, from_s).row);
  const auto steps = static_cast<Eigen::Index>(std::clamp(rows, 1.0, kStepsOfWindow));
  const bool loaded = run.loaded_rad.size() > 0;
  WheelSteps result;
  result.angle_rad.resize(run.angle_rad.rows(), steps);
  if (loaded) result.loaded_rad.resize(run.angle_rad.rows(), steps);
  if (!run.steering_rad.empty()) result.steering_rad.resize(steps);
  Eigen::VectorXd before;
  Eigen::VectorXd before_loaded;
  Eigen::VectorXd after;
  const Between first = between(run.time_s, from_s);
  interpolate(run.angle_rad, first, before);
  if (loaded) interpolate(run.loaded_rad, first, before_loaded);
  for (Eigen::Index k = 0; k < steps; ++k) {
    const double share = static_cast<double>(k + 1) / static_cast<double>(steps);
    const Between at = between(run.time_s, from_s + share * length_s);
    interpolate(run.angle_rad, at, after);
    result.angle_rad.col(k) = after - before;
    before.swap(after);
    if (loaded) {
      interpolate(run.loaded_rad, at, after);
      result.loaded_rad.col(k) = after - before_loaded;
      before_loaded.swap(after);
    }
    if (run.steering_rad.empty()) continue;
    const double middle_s = from_s + (share - 0.5 / static_cast<double>(steps)) * length_s;
    const Between there = between(run.time_s, middle_s);
    const auto row = static_cast<std::size_t>(there.row);
    const std::size_t next = std::min(row + 1, run.steering_rad.size() - 1);
    result.steering_rad[k] = (1 - there.share) * run.steering_rad[row] + there.share * run.steering_rad[next];
  }
  return result;
}

PlanarPose rolled_from(PlanarPose pose, const BaseRolling& rolling, const WheelSteps& steps, int floor) {
  const auto wheels = static_cast<std::size_t>(steps.angle_rad.rows());
  for (Eigen::Index k = 0; k < steps.angle_rad.cols(); ++k) {
    BaseRolling::Wheels one;
    one.angle_rad = {steps.angle_rad.col(k).data(), wheels};
    if (steps.loaded_rad.size() > 0) one.loaded_rad = {steps.loaded_rad.col(k).data(), wheels};
    if (steps.steering_rad.size() > 0) one.steering_rad = steps.steering_rad[k];
    one.floor = floor;
    pose = control::moved_by(pose, rolling.displacement(one));
  }
  return pose;
}

PlanarVector predicted(const BaseRolling& rolling, const WheelSteps& steps, int floor) {
  return rolling.tracked(rolled_from({}, rolling, steps, floor));
}

double rolled_m(const BaseDescription& base, const WheelSteps& steps) {
  double sum = 0;
  for (Eigen::Index w = 0; w < steps.angle_rad.rows(); ++w)
    sum += base.wheels[static_cast<std::size_t>(w)].radius_m * steps.angle_rad.row(w).cwiseAbs().sum();
  return sum / static_cast<double>(steps.angle_rad.rows());
}

BaseMotion cut(const BaseRecording& recording, const BaseDescription& base, double longest_delay_s) {
  BaseMotion motion{.name = recording.name, .floor = recording.floor, .runs = {}, .notes = {}};
  const BaseRolling rolling(base);
  const double pause_s = kBridgedPeriods * median_period_s(recording.time_s);
  std::size_t jumps = 0;
  std::size_t steps = 0;
  std::size_t pauses = 0;
  const std::size_t rows = recording.time_s.size();
  for (std::size_t first = 0; first < rows;) {
    std::size_t last = first + 1;
    while (last < rows && recording.time_s[last] - recording.time_s[last - 1] <= pause_s &&
           recording.time_s[last] > recording.time_s[last - 1] &&
           (recording.run.empty() || recording.run[last] == recording.run[first]))
      ++last;
    if (last < rows && (recording.run.empty() || recording.run[last] == recording.run[first])) ++pauses;
    if (last - first >= 3) {
      BaseRun run = run_of(recording, first, last);
      const BaseTrack whole = poses_of(recording, first, last);
      const std::vector<bool> jump = jumps_of(rolling, base, run, whole, recording.floor, longest_delay_s);
      steps += jump.size();
      jumps += static_cast<std::size_t>(std::ranges::count(jump, true));
      run.tracks = split(whole, jump);
      if (!run.tracks.empty()) motion.runs.push_back(std::move(run));
    }
    first = last;
  }
  if (static_cast<double>(jumps) > kMostJumps * static_cast<double>(steps))
    throw std::invalid_argument(recording.name + ": the pose moves farther than the wheels in " +
                                std::to_string(jumps) + " of " + std::to_string(steps) +
                                " steps: check position_factor and heading_factor of [tracking], and "
                                "radius_m and factor of the wheels");
  if (motion.runs.empty())
    throw std::invalid_argument(
        recording.name + (rows < 3 ? std::string(": it has only ") + std::to_string(rows) + " rows"
                                   : std::string(": the measured pose never changes: check the columns of "
                                                 "[tracking], or leave the recording out")));
  require_same_size(motion, base);
  if (pauses > 0) motion.notes.push_back(recording.name + ": cut at " + counted(pauses, " pause", " pauses"));
  if (jumps > 0)
    motion.notes.push_back(recording.name + ": cut at " +
                           counted(jumps, " jump of the pose", " jumps of the pose") +
                           " that no wheel explains");
  return motion;
}

BaseRecording set_aside(BaseRecording& whole) {
  const std::size_t rows = whole.time_s.size();
  std::vector<double> numbers = whole.run;
  std::ranges::sort(numbers);
  numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
  const bool by_runs = numbers.size() >= kSeparateRuns;
  const auto first = static_cast<std::size_t>(kSearchedShare * static_cast<double>(rows));
  std::vector<Eigen::Index> kept;
  std::vector<Eigen::Index> taken;
  for (std::size_t i = 0; i < rows; ++i) {
    const bool take =
        by_runs ? (std::ranges::lower_bound(numbers, whole.run[i]) - numbers.begin()) % 4 == 3 : i >= first;
    (take ? taken : kept).push_back(static_cast<Eigen::Index>(i));
  }
  const auto part = [&](const std::vector<Eigen::Index>& which, std::string name) {
    BaseRecording result;
    result.name = std::move(name);
    result.floor = whole.floor;
    result.is_speed = whole.is_speed;
    result.wheel = whole.wheel(Eigen::all, which);
    if (whole.load.size() > 0) result.load = whole.load(Eigen::all, which);
    if (whole.torque_Nm.size() > 0) result.torque_Nm = whole.torque_Nm(Eigen::all, which);
    for (const Eigen::Index row : which) {
      const auto i = static_cast<std::size_t>(row);
      result.time_s.push_back(whole.time_s[i]);
      result.pose.push_back(whole.pose[i]);
      if (!whole.run.empty()) result.run.push_back(whole.run[i]);
      if (!whole.steering_rad.empty()) result.steering_rad.push_back(whole.steering_rad[i]);
    }
    return result;
  };
  BaseRecording rest = part(taken, whole.name + (by_runs ? ", every fourth run" : ", last quarter"));
  whole = part(kept, whole.name);
  return rest;
}

std::vector<BaseWindow> windows_of(const BaseMotion& motion, double window_s, double stride_s,
                                   double margin_s) {
  std::vector<BaseWindow> windows;
  for (std::size_t r = 0; r < motion.runs.size(); ++r) {
    const BaseRun& run = motion.runs[r];
    const double half_period_s = 0.5 * median_period_s(run.time_s);
    for (std::size_t t = 0; t < run.tracks.size(); ++t) {
      const BaseTrack& track = run.tracks[t];
      const auto first_after = [&](std::size_t from, double seconds) {
        const double end_s = track.time_s[from] + seconds - half_period_s;
        return static_cast<std::size_t>(
            std::ranges::lower_bound(track.time_s.begin() + static_cast<std::ptrdiff_t>(from) + 1,
                                     track.time_s.end(), end_s) -
            track.time_s.begin());
      };
      for (std::size_t from = 0; from + 1 < track.pose.size(); from = first_after(from, stride_s)) {
        const std::size_t to = first_after(from, window_s);
        if (to >= track.pose.size()) break;
        const bool seen = track.time_s[from] - margin_s >= run.time_s.front() - half_period_s &&
                          track.time_s[to] + margin_s <= run.time_s.back() + half_period_s;
        // A pose that was held for long is from any time in between.
        const bool prompt = track.time_s[to] - track.time_s[from] <= 1.5 * window_s + 2 * half_period_s;
        if (seen && prompt)
          windows.push_back({.run = r,
                             .track = t,
                             .start_s = track.time_s[from],
                             .end_s = track.time_s[to],
                             .start = track.pose[from],
                             .measured = seen_from(track.pose[from], track.pose[to])});
      }
    }
  }
  return windows;
}

double align(const BaseDescription& base, std::span<BaseMotion> motions, double longest_delay_s) {
  const BaseRolling rolling(base);
  double period_s = 0;
  for (const BaseMotion& motion : motions)
    for (const BaseRun& run : motion.runs) period_s = std::max(period_s, median_period_s(run.time_s));
  const double window_s = std::max(kDelayWindow_s, kDelayPeriods * period_s);
  std::vector<RunWindows> runs;
  for (BaseMotion& motion : motions) {
    const std::vector<BaseWindow> windows = windows_of(motion, window_s, window_s, longest_delay_s);
    for (std::size_t r = 0; r < motion.runs.size(); ++r) {
      runs.push_back({.run = &motion.runs[r], .floor = motion.floor, .windows = {}});
      std::ranges::copy_if(windows, std::back_inserter(runs.back().windows),
                           [r](const BaseWindow& window) { return window.run == r; });
    }
  }
  const auto reach = static_cast<int>(std::floor(longest_delay_s / kDelayStep_s + 0.5));
  // By delay, of each run.
  std::vector<std::vector<Proportion>> sums(static_cast<std::size_t>(2 * reach + 1));
  gap::in_parallel(sums.size(), [&](std::size_t i) {
    for (const RunWindows& run : runs)
      sums[i].push_back(proportion_of(rolling, run, kDelayStep_s * (static_cast<int>(i) - reach)));
  });
  const auto best_of = [&](std::size_t unless, double stands_out, auto left) {
    std::size_t best = unless;
    for (std::size_t i = 0; i < sums.size(); ++i)
      if (left(sums[i]) < left(sums[best])) best = i;
    return left(sums[best]) < stands_out * left(sums[unless]) ? best : unless;
  };
  const std::size_t of_all =
      best_of(static_cast<std::size_t>(reach), kDelayStandsOut, [](const std::vector<Proportion>& all) {
        Proportion sum;
        for (const Proportion& one : all) sum.add(one);
        return sum.left();
      });
  const auto delay_s = [&](std::size_t i) { return kDelayStep_s * (static_cast<int>(i) - reach); };
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const std::size_t own =
        best_of(of_all, kRunStandsOut, [r](const std::vector<Proportion>& all) { return all[r].left(); });
    for (double& time_s : runs[r].run->time_s) time_s += delay_s(own);
  }
  return delay_s(of_all);
}

}  // namespace identification::robot_gap
