#include "analysis/gap_report.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "analysis/gap_plots.h"
#include "analysis/interval_cells.h"
#include "runtime/configuration/quantity.h"
#include "runtime/program/wording.h"

namespace analysis {
namespace {

using identification::fit::Estimate;
using identification::gap::FoundEffect;
using runtime::number_text;
using runtime::Quantity;
using runtime::quantity_of;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

void add_diagnosis(report::Page& page, const Findings& findings) {
  if (findings.result.diagnosis.empty()) return;
  std::vector<report::Row> rows;
  for (const identification::gap::Diagnosis& seen : findings.result.diagnosis)
    rows.push_back({seen.recording, seen.column, seen.found, seen.done});
  page.table({{"recording"}, {"column"}, {"what was found"}, {"what was done"}}, rows,
             "The recordings, before anything was explained with them");
}

/// "cogging 7.01 times a turn": its harmonics are separate steps.
std::string name_in_steps(const FoundEffect& found) {
  const auto* const ripple = std::get_if<model::effects::Cogging>(&found.effect);
  if (ripple == nullptr) return name_with_rivals(found);
  return name_with_rivals(found) + " " + number_text(ripple->parameters().periods_per_rev, "times a turn");
}

void add_summary(report::Page& page, const Findings& findings) {
  const identification::gap::Result& result = findings.result;
  for (const std::string& step : next_steps(findings)) page.text("Next: " + step);
  page.text(
      "The gap is the torque that the model does not predict, rms on held-out data: recordings or "
      "stretches that the search never saw, up to " +
      number_text(result.band_Hz, "Hz") +
      ". The noise floor is the unpredictable scatter of the torque sensor: no model can leave less.");

  std::vector<double> gaps_Nm;
  std::vector<report::Row> rows;
  const auto add = [&](const std::string& step, double gap_Nm) {
    gaps_Nm.push_back(gap_Nm);
    rows.push_back({static_cast<double>(rows.size()), step, gap_Nm,
                    result.noise_floor_Nm > 0 ? gap_Nm / result.noise_floor_Nm : kNone});
  };
  add("the model as given", result.gap_before_Nm);
  add("its parameters refitted", result.gap_base_Nm);
  for (const identification::gap::FoundEffect& found : result.effects)
    if (found.measured_on == FoundEffect::kHeldOut || found.measured_on == FoundEffect::kLeftOut)
      add("the new one without " + name_in_steps(found), found.gap_before);
  add("the new one", result.gap_after_Nm);
  page.table({{"step"}, {"model"}, {"gap", "N·m"}, {"times the noise", "", 2}}, rows,
             "The gap, step by step; noise floor " + number_text(result.noise_floor_Nm, "N·m"));
  std::vector<report::Plot> plots{steps_plot(gaps_Nm, result.noise_floor_Nm)};
  if (report::Plot friction = friction_plot(result.curve); !friction.series.empty())
    plots.push_back(std::move(friction));
  page.plots(plots);
  page.text("Simulated freely from the measured torque in short windows, the velocity is off by " +
            number_text(result.simulation_before, "rad/s") + " rms with the model as given and by " +
            number_text(result.simulation_after, "rad/s") + " with the new one.");
}

void add_closed_loop(report::Page& page, const Findings& findings) {
  std::vector<report::Row> rows;
  for (const identification::gap::ClosedLoop& run : findings.result.closed_loop)
    rows.push_back({run.before.recording, std::string(run.held_out ? "held out" : "searched"),
                    run.before.mean_rad, run.after.mean_rad, run.before.rms_rad, run.after.rms_rad});
  if (rows.empty()) return;
  page.heading("In the closed loop");
  page.text(
      "Drive and servo simulated together from the set-point alone, from the first row to the last, nothing "
      "reset: "
      "how far the position is off.");
  page.table({{"recording"},
              {"data"},
              {"mean, as given", "rad"},
              {"mean, new", "rad"},
              {"rms, as given", "rad"},
              {"rms, new", "rad"}},
             rows, "Position errors");
}

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) (text += text.empty() ? "" : ", ") += effect_words(name);
  return text;
}

