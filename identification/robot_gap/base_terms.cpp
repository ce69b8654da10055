#include "identification/robot_gap/base_terms.h"

#include <algorithm>
#include <limits>
#include <numbers>
#include <utility>

namespace identification::robot_gap {
namespace {

using control::BaseDescription;
using control::BaseKinematics;
using BaseKind = BaseTerm::Kind;
using Wheel = BaseDescription::Wheel;

constexpr double kFactor = 0.5;          // of a length or radius
constexpr double kLargeAngle_rad = 0.5;  // linear enough
constexpr double kMostSlip = 0.9;
constexpr double kSteepest = 0.3;
/// Of a floor, given or found.
constexpr double kSteepestSlope = 1;
constexpr double kSmall = 1e-4;
/// Steps of forces and torques: predictions are sums over them.
constexpr double kForceStep = 1e-3;
/// A base may lose this share of its mass.
constexpr double kMostMassLost = 0.95;
/// Of the given torque_scale.
constexpr double kLeastScale = 0.2;

gap::Bounds length_bounds(double value) { return {-kFactor * value, value / kFactor - value}; }
/// A change of at most `most` of a value that stays within ± `limit`.
gap::Bounds within(double value, double most, double limit) {
  return {std::clamp(-limit - value, -most, 0.0), std::clamp(limit - value, 0.0, most)};
}
gap::Bounds slip_bounds(double value) { return {std::min(0.0, -value), std::max(0.0, kMostSlip - value)}; }
/// Dissipation and inertia are not negative.
gap::Bounds positive_bounds(double value) { return {-value, std::numeric_limits<double>::infinity()}; }

double mean_of_wheels(const BaseDescription& base, double Wheel::*of) {
  double sum = 0;
  for (const Wheel& wheel : base.wheels) sum += wheel.*of;
  return sum / static_cast<double>(base.wheels.size());
}
double least_of_wheels(const BaseDescription& base, double Wheel::*of) {
  double least = std::numeric_limits<double>::infinity();
  for (const Wheel& wheel : base.wheels) least = std::min(least, wheel.*of);
  return least;
}

/// A change of all wheels and one of a single wheel may add up to less than nothing.
void keep_positive(BaseDescription& base, const BaseDescription& given) {
  for (std::size_t w = 0; w < base.wheels.size(); ++w) {
    Wheel& wheel = base.wheels[w];
    wheel.radius_m = std::max(wheel.radius_m, kFactor * kFactor * given.wheels[w].radius_m);
    for (double* const one : {&wheel.coulomb_Nm, &wheel.viscous_Nm_s_per_rad, &wheel.inertia_kg_m2})
      *one = std::max(0.0, *one);
  }
  for (double* const one :
       {&base.body.yaw_inertia_kg_m2, &base.body.sideways_resistance_N, &base.body.turning_resistance_Nm})
    *one = std::max(0.0, *one);
  for (BaseDescription::Floor& floor : base.floors) floor.resistance_N = std::max(0.0, floor.resistance_N);
}

class BaseCollector {
 public:
  BaseCollector(const BaseDescription& given, std::span<const BaseRecording> recordings)
      : given_(given), recordings_(recordings) {}

  void add_motion() {
    const double mean_m = mean_of_wheels(given_, &Wheel::radius_m);
    add_term("radius_m", mean_m, length_bounds(mean_m), {BaseKind::kAllRadii, 0, kSmall * mean_m});
    add_candidate("wheel_radius", -1, "base", 1);
    const double turning_m = given_.turning_length_m;
    add_term(control::turning_length_name(given_.kinematics), turning_m, length_bounds(turning_m),
             {BaseKind::kTurningLength, 0, kSmall * turning_m});
    add_candidate("turning_geometry", -1, "base", 1);
    if (given_.wheels.size() > 1)
      for (std::size_t w = 0; w < given_.wheels.size(); ++w) {
        const double radius_m = given_.wheels[w].radius_m;
        add_term("radius_m", radius_m, length_bounds(radius_m), {BaseKind::kRadius, w, kSmall * radius_m});
        add_candidate("wheel_radius", static_cast<int>(w), given_.wheels[w].name, 1);
      }
    if (given_.kinematics == BaseKinematics::kTricycle) {
      add_term("steering_offset_rad", given_.steering_offset_rad,
               within(given_.steering_offset_rad, kLargeAngle_rad, std::numbers::pi),
               {BaseKind::kSteeringOffset, 0, kSmall});
      add_candidate("steering_offset", -1, "steering", 1);
    }
    add_tracking();
    add_slip();
  }

