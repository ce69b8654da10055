// The delivered model is never worse than the given one on the judging data, and neither are its claims.
#include "identification/gap/delivery.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "identification/gap/gap.h"

namespace delivery_test {

using identification::gap::analyse;
using identification::gap::Result;
using identification::gap::Source;
using model::effects::make_effect;

constexpr double kPeriod_s = 2e-3;
constexpr double kInertia_kg_m2 = 0.011;
constexpr double kCoulomb_Nm = 0.3;
constexpr double kViscous = 0.02;
constexpr double kStribeckVelocity = 0.387;

model::effects::DriveModel given() {
  return {.name = "axis",
          .inertia_kg_m2 = kInertia_kg_m2,
          .effects = {make_effect("coulomb", {{"torque_Nm", kCoulomb_Nm}}),
                      make_effect("viscous", {{"coefficient_Nm_s_per_rad", kViscous}}),
                      make_effect("stribeck", {{"static_torque_Nm", 0.35},
                                               {"velocity_rad_per_s", kStribeckVelocity},
                                               {"exponent", 1}})}};
}

struct Motion {
  double velocity_rad_per_s;
  double acceleration_rad_per_s2;
};
using Torque = std::function<double(double time_s, double velocity_rad_per_s)>;

/// The torque of a drive with Coulomb and viscous friction for a motion, and `more_Nm`.
Source recorded(const std::string& name, unsigned seed, int rows, const std::function<Motion(double)>& motion,
                const Torque& more_Nm) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, 3e-3);
  std::vector<double> time, position, torque;
  double p = 0;
  for (int i = 0; i < rows; ++i) {
    const double t = i * kPeriod_s;
    const auto [v, a] = motion(t);
    time.push_back(t);
    position.push_back(p);
    p += (v + 0.5 * a * kPeriod_s) * kPeriod_s;
    torque.push_back(kInertia_kg_m2 * a + std::copysign(kCoulomb_Nm, v) + kViscous * v + noise(random) +
                     (more_Nm ? more_Nm(t, v) : 0));
  }
  Source source{.name = name, .recording = {}};
  source.recording.columns = {{"time_s", time}, {"position_rad", position}, {"torque_measured_Nm", torque}};
  return source;
}

/// Between 3 and 9 rad/s, one way or the other: too fast for the Stribeck curve to show.
Source fast_motion(const std::string& name, unsigned seed, double side, const Torque& more_Nm = {}) {
  const double rate = 1.3 + 0.1 * seed;
  const auto motion = [=](double t) -> Motion {
    return {side * (6 + 3 * std::sin(rate * t) * std::sin(0.4 * rate * t)),
            side * 3 * rate *
                (std::cos(rate * t) * std::sin(0.4 * rate * t) +
                 0.4 * std::sin(rate * t) * std::cos(0.4 * rate * t))};
  };
  return recorded(name, seed, 12000, motion, more_Nm);
}

/// Slow enough for the drive's Stribeck curve to show, both ways.
Source slow_motion(const std::string& name, unsigned seed) {
  const auto motion = [](double t) -> Motion {
    return {0.9 * std::sin(0.9 * t) + 0.5 * std::sin(2.3 * t),
            0.81 * std::cos(0.9 * t) + 1.15 * std::cos(2.3 * t)};
  };
  const auto peak = [](double, double v) {
    return std::copysign(0.05 * std::exp(-std::abs(v) / kStribeckVelocity), v);
  };
  return recorded(name, seed, 15000, motion, peak);
}

double value_of(const model::effects::DriveModel& model, const std::string& effect,
                const std::string& parameter) {
  for (const auto& any : model.effects)
    if (model::effects::name_of(any) == effect) return model::effects::parameter_of(any, parameter);
  ADD_FAILURE() << "no " << effect;
  return 0;
}

TEST(Delivery, AParameterThatTheDataDoNotAskAboutKeepsItsValue) {
  const std::vector<Source> data{fast_motion("a.csv", 1, 1), fast_motion("b.csv", 2, -1)};
  const std::vector<Source> held_out{fast_motion("c.csv", 3, 1), fast_motion("d.csv", 4, -1)};
  const Result result = analyse(given(), data, held_out);
  EXPECT_EQ(value_of(result.model, "stribeck", "velocity_rad_per_s"), kStribeckVelocity);
  EXPECT_EQ(value_of(result.model, "stribeck", "static_torque_Nm"), 0.35);
  EXPECT_NEAR(value_of(result.model, "coulomb", "torque_Nm"), kCoulomb_Nm, 1e-3);
  EXPECT_NEAR(result.model.inertia_kg_m2, kInertia_kg_m2, 1e-4);
}

