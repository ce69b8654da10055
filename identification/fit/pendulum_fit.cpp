#include "identification/fit/pendulum_fit.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "identification/fit/least_squares.h"
#include "model/friction/stribeck_curve.h"

namespace identification::fit {
namespace {

constexpr double kAlwaysEnabled[] = {1.0};

bool positive(double value) { return value > 0 && std::isfinite(value); }

/// The columns of a run, once checked. Views: the recording outlives it.
struct Rows {
  std::span<const double> time_s;
  std::span<const double> command_rad;
  std::span<const double> position_rad;
  std::span<const double> enabled;  ///< one entry when it never changes
  double duty_per_rad;
};

Rows checked_rows(const PendulumRun& run) {
  const Recording& recording = run.recording;
  const Rows rows{
      recording.column("time_s"), recording.column("position_command_rad"), recording.column("position_rad"),
      recording.has("drive_enabled") ? recording.column("drive_enabled") : kAlwaysEnabled, run.duty_per_rad};
  const std::string where = "pendulum of " + (recording.rig.empty() ? "an unnamed rig" : recording.rig) +
                            (recording.experiment.empty() ? "" : ", " + recording.experiment) + ": ";
  if (rows.time_s.size() < 2)
    throw std::invalid_argument(where + std::to_string(rows.time_s.size()) + " rows; 2 are the least");
  for (std::size_t i = 1; i < rows.time_s.size(); ++i)
    if (!positive(rows.time_s[i] - rows.time_s[i - 1]))
      throw std::invalid_argument(where + "time_s does not rise at row " + std::to_string(i));
  if (!positive(run.duty_per_rad))
    throw std::invalid_argument(where + "duty_per_rad must be a positive number, it is " +
                                std::to_string(run.duty_per_rad));
  return rows;
}

std::vector<Rows> checked_rows(std::span<const PendulumRun> runs) {
  if (runs.empty()) throw std::invalid_argument("pendulum: there is no run");
  std::vector<Rows> rows;
  for (const PendulumRun& run : runs) rows.push_back(checked_rows(run));
  return rows;
}

void require_valid(const PendulumRig& rig) {
  if (!positive(rig.mass_kg) || !positive(rig.length_m) || !positive(rig.gravity_m_per_s2) ||
      !positive(rig.supply_V))
    throw std::invalid_argument("pendulum rig: mass, length, gravity and supply must be positive numbers");
  if (!(rig.resistance_ohm >= 0 && std::isfinite(rig.resistance_ohm)))
    throw std::invalid_argument("pendulum rig: the resistance must be a positive number, or 0 to fit it");
}

void require_step(double longest_step_s) {
  if (!positive(longest_step_s))
    throw std::invalid_argument("pendulum: the step must be a positive number of seconds");
}

/// A column between its rows, read at times that rise.
class Interpolation {
 public:
  Interpolation(std::span<const double> time_s, std::span<const double> values)
      : time_s_(time_s), values_(values) {}

  double at(double t_s) {
    if (values_.size() == 1 || t_s <= time_s_.front()) return values_.front();
    while (next_ < time_s_.size() && time_s_[next_] <= t_s) ++next_;
    if (next_ == time_s_.size()) return values_.back();
    const double share = (t_s - time_s_[next_ - 1]) / (time_s_[next_] - time_s_[next_ - 1]);
    return values_[next_ - 1] + share * (values_[next_] - values_[next_ - 1]);
  }

 private:
  std::span<const double> time_s_;
  std::span<const double> values_;
  std::size_t next_ = 1;
};

/// The equations of PendulumParameters, one step at a time.
class Joint {
 public:
  Joint(const PendulumRig& rig, const PendulumParameters& p, double duty_per_rad, double position_rad)
      : p_(p),
        level_(p),
        duty_per_rad_(duty_per_rad),
        supply_V_(rig.supply_V),
        weight_Nm_(rig.mass_kg * rig.gravity_m_per_s2 * rig.length_m),
        load_inertia_kg_m2_(rig.mass_kg * rig.length_m * rig.length_m),
        inertia_kg_m2_(load_inertia_kg_m2_ + p.armature_kg_m2),
        position_rad_(position_rad) {}

  double position_rad() const { return position_rad_; }

