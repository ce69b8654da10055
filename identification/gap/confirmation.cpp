#include "identification/gap/confirmation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "model/effects/basis.h"

namespace identification::gap {
namespace {

/// Minimum width of a gap in encoder steps.
constexpr double kMinSteps = 2;
/// Times the squared noise floor; below, the residual is noise.
constexpr double kAboveNoise = 1.5;
/// Minimum share of the squared held-out residual that an effect must remove,
constexpr double kWorthwhileGain = 0.02;
/// and of its part above the noise if it is an elasticity or a backlash whose size may be zero,
constexpr double kMuch = 0.3;
/// or if twice its interval contains zero: what is not in the model leans on whatever resembles it.
constexpr double kSome = 0.2;

/// Share of its size by which an effect may differ between both halves of the data, unless the difference is
/// within this many standard deviations.
constexpr double kSameSize = 0.25;
constexpr double kSureToDiffer = 4;
constexpr std::size_t kConstancyBlocks = 40;

/// Parameters whose zero removes an effect; some have two.
struct Size {
  std::string_view effect;
  std::string_view parameter;
};
constexpr Size kStribeck{"stribeck", "static_torque_Nm"};
constexpr std::array kSizes{
    Size{"coulomb", "torque_Nm"},
    Size{"viscous", "coefficient_Nm_s_per_rad"},
    Size{"quadratic_drag", "coefficient_Nm_s2_per_rad2"},
    kStribeck,
    Size{"midspeed_dip", "depth_Nm"},
    Size{"torque_offset", "torque_Nm"},
    Size{"direction_asymmetry", "coulomb_Nm"},
    Size{"direction_asymmetry", "viscous_Nm_s_per_rad"},
    Size{"thermal_drift", "coulomb_change_Nm"},
    Size{"thermal_drift", "viscous_change_Nm_s_per_rad"},
    Size{"imbalance", "torque_Nm"},
    Size{"spring", "stiffness_Nm_per_rad"},
    Size{"load_friction", "share"},
    Size{"cogging", "amplitude_Nm"},
    Size{"inertia", "difference_kg_m2"},
    Size{"presliding", "stiffness_Nm_per_rad"},
    Size{"backlash", "gap_rad"},
    Size{"elasticity", "stiffness_Nm_per_rad"},
    Size{"torque_deadband", "threshold_Nm"},
    Size{"transport_delay", "delay_s"},
    Size{"torque_lag", "time_constant_s"},
};
/// Those of one effect; a user's own is absent if its amplitude is zero.
std::vector<Size> sizes_of(const model::effects::AnyEffect& effect) {
  const std::string_view name = model::effects::name_of(effect);
  if (std::holds_alternative<model::effects::Custom>(effect))
    return {{name, model::effects::amplitudes_of(effect).front()}};
  std::vector<Size> sizes;
  std::ranges::copy_if(kSizes, std::back_inserter(sizes),
                       [&](const Size& size) { return size.effect == name; });
  return sizes;
}
/// The value of `size` at which the effect is absent.
double none_at(const Size& size, const model::effects::DriveModel& model) {
  const auto* coulomb = model.find<model::effects::Coulomb>();
  return size.effect == "stribeck" && coulomb != nullptr ? coulomb->parameters().torque_Nm : 0;
}

class Confirmation {
 public:
  Confirmation(SearchResult& result, const Judged& judged) : result_(result), judged_(judged) { judge(); }

