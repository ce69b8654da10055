/// @file
/// A self-contained HTML page with text, tables and zoomable plots.
#pragma once
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace report {

enum class Style { kLine, kDashed, kPoints, kLineAndPoints };

/// One name in the legend. The points are joined in their order, so x may go back and forth (a loop);
/// non-finite values are gaps. If y is empty, only lower and upper are drawn, as an area.
struct Series {
  std::string name;
  std::vector<double> x;
  std::vector<double> y;
  Style style = Style::kLine;
  /// Both or neither: a band along a line, error bars on points.
  std::vector<double> lower{};
  std::vector<double> upper{};
  /// Series with the same number share colour and marker, such as the points of a wheel and its curve;
  /// default: by their order in the plot.
  std::optional<unsigned> look{};
};

struct Axis {
  std::string label;
  std::string unit{};            ///< as read, "rad/s"; empty without one
  bool log = false;              ///< values that are not positive are left out
  std::optional<double> from{};  ///< default: from the data
  std::optional<double> to{};
  /// Plots whose x axes name the same link have the same range, zoom together and show the same x. Empty:
  /// on its own.
  std::string link{};
};

/// A stretch of x, shaded, with its name; a line if it is one point.
struct Span {
  std::string name;
  double from = 0.0;
  double to = 0.0;
};

struct Plot {
  std::string title;
  Axis x;
  Axis y;
  std::vector<Series> series;
  std::string note{};         ///< explanation, one or two sentences
  bool equal_axes = false;    ///< a metre is as long in x as in y; neither axis may be logarithmic
  std::vector<Span> spans{};  ///< in the order of x
};

struct Column {
  std::string name;
  std::string unit{};
  /// Default: none if all numbers of the column are whole. Otherwise the same for the column, if its numbers
  /// are of similar size; if they differ by more than a factor of a thousand, four significant digits each.
  std::optional<int> decimals{};
};
/// To a file beside the page; `path` is relative to it.
struct Link {
  std::string text;
  std::string path;
};
/// Numbers are right-aligned; non-finite ones are shown as a dash.
using Cell = std::variant<std::string, double, Link>;
using Row = std::vector<Cell>;

/// Written from top to bottom:
///
///     report::Page page("Friction of wheel-1");
///     page.text("Steady-state torque in both directions.");
///     page.table({{"parameter"}, {"value"}, {"unit"}}, {{"viscous", 0.0125, "N·m·s/rad"}});
///     page.plot({.title = "Friction curve",
///                .x = {"velocity", "rad/s"},
///                .y = {"torque", "N·m"},
///                .series = {{"measured", velocity, torque, report::Style::kPoints},
///                           {.name = "fitted", .x = v, .y = t, .lower = low, .upper = high}}});
///     page.write("report.html");
///
/// Below the title it has the date, the host and the version of the software; of several headings, a list of
/// contents. Everything given is text, not HTML. The file loads nothing from elsewhere and follows the
/// reader's light or dark setting. Numbers are stored with nine digits; a series of more than a few thousand
/// points is thinned out to what a screen can show, and the page says so.
class Page {
 public:
  explicit Page(std::string title);

  void heading(std::string_view text);
  /// A paragraph. An empty line in it starts a new one.
  void text(std::string_view text);

  /// @throws std::invalid_argument if a row is not as wide as the columns.
  void table(const std::vector<Column>& columns, const std::vector<Row>& rows, std::string_view caption = {});

  /// @throws std::invalid_argument naming plot and series if their lengths differ, there is nothing to draw
  ///         with, or an axis ends before it begins.
  void plot(const Plot& plot) { plots({plot}); }
  /// Side by side where the window is wide enough.
  void plots(const std::vector<Plot>& plots);

  /// Setup: writes the page; an older one of that name is replaced only by a complete new one.
  /// @throws hal::SetupError naming path and cause.
  void write(const std::filesystem::path& path) const;
  std::string html() const;

 private:
  std::string title_;
  std::string made_;  // when, where and with what
  std::string contents_;
  std::size_t headings_ = 0;
  std::string body_;
};

}  // namespace report
