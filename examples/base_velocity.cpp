// Drives the base 0.1 m/s forward while it turns 0.2 rad/s, for four seconds, and prints the odometry.
//   base_velocity [ROBOT]       THE BASE MOVES: 0.4 m, on the floor; keep people away
#include <youbot/kinematics.h>
#include <youbot/robot.h>

#include <algorithm>
#include <cstdio>
#include <exception>

#include "example_robot.h"

namespace {

youbot::WheelVector wheel_positions(const youbot::RobotSample& sample) {
  youbot::WheelVector position_rad;
  for (int i = 0; i < 4; ++i) position_rad[i] = sample.joints[static_cast<std::size_t>(i)].position_rad;
  return position_rad;
}

}  // namespace

int main(int argc, char** argv) try {
  ExampleRobot example(argc > 1 ? argv[1] : "loopback");
  youbot::RobotCommand command;
  youbot::RobotSample sample;
  if (!example.enable(command, sample)) return 1;

  const youbot::LinkMap map = youbot::LinkMap::with_geometry({});
  const youbot::PlanarVector wanted_B{0.1, 0.0, 0.2};  // m/s, m/s, rad/s
  youbot::BaseOdometry odometry(map);
  for (int n = 0; n < 4000; ++n) {
    // The speed rises and falls over half a second.
    const double share = std::clamp(std::min(n, 3999 - n) / 500.0, 0.0, 1.0);
    const youbot::WheelVector speed_rad_per_s = map.wheel_velocity(share * wanted_B);
    for (int i = 0; i < 4; ++i)
      command.joints[static_cast<std::size_t>(i)] =
          youbot::JointCommand::velocity_rad_per_s(speed_rad_per_s[i]);
    if (!example.cycle(command, sample)) return 1;
    odometry.step(wheel_positions(sample));
    if (n % 500 == 0 || n == 3999)
      std::printf("%.1f s  x %.3f m  y %.3f m  yaw %.3f rad\n", 1e-3 * n, odometry.pose().x_m,
                  odometry.pose().y_m, odometry.pose().yaw_rad);
  }
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "base_velocity: %s\n", error.what());
  return 1;
}
