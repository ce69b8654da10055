// Drives with their own speed loop: real delays, and slow responses without a delay.
#include "identification/gap/speed_channel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "identification/gap/signals.h"

namespace speed_channel_test {

using identification::gap::Signals;
using identification::gap::speed_command_delay;

constexpr double kPeriod_s = 0.03;

const model::effects::DriveModel kBase{
    .name = "wheel",
    .inertia_kg_m2 = 0.01,
    .effects = {model::effects::make_effect("coulomb", {{"torque_Nm", 0.05}})}};

/// Steps to other speeds every few seconds, followed with droop, friction and a lag of two first orders.
Signals steps(double delay_s, double lag1_s, double lag2_s, unsigned seed = 1) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, 0.1);
  std::uniform_real_distribution<double> speed(-10, 10);
  constexpr int kFine = 100;  // steps a sample
  const double dt = kPeriod_s / kFine;
  const auto late = static_cast<std::size_t>(std::lround(delay_s / dt));
  std::vector<double> asked;
  double command = 0;
  double one = 0;
  double two = 0;
  Signals s;
  s.raw_period_s = kPeriod_s;
  for (int i = 0; i < 1000; ++i) {
    if (i % 60 == 30) command = i % 120 == 90 ? 0 : speed(random);
    s.raw_velocity_command_rad_per_s.push_back(command);
    s.raw_velocity_rad_per_s.push_back(std::round((two + noise(random)) / 0.18) * 0.18);
    for (int n = 0; n < kFine; ++n) {
      asked.push_back(command);
      const double heard = asked.size() > late ? asked[asked.size() - 1 - late] : 0;
      const double target = std::copysign(std::max(0.0, 0.9 * std::abs(heard) - 0.4), heard);
      one += dt / lag1_s * (target - one);
      two += dt / lag2_s * (one - two);
    }
  }
  return s;
}

TEST(GapSpeedChannel, FindsTheDelayOfASpeedCommand) {
  for (const double delay_s : {0.06, 0.1, 0.2}) {
    const auto found = speed_command_delay(std::vector{steps(delay_s, 0.05, 0.01)}, kBase, {});
    ASSERT_TRUE(found) << delay_s;
    EXPECT_EQ(model::effects::name_of(found->effect), "transport_delay");
    ASSERT_EQ(found->parameters.size(), 1U);
    EXPECT_NEAR(found->parameters[0].value, delay_s, 0.7 * kPeriod_s);
    EXPECT_LE(found->parameters[0].lower, delay_s + 0.2 * kPeriod_s);
    EXPECT_GE(found->parameters[0].upper, delay_s - 0.2 * kPeriod_s);
    EXPECT_LT(found->gap_after, found->gap_before);
    EXPECT_LT(found->p_value, 1e-3);
  }
}

TEST(GapSpeedChannel, ALagIsNoDelay) {
  for (const double lag_s : {0.04, 0.1, 0.3})
    for (const double second_s : {0.01, 0.05, 0.1})
      EXPECT_FALSE(speed_command_delay(std::vector{steps(0, lag_s, second_s)}, kBase, {}))
          << lag_s << ' ' << second_s;
}

TEST(GapSpeedChannel, SaysNothingWhereItIsNotAsked) {
  Signals s = steps(0.1, 0.05, 0.01);
  model::effects::DriveModel knows = kBase;
  knows.effects.push_back(model::effects::make_effect("transport_delay", {{"delay_s", 0.1}}));
  EXPECT_FALSE(speed_command_delay(std::vector{s}, knows, {}));
  EXPECT_FALSE(speed_command_delay(std::vector<Signals>{}, kBase, {}));
  Signals constant = s;
  std::ranges::fill(constant.raw_velocity_command_rad_per_s, 2.0);
  EXPECT_FALSE(speed_command_delay(std::vector{constant}, kBase, {}));
  Signals none = s;
  none.raw_velocity_command_rad_per_s.clear();
  EXPECT_FALSE(speed_command_delay(std::vector{none}, kBase, {}));
  // A torque command has its own channel.
  s.raw_command_Nm.assign(s.raw_velocity_rad_per_s.size(), 0.1);
  EXPECT_FALSE(speed_command_delay(std::vector{s}, kBase, {}));
}

}  // namespace speed_channel_test
