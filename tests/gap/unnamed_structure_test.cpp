// Causes outside the library, which are functions of the motion: none may get another's name, and the torque
// without a name must close what they leave.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include "analysis/explain.h"
#include "analysis/gap_json.h"
#include "identification/gap/gap.h"
#include "model/effects/any_effect.h"
#include "runtime/configuration/drive_model_file.h"
#include "tests/gap/unnamed_drive.h"
#include "tests/support/temporary_directory.h"

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

INSTANTIATE_TEST_SUITE_P(Causes, UnnamedStructure, testing::Values(Oddity::kDetent));

analysis::Inputs inputs_of(const OddDrive& drive, std::uint64_t seed) {
  const auto recording = [&](bool staircase, std::uint64_t n) {
    return gap_test::recording_of(drive, staircase, 10 * seed + n);
  };
  return {.model = base_of(drive),
          .rig = "odd",
          .data = {recording(true, 1), recording(false, 2)},
          .held_out = {recording(true, 3), recording(false, 4)},
          .warnings = {}};
}

bool has_unnamed(const model::effects::DriveModel& model) {
  return std::ranges::any_of(model.effects, [](const model::effects::AnyEffect& effect) {
    return std::holds_alternative<model::effects::Empirical>(effect);
  });
}

TEST(UnnamedTorque, IsOfferedInAFileOfItsOwnAndInTheModelWhereItIsAccepted) {
  const OddDrive drive{.oddity = Oddity::kDetent, .seed = 5};
  const support::TemporaryDirectory directory;
  for (const bool accept : {false, true}) {
    const std::filesystem::path out = directory / (accept ? "accepted" : "offered");
    const analysis::Findings findings =
        analysis::write_findings(inputs_of(drive, 7), {.out = out, .accept_unnamed = accept}, {});
    const Result& result = findings.result;
    ASSERT_TRUE(result.unnamed);
    EXPECT_EQ(std::filesystem::exists(out / "model-unnamed.toml"), !accept);
    EXPECT_EQ(has_unnamed(runtime::read_drive_model(out / "model.toml")), accept);
    if (!accept) {
      EXPECT_TRUE(has_unnamed(runtime::read_drive_model(out / "model-unnamed.toml")));
    }
    EXPECT_NEAR(result.gap_after_Nm, accept ? result.unnamed->gap_after_Nm : result.unnamed->gap_before_Nm,
                1e-9);
    EXPECT_NE(analysis::gap_json(findings).find("\"physical_name\": null"), std::string::npos);
  }
}

TEST(UnnamedTorque, IsNotOfferedWhereNothingIsMissing) {
  const Result result = analysed({.oddity = Oddity::kNone}, 9);
  EXPECT_EQ(names_of(result), "");
  EXPECT_FALSE(result.unnamed);
}

}  // namespace unnamed_structure_test
