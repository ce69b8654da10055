/// Joints at rest that yield under a torque, do not yield, or yield for another reason.
#include "identification/gap/rest_channel.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <variant>

namespace identification::gap {
namespace gap_rest_channel_test {

constexpr double kCoulomb_Nm = 0.05;
constexpr double kTick_rad = 2 * std::numbers::pi / 104000;

/// A second of sliding, then sines of torque at rest of a quarter to four fifths of break-away.
/// `give_rad`: where the joint is under a torque.
std::optional<FoundEffect> found(const std::function<double(double torque_Nm)>& give_rad) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  Source source{.name = "presliding.csv", .recording = {}};
  std::vector<double> time, torque, position;
  for (int i = 0; i < 17000; ++i) {
    const double t = 1e-3 * i;
    const double share = 0.25 + 0.15 * std::floor((t - 1) / 4);
    const double asked = t < 1 ? 1.2 * kCoulomb_Nm : share * kCoulomb_Nm * std::sin(2 * std::numbers::pi * t);
    const double at = t < 1 ? t : 1 + 0.37 * kTick_rad + give_rad(asked);
    time.push_back(t);
    torque.push_back(asked + 1e-3 * normal(random));
    position.push_back(std::floor(at / kTick_rad) * kTick_rad);
  }
  source.recording.columns = {{"time_s", time}, {"torque_measured_Nm", torque}, {"position_rad", position}};
  model::effects::DriveModel base{.name = "bench", .encoder_ticks_per_rev = 104000};
  base.effects = {model::effects::make_effect("coulomb", {{"torque_Nm", kCoulomb_Nm}})};
  const Band band = choose_band({source}, base);
  return rest_channel(std::vector<Signals>{make_signals(source, band)}, base, band, {}).presliding;
}

TEST(RestChannel, AContactThatGivesThreeTicksIsMeasured) {
  const double stiffness = kCoulomb_Nm / (3 * kTick_rad);
  const auto presliding = found([=](double torque) { return torque / stiffness; });
  ASSERT_TRUE(presliding);
  EXPECT_EQ(model::effects::name_of(presliding->effect), "presliding");
  const fit::Estimate& estimate = presliding->parameters.at(0);
  EXPECT_NEAR(estimate.value, stiffness, 0.08 * stiffness);
  EXPECT_LT(estimate.lower, estimate.value);
  EXPECT_GT(estimate.upper, estimate.value);
  EXPECT_TRUE(presliding->equivalent.empty());
}

TEST(RestChannel, ARigidContactGivesNothing) {
  EXPECT_FALSE(found([](double) { return 0.0; }));
}

// The motor's own friction holds the small torques.
TEST(RestChannel, ASpringBehindTheMotorIsNotTheContact) {
  EXPECT_FALSE(found([](double torque) {
    const double beyond = std::max(0.0, std::abs(torque) - 0.5 * kCoulomb_Nm);
    return std::copysign(beyond / 50, torque);
  }));
}

// Whatever the torque, the motor goes from one flank to the other.
TEST(RestChannel, AGapIsNotTheContact) {
  EXPECT_FALSE(found([](double torque) { return std::copysign(10 * kTick_rad, torque); }));
}

}  // namespace gap_rest_channel_test
}  // namespace identification::gap
