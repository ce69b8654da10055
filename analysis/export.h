/// @file
/// `youbot-gap export`: a drive model or a robot for programs of others, with an account of what they cannot
/// hold.
#pragma once
#include <cstdint>
#include <filesystem>

#include "analysis/inputs.h"
#include "model/effects/dissipation.h"

namespace analysis {

enum class ExportFormat : std::uint8_t {
  kMujoco,    ///< drive.xml or robot.xml, and the same _plain.xml with what most engines have
  kUrdf,      ///< drive.urdf or robot.urdf
  kResidual,  ///< for each recording, the torque that the model does not predict
};

struct ExportOptions {
  ExportFormat format = ExportFormat::kMujoco;
  InputPaths inputs{};  ///< model, of a drive or a robot; recordings in `data` to measure the costs on, which
                        ///< may be empty
  std::filesystem::path out{};
  double timestep_s = 5e-4;  ///< of MuJoCo
  /// Without recordings, approximations are best up to here.
  double top_speed_rad_per_s = model::effects::kUsualTopSpeed_rad_per_s;
  bool quiet = false;
};

/// Writes the files of the format into the directory `out`, each complete or missing, and prints for each
/// effect how it is carried, what is lost and what that costs on the recordings.
/// @throws runtime::ConfigError or std::invalid_argument if model, recordings or directory cannot be used;
/// hal::SetupError if a file cannot be written.
void export_model(const ExportOptions& options);

}  // namespace analysis
