// Harmonics of position-dependent torque: known answers, and cogging maps of a measured motor.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "identification/fit/harmonic_fit.h"
#include "tests/support/built_paths.h"
#include "tests/support/measured_data.h"

namespace identify_harmonic_test {

using identification::fit::fit_harmonics;
using identification::fit::HarmonicFit;
using identification::fit::PositionMap;

PositionMap synthetic(std::size_t points, double noise, unsigned seed, double amplitude = 1) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, noise);
  PositionMap map;
  for (std::size_t i = 0; i < points; ++i) {
    const double angle = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(points);
    map.position_rad.push_back(angle);
    map.value.push_back(0.2 + amplitude * (0.8 * std::sin(7 * angle + 0.3) + 0.3 * std::cos(12 * angle)) +
                        (noise > 0 ? normal(random) : 0));
  }
  return map;
}

/// README of the data: 8192 counts a turn.
PositionMap cogging_map(const std::string& name) {
  PositionMap map;
  for (const auto& row :
       test_support::csv_rows(support::source_dir() + "/tests/data/odrive_cogging/cogging_maps.csv")) {
    if (row[0] != name) continue;
    map.position_rad.push_back(std::stod(row[1]) * 2 * std::numbers::pi / 8192);
    map.value.push_back(std::stod(row[2]));
  }
  return map;
}

TEST(IdentifyHarmonics, FindsWhatIsThereAndNothingElse) {
  const HarmonicFit fit = fit_harmonics(synthetic(512, 0.02, 1));
  ASSERT_EQ(fit.harmonics.size(), 2u);
  EXPECT_EQ(fit.harmonics[0].per_turn, 7);
  EXPECT_NEAR(fit.harmonics[0].amplitude(), 0.8, 0.01);
  EXPECT_EQ(fit.harmonics[1].per_turn, 12);
  EXPECT_NEAR(fit.harmonics[1].amplitude(), 0.3, 0.01);
  EXPECT_NEAR(fit.mean, 0.2, 0.01);
  EXPECT_NEAR(fit.at(1.0), 0.2 + 0.8 * std::sin(7.3) + 0.3 * std::cos(12.0), 0.02);
}

TEST(IdentifyHarmonics, IntervalsOfAmplitudesHoldTheTruth) {
  int covered = 0;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    const auto harmonic =
        fit_harmonics(synthetic(256, 0.1, seed), {.highest_per_turn = 20, .harmonics = 2}).harmonics[0];
    covered += std::abs(harmonic.amplitude() - 0.8) <= harmonic.amplitude_ci95 ? 1 : 0;
  }
  EXPECT_GE(covered, 178);
  EXPECT_LE(covered, 198);
}

TEST(IdentifyHarmonics, FindsNothingInNoise) {
  int found = 0;
  for (unsigned seed = 1; seed <= 20; ++seed)
    found += fit_harmonics(synthetic(512, 1, seed, 0), {.highest_per_turn = 50}).harmonics.empty() ? 0 : 1;
  EXPECT_LE(found, 2);
}

TEST(IdentifyHarmonics, SaysThatPartOfATurnIsNotEnough) {
  PositionMap map = synthetic(512, 0.02, 1);
  map.position_rad.resize(300);
  map.value.resize(300);
  const HarmonicFit fit = fit_harmonics(map);
  EXPECT_TRUE(fit.harmonics.empty());
  EXPECT_EQ(fit.verdicts.size(), 1u);
}

TEST(IdentifyHarmonics, RefusesWhatIsNoMap) {
  EXPECT_THROW(fit_harmonics(synthetic(15, 0, 1)), std::invalid_argument);
  PositionMap map = synthetic(64, 0, 1);
  map.value.pop_back();
  EXPECT_THROW(fit_harmonics(map), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(fit_harmonics(synthetic(64, 0, 1)).r_squared_on({})), std::invalid_argument);
}

// Peers, README of the data: 2, 4, 8, 16 harmonics of a_16 on b_16 give R2 0.77, 0.92, 0.989, 0.995.
TEST(IdentifyHarmonicsOnMeasuredMotor, ReachThePeersOnAnotherMap) {
  const PositionMap a = cogging_map("a_16");
  const PositionMap b = cogging_map("b_16");
  ASSERT_EQ(a.value.size(), 512u);
  EXPECT_GE(fit_harmonics(a, {.harmonics = 4}).r_squared_on(b), 0.915);
  EXPECT_GE(fit_harmonics(a, {.harmonics = 8}).r_squared_on(b), 0.989);
  const HarmonicFit chosen = fit_harmonics(a);
  EXPECT_GE(chosen.r_squared_on(b), 0.99);
  EXPECT_EQ(chosen.harmonics[0].per_turn, 7);
  EXPECT_EQ(chosen.harmonics[1].per_turn, 28);
}

}  // namespace identify_harmonic_test
