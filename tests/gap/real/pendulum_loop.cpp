// The servo that lifts a weight, as its set-points: the firmware's law stands in the model.
#include <cmath>
#include <numbers>
#include <string>

#include "tests/gap/real/converted_drive.h"
#include "tests/gap/real/source_table.h"

namespace real_recordings {
namespace {

constexpr double kGravity_m_per_s2 = 9.80665;
constexpr double kMass_kg = 0.49;
constexpr double kLength_m = 0.1;
constexpr double kCounts = 4096;  // a revolution
// Published for this type of servo, from other recordings.
constexpr double kTorqueConstant_Nm_per_A = 0.366;
constexpr double kResistance_ohm = 2.81;
constexpr double kArmature_kg_m2 = 1.81e-3;
constexpr double kCoulomb_Nm = 4.8e-3;
constexpr double kViscous_Nm_s_per_rad = 5.4e-3;
constexpr double kSupply_V = 7.4;

/// The firmware's gain is in 1/256, its duty in 1/885.
double gain_V_per_rad(double kp) {
  return kSupply_V * kp * kCounts / (2 * std::numbers::pi) / (256.0 * 885.0);
}

}  // namespace

ConvertedDrive pendulum_loop(const std::filesystem::path& folder, const std::string& held_out_kp) {
  ConvertedDrive result;
  result.base.name = "pendulum-loop";
  result.base.inertia_kg_m2 = kArmature_kg_m2 + kMass_kg * kLength_m * kLength_m;
  result.base.encoder_ticks_per_rev = kCounts;
  result.base.servo = model::ServoLaw{.output = model::ServoLaw::Output::kVoltage,
                                      .position_gain = gain_V_per_rad(400),
                                      .limit = kSupply_V,
                                      .torque_constant_Nm_per_A = kTorqueConstant_Nm_per_A,
                                      .resistance_ohm = kResistance_ohm};
  result.base.effects = {
      model::effects::make_effect("coulomb", {{"torque_Nm", kCoulomb_Nm}}),
      model::effects::make_effect("viscous", {{"coefficient_Nm_s_per_rad", kViscous_Nm_s_per_rad}}),
      model::effects::make_effect("imbalance", {{"torque_Nm", kMass_kg * kGravity_m_per_s2 * kLength_m}})};
  result.remarks = {"Output side. The weight and its lever; armature, friction and motor as published."};
  for (const char* kp : {"100", "200", "400", "800"}) {
    for (const char* motion : {"sin_sin", "sin_time_square", "up_and_down", "lift_and_drop"}) {
      const std::string name = "kp" + std::string(kp) + "_" + motion;
      const SourceTable table(folder / ("xl330_" + name + ".csv"));
      ConvertedRecording run{.file = name + ".csv", .recording = {}};
      run.recording.rig = result.base.name;
      run.recording.experiment = motion;
      run.recording.comments = {{"source", "Rhoban/bam, data.bak/raw"},
                                {"servo.position_gain", std::to_string(gain_V_per_rad(std::stod(kp)))}};
      run.recording.columns = {{"time_s", table.column("t_s")},
                               {"position_rad", table.column("position_rad")},
                               {"position_command_rad", table.column("goal_rad")},
                               {"servo_enabled", table.column("torque_enable")}};
      (kp == held_out_kp ? result.held_out : result.data).push_back(std::move(run));
    }
  }
  return result;
}

}  // namespace real_recordings
