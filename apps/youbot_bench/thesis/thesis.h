/// @file
/// `youbot-bench thesis`: the figures and tables of the thesis, made again on its robot in virtual time, each
/// beside the printed numbers.
#pragma once
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "apps/youbot_bench/subcommand.h"
#include "apps/youbot_bench/thesis/figure.h"

namespace youbot_bench::thesis {

struct ThesisOptions {
  std::filesystem::path out{};
  std::vector<std::string> chapters{};  ///< empty: all
  bool quiet = false;
};

/// The figures of these chapters, with their recordings in `out`, which must be missing or empty.
/// @throws Stopped (workshop.h) when the program is asked to end, after removing what it wrote;
/// std::invalid_argument for an unknown chapter or a directory with something in it; hal::SetupError if it
/// cannot be written.
std::vector<Figure> make_figures(const ThesisOptions& options);

/// runtime::kExitDisagreement if a number lies beyond its limit, else kExitOk.
int exit_code(std::span<const Figure> figures);

/// Also writes `out`/report.html and thesis.json, and prints what agrees. Returns the exit code.
int thesis(const ThesisOptions& options);

}  // namespace youbot_bench::thesis

namespace youbot_bench {
Subcommand add_thesis(CLI::App& app);
}  // namespace youbot_bench
