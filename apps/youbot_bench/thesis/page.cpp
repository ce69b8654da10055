#include "apps/youbot_bench/thesis/page.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "apps/youbot_bench/thesis/not_made.h"

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

void add_comparisons(report::Page& page, const Figure& figure) {
  if (figure.compared.empty()) return;
  std::vector<report::Row> rows;
  for (const Comparison& comparison : figure.compared)
    rows.push_back({std::string(comparison.printed->what), std::string(comparison.printed->where),
                    std::string(comparison.printed->unit), printed_text(*comparison.printed),
                    ours_text(comparison.ours), difference_text(comparison), verdict(comparison),
                    comparison.why});
  page.table({{"what"},
              {"printed in"},
              {"unit"},
              {"printed"},
              {"ours"},
              {"difference, %"},
              {"verdict"},
              {"what differs and why"}},
             rows, "Printed numbers beside ours");
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
      "{} numbers that the thesis prints stand beside ours{}. {} of them are settings that we take from the "
      "thesis. "
      "Where the same physics or formula must give the same number, a limit is stated: {} of {} agree. The "
      "others may "
      "differ, and the last column says why.\n\n"
      "Ours come from experiments on the simulated robot of the thesis (wheels with its published friction "
      "curves, "
      "motors with its offset of 0.03 N·m, current without sign), in virtual time, when this page was made. "
      "The "
      "thesis' raw measurements are not public. A simulation that was given a number of the thesis returns "
      "it when the "
      "experiment and its evaluation are right; that is what such a row shows.\n\n"
      "Source: M. Corberán Ruiz, Haptic teleoperation of the youBot with friction compensation for the base, "
      "Universidad Carlos III de Madrid and University of Twente, 2012.",
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
