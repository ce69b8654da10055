#include "identification/gap/gap.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>
#include <numeric>
#include <set>
#include <stdexcept>

#include "identification/gap/actuator_channel.h"
#include "identification/gap/blind_spots.h"
#include "identification/gap/closed_loop.h"
#include "identification/gap/confirmation.h"
#include "identification/gap/delivery.h"
#include "identification/gap/diagnosis.h"
#include "identification/gap/excerpts.h"
#include "identification/gap/fast_ripple.h"
#include "identification/gap/fitted_model.h"
#include "identification/gap/held_out_names.h"
#include "identification/gap/implied_drive.h"
#include "identification/gap/lost_sign.h"
#include "identification/gap/next_experiment.h"
#include "identification/gap/noise_floor.h"
#include "identification/gap/rest_channel.h"
#include "identification/gap/rivals.h"
#include "identification/gap/search.h"
#include "identification/gap/sensor_offset.h"
#include "identification/gap/sign_test.h"
#include "identification/gap/signals.h"
#include "identification/gap/structure.h"
#include "identification/gap/torque_scale.h"
#include "identification/gap/unnamed.h"
#include "identification/gap/views.h"
#include "identification/gap/wording.h"

namespace identification::gap {
namespace {

using Indices = std::vector<Eigen::Index>;

constexpr int kBlocks = 32;
constexpr Eigen::Index kMinRows = 160;
/// The stretch of each recording that is set aside by default: 65 % to 85 % of its time.
constexpr double kSetAsideFrom = 0.65;
constexpr double kSetAsideTo = 0.85;
/// Explained: the residual is noise.
constexpr double kAtTheFloor = 1.2;
/// This far above the floor it is not noise, even if nothing predicts it.
constexpr double kNoise = 2;
/// Minimum share of the squared residual for a burst to be listed.
constexpr double kMinBurstShare = 0.02;
/// Minimum share of the noise floor that an effect must remove to be named.
constexpr double kMinNoiseShare = 0.5;
/// A model leaves less than the noise in its own fitted rows, by up to this factor.
constexpr double kFittedNoise = 1.2;

double rms(const Eigen::VectorXd& residual, const Indices& use) {
  return use.empty() ? 0 : std::sqrt(residual(use).squaredNorm() / static_cast<double>(use.size()));
}

/// Relative to the square of `before`; negative if it grew.
double share_taken(double before, double after) { return before > 0 ? 1 - std::pow(after / before, 2) : 0; }

void require_one_rig(std::span<const Source> data, std::span<const Source> held_out) {
  std::string rig;
  std::string first;
  for (const auto& group : {data, held_out}) {
    for (const Source& source : group) {
      if (source.recording.rig.empty()) continue;
      if (!rig.empty() && source.recording.rig != rig)
        throw std::invalid_argument(source.name + ": is of rig " + source.recording.rig + ", but " + first +
                                    " of rig " + rig + "; one model describes one rig");
      rig = source.recording.rig;
      first = source.name;
    }
  }
}

struct Split {
  Training training;
  Indices held_out;
};

bool is_set_aside(double share) { return share >= kSetAsideFrom && share < kSetAsideTo; }

Split split(const Rows& rows, std::size_t data_recordings, bool set_aside, const std::vector<bool>& burst,
            const Band& band) {
  Split result;
  Indices train;
  for (Eigen::Index i = 0; i < rows.count(); ++i) {
    const Signals& s = rows.signals()[rows.recording(i)];
    const double at = (rows.time_s(i) - s.recorded_from_s) / (s.recorded_to_s - s.recorded_from_s);
    const bool held = s.source >= data_recordings || (set_aside && is_set_aside(at));
    if (held)
      result.held_out.push_back(i);
    else if (!burst[static_cast<std::size_t>(i)])
      train.push_back(i);
  }
  const auto count = static_cast<Eigen::Index>(train.size());
  if (count < kMinRows || result.held_out.empty())
    throw std::invalid_argument(
        "the recordings are too short to hold anything out: above " + short_number(band.slowest_rad_per_s) +
        " rad/s, where position_rad distinguishes motion from rest, there are " + std::to_string(count) +
        " stretches of " + short_number(0.5 / band.cutoff_Hz) + " s to search in, of " +
        std::to_string(kMinRows) + " at least, and " + std::to_string(result.held_out.size()) +
        " to check with; record a staircase in both directions of half a minute or more, or with a finer "
        "encoder");
  for (Eigen::Index i = 0; i < count; ++i)
    result.training.block.push_back(static_cast<int>(i * kBlocks / count));
  result.training.rows = std::move(train);
  return result;
}

std::vector<fit::Estimate> parameters_of(const model::effects::AnyEffect* effect, const FittedModel& fitted,
                                         const Rows& rows, const std::vector<fit::Estimate>& all) {
  // Estimates are in the order of the free parameters.
  std::vector<fit::Estimate> own;
  const auto parameters = free_parameters(fitted, rows);
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    if (parameters[k].kind != FreeParameter::Kind::kEffect) continue;
    if (&fitted.model.effects[parameters[k].effect] == effect) own.push_back(all[k]);
  }
  return own;
}

const model::effects::AnyEffect* find_effect(const model::effects::DriveModel& model, std::string_view name,
                                             std::size_t skip) {
  for (const model::effects::AnyEffect& effect : model.effects) {
    if (model::effects::name_of(effect) != name) continue;
    if (skip-- == 0) return &effect;
  }
  return nullptr;
}

/// The unlocalised residual, in the whole band, and bursts, each with its time, after the structured parts;
/// largest first. `left` is the residual of all rows, of which `part` is used.
std::vector<Unexplained> left_over(std::vector<Unexplained> found, const Eigen::VectorXd& left,
                                   const Rows& rows, const std::vector<bool>& part,
                                   const std::vector<bool>& burst, double gap_Nm, double floor_Nm) {
  if (found.empty() && gap_Nm > kNoise * floor_Nm)
    found.push_back({.where = {.coordinate = "frequency_Hz", .from = 0, .to = rows.signals().front().band_Hz},
                     .share = 1 - std::pow(floor_Nm / gap_Nm, 2)});
  double all_square = 0;
  for (Eigen::Index i = 0; i < rows.count(); ++i)
    if (part[static_cast<std::size_t>(i)]) all_square += left[i] * left[i];
  const auto in_burst = [&](Eigen::Index i) {
    return burst[static_cast<std::size_t>(i)] && part[static_cast<std::size_t>(i)];
  };
  for (Eigen::Index i = 0; i < rows.count();) {
    Eigen::Index to = i;
    while (to < rows.count() && in_burst(to) && rows.recording(to) == rows.recording(i)) ++to;
    if (to == i) {
      ++i;
      continue;
    }
    const double square = left.segment(i, to - i).squaredNorm();
    const double mean = square / static_cast<double>(to - i);
    if (square >= kMinBurstShare * all_square && mean > 9 * floor_Nm * floor_Nm)
      found.push_back({.where = {.coordinate = "time_s",
                                 .from = rows.time_s(i),
                                 .to = rows.time_s(to - 1),
                                 .recording = rows.signals()[rows.recording(i)].name},
                       .share = square / all_square});
    i = to;
  }
  std::ranges::sort(found, std::greater{}, &Unexplained::share);
  return found;
}

/// Number of the given model's effects at the beginning of the final one: an offset may have become an
/// asymmetry.
std::size_t effects_kept(const model::effects::DriveModel& base, const model::effects::DriveModel& final) {
  const bool replaced =
      base.find<model::effects::TorqueOffset>() && !final.find<model::effects::TorqueOffset>();
  return base.effects.size() - (replaced ? 1 : 0);
}

FittedModel with(FittedModel fitted, const model::effects::AnyEffect& effect) {
  fitted.model.effects.push_back(effect);
  return fitted;
}

/// The elasticity that a presliding at rest may be.
model::effects::AnyEffect elasticity_like(const model::effects::AnyEffect& presliding) {
  return model::effects::make_effect(
      "elasticity",
      {{"stiffness_Nm_per_rad", model::effects::parameter_of(presliding, "stiffness_Nm_per_rad")}});
}

/// Finds the experiments that would decide what the data leave open: between names, and blind spots.
/// `rivals`: for each found effect, models with another one in its place. `actuator`: findings beside the
/// model, which also act in an experiment.
void plan_next(Result& result, const std::vector<std::vector<FittedModel>>& rivals, const FittedModel& final,
               const std::vector<model::effects::AnyEffect>& actuator, std::span<const Signals> searched,
               const AtHand& at_hand) {
  const auto driven = [&](FittedModel fitted) {
    std::ranges::copy(actuator, std::back_inserter(fitted.model.effects));
    return fitted;
  };
  std::vector<std::vector<Pair>> questions;
  std::vector<std::optional<NextExperiment>*> answers;
  for (std::size_t i = 0; i < rivals.size(); ++i) {
    if (rivals[i].empty()) continue;
    questions.emplace_back();
    for (const FittedModel& rival : rivals[i]) questions.back().push_back({driven(final), driven(rival)});
    answers.push_back(&result.effects[i].decided_by);
  }
  const auto is_known = [&](const std::string& effect) {
    return find_effect(final.model, effect, 0) != nullptr;
  };
  std::erase_if(result.blind_spots, [&](const BlindSpot& spot) {
    return !spot.effects.empty() && std::ranges::all_of(spot.effects, is_known);
  });
  for (BlindSpot& spot : result.blind_spots) {
    std::erase_if(spot.effects, is_known);
    if (spot.effects.empty()) continue;
    questions.emplace_back();
    for (const std::string& effect : spot.effects)
      questions.back().push_back(
          {driven(with(final, usual_effect(effect, final.model, at_hand.band.resolution_rad))),
           driven(final)});
    answers.push_back(&spot.shown_by);
  }
  result.limits = limits_of(searched);
  const std::vector<std::optional<NextExperiment>> found =
      next_experiments(driven(final).model, questions, at_hand, result.limits);
  for (std::size_t i = 0; i < found.size(); ++i) *answers[i] = found[i];
}

/// The search started with another inertia than the given model's: the model keeps it, and the difference
/// becomes an effect like any other. `before` and `after`: residual of the given model on all rows, and with
/// that inertia, refitted.
void name_inertia(Result& result, const model::effects::DriveModel& base, const Eigen::VectorXd& before,
                  const Eigen::VectorXd& after, const Training& training, const Indices& held_out) {
  double difference = result.model.inertia_kg_m2 - base.inertia_kg_m2;
  std::erase_if(result.model.effects, [&](const model::effects::AnyEffect& effect) {
    const auto* const more = std::get_if<model::effects::Inertia>(&effect);
    if (more != nullptr) difference += more->parameters().difference_kg_m2;
    return more != nullptr;
  });
  std::erase_if(result.effects,
                [](const FoundEffect& found) { return model::effects::name_of(found.effect) == "inertia"; });
  const auto own = std::ranges::find_if(
      result.refitted, [](const auto& parameter) { return parameter.second.name == "inertia_kg_m2"; });
  FoundEffect found{.effect = model::effects::make_effect("inertia", {{"difference_kg_m2", difference}}),
                    .where = {.coordinate = "acceleration_rad_per_s2"}};
  if (own != result.refitted.end()) {
    fit::Estimate estimate = own->second;
    estimate.name = "difference_kg_m2";
    for (double* value : {&estimate.value, &estimate.lower, &estimate.upper}) *value -= base.inertia_kg_m2;
    found.parameters = {estimate};
    result.refitted.erase(own);
  }
  std::vector<double> squares_before(kBlocks, 0);
  std::vector<double> squares_after(kBlocks, 0);
  for (std::size_t i = 0; i < training.rows.size(); ++i) {
    const auto block = static_cast<std::size_t>(training.block[i]);
    squares_before[block] += before[training.rows[i]] * before[training.rows[i]];
    squares_after[block] += after[training.rows[i]] * after[training.rows[i]];
  }
  found.blocks = kBlocks;
  for (std::size_t b = 0; b < squares_before.size(); ++b)
    found.blocks_improved += squares_after[b] < squares_before[b] ? 1 : 0;
  found.p_value = chance_of(squares_before, squares_after);
  found.gap_before = rms(before, held_out);
  found.gap_after = rms(after, held_out);
  found.held_out_gain = share_taken(found.gap_before, found.gap_after);
  result.model.inertia_kg_m2 = base.inertia_kg_m2;
  result.model.effects.push_back(found.effect);
  result.effects.insert(result.effects.begin(), std::move(found));
}

/// Of the torque's recording; less than a sample of most recorders.
constexpr double kWorthNotingLag_s = 1e-3;

HeldOutRows held_out_rows(const Rows& rows, const Eigen::VectorXd& before, const Eigen::VectorXd& after,
                          const Indices& held_out) {
  HeldOutRows result{.recording = {},
                     .torque_Nm = rows.torque_Nm()(held_out),
                     .before_Nm = before(held_out),
                     .after_Nm = after(held_out)};
  for (const Eigen::Index row : held_out)
    result.recording.push_back(rows.signals()[rows.recording(row)].source);
  return result;
}

/// Whether the residual is noise, and whether all of it was examined: only the held-out data decide.
Verdict verdict_of(const Result& result) {
  const bool structured = !result.unexplained.empty();
  if (result.effects.empty()) return structured ? Verdict::kUnexplained : Verdict::kNoGap;
  if (structured || result.gap_after_Nm > kAtTheFloor * result.noise_floor_Nm)
    return Verdict::kPartlyExplained;
  const bool ambiguous =
      std::ranges::any_of(result.effects, [](const FoundEffect& e) { return !e.equivalent.empty(); });
  return ambiguous ? Verdict::kAmbiguous : Verdict::kExplained;
}

/// Where the searched data contradict the held-out ones; empty if they agree.
std::string disagreement(const Result& result) {
  const auto at_the_floor = [&](double gap_Nm) { return gap_Nm <= kAtTheFloor * result.noise_floor_Nm; };
  const auto is_noise = [&](double gap_Nm, const std::vector<Unexplained>& structured) {
    return structured.empty() && (result.effects.empty() || at_the_floor(gap_Nm));
  };
  const bool held_out = is_noise(result.gap_after_Nm, result.unexplained);
  const bool searched = is_noise(result.gap_searched_Nm, result.unexplained_searched);
  if (held_out == searched) return {};
  const std::string gaps = short_number(result.gap_searched_Nm) + " N·m of the data searched and " +
                           short_number(result.gap_after_Nm) + " N·m of the held-out data";
  return held_out
             ? "The model leaves " + gaps +
                   ": what is structured in the former does not show in the latter, of which the verdict is."
             : "The model leaves " + gaps + ": " +
                   (at_the_floor(result.gap_searched_Nm)
                        ? "the searched data are explained"
                        : "what is left of the searched data has no structure") +
                   "; the held-out data contain a motion or a cause that was not searched.";
}

}  // namespace

