#include "identification/gap/search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <map>
#include <numeric>
#include <optional>
#include <span>

#include "identification/chance.h"
#include "identification/gap/block_comparison.h"
#include "identification/gap/candidates.h"
#include "identification/gap/chance_data.h"
#include "identification/gap/exploration.h"
#include "identification/gap/free_simulation.h"
#include "identification/gap/noise_draws.h"
#include "identification/gap/regression.h"
#include "model/effects/basis.h"

namespace identification::gap {
namespace {

constexpr int kFolds = 8;
constexpr int kMaxEffects = 8;
/// Maximum number of replaced names: otherwise two could replace each other for ever.
constexpr int kMaxReplaced = 4;
/// Rivals this close to the best are refined before a name is given.
constexpr double kRival = 0.5;
/// Minimum gain of the winner over no addition, in standard errors over the blocks.
constexpr double kSure = 2;
constexpr double kMuch = 0.2;
/// Number of parameters beyond those of the simplest rival from which a rival counts as much freer.
constexpr std::size_t kMuchFreer = 2;
/// Maximum share of the squared residual that remains. A load that moves relative to the motor is flexible
/// enough to explain parts of other effects: a real gap always removes most of the residual; a real
/// elasticity or bristle does so or simulates better.
constexpr double kElasticityLeavesAtMost = 0.5;
/// Minimum gain of a rival, as a share of the best one's gain.
constexpr double kAsGood = 0.8;
/// The same for one whose size the data determine, against a best one whose size they do not.
constexpr double kNearlyAsGood = 0.98;
/// Maximum relative uncertainty of a ripple's periods per turn: with more, any curvature of the torque over
/// the position would count as a ripple.
constexpr double kPeriodsKnownTo = 0.1;
/// Of the stroke: a wider gap leaves no motion with the load on a flank.
constexpr double kWidestGap = 1.0 / 3;
/// As many as the reversals that a recording needs to show a gap.
constexpr int kMinCrossings = 4;
/// Of half the gap: as far from its middle, the load is at a flank.
constexpr double kAtFlank = 0.9;
using Indices = std::vector<Eigen::Index>;

/// Probability by chance up to which plain friction is taken. Recordings of a few steady speeds have only a
/// dozen independent stretches: chance then gives the signs of a constant torque once in some hundred draws,
/// however clear the friction is.
constexpr double kPlainChance = 0.05;

/// Up to this probability by chance an effect may be one of two that are missing: together they are tried,
/// too.
constexpr double kPerhapsTwo = 0.1;

/// Every drive has them: where the model lacks one, it is a parameter with the value 0, no hypothesis among
/// many. A friction law has both.
bool is_plain_friction(std::string_view effect, const FittedModel& fitted) {
  return (effect == model::effects::Coulomb::kName || effect == model::effects::Viscous::kName) &&
         std::ranges::none_of(fitted.model.effects, [](const model::effects::AnyEffect& own) {
           return std::holds_alternative<model::effects::FrictionLaw>(own);
         });
}

Indices range(Eigen::Index from, Eigen::Index to) {
  Indices result(static_cast<std::size_t>(to - from));
  std::iota(result.begin(), result.end(), from);
  return result;
}

Indices joined(Indices base, std::span<const Eigen::Index> more) {
  base.insert(base.end(), more.begin(), more.end());
  return base;
}
std::vector<Bounds> joined(std::vector<Bounds> base, std::span<const Bounds> more) {
  base.insert(base.end(), more.begin(), more.end());
  return base;
}

/// Bounds of a linear step for each parameter.
std::vector<Bounds> step_bounds(const std::vector<FreeParameter>& parameters) {
  std::vector<Bounds> bounds;
  for (const FreeParameter& p : parameters) bounds.push_back({p.lower - p.value, p.upper - p.value});
  return bounds;
}

/// Scores a model, with free parameters, on blocks to which it was not fitted.
BlockRegression::Fit score(const FittedModel& fitted, const Rows& rows, const Training& training) {
  const auto parameters = free_parameters(fitted, rows);
  const Eigen::MatrixXd jacobian = prediction_jacobian(fitted, rows, parameters)(training.rows, Eigen::all);
  const BlockRegression regression(jacobian, training.block, kFolds);
  const Eigen::VectorXd residual = (rows.torque_Nm() - predicted_rows(fitted, rows))(training.rows);
  return regression.fit(regression.target(residual), range(0, jacobian.cols()), step_bounds(parameters));
}

/// One round: compares the present model with every candidate.
class Round {
 public:
  Round(const FittedModel& fitted, const Rows& rows, const Training& training)
      : fitted_(fitted), rows_(rows), training_(training), dictionary_(make_dictionary(fitted, rows)) {
    parameters_ = free_parameters(fitted, rows);
    jacobian_ = prediction_jacobian(fitted, rows, parameters_)(training.rows, Eigen::all);
    base_columns_ = range(0, jacobian_.cols());
    base_bounds_ = step_bounds(parameters_);
    columns_.resize(jacobian_.rows(), jacobian_.cols() + dictionary_.columns.cols());
    columns_ << jacobian_, dictionary_.columns(training.rows, Eigen::all);
    dictionary_.columns.resize(0, 0);  // large and no longer needed
    regression_.emplace(columns_, training.block, kFolds);
    residual_ = (rows.torque_Nm() - predicted_rows(fitted, rows))(training.rows);
    position_ = rows.means([](const Signals& s) { return s.position_rad; })(training.rows);
    velocity_ = rows.means([](const Signals& s) { return s.velocity_rad_per_s; })(training.rows);
    target_ = regression_->target(residual_);
    base_ = regression_->fit(target_, base_columns_, base_bounds_);
    left_ = residual_ - jacobian_ * base_.coefficients;
    least_left_ = left_;
  }

