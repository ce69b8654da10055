// Dahl's law against its closed form.
#include "model/friction/dahl.h"

#include <gtest/gtest.h>

#include "model/friction/lugre.h"
#include "tests/model/friction_joint.h"

namespace friction_dahl_test {

using namespace model::friction;  // NOLINT(google-build-using-namespace)
using friction_test::Chance;
using friction_test::moved;

constexpr double kCoulomb = 0.04, kStiffness = 250;

/// F/Fc after the way k·x = w from F₀/Fc = f, all towards positive motion. Cases solved by hand from
/// dy/dw = −y^α, y = 1 − F/Fc.
double closed_form(double alpha, double f, double w) {
  const double y = 1 - f;
  if (alpha == 0) return 1 - std::max(0.0, y - w);
  if (alpha == 0.5) return 1 - std::pow(std::max(0.0, std::sqrt(y) - w / 2), 2);
  if (alpha == 1) return 1 - y * std::exp(-w);
  if (alpha == 1.5) return 1 - std::pow(1 / std::sqrt(y) + w / 2, -2);
  if (alpha == 2) return 1 - 1 / (1 / y + w);
  return 1 - std::pow(std::pow(y, -2) + 2 * w, -0.5);  // 3
}

TEST(Dahl, IsItsClosedFormHoweverTheWayIsCut) {
  for (const double alpha : {0.0, 0.5, 1.0, 1.5, 2.0, 3.0})
    for (const double w : {0.01, 0.3, 1.0, 1.9, 10.0})
      for (const int steps : {1, 2, 50}) {
        const Dahl law({kCoulomb, kStiffness, alpha});
        const double way = w * kCoulomb / kStiffness;
        State state;
        const double up = closed_form(alpha, 0, w);
        EXPECT_NEAR(moved(law, state, way, 0.1, steps), kCoulomb * up, 1e-14) << alpha << " " << w;
        // Back over twice the way: the mirror image, from −up.
        EXPECT_NEAR(moved(law, state, -2 * way, 3.0, steps), -kCoulomb * closed_form(alpha, -up, 2 * w),
                    1e-14)
            << alpha << " " << w;
      }
}

TEST(Dahl, ExponentsNextToOneAreNextToTheExponential) {
  for (const double off : {-1e-6, -1e-13, 1e-15, 1e-9}) {
    const Dahl law({kCoulomb, kStiffness, 1 + off});
    State state;
    EXPECT_NEAR(moved(law, state, kCoulomb / kStiffness, 0.1), kCoulomb * (1 - std::exp(-1.0)), 1e-7);
  }
}

TEST(Dahl, HasTheStiffnessAtZeroTorqueAndNeverPassesCoulomb) {
  for (const double alpha : {0.0, 0.3, 1.0, 2.0, 5.0}) {
    const Dahl law({kCoulomb, kStiffness, alpha});
    State state;
    EXPECT_NEAR(moved(law, state, 1e-9, 0.1), kStiffness * 1e-9, 2e-5 * kStiffness * 1e-9);
    Chance chance(5);
    for (int n = 0; n < 10000; ++n)
      ASSERT_LE(std::abs(law.step(state, {chance.sign() * chance.log_between(1e-6, 1e3), 0}, 1e-3)),
                kCoulomb);
  }
}

TEST(Dahl, DependsOnTheWayAndNotOnTheSpeed) {
  const Dahl law({kCoulomb, kStiffness, 1.7});
  State slow, fast;
  for (const double way : {1e-4, -3e-5, 2e-5, -4e-4})
    EXPECT_NEAR(moved(law, slow, way, 1e-6, 10), moved(law, fast, way, 10), 1e-15);
}

// LuGre with Fs = Fc, σ1 = σ2 = 0 is Dahl's law with α = 1 [Canudas de Wit et al. 1995].
TEST(Dahl, WithExponentOneIsLuGreWithoutStribeckAndDamping) {
  const Dahl dahl({kCoulomb, kStiffness, 1});
  const LuGre lugre({kCoulomb, kCoulomb, 0.1, 2, kStiffness, 0, 0});
  Chance chance(6);
  State a, b;
  for (int n = 0; n < 5000; ++n) {
    const Contact contact{chance.sign() * chance.log_between(1e-4, 10), 0};
    ASSERT_NEAR(dahl.step(a, contact, 1e-3), lugre.step(b, contact, 1e-3), 1e-15);
  }
}

// dF/dx = σ0·(1 ∓ F/Fc): a cycle between F₁ and F₂ advances by (Fc/σ0)·ln((1 − F₁²/Fc²)/(1 − F₂²/Fc²)).
TEST(Dahl, DriftsUnderASwingingLoadByTheKnownAmount) {
  const Dahl law({kCoulomb, kStiffness, 1});
  State state;
  const double low = 0.25, high = 0.75;  // of Fc
  double position = 0, last = 0;
  const double step = 1e-9;
  for (int cycle = 0; cycle < 3; ++cycle) {
    while (law.step(state, {1, 0}, step) < high * kCoulomb) position += step;
    while (law.step(state, {-1, 0}, step) > low * kCoulomb) position -= step;
    if (cycle > 0) {
      EXPECT_NEAR(position - last, kCoulomb / kStiffness * std::log((1 - low * low) / (1 - high * high)),
                  4 * step);
    }
    last = position;
  }
}

}  // namespace friction_dahl_test
