/// @file
/// The law by which a servo follows a set-point.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>

namespace model {

/// Joint side. With the output u of the law, limited to ±limit,
///
///   u = Kp·(θ* − θ) + Kd·(ω* − ω) + Ki·∫(ω* − ω) dt
///
/// a servo that is fed with a voltage makes the torque τ = k/R·(u − k·ω), one with a current loop τ = u. The
/// integral stops at the limit. Without a velocity set-point ω* = 0 and, so that Ki does not pull to where it
/// started, the integral is of θ* − θ.
struct ServoLaw {
  enum class Output : std::uint8_t { kVoltage, kTorque };
  Output output = Output::kVoltage;
  double position_gain = 0;             ///< Kp, in V or N·m per rad
  double velocity_gain = 0;             ///< Kd, in V or N·m per rad/s
  double integral_gain = 0;             ///< Ki, per rad, or per rad·s without a velocity set-point
  double limit = 0;                     ///< in V or N·m; > 0
  double torque_constant_Nm_per_A = 1;  ///< k, for a voltage
  double resistance_ohm = 1;            ///< R, for a voltage

  double torque_Nm(double u, double velocity_rad_per_s) const noexcept {
    if (output == Output::kTorque) return u;
    return torque_constant_Nm_per_A / resistance_ohm * (u - torque_constant_Nm_per_A * velocity_rad_per_s);
  }
};

/// A set-point. NaN: there is none.
struct ServoGoal {
  double position_rad;
  double velocity_rad_per_s;
};

/// A servo in operation. One thread. Cycle: torque_Nm() neither allocates nor locks.
class Servo {
 public:
  explicit Servo(const ServoLaw& law) noexcept : law_(law) {}

  /// Torque at a measured motion, once every `step_s`.
  double torque_Nm(const ServoGoal& goal, double position_rad, double velocity_rad_per_s,
                   double step_s) noexcept {
    const double off_rad = std::isnan(goal.position_rad) ? 0 : goal.position_rad - position_rad;
    const bool follows_velocity = !std::isnan(goal.velocity_rad_per_s);
    const double off_rad_per_s = (follows_velocity ? goal.velocity_rad_per_s : 0) - velocity_rad_per_s;
    const double summed = integral_ + (follows_velocity ? off_rad_per_s : off_rad) * step_s;
    const auto output = [&](double integral) {
      return law_.position_gain * off_rad + law_.velocity_gain * off_rad_per_s +
             law_.integral_gain * integral;
    };
    if (std::abs(output(summed)) < law_.limit || std::abs(summed) < std::abs(integral_)) integral_ = summed;
    return law_.torque_Nm(std::clamp(output(integral_), -law_.limit, law_.limit), velocity_rad_per_s);
  }
  void reset() noexcept { integral_ = 0; }

 private:
  ServoLaw law_;
  double integral_ = 0;
};

}  // namespace model
