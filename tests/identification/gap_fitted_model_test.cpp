/// Fits of a drive model to recordings, and their intervals.
#include "identification/gap/fitted_model.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "sim/model_drive.h"

namespace identification::gap {
namespace gap_fitted_model_test {

constexpr double kGap_rad = 3e-3;

model::effects::DriveModel drive_with(double flank_Hz) {
  model::effects::DriveModel model{.name = "bench", .inertia_kg_m2 = 0.01};
  model.effects = {
      model::effects::make_effect("coulomb", {{"torque_Nm", 0.04}}),
      model::effects::make_effect("viscous", {{"coefficient_Nm_s_per_rad", 0.005}}),
      model::effects::make_effect(
          "backlash",
          {{"gap_rad", kGap_rad}, {"load_share", 0.35}, {"friction_ratio", 1.1}, {"flank_Hz", flank_Hz}})};
  return model;
}

/// Back and forth, without noise.
Source reversals(const model::effects::DriveModel& model) {
  constexpr double kPeriod_s = 1e-3;
  sim::ModelDrive drive(model, kPeriod_s, 40);
  std::vector<double> time, torque, position;
  for (int i = 0; i < 20000; ++i) {
    const double t = i * kPeriod_s;
    time.push_back(t);
    position.push_back(drive.position_rad());
    torque.push_back(0.09 * std::sin(9 * t) + 0.05 * std::sin(23 * t + 1));
    drive.step(torque.back());
  }
  // What is held from each sample to the next, at the sample.
  for (std::size_t i = torque.size(); i-- > 1;) torque[i] = 0.5 * (torque[i - 1] + torque[i]);
  Source source{.name = "reversals.csv", .recording = {}};
  source.recording.columns = {{"time_s", time}, {"torque_measured_Nm", torque}, {"position_rad", position}};
  return source;
}

// No fit finds the stiffness of the flanks, so the interval of the gap has to allow for it.
TEST(Estimates, TheIntervalOfAGapAllowsForFlanksOfAnotherStiffness) {
  const FittedModel start{.model = drive_with(150), .given_inertia_kg_m2 = 0.01};
  for (const double flank_Hz : {75.0, 110.0, 250.0, 300.0}) {
    const std::vector<Source> sources{reversals(drive_with(flank_Hz))};
    const std::vector<Signals> signals{make_signals(sources.front(), choose_band(sources, start.model))};
    const Rows rows(signals);
    std::vector<Eigen::Index> all(static_cast<std::size_t>(rows.count()));
    std::iota(all.begin(), all.end(), 0);
    const FittedModel fitted = refined(start, rows, all);
    bool is_there = false;
    for (const fit::Estimate& estimate : estimates(fitted, rows, all)) {
      ASSERT_NE(estimate.name, "flank_Hz");
      is_there = is_there || estimate.name == "gap_rad";
      if (estimate.name != "gap_rad") continue;
      EXPECT_LT(estimate.lower, kGap_rad) << flank_Hz;
      EXPECT_GT(estimate.upper, kGap_rad) << flank_Hz;
      EXPECT_LT(estimate.upper - estimate.lower, 0.3 * kGap_rad) << flank_Hz;
    }
    EXPECT_TRUE(is_there);
  }
}

TEST(Estimates, FlanksMayBeAsStiffAndAsSoftAsTheEffectKnows) {
  for (const double flank_Hz : {20.0, 2000.0}) {
    const FittedModel fitted{.model = drive_with(flank_Hz), .given_inertia_kg_m2 = 0.01};
    const std::vector<Source> sources{reversals(fitted.model)};
    const std::vector<Signals> signals{make_signals(sources.front(), choose_band(sources, fitted.model))};
    const Rows rows(signals);
    std::vector<Eigen::Index> all(static_cast<std::size_t>(rows.count()));
    std::iota(all.begin(), all.end(), 0);
    const std::vector<fit::Estimate> found = estimates(fitted, rows, all);
    const auto gap = std::ranges::find(found, "gap_rad", &fit::Estimate::name);
    ASSERT_NE(gap, found.end());
    EXPECT_TRUE(gap->ok()) << gap->not_identifiable;
    EXPECT_LT(gap->lower, kGap_rad);
    EXPECT_GT(gap->upper, kGap_rad);
    EXPECT_LT(gap->upper - gap->lower, 2 * kGap_rad) << flank_Hz;
  }
}

// A load whose bouncing is fixed while other parameters are differentiated still includes its external
// torques.
TEST(Estimates, WhatPullsAtALoadBehindAGapIsDetermined) {
  model::effects::DriveModel drive = drive_with(150);
  drive.effects.push_back(model::effects::make_effect("torque_offset", {{"torque_Nm", 0.01}}));
  const std::vector<Source> sources{reversals(drive)};
  const std::vector<Signals> signals{make_signals(sources.front(), choose_band(sources, drive))};
  const Rows rows(signals);
  const FittedModel fitted{.model = drive, .given_inertia_kg_m2 = drive.inertia_kg_m2};
  std::vector<FreeParameter> parameters = free_parameters(fitted, rows);
  std::erase_if(parameters, [&](const FreeParameter& p) {
    return p.kind != FreeParameter::Kind::kEffect || p.effect + 1 != drive.effects.size();
  });
  ASSERT_EQ(parameters.size(), 1U);
  // But for the time in which it flies.
  EXPECT_NEAR(prediction_jacobian(fitted, rows, parameters).mean(), 0.8, 0.2);
}

// Over two periods of a ripple, what else bends the torque moves its periods; over many it does not.
TEST(Estimates, TheIntervalOfARipplesPeriodsIsNoNarrowerThanTheStrokeResolves) {
  constexpr double kPeriods = 26;
  FittedModel start{.model = {.name = "bench", .inertia_kg_m2 = 0.01}, .given_inertia_kg_m2 = 0.01};
  start.model.effects = {
      model::effects::make_effect("coulomb", {{"torque_Nm", 0.04}}),
      model::effects::make_effect("viscous", {{"coefficient_Nm_s_per_rad", 0.005}}),
      model::effects::make_effect("cogging", {{"amplitude_Nm", 0.01}, {"periods_per_rev", kPeriods}})};
  for (const double stroke_rad : {0.5, 5.0}) {
    Source source{.name = "stroke.csv", .recording = {}};
    std::vector<double> time, torque, position;
    const double rate = 1 / stroke_rad;
    for (int i = 0; i < 20000; ++i) {
      const double t = 1e-3 * i;
      const double q = stroke_rad / 2 * std::sin(rate * t);
      const double v = 0.5 * std::cos(rate * t);
      time.push_back(t);
      position.push_back(q);
      torque.push_back(-0.01 * rate * rate * q + std::copysign(0.04, v) + 0.005 * v +
                       0.01 * std::sin(kPeriods * q));
    }
    source.recording.columns = {{"time_s", time}, {"torque_measured_Nm", torque}, {"position_rad", position}};
    const std::vector<Source> sources{source};
    const std::vector<Signals> signals{make_signals(source, choose_band(sources, start.model))};
    const Rows rows(signals);
    std::vector<Eigen::Index> all(static_cast<std::size_t>(rows.count()));
    std::iota(all.begin(), all.end(), 0);
    const std::vector<fit::Estimate> found = estimates(refined(start, rows, all), rows, all);
    const auto periods = std::ranges::find(found, "periods_per_rev", &fit::Estimate::name);
    ASSERT_NE(periods, found.end());
    // Half a period over the stroke.
    const double resolved = std::numbers::pi / stroke_rad;
    EXPECT_NEAR(periods->value, kPeriods, 0.1 * resolved) << stroke_rad;
    EXPECT_GT(periods->upper - periods->lower, 0.99 * resolved) << stroke_rad;
    EXPECT_LT(periods->upper - periods->lower, 1.5 * resolved) << stroke_rad;
  }
}

}  // namespace gap_fitted_model_test
}  // namespace identification::gap