  /// Half a step of drift, all torques, half a step of drift: second order, and friction as an impulse that
  /// stops the joint at most, so that rest is an exact zero and needs no band. [Moreau's midpoint rule]
  /// `enabled` may be a share of the step.
  void step(double command_rad, double enabled, double h_s) {
    position_rad_ += 0.5 * h_s * velocity_rad_per_s_;
    const double duty = std::clamp(duty_per_rad_ * (command_rad - position_rad_), -1.0, 1.0);
    const double torque_per_V = enabled * p_.torque_constant_Nm_per_A / p_.resistance_ohm;
    const double drive_Nm = torque_per_V * duty * supply_V_;
    const double back_emf = torque_per_V * p_.torque_constant_Nm_per_A;
    const double external_Nm = -weight_Nm_ * std::sin(position_rad_);
    const double friction_Nm = friction(drive_Nm - back_emf * velocity_rad_per_s_, external_Nm);

    const double half_damping = 0.5 * h_s * (back_emf + p_.viscous_Nm_s_per_rad) / inertia_kg_m2_;
    const double per_Nm = h_s / inertia_kg_m2_ / (1 + half_damping);
    const double unhindered =
        velocity_rad_per_s_ * (1 - half_damping) / (1 + half_damping) + per_Nm * (drive_Nm + external_Nm);
    velocity_rad_per_s_ =
        std::copysign(std::max(0.0, std::abs(unhindered) - per_Nm * friction_Nm), unhindered);
    position_rad_ += 0.5 * h_s * velocity_rad_per_s_;
  }

 private:
  double friction(double motor_Nm, double external_Nm) const {
    const double load_Nm =
        std::abs(load_inertia_kg_m2_ * motor_Nm - p_.armature_kg_m2 * external_Nm) / inertia_kg_m2_;
    return level_.level_Nm(velocity_rad_per_s_) + (p_.load_share + p_.load_share_per_Nm * load_Nm) * load_Nm;
  }

  PendulumParameters p_;
  model::friction::StribeckCurve level_;
  double duty_per_rad_;
  double supply_V_;
  double weight_Nm_;
  double load_inertia_kg_m2_;
  double inertia_kg_m2_;
  double position_rad_;
  double velocity_rad_per_s_ = 0;
};

void simulate(const Rows& rows, const PendulumRig& rig, const PendulumParameters& parameters,
              double longest_step_s, std::vector<double>& position_rad) {
  Interpolation command(rows.time_s, rows.command_rad);
  Interpolation enabled(rows.time_s, rows.enabled);
  Joint joint(rig, parameters, rows.duty_per_rad, rows.position_rad.front());
  position_rad.resize(rows.time_s.size());
  position_rad[0] = joint.position_rad();
  for (std::size_t i = 1; i < rows.time_s.size(); ++i) {
    const double from_s = rows.time_s[i - 1];
    const double steps = std::ceil((rows.time_s[i] - from_s) / longest_step_s);
    const double h_s = (rows.time_s[i] - from_s) / steps;
    for (double k = 0.5; k < steps; ++k) {
      const double middle_s = from_s + k * h_s;
      joint.step(command.at(middle_s), enabled.at(middle_s), h_s);
    }
    position_rad[i] = joint.position_rad();
  }
}

double mean_error_rad(const std::vector<Rows>& runs, const PendulumRig& rig,
                      const PendulumParameters& parameters, double longest_step_s) {
  std::vector<double> simulated;
  double sum = 0;
  for (const Rows& rows : runs) {
    simulate(rows, rig, parameters, longest_step_s, simulated);
    double of_run = 0;
    for (std::size_t i = 0; i < simulated.size(); ++i)
      of_run += std::abs(simulated[i] - rows.position_rad[i]);
    sum += of_run / static_cast<double>(simulated.size());
  }
  return sum / static_cast<double>(runs.size());
}

// ---------------------------------------------------------------------------------------------------- fit

// Where a stage only serves the next as a start, and at the end: far below what one more run would change.
constexpr double kRoughly = 1e-2;
constexpr double kClosely = 1e-5;

/// A coordinate of the search. Bounds are far outside of what small geared servos are.
struct Coordinate {
  const char* name;
  double PendulumParameters::*in;
  double start, lower, upper;
  double scale;
};
constexpr Coordinate kTorqueConstant{
    "torque_constant_Nm_per_A", &PendulumParameters::torque_constant_Nm_per_A, 0.3, 0.01, 10, 0.3};
constexpr Coordinate kResistance{"resistance_ohm", &PendulumParameters::resistance_ohm, 3, 0.1, 100, 3};
constexpr Coordinate kArmature{"armature_kg_m2", &PendulumParameters::armature_kg_m2, 2e-3, 1e-6, 1, 2e-3};
constexpr Coordinate kCoulomb{"coulomb_Nm", &PendulumParameters::coulomb_Nm, 0.02, 0, 10, 0.02};
constexpr Coordinate kViscous{
    "viscous_Nm_s_per_rad", &PendulumParameters::viscous_Nm_s_per_rad, 0.01, 0, 10, 0.01};
constexpr Coordinate kLoad{"load_share", &PendulumParameters::load_share, 0.1, 0, 2, 0.1};
constexpr Coordinate kLoadQuadratic{
    "load_share_per_Nm", &PendulumParameters::load_share_per_Nm, 0.1, 0, 100, 0.1};
// While it is searched for, this one is Fs − Fc: bounds are a box, and Fs is not to fall below Fc.
constexpr Coordinate kStatic{"static_Nm", &PendulumParameters::static_Nm, 0.01, 0, 10, 0.01};
constexpr Coordinate kStribeckVelocity{
    "stribeck_velocity_rad_per_s", &PendulumParameters::stribeck_velocity_rad_per_s, 1, 0.02, 20, 1};

/// Names what is searched for, and turns a point of the search into parameters and back.
class Coordinates {
 public:
  explicit Coordinates(double resistance_ohm) { fixed_.resistance_ohm = resistance_ohm; }
  void add(const Coordinate& coordinate) { list_.push_back(coordinate); }
  const std::vector<Coordinate>& list() const { return list_; }
  Eigen::Index size() const { return static_cast<Eigen::Index>(list_.size()); }

