#include "identification/gap/delivery.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>

#include "identification/gap/block_comparison.h"
#include "identification/gap/free_simulation.h"
#include "identification/gap/parallel.h"

namespace identification::gap {
namespace {

constexpr std::size_t kDeliveryBlocks = 20;
/// Standard errors: a larger difference is significant.
constexpr double kWorse = 2;
/// A given value is replaced if the new one is better by this: about the effect of three standard deviations
/// of a parameter.
constexpr double kAsked = 1.5;
/// Share of the square below which two models count as equal, however significant the difference.
constexpr double kAlike = 0.01;
/// The same if one of them keeps something that the data do not require to change: a given value, or a
/// presliding that is visible at rest.
constexpr double kAlikeIfGiven = 0.05;
constexpr double kMaxResidualShare = 0.5;
/// Maximum share of the squared torque residual that a gap, a spring or a bristle may leave.
constexpr double kLeavesAtMost = 0.8;

double total(const std::vector<double>& squares) {
  double sum = 0;
  for (const double square : squares) sum += square;
  return sum;
}

/// Squared residuals of one model on the held-out data.
struct Score {
  std::vector<double> torque;  ///< by block
  SimulatedMotion simulation;
  std::vector<double> closed_loop;  ///< by stretch of each recording with a set-point
};

class HeldOut {
 public:
  explicit HeldOut(const Judged& judged)
      : judged_(judged), windows_(windows_of(judged.rows, judged.held_out)) {}

  Score score(const FittedModel& fitted) const {
    return {blocks(fitted, judged_.held_out), simulated_motion(fitted.model, judged_.rows, windows_),
            closed_loop(fitted)};
  }
  std::vector<double> closed_loop(const FittedModel& fitted) const {
    std::vector<std::vector<double>> of_runs(judged_.held_out_runs.size());
    in_parallel(of_runs.size(), [&](std::size_t i) {
      of_runs[i] = closed_loop_squares(fitted.model, judged_.held_out_runs[i]);
    });
    std::vector<double> all;
    for (const std::vector<double>& squares : of_runs) all.insert(all.end(), squares.begin(), squares.end());
    return all;
  }
  std::size_t simulated_samples() const {
    std::size_t samples = 0;
    for (const Window& window : windows_) samples += window.length;
    return samples;
  }
  /// Squares of the torque residual over `rows`, in blocks.
  std::vector<double> blocks(const FittedModel& fitted, const std::vector<Eigen::Index>& rows) const {
    const Eigen::VectorXd left = (judged_.rows.torque_Nm() - predicted_rows(fitted, judged_.rows))(rows);
    std::vector<double> squares(kDeliveryBlocks, 0);
    for (Eigen::Index i = 0; i < left.size(); ++i)
      squares[static_cast<std::size_t>(i) * kDeliveryBlocks / rows.size()] += left[i] * left[i];
    return squares;
  }

 private:
  const Judged& judged_;
  std::vector<Window> windows_;
};

bool is_worse(const std::vector<double>& than, const std::vector<double>& candidate, double alike) {
  return total(candidate) > (1 + alike) * total(than) && decisiveness(candidate, than) > kWorse;
}
/// Removes little of the remaining torque residual; or not most of it, and simulates no better.
bool is_doubtful(const Score& than, const Score& candidate) {
  const bool simulates_better =
      candidate.simulation.follows && candidate.simulation.total() < than.simulation.total();
  return total(candidate.torque) >
         (simulates_better ? kLeavesAtMost : kMaxResidualShare) * total(than.torque);
}
/// What is worse with a candidate; empty: nothing.
std::string worse_at(const Score& than, const Score& candidate, double alike = kAlike) {
  if (is_worse(than.torque, candidate.torque, alike)) return "predicts the torque of the held-out data worse";
  if (is_worse(than.simulation.squares, candidate.simulation.squares, alike))
    return "simulates the held-out data worse";
  if (is_worse(than.closed_loop, candidate.closed_loop, alike))
    return "follows the held-out set-points worse, with its servo";
  return "";
}
/// `candidate` as it is compared with `than`: a simulation that follows the motion neither way says nothing
/// about the difference.
Score judged_against(const Score& than, Score candidate) {
  if (!than.simulation.follows && !candidate.simulation.follows) candidate.simulation = than.simulation;
  return candidate;
}

/// Index in the given model of the delivered effect `effect`; the added ones come after those.
class GivenPlaces {
 public:
  GivenPlaces(const model::effects::DriveModel& given, const model::effects::DriveModel& final) {
    const bool replaced =
        given.find<model::effects::TorqueOffset>() && !final.find<model::effects::TorqueOffset>();
    for (std::size_t i = 0; i < given.effects.size(); ++i)
      if (!replaced || !std::holds_alternative<model::effects::TorqueOffset>(given.effects[i]))
        places_.push_back(i);
  }
  std::optional<std::size_t> of(std::size_t effect) const {
    return effect < places_.size() ? std::optional(places_[effect]) : std::nullopt;
  }

