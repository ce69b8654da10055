#include "analysis/gap_model.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <variant>

#include "analysis/model_header.h"
#include "runtime/configuration/drive_model_file.h"

namespace analysis {
namespace {

using identification::fit::Estimate;
using identification::gap::FoundEffect;
using model::effects::EffectDescription;

/// One comment after each parameter of an effect, from the estimates by name.
void remark(runtime::EffectRemarks& remarks, const EffectDescription& effect, const std::string& parameter,
            const std::string& text) {
  remarks.parameters.resize(effect.parameters.size());
  for (std::size_t i = 0; i < effect.parameters.size(); ++i)
    if (effect.parameters[i].name == parameter) remarks.parameters[i] = text;
}

std::vector<std::string> evidence(const FoundEffect& found, const Findings& findings) {
  std::vector<std::string> lines{
      "added by youbot-gap: " + evidence_text(found),
      fmt::format("held-out gap {:.4g} -> {:.4g} N·m", found.gap_before, found.gap_after)};
  if (const std::string where = where_text(found.where); !where.empty())
    lines.back() += "; shows at " + where;
  if (!found.equivalent.empty()) {
    lines.emplace_back("this data cannot tell it from:");
    for (const std::string& rival : found.equivalent) lines.back() += " " + rival;
    lines.push_back("experiment that decides: " + deciding_experiment(found, findings));
  }
  return lines;
}

std::vector<std::string> unnamed_remarks(const identification::gap::UnnamedEffect& unnamed) {
  return {"no physical name: " + unnamed_evidence(unnamed),
          fmt::format("held-out gap {:.4g} -> {:.4g} N·m", unnamed.gap_before_Nm, unnamed.gap_after_Nm)};
}

std::vector<std::string> header(const Findings& findings) {
  std::vector<std::string> lines =
      model_header(findings, gap_line(findings.result.gap_before_Nm, findings.result.gap_after_Nm,
                                      findings.result.noise_floor_Nm, "N·m"));
  for (const Refitted& refitted : refitted_parameters(findings))
    if (refitted.after.name == "inertia_kg_m2")
      lines.push_back(
          fmt::format("inertia_kg_m2 was {:.6g}; {}", refitted.before, interval_text(refitted.after)));
  return lines;
}

}  // namespace

std::string improved_model_text(const Findings& findings) {
  const identification::gap::Result& result = findings.result;
  const std::size_t given = findings.base.effects.size();
  std::vector<runtime::EffectRemarks> remarks(result.model.effects.size());
  for (const Refitted& refitted : refitted_parameters(findings))
    if (refitted.effect < given)
      remark(remarks[refitted.effect], model::effects::effect_description(refitted.effect_type),
             refitted.after.name,
             fmt::format("was {:.6g}; {}", refitted.before, interval_text(refitted.after)));
  std::vector<bool> remarked(remarks.size(), false);
  for (const FoundEffect& found : result.effects) {
    const EffectDescription& effect = model::effects::description_of(found.effect);
    // Several may have the same type; actuator effects have other positions in the model than in the
    // findings.
    std::size_t i = given;
    while (i < remarks.size() && (remarked[i] || model::effects::name_of(result.model.effects[i]) !=
                                                     model::effects::name_of(found.effect)))
      ++i;
    if (i == remarks.size()) continue;
    remarked[i] = true;
    remarks[i].evidence = evidence(found, findings);
    for (const Estimate& estimate : parameters_of(found))
      remark(remarks[i], effect, estimate.name, interval_text(estimate));
  }
  if (result.unnamed_accepted)
    for (std::size_t i = given; i < remarks.size(); ++i)
      if (std::holds_alternative<model::effects::Empirical>(result.model.effects[i]))
        remarks[i].evidence = unnamed_remarks(*result.unnamed);
  return runtime::drive_model_text(result.model, header(findings), remarks);
}

std::string unnamed_model_text(const Findings& findings) {
  Findings accepted = findings;
  identification::gap::Result& result = accepted.result;
  result.model.effects.push_back(result.unnamed->effect);
  result.unnamed_accepted = true;
  result.gap_after_Nm = result.unnamed->gap_after_Nm;
  return improved_model_text(accepted);
}

}  // namespace analysis
