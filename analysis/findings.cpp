#include "analysis/findings.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <span>
#include <utility>
#include <variant>

#include "identification/gap/noise_draws.h"
#include "identification/gap/torque_scale.h"
#include "runtime/configuration/quantity.h"
#include "runtime/program/wording.h"

namespace analysis {
namespace {

using identification::gap::FoundEffect;
using identification::gap::Verdict;
using runtime::number_text;

constexpr double kWorthTelling = 1.05;  // minimum ratio of two gaps to be reported

std::string torque_text(double torque_Nm) { return number_text(torque_Nm, "N·m"); }

/// "stribeck and 3 harmonics of cogging": only a ripple has several.
std::string names_of(std::span<const FoundEffect> effects) {
  std::vector<std::string> names;
  for (const FoundEffect& found : effects) names.push_back(name_with_rivals(found));
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string name = names[i];
    const auto times = std::ranges::count(names, name);
    if (times == 1) continue;
    names[i] = fmt::format("{} harmonics of {}", times, name);
    names.erase(std::remove(names.begin() + static_cast<std::ptrdiff_t>(i) + 1, names.end(), name),
                names.end());
  }
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i)
    text += (i == 0 ? "" : i + 1 == names.size() ? " and " : ", ") + names[i];
  return text;
}

/// Headline for the held-out data.
std::string headline_of_held_out(const Findings& findings) {
  const identification::gap::Result& result = findings.result;
  const std::string before = torque_text(result.gap_before_Nm);
  const std::string after = torque_text(result.gap_after_Nm);
  const std::string noise = torque_text(result.noise_floor_Nm);
  const bool plural = result.effects.size() > 1;
  const bool undecided =
      std::ranges::any_of(result.effects, [](const FoundEffect& e) { return !e.equivalent.empty(); });
  const std::string missing = names_of(result.effects) + (plural ? " were missing" : " was missing") +
                              (undecided ? " (this data cannot tell which)" : "");
  const std::string falls = "the held-out gap falls from " + before + " to " + after + ", noise is " + noise;
  switch (result.verdict) {
    case Verdict::kNoGap:
      if (result.gap_before_Nm > kWorthTelling * result.gap_after_Nm)
        return findings.drive + ": no effect is missing; with the parameters refitted " + falls;
      return findings.drive + ": no gap; what the model leaves of held-out data, " + after + ", is noise (" +
             noise + ")";
    case Verdict::kExplained:
    case Verdict::kAmbiguous: return findings.drive + ": " + missing + "; " + falls;
    case Verdict::kPartlyExplained:
      return findings.drive + ": " + missing + ", and something is still missing; " + falls;
    case Verdict::kUnexplained:
      return findings.drive + ": something is missing that no known effect explains; the held-out gap of " +
             after + " stays, noise is " + noise;
  }
  return findings.drive;
}

/// Location of most of the residual, "time 3.1 to 3.8 s of 3.csv"; empty if it is spread over the whole band.
std::string strongest_unexplained(const identification::gap::Result& result) {
  const identification::gap::Unexplained* strongest = nullptr;
  for (const identification::gap::Unexplained& one : result.unexplained) {
    const bool everywhere = one.where.coordinate == "frequency_Hz" && one.where.from <= 0;
    if (!everywhere && (strongest == nullptr || one.share > strongest->share)) strongest = &one;
  }
  return strongest == nullptr ? "" : where_text(strongest->where);
}

}  // namespace

std::string effect_words(std::string_view type) {
  std::string words(type);
  std::ranges::replace(words, '_', ' ');
  return words;
}

std::string where_text(const identification::gap::Where& where) {
  std::string text;
  if (!where.coordinate.empty()) {
    const runtime::Quantity quantity = runtime::quantity_of(where.coordinate);
    text = quantity.name;
    if (where.from < where.to)
      text += " " + number_text(where.from) + " to " + number_text(where.to, quantity.unit);
    else if (where.from != 0)
      text += " " + number_text(where.from, quantity.unit);
  }
  if (!where.recording.empty()) text += (text.empty() ? "all" : "") + (" of " + where.recording);
  return text;
}

std::string interval_text(const identification::fit::Estimate& estimate) {
  if (!estimate.ok()) return "not identifiable: " + estimate.not_identifiable;
  const auto text = runtime::interval_text(estimate.value, estimate.lower, estimate.upper);
  return "95 %: " + text.lower + " to " + text.upper;
}