  struct Outcome {
    std::string_view effect;
    double gain = 0;
    FittedModel model;  ///< not refined
  };

  /// The best shape of each effect, best effect first.
  std::vector<Outcome> outcomes() {
    std::map<std::string_view, Outcome> best;
    for (const Candidate& candidate : dictionary_.candidates) {
      const BlockRegression::Fit fit =
          regression_->fit(target_, columns_of(candidate), bounds_of(candidate.bounds));
      const double gain = 1 - fit.held_out / base_.held_out;
      remember(gain, columns_(Eigen::all, columns_of(candidate)) * fit.coefficients);
      Outcome& known = best[candidate.effect];
      if (!known.effect.empty() && gain <= known.gain) continue;
      const auto amplitudes = fit.coefficients.tail(static_cast<Eigen::Index>(candidate.columns.size()));
      known = {candidate.effect, gain, candidate.add(moved(fit.coefficients), amplitudes)};
    }
    if (const double periods = ripple_periods_per_rev(left_, position_); periods > 0) {
      const auto [gain, steps, fitted] = ripple(periods, residual_, base_.held_out);
      remember(gain, fitted);
      const Eigen::Vector2d amplitudes = steps.tail<2>();
      best["cogging"] = {"cogging", gain, with_ripple(moved(steps), periods, amplitudes[0], amplitudes[1])};
    }
    std::vector<Outcome> result;
    for (auto& [name, outcome] : best) result.push_back(std::move(outcome));
    std::ranges::sort(result, std::greater{}, &Outcome::gain);
    return result;
  }

  /// Probability that chance data give as much as this outcome: to the whole search or, for plain friction,
  /// to plain friction.
  double p_value(const Outcome& outcome, const Options& options) {
    // The residual of the best hypothesis: otherwise its own effect would count as noise.
    ChanceData chance(least_left_, options.seed);
    return ChanceTest{.draw = [&chance] { return chance.draw(); },
                      .most_gain = [this, plain = is_plain(outcome.effect)](
                                       const Eigen::VectorXd& draw) { return most_gain(draw, plain); },
                      .repetitions = options.repetitions}
        .p_value(outcome.gain);
  }

  /// The best two hypotheses together, found one after the other: if `effect` is one of them, the probability
  /// that chance data give as much to the same search.
  double pair_p_value(std::string_view effect, const Options& options) {
    const Pair found = pair(residual_);
    if (found.effects[1].empty() || std::ranges::find(found.effects, effect) == found.effects.end()) return 1;
    ChanceData chance(residual_ - found.fitted, options.seed);
    return ChanceTest{.draw = [&chance] { return chance.draw(); },
                      .most_gain = [this](const Eigen::VectorXd& draw) { return pair(draw).gain; },
                      .repetitions = options.repetitions}
        .p_value(found.gain);
  }

  bool is_plain(std::string_view effect) const { return is_plain_friction(effect, fitted_); }
  /// Probability by chance up to which an effect is taken.
  double allowed_chance(std::string_view effect, const Options& options) const {
    return is_plain(effect) ? std::max(kPlainChance, options.false_positive_rate)
                            : options.false_positive_rate;
  }
  const BlockRegression::Fit& base() const noexcept { return base_; }