  void add_forces() {
    const BaseDescription::Body& body = given_.body;
    add_term("mass_kg", body.mass_kg, {-kMostMassLost * body.mass_kg}, {BaseKind::kMass, 0, kForceStep});
    add_candidate("mass", -1, "base", 1);
    add_term("yaw_inertia_kg_m2", body.yaw_inertia_kg_m2, positive_bounds(body.yaw_inertia_kg_m2),
             {BaseKind::kYawInertia, 0, kForceStep});
    add_candidate("yaw_inertia", -1, "base", 1);
    add_of_wheels("torque_constant", "torque_scale", &Wheel::torque_scale, BaseKind::kAllTorques,
                  BaseKind::kTorque);
    add_of_wheels("coulomb", "coulomb_Nm", &Wheel::coulomb_Nm, BaseKind::kAllCoulomb, BaseKind::kCoulomb);
    add_of_wheels("viscous", "viscous_Nm_s_per_rad", &Wheel::viscous_Nm_s_per_rad, BaseKind::kAllViscous,
                  BaseKind::kViscous);
    for (std::size_t w = 0; w < given_.wheels.size(); ++w) {
      add_term("offset_Nm", given_.wheels[w].offset_Nm, {}, {BaseKind::kTorqueOffset, w, kForceStep});
      add_candidate("torque_offset", static_cast<int>(w), given_.wheels[w].name, 1);
    }
    add_of_wheels("wheel_inertia", "inertia_kg_m2", &Wheel::inertia_kg_m2, BaseKind::kAllInertias,
                  BaseKind::kInertia);
    if (given_.kinematics == BaseKinematics::kOmni || given_.kinematics == BaseKinematics::kMecanum) {
      add_term("sideways_resistance_N", body.sideways_resistance_N,
               positive_bounds(body.sideways_resistance_N), {BaseKind::kSidewaysResistance, 0, kForceStep});
      add_candidate("sideways_resistance", -1, "base", 1);
    }
    add_term("turning_resistance_Nm", body.turning_resistance_Nm, positive_bounds(body.turning_resistance_Nm),
             {BaseKind::kTurningResistance, 0, kForceStep});
    add_candidate("turning_resistance", -1, "base", 1);
    add_for_floors(
        "floor_resistance", "resistance_N", BaseKind::kFloorResistance, kForceStep,
        [](const BaseDescription::Floor& floor) { return floor.resistance_N; }, positive_bounds);
    const gap::Bounds anywhere{-10 * given_.turning_length_m, 10 * given_.turning_length_m};
    add_term("centre_x_m", body.p_BC_m.x(), anywhere, {BaseKind::kCentreX, 0, kForceStep});
    add_term("centre_y_m", body.p_BC_m.y(), anywhere, {BaseKind::kCentreY, 0, kForceStep});
    add_candidate("centre_of_mass", -1, "base", 2);
    add_term("slope_x", body.slope.x(), within(body.slope.x(), kSteepest, kSteepestSlope),
             {BaseKind::kSlopeX, 0, kForceStep});
    add_term("slope_y", body.slope.y(), within(body.slope.y(), kSteepest, kSteepestSlope),
             {BaseKind::kSlopeY, 0, kForceStep});
    add_candidate("floor_slope", -1, "floor", 2);
  }

  BaseCatalogue collected() { return std::move(all_); }

 private:
  void add_term(std::string name, double value, gap::Bounds change, BaseTerm term) {
    all_.catalogue.terms.push_back(
        {.name = std::move(name), .given = value, .change = change, .is_linear = false});
    all_.terms.push_back(term);
  }
  /// Of the last `terms` terms.
  void add_candidate(std::string effect, int part, std::string part_name, std::size_t terms) {
    Candidate one{.effect = std::move(effect), .part = part, .part_name = std::move(part_name), .terms = {}};
    for (std::size_t k = terms; k > 0; --k) one.terms.push_back(all_.terms.size() - k);
    all_.catalogue.candidates.push_back(std::move(one));
  }