 private:
  std::vector<std::size_t> places_;
};

bool is_same(const FreeParameter& a, const FreeParameter& b) {
  return a.kind == b.kind && a.effect == b.effect && a.name == b.name;
}

/// The given value of a parameter; empty for additions and for the recording of the torque.
std::optional<double> given_value(const FreeParameter& p, const FittedModel& given,
                                  const GivenPlaces& places) {
  if (p.kind == FreeParameter::Kind::kInertia) return given.model.inertia_kg_m2;
  if (p.kind != FreeParameter::Kind::kEffect) return {};
  const auto place = places.of(p.effect);
  if (!place) return {};
  return model::effects::parameter_of(given.model.effects[*place], p.name);
}

/// All parameters except these are free.
std::function<bool(const FreeParameter&)> all_but(const std::vector<FreeParameter>& fixed) {
  return [&fixed](const FreeParameter& p) {
    return std::ranges::none_of(fixed, [&](const FreeParameter& f) { return is_same(f, p); });
  };
}

/// `fitted` with these at their given values, the others refined.
FittedModel with_given(const FittedModel& fitted, const std::vector<FreeParameter>& fixed,
                       const FittedModel& given, const GivenPlaces& places, const Judged& judged) {
  FittedModel start = fitted;
  for (FreeParameter p : fixed) {
    const double value = *given_value(p, given, places);
    p.lower = std::min(p.lower, value);  // the search's bounds do not bind what is given
    p.upper = std::max(p.upper, value);
    start = with_value(start, p, value);
  }
  return refined(start, judged.rows, judged.training.rows, all_but(fixed));
}

/// Share of a squared residual that an effect removes, and its significance.
struct Gain {
  double share;
  double decisiveness;
};
Gain gain_of(const std::vector<double>& bare, const std::vector<double>& left) {
  return {total(bare) > 0 ? 1 - total(left) / total(bare) : 0, decisiveness(bare, left)};
}

/// Drops effects that do not reduce the residual of held-out recordings or, if these cannot decide (as fast
/// ones cannot for a Stribeck curve), that of the stretches left out in turn. Each remaining effect stores
/// the model without it.
void drop_useless(SearchResult& result, const std::vector<FreeParameter>& fixed, const HeldOut& held_out,
                  const Judged& judged) {
  for (std::size_t i = result.added.size(); i-- > 0;) {
    Added& added = result.added[i];
    std::optional<FittedModel> without =
        without_added(result, i, judged.rows, judged.training, all_but(fixed));
    if (!without) continue;
    const Gain of_held_out =
        gain_of(held_out.blocks(*without, judged.held_out), held_out.blocks(result.fitted, judged.held_out));
    added.judged_by_held_out = judged.own_recordings && std::abs(of_held_out.decisiveness) > kWorse;
    added.gain = added.judged_by_held_out
                     ? of_held_out.share
                     : gain_of(left_out_squares(*without, judged.rows, judged.training),
                               left_out_squares(result.fitted, judged.rows, judged.training))
                           .share;
    if (added.gain > 0) {
      added.without = std::move(*without);
      continue;
    }
    result.rejected.push_back({std::string(added.effect), added.gain,
                               "takes away nothing of the residual that it was not fitted to"});
    result.fitted = std::move(*without);
    result.added.erase(result.added.begin() + static_cast<std::ptrdiff_t>(i));
    i = result.added.size();  // the remaining ones now remove something else
  }
}

std::vector<FreeParameter> given_parameters(const FittedModel& fitted, const FittedModel& given,
                                            const GivenPlaces& places, const Rows& rows) {
  std::vector<FreeParameter> list = free_parameters(fitted, rows);
  std::erase_if(list, [&](const FreeParameter& p) { return !given_value(p, given, places); });
  return list;
}

}  // namespace

std::vector<std::string> deliver(SearchResult& result, const FittedModel& given, const Judged& judged) {
  const HeldOut held_out(judged);
  Score score = held_out.score(result.fitted);
  for (std::size_t i = result.added.size(); i-- > 0;) {
    const std::optional<FittedModel> without = without_added(result, i, judged.rows, judged.training);
    if (!without) continue;
    Score bare = held_out.score(*without);
    const Score with = judged_against(bare, score);
    std::string reason = worse_at(bare, with);
    if (!reason.empty()) reason = "with it the model " + reason;
    if (reason.empty() && gives(result.added[i].effect) && is_doubtful(bare, with))
      reason = "with it most of the gap stays, or the held-out data are simulated no better";
    // A threshold determines the torque that the motion is compared with: only the motion itself can confirm
    // it.
    if (reason.empty() && result.added[i].effect == "torque_deadband" && !bare.simulation.squares.empty() &&
        !(with.simulation.follows && with.simulation.total() < bare.simulation.total()))
      reason = "with it the held-out data are simulated no better from their commands";
    if (reason.empty()) continue;
    result.rejected.push_back({std::string(result.added[i].effect), result.added[i].gain, reason});
    result.fitted = *without;
    result.added.erase(result.added.begin() + static_cast<std::ptrdiff_t>(i));
    score = std::move(bare);
  }

  const GivenPlaces places(given.model, result.fitted.model);
  std::vector<FreeParameter> own = given_parameters(result.fitted, given, places, judged.rows);
  const FittedModel unfitted = with_given(result.fitted, own, given, places, judged);
  Score as_given = held_out.score(unfitted);
  if (const std::string worse = worse_at(as_given, score); !worse.empty()) {
    result.fitted = unfitted;
    drop_useless(result, own, held_out, judged);
    return {"The given model's own parameters keep their values: refitted, the model " + worse + "."};
  }

  // Those with the smallest relative change first.
  std::ranges::sort(own, {}, [&](const FreeParameter& p) {
    return std::abs(p.value - *given_value(p, given, places)) / p.scale;
  });
  std::vector<FreeParameter> fixed;
  std::vector<double> searched = held_out.blocks(result.fitted, judged.training.rows);
  for (const FreeParameter& p : own) {
    std::vector<FreeParameter> trial = fixed;
    trial.push_back(p);
    const FittedModel kept = with_given(result.fitted, trial, given, places, judged);
    const std::vector<double> left = held_out.blocks(kept, judged.training.rows);
    if (decisiveness(left, searched) > kAsked) continue;
    Score candidate = held_out.score(kept);
    if (!worse_at(score, candidate, kAlikeIfGiven).empty()) continue;
    result.fitted = kept;
    searched = left;
    score = std::move(candidate);
    fixed = std::move(trial);
  }
  drop_useless(result, fixed, held_out, judged);
  return {};
}

WithPresliding with_presliding(const FittedModel& delivered, const model::effects::AnyEffect& presliding,
                               const Judged& judged) {
  FittedModel with = delivered;
  with.model.effects.push_back(presliding);
  const std::size_t at = with.model.effects.size() - 1;
  with = refined(with, judged.rows, judged.training.rows, [at](const FreeParameter& p) {
    return p.kind == FreeParameter::Kind::kEffect && p.effect == at && p.name == "damping_Nm_s_per_rad";
  });
  const HeldOut held_out(judged);
  const Score before = held_out.score(delivered);
  return {with, worse_at(before, judged_against(before, held_out.score(with)), kAlikeIfGiven)};
}

FittedModel fitted_to_servo(const FittedModel& delivered, const std::vector<ServoRun>& searched,
                            const Judged& judged) {
  if (searched.empty() || judged.held_out_runs.empty()) return delivered;
  FittedModel refined = refined_in_closed_loop(delivered, judged.rows, searched);
  const HeldOut held_out(judged);
  const Score before = held_out.score(delivered);
  const Score after = held_out.score(refined);
  const bool better = is_worse(after.closed_loop, before.closed_loop, kAlike);
  return better && worse_at(before, after, kAlikeIfGiven).empty() ? refined : delivered;
}

HeldOutComparison compared(const FittedModel& than, const FittedModel& candidate, const Judged& judged) {
  const HeldOut held_out(judged);
  const Score before = held_out.score(than);
  const Score after = held_out.score(candidate);
  const Gain gain = gain_of(before.torque, after.torque);
  const auto rms = [](const std::vector<double>& squares, std::size_t count) {
    return count > 0 ? std::sqrt(total(squares) / static_cast<double>(count)) : 0;
  };
  HeldOutComparison result{
      .gain = gain.share,
      .decisiveness = gain.decisiveness,
      .blocks = static_cast<int>(kDeliveryBlocks),
      .before_Nm = rms(before.torque, judged.held_out.size()),
      .after_Nm = rms(after.torque, judged.held_out.size()),
      .simulation_before_rad_per_s = rms(before.simulation.squares, held_out.simulated_samples()),
      .simulation_after_rad_per_s = rms(after.simulation.squares, held_out.simulated_samples()),
      .worse_at = worse_at(before, judged_against(before, after))};
  for (std::size_t b = 0; b < kDeliveryBlocks; ++b)
    result.blocks_improved += after.torque[b] < before.torque[b] ? 1 : 0;
  return result;
}

}  // namespace identification::gap
