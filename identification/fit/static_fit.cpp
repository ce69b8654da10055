#include "identification/fit/static_fit.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numeric>
#include <optional>
#include <set>
#include <span>
#include <stdexcept>
#include <utility>

#include "identification/fit/least_squares.h"
#include "model/effects/basis.h"
#include "model/effects/effect_chain.h"
#include "model/friction/any_law.h"

namespace identification::fit {
namespace {

using model::effects::AnyEffect;
using model::effects::EffectChain;
using model::effects::sliding_torque_Nm;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Share of a Stribeck peak.
constexpr double kUnseen = 1e-9;

std::string four_digits(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

/// The same in both directions except for the sign.
bool is_even(std::string_view effect) { return effect != "torque_offset" && effect != "direction_asymmetry"; }

/// One parameter of the form: identity, bounds, whether it is fitted.
struct Slot {
  EffectParameter parameter;
  bool curved = false;  ///< of an effect with a shape, in which the torque is not linear
  double lower = 0;
  double upper = 0;
  double initial = 0;
  std::string fixed_because{};  ///< empty: free
};

/// The form as numbers: all parameters → effects.
class Model {
 public:
  explicit Model(const StaticForm& form) : effects_(form.effects) {
    for (const AnyEffect& effect : effects_) {
      const auto& described = model::effects::description_of(effect);
      const std::vector<double> values = model::effects::values_of(effect);
      const bool curved = model::effects::amplitudes_of(effect).size() < values.size();
      for (std::size_t i = 0; i < values.size(); ++i) {
        const auto& row = described.parameters[i];
        Slot slot{{described.name, row.name}, curved, row.lower, row.upper, values[i]};
        if (std::ranges::find(form.given, slot.parameter) != form.given.end())
          slot.fixed_because = slot.parameter == terms::kConstantAsymmetry
                                   ? "given as zero: in a map it is the same as a torque offset"
                                   : "given, not fitted";
        // A map has too few slow speeds to distinguish a tail from an exponent.
        if (slot.parameter == terms::kStribeckTail) slot.fixed_because = "given, not fitted";
        slots_.push_back(std::move(slot));
      }
    }
    coulomb_ = index(terms::kCoulomb);
    static_ = index(terms::kStribeck);
    velocity_ = index(terms::kStribeckVelocity);
    exponent_ = index(terms::kStribeckExponent);
    tail_ = index(terms::kStribeckTail);
  }

  std::vector<Slot>& slots() { return slots_; }
  const std::vector<Slot>& slots() const { return slots_; }
  std::optional<std::size_t> index(const EffectParameter& parameter) const {
    for (std::size_t i = 0; i < slots_.size(); ++i)
      if (slots_[i].parameter == parameter) return i;
    return std::nullopt;
  }
  /// Friction at rest is not below sliding friction, and a peak that ends before the slowest speed of the map
  /// is invisible: then there is no Stribeck effect, and both levels are equal. Returns whether that was so.
  bool level_off(std::vector<double>& values, double slowest_rad_per_s) const {
    if (!coulomb_ || !static_ || !slots_[*static_].fixed_because.empty()) return false;
    const double share = model::effects::Stribeck::shape(slowest_rad_per_s, values[*velocity_],
                                                         values[*exponent_], values[*tail_]);
    if (values[*static_] > values[*coulomb_] && share > kUnseen) return false;
    values[*static_] = values[*coulomb_];
    return true;
  }

  std::vector<AnyEffect> effects(std::span<const double> values) const {
    std::vector<AnyEffect> result;
    for (const AnyEffect& effect : effects_) {
      const std::size_t count = model::effects::description_of(effect).parameters.size();
      result.push_back(model::effects::with_values(effect, values.first(count)));
      values = values.subspan(count);
    }
    return result;
  }
  EffectChain chain(std::span<const double> values) const { return EffectChain(effects(values)); }

 private:
  std::vector<AnyEffect> effects_;
  std::vector<Slot> slots_;
  std::optional<std::size_t> coulomb_;
  std::optional<std::size_t> static_;
  std::optional<std::size_t> velocity_;
  std::optional<std::size_t> exponent_;
  std::optional<std::size_t> tail_;
};

struct Point {
  std::size_t index;  // in the map
  double v;
  double tau;
  double variance;  // measured
};

class Fitter {
 public:
  Fitter(const StaticMap& map, const StaticForm& form, const StaticFitOptions& options)
      : map_(map), options_(options), model_(form) {
    fit_.form = form;
    fit_.leave_one_out_percent = std::numeric_limits<double>::quiet_NaN();
    for (std::size_t i = 0; i < map.points.size(); ++i) {
      const MapPoint& p = map.points[i];
      if (!std::isfinite(p.velocity_rad_per_s) || p.velocity_rad_per_s == 0 || !std::isfinite(p.torque_Nm) ||
          !(p.torque_ci95_Nm >= 0 && std::isfinite(p.torque_ci95_Nm)))
        throw std::invalid_argument("static fit: point " + std::to_string(i + 1) +
                                    " of the map is at rest or not a number");
      const double sigma = p.torque_ci95_Nm / 1.96;
      used_.push_back({i, p.velocity_rad_per_s, p.torque_Nm, sigma * sigma});
      largest_Nm_ = std::max(largest_Nm_, std::abs(p.torque_Nm));
    }
    every_point_ = used_;
    // Double precision of a torque; also for an exact map.
    least_variance_ = std::max(largest_Nm_ * largest_Nm_ * 1e-18, 1e-40);
  }

  StaticFit fit() {
    fix_what_the_map_cannot_show();
    if (!enough_speeds()) return std::move(fit_);
    starts_ = make_starts();
    if (options_.exclude_outliers) exclude_outliers();
    if (options_.left_out) leave_out_the_given();
    solve_with_scatter();
    // A profile that finds a lower sum of squares has left a local minimum.
    for (int attempt = 0; attempt < 4; ++attempt) {
      better_ = solution_;
      fit_.parameters.clear();
      describe();
      if (!(better_.cost < solution_.cost * (1 - 1e-6) - 1e-9)) break;
      solution_ = minimise(problem(used_, 0), {better_.parameters});
    }
    judge_stribeck();
    judge_directions();
    if (options_.leave_one_out) leave_one_out();
    return std::move(fit_);
  }

 private:
  std::vector<double> all_values(const Eigen::VectorXd& free) const {
    std::vector<double> values = base_;
    for (std::size_t k = 0; k < free_.size(); ++k) values[free_[k]] = free[static_cast<Eigen::Index>(k)];
    model_.level_off(values, slowest_);
    return values;
  }
  double scatter_variance() const { return scatter_ * scatter_; }
  double sigma(const Point& p) const {
    return std::sqrt(std::max(p.variance + scatter_variance(), least_variance_));
  }

  LeastSquaresProblem problem(const std::vector<Point>& points, double huber) const {
    LeastSquaresProblem result;
    result.residuals = points.size();
    const auto count = static_cast<Eigen::Index>(free_.size());
    result.lower.resize(count);
    result.upper.resize(count);
    result.scale.resize(count);
    const std::vector<Slot>& slots = model_.slots();
    for (Eigen::Index k = 0; k < count; ++k) {
      const Slot& slot = slots[free_[static_cast<std::size_t>(k)]];
      result.lower[k] = slot.lower;
      result.upper[k] = slot.upper;
      const bool torque = slot.parameter.name.find("Nm") != std::string_view::npos;
      result.scale[k] = torque ? largest_Nm_ / std::max(1.0, fastest_) : 1e-3;
    }
    result.huber = huber;
    result.evaluate = [this, &points](const Eigen::VectorXd& free, Eigen::VectorXd& residuals) {
      const EffectChain chain = model_.chain(all_values(free));
      for (std::size_t i = 0; i < points.size(); ++i) {
        const double torque = sliding_torque_Nm(chain, points[i].v);
        residuals[static_cast<Eigen::Index>(i)] = (torque - points[i].tau) / sigma(points[i]);
      }
    };
    return result;
  }

  void fix_what_the_map_cannot_show() {
    double slowest = kInfinity;
    bool forward = false;
    bool backward = false;
    for (const Point& p : used_) {
      (p.v > 0 ? forward : backward) = true;
      slowest = std::min(slowest, std::abs(p.v));
      fastest_ = std::max(fastest_, std::abs(p.v));
    }
    slowest_ = slowest;
    auto& slots = model_.slots();
    if (!forward || !backward)
      for (Slot& slot : slots)
        if (!is_even(slot.parameter.effect)) {
          slot.initial = 0;
          slot.fixed_because = "only one direction was measured";
        }
    for (const Slot& slot : slots) base_.push_back(std::clamp(slot.initial, slot.lower, slot.upper));
    // A parameter that affects no point, whatever the others are, needs another experiment.
    for (std::size_t i = 0; i < slots.size(); ++i) {
      if (!slots[i].fixed_because.empty()) continue;
      std::vector<double> moved = base_;
      bool matters = false;
      for (const double factor : {0.5, 0.99, 1.01, 2.0, 10.0}) {
        moved[i] =
            std::clamp(base_[i] == 0 ? factor - 0.75 : base_[i] * factor, slots[i].lower, slots[i].upper);
        const EffectChain before = model_.chain(base_);
        const EffectChain after = model_.chain(moved);
        for (const Point& p : used_)
          matters |= sliding_torque_Nm(before, p.v) != sliding_torque_Nm(after, p.v);
      }
      if (!matters) slots[i].fixed_because = "a map of sliding speeds does not depend on it";
    }
    for (std::size_t i = 0; i < slots.size(); ++i)
      if (slots[i].fixed_because.empty()) free_.push_back(i);
  }

  /// In one direction, an offset is a part of what brakes, and so is half the difference of both directions.
  void judge_directions() {
    const auto is_forward = [](const Point& p) { return p.v > 0; };
    const bool forward = std::ranges::all_of(used_, is_forward);
    if (!forward && !std::ranges::none_of(used_, is_forward)) return;
    const bool has_coulomb = model_.index(terms::kCoulomb).has_value();
    fit_.verdicts.push_back(
        std::string("only ") + (forward ? "positive" : "negative") +
        " speeds were measured: a torque offset, or friction that differs by direction, is " +
        (has_coulomb ? "part of the Coulomb torque" : "in the other terms") +
        " and not counted in its interval; measure the same speeds in the other direction, "
        "too");
  }

  bool enough_speeds() {
    std::set<long> magnitudes;
    for (const Point& p : used_) magnitudes.insert(std::lround(std::log(std::abs(p.v)) / 0.005));
    const std::size_t speeds = speeds_of(map_).size();
    std::size_t even = 0;  // parameters that only different speeds can separate
    for (const std::size_t k : free_) even += is_even(model_.slots()[k].parameter.effect) ? 1 : 0;
    const bool enough = speeds > free_.size() && magnitudes.size() >= even;
    if (enough) return true;
    const std::string why = "too few speeds: " + std::to_string(speeds) + " (" +
                            std::to_string(magnitudes.size()) + " without sign) for " +
                            std::to_string(free_.size()) + " parameters";
    fit_.verdicts.push_back(why + "; measure more or fit a simpler law");
    for (const Slot& slot : model_.slots())
      fit_.parameters.push_back({.name = std::string(slot.parameter.name),
                                 .not_identifiable = slot.fixed_because.empty() ? why : slot.fixed_because,
                                 .effect = std::string(slot.parameter.effect)});
    return false;
  }

  std::vector<Eigen::VectorXd> make_starts() {
    // Initial values: a Stribeck velocity within the map, levels from its two ends, and nothing else.
    double low = 0;
    double high = 0;
    double top = 0;
    for (const Point& p : used_) {
      const double level = std::abs(p.tau);
      if (std::abs(p.v) <= 1.01 * slowest_) low = std::max(low, level);
      if (std::abs(p.v) >= 0.99 * fastest_) top = std::max(top, level);
      high = std::max(high, level);
    }
    double least = high;
    for (const Point& p : used_) least = std::min(least, std::abs(p.tau));
    std::vector<Eigen::VectorXd> starts;
    const int steps = model_.index(terms::kStribeckVelocity) ? 6 : 1;
    for (int step = 0; step < steps; ++step)
      for (const double exponent : {1.0, 2.0}) {
        std::vector<double> values = base_;
        for (const std::size_t k : free_) values[k] = std::max(0.0, model_.slots()[k].lower);
        const auto set = [&](const EffectParameter& parameter, double value) {
          if (const auto i = model_.index(parameter); i && model_.slots()[*i].fixed_because.empty())
            values[*i] = std::clamp(value, model_.slots()[*i].lower, model_.slots()[*i].upper);
        };
        set(terms::kCoulomb, 0.9 * least);
        set(terms::kStribeck, 1.2 * low);
        set(terms::kStribeckExponent, exponent);
        set(terms::kViscous, std::max(0.0, top - least) / fastest_);
        set(terms::kStribeckVelocity, slowest_ * std::pow(fastest_ / slowest_, step / 6.0 + 0.05));
        Eigen::VectorXd start(static_cast<Eigen::Index>(free_.size()));
        for (std::size_t k = 0; k < free_.size(); ++k) start[static_cast<Eigen::Index>(k)] = values[free_[k]];
        starts.push_back(start);
        if (!model_.index(terms::kStribeckExponent)) break;
      }
    return starts;
  }

  /// The scatter at which `size` of the residuals [N·m], divided by their sigma, is 1; 0 if it is less than
  /// that without any.
  template <class Size>
  double scatter_for(const Eigen::VectorXd& residuals_Nm, const Size& size) const {
    const auto excess = [&](double scatter) {
      Eigen::VectorXd scaled = residuals_Nm;
      for (std::size_t i = 0; i < used_.size(); ++i)
        scaled[static_cast<Eigen::Index>(i)] /=
            std::sqrt(std::max(used_[i].variance + scatter * scatter, least_variance_));
      return size(scaled) - 1;
    };
    if (excess(0) <= 0) return 0;
    double below = 0;
    double above = std::max(residuals_Nm.cwiseAbs().maxCoeff(), std::sqrt(least_variance_)) * 10;
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (below + above);
      (excess(middle) > 0 ? below : above) = middle;
    }
    return above;
  }
  Eigen::VectorXd residuals_Nm(const LeastSquaresSolution& solution) const {
    Eigen::VectorXd result = solution.residuals;
    for (std::size_t i = 0; i < used_.size(); ++i) result[static_cast<Eigen::Index>(i)] *= sigma(used_[i]);
    return result;
  }

  double degrees_of_freedom() const {
    return std::max(1.0, static_cast<double>(used_.size()) - static_cast<double>(free_.size()));
  }

  void exclude_outliers() {
    const std::vector<Point> all = used_;
    const double n = static_cast<double>(all.size());
    const double share = std::sqrt(n / degrees_of_freedom());
    scatter_ = 0.1 * largest_Nm_;
    LeastSquaresSolution solution = minimise(problem(used_, 1.5), starts_);
    for (int i = 0; i < 8; ++i) {
      scatter_ = scatter_for(residuals_Nm(solution), [&](const Eigen::VectorXd& r) {
        return share * robust_sigma(std::vector<double>(r.begin(), r.end()));
      });
      solution = minimise(problem(used_, 1.5), {solution.parameters});
    }
    std::vector<Eigen::VectorXd> again = starts_;
    again.push_back(solution.parameters);
    solution = minimise(problem(used_, 1.5), again);

    // Accounts for the uncertain median of few residuals and for the maximum of many.
    const double limit = student_quantile(1 - 0.005 / n, std::max(3.0, degrees_of_freedom()));
    std::vector<Point> kept;
    std::vector<std::size_t> left_out;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const double off = std::abs(solution.residuals[static_cast<Eigen::Index>(i)]);
      if (off > limit)
        left_out.push_back(all[i].index);
      else
        kept.push_back(all[i]);
    }
    if (left_out.empty()) return;
    if (const std::string where = misfit(solution.residuals, limit); !where.empty()) {
      fit_.verdicts.push_back("the law does not describe this map " + where +
                              (options_.left_out ? "" : "; no point was left out"));
      return;
    }
    if (5 * left_out.size() > all.size() || kept.size() <= free_.size()) {
      fit_.verdicts.push_back("the law does not describe this map: " + std::to_string(left_out.size()) +
                              " of " + std::to_string(all.size()) + " points are far off" +
                              (options_.left_out ? "" : "; none was left out"));
      return;
    }
    fit_.outliers = std::move(left_out);
    used_ = std::move(kept);
  }

