/// @file
/// A simulated robot whose wheels have an effect that nobody was told of: practice for finding it.
#pragma once
#include <cstdint>
#include <optional>
#include <string>

#include "model/effects/drive_model.h"

namespace runtime {

/// What a lab knows of the simulated wheels: inertia, Coulomb and viscous friction, and the give of the
/// contact, which the thesis measured apart (2.5.2).
model::effects::DriveModel known_wheel_model();

/// One effect of the library in a size that a youBot's wheel may have, drawn from a seed: the same on every
/// machine. Not among them is what experiments with the wheels in the air cannot show (load_friction), what
/// the known model holds already, and what is the bus's business (transport_delay, unsigned_current).
class HiddenEffect {
 public:
  static constexpr int kMostSeed = 2'000'000'000;  ///< that options and configurations take; the least is 0

  explicit HiddenEffect(std::uint64_t seed);

  /// The known model with the effect: what the wheels do.
  const model::effects::DriveModel& wheel_model() const noexcept { return wheel_model_; }
  const model::effects::AnyEffect& effect() const noexcept { return wheel_model_.effects.back(); }
  /// What it is, in words: "stribeck: static torque 0.083 N·m, velocity 0.24 rad/s". For the end only.
  std::string reveal() const;

 private:
  model::effects::DriveModel wheel_model_;
};

/// What simulated wheels are to follow: a model file, a hidden effect, or neither.
/// @throws std::invalid_argument for both, naming the options; ConfigError as read_drive_model().
std::optional<model::effects::DriveModel> simulated_wheel_model(
    const std::string& model_file, const std::optional<std::uint64_t>& hidden_effect);

}  // namespace runtime
