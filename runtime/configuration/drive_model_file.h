/// @file
/// Drive models as files: format youbot-drive-model/1.
#pragma once
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "model/effects/drive_model.h"
#include "runtime/configuration/regular_file.h"

namespace runtime {

/// An empirical effect has tables, [[effect.term]], in place of parameters. A parameter that is missing in an
/// effect is zero, or 2 for a Stribeck exponent.
/// @throws ConfigError with all problems of the file: another format, an unknown effect or key, a value that
/// is missing or out of range.
model::effects::DriveModel read_drive_model(const std::filesystem::path& path);
/// The same for an open file; messages name it by its path.
model::effects::DriveModel read_drive_model(const std::filesystem::path& path, const RegularFile& file);

/// Comments of a model file on one effect.
struct EffectRemarks {
  std::vector<std::string> evidence{};    ///< lines above the effect
  std::vector<std::string> parameters{};  ///< after each parameter, in their order; may be shorter
};
/// Text of the file, from which read_drive_model() restores every digit. `remarks`: one per effect, or none.
std::string drive_model_text(const model::effects::DriveModel& model,
                             std::span<const std::string> header = {},
                             std::span<const EffectRemarks> remarks = {});

/// Why no compensator can use this model: "its friction drives the joint from -0.91 rad/s on, instead of
/// braking it"; empty if friction brakes at all speeds up to the maximum. See model/effects/dissipation.h.
std::string driving_friction(const model::effects::DriveModel& model, double top_speed_rad_per_s);

}  // namespace runtime