  PendulumParameters parameters(const Eigen::VectorXd& at) const {
    PendulumParameters p = fixed_;
    p.static_Nm = 0;
    for (std::size_t k = 0; k < list_.size(); ++k) p.*list_[k].in = at[static_cast<Eigen::Index>(k)];
    p.static_Nm += p.coulomb_Nm;
    return p;
  }
  /// `point` of fewer coordinates, continued with the starts of the new ones.
  Eigen::VectorXd continued(const Eigen::VectorXd& point) const {
    Eigen::VectorXd result(size());
    for (Eigen::Index k = 0; k < size(); ++k)
      result[k] = k < point.size() ? point[k] : list_[static_cast<std::size_t>(k)].start;
    return result;
  }
  template <class Get>
  Eigen::VectorXd each(Get get) const {
    Eigen::VectorXd result(size());
    for (Eigen::Index k = 0; k < size(); ++k) result[k] = get(list_[static_cast<std::size_t>(k)]);
    return result;
  }

 private:
  PendulumParameters fixed_;
  std::vector<Coordinate> list_;
};

class PendulumSearch {
 public:
  PendulumSearch(const std::vector<Rows>& runs, const PendulumRig& rig, const PendulumFitOptions& options)
      : runs_(runs), rig_(rig), options_(options) {}

  LeastSquaresSolution from(const Coordinates& coordinates, const std::vector<Eigen::VectorXd>& starts,
                            double tolerance) {
    LeastSquaresProblem problem;
    problem.residuals = runs_.size() * options_.rows_per_run;
    problem.lower = coordinates.each([](const Coordinate& c) { return c.lower; });
    problem.upper = coordinates.each([](const Coordinate& c) { return c.upper; });
    problem.scale = coordinates.each([](const Coordinate& c) { return c.scale; });
    problem.huber = 1;
    problem.max_iterations = 60;
    problem.tolerance = tolerance;
    problem.evaluate = [&](const Eigen::VectorXd& at, Eigen::VectorXd& residuals) {
      compare(coordinates.parameters(at), residuals);
    };
    return minimise(problem, starts);
  }

 private:
  void compare(const PendulumParameters& parameters, Eigen::VectorXd& residuals) {
    Eigen::Index next = 0;
    for (const Rows& rows : runs_) {
      simulate(rows, rig_, parameters, options_.longest_step_s, simulated_);
      for (std::size_t k = 0; k < options_.rows_per_run; ++k) {
        const std::size_t i = k * rows.time_s.size() / options_.rows_per_run;
        residuals[next++] = (simulated_[i] - rows.position_rad[i]) / options_.outlier_rad;
      }
    }
  }

