/// @file
/// Common parts of the tests of friction laws: a mass with friction, and repeatable random numbers.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "model/friction/any_law.h"
#include "model/friction/law.h"

namespace friction_test {

/// J·dv/dt = applied − friction by semi-implicit Euler, using only the law's interface.
template <class L>
class Joint {
 public:
  Joint(L law, double inertia) : law_(std::move(law)), inertia_(inertia) {}

  void step(double applied, double dt) {
    friction_ = law_.step(state_, {velocity_, applied}, dt);
    velocity_ += dt / inertia_ * (applied - friction_);
    position_ += dt * velocity_;
  }
  double position() const { return position_; }
  double velocity() const { return velocity_; }
  double friction() const { return friction_; }
  const model::friction::State& state() const { return state_; }
  void push(double velocity) { velocity_ = velocity; }

 private:
  L law_;
  double inertia_;
  model::friction::State state_;
  double position_ = 0, velocity_ = 0, friction_ = 0;
};

/// Moves the law by `way` at `speed` in `steps` equal steps; returns the friction at the end.
template <class L>
double moved(const L& law, model::friction::State& state, double way, double speed, int steps = 1) {
  double friction = 0;
  const double dt = std::abs(way) / speed / steps;
  for (int n = 0; n < steps; ++n) friction = law.step(state, {std::copysign(speed, way), 0}, dt);
  return friction;
}

class Chance {
 public:
  explicit Chance(unsigned seed) : engine_(seed) {}
  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11U) * 0x1p-53;
  }
  double log_between(double low, double high) { return std::exp(between(std::log(low), std::log(high))); }
  double sign() { return (engine_() & 1U) != 0 ? 1.0 : -1.0; }

 private:
  std::mt19937_64 engine_;
};

/// Every parameter at most a factor of `spread` from its default, within its bounds; zeros stay.
inline model::friction::AnyLaw varied(const model::friction::LawDescription& law, Chance& chance,
                                      double spread) {
  std::vector<double> values;
  for (const auto& parameter : law.parameters)
    values.push_back(parameter.name == "wheel"
                         ? std::floor(chance.between(1, 5))
                         : std::clamp(parameter.initial * chance.log_between(1 / spread, spread),
                                      parameter.lower, parameter.upper));
  return model::friction::make_law_from_values(law.name, values);
}

}  // namespace friction_test
