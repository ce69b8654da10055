/// @file
/// A custom effect: defined by a program, not part of the library.
///
///     model::effects::add_custom_effect(
///         {.name = "log_friction",
///          .shows = "friction that grows with the logarithm of the speed",
///          .amplitude = {"torque_Nm", 0, 10, 0.01},
///          .shape = {{"velocity_rad_per_s", 1e-3, 10, 0.1}},
///          .tried_shapes = {0.03, 0.1, 0.3},
///          .level = [](const Sliding& s, double v0) noexcept { return std::log1p(s.speed_rad_per_s / v0);
///          }});
///
/// Afterwards it behaves like any other effect: make_effect() creates it, drive model files may contain it,
/// the simulation includes it, and the search for missing effects tries it.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "model/catalogue.h"
#include "model/effects/effect.h"

namespace model::effects {

/// The functions are called by several threads at once and return finite numbers.
struct CustomEffect {
  struct Parameter {
    std::string name;  ///< letters, digits and underscores; ends with its unit
    double lower;
    double upper;
    double initial;  ///< the default
  };
  std::string name;                  ///< lower-case letters, digits and underscores
  std::string shows;                 ///< how it shows in measured data
  Parameter amplitude;               ///< factor of the functions
  std::optional<Parameter> shape{};  ///< argument of the functions; without one they receive 0
  /// Initial shapes of the search for missing effects; empty: the default.
  std::vector<double> tried_shapes{};
  /// Friction of a sliding joint at an amplitude of 1: positive opposes the motion. Cycle.
  double (*level)(const Sliding&, double shape) noexcept = nullptr;
  /// Torque against positive motion of the load over its position, at an amplitude of 1. Cycle.
  double (*load)(double position_rad, double shape) noexcept = nullptr;
};

/// A custom effect with its values.
class Custom {
 public:
  /// `kind` lives as long as the program. @throws std::invalid_argument as require_within()
  Custom(const CustomEffect& kind, double amplitude, double shape);

  /// The same with an amplitude of 1, which may be outside its bounds: a column of a regression.
  Custom with_unit_amplitude() const noexcept {
    Custom unit = *this;
    unit.amplitude_ = 1;
    return unit;
  }

  const CustomEffect& kind() const noexcept { return *kind_; }
  double amplitude() const noexcept { return amplitude_; }
  double shape() const noexcept { return shape_; }
  double level_Nm(const Sliding& sliding) const noexcept {
    return kind_->level != nullptr ? amplitude_ * kind_->level(sliding, shape_) : 0;
  }
  double load_Nm(double position_rad) const noexcept {
    return kind_->load != nullptr ? amplitude_ * kind_->load(position_rad, shape_) : 0;
  }

 private:
  const CustomEffect* kind_;
  double amplitude_;
  double shape_;
};

/// Maximum number of effects that a program can add.
inline constexpr std::size_t kMaxCustomEffects = 32;

/// Set-up: adds an effect for the lifetime of the program. Call it before anything else uses effects: no
/// other thread may use them during the call. @throws std::invalid_argument that names the mistake: a name
/// already in use, a shape or default outside its bounds, no function, or too many effects.
void add_custom_effect(CustomEffect effect);
/// In the order in which they were added.
std::vector<const CustomEffect*> custom_effects();

}  // namespace model::effects
