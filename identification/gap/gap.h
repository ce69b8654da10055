/// @file
/// Finds where a drive model and measured data disagree, names what is missing, adds it and measures again.
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
  std::string name;  ///< of the file, as the report calls it
  Recording recording;
  std::string path{};  ///< for messages about it alone; empty: the name
  /// Since when the drive runs, for what changes with that; without: since the first row.
  std::optional<double> running_from_s{};
};

/// What was noticed about a recording before anything was explained with it.
struct Diagnosis {
  std::string recording;
  std::string column;
  std::string found;  ///< "3 samples are more than 8 times ..."
  std::string done;   ///< "interpolated"
};

/// Of the held-out data alone.
enum class Verdict : std::uint8_t {
  kNoGap,            ///< nothing in the residual but noise
  kExplained,        ///< effects added, and nothing but noise is left
  kPartlyExplained,  ///< effects added, and structure is left
  kAmbiguous,        ///< the gap closes, but with one of several effects that this data cannot tell apart
  kUnexplained,      ///< structure, and no effect explains it
};
std::string_view verdict_name(Verdict verdict) noexcept;  ///< as gap.json has it: "partly explained"

/// A stretch of one signal in which something shows.
struct Where {
  std::string coordinate{};  ///< such as velocity_rad_per_s, position_rad, time_s, frequency_Hz
  double from = 0;
  double to = 0;
  std::string recording{};  ///< when it is one of several
};

/// An experiment of youbot-bench that would tell effects apart.
struct NextExperiment {
  std::string name;                                           ///< of the command: "staircase"
  std::vector<std::pair<std::string, std::string>> settings;  ///< other than its defaults, by key
  double duration_s = 0;
  double separation = 0;  ///< expected difference of what two models predict for it, in noise sigmas
};

struct FoundEffect {
  model::effects::AnyEffect effect;
  Where where;
  /// Of what the evidence is: of the held-out torque residual where nothing else is said.
  static constexpr std::string_view kHeldOut = "held-out residual";
  static constexpr std::string_view kLeftOut = "residual of stretches left out in turn";
  std::string_view measured_on = kHeldOut;
  double held_out_gain = 0;  ///< share of its square that the effect removes from what the model leaves
  int blocks_improved = 0;
  int blocks = 0;
  double p_value = 1;     ///< of a gain as large by chance, anywhere in the search
  double gap_before = 0;  ///< rms torque residual [N·m], of the delivered model refitted without the effect
  double gap_after = 0;
  std::vector<std::string> equivalent{};  ///< effects this data cannot tell from it
  /// How many draws of the noise it wins, and then each of those; empty without them.
  std::vector<int> wins{};
  std::optional<NextExperiment> decided_by{};  ///< separates it from those; none where nothing does
  std::vector<fit::Estimate> parameters{};     ///< in the order of the effect's description
};

/// What the drive has been seen to do, which it may be asked to do again. Joint side.
struct DriveLimits {
  double torque_Nm = 0;
  double speed_rad_per_s = 0;
  double travel_rad = 0;  ///< infinite for a joint that turns
};

/// What the data could not have shown, whether it is there or not.
struct BlindSpot {
  std::string text;                          ///< a sentence, with the recording that would show it
  std::vector<std::string> effects{};        ///< for which an experiment is looked for
  std::optional<NextExperiment> shown_by{};  ///< any of them, as large as they often are
};

struct RejectedEffect {
  std::string type;
  double gap_after;    ///< [N·m] had it been added to the final model
  std::string reason;  ///< the criterion that it did not meet
};
struct Unexplained {
  Where where;
  double share = 0;  ///< of the squared residual
};

/// Residual against one coordinate, before and after: what the report plots. Its mean; over frequency_Hz the
/// rms of what lies between two points.
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
  double noise_floor_Nm = 0;         ///< rms, in the band the residual is looked at
  double band_Hz = 0;
  std::vector<std::string> held_out;
  double gap_before_Nm = 0;  ///< held-out rms torque residual of the given model
  double gap_base_Nm = 0;    ///< of the given model with its own parameters refitted
  double gap_after_Nm = 0;
  double gap_searched_Nm = 0;  ///< of the new model on the data it was fitted to
  /// From the given model's gap to the last one; none where the given model cannot be compared, as with a
  /// torque that has lost its sign.
  std::optional<Shrink> shrink{};
  std::vector<RecordingGap> recordings{};  ///< of held-out data; the last one is of all of them
  double simulation_before = 0;  ///< rms velocity error of free simulation in windows, held out [rad/s]
  double simulation_after = 0;
  std::vector<Diagnosis> diagnosis;
  std::vector<FoundEffect> effects;
  std::vector<RejectedEffect> rejected;
  std::vector<Unexplained> unexplained;           ///< of the held-out data
  std::vector<Unexplained> unexplained_searched;  ///< of the data that were searched
  /// The given model's own parameters after refitting, by effect type; its inertia has an empty type.
  std::vector<std::pair<std::string, fit::Estimate>> refitted;  ///< effect type and its parameter
  std::string disagreement;        ///< of the data searched with the held-out ones, of which the verdict is
  std::vector<std::string> notes;  ///< what else there is to say about the model
  std::vector<BlindSpot> blind_spots;
  DriveLimits limits;  ///< within which an experiment was looked for
  std::vector<ResidualMap> maps;
  std::vector<Trace> traces;
  FrictionCurve curve;
};

/// More rows, or samples of what the widest band keeps, say no more about a drive: what a model lacks makes
/// its intervals wide long before their number makes them narrow. Fewer are all analysed.
struct Enough {
  std::size_t rows = 2'000'000;
  std::size_t samples = 1'000'000;
};

struct Options {
  double false_positive_rate = 0.01;  ///< of the whole search, per effect added
  int repetitions = 99;               ///< of the search on chance data
  double least_gain = 0.02;  ///< share of the squared residual below which an effect is not worth a name
  std::uint64_t seed = 1;
  Enough enough{};
  /// Called now and then with what is being done and how much of the whole analysis is done, 0 to 1.
  std::function<void(std::string_view what, double done)> progress{};
};

/// Deterministic for a seed, whatever the number of cores, all of which it uses.
/// `held_out` may be empty: then blocks of `data` are set aside, and the result says which. Recordings that
/// are moved here are not copied. Of very long ones some excerpts are analysed, which the diagnosis says
/// (excerpts.h).
/// @throws std::invalid_argument saying which experiment is missing when the data cannot carry the question:
///         nothing moves, recordings too short to hold anything out, rigs that differ, columns missing.
Result analyse(const model::effects::DriveModel& base, std::vector<Source> data, std::vector<Source> held_out,
               const Options& options = {});

}  // namespace identification::gap
