#include "identification/gap/speed_channel.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

#include "identification/fit/statistics.h"
#include "identification/gap/sign_test.h"
#include "identification/gap/zero_phase.h"
#include "model/effects/effect_chain.h"

namespace identification::gap {
namespace {

constexpr double kBlock_s = 1.0;
/// All recordings together; a delay is visible in the first of them.
constexpr std::size_t kMaxSamples = 20000;
constexpr double kLongestDelay_s = 0.4;
/// Sampling alone makes a velocity appear up to a period late, and its differences half a period.
constexpr double kMinPeriods = 1.5;
/// Minimum share of the squared misfit for an effect to be named.
constexpr double kMinGain = 0.1;

/// One recording.
struct Run {
  double period_s = 0;
  std::vector<double> command;
  std::vector<double> velocity;
};

struct Response {
  double delay_s = 0;
  double omega_rad_per_s = 0;
  double damping = 1;
};

/// Second-order low-pass, starting at rest at the first value; midpoint steps short enough for ω.
std::vector<double> followed(const std::vector<double>& input, double period_s, const Response& response) {
  const double w = response.omega_rad_per_s;
  const int steps =
      std::max(1, static_cast<int>(std::ceil(4 * period_s * w * std::max(1.0, response.damping))));
  const double dt = period_s / steps;
  std::vector<double> result(input.size());
  double y = input.empty() ? 0 : input.front();
  double rate = 0;
  for (std::size_t i = 0; i < input.size(); ++i) {
    result[i] = y;
    // Implicit in the rate: stable whatever the step.
    for (int n = 0; n < steps; ++n) {
      rate = (rate + dt * w * w * (input[i] - y)) / (1 + 2 * response.damping * w * dt + w * w * dt * dt);
      y += dt * rate;
    }
  }
  return result;
}

std::vector<double> delayed(const std::vector<double>& input, double periods) {
  std::vector<double> result(input.size());
  const auto whole = static_cast<std::size_t>(periods);
  const double part = periods - static_cast<double>(whole);
  const auto at = [&](std::size_t i, std::size_t back) { return input[i >= back ? i - back : 0]; };
  for (std::size_t i = 0; i < input.size(); ++i)
    result[i] = (1 - part) * at(i, whole) + part * at(i, whole + 1);
  return result;
}

std::vector<double> signs(const std::vector<double>& input) {
  std::vector<double> result;
  for (const double value : input) result.push_back(value > 0 ? 1 : value < 0 ? -1 : 0);
  return result;
}

/// Columns g, c, o of all runs, stacked.
Eigen::MatrixXd columns_of(const std::vector<Run>& runs, const Response& response) {
  std::size_t rows = 0;
  for (const Run& run : runs) rows += run.command.size();
  Eigen::MatrixXd columns(static_cast<Eigen::Index>(rows), 3);
  Eigen::Index at = 0;
  for (const Run& run : runs) {
    const std::vector<double> late = delayed(run.command, response.delay_s / run.period_s);
    const auto n = static_cast<Eigen::Index>(late.size());
    const std::vector<double> y = followed(late, run.period_s, response);
    const std::vector<double> s = followed(signs(late), run.period_s, response);
    columns.col(0).segment(at, n) = Eigen::Map<const Eigen::VectorXd>(y.data(), n);
    columns.col(1).segment(at, n) = Eigen::Map<const Eigen::VectorXd>(s.data(), n);
    at += n;
  }
  columns.col(2).setOnes();
  return columns;
}

Eigen::VectorXd velocities(const std::vector<Run>& runs) {
  std::vector<double> all;
  for (const Run& run : runs) all.insert(all.end(), run.velocity.begin(), run.velocity.end());
  return Eigen::Map<const Eigen::VectorXd>(all.data(), static_cast<Eigen::Index>(all.size()));
}

/// Residual of the best fit with that response.
Eigen::VectorXd misfit(const std::vector<Run>& runs, const Eigen::VectorXd& velocity,
                       const Response& response) {
  const Eigen::MatrixXd columns = columns_of(runs, response);
  Eigen::MatrixXd gram = columns.transpose() * columns;
  gram.diagonal().array() += 1e-9 * gram.diagonal().maxCoeff();
  return velocity - columns * gram.ldlt().solve(columns.transpose() * velocity);
}

struct Fitted {
  Response response;
  double square = 0;
};

/// The best response with that delay: a grid, then refined around its best point.
Fitted best_response(const std::vector<Run>& runs, const Eigen::VectorXd& velocity, double delay_s,
                     double period_s) {
  Fitted best{.response = {}, .square = std::numeric_limits<double>::infinity()};
  const auto consider = [&](const Response& response) {
    const double square = misfit(runs, velocity, response).squaredNorm();
    if (square < best.square) best = {response, square};
  };
  const double fastest = 2 / period_s;
  for (const double damping : {0.4, 0.7, 1.0, 2.0, 5.0})
    for (double omega = fastest; omega > fastest / 200; omega *= 0.6)
      consider({.delay_s = delay_s, .omega_rad_per_s = omega, .damping = damping});
  for (const double factor : {0.77, 0.88, 1.14, 1.3}) {
    Response finer = best.response;
    finer.omega_rad_per_s *= factor;
    consider(finer);
  }
  return best;
}

/// The delay with the least misfit within `low` to `high`, with the response fixed.
double finer_delay(const std::vector<Run>& runs, const Eigen::VectorXd& velocity, Response response,
                   double low, double high) {
  constexpr int kSteps = 24;
  double best = response.delay_s;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= kSteps; ++i) {
    response.delay_s = low + (high - low) * i / kSteps;
    const double square = misfit(runs, velocity, response).squaredNorm();
    if (square < least) {
      least = square;
      best = response.delay_s;
    }
  }
  return best;
}

/// Torque that `base` needs for that motion: inertia and sliding friction.
std::vector<double> torque_of(const model::effects::DriveModel& base, std::vector<double> velocity,
                              double period_s) {
  const model::effects::EffectChain chain(base.effects);
  std::vector<double> torque = derivative(velocity, period_s);
  for (std::size_t i = 0; i < velocity.size(); ++i)
    torque[i] = base.inertia_kg_m2 * torque[i] +
                (velocity[i] == 0 ? 0
                                  : std::copysign(chain.level_Nm({.speed_rad_per_s = std::abs(velocity[i]),
                                                                  .direction = velocity[i] < 0 ? -1.0 : 1.0}),
                                                  velocity[i]));
  return torque;
}

}  // namespace

