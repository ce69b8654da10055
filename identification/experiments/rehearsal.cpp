#include "identification/experiments/rehearsal.h"

#include <cmath>
#include <cstdint>

namespace identification::experiments {
namespace {

void note(Demand& demand, const hal::JointCommand& command, const Reading& reading) {
  const double size = std::abs(command.target);
  if (command.mode == hal::CommandMode::kTorque) {
    demand.by_torque = true;
    demand.torque_Nm = std::max(demand.torque_Nm, size);
    return;
  }
  demand.speed_rad_per_s = std::max(demand.speed_rad_per_s, size);
  const double velocity = reading.velocity_rad_per_s;
  const double end_rad =
      reading.position_rad + std::copysign(stopping_distance_rad(std::abs(velocity)), velocity);
  demand.lowest_rad = std::min(demand.lowest_rad, end_rad);
  demand.highest_rad = std::max(demand.highest_rad, end_rad);
}

}  // namespace

Demand rehearse(JointExperiment& experiment, int first_measurement, double period_s) {
  Demand demand;
  Reading reading;
  for (int measurement = first_measurement; measurement < experiment.measurement_count(); ++measurement) {
    reading.time_s = 0.0;
    experiment.begin(measurement, reading);
    for (std::int64_t cycle = 0; !experiment.finished(); ++cycle) {
      reading.time_s = static_cast<double>(cycle) * period_s;
      const hal::JointCommand command = experiment.step(reading).command;
      const bool by_velocity = command.mode == hal::CommandMode::kVelocity;
      reading.velocity_rad_per_s =
          by_velocity ? gently(reading.velocity_rad_per_s, command.target, period_s) : 0.0;
      reading.position_rad += reading.velocity_rad_per_s * period_s;
      reading.command_Nm = by_velocity ? kUnknown : command.target;
      note(demand, command, reading);
    }
  }
  return demand;
}

}  // namespace identification::experiments
