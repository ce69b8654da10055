/// @file
/// From measuring to driving better: the whole chain, on a simulated robot that hides an effect or on a robot
/// on a bus.
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
  /// What is done: measured and searched with the wheels off the ground, driven on it.
  enum class Stage : std::uint8_t { kBoth, kMeasure, kDrive };

  std::string robot = "loopback";                ///< or ethercat:IFACE, with whatever its drives have
  std::optional<std::uint64_t> hidden_effect{};  ///< of the loopback robot: seed, see runtime::HiddenEffect
  std::filesystem::path out{};
  std::filesystem::path config{};  ///< youbotd's, for a robot on a bus; none: the demo's
  int wheel = 0;  ///< the one to explain, whose model then stands for all four; 0: each wheel gets its own
  Stage stage = Stage::kBoth;
  bool virtual_time = false;  ///< on a bus: youbot-sim --lock-step
  bool allow_non_real_time = false;
  bool yes = false;  ///< nobody is asked whether the robot may move
  bool quiet = false;
};

/// A run of the demo: its summary, and where the base was and should have been every twentieth of a second.
struct Run {
  operation::Summary summary{};
  std::vector<double> time_s{};
  std::vector<control::PlanarPose> X_WB{};  ///< the truth where there is one, else by odometry
  std::vector<control::PlanarPose> reference_X_WB{};
};
/// The demo turns left only, and its mirror image right: so what differs by direction cannot just happen to
/// help.
struct Drive {
  Run demo{};
  Run mirrored{};
};

struct Improvement {
  std::vector<analysis::Findings> wheels{};  ///< of those explained
  std::optional<Drive> nothing_hidden{};     ///< loopback: wheels and compensator as the known model
  Drive base{};                              ///< with the known model in the compensator
  Drive improved{};                          ///< with the models that the search gave
};

/// 1. Records staircases, a multisine, ramps, pre-sliding and reversals of all wheels, in the air.
/// 2. Searches for what the known model lacks, wheel by wheel, from these recordings alone.
/// 3. Drives youbotd's demo on the same robot with either model in the compensator, and for comparison on
///    simulated wheels that hide nothing.
/// All of it with the programs' own code; on the loopback robot in virtual time. On a bus nothing is known of
/// what the drives have. A real robot is lifted and set down by a person, who is asked each time before it
/// moves; without a terminal the two stages are two calls. Prints what came out and, last, what was
/// hidden. Writes into `out`: recordings/, wheel-N/ with base.toml, model.toml, gap.json and report.html, the
/// configurations that were driven, youbotd-*.toml, and report.html.
/// Returns the exit code (exit_code.h). @throws std::invalid_argument when `out` is not empty or, to drive,
/// not as measuring left it; or what its parts do.
int improve(const ImproveOptions& options);

/// The same without a word on standard output, and without report.html. Empty `wheels` or summaries when it
/// was asked to stop, and after a drive that was stopped by a fault.
Improvement run_chain(const ImproveOptions& options);

Subcommand add_improve(CLI::App& app);
/// `reveal`: what --hidden-effect SEED hides.
Subcommand add_reveal(CLI::App& app);

}  // namespace youbot_bench