  /// Replaces the outliers found; only the verdicts about the law stay.
  void leave_out_the_given() {
    scatter_ = 0;
    fit_.outliers = *options_.left_out;
    used_.clear();
    for (std::size_t i = 0; i < every_point_.size(); ++i)
      if (std::ranges::find(fit_.outliers, i) == fit_.outliers.end()) used_.push_back(every_point_[i]);
  }

  /// Three neighbouring speeds that deviate to the same side are not chance; returns where, or empty.
  std::string misfit(const Eigen::VectorXd& residuals, double limit) const {
    std::vector<std::size_t> order(used_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return used_[a].v < used_[b].v; });
    std::string where;
    for (std::size_t from = 0, to = 0; from < order.size(); from = to) {
      const auto side = [&](std::size_t k) {
        const double r = residuals[static_cast<Eigen::Index>(order[k])];
        return std::abs(r) > limit ? std::copysign(1.0, r) : 0.0;
      };
      for (to = from + 1; to < order.size() && side(to) == side(from);) ++to;
      if (side(from) == 0 || to - from < 3) continue;
      where += (where.empty() ? "from " : ", from ") + four_digits(used_[order[from]].v) + " to " +
               four_digits(used_[order[to - 1]].v) + " rad/s";
    }
    return where;
  }

