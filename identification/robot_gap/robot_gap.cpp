#include "identification/robot_gap/robot_gap.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>
#include <utility>

#include "identification/gap/block_comparison.h"
#include "identification/robot_gap/judgement.h"
#include "identification/robot_gap/rivals.h"
#include "identification/robot_gap/search.h"
#include "identification/robot_gap/shares.h"

namespace identification::robot_gap {
namespace {

/// A residual of this many noise floors is only noise: the floor is an estimate.
constexpr double kNoiseOnly = 1.25;
/// An effect is named if the new model removes this share of what it acts on shows above the noise. Less is a
/// shadow of something else.
constexpr double kLeastRemoved = 0.4;
/// Or this share of the square of what the errors add up to: what comes and goes does not.
constexpr double kLeastAccumulated = 0.6;
/// While channels show so many noise floors, most of it has no name: an effect must stand out by itself.
constexpr double kMuchLeft = 3;
constexpr double kStandsOut = 0.3;
/// What takes the place of a refuted correction must remove this share of what that one did.
constexpr double kSubstitute = 0.5;
/// Standard errors of a rival's loss on held-out blocks that rule it out.
constexpr double kRuledOut = 2.5;
constexpr int kMaxRefutations = 12;
constexpr const char* kContainsGiven = "the interval of its size contains that of the given model";
/// A channel counts among those of an effect from this share of its largest square.
constexpr double kActs = 0.01;

/// Every parameter at once, fitted to the searched data: what parameters could do, and how well.
struct Dense {
  Eigen::VectorXd residual;           ///< of the searched rows
  Eigen::VectorXd held_out_residual;  ///< of the held-out ones
};
Dense dense_fit(const View& searched, const View& held_out) {
  const Fitted given = fit_chosen(searched, {});
  const Linearised rows(searched, given);
  const std::vector<gap::Bounds> free(static_cast<std::size_t>(rows.columns().cols()));
  const Eigen::VectorXd by = gap::bounded_solution(rows.columns().transpose() * rows.columns(),
                                                   rows.columns().transpose() * rows.residual(), free);
  const auto left = [&](const Linearised& at, const View& view) {
    Eigen::VectorXd residual = at.residual() - at.columns() * by;
    for (Eigen::Index i = 0; i < residual.size(); ++i)
      residual[i] *= view.sigma[view.plan().rows[static_cast<std::size_t>(i)].channel];
    return residual;
  };
  return {left(rows, searched), left(Linearised(held_out, given), held_out)};
}

/// Friction that the given model has, to be refitted as a baseline.
Chosen given_friction(const Catalogue& catalogue) {
  Chosen chosen;
  for (std::size_t c = 0; c < catalogue.candidates.size(); ++c)
    if (catalogue.candidates[c].is_refit) chosen.push_back(c);
  return chosen;
}

std::string text_of(const Candidate& candidate) {
  std::string effect = candidate.effect;
  std::ranges::replace(effect, '_', ' ');
  return effect + " of " + candidate.part_name;
}

template <class... Values>
std::string printed(const char* format, Values... values) {
  char text[400];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

struct Refuted {
  std::size_t candidate = 0;
  double gain = 0;
  std::string reason;
};

/// The whole analysis, step by step.
class Analysis {
 public:
  Analysis(const Subject& subject, const RobotOptions& options)
      : subject_(subject),
        catalogue_(subject.catalogue()),
        floor_(subject.noise_floor()),
        options_(options),
        searched_{subject, Part::kSearched, floor_},
        held_{subject, Part::kHeldOut, floor_} {}

  RobotResult run() {
    progress("fitting every parameter at once", 0.05);
    const Dense dense = dense_fit(searched_, held_);
    for (Eigen::Index c = 0; c < floor_.size(); ++c)
      searched_.sigma[c] = std::max(floor_[c], rms_of_channel(dense.residual, searched_.plan(), c));
    held_.sigma = searched_.sigma;
    before_ = residual_of(held_, fit_chosen(searched_, {}));
    select();
    progress("weighing rivals", 0.8);
    RobotResult result;
    describe(result, dense);
    progress("done", 1);
    return result;
  }

 private:
  void progress(const char* what, double done) const {
    if (options_.progress) options_.progress(what, done);
  }

  /// Searches, and refutes what does not hold on every recording, until all that is left does.
  void select() {
    const SearchOptions search_options{.seed = options_.seed};
    for (int round = 0; round <= kMaxRefutations; ++round) {
      progress("searching", 0.1 + 0.6 * round / (kMaxRefutations + 1.0));
      std::vector<std::size_t> banned;
      for (const Refuted& one : refuted_) banned.push_back(one.candidate);
      outcome_ = search(searched_, banned, search_options);
      fitted_ = fit_chosen(searched_, outcome_.chosen);
      after_ = residual_of(held_, fitted_);
      const std::optional<Refuted> next = find_refuted();
      if (!next) return;
      refuted_.push_back(*next);
    }
    outcome_ = {};
    fitted_ = fit_chosen(searched_, {});
    after_ = before_;
  }

  Fitted without(std::size_t place) const {
    Chosen rest = outcome_.chosen;
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(place));
    return fit_chosen(searched_, rest);
  }

  /// Of each channel, the squares of an effect's own columns there, in sigma.
  Eigen::VectorXd action_of(std::size_t candidate, const View& view) const {
    const std::vector<std::size_t>& terms = catalogue_.candidates[candidate].terms;
    const ComparedRows rows = subject_.compare(view.part, fitted_, terms);
    Eigen::VectorXd squares = Eigen::VectorXd::Zero(floor_.size());
    for (std::size_t i = 0; i < view.plan().rows.size(); ++i) {
      const Eigen::Index j = view.plan().rows[i].channel;
      const auto at = static_cast<Eigen::Index>(i);
      squares[j] += rows.columns.row(at).head(static_cast<Eigen::Index>(terms.size())).squaredNorm() /
                    (view.sigma[j] * view.sigma[j]);
    }
    return squares;
  }
  /// Whether an effect acts on each channel.
  std::vector<bool> acts_on(std::size_t candidate, const View& view) const {
    const Eigen::VectorXd squares = action_of(candidate, view);
    const double least = kActs * squares.maxCoeff();
    std::vector<bool> acts;
    for (const double one : squares) acts.push_back(one > least);
    return acts;
  }

  /// The chosen effect with a reason against it, the most harmful one. Over all channels together harm
  /// counts always; in a single channel only if the effect acts there: in others, it is other parameters that
  /// the fit changes with it.
  std::optional<Refuted> find_refuted() {
    std::optional<Refuted> worst;
    double worst_increase = 0;
    const Eigen::VectorXd searched = residual_of(searched_, fitted_);
    for (std::size_t place = 0; place < outcome_.chosen.size(); ++place) {
      const std::size_t candidate = outcome_.chosen[place];
      const Fitted less = without(place);
      const Eigen::VectorXd held_less = residual_of(held_, less);
      const std::vector<bool> acts = acts_on(candidate, searched_);
      const auto consider = [&](double increase, std::string reason) {
        if (worst && increase <= worst_increase) return;
        worst_increase = increase;
        worst = Refuted{candidate, outcome_.added[place].gain, std::move(reason)};
      };
      if (is_nothing(place)) consider(0, kContainsGiven);
      const Eigen::VectorXd searched_less = residual_of(searched_, less);
      for (const bool is_held : {true, false}) {
        const Harm harm = is_held ? worst_harm(held_less, after_, held_, acts)
                                  : worst_harm(searched_less, searched, searched_, acts);
        if (harm.found)
          consider(harm.after / std::max(1e-12, harm.before),
                   printed("parameters do not transfer: on %s the residual grows from %.3g to %.3g %s",
                           harm.place.c_str(), harm.before, harm.after, harm.unit.c_str()));
      }
      double held_before = 0;
      double held_after = 0;
      for (const double square : block_squares(held_less, held_)) held_before += square;
      for (const double square : block_squares(after_, held_)) held_after += square;
      if (held_after >= held_before)
        consider(held_after / held_before, "it does not help on the held-out recordings");
      for (const Refuted& former : refuted_)
        if (is_substitute(candidate, former.candidate) &&
            outcome_.added[place].gain < kSubstitute * former.gain)
          consider(0.5, "it takes the place of " + text_of(catalogue_.candidates[former.candidate]) +
                            ", which was refuted, and removes less than half as much");
    }
    return worst;
  }

  bool is_substitute(std::size_t candidate, std::size_t former) const {
    const Candidate& one = catalogue_.candidates[candidate];
    const Candidate& other = catalogue_.candidates[former];
    return one.part >= 0 && one.part == other.part && !one.effect.starts_with("link_");
  }

  /// Of what lies above the noise in the held-out rows of the channels on which an effect acts.
  struct Removed {
    double by_all = 1;     ///< share of the given model's that the new one removes
    double by_itself = 1;  ///< share that the effect removes where the new model lacks it
    double left_floors = 0;
  };
  Removed removed_by(std::size_t place) const {
    const std::vector<bool> acts = acts_on(outcome_.chosen[place], held_);
    const Eigen::VectorXd less = residual_of(held_, without(place));
    Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(4);
    for (std::size_t i = 0; i < held_.plan().rows.size(); ++i) {
      const Eigen::Index j = held_.plan().rows[i].channel;
      const auto at = static_cast<Eigen::Index>(i);
      if (!acts[static_cast<std::size_t>(j)]) continue;
      const double sigma = held_.sigma[j];
      Eigen::RowVectorXd one(4);
      one << before_[at] * before_[at], less[at] * less[at], after_[at] * after_[at], floor_[j] * floor_[j];
      sum += one / (sigma * sigma);
    }
    Removed removed;
    if (sum[0] > sum[3]) removed.by_all = (sum[0] - sum[2]) / (sum[0] - sum[3]);
    if (sum[1] > sum[3]) removed.by_itself = (sum[1] - sum[2]) / (sum[1] - sum[3]);
    removed.left_floors = sum[3] > 0 ? std::sqrt(sum[2] / sum[3]) : 0;
    return removed;
  }

  /// Normalised rms, in noise floors.
  double floors(const Eigen::VectorXd& residual) const {
    double sum = 0;
    for (std::size_t i = 0; i < held_.plan().rows.size(); ++i) {
      const double one = residual[static_cast<Eigen::Index>(i)] / floor_[held_.plan().rows[i].channel];
      sum += one * one;
    }
    return std::sqrt(sum / static_cast<double>(held_.plan().rows.size()));
  }

  NamedEffect name_of(std::size_t candidate) const {
    return {catalogue_.candidates[candidate].effect, catalogue_.candidates[candidate].part_name};
  }

  /// Units of the channels, each once.
  std::vector<std::string> units() const {
    std::vector<std::string> units;
    for (const Channel& channel : subject_.channels())
      if (std::ranges::find(units, channel.unit) == units.end()) units.push_back(channel.unit);
    return units;
  }

  /// Held-out rms over the channels of each unit.
  std::vector<double> rms_by_unit(const Eigen::VectorXd& residual) const {
    std::vector<double> result;
    for (const std::string& unit : units()) {
      double sum = 0;
      double count = 0;
      for (std::size_t i = 0; i < held_.plan().rows.size(); ++i) {
        if (subject_.channels()[static_cast<std::size_t>(held_.plan().rows[i].channel)].unit != unit)
          continue;
        const double one = residual[static_cast<Eigen::Index>(i)];
        sum += one * one;
        ++count;
      }
      result.push_back(count > 0 ? std::sqrt(sum / count) : 0);
    }
    return result;
  }

  void describe_effects(RobotResult& result) {
    if (outcome_.chosen.empty()) return;
    const auto rows = std::make_unique<Linearised>(searched_, fitted_);
    const auto estimates = intervals(searched_, fitted_, outcome_.chosen, options_.seed);
    std::vector<std::size_t> banned;
    for (const Refuted& one : refuted_) banned.push_back(one.candidate);
    for (std::size_t place = 0; place < outcome_.chosen.size(); ++place) {
      const std::size_t candidate = outcome_.chosen[place];
      const Eigen::VectorXd less = residual_of(held_, without(place));
      FoundPart found{.name = name_of(candidate)};
      const std::vector<double> before = block_squares(less, held_);
      const std::vector<double> after = block_squares(after_, held_);
      double sum_before = 0;
      double sum_after = 0;
      for (std::size_t b = 0; b < before.size(); ++b) {
        sum_before += before[b];
        sum_after += after[b];
        found.blocks_improved += after[b] < before[b] ? 1 : 0;
      }
      found.blocks = static_cast<int>(before.size());
      found.held_out_gain = sum_before > 0 ? 1 - sum_after / sum_before : 0;
      found.p_value = outcome_.added[place].p_value;
      found.gap_before = rms_by_unit(less);
      found.gap_after = rms_by_unit(after_);
      found.parameters = estimates[place];
      for (const std::size_t term : catalogue_.candidates[candidate].terms)
        found.given.push_back(catalogue_.terms[term].given);
      add_rivals(found, *rows, place, banned);
      result.effects.push_back(std::move(found));
    }
  }

  void add_rivals(FoundPart& found, const Linearised& rows, std::size_t place,
                  const std::vector<std::size_t>& banned) {
    const Rivals rivals = rivals_of(searched_, rows, outcome_.chosen, place, banned, options_.seed);
    const std::vector<double> own = block_squares(after_, held_);
    for (const Rival& rival : rivals.rivals) {
      Chosen with = outcome_.chosen;
      with[place] = rival.candidate;
      const Fitted other = fit_chosen(searched_, with);
      if (gap::decisiveness(block_squares(residual_of(held_, other), held_), own) > kRuledOut) continue;
      if (found.wins.empty()) {
        found.wins.push_back(rivals.own_wins);
        found.deciding_experiment =
            subject_.deciding_experiment(fitted_.changes, other.changes, options_.seed);
      }
      found.equivalent.push_back(name_of(rival.candidate));
      found.wins.push_back(rival.wins);
    }
  }

  void describe(RobotResult& result, const Dense& dense) {
    drop_shadows(result);
    describe_effects(result);
    result.changes = fitted_.changes;
    result.delay_s = fitted_.delay_s;
    result.held_out = subject_.motions(Part::kHeldOut);
    describe_gaps(result, dense);
    describe_motions(result);
    for (const Refuted& one : refuted_) result.rejected.push_back({name_of(one.candidate), one.reason});
    if (outcome_.next && outcome_.next->gain > 0)
      result.rejected.push_back({name_of(outcome_.next->candidate), outcome_.next->reason});
    result.shares = shares_of(before_, after_, held_);
    const ComparedRows rows = subject_.compare(Part::kHeldOut, as_given(subject_), {});
    result.traces = traces_of(rows.measured, before_, after_, held_);
    judge(result);
  }

  /// Share of what the errors of the given model add up to that the new one removes.
  double accumulated_removed() const {
    const double before = subject_.accumulated(Part::kHeldOut, fit_chosen(searched_, {}));
    return before > 0 ? 1 - subject_.accumulated(Part::kHeldOut, fitted_) / before : 0;
  }

  /// Whether no parameter of a chosen effect differs from that of the given model.
  bool is_nothing(std::size_t place) const {
    const auto estimates = intervals(searched_, fitted_, outcome_.chosen, options_.seed);
    const std::vector<std::size_t>& terms = catalogue_.candidates[outcome_.chosen[place]].terms;
    for (std::size_t k = 0; k < terms.size(); ++k) {
      const fit::Estimate& one = estimates[place][k];
      const double given = catalogue_.terms[terms[k]].given;
      if (given < one.lower || one.upper < given) return false;
    }
    return true;
  }

  /// Takes away effects that remove little of the disagreement where they act.
  void drop_shadows(RobotResult& result) {
    for (std::size_t place = outcome_.chosen.size(); place-- > 0;) {
      const Removed removed = removed_by(place);
      const bool is_shadow = removed.by_all < kLeastRemoved && accumulated_removed() < kLeastAccumulated;
      const bool is_lost = removed.left_floors >= kMuchLeft && removed.by_itself < kStandsOut;
      const bool is_zero = is_nothing(place);
      if (!is_shadow && !is_lost && !is_zero) continue;
      result.rejected.push_back(
          {name_of(outcome_.chosen[place]),
           is_zero ? std::string(kContainsGiven)
           : is_shadow
               ? printed("with it the model removes only %.0f %% of the disagreement where it acts: "
                         "something else is at work",
                         100 * std::max(0.0, removed.by_all))
               : printed(
                     "it removes only %.0f %% of the disagreement where it acts, and %.1f noise floors are "
                     "left there: something else is at work",
                     100 * std::max(0.0, removed.by_itself), removed.left_floors)});
      outcome_.chosen.erase(outcome_.chosen.begin() + static_cast<std::ptrdiff_t>(place));
      outcome_.added.erase(outcome_.added.begin() + static_cast<std::ptrdiff_t>(place));
      fitted_ = fit_chosen(searched_, outcome_.chosen);
      after_ = residual_of(held_, fitted_);
      place = outcome_.chosen.size();  // the others stand in another light
    }
    if (floors(after_) <= floors(before_)) return;
    // Never a model that is worse where it was not fitted.
    for (const std::size_t candidate : outcome_.chosen)
      result.rejected.push_back(
          {name_of(candidate), "the model is worse on the held-out recordings with it"});
    outcome_ = {};
    fitted_ = fit_chosen(searched_, {});
    after_ = before_;
  }

  void describe_gaps(RobotResult& result, const Dense& dense) const {
    const Eigen::VectorXd refitted = residual_of(held_, fit_chosen(searched_, given_friction(catalogue_)));
    Eigen::VectorXd noise(before_.size());
    for (Eigen::Index i = 0; i < noise.size(); ++i)
      noise[i] = floor_[held_.plan().rows[static_cast<std::size_t>(i)].channel];
    const std::vector<std::string> names = units();
    const std::vector<double> floor = rms_by_unit(noise);
    const std::vector<double> before = rms_by_unit(before_);
    const std::vector<double> refit = rms_by_unit(refitted);
    const std::vector<double> all = rms_by_unit(dense.held_out_residual);
    const std::vector<double> after = rms_by_unit(after_);
    for (std::size_t u = 0; u < names.size(); ++u)
      result.gaps.push_back({names[u], {floor[u], before[u], refit[u], all[u], after[u]}});
    for (Eigen::Index c = 0; c < floor_.size(); ++c) {
      ChannelGap channel{
          subject_.channels()[static_cast<std::size_t>(c)],
          {floor_[c], rms_of_channel(before_, held_.plan(), c), rms_of_channel(refitted, held_.plan(), c),
           rms_of_channel(dense.held_out_residual, held_.plan(), c),
           rms_of_channel(after_, held_.plan(), c)}};
      const auto moves = [c](const RowPlan::Row& row) { return row.channel == c; };
      channel.judged =
          std::ranges::any_of(held_.plan().rows, moves) && std::ranges::any_of(searched_.plan().rows, moves);
      if (!channel.judged)
        result.notes.push_back(
            channel.channel.name +
            " has no rows in the searched or in the held-out recordings: it was not judged");
      result.channels.push_back(channel);
    }
  }

  void describe_motions(RobotResult& result) const {
    const auto add = [&](const View& view, const Eigen::VectorXd& before, const Eigen::VectorXd& after) {
      const std::vector<std::string>& names = subject_.motions(view.part);
      for (std::size_t m = 0; m < names.size(); ++m) {
        double b = 0;
        double a = 0;
        double rows = 0;
        for (std::size_t i = 0; i < view.plan().rows.size(); ++i) {
          const RowPlan::Row& row = view.plan().rows[i];
          if (row.motion != m) continue;
          const double unit = floor_[row.channel];
          const auto at = static_cast<Eigen::Index>(i);
          b += before[at] * before[at] / (unit * unit);
          a += after[at] * after[at] / (unit * unit);
          ++rows;
        }
        if (rows > 0)
          result.motions.push_back(
              {names[m], view.part == Part::kHeldOut, std::sqrt(b / rows), std::sqrt(a / rows)});
      }
    };
    add(searched_, residual_of(searched_, fit_chosen(searched_, {})), residual_of(searched_, fitted_));
    add(held_, before_, after_);
  }

  void judge(RobotResult& result) const {
    const double before = floors(before_);
    const double after = floors(after_);
    const bool has_rivals =
        std::ranges::any_of(result.effects, [](const FoundPart& one) { return !one.equivalent.empty(); });
    if (result.effects.empty()) {
      result.verdict = before <= kNoiseOnly ? Verdict::kNoGap : Verdict::kUnexplained;
      result.reason = before <= kNoiseOnly
                          ? printed("the residual is %.2f noise floors", before)
                          : printed(
                                "the residual is %.2f noise floors, and no effect explains it on every "
                                "recording",
                                before);
    } else if (after > kNoiseOnly) {
      result.verdict = Verdict::kPartlyExplained;
      result.reason = printed("the residual falls from %.2f to %.2f noise floors; what is left has no name",
                              before, after);
    } else if (has_rivals) {
      result.verdict = Verdict::kAmbiguous;
      result.reason = "the gap closes, but other effects would close it as well on this data";
    } else {
      result.verdict = Verdict::kExplained;
      result.reason = printed("the residual falls from %.2f to %.2f noise floors", before, after);
    }
    if (std::ranges::any_of(refuted_, [](const Refuted& one) {
          return one.reason.starts_with("parameters do not transfer");
        }))
      result.reason += "; parameters do not transfer between the recordings for what was refuted";
  }

  const Subject& subject_;
  const Catalogue& catalogue_;
  const Eigen::VectorXd& floor_;
  const RobotOptions& options_;
  View searched_;
  View held_;
  SearchOutcome outcome_;
  std::vector<Refuted> refuted_;
  Fitted fitted_;
  Eigen::VectorXd before_;
  Eigen::VectorXd after_;
};

}  // namespace

RobotResult analyse(const Subject& subject, const RobotOptions& options) {
  return Analysis(subject, options).run();
}

}  // namespace identification::robot_gap
