#include "analysis/export.h"

#include <spdlog/fmt/fmt.h>

#include <cstdio>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "analysis/export_account.h"
#include "analysis/export_files.h"
#include "analysis/export_mujoco.h"
#include "analysis/export_residual.h"
#include "analysis/export_robot.h"
#include "analysis/sliding_fit.h"
#include "identification/gap/measured_gap.h"
#include "runtime/configuration/robot_file.h"
#include "runtime/log.h"
#include "runtime/program/progress_line.h"
#include "runtime/recording/made_paths.h"
#include "runtime/recording/output_directory.h"

namespace analysis {
namespace {

using identification::gap::MeasuredGap;
using model::effects::DriveModel;

constexpr const char* kMujocoFile = "drive.xml";
constexpr const char* kPlainFile = "drive_plain.xml";
constexpr const char* kUrdfFile = "drive.urdf";

std::vector<ExportedFile> texts_of(const DriveModel& model, const MeasuredGap* data,
                                   const ExportOptions& options) {
  const std::vector<double> speeds = speeds_to_fit_rad_per_s(
      data != nullptr ? data->speeds_rad_per_s() : std::vector<double>{}, options.top_speed_rad_per_s);
  const auto make = [&](const char* name, const Target& target, SlidingTerms terms, const auto& text) {
    const DriveModel carried = carried_by(model, target);
    const SlidingFit sliding = fit_sliding(carried, speeds, terms);
    ExportedFile written{.name = name, .text = {}, .account = account_of(model, target, sliding, data)};
    written.text = text(carried, sliding, export_remarks(options, written.account));
    return written;
  };
  if (options.format == ExportFormat::kUrdf)
    return {make(kUrdfFile, plain_target("URDF"), SlidingTerms::kCoulombViscous, urdf_text)};
  const double step_s = options.timestep_s;
  return {make(kMujocoFile, mujoco_target(), SlidingTerms::kAll,
               [step_s](const auto& carried, const auto& sliding, const auto& lines) {
                 return mujoco_text(carried, sliding, {step_s, lines});
               }),
          make(kPlainFile, plain_target("the plain file"), SlidingTerms::kCoulombViscous,
               [step_s](const auto& carried, const auto& sliding, const auto& lines) {
                 return plain_mujoco_text(carried, sliding, {step_s, lines});
               })};
}

std::vector<std::string> file_names(ExportFormat format) {
  switch (format) {
    case ExportFormat::kMujoco: return {kMujocoFile, kPlainFile};
    case ExportFormat::kUrdf: return {kUrdfFile};
    case ExportFormat::kResidual: break;
  }
  return {};
}

}  // namespace

void export_model(const ExportOptions& options) {
  if (options.format == ExportFormat::kResidual && options.inputs.data.empty())
    throw std::invalid_argument("export residual needs recordings: name them with --data");
  if (runtime::is_robot_file(options.inputs.model)) {
    export_robot(options);
    return;
  }
  runtime::ProgressLine progress("youbot-gap", options.quiet);
  Inputs inputs =
      read_inputs(options.inputs, [&](std::string_view what, double done) { progress.show(what, done); });
  progress.finish();
  for (const std::string& warning : inputs.warnings) spdlog::warn("{}", warning);
  std::optional<MeasuredGap> data;
  if (!inputs.data.empty()) data.emplace(inputs.model, std::move(inputs.data));
  if (data)
    for (const auto& [recording, column, found, done] : data->diagnosis())
      spdlog::warn("{}: {} {}: {}", recording, column, found, done);

  runtime::require_no_results(options.out, file_names(options.format));
  runtime::MadePaths made(runtime::make_output_directory(options.out));
  if (options.format == ExportFormat::kResidual) {
    runtime::require_empty(options.out);
    const std::vector<std::string> names = write_residuals(inputs.model, *data, options.out);
    made.keep();
    print_residuals(options, names, data->gap_Nm(inputs.model));
    return;
  }
  for (const ExportedFile& written : texts_of(inputs.model, data ? &*data : nullptr, options)) {
    write_exported(options, written);
    made.keep();
  }
}

}  // namespace analysis
