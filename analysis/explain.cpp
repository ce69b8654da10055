#include "analysis/explain.h"

#include <cstdio>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "analysis/findings.h"
#include "analysis/gap_json.h"
#include "analysis/gap_model.h"
#include "analysis/gap_report.h"
#include "analysis/summary.h"
#include "runtime/configuration/whole_file.h"
#include "runtime/log.h"
#include "runtime/program/progress_line.h"
#include "runtime/recording/made_paths.h"
#include "runtime/recording/output_directory.h"

namespace analysis {
namespace {

constexpr const char* kFiles[] = {"model.toml", "report.html", "gap.json"};
/// The model with a torque without a physical name, where it is offered only.
constexpr const char* kUnnamedFile = "model-unnamed.toml";

bool offers_unnamed(const Findings& findings) {
  return findings.result.unnamed && !findings.result.unnamed_accepted;
}

std::string drive_name(const Inputs& inputs) {
  for (const std::string* name : {&inputs.rig, &inputs.model.name})
    if (!name->empty()) return *name;
  return "the drive";
}

}  // namespace

Findings write_findings(Inputs inputs, const GapOptions& options,
                        const std::function<void(std::string_view, double)>& progress) {
  std::vector<std::string> results{std::begin(kFiles), std::end(kFiles)};
  results.emplace_back(kUnnamedFile);
  runtime::require_no_results(options.out, results);
  runtime::MadePaths made(runtime::make_output_directory(options.out));
  Findings findings{.base = inputs.model,
                    .base_path = options.inputs.model.string(),
                    .drive = drive_name(inputs),
                    .data = {},
                    .seed = options.seed,
                    .result = {}};
  for (const identification::gap::Source& source : inputs.data) findings.data.push_back(source.name);
  identification::gap::Options search;
  search.seed = options.seed;
  search.accept_unnamed = options.accept_unnamed;
  search.progress = progress;
  findings.result =
      identification::gap::analyse(inputs.model, std::move(inputs.data), std::move(inputs.held_out), search);
  made.keep();

  const std::string texts[] = {improved_model_text(findings), gap_report(findings).html(),
                               gap_json(findings)};
  for (std::size_t i = 0; i < std::size(kFiles); ++i)
    runtime::write_whole_file(options.out / kFiles[i], texts[i]);
  if (offers_unnamed(findings))
    runtime::write_whole_file(options.out / kUnnamedFile, unnamed_model_text(findings));
  return findings;
}

void explain_gap(const GapOptions& options) {
  runtime::ProgressLine progress("youbot-gap", options.quiet);
  const auto show = [&progress](std::string_view what, double done) { progress.show(what, done); };
  Inputs inputs = read_inputs(options.inputs, show);
  if (!inputs.warnings.empty()) progress.finish();
  for (const std::string& warning : inputs.warnings) spdlog::warn("{}", warning);
  const Findings findings = write_findings(std::move(inputs), options, show);
  progress.finish();
  if (options.quiet) return;
  std::fputs(summary_text(findings).c_str(), stdout);
  for (const char* const name : kFiles) std::printf("written: %s\n", (options.out / name).c_str());
  if (offers_unnamed(findings)) std::printf("written: %s\n", (options.out / kUnnamedFile).c_str());
}

}  // namespace analysis