 private:
  /// The model with the linear step of a candidate: the starting point of its refinement.
  FittedModel moved(const Eigen::VectorXd& steps) const {
    FittedModel result = fitted_;
    for (std::size_t k = 0; k < parameters_.size(); ++k)
      result = with_value(result, parameters_[k], parameters_[k].value + steps[static_cast<Eigen::Index>(k)]);
    return result;
  }
  /// Columns of the dictionary, in columns_.
  Indices in_columns(Indices of_dictionary) const {
    for (Eigen::Index& column : of_dictionary) column += jacobian_.cols();
    return of_dictionary;
  }
  Indices columns_of(const Candidate& candidate) const {
    return joined(base_columns_, in_columns(candidate.columns));
  }
  std::vector<Bounds> bounds_of(std::span<const Bounds> own) const { return joined(base_bounds_, own); }
  /// Gain of the best hypothesis on a target.
  double most_gain(const Eigen::VectorXd& values, bool of_plain_friction) const {
    const BlockRegression::Target target = regression_->target(values);
    const double base = regression_->held_out(target, base_columns_, base_bounds_);
    double most = 0;
    for (const Candidate& candidate : dictionary_.candidates) {
      if (of_plain_friction && !is_plain(candidate.effect)) continue;
      most = std::max(
          most, 1 - regression_->held_out(target, columns_of(candidate), bounds_of(candidate.bounds)) / base);
    }
    if (of_plain_friction) return most;
    const double periods = ripple_periods_per_rev(values, position_);
    return periods > 0 ? std::max(most, ripple(periods, values, base).gain) : most;
  }
  void remember(double gain, const Eigen::VectorXd& fitted) {
    if (gain <= most_gain_) return;
    most_gain_ = gain;
    least_left_ = residual_ - fitted;
  }

  struct Ripple {
    double gain;
    Eigen::VectorXd steps;  // of the model's own parameters, then sine and cosine
    Eigen::VectorXd fitted;
  };
  /// Beside the model's own parameters, or these columns.
  Ripple ripple(double periods, const Eigen::VectorXd& target, double base_held_out) const {
    return ripple(periods, target, base_held_out, base_columns_, base_bounds_);
  }
  Ripple ripple(double periods, const Eigen::VectorXd& target, double base_held_out, const Indices& beside,
                std::vector<Bounds> bounds) const {
    const auto count = static_cast<Eigen::Index>(beside.size());
    Eigen::MatrixXd columns(jacobian_.rows(), count + 2);
    columns << columns_(Eigen::all, beside),
        ripple_columns(periods, position_, velocity_, rows_.signals().front().band_Hz);
    const BlockRegression regression(columns, training_.block, kFolds);
    bounds.resize(bounds.size() + 2);
    const BlockRegression::Fit fit =
        regression.fit(regression.target(target), range(0, columns.cols()), bounds);
    return {1 - fit.held_out / base_held_out, fit.coefficients, columns * fit.coefficients};
  }

  struct Pair {
    std::array<std::string_view, 2> effects{};  ///< the second is empty if the first is as good alone
    double gain = 0;
    Eigen::VectorXd fitted;
  };
  /// The best candidate, and the best one, or a ripple, beside it.
  Pair pair(const Eigen::VectorXd& values) const {
    const BlockRegression::Target target = regression_->target(values);
    const double base = regression_->held_out(target, base_columns_, base_bounds_);
    const auto best_beside = [&](const Indices& columns, const std::vector<Bounds>& bounds,
                                 const Candidate* other) {
      const Candidate* best = nullptr;
      double least = regression_->held_out(target, columns, bounds);
      for (const Candidate& candidate : dictionary_.candidates) {
        if (other != nullptr && share_a_column(candidate, *other)) continue;
        const double left = regression_->held_out(target, joined(columns, in_columns(candidate.columns)),
                                                  joined(bounds, candidate.bounds));
        if (left >= least) continue;
        least = left;
        best = &candidate;
      }
      return best;
    };
    Pair best;
    Indices columns = base_columns_;
    std::vector<Bounds> bounds = base_bounds_;
    const auto take = [&](const Candidate& candidate) {
      columns = joined(std::move(columns), in_columns(candidate.columns));
      bounds = joined(std::move(bounds), candidate.bounds);
    };
    const auto keep_fit = [&] {
      const BlockRegression::Fit fit = regression_->fit(target, columns, bounds);
      best.gain = 1 - fit.held_out / base;
      best.fitted = columns_(Eigen::all, columns) * fit.coefficients;
    };
    const Candidate* const first = best_beside(columns, bounds, nullptr);
    if (first != nullptr) {
      take(*first);
      best.effects[0] = first->effect;
    }
    keep_fit();
    const double periods = ripple_periods_per_rev(values - best.fitted, position_);
    std::optional<Ripple> beside;
    if (periods > 0) beside = ripple(periods, values, base, columns, bounds);
    if (first != nullptr) {
      if (const Candidate* const second = best_beside(columns, bounds, first)) {
        take(*second);
        best.effects[1] = second->effect;
        keep_fit();
      }
    }
    if (beside && beside->gain > best.gain) {
      best.effects[first != nullptr ? 1 : 0] = "cogging";
      best.gain = beside->gain;
      best.fitted = std::move(beside->fitted);
    }
    return best;
  }
  static bool share_a_column(const Candidate& one, const Candidate& other) {
    return std::ranges::any_of(one.columns, [&](Eigen::Index column) {
      return std::ranges::find(other.columns, column) != other.columns.end();
    });
  }

