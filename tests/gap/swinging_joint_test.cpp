// Joints that swing within a stroke: springs beside weights, gaps that are not crossed, coarse encoders.
#include <gtest/gtest.h>

#include <cstdint>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include "analysis/findings.h"
#include "identification/gap/gap.h"
#include "identification/gap/search.h"
#include "identification/gap/signals.h"
#include "model/effects/any_effect.h"
#include "tests/gap/swinging_joint.h"

namespace swinging_joint_test {

using gap_test::analysed;
using gap_test::names;
using gap_test::Swing;
using gap_test::SwingingJoint;
using gap_test::words;
using identification::gap::Result;
using identification::gap::Verdict;

constexpr double kSeconds = 10;

double parameter(const Result& result, std::string_view name) {
  return model::effects::parameter_of(result.effects.at(0).effect, name);
}

TEST(Spring, IsNamedOverAStrokeThatShowsItStraight) {
  const SwingingJoint joint{.spring_Nm_per_rad = 1, .spring_rest_rad = 0.3};
  const Result result = analysed(joint, {.half_stroke_rad = 0.4, .seconds = kSeconds});
  ASSERT_EQ(names(result), "spring") << words(result);
  EXPECT_EQ(result.verdict, Verdict::kExplained);
  EXPECT_NEAR(parameter(result, "stiffness_Nm_per_rad"), 1, 0.005);
  EXPECT_NEAR(parameter(result, "rest_position_rad"), 0.3, 0.005);
}

TEST(Spring, IsNotNamedForAWeight) {
  const SwingingJoint joint{.weight_Nm = 1, .weight_rest_rad = 0.3};
  const Result result = analysed(joint, {.half_stroke_rad = 0.4, .seconds = kSeconds});
  ASSERT_EQ(names(result), "imbalance") << words(result);
  EXPECT_NEAR(parameter(result, "torque_Nm"), 1, 0.005);
}

// Within 0.12 rad of the middle the sine is 1e-4 N·m off a straight line, a tenth of the noise floor.
TEST(Spring, AndAWeightAreRivalsWhereTheNoiseHidesTheBend) {
  const SwingingJoint joint{.weight_Nm = 0.15, .weight_rest_rad = 0.1};
  const Result result = analysed(joint, {.half_stroke_rad = 0.12, .seconds = kSeconds});
  EXPECT_TRUE(names(result) == "spring/imbalance" || names(result) == "imbalance/spring") << words(result);
  EXPECT_EQ(result.verdict, Verdict::kAmbiguous);
  ASSERT_FALSE(result.effects.empty());
  identification::gap::FoundEffect either = result.effects.front();
  either.decided_by.reset();
  analysis::Findings findings;
  findings.result = result;
  const std::string decides = analysis::deciding_experiment(either, findings);
  EXPECT_NE(decides.find("record a larger stroke"), std::string::npos) << decides;
}

TEST(Spring, IsNotNamedWhereThereIsNone) {
  for (const double half_stroke_rad : {0.12, 0.9})
    EXPECT_EQ(names(analysed({}, {.half_stroke_rad = half_stroke_rad, .seconds = kSeconds})), "");
}

// The experiment that would decide begins where the joint was seen, not at zero.
TEST(Spring, FarFromZeroIsNamedAsWell) {
  const SwingingJoint joint{.spring_Nm_per_rad = 1, .spring_rest_rad = 2.3};
  const Result result = analysed(joint, {.centre_rad = 2.5, .half_stroke_rad = 0.4, .seconds = kSeconds});
  ASSERT_EQ(names(result), "spring") << words(result);
  EXPECT_NEAR(result.limits.middle_rad, 2.5, 0.1);
  EXPECT_NEAR(parameter(result, "rest_position_rad"), 2.3, 0.01);
}

// On a short stroke a constant torque is a spring far from its rest, or a weight at its highest torque.
TEST(Spring, IsNotNamedForAConstantTorque) {
  for (const double half_stroke_rad : {0.12, 0.4, 0.9}) {
    const Result result =
        analysed({.offset_Nm = 0.3}, {.half_stroke_rad = half_stroke_rad, .seconds = kSeconds});
    EXPECT_NE(names(result).find("torque_offset"), std::string::npos) << words(result);
    EXPECT_EQ(names(result).find("spring"), std::string::npos) << words(result);
    EXPECT_EQ(names(result).find("imbalance"), std::string::npos) << words(result);
  }
}

// The steps of another encoder than the model's made a torque of 1 N·m, which was named backlash.
TEST(SwingingJoint, WithACoarserEncoderThanTheModelSaysHasNoNewEffect) {
  const SwingingJoint joint{.inertia_kg_m2 = 0.01, .ticks_per_rev = 48};
  const Swing motion{.half_stroke_rad = 60, .fastest_Hz = 1, .seconds = 20};
  model::effects::DriveModel wrong = gap_test::known_of(joint);
  wrong.encoder_ticks_per_rev = 16384;
  const Result result =
      identification::gap::analyse(wrong, {swing(joint, motion, 30), swing(joint, motion, 31)},
                                   {swing(joint, motion, 32), swing(joint, motion, 33)});
  EXPECT_EQ(names(result), "") << words(result);
  EXPECT_LT(result.gap_after_Nm, 0.1 * joint.coulomb_Nm);
}

TEST(SwingingJoint, ACoarserModelThanTheEncoderKeepsItsSteps) {
  const SwingingJoint joint{.ticks_per_rev = 16384};
  model::effects::DriveModel coarse = gap_test::known_of(joint);
  coarse.encoder_ticks_per_rev = 4096;
  const auto resolution_rad = [&](const model::effects::DriveModel& model) {
    return identification::gap::choose_band({swing(joint, {.seconds = 4}, 1)}, model).resolution_rad;
  };
  EXPECT_DOUBLE_EQ(resolution_rad(coarse), 2 * std::numbers::pi / 4096);
  EXPECT_DOUBLE_EQ(resolution_rad(gap_test::known_of(joint)), 2 * std::numbers::pi / 16384);
}

/// A drive of which a third of the inertia is behind such a gap.
model::effects::DriveModel with_gap(double gap_rad) {
  model::effects::DriveModel model = gap_test::known_of({});
  model.effects.push_back(
      model::effects::make_effect("backlash", {{"gap_rad", gap_rad}, {"load_share", 0.33}}));
  return model;
}

TEST(SwingingJoint, CrossesAGapThatIsSmallAgainstItsStroke) {
  const auto crosses = [](double gap_rad, double half_stroke_rad, double seconds) {
    const model::effects::DriveModel model = with_gap(gap_rad);
    const identification::gap::Source source =
        gap_test::swing({}, {.half_stroke_rad = half_stroke_rad, .seconds = seconds}, 1);
    const std::vector<identification::gap::Signals> signals{
        make_signals(source, identification::gap::choose_band({source}, model))};
    return crosses_gap({.model = model, .given_inertia_kg_m2 = model.inertia_kg_m2},
                       identification::gap::Rows(signals));
  };
  EXPECT_TRUE(crosses(0.02, 0.27, 16));
  EXPECT_FALSE(crosses(0.36, 0.27, 16)) << "two thirds of the stroke";
  EXPECT_FALSE(crosses(0.02, 0.27, 1)) << "hardly a reversal";
}

}  // namespace swinging_joint_test
