#include "identification/robot_gap/arm_terms.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

namespace identification::robot_gap {
namespace {

using control::ArmDescription;
using control::ArmDrive;
using Kind = ArmTerm::Kind;

/// A link may lose this share of its mass.
constexpr double kLossOfMass = 0.95;
constexpr double kLeastTorqueScale = 0.2;
/// Stribeck speeds to try, as shares of the joint's top speed.
constexpr std::array kStribeckShares{0.03, 0.1, 0.3};

/// Effects that refine the friction of a given model.
constexpr std::array<std::string_view, 5> kFriction{"coulomb", "viscous", "load_friction", "stribeck",
                                                    "quadratic_drag"};

constexpr std::array kAxisNames{"x", "y", "z"};
constexpr std::array kTensorNames{"xx", "xy", "xz", "yy", "yz", "zz"};
constexpr std::array<std::array<int, 2>, 6> kTensorPlaces{{{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}}};

std::size_t at(int index) { return static_cast<std::size_t>(index); }

/// The drive's parameter; null for those of links and payload.
double* of_drive(ArmDrive& drive, const ArmTerm& term) {
  switch (term.kind) {
    case Kind::kEncoderZero: return &drive.encoder_zero_rad;
    case Kind::kCompliance: return &drive.compliance_rad_per_Nm;
    case Kind::kTorqueScale: return &drive.torque_scale;
    case Kind::kRotorInertia: return &drive.rotor_inertia_kg_m2;
    case Kind::kCoulomb: return &drive.coulomb_Nm;
    case Kind::kViscous: return &drive.viscous_Nm_s_per_rad;
    case Kind::kQuadraticDrag: return &drive.quadratic_drag_Nm_s2_per_rad2;
    case Kind::kOffset: return &drive.offset_Nm;
    case Kind::kLoadFriction: return &drive.load_friction;
    case Kind::kStribeck: return &drive.stribeck_Nm;
    case Kind::kSpring: return &drive.spring_Nm_per_rad;
    case Kind::kCable: return term.index == 2 ? &drive.cable_2_Nm_per_rad2 : &drive.cable_3_Nm_per_rad3;
    case Kind::kNeighbour:
      return term.index < 0 ? &drive.friction_of_previous_Nm : &drive.friction_of_next_Nm;
    default: return nullptr;
  }
}

ArmDrive::Ripple* find_ripple(ArmDrive& drive, double periods_per_rev) {
  for (ArmDrive::Ripple& ripple : drive.ripples)
    if (ripple.periods_per_rev == periods_per_rev) return &ripple;
  return nullptr;
}

/// Dissipation, masses and springs are not negative.
bool never_negative(Kind kind) {
  switch (kind) {
    case Kind::kPayloadMass:
    case Kind::kCompliance:
    case Kind::kRotorInertia:
    case Kind::kCoulomb:
    case Kind::kViscous:
    case Kind::kQuadraticDrag:
    case Kind::kLoadFriction:
    case Kind::kNeighbour: return true;
    default: return false;
  }
}

/// "mass_kg"; in files and reports.
std::string term_name(const ArmTerm& term, const ArmDescription& arm) {
  switch (term.kind) {
    case Kind::kPayloadMass:
    case Kind::kLinkMass:
    case Kind::kLinkDensity: return "mass_kg";
    case Kind::kPayloadMoment: return std::string("moment_") + kAxisNames[at(term.index)] + "_kg_m";
    case Kind::kLinkCentre: return std::string("centre_") + kAxisNames[at(term.index)] + "_m";
    case Kind::kLinkInertia: return std::string("inertia_") + kTensorNames[at(term.index)] + "_kg_m2";
    case Kind::kTilt: {
      const TiltAxes axes = tilt_axes(arm.gravity_B_m_per_s2);
      int nearest = 0;
      (term.index == 0 ? axes.first : axes.second).cwiseAbs().maxCoeff(&nearest);
      return std::string("tilt_about_") + "xyz"[nearest] + "_rad";
    }
    case Kind::kEncoderZero: return "encoder_zero_rad";
    case Kind::kCompliance: return "compliance_rad_per_Nm";
    case Kind::kTorqueScale: return "torque_scale";
    case Kind::kRotorInertia: return "rotor_inertia_kg_m2";
    case Kind::kCoulomb: return "coulomb_Nm";
    case Kind::kViscous: return "viscous_Nm_s_per_rad";
    case Kind::kQuadraticDrag: return "quadratic_drag_Nm_s2_per_rad2";
    case Kind::kOffset: return "offset_Nm";
    case Kind::kLoadFriction: return "load_friction";
    case Kind::kStribeck: return "stribeck_Nm";
    case Kind::kSpring: return "spring_Nm_per_rad";
    case Kind::kCable: return term.index == 2 ? "cable_2_Nm_per_rad2" : "cable_3_Nm_per_rad3";
    case Kind::kRippleSine: return "sine_Nm";
    case Kind::kRippleCosine: return "cosine_Nm";
    case Kind::kNeighbour: return term.index < 0 ? "friction_of_previous_Nm" : "friction_of_next_Nm";
    case Kind::kLag: return "torque_lag_s";
  }
  return {};
}

/// Allowed changes of the value.
gap::Bounds change_bounds(const ArmTerm& term, const ArmDescription& arm) {
  const double value = value_of(term, arm);
  if (never_negative(term.kind)) return {.lower = -value};
  if (term.kind == Kind::kLinkMass || term.kind == Kind::kLinkDensity) return {.lower = -kLossOfMass * value};
  if (term.kind == Kind::kTorqueScale) return {.lower = std::min(0.0, kLeastTorqueScale - value)};
  if (term.kind == Kind::kStribeck) return {.lower = -value};
  return {};
}

/// Whether torques are a sum over such terms.
bool is_linear(Kind kind) {
  return kind != Kind::kPayloadMoment && kind != Kind::kLinkCentre && kind != Kind::kTilt &&
         kind != Kind::kEncoderZero && kind != Kind::kCompliance && kind != Kind::kTorqueScale &&
         kind != Kind::kLoadFriction;
}

/// Collects terms, each once.
class Collector {
 public:
  explicit Collector(const ArmDescription& arm) : arm_(arm) {}

