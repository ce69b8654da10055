// Measures wheel 1's friction at eight speeds in each direction, fits a Stribeck curve to it, and writes the
// model for `[compensation] models` of youbotd. Wheels in the air.
//   identify_model [ROBOT [MODEL.toml]]
#include <youbot/identification.h>
#include <youbot/robot.h>

#include <cmath>
#include <cstdio>
#include <exception>
#include <fstream>
#include <string>

#include "example_robot.h"

namespace {

/// Mean torque at this speed over two seconds, after one second to settle.
bool measure(ExampleRobot& example, double speed_rad_per_s, youbot::RobotCommand& command,
             youbot::RobotSample& sample, youbot::StaticMap& map) {
  double torque_Nm = 0;
  double begin_rad = 0;
  for (int n = 0; n < 3000; ++n) {
    command.joints[0] = youbot::JointCommand::velocity_rad_per_s(speed_rad_per_s);
    if (!example.cycle(command, sample)) return false;
    if (n == 1000) begin_rad = sample.joints[0].position_rad;
    if (n >= 1000) torque_Nm += sample.joints[0].torque_Nm / 2000;
  }
  const double velocity_rad_per_s = (sample.joints[0].position_rad - begin_rad) / 1.999;
  map.points.push_back({.velocity_rad_per_s = velocity_rad_per_s, .torque_Nm = torque_Nm});
  std::printf("%7.3f rad/s  %7.4f N·m\n", velocity_rad_per_s, torque_Nm);
  return true;
}

}  // namespace

int main(int argc, char** argv) try {
  ExampleRobot example(argc > 1 ? argv[1] : "loopback", /*on_ground=*/false);
  youbot::RobotCommand command;
  youbot::RobotSample sample;
  if (!example.enable(command, sample)) return 1;
  youbot::StaticMap map{.rig = "wheel-1", .points = {}};
  for (const double direction : {1.0, -1.0})
    for (double speed = 0.4; speed < 8; speed *= 1.5)
      if (!measure(example, direction * speed, command, sample, map)) return 1;

  command = {};  // off, and a second to coast down
  for (int n = 0; n < 1000; ++n)
    if (!example.cycle(command, sample)) return 1;

  const youbot::StaticFit fit = youbot::fit_static(map, youbot::form_named("kfm"));
  for (const auto& estimate : fit.parameters)
    std::printf("%s %s: %.4g (%.4g to %.4g)\n", estimate.effect.c_str(), estimate.name.c_str(),
                estimate.value, estimate.lower, estimate.upper);
  for (const std::string& verdict : fit.verdicts) std::printf("! %s\n", verdict.c_str());
  if (!fit.ok()) return 1;
  std::printf("error %.1f %%\n", fit.relative_error_percent);

  youbot::DriveModel model;
  model.name = "wheel-1";
  model.effects = fit.effects;
  const std::string path = argc > 2 ? argv[2] : "model.toml";
  std::ofstream file(path);
  file << youbot::drive_model_text(model);
  file.close();
  if (!file) return std::fprintf(stderr, "%s: cannot be written\n", path.c_str()), 1;
  // As seen by a compensator: FrictionObserver uses this table, as in wheel_torque.cpp.
  const youbot::JointResistance resistance = youbot::resistance_of(youbot::read_drive_model(path));
  std::printf("%s: %.4f N·m at 1 rad/s\n", path.c_str(), resistance.sliding.level_Nm(1.0));
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "identify_model: %s\n", error.what());
  return 1;
}
