#include "analysis/gap_json.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "identification/gap/noise_draws.h"
#include "runtime/program/build_info.h"

namespace analysis {
namespace {

using Json = nlohmann::ordered_json;
using identification::fit::Estimate;

Json json_of(const identification::gap::Where& where) {
  Json json{{"coordinate", where.coordinate}, {"from", where.from}, {"to", where.to}};
  if (!where.recording.empty()) json["recording"] = where.recording;
  return json;
}

Json json_of(const Estimate& estimate) {
  Json json{{"value", estimate.value}, {"ci95", {estimate.lower, estimate.upper}}};
  if (!estimate.ok()) json["not_identifiable"] = estimate.not_identifiable;
  return json;
}

Json json_of(const std::vector<Estimate>& parameters) {
  Json json = Json::object();
  for (const Estimate& estimate : parameters) json[estimate.name] = json_of(estimate);
  return json;
}

/// {"stribeck": 13, "presliding": 7, "draws": 20}
Json wins_of(const identification::gap::FoundEffect& found) {
  Json json{{model::effects::name_of(found.effect), found.wins.front()}};
  for (std::size_t i = 0; i < found.equivalent.size(); ++i) json[found.equivalent[i]] = found.wins[i + 1];
  json["draws"] = identification::gap::kNoiseDraws;
  return json;
}

Json json_of(const identification::gap::FoundEffect& found, const Findings& findings) {
  Json json{{"type", model::effects::name_of(found.effect)},
            {"where", json_of(found.where)},
            {"evidence",
             {{"held_out_gain", found.held_out_gain},
              {"of_squared", found.measured_on},
              {"blocks_improved", std::to_string(found.blocks_improved) + "/" + std::to_string(found.blocks)},
              {"p_value", found.p_value}}},
            {"gap_before", found.gap_before},
            {"gap_after", found.gap_after},
            {"equivalent", found.equivalent},
            {"deciding_experiment", deciding_experiment(found, findings)},
            {"parameters", json_of(parameters_of(found))}};
  if (!found.wins.empty()) json["wins"] = wins_of(found);
  if (found.decided_by)
    json["expected"] = {{"separation_sigma", found.decided_by->separation},
                        {"duration_s", found.decided_by->duration_s}};
  return json;
}

Json json_of(const identification::gap::UnnamedEffect& unnamed, bool accepted) {
  using model::effects::Empirical;
  Json json{
      {"type", Empirical::kName},
      {"physical_name", nullptr},
      {"accepted", accepted},
      {"evidence",
       {{"held_out_gain", unnamed.held_out_gain},
        {"blocks_improved", std::to_string(unnamed.blocks_improved) + "/" + std::to_string(unnamed.blocks)},
        {"p_value", unnamed.p_value}}},
      {"gap_before", unnamed.gap_before_Nm},
      {"gap_after", unnamed.gap_after_Nm},
      {"removable_share", unnamed.removable_share},
      {"terms", Json::array()}};
  if (std::isfinite(unnamed.simulation_before_rad_per_s) && std::isfinite(unnamed.simulation_after_rad_per_s))
    json["simulation"] = {{"unit", "rad/s"},
                          {"before", unnamed.simulation_before_rad_per_s},
                          {"after", unnamed.simulation_after_rad_per_s}};
  for (const Empirical::Term& term : terms_of(unnamed))
    json["terms"].push_back({{"along", Empirical::name_of(term.along)},
                             {"times", Empirical::name_of(term.times)},
                             {"from", term.table.from()},
                             {"to", term.table.to()},
                             {"beyond", term.table.repeats() ? "repeats" : "holds the last value"},
                             {"unit", Empirical::unit_of(term.times)},
                             {"values", term.table.values()}});
  return json;
}

Json json_of(const std::vector<identification::gap::ClosedLoop>& runs, const ClosedLoopMean& mean) {
  Json json{{"metric", "mean magnitude of the position error from the set-points alone"},
            {"unit", "rad"},
            {"held_out", mean.held_out},
            {"before", mean.before_rad},
            {"after", mean.after_rad},
            {"recordings", Json::array()}};
  for (const identification::gap::ClosedLoop& run : runs)
    json["recordings"].push_back({{"recording", run.before.recording},
                                  {"held_out", run.held_out},
                                  {"before", run.before.mean_rad},
                                  {"after", run.after.mean_rad},
                                  {"rms_before", run.before.rms_rad},
                                  {"rms_after", run.after.rms_rad}});
  return json;
}

/// NaN, or an infinite end of an interval, would become `null`, which no reader expects.
void require_finite(const Json& json, const std::string& path) {
  if (json.is_number_float() && !std::isfinite(json.get<double>()))
    throw std::logic_error("gap.json: " + path + " has no finite value; this is a mistake in youbot-gap");
  if (!json.is_structured()) return;
  for (const auto& [key, value] : json.items()) require_finite(value, path + "/" + key);
}

}  // namespace

std::string gap_json(const Findings& findings) {
  const identification::gap::Result& result = findings.result;
  Json json{{"format", "youbot-gap/1"},
            {"verdict", identification::gap::verdict_name(result.verdict)},
            {"diagnosis", Json::array()},
            {"noise_floor_Nm", result.noise_floor_Nm},
            {"held_out", result.held_out},
            {"gap",
             {{"metric", "rms torque residual, held-out"},
              {"unit", "Nm"},
              {"before", result.gap_before_Nm},
              {"refitted", result.gap_base_Nm},
              {"after", result.gap_after_Nm},
              {"searched", result.gap_searched_Nm},
              {"band_Hz", result.band_Hz},
              {"torque_lag_s", result.torque_lag_s},
              {"torque_smoothing_s2", result.torque_smoothing_s2}}},
            {"effects", Json::array()},
            {"rejected", Json::array()},
            {"unexplained", Json::array()},
            {"unexplained_searched", Json::array()},
            {"refitted", Json::array()},
            {"notes", notes(findings)},
            {"drive", findings.drive},
            {"base_model", findings.base_path},
            {"data", findings.data},
            {"seed", findings.seed},
            {"version", runtime::build_version()}};
  if (result.shrink)
    json["gap"]["shrink"] = {{"value", result.shrink->share},
                             {"ci95", {result.shrink->lower, result.shrink->upper}}};
  json["gap"]["recordings"] = Json::array();
  for (const identification::gap::RecordingGap& gap : result.recordings) {
    const Json shares{{"nrmse", {{"before", gap.nrmse_before}, {"after", gap.nrmse_after}}},
                      {"vaf", {{"before", gap.vaf_before}, {"after", gap.vaf_after}}}};
    if (gap.recording.empty()) {
      json["gap"].update(shares);
      continue;
    }
    Json own{{"recording", gap.recording}, {"before", gap.before_Nm}, {"after", gap.after_Nm}};
    own.update(shares);
    json["gap"]["recordings"].push_back(std::move(own));
  }
  for (const identification::gap::Diagnosis& seen : result.diagnosis)
    json["diagnosis"].push_back(
        {{"recording", seen.recording}, {"column", seen.column}, {"found", seen.found}, {"done", seen.done}});
  // A model whose simulation diverges still predicts the torque.
  if (std::isfinite(result.simulation_before) && std::isfinite(result.simulation_after))
    json["simulation"] = {{"metric", "rms velocity error of free simulation in windows, held-out"},
                          {"unit", "rad/s"},
                          {"before", result.simulation_before},
                          {"after", result.simulation_after}};
  // Likewise.
  if (const ClosedLoopMean loop = closed_loop_mean(result);
      loop.recordings > 0 && std::ranges::all_of(result.closed_loop, [](const auto& run) {
        return std::isfinite(run.before.rms_rad) && std::isfinite(run.after.rms_rad);
      }))
    json["closed_loop"] = json_of(result.closed_loop, loop);
  for (const identification::gap::FoundEffect& found : result.effects)
    json["effects"].push_back(json_of(found, findings));
  for (const identification::gap::RejectedEffect& rejected : result.rejected)
    if (std::isfinite(rejected.gap_after))
      json["rejected"].push_back(
          {{"type", rejected.type}, {"gap_after", rejected.gap_after}, {"reason", rejected.reason}});
  for (const auto& [key, list] : {std::pair("unexplained", &result.unexplained),
                                  std::pair("unexplained_searched", &result.unexplained_searched)})
    for (const identification::gap::Unexplained& unexplained : *list)
      json[key].push_back({{"where", json_of(unexplained.where)}, {"share", unexplained.share}});
  if (result.unnamed) json["unnamed"] = json_of(*result.unnamed, result.unnamed_accepted);
  for (const Refitted& refitted : refitted_parameters(findings))
    if (std::isfinite(refitted.before) && refitted.after.ok())
      json["refitted"].push_back({{"type", refitted.effect_type},
                                  {"parameter", refitted.after.name},
                                  {"before", refitted.before},
                                  {"value", refitted.after.value},
                                  {"ci95", {refitted.after.lower, refitted.after.upper}}});
  require_finite(json, "");
  // Names of files and rigs may contain any bytes.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace analysis