  /// The reason to remove the i-th addition; empty: it stays.
  std::string reason_against(std::size_t i, const FittedModel& without) const {
    const std::string_view effect = result_.added[i].effect;
    const double square_without = square(without);
    if (effect == "backlash" && parameter(i, "gap_rad").value < kMinSteps * judged_.resolution_rad)
      return "its gap is narrower than two steps of the encoder";
    if (effect == "backlash" && !crosses_gap(result_.fitted, judged_.rows))
      return "its gap is not small against the stroke, or hardly ever crossed";
    if ((gives(effect) || effect == "presliding") && is_longest_lag(result_.fitted.lag_s) &&
        std::ranges::none_of(judged_.rows.signals(), &Signals::torque_is_command))
      return "the torque is recorded later than can be fitted, which looks the same";
    if (effect == "stribeck" &&
        parameter(i, "static_torque_Nm").value < none_at(kStribeck, result_.fitted.model))
      return "its static torque is below the Coulomb friction, which is another shape";
    if (effect == "inertia" && !is_constant(i))
      return "it is not the same while driving and braking, or at small and large torques";
    if (is_another_harmonic(i)) return "";
    // If only noise is left, the difference between two models on held-out recordings is noise, too.
    const double noise = judged_.noise_floor_Nm * judged_.noise_floor_Nm;
    const bool judges = judged_.own_recordings && square_ > kAboveNoise * noise;
    const double share = (square_without - square_) / (square_without - noise);
    if (judges && square_without < (1 + kWorthwhileGain) * square_)
      return "the held-out recordings are predicted hardly better with it";
    if (judges && share < kSome && may_be_none(i, 2))
      return "its size is uncertain, and most is left over with it, too";
    if (!may_be_none(i, 1)) return "";
    if (effect == "presliding") return "its stiffness may as well be zero";
    if (!gives(effect)) return "its size may as well be zero";
    if (judges && share < kMuch) return "its size may as well be zero, and most is left over with it, too";
    return gives_otherwise(i) ? "its size may as well be zero, and something else that gives is in the model"
                              : "";
  }

  /// The effect that the i-th addition may stand for, whatever the search preferred; empty without one.
  std::string_view alternative_to(std::size_t i) const {
    const std::string_view effect = result_.added[i].effect;
    if (effect == "elasticity" && may_be_none(i, 1)) return "backlash";
    if (effect == "backlash" && may_be_none(i, 1)) return "elasticity";
    // Over a short stroke the sine of a weight is straight.
    if (widest_span_rad(judged_.rows.signals()) > kEndlessTravel_rad) return {};
    return effect == "imbalance" ? "spring" : effect == "spring" ? "imbalance" : "";
  }

  /// For the present result.
  void judge() {
    square_ = square(result_.fitted);
    free_ = free_parameters(result_.fitted, judged_.rows);
    estimates_ = estimates(result_.fitted, judged_.rows, judged_.training.rows);
  }

