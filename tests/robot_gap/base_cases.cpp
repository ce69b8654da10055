#include "tests/robot_gap/base_cases.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace robot_gap_test {
namespace {

using identification::robot_gap::NamedEffect;

constexpr double kDegree = 0.017453292519943295;
constexpr const char* kSlippery = "carpet";

bool moves_sideways(const BaseDesign& base) {
  return base.kinematics == Kinematics::kOmni || base.kinematics == Kinematics::kMecanum;
}

/// Of the first parameter that the answer should have.
double true_number(const BaseDesign& base, const BaseEffect& hidden) {
  const double factor = 1 + hidden.size;
  if (hidden.effect == "mass") return base.mass_kg * factor;
  if (hidden.effect == "yaw_inertia") return base.yaw_inertia_kg_m2 * factor;
  if (hidden.effect == "torque_constant") return factor;
  if (hidden.effect == "coulomb") return base.wheels.front().coulomb_Nm + hidden.size;
  if (hidden.effect == "viscous") return base.wheels.front().viscous_Nm_s + hidden.size;
  if (hidden.effect == "wheel_inertia") return base.wheels.front().inertia_kg_m2 + hidden.size;
  if (hidden.effect == "wheel_radius") return base.wheels.front().radius_m * factor;  // all are alike
  if (hidden.effect == "tracking_scale") return factor;
  if (hidden.effect != "turning_geometry") return hidden.size;
  switch (base.kinematics) {
    case Kinematics::kDifferential: return base.track_m * factor;
    case Kinematics::kTricycle: return base.wheelbase_m * factor;
    case Kinematics::kOmni: return base.radius_m * factor;
    case Kinematics::kMecanum: return (base.wheelbase_m + base.track_m) / 2 * factor;
  }
  return 0;
}

NamedEffect expected(const BaseEffect& hidden) { return {hidden.effect, hidden.part}; }

std::vector<BaseRecording> recorded(const HiddenBase& base, const std::vector<BaseMotion>& motions,
                                    const BaseCase& asked, std::uint64_t first_seed) {
  const bool two_floors = std::any_of(asked.hidden.begin(), asked.hidden.end(), [](const BaseEffect& one) {
    return one.effect.starts_with("floor_") && one.part != "floor";
  });
  std::vector<BaseRecording> recordings;
  const auto count = static_cast<double>(motions.size());
  for (std::size_t i = 0; i < motions.size(); ++i) {
    BasePlan plan;
    plan.motion = motions[i];
    plan.tempo = 0.7 + 0.25 * static_cast<double>(i % 3);
    plan.seed = 100 * asked.seed + first_seed + i;
    plan.camera = asked.seed % 2 == 0;
    plan.lag_s = 0.01 + 0.01 * static_cast<double>(asked.seed % 5);
    plan.worn_from = static_cast<double>(i) / count;
    plan.worn_to = static_cast<double>(i + 1) / count;
    if (two_floors) plan.floor = i % 2 == 0 ? "table" : kSlippery;
    const std::string begin = plan.floor.empty() ? "run" : plan.floor;
    recordings.push_back(base.record(plan, begin + std::to_string(first_seed + i)));
  }
  return recordings;
}

/// What a tape measure, a worn tyre or a marker that is not in the middle would leave.
std::vector<BaseEffect> nameable(const BaseDesign& base, std::uint64_t seed) {
  const double sign = seed % 2 == 0 ? -1 : 1;
  std::vector<BaseEffect> effects{{"turning_geometry", "base", 0.03 * sign},
                                  {"wheel_radius", "base", 0.02 * sign},
                                  {"slip_forward", "base", 0.04},
                                  {"slip_with_load", "base", 0.08},
                                  {"floor_slip", kSlippery, 0.05},
                                  {"tracking_offset", "tracking", 0.03 * sign, -0.02},
                                  {"tracking_yaw", "tracking", 2 * kDegree * sign},
                                  {"tracking_scale", "tracking", 0.03}};
  if (base.wheels.size() > 1)
    effects.push_back({"wheel_radius", base.wheels[seed % base.wheels.size()].name, 0.03 * sign});
  if (moves_sideways(base)) effects.push_back({"slip_sideways", "base", 0.05});
  if (base.kinematics == Kinematics::kTricycle)
    effects.push_back({"steering_offset", "steering", 1.5 * kDegree * sign});
  return effects;
}

std::vector<std::vector<BaseEffect>> pairs(const BaseDesign& base, std::uint64_t seed) {
  const std::string& wheel = base.wheels[seed % base.wheels.size()].name;
  const BaseEffect turning{"turning_geometry", "base", 0.05};
  const BaseEffect yaw{"tracking_yaw", "tracking", 2.5 * kDegree};
  const BaseEffect offset{"tracking_offset", "tracking", 0.03, 0.02};
  switch (base.kinematics) {
    case Kinematics::kDifferential:
      return {{{"wheel_radius", wheel, 0.03}, yaw}, {{"wheel_radius", "base", -0.03}, turning}};
    case Kinematics::kTricycle:
      return {{{"steering_offset", "steering", 2 * kDegree}, turning}, {turning, yaw}};
    case Kinematics::kOmni: return {{{"slip_sideways", "base", 0.05}, yaw}, {turning, offset}};
    case Kinematics::kMecanum:
      return {{{"slip_sideways", "base", 0.06}, turning}, {{"wheel_radius", wheel, 0.05}, offset}};
  }
  return {};
}

std::vector<BaseEffect> unnameable(const BaseDesign& base, std::uint64_t seed) {
  const std::string& wheel = base.wheels[seed % base.wheels.size()].name;
  switch (base.kinematics) {
    case Kinematics::kDifferential:
      return {{"speed_slip", "base", 1}, {"worn_tyre", wheel, 0.1}, {"caster_pull", "base", 5 * kDegree}};
    case Kinematics::kTricycle: return {{"backlash", wheel, 0.4}, {"skid", "base", 0.6}};
    case Kinematics::kOmni:
      return {{"lens", "tracking", 0.03}, {"acceleration_slip", "base", 0.5}, {"stuck_wheel", wheel, 0.3}};
    case Kinematics::kMecanum:
      return {{"slippery_patch", "base", 0.2},
              {"heading_drift", "tracking", 0.15 * kDegree},
              {"eccentric_wheel", wheel, 0.08},
              {"lost_counts", wheel, 0.15}};
  }
  return {};
}

/// What scales, a load that is not in the middle, or a floor that is not level would leave.
std::vector<BaseEffect> nameable_forces(const BaseDesign& base, std::uint64_t seed) {
  const double sign = seed % 2 == 0 ? -1 : 1;
  const BaseDesign::Wheel& wheel = base.wheels[seed % base.wheels.size()];
  const double friction = wheel.coulomb_Nm;
  const double force = 0.4 * friction * static_cast<double>(base.wheels.size()) / wheel.radius_m;
  std::vector<BaseEffect> effects{{"mass", "base", 0.2 * sign},
                                  {"torque_constant", "base", 0.1 * sign},
                                  {"coulomb", "base", 0.4 * friction * sign},
                                  {"viscous", "base", 0.5 * wheel.viscous_Nm_s * sign},
                                  {"torque_offset", wheel.name, 0.3 * friction * sign},
                                  {"floor_slope", "floor", 0.012 * sign, 0.008},
                                  {"floor_resistance", kSlippery, force}};
  if (base.kinematics == Kinematics::kTricycle) return effects;
  effects.push_back({"yaw_inertia", "base", 0.3 * sign});
  effects.push_back({"centre_of_mass", "base", 0.04 * sign, 0.02});
  effects.push_back({"torque_constant", wheel.name, 0.15 * sign});
  effects.push_back({"coulomb", wheel.name, 0.6 * friction});
  effects.push_back({"viscous", wheel.name, wheel.viscous_Nm_s});
  effects.push_back({"turning_resistance", "base", 0.15 * force});
  if (moves_sideways(base)) effects.push_back({"sideways_resistance", "base", force});
  return effects;
}

std::vector<std::vector<BaseEffect>> pairs_of_forces(const BaseDesign& base) {
  const BaseDesign::Wheel& wheel = base.wheels.back();
  const BaseEffect mass{"mass", "base", 0.2};
  const BaseEffect radius{"wheel_radius", "base", 0.03};
  const BaseEffect slope{"floor_slope", "floor", -0.01, 0.01};
  if (base.kinematics == Kinematics::kTricycle) return {{mass, slope}};
  return {{mass, {"coulomb", wheel.name, 0.6 * wheel.coulomb_Nm}},
          {mass, radius},
          {slope, {"torque_constant", wheel.name, 0.15}},
          {{"centre_of_mass", "base", 0.05, 0}, {"turning_geometry", "base", 0.04}}};
}

std::vector<BaseEffect> unnameable_forces(const BaseDesign& base, std::uint64_t seed) {
  const BaseDesign::Wheel& wheel = base.wheels[seed % base.wheels.size()];
  const double force = wheel.coulomb_Nm * static_cast<double>(base.wheels.size()) / wheel.radius_m;
  return {{"torque_ripple", wheel.name, wheel.coulomb_Nm},
          {"gusts", "base", force},
          {"payload_put_on", "base", 0.3}};
}

}  // namespace

