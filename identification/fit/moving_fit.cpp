#include "identification/fit/moving_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "control/state_variable_filter.h"
#include "identification/fit/sampling.h"

namespace identification::fit {
namespace {

struct Sample {
  double torque_Nm;
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
    samples.push_back({of_torque_again.step(of_torque.step(torque[i]).position).position, motion.position,
                       motion.velocity});
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
  Eigen::MatrixXd A(n, 4);
  Eigen::VectorXd y(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Sample& s = samples[static_cast<std::size_t>(i)];
    (s.velocity_rad_per_s > 0 ? forward : backward) = true;
    A.row(i) << s.acceleration_rad_per_s2, std::copysign(1.0, s.velocity_rad_per_s), s.velocity_rad_per_s,
        1.0;
    y[i] = s.torque_Nm;
  }
  const bool offset = options.torque_offset && forward && backward;
  if (!offset) A.conservativeResize(n, 3);
  const Eigen::VectorXd x = A.colPivHouseholderQr().solve(y);
  const Eigen::VectorXd residual = A * x - y;
  fit.relative_error_percent = relative_error_percent(y, A * x);
  fit.condition = condition_number(A);

  // Blocks longer than the filter's correlation, and enough of them for a variance.
  const auto blocks = static_cast<std::size_t>(
      std::clamp(static_cast<double>(n) / static_cast<double>(2 * memory + 1), 12.0, 60.0));
  const Eigen::MatrixXd covariance = block_covariance(A, residual, blocks);
  const double t = student_975(static_cast<double>(blocks) - static_cast<double>(A.cols()));
  // The covariance of white residuals as a lower bound: few blocks may agree by chance.
  const Eigen::MatrixXd white =
      normal_inverse(A) * residual.squaredNorm() / static_cast<double>(n - A.cols());
  const std::pair<const char*, const char*> names[] = {{"", "inertia_kg_m2"},
                                                       {"coulomb", "torque_Nm"},
                                                       {"viscous", "coefficient_Nm_s_per_rad"},
                                                       {"torque_offset", "torque_Nm"}};
  for (Eigen::Index k = 0; k < A.cols(); ++k) {
    const double half = t * std::sqrt(std::max(covariance(k, k), white(k, k)));
    fit.parameters.push_back({.name = names[k].second,
                              .value = x[k],
                              .lower = x[k] - half,
                              .upper = x[k] + half,
                              .effect = names[k].first});
  }
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
    if (e.ok() && e.value < 0)
      refuse(k, e.upper > 0 ? "this motion does not distinguish it from zero"
                            : "came out below zero, where no friction is: something else is in this motion");
    const double half = 0.5 * (e.upper - e.lower);
    if (e.ok() && !(half * A.col(static_cast<Eigen::Index>(k)).norm() < 0.5 * y.norm()))
      refuse(k, "this motion cannot separate it from the other terms");
  }
  return fit;
}

}  // namespace identification::fit
