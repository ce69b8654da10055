/// @file
/// What a search for the gap found, and the words for it that model file, report and terminal share.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "identification/gap/gap.h"
#include "model/effects/drive_model.h"

namespace analysis {

struct Findings {
  model::effects::DriveModel base;  ///< as it was given
  std::string base_path;
  std::string drive;              ///< how titles call the rig
  std::vector<std::string> data;  ///< names of the recordings searched
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
/// All parameters of a found effect in the library's order, with intervals within what each may be; those
/// that are not fitted, as a Stribeck curve's tail, have their value and the reason.
std::vector<identification::fit::Estimate> parameters_of(const identification::gap::FoundEffect& found);
/// "stribeck", "stribeck or cogging" with what the data cannot tell from it.
std::string name_with_rivals(const identification::gap::FoundEffect& found);

/// "stribeck 13, presliding 7 of 20 draws of the noise"; empty without rivals.
std::string wins_text(const identification::gap::FoundEffect& found);
/// "youbot-bench staircase --joint wheel-1 --highest 0.2 --out next-experiment": to be typed as it is.
std::string command_text(const identification::gap::NextExperiment& experiment, const Findings& findings);
/// The command that separates an effect from its rivals, or that there is none; empty without rivals.
std::string deciding_experiment(const identification::gap::FoundEffect& found, const Findings& findings);
/// "34 sigmas expected in 62 s"
std::string expectation_text(const identification::gap::NextExperiment& experiment);
/// What there is to say beside the effects, the blind spots of the data with their commands among it.
std::vector<std::string> notes(const Findings& findings);

/// The verdict and the gap in one line that stands alone.
std::string headline(const Findings& findings);
/// What to do next, one sentence each, never empty.
std::vector<std::string> next_steps(const Findings& findings);

/// A parameter of the given model, before and after.
struct Refitted {
  std::size_t effect = 0;  ///< index in the model; its count of effects for the model's own, such as inertia
  double before = 0;       ///< NaN when the given model has none such
  identification::fit::Estimate after{};
  std::string effect_type{};
};
/// In the order of the result.
std::vector<Refitted> refitted_parameters(const Findings& findings);

}  // namespace analysis
