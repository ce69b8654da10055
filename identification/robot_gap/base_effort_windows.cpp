#include "identification/robot_gap/base_effort_windows.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "control/base_rolling.h"
#include "identification/fit/quantile.h"
#include "identification/fit/statistics.h"

namespace identification::robot_gap {
namespace {

using control::BaseDescription;
using control::BaseKinematics;
using control::BaseRolling;
using control::PlanarVector;

/// Below this share of its top speed a wheel may be at rest.
constexpr double kRestOfTop = 0.05;
constexpr double kTopQuantile = 0.95;
/// A direction of the base is assumed to be smoothed below this share of its top speed, or below so many
/// standard deviations of its noise up to the share above. A resistance acts in full at low speeds: as wheels
/// turn unevenly, a base that goes straight on turns slowly to and fro.
constexpr double kSignOfTop = 0.02;
constexpr double kSignOfNoise = 2;
/// A direction is determined if the base moves faster along it than so many standard deviations of its noise
constexpr double kSeenOfNoise = 4;
/// for more than this share of the time: of noise alone, less than a tenth of a thousandth is as fast.
constexpr double kSeenShare = 0.01;
/// Twist that rounding of the wheels' angles leaves [m/s, rad/s].
constexpr double kRoundedTwist = 1e-9;
constexpr double kOverlap = 0.5;
/// Samples in a window.
constexpr double kLeastSamples = 6;
/// Speeds are smoothed over this share of a window before it is asked whether they are zero.
constexpr double kSmoothed = 0.125;

/// The weight sin² of a window, as a density, and its integral.
struct SineSquared {
  double start_s;
  double length_s;
  double share(double t_s) const { return std::clamp((t_s - start_s) / length_s, 0.0, 1.0); }
  double density_per_s(double t_s) const {
    return (1 - std::cos(2 * std::numbers::pi * share(t_s))) / length_s;
  }
  double integral(double t_s) const {
    const double x = share(t_s);
    return x - std::sin(2 * std::numbers::pi * x) / (2 * std::numbers::pi);
  }
};

/// Rows [first, last] whose intervals lie at least partly between two times.
struct RowRange {
  std::size_t first;
  std::size_t last;
};
RowRange rows_between(const std::vector<double>& time_s, double start_s, double end_s) {
  const auto after = std::ranges::upper_bound(time_s, start_s) - time_s.begin();
  const auto until = std::ranges::lower_bound(time_s, end_s) - time_s.begin();
  const auto end = static_cast<std::ptrdiff_t>(time_s.size()) - 1;
  const std::ptrdiff_t first = std::clamp<std::ptrdiff_t>(after - 1, 0, end);
  return {static_cast<std::size_t>(first), static_cast<std::size_t>(std::clamp(until, first, end))};
}

/// Mean speed in the interval after a row. `angle_rad`: of the run, or any of its sums.
Eigen::VectorXd speed_after(const BaseRun& run, const Eigen::MatrixXd& angle_rad, std::size_t row) {
  const auto at = static_cast<Eigen::Index>(row);
  return (angle_rad.col(at + 1) - angle_rad.col(at)) / (run.time_s[row + 1] - run.time_s[row]);
}

/// Speeds of the intervals of a run, each the mean over its neighbourhood; wheels × intervals.
Eigen::MatrixXd smooth_speeds(const BaseRun& run, double smooth_s) {
  const std::size_t intervals = run.time_s.empty() ? 0 : run.time_s.size() - 1;
  Eigen::MatrixXd result(run.angle_rad.rows(), static_cast<Eigen::Index>(intervals));
  std::size_t first = 0;
  std::size_t last = 0;
  for (std::size_t k = 0; k < intervals; ++k) {
    const double middle_s = 0.5 * (run.time_s[k] + run.time_s[k + 1]);
    while (first < k && run.time_s[first] < middle_s - 0.5 * smooth_s) ++first;
    while (last < intervals && (last <= k || run.time_s[last] < middle_s + 0.5 * smooth_s)) ++last;
    result.col(static_cast<Eigen::Index>(k)) = (run.angle_rad.col(static_cast<Eigen::Index>(last)) -
                                                run.angle_rad.col(static_cast<Eigen::Index>(first))) /
                                               (run.time_s[last] - run.time_s[first]);
  }
  return result;
}

PlanarVector twist_of(const BaseRolling& rolling, const Eigen::VectorXd& speeds, double steering_rad,
                      int floor) {
  BaseRolling::Wheels wheels;
  wheels.angle_rad = {speeds.data(), static_cast<std::size_t>(speeds.size())};
  wheels.steering_rad = steering_rad;
  wheels.floor = floor;
  return rolling.displacement(wheels);
}

double steering_after(const BaseRun& run, std::size_t row) {
  return run.steering_rad.empty() ? 0 : 0.5 * (run.steering_rad[row] + run.steering_rad[row + 1]);
}

/// Intervals [first, last) in which every wheel turns and keeps its direction.
struct Stretch {
  std::size_t first;
  std::size_t last;
};
std::vector<Stretch> moving_stretches(const BaseRun& run, const RestSpeeds& rest, double smooth_s) {
  const Eigen::MatrixXd speeds = smooth_speeds(run, smooth_s);
  std::vector<Stretch> stretches;
  bool is_open = false;
  for (Eigen::Index k = 0; k < speeds.cols(); ++k) {
    const auto at = static_cast<std::size_t>(k);
    const bool moves = (speeds.col(k).cwiseAbs().array() > rest.wheel_rad_per_s.array()).all();
    const bool turns_on = is_open && (speeds.col(k).cwiseProduct(speeds.col(k - 1)).array() > 0).all();
    if (moves && turns_on) {
      stretches.back().last = at + 1;
    } else if (moves) {
      stretches.push_back({at, at + 1});
    }
    is_open = moves;
  }
  return stretches;
}

/// Measured pose; yaw is continuous.
control::PlanarPose pose_at(const BaseTrack& track, double t_s) {
  const auto after = std::ranges::upper_bound(track.time_s, t_s) - track.time_s.begin();
  const auto next = static_cast<std::size_t>(
      std::clamp<std::ptrdiff_t>(after, 1, static_cast<std::ptrdiff_t>(track.time_s.size()) - 1));
  const control::PlanarPose& from = track.pose[next - 1];
  const control::PlanarPose& to = track.pose[next];
  const double share =
      std::clamp((t_s - track.time_s[next - 1]) / (track.time_s[next] - track.time_s[next - 1]), 0.0, 1.0);
  return {from.x_m + share * (to.x_m - from.x_m), from.y_m + share * (to.y_m - from.y_m),
          from.yaw_rad + share * (to.yaw_rad - from.yaw_rad)};
}

/// Fills one window; its stretch is known.
class WindowFiller {
 public:
  WindowFiller(const BaseRun& run, const BaseDescription& base, const RestSpeeds& rest, int floor)
      : run_(run),
        base_(base),
        rest_(rest),
        rolling_(base),
        floor_(floor),
        smooth_(smooth_speeds(run, rest.smooth_s)) {}

