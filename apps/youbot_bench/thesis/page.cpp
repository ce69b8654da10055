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

std::string printed_text(const Printed& printed) {
  if (std::isinf(printed.to)) return fmt::format("{:.6g} or more", printed.from);
  if (printed.from == printed.to) return fmt::format("{:.6g}", printed.from);
  return fmt::format("{:.6g} to {:.6g}", printed.from, printed.to);
}

std::string ours_text(double ours) { return std::isfinite(ours) ? fmt::format("{:.5g}", ours) : "–"; }

std::string difference_text(const Comparison& comparison) {
  const double percent = comparison.difference_percent();
  return std::isfinite(percent) ? fmt::format("{:.3g}", std::abs(percent) < 0.005 ? 0.0 : percent) : "–";
}

std::string verdict(const Comparison& comparison) {
  const Printed& printed = *comparison.printed;
  if (printed.setting) return "taken from the thesis";
  if (!comparison.must_agree()) return "may differ";
  const std::string limit =
      printed.within_percent > 0 ? fmt::format(" (limit {:g} %)", printed.within_percent) : "";
  return (comparison.agrees() ? "agrees" : "DOES NOT AGREE") + limit;
}

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
  const std::string_view where = figure.compared.front().printed->where;
  const bool one_place = std::ranges::all_of(
      figure.compared, [&](const Comparison& comparison) { return comparison.printed->where == where; });
  std::vector<report::Column> columns{{"what"}, {"unit"},          {"printed"},
                                      {"ours"}, {"difference, %"}, {"verdict"}};
  if (!one_place) columns.push_back({"printed in"});
  std::vector<report::Row> rows;
  for (const Comparison& comparison : figure.compared) {
    const Printed& printed = *comparison.printed;
    rows.push_back({std::string(printed.what),
                    printed.unit.empty() ? std::string("–") : std::string(printed.unit),
                    printed_text(printed), ours_text(comparison.ours), difference_text(comparison),
                    verdict(comparison)});
    if (!one_place) rows.back().emplace_back(std::string(printed.where));
  }
  page.table(columns, rows,
             one_place ? "Printed in " + std::string(where) + ", and ours" : "Printed, and ours");
  add_reasons(page, figure);
}

void add(report::Page& page, const Figure& figure) {
  page.heading(figure.number + ": " + figure.caption);
  if (!figure.text.empty()) page.text(figure.text);
  add_comparisons(page, figure);
  for (const FigureTable& table : figure.tables) page.table(table.columns, table.rows, table.caption);
  if (!figure.plots.empty()) page.plots(figure.plots);
}

void add_not_made(report::Page& page) {
  page.heading("What is not made, and why");
  std::vector<report::Row> rows;
  for (const NotMade& each : kNotMade)
    rows.push_back({std::string(each.number), std::string(each.caption), std::string(each.reason)});
  page.table({{"figure or table"}, {"what it shows"}, {"reason"}}, rows);
}

std::string introduction(const Tally& all, bool selected) {
  return fmt::format(
      "{} numbers that the thesis prints stand beside ours{}. {} of them are settings that we take from "
      "the thesis. Where the same physics or formula must give the same number, a limit is stated: {} of "
      "{} agree. The others may differ, and the lines below each table say why.\n\n"
      "Ours come from experiments on the simulated robot of the thesis (wheels with its published friction "
      "curves, motors with its offset of 0.03 N·m, current without sign), in virtual time, when this page "
      "was made. The thesis' raw measurements are not public. A simulation that was given a number of the "
      "thesis returns it when the experiment and its evaluation are right; that is what such a row "
      "shows.\n\n"
      "Source: M. Corberán Ruiz, Haptic teleoperation of the youBot with friction compensation for the "
      "base, Universidad Carlos III de Madrid and University of Twente, 2012.",
      all.compared, selected ? " (some chapters only)" : "", all.settings, all.agree, all.must_agree);
}

}  // namespace

Tally tally(std::span<const Figure> figures) {
  Tally all;
  for (const Figure& figure : figures)
    for (const Comparison& comparison : figure.compared) {
      ++all.compared;
      if (comparison.printed->setting) ++all.settings;
      if (!comparison.must_agree()) continue;
      ++all.must_agree;
      if (comparison.agrees()) ++all.agree;
    }
  return all;
}

report::Page page_of(std::span<const Figure> figures, bool selected) {
  report::Page page("The thesis' figures and tables, printed and made again");
  page.text(introduction(tally(figures), selected));
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
                          {"printed_in", std::string(printed.where)},
                          {"what", std::string(printed.what)},
                          {"unit", std::string(printed.unit)},
                          {"printed_from", printed.from},
                          {"printed_to", number(printed.to)},
                          {"ours", number(comparison.ours)},
                          {"difference_percent", number(comparison.difference_percent())},
                          {"setting", printed.setting},
                          {"within_percent", number(printed.within_percent)},
                          {"why", comparison.why}};
      each["agrees"] =
          comparison.must_agree() ? nlohmann::json(comparison.agrees()) : nlohmann::json(nullptr);
      json["numbers"].push_back(std::move(each));
    }
  const Tally all = tally(figures);
  json["compared"] = all.compared;
  json["settings"] = all.settings;
  json["must_agree"] = all.must_agree;
  json["agree"] = all.agree;
  return json;
}

}  // namespace youbot_bench::thesis