  void solve_with_scatter() {
    scatter_ = std::max(scatter_, 1e-3 * largest_Nm_);
    solution_ = minimise(problem(used_, 0), starts_);
    const double dof = degrees_of_freedom();
    for (int i = 0; i < 5; ++i) {
      const double before = scatter_;
      scatter_ = scatter_for(residuals_Nm(solution_),
                             [&](const Eigen::VectorXd& r) { return r.squaredNorm() / dof; });
      solution_ = minimise(problem(used_, 0), {solution_.parameters});
      if (std::abs(scatter_ - before) <= 1e-3 * before) break;
    }
  }

  void describe() {
    const std::vector<double> values = all_values(solution_.parameters);
    fit_.effects = model_.effects(values);
    fit_.scatter_Nm = scatter_;
    fit_.condition = condition_number(solution_.jacobian);
    Eigen::VectorXd measured(solution_.residuals.size());
    for (std::size_t i = 0; i < used_.size(); ++i) measured[static_cast<Eigen::Index>(i)] = used_[i].tau;
    fit_.relative_error_percent = relative_error_percent(measured, measured + residuals_Nm(solution_));

    const auto& slots = model_.slots();
    const double t = scatter_ > 0 ? student_975(degrees_of_freedom()) : student_975(1e9);
    const Eigen::MatrixXd covariance = normal_inverse(solution_.jacobian);
    const LeastSquaresProblem whole = problem(used_, 0);
    const double size = measured_size();
    for (std::size_t k = 0, next = 0; k < slots.size(); ++k) {
      Estimate estimate{.name = std::string(slots[k].parameter.name),
                        .value = values[k],
                        .effect = std::string(slots[k].parameter.effect)};
      if (!slots[k].fixed_because.empty()) {
        estimate.not_identifiable = slots[k].fixed_because;
        fit_.parameters.push_back(std::move(estimate));
        continue;
      }
      const auto column = static_cast<Eigen::Index>(next++);
      const double half = t * std::sqrt(std::max(0.0, covariance(column, column)));
      estimate.lower = std::max(slots[k].lower, estimate.value - half);
      estimate.upper = std::min(slots[k].upper, estimate.value + half);
      if (!(half * solution_.jacobian.col(column).norm() < size)) {
        estimate.not_identifiable = "this map cannot separate it from the other terms";
      } else if (options_.profile && (is_curved() || estimate.value - 1.5 * half < slots[k].lower)) {
        estimate.lower = profile_end(whole, covariance, column, -1, half, t);
        estimate.upper = profile_end(whole, covariance, column, +1, half, t);
        if (estimate.upper >= slots[k].upper)
          estimate.not_identifiable = "any value above " + four_digits(estimate.lower) + " fits this map";
      }
      fit_.parameters.push_back(std::move(estimate));
    }
  }