void add_found(report::Page& page, const Findings& findings) {
  const std::vector<identification::gap::FoundEffect>& effects = findings.result.effects;
  if (effects.empty()) return;
  page.heading("What was missing");
  std::vector<report::Row> rows;
  std::vector<report::Row> parameters;
  std::vector<report::Row> rivals;
  for (const identification::gap::FoundEffect& found : effects) {
    const std::string_view type = model::effects::name_of(found.effect);
    const std::string name = effect_words(type);
    rows.push_back({name, std::string(model::effects::effect_description(type).shows),
                    where_text(found.where), found.gap_before, found.gap_after, 100 * found.held_out_gain,
                    std::string(found.measured_on),
                    std::to_string(found.blocks_improved) + " of " + std::to_string(found.blocks),
                    number_text(found.p_value)});
    for (const Estimate& estimate : parameters_of(found)) {
      const Quantity quantity = quantity_of(estimate.name);
      const auto [value, lower, upper] = interval_cells(estimate.value, estimate);
      parameters.push_back(
          {name, quantity.name, value, lower, upper, quantity.unit, estimate.not_identifiable});
    }
    if (!found.equivalent.empty())
      rivals.push_back({name, joined(found.equivalent), wins_text(found),
                        deciding_experiment(found, findings),
                        found.decided_by ? expectation_text(*found.decided_by) : ""});
  }
  page.table({{"effect"},
              {"how it shows"},
              {"where"},
              {"without it", "N·m"},
              {"with it", "N·m"},
              {"takes away", "%", 1},
              {"of the squared"},
              {"blocks improved"},
              {"by chance p"}},
             rows, "Effects found, in the order they were added");
  page.text(
      "\"Without it\" is what the new model leaves once the effect is taken out and the rest refitted. "
      "\"Takes "
      "away\" is the share by which the effect makes the squared residual smaller, of the rows that the next "
      "column names. p is the chance "
      "that the best of all "
      "effects tried would look as good on data in which nothing is missing.");
  if (!parameters.empty())
    page.table({{"effect"}, {"parameter"}, {"value"}, {"95 % from"}, {"to"}, {"unit"}, {"remark"}},
               parameters, "Their parameters with 95 % intervals");
  if (!rivals.empty())
    page.table(
        {{"effect"}, {"this data cannot tell it from"}, {"wins"}, {"experiment that decides"}, {"expected"}},
        rivals, "Rivals");
}

void add_plots(report::Page& page, const Findings& findings) {
  if (const std::vector<report::Plot> plots = residual_plots(findings.result); !plots.empty()) {
    page.heading("Where it shows");
    page.text(
        "The mean of measured torque less the model's, with the model as given and with the new one. "
        "Structure "
        "beyond the noise is something that a model lacks; its shape says what.");
    page.plots(plots);
  }
  if (const std::vector<report::Plot> plots = trace_plots(findings.result); !plots.empty()) {
    page.heading("Measured and simulated, on held-out data");
    page.text("Simulated from the measured torque alone, with the model as given and with the new one.");
    page.plots(plots);
  }
}

void add_rejected(report::Page& page, const Findings& findings) {
  const identification::gap::Result& result = findings.result;
  if (result.rejected.empty()) return;
  std::vector<report::Row> rows;
  for (const identification::gap::RejectedEffect& rejected : result.rejected)
    rows.push_back({effect_words(rejected.type),
                    std::string(model::effects::effect_description(rejected.type).shows), rejected.gap_after,
                    100 * (1 - rejected.gap_after / result.gap_searched_Nm), rejected.reason});
  page.heading("What was tried without success");
  page.text("None of these takes away enough of the " + number_text(result.gap_searched_Nm, "N·m") +
            " of the data searched to be more than chance.");
  page.table({{"effect"}, {"how it would show"}, {"gap with it", "N·m"}, {"less by", "%", 1}, {"why not"}},
             rows, "Effects tried and rejected");
}

