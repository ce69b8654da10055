// The experiments of the LuGre paper (Canudas de Wit et al. 1995, Table I) compared with a stiff solver
// (friction.md section 1, Radau at 1e-10; N and m as in the paper), its closed forms, and its known defect
// compared with the elasto-plastic law that fixes it (Dupont et al. 2002).
#include "model/friction/lugre.h"

#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <numbers>
#include <vector>

#include "model/friction/elasto_plastic.h"
#include "model/friction/kfm.h"
#include "tests/model/friction_joint.h"

namespace friction_lugre_test {

using namespace model::friction;  // NOLINT(google-build-using-namespace)
using friction_test::Chance;
using friction_test::Joint;

const LuGre::Parameters kPaper{1.0, 1.5, 0.001, 2, 1e5, std::sqrt(1e5), 0.4};
const ElastoPlastic::Parameters kPaperElastoPlastic{1.0, 1.5, 0.001, 2, 1e5, std::sqrt(1e5), 0.4, 0.8};
constexpr double kTolerance = 0.01;  // the paper's figures can be read to no better

TEST(LuGrePaper, Figure2PreSlidingLoopClosesOnItself) {
  Joint joint(LuGre(kPaper), 1.0);
  const auto force = [](double t) {
    if (t < 10) return 0.1425 * t;
    if (t < 15) return 1.425;
    if (t < 35) return 1.425 - 0.1425 * (t - 15);
    if (t < 40) return -1.425;
    if (t < 60) return -1.425 + 0.1425 * (t - 40);
    return 1.425;
  };
  constexpr double kStep = 1e-4;
  std::array<double, 66> position_um{};
  for (int n = 0; n < 650000; ++n) {
    joint.step(force(kStep * n), kStep);
    if ((n + 1) % 10000 == 0) position_um[static_cast<std::size_t>((n + 1) / 10000)] = 1e6 * joint.position();
  }
  EXPECT_NEAR(position_um[10], 44.86, 44.86 * kTolerance);
  EXPECT_NEAR(position_um[15], 45.31, 45.31 * kTolerance);
  EXPECT_NEAR(position_um[35], -9.56, 9.56 * kTolerance);
  EXPECT_NEAR(position_um[40], -10.02, 10.02 * kTolerance);
  EXPECT_NEAR(position_um[60], 44.86, 44.86 * kTolerance);
}

// While s is Fs, dz/dx = 1 − σ0·z/Fs: x = −(Fs/σ0)·ln(1 − F/Fs), independent of speed and step.
TEST(LuGre, PreSlidesQuasiStaticallyByTheLogarithm) {
  const LuGre law(kPaper);
  for (const int steps : {1, 7, 1000}) {
    State state;
    const double way = -1.5e-5 * std::log(1 - 1.425 / 1.5);
    EXPECT_NEAR(way, 44.94e-6, 0.01e-6);
    EXPECT_NEAR(friction_test::moved(law, state, way, 1e-8, steps), 1.425, 1e-6) << steps;
  }
}

TEST(LuGrePaper, Figure3FrictionLagsBehindTheVelocity) {
  struct Case {
    double w;
    std::array<double, 4> accelerating, decelerating;  // at 0.75, 1, 1.5, 2 mm/s
    double area;
  };
  const std::array<Case, 3> cases{
      {{1, {1.2891, 1.1872, 1.0539, 1.0100}, {1.2813, 1.1816, 1.0527, 1.0099}, 5.18e-6},
       {10, {1.3180, 1.2150, 1.0611, 1.0107}, {1.2489, 1.1610, 1.0483, 1.0095}, 4.79e-5},
       {25, {1.3227, 1.2454, 1.0796, 1.0130}, {1.2096, 1.1379, 1.0435, 1.0090}, 9.39e-5}}};
  const std::array<double, 4> speeds{0.75e-3, 1e-3, 1.5e-3, 2e-3};
  for (const Case& c : cases) {
    const LuGre law(kPaper);
    State state;
    constexpr double kStep = 1e-5;
    const auto velocity_at = [&](double t) { return 1e-3 * (1.5 + std::cos(c.w * t)); };
    const double period = 2 * std::numbers::pi / c.w;
    const int steps = static_cast<int>(std::lround(3 * period / kStep));
    double last_velocity = 0, last_force = 0, area = 0;
    std::array<double, 4> up{}, down{};
    for (int n = 0; n < steps; ++n) {
      // At the end of the step, where the force is; the velocity of the middle moves it there.
      const double velocity = velocity_at(kStep * (n + 1));
      const double force = law.step(state, {velocity_at(kStep * (n + 0.5)), 0}, kStep);
      if (kStep * n > 2 * period) {
        area += 0.5 * (force + last_force) * (velocity - last_velocity);
        for (std::size_t i = 0; i < speeds.size(); ++i)
          if ((last_velocity - speeds[i]) * (velocity - speeds[i]) <= 0)
            (velocity > last_velocity ? up : down)[i] = force;
      }
      last_velocity = velocity;
      last_force = force;
    }
    for (std::size_t i = 0; i < speeds.size(); ++i) {
      EXPECT_NEAR(up[i], c.accelerating[i], 1e-3 * c.accelerating[i]) << c.w << " at " << speeds[i];
      EXPECT_NEAR(down[i], c.decelerating[i], 1e-3 * c.decelerating[i]) << c.w << " at " << speeds[i];
      EXPECT_GT(up[i], down[i]);
    }
    EXPECT_NEAR(std::abs(area), c.area, kTolerance * c.area) << c.w;
  }
}

TEST(LuGrePaper, Figure4BreakAwayFallsWithTheForceRate) {
  struct Case {
    double rate, breakaway, velocity_mm_per_s;
  };
  double last = 1.5;
  for (const Case& c :
       {Case{1, 1.432, 0.35}, Case{2, 1.394, 0.44}, Case{3, 1.364, 0.50}, Case{4, 1.337, 0.55},
        Case{5, 1.313, 0.60}, Case{10, 1.220, 0.77}, Case{20, 1.099, 1.04}, Case{30, 1.025, 1.33}}) {
    Joint joint(LuGre(kPaper), 1.0);
    constexpr double kStep = 2e-6;
    double highest = 0, velocity = 0;
    for (int n = 0; joint.friction() >= 0.9999 * highest && n < 2000000; ++n) {
      joint.step(c.rate * kStep * n, kStep);
      if (joint.friction() > highest) {
        highest = joint.friction();
        velocity = joint.velocity();
      }
    }
    EXPECT_NEAR(highest, c.breakaway, kTolerance * c.breakaway) << c.rate;
    // Published to 0.01 mm/s.
    EXPECT_NEAR(1e3 * velocity, c.velocity_mm_per_s, 0.005 + kTolerance * c.velocity_mm_per_s) << c.rate;
    EXPECT_LT(highest, last);
    last = highest;
  }
}

/// When it starts and stops to slip, and where it rests between; slipping is faster than `threshold`.
struct Slips {
  std::vector<double> begin, end, rest;
  double fastest = 0, most_friction = 0, lowest = 1e9, highest = -1e9;
};
Slips watched(double duration, double after, double threshold,
              const std::function<double(double t, double x, double v, double dt)>& force) {
  constexpr double kStep = 2e-5;
  Joint joint(LuGre(kPaper), 1.0);
  Slips slips;
  bool slipping = false;
  for (int n = 0; kStep * n < duration; ++n) {
    const double t = kStep * n;
    joint.step(force(t, joint.position(), joint.velocity(), kStep), kStep);
    slips.fastest = std::max(slips.fastest, joint.velocity());
    slips.most_friction = std::max(slips.most_friction, joint.friction());
    if (t < after) continue;
    slips.lowest = std::min(slips.lowest, joint.position());
    slips.highest = std::max(slips.highest, joint.position());
    const bool fast = std::abs(joint.velocity()) > threshold;
    if (fast && !slipping) slips.begin.push_back(t);
    if (!fast && slipping) {
      slips.end.push_back(t);
      slips.rest.push_back(joint.position());
    }
    slipping = fast;
  }
  return slips;
}

TEST(LuGrePaper, Figure6SticksAndSlipsOnAPulledSpring) {
  const Slips slips =
      watched(28, 0, 0.01, [](double t, double x, double, double) { return 2 * (0.1 * t - x); });
  const std::array<double, 4> begin{7.458, 13.821, 20.183, 26.546};
  const std::array<double, 3> rest{0.6363, 1.2726, 1.9088};
  ASSERT_GE(slips.begin.size(), begin.size());
  ASSERT_GE(slips.rest.size(), rest.size());
  for (std::size_t i = 0; i < begin.size(); ++i) EXPECT_NEAR(slips.begin[i], begin[i], kTolerance * begin[i]);
  for (std::size_t i = 0; i < rest.size(); ++i) EXPECT_NEAR(slips.rest[i], rest[i], kTolerance * rest[i]);
  EXPECT_NEAR(slips.begin[2] - slips.begin[1], 6.363, kTolerance * 6.363);
  EXPECT_NEAR(slips.end[0], 10.224, kTolerance * 10.224);
  EXPECT_NEAR(slips.end[1], 16.586, kTolerance * 16.586);
  EXPECT_NEAR(slips.fastest, 0.370, kTolerance * 0.370);
  EXPECT_NEAR(slips.most_friction, 1.477, kTolerance * 1.477);
}

TEST(LuGrePaper, Figure8HuntsUnderIntegralAction) {
  double integral = 0;
  const Slips slips = watched(120, 40, 0.005, [&](double, double x, double v, double dt) {
    integral += (x - 1) * dt;
    return -6 * v - 3 * (x - 1) - 4 * integral;
  });
  ASSERT_GE(slips.begin.size(), 5U);
  for (std::size_t i = 1; i < slips.begin.size(); ++i)
    EXPECT_NEAR(slips.begin[i] - slips.begin[i - 1], 12.2, kTolerance * 12.2);
  // A limit cycle about 1 m: 1 % of its amplitude, and half of the last digit given.
  EXPECT_NEAR(slips.lowest, 0.936, 0.00064 + 0.0005);
  EXPECT_NEAR(slips.highest, 1.064, 0.00064 + 0.0005);
}

TEST(LuGre, IsTheKineticModelAtSteadyState) {
  const Kfm kfm({1.0, 1.5, 0.001, 2, 0.4});
  const LuGre law(kPaper);
  for (const double velocity : {-0.1, -1e-3, 2e-4, 1.7e-3, 1.0}) {
    State state, none;
    const double settled =
        friction_test::moved(law, state, std::copysign(1e-2, velocity), std::abs(velocity));
    EXPECT_NEAR(settled, kfm.step(none, {velocity, 0}, 1), 1e-12) << velocity;
    EXPECT_EQ(law.steady_Nm(velocity), kfm.steady_Nm(velocity));
  }
}

// σ1 = 0 and v = 2 mm/s from rest: F(t) = s·(1 − exp(−σ0·v·t/s)), however the time is cut.
TEST(LuGre, FollowsTheExponentialExactlyForAnyStep) {
  LuGre::Parameters parameters = kPaper;
  parameters.damping_Nm_s_per_rad = parameters.viscous_Nm_s_per_rad = 0;
  const LuGre law(parameters);
  const double level = 1 + 0.5 * std::exp(-4);
  for (const double step : {1e-5, 1e-3, 4e-3}) {
    State state;
    double force = 0;
    for (int n = 1; n * step < 0.0121; ++n) {
      force = law.step(state, {0.002, 0}, step);
      EXPECT_NEAR(force, level * (1 - std::exp(-1e5 * 0.002 * n * step / level)), 1e-10) << step;
    }
  }
}

// For any motion the whole of F is passive while |v|/s(v) <= 4·(σ1 + σ2)/σ1²; s >= Fc here.
TEST(LuGre, IsPassiveAsAWholeBelowItsSpeedLimit) {
  Chance chance(4);
  const LuGre law(kPaper);
  const double limit = 4 * (kPaper.damping_Nm_s_per_rad + 0.4) / 1e5;  // times Fc = 1: 0.0127 m/s
  State state;
  double taken = 0;
  for (int n = 0; n < 300000; ++n) {
    const double velocity = chance.sign() * chance.log_between(1e-6, limit);
    const double dt = chance.log_between(1e-6, 1e-2);
    taken += law.step(state, {velocity, 0}, dt) * velocity * dt;
    ASSERT_GE(taken, law.stored_energy_J(state) - 1e-15) << n;
  }
}

/// Where a mass is after each cycle of F = mean + swing·sin(2π·t), slow against everything inside.
template <class L>
std::vector<double> under_swinging_load(const L& law, double mean, double swing) {
  constexpr double kStep = 1e-4;
  Joint joint(law, 1.0);
  std::vector<double> position;
  for (int n = 0; n < 120000; ++n) {
    const double t = kStep * n;
    // The load comes on within the first second, so that nothing rings.
    joint.step(std::min(t, 1.0) * (mean + swing * std::sin(2 * std::numbers::pi * t)), kStep);
    if ((n + 1) % 10000 == 0) position.push_back(joint.position());
  }
  return position;
}

// LuGre: dx = dF/σ0/(1 ∓ F/Fs) up and down between F₁ and F₂, so each cycle moves it on by
// (Fs/σ0)·ln((1 − F₁²/Fs²)/(1 − F₂²/Fs²)): 3.62 µm between 0.1 and 0.7 N, for ever.
TEST(LuGre, DriftsUnderASwingingLoadBelowBreakAway) {
  const std::vector<double> position = under_swinging_load(LuGre(kPaper), 0.4, 0.3);
  const double drift = 1.5e-5 * std::log((1 - 0.01 / 2.25) / (1 - 0.49 / 2.25));
  EXPECT_NEAR(drift, 3.62e-6, 0.01e-6);
  for (std::size_t i = 2; i < position.size(); ++i)
    EXPECT_NEAR(position[i] - position[i - 1], drift, 0.01 * drift) << i;
}

TEST(ElastoPlastic, DoesNotDriftUnderTheSameLoad) {
  const std::vector<double> position = under_swinging_load(ElastoPlastic(kPaperElastoPlastic), 0.4, 0.3);
  // A spring at its mean load, with what σ1 and σ2 take of it while the load goes through its mean.
  const double velocity = 0.3 * 2 * std::numbers::pi / 1e5;
  const double expected = (0.4 - (std::sqrt(1e5) + 0.4) * velocity) / 1e5;
  EXPECT_NEAR(position.back(), expected, 1e-3 * expected);
  for (std::size_t i = 3; i < position.size(); ++i)
    EXPECT_NEAR(position[i], position[i - 1], 1e-6 * 3.62e-6) << i;
}

TEST(ElastoPlastic, DriftsOnlyWhenTheLoadPassesItsElasticRange) {
  // Up to 0.95 N with an elastic range of 0.8 N.
  const std::vector<double> position = under_swinging_load(ElastoPlastic(kPaperElastoPlastic), 0.5, 0.45);
  EXPECT_GT(position.back() - position[position.size() - 2], 1e-9);
}

TEST(ElastoPlastic, IsASpringUpToItsBreakAwayAndSlidesOnTheStribeckCurve) {
  const ElastoPlastic law(kPaperElastoPlastic);
  State state;
  EXPECT_NEAR(friction_test::moved(law, state, 0.79e-5, 1e-7), 0.79, 1e-4);  // σ1·v on top
  EXPECT_NEAR(friction_test::moved(law, state, -0.79e-5, 1e-7), 0.0, 1e-4) << "and comes back";
  EXPECT_NEAR(friction_test::moved(law, state, 1e-3, 2e-3), 1 + 0.5 * std::exp(-4.0) + 0.4 * 2e-3, 1e-12);
  EXPECT_NEAR(friction_test::moved(law, state, 1e-3, 1e-7), 1.5, 1e-6) << "s(v) grew again";
}

// The transition against a fine Runge-Kutta of the published equation.
TEST(ElastoPlastic, CrossesTheTransitionAsItsEquationSays) {
  ElastoPlastic::Parameters parameters = kPaperElastoPlastic;
  parameters.damping_Nm_s_per_rad = parameters.viscous_Nm_s_per_rad = 0;
  const ElastoPlastic law(parameters);
  const double limit = 1.5e-5, breakaway = 0.8e-5;  // at a speed far below vs
  const auto slope = [&](double z) {
    if (z < breakaway) return 1.0;
    const double alpha =
        z >= limit
            ? 1.0
            : 0.5 + 0.5 * std::sin(std::numbers::pi * (z - 0.5 * (breakaway + limit)) / (limit - breakaway));
    return 1 - alpha * z / limit;
  };
  double z = 0, way = 0;
  State single_steps, wide_steps;
  for (int n = 1; n <= 4000; ++n) {
    const double h = 1e-8;
    const double k1 = slope(z), k2 = slope(z + h / 2 * k1), k3 = slope(z + h / 2 * k2),
                 k4 = slope(z + h * k3);
    z += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    way += h;
    const double fine = friction_test::moved(law, single_steps, h, 1e-9);
    ASSERT_NEAR(fine, 1e5 * z, 1e-5) << way;
    if (n % 200 != 0) continue;  // 2 µm: a third of the transition in one step
    ASSERT_NEAR(friction_test::moved(law, wide_steps, 200 * h, 1e-9), 1e5 * z, 0.01) << way;
  }
}

}  // namespace friction_lugre_test
