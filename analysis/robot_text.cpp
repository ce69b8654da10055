#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <system_error>

#include "analysis/model_header.h"
#include "analysis/robot.h"
#include "identification/gap/noise_draws.h"
#include "runtime/configuration/quantity.h"
#include "runtime/program/build_info.h"
#include "runtime/program/wording.h"

namespace analysis {
namespace {

using identification::fit::Estimate;
using identification::robot_gap::FoundPart;
using identification::robot_gap::NamedEffect;
using identification::robot_gap::RobotResult;
using RobotJson = nlohmann::ordered_json;

std::string robot_parameters_text(const FoundPart& found) {
  std::string text;
  for (const Estimate& estimate : found.parameters) {
    const runtime::Quantity quantity = runtime::quantity_of(estimate.name);
    const auto numbers = runtime::interval_text(estimate.value, estimate.lower, estimate.upper);
    text += fmt::format("{}{} {}{}{} ({} to {})", text.empty() ? "" : ", ", quantity.name, numbers.value,
                        quantity.unit.empty() ? "" : " ", quantity.unit, numbers.lower, numbers.upper);
  }
  return text;
}

std::string robot_evidence(const FoundPart& found) {
  return fmt::format(
      "takes away {:.3g} % of the squared held-out residual, better in {} of {} blocks, p = {:.2g}",
      100 * found.held_out_gain, found.blocks_improved, found.blocks, found.p_value);
}

RobotJson json_of_name(const NamedEffect& name) { return {{"type", name.effect}, {"part", name.part}}; }

RobotJson json_of_found(const FoundPart& found) {
  RobotJson json = json_of_name(found.name);
  json["evidence"] = {{"held_out_gain", found.held_out_gain},
                      {"of_squared", "held-out residual"},
                      {"blocks_improved", fmt::format("{}/{}", found.blocks_improved, found.blocks)},
                      {"p_value", found.p_value}};
  json["gap_before"] = found.gap_before_Nm;
  json["gap_after"] = found.gap_after_Nm;
  json["equivalent"] = RobotJson::array();
  for (std::size_t i = 0; i < found.equivalent.size(); ++i) {
    RobotJson rival = json_of_name(found.equivalent[i]);
    rival["wins"] = found.wins[i + 1];
    json["equivalent"].push_back(std::move(rival));
  }
  if (!found.wins.empty()) {
    json["wins"] = found.wins.front();
    json["draws"] = identification::gap::kNoiseDraws;
  }
  json["deciding_experiment"] = found.deciding_experiment;
  json["parameters"] = RobotJson::object();
  for (std::size_t i = 0; i < found.parameters.size(); ++i) {
    const Estimate& one = found.parameters[i];
    json["parameters"][one.name] = {
        {"value", one.value}, {"ci95", {one.lower, one.upper}}, {"given", found.given[i]}};
  }
  return json;
}

/// Lines above the parts of a delivered model.
std::vector<runtime::RobotRemark> robot_remarks(const RobotResult& result) {
  std::vector<runtime::RobotRemark> remarks;
  for (const FoundPart& found : result.effects) {
    remarks.push_back({found.name.part, part_words(found.name) + ": " + robot_parameters_text(found)});
    remarks.push_back({found.name.part, "added by youbot-gap: " + robot_evidence(found)});
    if (found.equivalent.empty()) continue;
    std::string rivals;
    for (const NamedEffect& rival : found.equivalent)
      rivals += (rivals.empty() ? "" : ", ") + part_words(rival);
    remarks.push_back({found.name.part, "this data cannot tell it from: " + rivals});
  }
  return remarks;
}

}  // namespace

std::string part_words(const NamedEffect& name) {
  std::string effect = name.effect;
  std::ranges::replace(effect, '_', ' ');
  return effect + " of " + name.part;
}

std::string part_with_rivals(const FoundPart& found) {
  std::string text = part_words(found.name);
  for (const NamedEffect& rival : found.equivalent) text += ", or " + part_words(rival);
  return text;
}

std::string robot_gap_json(const RobotFindings& findings) {
  const RobotResult& result = findings.result;
  RobotJson json{{"format", "youbot-gap/1"},
                 {"kind", "robot"},
                 {"verdict", identification::gap::verdict_name(result.verdict)},
                 {"reason", result.reason},
                 {"noise_floor_Nm", result.noise_floor_Nm},
                 {"held_out", result.held_out},
                 {"gap",
                  {{"metric", "rms torque residual over all joints, held-out"},
                   {"unit", "Nm"},
                   {"before", result.gap_before_Nm},
                   {"refitted", result.gap_refitted_Nm},
                   {"all_parameters", result.gap_dense_Nm},
                   {"after", result.gap_after_Nm},
                   {"band_Hz", result.band_Hz},
                   {"torque_lag_s", result.torque_lag_s},
                   {"joints", RobotJson::array()},
                   {"recordings", RobotJson::array()}}},
                 {"effects", RobotJson::array()},
                 {"rejected", RobotJson::array()},
                 {"shares", RobotJson::array()},
                 {"notes", result.notes},
                 {"robot", findings.base.name},
                 {"base_model", findings.base_path},
                 {"data", findings.data},
                 {"seed", findings.seed},
                 {"version", runtime::build_version()}};
  for (const auto& joint : result.joints)
    json["gap"]["joints"].push_back({{"joint", joint.joint},
                                     {"judged", joint.judged},
                                     {"noise_floor_Nm", joint.noise_floor_Nm},
                                     {"before", joint.before_Nm},
                                     {"all_parameters", joint.dense_Nm},
                                     {"after", joint.after_Nm}});
  for (const auto& motion : result.motions)
    json["gap"]["recordings"].push_back({{"recording", motion.recording},
                                         {"held_out", motion.held_out},
                                         {"before", motion.before_Nm},
                                         {"after", motion.after_Nm}});
  for (const FoundPart& found : result.effects) json["effects"].push_back(json_of_found(found));
  for (const auto& rejected : result.rejected) {
    RobotJson one = json_of_name(rejected.name);
    one["reason"] = rejected.reason;
    json["rejected"].push_back(std::move(one));
  }
  for (const auto& share : result.shares)
    json["shares"].push_back({{"coordinate", share.coordinate},
                              {"joint", share.joint},
                              {"recording", share.recording},
                              {"from", share.from},
                              {"to", share.to},
                              {"before", share.before},
                              {"after", share.after},
                              {"rows", share.rows}});
  return json.dump(2, ' ', false, RobotJson::error_handler_t::replace) + "\n";
}

std::string robot_model_text(const RobotFindings& findings, const std::filesystem::path& out) {
  const RobotResult& result = findings.result;
  runtime::RobotFile robot = findings.base;
  robot.arm = result.arm;
  std::error_code error;
  std::filesystem::path urdf = std::filesystem::proximate(findings.base.urdf, out, error);
  if (error) urdf = std::filesystem::absolute(findings.base.urdf);
  return runtime::robot_file_text(robot, urdf, findings.base.arm, model_header(findings),
                                  robot_remarks(result));
}

std::string robot_summary_text(const RobotFindings& findings) {
  const RobotResult& result = findings.result;
  std::string text = fmt::format(
      "{}: {}: {}\ngap {:.3g} -> {:.3g} N·m on held-out data, noise floor {:.3g} N·m ({:.3g} N·m with the "
      "given "
      "friction refitted, {:.3g} N·m with every parameter fitted at once)\nheld out: {}\n",
      findings.base.name.empty() ? "the robot" : findings.base.name,
      identification::gap::verdict_name(result.verdict), result.reason, result.gap_before_Nm,
      result.gap_after_Nm, result.noise_floor_Nm, result.gap_refitted_Nm, result.gap_dense_Nm,
      runtime::list_text(result.held_out));
  const double total = [&] {
    double sum = 0;
    for (const auto& share : result.shares)
      if (share.coordinate == "joint") sum += share.before;
    return sum;
  }();
  for (const auto& joint : result.joints) {
    double share = 0;
    for (const auto& one : result.shares)
      if (one.coordinate == "joint" && one.joint == joint.joint) share = total > 0 ? one.before / total : 0;
    text +=
        fmt::format("  {}: {:.3g} -> {:.3g} N·m, floor {:.3g} N·m, {:.0f} % of the squared disagreement\n",
                    joint.joint, joint.before_Nm, joint.after_Nm, joint.noise_floor_Nm, 100 * share);
  }
  for (const FoundPart& found : result.effects) {
    text += fmt::format("  + {}: {}; {}\n", part_with_rivals(found), robot_parameters_text(found),
                        robot_evidence(found));
    if (!found.wins.empty()) {
      text += fmt::format("    wins: {} {}", part_words(found.name), found.wins.front());
      for (std::size_t i = 0; i < found.equivalent.size(); ++i)
        text += fmt::format(", {} {}", part_words(found.equivalent[i]), found.wins[i + 1]);
      text += fmt::format(" of {} draws of the noise\n", identification::gap::kNoiseDraws);
    }
  }
  for (const auto& rejected : result.rejected)
    text += fmt::format("  - {} not added: {}\n", part_words(rejected.name), rejected.reason);
  for (const std::string& note : result.notes) text += "  ! " + note + "\n";
  for (const FoundPart& found : result.effects)
    if (!found.deciding_experiment.empty()) text += "next: " + found.deciding_experiment + "\n";
  return text;
}

}  // namespace analysis
