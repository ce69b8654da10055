#include "identification/robot_gap/robot_gap.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>

#include "identification/gap/block_comparison.h"
#include "identification/robot_gap/arm_judgement.h"
#include "identification/robot_gap/arm_noise.h"
#include "identification/robot_gap/arm_rivals.h"
#include "identification/robot_gap/arm_search.h"
#include "identification/robot_gap/arm_shares.h"

namespace identification::robot_gap {
namespace {

using control::ArmDescription;

/// Share of each recording that searches, where nothing else is held out.
constexpr double kSearched = 0.75;
/// Blocks of all data, and their shortest length in periods of the band.
constexpr double kWantedBlocks = 60;
constexpr double kShortestBlock = 8;
constexpr int kFewestBlocks = 8;
/// A residual of this many noise floors is only noise: the floor is an estimate.
constexpr double kNoiseOnly = 1.25;
/// An effect is named if the new model removes this share of what its joints show above the noise. Less is a
/// shadow of something else.
constexpr double kLeastRemoved = 0.4;
/// While a joint shows so many noise floors, most of it has no name: an effect must stand out by itself.
constexpr double kMuchLeft = 3;
constexpr double kStandsOut = 0.3;
/// What takes the place of a refuted correction must remove this share of what that one did.
constexpr double kSubstitute = 0.5;
/// Standard errors of a rival's loss on held-out blocks that rule it out.
constexpr double kRuledOut = 2.5;
constexpr int kMaxRefutations = 12;
/// A joint counts among those of an effect from this share of its largest squared torque.
constexpr double kActs = 0.01;

/// The first `kSearched` of each recording, and the rest.
void set_aside(std::vector<ArmRecording>& data, std::vector<ArmRecording>& held_out) {
  for (ArmRecording& whole : data) {
    const auto rows = static_cast<Eigen::Index>(whole.time_s.size());
    const auto first = static_cast<Eigen::Index>(kSearched * static_cast<double>(rows));
    ArmRecording rest{whole.name + ", last quarter",
                      {whole.time_s.begin() + first, whole.time_s.end()},
                      whole.position_rad.rightCols(rows - first),
                      whole.torque_Nm.rightCols(rows - first)};
    held_out.push_back(std::move(rest));
    whole.time_s.resize(static_cast<std::size_t>(first));
    whole.position_rad = whole.position_rad.leftCols(first).eval();
    whole.torque_Nm = whole.torque_Nm.leftCols(first).eval();
  }
}

std::vector<ArmMotion> all_filtered(const std::vector<ArmRecording>& recordings, double band_Hz) {
  std::vector<ArmMotion> motions;
  motions.reserve(recordings.size());
  for (const ArmRecording& recording : recordings) motions.push_back(filtered(recording, band_Hz));
  return motions;
}

double seconds_of(const std::vector<ArmMotion>& motions) {
  double sum = 0;
  for (const ArmMotion& motion : motions) sum += static_cast<double>(motion.rows()) * motion.row_s();
  return sum;
}

/// Every parameter at once, fitted to the searched data: what parameters could do, and how well.
struct Dense {
  Eigen::VectorXd residual_Nm;           ///< of the searched rows
  Eigen::VectorXd held_out_residual_Nm;  ///< of the held-out ones
};
Dense dense_fit(const ArmDescription& arm, const ArmData& data, const ArmData& held_out,
                const std::vector<Term>& catalogue_terms) {
  std::vector<Term> terms = catalogue_terms;
  terms.push_back({Term::Kind::kLag});
  const ComparedRows rows = compare(arm, data.motions, data.plan, terms);
  Eigen::VectorXd weights(rows.measured_Nm.size());
  for (Eigen::Index i = 0; i < weights.size(); ++i)
    weights[i] = 1 / data.sigma_Nm[data.plan.rows[static_cast<std::size_t>(i)].joint];
  const Eigen::MatrixXd columns = weights.asDiagonal() * rows.columns;
  const Eigen::VectorXd left = rows.measured_Nm - rows.predicted_Nm;
  const std::vector<gap::Bounds> free(terms.size());
  const Eigen::VectorXd by = gap::bounded_solution(columns.transpose() * columns,
                                                   columns.transpose() * weights.cwiseProduct(left), free);
  const ComparedRows other = compare(arm, held_out.motions, held_out.plan, terms);
  return {left - rows.columns * by, other.measured_Nm - other.predicted_Nm - other.columns * by};
}

/// Friction that the given model has, to be refitted as a baseline.
Chosen given_friction(const ArmDescription& arm, const Catalogue& catalogue) {
  Chosen chosen;
  for (std::size_t c = 0; c < catalogue.candidates.size(); ++c) {
    const Candidate& candidate = catalogue.candidates[c];
    if (candidate.effect != "coulomb" && candidate.effect != "viscous" &&
        candidate.effect != "load_friction" && candidate.effect != "stribeck" &&
        candidate.effect != "quadratic_drag")
      continue;
    if (value_of(catalogue.terms[candidate.terms.front()], arm) != 0) chosen.push_back(c);
  }
  return chosen;
}

std::string text_of(const Candidate& candidate, const ArmDescription& arm) {
  std::string effect(candidate.effect);
  std::ranges::replace(effect, '_', ' ');
  return effect + " of " + part_name(candidate, arm);
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
  Analysis(const ArmDescription& arm, std::vector<ArmRecording> data, std::vector<ArmRecording> held_out,
           const RobotOptions& options)
      : given_(arm),
        options_(options),
        recordings_(std::move(data)),
        held_out_recordings_(std::move(held_out)) {
    if (recordings_.empty()) throw std::invalid_argument("there is no recording to search");
    if (held_out_recordings_.empty()) set_aside(recordings_, held_out_recordings_);
    std::vector<ArmRecording> all = recordings_;
    all.insert(all.end(), held_out_recordings_.begin(), held_out_recordings_.end());
    band_Hz_ = usable_band_Hz(all, options.band_Hz);
    motions_ = all_filtered(recordings_, band_Hz_);
    held_out_motions_ = all_filtered(held_out_recordings_, band_Hz_);
    const double block_s = std::max(kShortestBlock / band_Hz_, seconds_of(motions_) / kWantedBlocks);
    const double held_out_block_s =
        std::max(kShortestBlock / band_Hz_, seconds_of(held_out_motions_) / kWantedBlocks);
    const std::vector<double> rest = rest_speeds_rad_per_s(motions_, recordings_, band_Hz_);
    data_ = {motions_, plan_rows(motions_, rest, block_s), {}, {}};
    held_ = {held_out_motions_, plan_rows(held_out_motions_, rest, held_out_block_s), {}, {}};
    require_motion();
    floor_Nm_ = noise_floor_Nm(arm, recordings_, band_Hz_).cwiseMax(1e-9);
    for (ArmData* part : {&data_, &held_}) part->sigma_Nm = part->floor_Nm = floor_Nm_;
    catalogue_ = catalogue_of(arm, top_speeds_rad_per_s(motions_), options.ripples_per_rev);
  }

  RobotResult run() {
    progress("fitting every parameter at once", 0.05);
    const Dense dense = dense_fit(given_, data_, held_, catalogue_.terms);
    for (Eigen::Index j = 0; j < floor_Nm_.size(); ++j)
      data_.sigma_Nm[j] = std::max(floor_Nm_[j], rms_of_joint_Nm(dense.residual_Nm, data_, j));
    held_.sigma_Nm = data_.sigma_Nm;
    before_ = residual_Nm(fitted_arm(given_, data_, catalogue_, {}), held_);
    select();
    progress("weighing rivals", 0.8);
    RobotResult result;
    result.gap_dense_Nm = rms_Nm(dense.held_out_residual_Nm);
    describe(result, dense);
    progress("done", 1);
    return result;
  }

 private:
  void progress(const char* what, double done) const {
    if (options_.progress) options_.progress(what, done);
  }

  void require_motion() const {
    if (data_.plan.blocks() < kFewestBlocks)
      throw std::invalid_argument(
          printed("the recordings are too short: %d stretches of %.1f s in motion, at "
                  "least %d are needed; record more motion",
                  data_.plan.blocks(), kShortestBlock / band_Hz_, kFewestBlocks));
    if (held_.plan.rows.empty())
      throw std::invalid_argument("no joint moves in the held-out recordings: hold out others");
  }

  /// Searches, and refutes what does not hold on every recording, until all that is left does.
  void select() {
    const SearchOptions search_options{.seed = options_.seed};
    for (int round = 0; round <= kMaxRefutations; ++round) {
      progress("searching", 0.1 + 0.6 * round / (kMaxRefutations + 1.0));
      std::vector<std::size_t> banned;
      for (const Refuted& one : refuted_) banned.push_back(one.candidate);
      outcome_ = search(given_, data_, catalogue_, banned, search_options);
      fitted_ = fitted_arm(given_, data_, catalogue_, outcome_.chosen);
      after_ = residual_Nm(fitted_, held_);
      const std::optional<Refuted> next = find_refuted();
      if (!next) return;
      refuted_.push_back(*next);
    }
    outcome_ = {};
    fitted_ = fitted_arm(given_, data_, catalogue_, {});
    after_ = before_;
  }

  FittedArm without(std::size_t place) const {
    Chosen rest = outcome_.chosen;
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(place));
    return fitted_arm(given_, data_, catalogue_, rest);
  }

