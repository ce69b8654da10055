/// @file
/// An effect that a program brings along, because the library does not have it.
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
/// From then on it is an effect like the others: make_effect() makes it, drive models are read and written
/// with it, drives are simulated with it, and the search for missing effects tries it.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "model/catalogue.h"
#include "model/effects/effect.h"

namespace model::effects {

struct CustomEffect {
  struct Parameter {
    std::string name;  ///< ends with its unit
    double lower;
    double upper;
    double initial;  ///< the default
  };
  std::string name;                  ///< lower-case letters, digits and underscores
  std::string shows;                 ///< how it shows in measured data
  Parameter amplitude;               ///< what the functions are multiplied by
  std::optional<Parameter> shape{};  ///< what they are given; without one they are given 0
  /// Shapes that the search for missing effects begins with.
  std::vector<double> tried_shapes{};
  /// Friction of a joint that slides, at an amplitude of 1: positive takes more torque. Cycle.
  double (*level)(const Sliding&, double shape) noexcept = nullptr;
  /// Torque against positive motion of the load over its position, at an amplitude of 1. Cycle.
  double (*load)(double position_rad, double shape) noexcept = nullptr;
};

/// A custom effect with its values.
class Custom {
 public:
  /// `kind` lives as long as the program. @throws std::invalid_argument as require_within()
  Custom(const CustomEffect& kind, double amplitude, double shape);

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

/// So many a program can add.
inline constexpr std::size_t kMaxCustomEffects = 32;

/// Set-up: adds an effect for as long as the program runs. Call it before anything else uses effects: no
/// other thread may use them meanwhile. @throws std::invalid_argument naming what is wrong with it: a name
/// that is taken, a shape or default out of its bounds, no function, or one effect too many.
void add_custom_effect(CustomEffect effect);
/// In the order in which they were added.
std::vector<const CustomEffect*> custom_effects();

}  // namespace model::effects
