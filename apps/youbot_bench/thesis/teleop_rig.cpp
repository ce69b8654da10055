#include "apps/youbot_bench/thesis/teleop_rig.h"

#include "apps/youbot_bench/thesis/workshop.h"

namespace youbot_bench::thesis {
namespace {

constexpr std::chrono::milliseconds kCycle{1};

runtime::RobotOptions base_and_arm(bool on_ground) {
  runtime::RobotOptions options;
  options.ethercat.kind = hal::YoubotKind::kBaseAndArm;
  options.simulation.on_ground = on_ground;
  return options;
}

runtime::HapticOptions pen() {
  runtime::HapticOptions options;
  options.hand.travel = sim::GripTravel{};
  return options;
}

operation::TeleopCycle::Config cycle_of(const control::Teleoperation::Config& control) {
  operation::TeleopCycle::Config config;
  config.control = control;
  return config;
}

}  // namespace

TeleopRig::TeleopRig(const control::Teleoperation::Config& config, bool on_ground)
    : robot_(runtime::open_robot(base_and_arm(on_ground), clock_, kCycle)),
      master_(runtime::open_haptic(pen(), clock_, kCycle)),
      cycle_(cycle_of(config), *robot_.robot, *master_.device),
      activation_(*robot_.robot) {
  master_.device->activate();
}

const operation::TeleopRecord& TeleopRig::step() {
  if (cycles_++ % 256 == 0) Workshop::go_on();
  clock_.sleep_until(clock_.now() + kCycle);
  cycle_.step(clock_.now());
  operation::add_truth(cycle_.record(), robot_.manipulator->X_WT().translation(),
                       robot_.manipulator->contact_force_W_N());
  return cycle_.record();
}

bool TeleopRig::run_until(control::TeleopPhase wanted, std::chrono::seconds limit,
                          const std::function<void(const operation::TeleopRecord&)>& each) {
  for (std::chrono::nanoseconds t{}; t < limit && !finished(); t += kCycle) {
    const operation::TeleopRecord& record = step();
    if (each) each(record);
    if (phase() == wanted) return true;
  }
  return false;
}

control::Teleoperation::Config usual_teleoperation() {
  control::Teleoperation::Config config;
  config.robot.base.wrench_limits = {.force_N = 60.0, .moment_Nm = 20.0};
  return config;
}

}  // namespace youbot_bench::thesis
