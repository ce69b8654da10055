/// Which part of very long recordings is analysed, and that the result equals that of all data.
#include "identification/gap/excerpts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace identification::gap {
namespace gap_excerpts_test {

constexpr double kPeriod_s = 1e-3;
constexpr Band kBand{.cutoff_Hz = 25, .raw_period_s = kPeriod_s};
constexpr Enough kEnough{.rows = 60'000, .samples = 30'000};

/// To and fro within a radian, and its inertia, friction and noise.
Source swinging(const std::string& name, double seconds, double period_s = kPeriod_s) {
  Source source{.name = name, .recording = {}};
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0, 1e-3);
  std::vector<double> time, torque, position;
  for (double t = 0; t < seconds; t += period_s) {
    time.push_back(t);
    position.push_back(std::sin(2 * t));
    torque.push_back(-0.01 * 4 * std::sin(2 * t) + std::copysign(0.05, std::cos(2 * t)) + noise(random));
  }
  source.recording.columns = {{"time_s", time}, {"torque_measured_Nm", torque}, {"position_rad", position}};
  return source;
}
std::vector<double>& values(Source& source, const std::string& name) {
  return std::ranges::find(source.recording.columns, name, &Recording::Column::name)->values;
}
bool never(std::size_t, double) { return false; }
bool always(std::size_t, double) { return true; }

std::size_t rows_in(const std::vector<Excerpt>& excerpts) {
  std::size_t rows = 0;
  for (const Excerpt& excerpt : excerpts) rows += excerpt.to - excerpt.from;
  return rows;
}
bool holds(const std::vector<Excerpt>& excerpts, std::size_t row) {
  return std::ranges::any_of(excerpts, [&](const Excerpt& e) { return e.from <= row && row < e.to; });
}

TEST(Excerpts, WhatIsNotTooLongIsAnalysedAsAWhole) {
  const std::vector<Source> sources{swinging("a", 40), swinging("b", 19)};
  const std::vector<Excerpt> excerpts = chosen_excerpts(sources, kBand, never, kEnough);
  ASSERT_EQ(excerpts.size(), 2u);
  EXPECT_EQ(rows_in(excerpts), sources[0].recording.rows() + sources[1].recording.rows());
  EXPECT_TRUE(left_out(sources, excerpts).empty());
}

