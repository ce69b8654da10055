/// @file
/// A position-dependent torque.
#pragma once
#include <cmath>
#include <vector>

#include "model/even_table.h"

namespace model {

/// T(θ) = T0 + Σ A·sin(N·θ + φ) + Σ B·f(θ) + Σ table(θ), positive against positive motion: an offset, a
/// weight off the axis (N = 1), magnets, slots and teeth, functions that a program adds, and measured ones. θ
/// is the position reported by the drive, so this holds as long as its encoder keeps its zero: the youBot's
/// wheels lose it when powered off.
struct PositionTorque {
  struct Harmonic {
    double amplitude_Nm = 0;     ///< A
    double periods_per_rev = 1;  ///< N, of the joint
    double phase_rad = 0;        ///< φ
  };
  struct Function {
    double amplitude = 0;                                      ///< B
    double shape = 0;                                          ///< second argument of f
    double (*of)(double position_rad, double shape) noexcept;  ///< f
  };
  double constant_Nm = 0;  ///< T0
  std::vector<Harmonic> harmonics{};
  std::vector<Function> functions{};
  std::vector<EvenTable> tables{};

  /// Cycle.
  double at_Nm(double position_rad) const noexcept {
    double torque_Nm = constant_Nm;
    for (const Harmonic& harmonic : harmonics)
      torque_Nm +=
          harmonic.amplitude_Nm * std::sin(harmonic.periods_per_rev * position_rad + harmonic.phase_rad);
    for (const Function& f : functions) torque_Nm += f.amplitude * f.of(position_rad, f.shape);
    for (const EvenTable& table : tables) torque_Nm += table.at(position_rad);
    return torque_Nm;
  }
};

}  // namespace model
