// The laws without memory: their curves, their holding torque at rest, and how each reduces to the simpler
// one.
#include <gtest/gtest.h>

#include "model/friction/coulomb.h"
#include "model/friction/karnopp.h"
#include "model/friction/kfm.h"
#include "model/friction/measured_wheel.h"
#include "model/friction/regularised.h"
#include "model/friction/stiction.h"
#include "model/friction/viscous.h"
#include "model/friction/wheel_curve.h"
#include "tests/model/friction_joint.h"

namespace friction_static_test {

using namespace model::friction;  // NOLINT(google-build-using-namespace)
using friction_test::Joint;

/// Torque at a velocity, without history.
template <class L>
double at(const L& law, double velocity, double applied = 0) {
  State state;
  return law.step(state, {velocity, applied}, 1e-3);
}

// Worked by hand: exp(−1) = 0.36788, exp(−4) = 0.018316, exp(−√2) = 0.243117.
TEST(Kfm, IsTheStribeckCurveOfTheReview) {
  const Kfm squared({1.0, 1.5, 0.001, 2, 0.4});  // friction.md section 1, Table I of the LuGre paper
  EXPECT_NEAR(at(squared, 0.001), 1 + 0.5 * 0.367879441 + 0.0004, 1e-9);
  EXPECT_NEAR(at(squared, -0.002), -(1 + 0.5 * 0.018315639 + 0.0008), 1e-9);
  EXPECT_NEAR(at(squared, 1.0), 1.4, 1e-12);
  EXPECT_NEAR(squared.steady_Nm(0.0), 1.5, 1e-12);
  EXPECT_NEAR(squared.steady_Nm(-0.0), -1.5, 1e-12);
  EXPECT_NEAR(at(Kfm({1, 1.5, 0.001, 1, 0}), 0.001), 1 + 0.5 * 0.367879441, 1e-9);
  EXPECT_NEAR(at(Kfm({1, 1.5, 0.001, 0.5, 0}), 0.002), 1 + 0.5 * 0.243116734, 1e-9);
}

TEST(Kfm, WithThesisTableFourIsWheelOneAtLowSpeed) {
  // Thesis figure 18 is a fit: within 0.01 N·m of the measured curve between 0.1 and 1.2 rad/s.
  const Kfm law{Kfm::Parameters{}};
  for (double velocity = 0.1; velocity < 1.2; velocity += 0.05)
    EXPECT_NEAR(at(law, velocity), wheel_curve_Nm(1, velocity), 0.01) << velocity;
}

TEST(StaticLaws, ReduceToEachOther) {
  const Coulomb coulomb({0.05});
  const Viscous viscous({0.02});
  for (const double velocity : {-3.0, -0.2, -1e-6, 1e-6, 0.2, 3.0}) {
    const double both = at(coulomb, velocity) + at(viscous, velocity);
    EXPECT_NEAR(at(Kfm({0.05, 0.05, 0.1, 2, 0.02}), velocity), both, 1e-15) << "Stribeck without excess";
    EXPECT_NEAR(at(Stiction({0.05, 0.08, 0.02}), velocity), both, 1e-15) << "stiction in motion";
    if (std::abs(velocity) < 0.1) continue;
    EXPECT_NEAR(at(Kfm({0.05, 0.08, 1e-3, 2, 0.02}), velocity), both, 1e-15) << "Stribeck at high speed";
    const Kfm kfm({0.05, 0.08, 0.3, 1, 0.02});
    EXPECT_EQ(at(Regularised({0.05, 0.08, 0.3, 1, 0.02, 0.1}), velocity), at(kfm, velocity));
    EXPECT_EQ(at(Karnopp({0.05, 0.08, 0.3, 1, 0.02, 0.1}), velocity), at(kfm, velocity));
  }
}

TEST(StaticLaws, HoldWhatIsAppliedAtRestUpToBreakAway) {
  const auto check = [](const auto& law, double forward, double backward) {
    for (const double applied : {-0.5 * backward, 0.0, 0.99 * forward}) {
      EXPECT_EQ(at(law, 0.0, applied), applied) << law.kName;
      EXPECT_TRUE(law.holds({0.0, applied})) << law.kName;
    }
    EXPECT_NEAR(at(law, 0.0, 10), forward, 1e-15) << law.kName;
    EXPECT_NEAR(at(law, 0.0, -10), -backward, 1e-15) << law.kName;
    EXPECT_FALSE(law.holds({0.0, 1.01 * forward})) << law.kName;
    EXPECT_FALSE(law.holds({0.0, -1.01 * backward})) << law.kName;
  };
  check(Coulomb({0.05}), 0.05, 0.05);
  check(Stiction({0.05, 0.08, 0.02}), 0.08, 0.08);
  check(Kfm({0.05, 0.08, 0.1, 2, 0.02}), 0.08, 0.08);
  check(Karnopp({0.05, 0.08, 0.1, 2, 0.02, 0.01}), 0.08, 0.08);
  const SlidingTable table = wheel_table(2, {.spacing_rad_per_s = 0.005});
  check(MeasuredWheel({2, 1.25}), 1.25 * table.breakaway_Nm(1), 1.25 * table.breakaway_Nm(-1));
}

TEST(Stiction, IsCoulombBelowItsBreakAwayOnceItMoves) {
  const Stiction law({0.05, 0.08, 0.0});
  EXPECT_EQ(at(law, 1e-12), 0.05);
  EXPECT_EQ(law.steady_Nm(0.0), 0.08);
}

TEST(Regularised, IsContinuousAndCreepsUnderLoadByTheLineThroughZero) {
  const Regularised law({0.05, 0.08, 0.1, 1, 0.0, 0.01});
  const double at_threshold = 0.05 + 0.03 * std::exp(-0.1);
  EXPECT_NEAR(at(law, 0.01 - 1e-12), at_threshold, 1e-10);
  EXPECT_NEAR(at(law, 0.01 + 1e-12), at_threshold, 1e-10);
  EXPECT_NEAR(at(law, -0.005), -0.5 * at_threshold, 1e-15);
  // Known to drift: held for 1 s with 60 % of that, after J·ε/F = 1.3 ms of start.
  Joint joint(law, 0.01);
  for (int n = 0; n < 10000; ++n) joint.step(0.6 * at_threshold, 1e-4);
  EXPECT_NEAR(joint.velocity(), 0.006, 1e-9);
  EXPECT_NEAR(joint.position(), 0.006, 0.006 * 2e-3);
}

TEST(Karnopp, HoldsAJointInItsBandWithoutDriftWhenTheIntegratorTakesItsWord) {
  const Karnopp law({0.05, 0.08, 0.1, 1, 0.0, 0.01});
  State state;
  double velocity = 1.0, position = 0;
  double rested_at = 0;
  for (int n = 0; n < 20000; ++n) {  // 0.07 N·m of load: less than it breaks away with
    const Contact contact{velocity, n < 10000 ? 0.0 : 0.07 * std::sin(1e-2 * n)};
    if (law.holds(contact)) velocity = 0;
    velocity += 1e-3 / 0.01 *
                (contact.applied_torque_Nm - law.step(state, {velocity, contact.applied_torque_Nm}, 1e-3));
    position += 1e-3 * velocity;
    if (n == 10000) rested_at = position;
  }
  EXPECT_GT(rested_at, 0.01);
  EXPECT_EQ(position, rested_at);
}

TEST(Karnopp, PassesTheAppliedTorqueOnlyInsideTheBand) {
  const Karnopp law({0.05, 0.08, 0.1, 1, 0.02, 0.01});
  EXPECT_EQ(at(law, 0.0099, -0.03), -0.03);
  EXPECT_EQ(at(law, -0.0099, 0.5), 0.08);
  EXPECT_NEAR(at(law, 0.0101, -0.03), 0.05 + 0.03 * std::exp(-0.101) + 0.02 * 0.0101, 1e-15);
}

// Wheel 3 rises from 0.087 to 0.102 N·m between 0.02 and 0.1 rad/s.
TEST(MeasuredWheel, KeepsTheRiseBelowItsPeakDownToAGivenSpeed) {
  for (const double wheel : {1.0, 2.0, 3.0, 4.0}) {
    const MeasuredWheel law({wheel, 1, 0.02});
    for (const double velocity : {0.02, 0.03, 0.05, 0.1, 0.25, -0.02, -0.04, -0.08, 3.0, -7.0})
      EXPECT_NEAR(at(law, velocity), wheel_curve_Nm(static_cast<int>(wheel), velocity), 3e-4)
          << wheel << " at " << velocity;
    EXPECT_EQ(law.steady_Nm(0.0), law.steady_Nm(0.02));
    EXPECT_LT(law.steady_Nm(0.0), MeasuredWheel({wheel, 1}).steady_Nm(0.0)) << "of which the peak is held";
  }
}

TEST(MeasuredWheel, IsThePublishedCurveTimesItsScale) {
  // Check values of thesis_notes.md, computed from appendix A. Tolerance: straight lines 0.005 rad/s long.
  EXPECT_NEAR(at(MeasuredWheel({1, 1}), 1.0), 0.0536847, 2e-6);
  EXPECT_NEAR(at(MeasuredWheel({1, 1}), -9.0), -0.310798, 2e-6);
  EXPECT_NEAR(at(MeasuredWheel({2, 1}), -4.0), -0.123525, 2e-6);
  EXPECT_NEAR(at(MeasuredWheel({3, 1}), 5.0), 0.149057, 2e-6);
  EXPECT_NEAR(at(MeasuredWheel({4, 1.3}), -7.0), -1.3 * 0.299831, 3e-6);
  for (int wheel = 1; wheel <= 4; ++wheel)
    for (double velocity = -9.99; velocity < 10; velocity += 0.173) {
      if (std::abs(velocity) < 0.3) continue;  // below the peak the table holds it
      EXPECT_NEAR(at(MeasuredWheel({static_cast<double>(wheel), 1}), velocity),
                  wheel_curve_Nm(wheel, velocity), 1e-3);
    }
  EXPECT_EQ(at(MeasuredWheel({3, 1}), 25), at(MeasuredWheel({3, 1}), 10)) << "held beyond what was measured";
}

TEST(StepLimit, IsTwoOverTheRateOfADamperAndTwoOverTheFrequencyOfASpring) {
  EXPECT_NEAR(coupled_step_limit_s(0, 0.02, 0.01), 2 * 0.01 / 0.02, 1e-15);
  EXPECT_NEAR(coupled_step_limit_s(250, 0, 0.01), 2 / std::sqrt(250 / 0.01), 1e-15);
  EXPECT_TRUE(std::isinf(coupled_step_limit_s(0, 0, 0.01)));
}

}  // namespace friction_static_test
