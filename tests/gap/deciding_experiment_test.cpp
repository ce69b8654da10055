// The requested experiment is run on the hidden drive, and the right name wins.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "identification/experiments/joint_experiment.h"
#include "identification/experiments/steady_state.h"
#include "identification/experiments/torque_wave.h"
#include "identification/gap/bench_experiments.h"
#include "identification/gap/gap.h"
#include "tests/gap/gap_cases.h"
#include "tests/gap/hidden_experiment.h"

namespace gap_test {
namespace {

using identification::gap::NextExperiment;
using identification::gap::Result;
using identification::gap::Source;

const identification::gap::FoundEffect* found(const Result& result, std::string_view name) {
  const auto at = std::ranges::find_if(result.effects, [&](const auto& effect) {
    return model::effects::name_of(effect.effect) == name ||
           std::ranges::find(effect.equivalent, name) != effect.equivalent.end();
  });
  return at == result.effects.end() ? nullptr : &*at;
}

/// What youbot-bench would make of these options.
std::unique_ptr<identification::experiments::JointExperiment> made(const NextExperiment& wanted,
                                                                   const Result& result) {
  for (const auto& experiment : identification::gap::bench_experiments(result.model, result.limits))
    if (experiment.name == wanted.name && experiment.settings == wanted.settings)
      return experiment.make(HiddenPlant::kSample_s);
  return nullptr;
}

std::string words(const Result& result) {
  std::string text(identification::gap::verdict_name(result.verdict));
  for (const auto& effect : result.effects) {
    text += "\n  " + std::string(model::effects::name_of(effect.effect));
    for (std::size_t i = 0; i < effect.equivalent.size(); ++i)
      text += " or " + effect.equivalent[i] +
              (i + 1 < effect.wins.size() ? " (" + std::to_string(effect.wins[i + 1]) + ")" : "");
    if (effect.decided_by)
      text += ", by " + effect.decided_by->name + ": " + std::to_string(effect.decided_by->separation);
  }
  for (const auto& effect : result.rejected) text += "\n  no " + effect.type + ": " + effect.reason;
  for (const auto& spot : result.blind_spots)
    text += "\n  " + spot.text + (spot.shown_by ? ": " + spot.shown_by->name : "");
  return text;
}

/// What everybody knows about it.
model::effects::DriveModel base_of(const Drive& drive) {
  model::effects::DriveModel base;
  base.inertia_kg_m2 = drive.plant.inertia_kg_m2;
  base.encoder_ticks_per_rev = drive.sensors.encoder_ticks_per_rev;
  base.effects = {model::effects::make_effect("coulomb", {{"torque_Nm", drive.plant.coulomb_Nm}}),
                  model::effects::make_effect(
                      "viscous", {{"coefficient_Nm_s_per_rad", drive.plant.viscous_Nm_s_per_rad}})};
  return base;
}

/// Constant speeds of two to eight radians a second, first one way, then the other: hardly ever slow.
Source fast_speeds(const Drive& drive) {
  identification::experiments::SteadyState experiment({.settle_s = 0.5, .measure_s = 1.5, .extra_s = 0},
                                                      {8, 5, 3, 2, 4, 6, 7, -7, -6, -4, -2, -3, -5, -8},
                                                      HiddenPlant::kSample_s);
  return {"fast-speeds.csv", carry_out(drive, experiment, 3)};
}

struct Answers {
  Result before;
  Result after;
};
/// Asks with fast speeds alone, carries out what would show the blind spot, and asks with both.
Answers ask_twice(const Drive& drive, const model::effects::DriveModel& base, std::string_view effect) {
  Answers answers;
  std::vector<Source> data{fast_speeds(drive)};
  answers.before = identification::gap::analyse(base, data, {});
  const auto spot = std::ranges::find_if(answers.before.blind_spots, [&](const auto& blind) {
    return std::ranges::find(blind.effects, effect) != blind.effects.end();
  });
  if (spot == answers.before.blind_spots.end() || !spot->shown_by) return answers;
  data.push_back({"deciding.csv", carry_out(drive, *made(*spot->shown_by, answers.before), 4)});
  answers.after = identification::gap::analyse(base, data, {});
  return answers;
}

/// A torque of one size that does not break the joint away, after constant speeds.
std::vector<Source> rests_under_one_torque(const Drive& drive) {
  std::vector<Source> data{fast_speeds(drive)};
  for (std::uint64_t seed = 5; seed < 8; ++seed) {
    identification::experiments::TorqueWave wave(
        {.waveform = "sine", .peak_Nm = 0.35 * drive.plant.coulomb_Nm, .lowest_Hz = 1, .periods = 20},
        HiddenPlant::kSample_s);
    data.push_back({"rest-" + std::to_string(seed) + ".csv", carry_out(drive, wave, seed)});
  }
  return data;
}

// A joint that gives under one size of torque rests on bristles or on a spring. What is asked for is carried
// out on a hidden drive whose friction contact gives: its name is left alone.
TEST(DecidingExperiment, OfTwoNamesTheRightOneIsLeft) {
  for (const double deadband_share : {0.0, 0.2}) {
    Drive drive;
    drive.effects.contact_rad_per_Nm = 0.05;
    drive.effects.deadband_Nm = deadband_share * drive.plant.coulomb_Nm;
    const model::effects::DriveModel base = base_of(drive);
    std::vector<Source> data = rests_under_one_torque(drive);
    const Result before = identification::gap::analyse(base, data, {});
    const auto* const either = found(before, "presliding");
    ASSERT_NE(either, nullptr) << words(before);
    ASSERT_EQ(either->equivalent, std::vector<std::string>{"elasticity"}) << words(before);
    EXPECT_NE(before.verdict, identification::gap::Verdict::kExplained) << words(before);
    ASSERT_TRUE(either->decided_by) << words(before);
    data.push_back({"deciding.csv", carry_out(drive, *made(*either->decided_by, before), 4)});
    const Result after = identification::gap::analyse(base, data, {});
    const auto* const one = found(after, "presliding");
    ASSERT_NE(one, nullptr) << words(before) << words(after);
    EXPECT_EQ(model::effects::name_of(one->effect), "presliding") << words(after);
    EXPECT_TRUE(one->equivalent.empty()) << words(before) << words(after);
    EXPECT_EQ(found(after, "elasticity"), nullptr) << words(after);
  }
}

// Whether friction falls from rest on is nothing that fast speeds show. What is asked for is carried out on a
// hidden drive that has it and on one that has not: the right one of the two models wins.
TEST(DecidingExperiment, OnTheHiddenDriveTheRightModelWins) {
  Drive drive;
  const model::effects::DriveModel base = base_of(drive);
  const Answers without = ask_twice(drive, base, "stribeck");
  EXPECT_FALSE(found(without.before, "stribeck")) << words(without.before);
  EXPECT_FALSE(found(without.after, "stribeck")) << words(without.after);

  drive.effects.stribeck_Nm = 0.025;
  const Answers with = ask_twice(drive, base, "stribeck");
  EXPECT_FALSE(found(with.before, "stribeck")) << words(with.before);
  const auto* const stribeck = found(with.after, "stribeck");
  ASSERT_NE(stribeck, nullptr) << words(with.before) << words(with.after);
  EXPECT_TRUE(stribeck->equivalent.empty()) << words(with.after);
}

}  // namespace
}  // namespace gap_test
