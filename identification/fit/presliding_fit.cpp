#include "identification/fit/presliding_fit.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <span>
#include <stdexcept>
#include <utility>

#include "identification/fit/least_squares.h"
#include "identification/fit/sampling.h"
#include "model/friction/lugre.h"

namespace identification::fit {
namespace {

using model::friction::LuGre;

constexpr double kMinSteps = 20;        // of the encoder
constexpr double kLargestOffset = 0.1;  // of the static friction
constexpr std::pair<const char*, const char*> kNames[] = {{"presliding", "stiffness_Nm_per_rad"},
                                                          {"presliding", "damping_Nm_s_per_rad"},
                                                          {"torque_offset", "torque_Nm"},
                                                          {"", "position_offset_rad"}};

std::string three_digits(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

double largest(std::span<const double> values) {
  double most = 0;
  for (const double value : values) most = std::max(most, std::abs(value));
  return most;
}

/// The smallest step between different positions.
double resolution_of(std::span<const double> position) {
  std::vector<double> sorted(position.begin(), position.end());
  std::sort(sorted.begin(), sorted.end());
  const double rounding = 1e-12 * std::max(std::abs(sorted.front()), std::abs(sorted.back()));
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < sorted.size(); ++i)
    if (const double step = sorted[i] - sorted[i - 1]; step > rounding) least = std::min(least, step);
  return std::isfinite(least) ? least : 0;
}

/// Why the torque does not allow the fit; empty if it does.
std::string torque_obstacle(const Recording& recording, std::span<const double> torque, double static_Nm) {
  const double most = largest(torque);
  const auto [low, high] = std::minmax_element(torque.begin(), torque.end());
  if (!(*low<-0.1 * most&& * high> 0.1 * most))
    return "the torque never reverses (" + three_digits(*low) + " to " + three_digits(*high) +
           " N·m); stiffness and damping show at reversals of the motion";

  if (recording.has("torque_command_Nm") && recording.has("torque_measured_Nm")) {
    const auto command = recording.column("torque_command_Nm");
    const double range = largest(command);
    std::vector<double> wanted;
    std::vector<double> delivered;
    for (std::size_t i = 0; i < command.size(); ++i) {
      if (std::abs(command[i]) > 0.25 * range) continue;
      wanted.push_back(std::abs(command[i]));
      delivered.push_back(std::abs(torque[i]));
    }
    const double offset = median(delivered);
    if (offset - median(wanted) > kLargestOffset * static_Nm)
      return "the motor delivers about " + three_digits(offset) +
             " N·m where less is commanded: " + three_digits(100 * offset / static_Nm) +
             " % of the static friction, so the torque jumps at each reversal, where stiffness and damping "
             "show";
    double square = 0;
    for (std::size_t i = 0; i < command.size(); ++i)
      square += (torque[i] - command[i]) * (torque[i] - command[i]);
    const double off = std::sqrt(square / static_cast<double>(command.size()));
    if (off > kLargestOffset * static_Nm)
      return "the delivered torque differs from the commanded one by " + three_digits(off) +
             " N·m rms, more than a tenth of the static friction";
  }
  // A torque that passes through zero has values near it; one that jumps over it does not.
  std::size_t small = 0;
  for (const double value : torque) small += std::abs(value) < kLargestOffset * static_Nm ? 1 : 0;
  if (200 * small < torque.size())
    return "the torque jumps over zero: hardly any sample is below " +
           three_digits(kLargestOffset * static_Nm) + " N·m; stiffness and damping show at reversals";
  return {};
}

/// Simulated position of a joint with these parameters under the torque.
class Simulation {
 public:
  Simulation(std::span<const double> torque, double period_s, const PreslidingFitOptions& options)
      : torque_(torque), period_s_(period_s), options_(options) {}

