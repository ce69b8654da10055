#include "identification/fit/moving_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <utility>

#include "control/state_variable_filter.h"
#include "identification/fit/sampling.h"

namespace identification::fit {
namespace {

/// A torque that was recorded that much late or early is an instrument's; more is the drive's.
constexpr double kRecorderLag_s = 0.01;
constexpr double kRecorderLead_s = 0.002;
/// Beyond, other terms rule the motion.
constexpr double kForeign_percent = 30;

struct Sample {
  double torque_Nm;
  double torque_rate_Nm_per_s;
  double velocity_rad_per_s;
  double acceleration_rad_per_s2;
};

std::vector<Sample> filtered(const Recording& recording, double cutoff_rad_per_s, double period_s) {
  const auto position = recording.column("position_rad");
  const auto torque =
      recording.column(recording.has("torque_measured_Nm") ? "torque_measured_Nm" : "torque_command_Nm");
  const control::StateVariableFilter::Config config{.cutoff_rad_per_s = cutoff_rad_per_s,
                                                    .period_s = period_s};
  // Twice: the acceleration from a single pass contains the encoder's steps times ω², and as a noisy
  // regressor would bias the inertia low. The velocity of a pass over the velocity does not.
  control::StateVariableFilter of_position(config);
  control::StateVariableFilter of_velocity(config);
  control::StateVariableFilter of_torque(config);
  control::StateVariableFilter of_torque_again(config);
  std::vector<Sample> samples;
  samples.reserve(position.size());
  for (std::size_t i = 0; i < position.size(); ++i) {
    const auto motion = of_velocity.step(of_position.step(position[i]).velocity);
    const auto smooth = of_torque_again.step(of_torque.step(torque[i]).position);
    samples.push_back({smooth.position, smooth.velocity, motion.position, motion.velocity});
  }
  return samples;
}

/// Samples to use: fast enough, also during the whole preceding memory of the filter, and after them for
/// longer than its lag, because the joint reverses earlier than its filtered velocity.
std::vector<Sample> sliding(const std::vector<Sample>& samples, double slowest, std::size_t memory) {
  const std::size_t ahead = memory / 2;
  std::vector<Sample> result;
  std::size_t since = 0;  // consecutive samples of one sign, including the present one
  double sign = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double v = samples[i].velocity_rad_per_s;
    const double now = std::abs(v) < slowest ? 0.0 : std::copysign(1.0, v);
    since = now == sign ? since + 1 : 1;
    sign = now;
    if (now != 0 && since > memory + ahead && i >= 2 * memory) result.push_back(samples[i - ahead]);
  }
  return result;
}

/// Least squares of y = A·x.
struct Solution {
  Eigen::VectorXd x;
  Eigen::VectorXd
      half_width;  ///< of the 95 % intervals, which allow for residuals that are correlated in time
};
Solution solved(const Eigen::MatrixXd& A, const Eigen::VectorXd& y, std::size_t memory) {
  Solution solution{.x = A.colPivHouseholderQr().solve(y), .half_width = {}};
  const Eigen::VectorXd residual = A * solution.x - y;
  const auto n = static_cast<double>(A.rows());
  // Blocks longer than the filter's correlation, and enough of them for a variance.
  const auto blocks =
      static_cast<std::size_t>(std::clamp(n / static_cast<double>(2 * memory + 1), 12.0, 60.0));
  // The covariance of white residuals as a lower bound: few blocks may agree by chance.
  const Eigen::MatrixXd white =
      normal_inverse(A) * residual.squaredNorm() / (n - static_cast<double>(A.cols()));
  const Eigen::MatrixXd covariance = block_covariance(A, residual, blocks);
  const double t = student_975(static_cast<double>(blocks) - static_cast<double>(A.cols()));
  solution.half_width = t * covariance.diagonal().cwiseMax(white.diagonal()).cwiseSqrt();
  return solution;
}

/// "12.3 ms"
std::string milliseconds(double seconds) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.3g ms", 1e3 * seconds);
  return text.data();
}

}  // namespace

