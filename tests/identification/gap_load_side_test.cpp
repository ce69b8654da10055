/// A load behind a spring or a gap, driven by a motor whose motion is given.
#include "identification/gap/load_side.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace identification::gap {
namespace gap_load_side_test {

constexpr double kPeriod_s = 5e-3;
constexpr double kInertia = 0.01;
const std::vector<double> kNoPull(10000, 0.0);

Signals driven(double seconds, const std::function<double(double)>& position,
               const std::function<double(double)>& velocity) {
  Signals s;
  s.period_s = kPeriod_s;
  s.filter_Hz = 50;
  for (double t = 0; t < seconds; t += kPeriod_s) {
    s.time_s.push_back(t);
    s.running_s.push_back(t);
    s.position_rad.push_back(position(t));
    s.velocity_rad_per_s.push_back(velocity(t));
  }
  return s;
}

Signals sine(double amplitude_rad, double w) {
  return driven(
      20, [=](double t) { return amplitude_rad * std::sin(w * t); },
      [=](double t) { return amplitude_rad * w * std::cos(w * t); });
}

model::effects::EffectChain rubbing(double coulomb_Nm) {
  if (coulomb_Nm == 0) return {};
  const model::effects::AnyEffect coulomb =
      model::effects::make_effect("coulomb", {{"torque_Nm", coulomb_Nm}});
  return model::effects::EffectChain({&coulomb, 1});
}

// J·ω²·A/(1 − (ω/ω0)²), undamped, far from resonance.
TEST(LoadSide, ASpringAsksForMoreThanARigidShaftBelowItsResonanceAndForLessAbove) {
  const double w0 = 40;
  const double share = 0.3;
  const model::effects::Mechanics mechanics{
      .inertia_kg_m2 = kInertia, .shaft_Nm_per_rad = share * kInertia * w0 * w0, .load_share = share};
  for (const double w : {10.0, 80.0}) {
    const std::vector<double> torque = load_side_Nm(mechanics, rubbing(0), sine(1, w), kNoPull);
    double most = 0;
    for (std::size_t i = torque.size() / 2; i < torque.size(); ++i)
      most = std::max(most, std::abs(torque[i]));
    const double rigid = kInertia * w * w;
    EXPECT_NEAR(most / rigid, std::abs(1 / (1 - (w / w0) * (w / w0))), 0.03) << w;
  }
}

TEST(LoadSide, AStrongDamperAndAStiffShaftStayFinite) {
  for (const double stiffness : {0.1, 1e8}) {
    const model::effects::Mechanics mechanics{.inertia_kg_m2 = kInertia,
                                              .shaft_Nm_per_rad = stiffness,
                                              .shaft_Nm_s_per_rad = 1e3,
                                              .load_share = 0.3};
    const Signals s = sine(1, 10);
    const std::vector<double> torque = load_side_Nm(mechanics, rubbing(0), s, kNoPull);
    // Either way the load goes with the motor.
    for (std::size_t i = torque.size() / 2; i + 1 < torque.size(); ++i)
      ASSERT_NEAR(torque[i], -kInertia * 100 * std::sin(10 * (s.time_s[i] - 0.5 * kPeriod_s)), 0.02)
          << stiffness;
  }
}

TEST(LoadSide, BehindNoGapToSpeakOfTheLoadIsRigid) {
  const model::effects::Mechanics mechanics{
      .inertia_kg_m2 = kInertia, .backlash_rad = 1e-9, .load_share = 0.3};
  const double w = 10;
  const Signals s = sine(1, w);
  const std::vector<double> torque = load_side_Nm(mechanics, rubbing(0.05), s, kNoPull);
  for (std::size_t i = 10; i < s.size(); ++i) {
    const double v = s.velocity_rad_per_s[i];
    if (std::abs(v) < 1) continue;  // the sign of friction turns within a step
    const double a = -w * w * std::sin(w * (s.time_s[i] - 0.5 * kPeriod_s));
    EXPECT_NEAR(torque[i], kInertia * a + std::copysign(0.05, v), 0.01) << s.time_s[i];
  }
}

// Motor forward at v, then back at −v: without inertia to speak of the load stays until the motor has crossed
// the gap, and then takes the friction.
TEST(LoadSide, ALoadThatStopsByItselfWaitsForTheOtherFlank) {
  const double gap = 0.1;
  const model::effects::Mechanics mechanics{.inertia_kg_m2 = 1e-6, .backlash_rad = gap, .load_share = 0.3};
  const Signals s = driven(
      2, [](double t) { return t < 1 ? t : 2 - t; }, [](double t) { return t < 1 ? 1.0 : -1.0; });
  const std::vector<double> torque = load_side_Nm(mechanics, rubbing(0.05), s, kNoPull);
  for (std::size_t i = 0; i < s.size(); ++i) {
    const double t = s.time_s[i];
    if (t > 0.5 * gap + 0.02 && t < 0.98) {
      EXPECT_NEAR(torque[i], 0.05, 1e-3) << t;
    } else if (t > 1.02 && t < 1 + gap - 0.02) {
      EXPECT_NEAR(torque[i], 0, 1e-3) << t;
    } else if (t > 1 + gap + 0.02) {
      EXPECT_NEAR(torque[i], -0.05, 1e-3) << t;
    }
  }
}

// The motor stops dead; a load without friction, which began in the middle of the gap, goes on to the flank
// and is stopped there: its momentum, once.
TEST(LoadSide, ALoadCoastsThroughTheGapAndGivesItsMomentumAtTheEnd) {
  const double gap = 0.1;
  const model::effects::Mechanics mechanics{
      .inertia_kg_m2 = kInertia, .backlash_rad = gap, .load_share = 0.3};
  const Signals s = driven(
      2, [](double t) { return std::min(t, 1.0); }, [](double t) { return t < 1 ? 1.0 : 0.0; });
  const std::vector<double> torque = load_side_Nm(mechanics, rubbing(0), s, kNoPull);
  double impulse = 0;
  for (std::size_t i = 0; i < s.size(); ++i) {
    if (s.time_s[i] < 1.02) continue;
    impulse += torque[i] * kPeriod_s;
    if (torque[i] != 0) {
      EXPECT_NEAR(s.time_s[i], 1 + 0.5 * gap, 0.01);
    }
  }
  EXPECT_NEAR(impulse, -kInertia * 1.0, 0.02 * kInertia);
}

// A weight keeps the load on one flank of the gap, so that it is never crossed and the motor always carries
// the whole weight; without the weight the load floats in the middle of a motion as small as this.
TEST(LoadSide, AWeightHoldsTheGapShut) {
  const double share = 0.3;
  const model::effects::Mechanics mechanics{
      .inertia_kg_m2 = kInertia, .backlash_rad = 0.1, .load_share = share};
  const Signals s = sine(0.04, 5);
  const double weight_Nm = 2 * share * kInertia * 0.04 * 25;  // twice what the motion takes
  const std::vector<double> held =
      load_side_Nm(mechanics, rubbing(0), s, std::vector<double>(s.size(), weight_Nm));
  const std::vector<double> loose = load_side_Nm(mechanics, rubbing(0.05), s, kNoPull);
  for (std::size_t i = s.size() / 2; i < s.size(); ++i) {
    const double a = -0.04 * 25 * std::sin(5 * (s.time_s[i] - 0.5 * kPeriod_s));
    ASSERT_NEAR(share * held[i], weight_Nm + share * kInertia * a, 0.05 * weight_Nm) << s.time_s[i];
    ASSERT_EQ(loose[i], 0) << s.time_s[i];
  }
}

}  // namespace gap_load_side_test
}  // namespace identification::gap