std::string group_name(BaseCase::Group group) {
  switch (group) {
    case BaseCase::Group::kNothing: return "base_nothing";
    case BaseCase::Group::kSingle: return "base_single";
    case BaseCase::Group::kPairs: return "base_pairs";
    case BaseCase::Group::kOutside: return "base_outside";
    case BaseCase::Group::kForcesNothing: return "forces_nothing";
    case BaseCase::Group::kForcesSingle: return "forces_single";
    case BaseCase::Group::kForcesPairs: return "forces_pairs";
    case BaseCase::Group::kForcesOutside: return "forces_outside";
  }
  return "";
}

std::string BaseCase::name() const {
  std::string text;
  for (const BaseEffect& one : hidden) text += (text.empty() ? "" : " + ") + one.effect + " " + one.part;
  return group_name(group) + ": " + base.name + ": " + (text.empty() ? "nothing" : text);
}

std::vector<BaseCase> base_cases(std::uint64_t seeds) {
  std::vector<BaseCase> cases;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed)
    for (const BaseDesign& base : {two_wheeler(), tricycle(), omni_base(), mecanum_base()}) {
      using Group = BaseCase::Group;
      cases.push_back({Group::kNothing, base, {}, seed});
      for (const BaseEffect& one : nameable(base, seed)) cases.push_back({Group::kSingle, base, {one}, seed});
      for (const auto& both : pairs(base, seed)) cases.push_back({Group::kPairs, base, both, seed});
      for (const BaseEffect& one : unnameable(base, seed))
        cases.push_back({Group::kOutside, base, {one}, seed});
    }
  for (std::uint64_t seed = 1; seed <= seeds; ++seed)
    for (const BaseDesign& design : {two_wheeler(), tricycle(), omni_base(), mecanum_base()}) {
      using Group = BaseCase::Group;
      const BaseDesign base = weighed(design);
      cases.push_back({Group::kForcesNothing, base, {}, seed});
      for (const BaseEffect& one : nameable_forces(base, seed))
        cases.push_back({Group::kForcesSingle, base, {one}, seed});
      for (const auto& both : pairs_of_forces(base)) cases.push_back({Group::kForcesPairs, base, both, seed});
      for (const BaseEffect& one : unnameable_forces(base, seed))
        cases.push_back({Group::kForcesOutside, base, {one}, seed});
    }
  return cases;
}