MovingFit fit_moving(const Recording& recording, const MovingFitOptions& options) {
  const double period_s = even_period_s(recording);
  const double cutoff_rad_per_s = std::min(options.cutoff_rad_per_s, 1 / period_s);  // the filter's limit
  const std::vector<Sample> all = filtered(recording, cutoff_rad_per_s, period_s);
  double fastest = 0;
  for (const Sample& s : all) fastest = std::max(fastest, std::abs(s.velocity_rad_per_s));
  const double slowest = options.slowest_rad_per_s > 0 ? options.slowest_rad_per_s : fastest / 50;
  // Twenty time constants: less than 1e-4 of the other sign's friction is left.
  const auto memory = static_cast<std::size_t>(std::ceil(20 / (cutoff_rad_per_s * period_s)));
  const std::vector<Sample> samples = sliding(all, slowest, memory);
  if (fastest == 0 || samples.size() < 50)
    throw std::invalid_argument(
        "moving fit of " + (recording.rig.empty() ? "an unnamed rig" : recording.rig) +
        ": the joint hardly moves; " + std::to_string(samples.size()) + " samples slide, 50 are the least");

  MovingFit fit;
  fit.used = samples.size();
  bool forward = false;
  bool backward = false;
  const auto n = static_cast<Eigen::Index>(samples.size());
  Eigen::MatrixXd A(n, 3);
  Eigen::VectorXd y(n);
  Eigen::VectorXd rate(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Sample& s = samples[static_cast<std::size_t>(i)];
    (s.velocity_rad_per_s > 0 ? forward : backward) = true;
    A.row(i) << s.acceleration_rad_per_s2, std::copysign(1.0, s.velocity_rad_per_s), s.velocity_rad_per_s;
    y[i] = s.torque_Nm;
    rate[i] = s.torque_rate_Nm_per_s;
  }
  const bool offset = options.torque_offset && forward && backward;
  if (offset) {
    A.conservativeResize(n, 4);
    A.col(3).setOnes();
  }
  const Eigen::Index terms = A.cols();
  // A torque that lags is, to first order, less by lag · its rate.
  Eigen::MatrixXd late(n, terms + 1);
  late << A, -rate;
  Solution solution = solved(late, y, memory);
  const double lag_s = solution.x[terms];
  const double lag_half_s = solution.half_width[terms];
  const bool shows = std::abs(lag_s) > lag_half_s;
  const bool in_range = lag_s > -kRecorderLead_s && lag_s < kRecorderLag_s;
  if (shows && in_range) {
    A = late;
    fit.torque_lag_s = lag_s;
  } else {
    // The lag is given: none, or the end of its range. What the parameters change with it is unknown.
    const double given_s = shows ? std::clamp(lag_s, -kRecorderLead_s, kRecorderLag_s) : 0;
    const double unknown_s = shows ? std::abs(lag_s - given_s) + lag_half_s
                                   : std::min(std::abs(lag_s) + lag_half_s, kRecorderLag_s);
    const Eigen::VectorXd per_lag = A.colPivHouseholderQr().solve(rate);
    solution = solved(A, y + given_s * rate, memory);
    for (Eigen::Index k = 0; k < terms; ++k)
      solution.half_width[k] = std::hypot(solution.half_width[k], per_lag[k] * unknown_s);
    y += given_s * rate;
    fit.torque_lag_s = given_s;
    if (shows)
      fit.verdicts.push_back(
          "torque lag at the end of its range: " + milliseconds(given_s) + " of " + milliseconds(lag_s) +
          " (" + milliseconds(lag_s - lag_half_s) + " to " + milliseconds(lag_s + lag_half_s) +
          (lag_s > 0 ? "): no recorder is that late, so the drive itself may lag; compare the time stamps of "
                       "torque and position, or search for a delay with youbot-gap"
                     : "): no recorder is that early; compare the time stamps of torque and position"));
  }
  fit.relative_error_percent = relative_error_percent(y, A * solution.x);
  fit.condition = condition_number(A);
  const std::pair<const char*, const char*> names[] = {{"", "inertia_kg_m2"},
                                                       {"coulomb", "torque_Nm"},
                                                       {"viscous", "coefficient_Nm_s_per_rad"},
                                                       {"torque_offset", "torque_Nm"}};
  for (Eigen::Index k = 0; k < terms; ++k)
    fit.parameters.push_back({.name = names[k].second,
                              .value = solution.x[k],
                              .lower = solution.x[k] - solution.half_width[k],
                              .upper = solution.x[k] + solution.half_width[k],
                              .effect = names[k].first});
  if (!offset)
    fit.parameters.push_back(
        {.name = names[3].second,
         .not_identifiable = options.torque_offset ? "only one direction was measured" : "not asked for",
         .effect = names[3].first});

  const auto refuse = [&fit](std::size_t k, const std::string& why) {
    fit.parameters[k].not_identifiable = why;
    fit.verdicts.push_back(fit.parameters[k].title() + ": " + why);
  };
  const Estimate& inertia = fit.parameters[0];
  if (!(inertia.lower > 0) || inertia.upper - inertia.lower > inertia.value)
    refuse(0, "the joint accelerates too little against noise and friction; move it with changing velocity");
  double slow = fastest;
  double fast = 0;
  for (const Sample& s : samples) {
    slow = std::min(slow, std::abs(s.velocity_rad_per_s));
    fast = std::max(fast, std::abs(s.velocity_rad_per_s));
  }
  if (fast < 1.2 * slow) {
    refuse(1, "one speed does not separate it from viscous friction");
    refuse(2, "one speed does not separate it from Coulomb friction");
  }
  for (std::size_t k = 1; k < 3; ++k) {
    const Estimate& e = fit.parameters[k];
    if (e.ok() && e.lower < 0)
      refuse(k, e.upper > 0 ? "this motion does not distinguish it from zero"
                            : "came out below zero, where no friction is: something else is in this motion");
    const double half = 0.5 * (e.upper - e.lower);
    if (e.ok() && !(half * A.col(static_cast<Eigen::Index>(k)).norm() < 0.5 * y.norm()))
      refuse(k, "this motion cannot separate it from the other terms");
  }
  if (fit.relative_error_percent > kForeign_percent)
    fit.verdicts.push_back(
        "these terms leave " + std::to_string(std::lround(fit.relative_error_percent)) +
        " % of the torque: a weight, a contact or another effect rules this motion, and the "
        "intervals do not allow for it; youbot-gap searches for it");
  return fit;
}

}  // namespace identification::fit
