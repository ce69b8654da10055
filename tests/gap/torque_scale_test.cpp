// A torque that is recorded too large is no inertia.
#include "identification/gap/torque_scale.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "tests/gap/gap_cases.h"

namespace gap_test {
namespace {

using identification::gap::analyse;
using identification::gap::FoundEffect;
using identification::gap::Result;
using identification::gap::Source;

/// Recordings of a drive that lacks nothing, with the measured torque times `factor`, and without its
/// command.
std::vector<Source> scaled(std::vector<Source> sources, double factor) {
  for (Source& source : sources) {
    std::erase_if(source.recording.columns,
                  [](const auto& column) { return column.name == "torque_command_Nm"; });
    for (auto& column : source.recording.columns)
      if (column.name == "torque_measured_Nm")
        for (double& torque_Nm : column.values) torque_Nm *= factor;
  }
  return sources;
}

Result analysed(const Case& drive, double factor) {
  return analyse(drive.base, scaled(drive.data, factor), scaled(drive.held_out, factor));
}

const FoundEffect* inertia_of(const Result& result) {
  const auto found = std::ranges::find_if(
      result.effects, [](const FoundEffect& e) { return model::effects::name_of(e.effect) == "inertia"; });
  return found == result.effects.end() ? nullptr : &*found;
}

TEST(TorqueScale, ATorqueThatIsRecordedAThirdTooLargeIsARivalOfTheInertia) {
  const Result result = analysed(make_case({.kind = CaseKind::kNone, .seed = 3}, 0.5), 4.0 / 3);
  const FoundEffect* const inertia = inertia_of(result);
  ASSERT_NE(inertia, nullptr);
  EXPECT_EQ(inertia->equivalent, std::vector<std::string>{"torque_scale"});
  EXPECT_NE(result.verdict, identification::gap::Verdict::kExplained);
  ASSERT_FALSE(result.notes.empty());
  EXPECT_NE(result.notes.back().find("all 1.3"), std::string::npos) << result.notes.back();
}

TEST(TorqueScale, AnInertiaThatIsMissingHasNoSuchRival) {
  const Case drive =
      make_case({.kind = CaseKind::kSingle, .hidden = {Hidden::kInertia}, .size = 6, .seed = 3}, 0.5);
  const Result result = analysed(drive, 1);
  const FoundEffect* const inertia = inertia_of(result);
  ASSERT_NE(inertia, nullptr);
  EXPECT_TRUE(std::ranges::find(inertia->equivalent, "torque_scale") == inertia->equivalent.end());
}

}  // namespace
}  // namespace gap_test
