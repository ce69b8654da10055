#include "tests/gap/gap_cases.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "tests/gap/chance.h"

namespace gap_test {
namespace {

using model::effects::make_effect;

constexpr int kMaxPasses = 6;
constexpr double kSizeTolerance = 0.05;

bool is_hidden(const CaseSpec& spec, Hidden kind) {
  return std::find(spec.hidden.begin(), spec.hidden.end(), kind) != spec.hidden.end();
}

Plant any_plant(Chance& chance) {
  static constexpr auto kInertiaAndCoulomb = std::to_array<std::pair<double, double>>({{0.003, 0.01},
                                                                                       {0.004, 0.025},
                                                                                       {0.006, 0.03},
                                                                                       {0.0112, 0.045},
                                                                                       {0.0112, 0.08},
                                                                                       {0.015, 0.05},
                                                                                       {0.02, 0.1},
                                                                                       {0.03, 0.12},
                                                                                       {0.05, 0.2}});
  const auto& [inertia, coulomb] = kInertiaAndCoulomb[chance.bits() % kInertiaAndCoulomb.size()];
  Plant plant;
  plant.inertia_kg_m2 = inertia * chance.uniform(0.9, 1.1);
  plant.coulomb_Nm = coulomb * chance.uniform(0.85, 1.15);
  plant.viscous_Nm_s_per_rad = plant.coulomb_Nm * chance.uniform(0.7, 2.2) / 8;
  plant.load_friction_share = chance.uniform(0.3, 0.5);
  return plant;
}

Sensors any_sensors(const Plant& plant, CaseKind kind, Chance& chance) {
  Sensors sensors;
  // Not below the encoder's quantization noise in the acceleration torque of this inertia.
  sensors.torque_noise_Nm =
      std::max(plant.coulomb_Nm * chance.uniform(0.02, 0.04), plant.inertia_kg_m2 * 0.08);
  const bool bare = kind == CaseKind::kNone;
  if (chance.uniform(0, 1) < (bare ? 0.5 : 0.33)) sensors.noise_correlation_s = chance.uniform(1e-3, 5e-3);
  if (chance.uniform(0, 1) < (bare ? 0.5 : 0.33))
    sensors.torque_step_Nm = chance.uniform(0.5, bare ? 3 : 1.5) * sensors.torque_noise_Nm;
  if (chance.uniform(0, 1) < (bare ? 0.5 : 0.15))
    sensors.torque_lag_s = bare ? chance.uniform(0.5e-3, 3e-3) : chance.uniform(0.2e-3, 1e-3);
  return sensors;
}

HiddenEffects any_shapes(Chance& chance) {
  static constexpr auto kPeriodsPerRev = std::to_array<double>({7, 12, 26, 52});
  HiddenEffects effects;
  effects.stribeck_rad_per_s = chance.uniform(0.1, 0.5);
  effects.dip_centre_rad_per_s = chance.uniform(2, 3);
  effects.dip_half_width_rad_per_s = chance.uniform(1, 1.8);
  effects.cogging_per_rev = kPeriodsPerRev[chance.bits() % kPeriodsPerRev.size()];
  effects.cogging_phase_rad = chance.uniform(-kPi, kPi);
  effects.imbalance_rest_rad = chance.uniform(-kPi, kPi);
  effects.load_share = chance.uniform(0.25, 0.45);
  effects.warm_time_s = chance.uniform(6, 12);
  effects.cyclic_Hz = chance.uniform(0.7, 7);
  return effects;
}

/// Initial guess of the amount that makes `torque_Nm` rms, with its minimum and maximum.
struct Range {
  double guess;
  double least = 0;
  double most = std::numeric_limits<double>::infinity();
};
Range range_of(Hidden kind, const Drive& drive, double top_rad_per_s, double torque_Nm) {
  const Plant& plant = drive.plant;
  const double share = drive.effects.load_share * (1 - drive.effects.load_share);
  const double tick_rad = 2 * kPi / drive.sensors.encoder_ticks_per_rev;
  // Compliance with which the two masses resonate there.
  const auto shaft_at = [&](double hz) {
    return 1 / (plant.inertia_kg_m2 * share * 4 * kPi * kPi * hz * hz);
  };
  switch (kind) {
    case Hidden::kStribeck: return {5 * torque_Nm, 0, 2.5 * plant.coulomb_Nm};
    case Hidden::kDirectionAsymmetry: return {1.1 * torque_Nm, 0, 0.6 * plant.coulomb_Nm};
    case Hidden::kMidspeedDip: return {2.5 * torque_Nm, 0, 0.85 * plant.coulomb_Nm};
    case Hidden::kQuadraticDrag: return {8 * torque_Nm / (top_rad_per_s * top_rad_per_s)};
    case Hidden::kPresliding:
      return {5 * tick_rad / plant.coulomb_Nm, 2.6 * tick_rad / plant.coulomb_Nm,
              200 * tick_rad / plant.coulomb_Nm};
    case Hidden::kCogging: return {1.35 * torque_Nm, 0, 0.8 * plant.coulomb_Nm};
    case Hidden::kImbalance: return {1.4 * torque_Nm, 0, 1.5 * plant.coulomb_Nm};
    // Less would be a base parameter that is a little off.
    case Hidden::kInertia: return {torque_Nm / 7.5, 0.1 * plant.inertia_kg_m2, plant.inertia_kg_m2};
    case Hidden::kBacklash: return {0.005, 50 * tick_rad, 0.3};
    case Hidden::kElasticity: return {shaft_at(30), shaft_at(120), shaft_at(12)};
    case Hidden::kThermalDrift: return {1.5 * torque_Nm / plant.coulomb_Nm, 0, 0.6};
    case Hidden::kTorqueOffset: return {torque_Nm, 0, 0.6 * plant.coulomb_Nm};
    case Hidden::kTorqueDeadband: return {0.5 * plant.coulomb_Nm, 0, 0.9 * plant.coulomb_Nm};
    case Hidden::kTransportDelay: return {0.003, 0.002, 0.012};
    case Hidden::kUnsignedCurrent: return {1, 1, 1};
    case Hidden::kLoadFriction: return {1.4 * torque_Nm / drive.effects.imbalance_Nm, 0, 0.7};
    case Hidden::kPush: return {2.2 * torque_Nm};
    case Hidden::kCyclicLoad: return {1.4 * torque_Nm};
    case Hidden::kLooseCoupling:
      return {0.09 / plant.inertia_kg_m2, 0.01 / plant.inertia_kg_m2, 0.9 / plant.coulomb_Nm};
    case Hidden::kStickingBrush: return {3 * torque_Nm, 0, 3 * plant.coulomb_Nm};
    case Hidden::kRandomWalk: return {torque_Nm};
  }
  return {0};
}

bool either_sign(Hidden kind) {
  return kind == Hidden::kDirectionAsymmetry || kind == Hidden::kTorqueOffset || kind == Hidden::kInertia ||
         kind == Hidden::kThermalDrift;
}

double allowed(Hidden kind, double amount) {
  // Delays of a bus are whole cycles; one cycle may be a recorder's convention.
  if (kind == Hidden::kTransportDelay)
    return std::round(amount / HiddenPlant::kSample_s) * HiddenPlant::kSample_s;
  return amount;
}

std::vector<TrueParameter> true_parameters(const CaseSpec& spec, const Drive& drive) {
  const HiddenEffects& effects = drive.effects;
  std::vector<TrueParameter> result;
  for (const Hidden kind : spec.hidden) {
    const auto add = [&](std::string_view parameter, double value, double resolution = 0) {
      result.push_back({std::string(name_of(kind)), std::string(parameter), value, resolution});
    };
    switch (kind) {
      case Hidden::kDirectionAsymmetry: add("coulomb_Nm", effects.asymmetry_Nm); break;
      case Hidden::kQuadraticDrag: add("coefficient_Nm_s2_per_rad2", effects.drag_Nm_s2_per_rad2); break;
      case Hidden::kCogging:
        add("amplitude_Nm", effects.cogging_Nm);
        add("periods_per_rev", effects.cogging_per_rev);
        break;
      case Hidden::kImbalance: add("torque_Nm", effects.imbalance_Nm); break;
      case Hidden::kInertia: add("difference_kg_m2", effects.inertia_kg_m2); break;
      case Hidden::kBacklash: add("gap_rad", effects.gap_rad); break;
      case Hidden::kElasticity: add("stiffness_Nm_per_rad", 1 / effects.shaft_rad_per_Nm); break;
      case Hidden::kThermalDrift:
        add("coulomb_change_Nm", effects.warm_share * drive.plant.coulomb_Nm);
        add("viscous_change_Nm_s_per_rad", effects.warm_share * drive.plant.viscous_Nm_s_per_rad);
        add("time_constant_s", effects.warm_time_s);
        break;
      case Hidden::kTorqueOffset: add("torque_Nm", effects.offset_Nm); break;
      case Hidden::kTorqueDeadband: add("threshold_Nm", effects.deadband_Nm); break;
      case Hidden::kTransportDelay:
        // A finer value depends on the definition of a sample.
        add("delay_s", effects.delay_s, 0.5 * HiddenPlant::kSample_s);
        break;
      case Hidden::kLoadFriction: add("share", effects.load_friction); break;
      default: break;  // shapes of their own
    }
  }
  return result;
}

std::vector<Simulated> simulate_all(const Drive& drive, const std::vector<Run>& runs) {
  std::vector<Simulated> result;
  result.reserve(runs.size());
  for (const Run& run : runs) result.push_back(simulate(drive, run));
  return result;
}

std::vector<identification::gap::Source> sources(std::vector<Simulated> runs, std::string_view prefix) {
  std::vector<identification::gap::Source> result;
  for (Simulated& run : runs) {
    const std::string name = std::string(prefix) + run.recording.experiment + ".csv";
    result.push_back({name, std::move(run.recording)});
  }
  return result;
}

/// Recordings in which every hidden effect has its size, as near as its limits let it come.
std::vector<Simulated> simulate_to_size(const CaseSpec& spec, const std::vector<Run>& runs,
                                        const std::vector<double>& signs, Drive& drive,
                                        std::vector<double>& sizes) {
  const double floor_Nm = drive.sensors.noise_floor_Nm();
  const std::size_t count = spec.hidden.size();
  std::vector<Range> ranges;
  for (const Hidden kind : spec.hidden)
    ranges.push_back(range_of(kind, drive, runs.front().top_rad_per_s, spec.size * floor_Nm));
  std::vector<double> amounts(count);
  std::vector<double> last_amounts(count);
  std::vector<double> last_sizes(count);
  for (std::size_t i = 0; i < count; ++i)
    amounts[i] = allowed(spec.hidden[i], std::clamp(ranges[i].guess, ranges[i].least, ranges[i].most));

  for (int pass = 0;; ++pass) {
    for (std::size_t i = 0; i < count; ++i) drive.effects.amount(spec.hidden[i]) = signs[i] * amounts[i];
    std::vector<Simulated> result = simulate_all(drive, runs);
    sizes.assign(count, 0);
    bool good = true;
    std::vector<double> next = amounts;
    for (std::size_t i = 0; i < count; ++i) {
      sizes[i] = contribution_Nm(result, spec.hidden[i]) / floor_Nm;
      if (std::abs(sizes[i] / spec.size - 1) < kSizeTolerance) continue;
      // Along the power law through the last two passes.
      double power = 1;
      if (pass > 0 && amounts[i] != last_amounts[i] && sizes[i] > 0 && last_sizes[i] > 0)
        power =
            std::clamp(std::log(sizes[i] / last_sizes[i]) / std::log(amounts[i] / last_amounts[i]), 0.4, 4.0);
      const double factor = sizes[i] > 0 ? std::pow(spec.size / sizes[i], 1 / power) : 2;
      next[i] = allowed(spec.hidden[i], std::clamp(amounts[i] * std::clamp(factor, 0.2, 5.0), ranges[i].least,
                                                   ranges[i].most));
      good = good && next[i] == amounts[i];
    }
    if (good || pass + 1 == kMaxPasses) return result;
    last_amounts = std::exchange(amounts, next);
    last_sizes = sizes;
  }
}

}  // namespace

std::string_view name_of(CaseKind kind) {
  switch (kind) {
    case CaseKind::kNone: return "none";
    case CaseKind::kSingle: return "single";
    case CaseKind::kPair: return "pair";
    case CaseKind::kTriple: return "triple";
    case CaseKind::kOutside: return "outside";
  }
  return "";
}

std::string CaseSpec::name() const {
  std::string result;
  for (const Hidden effect : hidden) (result += result.empty() ? "" : "+") += name_of(effect);
  return result.empty() ? "nothing" : result;
}

std::vector<identification::gap::Source> recordings_of(const Drive& drive, const std::vector<Run>& runs,
                                                       std::string_view prefix) {
  return sources(simulate_all(drive, runs), prefix);
}

double Case::least_size() const { return sizes.empty() ? 0 : *std::min_element(sizes.begin(), sizes.end()); }

std::vector<CaseSpec> gap_cases() {
  std::vector<CaseSpec> cases;
  std::uint64_t seed = 1000;
  for (int i = 0; i < 66; ++i) cases.push_back({CaseKind::kNone, {}, 0, ++seed});

  for (std::size_t kind = 0; kind < kLibraryKinds; ++kind) {
    const auto hidden = static_cast<Hidden>(kind);
    for (const double size : {0.6, 1.5, 3.2, 3.6, 4.0, 5.0})
      cases.push_back({CaseKind::kSingle, {hidden}, size, ++seed});
  }

  using enum Hidden;
  static const std::vector<std::vector<Hidden>> kPairs{{kStribeck, kMidspeedDip},
                                                       {kStribeck, kCogging},
                                                       {kStribeck, kTorqueOffset},
                                                       {kStribeck, kTransportDelay},
                                                       {kStribeck, kDirectionAsymmetry},
                                                       {kStribeck, kInertia},
                                                       {kMidspeedDip, kTorqueOffset},
                                                       {kMidspeedDip, kCogging},
                                                       {kMidspeedDip, kThermalDrift},
                                                       {kQuadraticDrag, kCogging},
                                                       {kQuadraticDrag, kStribeck},
                                                       {kQuadraticDrag, kTransportDelay},
                                                       {kQuadraticDrag, kImbalance},
                                                       {kCogging, kImbalance},
                                                       {kCogging, kThermalDrift},
                                                       {kCogging, kTorqueDeadband},
                                                       {kImbalance, kStribeck},
                                                       {kImbalance, kLoadFriction},
                                                       {kInertia, kImbalance},
                                                       {kInertia, kTorqueOffset},
                                                       {kThermalDrift, kTorqueOffset},
                                                       {kThermalDrift, kImbalance},
                                                       {kTorqueDeadband, kStribeck},
                                                       {kTorqueDeadband, kImbalance},
                                                       {kTransportDelay, kCogging},
                                                       {kTransportDelay, kTorqueOffset},
                                                       {kUnsignedCurrent, kTransportDelay},
                                                       {kPresliding, kCogging},
                                                       {kPresliding, kStribeck},
                                                       {kBacklash, kCogging},
                                                       {kBacklash, kTorqueOffset},
                                                       {kElasticity, kStribeck},
                                                       {kElasticity, kCogging},
                                                       {kDirectionAsymmetry, kCogging},
                                                       {kDirectionAsymmetry, kQuadraticDrag},
                                                       {kUnsignedCurrent, kStribeck}};
  for (std::size_t i = 0; i < kPairs.size(); ++i)
    cases.push_back({CaseKind::kPair, kPairs[i], i % 2 == 0 ? 3.5 : 5, ++seed});

  static const std::vector<std::vector<Hidden>> kTriples{
      {kStribeck, kMidspeedDip, kCogging},       {kStribeck, kTorqueOffset, kTransportDelay},
      {kStribeck, kCogging, kThermalDrift},      {kMidspeedDip, kImbalance, kInertia},
      {kQuadraticDrag, kCogging, kTorqueOffset}, {kImbalance, kCogging, kTorqueDeadband},
      {kImbalance, kLoadFriction, kStribeck},    {kInertia, kStribeck, kImbalance},
      {kTransportDelay, kCogging, kMidspeedDip}, {kThermalDrift, kStribeck, kImbalance},
      {kPresliding, kStribeck, kTorqueOffset},   {kElasticity, kStribeck, kTorqueOffset}};
  for (const std::vector<Hidden>& triple : kTriples) cases.push_back({CaseKind::kTriple, triple, 5, ++seed});

  for (std::size_t kind = kLibraryKinds; kind < kHiddenKinds; ++kind) {
    const auto hidden = static_cast<Hidden>(kind);
    for (const double size : {1.5, 3.0, 3.0, 4.0, 4.0, 5.0, 5.0})
      cases.push_back({CaseKind::kOutside, {hidden}, size, ++seed});
  }
  return cases;
}

Case make_case(const CaseSpec& spec, double length) {
  Chance chance(spec.seed);
  Case result;
  result.spec = spec;
  Drive& drive = result.drive;
  drive.plant = any_plant(chance);
  drive.sensors = any_sensors(drive.plant, spec.kind, chance);
  drive.effects = any_shapes(chance);
  if (is_hidden(spec, Hidden::kLoadFriction)) drive.effects.imbalance_Nm = 0.6 * drive.plant.coulomb_Nm;
  const double top_rad_per_s = chance.uniform(6.5, 9);
  std::vector<double> signs;
  for (const Hidden kind : spec.hidden) signs.push_back(either_sign(kind) ? chance.sign() : 1);

  const auto run = [&](Experiment experiment, double duration_s) {
    return Run{experiment, std::round(duration_s * length), top_rad_per_s, chance.bits()};
  };
  result.runs = {run(Experiment::kStaircase, 28), run(Experiment::kMultisine, 24),
                 run(Experiment::kTorqueRamp, 24), run(Experiment::kReversals, 22),
                 run(Experiment::kPresliding, 20)};
  result.held_out_runs = {run(Experiment::kRandomSteps, 16), run(Experiment::kTorqueRamp, 16)};
  result.data = sources(simulate_to_size(spec, result.runs, signs, drive, result.sizes), "");
  result.held_out = recordings_of(drive, result.held_out_runs, "held-out-");
  result.parameters = true_parameters(spec, drive);

  // Values of a data sheet and an earlier fit. A missing inertia is missing from the true one.
  const bool off = chance.uniform(0, 1) < 0.5;
  const auto known = [&](double value) { return off ? value * (1 + 0.02 * chance.sign()) : value; };
  model::effects::DriveModel& base = result.base;
  base.name = "hidden";
  base.inertia_kg_m2 =
      is_hidden(spec, Hidden::kInertia) ? drive.plant.inertia_kg_m2 : known(drive.plant.inertia_kg_m2);
  base.encoder_ticks_per_rev = drive.sensors.encoder_ticks_per_rev;
  if (chance.uniform(0, 1) < 0.5) base.torque_noise_Nm = drive.sensors.noise_floor_Nm();
  base.effects = {
      make_effect("coulomb", {{"torque_Nm", known(drive.plant.coulomb_Nm)}}),
      make_effect("viscous", {{"coefficient_Nm_s_per_rad", known(drive.plant.viscous_Nm_s_per_rad)}})};
  if (is_hidden(spec, Hidden::kLoadFriction) && !is_hidden(spec, Hidden::kImbalance))
    base.effects.push_back(
        make_effect("imbalance", {{"torque_Nm", drive.effects.imbalance_Nm},
                                  {"rest_position_rad", drive.effects.imbalance_rest_rad}}));
  return result;
}

}  // namespace gap_test