  const std::vector<Rows>& runs_;
  const PendulumRig& rig_;
  const PendulumFitOptions& options_;
  std::vector<double> simulated_;
};

/// What each stage adds to the one before.
std::vector<std::vector<Coordinate>> stages(const PendulumRig& rig, const PendulumFitOptions& options) {
  std::vector<std::vector<Coordinate>> result{{kTorqueConstant, kArmature, kCoulomb, kViscous}};
  if (rig.resistance_ohm == 0) result.front().push_back(kResistance);
  if (options.friction.load) result.push_back({kLoad});
  if (options.friction.load_quadratic) result.push_back({kLoadQuadratic});
  if (options.friction.stribeck) result.push_back({kStatic, kStribeckVelocity});
  return result;
}

/// Starts of a stage: all that is new at a small value. Where the joint sticks, the error is no smooth
/// function of Coulomb's torque, and minima lie on both sides of the best; what is new may also take over
/// from it. So it starts again from a quarter. Stribeck's velocity has a valley at each order of magnitude.
std::vector<Eigen::VectorXd> starts(const Coordinates& coordinates, const Eigen::VectorXd& before) {
  std::vector<Eigen::VectorXd> result(2, coordinates.continued(before));
  const auto& list = coordinates.list();
  for (std::size_t k = 0; k < list.size(); ++k)
    if (list[k].in == kCoulomb.in) result[1][static_cast<Eigen::Index>(k)] *= 0.25;
  if (list.back().in == kStribeckVelocity.in) {
    result.push_back(result.front());
    result.back()[coordinates.size() - 1] *= 0.2;
  }
  return result;
}

std::vector<Estimate> estimates(const Coordinates& coordinates, const LeastSquaresSolution& solution,
                                std::size_t runs) {
  std::vector<Estimate> result;
  const PendulumParameters parameters = coordinates.parameters(solution.parameters);
  for (const Coordinate& c : coordinates.list())
    result.push_back({.name = c.name, .value = parameters.*c.in});
  const auto parameter_count = coordinates.list().size();
  if (runs <= parameter_count) return result;

  // As the minimum has it: an error that counts by magnitude has the weight outlier/|error|.
  const Eigen::VectorXd weight = solution.residuals.cwiseAbs().cwiseMax(1).cwiseInverse().cwiseSqrt();
  Eigen::MatrixXd jacobian = weight.asDiagonal() * solution.jacobian;
  // Fs − Fc was searched for: ∂/∂Fc at constant Fs is ∂/∂Fc − ∂/∂(Fs − Fc).
  const auto& list = coordinates.list();
  const auto column = [&](const Coordinate& wanted) {
    return std::find_if(list.begin(), list.end(), [&](const Coordinate& c) { return c.in == wanted.in; }) -
           list.begin();
  };
  if (column(kStatic) < coordinates.size()) jacobian.col(column(kCoulomb)) -= jacobian.col(column(kStatic));
  const Eigen::MatrixXd covariance =
      block_covariance(jacobian, weight.cwiseProduct(solution.residuals), runs);
  const double t = student_975(static_cast<double>(runs - parameter_count));
  for (Eigen::Index k = 0; k < coordinates.size(); ++k) {
    Estimate& estimate = result[static_cast<std::size_t>(k)];
    estimate.lower = estimate.value - t * std::sqrt(covariance(k, k));
    estimate.upper = estimate.value + t * std::sqrt(covariance(k, k));
  }
  return result;
}

}  // namespace

const Estimate& PendulumFit::estimate(std::string_view name) const {
  const auto found =
      std::find_if(estimates.begin(), estimates.end(), [&](const Estimate& e) { return e.name == name; });
  if (found == estimates.end())
    throw std::invalid_argument("pendulum fit: there is no parameter " + std::string(name));
  return *found;
}

std::vector<double> simulate_pendulum(const PendulumRun& run, const PendulumRig& rig,
                                      const PendulumParameters& parameters, double longest_step_s) {
  const Rows rows = checked_rows(run);
  require_valid(rig);
  require_step(longest_step_s);
  if (!positive(parameters.resistance_ohm) || !(parameters.armature_kg_m2 >= 0))
    throw std::invalid_argument("pendulum: the resistance must be positive, the armature not negative");
  std::vector<double> position_rad;
  simulate(rows, rig, parameters, longest_step_s, position_rad);
  return position_rad;
}

double pendulum_error_rad(std::span<const PendulumRun> runs, const PendulumRig& rig,
                          const PendulumParameters& parameters, double longest_step_s) {
  require_valid(rig);
  require_step(longest_step_s);
  return mean_error_rad(checked_rows(runs), rig, parameters, longest_step_s);
}

PendulumFit fit_pendulum(std::span<const PendulumRun> runs, const PendulumRig& rig,
                         const PendulumFitOptions& options) {
  require_valid(rig);
  require_step(options.longest_step_s);
  if (!positive(options.outlier_rad))
    throw std::invalid_argument("pendulum fit: the outlier bound must be a positive number of rad");
  const std::vector<Rows> rows = checked_rows(runs);
  for (const Rows& run : rows)
    if (options.rows_per_run == 0 || run.time_s.size() < options.rows_per_run)
      throw std::invalid_argument("pendulum fit: a run of " + std::to_string(run.time_s.size()) +
                                  " rows cannot be compared at " + std::to_string(options.rows_per_run));

  PendulumSearch search(rows, rig, options);
  Coordinates coordinates(rig.resistance_ohm);
  LeastSquaresSolution solution;
  for (const auto& stage : stages(rig, options)) {
    for (const Coordinate& c : stage) coordinates.add(c);
    solution = search.from(coordinates, starts(coordinates, solution.parameters), kRoughly);
  }
  solution = search.from(coordinates, {solution.parameters}, kClosely);
  PendulumFit fit;
  fit.parameters = coordinates.parameters(solution.parameters);
  fit.estimates = estimates(coordinates, solution, runs.size());
  fit.mean_absolute_error_rad = mean_error_rad(rows, rig, fit.parameters, options.longest_step_s);
  fit.converged = solution.converged;
  return fit;
}

}  // namespace identification::fit
