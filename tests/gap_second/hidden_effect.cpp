#include "tests/gap_second/hidden_effect.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <stdexcept>

namespace gap_second {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

/// What an effect is drawn with: random numbers, and the sizes of the drive.
struct Draw {
  Subject& subject;
  std::mt19937_64& random;
  DriveTruth& truth = subject.truth;
  Rig& rig = subject.rig;
  double coulomb = subject.truth.coulomb_Nm;
  double top = subject.rig.top_speed_rad_per_s;

  double between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  }
  double either_sign(double low, double high) {
    return between(0, 1) < 0.5 ? -between(low, high) : between(low, high);
  }
  template <std::size_t N>
  double one_of(const std::array<double, N>& values) {
    return values[std::uniform_int_distribution<std::size_t>(0, N - 1)(random)];
  }
  void know(const std::string& parameter, double value) { subject.parameters[parameter] = value; }
  void at_least(double rate_Hz) { rig.rate_Hz = std::max(rig.rate_Hz, rate_Hz); }
};

void hide_stribeck(Draw& d) {
  d.truth.static_excess_Nm = d.coulomb * d.between(0.4, 1.0);
  d.truth.stribeck_rad_per_s = d.top * d.between(0.03, 0.08);
  d.know("stribeck.static_torque_Nm", d.coulomb + d.truth.static_excess_Nm);
  d.know("stribeck.velocity_rad_per_s", d.truth.stribeck_rad_per_s);
}

void hide_asymmetry(Draw& d) {
  d.truth.asymmetry_coulomb_Nm = d.coulomb * d.either_sign(0.1, 0.3);
  d.truth.asymmetry_viscous_Nm_s_per_rad = d.truth.viscous_Nm_s_per_rad * d.either_sign(0.25, 0.45);
}

void hide_dip(Draw& d) {
  d.truth.dip_depth_Nm = d.coulomb * d.between(0.3, 0.6);
  d.truth.dip_centre_rad_per_s = d.top * d.between(0.25, 0.4);
  d.truth.dip_width_rad_per_s = d.top * d.between(0.08, 0.15);
  d.know("midspeed_dip.centre_rad_per_s", d.truth.dip_centre_rad_per_s);
}

void hide_drag(Draw& d) {
  d.truth.drag_Nm_s2_per_rad2 = d.coulomb * d.between(0.5, 1.5) / (d.top * d.top);
  d.know("quadratic_drag.coefficient_Nm_s2_per_rad2", d.truth.drag_Nm_s2_per_rad2);
}

void hang_weight(Draw& d, double least, double most) {
  d.truth.imbalance_Nm = d.coulomb * d.between(least, most);
  d.truth.rest_position_rad = d.between(-1.5, 1.5);
  d.rig.usual_torque_Nm = d.coulomb + d.truth.imbalance_Nm;
}

void hide_load_friction(Draw& d) {
  hang_weight(d, 1.0, 2.0);  // which the base model knows
  d.truth.load_friction_share = d.between(0.15, 0.4);
  d.know("load_friction.share", d.truth.load_friction_share);
}

void hide_imbalance(Draw& d) {
  hang_weight(d, 0.5, 1.5);
  d.know("imbalance.torque_Nm", d.truth.imbalance_Nm);
}

void hide_presliding(Draw& d) {
  d.at_least(500);
  const double deflection = d.between(20, 100) * kTurn / d.rig.ticks_per_rev;
  d.truth.bristle_stiffness_Nm_per_rad = d.coulomb / deflection;
  d.know("presliding.stiffness_Nm_per_rad", d.truth.bristle_stiffness_Nm_per_rad);
}

void hide_cogging(Draw& d) {
  d.truth.cogging_Nm = d.coulomb * d.between(0.15, 0.5);
  d.truth.cogging_per_rev = d.subject.geared ? d.one_of(std::array{52.0, 78.0, 104.0})
                                             : d.one_of(std::array{7.0, 12.0, 14.0, 24.0, 42.0});
  d.truth.cogging_phase_rad = d.between(0, kTurn);
  d.know("cogging.amplitude_Nm", d.truth.cogging_Nm);
  d.know("cogging.periods_per_rev", d.truth.cogging_per_rev);
}

void hide_inertia(Draw& d) {
  const double difference = d.rig.nominal_inertia_kg_m2 * d.between(0.15, 0.6);
  d.truth.inertia_kg_m2 = d.rig.nominal_inertia_kg_m2 + difference;
  d.know("inertia.difference_kg_m2", difference);
}

/// A second mass behind a spring in which the load alone would swing at `frequency_Hz`.
void split(Draw& d, double frequency_Hz, double damping_ratio) {
  d.at_least(500);
  d.truth.load_share = d.between(0.3, 0.6);
  const double load = d.truth.inertia_kg_m2 * d.truth.load_share;
  const double omega = kTurn * frequency_Hz;
  d.truth.coupling_stiffness_Nm_per_rad = omega * omega * load;
  d.truth.coupling_damping_Nm_s_per_rad = 2 * damping_ratio * omega * load;
}

