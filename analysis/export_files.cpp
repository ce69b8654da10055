#include "analysis/export_files.h"

#include <spdlog/fmt/fmt.h>

#include <cstdio>

#include "runtime/configuration/whole_file.h"
#include "runtime/program/build_info.h"

namespace analysis {

std::vector<std::string> export_remarks(const ExportOptions& options,
                                        const std::vector<std::string>& account) {
  std::vector<std::string> lines{fmt::format("written by youbot-gap {} from {}", runtime::build_version(),
                                             options.inputs.model.string())};
  lines.insert(lines.end(), account.begin(), account.end());
  return lines;
}

void write_exported(const ExportOptions& options, const ExportedFile& file) {
  runtime::write_whole_file(options.out / file.name, file.text);
  if (options.quiet) return;
  std::printf("written: %s\n", (options.out / file.name).c_str());
  for (const std::string& line : file.account) std::printf("  %s\n", line.c_str());
}

void print_residuals(const ExportOptions& options, const std::vector<std::string>& names, double gap_Nm) {
  if (options.quiet) return;
  std::printf("gap on the recordings: %.4g N·m\n", gap_Nm);
  for (const std::string& name : names) std::printf("written: %s\n", (options.out / name).c_str());
}

}  // namespace analysis