std::optional<FoundEffect> speed_command_delay(std::span<const Signals> signals,
                                               const model::effects::DriveModel& base,
                                               const Options& options) {
  if (base.find<model::effects::TransportDelay>()) return std::nullopt;
  std::vector<Run> runs;
  std::size_t samples = 0;
  bool changes = false;
  for (const Signals& s : signals) {
    if (!s.raw_command_Nm.empty()) return std::nullopt;
    if (s.raw_velocity_command_rad_per_s.empty() || samples >= kMaxSamples) continue;
    const std::size_t count = std::min(s.raw_velocity_command_rad_per_s.size(), kMaxSamples - samples);
    const auto first = [&](const std::vector<double>& all) {
      return std::vector<double>(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(count));
    };
    runs.push_back(
        {s.raw_period_s, first(s.raw_velocity_command_rad_per_s), first(s.raw_velocity_rad_per_s)});
    const auto [low, high] = std::ranges::minmax_element(runs.back().command);
    changes = changes || *high > *low;
    samples += count;
  }
  if (!changes) return std::nullopt;
  const double period_s = runs.front().period_s;
  const Eigen::VectorXd velocity = velocities(runs);

  const Fitted prompt = best_response(runs, velocity, 0, period_s);
  Fitted late = prompt;
  const double longest = std::min(kLongestDelay_s, model::effects::DelayLine::kLongest_s);
  const double step = std::max(period_s, longest / 25);
  for (double delay = step; delay <= longest; delay += step) {
    const Fitted fitted = best_response(runs, velocity, delay, period_s);
    if (fitted.square < late.square) late = fitted;
  }
  // Delay and response trade off against each other: both are refined in turn.
  for (int round = 0; round < 2; ++round) {
    const double delay =
        finer_delay(runs, velocity, late.response, std::max(0.0, late.response.delay_s - step),
                    std::min(late.response.delay_s + step, model::effects::DelayLine::kLongest_s));
    const Fitted fitted = best_response(runs, velocity, delay, period_s);
    if (fitted.square < late.square) late = fitted;
  }
  const double delay_s = late.response.delay_s;
  const double gain = 1 - late.square / prompt.square;
  if (delay_s < kMinPeriods * period_s || gain < kMinGain) return std::nullopt;

  // Blocks of a second that improve, against those that worsen.
  const Eigen::VectorXd before = misfit(runs, velocity, prompt.response);
  const Eigen::VectorXd after = misfit(runs, velocity, late.response);
  const auto length = std::max<Eigen::Index>(4, std::llround(kBlock_s / period_s));
  FoundEffect found{.effect = model::effects::make_effect("transport_delay", {{"delay_s", delay_s}}),
                    .where = {}};
  std::vector<double> was;
  std::vector<double> is;
  for (Eigen::Index at = 0; at + length <= before.size(); at += length) {
    was.push_back(before.segment(at, length).squaredNorm());
    is.push_back(after.segment(at, length).squaredNorm());
    found.blocks_improved += is.back() < was.back() ? 1 : 0;
  }
  found.blocks = static_cast<int>(was.size());
  found.p_value = chance_of(was, is);
  if (found.p_value > options.false_positive_rate) return std::nullopt;

  found.measured_on = "misfit of commanded and measured speed";
  found.held_out_gain = gain;
  const auto [low, high] = std::ranges::minmax_element(runs.front().command);
  found.where = {.coordinate = "velocity_command_rad_per_s", .from = *low, .to = *high};
  double square_before = 0;
  double square_after = 0;
  Eigen::Index at = 0;
  for (const Run& run : runs) {
    const auto n = static_cast<Eigen::Index>(run.velocity.size());
    const std::vector<double> measured = torque_of(base, run.velocity, run.period_s);
    const auto square = [&](const Eigen::VectorXd& error) {
      std::vector<double> asked = run.velocity;
      for (Eigen::Index i = 0; i < n; ++i) asked[static_cast<std::size_t>(i)] -= error[at + i];
      asked = torque_of(base, asked, run.period_s);
      double sum = 0;
      for (std::size_t i = 0; i < asked.size(); ++i) sum += std::pow(asked[i] - measured[i], 2);
      return sum;
    };
    square_before += square(before);
    square_after += square(after);
    at += n;
  }
  found.gap_before = std::sqrt(square_before / static_cast<double>(velocity.size()));
  found.gap_after = std::sqrt(square_after / static_cast<double>(velocity.size()));

  // The interval, from stretches that are fitted separately.
  constexpr std::size_t kGroups = 6;
  std::vector<double> alone;
  for (std::size_t group = 0; group < kGroups; ++group) {
    std::vector<Run> own;
    for (const Run& run : runs) {
      const auto cut = [&](const std::vector<double>& all) {
        const auto from = static_cast<std::ptrdiff_t>(all.size() * group / kGroups);
        const auto to = static_cast<std::ptrdiff_t>(all.size() * (group + 1) / kGroups);
        return std::vector<double>(all.begin() + from, all.begin() + to);
      };
      own.push_back({run.period_s, cut(run.command), cut(run.velocity)});
    }
    alone.push_back(finer_delay(own, velocities(own), late.response, std::max(0.0, delay_s - 3 * period_s),
                                delay_s + 3 * period_s));
  }
  double mean = 0;
  for (const double value : alone) mean += value / kGroups;
  double square = 0;
  for (const double value : alone) square += (value - mean) * (value - mean);
  const double half = std::max(
      0.5 * period_s, fit::student_975(kGroups - 1) * std::sqrt(square / (kGroups * (kGroups - 1.0))));
  found.parameters = {
      {.name = "delay_s", .value = delay_s, .lower = delay_s - half, .upper = delay_s + half}};
  return found;
}

}  // namespace identification::gap
