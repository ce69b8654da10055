// Geared wheels of an omni-directional robot: speed set-points, coarse speed, magnitude of the current.
#include <stdexcept>

#include "tests/gap/real/converted_drive.h"
#include "tests/gap/real/source_table.h"

namespace real_recordings {
namespace {

constexpr double kGear = 16;
constexpr double kTorqueConstant_Nm_per_A = 0.0514;
// Motor side: where the source's own fit began.
constexpr double kInertia_kg_m2 = 1.46e-6;
constexpr double kCoulomb_Nm = 8.2e-3;
constexpr double kViscous_Nm_s_per_rad = 2.58e-5;

std::vector<double> scaled(std::vector<double> values, double factor) {
  for (double& value : values) value *= factor;
  return values;
}

}  // namespace

ConvertedDrive omni_wheel(const std::filesystem::path& folder, int motor) {
  if (motor < 1 || motor > 3) throw std::invalid_argument("there are motors 1 to 3");
  const std::string own = "m" + std::to_string(motor);
  ConvertedDrive result;
  result.base.name = "omni-wheel-" + std::to_string(motor);
  result.base.inertia_kg_m2 = kInertia_kg_m2 * kGear * kGear;
  result.base.effects = {model::effects::make_effect("coulomb", {{"torque_Nm", kCoulomb_Nm * kGear}}),
                         model::effects::make_effect("viscous", {{"coefficient_Nm_s_per_rad",
                                                                  kViscous_Nm_s_per_rad * kGear * kGear}})};
  result.remarks = {
      "Wheel side of a 16:1 gear. Inertia, Coulomb and viscous friction: where the source's own fit",
      "began."};
  const auto add = [&](std::vector<ConvertedRecording>& to, const std::string& name) {
    const SourceTable table(folder / (name + ".csv"));
    ConvertedRecording run{.file = name + ".csv", .recording = {}};
    run.recording.rig = result.base.name;
    run.recording.experiment = "speed set-point steps";
    run.recording.comments = {{"source", "BrOleg5/research-wheel-slippage"}};
    run.recording.columns = {
        {"time_s", table.column("t_s")},
        {"velocity_command_rad_per_s", scaled(table.column(own + "_set_velocity_rad_s"), 1 / kGear)},
        {"velocity_rad_per_s", scaled(table.column(own + "_velocity_rad_s"), 1 / kGear)},
        {"torque_measured_Nm",
         scaled(table.column(own + "_abs_current_A"), kTorqueConstant_Nm_per_A * kGear)}};
    to.push_back(std::move(run));
  };
  add(result.data, "data_for_identification_without_integral");
  add(result.data, "data_for_identification_with_integral");
  add(result.held_out, "validation_data");
  return result;
}

}  // namespace real_recordings
