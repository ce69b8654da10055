#include "analysis/summary.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>

#include "runtime/configuration/quantity.h"
#include "runtime/program/wording.h"

namespace analysis {
namespace {

/// "0.083 N·m (0.081 to 0.085)"
std::string estimate_text(const identification::fit::Estimate& estimate, const std::string& unit) {
  const auto text = runtime::interval_text(estimate.value, estimate.lower, estimate.upper);
  return text.value + (unit.empty() ? "" : " " + unit) + " (" + text.lower + " to " + text.upper + ")";
}

/// "static torque 0.083 N·m (0.081 to 0.085), …"
std::string parameters_text(const identification::gap::FoundEffect& found) {
  std::string text;
  for (const identification::fit::Estimate& estimate : parameters_of(found)) {
    const runtime::Quantity quantity = runtime::quantity_of(estimate.name);
    text += text.empty() ? "" : ", ";
    if (estimate.ok())
      text += quantity.name + " " + estimate_text(estimate, quantity.unit);
    else
      text += fmt::format("{} {} ({})", quantity.name, runtime::number_text(estimate.value, quantity.unit),
                          estimate.not_identifiable);
  }
  return text;
}

std::string effect_text(const identification::gap::FoundEffect& found) {
  std::string text = "  + " + name_with_rivals(found);
  if (const std::string parameters = parameters_text(found); !parameters.empty()) text += ": " + parameters;
  text += "; " + evidence_text(found);
  if (const std::string where = where_text(found.where); !where.empty()) text += "; shows at " + where;
  if (const std::string wins = wins_text(found); !wins.empty()) text += "; wins: " + wins;
  return text + "\n";
}

/// Plausible rejected effects: those that would reduce a gap that is more than noise.
std::string rejected_text(const identification::gap::Result& result) {
  constexpr double kWorthMentioning = 0.99;
  if (result.gap_searched_Nm <= result.noise_floor_Nm) return {};
  std::string text;
  for (const identification::gap::RejectedEffect& rejected : result.rejected)
    if (rejected.gap_after < kWorthMentioning * result.gap_searched_Nm)
      text += fmt::format(
          "  - {} not added, though it took away {:.2g} % of the squared residual searched where it was "
          "tried: {}\n",
          effect_words(rejected.type), 100 * (1 - std::pow(rejected.gap_after / result.gap_searched_Nm, 2)),
          rejected.reason);
  return text;
}

/// Given parameters that the data contradict.
std::string refitted_text(const Findings& findings) {
  std::string text;
  for (const Refitted& refitted : refitted_parameters(findings)) {
    if (!std::isfinite(refitted.before) || !refitted.after.ok()) continue;
    if (refitted.before >= refitted.after.lower && refitted.before <= refitted.after.upper) continue;
    const runtime::Quantity quantity = runtime::quantity_of(refitted.after.name);
    text += fmt::format("  = {}{}: {:.4g} -> {}\n",
                        refitted.effect_type.empty() ? "" : effect_words(refitted.effect_type) + " ",
                        quantity.name, refitted.before, estimate_text(refitted.after, quantity.unit));
  }
  return text;
}

/// The gap relative to the torque, and its reduction.
std::string shrink_text(const identification::gap::Result& result) {
  if (result.recordings.empty()) return {};
  const identification::gap::RecordingGap& all = result.recordings.back();
  std::string text = fmt::format("of the torque's standard deviation: {:.2g} % -> {:.2g} %",
                                 100 * all.nrmse_before, 100 * all.nrmse_after);
  if (result.shrink)
    text += fmt::format("; {:.3g} % smaller (95 % interval {:.3g} to {:.3g} %)", 100 * result.shrink->share,
                        100 * result.shrink->lower, 100 * result.shrink->upper);
  return text + '\n';
}

}  // namespace

std::string summary_text(const Findings& findings) {
  const identification::gap::Result& result = findings.result;
  std::string text =
      fmt::format("{}: {}\n", findings.drive, identification::gap::verdict_name(result.verdict));
  for (const identification::gap::Diagnosis& seen : result.diagnosis)
    text += fmt::format("  # {}: {} {}: {}\n", seen.recording, seen.column, seen.found, seen.done);
  text += fmt::format(
      "gap {:.3g} -> {:.3g} N·m on held-out data, noise floor {:.3g} N·m ({:.3g} N·m with the given model's "
      "parameters refitted)\n",
      result.gap_before_Nm, result.gap_after_Nm, result.noise_floor_Nm, result.gap_base_Nm);
  text += shrink_text(result);
  if (const ClosedLoopMean loop = closed_loop_mean(result); loop.recordings > 0)
    text += fmt::format(
        "from the set-points alone, with the servo: position off by {:.3g} -> {:.3g} rad, mean of {} {} "
        "recordings\n",
        loop.before_rad, loop.after_rad, loop.recordings, loop.held_out ? "held-out" : "searched");
  text += fmt::format("held out: {}\n", runtime::list_text(result.held_out));
  for (const identification::gap::FoundEffect& found : result.effects) text += effect_text(found);
  text += refitted_text(findings);
  text += rejected_text(result);
  for (const identification::gap::Unexplained& unexplained : result.unexplained)
    text += fmt::format("  ? {}: {:.0f} % of the squared held-out residual, unexplained\n",
                        where_text(unexplained.where), 100 * unexplained.share);
  if (result.unnamed) {
    text += fmt::format(
        "  ~ no physical name, {}: {}; gap {:.3g} -> {:.3g} N·m, simulated velocity {:.3g} -> {:.3g} "
        "rad/s\n",
        result.unnamed_accepted ? "in the model" : "offered", unnamed_evidence(*result.unnamed),
        result.unnamed->gap_before_Nm, result.unnamed->gap_after_Nm,
        result.unnamed->simulation_before_rad_per_s, result.unnamed->simulation_after_rad_per_s);
    for (const auto& term : terms_of(*result.unnamed)) text += "      " + term_text(term) + "\n";
  }
  for (const std::string& note : notes(findings)) text += "  ! " + note + "\n";
  for (const std::string& step : next_steps(findings)) text += "next: " + step + "\n";
  return text;
}

}  // namespace analysis
