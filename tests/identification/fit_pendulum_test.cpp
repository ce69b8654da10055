// A servo that lifts a pendulum: known answers, parameters back from a simulator written here, measured
// drives.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "identification/fit/pendulum_fit.h"
#include "tests/support/built_paths.h"
#include "tests/support/measured_data.h"

namespace identify_pendulum_test {

using identification::fit::fit_pendulum;
using identification::fit::pendulum_error_rad;
using identification::fit::PendulumFit;
using identification::fit::PendulumFriction;
using identification::fit::PendulumParameters;
using identification::fit::PendulumRig;
using identification::fit::PendulumRun;
using identification::fit::simulate_pendulum;

constexpr double kGravity = 9.80665;
/// The rig of tests/data/bam_xl330, with the data sheet's resistance (README.md there).
constexpr PendulumRig kRig{.mass_kg = 0.49, .length_m = 0.1, .supply_V = 7.4, .resistance_ohm = 3.4};
constexpr double kLoadInertia = 0.49 * 0.1 * 0.1;
constexpr double kWeight_Nm = 0.49 * kGravity * 0.1;

/// The servo's firmware: 4096 counts a revolution, a gain in 1/256, a duty in 1/885.
double duty_per_rad(double kp) { return kp * 4096 / (2 * std::numbers::pi) / (256 * 885); }

/// A run whose position is only a start.
PendulumRun run_to(double from_rad, const std::function<double(double)>& command, double enabled,
                   double kp = 200, double duration_s = 4, double period_s = 5e-3) {
  PendulumRun run;
  run.duty_per_rad = duty_per_rad(kp);
  auto& columns = run.recording.columns;
  columns = {{"time_s", {}}, {"position_command_rad", {}}, {"position_rad", {}}, {"drive_enabled", {}}};
  for (double t = 0; t < duration_s; t += period_s) {
    columns[0].values.push_back(t);
    columns[1].values.push_back(command(t));
    columns[2].values.push_back(from_rad);
    columns[3].values.push_back(enabled);
  }
  return run;
}

double zero(double /*t*/) { return 0; }

constexpr PendulumParameters kFrictionless{.coulomb_Nm = 0, .viscous_Nm_s_per_rad = 0, .static_Nm = 0};

// ----------------------------------------------------------------------------------------- known answers

TEST(Pendulum, SwingsFreelyAtItsOwnPeriodAndKeepsItsHeight) {
  const double amplitude = 0.2;
  const auto position = simulate_pendulum(run_to(amplitude, zero, 0), kRig, kFrictionless);
  const double inertia = kLoadInertia + kFrictionless.armature_kg_m2;
  // The circle's period, first two terms of the series in the amplitude: the next is below 1e-6.
  const double period_s = 2 * std::numbers::pi * std::sqrt(inertia / kWeight_Nm) *
                          (1 + amplitude * amplitude / 16 + 11 * std::pow(amplitude, 4) / 3072);
  double last_s = 0;
  int crossings = 0;
  for (std::size_t i = 1; i < position.size(); ++i)
    if (position[i - 1] > 0 && position[i] <= 0) {
      const double t = 5e-3 * (static_cast<double>(i) - position[i] / (position[i] - position[i - 1]));
      if (crossings++ > 0) {
        EXPECT_NEAR(t - last_s, period_s, 2e-5);  // of a chord instead of the sine
      }
      last_s = t;
    }
  EXPECT_GE(crossings, 4);
  EXPECT_NEAR(*std::min_element(position.begin(), position.end()), -amplitude, 1e-4);
}

TEST(Pendulum, StaysExactlyWhereFrictionHoldsItsWeight) {
  PendulumParameters p = kFrictionless;
  p.coulomb_Nm = p.static_Nm = 0.05;
  const double holds = std::asin(0.999 * p.coulomb_Nm / kWeight_Nm);
  for (const double x : simulate_pendulum(run_to(holds, zero, 0), kRig, p)) EXPECT_EQ(x, holds);
  const double slips = std::asin(1.001 * p.coulomb_Nm / kWeight_Nm);
  EXPECT_LT(simulate_pendulum(run_to(slips, zero, 0), kRig, p).back(), slips);

  p.static_Nm = 0.06;  // holds more than it takes to keep sliding
  EXPECT_EQ(simulate_pendulum(run_to(slips, zero, 0), kRig, p).back(), slips);
}

TEST(Pendulum, LoadFrictionHoldsAHigherWeightTheMoreOfItTheGearCarries) {
  PendulumParameters p = kFrictionless;
  p.armature_kg_m2 = kLoadInertia;  // open leads: half of the weight reaches the rotor
  p.load_share = 1.9;
  EXPECT_LT(simulate_pendulum(run_to(0.5, zero, 0), kRig, p).back(), 0.5);
  p.load_share = 2.1;
  EXPECT_EQ(simulate_pendulum(run_to(0.5, zero, 0), kRig, p).back(), 0.5);
}

TEST(Pendulum, StopsBelowTheCommandWhereLoadFrictionAndWeightEatTheMotorsTorque) {
  PendulumParameters p = kFrictionless;
  p.armature_kg_m2 = 1e-9;       // then all of the motor's torque passes the gear
  p.viscous_Nm_s_per_rad = 0.5;  // creeps up to its rest
  p.load_share = 0.3;
  p.load_share_per_Nm = 0.2;
  const auto run = run_to(
      0, [](double) { return 1.2; }, 1, 400, 20);
  const double q = simulate_pendulum(run, kRig, p).back();
  const double volts = kRig.supply_V * run.duty_per_rad * (1.2 - q);
  const double motor = p.torque_constant_Nm_per_A / p.resistance_ohm * volts;
  EXPECT_NEAR(motor * (1 - 0.3 - 0.2 * motor), kWeight_Nm * std::sin(q), 1e-4);
}

TEST(Pendulum, ErrsWithTheSquareOfTheStep) {
  PendulumParameters p = kFrictionless;
  p.viscous_Nm_s_per_rad = 0.01;
  const auto run = run_to(
      0.3, [](double t) { return std::sin(3 * t); }, 1, 200, 2, 8e-3);
  const double exact = simulate_pendulum(run, kRig, p, 1e-5).back();
  // A little more than the rows' 8 ms, whose rounding would else ask for one step more here and there.
  const double coarse = simulate_pendulum(run, kRig, p, 8.1e-3).back() - exact;
  const double fine = simulate_pendulum(run, kRig, p, 4.1e-3).back() - exact;
  EXPECT_NEAR(coarse / fine, 4, 0.4);
}

TEST(Pendulum, RefusesWhatItCannotSimulateOrFit) {
  const PendulumRun good = run_to(0, zero, 1);
  EXPECT_THROW(simulate_pendulum(good, {}, kFrictionless), std::invalid_argument);
  EXPECT_THROW(simulate_pendulum(good, kRig, kFrictionless, 0), std::invalid_argument);
  EXPECT_THROW(simulate_pendulum(good, kRig, {.resistance_ohm = 0}), std::invalid_argument);
  PendulumRun bad = good;
  bad.duty_per_rad = 0;
  EXPECT_THROW(simulate_pendulum(bad, kRig, kFrictionless), std::invalid_argument);
  bad = good;
  bad.recording.columns[0].values[7] = bad.recording.columns[0].values[6];
  EXPECT_THROW(simulate_pendulum(bad, kRig, kFrictionless), std::invalid_argument);
  bad = good;
  bad.recording.columns.erase(bad.recording.columns.begin() + 1);
  EXPECT_THROW(simulate_pendulum(bad, kRig, kFrictionless), std::invalid_argument);
  EXPECT_THROW(fit_pendulum({}, kRig), std::invalid_argument);
  EXPECT_THROW(pendulum_error_rad({}, kRig, kFrictionless), std::invalid_argument);
  EXPECT_THROW(fit_pendulum(std::vector{good}, kRig, {.rows_per_run = 10000}), std::invalid_argument);
  EXPECT_THROW(fit_pendulum(std::vector{good}, kRig, {.outlier_rad = 0}), std::invalid_argument);
}

// ------------------------------------------------------------------------------------------ made-up drives

/// Another integrator (Runge–Kutta, 20 µs) and another rest (friction grows over a millirad/s, and creeps).
struct Truth {
  double kt = 0.35;
  double armature = 1.5e-3;
  double coulomb = 0.012;
  double viscous = 0.006;
  double load = 0.25;
  double load_per_Nm = 0.4;

