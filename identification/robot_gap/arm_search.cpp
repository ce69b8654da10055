#include "identification/robot_gap/arm_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <set>
#include <utility>

#include "identification/chance.h"
#include "identification/gap/parallel.h"
#include "identification/gap/sign_test.h"

namespace identification::robot_gap {
namespace {

using gap::BlockRegression;
using gap::Bounds;

constexpr int kFolds = 10;
/// Candidates whose left-out squares differ by less than this share count as equal; the simpler one is taken.
constexpr double kEqual = 0.01;
/// Probability by chance that so many more blocks improve.
constexpr double kSignLevel = 0.05;
constexpr double kLongestLag_s = 0.02;
/// Linearised fits until terms that are not quite linear agree with themselves.
constexpr int kFits = 3;
constexpr std::size_t kMostEffects = 8;
/// Candidates with this share of the largest gain are fitted, at most so many.
constexpr double kNear = 0.8;
constexpr std::size_t kShortList = 8;
constexpr int kRevisions = 6;
/// A residual of so many noise floors leaves nothing to explain.
constexpr double kQuiet = 1.1;

std::vector<Term> with_lag(std::vector<Term> terms) {
  terms.push_back({Term::Kind::kLag});
  return terms;
}

struct WeightedRows {
  Eigen::MatrixXd columns;
  Eigen::VectorXd residual;
};
WeightedRows weighted(const control::ArmDescription& arm, const ArmData& data, const Catalogue& catalogue) {
  ComparedRows rows = compare(arm, data.motions, data.plan, with_lag(catalogue.terms));
  WeightedRows result{std::move(rows.columns), rows.measured_Nm - rows.predicted_Nm};
  for (Eigen::Index i = 0; i < result.residual.size(); ++i) {
    const double weight = 1 / data.sigma_Nm[data.plan.rows[static_cast<std::size_t>(i)].joint];
    result.residual[i] *= weight;
    result.columns.row(i) *= weight;
  }
  return result;
}

/// One that could be added: neither there nor banned, in any variant.
bool is_free(std::size_t candidate, const Chosen& chosen, std::span<const std::size_t> banned,
             const Catalogue& catalogue) {
  const auto same = [&](std::size_t other) {
    return catalogue.candidates[candidate].same_effect(catalogue.candidates[other]);
  };
  return std::ranges::find(chosen, candidate) == chosen.end() && std::ranges::none_of(banned, same);
}

Chosen all_of(const Catalogue& catalogue) {
  Chosen all;
  for (std::size_t i = 0; i < catalogue.candidates.size(); ++i) all.push_back(i);
  return all;
}

/// Whether torques are a sum over these terms: one fit finds them.
bool are_linear(const std::vector<Term>& terms) {
  return std::ranges::none_of(terms, [](const Term& term) {
    return term.kind == Term::Kind::kPayloadMoment || term.kind == Term::Kind::kLinkCentre ||
           term.kind == Term::Kind::kTilt || term.kind == Term::Kind::kEncoderZero ||
           term.kind == Term::Kind::kTorqueScale || term.kind == Term::Kind::kLoadFriction;
  });
}

/// The chosen candidates' fit, without the columns of the others.
struct FittedAlone {
  FittedArm fitted;
  std::vector<double> left_out;  // squares of each block
};
FittedAlone fitted_alone(const control::ArmDescription& given, const ArmData& data,
                         const Catalogue& catalogue, const Chosen& chosen) {
  const Catalogue own = only(catalogue, chosen);
  const Chosen all = all_of(own);
  FittedAlone result{{given, 0}, {}};
  const int rounds = are_linear(own.terms) ? 1 : kFits;
  for (int round = 0; round < rounds; ++round) {
    const Linearised rows(given, result.fitted.arm, all, data, own);
    const std::vector<Eigen::Index> columns = rows.columns_of(all);
    gap::BlockRegression::Fit fit = rows.fit(all);
    result.fitted.arm = given;
    for (std::size_t k = 0; k < columns.size(); ++k) {
      const double step = fit.coefficients[static_cast<Eigen::Index>(k)];
      if (columns[k] == rows.lag_column())
        result.fitted.lag_s = step;
      else
        change(result.fitted.arm, own.terms[static_cast<std::size_t>(columns[k])], step);
    }
    result.left_out = std::move(fit.held_out_of);
  }
  return result;
}

/// What all comparisons of candidates need.
struct Field {
  const control::ArmDescription& given;
  const ArmData& data;
  const Catalogue& catalogue;
  std::span<const std::size_t> banned;
};

double sum_of(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum;
}

struct Best {
  std::size_t candidate = 0;
  double left = 0;  // as left_out() of the rows says it
};
/// The candidate that leaves least; of nearly equal ones, the simplest. Those that are near the best are
/// fitted by themselves, because few terms are quite linear.
std::optional<Best> best_of(const Field& field, const Linearised& rows, const Chosen& chosen) {
  struct Tried {
    std::size_t candidate = 0;
    double left = 0;
    double fitted = 0;
  };
  std::vector<Tried> tried;
  for (std::size_t c = 0; c < field.catalogue.candidates.size(); ++c)
    if (is_free(c, chosen, field.banned, field.catalogue)) tried.push_back({c});
  if (tried.empty()) return {};
  gap::in_parallel(tried.size(), [&](std::size_t i) {
    tried[i].left = rows.left_out(with_candidate(chosen, tried[i].candidate, field.catalogue));
  });
  std::ranges::stable_sort(tried, {}, &Tried::left);
  const double before = rows.left_out(chosen);
  const double most_gain = before - tried.front().left;
  std::erase_if(tried, [&](const Tried& one) { return before - one.left < kNear * most_gain; });
  if (tried.empty() || !(most_gain > 0)) return {};
  if (tried.size() > kShortList) tried.resize(kShortList);
  if (tried.size() == 1) return Best{tried.front().candidate, tried.front().left};
  for (Tried& one : tried)
    one.fitted = sum_of(left_out_squares(field.given, field.data, field.catalogue,
                                         with_candidate(chosen, one.candidate, field.catalogue)));
  const double least = std::ranges::min_element(tried, {}, &Tried::fitted)->fitted;
  const Tried* best = nullptr;
  for (const Tried& one : tried) {
    if (one.fitted > (1 + kEqual) * least) continue;
    const std::size_t size = field.catalogue.candidates[one.candidate].terms.size();
    const std::size_t best_size =
        best == nullptr ? 0 : field.catalogue.candidates[best->candidate].terms.size();
    if (best == nullptr || size < best_size || (size == best_size && one.fitted < best->fitted)) best = &one;
  }
  return Best{best->candidate, std::min(best->left, before)};
}

/// Whether no joint shows more than noise.
bool is_quiet(const Linearised& rows, const Chosen& chosen, const ArmData& data) {
  const std::vector<Eigen::Index> columns = rows.columns_of(chosen);
  const Eigen::VectorXd left =
      rows.residual() - rows.columns()(Eigen::all, columns) * rows.fit(chosen).coefficients;
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(data.sigma_Nm.size());
  Eigen::VectorXd counts = Eigen::VectorXd::Zero(data.sigma_Nm.size());
  for (Eigen::Index i = 0; i < left.size(); ++i) {
    const Eigen::Index j = data.plan.rows[static_cast<std::size_t>(i)].joint;
    squares[j] += left[i] * left[i];
    ++counts[j];
  }
  for (Eigen::Index j = 0; j < squares.size(); ++j) {
    const double quiet = kQuiet * data.floor_Nm[j] / data.sigma_Nm[j];
    if (squares[j] > quiet * quiet * counts[j]) return false;
  }
  return true;
}

/// A target whose blocks have other signs: what a block shows does not depend on its sign unless an effect
/// explains it.
BlockRegression::Target flipped(const BlockRegression::Target& target, const Eigen::VectorXd& signs) {
  BlockRegression::Target result = target;
  for (Eigen::VectorXd& sum : result.fold_product) sum.setZero();
  result.total_product.setZero();
  for (std::size_t b = 0; b < result.product.size(); ++b) {
    result.product[b] *= signs[static_cast<Eigen::Index>(b)];
    result.fold_product[b % result.fold_product.size()] += result.product[b];
    result.total_product += result.product[b];
  }
  return result;
}

/// Probability that the best candidate gains as much on data without an effect.
double chance_of_gain(const Linearised& rows, const Chosen& chosen, std::span<const std::size_t> banned,
                      const Catalogue& catalogue, double gain, const SearchOptions& options) {
  const std::vector<Eigen::Index> base = rows.columns_of(chosen);
  const BlockRegression::Fit fit = rows.fit(chosen);
  Eigen::VectorXd left = rows.residual();
  for (std::size_t k = 0; k < base.size(); ++k)
    left -= rows.columns().col(base[k]) * fit.coefficients[static_cast<Eigen::Index>(k)];
  const BlockRegression::Target target = rows.regression().target(left);
  const std::vector<Bounds> free_bounds(base.size());
  std::vector<std::pair<std::vector<Eigen::Index>, std::vector<Bounds>>> tried;
  for (std::size_t c = 0; c < catalogue.candidates.size(); ++c) {
    if (!is_free(c, chosen, banned, catalogue)) continue;
    std::vector<Eigen::Index> columns = rows.columns_of(with_candidate(chosen, c, catalogue));
    std::vector<Bounds> bounds = rows.bounds_of(columns);
    // What is fitted already may change either way.
    for (std::size_t k = 0; k < columns.size(); ++k)
      if (std::ranges::find(base, columns[k]) != base.end()) bounds[k] = {};
    tried.emplace_back(std::move(columns), std::move(bounds));
  }
  std::mt19937_64 random(options.seed);
  ChanceTest chance;
  chance.repetitions = options.repetitions;
  chance.draw = [&] {
    Eigen::VectorXd signs(static_cast<Eigen::Index>(target.product.size()));
    for (double& sign : signs) sign = (random() & 1U) != 0 ? 1.0 : -1.0;
    return signs;
  };
  chance.most_gain = [&](const Eigen::VectorXd& signs) {
    const BlockRegression::Target data = flipped(target, signs);
    const double before = rows.regression().held_out(data, base, free_bounds);
    double least = before;
    for (const auto& [columns, bounds] : tried)
      least = std::min(least, rows.regression().held_out(data, columns, bounds));
    return 1 - least / before;
  };
  return chance.p_value(gain);
}

Added evidence_of(const Linearised& rows, const Chosen& without, std::size_t candidate) {
  Chosen with = without;
  with.push_back(candidate);
  const std::vector<double> before = rows.fit(without).held_out_of;
  const std::vector<double> after = rows.fit(with).held_out_of;
  Added added{.candidate = candidate, .blocks = static_cast<int>(before.size())};
  double sum_before = 0;
  double sum_after = 0;
  for (std::size_t b = 0; b < before.size(); ++b) {
    sum_before += before[b];
    sum_after += after[b];
    added.blocks_improved += after[b] < before[b] ? 1 : 0;
  }
  added.gain = sum_before > 0 ? 1 - sum_after / sum_before : 0;
  return added;
}

/// Whether the gain is spread over the data.
bool is_spread(const Linearised& rows, const Chosen& before, const Chosen& after) {
  return gap::chance_of(rows.fit(before).held_out_of, rows.fit(after).held_out_of) <= kSignLevel;
}

Chosen without_place(const Chosen& chosen, std::size_t place) {
  Chosen rest = chosen;
  rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(place));
  return rest;
}

/// Replaces a chosen candidate by one that leaves clearly less, or removes one without which as little is
/// left. Returns whether anything changed.
bool revise(const Field& field, const Linearised& rows, Chosen& chosen, double least_gain) {
  if (chosen.size() < 2) return false;
  const double left = rows.left_out(chosen);
  for (std::size_t place = chosen.size(); place-- > 0;) {
    const Chosen rest = without_place(chosen, place);
    if (1 - left / rows.left_out(rest) > least_gain / 2) continue;
    chosen = rest;
    return true;
  }
  for (std::size_t place = 0; place < chosen.size(); ++place) {
    const Chosen rest = without_place(chosen, place);
    const std::optional<Best> other = best_of(field, rows, rest);
    if (!other || other->candidate == chosen[place]) continue;
    const Chosen revised = with_candidate(rest, other->candidate, field.catalogue);
    if (revised.size() < chosen.size()) continue;  // in place of another variant of its own
    const double own = sum_of(left_out_squares(field.given, field.data, field.catalogue, chosen));
    const double others = sum_of(left_out_squares(field.given, field.data, field.catalogue, revised));
    if (others > (1 - least_gain) * own) continue;
    chosen = revised;
    return true;
  }
  return false;
}

}  // namespace