  const FittedModel& fitted_;
  const Rows& rows_;
  const Training& training_;
  Dictionary dictionary_;
  std::vector<FreeParameter> parameters_;
  Eigen::MatrixXd jacobian_;
  Eigen::MatrixXd columns_;
  Indices base_columns_;
  std::vector<Bounds> base_bounds_;
  std::optional<BlockRegression> regression_;
  BlockRegression::Target target_;
  Eigen::VectorXd residual_;
  Eigen::VectorXd position_;
  Eigen::VectorXd velocity_;
  BlockRegression::Fit base_;
  Eigen::VectorXd left_;        // residual of the present model, refitted
  Eigen::VectorXd least_left_;  // residual of the best hypothesis so far
  double most_gain_ = 0;
};

struct Rival {
  std::string_view effect;
  FittedModel model;
  BlockRegression::Fit fit;
  std::size_t parameters;
};

/// Number of free parameters of a model. The compliance of a bristle does not count: it is part of the
/// effect.
std::size_t freedom_of(const FittedModel& model, const Rows& rows) {
  const auto parameters = free_parameters(model, rows);
  const bool bristle = model.model.find<model::effects::Presliding>() != nullptr;
  return parameters.size() - (bristle ? 1 : 0);
}

/// Whether one model predicts left-out blocks better than another, and not by chance in a few of them.
bool is_sure(const BlockRegression::Fit& worse, const BlockRegression::Fit& better) {
  std::size_t improved = 0;
  for (std::size_t b = 0; b < worse.held_out_of.size(); ++b)
    improved += better.held_out_of[b] < worse.held_out_of[b] ? 1 : 0;
  if (2 * improved <= worse.held_out_of.size()) return false;
  if (decisiveness(worse.held_out_of, better.held_out_of) >= kSure) return true;
  // A few large blocks make the mean uncertain: then nearly all blocks must improve, and the gain must be
  // large.
  return 5 * improved >= 4 * worse.held_out_of.size() && 1 - better.held_out / worse.held_out >= kMuch;
}

/// Whether the motion of `candidate`, driven by the torque alone, is closer to the training data than that of
/// `than`.
bool simulates_better(const FittedModel& than, const FittedModel& candidate, const Rows& rows,
                      const Training& training) {
  const std::vector<Window> windows = windows_of(rows, training.rows);
  if (windows.empty()) return true;
  const SimulatedMotion motion = simulated_motion(candidate.model, rows, windows);
  return motion.follows && motion.total() < simulated_motion(than.model, rows, windows).total();
}

/// Whether the data determine the amplitudes of the last effect of this name.
bool knows_its_size(const FittedModel& model, std::string_view effect, const Rows& rows,
                    const Training& training) {
  std::size_t at = model.model.effects.size();
  while (at > 0 && model::effects::name_of(model.model.effects[at - 1]) != effect) --at;
  if (at-- == 0) return true;  // not an effect of its own, as an inertia
  const std::span<const std::string_view> amplitudes = model::effects::amplitudes_of(model.model.effects[at]);
  const std::vector<FreeParameter> parameters = free_parameters(model, rows);
  const std::vector<fit::Estimate> found = estimates(model, rows, training.rows);
  for (std::size_t i = 0; i < found.size(); ++i)
    if (parameters[i].kind == FreeParameter::Kind::kEffect && parameters[i].effect == at && !found[i].ok() &&
        std::ranges::find(amplitudes, found[i].name) != amplitudes.end())
      return false;
  return true;
}

/// Whether the data determine the periods per turn of the added ripple.
bool knows_its_periods(const FittedModel& model, const Rows& rows, const Training& training) {
  const std::vector<fit::Estimate> found = estimates(model, rows, training.rows);
  const auto periods =
      std::ranges::find(found.rbegin(), found.rend(), "periods_per_rev", &fit::Estimate::name);
  return periods != found.rend() && periods->ok() &&
         periods->upper - periods->value <= kPeriodsKnownTo * periods->value;
}

FittedModel with_offset(FittedModel fitted) {
  fitted.model.effects.push_back(model::effects::make_effect("torque_offset", {{"torque_Nm", 0}}));
  return fitted;
}
/// Whether the model already has a constant torque.
bool has_constant(const FittedModel& fitted) {
  return fitted.model.find<model::effects::TorqueOffset>() != nullptr ||
         fitted.model.find<model::effects::DirectionAsymmetry>() != nullptr;
}

/// The winner first, then those that win some draws of the noise; empty if no gain is significant.
/// `rivals`: the initial ones; their effects are not tried again.
std::vector<Rival> contest(const FittedModel& before, const std::vector<Round::Outcome>& outcomes,
                           const BlockRegression::Fit& base, const Rows& rows, const Training& training,
                           const Options& options, std::vector<Rival> rivals = {}) {
  // On a short stroke, a spring or a weight off the axis contains a constant torque, which is simpler.
  std::optional<BlockRegression::Fit> constant;
  const auto is_a_constant = [&](const BlockRegression::Fit& fit) {
    if (!constant) constant = score(refined_widely(with_offset(before), rows, training.rows), rows, training);
    return !is_sure(*constant, fit);
  };
  double most = 0;  // maximum gain of the accepted ones
  for (const Rival& rival : rivals) most = std::max(most, 1 - rival.fit.held_out / base.held_out);
  for (const Round::Outcome& outcome : outcomes) {
    if (outcome.gain < std::max(kRival * most, options.least_gain)) break;
    if (std::ranges::find(rivals, outcome.effect, &Rival::effect) != rivals.end()) continue;
    FittedModel model = refined_widely(outcome.model, rows, training.rows);
    BlockRegression::Fit fit = score(model, rows, training);
    if (!is_sure(base, fit)) continue;
    if (outcome.effect == "cogging" && !knows_its_periods(model, rows, training)) continue;
    if (gives(outcome.effect) && fit.held_out > kElasticityLeavesAtMost * base.held_out &&
        (outcome.effect == "backlash" || !simulates_better(before, model, rows, training)))
      continue;
    if (outcome.effect == "backlash" && !crosses_gap(model, rows)) continue;
    if ((outcome.effect == "spring" || outcome.effect == "imbalance") && !has_constant(before) &&
        is_a_constant(fit))
      continue;
    const std::size_t parameters = freedom_of(model, rows);
    most = std::max(most, 1 - fit.held_out / base.held_out);
    rivals.push_back({outcome.effect, std::move(model), std::move(fit), parameters});
  }
  if (rivals.empty()) return rivals;
  std::ranges::sort(rivals, {}, [](const Rival& r) { return r.fit.held_out; });
  const double best = rivals.front().fit.held_out;
  std::erase_if(rivals, [&](const Rival& r) {
    return base.held_out - r.fit.held_out < kAsGood * (base.held_out - best);
  });
  if (rivals.empty()) return rivals;  // the initial one is worse than none
  // Friction that an asymmetry turns into a push, for example, is cut to none, whatever the size of both: an
  // offset, whose size is determined, fits nearly as well and is closer to the truth.
  const auto knows = [&](const Rival& r) { return knows_its_size(r.model, r.effect, rows, training); };
  const auto near = [&](const Rival& r) {
    return base.held_out - r.fit.held_out >= kNearlyAsGood * (base.held_out - best);
  };
  if (rivals.size() > 1 && !knows(rivals.front()) &&
      std::ranges::any_of(rivals, [&](const Rival& r) { return near(r) && knows(r); }))
    std::erase_if(rivals, [&](const Rival& r) { return !knows(r); });
  std::vector<std::vector<double>> squares;
  for (const Rival& rival : rivals) squares.push_back(rival.fit.held_out_of);
  const std::vector<int> wins = draws_won(squares, options.seed);
  for (std::size_t i = rivals.size(); i-- > 0;)
    if (wins[i] == 0) rivals.erase(rivals.begin() + static_cast<std::ptrdiff_t>(i));
  // The simplest of equally good ones is named; a shape with many more free parameters is not a rival.
  std::ranges::stable_sort(rivals, {}, &Rival::parameters);
  const std::size_t simplest = rivals.front().parameters;
  std::erase_if(rivals, [&](const Rival& r) { return r.parameters >= simplest + kMuchFreer; });
  return rivals;
}

/// Removes added effects that no longer reduce the residual.
void drop_idle(SearchResult& result, const Rows& rows, const Training& training, double least_gain) {
  for (std::size_t i = 0; i + 1 < result.added.size();) {
    const std::optional<FittedModel> without = without_added(result, i, rows, training);
    if (without) {
      const BlockRegression::Fit with = score(result.fitted, rows, training);
      const BlockRegression::Fit bare = score(*without, rows, training);
      if (1 - with.held_out / bare.held_out >= least_gain && is_sure(bare, with)) {
        ++i;
        continue;
      }
      result.fitted = *without;
    }
    result.added.erase(result.added.begin() + static_cast<std::ptrdiff_t>(i));
  }
}

/// The winner of a contest, as an addition to `before`.
Added added_of(const std::vector<Rival>& rivals, const FittedModel& before, const BlockRegression::Fit& base,
               double p_value) {
  const Rival& winner = rivals.front();
  Added added{.effect = winner.effect, .before = before, .after = winner.model, .p_value = p_value};
  added.gain = 1 - winner.fit.held_out / base.held_out;
  added.blocks = static_cast<int>(winner.fit.held_out_of.size());
  for (std::size_t b = 0; b < winner.fit.held_out_of.size(); ++b)
    added.blocks_improved += winner.fit.held_out_of[b] < base.held_out_of[b] ? 1 : 0;
  for (std::size_t i = 1; i < rivals.size(); ++i)
    added.rivals.push_back({.effect = std::string(rivals[i].effect)});
  return added;
}

/// An effect that was added early may have explained part of effects that were added later: each one competes
/// with all others again, in its place in the present model. @returns whether one was replaced.
bool replace_misnamed(SearchResult& result, const Rows& rows, const Training& training,
                      const Options& options) {
  for (std::size_t i = 0; i < result.added.size(); ++i) {
    const bool is_newest = i + 1 == result.added.size() &&
                           result.added[i].after.model.effects.size() == result.fitted.model.effects.size();
    if (is_newest) continue;  // it has just won
    const std::optional<FittedModel> without = without_added(result, i, rows, training);
    if (!without) continue;
    Round round(*without, rows, training);
    std::vector<Rival> rivals{{result.added[i].effect, result.fitted, score(result.fitted, rows, training),
                               freedom_of(result.fitted, rows)}};
    rivals = contest(*without, round.outcomes(), round.base(), rows, training, options, std::move(rivals));
    if (rivals.empty()) continue;
    const auto incumbent = std::ranges::find(rivals, result.added[i].effect, &Rival::effect);
    if (incumbent != rivals.end()) {
      // It still wins draws and is not much freer than the simplest one.
      std::rotate(rivals.begin(), incumbent, incumbent + 1);
      for (const Rival& rival : std::span(rivals).subspan(1))
        if (std::ranges::find(result.added[i].rivals, rival.effect, &RivalModel::effect) ==
            result.added[i].rivals.end())
          result.added[i].rivals.push_back({.effect = std::string(rival.effect)});
      continue;
    }
    Added added = added_of(rivals, *without, round.base(), 1);
    added.p_value = round.p_value({.effect = added.effect, .gain = added.gain, .model = {}}, options);
    result.fitted = rivals.front().model;
    result.added.erase(result.added.begin() + static_cast<std::ptrdiff_t>(i));
    result.added.push_back(std::move(added));  // its effect is also the last one in the model
    return true;
  }
  return false;
}

/// "0.42"
std::string short_text(double value) {
  std::array<char, 24> text{};
  std::snprintf(text.data(), text.size(), "%.2g", value);
  return text.data();
}

/// Chooses the form of an added Stribeck curve that predicts left-out blocks better: with the wrong form, the
/// residual of its tail would become Coulomb friction, a dip or a drag.
void choose_tail(SearchResult& result, const Rows& rows, const Training& training) {
  for (std::size_t i = 0; i < result.added.size(); ++i) {
    const std::optional<std::size_t> at = place_of_added(result, i);
    if (!at || result.added[i].effect != model::effects::Stribeck::kName) continue;
    auto parameters = std::get<model::effects::Stribeck>(result.fitted.model.effects[*at]).parameters();
    parameters.tail = parameters.tail == 0 ? 1 : 0;
    FittedModel other = result.fitted;
    other.model.effects[*at] = model::effects::Stribeck(parameters);
    other = refined(other, rows, training.rows);
    const BlockRegression::Fit now = score(result.fitted, rows, training);
    if (score(other, rows, training).held_out < now.held_out) result.fitted = std::move(other);
  }
}

/// Reason why the search did not add this effect: the first criterion that it did not meet.
std::string reason_against(const Round::Outcome& outcome, const Round& round, int step, double p,
                           double least_square, const Options& options) {
  if (outcome.gain <= 0) return "predicts left-out stretches no better";
  if (outcome.gain < options.least_gain)
    return "takes away less than " + short_text(100 * options.least_gain) + " % of the squared residual";
  if (step >= kMaxEffects) return "as many effects as the search adds were found before it";
  if (outcome.gain * round.base().held_out < least_square)
    return "takes away less than the noise floor lets tell";
  if (const double allowed = round.allowed_chance(outcome.effect, options); p > allowed)
    return "chance gives the search as much: p is " + short_text(p) + " or more, allowed is " +
           short_text(allowed);
  if (outcome.effect == "cogging")
    return "its gain is not sure, or its periods a turn are not known to a tenth";
  if (outcome.effect == "backlash")
    return "its gain is not sure, it takes less than half of what is left, or the joint does not cross its "
           "gap";
  if (gives(outcome.effect))
    return "its gain is not sure, or it takes less than half of what is left and the data are simulated no "
           "better";
  return "its gain is not sure: made by too few of the left-out stretches";
}

void report(const Options& options, std::string_view what, double done) {
  if (options.progress) options.progress(what, done);
}

}  // namespace

bool gives(std::string_view effect) noexcept {
  return effect == "presliding" || effect == "backlash" || effect == "elasticity";
}

bool crosses_gap(const FittedModel& fitted, const Rows& rows) {
  const auto* const backlash = fitted.model.find<model::effects::Backlash>();
  if (backlash == nullptr) return false;
  const double gap_rad = backlash->parameters().gap_rad;
  if (gap_rad > kWidestGap * widest_span_rad(rows.signals())) return false;
  int crossings = 0;
  for (const Signals& signals : rows.signals()) {
    double flank_rad = 0;
    for (const double twist_rad : load_side_of(fitted.model, signals).twist_rad) {
      if (std::abs(twist_rad) < kAtFlank * 0.5 * gap_rad) continue;
      crossings += twist_rad * flank_rad < 0 ? 1 : 0;
      flank_rad = twist_rad;
    }
  }
  return crossings >= kMinCrossings;
}

std::optional<std::size_t> place_of_added(const SearchResult& result, std::size_t i) {
  const auto same = [&](const Added& other) { return other.effect == result.added[i].effect; };
  const auto here = result.added.begin() + static_cast<std::ptrdiff_t>(i);
  auto later = std::count_if(here, result.added.end(), same);  // itself among them
  const std::vector<model::effects::AnyEffect>& effects = result.fitted.model.effects;
  for (std::size_t at = effects.size(); at-- > 0;)
    if (model::effects::name_of(effects[at]) == result.added[i].effect && --later == 0) return at;
  return {};
}

std::optional<FittedModel> without_added(const SearchResult& result, std::size_t i, const Rows& rows,
                                         const Training& training,
                                         const std::function<bool(const FreeParameter&)>& is_free) {
  const std::optional<std::size_t> at = place_of_added(result, i);
  if (!at) return {};
  FittedModel without = result.fitted;
  without.model.effects.erase(without.model.effects.begin() + static_cast<std::ptrdiff_t>(*at));
  if (result.added[i].effect == "inertia") without.model.inertia_kg_m2 = without.given_inertia_kg_m2;
  return refined(without, rows, training.rows, is_free);
}

std::vector<RivalModel> with_one_of(const FittedModel& without, const std::vector<std::string>& effects,
                                    const Rows& rows, const Training& training) {
  std::vector<RivalModel> rivals;
  Round round(without, rows, training);
  for (const Round::Outcome& outcome : round.outcomes())
    if (std::ranges::find(effects, outcome.effect) != effects.end())
      rivals.push_back({std::string(outcome.effect), refined_widely(outcome.model, rows, training.rows)});
  return rivals;
}

std::vector<double> left_out_squares(const FittedModel& fitted, const Rows& rows, const Training& training) {
  return score(fitted, rows, training).held_out_of;
}

SearchResult search(const FittedModel& start, const Rows& rows, const Training& training,
                    const Options& options) {
  SearchResult result;
  report(options, "refitting the model's own parameters", 0.1);
  result.fitted = refined_widely(start, rows, training.rows);
  const double least_square =
      training.least_Nm * training.least_Nm * static_cast<double>(training.rows.size());
  int replaced = 0;
  for (int step = 0;; ++step) {
    const auto passed = [step](double of_step) {
      return 0.1 + 0.8 * (step + of_step) / (step + of_step + 2);
    };
    report(options, "trying effects", passed(0));
    Round round(result.fitted, rows, training);
    const std::vector<Round::Outcome> outcomes = round.outcomes();
    const int additions = step - replaced;
    const auto is_worth = [&](const Round::Outcome& outcome) {
      return outcome.gain >= options.least_gain && outcome.gain * round.base().held_out >= least_square;
    };
    const bool worth = additions < kMaxEffects && !outcomes.empty() && is_worth(outcomes.front());
    report(options, "trying the same on chance data", passed(0.2));
    std::map<std::string_view, double> p_of;  // of the effects whose chance was tried
    const auto is_chance = [&](const Round::Outcome& outcome) {
      if (!p_of.contains(outcome.effect)) p_of[outcome.effect] = round.p_value(outcome, options);
      return p_of[outcome.effect] > round.allowed_chance(outcome.effect, options);
    };
    // The residual that chance is drawn from contains a second missing effect, as if it were noise.
    if (worth && is_chance(outcomes.front()) && p_of[outcomes.front().effect] <= kPerhapsTwo)
      p_of[outcomes.front().effect] =
          std::min(p_of[outcomes.front().effect], round.pair_p_value(outcomes.front().effect, options));
    // An effect whose gain is chance does not compete with plain friction whose gain is not.
    std::vector<Round::Outcome> contestants;
    if (worth && !is_chance(outcomes.front())) {
      contestants = outcomes;
    } else if (worth) {
      std::ranges::copy_if(outcomes, std::back_inserter(contestants), [&](const Round::Outcome& outcome) {
        return round.is_plain(outcome.effect) && is_worth(outcome) && !is_chance(outcome);
      });
    }
    report(options, "fitting rivals", passed(0.4));
    std::vector<Rival> rivals;
    if (!contestants.empty())
      rivals = contest(result.fitted, contestants, round.base(), rows, training, options);
    // The simplest rival gains less than the best outcome, and chance reaches a smaller gain more often. A
    // rival whose gain chance reaches too often is replaced by the next one.
    while (!rivals.empty() &&
           is_chance(*std::ranges::find(outcomes, rivals.front().effect, &Round::Outcome::effect)))
      rivals.erase(rivals.begin());
    // Chance reaches a smaller gain at least as often, if it is tried on the same effects.
    const auto p_at_least = [&](const Round::Outcome& outcome) {
      if (const auto tried = p_of.find(outcome.effect); tried != p_of.end()) return tried->second;
      if (!worth) return 1.0;
      std::optional<double> least;
      for (const auto& [effect, p] : p_of)
        if (round.is_plain(effect) == round.is_plain(outcome.effect)) least = std::min(p, least.value_or(p));
      return least.value_or(p_of.at(outcomes.front().effect));
    };
    if (rivals.empty() && replaced < kMaxReplaced && replace_misnamed(result, rows, training, options)) {
      ++replaced;
      choose_tail(result, rows, training);
      drop_idle(result, rows, training, options.least_gain);
      continue;
    }
    if (rivals.empty()) {
      for (const Round::Outcome& outcome : outcomes)
        result.rejected.push_back(
            {std::string(outcome.effect), std::max(0.0, outcome.gain),
             reason_against(outcome, round, additions, p_at_least(outcome), least_square, options)});
      return result;
    }
    result.added.push_back(added_of(rivals, result.fitted, round.base(), p_of[rivals.front().effect]));
    result.fitted = rivals.front().model;
    choose_tail(result, rows, training);
    drop_idle(result, rows, training, options.least_gain);
  }
}

}  // namespace identification::gap