  EffortWindow filled(std::size_t run_number, const BaseTrack& track, double start_s, double length_s,
                      double lag_s) const {
    EffortWindow window;
    window.run = run_number;
    window.start_s = start_s;
    window.end_s = start_s + length_s;
    window.pose = pose_at(track, start_s + 0.5 * length_s);
    window.torque_Nm = mean_torque(run_, window.start_s, window.end_s, lag_s);
    const Eigen::Index wheels = run_.angle_rad.rows();
    window.speed_rad_per_s = Eigen::VectorXd::Zero(wheels);
    window.acceleration_rad_per_s2 = Eigen::VectorXd::Zero(wheels);
    window.rolled_rad_per_s2 = Eigen::VectorXd::Zero(wheels);
    window.speed_products = Eigen::MatrixXd::Zero(wheels, wheels);
    window.cos_yaw = 0;
    window.twist.setZero();
    const SineSquared weight{start_s, length_s};
    const RowRange rows = rows_between(run_.time_s, window.start_s, window.end_s);
    double slope_before = 0;  // of the weight, in the interval before
    double change_before = 0;
    for (std::size_t k = rows.first; k < rows.last; ++k) {
      const double from_s = run_.time_s[k];
      const double to_s = run_.time_s[k + 1];
      const double share = weight.integral(to_s) - weight.integral(from_s);
      const double change_per_s = weight.density_per_s(to_s) - weight.density_per_s(from_s);
      const Eigen::VectorXd speed = speed_after(run_, run_.angle_rad, k);
      const Eigen::VectorXd rolled = rolled_after(k, speed);
      const double steering_rad = steering_after(run_, k);
      const PlanarVector twist = twist_of(rolling_, rolled, steering_rad, floor_);
      const double yaw_rad = pose_at(track, 0.5 * (from_s + to_s)).yaw_rad;
      const PlanarVector smooth =
          twist_of(rolling_, smooth_.col(static_cast<Eigen::Index>(k)), steering_rad, floor_);
      const double turning_sign = std::tanh(smooth[2] / rest_.twist[2]);
      window.speed_rad_per_s += share * speed;
      window.acceleration_rad_per_s2 -= change_per_s * speed;
      window.rolled_rad_per_s2 -= change_per_s * rolled;
      window.speed_products += share * rolled * rolled.transpose();
      window.twist += share * twist;
      window.cos_yaw += share * std::cos(yaw_rad);
      window.sin_yaw += share * std::sin(yaw_rad);
      window.turning_sign += share * turning_sign;
      window.sideways_sign += share * std::tanh(smooth[1] / rest_.twist[1]);
      window.of_torque_noise += share * share;
      const double slope = change_per_s / (to_s - from_s);
      window.of_motion_noise += run_.is_speed
                                    ? 0.25 * (change_per_s + change_before) * (change_per_s + change_before)
                                    : (slope - slope_before) * (slope - slope_before);
      slope_before = slope;
      change_before = change_per_s;
      if (base_.kinematics == BaseKinematics::kTricycle)
        add_steered(window.steered, k, weight, rolled[0], share, yaw_rad, turning_sign);
    }
    window.of_motion_noise +=
        run_.is_speed ? 0.25 * change_before * change_before : slope_before * slope_before;
    window.sign = window.speed_rad_per_s.cwiseSign();
    return window;
  }