  /// Size of the torques in standard deviations: a term that may exceed the whole map is undetermined.
  double measured_size() const {
    double square = 0;
    for (const Point& p : used_) square += p.tau * p.tau / (sigma(p) * sigma(p));
    return std::sqrt(square);
  }
  /// Not linear in its parameters.
  bool is_curved() const {
    return std::ranges::any_of(free_, [this](std::size_t k) { return model_.slots()[k].curved; });
  }

  /// Where, going to one side, the sum of squares has risen by t² with all others refitted.
  double profile_end(const LeastSquaresProblem& whole, const Eigen::MatrixXd& covariance, Eigen::Index column,
                     int side, double half, double t) {
    const double start = solution_.parameters[column];
    const double bound = side > 0 ? whole.upper[column] : whole.lower[column];
    const Eigen::VectorXd along = covariance.col(column) / covariance(column, column);
    Eigen::VectorXd near = solution_.parameters;
    const auto rise = [&](double value) {
      LeastSquaresProblem pinned = whole;
      pinned.lower[column] = pinned.upper[column] = value;
      // From the last point, moving the others according to the covariance.
      const LeastSquaresSolution found =
          minimise_without(pinned, column, near + (value - near[column]) * along);
      near = found.parameters;
      if (found.cost < better_.cost) better_ = found;
      return 2 * (found.cost - solution_.cost) - t * t;
    };
    double inside = start;
    double step = std::isfinite(half) && half > 0 ? 0.4 * half : 0.1 * std::abs(start) + 1e-12;
    double outside = start;
    for (int i = 0; i<40; ++i, step *= i> 2 ? 2.0 : 1.0) {
      outside = side > 0 ? std::min(inside + step, bound) : std::max(inside - step, bound);
      if (rise(outside) > 0) break;
      if (outside == bound) return bound;
      inside = outside;
    }
    for (int i = 0; i < 8; ++i) {
      const double middle = 0.5 * (inside + outside);
      (rise(middle) > 0 ? outside : inside) = middle;
    }
    return 0.5 * (inside + outside);
  }
  /// `pinned` with the parameter of `column` removed from the search.
  static LeastSquaresSolution minimise_without(const LeastSquaresProblem& pinned, Eigen::Index column,
                                               const Eigen::VectorXd& from) {
    const Eigen::Index rest = from.size() - 1;
    const auto without = [&](const Eigen::VectorXd& v) {
      Eigen::VectorXd result(rest);
      result << v.head(column), v.tail(rest - column);
      return result;
    };
    const auto with = [&pinned, column, rest](const Eigen::VectorXd& v) {
      Eigen::VectorXd result(rest + 1);
      result << v.head(column), pinned.lower[column], v.tail(rest - column);
      return result;
    };
    LeastSquaresProblem smaller;
    smaller.residuals = pinned.residuals;
    smaller.lower = without(pinned.lower);
    smaller.upper = without(pinned.upper);
    smaller.scale = without(pinned.scale);
    smaller.evaluate = [&](const Eigen::VectorXd& v, Eigen::VectorXd& r) { pinned.evaluate(with(v), r); };
    LeastSquaresSolution solution = minimise(smaller, {without(from)});
    solution.parameters = with(solution.parameters);
    return solution;
  }