void hide_backlash(Draw& d) {
  split(d, d.between(40, 80), 0.05);
  d.truth.gap_rad = d.top * d.between(0.002, 0.006);
  const double restitution = d.between(0.3, 0.7);
  d.truth.impact_loss_s_per_rad = 1.5 * (1 - restitution) / (0.1 * d.top);
  d.know("backlash.gap_rad", d.truth.gap_rad);
}

void hide_elasticity(Draw& d) {
  const double frequency_Hz = d.between(6, 20);
  split(d, frequency_Hz, d.between(0.02, 0.08));
  d.rig.highest_tone_Hz = 2.5 * frequency_Hz;
  d.know("elasticity.stiffness_Nm_per_rad", d.truth.coupling_stiffness_Nm_per_rad);
}

void hide_drift(Draw& d) {
  d.rig.rate_Hz = std::min(d.rig.rate_Hz, 500.0);
  d.subject.seconds = 70;
  d.truth.drift_coulomb_Nm = d.coulomb * d.either_sign(0.3, 0.5);
  d.truth.drift_time_constant_s = d.between(10, 25);
  d.know("thermal_drift.coulomb_change_Nm", d.truth.drift_coulomb_Nm);
  d.know("thermal_drift.time_constant_s", d.truth.drift_time_constant_s);
}

void hide_delay(Draw& d) {
  d.truth.delay_s = std::max(d.between(0.012, 0.03), 3.3 / d.rig.rate_Hz);
  d.know("transport_delay.delay_s", d.truth.delay_s);
}

void hide_deadband(Draw& d) {
  d.truth.deadband_Nm = d.coulomb * d.between(0.7, 1.2);
  d.know("torque_deadband.threshold_Nm", d.truth.deadband_Nm);
}

const std::vector<std::pair<std::string, std::function<void(Draw&)>>>& hidings() {
  static const std::vector<std::pair<std::string, std::function<void(Draw&)>>> table = {
      // Every subject has it; the base model leaves it out.
      {"viscous", [](Draw& d) { d.know("viscous.coefficient_Nm_s_per_rad", d.truth.viscous_Nm_s_per_rad); }},
      {"stribeck", hide_stribeck},
      {"direction_asymmetry", hide_asymmetry},
      {"midspeed_dip", hide_dip},
      {"quadratic_drag", hide_drag},
      {"load_friction", hide_load_friction},
      {"presliding", hide_presliding},
      {"cogging", hide_cogging},
      {"imbalance", hide_imbalance},
      {"inertia", hide_inertia},
      {"backlash", hide_backlash},
      {"elasticity", hide_elasticity},
      {"thermal_drift", hide_drift},
      {"torque_offset", [](Draw& d) { d.truth.offset_Nm = d.coulomb * d.either_sign(0.2, 0.5); }},
      {"torque_deadband", hide_deadband},
      {"transport_delay", hide_delay},
      {"unsigned_current", [](Draw& d) { d.subject.unsigned_current = true; }}};
  return table;
}

const std::vector<std::pair<std::string, std::function<void(Draw&)>>>& causes() {
  static const std::vector<std::pair<std::string, std::function<void(Draw&)>>> table = {
      {"rough track", [](Draw& d) { d.truth.rough_track_share = d.between(0.4, 0.7); }},
      {"hidden lag", [](Draw& d) { d.truth.hidden_lag_s = d.between(0.03, 0.06); }},
      {"soft limit", [](Draw& d) { d.truth.soft_limit_Nm = d.coulomb * d.between(3, 5); }},
      {"gear efficiency", [](Draw& d) { d.truth.transmitted_share = d.between(0.15, 0.3); }},
      {"eccentric encoder",
       [](Draw& d) {  // large enough for the inertia to notice
         const double per_amplitude = d.truth.inertia_kg_m2 * d.top * d.top / 4;
         d.rig.encoder_eccentricity_rad = std::min(0.3, d.coulomb * d.between(0.5, 1.0) / per_amplitude);
       }},
      {"dragging brake", [](Draw& d) { d.truth.brake_Nm = d.coulomb * d.between(0.5, 1.0); }},
      {"hum", [](Draw& d) {
         d.truth.hum_Nm = d.coulomb * d.between(0.3, 0.6);
         d.truth.hum_Hz = d.between(2, 6);
       }}};
  return table;
}

std::vector<std::string> names_of(
    const std::vector<std::pair<std::string, std::function<void(Draw&)>>>& table) {
  std::vector<std::string> names;
  for (const auto& row : table) names.push_back(row.first);
  return names;
}

void apply(const std::vector<std::pair<std::string, std::function<void(Draw&)>>>& table,
           const std::string& name, Subject& subject, std::mt19937_64& random) {
  for (const auto& [known, hide] : table) {
    if (known != name) continue;
    Draw draw{subject, random};
    hide(draw);
    return;
  }
  throw std::invalid_argument("unknown effect: " + name);
}

}  // namespace

