/// @file
/// Files of an export, with their account.
#pragma once
#include <string>
#include <vector>

#include "analysis/export.h"

namespace analysis {

struct ExportedFile {
  std::string name;
  std::string text;
  std::vector<std::string> account;  ///< lines: how each effect is carried, and what is lost
};

/// The lines that stand as comments at the head of a file.
std::vector<std::string> export_remarks(const ExportOptions& options,
                                        const std::vector<std::string>& account);
/// Writes the file and prints its account. @throws hal::SetupError if it cannot be written.
void write_exported(const ExportOptions& options, const ExportedFile& file);
/// Prints what was written. `gap_Nm`: of the model.
void print_residuals(const ExportOptions& options, const std::vector<std::string>& names, double gap_Nm);

}  // namespace analysis
