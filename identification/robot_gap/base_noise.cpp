#include "identification/robot_gap/base_noise.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "control/base_rolling.h"
#include "identification/fit/statistics.h"
#include "identification/gap/quantum.h"

namespace identification::robot_gap {
namespace {

using control::BaseDescription;
using control::BaseRolling;
using control::PlanarVector;

/// Steps on each side over which the mean is taken away: what is slower is no noise but the model's.
constexpr std::ptrdiff_t kLocal = 8;
/// Share of the typical motion below which a short window is at rest: without motion there is less noise.
constexpr double kMovesAtAll = 0.1;
/// Changes of which almost all are one step are of a motion at constant speed, not of a quantised signal.
constexpr double kOneStep = 0.95;
/// Share of the values of a quantised signal that are whole multiples, and how nearly.
constexpr double kMultiples = 0.99;
constexpr double kNearly = 0.05;
/// Outliers are beyond so many robust standard deviations, and this share of the typical motion; where they
/// are more than the last share, they are no exceptions.
constexpr double kFarOut = 8;
constexpr double kOfMotion = 0.02;
constexpr double kMostOutliers = 0.05;

/// The quantum of a signal whose zero is known.
std::optional<double> quantum_from_zero(std::span<const double> signal) {
  const std::optional<double> quantum = gap::quantum_of(signal);
  if (!quantum) return std::nullopt;
  std::size_t whole = 0;
  for (const double value : signal) {
    const double count = value / *quantum;
    if (std::abs(count - std::round(count)) < kNearly) ++whole;
  }
  return static_cast<double>(whole) < kMultiples * static_cast<double>(signal.size()) ? std::nullopt
                                                                                      : quantum;
}

/// The quantum of a signal that changes by more than one step, or not always.
std::optional<double> quantum_of_changes(std::span<const double> signal) {
  const std::optional<double> quantum = gap::quantum_of(signal);
  if (!quantum) return std::nullopt;
  std::size_t single = 0;
  for (std::size_t i = 1; i < signal.size(); ++i)
    if (std::abs(std::abs(signal[i] - signal[i - 1]) / *quantum - 1) < kNearly) ++single;
  return static_cast<double>(single) > kOneStep * static_cast<double>(signal.size() - 1) ? std::nullopt
                                                                                         : quantum;
}

double rounding_variance(const std::optional<double>& quantum) {
  return quantum ? *quantum * *quantum / 12 : 0;
}

/// Squares of what an angle of each wheel moves the base by, added up over the wheels.
Eigen::Vector3d squares_of_wheels(const BaseDescription& base, const std::vector<double>& variance) {
  const BaseRolling rolling(base);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t w = 0; w < base.wheels.size(); ++w) {
    std::vector<double> unit(base.wheels.size(), 0);
    unit[w] = 1;
    BaseRolling::Wheels one;
    one.angle_rad = unit;
    sum += variance[w] * rolling.displacement(one).cwiseAbs2();
  }
  return sum;
}

struct Rounding {
  Eigen::Vector3d of_ends = Eigen::Vector3d::Zero();
  Eigen::Vector3d of_speeds_per_s2 = Eigen::Vector3d::Zero();
};

/// The largest of all recordings.
Rounding rounding_of(const BaseDescription& base, std::span<const BaseRecording> recordings) {
  Rounding result;
  for (const BaseRecording& recording : recordings) {
    std::vector<double> x;
    std::vector<double> y;
    std::vector<double> heading;
    for (const control::PlanarPose& pose : recording.pose) {
      x.push_back(pose.x_m);
      y.push_back(pose.y_m);
      heading.push_back(pose.yaw_rad);
    }
    const double of_place =
        std::max(rounding_variance(quantum_of_changes(x)), rounding_variance(quantum_of_changes(y)));
    Eigen::Vector3d ends =
        2 * Eigen::Vector3d(of_place, of_place, rounding_variance(quantum_of_changes(heading)));
    std::vector<double> of_angles(base.wheels.size(), 0);
    std::vector<double> of_speeds(base.wheels.size(), 0);
    for (std::size_t w = 0; w < base.wheels.size(); ++w) {
      const Eigen::VectorXd own = recording.wheel.row(static_cast<Eigen::Index>(w));
      const std::span<const double> signal(own.data(), static_cast<std::size_t>(own.size()));
      (recording.is_speed[w] ? of_speeds : of_angles)[w] =
          rounding_variance(recording.is_speed[w] ? quantum_from_zero(signal) : quantum_of_changes(signal));
    }
    ends += 2 * squares_of_wheels(base, of_angles);
    result.of_ends = result.of_ends.cwiseMax(ends);
    result.of_speeds_per_s2 = result.of_speeds_per_s2.cwiseMax(squares_of_wheels(base, of_speeds));
  }
  return result;
}

/// Consecutive short windows, those of one track after the other.
struct Series {
  Eigen::MatrixX3d measured;
  Eigen::MatrixX3d predicted;
  std::vector<Eigen::Index> starts;  ///< of the tracks, and the end
};
Series series_of(const BaseDescription& base, std::span<const BaseMotion> motions, double part_s) {
  const BaseRolling rolling(base);
  std::vector<PlanarVector> measured;
  std::vector<PlanarVector> by_wheels;
  Series series;
  for (const BaseMotion& motion : motions) {
    const std::vector<BaseWindow> windows = windows_of(motion, part_s, part_s, 0);
    for (std::size_t i = 0; i < windows.size(); ++i) {
      const BaseWindow& window = windows[i];
      if (i == 0 || windows[i - 1].run != window.run || windows[i - 1].track != window.track ||
          windows[i - 1].end_s != window.start_s)
        series.starts.push_back(static_cast<Eigen::Index>(measured.size()));
      measured.push_back(window.measured);
      by_wheels.push_back(predicted(
          rolling, wheel_steps(motion.runs[window.run], window.start_s, window.end_s, 0), motion.floor));
    }
  }
  const auto count = static_cast<Eigen::Index>(measured.size());
  series.starts.push_back(count);
  series.measured.resize(count, 3);
  series.predicted.resize(count, 3);
  for (Eigen::Index k = 0; k < count; ++k) {
    series.measured.row(k) = measured[static_cast<std::size_t>(k)];
    series.predicted.row(k) = by_wheels[static_cast<std::size_t>(k)];
  }
  return series;
}

/// What no matrix explains by these columns, fitted to the rows that are not left out.
Eigen::MatrixX3d unexplained(const Eigen::MatrixX3d& measured, const Eigen::MatrixXd& columns,
                             const std::vector<bool>& left_out) {
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(columns.cols(), columns.cols());
  Eigen::MatrixXd cross = Eigen::MatrixXd::Zero(columns.cols(), 3);
  for (Eigen::Index k = 0; k < columns.rows(); ++k) {
    if (left_out[static_cast<std::size_t>(k)]) continue;
    gram += columns.row(k).transpose() * columns.row(k);
    cross += columns.row(k).transpose() * measured.row(k);
  }
  // Directions without motion explain nothing.
  gram.diagonal().array() *= 1 + 1e-9;
  gram.diagonal().array() += 1e-12;
  return measured - columns * gram.ldlt().solve(cross);
}

/// Without the mean of the neighbours in its own track.
Eigen::MatrixX3d without_local_mean(const Eigen::MatrixX3d& values, const std::vector<Eigen::Index>& starts) {
  Eigen::MatrixX3d result(values.rows(), 3);
  for (std::size_t t = 0; t + 1 < starts.size(); ++t)
    for (Eigen::Index k = starts[t]; k < starts[t + 1]; ++k) {
      const Eigen::Index first = std::max(starts[t], k - kLocal);
      const Eigen::Index last = std::min(starts[t + 1], k + kLocal + 1);
      result.row(k) = values.row(k) - values.middleRows(first, last - first).colwise().mean();
    }
  return result;
}

/// Motions, and how they change: what a given model may miss.
Eigen::MatrixXd with_changes(const Series& series) {
  Eigen::MatrixXd columns(series.predicted.rows(), 6);
  columns.leftCols(3) = series.predicted;
  for (std::size_t t = 0; t + 1 < series.starts.size(); ++t)
    for (Eigen::Index k = series.starts[t]; k < series.starts[t + 1]; ++k)
      columns.row(k).tail(3) = series.predicted.row(std::min(k + 1, series.starts[t + 1] - 1)) -
                               series.predicted.row(std::max(k - 1, series.starts[t]));
  return columns;
}

/// Sizes of motions, wheels that turn the base included.
Eigen::VectorXd sizes_of(const Eigen::MatrixX3d& motions, double lever_m) {
  return motions.leftCols(2).rowwise().norm() + lever_m * motions.col(2).cwiseAbs();
}

}  // namespace

