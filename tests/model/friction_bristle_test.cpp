// The bristle law and its reset integrator (Haessig, Friedland 1991).
#include "model/friction/bristle.h"

#include <gtest/gtest.h>

#include "model/friction/reset_integrator.h"
#include "tests/model/friction_joint.h"

namespace friction_bristle_test {

using namespace model::friction;  // NOLINT(google-build-using-namespace)
using friction_test::Joint;
using friction_test::moved;

constexpr double kStiffness = 100, kReach = 1e-3;

TEST(Bristle, IsOneSpringUntilAllBondsOfARestedJointBreak) {
  const Bristle law({kStiffness, kReach});
  State state;
  EXPECT_NEAR(moved(law, state, 0.9 * kReach, 0.01, 9), 0.9 * kStiffness * kReach, 1e-12);
  EXPECT_NEAR(moved(law, state, -0.9 * kReach, 0.01, 9), 0, 1e-12) << "nothing broke";
  EXPECT_NEAR(moved(law, state, 0.999 * kReach, 0.01), 0.999 * kStiffness * kReach, 1e-12) << "K·δ holds";
  static_cast<void>(moved(law, state, 0.01 * kReach, 0.01));
  EXPECT_LT(std::abs(law.step(state, {0, 0}, 0)), 0.9 * kStiffness * kReach) << "and then gives way";
}

// Renewal with restarts even over [−δ, δ]: density (d + δ)/(2δ²), so the mean of F is K·δ/3 and its standard
// deviation K·δ·√(2/N)/3. Ten thousand lengths of reach hold about 10⁴·N breaks: 1 % is more than 3 sigma.
TEST(Bristle, SlidesAtTheMeanAndSpreadOfItsRenewals) {
  for (const double cut : {0.02, 0.3}) {  // of the reach in a step
    const Bristle law({kStiffness, kReach});
    State state;
    static_cast<void>(moved(law, state, 20 * kReach, 0.1, 1000));
    double sum = 0, squares = 0;
    const int steps = static_cast<int>(1e4 / cut);
    for (int n = 0; n < steps; ++n) {
      static_cast<void>(law.step(state, {0.1, 0}, cut * kReach / 0.1));
      const double friction = law.step(state, {0.1, 0}, 0);  // of the state, without the step's mean
      sum += friction;
      squares += friction * friction;
    }
    const double mean = sum / steps, sigma = std::sqrt(squares / steps - mean * mean);
    EXPECT_NEAR(mean, kStiffness * kReach / 3, 0.01 * kStiffness * kReach / 3) << cut;
    EXPECT_NEAR(sigma, kStiffness * kReach * std::sqrt(0.2) / 3, 0.05 * kStiffness * kReach / 3) << cut;
    EXPECT_EQ(law.steady_Nm(-1.0), -kStiffness * kReach / 3);
  }
}

TEST(Bristle, KeepsItsMeanInStepsOfManyBreaks) {
  const Bristle law({kStiffness, kReach});
  State state;
  double sum = 0;
  for (int n = 0; n < 20000; ++n) sum += law.step(state, {-5.0, 0}, 1e-3);
  EXPECT_NEAR(sum / 20000, -kStiffness * kReach / 3, 0.01 * kStiffness * kReach / 3);
}

// At 1 kHz a wheel passes a part of the reach in each step, or several. Over 10 rad, some 10⁵ breaks.
TEST(Bristle, SlidesAtItsMeanAtAnySpeedAndStep) {
  const Bristle law(Bristle::Parameters{});
  for (const double speed : {0.02, 0.05, 0.2, 0.4, 0.7, 2.0}) {
    State state;
    double sum = 0;
    const int steps = static_cast<int>(10 / (speed * 1e-3));
    for (int n = 0; n < steps; ++n) sum += law.step(state, {speed, 0}, 1e-3);
    EXPECT_NEAR(sum / steps, law.steady_Nm(speed), 0.03 * law.steady_Nm(speed)) << speed;
  }
}

// Held by its bonds, a joint without a damper rings at a constant amplitude; it gains nothing by the step.
TEST(Bristle, AJointThatSlidIntoRestRingsWithoutGrowing) {
  Joint joint(Bristle({kStiffness, kReach}), 0.01);
  joint.push(0.3);
  double early = 0, late = 0;
  for (int n = 0; n < 40000; ++n) {
    joint.step(0, 1e-3);
    if (n >= 5000 && n < 10000) early = std::max(early, std::abs(joint.velocity()));
    if (n >= 35000) late = std::max(late, std::abs(joint.velocity()));
  }
  EXPECT_GT(early, 0);
  EXPECT_LE(late, 1.01 * early);
}

TEST(Bristle, RepeatsItselfForTheSameSeedAndDiffersForAnother) {
  const Bristle law({kStiffness, kReach});
  State first, second, other;
  other.x[Bristle::kBristles] = 12345;
  double same = 0, different = 0;
  for (int n = 0; n < 1000; ++n) {
    const double friction = law.step(first, {0.1, 0}, 1e-3);
    same = std::max(same, std::abs(friction - law.step(second, {0.1, 0}, 1e-3)));
    different = std::max(different, std::abs(friction - law.step(other, {0.1, 0}, 1e-3)));
  }
  EXPECT_EQ(same, 0.0);
  EXPECT_GT(different, 0.1 * kStiffness * kReach);
}

TEST(Bristle, DoesNotDriftUnderALoadThatBreaksNoBond) {
  const double hold = kStiffness * kReach;
  Joint joint(Bristle({kStiffness, kReach}), 0.01);
  for (int n = 0; n < 20000; ++n) joint.step(hold * (0.2 + 0.2 * std::sin(1e-2 * n)), 1e-3);
  EXPECT_LT(std::abs(joint.position()), kReach);
}

constexpr ResetIntegrator::Parameters kReset{0.05, 0.6, 100, 0.0};  // z0 = 0.5 mrad, breaks at 0.08 N·m

TEST(ResetIntegrator, IsASpringToItsBreakAwayThenSlidesAtCoulomb) {
  const ResetIntegrator law(kReset);
  for (const int steps : {1, 5}) {
    State state;
    EXPECT_NEAR(moved(law, state, 0.49e-3, 0.01, steps), 1.6 * 100 * 0.49e-3, 1e-12);
    EXPECT_NEAR(moved(law, state, -0.49e-3, 0.01, steps), 0, 1e-12);
    EXPECT_NEAR(moved(law, state, 0.49999e-3, 0.01, steps), 0.08, 2e-6) << "just held";
    static_cast<void>(moved(law, state, 1e-4, 0.01, steps));
    EXPECT_NEAR(moved(law, state, 1e-4, 0.01, steps), 0.05, 1e-15) << "slides";
    EXPECT_NEAR(moved(law, state, -0.1e-3, 0.01, steps), 1.6 * 100 * 0.4e-3, 1e-12) << "holds again";
  }
}

TEST(ResetIntegrator, DampsOnlyWhileItSticks) {
  ResetIntegrator::Parameters parameters = kReset;
  parameters.damping_Nm_s_per_rad = 0.3;
  const ResetIntegrator law(parameters);
  State state;
  EXPECT_NEAR(moved(law, state, 0.1e-3, 0.01), 0.016 + 0.3 * 0.01, 1e-12);
  static_cast<void>(moved(law, state, 1e-3, 0.01));
  EXPECT_NEAR(moved(law, state, 1e-3, 0.01), 0.05, 1e-15);
}

// Sliding friction Fc·(1 + b·exp(−v/vs)) + σ2·v, and a spring of its stiffness at rest.
TEST(ResetIntegrator, SlidesOnACurveOfSpeedAndSticksWithOneStiffness) {
  ResetIntegrator::Parameters parameters = kReset;
  parameters.stribeck_gain = 0.5;
  parameters.stribeck_velocity_rad_per_s = 0.2;
  parameters.stribeck_exponent = 1;
  parameters.viscous_Nm_s_per_rad = 0.01;
  const ResetIntegrator law(parameters);
  for (const double speed : {0.05, 0.2, 1.0}) {
    State state;
    EXPECT_NEAR(moved(law, state, 0.4e-3, speed, 4), 1.6 * 1.5 * 100 * 0.4e-3, 1e-12);
    static_cast<void>(moved(law, state, 1e-2, speed));
    const double sliding = 0.05 * (1 + 0.5 * std::exp(-speed / 0.2)) + 0.01 * speed;
    EXPECT_NEAR(moved(law, state, 1e-2, speed), sliding, 1e-12) << speed;
    EXPECT_NEAR(law.steady_Nm(-speed), -sliding, 1e-12);
    EXPECT_NEAR(law.steady_Nm(0.0), 1.6 * 1.5 * 0.05, 1e-12) << "breakaway";
  }
}

// One step over the whole way costs the spring's end value up to z0 and Coulomb beyond.
TEST(ResetIntegrator, WeighsTheStuckAndSlidingPartOfAStep) {
  State state;
  EXPECT_NEAR(moved(ResetIntegrator(kReset), state, 2e-3, 0.01), 0.25 * 0.08 + 0.75 * 0.05, 1e-15);
}

TEST(ResetIntegrator, DoesNotDriftBelowBreakAwayAndLetsGoAbove) {
  ResetIntegrator::Parameters parameters = kReset;
  parameters.damping_Nm_s_per_rad = 0.2;
  Joint held(ResetIntegrator(parameters), 0.01), loose(ResetIntegrator(parameters), 0.01);
  const auto load = [](int n) { return std::min(1.0, 1e-3 * n) * (0.05 + 0.02 * std::sin(1e-3 * n)); };
  for (int n = 0; n < 20000; ++n) held.step(load(n), 1e-4);
  const double before = held.position();
  for (int n = 0; n < 62832; ++n) held.step(0.05 + 0.02 * std::sin(1e-3 * (20000 + n)), 1e-4);
  EXPECT_NEAR(held.position(), before, 1e-7) << "ten cycles later";
  for (int n = 0; n < 20000; ++n) loose.step(std::min(0.085, 1e-5 * n), 1e-4);
  EXPECT_GT(loose.position(), 0.1);
}

}  // namespace friction_bristle_test