  /// The first chosen effect with a reason against it, the most harmful one.
  std::optional<Refuted> find_refuted() {
    std::optional<Refuted> worst;
    double worst_increase = 0;
    const auto estimates = outcome_.chosen.empty() ? std::vector<std::vector<fit::Estimate>>{}
                                                   : intervals(given_, fitted_, data_, catalogue_,
                                                               outcome_.chosen, options_.seed);
    const Eigen::VectorXd searched = residual_Nm(fitted_, data_);
    for (std::size_t place = 0; place < outcome_.chosen.size(); ++place) {
      const std::size_t candidate = outcome_.chosen[place];
      const FittedArm less = without(place);
      const Eigen::VectorXd held_less = residual_Nm(less, held_);
      const auto consider = [&](double increase, std::string reason) {
        if (worst && increase <= worst_increase) return;
        worst_increase = increase;
        worst = Refuted{candidate, outcome_.added[place].gain, std::move(reason)};
      };
      if (std::ranges::all_of(estimates[place], [&](const fit::Estimate& one) {
            const auto which = static_cast<std::size_t>(&one - estimates[place].data());
            const double given = reported_value(
                catalogue_.terms[catalogue_.candidates[candidate].terms[which]], given_, given_);
            return one.lower <= given && given <= one.upper;
          }))
        consider(0, "the interval of its size contains that of the given model");
      const Eigen::VectorXd searched_less = residual_Nm(less, data_);
      for (const bool is_held : {true, false}) {
        const Harm harm = is_held ? worst_harm(held_less, after_, held_, given_)
                                  : worst_harm(searched_less, searched, data_, given_);
        if (harm.found)
          consider(harm.after_Nm / std::max(1e-12, harm.before_Nm),
                   printed("parameters do not transfer: on %s%s%s the residual grows from %.3g to %.3g N·m",
                           harm.recording.c_str(), harm.joint.empty() ? "" : ", ", harm.joint.c_str(),
                           harm.before_Nm, harm.after_Nm));
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
          consider(0.5, "it takes the place of " + text_of(catalogue_.candidates[former.candidate], given_) +
                            ", which was refuted, and removes less than half as much");
    }
    return worst;
  }

  bool is_substitute(std::size_t candidate, std::size_t former) const {
    const Candidate& one = catalogue_.candidates[candidate];
    const Candidate& other = catalogue_.candidates[former];
    return one.part >= 0 && one.part == other.part && !one.effect.starts_with("link_");
  }

  /// Of what lies above the noise in the held-out rows of the joints on which an effect acts.
  struct Removed {
    double by_all = 1;     ///< share of the given model's that the new one removes
    double by_itself = 1;  ///< share that the effect removes where the new model lacks it
    double left_floors = 0;
  };
  Removed removed_by(std::size_t place) const {
    const std::vector<std::size_t> chosen{outcome_.chosen[place]};
    const Catalogue own = only(catalogue_, chosen);
    const ComparedRows rows = compare(fitted_.arm, held_.motions, held_.plan, own.terms);
    const Eigen::VectorXd less = residual_Nm(without(place), held_);
    Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(floor_Nm_.size(), 6);
    for (std::size_t i = 0; i < held_.plan.rows.size(); ++i) {
      const Eigen::Index j = held_.plan.rows[i].joint;
      const auto at = static_cast<Eigen::Index>(i);
      const double sigma = data_.sigma_Nm[j];
      Eigen::RowVectorXd one(6);
      one << rows.columns.row(at).squaredNorm(), before_[at] * before_[at], less[at] * less[at],
          after_[at] * after_[at], floor_Nm_[j] * floor_Nm_[j], 0;
      sums.row(j) += one / (sigma * sigma);
    }
    const double most = sums.col(0).maxCoeff();
    Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(6);
    for (Eigen::Index j = 0; j < sums.rows(); ++j)
      if (sums(j, 0) > kActs * most) sum += sums.row(j);
    Removed removed;
    if (sum[1] > sum[4]) removed.by_all = (sum[1] - sum[3]) / (sum[1] - sum[4]);
    if (sum[2] > sum[4]) removed.by_itself = (sum[2] - sum[3]) / (sum[2] - sum[4]);
    removed.left_floors = sum[4] > 0 ? std::sqrt(sum[3] / sum[4]) : 0;
    return removed;
  }

  /// Normalised rms, in noise floors.
  double floors(const Eigen::VectorXd& residual) const {
    double sum = 0;
    for (std::size_t i = 0; i < held_.plan.rows.size(); ++i) {
      const double one = residual[static_cast<Eigen::Index>(i)] / floor_Nm_[held_.plan.rows[i].joint];
      sum += one * one;
    }
    return std::sqrt(sum / static_cast<double>(held_.plan.rows.size()));
  }

  NamedEffect name_of(std::size_t candidate) const {
    const Candidate& one = catalogue_.candidates[candidate];
    return {std::string(one.effect), part_name(one, given_)};
  }

  void describe_effects(RobotResult& result) {
    if (outcome_.chosen.empty()) return;
    const auto rows = std::make_unique<Linearised>(given_, fitted_.arm, outcome_.chosen, data_, catalogue_);
    const auto estimates = intervals(given_, fitted_, data_, catalogue_, outcome_.chosen, options_.seed);
    std::vector<std::size_t> banned;
    for (const Refuted& one : refuted_) banned.push_back(one.candidate);
    for (std::size_t place = 0; place < outcome_.chosen.size(); ++place) {
      const std::size_t candidate = outcome_.chosen[place];
      const Eigen::VectorXd less = residual_Nm(without(place), held_);
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
      found.gap_before_Nm = rms_Nm(less);
      found.gap_after_Nm = rms_Nm(after_);
      found.parameters = estimates[place];
      for (const std::size_t term : catalogue_.candidates[candidate].terms)
        found.given.push_back(reported_value(catalogue_.terms[term], given_, given_));
      add_rivals(found, *rows, place, banned);
      result.effects.push_back(std::move(found));
    }
  }

  void add_rivals(FoundPart& found, const Linearised& rows, std::size_t place,
                  const std::vector<std::size_t>& banned) {
    const ArmRivals rivals =
        rivals_of(given_, data_, rows, catalogue_, outcome_.chosen, place, banned, options_.seed);
    const std::vector<double> own = block_squares(after_, held_);
    for (const ArmRival& rival : rivals.rivals) {
      Chosen with = outcome_.chosen;
      with[place] = rival.candidate;
      const FittedArm other = fitted_arm(given_, data_, catalogue_, with);
      if (gap::decisiveness(block_squares(residual_Nm(other, held_), held_), own) > kRuledOut) continue;
      if (found.wins.empty()) {
        found.wins.push_back(rivals.own_wins);
        found.deciding_experiment = deciding_pose(fitted_.arm, other.arm, data_, options_.seed);
      }
      found.equivalent.push_back(name_of(rival.candidate));
      found.wins.push_back(rival.wins);
    }
  }

  void describe(RobotResult& result, const Dense& dense) {
    drop_shadows(result);
    describe_effects(result);
    result.arm = fitted_.arm;
    result.torque_lag_s = fitted_.lag_s;
    result.band_Hz = band_Hz_;
    result.gap_before_Nm = rms_Nm(before_);
    result.gap_after_Nm = rms_Nm(after_);
    result.gap_refitted_Nm =
        rms_Nm(residual_Nm(fitted_arm(given_, data_, catalogue_, given_friction(given_, catalogue_)), held_));
    double floor_square = 0;
    for (const RowPlan::Row& row : held_.plan.rows)
      floor_square += floor_Nm_[row.joint] * floor_Nm_[row.joint];
    result.noise_floor_Nm = std::sqrt(floor_square / static_cast<double>(held_.plan.rows.size()));
    for (const ArmMotion& motion : held_out_motions_) result.held_out.push_back(motion.name);
    describe_joints(result, dense);
    for (const Refuted& one : refuted_) result.rejected.push_back({name_of(one.candidate), one.reason});
    if (outcome_.next && outcome_.next->gain > 0)
      result.rejected.push_back({name_of(outcome_.next->candidate), outcome_.next->reason});
    const ComparedRows rows = compare(given_, held_.motions, held_.plan, {});
    result.shares = shares_of(before_, after_, rows.predicted_Nm, held_, given_);
    result.traces = traces_of(rows.measured_Nm, before_, after_, held_, given_);
    judge(result);
  }

  /// Takes away effects that remove little of what their joints show.
  void drop_shadows(RobotResult& result) {
    for (std::size_t place = outcome_.chosen.size(); place-- > 0;) {
      const Removed removed = removed_by(place);
      const bool is_shadow = removed.by_all < kLeastRemoved;
      if (!is_shadow && (removed.left_floors < kMuchLeft || removed.by_itself >= kStandsOut)) continue;
      result.rejected.push_back(
          {name_of(outcome_.chosen[place]),
           is_shadow
               ? printed("with it the model removes only %.0f %% of what its joints show above the noise: "
                         "something else is at work",
                         100 * std::max(0.0, removed.by_all))
               : printed("it removes only %.0f %% where its joints still show %.1f noise floors: something "
                         "else is at work",
                         100 * std::max(0.0, removed.by_itself), removed.left_floors)});
      outcome_.chosen.erase(outcome_.chosen.begin() + static_cast<std::ptrdiff_t>(place));
      outcome_.added.erase(outcome_.added.begin() + static_cast<std::ptrdiff_t>(place));
      fitted_ = fitted_arm(given_, data_, catalogue_, outcome_.chosen);
      after_ = residual_Nm(fitted_, held_);
      place = outcome_.chosen.size();  // the others stand in another light
    }
    if (rms_Nm(after_) <= rms_Nm(before_)) return;
    // Never a model that is worse where it was not fitted.
    for (const std::size_t candidate : outcome_.chosen)
      result.rejected.push_back(
          {name_of(candidate), "the model is worse on the held-out recordings with it"});
    outcome_ = {};
    fitted_ = fitted_arm(given_, data_, catalogue_, {});
    after_ = before_;
  }

  void describe_joints(RobotResult& result, const Dense& dense) const {
    for (Eigen::Index j = 0; j < floor_Nm_.size(); ++j) {
      JointGap joint{given_.arm.links[static_cast<std::size_t>(j)].joint, floor_Nm_[j],
                     rms_of_joint_Nm(before_, held_, j), rms_of_joint_Nm(after_, held_, j),
                     rms_of_joint_Nm(dense.held_out_residual_Nm, held_, j)};
      const auto moves = [j](const RowPlan::Row& row) { return row.joint == j; };
      joint.judged =
          std::ranges::any_of(held_.plan.rows, moves) && std::ranges::any_of(data_.plan.rows, moves);
      if (!joint.judged) result.notes.push_back(joint.joint + " does not move: it was not judged");
      result.joints.push_back(joint);
    }
    if (band_Hz_ < options_.band_Hz)
      result.notes.push_back(
          printed("compared up to %.3g Hz, not %.3g: the slowest recording has no more samples", band_Hz_,
                  options_.band_Hz));
    const auto add = [&](const ArmData& data, const Eigen::VectorXd& before, const Eigen::VectorXd& after,
                         bool is_held_out) {
      for (std::size_t m = 0; m < data.motions.size(); ++m) {
        double b = 0;
        double a = 0;
        double rows = 0;
        for (std::size_t i = 0; i < data.plan.rows.size(); ++i) {
          if (data.plan.rows[i].motion != m) continue;
          const auto at = static_cast<Eigen::Index>(i);
          b += before[at] * before[at];
          a += after[at] * after[at];
          ++rows;
        }
        if (rows > 0)
          result.motions.push_back(
              {data.motions[m].name, is_held_out, std::sqrt(b / rows), std::sqrt(a / rows)});
      }
    };
    add(data_, residual_Nm(fitted_arm(given_, data_, catalogue_, {}), data_), residual_Nm(fitted_, data_),
        false);
    add(held_, before_, after_, true);
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

  const ArmDescription& given_;
  const RobotOptions& options_;
  std::vector<ArmRecording> recordings_;
  std::vector<ArmRecording> held_out_recordings_;
  double band_Hz_ = 0;
  std::vector<ArmMotion> motions_;
  std::vector<ArmMotion> held_out_motions_;
  ArmData data_{};
  ArmData held_{};
  Eigen::VectorXd floor_Nm_;
  Catalogue catalogue_;
  SearchOutcome outcome_;
  std::vector<Refuted> refuted_;
  FittedArm fitted_;
  Eigen::VectorXd before_;
  Eigen::VectorXd after_;
};

}  // namespace

RobotResult analyse(const ArmDescription& arm, std::vector<ArmRecording> data,
                    std::vector<ArmRecording> held_out, const RobotOptions& options) {
  return Analysis(arm, std::move(data), std::move(held_out), options).run();
}

}  // namespace identification::robot_gap
