// A hobby servo that lifts a weight: no torque was measured; the firmware's law gives the command.
#include <algorithm>
#include <numbers>

#include "tests/gap/real/converted_drive.h"
#include "tests/gap/real/source_table.h"

namespace real_recordings {
namespace {

constexpr double kGravity_m_per_s2 = 9.80665;
constexpr double kMass_kg = 0.49;
constexpr double kLength_m = 0.1;
constexpr double kCounts = 4096;  // a revolution
// The data sheet's.
constexpr double kTorqueConstant_Nm_per_A = 0.354;
constexpr double kResistance_ohm = 3.4;
// Published for this type of servo.
constexpr double kArmature_kg_m2 = 1.81e-3;
/// The logged value is aliased by the motor's PWM.
constexpr double kSupply_V = 7.4;
constexpr double kCoulomb_Nm = 4.8e-3;
constexpr double kViscous_Nm_s_per_rad = 5.4e-3;

/// The firmware's gain is in 1/256, its duty in 1/885.
double duty(double kp, double error_rad) {
  return std::clamp(kp * error_rad * kCounts / (2 * std::numbers::pi) / (256.0 * 885.0), -1.0, 1.0);
}

}  // namespace

ConvertedDrive pendulum_servo(const std::filesystem::path& folder) {
  constexpr double kTorquePerVolt = kTorqueConstant_Nm_per_A / kResistance_ohm;
  ConvertedDrive result;
  result.base.name = "pendulum-servo";
  result.base.inertia_kg_m2 = kArmature_kg_m2 + kMass_kg * kLength_m * kLength_m;
  result.base.encoder_ticks_per_rev = kCounts;
  result.base.effects = {
      model::effects::make_effect("coulomb", {{"torque_Nm", kCoulomb_Nm}}),
      model::effects::make_effect(
          "viscous",
          {{"coefficient_Nm_s_per_rad", kViscous_Nm_s_per_rad + kTorquePerVolt * kTorqueConstant_Nm_per_A}}),
      model::effects::make_effect("imbalance", {{"torque_Nm", kMass_kg * kGravity_m_per_s2 * kLength_m}})};
  result.remarks = {"Output side. The weight and its lever, and armature, Coulomb and viscous friction as",
                    "published; the viscous coefficient holds the motor's back-EMF, kt^2/R, too, because the",
                    "recordings give the torque that the voltage would make at rest."};
  for (const char* kp : {"100", "200", "400", "800"}) {
    for (const char* motion : {"sin_sin", "sin_time_square", "up_and_down"}) {
      const std::string name = "kp" + std::string(kp) + "_" + motion;
      const SourceTable table(folder / ("xl330_" + name + ".csv"));
      const auto goal = table.column("goal_rad");
      const auto position = table.column("position_rad");
      std::vector<double> torque;
      for (std::size_t i = 0; i < goal.size(); ++i)
        torque.push_back(kTorquePerVolt * kSupply_V * duty(std::stod(kp), goal[i] - position[i]));
      ConvertedRecording run{.file = name + ".csv", .recording = {}};
      run.recording.rig = result.base.name;
      run.recording.experiment = motion;
      run.recording.comments = {{"source", "Rhoban/bam, data.bak/raw"}};
      run.recording.columns = {{"time_s", table.column("t_s")},
                               {"torque_command_Nm", std::move(torque)},
                               {"position_rad", position},
                               {"position_command_rad", goal},
                               {"temperature_C", table.column("temp_C")}};
      // Another gain than any that is searched: a whole one is held out.
      (std::string_view(kp) == "200" ? result.held_out : result.data).push_back(std::move(run));
    }
  }
  return result;
}

}  // namespace real_recordings
