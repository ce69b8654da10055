/// @file
/// Result of a gap search, and its texts for model file, report and terminal.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "identification/gap/gap.h"
#include "model/effects/drive_model.h"

namespace analysis {

struct Findings {
  model::effects::DriveModel base;  ///< as given
  std::string base_path;
  std::string drive;              ///< name of the rig in titles
  std::vector<std::string> data;  ///< names of the searched recordings
  std::uint64_t seed = 1;
  identification::gap::Result result;
};

/// "direction_asymmetry" → "direction asymmetry".
std::string effect_words(std::string_view type);
/// "velocity -0.5 to 0.5 rad/s", "time 3.1 to 3.8 s of 3.csv"; empty without a coordinate.
std::string where_text(const identification::gap::Where& where);
/// "95 %: 0.081 to 0.085", or why there is no interval.
std::string interval_text(const identification::fit::Estimate& estimate);
/// "takes away 92 % of the squared held-out residual, better in 31 of 32 blocks, p = 0.004"
std::string evidence_text(const identification::gap::FoundEffect& found);
/// All parameters of a found effect in the library's order, with intervals within their bounds; those that
/// are not fitted, such as a Stribeck curve's tail, have their value and the reason.
std::vector<identification::fit::Estimate> parameters_of(const identification::gap::FoundEffect& found);
/// "removes 84 % of the squared held-out residual, better in 19 of 20 blocks, p = 0.01; of what lies above
/// the noise floor 97 %"
std::string unnamed_evidence(const identification::gap::UnnamedEffect& unnamed);
/// "direction times a table of 24 values over position in turn 0 to 6.28 rad"
std::string term_text(const model::effects::Empirical::Term& term);
/// The terms of an unnamed effect.
const std::vector<model::effects::Empirical::Term>& terms_of(
    const identification::gap::UnnamedEffect& unnamed);
/// "stribeck", or "stribeck or cogging" with the effects that the data cannot distinguish from it.
std::string name_with_rivals(const identification::gap::FoundEffect& found);

/// "stribeck 13, presliding 7 of 20 draws of the noise"; empty without rivals.
std::string wins_text(const identification::gap::FoundEffect& found);
/// "youbot-bench staircase --joint wheel-1 --highest 0.2 --out next-experiment": ready to be typed.
std::string command_text(const identification::gap::NextExperiment& experiment, const Findings& findings);
/// The command that distinguishes an effect from its rivals, or that there is none; empty without rivals.
std::string deciding_experiment(const identification::gap::FoundEffect& found, const Findings& findings);
/// "34 sigmas expected in 62 s"
std::string expectation_text(const identification::gap::NextExperiment& experiment);
/// Mean magnitude of the position errors in the closed loop, over the held-out recordings with a set-point
/// or, where there are none, over the searched ones.
struct ClosedLoopMean {
  double before_rad = 0;
  double after_rad = 0;
  std::size_t recordings = 0;  ///< 0: there is no closed loop
  bool held_out = false;
};
ClosedLoopMean closed_loop_mean(const identification::gap::Result& result);

/// Remarks besides the effects, including the blind spots of the data with their commands.
std::vector<std::string> notes(const Findings& findings);

/// The verdict and the gap in one self-contained line.
std::string headline(const Findings& findings);
/// Next steps, one sentence each, never empty.
std::vector<std::string> next_steps(const Findings& findings);

/// A parameter of the given model, before and after.
struct Refitted {
  std::size_t effect = 0;  ///< index in the model; its number of effects for the model's own parameters, such
                           ///< as inertia
  double before = 0;       ///< NaN if the given model has no such parameter
  identification::fit::Estimate after{};
  std::string effect_type{};
};
/// In the order of the result.
std::vector<Refitted> refitted_parameters(const Findings& findings);

}  // namespace analysis