BaseNoise noise_of(const BaseDescription& base, std::span<const BaseRecording> recordings,
                   std::span<const BaseMotion> motions, double part_s) {
  const Series series = series_of(base, motions, part_s);
  const std::vector<bool> none(static_cast<std::size_t>(series.measured.rows()), false);
  const Eigen::MatrixX3d scatter =
      without_local_mean(unexplained(series.measured, with_changes(series), none), series.starts);
  const Eigen::VectorXd sizes = sizes_of(series.predicted, base.turning_length_m);
  const double moves = sizes.sum() > 0 ? kMovesAtAll * sizes.squaredNorm() / sizes.sum() : 0;
  Eigen::Vector3d own = Eigen::Vector3d::Zero();
  Eigen::Vector3d next = Eigen::Vector3d::Zero();
  double own_count = 0;
  double next_count = 0;
  for (std::size_t t = 0; t + 1 < series.starts.size(); ++t)
    for (Eigen::Index k = series.starts[t]; k < series.starts[t + 1]; ++k) {
      if (sizes[k] < moves) continue;
      own += scatter.row(k).cwiseAbs2();
      ++own_count;
      if (k + 1 == series.starts[t + 1]) continue;
      next += scatter.row(k).cwiseProduct(scatter.row(k + 1));
      ++next_count;
    }
  own /= std::max(1.0, own_count);
  next /= std::max(1.0, next_count);
  const Rounding rounding = rounding_of(base, recordings);
  BaseNoise noise;
  // White noise of a pose is in two steps, with opposite signs.
  noise.of_ends = (-2 * next).cwiseMax(rounding.of_ends);
  // The local mean has taken away three of its terms.
  constexpr double kTaken = 3.0 / (2 * kLocal + 1);
  noise.per_s = (own + 2 * next).cwiseMax(0) / (1 - kTaken) / part_s;
  noise.of_speed_steps_per_s2 = rounding.of_speeds_per_s2;
  return noise;
}