 private:
  Eigen::VectorXd rolled_after(std::size_t row, const Eigen::VectorXd& speed) const {
    if (base_.slip_with_load == 0 || run_.loaded_rad.size() == 0) return speed;
    return speed - base_.slip_with_load * speed_after(run_, run_.loaded_rad, row);
  }
  void add_steered(EffortWindow::Steered& steered, std::size_t k, const SineSquared& weight, double speed,
                   double share, double yaw_rad, double turning_sign) const {
    const auto angle = [&](std::size_t row) { return run_.steering_rad[row] + base_.steering_offset_rad; };
    const double middle = steering_after(run_, k) + base_.steering_offset_rad;
    const double c = std::cos(middle);
    const double s = std::sin(middle);
    const double before = weight.density_per_s(run_.time_s[k]);
    const double after = weight.density_per_s(run_.time_s[k + 1]);
    const double change_c = after * std::cos(angle(k + 1)) - before * std::cos(angle(k));
    const double change_s = after * std::sin(angle(k + 1)) - before * std::sin(angle(k));
    steered.cc -= change_c * c * speed;
    steered.ss -= change_s * s * speed;
    steered.cs -= change_s * c * speed;
    steered.sc -= change_c * s * speed;
    steered.css += share * c * s * s * speed * speed;
    const Eigen::Vector2d yaw(std::cos(yaw_rad), std::sin(yaw_rad));
    steered.c_yaw += share * c * yaw;
    steered.s_yaw += share * s * yaw;
    steered.s_turning_sign += share * s * turning_sign;
  }