std::vector<identification::fit::Estimate> parameters_of(const FoundEffect& found) {
  using identification::fit::Estimate;
  std::vector<Estimate> all;
  for (const auto& parameter :
       model::effects::effect_description(model::effects::name_of(found.effect)).parameters) {
    const auto fitted = std::ranges::find(found.parameters, parameter.name, &Estimate::name);
    all.push_back(fitted != found.parameters.end()
                      ? *fitted
                      : Estimate{.name = std::string(parameter.name), .not_identifiable = "not fitted"});
    Estimate& estimate = all.back();
    if (!std::isfinite(estimate.value))
      estimate.value = model::effects::parameter_of(found.effect, parameter.name);
    estimate.lower = std::max(estimate.lower, parameter.lower);
    estimate.upper = std::min(estimate.upper, parameter.upper);
  }
  return all;
}

std::string evidence_text(const FoundEffect& found) {
  return fmt::format(
      "takes away {:.1f} % of the squared {}, better in {} of {} blocks of the data searched, p = {:.2g}",
      100 * found.held_out_gain, found.measured_on, found.blocks_improved, found.blocks, found.p_value);
}

std::string unnamed_evidence(const identification::gap::UnnamedEffect& unnamed) {
  return fmt::format(
      "removes {:.1f} % of the squared held-out residual, {:.0f} % of what lies above the noise floor; "
      "better "
      "in {} of {} blocks, p = {:.2g}",
      100 * unnamed.held_out_gain, 100 * unnamed.removable_share, unnamed.blocks_improved, unnamed.blocks,
      unnamed.p_value);
}

std::string term_text(const model::effects::Empirical::Term& term) {
  using model::effects::Empirical;
  const std::string factor =
      term.times == Empirical::Times::kOne ? "a" : std::string(Empirical::name_of(term.times)) + " times a";
  const std::string where = where_text({.coordinate = std::string(Empirical::name_of(term.along)),
                                        .from = term.table.from(),
                                        .to = term.table.to()});
  return fmt::format("{} table of {} values over {}", factor, term.table.values().size(), where);
}

const std::vector<model::effects::Empirical::Term>& terms_of(
    const identification::gap::UnnamedEffect& unnamed) {
  return std::get<model::effects::Empirical>(unnamed.effect).terms();
}

std::string name_with_rivals(const FoundEffect& found) {
  std::string name = effect_words(model::effects::name_of(found.effect));
  for (const std::string& rival : found.equivalent) name += " or " + effect_words(rival);
  return name;
}

std::string wins_text(const FoundEffect& found) {
  if (found.wins.size() != found.equivalent.size() + 1) return "";
  std::string text =
      effect_words(model::effects::name_of(found.effect)) + " " + std::to_string(found.wins.front());
  for (std::size_t i = 0; i < found.equivalent.size(); ++i)
    text += ", " + effect_words(found.equivalent[i]) + " " + std::to_string(found.wins[i + 1]);
  return text + fmt::format(" of {} draws of the noise", identification::gap::kNoiseDraws);
}

std::string command_text(const identification::gap::NextExperiment& experiment, const Findings& findings) {
  std::string text = "youbot-bench " + experiment.name;
  const std::string& drive = findings.drive;
  if (drive.starts_with("arm-")) text += " --kind base+arm";
  if (drive.starts_with("arm-") || drive.starts_with("wheel-")) text += " --joint " + drive;
  for (const auto& [key, value] : experiment.settings) text += " " + runtime::option_name(key) + " " + value;
  return text + " --out next-experiment";
}

std::string expectation_text(const identification::gap::NextExperiment& experiment) {
  return fmt::format("{:.0f} sigmas expected in {:.0f} s", experiment.separation, experiment.duration_s);
}

std::string deciding_experiment(const FoundEffect& found, const Findings& findings) {
  if (found.equivalent.empty()) return "";
  if (std::ranges::find(found.equivalent, identification::gap::kTorqueScale) != found.equivalent.end())
    return "none: no motion separates them; compare the recorded torque with that of a known weight";
  if (found.decided_by) return command_text(*found.decided_by, findings);
  const identification::gap::DriveLimits& limits = findings.result.limits;
  const std::string_view named = model::effects::name_of(found.effect);
  const auto may_be = [&](std::string_view effect) {
    return named == effect || std::ranges::find(found.equivalent, effect) != found.equivalent.end();
  };
  if (may_be("actuator_offset") && may_be("torque_sensor_offset"))
    return "none: record the torque sensor with the drive switched off";
  if (may_be("spring") && may_be("imbalance"))
    return fmt::format(
        "none within {:.2g} rad: record a larger stroke, over which the torque of a weight bends and that "
        "of a spring stays straight",
        limits.travel_rad);
  return fmt::format("none: no experiment of youbot-bench up to {:.2g} N·m and {:.2g} rad/s separates them",
                     limits.torque_Nm, limits.speed_rad_per_s);
}