Judged judge_base(const BaseCase& asked) {
  const HiddenBase base(asked.base, asked.hidden);
  using enum BaseMotion;
  const auto data = recorded(base, {kSquares, kSquares, kLines, kFree, kSquares, kFree}, asked, 0);
  // Circles are in no searched recording; for every third seed the kinds of motion are the same.
  const auto held_out = asked.seed % 3 == 0 ? recorded(base, {kSquares, kFree, kLines, kFree}, asked, 50)
                                            : recorded(base, {kCircles, kCircles, kFree, kFree}, asked, 50);
  const auto begin = std::chrono::steady_clock::now();
  Judged judged{.result = analyse_base(asked.base, data, held_out, asked.seed)};
  judged.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();

  std::vector<NamedEffect> truth;
  if (asked.group != BaseCase::Group::kOutside && asked.group != BaseCase::Group::kForcesOutside)
    for (const BaseEffect& hidden : asked.hidden) truth.push_back(expected(hidden));
  judge_names(judged, truth);
  if (!judged.right) return judged;
  for (const BaseEffect& hidden : asked.hidden)
    for (const auto& found : judged.result.effects)
      if (same(found.name, expected(hidden))) judge_parameter(judged, found, true_number(asked.base, hidden));
  return judged;
}

}  // namespace robot_gap_test
