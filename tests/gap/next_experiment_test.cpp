// The experiment that would distinguish two models: cases with a known answer.
#include "identification/gap/next_experiment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <initializer_list>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "identification/experiments/staircase.h"
#include "identification/experiments/torque_wave.h"

namespace gap_test {
namespace {

using namespace identification::gap;
using identification::experiments::JointExperiment;
using model::effects::make_effect;

const DriveLimits kLimits{
    .torque_Nm = 0.3, .speed_rad_per_s = 9, .travel_rad = std::numeric_limits<double>::infinity()};
constexpr Band kBand{.cutoff_Hz = 25,
                     .resolution_rad = 6e-5,
                     .torque_sigma_Nm = 0.0015,
                     .slowest_rad_per_s = 0.02,
                     .raw_period_s = 1e-3};

FittedModel wheel(std::initializer_list<model::effects::AnyEffect> more = {}) {
  FittedModel fitted;
  fitted.model.inertia_kg_m2 = fitted.given_inertia_kg_m2 = 0.0112;
  fitted.model.effects = {make_effect("coulomb", {{"torque_Nm", 0.045}}),
                          make_effect("viscous", {{"coefficient_Nm_s_per_rad", 0.0125}})};
  fitted.model.effects.insert(fitted.model.effects.end(), more);
  return fitted;
}

/// The wheel's recorded motion so far.
class Known {
 public:
  explicit Known(std::unique_ptr<JointExperiment> experiment, bool measured = true) {
    Source source = *carried_out(wheel().model, *experiment, kLimits);
    if (!measured)
      std::erase_if(source.recording.columns,
                    [](const auto& column) { return column.name == "torque_measured_Nm"; });
    signals_.push_back(make_signals(source, kBand));
    rows_ = std::make_unique<Rows>(signals_);
    for (Eigen::Index i = 0; i < rows_->count(); ++i) use_.push_back(i);
  }
  AtHand at_hand() const { return {*rows_, use_, kBand, 0.0005}; }
  std::optional<NextExperiment> next(const Pair& pair) const {
    return next_experiments(pair.truth.model, {{pair}}, at_hand(), kLimits).front();
  }

 private:
  std::vector<Signals> signals_;
  std::unique_ptr<Rows> rows_;
  std::vector<Eigen::Index> use_;
};

Known staircase_known() {
  return Known(
      std::make_unique<identification::experiments::Staircase>(identification::experiments::StaircaseConfig{
          .quantity = "velocity", .step = 1, .highest = 4, .hold_s = 2}));
}

double setting(const NextExperiment& experiment, const std::string& key, double otherwise) {
  for (const auto& [name, value] : experiment.settings)
    if (name == key) return std::stod(value);
  return otherwise;
}

std::string words(const std::optional<NextExperiment>& experiment) {
  if (!experiment) return "none";
  std::string text = experiment->name;
  for (const auto& [key, value] : experiment->settings) text += " " + key + " " + value;
  return text + ", " + std::to_string(experiment->separation) + " sigmas in " +
         std::to_string(experiment->duration_s) + " s";
}

// Both add the same torque whichever way the joint turns, and hold it as well at rest.
TEST(NextExperiment, NothingDistinguishesAnOffsetFromAsMuchMoreCoulombFrictionOneWay) {
  const auto next =
      staircase_known().next({wheel({make_effect("torque_offset", {{"torque_Nm", 0.01}})}),
                              wheel({make_effect("direction_asymmetry", {{"coulomb_Nm", 0.01}})})});
  EXPECT_FALSE(next) << words(next);
}

// What grows with the speed is no offset: the fastest speeds show it.
TEST(NextExperiment, SpeedDistinguishesAnOffsetFromMoreViscousFrictionOneWay) {
  const auto next = staircase_known().next(
      {wheel({make_effect("direction_asymmetry", {{"coulomb_Nm", 0.005}, {"viscous_Nm_s_per_rad", 0.002}})}),
       wheel({make_effect("torque_offset", {{"torque_Nm", 0.01}})})});
  ASSERT_TRUE(next);
  EXPECT_TRUE(next->name == "multisine" || next->name == "reversals" || next->name == "staircase")
      << words(next);
}

// At one frequency of a wheel braked by viscous friction, a torque reported late by T looks like an inertia
// difference of T·b; many frequencies at once distinguish them, and constant speeds show neither.
TEST(NextExperiment, AMultisineDistinguishesAnInertiaFromALateTorque) {
  const Known known(std::make_unique<identification::experiments::TorqueWave>(
      identification::experiments::PreslidingConfig{
          .waveform = "sine", .peak_Nm = 0.15, .lowest_Hz = 0.5, .rest_s = 0, .periods = 20},
      1e-3));
  FittedModel late = wheel();
  late.lag_s = 0.008;
  const auto next = known.next({wheel({make_effect("inertia", {{"difference_kg_m2", 0.002}})}), late});
  ASSERT_TRUE(next);
  EXPECT_EQ(next->name, "multisine") << words(next);
}

// e^(−sT) and a filter agree up to second order in sT: only a high frequency distinguishes them.
TEST(NextExperiment, HighFrequenciesTellADelayFromAFilter) {
  const Known known(
      std::make_unique<identification::experiments::TorqueWave>(
          identification::experiments::MultisineConfig{.peak_Nm = 0.2, .highest_Hz = 1, .periods = 3}, 1e-3),
      false);
  FittedModel filter = wheel();
  filter.lag_s = 0.012;
  filter.smoothing_s2 = 0.012 * 0.012;
  const auto next = known.next({wheel({make_effect("transport_delay", {{"delay_s", 0.012}})}), filter});
  ASSERT_TRUE(next);
  EXPECT_EQ(next->name, "multisine") << words(next);
  EXPECT_EQ(setting(*next, "highest_Hz", 5), 25) << words(next);
}

// A bristle gives under a torque that moves a rigid contact not at all.
TEST(NextExperiment, TorqueAtRestDistinguishesPreslidingFromStribeckFriction) {
  const auto next = staircase_known().next(
      {wheel({make_effect("presliding", {{"stiffness_Nm_per_rad", 20}})}),
       wheel({make_effect("stribeck", {{"static_torque_Nm", 0.06}, {"velocity_rad_per_s", 0.2}})})});
  ASSERT_TRUE(next);
  EXPECT_TRUE(next->name == "presliding" || next->name == "dahl") << words(next);
}

TEST(NextExperiment, TwoNamesOfTheSameModelAreNotDistinguished) {
  const FittedModel same = wheel({make_effect("torque_offset", {{"torque_Nm", 0.01}})});
  EXPECT_FALSE(staircase_known().next({same, same}));
}

// Limits are those of the drive: a joint that moves half a radian is not sent round.
TEST(NextExperiment, TheLimitsAreKept) {
  DriveLimits limits = kLimits;
  limits.travel_rad = 0.5;
  const model::effects::DriveModel drive = wheel().model;
  int within = 0;
  for (const BenchExperiment& experiment : bench_experiments(drive, limits)) {
    const auto source = carried_out(drive, *experiment.make(1e-3), limits);
    if (!source) continue;
    ++within;
    const auto [low, high] = std::ranges::minmax(source->recording.column("position_rad"));
    EXPECT_LE(high - low, limits.travel_rad) << experiment.name;
    const auto [least, most] = std::ranges::minmax(source->recording.column("torque_command_Nm"));
    EXPECT_LE(std::max(-least, most), limits.torque_Nm) << experiment.name;
  }
  EXPECT_GT(within, 2);
}

}  // namespace
}  // namespace gap_test
