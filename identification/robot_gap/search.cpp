#include "identification/robot_gap/search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numeric>
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
/// An effect acts in blocks with this share of its largest square in one.
constexpr double kActsInBlock = 0.01;
/// Linearised fits until terms that are not quite linear agree with themselves.
constexpr int kFits = 3;
/// Effects that a search adds: this many, or for each channel so many. A model without friction lacks two on
/// every joint.
constexpr std::size_t kMostEffects = 8;
constexpr std::size_t kMostOfChannel = 4;
/// Candidates with this share of the largest gain are fitted, at most so many.
constexpr double kNear = 0.8;
constexpr std::size_t kShortList = 8;
constexpr int kRevisions = 6;
/// A residual of so many noise floors leaves nothing to explain.
constexpr double kQuiet = 1.1;

/// Every term once, in the order of the candidates.
std::vector<std::size_t> terms_of(const Catalogue& catalogue, const Chosen& candidates) {
  std::vector<std::size_t> terms;
  for (const std::size_t candidate : candidates)
    for (const std::size_t term : catalogue.candidates[candidate].terms)
      if (std::ranges::find(terms, term) == terms.end()) terms.push_back(term);
  return terms;
}

std::vector<std::size_t> all_terms(const Catalogue& catalogue) {
  std::vector<std::size_t> terms(catalogue.terms.size());
  std::iota(terms.begin(), terms.end(), std::size_t{0});
  return terms;
}

/// One that could be added: neither there nor banned, in any variant.
bool is_free(std::size_t candidate, const Chosen& chosen, std::span<const std::size_t> banned,
             const Catalogue& catalogue) {
  const auto same = [&](std::size_t other) {
    return catalogue.candidates[candidate].same_effect(catalogue.candidates[other]);
  };
  return std::ranges::find(chosen, candidate) == chosen.end() && std::ranges::none_of(banned, same);
}

/// The chosen candidates' fit, without the columns of the others.
struct FittedAlone {
  Fitted fitted;
  std::vector<double> left_out;  // squares of each block
};
FittedAlone fitted_alone(const View& view, const Chosen& chosen) {
  FittedAlone result{as_given(view.subject), {}};
  const bool is_linear = std::ranges::all_of(terms_of(view.catalogue(), chosen), [&](std::size_t term) {
    return view.catalogue().terms[term].is_linear;
  });
  const int rounds = is_linear ? 1 : kFits;
  for (int round = 0; round < rounds; ++round) {
    const Linearised rows(view, result.fitted, chosen);
    gap::BlockRegression::Fit fit = rows.fit(chosen);
    result.fitted = rows.fitted(rows.columns_of(chosen), fit.coefficients);
    result.left_out = std::move(fit.held_out_of);
  }
  return result;
}

/// What all comparisons of candidates need.
struct Field {
  const View& view;
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
  for (std::size_t c = 0; c < field.view.catalogue().candidates.size(); ++c)
    if (is_free(c, chosen, field.banned, field.view.catalogue())) tried.push_back({c});
  if (tried.empty()) return {};
  gap::in_parallel(tried.size(), [&](std::size_t i) {
    tried[i].left = rows.left_out(with_candidate(chosen, tried[i].candidate, field.view.catalogue()));
  });
  std::ranges::stable_sort(tried, {}, &Tried::left);
  const double before = rows.left_out(chosen);
  const double most_gain = before - tried.front().left;
  std::erase_if(tried, [&](const Tried& one) { return before - one.left < kNear * most_gain; });
  if (tried.empty() || !(most_gain > 0)) return {};
  if (tried.size() > kShortList) tried.resize(kShortList);
  if (tried.size() == 1) return Best{tried.front().candidate, tried.front().left};
  for (Tried& one : tried)
    one.fitted =
        sum_of(left_out_squares(field.view, with_candidate(chosen, one.candidate, field.view.catalogue())));
  const double least = std::ranges::min_element(tried, {}, &Tried::fitted)->fitted;
  const Tried* best = nullptr;
  for (const Tried& one : tried) {
    if (one.fitted > (1 + kEqual) * least) continue;
    const std::size_t size = field.view.catalogue().candidates[one.candidate].terms.size();
    const std::size_t best_size =
        best == nullptr ? 0 : field.view.catalogue().candidates[best->candidate].terms.size();
    if (best == nullptr || size < best_size || (size == best_size && one.fitted < best->fitted)) best = &one;
  }
  return Best{best->candidate, std::min(best->left, before)};
}

