// Causes outside the library, which are functions of the motion: none may get another's name, and the torque
// without a name must close what they leave.
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "identification/gap/gap.h"
#include "model/effects/any_effect.h"
#include "tests/gap/unnamed_drive.h"

namespace unnamed_structure_test {

using gap_test::OddDrive;
using gap_test::Oddity;
using identification::gap::Options;
using identification::gap::Result;

model::effects::DriveModel base_of(const OddDrive& drive) {
  model::effects::DriveModel base{
      .name = "odd",
      .inertia_kg_m2 = drive.inertia_kg_m2,
      .encoder_ticks_per_rev = 104000,
      .effects = {model::effects::make_effect("coulomb", {{"torque_Nm", drive.coulomb_Nm}}),
                  model::effects::make_effect("viscous",
                                              {{"coefficient_Nm_s_per_rad", drive.viscous_Nm_s_per_rad}})}};
  if (drive.weight_Nm > 0)
    base.effects.push_back(model::effects::make_effect("imbalance", {{"torque_Nm", drive.weight_Nm}}));
  return base;
}

Result analysed(const OddDrive& drive, std::uint64_t seed, const Options& options = {}) {
  const auto recording = [&](bool staircase, std::uint64_t n) {
    return gap_test::recording_of(drive, staircase, 10 * seed + n);
  };
  return identification::gap::analyse(base_of(drive), {recording(true, 1), recording(false, 2)},
                                      {recording(true, 3), recording(false, 4)}, options);
}

std::string names_of(const Result& result) {
  std::string names;
  for (const identification::gap::FoundEffect& found : result.effects)
    names += std::string(model::effects::name_of(found.effect)) + " ";
  return names;
}

class UnnamedStructure : public testing::TestWithParam<Oddity> {};

TEST_P(UnnamedStructure, GetsNoNameAndIsClosed) {
  OddDrive drive{.oddity = GetParam(), .seed = 5};
  if (drive.oddity == Oddity::kLoadTimesSpeed) drive.weight_Nm = 0.1;
  const Result result = analysed(drive, 7);
  EXPECT_EQ(names_of(result), "");
  EXPECT_EQ(result.verdict, identification::gap::Verdict::kUnexplained);
  ASSERT_TRUE(result.unnamed);
  EXPECT_GT(result.unnamed->removable_share, 0.8);
  EXPECT_LE(result.unnamed->simulation_after_rad_per_s, 1.01 * result.unnamed->simulation_before_rad_per_s);
  EXPECT_FALSE(result.unnamed_accepted) << "it was not asked for";
  for (const model::effects::AnyEffect& effect : result.model.effects)
    EXPECT_NE(model::effects::name_of(effect), "empirical");
}

INSTANTIATE_TEST_SUITE_P(Causes, UnnamedStructure,
                         testing::Values(Oddity::kSpeedWave, Oddity::kDetent, Oddity::kRelaxation,
                                         Oddity::kTwisted));

TEST(UnnamedStructure, ThatIsAcceptedIsInTheModelAndInTheGap) {
  const OddDrive drive{.oddity = Oddity::kSpeedWave, .seed = 3};
  const Result result = analysed(drive, 8, {.accept_unnamed = true});
  ASSERT_TRUE(result.unnamed);
  EXPECT_TRUE(result.unnamed_accepted);
  EXPECT_EQ(model::effects::name_of(result.model.effects.back()), "empirical");
  EXPECT_NEAR(result.gap_after_Nm, result.unnamed->gap_after_Nm, 1e-9);
  EXPECT_EQ(result.verdict, identification::gap::Verdict::kUnexplained) << "nothing has got a name";
}

TEST(UnnamedStructure, IsNotOfferedWhereNothingIsMissing) {
  const Result result = analysed({.oddity = Oddity::kNone}, 9);
  EXPECT_EQ(names_of(result), "");
  EXPECT_FALSE(result.unnamed);
}

}  // namespace unnamed_structure_test
