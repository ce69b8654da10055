/// @file
/// The experiments as subcommands: their options.
#pragma once
#include <vector>

#include "apps/youbot_bench/subcommand.h"

namespace youbot_bench {

/// `steady-state`, `torque-ramp`, `dahl`, `presliding`, `stick-slip`, `compensation`, `staircase`,
/// `reversals`, `multisine`. Each runs until it is finished, asked to stop or stopped by a fault.
/// @throws runtime::ConfigError, std::invalid_argument, hal::SetupError.
std::vector<Subcommand> add_experiments(CLI::App& app);

}  // namespace youbot_bench
