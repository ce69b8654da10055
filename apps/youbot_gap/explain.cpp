#include "apps/youbot_gap/explain.h"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cstdio>
#include <stdexcept>
#include <system_error>
#include <utility>

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

void explain_gap(const GapOptions& options) {
  const Inputs inputs = read_inputs(options.inputs);
  prepare(options.out, options.inputs.model);
  for (const std::string& warning : inputs.warnings) spdlog::warn("{}", warning);

  Findings findings{.base = inputs.model,
                    .base_path = options.inputs.model.string(),
                    .drive = drive_name(inputs),
                    .data = {},
                    .seed = options.seed,
                    .result = {}};
  for (const sim::gap::Source& source : inputs.data) findings.data.push_back(source.name);
  apps::ProgressLine progress("youbot-gap", options.quiet);
  sim::gap::Options search;
  search.seed = options.seed;
  search.progress = [&progress](std::string_view what, double done) { progress.show(what, done); };
  findings.result = sim::gap::analyse(inputs.model, inputs.data, inputs.held_out, search);
  progress.finish();

  // Everything before the first file, so that a failure leaves the older ones together.
  const std::pair<fs::path, std::string> files[] = {{"model.toml", improved_model_text(findings)},
                                                    {"report.html", gap_report(findings).html()},
                                                    {"gap.json", gap_json(findings)}};
  for (const auto& [name, text] : files) apps::write_whole_file(options.out / name, text);
  if (options.quiet) return;
  std::fputs(summary_text(findings).c_str(), stdout);
  for (const auto& [name, text] : files) std::printf("written: %s\n", (options.out / name).c_str());
}

}  // namespace youbot_gap
