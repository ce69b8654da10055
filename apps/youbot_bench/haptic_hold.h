/// @file
/// `youbot-bench haptic-hold`: a haptic master's pen held at a point by springs, the thesis' first haptic
/// test (3.4.1.1). Pulled away and let go it returns; what the hand feels is shown, and recorded on request.
#pragma once
#include <array>
#include <atomic>
#include <string>

#include "apps/youbot_bench/subcommand.h"

namespace youbot_bench {

struct HapticHoldOptions {
  std::string haptic{};  ///< backend; empty: the configuration's, else loopback
  std::string config{};  ///< TOML with a [haptic] table; empty: defaults
  double stiffness_N_per_m = 200.0;
  double damping_N_s_per_m = 0.5;
  std::array<double, 3> point_m{};  ///< in the device's frame H
  double duration_s = 20.0;
  std::string out{};  ///< directory for haptic.csv and report.html; empty: none
  bool virtual_time = false;
  bool allow_non_real_time = false;
  bool quiet = false;  ///< nothing but problems
};

/// Largest values that --stiffness and --damping take.
inline constexpr double kMostHoldStiffness_N_per_m = 2000.0;
inline constexpr double kMostHoldDamping_N_s_per_m = 20.0;

/// The exit code. Set `stop` to end it early; the force then fades out as at the end. On the loopback
/// somebody pulls the pen away and lets it go, over and over.
/// @throws runtime::ConfigError, std::invalid_argument, hal::SetupError.
int haptic_hold(const HapticHoldOptions& options, const std::atomic<bool>& stop);

Subcommand add_haptic_hold(CLI::App& app);

}  // namespace youbot_bench
