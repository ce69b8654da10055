#include "identification/gap/blind_spots.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "identification/gap/fast_ripple.h"
#include "identification/gap/wording.h"

namespace identification::gap {
namespace {

/// Relative to the fastest speed: below it friction falls or rises when sliding begins.
constexpr double kSlow = 0.1;
constexpr double kMinShare = 0.02;
constexpr double kMinRunning_s = 15;
constexpr std::size_t kMinReversals = 4;
/// Change between samples over the torque itself, rms: that of a sine with twelve samples per period.
constexpr double kMaxChange = 0.5;
/// Of a ripple, per turn: a motor's magnets and slots behind a small gear.
constexpr double kUsualPeriods = 100;

struct Coverage {
  double samples = 0;
  double forward = 0;
  double backward = 0;
  double slow = 0;
  std::size_t reversals = 0;
  double angle_rad = 0;
  double longest_s = 0;
  bool torque_commanded = false;
  bool speed_commanded = false;
  double change = 0;  ///< maximum over all recordings
};

/// Change of the commanded torque, which has less noise than a measured one, between samples, relative to its
/// own rms.
double change_of(const Signals& s) {
  const std::vector<double>& torque = s.raw_command_Nm;
  double square = 0;
  double step_square = 0;
  for (std::size_t i = 1; i < torque.size(); ++i) {
    square += torque[i] * torque[i];
    step_square += std::pow(torque[i] - torque[i - 1], 2);
  }
  return square > 0 ? std::sqrt(step_square / square) : 0;
}

Coverage coverage_of(std::span<const Signals> signals) {
  double fastest = 0;
  for (const Signals& s : signals)
    for (const double v : s.velocity_rad_per_s) fastest = std::max(fastest, std::abs(v));
  Coverage c;
  c.angle_rad = widest_span_rad(signals);
  for (const Signals& s : signals) {
    c.longest_s = std::max(c.longest_s, s.running_s.back());
    c.torque_commanded = c.torque_commanded || !s.raw_command_Nm.empty();
    c.speed_commanded = c.speed_commanded || !s.raw_velocity_command_rad_per_s.empty();
    c.change = std::max(c.change, change_of(s));
    double direction = 0;
    for (std::size_t i = 0; i < s.size(); ++i) {
      if (s.moving[i] == 0) continue;
      const double v = s.velocity_rad_per_s[i];
      c.samples += 1;
      (v > 0 ? c.forward : c.backward) += 1;
      c.slow += std::abs(v) < kSlow * fastest ? 1 : 0;
      if (v * direction < 0) ++c.reversals;
      direction = v;
    }
  }
  return c;
}

/// Typical size of an effect, relative to the Coulomb torque.
constexpr double kOften = 0.3;
constexpr double kUsualCoulomb_Nm = 0.05;
/// In encoder steps: displacement of a joint at a reversal.
constexpr double kSteps = 20;
constexpr double kFalls_rad_per_s = 0.3;
constexpr double kWarm_s = 20;
constexpr double kSpring_Hz = 20;
/// Share of the inertia behind the spring.
constexpr double kLoad = 0.2;

}  // namespace

model::effects::AnyEffect usual_effect(std::string_view effect, const model::effects::DriveModel& model,
                                       double resolution_rad) {
  const auto* friction = model.find<model::effects::Coulomb>();
  const double coulomb_Nm = friction != nullptr ? friction->parameters().torque_Nm : kUsualCoulomb_Nm;
  const double amount_Nm = kOften * coulomb_Nm;
  const double give_rad = kSteps * resolution_rad;
  const double rad_per_s = 2 * std::numbers::pi * kSpring_Hz;
  std::vector<model::effects::NamedValue> values{{"torque_Nm", amount_Nm}};
  if (effect == "stribeck")
    values = {{"static_torque_Nm", coulomb_Nm + amount_Nm}, {"velocity_rad_per_s", kFalls_rad_per_s}};
  if (effect == "thermal_drift") values = {{"coulomb_change_Nm", -amount_Nm}, {"time_constant_s", kWarm_s}};
  if (effect == "presliding") values = {{"stiffness_Nm_per_rad", coulomb_Nm / give_rad}};
  if (effect == "backlash") values = {{"gap_rad", give_rad}};
  if (effect == "elasticity")
    values = {{"stiffness_Nm_per_rad", kLoad * model.inertia_kg_m2 * rad_per_s * rad_per_s}};
  for (model::effects::NamedValue& value : values)
    for (const auto& parameter : model::effects::effect_description(effect).parameters)
      if (parameter.name == value.name)
        value.value = std::clamp(value.value, parameter.lower, parameter.upper);
  return model::effects::make_effect(effect, values);
}

std::vector<BlindSpot> blind_spots(std::span<const Signals> signals, bool rests) {
  std::vector<BlindSpot> spots;
  const Coverage c = coverage_of(signals);
  if (c.change > kMaxChange)
    spots.push_back(
        {"the torque changes by half of itself or more from one sample to the next: what happens in between "
         "looks like a gap; record at a higher rate",
         {}});
  if (std::min(c.forward, c.backward) < kMinShare * c.samples)
    spots.push_back(
        {"the joint moves one way only: a torque offset, friction that differs by direction and Coulomb "
         "friction look the same",
         {"torque_offset"}});
  if (std::ranges::any_of(signals, &Signals::signed_by_motion))
    spots.push_back(
        {"the torque has lost its sign and has that of the motion instead: backlash, elasticity and "
         "presliding do not show; record torque_command_Nm",
         {}});
  else if (c.reversals < kMinReversals)
    spots.push_back({"the joint hardly ever reverses: backlash, elasticity and presliding do not show",
                     {"backlash", "elasticity", "presliding"}});
  else if (!rests)
    spots.push_back(
        {"the joint never rests while the torque changes: a friction contact that gives less than it travels "
         "in a few samples does not show",
         {"presliding"}});
  if (c.slow < kMinShare * c.samples)
    spots.push_back({"the joint is hardly ever slow: Stribeck friction does not show", {"stribeck"}});
  if (c.angle_rad < kMinStroke_rad)
    spots.push_back({"the joint turns less than " + short_number(kMinStroke_rad) +
                         " rad: imbalance, spring and load friction do not show",
                     {"imbalance"}});
  if (const double shown = most_periods_shown(signals); shown > 0 && shown < kUsualPeriods)
    spots.push_back({"a ripple of more than " + short_number(shown) +
                         " periods a turn does not show: at these speeds it is above the analysed band; turn "
                         "the joint more slowly",
                     {}});
  if (c.longest_s < kMinRunning_s)
    spots.push_back(
        {"no recording is longer than fifteen seconds: thermal drift does not show", {"thermal_drift"}});
  if (!c.torque_commanded)
    spots.push_back({std::string("no torque command was recorded: ") +
                         (c.speed_commanded ? "a dead-band of the actuator does"
                                            : "dead-band and delay of the actuator do") +
                         " not show; record torque_command_Nm",
                     {}});
  return spots;
}

}  // namespace identification::gap