void add_unexplained(report::Page& page, const Findings& findings) {
  const identification::gap::Result& result = findings.result;
  std::vector<report::Row> rows;
  for (const auto& [data, list] :
       {std::pair("held out", &result.unexplained), std::pair("searched", &result.unexplained_searched)})
    for (const identification::gap::Unexplained& unexplained : *list)
      rows.push_back({data, where_text(unexplained.where), 100 * unexplained.share});
  if (rows.empty()) return;
  page.heading("What stays unexplained");
  if (!result.disagreement.empty()) page.text(result.disagreement);
  page.table({{"data"}, {"where"}, {"share of their squared residual", "%", 1}}, rows,
             "Structure that no known effect explains; the verdict is of the held-out data");
}

void add_unnamed(report::Page& page, const Findings& findings) {
  if (!findings.result.unnamed) return;
  const identification::gap::UnnamedEffect& unnamed = *findings.result.unnamed;
  page.heading("What has no name, as a torque");
  page.text(
      "No physical name: " + unnamed_evidence(unnamed) + ". Simulated freely, the velocity is off by " +
      number_text(unnamed.simulation_before_rad_per_s, "rad/s") + " without it and by " +
      number_text(unnamed.simulation_after_rad_per_s, "rad/s") + " with it. " +
      (findings.result.unnamed_accepted
           ? "It is part of model.toml (--accept-unnamed)."
           : "It is not part of model.toml; model-unnamed.toml holds it, and --accept-unnamed adds it."));
  std::vector<report::Row> rows;
  for (const model::effects::Empirical::Term& term : terms_of(unnamed)) {
    const auto [least, most] = std::ranges::minmax(term.table.values());
    rows.push_back({term_text(term), least, most, std::string(model::effects::Empirical::unit_of(term.times)),
                    std::string(term.table.repeats() ? "repeats" : "the last value holds")});
  }
  page.table({{"term"}, {"smallest value"}, {"largest"}, {"unit"}, {"beyond the range"}}, rows,
             "A sum of these, against positive motion");
  page.plots(term_plots(terms_of(unnamed)));
}

void add_refitted(report::Page& page, const Findings& findings) {
  std::vector<report::Row> rows;
  for (const Refitted& refitted : refitted_parameters(findings)) {
    const Estimate& after = refitted.after;
    const Quantity quantity = quantity_of(after.name);
    const auto [now, lower, upper] = interval_cells(after.ok() ? after.value : kNone, after);
    rows.push_back({refitted.effect_type.empty() ? "the drive itself" : effect_words(refitted.effect_type),
                    quantity.name, refitted.before, now, lower, upper, quantity.unit,
                    after.not_identifiable});
  }
  if (rows.empty()) return;
  page.heading("The model's own parameters");
  page.table({{"effect"}, {"parameter"}, {"given"}, {"now"}, {"95 % from"}, {"to"}, {"unit"}, {"remark"}},
             rows, "Refitted together with what was added");
}

void add_provenance(report::Page& page, const Findings& findings) {
  page.heading("What this is about");
  for (const std::string& note : notes(findings)) page.text(note);
  page.text("Model: " + findings.base_path + ".");
  page.text("Searched: " + runtime::list_text(findings.data) +
            ". Held out: " + runtime::list_text(findings.result.held_out) + ". Random numbers begin with " +
            std::to_string(findings.seed) + ".");
}

}  // namespace

report::Page gap_report(const Findings& findings) {
  report::Page page("Gap of " + headline(findings));
  add_diagnosis(page, findings);
  add_summary(page, findings);
  add_found(page, findings);
  add_plots(page, findings);
  add_closed_loop(page, findings);
  add_unexplained(page, findings);
  add_unnamed(page, findings);
  add_rejected(page, findings);
  add_refitted(page, findings);
  add_provenance(page, findings);
  return page;
}

}  // namespace analysis
