// The edit test: it accepts models that are right for the right reason, and no others.
#include "tests/gap/edit_test.h"

#include <gtest/gtest.h>

#include <string>

#include "tests/gap/gap_cases.h"
#include "tests/gap/gap_judge.h"

namespace gap_test {
namespace {

constexpr double kLength = 0.4;

/// A model of the case's drive, which has an offset, with these two effects.
identification::gap::Result delivered(const Case& gap_case, double offset_Nm, double asymmetry_Nm) {
  using model::effects::make_effect;
  const Plant& plant = gap_case.drive.plant;
  identification::gap::Result result;
  result.verdict = identification::gap::Verdict::kExplained;
  result.model = gap_case.base;
  result.model.inertia_kg_m2 = plant.inertia_kg_m2;
  result.model.effects = {make_effect("coulomb", {{"torque_Nm", plant.coulomb_Nm}}),
                          make_effect("viscous", {{"coefficient_Nm_s_per_rad", plant.viscous_Nm_s_per_rad}}),
                          make_effect("torque_offset", {{"torque_Nm", offset_Nm}})};
  if (asymmetry_Nm != 0)
    result.model.effects.push_back(make_effect("direction_asymmetry", {{"coulomb_Nm", asymmetry_Nm}}));
  result.effects.push_back({.effect = result.model.effects[2], .where = {}});
  return result;
}

TEST(EditTest, WhatTheSearchExplainsIsRightForTheRightReason) {
  using enum Hidden;
  for (const CaseSpec& spec : {CaseSpec{CaseKind::kSingle, {kQuadraticDrag}, 5, 61},
                               CaseSpec{CaseKind::kSingle, {kCogging}, 5, 25}}) {
    const Judgement judgement = judge(make_case(spec, kLength), true);
    ASSERT_EQ(judgement.verdict, identification::gap::Verdict::kExplained) << spec.name();
    ASSERT_EQ(judgement.edits.size(), 1U) << spec.name();
    EXPECT_TRUE(judgement.edits.front().passed()) << spec.name() << ": " << judgement.edits.front().gap_Nm
                                                  << " of " << judgement.edits.front().never_Nm;
  }
}

// An offset and a difference of Coulomb friction by direction are the same to a joint in motion: too much of
// one and as much less of the other leave no gap. The name is right; the offset is not.
TEST(EditTest, WrongParametersThatMakeUpForEachOtherFailIt) {
  const Case gap_case = make_case({CaseKind::kSingle, {Hidden::kTorqueOffset}, 5, 62}, kLength);
  const double offset_Nm = gap_case.drive.effects.offset_Nm;
  const auto gap_of = [&](const identification::gap::Result& result) {
    const identification::gap::Result again =
        identification::gap::analyse(result.model, gap_case.data, gap_case.held_out);
    return again.gap_before_Nm / again.noise_floor_Nm;
  };
  const identification::gap::Result right = delivered(gap_case, offset_Nm, 0);
  const identification::gap::Result wrong = delivered(gap_case, 1.5 * offset_Nm, -0.5 * offset_Nm);
  EXPECT_LT(gap_of(right), 1.2);
  EXPECT_LT(gap_of(wrong), 1.2) << "the gap does not see it";
  EXPECT_TRUE(edit_tests(gap_case, right).front().passed());
  EXPECT_FALSE(edit_tests(gap_case, wrong).front().passed());
}

}  // namespace
}  // namespace gap_test