/// Whether no channel shows more than noise.
bool is_quiet(const Linearised& rows, const Chosen& chosen, const View& view) {
  const std::vector<Eigen::Index> columns = rows.columns_of(chosen);
  const Eigen::VectorXd left =
      rows.residual() - rows.columns()(Eigen::all, columns) * rows.fit(chosen).coefficients;
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(view.sigma.size());
  Eigen::VectorXd counts = Eigen::VectorXd::Zero(view.sigma.size());
  for (Eigen::Index i = 0; i < left.size(); ++i) {
    const Eigen::Index channel = view.plan().rows[static_cast<std::size_t>(i)].channel;
    squares[channel] += left[i] * left[i];
    ++counts[channel];
  }
  for (Eigen::Index c = 0; c < squares.size(); ++c) {
    const double quiet = kQuiet * view.subject.noise_floor()[c] / view.sigma[c];
    if (squares[c] > quiet * quiet * counts[c]) return false;
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

/// Whether the gain of a candidate is spread over the blocks in which it acts.
bool is_spread(const Linearised& rows, const Chosen& before, const Chosen& with, std::size_t candidate,
               const View& view) {
  const BlockRegression::Fit fit = rows.fit(with);
  const std::vector<Eigen::Index> columns = rows.columns_of(with);
  Eigen::VectorXd effect = Eigen::VectorXd::Zero(rows.residual().size());
  for (const std::size_t term : view.catalogue().candidates[candidate].terms) {
    const auto place = std::ranges::find(columns, rows.column_of(term)) - columns.begin();
    effect += rows.columns().col(columns[static_cast<std::size_t>(place)]) * fit.coefficients[place];
  }
  std::vector<double> squares(static_cast<std::size_t>(view.plan().blocks()), 0);
  for (Eigen::Index i = 0; i < effect.size(); ++i)
    squares[static_cast<std::size_t>(view.plan().block[static_cast<std::size_t>(i)])] +=
        effect[i] * effect[i];
  const double least = kActsInBlock * *std::ranges::max_element(squares);
  const std::vector<double> all_before = rows.fit(before).held_out_of;
  std::vector<double> acted_before;
  std::vector<double> acted_after;
  for (std::size_t b = 0; b < squares.size(); ++b) {
    if (squares[b] < least) continue;
    acted_before.push_back(all_before[b]);
    acted_after.push_back(fit.held_out_of[b]);
  }
  return gap::chance_of(acted_before, acted_after) <= kSignLevel;
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
    const Chosen revised = with_candidate(rest, other->candidate, field.view.catalogue());
    if (revised.size() < chosen.size()) continue;  // in place of another variant of its own
    const double own = sum_of(left_out_squares(field.view, chosen));
    const double others = sum_of(left_out_squares(field.view, revised));
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

Fitted as_given(const Subject& subject) {
  return {Eigen::VectorXd::Zero(static_cast<Eigen::Index>(subject.catalogue().terms.size())), 0};
}

Linearised::Linearised(const View& view, const Fitted& at)
    : Linearised(view, at, Terms{all_terms(view.catalogue())}) {}

Linearised::Linearised(const View& view, const Fitted& at, const Chosen& candidates)
    : Linearised(view, at, Terms{terms_of(view.catalogue(), candidates)}) {}

Linearised::Linearised(const View& view, const Fitted& at, Terms terms)
    : subject_(view.subject), terms_(std::move(terms.list)), regression_(columns_, {}, kFolds) {
  ComparedRows rows = subject_.compare(view.part, at, terms_);
  columns_ = std::move(rows.columns);
  residual_ = rows.measured - rows.predicted;
  for (std::size_t k = 0; k < terms_.size(); ++k)
    residual_ +=
        columns_.col(static_cast<Eigen::Index>(k)) * at.changes[static_cast<Eigen::Index>(terms_[k])];
  residual_ += columns_.rightCols(1) * at.delay_s;
  const RowPlan& plan = view.plan();
  for (Eigen::Index i = 0; i < residual_.size(); ++i) {
    const double weight = 1 / view.sigma[plan.rows[static_cast<std::size_t>(i)].channel];
    residual_[i] *= weight;
    columns_.row(i) *= weight;
  }
  regression_ = BlockRegression(columns_, plan.block, kFolds);
  target_ = regression_.target(residual_);
}

Eigen::Index Linearised::column_of(std::size_t term) const {
  return std::ranges::find(terms_, term) - terms_.begin();
}

std::vector<Eigen::Index> Linearised::columns_of(const Chosen& chosen) const {
  std::vector<Eigen::Index> columns;
  for (const std::size_t term : terms_of(subject_.catalogue(), chosen)) columns.push_back(column_of(term));
  columns.push_back(columns_.cols() - 1);
  return columns;
}

std::vector<Bounds> Linearised::bounds_of(std::span<const Eigen::Index> columns) const {
  std::vector<Bounds> bounds;
  for (const Eigen::Index column : columns) {
    if (const auto k = static_cast<std::size_t>(column); k < terms_.size())
      bounds.push_back(subject_.catalogue().terms[terms_[k]].change);
    else
      bounds.push_back({-subject_.longest_delay_s(), subject_.longest_delay_s()});
  }
  return bounds;
}

Fitted Linearised::fitted(std::span<const Eigen::Index> columns, const Eigen::VectorXd& coefficients) const {
  Fitted result = as_given(subject_);
  for (std::size_t k = 0; k < columns.size(); ++k) {
    const double value = coefficients[static_cast<Eigen::Index>(k)];
    if (const auto column = static_cast<std::size_t>(columns[k]); column < terms_.size())
      result.changes[static_cast<Eigen::Index>(terms_[column])] = value;
    else
      result.delay_s = value;
  }
  return result;
}

BlockRegression::Fit Linearised::fit(const Chosen& chosen) const {
  const std::vector<Eigen::Index> columns = columns_of(chosen);
  return regression_.fit(target_, columns, bounds_of(columns));
}

double Linearised::left_out(const Chosen& chosen) const {
  const std::vector<Eigen::Index> columns = columns_of(chosen);
  return regression_.held_out(target_, columns, bounds_of(columns));
}

Fitted fit_chosen(const View& view, const Chosen& chosen) { return fitted_alone(view, chosen).fitted; }

std::vector<double> left_out_squares(const View& view, const Chosen& chosen) {
  return fitted_alone(view, chosen).left_out;
}

SearchOutcome search(const View& view, std::span<const std::size_t> banned, const SearchOptions& options) {
  const Catalogue& catalogue = view.catalogue();
  SearchOutcome outcome{.fitted = as_given(view.subject), .chosen = {}, .added = {}, .next = {}};
  std::vector<double> p_values(catalogue.candidates.size(), 1.0);
  std::set<Chosen> seen;
  auto rows = std::make_unique<Linearised>(view, outcome.fitted);
  const auto refit = [&] {
    outcome.fitted = fit_chosen(view, outcome.chosen);
    rows = std::make_unique<Linearised>(view, outcome.fitted);
  };
  const double of_all = rows->left_out({});
  const std::size_t most = std::max(kMostEffects, kMostOfChannel * view.subject.channels().size());
  while (!is_quiet(*rows, outcome.chosen, view)) {
    const std::optional<Best> best = best_of({view, banned}, *rows, outcome.chosen);
    if (!best) break;
    const double left = rows->left_out(outcome.chosen);
    const double gain = 1 - best->left / left;
    outcome.next = LeftOut{best->candidate, gain, "as many effects as the search adds were found before it"};
    if (outcome.chosen.size() >= most) break;
    outcome.next->reason = "takes away too little";
    if (!(gain >= options.least_gain) || gain * left < options.least_of_all * of_all) break;
    outcome.next->reason = "does not help in most of the blocks in which it acts";
    const Chosen with = with_candidate(outcome.chosen, best->candidate, catalogue);
    if (!is_spread(*rows, outcome.chosen, with, best->candidate, view)) break;
    const double p = chance_of_gain(*rows, outcome.chosen, banned, catalogue, gain, options);
    outcome.next->reason = "may be chance";
    if (p > options.false_positive_rate) break;
    outcome.next.reset();
    p_values[best->candidate] = p;
    outcome.chosen = with;
    refit();
    for (int round = 0; round < kRevisions; ++round) {
      if (!revise({view, banned}, *rows, outcome.chosen, options.least_gain)) break;
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