std::string_view verdict_name(Verdict verdict) noexcept {
  switch (verdict) {
    case Verdict::kNoGap: return "no gap";
    case Verdict::kExplained: return "explained";
    case Verdict::kPartlyExplained: return "partly explained";
    case Verdict::kAmbiguous: return "ambiguous";
    case Verdict::kUnexplained: return "unexplained";
  }
  return "";
}

Result analyse(const model::effects::DriveModel& base, std::vector<Source> all_data,
               std::vector<Source> all_held_out, const Options& options) {
  const auto progress = [&](std::string_view what, double done) {
    if (options.progress) options.progress(what, done);
  };
  if (all_data.empty()) throw std::invalid_argument("no recordings");
  require_one_rig(all_data, all_held_out);
  progress("looking for damage in the recordings", 0);
  Result result;
  std::vector<ServoRun> searched_runs;
  std::vector<ServoRun> held_out_runs;
  if (base.servo) {
    unwrap_positions(all_data, result.diagnosis);
    unwrap_positions(all_held_out, result.diagnosis);
    add_servo_torques(all_data, *base.servo);
    add_servo_torques(all_held_out, *base.servo);
    searched_runs = servo_runs(all_data, *base.servo);
    held_out_runs = servo_runs(all_held_out, *base.servo);
    if (const std::size_t left_out =
            all_data.size() + all_held_out.size() - searched_runs.size() - held_out_runs.size();
        left_out > 0)
      result.notes.push_back(
          std::to_string(left_out) +
          " of the recordings are not simulated with the servo: they lack a set-point, or a "
          "position in each row.");
  }
  Diagnosed looked = diagnose(std::move(all_data), base);
  Diagnosed looked_held_out = diagnose(std::move(all_held_out), base);
  std::ranges::move(looked.diagnosis, std::back_inserter(result.diagnosis));
  std::ranges::move(looked_held_out.diagnosis, std::back_inserter(result.diagnosis));
  std::vector<Source> sources = std::move(looked.sources);
  const std::size_t data_count = sources.size();
  std::ranges::move(looked_held_out.sources, std::back_inserter(sources));

  progress("preparing the recordings", 0.04);
  std::optional<LostSign> sign = lost_sign(sources, data_count, base, options);
  if (sign) sources = std::move(sign->sources);
  remove_sensor_offset(sources, base);
  const std::span<const Source> data = std::span(sources).first(data_count);
  const std::span<const Source> held_out = std::span(sources).subspan(data_count);
  // Initial model of the search.
  model::effects::DriveModel start = base;
  const std::optional<double> inertia = another_inertia(data, base);
  if (inertia && !base.find<model::effects::Inertia>()) start.inertia_kg_m2 = *inertia;
  const Band band = choose_band(sources, start);
  const auto judges = [&](std::size_t source, double share) {
    return source >= data_count || (held_out.empty() && is_set_aside(share));
  };
  const std::vector<Excerpt> excerpts = chosen_excerpts(sources, band, judges, options.enough);
  std::ranges::move(left_out(sources, excerpts), std::back_inserter(result.diagnosis));
  const std::vector<Signals> signals = signals_of(sources, excerpts, band);
  const Rows rows(signals);

  // The actuator first: the delivered torque determines the reference of everything else.
  const auto searched_count =
      std::ranges::count_if(signals, [&](const Signals& s) { return s.source < data_count; });
  const std::span<const Signals> searched =
      std::span(signals).first(static_cast<std::size_t>(searched_count));
  ActuatorFindings actuator = actuator_channel(searched, base, options);

  FittedModel given{.model = start, .given_inertia_kg_m2 = start.inertia_kg_m2};
  const std::vector<bool> burst = bursts(given, rows);
  Split parts = split(rows, data.size(), held_out.empty(), burst, band);
  result.noise_floor_Nm = noise_floor_Nm(signals, actuator.left_Nm, band, start);
  parts.training.least_Nm = kMinNoiseShare * result.noise_floor_Nm;
  // Bursts are listed separately below: they are excluded from the measured gap.
  Indices quiet;
  for (const Eigen::Index i : parts.held_out)
    if (!burst[static_cast<std::size_t>(i)]) quiet.push_back(i);
  if (quiet.empty()) quiet = parts.held_out;
  const auto residual = [&](const FittedModel& fitted) -> Eigen::VectorXd {
    return rows.torque_Nm() - predicted_rows(fitted, rows);
  };
  SearchResult searching = search(given, rows, parts.training, options);
  // Sensor report beyond the command is noise, or torque that was not commanded: a model that leaves less has
  // shown that it is torque.
  result.noise_floor_Nm =
      std::min(result.noise_floor_Nm, kFittedNoise * rms(residual(searching.fitted), parts.training.rows));
  const Judged judged{
      rows,         parts.training, quiet, !held_out.empty(), result.noise_floor_Nm, band.resolution_rad,
      held_out_runs};
  progress("holding the answer against held-out data", 0.86);
  confirm(searching, judged);
  std::vector<std::string> taken_back = deliver(searching, given, judged);
  weigh_rivals(searching, rows, parts.training, options);
  if (!held_out_runs.empty()) {
    progress("following the set-points", 0.9);
    searching.fitted = fitted_to_servo(searching.fitted, searched_runs, judged);
  }

  progress("looking for what is left", 0.92);
  RestFindings rest = rest_channel(searched, searching.fitted.model, band, options);
  // Unless a compliance was already found in motion, or the torque at rest has the sign of the noise.
  if (searching.fitted.model.find<model::effects::Elasticity>() ||
      searching.fitted.model.find<model::effects::Backlash>() ||
      std::ranges::any_of(searched, &Signals::signed_by_motion))
    rest.presliding.reset();
  FittedModel final = searching.fitted;
  if (rest.presliding) {
    WithPresliding with_it = with_presliding(final, rest.presliding->effect, judged);
    if (with_it.worse_at.empty()) {
      final = std::move(with_it.model);
    } else {
      searching.rejected.push_back(
          {"presliding", 0, "shows at rest, but with it the model " + with_it.worse_at});
      rest.presliding.reset();
    }
  }
  result.notes = std::move(taken_back);
  if (std::string note = fast_ripple_note(searched, final.model); !note.empty())
    result.notes.push_back(std::move(note));
  if (std::abs(final.lag_s) > kWorthNotingLag_s &&
      std::ranges::none_of(searched, &Signals::torque_is_command))
    result.notes.push_back(
        "The torque is taken as recorded " + short_number(1e3 * std::abs(final.lag_s)) + " ms " +
        (final.lag_s > 0 ? "late" : "early") + (is_longest_lag(final.lag_s) ? " or more" : "") +
        ", fitted to the motion. All gaps here allow for that, and the model has no part of it.");
  result.blind_spots = blind_spots(searched, rest.rests);
  const FittedModel refitted = refined(given, rows, parts.training.rows);
  const Eigen::VectorXd named_left = residual(final);
  result.band_Hz = band.cutoff_Hz;
  FittedModel as_given = given;
  as_given.model = base;
  as_given.lag_s = final.lag_s;
  as_given.smoothing_s2 = final.smoothing_s2;
  result.torque_lag_s = final.lag_s;
  result.torque_smoothing_s2 = final.smoothing_s2;
  result.gap_before_Nm = rms(residual(as_given), quiet);
  result.gap_base_Nm = rms(residual(refitted), quiet);
  result.gap_after_Nm = rms(named_left, quiet);
  // The verdict is about the effects that have a name.
  Structure structured = structure(final, rows, parts.training, quiet, options);
  std::vector<bool> judging(static_cast<std::size_t>(rows.count()), false);
  for (const Eigen::Index i : parts.held_out) judging[static_cast<std::size_t>(i)] = true;
  std::vector<bool> searched_rows = judging;
  searched_rows.flip();
  result.gap_searched_Nm = rms(named_left, parts.training.rows);
  result.unexplained = left_over(std::move(structured.held_out), named_left, rows, judging, burst,
                                 result.gap_after_Nm, result.noise_floor_Nm);
  result.unexplained_searched = left_over(std::move(structured.searched), named_left, rows, searched_rows,
                                          burst, result.gap_searched_Nm, result.noise_floor_Nm);
  if (!result.unexplained.empty()) {
    progress("describing what has no name", 0.93);
    result.unnamed = find_unnamed(final, judged, options);
  }
  result.unnamed_accepted = result.unnamed && options.accept_unnamed;
  const FittedModel delivered = result.unnamed_accepted ? with(final, result.unnamed->effect) : final;
  const Eigen::VectorXd left = result.unnamed_accepted ? residual(delivered) : named_left;
  result.gap_after_Nm = rms(left, quiet);
  result.gap_searched_Nm = rms(left, parts.training.rows);
  const HeldOutRows compared = held_out_rows(rows, residual(as_given), left, quiet);
  if (!sign || !sign->found) result.shrink = shrink_of(compared, options.seed);
  std::vector<std::string> names;
  for (const Source& source : sources) names.push_back(source.name);
  result.recordings = recording_gaps(compared, names);

  result.model = delivered.model;
  const std::vector<fit::Estimate> all = estimates(final, rows, parts.training.rows);
  const auto free = free_parameters(final, rows);
  const std::size_t of_base = effects_kept(base, final.model);
  for (std::size_t k = 0; k < free.size(); ++k) {
    if (free[k].kind == FreeParameter::Kind::kInertia) result.refitted.emplace_back("", all[k]);
    if (free[k].kind == FreeParameter::Kind::kEffect && free[k].effect < of_base)
      result.refitted.emplace_back(model::effects::name_of(final.model.effects[free[k].effect]), all[k]);
  }
  const auto actuator_offset =
      std::ranges::find(actuator.effects, "actuator_offset",
                        [](const FoundEffect& f) { return model::effects::name_of(f.effect); });
  const OffsetOf offset_is_of = actuator_offset == actuator.effects.end()
                                    ? OffsetOf::kActuator
                                    : offset_of(*actuator_offset, base, final, rows, parts.training.rows);
  if (offset_is_of == OffsetOf::kSensor) {
    give_to_sensor(*actuator_offset, base, result);
  } else if (offset_is_of == OffsetOf::kEither) {
    actuator_offset->equivalent.emplace_back("torque_sensor_offset");
    result.notes.emplace_back(
        "The offset between command and measured torque is the actuator's or the torque sensor's; the motion "
        "does not decide. Record the torque sensor with the drive switched off.");
  }
  std::erase_if(actuator.effects,
                [&](const FoundEffect& found) { return is_of_late_sensor(found, final.lag_s); });
  // A part of a lag may be the sensor's.
  for (FoundEffect& found : actuator.effects)
    if (std::holds_alternative<model::effects::TorqueLag>(found.effect))
      found.parameters.front().lower -= std::max(0.0, final.lag_s);
  if (sign && sign->found) {
    result.gap_before_Nm = std::max(result.gap_before_Nm, sign->found->gap_before);
    result.effects.push_back(*sign->found);
  }
  for (const FoundEffect& found : actuator.effects) {
    result.model.effects.push_back(found.effect);
    result.effects.push_back(found);
  }
  // The sensor loses the sign of what it reports with its offset.
  if (sign && sign->found) result.model.effects.push_back(sign->found->effect);
  const auto is_the_sensors = [&](std::string_view effect) {
    return offset_is_of == OffsetOf::kSensor && effect == "torque_offset";
  };
  std::set<std::string> named;
  // A compliance at rest is in the delivered model, but not in the compared ones.
  const auto as_delivered = [&](FittedModel other) {
    if (rest.presliding) other.model.effects.push_back(final.model.effects.back());
    if (result.unnamed_accepted) other.model.effects.push_back(result.unnamed->effect);
    return other;
  };
  std::vector<std::vector<FittedModel>> rivals;  // of each found effect
  for (std::size_t n = 0; n < searching.added.size(); ++n) {
    const Added& added = searching.added[n];
    std::size_t earlier = 0;
    for (std::size_t m = 0; m < n; ++m) earlier += searching.added[m].effect == added.effect ? 1 : 0;
    for (const model::effects::AnyEffect& effect : base.effects)
      earlier += model::effects::name_of(effect) == added.effect ? 1 : 0;
    const model::effects::AnyEffect* effect = find_effect(final.model, added.effect, earlier);
    if (effect == nullptr || is_the_sensors(added.effect)) continue;
    FoundEffect found{
        .effect = *effect,
        .where =
            where_of(added.effect, predicted_rows(added.after, rows) - predicted_rows(added.before, rows),
                     rows, parts.training.rows)};
    found.blocks = added.blocks;
    found.blocks_improved = added.blocks_improved;
    found.p_value = added.p_value;
    // For the delivered model; without held-out recordings, for the blocks left out in turn.
    found.gap_before = rms(residual(as_delivered(added.without)), quiet);
    found.gap_after = result.gap_after_Nm;
    found.held_out_gain = added.gain;
    if (!added.judged_by_held_out) found.measured_on = FoundEffect::kLeftOut;
    rivals.resize(result.effects.size() + 1);
    for (const RivalModel& rival : added.rivals) {
      rivals.back().push_back(as_delivered(rival.model));
      if (found.wins.empty()) found.wins.push_back(added.wins);
      found.equivalent.push_back(rival.effect);
      found.wins.push_back(rival.wins);
    }
    found.parameters = parameters_of(effect, final, rows, all);
    named.emplace(added.effect);
    result.effects.push_back(std::move(found));
  }
  if (rest.presliding) {
    FoundEffect& found = *rest.presliding;
    found.effect = final.model.effects.back();
    for (const fit::Estimate& estimate : parameters_of(&final.model.effects.back(), final, rows, all))
      if (estimate.name == "damping_Nm_s_per_rad") found.parameters.push_back(estimate);
    rivals.resize(result.effects.size() + 1);
    if (!found.equivalent.empty())
      rivals.back().push_back(with(searching.fitted, elasticity_like(found.effect)));
    named.emplace(model::effects::name_of(found.effect));
    result.effects.push_back(std::move(found));
  }
  for (const auto& [type, gain, reason] : searching.rejected)
    if (!named.contains(type))
      result.rejected.push_back({type, result.gap_searched_Nm * std::sqrt(std::max(0.0, 1 - gain)), reason});

  progress("looking for the next experiment", 0.94);
  // A delay of a speed command is not a delay of the torque: experiments have their own speed loops.
  std::vector<model::effects::AnyEffect> of_torque;
  if (std::ranges::any_of(searched, [](const Signals& s) { return !s.raw_command_Nm.empty(); }))
    for (const FoundEffect& found : actuator.effects) of_torque.push_back(found.effect);
  plan_next(result, rivals, final, of_torque, searched,
            {rows, parts.training.rows, band, std::max(result.gap_after_Nm, result.noise_floor_Nm)});
  if (start.inertia_kg_m2 != base.inertia_kg_m2)
    name_inertia(result, base, residual(as_given), residual(refitted), parts.training, quiet);
  weigh_torque_scale(base, result);

  progress("simulating", 0.96);
  const Simulated simulated = simulate(base, delivered.model, signals, rows, quiet);
  result.simulation_before = simulated.before_rad_per_s;
  result.simulation_after = simulated.after_rad_per_s;
  result.traces = simulated.traces;
  for (const std::vector<ServoRun>* const runs : {&searched_runs, &held_out_runs})
    for (const ServoRun& run : *runs)
      result.closed_loop.push_back(
          {closed_loop_error(base, run), closed_loop_error(delivered.model, run), runs == &held_out_runs});
  result.maps = residual_maps(as_given, delivered, rows, quiet);
  result.curve = friction_curve(given, delivered, rows);
  result.held_out = held_out.empty() ? held_out_names(rows, quiet, kSetAsideFrom, kSetAsideTo)
                                     : held_out_names(rows, quiet, 0, 1);
  result.verdict = verdict_of(result);
  result.disagreement = disagreement(result);
  progress("done", 1);
  return result;
}

}  // namespace identification::gap
