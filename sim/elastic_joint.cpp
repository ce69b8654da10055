#include "sim/elastic_joint.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "sim/bus/arm_joint.h"

namespace sim {
namespace {

constexpr double kStopDampingRatio = 0.5;

void require(bool good, int joint, const char* name, double value) {
  if (!good)
    throw std::invalid_argument("simulated arm joint " + std::to_string(joint) + ": " + name + " cannot be " +
                                std::to_string(value));
}
void require_not_negative(int joint, const char* name, double value) {
  require(std::isfinite(value) && value >= 0, joint, name, value);
}
void require_positive(int joint, const char* name, double value) {
  require(std::isfinite(value) && value > 0, joint, name, value);
}

DriveParameters motor_side(int joint, const bus::ArmJointData& data) {
  require_not_negative(joint, "coulomb_Nm", data.coulomb_Nm);
  require_not_negative(joint, "viscous_Nm_s_per_rad", data.viscous_Nm_s_per_rad);
  require_not_negative(joint, "load_inertia_kg_m2", data.load_inertia_kg_m2);
  require_positive(joint, "gear_ratio", data.axis.gear_ratio);
  require_positive(joint, "torque_constant_Nm_per_A", data.axis.torque_constant_Nm_per_A);
  require_positive(joint, "winding_resistance_ohm", data.axis.winding_resistance_ohm);
  DriveParameters drive = bus::arm_drive_parameters(data);  // tuned for the load that the controller expects
  drive.load_inertia_kg_m2 = 0.0;
  return drive;
}

}  // namespace

ElasticJoint::ElasticJoint(int joint, const bus::ArmJointData& data, const GearGive& gear, double link_kg_m2,
                           double start_rad, std::uint64_t noise_seed)
    : start_rad_(start_rad),
      drive_(motor_side(joint, data), bus::arm_friction(data), noise_seed),
      gear_Nm_per_rad_(gear.stiffness_Nm_per_rad),
      stops_{.lower_rad = data.lower_stop_rad, .upper_rad = data.upper_stop_rad} {
  require_positive(joint, "stiffness_Nm_per_rad of the gear", gear.stiffness_Nm_per_rad);
  require_not_negative(joint, "damping_ratio of the gear", gear.damping_ratio);
  require(data.lower_stop_rad <= start_rad && start_rad <= data.upper_stop_rad, joint, "start_rad",
          start_rad);
  const double rotor_kg_m2 = drive_.inertia_kg_m2();
  const double swinging_kg_m2 = rotor_kg_m2 * link_kg_m2 / (rotor_kg_m2 + link_kg_m2);
  gear_Nm_s_per_rad_ = 2 * gear.damping_ratio * std::sqrt(gear_Nm_per_rad_ * swinging_kg_m2);
  stops_.damping_Nm_s_per_rad = 2 * kStopDampingRatio * std::sqrt(stops_.stiffness_Nm_per_rad * link_kg_m2);
}

void ElasticJoint::control(const hal::JointCommand& command, bool powered, double interval_s) noexcept {
  hal::JointCommand from_start = command;
  if (command.mode == hal::CommandMode::kPosition) from_start.target -= start_rad_;
  drive_.control(from_start, powered, interval_s);
}

void ElasticJoint::sense(double interval_s) noexcept { drive_.sense(interval_s); }

hal::JointSample ElasticJoint::measured() const noexcept {
  hal::JointSample sample = drive_.measured();
  sample.position_rad += start_rad_;
  sample.homed = true;
  return sample;
}

double ElasticJoint::step(double link_rad, double link_rad_per_s, double step_s) noexcept {
  const double before_rad_per_s = drive_.velocity_rad_per_s();
  const double gear_Nm =
      gear_Nm_per_rad_ * (motor_rad() - link_rad) + gear_Nm_s_per_rad_ * (before_rad_per_s - link_rad_per_s);
  drive_.step(gear_Nm, step_s);
  motor_work_J_ += 0.5 * step_s * drive_.motor_torque_Nm() * (before_rad_per_s + drive_.velocity_rad_per_s());
  return gear_Nm - stops_.load_Nm(link_rad, link_rad_per_s);
}

double ElasticJoint::kinetic_energy_J() const noexcept {
  return 0.5 * drive_.inertia_kg_m2() * drive_.velocity_rad_per_s() * drive_.velocity_rad_per_s();
}

double ElasticJoint::elastic_energy_J(double link_rad) const noexcept {
  const double bent_rad = motor_rad() - link_rad;
  const double pressed_rad = link_rad - std::clamp(link_rad, stops_.lower_rad, stops_.upper_rad);
  return 0.5 * gear_Nm_per_rad_ * bent_rad * bent_rad +
         0.5 * stops_.stiffness_Nm_per_rad * pressed_rad * pressed_rad;
}

}  // namespace sim
