/// @file
/// A simulated robot whose wheels have an undisclosed effect, to practise identification.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "model/effects/drive_model.h"

namespace runtime {

/// Known parameters of the simulated wheels: inertia, Coulomb and viscous friction, and the contact
/// compliance, which the thesis measured separately (2.5.2).
model::effects::DriveModel known_wheel_model();

/// One effect of the library with a plausible size for a youBot wheel, drawn from a seed: the same on every
/// machine. Excluded are effects that experiments with lifted wheels cannot show (load_friction,
/// torque_saturation) or that a wheel does not have (spring), effects that the known model already contains,
/// those of bus and drive (transport_delay, torque_lag, unsigned_current, actuator_gain, actuator_offset,
/// torque_sensor_offset), and of those that repeat over position all but cogging.
class HiddenEffect {
 public:
  static constexpr int kMaxSeed = 2'000'000'000;  ///< accepted by options and configurations; the minimum is
                                                  ///< 0

  explicit HiddenEffect(std::uint64_t seed);

  /// The known model with the effect, as simulated.
  const model::effects::DriveModel& wheel_model() const noexcept { return wheel_model_; }
  const model::effects::AnyEffect& effect() const noexcept { return wheel_model_.effects.back(); }
  /// Description: "stribeck: static torque 0.083 N·m, velocity 0.24 rad/s". For the end only.
  std::string reveal() const;

 private:
  model::effects::DriveModel wheel_model_;
};

/// Models of the simulated wheels, for sim::MecanumWheelParameters: of model files, one for all wheels or one
/// for each, of a hidden effect, or none.
/// @throws std::invalid_argument for both, naming the options, and for another number of files; ConfigError
/// as read_drive_model().
std::vector<model::effects::DriveModel> simulated_wheel_models(
    const std::vector<std::string>& model_files, const std::optional<std::uint64_t>& hidden_effect);

}  // namespace runtime
