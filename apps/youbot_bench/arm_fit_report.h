/// @file
/// Results of an arm's excitation: for the terminal, the page and other programs.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "identification/robot_gap/arm_excitation.h"
#include "identification/robot_gap/arm_fit.h"
#include "report/report.h"
#include "runtime/configuration/robot_file.h"

namespace youbot_bench {

/// Two models, compared by the recordings.
struct RivalGaps {
  std::string model;
  std::string against;
  double model_Nm = 0;  ///< rms torque residual, each as it is
  double against_Nm = 0;
};

struct ArmFindings {
  std::string robot;                ///< "loopback"
  std::string model;                ///< from which the fit started, as named
  std::vector<std::string> fitted;  ///< recordings
  std::string held_out;
  std::uint64_t seed = 1;
  identification::robot_gap::ExcitationPlan plan;
  identification::robot_gap::ArmFit fit;
  std::optional<RivalGaps> rivals{};
};

std::string arm_plan_text(const identification::robot_gap::ExcitationPlan& plan, double seconds);
std::string arm_fit_text(const ArmFindings& findings);
std::string arm_fit_json(const ArmFindings& findings);
report::Page arm_fit_page(const ArmFindings& findings);
/// The model with the fitted arm. `urdf`: as the file names it.
std::string arm_fit_model_text(const ArmFindings& findings, const runtime::RobotFile& given,
                               const std::filesystem::path& urdf);

}  // namespace youbot_bench
