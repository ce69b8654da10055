#include "tests/gap/baselines.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace gap_test {
namespace {

bool names(const BaselineAnswer& answer, Hidden hidden) {
  return std::ranges::find(answer.named, name_of(hidden)) != answer.named.end();
}

// They are real opponents: they name a strong effect, and leave only noise.
TEST(Baselines, FindAStrongEffectAndLeaveNoise) {
  for (const Hidden hidden :
       {Hidden::kStribeck, Hidden::kCogging, Hidden::kQuadraticDrag, Hidden::kInertia}) {
    SCOPED_TRACE(name_of(hidden));
    const Case gap_case =
        make_case({.kind = CaseKind::kSingle, .hidden = {hidden}, .size = 12, .seed = 7001});
    const BaselineAnswers answers = baseline_answers(gap_case);
    EXPECT_TRUE(answers.could_name_all);
    for (const BaselineAnswer& answer : {answers.sparse, answers.all_parameters}) {
      EXPECT_TRUE(names(answer, hidden));
      EXPECT_LT(answer.gap_after_Nm, gap_case.drive.sensors.noise_floor_Nm());
    }
  }
}

TEST(Baselines, CannotNameALostSign) {
  const Case gap_case =
      make_case({.kind = CaseKind::kSingle, .hidden = {Hidden::kUnsignedCurrent}, .size = 12, .seed = 7002});
  EXPECT_FALSE(baseline_answers(gap_case).could_name_all);
}

TEST(Baselines, AreRightWithAllNamesAndNoOther) {
  const CaseSpec pair{.kind = CaseKind::kPair, .hidden = {Hidden::kStribeck, Hidden::kCogging}};
  EXPECT_TRUE(is_right({.named = {"cogging", "stribeck"}}, pair));
  EXPECT_FALSE(is_right({.named = {"cogging"}}, pair));
  EXPECT_FALSE(is_right({.named = {"cogging", "stribeck", "backlash"}}, pair));
  const CaseSpec outside{.kind = CaseKind::kOutside, .hidden = {Hidden::kPush}};
  EXPECT_TRUE(is_right({}, outside));
  EXPECT_FALSE(is_right({.named = {"cogging"}}, outside));
}

}  // namespace
}  // namespace gap_test