TEST(Excerpts, AreSpreadOverAllRecordingsAndTheirTime) {
  // The second has a fifth of the rate: as much time of it, in fewer rows.
  const std::vector<Source> sources{swinging("a", 200), swinging("b", 200, 5 * kPeriod_s),
                                    swinging("c", 100)};
  const std::vector<Excerpt> excerpts = chosen_excerpts(sources, kBand, never, kEnough);
  EXPECT_LE(rows_in(excerpts), 66'000u);
  EXPECT_GE(rows_in(excerpts), 35'000u);
  for (std::size_t s = 0; s < sources.size(); ++s) {
    const auto time_s = sources[s].recording.column("time_s");
    double until_s = 0;
    double longest_s = 0;
    for (const Excerpt& excerpt : excerpts) {
      if (excerpt.source != s) continue;
      longest_s = std::max(longest_s, time_s[excerpt.from] - until_s);
      until_s = time_s[excerpt.to - 1];
    }
    longest_s = std::max(longest_s, time_s.back() - until_s);
    EXPECT_LT(longest_s, 60) << sources[s].name;
  }
  const std::vector<Diagnosis> said = left_out(sources, excerpts);
  ASSERT_EQ(said.size(), 1u);
  EXPECT_NE(said[0].done.find(std::to_string(rows_in(excerpts)) + " rows"), std::string::npos)
      << said[0].done;
}

TEST(Excerpts, HoldAPositionThatIsVisitedOnce) {
  for (const double at_s : {123.0, 277.0, 501.0}) {
    Source source = swinging("a", 600);
    const auto at = static_cast<std::size_t>(at_s / kPeriod_s);
    for (std::size_t i = 0; i < 1000; ++i)
      values(source, "position_rad")[at + i] +=
          2 * std::pow(std::sin(std::numbers::pi * static_cast<double>(i) / 1000), 2);
    EXPECT_TRUE(holds(chosen_excerpts(std::vector{source}, kBand, never, kEnough), at + 500)) << at_s;
  }
}

TEST(Excerpts, HoldAPushOfHalfASecond) {
  for (const double at_s : {123.0, 277.0, 501.0}) {
    Source source = swinging("a", 600);
    const auto at = static_cast<std::size_t>(at_s / kPeriod_s);
    for (std::size_t i = 0; i < 500; ++i) values(source, "torque_measured_Nm")[at + i] += 0.3;
    EXPECT_TRUE(holds(chosen_excerpts(std::vector{source}, kBand, never, kEnough), at + 250)) << at_s;
  }
}

// Else the gap would be measured where the motion is unusual.
TEST(Excerpts, ToJudgeWithDoNotDependOnWhatIsInThem) {
  Source source = swinging("a", 600);
  const std::vector<Excerpt> before = chosen_excerpts(std::vector{source}, kBand, always, kEnough);
  std::mt19937_64 random(2);
  std::ranges::shuffle(values(source, "torque_measured_Nm"), random);
  for (double& position : values(source, "position_rad")) position = std::abs(position);
  const std::vector<Excerpt> after = chosen_excerpts(std::vector{source}, kBand, always, kEnough);
  ASSERT_EQ(before.size(), after.size());
  for (std::size_t i = 0; i < before.size(); ++i) EXPECT_EQ(before[i].from, after[i].from);
}

// Whole recordings, or quarters of them, as short as an excerpt: each held-out row belongs to an excerpt that
// was selected by its number, not by its content.
TEST(Excerpts, OfShortRecordingsJudgeByTheirNumberToo) {
  const auto is_set_aside = [](std::size_t, double share) { return share >= 0.65 && share < 0.85; };
  for (const double seconds : {5.0, 16.0}) {
    SCOPED_TRACE(seconds);
    std::vector<Source> sources;
    for (int i = 0; i < 60; ++i) sources.push_back(swinging("a", seconds));
    const auto judging = [&] {
      std::vector<std::pair<std::size_t, std::size_t>> found;
      for (const Excerpt& excerpt : chosen_excerpts(sources, kBand, is_set_aside, kEnough)) {
        const auto rows = static_cast<double>(sources[excerpt.source].recording.rows());
        if (static_cast<double>(excerpt.to) > 0.65 * rows && static_cast<double>(excerpt.from) < 0.85 * rows)
          found.emplace_back(excerpt.source, excerpt.from);
      }
      return found;
    };
    const auto before = judging();
    ASSERT_FALSE(before.empty());
    for (std::size_t s = 0; s < sources.size(); s += 7) {
      std::vector<double>& position = values(sources[s], "position_rad");
      for (std::size_t i = position.size() * 7 / 10; i < position.size() * 8 / 10; ++i) position[i] += 5;
    }
    EXPECT_EQ(judging(), before);
  }
}

// A load that comes back every 20 s, of which every fifth excerpt of 4 s would see always the same part.
TEST(Excerpts, ToJudgeWithSeeAsMuchOfACycleAsThereIs) {
  constexpr double kCycle_s = 20;
  const Source source = swinging("a", 2000);
  const std::vector<Excerpt> excerpts =
      chosen_excerpts(std::vector{source}, kBand, always, {.rows = 400'000, .samples = 200'000});
  std::vector<double> rows(5, 0);
  for (const Excerpt& excerpt : excerpts)
    for (std::size_t i = excerpt.from; i < excerpt.to; ++i) {
      const double time_s = static_cast<double>(i) * kPeriod_s;
      rows[static_cast<std::size_t>(std::fmod(time_s, kCycle_s) / kCycle_s * 5)] += 1;
    }
  const double even = static_cast<double>(rows_in(excerpts)) / 5;
  for (const double part : rows) EXPECT_NEAR(part, even, 0.25 * even);
}

TEST(Excerpts, KeepTheTimeOfTheirRecording) {
  const std::vector<Source> sources{swinging("a", 300)};
  const std::vector<Excerpt> excerpts = chosen_excerpts(sources, kBand, never, kEnough);
  const std::vector<Signals> signals = signals_of(sources, excerpts, kBand);
  ASSERT_EQ(signals.size(), excerpts.size());
  for (std::size_t i = 0; i < signals.size(); ++i) {
    EXPECT_NEAR(signals[i].running_s.front(), static_cast<double>(excerpts[i].from) * kPeriod_s, 1e-6);
    EXPECT_NEAR(signals[i].recorded_to_s, 300, 0.01);
    EXPECT_EQ(signals[i].name, "a");
  }
  EXPECT_NEAR(widest_span_rad(signals), 2, 0.01);
}

}  // namespace gap_excerpts_test
}  // namespace identification::gap