Chosen with_candidate(Chosen chosen, std::size_t candidate, const Catalogue& catalogue) {
  const Candidate& added = catalogue.candidates[candidate];
  std::erase_if(chosen, [&](std::size_t one) { return added.same_effect(catalogue.candidates[one]); });
  chosen.push_back(candidate);
  return chosen;
}

Linearised::Linearised(const control::ArmDescription& given, const control::ArmDescription& at,
                       const Chosen& chosen, const ArmData& data, const Catalogue& catalogue)
    : given_(given), catalogue_(catalogue), regression_(columns_, {}, kFolds) {
  WeightedRows rows = weighted(at, data, catalogue);
  columns_ = std::move(rows.columns);
  residual_ = std::move(rows.residual);
  for (const Eigen::Index column : columns_of(chosen)) {
    if (column == lag_column()) continue;
    const Term& term = catalogue.terms[static_cast<std::size_t>(column)];
    residual_ +=
        columns_.col(column) * (reported_value(term, given, at) - reported_value(term, given, given));
  }
  regression_ = BlockRegression(columns_, data.plan.block, kFolds);
  target_ = regression_.target(residual_);
}

std::vector<Eigen::Index> Linearised::columns_of(const Chosen& chosen) const {
  std::vector<Eigen::Index> columns;
  for (const std::size_t candidate : chosen)
    for (const std::size_t term : catalogue_.candidates[candidate].terms) {
      const auto column = static_cast<Eigen::Index>(term);
      if (std::ranges::find(columns, column) == columns.end()) columns.push_back(column);
    }
  columns.push_back(lag_column());
  return columns;
}

