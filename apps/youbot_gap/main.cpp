// youbot-gap: finds what a drive model lacks, names it, adds it.
#include <CLI/CLI.hpp>

#include "analysis/explain.h"
#include "runtime/configuration/finite_range.h"
#include "runtime/program/exit_code.h"
#include "runtime/program/run_app.h"

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
  app.add_option("--model", options.inputs.model, "the drive model, TOML")->required();
  app.add_option("--data", options.inputs.data, "recordings of the drive, or directories of them")
      ->required();
  app.add_option("--held-out", options.inputs.held_out,
                 "recordings that only judge; without them parts of --data are set aside");
  app.add_option("--joint", options.inputs.joint,
                 "joint of an MCAP file with several, such as wheel_1 of base.mcap");
  app.add_option("--out", options.out, "directory for model.toml, report.html and gap.json")->required();
  app.add_option("--seed", options.seed, "of the random numbers: the same seed gives the same answer")
      ->check(runtime::finite_range(0, 1e15))
      ->capture_default_str();
  app.add_flag("--quiet", options.quiet, "no progress and no summary");

  return runtime::run_app(app, argc, argv, [&] {
    analysis::explain_gap(options);
    return runtime::kExitOk;
  });
}
