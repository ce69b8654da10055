// youbot-sim: serves an emulated youBot to any EtherCAT master on the other end of a network cable.

#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "apps/youbot_sim/fault_file.h"
#include "apps/youbot_sim/frame_socket.h"
#include "apps/youbot_sim/robot_recording.h"
#include "apps/youbot_sim/server.h"
#include "drivers/ethercat/simulated_bus.h"
#include "drivers/tmcl/youbot_topology.h"
#include "runtime/configuration/arm_model.h"
#include "runtime/configuration/finite_range.h"
#include "runtime/configuration/hidden_effect.h"
#include "runtime/configuration/scene_config.h"
#include "runtime/log.h"
#include "runtime/program/exit_code.h"
#include "runtime/program/non_blocking_log.h"
#include "runtime/program/run_app.h"
#include "runtime/program/stop_on_signals.h"
#include "runtime/real_time.h"
#include "runtime/simulated_arm.h"
#include "sim/bus/youbot_bus.h"

namespace {

using drivers::tmcl::Firmware;
using drivers::tmcl::kYoubotKinds;
using drivers::tmcl::YoubotKind;
using sim::bus::Hardware;
using sim::bus::MailboxDemand;

const std::map<std::string, YoubotKind> kRobots(kYoubotKinds.begin(), kYoubotKinds.end());
const std::map<std::string, Firmware> kFirmwares{{"148", Firmware::k148}, {"200", Firmware::k200}};
const std::map<std::string, MailboxDemand> kDemands{{"lenient", MailboxDemand::kWhereSiiNames},
                                                    {"strict", MailboxDemand::kAlways}};
const std::map<std::string, Hardware> kGenerations{{"first", Hardware::kFirst}, {"later", Hardware::kLater}};

/// Below a master's, which is 80 by default: if both share a core its cycle comes first.
constexpr int kPriority = 70;

struct Arguments {
  std::string interface;
  std::string robot = "base+arm";
  std::string firmware = "148";
  std::string hardware = "later";
  std::string boards = "lenient";
  std::string faults_file;
  std::string scene_file;
  std::string robot_file;
  std::string record_file;
  std::vector<std::string> model_files;
  std::optional<std::uint64_t> hidden_effect;
  double duration_s = 0.0;
  bool lock_step = false;
  bool quiet = false;
};

/// A real wire takes time here, so emulated round trips stay off.
sim::bus::YoubotBusOptions robot_options(const Arguments& arguments) {
  sim::bus::YoubotBusOptions options;
  options.robot = kRobots.at(arguments.robot);
  options.coupled = options.robot == YoubotKind::kBaseAndArm;
  options.board.firmware = kFirmwares.at(arguments.firmware);
  options.hardware = kGenerations.at(arguments.hardware);
  options.slave.mailbox_demand = kDemands.at(arguments.boards);
  options.wire.timed = false;
  options.mark = arguments.lock_step ? drivers::ethercat::kLockStepMark : drivers::ethercat::kSimulatedMark;
  options.base.models = runtime::simulated_wheel_models(arguments.model_files, arguments.hidden_effect);
  if (!arguments.scene_file.empty()) {
    if (!options.coupled)
      throw std::invalid_argument("--scene needs --robot base+arm: only its end effector can touch objects");
    options.scene = runtime::load_scene(arguments.scene_file);
  }
  if (!arguments.robot_file.empty()) {
    if (!options.coupled)
      throw std::invalid_argument("--robot-file needs --robot base+arm: only its arm has weight");
    runtime::build_arm(runtime::read_arm_model(arguments.robot_file).model, options.masses, options.arm);
  }
  if (!arguments.faults_file.empty())
    options.wire.faults = youbot_sim::load_faults(arguments.faults_file, youbot_boards(options.robot).size());
  return options;
}

youbot_sim::ServerSummary serve(const Arguments& arguments, sim::bus::YoubotBus& robot,
                                youbot_sim::FrameSocket& socket, std::chrono::nanoseconds duration) {
  if (arguments.lock_step)
    return youbot_sim::serve_in_lock_step(robot, socket, duration, runtime::stop_requested);
  runtime::RealTimeThread real_time;  // entered last, when everything is allocated and all other threads run
  for (const std::string& refused : real_time.enter({.priority = kPriority}))
    if (!arguments.quiet) spdlog::info("answers may be late on a busy machine: {}", refused);
  const runtime::NonBlockingLog log;  // otherwise a reader of the log could delay the robot
  return youbot_sim::serve(robot, socket, duration, runtime::stop_requested);
}

int run(const Arguments& arguments) {
  sim::bus::YoubotBus robot(robot_options(arguments));
  youbot_sim::FrameSocket socket(arguments.interface);
  std::optional<youbot_sim::RobotRecording> recording;
  if (!arguments.record_file.empty()) recording.emplace(arguments.record_file, robot, arguments.lock_step);
  runtime::stop_on_signals();
  if (!arguments.quiet) {
    std::printf("serving %zu slaves on %s\n", robot.bus().size(), arguments.interface.c_str());
    std::fflush(stdout);  // scripts wait for this line
  }
  const std::chrono::nanoseconds duration(std::llround(1e9 * arguments.duration_s));
  const youbot_sim::ServerSummary summary = serve(arguments, robot, socket, duration);
  if (!arguments.quiet) std::fputs(youbot_sim::report(summary, robot).c_str(), stdout);
  if (recording) {
    recording->close();
    for (const std::string& problem : recording->problems()) spdlog::warn("recording: {}", problem);
  }
  if (summary.skipped.count() > 0)
    spdlog::warn("the machine was too busy: {:.3f} s did not pass for the robot",
                 std::chrono::duration<double>(summary.skipped).count());
  if (summary.refused > 0) spdlog::warn("{} replies were refused by the interface", summary.refused);
  return runtime::kExitOk;
}

}  // namespace

