// youbot-bench: examines a youBot's bus, measures its drives, and identifies them from recordings.
#include <CLI/CLI.hpp>
#include <vector>

#include "apps/youbot_bench/arm_excitation.h"
#include "apps/youbot_bench/curve.h"
#include "apps/youbot_bench/diagnose.h"
#include "apps/youbot_bench/experiments_cli.h"
#include "apps/youbot_bench/haptic_hold.h"
#include "apps/youbot_bench/identify.h"
#include "apps/youbot_bench/improve.h"
#include "apps/youbot_bench/parameters.h"
#include "apps/youbot_bench/scan.h"
#include "apps/youbot_bench/sdo.h"
#include "apps/youbot_bench/thesis/thesis.h"
#include "apps/youbot_bench/transparency.h"
#include "apps/youbot_bench/usb_probe.h"
#include "runtime/program/exit_code.h"
#include "runtime/program/run_app.h"

namespace youbot_bench {
namespace {

std::vector<Subcommand> add_all(CLI::App& app) {
  std::vector<Subcommand> commands{add_curve(app),       add_scan(app),        add_parameters(app),
                                   add_sdo(app),         add_diagnose(app),    add_usb_probe(app),
                                   add_haptic_hold(app), add_transparency(app)};
  for (const Subcommand& experiment : add_experiments(app)) commands.push_back(experiment);
  commands.insert(commands.end(), {add_arm_excitation(app), add_identify(app), add_improve(app),
                                   add_reveal(app), add_thesis(app)});
  return commands;
}

}  // namespace
}  // namespace youbot_bench

// NOLINTNEXTLINE(bugprone-exception-escape): out of memory before the first message may end the process.
int main(int argc, char** argv) {
  CLI::App app("Examines a youBot's bus and measures its drives.", "youbot-bench");
  app.footer(
      "Exit codes: 0 done, 1 a compared number is beyond its limit, 2 usage or configuration, 3 device or "
      "set-up, 4 a fault, 130 interrupted before it was done.");
  app.require_subcommand(1);
  const std::vector<youbot_bench::Subcommand> commands = youbot_bench::add_all(app);
  return runtime::run_app(app, argc, argv, [&commands] {
    for (const youbot_bench::Subcommand& command : commands)
      if (command.app->parsed()) return command.run();
    return runtime::kExitUsage;
  });
}