  const BaseRun& run_;
  const BaseDescription& base_;
  const RestSpeeds& rest_;
  BaseRolling rolling_;
  int floor_;
  Eigen::MatrixXd smooth_;  // speeds, wheels × intervals
};

/// Weights of four neighbours that leave nothing of a parabola, however they are spaced; of norm 1.
Eigen::Vector4d third_difference(const BaseRun& run, std::size_t row) {
  Eigen::Vector4d weights = Eigen::Vector4d::Ones();
  for (Eigen::Index i = 0; i < 4; ++i)
    for (Eigen::Index j = 0; j < 4; ++j)
      if (j != i)
        weights[i] /=
            run.time_s[row + static_cast<std::size_t>(i)] - run.time_s[row + static_cast<std::size_t>(j)];
  return weights.normalized();
}
/// Of even samples, of which each is the mean of two: norm of that of the samples.
constexpr double kOfAveragedSpeeds = 2.5 / 20;

/// What noise leaves of a smoothed twist: one sample for each four neighbours.
std::vector<PlanarVector> twist_noise(const BaseRun& run, const BaseRolling& rolling, double smooth_s,
                                      int floor) {
  const Eigen::Index needed = run.is_speed ? 5 : 4;
  const double of_samples =
      run.is_speed ? 1 / std::sqrt(kOfAveragedSpeeds * kSmoothedRows) : std::numbers::sqrt2 / smooth_s;
  std::vector<PlanarVector> noise;
  for (Eigen::Index k = 0; k + needed <= run.angle_rad.cols(); ++k) {
    const auto row = static_cast<std::size_t>(k);
    const Eigen::Vector4d weights = third_difference(run, row);
    Eigen::VectorXd left = Eigen::VectorXd::Zero(run.angle_rad.rows());
    for (Eigen::Index i = 0; i < 4; ++i)
      left += weights[i] * (run.is_speed ? speed_after(run, run.angle_rad, row + static_cast<std::size_t>(i))
                                         : Eigen::VectorXd(run.angle_rad.col(k + i)));
    noise.emplace_back(of_samples * twist_of(rolling, left, steering_after(run, row + 1), floor));
  }
  return noise;
}

}  // namespace

RestSpeeds rest_speeds(std::span<const BaseMotion> motions, const BaseDescription& base, double smooth_s) {
  const std::size_t wheels = base.wheels.size();
  std::vector<std::vector<double>> speeds(wheels);
  std::array<std::vector<double>, 3> twists;
  std::array<std::vector<double>, 3> noise;
  const BaseRolling rolling(base);
  for (const BaseMotion& motion : motions)
    for (const BaseRun& run : motion.runs) {
      const Eigen::MatrixXd own = smooth_speeds(run, smooth_s);
      for (Eigen::Index k = 0; k < own.cols(); ++k) {
        for (std::size_t w = 0; w < wheels; ++w)
          speeds[w].push_back(std::abs(own(static_cast<Eigen::Index>(w), k)));
        const PlanarVector twist =
            twist_of(rolling, own.col(k), steering_after(run, static_cast<std::size_t>(k)), motion.floor);
        for (std::size_t i = 0; i < 3; ++i)
          twists[i].push_back(std::abs(twist[static_cast<Eigen::Index>(i)]));
      }
      for (const PlanarVector& one : twist_noise(run, rolling, smooth_s, motion.floor))
        for (std::size_t i = 0; i < 3; ++i)
          if (const double left = one[static_cast<Eigen::Index>(i)]; left != 0)
            noise[i].push_back(std::abs(left));
    }
  RestSpeeds rest{Eigen::VectorXd(static_cast<Eigen::Index>(wheels)), PlanarVector::Zero(), smooth_s};
  for (std::size_t w = 0; w < wheels; ++w)
    rest.wheel_rad_per_s[static_cast<Eigen::Index>(w)] =
        kRestOfTop * fit::quantile(std::move(speeds[w]), kTopQuantile);
  for (std::size_t i = 0; i < 3; ++i) {
    const double sigma = fit::robust_sigma(std::move(noise[i]));
    const auto count = static_cast<double>(twists[i].size());
    std::erase_if(twists[i], [least = std::max(kRoundedTwist, kSeenOfNoise * sigma)](double speed) {
      return !(speed > least);
    });
    if (static_cast<double>(twists[i].size()) <= kSeenShare * count) {
      rest.twist[static_cast<Eigen::Index>(i)] = std::numeric_limits<double>::infinity();
      continue;
    }
    const double top = fit::quantile(std::move(twists[i]), kTopQuantile);
    rest.twist[static_cast<Eigen::Index>(i)] =
        std::clamp(kSignOfNoise * sigma, kSignOfTop * top, kRestOfTop * top);
  }
  return rest;
}

Eigen::VectorXd mean_torque(const BaseRun& run, double start_s, double end_s, double lag_s) {
  const SineSquared weight{start_s + lag_s, end_s - start_s};
  const RowRange rows = rows_between(run.time_s, start_s + lag_s, end_s + lag_s);
  // A mean speed between two rows sees the motion through a window of their distance. Torques are seen
  // through one as wide, by this share of each weight at the other end; mean speeds of speeds are blurred
  // twice as much.
  const double blur = run.is_speed ? 1.0 / 6 : 1.0 / 12;
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(run.torque_Nm.rows());
  double weights = 0;
  for (std::size_t k = rows.first; k < rows.last; ++k) {
    const double period_s = run.time_s[k + 1] - run.time_s[k];
    const double before = period_s * weight.density_per_s(run.time_s[k]);
    const double after = period_s * weight.density_per_s(run.time_s[k + 1]);
    const auto at = static_cast<Eigen::Index>(k);
    sum += ((0.5 - blur) * before + blur * after) * run.torque_Nm.col(at) +
           (blur * before + (0.5 - blur) * after) * run.torque_Nm.col(at + 1);
    weights += 0.5 * (before + after);
  }
  return weights > 0 ? Eigen::VectorXd(sum / weights) : sum;
}

std::vector<EffortWindow> effort_windows(const BaseMotion& motion, const BaseDescription& base,
                                         const RestSpeeds& rest, double window_s, double lag_s) {
  std::vector<EffortWindow> windows;
  for (std::size_t r = 0; r < motion.runs.size(); ++r) {
    const BaseRun& run = motion.runs[r];
    const WindowFiller filler(run, base, rest, motion.floor);
    for (const Stretch& stretch : moving_stretches(run, rest, kSmoothed * window_s)) {
      const double length_s = run.time_s[stretch.last] - run.time_s[stretch.first];
      if (length_s < window_s ||
          static_cast<double>(stretch.last - stretch.first) * window_s < kLeastSamples * length_s)
        continue;
      const double room_s = length_s - window_s;
      const auto more = static_cast<std::size_t>(std::floor(room_s / (kOverlap * window_s)));
      for (std::size_t i = 0; i <= more; ++i) {
        const double start_s =
            run.time_s[stretch.first] +
            (more == 0 ? 0.5 * room_s : room_s * static_cast<double>(i) / static_cast<double>(more));
        const auto track = std::ranges::find_if(run.tracks, [&](const BaseTrack& one) {
          return one.time_s.front() <= start_s && start_s + window_s <= one.time_s.back();
        });
        const bool has_torque =
            run.time_s.front() <= start_s + lag_s && start_s + window_s + lag_s <= run.time_s.back();
        if (track != run.tracks.end() && has_torque)
          windows.push_back(filler.filled(r, *track, start_s, window_s, lag_s));
      }
    }
  }
  return windows;
}

EffortNoise effort_noise(std::span<const BaseMotion> motions, const RestSpeeds& rest) {
  const Eigen::Index wheels = rest.wheel_rad_per_s.size();
  Eigen::VectorXd of_torque = Eigen::VectorXd::Zero(wheels);
  Eigen::VectorXd of_motion = Eigen::VectorXd::Zero(wheels);
  double count = 0;
  for (const BaseMotion& motion : motions)
    for (const BaseRun& run : motion.runs)
      for (const Stretch& stretch : moving_stretches(run, rest, rest.smooth_s))
        for (std::size_t k = stretch.first; k + 4 < stretch.last; ++k) {
          const auto at = static_cast<Eigen::Index>(k);
          const Eigen::Vector4d weights = third_difference(run, k);
          of_torque += (run.torque_Nm.middleCols(at, 4) * weights).cwiseAbs2();
          if (run.is_speed) {
            Eigen::VectorXd speed = Eigen::VectorXd::Zero(wheels);
            for (Eigen::Index i = 0; i < 4; ++i)
              speed += weights[i] * speed_after(run, run.angle_rad, static_cast<std::size_t>(at + i));
            of_motion += speed.cwiseAbs2() / kOfAveragedSpeeds;
          } else {
            of_motion += (run.angle_rad.middleCols(at, 4) * weights).cwiseAbs2();
          }
          ++count;
        }
  count = std::max(1.0, count);
  return {(of_torque / count).cwiseSqrt(), (of_motion / count).cwiseSqrt()};
}

}  // namespace identification::robot_gap