  void run(double stiffness, double damping, double offset_Nm, double start_rad,
           Eigen::VectorXd& position) const {
    const LuGre law({.coulomb_Nm = options_.sliding.coulomb_Nm,
                     .static_Nm = options_.sliding.static_Nm,
                     .stribeck_velocity_rad_per_s = options_.sliding.stribeck_velocity_rad_per_s,
                     .stribeck_exponent = options_.sliding.stribeck_exponent,
                     .stiffness_Nm_per_rad = stiffness,
                     .damping_Nm_s_per_rad = damping,
                     .viscous_Nm_s_per_rad = options_.sliding.viscous_Nm_s_per_rad});
    // A fiftieth of the longest stable step, where its first-order error is below a percent of σ1's effect.
    const double wanted = 0.02 * law.max_step_s(options_.inertia_kg_m2);
    const int steps = std::clamp(static_cast<int>(std::ceil(period_s_ / wanted)), 1, 200);
    const double h = period_s_ / steps;
    model::friction::State state;
    double x = start_rad;
    double v = 0;
    double friction = 0;
    for (std::size_t i = 0; i < torque_.size(); ++i) {
      position[static_cast<Eigen::Index>(i)] = x;
      for (int step = 0; step < steps; ++step) {
        v += h / options_.inertia_kg_m2 * (torque_[i] - offset_Nm - friction);
        friction = law.step(state, {.velocity_rad_per_s = v}, h);
        x += h * v;
      }
    }
  }