const std::vector<std::string>& known_effects() {
  static const std::vector<std::string> names = names_of(hidings());
  return names;
}

const std::vector<std::string>& unknown_causes() {
  static const std::vector<std::string> names = names_of(causes());
  return names;
}

bool belongs_to(const std::string& effect, const Subject& subject) {
  return subject.geared || effect != "backlash";
}

bool go_together(const std::string& one, const std::string& other) {
  static const std::vector<std::vector<std::string>> alike = {
      {"backlash", "elasticity", "presliding", "inertia"},
      {"torque_offset", "direction_asymmetry"},
      {"imbalance", "load_friction"},
      {"transport_delay", "torque_deadband"}};
  const auto in = [](const std::vector<std::string>& group, const std::string& effect) {
    return std::find(group.begin(), group.end(), effect) != group.end();
  };
  return one != other && std::none_of(alike.begin(), alike.end(),
                                      [&](const auto& group) { return in(group, one) && in(group, other); });
}

void hide_effect(const std::string& effect, Subject& subject, std::mt19937_64& random) {
  apply(hidings(), effect, subject, random);
}

void hide_unknown_cause(const std::string& cause, Subject& subject, std::mt19937_64& random) {
  apply(causes(), cause, subject, random);
}

void take_away(const std::string& effect, Subject& subject) {
  DriveTruth& truth = subject.truth;
  if (effect == "coulomb") truth.coulomb_Nm = 0;
  if (effect == "viscous") truth.viscous_Nm_s_per_rad = 0;
  if (effect == "stribeck") truth.static_excess_Nm = 0;
  if (effect == "direction_asymmetry") truth.asymmetry_coulomb_Nm = truth.asymmetry_viscous_Nm_s_per_rad = 0;
  if (effect == "midspeed_dip") truth.dip_depth_Nm = 0;
  if (effect == "quadratic_drag") truth.drag_Nm_s2_per_rad2 = 0;
  if (effect == "load_friction") truth.load_friction_share = 0;
  if (effect == "presliding") truth.bristle_stiffness_Nm_per_rad = 0;
  if (effect == "cogging") truth.cogging_Nm = 0;
  if (effect == "imbalance") truth.imbalance_Nm = 0;
  if (effect == "inertia") truth.inertia_kg_m2 = subject.rig.nominal_inertia_kg_m2;
  if (effect == "backlash") truth.gap_rad = 0;
  if (effect == "backlash" || effect == "elasticity") truth.load_share = 0;
  if (effect == "thermal_drift") truth.drift_coulomb_Nm = 0;
  if (effect == "torque_offset") truth.offset_Nm = 0;
  if (effect == "torque_deadband") truth.deadband_Nm = 0;
  if (effect == "transport_delay") truth.delay_s = 0;
  if (effect == "unsigned_current") subject.unsigned_current = false;
}

Subject draw_subject(std::mt19937_64& random) {
  Subject subject;
  Draw draw{subject, random};
  struct Size {
    const char* name;
    double inertia_kg_m2, coulomb_Nm, top_rad_per_s;
    int ticks_per_rev;
    bool geared;
  };
  const std::array<Size, 3> sizes = {{{"small-motor", 1e-5, 0.003, 120, 8192, false},
                                      {"geared-joint", 0.0112, 0.045, 10, 104000, true},
                                      {"large-axis", 8.0, 18.0, 3, 1048576, true}}};
  const Size& size = sizes[std::uniform_int_distribution<std::size_t>(0, 2)(random)];
  subject.geared = size.geared;
  DriveTruth& truth = subject.truth;
  truth.inertia_kg_m2 = size.inertia_kg_m2 * draw.between(0.7, 1.5);
  truth.coulomb_Nm = size.coulomb_Nm * draw.between(0.7, 1.4);
  Rig& rig = subject.rig;
  rig.top_speed_rad_per_s = size.top_rad_per_s * draw.between(0.8, 1.2);
  truth.viscous_Nm_s_per_rad = truth.coulomb_Nm / rig.top_speed_rad_per_s * draw.between(0.6, 1.5);
  truth.current_lag_s = draw.between(0.0003, 0.001);
  truth.largest_torque_Nm = 30 * truth.coulomb_Nm;
  rig.name = size.name;
  rig.rate_Hz = draw.one_of(std::array{100.0, 200.0, 500.0, 1000.0, 1000.0, 2000.0});
  rig.ticks_per_rev = size.ticks_per_rev;
  rig.torque_noise_Nm = truth.coulomb_Nm * draw.between(0.02, 0.04);
  rig.torque_is_mean = draw.between(0, 1) < 0.5;
  rig.usual_torque_Nm = truth.coulomb_Nm;
  rig.nominal_inertia_kg_m2 = truth.inertia_kg_m2;
  rig.highest_tone_Hz = std::min(15.0, rig.rate_Hz / 12);
  return subject;
}

}  // namespace gap_second
