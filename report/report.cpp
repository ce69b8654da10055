#include "report/report.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <limits>
#include <span>
#include <stdexcept>

#include "report/assets.h"
#include "report/decimate.h"
#include "runtime/configuration/whole_file.h"
#include "runtime/fixed_text.h"
#include "runtime/program/build_info.h"

namespace report {
namespace {

std::string escaped(std::string_view text) {
  std::string html;
  html.reserve(text.size());
  for (const char c : text) {
    switch (c) {
      case '&': html += "&amp;"; break;
      case '<': html += "&lt;"; break;
      case '>': html += "&gt;"; break;
      case '"': html += "&quot;"; break;
      case '\'': html += "&#39;"; break;
      default: html += c;
    }
  }
  return html;
}

/// A JSON string that is safe inside <script>: without `<`.
std::string json(std::string_view text) {
  constexpr std::string_view kHex = "0123456789abcdef";
  std::string quoted = R"(")";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      quoted += '\\';
      quoted += c;
    } else if (byte < 0x20 || c == '<') {
      quoted += "\\u00";
      quoted += kHex[byte >> 4];
      quoted += kHex[byte & 15];
    } else {
      quoted += c;
    }
  }
  return quoted + '"';
}

template <typename... Format>
std::string number_text(double value, Format... format) {
  std::array<char, 400> text;  // the largest double has 309 digits
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value, format...).ptr;
  return {text.data(), end};
}

/// Nine significant digits, as std::chars_format::general writes them, but five times faster for the values
/// that fill a plot.
std::string nine_digits(double value) {
  constexpr int kDigits = 9;
  const double magnitude = std::abs(value);
  if (!(magnitude >= 1e-4 && magnitude < 1e8)) return number_text(value, std::chars_format::general, kDigits);
  int decimals = kDigits + 3;
  for (double power = 1e-3; magnitude >= power; power *= 10) --decimals;
  std::array<char, 32> text;
  char* end = runtime::write_fixed(text.data(), text.data() + text.size(), value, decimals);
  while (*(end - 1) == '0') --end;
  if (*(end - 1) == '.') --end;
  return {text.data(), end};
}

std::string json(double value) { return std::isfinite(value) ? nine_digits(value) : "null"; }

std::string json(const std::optional<double>& value) { return value ? json(*value) : "null"; }

std::string json(std::span<const double> values, const std::vector<std::size_t>& indices) {
  std::string array = "[";
  for (const std::size_t i : indices) {
    if (array.size() > 1) array += ',';
    array += json(values[i]);
  }
  return array + ']';
}

std::string json(const Axis& axis) {
  return R"({"label":)" + json(axis.label) + R"(,"unit":)" + json(axis.unit) + R"(,"log":)" +
         (axis.log ? "true" : "false") + R"(,"from":)" + json(axis.from) + R"(,"to":)" + json(axis.to) +
         R"(,"link":)" + json(axis.link) + "}";
}

std::string json(const std::vector<Span>& spans) {
  std::string array = "[";
  for (const Span& span : spans)
    array += (array.size() > 1 ? "," : "") + std::string(R"({"name":)") + json(span.name) + R"(,"from":)" +
             json(span.from) + R"(,"to":)" + json(span.to) + "}";
  return array + ']';
}

const char* name_of(Style style) {
  switch (style) {
    case Style::kLine: return "line";
    case Style::kDashed: return "dashed";
    case Style::kPoints: return "points";
    case Style::kLineAndPoints: return "line and points";
  }
  return "line";
}

/// Number of points with separators.
std::string grouped(std::size_t count) {
  std::string digits = std::to_string(count);
  for (std::size_t i = digits.size(); i > 3; i -= 3) digits.insert(i - 3, 1, ',');
  return digits;
}

struct Drawn {
  std::string json;
  std::string thinned;  ///< a sentence, empty if all points are there
};

Drawn drawn(const Series& series, const Plot& plot) {
  const auto& lower = series.lower.empty() ? series.y : series.lower;
  const auto& upper = series.upper.empty() ? series.y : series.upper;
  const Points points{series.x, lower, upper, plot.x.log, plot.y.log};
  const bool markers = series.style == Style::kPoints;
  const auto kept = markers ? needed_for_markers(points) : needed_for_line(points);

  const auto optional = [&kept](const std::vector<double>& values) {
    return values.empty() ? "null" : json(values, kept);
  };
  // Without points it is unknown whether the series is an area: a line, then.
  const std::string y = series.x.empty() ? "[]" : optional(series.y);
  Drawn result;
  result.json = R"({"name":)" + json(series.name) + R"(,"style":")" + name_of(series.style) + R"(","x":)" +
                json(series.x, kept) + R"(,"y":)" + y + R"(,"lower":)" + optional(series.lower) +
                R"(,"upper":)" + optional(series.upper) + R"(,"look":)" +
                (series.look ? std::to_string(*series.look) : "null") + "}";
  if (kept.size() < series.x.size()) {
    result.thinned = (series.name.empty() ? "" : series.name + ": ") + grouped(kept.size()) + " of " +
                     grouped(series.x.size()) + " points are in this page, " +
                     (markers ? "without those that others cover. "
                              : "with the first, last, lowest and highest of every pixel column. ");
  }
  return result;
}

