// youbot-bench: look at a bus, measure drives.
#include <CLI/CLI.hpp>
#include <cstdint>
#include <cstdio>
#include <map>
#include <string>

#include "apps/common/exit_code.h"
#include "apps/common/finite_range.h"
#include "apps/common/hidden_effect.h"
#include "apps/common/run_app.h"
#include "apps/common/stop_on_signals.h"
#include "apps/youbot_bench/bus.h"
#include "apps/youbot_bench/curve.h"
#include "apps/youbot_bench/diagnose.h"
#include "apps/youbot_bench/experiments_cli.h"
#include "apps/youbot_bench/haptic_hold.h"
#include "apps/youbot_bench/identify.h"
#include "apps/youbot_bench/improve.h"
#include "apps/youbot_bench/parameters.h"
#include "apps/youbot_bench/scan.h"
#include "apps/youbot_bench/transparency.h"
#include "apps/youbot_bench/usb_probe.h"
#include "identification/fit/static_fit.h"
#include "model/friction/any_law.h"

namespace {

using apps::finite_range;

/// "coulomb, viscous, …"
std::string law_names() {
  std::string names;
  for (const auto& law : model::friction::law_descriptions())
    if (identification::fit::form_of_law(law)) (names += names.empty() ? "" : ", ") += law.name;
  return names;
}

}  // namespace