  double acceleration(double gain, double command, double q, double v, bool on) const {
    const double volts = std::max(-1.0, std::min(1.0, gain * (command - q))) * kRig.supply_V;
    const double motor = on ? kt * (volts - kt * v) / kRig.resistance_ohm : 0;
    const double weight = kWeight_Nm * std::sin(q);
    const double inertia = kLoadInertia + armature;
    const double transmitted = std::abs(motor - armature * (motor - weight) / inertia);
    const double level = coulomb + load * transmitted + load_per_Nm * transmitted * transmitted;
    return (motor - weight - viscous * v - level * std::tanh(v / 1e-3)) / inertia;
  }

  PendulumRun record(double kp, const std::function<double(double)>& command, double off_after_s) const {
    PendulumRun run = run_to(0, command, 1, kp);
    auto& columns = run.recording.columns;
    constexpr int kSteps = 250;
    constexpr double kStep_s = 2e-5;
    double q = 0;
    double v = 0;
    for (std::size_t i = 0; i < run.recording.rows(); ++i) {
      const double row_s = columns[0].values[i];
      const bool on = row_s < off_after_s;
      columns[2].values[i] = 2 * std::numbers::pi / 4096 * std::round(q * 4096 / (2 * std::numbers::pi));
      columns[3].values[i] = on ? 1 : 0;
      for (int k = 0; k < kSteps; ++k) {
        const double goal = command(row_s + (k + 0.5) * kStep_s);
        const auto a = [&](double x, double w) { return acceleration(run.duty_per_rad, goal, x, w, on); };
        const double h = kStep_s;
        const double a1 = a(q, v);
        const double a2 = a(q + h / 2 * v, v + h / 2 * a1);
        const double a3 = a(q + h / 2 * (v + h / 2 * a1), v + h / 2 * a2);
        const double a4 = a(q + h * (v + h / 2 * a2), v + h * a3);
        q += h * (v + h / 6 * (a1 + a2 + a3));
        v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
      }
    }
    return run;
  }

