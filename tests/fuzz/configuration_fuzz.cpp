// youbotd's configuration and overrides by `set`. Lines "!KEY VALUE" at the beginning are settings, the rest
// is the file.
#include <cmath>
#include <map>
#include <string>
#include <string_view>

#include "operation/config.h"
#include "operation/demo_config.h"
#include "runtime/configuration/toml_reader.h"
#include "tests/fuzz/ceilings.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/memory_file.h"

namespace {

using fuzz::require;
using operation::Config;

/// Negated so that NaN fails.
void within(double value, double least, double most) { require(value >= least && value <= most); }

/// As the comments of demo.toml and teleop.toml, and the readers, say it; ceilings are those of the machine.
void check_ranges(const Config& config) {
  using std::chrono_literals::operator""ms;
  using std::chrono_literals::operator""s;
  const operation::Cycle::Config& cycle = config.cycle;
  require(cycle.period >= 1ms && cycle.period <= 10ms);
  require(cycle.command_timeout >= 2 * cycle.period && cycle.command_timeout <= 2s &&
          cycle.command_timeout <= config.commander_timeout);
  require(config.commander_timeout >= 300ms && config.commander_timeout <= 10s);
  require(config.robot.ethercat.frame_timeout.count() > 0 &&
          config.robot.ethercat.frame_timeout <= cycle.command_timeout);
  within(cycle.controller.wrench_limits.force_N, 0, 200);
  within(cycle.controller.wrench_limits.moment_Nm, 0, 50);
  within(cycle.controller.torque_limit_Nm, 0, 2.5);
  within(cycle.wheel_speed_limit_rad_per_s, 0.1, 30);
  for (int axis = 0; axis < 3; ++axis) {
    within(cycle.controller.stiffness[axis], 0, 5000);
    within(cycle.controller.damping[axis], 0, 2000);
    within(cycle.controller.feedforward_inertia[axis], 0, 200);
  }
  within(cycle.controller.compensator.margin, 0, 1);
  within(cycle.controller.compensator.full_command_Nm, 1e-4, 1);
  const control::BasePath::Limits& path = config.path.limits;
  within(path.speed_m_per_s, 0.001, 0.8);
  within(path.acceleration_m_per_s2, 0.001, 5);
  within(path.turn_speed_rad_per_s, 0.001, 3);
  within(path.turn_acceleration_rad_per_s2, 0.001, 20);
  for (const control::PlanarVector& leg : config.path.displacements_B)
    require(leg.allFinite() && !leg.isZero() && leg.cwiseAbs().maxCoeff() <= 100);
  const auto& teleoperation = config.teleoperation;
  for (const double limit_Nm : teleoperation.robot.arm_torque_limit_Nm) within(limit_Nm, 0.1, 15);
  within(teleoperation.joint_speed_limit_rad_per_s, 0.1, 10);
  within(teleoperation.robot.spring.force_limit_N, 1, 200);
  within(teleoperation.robot.spring.moment_limit_Nm, 0.1, 50);
  within(teleoperation.feedback.force_limit_N, 0.1, 12);
  within(teleoperation.mapping.motion_scale, 0.01, 10);
  require(teleoperation.unfolded_rad.allFinite() && teleoperation.start_p_WT_m.allFinite());
  within(config.robot.simulation.mass_kg, 1, 200);
  for (const sim::Wall& wall : config.robot.scene.walls)
    require(wall.p_W_m.allFinite() && wall.normal_W.allFinite() && wall.normal_W.norm() > 0);
}

/// Takes the lines of settings off the text.
std::map<std::string, std::string> take_settings(std::string_view& text) {
  std::map<std::string, std::string> settings;
  while (text.starts_with('!')) {
    const std::string_view line = text.substr(1, text.find('\n') - 1);
    text.remove_prefix(std::min(text.size(), line.size() + 2));
    const std::size_t blank = std::min(line.find(' '), line.size());
    settings[std::string(line.substr(0, blank))] = line.substr(std::min(blank + 1, line.size()));
  }
  return settings;
}

constexpr std::string_view kTeleoperation =
    "[haptic]\ndevice = \"loopback\"\n[teleoperation.start]\nunfolded_deg = [169, 65, -146, 102.5, 167.5]\n"
    "position_m = [0.35, 0.0, 0.35]\npitch_deg = 120\n[teleoperation.coupling]\nforce_limit_N = 40\n"
    "moment_limit_Nm = 6\n[teleoperation.mapping]\nmotion_scale = 1.0\nrest_deflection_m = 0.01\n"
    "full_deflection_m = 0.05\n[teleoperation.feedback]\nforce_limit_N = 8\npassivity = true\n"
    "detect_release = true\n[teleoperation.buttons]\ngripper = 0\nclutch = 1\n[teleoperation.arm]\n"
    "torque_limit_Nm = [9.5, 9.5, 6.0, 2.0, 1.0]\njoint_speed_limit_rad_per_s = 3\n[scene]\n"
    "[[scene.wall]]\npoint_m = [1, 0, 0]\nnormal = [-1, 0, 0]\nstiffness_N_per_m = 2000\n";

}  // namespace

