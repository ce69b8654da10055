// Report pages: content of the file. tests/browser checks what a reader sees.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <random>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "hal/setup_error.h"
#include "report/decimate.h"
#include "report/report.h"
#include "runtime/program/build_info.h"
#include "tests/support/temporary_directory.h"

namespace report_test {

using report::Page;
using report::Plot;
using report::Points;
using report::Style;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

std::string read(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// The error message of the work; empty without an error.
template <typename Exception, typename Work>
std::string complaint(Work work) {
  try {
    work();
  } catch (const Exception& error) {
    return error.what();
  }
  return "";
}

Plot plot_of(std::vector<report::Series> series) {
  return {.title = "P", .x = {"x", "s"}, .y = {"y", "N"}, .series = std::move(series)};
}

TEST(Report, EscapesEveryTextItIsGiven) {
  const std::string bad = "<i>\"&'";
  Page page(bad);
  page.heading(bad);
  page.text(bad);
  page.table({{bad, bad}}, {{bad}}, bad);
  Plot plot{.title = bad, .x = {bad, bad}, .y = {bad, bad}, .series = {{bad, {1}, {2}}}, .note = bad};
  page.plot(plot);
  const std::string html = page.html();
  EXPECT_FALSE(has(html, "<i>"));
  EXPECT_TRUE(has(html, R"(<h2 id="section-1">&lt;i&gt;&quot;&amp;&#39;</h2>)"));
  EXPECT_TRUE(has(html, R"("title":"\u003ci>\"&'")"));
}

TEST(Report, LoadsNothingFromElsewhere) {
  Page page("P");
  page.plot(plot_of({{"", {1, 2}, {3, 4}}}));
  const std::string html = page.html();
  EXPECT_TRUE(has(html, "default-src 'none'"));
  for (const char* loader : {" src=", "<link rel=\"stylesheet", "@import", "url("})
    EXPECT_FALSE(has(html, loader)) << loader;
  EXPECT_TRUE(has(html, "Permission is hereby granted"));  // the licence of dygraphs asks for it
  EXPECT_LT(html.size(), 200'000U);                        // dygraphs takes 131 kB
}

TEST(Report, ParagraphsArePartedByEmptyLines) {
  Page page("P");
  page.text("one\n\ntwo\nstill two");
  EXPECT_TRUE(has(page.html(), "<p>one</p>\n<p>two\nstill two</p>"));
}

TEST(Report, TableNumbersHaveTheColumnsDecimalsOrFourDigits) {
  Page page("P");
  page.table({{"given", "N·m", 2}, {"four"}, {"whole"}, {"text"}},
             {{1.005e-1, 0.0125, 12345.0, "left"}, {kNaN, 2.0e-7, -3.0, "x"}, {-1.0, 123456.7, 0.0, "y"}});
  const std::string html = page.html();
  EXPECT_TRUE(has(html, R"(<th scope="col" class="number">given <span class="unit">(N·m)</span></th>)"));
  for (const char* cell :
       {">0.10<", ">–<", ">-1.00<", ">0.01250<", ">2.000e-07<", ">123457<", ">12345<", ">-3<", ">0<"})
    EXPECT_TRUE(has(html, std::string(R"(<td class="number")") + cell)) << cell;
  EXPECT_TRUE(has(html, "<td>left</td>"));
}

TEST(Report, NumbersOfSimilarSizeHaveTheSameDecimalsInAColumn) {
  Page page("P");
  page.table({{"speed"}, {"rounds up"}, {"tiny"}},
             {{0.05023, -9.9999, 0.0007396}, {-4.001, 1.5, 0.0004337}, {9.9996, 0.0, 0.0}});
  const std::string html = page.html();
  for (const char* cell : {">0.05023<", ">-4.001<", ">10.00<", ">-10.000<", ">1.500<", ">0.000<",
                           ">0.0007396<", ">0.0004337<", ">0.0000000<"})
    EXPECT_TRUE(has(html, std::string(R"(<td class="number")") + cell)) << cell;
}

TEST(Report, SaysWhenWhereAndByWhichVersionItWasMade) {
  std::array<char, 256> host{};
  ASSERT_EQ(gethostname(host.data(), host.size() - 1), 0);
  EXPECT_TRUE(has(Page("P").html(),
                  std::string(" UTC on ") + host.data() + " by youbot-hal " + runtime::build_version()));
}

TEST(Report, SeveralHeadingsMakeContents) {
  Page page("P");
  page.heading("one & only");
  EXPECT_FALSE(has(page.html(), "<nav"));
  page.heading("two");
  EXPECT_TRUE(has(page.html(), R"(<li><a href="#section-1">one &amp; only</a></li>)"));
  EXPECT_TRUE(has(page.html(), R"(<li><a href="#section-2">two</a></li>)"));
  EXPECT_TRUE(has(page.html(), R"(<h2 id="section-2">two</h2>)"));
}

TEST(Report, LinksAreCellsAndEscaped) {
  Page page("P");
  page.table({{"file"}}, {{report::Link{"a<b", "a\"b.csv"}}});
  EXPECT_TRUE(has(page.html(), R"(<td><a href="a&quot;b.csv">a&lt;b</a></td>)"));
}

TEST(Report, RowsAsWideAsTheColumnsOnly) {
  Page page("P");
  EXPECT_THROW(page.table({{"a"}, {"b"}}, {{1.0, 2.0}, {1.0}}), std::invalid_argument);
}

TEST(Report, ValuesThatAreNotFiniteBecomeGaps) {
  Page page("P");
  page.plot(plot_of({{"s", {0, 1, 2}, {kNaN, kInfinity, -0.25}}}));
  EXPECT_TRUE(has(page.html(), R"("x":[0,1,2],"y":[null,null,-0.25],"lower":null,"upper":null)"));
}

TEST(Report, PlottedValuesHaveNineSignificantDigits) {
  std::mt19937 random(7);
  std::uniform_real_distribution<> mantissa(-10, 10);
  std::uniform_int_distribution<> exponent(-7, 10);
  std::vector<double> values{0,   -0.0,  1e-4,  9.99999999949e-4, 0.01, 0.1, 1, 9.9999999996, 99999999.96,
                             1e8, 1e300, 5e-324};
  for (int i = 0; i < 3000; ++i) values.push_back(mantissa(random) * std::pow(10.0, exponent(random)));
  std::string expected;
  for (const double value : values) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.9g", value);
    expected += (expected.empty() ? "" : ",") + std::string(text.data());
  }
  Page page("P");
  page.plot(plot_of({{.name = "s", .x = values, .y = values}}));
  EXPECT_TRUE(has(page.html(), R"("x":[)" + expected + "]"));
}

TEST(Report, RefusesWhatCannotBeDrawnAndNamesIt) {
  Page page("P");
  const auto refused = [&](const Plot& plot) {
    return complaint<std::invalid_argument>([&] { page.plot(plot); });
  };
  EXPECT_EQ(refused(plot_of({{"measured", {1, 2}, {1}}})),
            R"(report: plot "P", series "measured": 1 values for 2 of x)");
  EXPECT_TRUE(has(refused(plot_of({})), "no series"));
  EXPECT_TRUE(has(refused(plot_of({{.name = "s", .x = {1}, .y = {}}})), "neither y nor"));
  EXPECT_TRUE(has(refused(plot_of({{"s", {1}, {1}, Style::kLine, {0}, {}}})), "differ in length"));
  Plot reversed = plot_of({{"s", {1}, {1}}});
  reversed.x.from = 2;
  reversed.x.to = 1;
  EXPECT_TRUE(has(refused(reversed), R"(axis "x" ends before it begins)"));
  Plot log_from_zero = plot_of({{"s", {1}, {1}}});
  log_from_zero.y.log = true;
  log_from_zero.y.from = 0;
  EXPECT_TRUE(has(refused(log_from_zero), "positive"));
  Plot equal = plot_of({{"s", {1}, {1}}});
  equal.equal_axes = equal.x.log = true;
  EXPECT_TRUE(has(refused(equal), "equal axes cannot be logarithmic"));
  Plot marked = plot_of({{"s", {1}, {1}}});
  marked.spans = {{"late", 2, 1}};
  EXPECT_TRUE(has(refused(marked), R"(span "late" needs finite ends)"));
  EXPECT_FALSE(has(page.html(), "<figcaption>")) << "a refused plot leaves nothing behind";
}

TEST(Report, ASeriesWithoutPointsIsAllowed) {
  Page page("P");
  page.plot(plot_of({{"nothing was measured", {}, {}}}));
  EXPECT_TRUE(has(page.html(), R"("x":[],"y":[],"lower":null)"));
}

class ReportFile : public testing::Test {
 protected:
  support::TemporaryDirectory folder_;
};

TEST_F(ReportFile, ReplacesAnOlderPageAndLeavesNothingElse) {
  const auto path = folder_.write("report.html", "older");
  const Page page("newer");
  page.write(path);
  EXPECT_EQ(read(path), page.html());
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_.path()), {}), 1);
}

TEST_F(ReportFile, SaysWhichPathAndWhy) {
  const auto path = folder_ / "missing" / "report.html";
  EXPECT_EQ(complaint<hal::SetupError>([&] { Page("P").write(path); }),
            path.string() +
                ": cannot be created: No such file or directory: its folder must exist and be writable");
}

TEST_F(ReportFile, ReplacesNeitherFoldersNorDevices) {
  for (const std::filesystem::path& path : {folder_.path(), std::filesystem::path("/dev/null")})
    EXPECT_TRUE(has(complaint<hal::SetupError>([&] { Page("P").write(path); }), "not a regular file"))
        << path;
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

/// A line's points: y lies between lower and upper.
struct Line {
  std::vector<double> x;
  std::vector<double> y;
  Points points() const { return {x, y, y}; }
};

Line noise(std::size_t count) {
  Line line;
  for (std::size_t i = 0; i < count; ++i) {
    line.x.push_back(static_cast<double>(i));
    line.y.push_back(std::sin(static_cast<double>(i * i % 10'007)));
  }
  return line;
}

TEST(ReportDecimation, KeepsShortSeriesWhole) {
  const Line line = noise(report::kKeepAll);
  EXPECT_EQ(report::needed_for_line(line.points()).size(), line.x.size());
  EXPECT_EQ(report::needed_for_markers(line.points()).size(), line.x.size());
}

TEST(ReportDecimation, EveryColumnOfPixelsSpansWhatItDid) {
  const Line line = noise(300'000);
  const auto kept = report::needed_for_line(line.points());
  EXPECT_LE(kept.size(), 4U * report::kColumns);
  ASSERT_TRUE(std::ranges::is_sorted(kept));
  EXPECT_EQ(kept.front(), 0U);
  EXPECT_EQ(kept.back(), line.x.size() - 1);

  using Spans = std::map<std::size_t, std::pair<double, double>>;
  const auto widen = [&](Spans& spans, std::size_t i) {
    const std::size_t column = i * report::kColumns / (line.x.size() - 1);
    auto& span = spans.try_emplace(column, line.y[i], line.y[i]).first->second;
    span = {std::min(span.first, line.y[i]), std::max(span.second, line.y[i])};
  };
  Spans all, left;
  for (std::size_t i = 0; i < line.x.size(); ++i) widen(all, i);
  for (const std::size_t i : kept) widen(left, i);
  EXPECT_EQ(all, left);
}

TEST(ReportDecimation, KeepsGaps) {
  Line line = noise(100'000);
  for (std::size_t i = 40'000; i < 60'000; ++i) line.y[i] = kNaN;
  const auto kept = report::needed_for_line(line.points());
  EXPECT_EQ(std::ranges::count_if(kept, [&](std::size_t i) { return std::isnan(line.y[i]); }), 1);
  EXPECT_TRUE(std::ranges::binary_search(kept, 39'999U));
  EXPECT_TRUE(std::ranges::binary_search(kept, 60'000U));
}

TEST(ReportDecimation, KeepsBothBranchesOfALoopRunManyTimes) {
  Line loop;
  for (int i = 0; i < 1'000'000; ++i) {
    const double phase = 2 * std::numbers::pi * i / 1000;
    loop.x.push_back(std::cos(phase));
    loop.y.push_back(std::sin(phase));
  }
  const auto kept = report::needed_for_line(loop.points());
  EXPECT_LE(kept.size(), report::kKeepAtMost);
  double up = 0, down = 0, left = 0, right = 0;
  for (const std::size_t i : kept) {
    up = std::max(up, loop.y[i]);
    down = std::min(down, loop.y[i]);
    left = std::min(left, loop.x[i]);
    right = std::max(right, loop.x[i]);
  }
  for (const double reach : {up, -down, -left, right}) EXPECT_NEAR(reach, 1, 1e-4);
}

TEST(ReportDecimation, LeavesOutOnlyMarkersThatOthersCover) {
  const Line line = noise(500'000);
  const auto kept = report::needed_for_markers(line.points());
  EXPECT_LE(kept.size(), report::kKeepAtMost);
  // Still one in every cell of a grid as coarse as markers are large, where there was one.
  const auto cells_of = [&](const auto& indices) {
    std::vector<bool> taken(50 * 50);
    for (const std::size_t i : indices) {
      const auto column = std::min(49, static_cast<int>(line.x[i] / static_cast<double>(line.x.size()) * 50));
      const auto row = std::min(49, static_cast<int>((line.y[i] + 1) / 2 * 50));
      taken[static_cast<std::size_t>(50 * row + column)] = true;
    }
    return std::ranges::count(taken, true);
  };
  std::vector<std::size_t> all(line.x.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  EXPECT_EQ(cells_of(kept), cells_of(all));
}

TEST(ReportDecimation, CopesWithSeriesWithoutExtent) {
  const std::size_t count = 10'000;
  const Line still{std::vector<double>(count, 1), std::vector<double>(count, 2)};
  EXPECT_LE(report::needed_for_line(still.points()).size(), 4U);
  EXPECT_EQ(report::needed_for_markers(still.points()).size(), 1U);
  const Line nothing{std::vector<double>(count, kNaN), std::vector<double>(count, kNaN)};
  EXPECT_LE(report::needed_for_line(nothing.points()).size(), 1U);
  EXPECT_TRUE(report::needed_for_markers(nothing.points()).empty());
  Line vast = noise(count);
  const double largest = std::numeric_limits<double>::max();
  std::tie(vast.x.front(), vast.x.back(), vast.y[5], vast.y[6]) =
      std::tuple(-largest, largest, -largest, largest);
  EXPECT_GE(report::needed_for_line(vast.points()).size(), 4U);
  EXPECT_GE(report::needed_for_markers(vast.points()).size(), 4U);
}

TEST(ReportDecimation, OnLogarithmicAxesColumnsAreEqualRatios) {
  std::vector<double> x;
  for (int i = 0; i < 100'000; ++i) x.push_back(std::pow(10, 6.0 * i / 100'000));
  x.front() = -1;  // has no place there
  const auto kept = report::needed_for_line({x, x, x, true, true});
  // In the first decade, a sixth of the axis but a millionth of the range.
  EXPECT_GT(std::ranges::count_if(kept, [&](std::size_t i) { return x[i] > 0 && x[i] < 10; }),
            report::kColumns / 6);
}

}  // namespace report_test