  /// Two motions at each gain: swinging, and a lift that is let go.
  std::vector<PendulumRun> recordings(const std::vector<double>& gains) const {
    std::vector<PendulumRun> runs;
    for (const double kp : gains) {
      runs.push_back(record(
          kp, [](double t) { return 1.2 * std::sin(2 * t) + 0.4 * std::sin(9 * t); }, 9));
      runs.push_back(record(
          kp, [](double t) { return -0.8 * (1 - std::cos(2 * std::min(t, 1.5))); }, 2));
    }
    return runs;
  }
};

TEST(IdentifyPendulum, FindsTheParametersOfAnotherSimulator) {
  const Truth truth;
  const PendulumFit fit = fit_pendulum(truth.recordings({150, 300, 600, 800}), kRig,
                                       {.friction = {.load = true, .load_quadratic = true}});
  EXPECT_TRUE(fit.converged);
  // Half a step of the encoder is 0.8 mrad; the rest is creep and the longer step.
  EXPECT_LT(fit.mean_absolute_error_rad, 3e-3);
  const auto expect_within = [&fit](const char* name, double value, double share) {
    EXPECT_NEAR(fit.estimate(name).value, value, share * value) << name;
  };
  expect_within("torque_constant_Nm_per_A", truth.kt, 0.03);
  expect_within("armature_kg_m2", truth.armature, 0.1);
  expect_within("coulomb_Nm", truth.coulomb, 0.1);
  expect_within("viscous_Nm_s_per_rad", truth.viscous, 0.1);
  expect_within("load_share", truth.load, 0.1);
  expect_within("load_share_per_Nm", truth.load_per_Nm, 0.1);
  EXPECT_EQ(fit.parameters.resistance_ohm, kRig.resistance_ohm);
  EXPECT_THROW(fit.estimate("static_Nm"), std::invalid_argument);
}

TEST(IdentifyPendulum, FindsNoLoadFrictionWhereThereIsNone) {
  const Truth truth{.coulomb = 0.04, .load = 0, .load_per_Nm = 0};
  const auto runs = truth.recordings({150, 300, 600, 800});
  const PendulumFit fit = fit_pendulum(runs, kRig, {.friction = {.load = true}});
  EXPECT_LT(fit.estimate("load_share").value, 0.02);
  EXPECT_NEAR(fit.estimate("coulomb_Nm").value, truth.coulomb, 0.1 * truth.coulomb);
}

// ---------------------------------------------------------------------------------------- measured drives
// Peer numbers: tests/data/bam_xl330/README.md.

constexpr std::array kGains{100, 200, 400, 800};
constexpr std::array kMotions{"sin_sin", "sin_time_square", "up_and_down", "lift_and_drop"};
constexpr double kPeer_rad = 0.0691;  // the best of the peers' models

/// All 16 runs, those of one gain together.
const std::vector<PendulumRun>& xl330_runs() {
  static const std::vector<PendulumRun> kRuns = [] {
    std::vector<PendulumRun> runs;
    for (const int kp : kGains)
      for (const std::string motion : kMotions) {
        PendulumRun& run = runs.emplace_back();
        run.duty_per_rad = duty_per_rad(kp);
        run.recording.rig = "xl330";
        run.recording.experiment = "kp " + std::to_string(kp) + " " + motion;
        auto& columns = run.recording.columns;
        columns = {{"time_s", {}}, {"position_command_rad", {}}, {"position_rad", {}}, {"drive_enabled", {}}};
        for (const auto& row :
             test_support::csv_rows(support::source_dir() + "/tests/data/bam_xl330/xl330_kp" +
                                    std::to_string(kp) + "_" + motion + ".csv"))
          for (const auto& [column, field] : {std::pair{0, 0}, {1, 1}, {2, 2}, {3, 7}})
            columns[static_cast<std::size_t>(column)].values.push_back(
                std::stod(row[static_cast<std::size_t>(field)]));
      }
    return runs;
  }();
  return kRuns;
}

/// What is left out together, and what is reported together.
enum class HoldOut { kGain, kMotion };

/// Held-out errors of the 16 runs: each was simulated, whole and from the command alone, with parameters of
/// the twelve runs that do not share its gain (or its motion).
class HeldOut {
 public:
  HeldOut(const char* name, const PendulumFriction& friction, HoldOut what) {
    for (std::size_t part = 0; part < 4; ++part) {
      std::vector<PendulumRun> training;
      for (std::size_t i = 0; i < 16; ++i)
        if (part_of(i, what) != part) training.push_back(xl330_runs()[i]);
      const PendulumFit fit = fit_pendulum(training, kRig, {.friction = friction});
      for (std::size_t i = 0; i < 16; ++i) {
        if (part_of(i, what) != part) continue;
        runs_rad[i] = pendulum_error_rad(std::vector{xl330_runs()[i]}, kRig, fit.parameters);
        parts_rad[part] += runs_rad[i] / 4;
      }
      mean_rad += parts_rad[part] / 4;
    }
    std::printf("%-26s held-out MAE %.4f rad;", name, mean_rad);
    for (std::size_t part = 0; part < 4; ++part)
      std::printf(" %s %.4f", what == HoldOut::kGain ? std::to_string(kGains[part]).c_str() : kMotions[part],
                  parts_rad[part]);
    std::printf("\n");
  }

