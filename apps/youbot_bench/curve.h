/// @file
/// `youbot-bench curve`: the measured wheel curve as a table.
#pragma once

#include "apps/youbot_bench/subcommand.h"

namespace youbot_bench {

struct CurveOptions {
  int wheel = 1;
  double from_rad_per_s = -10.0;
  double to_rad_per_s = 10.0;
  double step_rad_per_s = 0.1;
  bool quiet = false;  ///< the table without remarks
};

/// Prints `velocity_rad_per_s,torque_Nm` to standard output. @throws std::invalid_argument.
void print_curve(const CurveOptions& options);

Subcommand add_curve(CLI::App& app);

}  // namespace youbot_bench