TEST(Delivery, AParameterThatIsWrongIsMended) {
  model::effects::DriveModel wrong = given();
  wrong.effects[1] = make_effect("viscous", {{"coefficient_Nm_s_per_rad", 1.3 * kViscous}});
  const std::vector<Source> data{fast_motion("a.csv", 1, 1), fast_motion("b.csv", 2, -1)};
  const std::vector<Source> held_out{fast_motion("c.csv", 3, 1), fast_motion("d.csv", 4, -1)};
  const Result result = analyse(wrong, data, held_out);
  EXPECT_NEAR(value_of(result.model, "viscous", "coefficient_Nm_s_per_rad"), kViscous, 0.03 * kViscous);
  EXPECT_EQ(value_of(result.model, "stribeck", "velocity_rad_per_s"), kStribeckVelocity);
}

/// Something rubbed in the recording that was searched, and not in those that judge.
TEST(Delivery, WhatHeldOnlyInTheSearchedRecordingIsNotDelivered) {
  const auto rubs = [](double, double v) { return 0.012 * v; };
  const std::vector<Source> data{fast_motion("a.csv", 1, 1, rubs), fast_motion("b.csv", 2, -1, rubs)};
  const std::vector<Source> held_out{fast_motion("c.csv", 3, 1), fast_motion("d.csv", 4, -1)};
  const Result result = analyse(given(), data, held_out);
  EXPECT_LE(result.gap_after_Nm, 1.01 * result.gap_before_Nm);
  EXPECT_TRUE(result.effects.empty());
  EXPECT_EQ(value_of(result.model, "viscous", "coefficient_Nm_s_per_rad"), kViscous);
  EXPECT_TRUE(std::ranges::any_of(result.notes, [](const std::string& note) {
    return note.find("keep their values") != std::string::npos;
  }));
}

/// The Coulomb friction rises by the magnitude of a random walk with a time constant of 15 s. A thermal drift
/// removes a third of the residual of each of these walks, or more.
TEST(Delivery, NoThermalDriftIsNamedWhoseSizesMayBothBeZero) {
  for (const unsigned seed : {16, 19, 22, 26}) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> step(0, 0.03 * std::sqrt(2 * kPeriod_s / 15));
    double wander_Nm = 0;
    const auto wanders = [&](double, double v) {
      wander_Nm += step(random) - wander_Nm * kPeriod_s / 15;
      return std::copysign(wander_Nm, v);
    };
    const auto motion = [](double t) -> Motion {
      return {3 * std::sin(0.7 * t) + 1.5 * std::sin(1.9 * t),
              2.1 * std::cos(0.7 * t) + 2.85 * std::cos(1.9 * t)};
    };
    model::effects::DriveModel model = given();
    model.effects.pop_back();
    const Result result = analyse(model, {recorded("a.csv", seed, 30000, motion, wanders)}, {});
    for (const auto& effect : result.effects)
      EXPECT_TRUE(std::ranges::any_of(
          effect.parameters,
          [&](const auto& p) { return p.name != "time_constant_s" && (p.lower > 0 || p.upper < 0); }))
          << model::effects::name_of(effect.effect) << " of seed " << seed;
  }
}

/// Recordings that only know fast motion neither confirm a Stribeck curve nor refute it: whether it takes
/// away or adds a ten-thousandth of their residual is chance, whichever noise they have.
TEST(Delivery, WhatHeldOutRecordingsCannotShowStays) {
  model::effects::DriveModel base = given();
  base.effects.pop_back();
  for (unsigned seed = 3; seed < 11; seed += 2) {
    SCOPED_TRACE(seed);
    const Result result = analyse(base, {slow_motion("a.csv", 1), slow_motion("b.csv", 2)},
                                  {fast_motion("c.csv", seed, 1), fast_motion("d.csv", seed + 1, -1)});
    ASSERT_EQ(result.effects.size(), 1U);
    EXPECT_EQ(model::effects::name_of(result.effects.front().effect), "stribeck");
    EXPECT_GT(result.effects.front().held_out_gain, 0);
  }
}

