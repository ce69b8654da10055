// youbotd: drives the base at 1 kHz along the path in its configuration, or base and arm by a hand on a
// haptic device.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>
#include <stdexcept>

#include "apps/youbotd/check.h"
#include "apps/youbotd/serve.h"
#include "apps/youbotd/shown_run.h"
#include "drivers/station/key.h"
#include "operation/config.h"
#include "operation/operator_station.h"
#include "operation/report.h"
#include "operation/session.h"
#include "operation/teleop_demo.h"
#include "operation/teleop_session.h"
#include "runtime/configuration/finite_range.h"
#include "runtime/log.h"
#include "runtime/program/build_info.h"
#include "runtime/program/exit_code.h"
#include "runtime/program/json_output.h"
#include "runtime/program/non_blocking_log.h"
#include "runtime/program/run_app.h"
#include "runtime/program/stop_on_signals.h"
#include "runtime/real_time.h"

namespace {

struct Arguments {
  std::string robot;
  std::string haptic;
  std::optional<double> duration_s;
  std::string record_directory;
  std::optional<std::string> record_csv;
  std::string control_socket;
  std::optional<std::string> page;
  std::optional<std::uint32_t> ros2;  // the domain
  bool ros2_commands = false;
  youbotd::ShownRun* shown = nullptr;  // this run
  bool demo = false;
  bool quiet = false;
  bool check = false;
  std::string make_key;
  runtime::Format format = runtime::Format::kText;
  operation::SessionOptions session;
};

void print(const Arguments& arguments, const std::string& text) {
  if (!arguments.quiet) std::fputs(text.c_str(), stdout);
}

int exit_code(const operation::RunSummary& summary) {
  return summary.stop_reason.empty() ? runtime::kExitOk : runtime::kExitFault;
}

/// Errors are printed even with --quiet.
void log_problems(const operation::RunSummary& summary) {
  for (const std::string& problem : summary.not_real_time) spdlog::warn("not real-time: {}", problem);
  for (const std::string& problem : summary.recording_problems) spdlog::warn("recording: {}", problem);
  if (summary.cycles_lost > 0)
    spdlog::warn("recording: {} of {} cycles lost", summary.cycles_lost,
                 summary.cycles_lost + summary.cycles_recorded);
  if (!summary.stop_reason.empty()) spdlog::error("stopped by a fault at {}", summary.stop_reason);
  if (summary.fault_report)
    spdlog::error("the last second before it is in {}", summary.fault_report->string());
}

void show_end(const Arguments& arguments, const operation::RunSummary& summary) {
  if (arguments.shown != nullptr) arguments.shown->finish(summary);
}

/// The haptic device's thread may be refused only what the loop may do without.
void relax(runtime::HapticOptions& haptic) {
  runtime::RealTimeThread attempt;  // released at once
  if (!attempt.enter({.priority = haptic.thread.fifo_priority}).empty()) haptic.thread.fifo_priority = 0;
}

/// The file, with settings and the command line applied.
operation::Config configuration(const Arguments& arguments,
                                const std::map<std::string, std::string>& settings = {}) {
  operation::Config config = operation::load_config(arguments.session.config_file, settings);
  // What the command line gives has no counterpart in the file that could have changed.
  if (!arguments.robot.empty()) {
    runtime::check_robot_name(arguments.robot);
    config.robot.name = arguments.robot;
    config.opened_once["robot"].clear();
  }
  try {
    runtime::check_robot(config.robot);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(arguments.session.config_file.string() + ": " + error.what());
  }
  if (!arguments.haptic.empty()) {
    if (config.role == runtime::Role::kRobot)
      throw std::invalid_argument(
          "--haptic: with role = \"robot\" the haptic device is the one of the operator's station");
    config.haptic.name = arguments.haptic;
    config.teleoperated = true;
    config.opened_once[operation::kHapticDevice].clear();
  }
  if (arguments.session.allow_non_real_time) relax(config.haptic);
  return config;
}

int run_once(const Arguments& arguments, const operation::Config& config) {
  const operation::Summary summary =
      operation::run_session(config, arguments.session, runtime::stop_requested);
  print(arguments, operation::report(summary));
  log_problems(summary);
  show_end(arguments, summary);
  const int code = exit_code(summary);
  return code == runtime::kExitOk && summary.cut_short && runtime::stop_requested ? runtime::kExitInterrupted
                                                                                  : code;
}

/// The same path without and with compensation, each with its own recording.
int run_demo(const Arguments& arguments, operation::Config config) {
  const auto recording_of = [&](bool compensate) {
    auto directory = arguments.session.record_directory;
    if (directory) *directory /= compensate ? "with" : "without";
    return directory;
  };
  for (const bool compensate : {false, true})
    if (const auto directory = recording_of(compensate))
      operation::check_record_directory(*directory, arguments.session.record_format);

  // Without compensation it falls behind, and the comparison shows how far: a simulation may continue. A
  // robot stops, which is a result, too.
  if (runtime::is_simulated(config.robot.name)) config.cycle.allow_any_following_error();
  std::array<operation::Summary, 2> summaries;
  for (const bool compensate : {false, true}) {
    config.cycle.controller.compensate_friction = compensate;
    operation::SessionOptions options = arguments.session;
    options.record_directory = recording_of(compensate);
    print(arguments, compensate ? "\n== with friction compensation\n" : "== without friction compensation\n");
    operation::Summary& summary = summaries[compensate ? 1 : 0];
    summary = operation::run_session(config, options, runtime::stop_requested);
    print(arguments, operation::report(summary));
    if (!compensate && summary.fell_behind) {
      spdlog::info("stopped at {}", summary.stop_reason);
      continue;
    }
    log_problems(summary);
    if (const int code = exit_code(summary)) {
      show_end(arguments, summary);
      return code;
    }
    if (runtime::stop_requested) {
      show_end(arguments, summary);
      spdlog::info("stopped on request, nothing to compare");
      return runtime::kExitInterrupted;
    }
  }
  print(arguments, "\n" + operation::compare(summaries[0], summaries[1]));
  show_end(arguments, summaries[1]);
  return runtime::kExitOk;
}

/// Teleoperation of base and arm.
int run_teleoperation(const Arguments& arguments, const operation::Config& config) {
  operation::TeleopOptions options{static_cast<const operation::AloneOptions&>(arguments.session)};
  if (arguments.demo) options.tasks = operation::demo_tasks();
  const operation::TeleopSummary summary =
      operation::run_teleop_session(config, options, runtime::stop_requested);
  print(arguments, operation::report(summary));
  log_problems(summary);
  show_end(arguments, summary);
  const auto is_open = [](const operation::TaskReport& task) {
    return task.outcome.result == sim::TaskResult::kNotBegun ||
           task.outcome.result == sim::TaskResult::kUnderWay;
  };
  const int code = exit_code(summary);
  if (code == runtime::kExitOk && arguments.session.duration && std::ranges::any_of(summary.tasks, is_open))
    spdlog::warn("--duration ended the demo before the operator had finished");
  return code == runtime::kExitOk && arguments.demo && runtime::stop_requested ? runtime::kExitInterrupted
                                                                               : code;
}

/// Without a robot, until a signal ends it.
int run_station(const Arguments& arguments, const operation::Config& config) {
  if (arguments.session.virtual_time || arguments.demo || arguments.page || arguments.ros2 ||
      arguments.session.record_directory || !arguments.control_socket.empty())
    throw std::invalid_argument(
        "role = \"operator\" has a haptic device only: --demo, --page, --ros2, --record, --control and "
        "--virtual-time belong to the robot's station");
  const operation::StationSummary summary = operation::run_operator_station(
      config,
      {.duration = arguments.session.duration, .allow_non_real_time = arguments.session.allow_non_real_time},
      runtime::stop_requested);
  print(arguments, operation::report(summary));
  if (summary.fault.empty()) return runtime::kExitOk;
  spdlog::error("stopped by a fault: {}", summary.fault);
  return runtime::kExitFault;
}

/// Commanded over a socket, until a signal ends it.
int serve(const Arguments& arguments) {
  youbotd::serve({.service = {.config_file = arguments.session.config_file,
                              .record_directory = arguments.session.record_directory,
                              .record_format = arguments.session.record_format,
                              .configuration =
                                  [&arguments](const std::map<std::string, std::string>& settings) {
                                    return configuration(arguments, settings);
                                  },
                              .ros2_commands = arguments.ros2_commands},
                  .control_socket = arguments.control_socket,
                  .allow_non_real_time = arguments.session.allow_non_real_time,
                  .page = arguments.page,
                  .ros2 = arguments.ros2},
                 runtime::stop_requested);
  return runtime::kExitOk;
}

youbotd::CheckOptions check_options(const Arguments& arguments) {
  return {.record_directory = arguments.session.record_directory,
          .record_format = arguments.session.record_format,
          .virtual_time = arguments.session.virtual_time,
          .allow_non_real_time = arguments.session.allow_non_real_time};
}

int run_check(const Arguments& arguments, const operation::Config& config) {
  youbotd::CheckOptions options = check_options(arguments);
  options.control_socket = arguments.control_socket;
  options.page = arguments.page;
  options.ros2 = arguments.ros2;
  const youbotd::Findings findings = youbotd::check(config, options);
  if (arguments.format == runtime::Format::kJson)
    runtime::print(youbotd::json_of(findings));
  else
    std::fputs(youbotd::report(findings, arguments.quiet).c_str(), stdout);
  return youbotd::passed(findings) ? runtime::kExitOk : runtime::kExitSetup;
}

/// No machine moves and no device exerts a force: a late loop does no harm.
bool is_all_simulated(const operation::Config& config) {
  if (config.role == runtime::Role::kOperator) return runtime::is_simulated_haptic(config.haptic.name);
  return runtime::is_simulated(config.robot.name) &&
         (!config.teleoperated || runtime::is_simulated_haptic(config.haptic.name));
}

/// --record-csv has its own directory or chooses the format of --record.
void choose_recording(Arguments& arguments) {
  std::string directory = arguments.record_directory;
  if (arguments.record_csv) {
    arguments.session.record_format = runtime::RecordingFormat::kCsv;
    if (directory.empty() == arguments.record_csv->empty())
      throw std::invalid_argument("--record-csv: name one directory, behind it or behind --record");
    if (directory.empty()) directory = *arguments.record_csv;
  }
  if (!directory.empty()) arguments.session.record_directory = directory;
}

int run(Arguments arguments) {
  if (!arguments.make_key.empty()) {
    drivers::station::make_key_file(arguments.make_key);
    print(arguments,
          "copy " + arguments.make_key + " to the other station over a trusted channel, mode 0600\n");
    return runtime::kExitOk;
  }
  if (arguments.session.config_file.empty()) throw std::invalid_argument("--config is required");
  const operation::Config config = configuration(arguments);
  if (arguments.duration_s)
    arguments.session.duration = std::chrono::nanoseconds(std::llround(*arguments.duration_s * 1e9));
  choose_recording(arguments);
  if (!arguments.control_socket.empty() &&
      (arguments.session.virtual_time || arguments.demo || arguments.session.duration))
    throw std::invalid_argument(
        "--control serves in real time until it is stopped: not with --virtual-time, "
        "--demo or --duration");
  if ((arguments.page || arguments.ros2) && arguments.session.virtual_time)
    throw std::invalid_argument("--page and --ros2 show real time: not with --virtual-time");
  if (arguments.check) return run_check(arguments, config);
  if (is_all_simulated(config)) arguments.session.allow_non_real_time = true;
  runtime::stop_on_signals();
  if (config.role == runtime::Role::kOperator) return run_station(arguments, config);
  if (!arguments.quiet)
    spdlog::info("{}: running {}{}, {:g} Hz{}", runtime::build_version(), config.robot.name,
                 config.teleoperated ? " by hand on " + config.haptic.name : "",
                 1 / std::chrono::duration<double>(config.cycle.period).count(),
                 arguments.session.virtual_time ? ", virtual time" : "; Ctrl-C stops");
  arguments.session.show_progress = !arguments.quiet && !arguments.session.virtual_time;
  if (!arguments.control_socket.empty()) return serve(arguments);
  if (!arguments.quiet)
    for (const std::string& line : operation::arm_lines(config)) spdlog::info("{}", line);
  if (!config.teleoperated && config.path.displacements_B.empty())
    spdlog::warn("{}: no [[path.leg]], so the base stays where it is",
                 arguments.session.config_file.string());
  std::optional<youbotd::ShownRun> shown;
  if (arguments.page || arguments.ros2) {
    shown.emplace(youbotd::ShownRun::Options{.page = arguments.page, .domain = arguments.ros2}, config,
                  arguments.page ? youbotd::check(config, check_options(arguments)) : youbotd::Findings{},
                  runtime::stop_requested);
    arguments.session.live = &shown->feed();
    arguments.shown = &*shown;
  }
  if (config.teleoperated) return run_teleoperation(arguments, config);
  return arguments.demo ? run_demo(arguments, config) : run_once(arguments, config);
}

}  // namespace