void require(bool condition, const std::string& problem) {
  if (!condition) throw std::invalid_argument("report: " + problem);
}

void check(const Axis& axis, const std::string& where) {
  for (const auto& end : {axis.from, axis.to}) {
    require(
        !end || (std::isfinite(*end) && (!axis.log || *end > 0)),
        where + R"(: axis ")" + axis.label + R"(" needs ends that are finite and, if logarithmic, positive)");
  }
  require(!axis.from || !axis.to || *axis.from < *axis.to,
          where + R"(: axis ")" + axis.label + R"(" ends before it begins)");
}

void check(const Plot& plot) {
  const std::string where = R"(plot ")" + plot.title + R"(")";
  check(plot.x, where);
  check(plot.y, where);
  require(!plot.series.empty(), where + " has no series");
  require(!plot.equal_axes || (!plot.x.log && !plot.y.log), where + ": equal axes cannot be logarithmic");
  for (const Span& span : plot.spans)
    require(std::isfinite(span.from) && span.from <= span.to && std::isfinite(span.to),
            where + R"(: span ")" + span.name + R"(" needs finite ends in order)");
  for (const Series& series : plot.series) {
    const std::string which = where + R"(, series ")" + series.name + R"(": )";
    const std::size_t count = series.x.size();
    require(series.lower.size() == series.upper.size(), which + "lower and upper differ in length");
    require(!series.y.empty() || !series.lower.empty() || count == 0,
            which + "neither y nor lower and upper");
    for (const auto* values : {&series.y, &series.lower})
      require(values->empty() || values->size() == count,
              which + std::to_string(values->size()) + " values for " + std::to_string(count) + " of x");
  }
}

std::string with_unit(const std::string& name, const std::string& unit) {
  return escaped(name) + (unit.empty() ? "" : R"( <span class="unit">()" + escaped(unit) + ")</span>");
}

std::string fixed(double value, int decimals) {
  return number_text(value, std::chars_format::fixed, std::clamp(decimals, 0, 17));
}

/// Decimal exponent of what is left of a value after rounding it to four significant digits.
int exponent_of(double value) {
  const std::string rounded = number_text(value, std::chars_format::scientific, 3);
  return std::atoi(rounded.c_str() + rounded.find('e') + 1);
}

/// Four significant digits, without exponent if that is short.
std::string four_digits(double value) {
  if (value == 0) return "0";
  const int exponent = exponent_of(value);
  if (exponent < -4 || exponent > 6) return number_text(value, std::chars_format::scientific, 3);
  return fixed(value, 3 - exponent);
}

bool is_whole(const Cell& cell) {
  const auto* value = std::get_if<double>(&cell);
  return value == nullptr || !std::isfinite(*value) ||
         (std::trunc(*value) == *value && std::abs(*value) < 1e15);
}

/// Of column `i`: as Column describes it.
std::optional<int> decimals_of(const Column& column, const std::vector<Row>& rows, std::size_t i) {
  if (column.decimals) return column.decimals;
  if (std::ranges::all_of(rows, [i](const Row& row) { return is_whole(row[i]); })) return 0;
  constexpr int kSimilar = 2;
  constexpr int kLongest = 7;  // decimals: smaller numbers are shorter with an exponent
  int smallest = std::numeric_limits<int>::max();
  int largest = std::numeric_limits<int>::min();
  for (const Row& row : rows) {
    const auto* value = std::get_if<double>(&row[i]);
    if (value == nullptr || !std::isfinite(*value) || *value == 0) continue;
    smallest = std::min(smallest, exponent_of(*value));
    largest = std::max(largest, exponent_of(*value));
  }
  if (largest - smallest > kSimilar) return std::nullopt;
  const int decimals = std::max(0, 3 - smallest);  // four significant digits of the smallest
  return decimals <= kLongest ? std::optional(decimals) : std::nullopt;
}

std::string html_cell(const Cell& cell, std::optional<int> decimals) {
  if (const auto* text = std::get_if<std::string>(&cell)) return "<td>" + escaped(*text) + "</td>";
  if (const auto* link = std::get_if<Link>(&cell))
    return R"(<td><a href=")" + escaped(link->path) + R"(">)" + escaped(link->text) + "</a></td>";
  const double value = std::get<double>(cell) + 0.0;  // -0 becomes 0
  if (!std::isfinite(value)) return R"(<td class="number">–</td>)";
  return R"(<td class="number">)" + (decimals ? fixed(value, *decimals) : four_digits(value)) + "</td>";
}

