/// @file
/// Finds where a drive model and measured data disagree, names the missing effect, adds it and measures
/// again.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "identification/fit/statistics.h"
#include "identification/gap/shrink.h"
#include "identification/recording.h"
#include "model/effects/drive_model.h"

namespace identification::gap {

struct Source {
  std::string name;  ///< of the file, as used in the report
  Recording recording;
  std::string path{};  ///< for messages about it only; empty: the name
  /// Time since which the drive runs, for effects that depend on it; empty: since the first row.
  std::optional<double> running_from_s{};
  /// The measured torque had lost its sign and has that of the motion.
  bool signed_by_motion = false;
};

/// A finding about a recording before the analysis.
struct Diagnosis {
  std::string recording;
  std::string column;
  std::string found;  ///< "3 samples are more than 8 times ..."
  std::string done;   ///< "interpolated"
};

/// Based on the held-out data only.
enum class Verdict : std::uint8_t {
  kNoGap,            ///< the residual is only noise
  kExplained,        ///< effects added, only noise is left
  kPartlyExplained,  ///< effects added, and structure is left
  kAmbiguous,        ///< the gap closes, but with one of several effects that this data cannot distinguish
  kUnexplained,      ///< structure that no effect explains
};
std::string_view verdict_name(Verdict verdict) noexcept;  ///< as in gap.json: "partly explained"

/// A range of one signal in which an effect is visible.
struct Where {
  std::string coordinate{};  ///< e.g. velocity_rad_per_s, position_rad, time_s, frequency_Hz
  double from = 0;
  double to = 0;
  std::string recording{};  ///< if it is one of several
};

/// An experiment of youbot-bench that would distinguish effects.
struct NextExperiment {
  std::string name;                                           ///< of the command: "staircase"
  std::vector<std::pair<std::string, std::string>> settings;  ///< other than its defaults, by key
  double duration_s = 0;
  double separation = 0;  ///< expected difference between the predictions of two models, in noise sigmas
};

struct FoundEffect {
  model::effects::AnyEffect effect;
  Where where;
  /// Kind of evidence; default: the held-out torque residual.
  static constexpr std::string_view kHeldOut = "held-out residual";
  static constexpr std::string_view kLeftOut = "residual of stretches left out in turn";
  std::string_view measured_on = kHeldOut;
  double held_out_gain = 0;  ///< share of the model's squared residual that the effect removes
  int blocks_improved = 0;
  int blocks = 0;
  double p_value = 1;     ///< probability of such a gain by chance, in the whole search or in plain friction
  double gap_before = 0;  ///< rms torque residual [N·m], of the delivered model refitted without the effect
  double gap_after = 0;
  std::vector<std::string> equivalent{};  ///< effects that this data cannot distinguish from it
  /// Number of noise draws that it wins, then that of each equivalent; empty without draws.
  std::vector<int> wins{};
  std::optional<NextExperiment> decided_by{};  ///< distinguishes it from those; empty if nothing does
  std::vector<fit::Estimate> parameters{};     ///< in the order of the effect's description
};

/// Structure that no effect of the library explains, as model::effects::Empirical: it has no physical name.
struct UnnamedEffect {
  model::effects::AnyEffect effect;
  double held_out_gain = 0;  ///< share of the squared held-out residual that it removes
  int blocks_improved = 0;   ///< of the held-out data
  int blocks = 0;
  double p_value = 1;        ///< of its terms, the largest: probability of such a gain by chance
  double gap_before_Nm = 0;  ///< held-out rms torque residual without it
  double gap_after_Nm = 0;
  double removable_share = 0;  ///< of the squared residual above the noise floor, the share that it removes
  double simulation_before_rad_per_s = 0;  ///< rms velocity error, as in HeldOutComparison
  double simulation_after_rad_per_s = 0;
};

/// Of the simulation of model and servo together, from the set-point alone.
struct ClosedLoopError {
  std::string recording;
  double mean_rad = 0;  ///< mean magnitude of the position error
  double rms_rad = 0;
};
/// The same with the given model and with the new one.
struct ClosedLoop {
  ClosedLoopError before;
  ClosedLoopError after;
  bool held_out = false;  ///< whether no fit has used the recording
};

/// Range in which the drive has been observed, and may be used again. Joint side.
struct DriveLimits {
  double torque_Nm = 0;
  double speed_rad_per_s = 0;
  double travel_rad = 0;  ///< infinite for a continuous joint
  double middle_rad = 0;  ///< of the travel, where experiments begin; 0 for a continuous joint
};

/// An effect that the data could not show, present or not.
struct BlindSpot {
  std::string text;                          ///< a sentence with the recording that would show it
  std::vector<std::string> effects{};        ///< for which an experiment is searched
  std::optional<NextExperiment> shown_by{};  ///< for any of them, with their usual size
};

struct RejectedEffect {
  std::string type;
  double gap_after;    ///< [N·m] of the data searched, less the share that it took where it was tried
  std::string reason;  ///< the criterion that it failed
};
struct Unexplained {
  Where where;
  double share = 0;  ///< of the squared residual
};

/// Residual against one coordinate, before and after, for the report's plots. Its mean; over frequency_Hz the
/// rms between two points.
struct ResidualMap {
  std::string coordinate;
  std::vector<double> at;
  std::vector<double> before_Nm;
  std::vector<double> after_Nm;
};
/// A stretch of held-out data: measured, and simulated from the measured torque with both models.
struct Trace {
  std::string recording;
  std::vector<double> time_s;
  std::vector<double> measured_rad_per_s;
  std::vector<double> before_rad_per_s;
  std::vector<double> after_rad_per_s;
};
/// A frictional torque against velocity: the model's curve before and after, and measured points.
struct FrictionCurve {
  std::vector<double> velocity_rad_per_s;
  std::vector<double> before_Nm;
  std::vector<double> after_Nm;
  std::vector<double> measured_velocity_rad_per_s;
  std::vector<double> measured_Nm;
};

struct Result {
  Verdict verdict = Verdict::kNoGap;
  model::effects::DriveModel model;  ///< base parameters refitted, effects added
  double noise_floor_Nm = 0;         ///< rms, in the band of the residual
  double band_Hz = 0;
  std::vector<std::string> held_out;
  double gap_before_Nm = 0;  ///< held-out rms torque residual of the given model
  /// How the recording of the torque was taken, fitted: true = reported + lag · rate + smoothing · its rate.
  /// All gaps here, also that of the given model, allow for it. It is no part of the model.
  double torque_lag_s = 0;
  double torque_smoothing_s2 = 0;
  double gap_base_Nm = 0;  ///< of the given model with refitted parameters
  double gap_after_Nm = 0;
  double gap_searched_Nm = 0;  ///< of the new model on the data it was fitted to
  /// From the given model's gap to the last one; empty if the given model cannot be compared, for example if
  /// a torque has lost its sign.
  std::optional<Shrink> shrink{};
  std::vector<RecordingGap> recordings{};  ///< of held-out data; the last one covers all of them
  double simulation_before = 0;  ///< rms velocity error of free simulation in windows, held out [rad/s]
  double simulation_after = 0;
  std::vector<ClosedLoop> closed_loop{};  ///< of each recording with a set-point, if the model has a servo
  std::vector<Diagnosis> diagnosis;
  std::vector<FoundEffect> effects;
  std::vector<RejectedEffect> rejected;
  std::vector<Unexplained> unexplained;           ///< of the held-out data
  std::vector<Unexplained> unexplained_searched;  ///< of the searched data
  /// A torque without a physical name that removes structure that stays unexplained.
  std::optional<UnnamedEffect> unnamed{};
  bool unnamed_accepted = false;  ///< it is in the model, and in the gap after
  /// Refitted parameters of the given model, by effect type; its inertia has an empty type.
  std::vector<std::pair<std::string, fit::Estimate>> refitted;  ///< effect type and its parameter
  std::string disagreement;        ///< between the searched and the held-out data, on which the verdict is
                                   ///< based
  std::vector<std::string> notes;  ///< further remarks on the model
  std::vector<BlindSpot> blind_spots;
  DriveLimits limits;  ///< limits for the experiments
  std::vector<ResidualMap> maps;
  std::vector<Trace> traces;
  FrictionCurve curve;
};

/// More rows, or samples in the widest band, add no information: model errors widen the intervals long before
/// the number narrows them. Smaller data are analysed completely.
struct Enough {
  std::size_t rows = 2'000'000;
  std::size_t samples = 1'000'000;
};

struct Options {
  double false_positive_rate = 0.01;  ///< of the whole search, per effect added; of plain friction 0.05
  int repetitions = 99;               ///< of the search on chance data
  double least_gain = 0.02;           ///< minimum share of the squared residual for an effect to be named
  std::uint64_t seed = 1;
  Enough enough{};
  bool accept_unnamed = false;  ///< adds a torque without a physical name to the model
  /// Called occasionally with the current step and the completed share of the analysis, 0 to 1.
  std::function<void(std::string_view what, double done)> progress{};
};

/// Deterministic for a seed, whatever the number of cores; uses all of them. If `held_out` is empty, blocks
/// of `data` are set aside, and the result names them. Recordings that are moved here are not copied. Of very
/// long ones, selected excerpts are analysed, which the diagnosis reports (excerpts.h).
/// @throws std::invalid_argument naming the missing experiment if the data cannot answer the question:
/// nothing moves, recordings too short to hold anything out, different rigs, missing columns.
Result analyse(const model::effects::DriveModel& base, std::vector<Source> data, std::vector<Source> held_out,
               const Options& options = {});

}  // namespace identification::gap