std::vector<Bounds> Linearised::bounds_of(std::span<const Eigen::Index> columns) const {
  std::vector<Bounds> bounds;
  for (const Eigen::Index column : columns) {
    if (column == lag_column())
      bounds.push_back({-kLongestLag_s, kLongestLag_s});
    else
      bounds.push_back(change_bounds(catalogue_.terms[static_cast<std::size_t>(column)], given_));
  }
  return bounds;
}

BlockRegression::Fit Linearised::fit(const Chosen& chosen) const {
  const std::vector<Eigen::Index> columns = columns_of(chosen);
  return regression_.fit(target_, columns, bounds_of(columns));
}

double Linearised::left_out(const Chosen& chosen) const {
  const std::vector<Eigen::Index> columns = columns_of(chosen);
  return regression_.held_out(target_, columns, bounds_of(columns));
}

FittedArm fitted_arm(const control::ArmDescription& given, const ArmData& data, const Catalogue& catalogue,
                     const Chosen& chosen) {
  return fitted_alone(given, data, catalogue, chosen).fitted;
}

std::vector<double> left_out_squares(const control::ArmDescription& given, const ArmData& data,
                                     const Catalogue& catalogue, const Chosen& chosen) {
  return fitted_alone(given, data, catalogue, chosen).left_out;
}

