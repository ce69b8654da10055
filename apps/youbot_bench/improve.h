/// @file
/// From measuring to driving better: the whole chain on a simulated robot that hides an effect.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "apps/youbot_gap/findings.h"
#include "apps/youbotd/session.h"
#include "control/planar.h"

namespace youbot_bench {

struct ImproveOptions {
  std::uint64_t hidden_effect = 0;  ///< seed, see apps::HiddenEffect
  std::filesystem::path out{};
  int wheel = 0;  ///< the one to explain, whose model then stands for all four; 0: each wheel gets its own
  bool quiet = false;
};

/// A run of the demo: its summary, and where the base was and should have been every twentieth of a second.
struct Run {
  youbotd::Summary summary{};
  std::vector<double> time_s{};
  std::vector<control::PlanarPose> X_WB{};
  std::vector<control::PlanarPose> reference_X_WB{};
};
/// The demo turns left only, and its mirror image right: so what differs by direction cannot just happen to
/// help.
struct Drive {
  Run demo{};
  Run mirrored{};
};

struct Improvement {
  std::vector<youbot_gap::Findings> wheels{};  ///< of those explained
  Drive nothing_hidden{};                      ///< wheels and compensator as the known model
  Drive base{};                                ///< with the known model in the compensator
  Drive improved{};                            ///< with the models that the search gave
};

/// 1. Records staircases, a multisine, ramps, pre-sliding and reversals of all wheels, in the air.
/// 2. Searches for what the known model lacks, wheel by wheel, from these recordings alone.
/// 3. Drives youbotd's demo on the same robot with either model in the compensator, and for comparison on
///    wheels that hide nothing.
/// All of it with the programs' own code and in virtual time. Prints what came out and, last, what was
/// hidden. Writes into `out`: recordings/, wheel-N/ with base.toml, model.toml, gap.json and report.html, the
/// configurations that were driven, youbotd-*.toml, and report.html.
/// Returns the exit code (exit_code.h). @throws std::invalid_argument when `out` is not empty, or what its
/// parts do.
int improve(const ImproveOptions& options);

/// The same without a word on standard output, and without report.html. Empty `wheels` or summaries when it
/// was asked to stop.
Improvement run_chain(const ImproveOptions& options);

}  // namespace youbot_bench
