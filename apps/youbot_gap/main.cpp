// youbot-gap: finds what a drive model lacks, names it, adds it.
#include <CLI/CLI.hpp>
#include <string>

#include "analysis/explain.h"
#include "analysis/export.h"
#include "analysis/robot.h"
#include "runtime/configuration/finite_range.h"
#include "runtime/program/exit_code.h"
#include "runtime/program/run_app.h"

namespace {

constexpr const char* kColumnsHelp =
    "column map of recordings that another program wrote, TOML: which column is what, its unit, sign "
    "and side of the gear";

analysis::ExportFormat format_called(const std::string& name) {
  if (name == "urdf") return analysis::ExportFormat::kUrdf;
  return name == "residual" ? analysis::ExportFormat::kResidual : analysis::ExportFormat::kMujoco;
}

void add_export(CLI::App& app, analysis::ExportOptions& options) {
  CLI::App* const command = app.add_subcommand(
      "export",
      "write a drive model or an arm for other simulators, with a list of what they cannot represent and "
      "what that costs on recordings");
  command
      ->add_option_function<std::string>(
          "format", [&options](const std::string& name) { options.format = format_called(name); },
          "mujoco: drive.xml or robot.xml, and drive_plain.xml or robot_plain.xml with what most engines "
          "have; urdf: drive.urdf or robot.urdf; residual: for each recording the torque that the model does "
          "not predict, as CSV")
      ->required()
      ->check(CLI::IsMember({"mujoco", "urdf", "residual"}));
  command->add_option("model", options.inputs.model, "the drive model or the robot file of an arm, TOML")
      ->required();
  command->add_option(
      "--data", options.inputs.data,
      "recordings of the drive or of all joints, or directories of them, to measure what is lost");
  command->add_option("--joint", options.inputs.joint, "joint of an MCAP file with several");
  command->add_option("--columns", options.inputs.columns, kColumnsHelp);
  command->add_option("--out", options.out, "directory for the files")->required();
  command->add_option("--timestep", options.timestep_s, "of MuJoCo [s]")
      ->check(runtime::finite_range(1e-5, 0.1))
      ->capture_default_str();
  command
      ->add_option("--top-speed", options.top_speed_rad_per_s,
                   "without recordings, approximations are best up to this speed [rad/s]")
      ->check(runtime::finite_range(1e-3, 1e4))
      ->capture_default_str();
  command->add_flag("--quiet", options.quiet, "no progress and no summary");
}

void add_robot(CLI::App& app, analysis::RobotGapOptions& options) {
  CLI::App* const command = app.add_subcommand(
      "robot",
      "find which part of the model of an arm or a base is wrong, and by which effect: payload, link, joint, "
      "drive; wheel, geometry, slip, tracking");
  command->add_option("--model", options.model, "the arm, its URDF and drives, or the base, its wheels: TOML")
      ->required();
  command
      ->add_option("--data", options.data,
                   "recordings of all joints, or of wheels and pose; or directories of them")
      ->required();
  command->add_option("--held-out", options.held_out,
                      "recordings that only judge; without them the last quarter of each one is set aside");
  command->add_option("--out", options.out, "directory for model.toml, report.html and gap.json")->required();
  command->add_option("--seed", options.seed, "of the random numbers: the same seed gives the same answer")
      ->check(runtime::finite_range(0, 1e15))
      ->capture_default_str();
  command->add_flag("--quiet", options.quiet, "no progress and no summary");
}

}  // namespace

// NOLINTNEXTLINE(bugprone-exception-escape): out of memory before the first message may end the process.
int main(int argc, char** argv) {
  CLI::App app(
      "Finds where a drive model and recordings disagree, names the missing effect, adds it to the model and "
      "shows how much of the gap is left.",
      "youbot-gap");
  app.footer(
      "Exit codes: 0 done, whatever the verdict; 2 usage, model or recordings; 3 a directory or file that "
      "cannot be written.");

  analysis::GapOptions options;
  CLI::Option* const model = app.add_option("--model", options.inputs.model, "the drive model, TOML");
  CLI::Option* const data =
      app.add_option("--data", options.inputs.data, "recordings of the drive, or directories of them");
  app.add_option("--held-out", options.inputs.held_out,
                 "recordings that only judge; without them parts of --data are set aside");
  app.add_option("--joint", options.inputs.joint,
                 "joint of an MCAP file with several, such as wheel_1 of base.mcap");
  app.add_option("--columns", options.inputs.columns, kColumnsHelp);
  CLI::Option* const out =
      app.add_option("--out", options.out, "directory for model.toml, report.html and gap.json");
  app.add_option("--seed", options.seed, "of the random numbers: the same seed gives the same answer")
      ->check(runtime::finite_range(0, 1e15))
      ->capture_default_str();
  app.add_flag(
      "--accept-unnamed", options.accept_unnamed,
      "add structure that no effect explains to the model as well, as a torque without a physical name; "
      "otherwise it is only offered, in model-unnamed.toml");
  app.add_flag("--quiet", options.quiet, "no progress and no summary");

  analysis::ExportOptions exported;
  add_export(app, exported);
  analysis::RobotGapOptions robot;
  add_robot(app, robot);
  // The library would ask for them before a subcommand, too.
  app.final_callback([&] {
    if (!app.get_subcommands().empty()) {
      for (const CLI::Option* option : app.get_options())
        if (!option->empty())
          throw CLI::ValidationError(
              option->get_name(),
              "stands before '" + app.get_subcommands().front()->get_name() + "', or is no option of it");
      return;
    }
    for (const CLI::Option* needed : {model, data, out})
      if (needed->empty()) throw CLI::RequiredError(needed->get_name());
  });

  return runtime::run_app(app, argc, argv, [&] {
    if (app.get_subcommands().empty())
      analysis::explain_gap(options);
    else if (app.got_subcommand("robot"))
      analysis::explain_robot(robot);
    else
      analysis::export_model(exported);
    return runtime::kExitOk;
  });
}