// NOLINTNEXTLINE(bugprone-exception-escape): out of memory before the first message may end the process.
int main(int argc, char** argv) {
  CLI::App app("Looks at a youBot's bus and measures its drives.", "youbot-bench");
  app.footer("Exit codes: 0 done, 2 usage or configuration, 3 device or set-up, 4 a fault.");
  app.require_subcommand(1);

  youbot_bench::CurveOptions curve;
  CLI::App* const curve_command = app.add_subcommand("curve", "print the measured friction curve of a wheel");
  curve_command->add_option("--wheel", curve.wheel, "number of the wheel")
      ->check(finite_range(1, 4))
      ->required();
  curve_command->add_option("--from", curve.from_rad_per_s, "rad/s")
      ->check(finite_range(-1000, 1000))
      ->capture_default_str();
  curve_command->add_option("--to", curve.to_rad_per_s, "rad/s")
      ->check(finite_range(-1000, 1000))
      ->capture_default_str();
  curve_command->add_option("--step", curve.step_rad_per_s, "rad/s")
      ->check(finite_range(1e-6, 1000))
      ->capture_default_str();
  curve_command->add_flag("--quiet", curve.quiet,
                          "the table only, without a remark on where nothing was measured");

  std::string robot;
  CLI::App* const scan_command =
      app.add_subcommand("scan", "list the slaves on the bus and how they are cabled; changes nothing");
  const char* const buses =
      "ethercat:IFACE, or wire: an emulated base with an arm; loopback and can:IFACE "
      "have no EtherCAT bus";
  scan_command->add_option("--robot", robot, buses)->required();

  youbot_bench::ParametersOptions parameters;
  CLI::App* const parameters_command = app.add_subcommand(
      "parameters",
      "print all axis parameters of all motor controllers, or set some; takes the bus to PRE-OP");
  parameters_command
      ->add_option("--robot", parameters.robot,
                   "ethercat:IFACE, can:IFACE, or wire: an emulated base with an arm; loopback has none")
      ->required();
  parameters_command->add_option("--config", parameters.config,
                                 "TOML file whose [can] says what is on can:IFACE, an experiment.toml too");
  parameters_command
      ->add_option("--joint", parameters.joints,
                   "wheel-1, arm-5, …; slave-2 on a bus that is no complete youBot; none: all")
      ->delimiter(',');
  CLI::Option* const set =
      parameters_command
          ->add_option(
              "--set", parameters.settings,
              "NAME=VALUE, written to --joint and read back; until the drive loses its power. Not while "
              "the motor turns or is held, nor what the manufacturer's password protects")
          ->type_size(1)
          ->delimiter(',');
  parameters_command
      ->add_flag("--store", parameters.store, "also keep it in EEPROM, which wears out: not again and again")
      ->needs(set);

  youbot_bench::DiagnoseOptions diagnose;
  CLI::App* const diagnose_command = app.add_subcommand(
      "diagnose", "cycle the bus with the motors stopped and tell how frames, slaves and cables fare");
  diagnose_command->add_option("--robot", robot, buses)->required();
  diagnose_command->add_option("--duration", diagnose.duration_s, "seconds")
      ->check(finite_range(0.1, 1e6))
      ->capture_default_str();
  diagnose_command->add_option("--capture", diagnose.capture,
                               "pcapng file for the last second of frames, for Wireshark");
  diagnose_command->add_flag("--quiet", diagnose.quiet, "no progress");

  youbot_bench::UsbProbeOptions usb_probe;
  CLI::App* const usb_probe_command = app.add_subcommand(
      "usb-probe", "list haptic masters on USB and whether they can be used; claims and sends nothing");
  usb_probe_command->add_option("--vendor", usb_probe.vendor, "only this vendor's, hexadecimal");
  usb_probe_command->add_option("--product", usb_probe.product, "only this product, hexadecimal");
  usb_probe_command->add_flag("--all", usb_probe.all, "also what is no haptic master");
  CLI::Option* const probe_out =
      usb_probe_command->add_option("--out", usb_probe.out, "file that gets the report, too");
  usb_probe_command->add_flag("--watch", usb_probe.watch, "go on and tell who comes and goes; Ctrl-C ends it")
      ->excludes(probe_out);

  youbot_bench::HapticHoldOptions hold;
  CLI::App* const hold_command = app.add_subcommand(
      "haptic-hold", "hold a haptic master's pen at a point by springs. THIS PUSHES ON A HAND");
  hold_command->add_option("--haptic", hold.haptic,
                           "loopback, force-dimension, falcon, spacemouse; none: the file's, else loopback");
  hold_command->add_option("--config", hold.config, "TOML file with a [haptic] table");
  hold_command->add_option("--stiffness", hold.stiffness_N_per_m, "N/m")
      ->check(finite_range(0.0, youbot_bench::kMostHoldStiffness_N_per_m))
      ->capture_default_str();
  hold_command->add_option("--damping", hold.damping_N_s_per_m, "N·s/m")
      ->check(finite_range(0.0, youbot_bench::kMostHoldDamping_N_s_per_m))
      ->capture_default_str();
  hold_command
      ->add_option("--point", hold.point_m,
                   "x y z in m, from the device's origin: x towards the user, y to the right, z up")
      ->check(finite_range(-0.2, 0.2))
      ->capture_default_str();
  hold_command->add_option("--duration", hold.duration_s, "seconds")
      ->check(finite_range(0.1, 3600.0))
      ->capture_default_str();
  hold_command->add_option("--out", hold.out, "directory for haptic.csv and report.html");
  hold_command->add_flag("--virtual-time", hold.virtual_time, "as fast as the machine allows (loopback)");
  hold_command->add_flag("--allow-non-rt", hold.allow_non_real_time,
                         "go on when the system refuses real-time scheduling or memory locking");
  hold_command->add_flag("--quiet", hold.quiet, "print problems only");

  youbot_bench::TransparencyOptions transparency;
  CLI::App* const transparency_command = app.add_subcommand(
      "transparency", "measure how the robot feels and follows through teleoperation; in the simulation");
  transparency_command->add_option("--config", transparency.config,
                                   "youbotd's TOML file, such as teleop.toml");
  transparency_command->add_option("--robot", transparency.robot, "loopback; none: the file's");
  transparency_command->add_option("--haptic", transparency.haptic, "loopback; none: the file's");
  transparency_command
      ->add_option("--feedback", transparency.feedback, "position-error, none, or both with a comma between")
      ->delimiter(',')
      ->capture_default_str();
  transparency_command
      ->add_option("--stiffness", transparency.stiffness_N_per_m,
                   "of the coupling, N/m; several with commas between")
      ->delimiter(',')
      ->check(finite_range(1.0, youbot_bench::kMostCoupling_N_per_m))
      ->capture_default_str();
  transparency_command->add_option("--axis", transparency.axis, "x forward, y left, z up")
      ->capture_default_str();
  transparency_command
      ->add_option("--peak", transparency.excitation.peak_N, "largest force of the excitation, N")
      ->check(finite_range(1e-3, 100.0))
      ->capture_default_str();
  transparency_command->add_option("--lowest", transparency.excitation.lowest_Hz, "frequency, Hz")
      ->check(finite_range(1e-3, 500.0))
      ->capture_default_str();
  transparency_command->add_option("--highest", transparency.excitation.highest_Hz, "frequency, Hz")
      ->check(finite_range(1e-3, 500.0))
      ->capture_default_str();
  transparency_command->add_option("--lines", transparency.excitation.lines, "number of frequencies")
      ->check(finite_range(3, 500))
      ->capture_default_str();
  transparency_command->add_option("--period", transparency.excitation.period_s, "of the excitation, s")
      ->check(finite_range(0.1, 1000.0))
      ->capture_default_str();
  transparency_command
      ->add_option("--realizations", transparency.realizations, "excitations with other phases")
      ->check(finite_range(2, 100))
      ->capture_default_str();
  transparency_command
      ->add_option("--out", transparency.out, "directory for a CSV file of each condition, and report.html")
      ->required();
  transparency_command->add_flag("--quiet", transparency.quiet, "print problems only");

  youbot_bench::ExperimentCommands experiments(app);

  youbot_bench::IdentifyOptions identify;
  CLI::App* const identify_command = app.add_subcommand(
      "identify", "fit a drive model to recordings; says so where they do not determine a parameter");
  identify_command->add_option("--map", identify.maps,
                               "steady-state maps, one row per speed, or directories of them");
  identify_command->add_option("--moving", identify.moving,
                               "recording with changing velocity: inertia, friction");
  identify_command->add_option(
      "--presliding", identify.presliding,
      "recording below break-away: stiffness and damping; with --map and the inertia");
  identify_command
      ->add_option("--law", identify.law,
                   "fitted to a map: auto, which chooses the terms, or one of " + law_names() +
                       ", with +offset, +asymmetry, +quadratic as wanted")
      ->capture_default_str();
  identify_command
      ->add_option("--speeds-above", identify.speeds.above_rad_per_s,
                   "fit the map's speeds from this one on, rad/s")
      ->check(finite_range(0, 1e6))
      ->capture_default_str();
  identify_command
      ->add_option("--speeds-below", identify.speeds.below_rad_per_s,
                   "fit the map's speeds up to this one, rad/s; when less than --speeds-above, what "
                   "lies between is left out")
      ->check(finite_range(0, 1e6));
  identify_command->add_option("--inertia", identify.inertia_kg_m2, "kg·m², joint side, when it is known")
      ->check(finite_range(1e-12, 1e6));
  identify_command->add_option("--out", identify.out, "directory for model.toml and report.html")->required();
  identify_command->add_flag("--quiet", identify.quiet, "print problems only");

  using Stage = youbot_bench::ImproveOptions::Stage;
  youbot_bench::ImproveOptions improve;
  CLI::App* const improve_command =
      app.add_subcommand("improve",
                         "find what the model of the wheels lacks, compensate it and drive better: "
                         "experiments, search, demo. ON A ROBOT THIS MOVES A MACHINE");
  improve_command->footer(
      "On a real robot the wheels turn first, lifted off the ground; then the base drives the demo path and "
      "its mirror image, twice, each from where it stands: keep 4 m by 4 m free, or carry it back. It asks "
      "on the terminal before each; without one, --stage measure --yes and --stage drive --yes, set down in "
      "between. Its path error is that of the wheels' odometry.\n"
      "A simulation in lock-step (youbot-sim --lock-step) is lifted and set down by this program.\n"
      "Exit codes: 0 done or interrupted, 2 usage or configuration, 3 device, set-up or disk, 4 stopped by a "
      "fault.");
  improve_command
      ->add_option("--hidden-effect", improve.hidden_effect,
                   "seed that draws the effect of the simulated robot in this program")
      ->check(finite_range(0, apps::HiddenEffect::kMostSeed));
  improve_command->add_option("--robot", improve.robot,
                              "ethercat:IFACE: a robot or youbot-sim, with what it has");
  improve_command->add_option("--config", improve.config,
                              "youbotd's TOML file for that robot; none: the demo's");
  improve_command
      ->add_option("--stage", improve.stage, "measure, with the wheels off the ground, or drive, on it")
      ->transform(CLI::CheckedTransformer(
                      std::map<std::string, Stage>{{"measure", Stage::kMeasure}, {"drive", Stage::kDrive}})
                      .description("measure or drive"));
  improve_command->add_flag("--virtual-time", improve.virtual_time,
                            "as fast as both ends can; youbot-sim --lock-step and nothing else");
  improve_command->add_flag("--allow-non-rt", improve.allow_non_real_time,
                            "go on when the system refuses real-time scheduling or memory locking");
  improve_command->add_flag("--yes", improve.yes, "with --stage: the robot may move, do not ask");
  improve_command->add_option("--out", improve.out, "directory for recordings, models and reports")
      ->required();
  improve_command
      ->add_option("--wheel", improve.wheel,
                   "explain this one and take its model for all; none: each wheel gets its own")
      ->check(finite_range(1, 4));
  improve_command->add_flag("--quiet", improve.quiet, "print problems only");

  std::uint64_t revealed_effect = 0;
  CLI::App* const reveal_command =
      app.add_subcommand("reveal", "tell what --hidden-effect SEED hides; for the end");
  reveal_command->add_option("--hidden-effect", revealed_effect, "the seed")
      ->check(finite_range(0, apps::HiddenEffect::kMostSeed))
      ->required();

  return apps::run_app(app, argc, argv, [&] {
    if (*improve_command) return youbot_bench::improve(improve);
    if (*reveal_command) std::printf("%s\n", apps::HiddenEffect(revealed_effect).reveal().c_str());
    if (*identify_command) youbot_bench::identify(identify);
    if (experiments.chosen()) return experiments.run();
    if (*hold_command) {
      apps::stop_on_signals();
      return youbot_bench::haptic_hold(hold, apps::stop_requested);
    }
    if (*transparency_command) {
      apps::stop_on_signals();
      return youbot_bench::transparency(transparency, apps::stop_requested);
    }
    if (*usb_probe_command) {
      apps::stop_on_signals();
      youbot_bench::usb_probe(usb_probe, apps::stop_requested);
    }
    if (*curve_command) youbot_bench::print_curve(curve);
    if (*scan_command) youbot_bench::print_scan(*youbot_bench::open_bus(robot).link);
    if (*parameters_command) youbot_bench::parameters(parameters);
    if (*diagnose_command) {
      const youbot_bench::Bus bus = youbot_bench::open_bus(robot);
      apps::stop_on_signals();
      return youbot_bench::print_diagnosis(*bus.link, *bus.clock, diagnose, apps::stop_requested)
                 ? apps::kExitOk
                 : apps::kExitFault;
    }
    return apps::kExitOk;
  });
}