  void add(std::string_view effect, int part, const std::vector<ArmTerm>& terms) {
    Candidate candidate{std::string(effect), part, part_name(effect, part), {}, false};
    for (const ArmTerm& one : terms) candidate.terms.push_back(place_of(one));
    candidate.is_refit =
        std::ranges::find(kFriction, effect) != kFriction.end() && value_of(terms.front(), arm_) != 0;
    all_.catalogue.candidates.push_back(std::move(candidate));
  }
  ArmCatalogue collected() { return std::move(all_); }

 private:
  std::size_t place_of(const ArmTerm& term) {
    const auto found = std::ranges::find(all_.terms, term);
    if (found != all_.terms.end()) return static_cast<std::size_t>(found - all_.terms.begin());
    all_.terms.push_back(term);
    all_.catalogue.terms.push_back(
        {term_name(term, arm_), value_of(term, arm_), change_bounds(term, arm_), is_linear(term.kind)});
    return all_.terms.size() - 1;
  }

  std::string part_name(std::string_view effect, int part) const {
    if (effect == "payload") return "tip";
    if (part < 0) return "base";
    const control::ArmLink& link = arm_.arm.links[at(part)];
    return effect.starts_with("link_") ? link.link : link.joint;
  }

  const ArmDescription& arm_;
  ArmCatalogue all_;
};

std::vector<ArmTerm> indexed(Kind kind, int part, int count) {
  std::vector<ArmTerm> terms;
  for (int i = 0; i < count; ++i) terms.push_back({kind, part, i});
  return terms;
}

void add_links(Collector& all, const ArmDescription& arm) {
  const int last = static_cast<int>(arm.arm.links.size()) - 1;
  all.add("payload", -1, {{Kind::kPayloadMass, last}});
  for (int link = 0; link <= last; ++link) {
    all.add("link_mass", link, {{Kind::kLinkMass, link}});
    if (arm.arm.links[at(link)].inertia.mass_kg > 0) {
      all.add("link_mass", link, {{Kind::kLinkDensity, link}});
      all.add("link_centre", link, indexed(Kind::kLinkCentre, link, 3));
    }
    all.add("link_inertia", link, indexed(Kind::kLinkInertia, link, 6));
  }
  all.add("gravity_direction", -1, indexed(Kind::kTilt, 0, 2));
  std::vector<ArmTerm> payload = indexed(Kind::kPayloadMoment, last, 3);
  payload.insert(payload.begin(), {Kind::kPayloadMass, last});
  all.add("payload", -1, payload);
}

void add_drive(Collector& all, const ArmDescription& arm, int joint, double top_speed,
               std::span<const double> ripples) {
  const ArmDrive& drive = arm.drives[at(joint)];
  const int joints = static_cast<int>(arm.drives.size());
  all.add("coulomb", joint, {{Kind::kCoulomb, joint}});
  all.add("viscous", joint, {{Kind::kViscous, joint}});
  all.add("torque_offset", joint, {{Kind::kOffset, joint}});
  all.add("load_friction", joint, {{Kind::kLoadFriction, joint}});
  all.add("rotor_inertia", joint, {{Kind::kRotorInertia, joint}});
  all.add("torque_constant", joint, {{Kind::kTorqueScale, joint}});
  all.add("encoder_zero", joint, {{Kind::kEncoderZero, joint}});
  if (drive.compliance_rad_per_Nm == 0 || !drive.friction_before_gear)
    all.add("elasticity", joint, {{Kind::kCompliance, joint, 0}});
  if (drive.compliance_rad_per_Nm == 0 || drive.friction_before_gear)
    all.add("elasticity", joint, {{Kind::kCompliance, joint, 1}});
  if (drive.stribeck_Nm != 0)
    all.add("stribeck", joint, {{Kind::kStribeck, joint, 0, drive.stribeck_speed_rad_per_s}});
  else
    for (const double share : kStribeckShares)
      all.add("stribeck", joint, {{Kind::kStribeck, joint, 0, share * top_speed}});
  all.add("quadratic_drag", joint, {{Kind::kQuadraticDrag, joint}});
  if (joint > 0) all.add("friction_coupling", joint, {{Kind::kNeighbour, joint, -1}});
  if (joint + 1 < joints) all.add("friction_coupling", joint, {{Kind::kNeighbour, joint, 1}});
  all.add("spring", joint, {{Kind::kSpring, joint}, {Kind::kOffset, joint}});
  for (const double order : ripples)
    all.add("cogging", joint, {{Kind::kRippleSine, joint, 0, order}, {Kind::kRippleCosine, joint, 0, order}});
  all.add(
      "cable_torque", joint,
      {{Kind::kSpring, joint}, {Kind::kOffset, joint}, {Kind::kCable, joint, 2}, {Kind::kCable, joint, 3}});
}

}  // namespace

double value_of(const ArmTerm& term, const ArmDescription& arm) {
  ArmDrive drive = arm.drives[at(term.part)];
  const control::LinkInertia& body = arm.arm.links[at(term.part)].inertia;
  switch (term.kind) {
    case Kind::kPayloadMass: return arm.payload_kg;
    case Kind::kPayloadMoment: return arm.payload_kg * arm.p_TP_m[term.index];
    case Kind::kLinkMass:
    case Kind::kLinkDensity: return body.mass_kg;
    case Kind::kLinkCentre: return body.p_LC_m[term.index];
    case Kind::kLinkInertia: {
      const auto& [row, column] = kTensorPlaces[at(term.index)];
      return body.about_C_kg_m2(row, column);
    }
    case Kind::kRippleSine:
    case Kind::kRippleCosine: {
      const ArmDrive::Ripple* const ripple = find_ripple(drive, term.setting);
      if (ripple == nullptr) return 0;
      return term.kind == Kind::kRippleSine ? ripple->sine_Nm : ripple->cosine_Nm;
    }
    default: {
      const double* const value = of_drive(drive, term);
      return value == nullptr ? 0 : *value;
    }
  }
}

TiltAxes tilt_axes(const Eigen::Vector3d& gravity_B) {
  // The axes of B but the one nearest to gravity, made perpendicular to it.
  const Eigen::Vector3d down = gravity_B.normalized();
  int nearest = 0;
  down.cwiseAbs().maxCoeff(&nearest);
  const int one = nearest == 0 ? 1 : 0;
  Eigen::Vector3d first = Eigen::Vector3d::Unit(one);
  first = (first - first.dot(down) * down).normalized();
  Eigen::Vector3d second = down.cross(first);
  if (second[3 - nearest - one] < 0) second = -second;
  return {first, second};
}

void change(ArmDescription& arm, const ArmTerm& term, double by) {
  ArmDrive& drive = arm.drives[at(term.part)];
  control::LinkInertia& body = arm.arm.links[at(term.part)].inertia;
  switch (term.kind) {
    case Kind::kPayloadMass: {
      const Eigen::Vector3d moment = arm.payload_kg * arm.p_TP_m;
      arm.payload_kg = std::max(0.0, arm.payload_kg + by);
      if (arm.payload_kg > 0) arm.p_TP_m = moment / arm.payload_kg;
      return;
    }
    case Kind::kPayloadMoment:
      if (arm.payload_kg > 0) arm.p_TP_m[term.index] += by / arm.payload_kg;
      return;
    case Kind::kLinkMass: body.mass_kg += by; return;
    case Kind::kLinkDensity:
      body.about_C_kg_m2 *= 1 + by / body.mass_kg;
      body.mass_kg += by;
      return;
    case Kind::kLinkCentre: body.p_LC_m[term.index] += by; return;
    case Kind::kLinkInertia: {
      const auto& [row, column] = kTensorPlaces[at(term.index)];
      body.about_C_kg_m2(row, column) += by;
      if (row != column) body.about_C_kg_m2(column, row) += by;
      return;
    }
    case Kind::kTilt: {
      const TiltAxes axes = tilt_axes(arm.gravity_B_m_per_s2);
      arm.gravity_B_m_per_s2 =
          Eigen::AngleAxisd(by, term.index == 0 ? axes.first : axes.second) * arm.gravity_B_m_per_s2;
      return;
    }
    case Kind::kRippleSine:
    case Kind::kRippleCosine: {
      if (find_ripple(drive, term.setting) == nullptr) drive.ripples.push_back({term.setting, 0, 0});
      ArmDrive::Ripple& ripple = *find_ripple(drive, term.setting);
      (term.kind == Kind::kRippleSine ? ripple.sine_Nm : ripple.cosine_Nm) += by;
      return;
    }
    case Kind::kStribeck: drive.stribeck_speed_rad_per_s = term.setting; break;
    case Kind::kCompliance: drive.friction_before_gear = term.index == 1; break;
    default: break;
  }
  if (double* const value = of_drive(drive, term)) *value += by;
}

ArmCatalogue arm_catalogue(const ArmDescription& arm, std::span<const double> top_speed_rad_per_s,
                           std::span<const double> ripples_per_rev) {
  Collector all(arm);
  add_links(all, arm);
  for (int joint = 0; joint < static_cast<int>(arm.drives.size()); ++joint) {
    std::vector<double> ripples(ripples_per_rev.begin(), ripples_per_rev.end());
    // Of a rotor that is not balanced, and the first of its magnets'.
    if (const double gear = arm.drives[at(joint)].gear_ratio; gear > 1) {
      ripples.push_back(gear);
      ripples.push_back(2 * gear);
    }
    add_drive(all, arm, joint, top_speed_rad_per_s[at(joint)], ripples);
  }
  return all.collected();
}

}  // namespace identification::robot_gap
