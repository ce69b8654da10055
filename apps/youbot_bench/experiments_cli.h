/// @file
/// The experiments as subcommands: their options.
#pragma once
#include <memory>
#include <vector>

namespace CLI {  // NOLINT(readability-identifier-naming): the library calls itself so
class App;
}

namespace youbot_bench {

class ExperimentCommand;

/// `steady-state`, `torque-ramp`, `dahl`, `presliding`, `stick-slip`, `compensation`, `staircase`,
/// `reversals`, `multisine`.
///
///     ExperimentCommands experiments(app);
///     ... app.parse() ...
///     if (experiments.chosen()) return experiments.run();
class ExperimentCommands {
 public:
  /// Adds the subcommands to `app`, which it does not outlive.
  explicit ExperimentCommands(CLI::App& app);
  ~ExperimentCommands();
  ExperimentCommands(const ExperimentCommands&) = delete;
  ExperimentCommands& operator=(const ExperimentCommands&) = delete;

  bool chosen() const;
  /// Runs the chosen one until it is finished, asked to stop or stopped by a fault. Returns the exit code
  /// (exit_code.h). @throws apps::ConfigError, std::invalid_argument, hal::SetupError.
  int run();

 private:
  std::vector<std::unique_ptr<ExperimentCommand>> commands_;
};

}  // namespace youbot_bench