// NOLINTNEXTLINE(bugprone-exception-escape): out of memory before the first message may end the process.
int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app("Serves an emulated youBot to an EtherCAT master on a raw socket. Needs CAP_NET_RAW.",
               "youbot-sim");
  app.footer("Exit codes: 0 done, 2 usage or configuration, 3 device or set-up.");
  app.add_option("--interface", arguments.interface, "network interface, such as one end of a veth pair")
      ->required();
  app.add_option("--robot", arguments.robot, "boards on the bus")
      ->check(CLI::IsMember(&kRobots))
      ->capture_default_str();
  app.add_option("--firmware", arguments.firmware, "of the motor controllers")
      ->check(CLI::IsMember(&kFirmwares))
      ->capture_default_str();
  app.add_option("--hardware", arguments.hardware, "hardware generation, for the names of the boards")
      ->check(CLI::IsMember(&kGenerations))
      ->capture_default_str();
  app.add_option(
         "--boards", arguments.boards,
         "strict boards need their mailbox to enter PRE-OP; lenient ones do not, for masters that set a "
         "mailbox up only if the EEPROM names a protocol, which these do not. See docs/emulated_bus.md")
      ->check(CLI::IsMember(&kDemands))
      ->capture_default_str();
  app.add_option("--faults", arguments.faults_file,
                 "TOML file that schedules faults; FILE_FORMATS.md has an example")
      ->check(CLI::ExistingFile);
  app.add_option("--scene", arguments.scene_file,
                 "TOML file whose [scene] lists the objects that the end effector can touch, as in youbotd's "
                 "configuration")
      ->check(CLI::ExistingFile);
  app.add_option("--robot-file", arguments.robot_file,
                 "robot file, as youbot-gap robot delivers it, that the arm follows; without it the masses "
                 "differ from the description by up to 5 percent")
      ->check(CLI::ExistingFile);
  app.add_option(
      "--record", arguments.record_file,
      "file, .csv or .mcap, a row for each emulated millisecond: true motion, values reported to the master "
      "and commands followed; FILE_FORMATS.md lists the columns");
  app.add_option("--model", arguments.model_files,
                 "drive model file that the wheels follow, or four, separated by commas; none: the measured "
                 "curves")
      ->delimiter(',');
  app.add_option("--hidden-effect", arguments.hidden_effect,
                 "seed of a hidden effect of the wheels; `youbot-bench reveal` prints it")
      ->check(runtime::finite_range(0, runtime::HiddenEffect::kMaxSeed));
  app.add_flag("--lock-step", arguments.lock_step,
               "each frame advances time by a millisecond, for masters with --virtual-time");
  app.add_option("--duration", arguments.duration_s, "end after this many seconds of the robot's time")
      ->check(runtime::finite_range(0.001, 1e6));
  app.add_flag("--quiet", arguments.quiet, "print problems only");
  return runtime::run_app(app, argc, argv, [&] { return run(arguments); });
}