 private:
  std::span<const double> torque_;
  double period_s_;
  const PreslidingFitOptions& options_;
};

}  // namespace

PreslidingFit fit_presliding(const Recording& recording, const PreslidingFitOptions& options) {
  if (!(options.inertia_kg_m2 > 0 && std::isfinite(options.inertia_kg_m2)))
    throw std::invalid_argument("presliding fit: the inertia must be known, a positive number of kg·m²");
  const double period_s = even_period_s(recording);
  const std::span<const double> position = recording.column("position_rad");
  const std::span<const double> torque =
      recording.column(recording.has("torque_measured_Nm") ? "torque_measured_Nm" : "torque_command_Nm");

  PreslidingFit fit;
  const auto refuse_all = [&fit](const std::string& why) {
    fit.verdicts.push_back(why);
    for (const auto& [effect, name] : kNames)
      fit.parameters.push_back({.name = name, .not_identifiable = why, .effect = effect});
    return fit;
  };
  if (const std::string why = torque_obstacle(recording, torque, options.sliding.static_Nm); !why.empty())
    return refuse_all(why);
  const auto [low, high] = std::minmax_element(position.begin(), position.end());
  const double range = *high - *low;
  const double resolution = options.resolution_rad > 0 ? options.resolution_rad : resolution_of(position);
  if (!(range >= kMinSteps * resolution) || range == 0)
    return refuse_all("the encoder is too coarse: the joint moves " + three_digits(range) + " rad, " +
                      three_digits(resolution > 0 ? range / resolution : 0) + " steps of " +
                      three_digits(resolution) + " rad; 20 are the least");
  if (largest(torque) > options.sliding.static_Nm)
    fit.verdicts.emplace_back("the torque exceeds the static friction; errors of the sliding friction enter");

  const auto n = static_cast<Eigen::Index>(position.size());
  const Eigen::VectorXd measured = Eigen::Map<const Eigen::VectorXd>(position.data(), n);
  // For a rounded position; a fit to exact numbers also needs a scale.
  const double sigma = std::max(resolution / std::sqrt(12.0), 1e-6 * range);
  const Simulation simulation(torque, period_s, options);
  LeastSquaresProblem problem;
  problem.residuals = position.size();
  problem.max_iterations = 60;
  problem.tolerance = 1e-7;
  problem.evaluate = [&](const Eigen::VectorXd& p, Eigen::VectorXd& residuals) {
    simulation.run(std::exp(p[0]), std::exp(p[1]), p[2], p[3], residuals);
    residuals = (residuals - measured) / sigma;
  };
  // The contact yields, so its stiffness is at least the secant of the motion.
  const double secant = 2 * largest(torque) / range;
  const double most_Nm = largest(torque);
  problem.lower =
      Eigen::Vector4d(std::log(0.1 * secant), std::log(1e-8 * std::sqrt(options.inertia_kg_m2 * secant)),
                      -most_Nm, *low - range);
  problem.upper =
      Eigen::Vector4d(std::log(1e4 * secant), std::log(1e3 * std::sqrt(options.inertia_kg_m2 * secant)),
                      most_Nm, *high + range);
  problem.scale = Eigen::Vector4d(1, 1, most_Nm, range);
  struct Start {
    double cost;
    Eigen::VectorXd at;
  };
  std::vector<Start> starts;
  Eigen::VectorXd residuals(n);
  for (const double stiffness : {1.2 * secant, 2.5 * secant, 6 * secant, 20 * secant})
    for (const double damping : {0.02, 0.2, 1.0, 5.0}) {
      const Eigen::Vector4d at(std::log(stiffness),
                               std::log(damping * std::sqrt(options.inertia_kg_m2 * stiffness)), 0,
                               position[0]);
      problem.evaluate(at, residuals);
      starts.push_back({residuals.squaredNorm(), at});
    }
  std::sort(starts.begin(), starts.end(), [](const Start& a, const Start& b) { return a.cost < b.cost; });
  // Further starts only while the residual is larger than the encoder's steps explain.
  LeastSquaresSolution solution = minimise(problem, {starts[0].at});
  for (std::size_t i = 1; i < 3 && solution.cost > static_cast<double>(n); ++i)
    if (LeastSquaresSolution other = minimise(problem, {starts[i].at}); other.cost < solution.cost)
      solution = std::move(other);

  const Eigen::VectorXd error = solution.residuals * sigma;
  fit.rms_error_rad = std::sqrt(error.squaredNorm() / static_cast<double>(n));
  fit.relative_error_percent = 100 * error.norm() / (measured.array() - measured.mean()).matrix().norm();
  constexpr std::size_t kBlocks = 24;
  const Eigen::MatrixXd covariance = block_covariance(solution.jacobian, solution.residuals, kBlocks);
  const Eigen::MatrixXd white =
      normal_inverse(solution.jacobian) *
      std::max(solution.residuals.squaredNorm() / static_cast<double>(n - 4), 1e-12);
  const double t = student_975(kBlocks - 4.0);
  // The covariance is only local: a very different damping must leave clearly more.
  bool damping_matters = true;
  for (const double factor : {0.1, 10.0}) {
    LeastSquaresProblem other = problem;
    Eigen::VectorXd start = solution.parameters;
    start[1] = std::clamp(start[1] + std::log(factor), problem.lower[1] + 1e-6, problem.upper[1] - 1e-6);
    other.lower[1] = start[1] - 1e-6;
    other.upper[1] = start[1] + 1e-6;
    other.max_iterations = 20;
    damping_matters = damping_matters && minimise(other, {start}).cost > 1.05 * solution.cost;
  }
  for (Eigen::Index k = 0; k < 4; ++k) {
    const double half = t * std::sqrt(std::max(covariance(k, k), white(k, k)));
    const double value = solution.parameters[k];
    Estimate estimate{.name = kNames[k].second,
                      .value = value,
                      .lower = value - half,
                      .upper = value + half,
                      .effect = kNames[k].first};
    if (k < 2) {
      estimate.value = std::exp(value);
      estimate.lower = std::exp(value - half);
      estimate.upper = std::exp(value + half);
      const bool at_bound = value - problem.lower[k] < 0.01 || problem.upper[k] - value < 0.01;
      if (at_bound || half > std::log(2.0) || (k == 1 && !damping_matters))
        estimate.not_identifiable = k == 0 ? "the motion does not determine the stiffness"
                                           : "the motion does not excite the damping; use faster reversals";
    }
    if (!estimate.ok()) fit.verdicts.push_back(estimate.title() + ": " + estimate.not_identifiable);
    fit.parameters.push_back(std::move(estimate));
    if (k == 1)
      fit.parameters.push_back(
          {.name = "exponent", .value = 1, .not_identifiable = "given, LuGre's", .effect = "presliding"});
  }
  if (fit.relative_error_percent > 30)
    fit.verdicts.push_back("the law does not describe this motion: " +
                           three_digits(fit.relative_error_percent) + " % of it is left");
  return fit;
}

}  // namespace identification::fit
