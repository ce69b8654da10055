/// @file
/// From measurement to better driving: the complete chain, on a simulated robot with a hidden effect or on a
/// robot on a bus.
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "analysis/findings.h"
#include "apps/youbot_bench/subcommand.h"
#include "control/planar.h"
#include "operation/session.h"

namespace youbot_bench {

struct ImproveOptions {
  /// Measured and searched with lifted wheels, driven on the ground.
  enum class Stage : std::uint8_t { kBoth, kMeasure, kDrive };

  std::string robot = "loopback";                ///< or ethercat:IFACE, with the actual properties of its
                                                 ///< drives
  std::optional<std::uint64_t> hidden_effect{};  ///< of the loopback robot: seed, see runtime::HiddenEffect
  std::filesystem::path out{};
  std::filesystem::path config{};  ///< youbotd's, for a robot on a bus; empty: the demo's
  int wheel = 0;  ///< the wheel to analyse, whose model is then used for all four; 0: each wheel gets its own
  Stage stage = Stage::kBoth;
  bool virtual_time = false;  ///< on a bus: youbot-sim --lock-step
  bool allow_non_real_time = false;
  bool yes = false;  ///< no confirmation before the robot moves
  bool quiet = false;
};

/// A run of the demo: its summary, and actual and reference poses every twentieth of a second.
struct Run {
  operation::Summary summary{};
  std::vector<double> time_s{};
  std::vector<control::PlanarPose> X_WB{};  ///< true pose if known, otherwise odometry
  std::vector<control::PlanarPose> reference_X_WB{};
};
/// The demo only turns left, and its mirror image right, so that a direction-dependent effect cannot help by
/// chance.
struct Drive {
  Run demo{};
  Run mirrored{};
};

struct Improvement {
  std::vector<analysis::Findings> wheels{};  ///< of the analysed ones
  std::optional<Drive> nothing_hidden{};     ///< loopback: wheels and compensator with the known model
  Drive base{};                              ///< with the known model in the compensator
  Drive improved{};                          ///< with the models from the search
};

/// 1. Records staircases, a multisine, ramps, presliding and reversals of all wheels, lifted.
/// 2. Searches for effects that the known model lacks, wheel by wheel, from these recordings only.
/// 3. Drives youbotd's demo on the same robot with either model in the compensator, and for comparison on
/// simulated wheels without a hidden effect.
/// Uses the programs' own code; on the loopback robot in virtual time. On a bus the properties of the drives
/// are unknown. A person lifts a real robot and sets it down, and is asked each time before it moves; without
/// a terminal the two stages are two calls. Prints the result and, last, what was hidden. Writes into `out`:
/// recordings/, wheel-N/ with base.toml, model.toml, gap.json and report.html, the driven configurations,
/// youbotd-*.toml, and report.html.
/// Returns the exit code (exit_code.h). @throws std::invalid_argument if `out` is not empty or, for driving,
/// not as left by the measurement; or what its parts throw.
int improve(const ImproveOptions& options);

/// The same without output on standard output, and without report.html. Empty `wheels` or summaries after a
/// stop request, and after a drive that was stopped by a fault.
Improvement run_chain(const ImproveOptions& options);

Subcommand add_improve(CLI::App& app);
/// `reveal`: prints the effect of --hidden-effect SEED.
Subcommand add_reveal(CLI::App& app);

}  // namespace youbot_bench
