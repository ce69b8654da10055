#include "apps/common/open_robot.h"

#include <stdexcept>
#include <vector>

#include "hal/axis_scale.h"
#include "hal/loopback_robot.h"
#include "hal/youbot_axes.h"

namespace apps {
namespace {

std::vector<hal::JointInfo> wheel_joints() {
  const hal::AxisData& axis = hal::kWheelAxis;
  const double limit_Nm =
      axis.current_limit_A * axis.constants.torque_constant_Nm_per_A * axis.constants.gear_ratio;
  return {{"wheel-1", limit_Nm}, {"wheel-2", limit_Nm}, {"wheel-3", limit_Nm}, {"wheel-4", limit_Nm}};
}

/// The simulated drive is the real axis: same gear, motor constant, current limit and sensor counts.
sim::BaseParameters with_youbot_wheels(sim::BaseParameters parameters) {
  const hal::AxisData& axis = hal::kWheelAxis;
  const hal::AxisScale scale(axis.constants);
  parameters.drive.gear_ratio = axis.constants.gear_ratio;
  parameters.drive.motor.torque_constant_Nm_per_A = axis.constants.torque_constant_Nm_per_A;
  parameters.drive.motor.current_limit_A = axis.current_limit_A;
  parameters.drive.sensors.position_resolution_rad = scale.position_resolution_rad();
  parameters.drive.sensors.velocity_resolution_rad_per_s = scale.velocity_resolution_rad_per_s();
  parameters.drive.sensors.torque_resolution_Nm = scale.torque_resolution_Nm();
  return parameters;
}

}  // namespace

OpenedRobot open_robot(const std::string& name, const sim::BaseParameters& simulation,
                       const hal::Clock& clock, std::chrono::nanoseconds period) {
  if (name != "loopback")
    throw std::invalid_argument("--robot: there is no '" + name + "'; this build has: loopback");
  OpenedRobot opened;
  opened.simulation = std::make_unique<sim::Base>(with_youbot_wheels(simulation));
  opened.robot = std::make_unique<hal::LoopbackRobot>(*opened.simulation, clock, period, wheel_joints());
  return opened;
}

}  // namespace apps
