#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

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
using identification::robot_gap::Gap;
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

/// "Nm": as names of columns have it.
std::string plain_unit(std::string unit) {
  for (std::size_t at = unit.find("·"); at != std::string::npos; at = unit.find("·"))
    unit.erase(at, std::string_view("·").size());
  return unit;
}

RobotJson json_of_gap(const Gap& gap) {
  return {{"noise_floor", gap.noise_floor},
          {"before", gap.before},
          {"refitted", gap.refitted},
          {"all_parameters", gap.dense},
          {"after", gap.after}};
}

RobotJson json_of_found(const FoundPart& found, const RobotResult& result) {
  RobotJson json = json_of_name(found.name);
  json["evidence"] = {{"held_out_gain", found.held_out_gain},
                      {"of_squared", "held-out residual"},
                      {"blocks_improved", fmt::format("{}/{}", found.blocks_improved, found.blocks)},
                      {"p_value", found.p_value}};
  json["gap_before"] = found.gap_before.front();
  json["gap_after"] = found.gap_after.front();
  json["units"] = RobotJson::array();
  for (std::size_t u = 0; u < result.gaps.size(); ++u)
    json["units"].push_back({{"unit", plain_unit(result.gaps[u].unit)},
                             {"before", found.gap_before[u]},
                             {"after", found.gap_after[u]}});
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

RobotJson json_of_path(const PathGap& path) {
  const auto both = [](double before, double after) {
    return RobotJson{{"before", before}, {"after", after}};
  };
  return {{"recording", path.recording},
          {"run", path.run},
          {"held_out", path.held_out},
          {"length_m", path.length_m},
          {"rms_m", both(path.before.rms_m, path.after.rms_m)},
          {"end_m", both(path.before.end_m, path.after.end_m)},
          {"end_heading_rad", both(path.before.end_heading_rad, path.after.end_heading_rad)}};
}

/// Over the held-out runs, each counted once.
std::string paths_text(const std::vector<PathGap>& paths) {
  PathGap::Error before;
  PathGap::Error after;
  double runs = 0;
  const auto add = [](PathGap::Error& sum, const PathGap::Error& one) {
    sum.rms_m += one.rms_m * one.rms_m;
    sum.end_m += one.end_m * one.end_m;
    sum.end_heading_rad += one.end_heading_rad * one.end_heading_rad;
  };
  for (const PathGap& path : paths) {
    if (!path.held_out) continue;
    add(before, path.before);
    add(after, path.after);
    ++runs;
  }
  if (runs == 0) return "";
  const auto rms = [runs](double squares) { return std::sqrt(squares / runs); };
  return fmt::format(
      "paths of {:.0f} held-out runs: off by {:.3g} -> {:.3g} m, at the end {:.3g} -> {:.3g} m and {:.3g} -> "
      "{:.3g} rad\n",
      runs, rms(before.rms_m), rms(after.rms_m), rms(before.end_m), rms(after.end_m),
      rms(before.end_heading_rad), rms(after.end_heading_rad));
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

std::vector<runtime::RobotRemark> robot_remarks(const RobotFindings& findings) {
  std::vector<runtime::RobotRemark> remarks;
  for (const FoundPart& found : findings.result.effects) {
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

std::vector<std::string> robot_header(const RobotFindings& findings) {
  std::string gap;
  for (const auto& of_unit : findings.result.gaps)
    gap += (gap.empty() ? "" : "; ") +
           gap_line(of_unit.gap.before, of_unit.gap.after, of_unit.gap.noise_floor, of_unit.unit);
  return model_header(findings, gap);
}

std::string robot_gap_json(const RobotFindings& findings) {
  const RobotResult& result = findings.result;
  RobotJson json{{"format", "youbot-gap/1"},
                 {"kind", "robot"},
                 {"verdict", identification::gap::verdict_name(result.verdict)},
                 {"reason", result.reason},
                 {"held_out", result.held_out},
                 {"gap", {{"metric", findings.metric}, {"delay_s", result.delay_s}}},
                 {"effects", RobotJson::array()},
                 {"rejected", RobotJson::array()},
                 {"shares", RobotJson::array()},
                 {"notes", result.notes},
                 {"robot", findings.name},
                 {"base_model", findings.base_path},
                 {"data", findings.data},
                 {"seed", findings.seed},
                 {"version", runtime::build_version()}};
  // Of the first unit also as for a drive.
  RobotJson& gap = json["gap"];
  const auto& first = result.gaps.front();
  json["noise_floor_" + plain_unit(first.unit)] = first.gap.noise_floor;
  gap["unit"] = plain_unit(first.unit);
  gap.update(json_of_gap(first.gap));
  gap["units"] = RobotJson::array();
  for (const auto& of_unit : result.gaps) {
    RobotJson one{{"unit", plain_unit(of_unit.unit)}};
    one.update(json_of_gap(of_unit.gap));
    gap["units"].push_back(std::move(one));
  }
  const std::string channels = findings.channel_word + "s";
  gap[channels] = RobotJson::array();
  for (const auto& channel : result.channels) {
    RobotJson one{{findings.channel_word, channel.channel.name},
                  {"unit", plain_unit(channel.channel.unit)},
                  {"judged", channel.judged}};
    one.update(json_of_gap(channel.gap));
    gap[channels].push_back(std::move(one));
  }
  gap["recordings"] = RobotJson::array();
  for (const auto& motion : result.motions)
    gap["recordings"].push_back({{"recording", motion.recording},
                                 {"held_out", motion.held_out},
                                 {"unit", "noise floors"},
                                 {"before", motion.before},
                                 {"after", motion.after}});
  if (!findings.paths.empty()) {
    gap["paths"] = RobotJson::array();
    for (const PathGap& path : findings.paths) gap["paths"].push_back(json_of_path(path));
  }
  for (const FoundPart& found : result.effects) json["effects"].push_back(json_of_found(found, result));
  for (const auto& rejected : result.rejected) {
    RobotJson one = json_of_name(rejected.name);
    one["reason"] = rejected.reason;
    json["rejected"].push_back(std::move(one));
  }
  for (const auto& share : result.shares)
    json["shares"].push_back(
        {{"coordinate", share.coordinate == "channel" ? findings.channel_word : share.coordinate},
         {findings.channel_word, share.channel},
         {"recording", share.recording},
         {"unit", plain_unit(share.unit)},
         {"from", share.from},
         {"to", share.to},
         {"before", share.before},
         {"after", share.after},
         {"rows", share.rows}});
  return json.dump(2, ' ', false, RobotJson::error_handler_t::replace) + "\n";
}

std::string robot_summary_text(const RobotFindings& findings) {
  const RobotResult& result = findings.result;
  std::string text = fmt::format("{}: {}: {}\n", findings.name.empty() ? "the robot" : findings.name,
                                 identification::gap::verdict_name(result.verdict), result.reason);
  for (const auto& of_unit : result.gaps)
    text += fmt::format(
        "gap {:.3g} -> {:.3g} {unit} on held-out data, noise floor {:.3g} {unit} ({:.3g} {unit} with every "
        "parameter fitted at once)\n",
        of_unit.gap.before, of_unit.gap.after, of_unit.gap.noise_floor, of_unit.gap.dense,
        fmt::arg("unit", of_unit.unit));
  text += "held out: " + runtime::list_text(result.held_out) + "\n";
  for (const auto& channel : result.channels) {
    double share = 0;
    for (const auto& one : result.shares)
      if (one.coordinate == "channel" && one.channel == channel.channel.name) share = one.before;
    text += fmt::format(
        "  {}: {:.3g} -> {:.3g} {unit}, floor {:.3g} {unit}, {:.0f} % of the squared disagreement\n",
        channel.channel.name, channel.gap.before, channel.gap.after, channel.gap.noise_floor, 100 * share,
        fmt::arg("unit", channel.channel.unit));
  }
  text += paths_text(findings.paths);
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