 private:
  /// Mean square residual of the held-out rows.
  double square(const FittedModel& fitted) const {
    const Eigen::VectorXd left = judged_.rows.torque_Nm() - predicted_rows(fitted, judged_.rows);
    return left(judged_.held_out).squaredNorm() / static_cast<double>(judged_.held_out.size());
  }
  const fit::Estimate& parameter(std::size_t i, std::string_view name) const {
    const std::size_t effect = *place_of_added(result_, i);
    for (std::size_t k = 0; k < free_.size(); ++k)
      if (free_[k].kind == FreeParameter::Kind::kEffect && free_[k].effect == effect && free_[k].name == name)
        return estimates_[k];
    static const fit::Estimate kUnknown;
    return kUnknown;
  }
  /// Whether the i-th addition has one size for all rows: if it differs between driving and braking, or
  /// between small and large torques, it stands for something else.
  bool is_constant(std::size_t i) const {
    const std::vector<Eigen::Index>& use = judged_.training.rows;
    FittedModel without = result_.fitted;
    without.model.effects.erase(without.model.effects.begin() +
                                static_cast<std::ptrdiff_t>(*place_of_added(result_, i)));
    const Eigen::VectorXd predicted = predicted_rows(result_.fitted, judged_.rows);
    const Eigen::VectorXd own = (predicted - predicted_rows(without, judged_.rows))(use);
    const Eigen::VectorXd residual = (judged_.rows.torque_Nm() - predicted)(use);
    const Eigen::MatrixXd jacobian =
        prediction_jacobian(result_.fitted, judged_.rows, free_)(use, Eigen::all);
    const Eigen::VectorXd torque = judged_.rows.torque_Nm()(use);
    const Eigen::VectorXd velocity =
        judged_.rows.means([](const Signals& s) { return s.velocity_rad_per_s; })(use);
    const Eigen::VectorXd size = torque.cwiseAbs();
    const double median = fit::median({size.data(), size.data() + size.size()});
    const Eigen::ArrayXd driving = (torque.array() * velocity.array() > 0).cast<double>();
    const Eigen::ArrayXd strong = (size.array() > median).cast<double>();
    Eigen::MatrixXd columns(jacobian.rows(), jacobian.cols() + 1);
    for (const Eigen::ArrayXd& part : {driving, strong}) {
      columns << jacobian, (own.array() * part).matrix();
      const Eigen::VectorXd fitted = fit::normal_inverse(columns) * (columns.transpose() * residual);
      const Eigen::MatrixXd covariance =
          fit::block_covariance(columns, residual - columns * fitted, kConstancyBlocks);
      const Eigen::Index last = jacobian.cols();
      if (std::abs(fitted[last]) > kSameSize &&
          std::abs(fitted[last]) > kSureToDiffer * std::sqrt(covariance(last, last)))
        return false;
    }
    return true;
  }
  /// Whether each size of the i-th addition may be zero, by its interval times `widened`.
  bool may_be_none(std::size_t i, double widened) const {
    const std::vector<Size> sizes = sizes_of(result_.fitted.model.effects[*place_of_added(result_, i)]);
    return std::ranges::all_of(sizes, [&](const Size& size) {
      const fit::Estimate& estimate = parameter(i, size.parameter);
      const double none = none_at(size, result_.fitted.model);
      const auto end = [&](double of) { return estimate.value + widened * (of - estimate.value); };
      return end(estimate.lower) <= none && none <= end(estimate.upper);
    });
  }
  /// Another harmonic of a confirmed cogging: one cause has several.
  bool is_another_harmonic(std::size_t i) const {
    const auto is_cogging = [](const Added& added) { return added.effect == "cogging"; };
    return is_cogging(result_.added[i]) &&
           std::any_of(result_.added.begin(), result_.added.begin() + static_cast<std::ptrdiff_t>(i),
                       is_cogging);
  }
  bool gives_otherwise(std::size_t i) const {
    const std::size_t own = *place_of_added(result_, i);
    const std::vector<model::effects::AnyEffect>& effects = result_.fitted.model.effects;
    for (std::size_t k = 0; k < effects.size(); ++k)
      if (k != own && gives(model::effects::name_of(effects[k]))) return true;
    return false;
  }

  SearchResult& result_;
  const Judged& judged_;
  double square_ = 0;  // that of the result
  std::vector<FreeParameter> free_;
  std::vector<fit::Estimate> estimates_;
};

}  // namespace

void confirm(SearchResult& result, const Judged& judged) {
  Confirmation confirmation(result, judged);
  for (std::size_t i = result.added.size(); i-- > 0;) {
    std::optional<FittedModel> without = without_added(result, i, judged.rows, judged.training);
    if (!without) continue;
    const std::string reason = confirmation.reason_against(i, *without);
    if (reason.empty()) continue;
    const Added dropped = result.added[i];
    result.rejected.push_back({std::string(dropped.effect), dropped.gain, reason});
    result.fitted = std::move(*without);
    result.added.erase(result.added.begin() + static_cast<std::ptrdiff_t>(i));
    confirmation.judge();
    i = result.added.size();  // the remaining ones may have become necessary, or unnecessary
  }
  for (std::size_t i = 0; i < result.added.size(); ++i) {
    Added& added = result.added[i];
    if (!place_of_added(result, i)) continue;
    const std::string other(confirmation.alternative_to(i));
    if (!other.empty() && std::ranges::find(added.rivals, other, &RivalModel::effect) == added.rivals.end())
      added.rivals.push_back({.effect = other});
  }
}

}  // namespace identification::gap
