/// @file
/// An experiment with all its inputs, as a value: built from a command line, a file or by other programs.
#pragma once
#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include "control/plausibility/checks.h"
#include "hal/can_robot.h"
#include "hal/ethercat_robot.h"
#include "identification/experiments/compensation.h"
#include "identification/experiments/dahl.h"
#include "identification/experiments/parameter.h"
#include "identification/experiments/reversals.h"
#include "identification/experiments/staircase.h"
#include "identification/experiments/steady_state.h"
#include "identification/experiments/stick_slip.h"
#include "identification/experiments/torque_ramp.h"
#include "identification/experiments/torque_wave.h"
#include "runtime/configuration/hidden_effect.h"

namespace runtime {
class TomlTable;
}  // namespace runtime

namespace youbot_bench {

struct ExperimentOutcome;

/// Settings common to all experiments; the defaults of some depend on the experiment.
struct ExperimentSettings {
  std::string robot = "loopback";
  std::string joints{};
  std::string model{};
  int hidden_effect = -1;
  double record_rate_Hz = 1000.0;
  double max_speed_rad_per_s = 12.0;
  double max_travel_rad = 0.0;
  std::string start_rad{};
  double filter_cutoff_rad_per_s = 125.0;
  double simulation_step_s = 5e-5;
  int noise_seed = 1;

  template <typename Visitor>
  void visit(Visitor&& v) {
    using identification::experiments::Parameter;
    v(Parameter{"robot", "loopback, wire, ethercat:IFACE, can:IFACE"}, robot);
    v(Parameter{"joints", "such as wheel-2, or wheel-1,wheel-3, or arm-2 alone; none named: all wheels"},
      joints);
    v(Parameter{"model",
                "drive model file that simulated wheels follow, or four, separated by commas; none: the "
                "measured curves"},
      model);
    v(Parameter{"hidden_effect", "seed of a hidden effect injected into the simulated wheels; -1: none", -1,
                runtime::HiddenEffect::kMaxSeed},
      hidden_effect);
    v(Parameter{"record_rate_Hz", "rows per second of the recording", 0.001, 1000}, record_rate_Hz);
    v(Parameter{"max_speed_rad_per_s", "a faster joint is stopped; arm joints also have their own limits",
                0.01, 30},
      max_speed_rad_per_s);
    v(Parameter{"max_travel_rad", "a joint that moves further in a measurement is stopped; 0: no limit", 0,
                1e6},
      max_travel_rad);
    v(Parameter{"start_rad", "start position of an arm joint; none: its present position"}, start_rad);
    v(Parameter{"filter_cutoff_rad_per_s", "of the velocity", 1, 1000}, filter_cutoff_rad_per_s);
    v(Parameter{"simulation_step_s", "of the simulated drives", 1e-6, 2e-4}, simulation_step_s);
    v(Parameter{"noise_seed", "of the simulated sensors", 0, 2e9}, noise_seed);
  }
};
/// Which experiment, and its own parameters.
using ExperimentParameters =
    std::variant<identification::experiments::SteadyStateConfig,
                 identification::experiments::TorqueRampConfig, identification::experiments::DahlConfig,
                 identification::experiments::PreslidingConfig, identification::experiments::StickSlipConfig,
                 identification::experiments::CompensationConfig,
                 identification::experiments::StaircaseConfig, identification::experiments::ReversalsConfig,
                 identification::experiments::MultisineConfig>;

///     ExperimentRequest request = experiment_request(StaircaseConfig{.step = 0.05});
///     request.directory = "recordings";
///     return run_experiment(std::move(request));
struct ExperimentRequest {
  const char* name = "";    ///< also the directory of the recording
  const char* result = "";  ///< likewise, of the results; empty: the recording is the result
  const char* about = "";
  ExperimentSettings settings{};
  ExperimentParameters parameters{};
  hal::EthercatOptions ethercat{.kind = hal::YoubotKind::kBase};
  hal::CanOptions can{};
  control::ChecksOff checks_off{};  ///< of the sensors
  std::filesystem::path directory{};
  bool resume = false;  ///< what is in `directory`; its configuration must have been read
  bool real_time = false;
  bool virtual_time = false;  ///< a robot on a bus too; a simulated one is, unless `real_time`
  bool allow_non_real_time = false;
  bool yes = false;  ///< the robot may move, do not ask
  bool quiet = false;
};

/// All experiments, with their defaults.
std::vector<ExperimentRequest> experiment_requests();
/// The experiment of these parameters, otherwise with its defaults.
ExperimentRequest experiment_request(const ExperimentParameters& parameters);

/// Takes what an experiment.toml, or youbotd's configuration, says. @throws runtime::ConfigError.
void read_experiment(const std::filesystem::path& file, ExperimentRequest& request);

/// Runs it until it is finished, asked to stop (stop_on_signals.h) or stopped by a fault, and prints what
/// came out. Returns the exit code (exit_code.h). @throws std::invalid_argument, hal::SetupError.
int run_experiment(ExperimentRequest request);
/// The same without output, for programs that show what came out in their own way; only the progress, unless
/// the request is quiet. Makes the file paths of `request` absolute. @throws as run_experiment().
ExperimentOutcome perform_experiment(ExperimentRequest& request);

/// `root` may be an experiment.toml; its keys belong to the experiment.
void leave_to_experiments(runtime::TomlTable& root);

}  // namespace youbot_bench
