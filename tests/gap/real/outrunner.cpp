// A hobby motor without gear, turned slowly once round: its torque repeats over position.
#include <numbers>

#include "tests/gap/real/converted_drive.h"
#include "tests/gap/real/source_table.h"

namespace real_recordings {
namespace {

constexpr double kCounts = 8192;  // a revolution
/// The source gives its cogging as 0.4 A and as 3 mN·m.
constexpr double kTorqueConstant_Nm_per_A = 3e-3 / 0.4;
/// What its spin-ups gain in speed for each ampere; the source's own 2.5e-4 kg m2 is called rough there.
constexpr double kAcceleration_rad_per_s2_per_A = 262;
constexpr double kFriction_A = 0.3;

std::vector<double> scaled(std::vector<double> values, double factor) {
  for (double& value : values) value *= factor;
  return values;
}

}  // namespace

ConvertedDrive outrunner(const std::filesystem::path& folder) {
  ConvertedDrive result;
  result.base.name = "outrunner";
  result.base.inertia_kg_m2 = kTorqueConstant_Nm_per_A / kAcceleration_rad_per_s2_per_A;
  result.base.encoder_ticks_per_rev = kCounts;
  result.base.effects = {
      model::effects::make_effect("coulomb", {{"torque_Nm", kFriction_A * kTorqueConstant_Nm_per_A}}),
      model::effects::make_effect("viscous", {{"coefficient_Nm_s_per_rad", 1e-5}})};
  result.remarks = {
      "0.3 A of friction as the source expects; 7.5 mN m/A, from its cogging",
      "of 0.4 A or 3 mN m; inertia from its spin-ups, 262 rad/s2 an ampere. The viscous coefficient",
      "is a guess."};
  const auto add = [&](std::vector<ConvertedRecording>& to, const std::string& name) {
    const SourceTable table(folder / (name + ".csv"));
    ConvertedRecording run{.file = name + ".csv", .recording = {}};
    run.recording.rig = result.base.name;
    run.recording.experiment = "slow constant velocity";
    run.recording.comments = {{"source", "gchenfc/ODrive, analysis/cogging_torque"}};
    run.recording.columns = {
        {"time_s", table.column("t_s")},
        {"torque_measured_Nm", scaled(table.column("iq_A"), kTorqueConstant_Nm_per_A)},
        {"position_rad", scaled(table.column("position_counts"), 2 * std::numbers::pi / kCounts)}};
    to.push_back(std::move(run));
  };
  // With its anti-cogging map the controller pushes ahead of the error; the torque that it takes is the same.
  add(result.data, "slow2_comp_0");
  add(result.data, "slow2_slower_nocomp_0");
  add(result.held_out, "slow2_nocomp_0");
  return result;
}

}  // namespace real_recordings
