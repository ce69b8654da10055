#include "sim/bus/arm_joint.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

namespace sim::bus {
namespace {

constexpr double kStopDampingRatio = 0.5;
constexpr double kBristleStiffness_Nm_per_rad = 2000.0;
constexpr double kVelocityBandwidth_per_s = 30.0;  // of the drive's velocity loop; its integral has a third
                                                   // of it
/// As in sim::Base: the stiffest part, √(20000 / 0.07 kg·m²) = 530 rad/s, gets 40 steps per radian.
constexpr std::int64_t kSteps_per_s = 20'000;

}  // namespace

DriveParameters arm_drive_parameters(const ArmJointData& data) {
  const BoardAxis& axis = data.axis;
  DriveParameters p;
  p.motor.torque_constant_Nm_per_A = axis.torque_constant_Nm_per_A;
  p.motor.current_limit_A = axis.current_limit_A;
  p.motor.resistance_ohm = axis.winding_resistance_ohm;
  p.motor.supply_V = axis.supply_V;
  p.motor.rotor_inertia_kg_m2 = data.rotor_inertia_kg_m2;
  p.gear_ratio = axis.gear_ratio;
  p.load_inertia_kg_m2 = data.load_inertia_kg_m2;
  const double inertia =
      p.load_inertia_kg_m2 + p.motor.rotor_inertia_kg_m2 * axis.gear_ratio * axis.gear_ratio;
  p.presliding = {kBristleStiffness_Nm_per_rad, 0.2 * std::sqrt(inertia * kBristleStiffness_Nm_per_rad)};
  // The wheel's sensors, behind another gear: they are on the motor.
  const DriveParameters wheel;
  const double slower = wheel.gear_ratio / axis.gear_ratio;
  const double stronger = axis.gear_ratio * axis.torque_constant_Nm_per_A /
                          (wheel.gear_ratio * wheel.motor.torque_constant_Nm_per_A);
  p.sensors.position_resolution_rad = 2 * std::numbers::pi / (axis.ticks_per_motor_rev * axis.gear_ratio);
  p.sensors.velocity_resolution_rad_per_s *= slower;
  p.sensors.velocity_noise_rad_per_s *= slower;
  p.sensors.torque_resolution_Nm *= stronger;
  p.sensors.torque_noise_Nm *= stronger;
  p.velocity_gain_Nm_s_per_rad = kVelocityBandwidth_per_s * inertia;
  p.velocity_integral_gain_Nm_per_rad = p.velocity_gain_Nm_s_per_rad * kVelocityBandwidth_per_s / 3;
  return p;
}

model::friction::SlidingTable arm_friction(const ArmJointData& data) {
  return {
      [&data](double velocity) { return data.coulomb_Nm + data.viscous_Nm_s_per_rad * std::abs(velocity); },
      {.breakaway_band_rad_per_s = 0}};
}

ArmJoint::ArmJoint(const ArmJointData& data, double start_rad, std::uint64_t noise_seed)
    : start_rad_(start_rad),
      stops_{.lower_rad = data.lower_stop_rad, .upper_rad = data.upper_stop_rad},
      homes_upwards_(data.upper_stop_rad == 0),
      drive_(arm_drive_parameters(data), arm_friction(data), noise_seed) {
  stops_.damping_Nm_s_per_rad =
      2 * kStopDampingRatio * std::sqrt(stops_.stiffness_Nm_per_rad * drive_.inertia_kg_m2());
  if (!(data.lower_stop_rad <= start_rad && start_rad <= data.upper_stop_rad))
    throw std::invalid_argument("simulated arm joint: it cannot start at " + std::to_string(start_rad) +
                                " rad, outside its end stops");
}

void ArmJoint::command(const hal::JointCommand& command, bool powered) noexcept {
  command_ = command;
  powered_ = powered;
}

hal::JointSample ArmJoint::measured() const noexcept {
  hal::JointSample sample = drive_.measured();
  sample.position_rad += start_rad_;
  return sample;
}

void ArmJoint::block_at(double position_rad) noexcept {
  (homes_upwards_ ? stops_.upper_rad : stops_.lower_rad) = position_rad;
}

void ArmJoint::advance(std::chrono::nanoseconds period) noexcept {
  const double period_s = std::chrono::duration<double>(period).count();
  drive_.control(command_, powered_, period_s);
  const std::int64_t steps = std::max<std::int64_t>(1, period.count() * kSteps_per_s / 1'000'000'000);
  const double step_s = period_s / static_cast<double>(steps);
  for (std::int64_t n = 0; n < steps; ++n)
    drive_.step(stops_.load_Nm(position_rad(), velocity_rad_per_s()), step_s);
  drive_.sense(period_s);
}

}  // namespace sim::bus
