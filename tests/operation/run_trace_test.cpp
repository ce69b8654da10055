// What the page of a run keeps of it.
#include "operation/run_trace.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "operation/run_page.h"

namespace operation {
namespace run_trace_test {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

TEST(TimeTrace, KeepsEveryPeakAtItsTimeHoweverLongTheRun) {
  TimeTrace trace(2);
  constexpr int kSamples = 3'000'000;  // 50 minutes
  for (int i = 0; i < kSamples; ++i)
    trace.add(0.001 * i, std::array{i == 1'234'567 ? 7.5 : std::sin(0.01 * i), i == 2'000'001 ? -3.0 : 0.0});
  const report::Series wave = trace.series("wave", 0, 3);
  EXPECT_LE(wave.x.size(), 2000U);
  ASSERT_TRUE(std::ranges::is_sorted(wave.x));
  const auto peak = static_cast<std::size_t>(std::ranges::max_element(wave.y) - wave.y.begin());
  EXPECT_EQ(wave.y[peak], 7.5);
  EXPECT_EQ(wave.x[peak], 1234.567);
  const report::Series flat = trace.series("flat", 1, 3);
  EXPECT_LT(flat.x.size(), 10U) << "a constant needs few points";
  const auto dip = static_cast<std::size_t>(std::ranges::min_element(flat.y) - flat.y.begin());
  EXPECT_EQ(flat.y[dip], -3.0);
  EXPECT_EQ(flat.x[dip], 2000.001);
}

TEST(TimeTrace, AShortRunIsThereWhole) {
  TimeTrace trace(1);
  for (const double y : {1.0, 2.0, 4.0}) trace.add(0.5 * y, std::array{y});
  const report::Series series = trace.series("", 0, 2, 1000, report::Style::kDashed);
  EXPECT_EQ(series.x, (std::vector<double>{0.5, 1.0, 2.0}));
  EXPECT_EQ(series.y, (std::vector<double>{1000, 2000, 4000}));
  EXPECT_EQ(series.style, report::Style::kDashed);
}

TEST(TimeTrace, WhatIsNotKnownIsAGap) {
  TimeTrace trace(1);
  for (const double y : {1.0, kNone, std::numeric_limits<double>::infinity(), 2.0})
    trace.add(y, std::array{y});
  const report::Series series = trace.series("", 0, 2);
  EXPECT_EQ(series.y.front(), 1.0);
  EXPECT_TRUE(std::isnan(series.y[1]));
  EXPECT_EQ(series.y.back(), 2.0);
}

TEST(Track, ALongPathIsClosedByFewPointsNearIt) {
  Track track;
  for (int i = 0; i <= 2'000'000; ++i) {
    const double angle = 2 * std::numbers::pi * i / 100'000;  // twenty rounds
    track.add({std::cos(angle), std::sin(angle), 0.25});
  }
  const report::Series above = track.series("", 1, report::Style::kLine);
  EXPECT_LE(above.x.size(), 3000U);
  for (std::size_t i = 0; i < above.x.size(); ++i) {
    ASSERT_NEAR(std::hypot(above.x[i], above.y[i]), 1, 2e-5);
    // A chord of 0.2 m leaves the circle by 5 mm.
    if (i == 0) continue;
    ASSERT_LT(std::hypot(above.x[i] - above.x[i - 1], above.y[i] - above.y[i - 1]), 0.2);
  }
  EXPECT_EQ(above.x.back(), 1);
  for (const double z : track.series("", 2, report::Style::kLine).y) EXPECT_EQ(z, 0.25);
}

TEST(Track, RestAddsNothingAndGapsAreBounded) {
  Track track;
  for (int i = 0; i < 100'000; ++i) track.add({1, 2, 3});
  EXPECT_LE(track.series("", 1, report::Style::kLine).x.size(), 2U);
  Track torn;
  for (int i = 0; i < 100'000; ++i)
    torn.add(i % 2 == 0 ? Eigen::Vector3d(i, 0, 0) : Eigen::Vector3d(kNone, 0, 0));
  EXPECT_LE(torn.series("", 1, report::Style::kLine).x.size(), 3001U);
  Track unknown;
  unknown.add({kNone, kNone, 0});
  EXPECT_TRUE(unknown.empty());
}

TEST(RunPage, CountsTimesAndTheLongestStretchOfALimit) {
  Occurrences touched;
  double time_s = 0;
  for (const bool holds : {false, true, true, false, true, true, true, false})
    touched.add(time_s += 1, holds);
  EXPECT_EQ(touched.cycles(), 5U);
  EXPECT_EQ(touched.times(), 2U);
  EXPECT_EQ(touched.longest(), 3U);
  EXPECT_EQ(touched.first_s(), 2);
}

TEST(RunPage, TheLastOf200PhasesContainsTheRest) {
  RunPage page(std::chrono::milliseconds(1), {});
  for (int i = 0; i < 1000; ++i)
    page.add(std::chrono::milliseconds(i), i % 2 == 0 ? "operating" : "let go", 0, {}, {});
  const std::vector<report::Span> spans = page.spans({});
  ASSERT_EQ(spans.size(), 200U);
  EXPECT_EQ(spans.back().from, 0.199);
  EXPECT_EQ(spans.back().to, 0.999);
}

TEST(RunPage, PhasesMeetAndTheFaultIsALine) {
  RunPage page(std::chrono::milliseconds(1), {});
  for (int i = 0; i < 100; ++i)
    page.add(std::chrono::milliseconds(i), i < 40 ? "starting" : "running", 0, {}, {});
  RunSummary summary;
  EXPECT_EQ(page.spans(summary).size(), 2U);
  summary.stop_reason = "wheel-1 blocked";
  summary.stop_time = std::chrono::milliseconds(90);
  const std::vector<report::Span> spans = page.spans(summary);
  ASSERT_EQ(spans.size(), 3U);
  EXPECT_EQ(spans[0].to, 0.04);
  EXPECT_EQ(spans[1].from, 0.04);
  EXPECT_EQ(spans[1].to, 0.099);
  EXPECT_EQ(spans[2].from, 0.09);
  EXPECT_EQ(spans[2].to, 0.09);
}

}  // namespace run_trace_test
}  // namespace operation