  Estimate* estimate(const EffectParameter& parameter) {
    const auto i = model_.index(parameter);
    return i && model_.slots()[*i].fixed_because.empty() ? &fit_.parameters[*i] : nullptr;
  }
  void judge_stribeck() {
    const auto velocity = model_.index(terms::kStribeckVelocity);
    const auto coulomb = model_.index(terms::kCoulomb);
    if (!velocity || !coulomb) return;
    std::vector<double> values = all_values(solution_.parameters);
    const double vs = values[*velocity];
    std::set<long> below;
    std::set<long> above;
    for (const Point& p : used_) {
      const double speed = std::abs(p.v);
      if (speed <= vs) below.insert(std::lround(std::log(speed) / 0.005));
      if (speed >= 1.5 * vs) above.insert(std::lround(std::log(speed) / 0.005));
    }
    std::string why;
    if (model_.level_off(values, slowest_))
      why = "friction does not fall as the joint begins to slide: there is no Stribeck effect";
    else if (!stribeck_matters())
      why = "without a Stribeck term the map is described as well";
    else if (below.empty())
      why = "no speed below the Stribeck velocity: the slowest is " + four_digits(slowest_) +
            ", it is about " + four_digits(vs) + " rad/s";
    const auto refuse = [&](const EffectParameter& parameter, const std::string& reason) {
      if (Estimate* const found = estimate(parameter); found != nullptr && found->ok())
        found->not_identifiable = reason;
    };
    if (!why.empty()) {
      fit_.verdicts.push_back(why);
      for (const EffectParameter& parameter :
           {terms::kStribeck, terms::kStribeckVelocity, terms::kStribeckExponent})
        refuse(parameter, why);
    } else if (above.empty()) {
      why = "no speed well above the Stribeck velocity: the fastest is " + four_digits(fastest_) +
            ", it is about " + four_digits(vs) + " rad/s";
      fit_.verdicts.push_back(why);
      for (const EffectParameter& parameter : {terms::kCoulomb, terms::kViscous, terms::kStribeckVelocity})
        refuse(parameter, why);
    }
    for (const EffectParameter& parameter : {terms::kStribeckVelocity, terms::kStribeckExponent})
      if (Estimate* const found = estimate(parameter);
          found != nullptr && found->ok() && found->upper > 10 * found->lower)
        found->not_identifiable =
            "this map allows anything from " + four_digits(found->lower) + " to " + four_digits(found->upper);
  }
  /// Whether the level at rest differs significantly from that of sliding, whatever the shape between them:
  /// the sum of squares without the difference, compared with the gain of three free parameters by chance in
  /// 1 of 20 maps.
  bool stribeck_matters() {
    if (estimate(terms::kStribeck) == nullptr) return true;
    const LeastSquaresProblem whole = problem(used_, 0);
    // Coulomb level for both, through static = coulomb.
    const std::size_t c = *model_.index(terms::kCoulomb);
    const std::size_t s = *model_.index(terms::kStribeck);
    const double coulomb_Nm = all_values(solution_.parameters)[c];
    LeastSquaresProblem level = whole;
    level.evaluate = [&](const Eigen::VectorXd& free, Eigen::VectorXd& residuals) {
      Eigen::VectorXd same = free;
      double value = coulomb_Nm;
      for (std::size_t k = 0; k < free_.size(); ++k)
        if (free_[k] == c) value = free[static_cast<Eigen::Index>(k)];
      for (std::size_t k = 0; k < free_.size(); ++k)
        if (free_[k] == s) same[static_cast<Eigen::Index>(k)] = value;
      whole.evaluate(same, residuals);
    };
    const double rise = 2 * (minimise(level, {solution_.parameters}).cost - solution_.cost);
    return rise > 7.81;  // chi-squared, 3 degrees of freedom, 95 %
  }