std::vector<fuzz::Bytes> fuzz::seeds() {
  const std::string demo(operation::kDemoConfig);
  std::vector<Bytes> seeds{bytes_of(demo), bytes_of(kTeleoperation)};
  // The short ones are where a mutation most often changes one value.
  for (const std::string_view text :
       {"!limits.force_N 4\n!path.speed_m_per_s 0.05\n[limits]\nforce_N = 5\n[path]\nspeed_m_per_s = 0.1\n",
        "!path.leg [{forward_m = 1}, {turn_rad = -1}]\n!compensation.models [\"a\", \"b\", \"c\", \"d\"]\n",
        "!controller {damping_N_s_per_m = 9}\n!limits.moment_Nm 1e0\n[limits]\nmoment_Nm = 2\n",
        "!teleoperation.arm.torque_limit_Nm [9, 9, 5, 2, 0.9]\n!teleoperation.feedback.passivity true\n"
        "[teleoperation.arm]\ntorque_limit_Nm = [9, 9, 6, 2, 1]\n",
        "robot = \"ethercat:eth0\"\n[ethercat]\nkind = \"base+arm\"\nframe_timeout_s = 5e-4\n"
        "[[ethercat.parameter]]\njoint = \"wheel-1\"\nname = \"motor_acceleration\"\nvalue = 2000\n",
        "\xfe\xff\n[can]\nmodule_id = 1\n",  // as if in UTF-16
        "[can]\njoint = \"wheel-1\"\nmodule_id = 1\nreply_id = 2\nrequests_per_cycle = 3\n",
        "[loop]\nperiod_s = 0.001\ncommand_timeout_s = 0.1\npriority = 80\n[simulation]\n"
        "loaded_friction_scale = [1.15, 1.30, 1.10, 1.25]\nhidden_effect = 7\n"})
    seeds.push_back(bytes_of(text));
  return seeds;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const fuzz::MemoryFile file;
  const std::string copy(reinterpret_cast<const char*>(data), size);
  std::string_view text = copy;
  const std::map<std::string, std::string> settings = take_settings(text);
  file.hold(text);
  try {
    const Config config = operation::load_config(file.path(), settings);
    check_ranges(config);
    if (!settings.empty()) fuzz::check_ceilings(config, operation::load_config(file.path()));
  } catch (const runtime::ConfigError& error) {
    // Only a file that is no text of lines at all is refused without naming one.
    require(!error.problems().empty());
    for (const std::string& problem : error.problems())
      require(file.names_line(problem) ||
              problem == file.path() + ": is not TOML: look for brackets or quotes that do not match" ||
              problem == file.path() + ": is UTF-16 text: save it as UTF-8" ||
              (!settings.empty() && problem.starts_with("set: ")));
  }
  return 0;
}