// NOLINTNEXTLINE(bugprone-exception-escape): out of memory before the first message may end the process.
int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app(
      "Drives the youBot's base at 1 kHz along the path in its configuration or, with a haptic device, base "
      "and arm by hand. THIS MOVES A MACHINE AND PUSHES ON A HAND.",
      "youbotd");
  app.footer(
      "Exit codes: 0 done, 2 usage or configuration, 3 device or set-up, 4 stopped by a fault, 130 "
      "interrupted before a path or a demo was done.");
  app.add_option("--config", arguments.session.config_file,
                 "TOML file; demo.toml and teleop.toml, installed in PREFIX/share/youbot-hal, show its keys");
  app.add_option("--robot", arguments.robot,
                 "robot in place of the configured one: loopback, wire, ethercat:IFACE");
  app.add_option("--haptic", arguments.haptic,
                 "teleoperate base and arm with this haptic device: loopback, force-dimension or omega.6, "
                 "falcon, spacemouse");
  app.add_option("--duration", arguments.duration_s, "come to rest after this many seconds of robot time")
      ->check(runtime::finite_range(0.001, 1e6));
  app.add_option("--record", arguments.record_directory,
                 "directory for recordings as MCAP, made if missing: for Foxglove, PlotJuggler, Rerun, "
                 "youbot-gap; youbotctl converts them to CSV");
  app.add_option("--record-csv", arguments.record_csv,
                 "the same as CSV, in a directory named here or by --record")
      ->expected(0, 1);
  app.add_option("--control", arguments.control_socket,
                 "run as a service: keep the drives off until `youbotctl` enables them over this Unix "
                 "socket, and after "
                 "a fault until it is acknowledged and enabled again");
  app.add_option(
         "--page", arguments.page,
         "serve a live page in the browser at HOST:PORT (default: " + std::string(live::kDefaultAddress) +
             "); everyone who can open it sees everything and can stop the robot")
      ->expected(0, 1)
      ->default_str(std::string(live::kDefaultAddress));
  CLI::Option* const ros2 =
      app.add_option(
             "--ros2", arguments.ros2,
             "publish the robot's state to this DDS domain (default: 0) as the node /youbotd of ROS 2; "
             "everyone on the network can read it")
          ->expected(0, 1)
          ->check(CLI::Range(0U, ros2::kMaxDomain))
          ->default_str("0");
  app.add_flag("--ros2-commands", arguments.ros2_commands,
               "with --control, without a haptic device: offer the mode ros2, in which everyone on the "
               "network can steer the base by /cmd_vel while a client of the socket keeps it enabled")
      ->needs(ros2)
      ->needs("--control");
  app.add_flag("--virtual-time", arguments.session.virtual_time,
               "run as fast as the machine allows; only if robot and haptic device are simulated, or with "
               "youbot-sim --lock-step on a bus");
  app.add_flag("--allow-non-rt", arguments.session.allow_non_real_time,
               "continue when the system refuses real-time scheduling or memory locking; it always does when "
               "everything is simulated");
  app.add_flag("--demo", arguments.demo,
               "drive the path without and with friction compensation and compare; with a haptic device: a "
               "simulated operator performs a series of tasks");
  CLI::Option* const check =
      app.add_flag("--check", arguments.check,
                   "check configuration, machine and devices, print what to do, and exit; nothing moves");
  app.add_option("--make-key", arguments.make_key,
                 "write a new key for the link of two stations into this new file, and exit");
  runtime::add_json_flag(app, arguments.format);
  app.get_option("--json")->needs(check)->description("with --check: print JSON, for other programs");
  app.add_flag("--quiet", arguments.quiet, "print problems only");
  std::optional<runtime::NonBlockingLog> log;  // for a service, to log the reason of a refused start
  return runtime::run_app(app, argc, argv, [&] {
    if (!arguments.control_socket.empty()) log.emplace();
    return run(arguments);
  });
}