  void add_tracking() {
    const BaseDescription::Tracking& tracking = given_.tracking;
    add_term("scale", tracking.scale, length_bounds(tracking.scale),
             {BaseKind::kTrackingScale, 0, kSmall * tracking.scale});
    add_candidate("tracking_scale", -1, "tracking", 1);
    add_term("yaw_rad", tracking.yaw_BT_rad, {-kLargeAngle_rad, kLargeAngle_rad},
             {BaseKind::kTrackingYaw, 0, kSmall});
    add_candidate("tracking_yaw", -1, "tracking", 1);
    const gap::Bounds anywhere{-10 * given_.turning_length_m, 10 * given_.turning_length_m};
    add_term("offset_x_m", tracking.p_BT_m.x(), anywhere, {BaseKind::kTrackingX, 0, kSmall});
    add_term("offset_y_m", tracking.p_BT_m.y(), anywhere, {BaseKind::kTrackingY, 0, kSmall});
    add_candidate("tracking_offset", -1, "tracking", 2);
  }

  void add_slip() {
    add_term("slip_forward", given_.slip_forward, slip_bounds(given_.slip_forward),
             {BaseKind::kSlipForward, 0, kSmall});
    add_candidate("slip_forward", -1, "base", 1);
    if (given_.kinematics == BaseKinematics::kOmni || given_.kinematics == BaseKinematics::kMecanum) {
      add_term("slip_sideways", given_.slip_sideways, slip_bounds(given_.slip_sideways),
               {BaseKind::kSlipSideways, 0, kSmall});
      add_candidate("slip_sideways", -1, "base", 1);
    }
    double largest = 0;
    for (const BaseRecording& recording : recordings_)
      if (recording.load.size() > 0) largest = std::max(largest, recording.load.cwiseAbs().maxCoeff());
    if (largest > 0) {
      const double value = given_.slip_with_load;
      add_term("slip_with_load", value, {std::min(0.0, -value), std::max(0.0, kMostSlip / largest - value)},
               {BaseKind::kSlipWithLoad, 0, kSmall / largest});
      add_candidate("slip_with_load", -1, "base", 1);
    }
    add_for_floors(
        "floor_slip", "slip", BaseKind::kFloorSlip, kSmall,
        [](const BaseDescription::Floor& floor) { return floor.slip; }, slip_bounds);
  }

  /// Of each floor that some recordings are on, and others not.
  template <class Value, class Allowed>
  void add_for_floors(const char* effect, const char* name, BaseKind kind, double step, Value value,
                      Allowed allowed) {
    for (std::size_t f = 0; f < given_.floors.size(); ++f) {
      const auto on = std::ranges::count(recordings_, static_cast<int>(f), &BaseRecording::floor);
      if (on == 0 || on == static_cast<std::ptrdiff_t>(recordings_.size())) continue;
      const double given = value(given_.floors[f]);
      add_term(name, given, allowed(given), {kind, f, step});
      add_candidate(effect, -1, given_.floors[f].name, 1);
    }
  }

  /// Of all wheels together, then of each.
  void add_of_wheels(const char* effect, const char* name, double Wheel::*of, BaseKind all, BaseKind single) {
    const bool is_scale = all == BaseKind::kAllTorques;
    const auto bounds = [&](double value) {
      return is_scale ? gap::Bounds{(kLeastScale - 1) * value} : positive_bounds(value);
    };
    const auto step = [&](double value) { return is_scale ? kForceStep * value : kForceStep; };
    const double mean = mean_of_wheels(given_, of);
    add_term(name, mean, bounds(is_scale ? mean : least_of_wheels(given_, of)), {all, 0, step(mean)});
    add_candidate(effect, -1, "base", 1);
    all_.catalogue.candidates.back().is_refit =
        (all == BaseKind::kAllCoulomb || all == BaseKind::kAllViscous) && mean != 0;
    if (given_.wheels.size() < 2) return;
    for (std::size_t w = 0; w < given_.wheels.size(); ++w) {
      add_term(name, given_.wheels[w].*of, bounds(given_.wheels[w].*of),
               {single, w, step(given_.wheels[w].*of)});
      add_candidate(effect, static_cast<int>(w), given_.wheels[w].name, 1);
    }
  }