  void leave_one_out() {
    std::vector<bool> out(map_.points.size(), false);
    for (const std::size_t i : fit_.outliers) out[i] = true;
    Eigen::VectorXd measured = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(map_.points.size()));
    Eigen::VectorXd predicted = measured;
    for (const std::vector<std::size_t>& speed : speeds_of(map_)) {
      std::vector<Point> rest;
      for (const Point& p : used_)
        if (std::find(speed.begin(), speed.end(), p.index) == speed.end()) rest.push_back(p);
      if (rest.size() == used_.size()) continue;  // all of them outliers
      const EffectChain chain =
          model_.chain(all_values(minimise(problem(rest, 0), {solution_.parameters}).parameters));
      for (const std::size_t i : speed) {
        if (out[i]) continue;
        const double v = map_.points[i].velocity_rad_per_s;
        measured[static_cast<Eigen::Index>(i)] = map_.points[i].torque_Nm;
        predicted[static_cast<Eigen::Index>(i)] = sliding_torque_Nm(chain, v);
      }
    }
    fit_.leave_one_out_percent = relative_error_percent(measured, predicted);
  }

  const StaticMap& map_;
  const StaticFitOptions& options_;
  Model model_;
  StaticFit fit_;
  std::vector<Point> used_;
  std::vector<Point> every_point_;
  std::vector<double> base_;       // all parameters; the free ones at their initial values
  std::vector<std::size_t> free_;  // which are fitted
  double scatter_ = 0;
  double largest_Nm_ = 0;
  double least_variance_ = 0;
  double slowest_ = 0;
  double fastest_ = 0;
  std::vector<Eigen::VectorXd> starts_;
  LeastSquaresSolution solution_;
  LeastSquaresSolution better_;  // the best of any profile
};

}  // namespace