/// "Made 2026-11-27 02:14:09 UTC on HOST by youbot-hal 0.2.0 (1756d18)"
std::string made() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  std::array<char, 64> date{};
  std::strftime(date.data(), date.size(), "%Y-%m-%d %H:%M:%S UTC", &utc);
  std::array<char, 256> host{};
  if (gethostname(host.data(), host.size() - 1) != 0) host.front() = '?';
  return std::string("Made ") + date.data() + " on " + host.data() + " by youbot-hal " +
         runtime::build_version();
}

}  // namespace

Page::Page(std::string title) : title_(std::move(title)), made_(made()) {}

void Page::heading(std::string_view text) {
  const std::string id = "section-" + std::to_string(++headings_);
  body_ += "<h2 id=\"" + id + "\">" + escaped(text) + "</h2>\n";
  contents_ += "<li><a href=\"#" + id + "\">" + escaped(text) + "</a></li>\n";
}

void Page::text(std::string_view text) {
  while (!text.empty()) {
    const auto end = std::min(text.find("\n\n"), text.size());
    if (end > 0) body_ += "<p>" + escaped(text.substr(0, end)) + "</p>\n";
    text.remove_prefix(std::min(text.size(), end + 2));
  }
}

void Page::table(const std::vector<Column>& columns, const std::vector<Row>& rows, std::string_view caption) {
  for (const Row& row : rows)
    require(row.size() == columns.size(), "a table row of " + std::to_string(row.size()) + " cells under " +
                                              std::to_string(columns.size()) + " columns");
  std::string head;
  std::vector<std::optional<int>> decimals;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const auto is_number = [i](const Row& row) { return std::holds_alternative<double>(row[i]); };
    const bool numbers = std::ranges::any_of(rows, is_number);
    decimals.push_back(decimals_of(columns[i], rows, i));
    head += std::string(R"(<th scope="col")") + (numbers ? R"( class="number")" : "") + ">" +
            with_unit(columns[i].name, columns[i].unit) + "</th>";
  }
  // The box scrolls if the window is narrower than the table; it takes the focus so that keys can scroll it.
  // The caption keeps the width of the window by being inside a box that stays.
  body_ += R"(<div class="table" tabindex="0" role="region" aria-label=")" +
           (caption.empty() ? "Table" : escaped(caption)) + "\"><table>\n";
  if (!caption.empty()) body_ += "<caption><span>" + escaped(caption) + "</span></caption>\n";
  body_ += "<thead><tr>" + head + "</tr></thead>\n<tbody>\n";
  for (const Row& row : rows) {
    body_ += "<tr>";
    for (std::size_t i = 0; i < row.size(); ++i) body_ += html_cell(row[i], decimals[i]);
    body_ += "</tr>\n";
  }
  body_ += "</tbody></table></div>\n";
}

void Page::plots(const std::vector<Plot>& plots) {
  for (const Plot& plot : plots) check(plot);
  body_ += "<div class=\"grid\">\n";
  for (const Plot& plot : plots) {
    std::string series;
    std::string thinned;
    for (const Series& one : plot.series) {
      const Drawn result = drawn(one, plot);
      series += (series.empty() ? "" : ",\n") + result.json;
      thinned += result.thinned;
    }
    body_ += "<figure class=\"plot\">\n<figcaption>" + escaped(plot.title) + "</figcaption>\n";
    if (!plot.note.empty()) body_ += "<p>" + escaped(plot.note) + "</p>\n";
    body_ += R"(<script type="application/json">{"title":)" + json(plot.title) + R"(,"x":)" + json(plot.x) +
             R"(,"y":)" + json(plot.y) + R"(,"equal":)" + (plot.equal_axes ? "true" : "false") +
             R"(,"spans":)" + json(plot.spans) + R"(,"series":[)" + series + "]}</script>\n";
    if (!thinned.empty())
      body_ += R"(<p class="thinned">)" + escaped(thinned) + "Zooming in shows no more of them.</p>\n";
    body_ += "</figure>\n";
  }
  body_ += "</div>\n";
}

std::string Page::html() const {
  std::string page = R"(<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<link rel="icon" href="data:,">
)";
  page += "<title>" + escaped(title_) + "</title>\n<style>\n";
  page += kDygraphsStyle;
  page += kPageStyle;
  page += "</style>\n</head>\n<body>\n<main>\n<header>\n<h1>" + escaped(title_) + "</h1>\n<p>" +
          escaped(made_) + "</p>\n</header>\n";
  if (headings_ > 1) page += "<nav aria-label=\"Contents\"><ul>\n" + contents_ + "</ul></nav>\n";
  page += body_;
  page += "<noscript><p>The plots, and the tables of their data, need JavaScript.</p></noscript>\n</main>\n";
  page += "<script>/*\n";
  page += kDygraphsLicense;
  page += "\n*/\n";
  page += kDygraphsScript;
  page += "</script>\n<script>\n";
  page += kPageScript;
  page += "</script>\n</body>\n</html>\n";
  return page;
}

void Page::write(const std::filesystem::path& path) const { runtime::write_whole_file(path, html()); }

}  // namespace report
