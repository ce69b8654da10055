// A controller of your own at 1 kHz: wheel 1 follows a sine by a spring and a damper, and its data are
// recorded. On a simulated robot, or on a real one with its wheels in the air.
//   own_controller [ROBOT [FILE.csv]]
#include <youbot/recording.h>
#include <youbot/robot.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <string>

#include "example_robot.h"

namespace {

struct Row {
  double time_s = 0;
  double torque_command_Nm = 0;
  double torque_measured_Nm = 0;
  double position_rad = 0;
  double velocity_rad_per_s = 0;
};

/// Position in, torque out; one call per millisecond.
class SpringAndDamper {
 public:
  double step(double wanted_rad, double position_rad) noexcept {
    const double error_rad = wanted_rad - position_rad;
    const double rate_rad_per_s = (error_rad - last_error_rad_) / 1e-3;
    last_error_rad_ = error_rad;
    filtered_rad_per_s_ += 0.1 * (rate_rad_per_s - filtered_rad_per_s_);
    return 4.0 * error_rad + 0.2 * filtered_rad_per_s_;
  }

 private:
  double last_error_rad_ = 0;
  double filtered_rad_per_s_ = 0;
};

}  // namespace

int main(int argc, char** argv) try {
  const std::string name = argc > 1 ? argv[1] : "loopback";
  const bool simulated = youbot::is_simulated(name);  // faster than a disk
  ExampleRobot example(name, /*on_ground=*/false);
  youbot::RecordingFile file(argc > 2 ? argv[2] : "own_controller.csv",
                             {{"rig", "wheel-1"}, {"sample_rate_Hz", "1000"}},
                             {{"time_s", 6},
                              {"torque_command_Nm", 6},
                              {"torque_measured_Nm", 6},
                              {"position_rad", 7},
                              {"velocity_rad_per_s", 6}});
  youbot::Recorder<Row> recorder(
      8192,
      [&file](const Row& r) {
        file.append_row(std::array{r.time_s, r.torque_command_Nm, r.torque_measured_Nm, r.position_rad,
                                   r.velocity_rad_per_s});
      },
      [&file] { file.flush(); });

  // Last, when everything is allocated: SCHED_FIFO and locked memory, if the system allows.
  youbot::RealTimeThread real_time;
  for (const std::string& refused : real_time.enter({})) std::printf("not real-time: %s\n", refused.c_str());

  youbot::RobotCommand command;
  youbot::RobotSample sample;
  if (!example.enable(command, sample)) return 1;
  SpringAndDamper controller;
  const double start_rad = sample.joints[0].position_rad;
  double worst_rad = 0;
  bool followed = true;
  for (int n = 0; n < 4000; ++n) {
    const double wanted_rad = start_rad + std::sin(2 * 3.14159265 * 0.5 * 1e-3 * n);
    const youbot::JointSample& wheel = sample.joints[0];
    worst_rad = std::max(worst_rad, std::abs(wanted_rad - wheel.position_rad));
    const double torque_Nm = controller.step(wanted_rad, wheel.position_rad);
    command.joints[0] = youbot::JointCommand::torque_Nm(torque_Nm);
    followed = example.cycle(command, sample);
    if (!followed) break;
    if (simulated) recorder.wait_for_room();
    recorder.push({1e-3 * n, torque_Nm, wheel.torque_Nm, wheel.position_rad, wheel.velocity_rad_per_s});
  }
  recorder.stop();
  file.close();
  if (!file.error().empty()) std::fprintf(stderr, "%s\n", file.error().c_str());
  std::printf("furthest from the sine: %.3f rad; %llu rows\n", worst_rad,
              static_cast<unsigned long long>(file.rows_written()));
  return followed && file.error().empty() ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "own_controller: %s\n", error.what());
  return 1;
}
