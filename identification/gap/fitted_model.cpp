#include "identification/gap/fitted_model.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <string>
#include <variant>

#include "identification/gap/parallel.h"

namespace identification::gap {
namespace {

using model::effects::AnyEffect;

/// Groups whose residuals count as independent: stretches of time, and ranges of speed or acceleration.
constexpr std::size_t kTimeGroups = 40;
constexpr std::size_t kMotionGroups = 20;
/// A parameter whose whole plausible range changes the prediction by less than this share of the residual is
/// invisible.
constexpr double kUnseen = 1e-6;
/// Step for differentiation, relative to a parameter's scale.
constexpr double kWidestStep = 0.03;
constexpr int kMaxNarrowings = 4;
/// Difference between the slopes on both sides, relative to their sum, that counts as straight.
constexpr double kStraight = 0.3;
constexpr int kMaxRounds = 20;
/// Scale for an exponent of zero.
constexpr double kExponentScale = 1;
constexpr double kAtBound = 1e-3;
/// Share of a period over the whole stroke by which the shape of a ripple may shift its periods.
constexpr double kUnresolved = 0.25;
/// The band does not resolve impacts, so the stiffness of flanks cannot be fitted. Their compliance looks
/// like a wider gap: their frequency may be half or twice as high.
constexpr std::string_view kFlank = "flank_Hz";
constexpr double kFlankMayBe = 2;
/// Smoothing of a lag that is a delay and no filter, in squares of the lag.
constexpr double kPureDelay = 0.5;

AnyEffect changed(const AnyEffect& effect, std::string_view name, double value) {
  const auto& described = model::effects::description_of(effect);
  std::vector<model::effects::NamedValue> values;
  for (const auto& parameter : described.parameters)
    values.push_back({parameter.name,
                      parameter.name == name ? value : model::effects::parameter_of(effect, parameter.name)});
  return model::effects::make_effect(described.name, values);
}

/// Whether a bound stopped the fit that is not natural, as zero is.
bool at_the_end(const FreeParameter& p) {
  if (p.kind != FreeParameter::Kind::kEffect) return false;
  return (p.lower > 0 && p.value <= (1 + kAtBound) * p.lower) ||
         (p.upper > 0 && p.value >= (1 - kAtBound) * p.upper);
}

/// A sensor that lags reports less of a rising torque: true = reported + lag·rate, which is exact for a
/// first-order lag; + smoothing·bend, which is half the square of a pure delay, a 24th of that of a mean's
/// length.
Eigen::VectorXd lag_column(const Rows& rows) { return -rows.torque_rate_Nm_per_s(); }
Eigen::VectorXd smoothing_column(const Rows& rows) { return -rows.torque_bend_Nm_per_s2(); }

/// Per recording; empty if the model has no gap.
std::vector<LoadSide> bouncing_loads(const FittedModel& fitted, const Rows& rows) {
  std::vector<LoadSide> loads;
  if (fitted.model.find<model::effects::Backlash>() == nullptr ||
      fitted.model.find<model::effects::Elasticity>() != nullptr)
    return loads;
  for (const Signals& s : rows.signals()) loads.push_back(load_side_of(fitted.model, s));
  return loads;
}

/// As predicted_rows(), with these loads if there are any.
Eigen::VectorXd rows_with(const std::vector<LoadSide>& loads, const FittedModel& fitted, const Rows& rows) {
  Eigen::VectorXd result = rows.column([&](const Signals& s) {
    const auto recording = static_cast<std::size_t>(&s - rows.signals().data());
    return predicted_torque_Nm(fitted.model, s, loads.empty() ? nullptr : &loads[recording]);
  });
  if (fitted.lag_s != 0) result += fitted.lag_s * lag_column(rows);
  if (fitted.smoothing_s2 != 0) result += fitted.smoothing_s2 * smoothing_column(rows);
  return result;
}

/// Change of the prediction with one parameter, by differences: over a wide step for parameters that act
/// through events, such as a spring, narrower if the prediction is curved within it. A bouncing load in a gap
/// is always curved: there the wide step shows what a fit can achieve, and no narrower one does. Its bouncing
/// is kept when any other parameter changes.
Eigen::VectorXd slope(const FittedModel& fitted, const Rows& rows, const FreeParameter& p,
                      const Eigen::VectorXd& here, const std::vector<LoadSide>& loads) {
  const bool bounces = !loads.empty() && p.kind == FreeParameter::Kind::kEffect &&
                       std::holds_alternative<model::effects::Backlash>(fitted.model.effects[p.effect]);
  const std::vector<LoadSide> none;
  const std::vector<LoadSide>& known = bounces ? none : loads;
  const int most_narrowings = bounces ? 1 : kMaxNarrowings;
  Eigen::VectorXd straightest = Eigen::VectorXd::Zero(rows.count());
  double least_bend = std::numeric_limits<double>::infinity();
  double h = kWidestStep * p.scale;
  for (int attempt = 0; attempt < most_narrowings && least_bend > kStraight; ++attempt, h *= 0.1) {
    const double above = std::min(p.value + h, p.upper);
    const double below = std::max(p.value - h, p.lower);
    if (!(above > below)) break;
    const Eigen::VectorXd up = rows_with(known, with_value(fitted, p, above), rows) - here;
    const Eigen::VectorXd down = here - rows_with(known, with_value(fitted, p, below), rows);
    const double length = (up + down).norm();
    const bool one_sided = above == p.value || below == p.value;
    const double bend = !(length > 0) ? std::numeric_limits<double>::max()
                        : one_sided   ? 0
                                      : (up - down).norm() / length;
    if (bend >= least_bend) continue;
    least_bend = bend;
    straightest = (up + down) / (above - below);
  }
  return straightest;
}

/// Groups of rows of equal size, sorted by `order`.
std::vector<std::size_t> groups_by(const Eigen::VectorXd& order, std::size_t groups) {
  const auto rows = static_cast<std::size_t>(order.size());
  std::vector<Eigen::Index> sorted(rows);
  std::iota(sorted.begin(), sorted.end(), 0);
  std::ranges::stable_sort(sorted, {}, [&](Eigen::Index i) { return order[i]; });
  std::vector<std::size_t> group(rows);
  for (std::size_t i = 0; i < rows; ++i) group[static_cast<std::size_t>(sorted[i])] = i * groups / rows;
  return group;
}

/// Half the 95 % interval of each parameter.
Eigen::VectorXd half_widths_of(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residual,
                               const Rows& rows, const std::vector<Eigen::Index>& use) {
  Eigen::VectorXd widest = Eigen::VectorXd::Zero(jacobian.cols());
  const auto consider = [&](const Eigen::VectorXd& order, std::size_t groups) {
    const Eigen::MatrixXd covariance =
        fit::group_covariance(jacobian, residual, groups_by(order, groups), groups);
    const double t = fit::student_975(static_cast<double>(groups - 1));
    widest = widest.cwiseMax(t * covariance.diagonal().cwiseMax(0).cwiseSqrt());
  };
  const auto count = static_cast<Eigen::Index>(use.size());
  consider(Eigen::VectorXd::LinSpaced(count, 0, 1), kTimeGroups);
  consider(rows.means([](const Signals& s) { return s.velocity_rad_per_s; })(use), kMotionGroups);
  consider(rows.means([](const Signals& s) { return s.acceleration_rad_per_s2; })(use), kMotionGroups);
  return widest;
}

/// Friction laws, effects that only command and measured torque together show (actuator_channel.h), and
/// effects that the search does not look for: how far their parameters may move without losing a ripple's
/// phase, or being taken for the lag of the recording, is not known here.
bool is_given(const AnyEffect& effect) {
  return std::holds_alternative<model::effects::FrictionLaw>(effect) ||
         std::holds_alternative<model::effects::PositionFriction>(effect) ||
         std::holds_alternative<model::effects::TorqueRipple>(effect) ||
         std::holds_alternative<model::effects::EncoderEccentricity>(effect) ||
         std::holds_alternative<model::effects::TorqueSaturation>(effect) ||
         std::holds_alternative<model::effects::ActuatorGain>(effect) ||
         std::holds_alternative<model::effects::ActuatorOffset>(effect) ||
         std::holds_alternative<model::effects::TorqueSensorOffset>(effect);
}

double longest_period_s(const Rows& rows) {
  double period_s = 0;
  for (const Signals& s : rows.signals()) period_s = std::max(period_s, s.raw_period_s);
  return period_s;
}

double most_smoothing_s2(double period_s, double lag_s) {
  return std::max(
      {kMaxSmoothing * period_s * period_s, kTorqueFilter_s * kTorqueFilter_s, kPureDelay * lag_s * lag_s});
}

/// Of one turn, where zero is a place like any other. A spring may rest many turns away.
bool is_place(const FreeParameter& p, const FittedModel& fitted) {
  const bool of_spring = p.kind == FreeParameter::Kind::kEffect &&
                         std::holds_alternative<model::effects::Spring>(fitted.model.effects[p.effect]);
  return !of_spring && (p.name.ends_with("position_rad") || p.name.ends_with("phase_rad"));
}

}  // namespace

std::vector<FreeParameter> free_parameters(const FittedModel& fitted, const Rows& rows) {
  std::vector<FreeParameter> list;
  const double given = fitted.given_inertia_kg_m2;
  if (fitted.model.find<model::effects::Inertia>() == nullptr)
    list.push_back({FreeParameter::Kind::kInertia, 0, "inertia_kg_m2", fitted.model.inertia_kg_m2,
                    (1 - kInertiaTolerance) * given, (1 + kInertiaTolerance) * given, given});
  const bool measured = std::ranges::none_of(rows.signals(), &Signals::torque_is_command);
  const double period_s = longest_period_s(rows);
  const bool commands_are_late = fitted.model.find<model::effects::TransportDelay>() != nullptr ||
                                 fitted.model.find<model::effects::TorqueLag>() != nullptr;
  if (measured || !commands_are_late) {
    const double lead_s =
        measured ? std::min(period_s, kLongestLead_s) : std::max(0.5 * period_s, kCurrentLoop_s);
    const double lag_s = measured ? kLongestLag_s : 0.5 * period_s;
    list.push_back({FreeParameter::Kind::kLag, 0, "lag_s", fitted.lag_s, -lead_s, lag_s, 1e-3});
    if (const double square_s2 = period_s * period_s; period_s <= kLongestPeriod_s)
      list.push_back({FreeParameter::Kind::kSmoothing, 0, "smoothing_s2", fitted.smoothing_s2,
                      kMinSmoothing * square_s2, most_smoothing_s2(period_s, fitted.lag_s), square_s2});
  }
  for (std::size_t i = 0; i < fitted.model.effects.size(); ++i) {
    const AnyEffect& effect = fitted.model.effects[i];
    if (is_given(effect)) continue;
    for (const auto& parameter : model::effects::description_of(effect).parameters) {
      if (std::holds_alternative<model::effects::Stribeck>(effect) && parameter.name == "tail") continue;
      if (std::holds_alternative<model::effects::LoadFriction>(effect) && parameter.name != "share") continue;
      if (parameter.name == kFlank) continue;
      const double value = model::effects::parameter_of(effect, parameter.name);
      double scale = std::max(std::abs(value), 0.1 * std::abs(parameter.initial));
      // A ripple is out of step far from the joint's zero long before its periods differ noticeably.
      if (std::holds_alternative<model::effects::Cogging>(effect) && parameter.name == "periods_per_rev")
        scale = std::min(scale, 2 * std::numbers::pi / std::max(farthest_rad(rows.signals()), 1e-3));
      // Both start from zero if the given contact has none.
      if (const auto* contact = std::get_if<model::effects::Presliding>(&effect)) {
        if (parameter.name == "exponent") scale = std::max(value, kExponentScale);
        if (parameter.name == "damping_Nm_s_per_rad")
          scale = std::max(value, contact->parameters().stiffness_Nm_per_rad * period_s);
      }
      FreeParameter free{
          FreeParameter::Kind::kEffect, i, parameter.name, value, parameter.lower, parameter.upper,
          scale > 0 ? scale : 1e-3};
      if (std::holds_alternative<model::effects::Inertia>(effect)) {
        free.lower = std::max(free.lower, -kMaxInertiaDecrease * given);
        free.upper = std::min(free.upper, kMaxInertiaIncrease * given);
      }
      // Nothing is dragged along by the medium that it stirs. A given curve may bend down.
      if (std::holds_alternative<model::effects::QuadraticDrag>(effect) && value >= 0) free.lower = 0;
      if (std::holds_alternative<model::effects::TorqueDeadband>(effect) && !measured)
        free.upper = std::min(free.upper, std::max(value, usual_command_Nm(rows.signals())));
      list.push_back(free);
    }
  }
  return list;
}

FittedModel with_value(const FittedModel& fitted, const FreeParameter& parameter, double value) {
  FittedModel result = fitted;
  const double bounded = std::clamp(value, parameter.lower, parameter.upper);
  switch (parameter.kind) {
    case FreeParameter::Kind::kInertia: result.model.inertia_kg_m2 = bounded; break;
    case FreeParameter::Kind::kLag: result.lag_s = bounded; break;
    case FreeParameter::Kind::kSmoothing: result.smoothing_s2 = bounded; break;
    case FreeParameter::Kind::kEffect:
      result.model.effects[parameter.effect] =
          changed(fitted.model.effects[parameter.effect], parameter.name, bounded);
      break;
  }
  return result;
}

Eigen::VectorXd predicted_rows(const FittedModel& fitted, const Rows& rows) {
  return rows_with({}, fitted, rows);
}

Eigen::MatrixXd prediction_jacobian(const FittedModel& fitted, const Rows& rows,
                                    const std::vector<FreeParameter>& parameters) {
  Eigen::MatrixXd jacobian(rows.count(), static_cast<Eigen::Index>(parameters.size()));
  const std::vector<LoadSide> loads = bouncing_loads(fitted, rows);
  const Eigen::VectorXd here = rows_with(loads, fitted, rows);
  in_parallel(parameters.size(), [&](std::size_t k) {
    const FreeParameter& p = parameters[k];
    jacobian.col(static_cast<Eigen::Index>(k)) = p.kind == FreeParameter::Kind::kLag ? lag_column(rows)
                                                 : p.kind == FreeParameter::Kind::kSmoothing
                                                     ? smoothing_column(rows)
                                                     : slope(fitted, rows, p, here, loads);
  });
  return jacobian;
}

FittedModel refined(const FittedModel& fitted, const Rows& rows, const std::vector<Eigen::Index>& use,
                    const std::function<bool(const FreeParameter&)>& is_free) {
  FittedModel current = fitted;
  const double period_s = longest_period_s(rows);
  // Gauss-Newton with a trust region by halving: few rounds, one Jacobian each.
  Eigen::VectorXd residual = (rows.torque_Nm() - predicted_rows(current, rows))(use);
  double cost = residual.squaredNorm();
  double damping = 1e-6;
  for (int round = 0; round < kMaxRounds; ++round) {
    std::vector<FreeParameter> parameters = free_parameters(current, rows);
    if (is_free) std::erase_if(parameters, [&](const FreeParameter& p) { return !is_free(p); });
    const Eigen::MatrixXd jacobian = prediction_jacobian(current, rows, parameters)(use, Eigen::all);
    const Eigen::MatrixXd gram = jacobian.transpose() * jacobian;
    const Eigen::VectorXd slope = jacobian.transpose() * residual;
    const double before = cost;
    bool improved = false;
    for (int attempt = 0; attempt < 5 && !improved; ++attempt) {
      Eigen::VectorXd unit = gram.diagonal().cwiseSqrt();
      for (Eigen::Index i = 0; i < unit.size(); ++i) unit[i] = unit[i] > 0 ? 1 / unit[i] : 0;
      Eigen::MatrixXd g = unit.asDiagonal() * gram * unit.asDiagonal();
      g.diagonal().array() += damping;
      const Eigen::VectorXd step = unit.cwiseProduct(g.ldlt().solve(unit.cwiseProduct(slope)));
      FittedModel moved = current;
      for (std::size_t k = 0; k < parameters.size(); ++k) {
        const FreeParameter& p = parameters[k];
        // Limits the change of a shape in one step.
        const double most =
            p.kind == FreeParameter::Kind::kEffect ? std::max(std::abs(p.value), p.scale) : 1e9;
        moved = with_value(moved, p,
                           p.value + std::clamp(step[static_cast<Eigen::Index>(k)], -0.5 * most, 0.5 * most));
      }
      // Its bound is that of the new lag.
      moved.smoothing_s2 = std::min(moved.smoothing_s2, most_smoothing_s2(period_s, moved.lag_s));
      Eigen::VectorXd trial = (rows.torque_Nm() - predicted_rows(moved, rows))(use);
      const double trial_cost = trial.squaredNorm();
      if (trial_cost < cost) {
        current = moved;
        residual = std::move(trial);
        cost = trial_cost;
        improved = true;
        damping = std::max(damping * 0.1, 1e-9);
      } else {
        damping = std::max(damping * 30, 1e-4);
      }
    }
    if (!improved || before - cost < 1e-4 * before) break;
  }
  return current;
}

namespace {

/// Change of each free parameter in fits with flanks of half and of twice the frequency, the larger of both.
/// Zero without a gap.
Eigen::VectorXd moved_by_flanks(const FittedModel& fitted, const Rows& rows,
                                const std::vector<Eigen::Index>& use) {
  const std::size_t count = free_parameters(fitted, rows).size();
  Eigen::VectorXd largest = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(count));
  const auto is_gap = [](const AnyEffect& e) { return std::holds_alternative<model::effects::Backlash>(e); };
  const auto gap = std::ranges::find_if(fitted.model.effects, is_gap);
  if (gap == fitted.model.effects.end()) return largest;
  const double flank_Hz = model::effects::parameter_of(*gap, kFlank);
  const auto& ranges = model::effects::effect_description("backlash").parameters;
  const auto range =
      std::ranges::find(ranges, kFlank, [](const auto& p) { return std::string_view(p.name); });
  // Delivered parameters may keep given values: only changes by the flanks count.
  const std::vector<FreeParameter> unmoved = free_parameters(refined(fitted, rows, use), rows);
  for (const double factor : {1 / kFlankMayBe, kFlankMayBe}) {
    FittedModel other = fitted;
    other.model.effects[static_cast<std::size_t>(gap - fitted.model.effects.begin())] =
        changed(*gap, kFlank, std::clamp(factor * flank_Hz, range->lower, range->upper));
    const std::vector<FreeParameter> moved = free_parameters(refined(other, rows, use), rows);
    for (std::size_t k = 0; k < count; ++k) {
      double& most = largest[static_cast<Eigen::Index>(k)];
      most = std::max(most, std::abs(moved[k].value - unmoved[k].value));
    }
  }
  return largest;
}

/// Error of the periods per turn of a ripple that is not one sine: the stroke tells orders apart from which a
/// period more or less fits into it.
double unresolved_periods(const FittedModel& fitted, const FreeParameter& p, const Rows& rows) {
  if (p.kind != FreeParameter::Kind::kEffect || p.name != "periods_per_rev" ||
      !std::holds_alternative<model::effects::Cogging>(fitted.model.effects[p.effect]))
    return 0;
  return kUnresolved * 2 * std::numbers::pi / std::max(widest_span_rad(rows.signals()), 1e-9);
}

}  // namespace

