// Command and measured torque that differ by a gain or an offset: which of the two the drive obeys.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "identification/gap/gap.h"
#include "model/effects/effect_chain.h"
#include "tests/gap/gap_cases.h"

namespace gap_test {
namespace torque_columns_test {

using identification::gap::Result;
using identification::gap::Source;

constexpr double kOffset_Nm = 0.05;
constexpr double kLength = 0.4;

/// Recordings with one column times `gain` plus `offset_Nm`.
std::vector<Source> with_column(std::vector<Source> sources, std::string_view name, double gain,
                                double offset_Nm) {
  for (Source& source : sources)
    for (auto& column : source.recording.columns)
      if (column.name == name)
        for (double& value : column.values) value = gain * value + offset_Nm;
  return sources;
}

Result analysed(const Case& drive, const model::effects::DriveModel& model, std::string_view column,
                double gain, double offset_Nm) {
  return identification::gap::analyse(model, with_column(drive.data, column, gain, offset_Nm),
                                      with_column(drive.held_out, column, gain, offset_Nm));
}

std::vector<std::string> names_of(const Result& result) {
  std::vector<std::string> names;
  for (const auto& found : result.effects) names.emplace_back(model::effects::name_of(found.effect));
  return names;
}

double value_of(const model::effects::DriveModel& model, std::string_view effect,
                std::string_view parameter) {
  const auto is_it = [&](const auto& any) { return model::effects::name_of(any) == effect; };
  EXPECT_EQ(std::ranges::count_if(model.effects, is_it), 1) << effect;
  const auto found = std::ranges::find_if(model.effects, is_it);
  return found == model.effects.end() ? 0 : model::effects::parameter_of(*found, parameter);
}

/// The new model predicts the same recordings as well as it said.
void expect_no_gap_with(const Result& result, const Case& drive, std::string_view column, double gain,
                        double offset_Nm) {
  const Result again = analysed(drive, result.model, column, gain, offset_Nm);
  EXPECT_EQ(names_of(again), std::vector<std::string>{});
  EXPECT_NEAR(again.gap_before_Nm, result.gap_after_Nm, 0.05 * result.gap_after_Nm);
}

TEST(TorqueColumns, AnOffsetOfTheReportThatDoesNotMoveTheJointIsTheSensors) {
  const Case drive = make_case({.kind = CaseKind::kNone, .seed = 3}, kLength);
  const Result result = analysed(drive, drive.base, "torque_measured_Nm", 1, kOffset_Nm);
  EXPECT_EQ(names_of(result), std::vector<std::string>{"torque_sensor_offset"});
  EXPECT_NEAR(value_of(result.model, "torque_sensor_offset", "torque_Nm"), kOffset_Nm, 0.001);
  EXPECT_TRUE(result.effects.at(0).equivalent.empty());
  EXPECT_GT(result.gap_before_Nm, 5 * result.gap_after_Nm);
  expect_no_gap_with(result, drive, "torque_measured_Nm", 1, kOffset_Nm);
}

TEST(TorqueColumns, AnOffsetBeyondTheCommandThatMovesTheJointIsTheActuators) {
  const Case drive = make_case({.kind = CaseKind::kNone, .seed = 4}, kLength);
  const Result result = analysed(drive, drive.base, "torque_command_Nm", 1, -kOffset_Nm);
  EXPECT_EQ(names_of(result), std::vector<std::string>{"actuator_offset"});
  EXPECT_NEAR(value_of(result.model, "actuator_offset", "torque_Nm"), kOffset_Nm, 0.001);
  expect_no_gap_with(result, drive, "torque_command_Nm", 1, -kOffset_Nm);
}

/// Also finds what the drive lacks: a command of another scale is no noise of the report.
TEST(TorqueColumns, ACommandOfAnotherScaleIsAGainAndHidesNothing) {
  const Case drive =
      make_case({.kind = CaseKind::kSingle, .hidden = {Hidden::kStribeck}, .size = 6, .seed = 21}, kLength);
  const Result result = analysed(drive, drive.base, "torque_command_Nm", 0.8, 0);
  EXPECT_EQ(names_of(result), (std::vector<std::string>{"actuator_gain", "stribeck"}));
  EXPECT_NEAR(value_of(result.model, "actuator_gain", "gain"), 1.25, 0.01);
  EXPECT_LT(result.noise_floor_Nm, 0.5 * result.gap_before_Nm);
}

TEST(TorqueColumns, AGainIsFoundBehindAGivenOffset) {
  const Case drive = make_case({.kind = CaseKind::kNone, .seed = 6}, kLength);
  model::effects::DriveModel model = drive.base;
  model.effects.push_back(model::effects::make_effect("actuator_offset", {{"torque_Nm", 0.04}}));
  // measured = 1.25·(command + 0.04)
  const Result result = analysed(drive, model, "torque_command_Nm", 0.8, -0.04);
  EXPECT_EQ(names_of(result), std::vector<std::string>{"actuator_gain"});
  EXPECT_NEAR(value_of(result.model, "actuator_gain", "gain"), 1.25, 0.01);
  EXPECT_NEAR(model::effects::EffectChain(result.model.effects).deliver(0.1, 1e-3), 1.25 * 0.14, 0.002);
}

TEST(TorqueColumns, AGivenSensorOffsetIsTakenOff) {
  const Case drive = make_case({.kind = CaseKind::kNone, .seed = 5}, kLength);
  model::effects::DriveModel model = drive.base;
  model.effects.push_back(model::effects::make_effect("torque_sensor_offset", {{"torque_Nm", 0.02}}));
  const Result result = analysed(drive, model, "torque_measured_Nm", 1, kOffset_Nm);
  EXPECT_EQ(names_of(result), std::vector<std::string>{"torque_sensor_offset"});
  EXPECT_NEAR(model::effects::EffectChain(result.model.effects).report_Nm(0), kOffset_Nm, 0.001);
}

}  // namespace torque_columns_test
}  // namespace gap_test