ClosedLoopMean closed_loop_mean(const identification::gap::Result& result) {
  ClosedLoopMean mean;
  mean.held_out = std::ranges::any_of(result.closed_loop, &identification::gap::ClosedLoop::held_out);
  for (const identification::gap::ClosedLoop& run : result.closed_loop) {
    if (run.held_out != mean.held_out) continue;
    mean.before_rad += run.before.mean_rad;
    mean.after_rad += run.after.mean_rad;
    ++mean.recordings;
  }
  if (mean.recordings == 0) return mean;
  mean.before_rad /= static_cast<double>(mean.recordings);
  mean.after_rad /= static_cast<double>(mean.recordings);
  return mean;
}

std::vector<std::string> notes(const Findings& findings) {
  std::vector<std::string> all = findings.result.notes;
  if (!findings.result.disagreement.empty()) all.insert(all.begin(), findings.result.disagreement);
  for (const identification::gap::BlindSpot& spot : findings.result.blind_spots) {
    all.push_back(spot.text);
    if (spot.shown_by)
      all.back() += "; this would show it: " + command_text(*spot.shown_by, findings) + " (" +
                    expectation_text(*spot.shown_by) + ")";
    else if (!spot.effects.empty())
      all.back() += "; nor would any experiment of youbot-bench within what the drive has done";
  }
  return all;
}

std::string headline(const Findings& findings) {
  const std::string text = headline_of_held_out(findings);
  return findings.result.disagreement.empty() ? text : text + "; the data searched say otherwise";
}

std::vector<std::string> next_steps(const Findings& findings) {
  const identification::gap::Result& result = findings.result;
  std::vector<std::string> steps;
  for (const FoundEffect& found : result.effects) {
    if (found.equivalent.empty()) continue;
    const std::string expected = found.decided_by ? " (" + expectation_text(*found.decided_by) + ")" : "";
    steps.push_back("To tell " + name_with_rivals(found) + ": " + deciding_experiment(found, findings) +
                    expected + ". Until then the model holds the first.");
  }

  const std::string place = strongest_unexplained(result);
  const std::string look =
      place.empty()
          ? "What is left shows at no one place: see the report, and check what touches the joint."
          : "What is left shows most at " + place +
                ": see the report there, record that stretch again, and check what touches the joint.";
  if (result.unnamed && !result.unnamed_accepted)
    steps.push_back(fmt::format(
        "model-unnamed.toml closes {:.0f} % of what is left above the noise with a torque that has no "
        "physical name; --accept-unnamed adds it to model.toml.",
        100 * result.unnamed->removable_share));
  switch (result.verdict) {
    case Verdict::kNoGap:
      steps.emplace_back("Keep the model's form: within what these recordings exercise nothing is missing.");
      break;
    case Verdict::kAmbiguous:
      steps.emplace_back(
          "The new model predicts the torque, and so would one with a rival in it. Decide between them "
          "before its "
          "parameters serve another purpose, such as gravity compensation or a simulation of the whole "
          "robot.");
      break;
    case Verdict::kExplained:
      steps.emplace_back("Use the new model in place of the given one: it loads wherever that does.");
      break;
    case Verdict::kPartlyExplained:
      steps.emplace_back("The new model is better than the given one, but not complete.");
      steps.push_back(look);
      break;
    case Verdict::kUnexplained: steps.push_back(look); break;
  }
  return steps;
}

std::vector<Refitted> refitted_parameters(const Findings& findings) {
  const std::vector<model::effects::AnyEffect>& effects = findings.base.effects;
  std::vector<Refitted> all;
  std::map<std::pair<std::string, std::string>, int> seen;  // several effects may have the same type
  for (const auto& [type, estimate] : findings.result.refitted) {
    Refitted refitted{.effect = effects.size(),
                      .before = std::numeric_limits<double>::quiet_NaN(),
                      .after = estimate,
                      .effect_type = type};
    if (estimate.name == "inertia_kg_m2") {
      refitted.before = findings.base.inertia_kg_m2;
    } else {
      int earlier = seen[{type, estimate.name}]++;
      for (std::size_t i = 0; i < effects.size() && refitted.effect == effects.size(); ++i)
        if (model::effects::name_of(effects[i]) == type && earlier-- == 0) refitted.effect = i;
      if (refitted.effect < effects.size())
        refitted.before = model::effects::parameter_of(effects[refitted.effect], estimate.name);
    }
    all.push_back(std::move(refitted));
  }
  return all;
}

}  // namespace analysis