std::vector<fit::Estimate> estimates(const FittedModel& fitted, const Rows& rows,
                                     const std::vector<Eigen::Index>& use) {
  const std::vector<FreeParameter> parameters = free_parameters(fitted, rows);
  const Eigen::MatrixXd jacobian = prediction_jacobian(fitted, rows, parameters)(use, Eigen::all);
  const Eigen::VectorXd residual = (rows.torque_Nm() - predicted_rows(fitted, rows))(use);
  std::vector<Eigen::Index> seen;
  for (Eigen::Index k = 0; k < jacobian.cols(); ++k) {
    const double effect = jacobian.col(k).norm() * parameters[static_cast<std::size_t>(k)].scale;
    if (effect > kUnseen * residual.norm()) seen.push_back(k);
  }
  const Eigen::MatrixXd moved = jacobian(Eigen::all, seen);
  const Eigen::VectorXd by_flanks = moved_by_flanks(fitted, rows, use)(seen);
  const Eigen::VectorXd half_widths =
      (half_widths_of(moved, residual, rows, use).cwiseAbs2() + by_flanks.cwiseAbs2()).cwiseSqrt();
  std::vector<fit::Estimate> result;
  for (const FreeParameter& p : parameters) {
    fit::Estimate estimate{.name = std::string(p.name), .value = p.value};
    const auto at = static_cast<Eigen::Index>(result.size());
    const auto found = std::ranges::find(seen, at);
    if (found == seen.end()) {
      estimate.not_identifiable = "this data does not depend on it";
    } else {
      const double half = std::hypot(half_widths[found - seen.begin()], unresolved_periods(fitted, p, rows));
      estimate.lower = p.value - half;
      estimate.upper = p.value + half;
      if (at_the_end(p)) estimate.not_identifiable = "the fit runs to the end of the range it may have";
      const bool place = is_place(p, fitted);
      if (place ? !(half < std::numbers::pi) : !(half < 10 * std::max(std::abs(p.value), p.scale)))
        estimate.not_identifiable =
            place ? "its interval is wider than a turn" : "its interval is wider than ten times its value";
    }
    result.push_back(std::move(estimate));
  }
  return result;
}

}  // namespace identification::gap