SearchOutcome search(const control::ArmDescription& given, const ArmData& data, const Catalogue& catalogue,
                     std::span<const std::size_t> banned, const SearchOptions& options) {
  SearchOutcome outcome{.arm = given, .chosen = {}, .added = {}, .next = {}};
  std::vector<double> p_values(catalogue.candidates.size(), 1.0);
  std::set<Chosen> seen;
  auto rows = std::make_unique<Linearised>(given, given, Chosen{}, data, catalogue);
  const auto refit = [&] {
    outcome.arm = fitted_arm(given, data, catalogue, outcome.chosen).arm;
    rows = std::make_unique<Linearised>(given, outcome.arm, outcome.chosen, data, catalogue);
  };
  const double of_all = rows->left_out({});
  while (outcome.chosen.size() < kMostEffects && !is_quiet(*rows, outcome.chosen, data)) {
    const std::optional<Best> best = best_of({given, data, catalogue, banned}, *rows, outcome.chosen);
    if (!best) break;
    const double left = rows->left_out(outcome.chosen);
    const double gain = 1 - best->left / left;
    outcome.next = LeftOut{best->candidate, gain, "takes away too little"};
    if (!(gain >= options.least_gain) || gain * left < options.least_of_all * of_all) break;
    outcome.next->reason = "does not help in most blocks";
    const Chosen with = with_candidate(outcome.chosen, best->candidate, catalogue);
    if (!is_spread(*rows, outcome.chosen, with)) break;
    const double p = chance_of_gain(*rows, outcome.chosen, banned, catalogue, gain, options);
    outcome.next->reason = "may be chance";
    if (p > options.false_positive_rate) break;
    outcome.next.reset();
    p_values[best->candidate] = p;
    outcome.chosen = with;
    refit();
    for (int round = 0; round < kRevisions; ++round) {
      if (!revise({given, data, catalogue, banned}, *rows, outcome.chosen, options.least_gain)) break;
      for (const std::size_t candidate : outcome.chosen)
        p_values[candidate] = std::min(p_values[candidate], p);
      refit();
    }
    // Adding and removing in turn would never end.
    Chosen sorted = outcome.chosen;
    std::ranges::sort(sorted);
    if (!seen.insert(std::move(sorted)).second) break;
  }
  for (std::size_t place = 0; place < outcome.chosen.size(); ++place) {
    outcome.added.push_back(evidence_of(*rows, without_place(outcome.chosen, place), outcome.chosen[place]));
    outcome.added.back().p_value = p_values[outcome.chosen[place]];
  }
  return outcome;
}

}  // namespace identification::robot_gap