StaticForm& StaticForm::add(std::string_view effect) {
  effects.push_back(model::effects::make_effect(effect));
  if (effect == terms::kConstantAsymmetry.effect) given.push_back(terms::kConstantAsymmetry);
  return *this;
}

StaticForm& StaticForm::give(const EffectParameter& parameter, double value) {
  for (AnyEffect& effect : effects) {
    const auto& described = model::effects::description_of(effect);
    if (described.name != parameter.effect) continue;
    std::vector<double> values = model::effects::values_of(effect);
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (described.parameters[i].name != parameter.name) continue;
      values[i] = value;
      effect = model::effects::with_values(effect, values);
      given.push_back({described.name, described.parameters[i].name});
      return *this;
    }
  }
  throw std::invalid_argument("static fit: the form has no parameter " + std::string(parameter.effect) + " " +
                              std::string(parameter.name));
}

std::optional<StaticForm> form_of_law(const model::friction::LawDescription& law) {
  const auto has = [&](std::string_view name) {
    return std::ranges::find(law.parameters, name, &model::friction::ParameterDescription::name) !=
           law.parameters.end();
  };
  if (has("static_excess_Nm")) return {};  // Armstrong's peak has its own shape
  StaticForm form;
  if (has("coulomb_Nm")) form.add("coulomb");
  if (has("viscous_Nm_s_per_rad")) form.add("viscous");
  if (has("static_Nm") && has("stribeck_velocity_rad_per_s")) form.add("stribeck");
  if (form.effects.empty()) return {};
  if (has("stiffness_Nm_per_rad")) form.add("presliding");
  return form;
}