BaseScatter scatter_of(const Eigen::MatrixX3d& measured, const Eigen::MatrixX3d& predicted, double lever_m) {
  BaseScatter result;
  const auto count = static_cast<std::size_t>(measured.rows());
  result.is_outlier.assign(count, false);
  if (count == 0) return result;
  const double size_m = sizes_of(predicted, lever_m).mean();
  const Eigen::Vector3d least = kOfMotion * Eigen::Vector3d(size_m, size_m, size_m / lever_m);
  Eigen::MatrixX3d left;
  // The first fit is with the outliers.
  for (int round = 0; round < 2; ++round) {
    left = unexplained(measured, predicted, result.is_outlier);
    Eigen::Vector3d bound;
    for (Eigen::Index c = 0; c < 3; ++c) {
      const Eigen::VectorXd own = left.col(c).cwiseAbs();
      bound[c] = std::max(least[c], kFarOut * fit::robust_sigma({own.data(), own.data() + own.size()}));
    }
    for (std::size_t k = 0; k < count; ++k)
      result.is_outlier[k] =
          (left.row(static_cast<Eigen::Index>(k)).transpose().cwiseAbs().array() > bound.array()).any();
    if (static_cast<double>(std::ranges::count(result.is_outlier, true)) >
        kMostOutliers * static_cast<double>(count))
      result.is_outlier.assign(count, false);
  }
  double kept = 0;
  for (std::size_t k = 0; k < count; ++k) {
    if (result.is_outlier[k]) continue;
    result.rms += left.row(static_cast<Eigen::Index>(k)).cwiseAbs2();
    ++kept;
  }
  result.rms = (result.rms / kept).cwiseSqrt();
  return result;
}

Eigen::Vector3d floor_of(const BaseNoise& noise, double window_s, const Eigen::Vector2d& travel_m2) {
  Eigen::Vector3d variance =
      noise.of_ends + window_s * noise.per_s + window_s * window_s * noise.of_speed_steps_per_s2;
  // Half of of_ends is at the start. A heading that drifts evenly, or at random, turns the way by a third of
  // the square of its own change.
  const double turned = noise.of_ends[2] / 2 + window_s * noise.per_s[2] / 3 +
                        window_s * window_s * noise.of_speed_steps_per_s2[2] / 4;
  variance[0] += turned * travel_m2[1];
  variance[1] += turned * travel_m2[0];
  return variance.cwiseSqrt();
}

}  // namespace identification::robot_gap