  const BaseDescription& given_;
  std::span<const BaseRecording> recordings_;
  BaseCatalogue all_;
};

}  // namespace

BaseCatalogue base_catalogue(const BaseDescription& given, std::span<const BaseRecording> recordings,
                             bool with_forces) {
  BaseCollector all(given, recordings);
  all.add_motion();
  if (with_forces) all.add_forces();
  return all.collected();
}

BaseDescription changed(const BaseDescription& given, const BaseCatalogue& all,
                        const Eigen::VectorXd& changes) {
  BaseDescription base = given;
  for (std::size_t k = 0; k < all.terms.size(); ++k) {
    const double by = changes[static_cast<Eigen::Index>(k)];
    const std::size_t index = all.terms[k].index;
    const auto add_to_all = [&](double Wheel::*of) {
      for (Wheel& wheel : base.wheels) wheel.*of += by;
    };
    const auto scale_all = [&](double Wheel::*of) {
      for (Wheel& wheel : base.wheels) wheel.*of *= 1 + by / all.catalogue.terms[k].given;
    };
    switch (all.terms[k].kind) {
      case BaseKind::kAllRadii: scale_all(&Wheel::radius_m); break;
      case BaseKind::kRadius: base.wheels[index].radius_m += by; break;
      case BaseKind::kTurningLength: base.turning_length_m += by; break;
      case BaseKind::kSteeringOffset: base.steering_offset_rad += by; break;
      case BaseKind::kTrackingScale: base.tracking.scale += by; break;
      case BaseKind::kTrackingX: base.tracking.p_BT_m.x() += by; break;
      case BaseKind::kTrackingY: base.tracking.p_BT_m.y() += by; break;
      case BaseKind::kTrackingYaw: base.tracking.yaw_BT_rad += by; break;
      case BaseKind::kSlipForward: base.slip_forward += by; break;
      case BaseKind::kSlipSideways: base.slip_sideways += by; break;
      case BaseKind::kSlipWithLoad: base.slip_with_load += by; break;
      case BaseKind::kFloorSlip: base.floors[index].slip += by; break;
      case BaseKind::kMass: base.body.mass_kg += by; break;
      case BaseKind::kYawInertia: base.body.yaw_inertia_kg_m2 += by; break;
      case BaseKind::kCentreX: base.body.p_BC_m.x() += by; break;
      case BaseKind::kCentreY: base.body.p_BC_m.y() += by; break;
      case BaseKind::kAllTorques: scale_all(&Wheel::torque_scale); break;
      case BaseKind::kTorque: base.wheels[index].torque_scale *= 1 + by / all.catalogue.terms[k].given; break;
      case BaseKind::kTorqueOffset: base.wheels[index].offset_Nm += by; break;
      case BaseKind::kAllCoulomb: add_to_all(&Wheel::coulomb_Nm); break;
      case BaseKind::kCoulomb: base.wheels[index].coulomb_Nm += by; break;
      case BaseKind::kAllViscous: add_to_all(&Wheel::viscous_Nm_s_per_rad); break;
      case BaseKind::kViscous: base.wheels[index].viscous_Nm_s_per_rad += by; break;
      case BaseKind::kAllInertias: add_to_all(&Wheel::inertia_kg_m2); break;
      case BaseKind::kInertia: base.wheels[index].inertia_kg_m2 += by; break;
      case BaseKind::kSlopeX: base.body.slope.x() += by; break;
      case BaseKind::kSlopeY: base.body.slope.y() += by; break;
      case BaseKind::kSidewaysResistance: base.body.sideways_resistance_N += by; break;
      case BaseKind::kTurningResistance: base.body.turning_resistance_Nm += by; break;
      case BaseKind::kFloorResistance: base.floors[index].resistance_N += by; break;
    }
  }
  keep_positive(base, given);
  return base;
}

}  // namespace identification::robot_gap
