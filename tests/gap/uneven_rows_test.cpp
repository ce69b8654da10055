// One drive, logged evenly, with steps that vary, with rows missing, at a rate that changes, and in files of
// two rates: all give the same answers. Torques are Newton's, of a motion that is known at any time.
#include "identification/gap/even_rows.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "identification/gap/diagnosis.h"

namespace uneven_rows_test {

using identification::gap::diagnose;
using identification::gap::Source;

constexpr double kInertia_kg_m2 = 0.02;
constexpr double kCoulomb_Nm = 0.15;
constexpr double kViscous = 0.03;
constexpr double kTick_rad = 2 * std::numbers::pi / 65536;
constexpr double kPeriod_s = 1e-3;
constexpr double kSlowPeriod_s = 4e-3;
constexpr double kDuration_s = 30;

model::effects::DriveModel base() {
  return {.name = "axis",
          .inertia_kg_m2 = kInertia_kg_m2,
          .effects = {model::effects::make_effect("coulomb", {{"torque_Nm", kCoulomb_Nm}}),
                      model::effects::make_effect("viscous", {{"coefficient_Nm_s_per_rad", kViscous}})}};
}

/// The next step after a time.
using Steps = std::function<double(double time_s)>;
std::vector<double> times(const Steps& step) {
  std::vector<double> result;
  for (double t = 0; t < kDuration_s; t += step(t)) result.push_back(t);
  return result;
}

/// Cogging of 18 periods a turn is what the model lacks.
Source recording(const std::string& name, const std::vector<double>& time_s, double cogging_Nm,
                 double torque_scale = 1) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> noise(0, 3e-3);
  std::vector<double> position, velocity, torque;
  for (const double t : time_s) {
    double q = 0;
    double v = 0;
    double a = 0;
    constexpr std::array<std::array<double, 3>, 3> kSines{{{5, 0.9, 0}, {2, 4.1, 1}, {0.5, 9.7, 2}}};
    for (const auto& [speed, omega, phase] : kSines) {
      q -= speed / omega * std::cos(omega * t + phase);
      v += speed * std::sin(omega * t + phase);
      a += speed * omega * std::cos(omega * t + phase);
    }
    position.push_back(kTick_rad * std::round(q / kTick_rad));
    velocity.push_back(v + noise(random));
    torque.push_back(torque_scale * (kInertia_kg_m2 * a + std::copysign(kCoulomb_Nm, v) + kViscous * v +
                                     cogging_Nm * std::sin(18 * q) + noise(random)));
  }
  Source source{.name = name, .recording = {}};
  source.recording.columns = {{"time_s", time_s},
                              {"position_rad", position},
                              {"velocity_rad_per_s", velocity},
                              {"torque_measured_Nm", torque}};
  return source;
}

struct Logged {
  const char* how;
  std::vector<std::vector<double>> files;  ///< their times
};
std::vector<Logged> all_logged() {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> shake(0.8, 1.2);
  std::bernoulli_distribution missing(0.1);
  std::bernoulli_distribution half_missing(0.5);
  const auto even = times([](double) { return kPeriod_s; });
  return {{"evenly", {even, even}},
          {"with steps that vary by 20 %", {times([&](double) { return kPeriod_s * shake(random); }), even}},
          {"with rows missing", {times([&](double) { return kPeriod_s * (missing(random) ? 2 : 1); }), even}},
          {"with half of the rows missing",
           {times([&](double) { return kPeriod_s * (half_missing(random) ? 2 : 1); }), even}},
          {"at 1000 and then 250 Hz",
           {times([](double t) { return t < 0.5 * kDuration_s ? kPeriod_s : kSlowPeriod_s; })}},
          {"at 250 and then 1000 Hz",
           {times([](double t) { return t < 0.5 * kDuration_s ? kSlowPeriod_s : kPeriod_s; })}},
          {"in files of 1000 and 250 Hz", {even, times([](double) { return kSlowPeriod_s; })}}};
}
std::vector<Source> sources_of(const Logged& logged, double cogging_Nm, double torque_scale = 1) {
  std::vector<Source> sources;
  for (const auto& time_s : logged.files)
    sources.push_back(
        recording("file " + std::to_string(sources.size()) + ".csv", time_s, cogging_Nm, torque_scale));
  return sources;
}

std::string refusal(std::vector<Source> sources) {
  try {
    diagnose(std::move(sources), base());
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}
bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(UnevenRows, UnitsGearAndSignAreJudgedLikeThoseOfEvenRows) {
  for (const Logged& logged : all_logged()) {
    SCOPED_TRACE(logged.how);
    for (const auto& diagnosis : diagnose(sources_of(logged, 0), base()).diagnosis)
      EXPECT_EQ(diagnosis.column, "time_s") << diagnosis.found;
    EXPECT_TRUE(contains(refusal(sources_of(logged, 0, 1000)), "seems to be in mN·m"));
    EXPECT_TRUE(contains(refusal(sources_of(logged, 0, 0.01)), "on the motor's side of the gear"));
    EXPECT_TRUE(contains(refusal(sources_of(logged, 0, -1)), "has the wrong sign"));
  }
}

/// For ten of thirty seconds; the header states the rate of the others.
Source slower_between(double slow_s) {
  Source source =
      recording("a.csv", times([&](double t) { return t < 10 || t >= 20 ? kPeriod_s : slow_s; }), 0);
  source.recording.sample_rate_Hz = 1 / kPeriod_s;
  return source;
}

TEST(UnevenRows, ARateThatChangesDividesARecording) {
  const auto diagnosed = diagnose({slower_between(kSlowPeriod_s)}, base());
  ASSERT_EQ(diagnosed.sources.size(), 3U);
  const auto middle = diagnosed.sources[1].recording.column("time_s");
  EXPECT_NEAR(middle.front(), 10, kSlowPeriod_s);
  EXPECT_NEAR(middle.back(), 20, kSlowPeriod_s);
  ASSERT_EQ(diagnosed.diagnosis.size(), 1U);
  EXPECT_TRUE(contains(diagnosed.diagnosis[0].found, "the rate changes from 1000 to 250 Hz"));
}

/// All recordings are compared at the lowest rate: an idle drive's log would take the band from the others.
TEST(UnevenRows, AMuchSlowerPartIsLeftOut) {
  const auto diagnosed = diagnose({slower_between(0.02)}, base());
  ASSERT_EQ(diagnosed.sources.size(), 2U);
  EXPECT_NEAR(diagnosed.sources[1].recording.column("time_s").front(), 20, 0.02);
  ASSERT_EQ(diagnosed.diagnosis.size(), 2U);
  EXPECT_TRUE(contains(diagnosed.diagnosis[1].found, "of the rows have less than a fifth of the usual rate"));
}

TEST(UnevenRows, TheVerdictAndTheFoundEffectAreTheSame) {
  for (const Logged& logged : all_logged()) {
    SCOPED_TRACE(logged.how);
    const auto result = identification::gap::analyse(base(), sources_of(logged, 0.05), {});
    EXPECT_EQ(result.verdict, identification::gap::Verdict::kExplained);
    ASSERT_EQ(result.effects.size(), 1U);
    const auto* cogging = std::get_if<model::effects::Cogging>(&result.effects[0].effect);
    ASSERT_NE(cogging, nullptr);
    EXPECT_NEAR(cogging->parameters().periods_per_rev, 18, 0.05);
    EXPECT_NEAR(cogging->parameters().amplitude_Nm, 0.05, 0.003);
  }
}

}  // namespace uneven_rows_test
