/// @file
/// `youbot-bench arm-excitation`: computes motions from which the arm is identified, drives them and fits the
/// arm's model.
#pragma once
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "apps/youbot_bench/subcommand.h"
#include "identification/robot_gap/arm_excitation.h"
#include "runtime/configuration/arm_model.h"
#include "sim/environment.h"

namespace youbot_bench {

struct ArmExcitationOptions {
  std::string robot = "loopback";
  std::string kind = "base+arm";
  std::string config{};  ///< of which [ethercat] and [plausibility] are read
  std::filesystem::path out{};
  std::string model{};    ///< robot file of the arm; empty: described_arm()
  std::string against{};  ///< of a rival model that the motions are to separate from it; empty: identify
  std::string given{};    ///< of the model that both rivals change; empty: described_arm()
  identification::robot_gap::ExcitationOptions plan{};
  bool plan_only = false;
  bool virtual_time = false;
  bool real_time = false;
  bool allow_non_real_time = false;
  bool yes = false;
  bool quiet = false;
  /// For tests: what a simulated arm is in truth; empty: sim::built_robot().
  std::optional<runtime::ArmModel> simulated{};
  sim::EnvironmentParameters scene{};  ///< likewise: what it can touch
};

/// Returns the exit code. @throws runtime::ConfigError, std::invalid_argument, hal::SetupError before
/// anything moves.
int arm_excitation(const ArmExcitationOptions& options, const std::atomic<bool>& stop);

Subcommand add_arm_excitation(CLI::App& app);

}  // namespace youbot_bench