  /// In how many of the 16 runs this one errs less.
  int better_than(const HeldOut& other) const {
    int count = 0;
    for (std::size_t i = 0; i < 16; ++i) count += runs_rad[i] < other.runs_rad[i] ? 1 : 0;
    return count;
  }

  double mean_rad = 0;
  std::array<double, 4> parts_rad{};
  std::array<double, 16> runs_rad{};

 private:
  static std::size_t part_of(std::size_t run, HoldOut what) {
    return what == HoldOut::kGain ? run / 4 : run % 4;
  }
};

// One-sided sign test at 5 %: 12 of 16 pairs.
constexpr int kSignificant = 12;

TEST(IdentifyPendulumOnMeasuredDrives, LoadFrictionPredictsAGainItHasNotSeenBetterThanThePeers) {
  const HeldOut plain("Coulomb + viscous", {}, HoldOut::kGain);
  const HeldOut load("+ load", {.load = true}, HoldOut::kGain);
  const HeldOut quadratic("+ load, quadratic", {.load = true, .load_quadratic = true}, HoldOut::kGain);
  EXPECT_LT(load.mean_rad, kPeer_rad);
  EXPECT_LT(load.mean_rad, 0.85 * plain.mean_rad);
  EXPECT_GE(load.better_than(plain), kSignificant);
  EXPECT_LT(quadratic.mean_rad, 0.9 * load.mean_rad);
  constexpr std::array kPeerByGain_rad{0.028, 0.061, 0.074, 0.114};
  for (std::size_t part = 0; part < 4; ++part)
    EXPECT_LT(quadratic.parts_rad[part], kPeerByGain_rad[part]) << "kp " << kGains[part];
}

TEST(IdentifyPendulumOnMeasuredDrives, LoadFrictionPredictsAMotionItHasNotSeenBetterThanThePeers) {
  const HeldOut plain("Coulomb + viscous", {}, HoldOut::kMotion);
  const HeldOut load("+ load", {.load = true}, HoldOut::kMotion);
  const HeldOut quadratic("+ load, quadratic", {.load = true, .load_quadratic = true}, HoldOut::kMotion);
  EXPECT_LT(load.mean_rad, kPeer_rad);
  EXPECT_LT(load.mean_rad, 0.85 * plain.mean_rad);
  EXPECT_GE(load.better_than(plain), kSignificant);
  EXPECT_LT(quadratic.mean_rad, 0.9 * load.mean_rad);
}

TEST(IdentifyPendulumOnMeasuredDrives, AStribeckCurveAloneHardlyHelps) {
  const HeldOut plain("Coulomb + viscous", {}, HoldOut::kGain);
  const HeldOut stribeck("+ Stribeck", {.stribeck = true}, HoldOut::kGain);
  EXPECT_GT(stribeck.mean_rad, 0.95 * plain.mean_rad);
}

}  // namespace identify_pendulum_test
