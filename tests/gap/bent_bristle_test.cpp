// A drive with LuGre friction: its bristle yields gradually, while the given model's is linear up to
// break-away. This is neither a spring behind the gear nor a gap in it.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "identification/gap/gap.h"
#include "model/effects/any_effect.h"

namespace bent_bristle_test {

constexpr double kInertia_kg_m2 = 0.25;
constexpr double kCoulomb_Nm = 1.5;
constexpr double kViscous_Nm_s_per_rad = 0.4;
constexpr double kStiffness_Nm_per_rad = 400;  // bends by 4 mrad
constexpr double kDamping_Nm_s_per_rad = 4;
constexpr double kTick_rad = 2 * std::numbers::pi / 200000;
constexpr double kNoise_Nm = 0.02;

/// z' = v − σ0·|v|·z/Fc,  F = σ0·z + σ1·z' + σ2·v  [C. Canudas de Wit et al., IEEE TAC 40, 1995], in steps of
/// 20 µs, under a controller that follows a sum of sines.
identification::gap::Source drive(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> phase(0, 2 * std::numbers::pi);
  std::vector<double> phases(5);
  for (double& value : phases) value = phase(random);
  constexpr double kStep_s = 2e-5;
  std::vector<double> time_s;
  std::vector<double> measured_Nm;
  std::vector<double> position_rad;
  double wanted = 0;
  double position = 0;
  double velocity = 0;
  double bristle = 0;
  double torque = 0;
  for (int k = 0; k < 10000; ++k) {
    const double now_s = 1e-3 * k;
    time_s.push_back(now_s);
    position_rad.push_back(std::floor(position / kTick_rad) * kTick_rad);
    measured_Nm.push_back(torque + kNoise_Nm * normal(random));
    double wanted_velocity = 0;
    for (std::size_t n = 0; n < phases.size(); ++n)
      wanted_velocity +=
          0.4 * std::sin(2 * std::numbers::pi * (0.3 + 0.7 * static_cast<double>(n)) * now_s + phases[n]);
    wanted += 1e-3 * wanted_velocity;
    torque = 600 * (wanted - position) + 15 * (wanted_velocity - velocity);
    for (int step = 0; step < 50; ++step) {
      const double bending = velocity - kStiffness_Nm_per_rad * std::abs(velocity) * bristle / kCoulomb_Nm;
      const double friction = kStiffness_Nm_per_rad * bristle + kDamping_Nm_s_per_rad * bending +
                              kViscous_Nm_s_per_rad * velocity;
      bristle += kStep_s * bending;
      velocity += kStep_s / kInertia_kg_m2 * (torque - friction);
      position += kStep_s * velocity;
    }
  }
  identification::gap::Source source{.name = "lugre-" + std::to_string(seed) + ".csv", .recording = {}};
  source.recording.rig = "lugre";
  source.recording.columns = {{"time_s", std::move(time_s)},
                              {"position_rad", std::move(position_rad)},
                              {"torque_measured_Nm", std::move(measured_Nm)}};
  return source;
}

identification::gap::Result analysed(bool with_presliding) {
  model::effects::DriveModel base{
      .name = "lugre",
      .inertia_kg_m2 = kInertia_kg_m2,
      .effects = {
          model::effects::make_effect("coulomb", {{"torque_Nm", kCoulomb_Nm}}),
          model::effects::make_effect("viscous", {{"coefficient_Nm_s_per_rad", kViscous_Nm_s_per_rad}})}};
  base.encoder_ticks_per_rev = 200000;
  base.torque_noise_Nm = kNoise_Nm;
  if (with_presliding)
    base.effects.push_back(
        model::effects::make_effect("presliding", {{"stiffness_Nm_per_rad", kStiffness_Nm_per_rad}}));
  return identification::gap::analyse(base, std::vector{drive(1), drive(2)}, std::vector{drive(3)}, {});
}

TEST(BentBristle, IsTheShapeOfTheGivenPresliding) {
  const identification::gap::Result result = analysed(true);
  EXPECT_TRUE(result.effects.empty());
  const auto* presliding = result.model.find<model::effects::Presliding>();
  ASSERT_NE(presliding, nullptr);
  EXPECT_NEAR(presliding->parameters().exponent, 1, 0.1);
  EXPECT_NEAR(presliding->parameters().stiffness_Nm_per_rad, kStiffness_Nm_per_rad,
              0.1 * kStiffness_Nm_per_rad);
  EXPECT_NEAR(presliding->parameters().damping_Nm_s_per_rad, kDamping_Nm_s_per_rad,
              0.3 * kDamping_Nm_s_per_rad);
}

TEST(BentBristle, IsPreslidingWhereThereIsNone) {
  const identification::gap::Result result = analysed(false);
  ASSERT_EQ(result.effects.size(), 1U);
  EXPECT_EQ(model::effects::name_of(result.effects.front().effect), "presliding");
  EXPECT_TRUE(result.effects.front().equivalent.empty());
  EXPECT_NEAR(model::effects::parameter_of(result.effects.front().effect, "exponent"), 1, 0.1);
}

}  // namespace bent_bristle_test
