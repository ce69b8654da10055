#include "apps/youbot_gap/explain.h"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cstdio>
#include <iterator>
#include <stdexcept>
#include <system_error>

#include "apps/common/progress_line.h"
#include "apps/common/whole_file.h"
#include "apps/youbot_gap/findings.h"
#include "apps/youbot_gap/gap_json.h"
#include "apps/youbot_gap/gap_model.h"
#include "apps/youbot_gap/gap_report.h"
#include "apps/youbot_gap/summary.h"

namespace youbot_gap {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFiles[] = {"model.toml", "report.html", "gap.json"};

/// Before the work, so that its result has a place.
void prepare(const fs::path& out, const fs::path& model) {
  std::error_code error;
  fs::create_directories(out, error);
  if (error || !fs::is_directory(out, error))
    throw std::invalid_argument("--out: cannot make the directory " + out.string() +
                                (error ? ": " + error.message() : ": something else has that name"));
  if (::access(out.c_str(), W_OK) != 0)
    throw std::invalid_argument("--out: may not write into " + out.string());
  if (fs::equivalent(out / "model.toml", model, error))
    throw std::invalid_argument("--out: would replace the model that is given, " + model.string() +
                                "; choose another directory");
}

std::string drive_name(const Inputs& inputs) {
  for (const std::string* name : {&inputs.rig, &inputs.model.name})
    if (!name->empty()) return *name;
  return "the drive";
}

}  // namespace

Findings write_findings(const Inputs& inputs, const GapOptions& options,
                        const std::function<void(std::string_view, double)>& progress) {
  prepare(options.out, options.inputs.model);
  Findings findings{.base = inputs.model,
                    .base_path = options.inputs.model.string(),
                    .drive = drive_name(inputs),
                    .data = {},
                    .seed = options.seed,
                    .result = {}};
  for (const sim::gap::Source& source : inputs.data) findings.data.push_back(source.name);
  sim::gap::Options search;
  search.seed = options.seed;
  search.progress = progress;
  findings.result = sim::gap::analyse(inputs.model, inputs.data, inputs.held_out, search);

  // Everything before the first file, so that a failure leaves the older ones together.
  const std::string texts[] = {improved_model_text(findings), gap_report(findings).html(),
                               gap_json(findings)};
  for (std::size_t i = 0; i < std::size(kFiles); ++i)
    apps::write_whole_file(options.out / kFiles[i], texts[i]);
  return findings;
}

void explain_gap(const GapOptions& options) {
  const Inputs inputs = read_inputs(options.inputs);
  for (const std::string& warning : inputs.warnings) spdlog::warn("{}", warning);
  apps::ProgressLine progress("youbot-gap", options.quiet);
  const Findings findings = write_findings(
      inputs, options, [&progress](std::string_view what, double done) { progress.show(what, done); });
  progress.finish();
  if (options.quiet) return;
  std::fputs(summary_text(findings).c_str(), stdout);
  for (const char* const name : kFiles) std::printf("written: %s\n", (options.out / name).c_str());
}

}  // namespace youbot_gap
