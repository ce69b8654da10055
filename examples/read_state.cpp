// Prints what the joints measure, ten times a second for two seconds. The drives stay off: nothing moves.
//   read_state [ROBOT]
#include <youbot/robot.h>

#include <cstdio>
#include <exception>

#include "example_robot.h"

int main(int argc, char** argv) try {
  ExampleRobot example(argc > 1 ? argv[1] : "loopback");
  youbot::Robot& robot = example.robot();
  for (const std::string& note : robot.notes()) std::printf("%s\n", note.c_str());

  const youbot::RobotCommand off;  // the default command keeps every drive off
  youbot::RobotSample sample;
  for (int n = 0; n < 2000; ++n) {
    if (!example.cycle(off, sample)) return 1;
    if (n % 100 != 0) continue;
    std::printf("%.1f s", 1e-3 * n);
    for (std::size_t i = 0; i < robot.joints().size(); ++i)
      std::printf("  %s %.4f rad %.3f rad/s", robot.joints()[i].name.c_str(), sample.joints[i].position_rad,
                  sample.joints[i].velocity_rad_per_s);
    std::printf("\n");
  }
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "read_state: %s\n", error.what());
  return 1;
}
