// Applies a small torque to wheel 1, wheels in the air: without compensation friction holds it, with
// compensation it turns.
//   wheel_torque [ROBOT]        a real robot stands on blocks
#include <youbot/friction.h>
#include <youbot/robot.h>

#include <cmath>
#include <cstdio>
#include <exception>

#include "example_robot.h"

namespace {

constexpr double kPush_Nm = 0.05;

/// Rotation of wheel 1 in two seconds.
double push(ExampleRobot& example, bool compensate) {
  youbot::RobotCommand command;
  youbot::RobotSample sample;
  if (!example.enable(command, sample)) return NAN;

  // The measured friction of this wheel, and the compensated share.
  youbot::FrictionObserver observer(youbot::wheel_table(1), {});
  const youbot::FrictionCompensator compensator({.margin = 0.9});
  observer.reset(sample.joints[0].position_rad);
  const double start_rad = sample.joints[0].position_rad;
  for (int n = 0; n < 2000; ++n) {
    const youbot::FrictionEstimate estimate = observer.step(sample.joints[0].position_rad);
    double torque_Nm = kPush_Nm;
    if (compensate) torque_Nm += compensator.torque_Nm(kPush_Nm, estimate, observer);
    command.joints[0] = youbot::JointCommand::torque_Nm(torque_Nm);
    if (!example.cycle(command, sample)) return NAN;
  }
  const double turned_rad = sample.joints[0].position_rad - start_rad;
  command = {};  // off, and a second to coast down
  for (int n = 0; n < 1000; ++n)
    if (!example.cycle(command, sample)) return NAN;
  return turned_rad;
}

}  // namespace

int main(int argc, char** argv) try {
  ExampleRobot example(argc > 1 ? argv[1] : "loopback", /*on_ground=*/false);
  for (const bool compensate : {false, true}) {
    const double turned_rad = push(example, compensate);
    if (std::isnan(turned_rad)) return 1;
    std::printf("%.2f N·m for 2 s %s compensation: wheel-1 turned %.3f rad\n", kPush_Nm,
                compensate ? "with" : "without", turned_rad);
  }
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "wheel_torque: %s\n", error.what());
  return 1;
}
