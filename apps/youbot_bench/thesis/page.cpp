#include "apps/youbot_bench/thesis/page.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "apps/youbot_bench/thesis/not_made.h"
#include "runtime/program/wording.h"

namespace youbot_bench::thesis {
namespace {

std::string ours_text(double ours) { return std::isfinite(ours) ? fmt::format("{:.5g}", ours) : "–"; }

std::string difference_text(const Comparison& comparison) {
  const double percent = comparison.difference_percent();
  return std::isfinite(percent) ? fmt::format("{:.3g}", std::abs(percent) < 0.005 ? 0.0 : percent) : "–";
}

const char* name(Kind kind) {
  switch (kind) {
    case kMayDiffer: return "may differ";
    case kMustAgree: return "must agree";
    case kSetting: return "setting";
    case kByConstruction: return "by construction";
  }
  return "";
}

std::string verdict(const Comparison& comparison) {
  const Printed& printed = *comparison.printed;
  if (!printed.limited()) return name(printed.kind);
  const std::string limit =
      printed.within_percent > 0 ? fmt::format(" (limit {:g} %)", printed.within_percent) : "";
  if (!comparison.agrees()) return "DOES NOT AGREE" + limit;
  return (printed.kind == kMustAgree ? "agrees" : name(printed.kind)) + limit;
}

const char* name(Origin origin) { return origin == kThesis ? "thesis" : "criterion"; }

/// Numbers with the same reason share a paragraph.
void add_reasons(report::Page& page, const Figure& figure) {
  std::vector<std::pair<std::string, std::vector<std::string>>> reasons;
  for (const Comparison& comparison : figure.compared) {
    if (comparison.why.empty()) continue;
    auto known = std::ranges::find(reasons, comparison.why, &decltype(reasons)::value_type::first);
    if (known == reasons.end()) known = reasons.insert(known, {comparison.why, {}});
    known->second.emplace_back(comparison.printed->what);
  }
  for (const auto& [why, names] : reasons) page.text(runtime::list_text(names) + ": " + why);
}

void add_comparisons(report::Page& page, const Figure& figure) {
  if (figure.compared.empty()) return;
  std::vector<report::Row> rows;
  for (const Comparison& comparison : figure.compared) {
    const Printed& printed = *comparison.printed;
    rows.push_back({std::string(printed.what),
                    printed.unit.empty() ? std::string("–") : std::string(printed.unit),
                    expected_text(printed), ours_text(comparison.ours), difference_text(comparison),
                    verdict(comparison), name(printed.origin), std::string(printed.place)});
  }
  page.table(
      {{"what"}, {"unit"}, {"expected"}, {"ours"}, {"difference, %"}, {"verdict"}, {"origin"}, {"place"}},
      rows, "Expected numbers, and ours");
  add_reasons(page, figure);
}

void add(report::Page& page, const Figure& figure) {
  page.heading(figure.number + ": " + figure.caption);
  if (!figure.text.empty()) page.text(figure.text);
  add_comparisons(page, figure);
  for (const FigureTable& table : figure.tables) page.table(table.columns, table.rows, table.caption);
  if (figure.more) figure.more(page);
  if (!figure.plots.empty()) page.plots(figure.plots);
}

void add_not_made(report::Page& page) {
  page.heading("What is not made, and why");
  std::vector<report::Row> rows;
  for (const NotMade& each : kNotMade)
    rows.push_back({std::string(each.number), std::string(each.caption), std::string(each.reason)});
  page.table({{"figure or table"}, {"what it shows"}, {"reason"}}, rows);
}

std::string introduction(const Tally& print, const Tally& criteria, bool selected) {
  const std::size_t outside = print.outside + criteria.outside;
  return fmt::format(
      "{} numbers that the thesis prints stand beside ours{}:\n\n"
      "{} must agree within a stated limit, because an experiment, an evaluation or a formula of ours could "
      "miss them; {} of them do. {} are settings that we take from the thesis and read back, some at the end "
      "of a run. {} agree by construction: they follow from other printed numbers, or what the thesis does "
      "not print was chosen to give them. {} may differ, and the lines below each table say why.\n\n"
      "{} more are criteria of ours, where the thesis prints words, a curve or a function and no number: "
      "{} of {} that must agree do, {} hold by construction. {}\n\n"
      "Ours come from experiments on the simulated robot of the thesis (wheels with its published friction "
      "curves, motors with its offset of {:g} N·m, current without sign), in virtual time, when this page "
      "was made. The thesis' raw measurements are not public. Where the simulation was given a number of "
      "the thesis and an evaluation estimates it again, the row shows that the evaluation is right, not "
      "that the robot has that number.\n\n"
      "Source: M. Corberán Ruiz, Haptic teleoperation of the youBot with friction compensation for the "
      "base, Universidad Carlos III de Madrid and University of Twente, 2012.",
      print.compared, selected ? " (some chapters only)" : "", print.must_agree, print.agree, print.settings,
      print.by_construction, print.may_differ, criteria.compared, criteria.agree, criteria.must_agree,
      criteria.by_construction,
      outside == 0 ? "None is beyond its limit." : fmt::format("{} of all are beyond their limit.", outside),
      printed_value("ramp/offset"));
}

nlohmann::json counts(const Tally& all) {
  return {
      {"compared", all.compared}, {"must_agree", all.must_agree},           {"agree", all.agree},
      {"settings", all.settings}, {"by_construction", all.by_construction}, {"may_differ", all.may_differ},
      {"outside", all.outside}};
}

}  // namespace

std::string expected_text(const Printed& printed) {
  if (std::isinf(printed.to)) return fmt::format("{:.6g} or more", printed.from);
  if (printed.from == printed.to) return fmt::format("{:.6g}", printed.from);
  return fmt::format("{:.6g} to {:.6g}", printed.from, printed.to);
}

Tally tally(std::span<const Figure> figures, Origin origin) {
  Tally all;
  for (const Figure& figure : figures)
    for (const Comparison& comparison : figure.compared) {
      const Printed& printed = *comparison.printed;
      if (printed.origin != origin) continue;
      ++all.compared;
      switch (printed.kind) {
        case kMayDiffer: ++all.may_differ; break;
        case kMustAgree: ++all.must_agree; break;
        case kSetting: ++all.settings; break;
        case kByConstruction: ++all.by_construction; break;
      }
      if (printed.kind == kMustAgree && comparison.agrees()) ++all.agree;
      if (printed.limited() && !comparison.agrees()) ++all.outside;
    }
  return all;
}

report::Page page_of(std::span<const Figure> figures, bool selected) {
  report::Page page("The thesis' figures and tables, printed and made again");
  page.text(introduction(tally(figures, kThesis), tally(figures, kCriterion), selected));
  for (const Figure& figure : figures) add(page, figure);
  add_not_made(page);
  return page;
}

nlohmann::json json_of(std::span<const Figure> figures) {
  const auto number = [](double value) {
    return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(nullptr);
  };
  nlohmann::json json{{"format", "youbot-thesis/1"}, {"numbers", nlohmann::json::array()}};
  for (const Figure& figure : figures)
    for (const Comparison& comparison : figure.compared) {
      const Printed& printed = *comparison.printed;
      nlohmann::json each{{"key", std::string(printed.key)},
                          {"figure", figure.number},
                          {"origin", name(printed.origin)},
                          {"place", std::string(printed.place)},
                          {"what", std::string(printed.what)},
                          {"unit", std::string(printed.unit)},
                          {"expected_from", printed.from},
                          {"expected_to", number(printed.to)},
                          {"ours", number(comparison.ours)},
                          {"difference_percent", number(comparison.difference_percent())},
                          {"kind", name(printed.kind)},
                          {"why", comparison.why}};
      each["within_percent"] =
          printed.limited() ? nlohmann::json(printed.within_percent) : nlohmann::json(nullptr);
      each["agrees"] = printed.limited() ? nlohmann::json(comparison.agrees()) : nlohmann::json(nullptr);
      json["numbers"].push_back(std::move(each));
    }
  json["thesis"] = counts(tally(figures, kThesis));
  json["criterion"] = counts(tally(figures, kCriterion));
  return json;
}

}  // namespace youbot_bench::thesis
