// Lead screws driven at constant speeds: each run of the published steady-state tables is a recording with
// its own rate.
#include <cmath>
#include <map>
#include <numbers>
#include <stdexcept>

#include "tests/gap/real/converted_drive.h"
#include "tests/gap/real/source_table.h"

namespace real_recordings {
namespace {

/// Of the motor's side, which is where velocity and torque were measured.
constexpr double kInputInertia_kg_m2 = 2.186e-6;
constexpr double kLead_m = 2e-3;
constexpr double kSupportBreakaway_Nm[] = {1e-3, 2e-3};
constexpr double kSupportViscous_Nm_s_per_rad[] = {3e-5, 3e-5};
/// Load with its nut, and on drive 2 a second nut.
constexpr double kMovingMass_kg[] = {0.180, 0.180 + 0.05};

}  // namespace

ConvertedDrive screw_drive(const std::filesystem::path& folder, int drive) {
  if (drive < 1 || drive > 2) throw std::invalid_argument("there are screw drives 1 and 2");
  const std::string number = std::to_string(drive);
  const std::string rig = "screw-drive-" + number;
  const double lead_per_rad = kLead_m / (2 * std::numbers::pi);
  ConvertedDrive result;
  result.base.name = rig;
  result.base.inertia_kg_m2 = kInputInertia_kg_m2 + kMovingMass_kg[drive - 1] * lead_per_rad * lead_per_rad;
  result.base.effects = {
      model::effects::make_effect("coulomb", {{"torque_Nm", kSupportBreakaway_Nm[drive - 1]}}),
      model::effects::make_effect("viscous",
                                  {{"coefficient_Nm_s_per_rad", kSupportViscous_Nm_s_per_rad[drive - 1]}})};
  result.remarks = {
      "Motor side of a lead screw. Inertia: input 2.186e-6 kg m2 and the moving mass through the",
      "2 mm lead; friction: the support bearings only, as published. What the nut adds is left",
      "to be found."};

  const SourceTable table(folder / ("drive" + number + "_steady_state.csv"));
  const auto labels = table.words("run_label_rpm");
  const auto time = table.column("t_s");
  const auto velocity = table.column("velocity_rad_s");
  const auto torque = table.column("torque_Nm");
  std::map<int, std::size_t> of_speed;  // where the recording of a speed is
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const int rpm = static_cast<int>(std::lround(std::stod(labels[i])));
    const auto [at, is_new] = of_speed.emplace(rpm, result.data.size());
    if (is_new) {
      ConvertedRecording run;
      run.file = (rpm < 0 ? "backward_" : "forward_") + std::string(std::abs(rpm) < 100 ? "0" : "") +
                 (std::abs(rpm) < 10 ? "0" : "") + std::to_string(std::abs(rpm)) + "rpm.csv";
      run.recording.rig = rig;
      run.recording.experiment = "constant velocity, " + std::to_string(rpm) + " rpm";
      run.recording.comments = {{"source", "RViMLab/TRO2021-Dynamic-Modelling, experiments"}};
      run.recording.columns = {{"time_s", {}}, {"torque_measured_Nm", {}}, {"velocity_rad_per_s", {}}};
      result.data.push_back(std::move(run));
    }
    auto& columns = result.data[at->second].recording.columns;
    columns[0].values.push_back(time[i]);
    columns[1].values.push_back(torque[i]);
    columns[2].values.push_back(velocity[i]);
  }
  return result;
}

}  // namespace real_recordings
