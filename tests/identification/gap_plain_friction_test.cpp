/// A model without Coulomb friction gets it, also from a few steady speeds.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "identification/gap/search.h"

namespace identification::gap::gap_plain_friction_test {

constexpr double kPeriod_s = 5e-3;
constexpr double kInertia_kg_m2 = 1.2e-4;
constexpr double kCoulomb_Nm = 0.02;
constexpr double kViscous = 1e-4;

/// A motor whose torque steps once, after 4 s. Its torque sensor has an offset, too.
Source two_steps(const char* name, unsigned seed, double first_Nm, double second_Nm) {
  constexpr double kOffset_Nm = 0.2 * kCoulomb_Nm;
  constexpr double kNoise_Nm = 3e-3;
  constexpr int kSubsteps = 10;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, kNoise_Nm);
  std::vector<double> time, position, torque;
  double v = 0;
  double p = 0;
  for (int i = 0; i < 1600; ++i) {
    const double t = i * kPeriod_s;
    const double applied_Nm = t < 4 ? first_Nm : second_Nm;
    time.push_back(t);
    position.push_back(p);
    torque.push_back(applied_Nm + noise(random));
    for (int k = 0; k < kSubsteps; ++k) {
      const double friction_Nm = kCoulomb_Nm * std::tanh(v / 0.5) + kViscous * v;
      v += (applied_Nm - kOffset_Nm - friction_Nm) / kInertia_kg_m2 * kPeriod_s / kSubsteps;
      p += v * kPeriod_s / kSubsteps;
    }
  }
  Source source{.name = name, .recording = {}};
  source.recording.columns = {{"time_s", time}, {"position_rad", position}, {"torque_measured_Nm", torque}};
  return source;
}

// Four recordings at eight speeds have about ten independent stretches. Chance gives ten equal signs once in
// 512 draws, and the search used to take that for a reason against any constant torque.
TEST(PlainFriction, IsFoundInAFewSteadySpeedsWhateverTheDraws) {
  const std::vector<Source> sources{two_steps("a.csv", 1, -0.03, -0.045), two_steps("b.csv", 3, 0.035, 0.05),
                                    two_steps("c.csv", 2, -0.03, -0.04), two_steps("d.csv", 4, 0.035, 0.045)};
  FittedModel start{.model = {.name = "rig", .inertia_kg_m2 = kInertia_kg_m2},
                    .given_inertia_kg_m2 = kInertia_kg_m2};
  start.model.effects = {
      model::effects::make_effect("viscous", {{"coefficient_Nm_s_per_rad", 0.8 * kViscous}})};
  const Band band = choose_band(sources, start.model);
  std::vector<Signals> signals;
  for (const Source& source : sources) signals.push_back(make_signals(source, band));
  const Rows rows(signals);
  Training training{.rows = {}, .block = {}, .least_Nm = 5e-4};
  for (Eigen::Index i = 0; i < rows.count(); ++i) {
    training.rows.push_back(i);
    training.block.push_back(static_cast<int>(i * 32 / rows.count()));
  }
  for (const std::uint64_t seed : {1U, 2U}) {
    const SearchResult result = search(start, rows, training, {.seed = seed});
    const auto* const coulomb = result.fitted.model.find<model::effects::Coulomb>();
    ASSERT_NE(coulomb, nullptr) << seed;
    EXPECT_NEAR(coulomb->parameters().torque_Nm, kCoulomb_Nm, 0.1 * kCoulomb_Nm) << seed;
  }
}

}  // namespace identification::gap::gap_plain_friction_test
