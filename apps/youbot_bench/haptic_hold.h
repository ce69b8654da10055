/// @file
/// `youbot-bench haptic-hold`: springs hold the handle of a haptic device at a point, the thesis' first
/// haptic test (3.4.1.1). Pulled away and released it returns; the force on the hand is displayed, and
/// recorded on request.
#pragma once
#include <array>
#include <atomic>
#include <string>

#include "apps/youbot_bench/subcommand.h"

namespace youbot_bench {

struct HapticHoldOptions {
  std::string haptic{};  ///< backend; empty: the configuration's, otherwise loopback
  std::string config{};  ///< TOML with a [haptic] table; empty: defaults
  double stiffness_N_per_m = 200.0;
  double damping_N_s_per_m = 0.5;
  std::array<double, 3> point_m{};  ///< in the device's frame H
  double duration_s = 20.0;
  std::string out{};  ///< directory for haptic.csv and report.html; empty: none
  bool virtual_time = false;
  bool allow_non_real_time = false;
  bool quiet = false;  ///< errors only
};

/// Maximum values of --stiffness and --damping.
inline constexpr double kMaxHoldStiffness_N_per_m = 2000.0;
inline constexpr double kMaxHoldDamping_N_s_per_m = 20.0;

/// Returns the exit code. Set `stop` to end it early; the force then fades out as at the end, and the code is
/// kExitInterrupted. On the loopback a simulated hand pulls the handle away and releases it, repeatedly.
/// @throws runtime::ConfigError, std::invalid_argument, hal::SetupError.
int haptic_hold(const HapticHoldOptions& options, const std::atomic<bool>& stop);

Subcommand add_haptic_hold(CLI::App& app);

}  // namespace youbot_bench