StaticForm form_named(std::string_view text) {
  const std::string_view law = text.substr(0, text.find('+'));
  std::optional<StaticForm> known =
      form_of_law(model::friction::law_description(law));  // throws with the list
  if (!known)
    throw std::invalid_argument("--law: no effects of a drive model make the curve of " + std::string(law) +
                                "; kfm is the nearest");
  StaticForm form = *std::move(known);
  constexpr std::pair<std::string_view, std::string_view> kMore[] = {
      {"offset", "torque_offset"}, {"asymmetry", "direction_asymmetry"}, {"quadratic", "quadratic_drag"}};
  while (text.find('+') != text.npos) {
    text.remove_prefix(text.find('+') + 1);
    const std::string_view term = text.substr(0, text.find('+'));
    const auto found = std::ranges::find(kMore, term, &std::pair<std::string_view, std::string_view>::first);
    if (found == std::end(kMore))
      throw std::invalid_argument("--law: '" + std::string(term) +
                                  "' is no term; there are offset, asymmetry and quadratic");
    form.add(found->second);
  }
  return form;
}

std::string form_name(const StaticForm& form) {
  std::string name;
  for (const AnyEffect& effect : form.effects)
    (name += name.empty() ? "" : " + ") += model::effects::name_of(effect);
  std::ranges::replace(name, '_', ' ');
  return name;
}

double StaticFit::torque_Nm(double velocity_rad_per_s) const {
  if (!ok()) throw std::logic_error("static fit: nothing was fitted");
  return sliding_torque_Nm(EffectChain(effects), velocity_rad_per_s);
}

StaticFit fit_static(const StaticMap& map, const StaticForm& form, const StaticFitOptions& options) {
  return Fitter(map, form, options).fit();
}

}  // namespace identification::fit