/// A drive that cancels its own ripple adds a torque that is measured, moves the joint, and was not
/// commanded.
TEST(NoiseFloor, IsNotTheTorqueThatTheCommandDidNotAskFor) {
  model::effects::DriveModel base = given();
  base.effects.pop_back();
  const auto with_command = [](Source source) {
    std::vector<double> command = source.recording.columns[2].values;
    for (std::size_t i = 0; i < command.size(); ++i) {
      const double turn = 2 * std::numbers::pi * kPeriod_s * static_cast<double>(i);
      command[i] -= 0.08 * (std::sin(6.1 * turn) + std::sin(9.7 * turn));
    }
    source.recording.columns.push_back({"torque_command_Nm", std::move(command)});
    return source;
  };
  const Result result =
      analyse(base, {with_command(slow_motion("a.csv", 1)), with_command(slow_motion("b.csv", 2))},
              {with_command(slow_motion("c.csv", 3))});
  EXPECT_LT(result.noise_floor_Nm, 1.5 * result.gap_after_Nm) << "a model cannot leave less than noise";
}

/// An effect that is not in the library: a 2.3 Hz disturbance, independent of the joint's position.
double shakes(double time_s, double /*velocity*/) {
  return 0.012 * std::sin(2 * std::numbers::pi * 2.3 * time_s);
}

using identification::gap::Verdict;

TEST(Verdict, IsOfTheHeldOutDataAndSaysWhereTheOthersDisagree) {
  const auto motion = [](unsigned seed, bool shaken) {
    const std::string name = std::to_string(seed) + ".csv";
    const double side = seed % 2 == 0 ? -1 : 1;
    return shaken ? fast_motion(name, seed, side, shakes) : fast_motion(name, seed, side);
  };
  for (const bool searched : {false, true}) {
    for (const bool held_out : {false, true}) {
      const Result result = analyse(given(), {motion(1, searched), motion(2, searched)},
                                    {motion(3, held_out), motion(4, held_out)});
      EXPECT_TRUE(result.effects.empty());
      EXPECT_EQ(result.verdict, held_out ? Verdict::kUnexplained : Verdict::kNoGap);
      EXPECT_EQ(result.unexplained.empty(), !held_out);
      EXPECT_EQ(result.unexplained_searched.empty(), !searched);
      EXPECT_EQ(result.disagreement.empty(), searched == held_out) << result.disagreement;
    }
  }
}

/// Half a second of each recording judges.
TEST(Verdict, OfShortRecordingsHasTheWeightOfThoseSearched) {
  const auto first_seconds = [](Source source, std::size_t rows) {
    for (auto& column : source.recording.columns) column.values.resize(rows);
    return source;
  };
  const auto bends = [](double /*time_s*/, double v) { return 0.03 * std::sin(4 * v); };
  for (const bool bent : {false, true}) {
    std::vector<Source> data;
    for (unsigned seed = 1; seed < 5; ++seed)
      data.push_back(first_seconds(fast_motion(std::to_string(seed) + ".csv", seed, seed % 2 == 0 ? -1 : 1,
                                               bent ? bends : std::function<double(double, double)>()),
                                   1500));
    const Result result = analyse(given(), data, {});
    EXPECT_EQ(result.verdict == Verdict::kNoGap, !bent);
    EXPECT_EQ(result.disagreement, "");
  }
}

TEST(HeldOut, ListsWhatJudgedAndNothingElse) {
  const std::vector<Source> data{fast_motion("a.csv", 1, 1), fast_motion("b.csv", 2, -1)};
  const std::vector<Source> held_out{fast_motion("c.csv", 3, 1), fast_motion("d.csv", 4, -1)};
  EXPECT_EQ(analyse(given(), data, held_out).held_out, (std::vector<std::string>{"c.csv", "d.csv"}));
  // Of 24 s, from 65 % on.
  EXPECT_EQ(analyse(given(), data, {}).held_out,
            (std::vector<std::string>{"a.csv, 15.60 s to 20.40 s", "b.csv, 15.60 s to 20.40 s"}));
  // A third of all rows is enough: 4 of 12 excerpts of four seconds, of which no two touch.
  identification::gap::Options options;
  options.enough = {.rows = 16'000, .samples = 16'000};
  const Result part = analyse(given(), data, held_out, options);
  ASSERT_EQ(part.held_out.size(), 2U);
  for (const std::string& name : part.held_out)
    EXPECT_NE(name.find(".csv, 2 stretches, 8.00 s in all"), std::string::npos) << name;
}

}  // namespace delivery_test
