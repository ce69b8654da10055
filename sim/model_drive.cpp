#include "sim/model_drive.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>

namespace sim {
namespace {

/// An unspecified contact is as stiff as the integration allows and settles within a few steps.
constexpr double kContactAngle_rad = 0.3;  // per integration step
constexpr double kContactDampingRatio = 0.3;
/// Steps in the longest stable one, for accuracy.
constexpr double kStableSteps = 5;
constexpr double kMostSubsteps = 1e4;

model::effects::Mechanics mechanics(const model::effects::DriveModel& model,
                                    const model::effects::EffectChain& effects, double step_s) {
  model::effects::Mechanics result = effects.arranged({.inertia_kg_m2 = model.inertia_kg_m2});
  if (!(result.stiffness_Nm_per_rad > 0)) {
    const double resonance = kContactAngle_rad / step_s;
    result.stiffness_Nm_per_rad = result.inertia_kg_m2 * resonance * resonance;
    result.damping_Nm_s_per_rad = 2 * kContactDampingRatio * result.inertia_kg_m2 * resonance;
  }
  return result;
}

}  // namespace

ModelDrive::ModelDrive(const model::effects::DriveModel& model, double step_s, int substeps)
    : step_s_(step_s),
      substeps_(substeps),
      effects_(model.effects),
      parts_(mechanics(model, effects_, step_s / substeps), std::nullopt, effects_) {
  const double needed = std::ceil(kStableSteps * step_s / parts_.longest_step_s());
  if (!(needed <= kMostSubsteps))
    throw std::invalid_argument("simulated drive: a friction law needs steps below " +
                                std::to_string(1e9 * parts_.longest_step_s()) + " ns");
  substeps_ = std::max(substeps, static_cast<int>(needed));
}

void ModelDrive::step(double command_Nm) noexcept {
  delivered_Nm_ = effects_.deliver(command_Nm, step_s_);
  for (int i = 0; i < substeps_; ++i) parts_.step(delivered_Nm_, 0, step_s_ / substeps_);
}

}  // namespace sim
