#include "analysis/robot.h"

#include <cstdio>
#include <iterator>
#include <utility>

#include "runtime/configuration/base_file.h"
#include "runtime/configuration/whole_file.h"
#include "runtime/log.h"
#include "runtime/program/progress_line.h"
#include "runtime/recording/made_paths.h"
#include "runtime/recording/output_directory.h"

namespace analysis {
namespace {

constexpr const char* kRobotFiles[] = {"model.toml", "report.html", "gap.json"};

}  // namespace

void explain_robot(const RobotGapOptions& options) {
  runtime::ProgressLine progress("youbot-gap", options.quiet);
  OpenedRobot robot = runtime::describes_base(options.model) ? open_base(options) : open_arm(options);
  if (!robot.warnings.empty()) progress.finish();
  for (const std::string& warning : robot.warnings) spdlog::warn("{}", warning);
  runtime::require_no_results(options.out, {std::begin(kRobotFiles), std::end(kRobotFiles)});
  runtime::MadePaths made(runtime::make_output_directory(options.out));
  RobotFindings findings = std::move(robot.findings);
  findings.base_path = options.model.string();
  findings.seed = options.seed;
  const auto show = [&progress](std::string_view what, double done) { progress.show(what, done); };
  findings.result =
      identification::robot_gap::analyse(*robot.subject, {.seed = options.seed, .progress = show});
  if (robot.complete) robot.complete(findings);
  made.keep();
  const std::string texts[] = {robot.model_text(findings, options.out), robot_report_html(findings),
                               robot_gap_json(findings)};
  for (std::size_t i = 0; i < std::size(kRobotFiles); ++i)
    runtime::write_whole_file(options.out / kRobotFiles[i], texts[i]);
  progress.finish();
  if (options.quiet) return;
  std::fputs(robot_summary_text(findings).c_str(), stdout);
  for (const char* const name : kRobotFiles) std::printf("written: %s\n", (options.out / name).c_str());
}

}  // namespace analysis
