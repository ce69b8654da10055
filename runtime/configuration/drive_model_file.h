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

/// A parameter that an effect may leave out is one that is zero then, or a Stribeck exponent (2).
/// @throws ConfigError with all problems of the file: another format, an unknown effect or key, a value
///         without or beyond its bounds.
model::effects::DriveModel read_drive_model(const std::filesystem::path& path);
/// Of a file that is open already; messages name it by its path.
model::effects::DriveModel read_drive_model(const std::filesystem::path& path, const RegularFile& file);

/// What a model file says about one effect in comments.
struct EffectRemarks {
  std::vector<std::string> evidence{};    ///< lines above the effect
  std::vector<std::string> parameters{};  ///< behind each parameter, in their order; may be shorter
};
/// The text of the file, readable by read_drive_model() to the last digit. `remarks`: of each effect, or
/// none.
std::string drive_model_text(const model::effects::DriveModel& model,
                             std::span<const std::string> header = {},
                             std::span<const EffectRemarks> remarks = {});

/// Why no compensator can take this model: "its friction drives the joint from -0.91 rad/s on, instead of
/// braking it"; empty when friction brakes at all speeds up to the top one. See model/effects/dissipation.h.
std::string driving_friction(const model::effects::DriveModel& model, double top_speed_rad_per_s);

}  // namespace runtime
