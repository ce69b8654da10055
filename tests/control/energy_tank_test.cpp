// Energy that a haptic device may return to the hand, measured at its port on devices that change their force
// slowly and late.
#include "control/energy_tank.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>

#include "control/port_energy.h"
#include "tests/support/no_alloc_guard.h"

namespace energy_tank_test {

using control::EnergyTank;
using control::PortEnergy;
using Eigen::Vector3d;

constexpr double kPeriod_s = 1e-3;
constexpr double kReserve_J = 0.005;
constexpr double kRate_N_per_s = 200;
const EnergyTank::Config kConfig{.reserve_J = kReserve_J,
                                 .damping_N_s_per_m = 3,
                                 .force_rate_N_per_s = kRate_N_per_s,
                                 .device_mass_kg = 0.4,
                                 .against_speed_m_per_s = 0.01,
                                 .active = true};

/// Follows the command of the previous sample, as fast as it may.
class Device {
 public:
  void tell(const Vector3d& force_N) {
    Vector3d change_N = commanded_N_ - held_N_;
    change_N *= std::min(1.0, kRate_N_per_s * kPeriod_s / std::max(change_N.norm(), 1e-12));
    held_N_ += change_N;
    commanded_N_ = force_N;
  }
  const Vector3d& held_N() const { return held_N_; }

 private:
  Vector3d held_N_ = Vector3d::Zero();
  Vector3d commanded_N_ = Vector3d::Zero();
};

/// A tank before a device, and the truth about its port.
struct Master {
  explicit Master(const EnergyTank::Config& config = kConfig) : tank(config) {}

  EnergyTank::Output step(const Vector3d& p_m, const Vector3d& v_m_per_s, const Vector3d& wanted_N,
                          double stored_J) {
    const EnergyTank::Output output = tank.step(p_m, v_m_per_s, device.held_N(), wanted_N, stored_J);
    device.tell(output.force_N);
    given.update(p_m, device.held_N());
    return output;
  }

  EnergyTank tank;
  Device device;
  PortEnergy given;
};

/// Of a motion with bounded acceleration and speed.
struct Motion {
  void step(const Vector3d& a_m_per_s2, double top_speed_m_per_s) {
    v_m_per_s += kPeriod_s * a_m_per_s2;
    v_m_per_s *= std::min(1.0, top_speed_m_per_s / std::max(v_m_per_s.norm(), 1e-12));
    p_m += kPeriod_s * v_m_per_s;
  }
  Vector3d p_m = Vector3d::Zero();
  Vector3d v_m_per_s = Vector3d::Zero();
};

/// With this level, and the handle at p = (1, 0, 0) m: the hand has pushed it there against a force, or was
/// pushed.
EnergyTank with_level(double level_J) {
  EnergyTank tank(kConfig);
  constexpr double kMuch_J = 1e3;
  tank.step(Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero(), kMuch_J);
  tank.step(Vector3d::UnitX(), Vector3d::Zero(), {kReserve_J - level_J, 0, 0}, Vector3d::Zero(), kMuch_J);
  return tank;
}
/// One cycle there; no force was held before.
EnergyTank::Output step(EnergyTank& tank, const Vector3d& v_m_per_s, const Vector3d& wanted_N,
                        double stored_J) {
  return tank.step(Vector3d::UnitX(), v_m_per_s, Vector3d::Zero(), wanted_N, stored_J);
}

enum class Wanted { kAnything, kNowWithTheHandNowAgainstIt, kAlwaysTheSame };

TEST(EnergyTank, FromNoMomentOnGivesMoreThanItsReserveWhenNothingIsStored) {
  constexpr double kTop_m_per_s = 0.5;
  for (const double force_N : {2.0, 8.0})
    for (const double acceleration_m_per_s2 : {2.0, 10.0})
      for (const Wanted wanted :
           {Wanted::kAnything, Wanted::kNowWithTheHandNowAgainstIt, Wanted::kAlwaysTheSame}) {
        // The tank keeps back what braking the force gives at the speed of now. A hand that meanwhile speeds
        // up by a·t gets ∫(F − R·t)·a·t dt = F³·a/(6·R²) more, and two samples pass before the device brakes.
        const double unforeseen_J =
            std::pow(force_N, 3) * acceleration_m_per_s2 / (6 * std::pow(kRate_N_per_s, 2)) +
            2 * kPeriod_s * force_N * kTop_m_per_s;
        std::mt19937 random(17);
        std::normal_distribution<double> normal;
        const auto direction = [&] {
          return Vector3d(Vector3d(Vector3d::NullaryExpr([&] { return normal(random); })).normalized());
        };
        Master master;
        Motion hand;
        Vector3d acceleration = Vector3d::Zero(), towards = Vector3d::UnitX();
        double least_J = 0, most_J = 0;
        for (int n = 0; n < 60'000; ++n) {
          if (n % 50 == 0) acceleration = acceleration_m_per_s2 * direction();
          if (wanted == Wanted::kAnything && n % 70 == 0) towards = direction();
          if (wanted == Wanted::kNowWithTheHandNowAgainstIt && hand.v_m_per_s.norm() > 1e-6)
            towards = (n / 40 % 2 == 0 ? 1 : -1) * hand.v_m_per_s.normalized();
          master.step(hand.p_m, hand.v_m_per_s, force_N * towards, 0);
          least_J = std::min(least_J, master.given.energy_J());
          most_J = std::max(most_J, master.given.energy_J() - least_J);
          hand.step(acceleration, kTop_m_per_s);
        }
        EXPECT_LE(most_J, kReserve_J + unforeseen_J)
            << force_N << " N, " << acceleration_m_per_s2 << " m/s^2, " << static_cast<int>(wanted);
        EXPECT_LT(least_J, -0.1) << "the hand has put energy in, too";
      }
}

TEST(EnergyTank, ASpringThatTheHandWindsUpGivesBackAllOfIt) {
  // A virtual wall, as stiff as the thesis' 700 N/m over k_f = 10, pressed in by 2 cm at up to 0.2 m/s. Held
  // over a sample and late, its force returns a little more than it took: of that the reserve takes what it
  // can, and then the tank.
  constexpr double kStiffness_N_per_m = 70, kDeepest_m = 0.02;
  constexpr int kPress = 314;
  Master master;
  double before_J = 0, taken_J = 0;
  for (int n = 0; n < 50 * kPress; ++n) {
    const double phase = 2 * std::numbers::pi * n / kPress;
    const double x_m = kDeepest_m / 2 * (1 - std::cos(phase));
    const double v_m_per_s = kDeepest_m / 2 * 2 * std::numbers::pi / (kPress * kPeriod_s) * std::sin(phase);
    const Vector3d wanted_N(-kStiffness_N_per_m * x_m, 0, 0);
    const EnergyTank::Output output =
        master.step({x_m, 0, 0}, {v_m_per_s, 0, 0}, wanted_N, kStiffness_N_per_m * x_m * x_m / 2);
    if (n < 2 * kPress) {
      ASSERT_EQ(output.withheld_N, 0) << n;
      ASSERT_LT((output.force_N - wanted_N).norm(), 1e-12) << n;
    }
    ASSERT_LT(output.withheld_N, 0.2 * kStiffness_N_per_m * kDeepest_m) << n;
    taken_J = std::max(taken_J, before_J - master.given.energy_J());
    if (n % kPress != kPress - 1) continue;
    EXPECT_GT(master.given.energy_J() - before_J, -0.2 * taken_J) << "press " << n / kPress;
    before_J = master.given.energy_J();
    taken_J = 0;
  }
  EXPECT_LE(master.given.energy_J(), kReserve_J);
}

TEST(EnergyTank, ASpringThatTheRobotStretchesDrivesAFreeGripByNoMoreThanTheReserve) {
  constexpr double kMass_kg = 0.3, kDrag_N_s_per_m = 0.5, kStiffness_N_per_m = 70;
  for (const double tip_speed_m_per_s : {0.02, 0.1, 0.5}) {
    Master master;
    Motion grip;
    double most_J = 0, withheld_N = 0;
    for (int n = 0; n < 20'000; ++n) {
      // The end effector moves away, and back again.
      const double phase = std::fmod(kPeriod_s * n * tip_speed_m_per_s / 0.15, 2.0);
      const double tip_m = 0.15 * std::min(phase, 2 - phase);
      const double stretch_m = tip_m - grip.p_m.x();
      const auto output = master.step(grip.p_m, grip.v_m_per_s, {kStiffness_N_per_m * stretch_m, 0, 0},
                                      kStiffness_N_per_m * stretch_m * stretch_m / 2);
      withheld_N = std::max(withheld_N, output.withheld_N);
      grip.step((master.device.held_N() - kDrag_N_s_per_m * grip.v_m_per_s) / kMass_kg, 10);
      most_J = std::max(most_J, kMass_kg * grip.v_m_per_s.squaredNorm() / 2);
      ASSERT_LE(master.given.energy_J(), kReserve_J);
    }
    EXPECT_LE(most_J, kReserve_J) << tip_speed_m_per_s;
    EXPECT_GT(withheld_N, 0.1) << "the spring would have had more";
  }
}

TEST(EnergyTank, EmptyItStillLetsTheHandFeelWhatItMovesAgainst) {
  Master master;
  // The robot pulls the hand along until nothing is left, and gives nothing then.
  Motion hand;
  for (int n = 0; n < 1000; ++n) {
    hand.v_m_per_s = {0.1, 0, 0};
    master.step(hand.p_m, hand.v_m_per_s, {2, 0, 0}, 0);
    hand.step(Vector3d::Zero(), 1);
  }
  const EnergyTank::Output empty = master.step(hand.p_m, hand.v_m_per_s, {2, 0, 0}, 0);
  EXPECT_LT(empty.force_N.x(), 0.1);
  EXPECT_GT(empty.withheld_N, 1.7);

  hand.v_m_per_s = {-0.05, 0, 0};
  const EnergyTank::Output against = master.step(hand.p_m, hand.v_m_per_s, {2, 0, 0}, 0);
  EXPECT_LT(against.withheld_N, 0.02);
  EXPECT_GT(against.force_N.x(), 1.98);
}

TEST(EnergyTank, RecoversByWhatTheHandPutsIn) {
  EnergyTank tank = with_level(-0.02);
  const Vector3d along(0.1, 0, 0), wanted_N(2, 0, 0);
  EXPECT_NEAR(step(tank, along, wanted_N, 0).withheld_N, 2, 1e-12);
  // Against 2 N for 5 cm: 0.1 J into a spring.
  tank.step({0.95, 0, 0}, -along, wanted_N, wanted_N, 0.1);
  EXPECT_NEAR(tank.level_J(), 0.08, 1e-12);
  EXPECT_EQ(tank.step({0.95, 0, 0}, along, wanted_N, wanted_N, 0.1).withheld_N, 0);
}

TEST(EnergyTank, HoldsNoMoreThanTheSpringAndTheReserve) {
  EnergyTank tank = with_level(0.3);
  const auto at_rest = [&](double stored_J) {
    step(tank, Vector3d::Zero(), Vector3d::Zero(), stored_J);
    return tank.level_J();
  };
  EXPECT_DOUBLE_EQ(at_rest(0.5), 0.3) << "what the robot puts in is not the hand's";
  EXPECT_DOUBLE_EQ(at_rest(0.1), 0.1 + kReserve_J);
  EXPECT_DOUBLE_EQ(at_rest(0.5), 0.1 + kReserve_J) << "what was gone does not come back";
  tank.reset();
  EXPECT_DOUBLE_EQ(at_rest(0.5), kReserve_J);
}

TEST(EnergyTank, KeepsBackWhatBrakingTheForceWillGive) {
  // A force F that is removed at its rate R still delivers F²·v/(2·R), and F⁴/(8·m·R²) because it accelerates
  // the mass meanwhile: 22 mJ for 4 N at 0.5 m/s on 0.4 kg.
  const Vector3d v(0.5, 0, 0), wanted_N(4, 0, 0);
  const auto given_N = [&](double level_J) {
    EnergyTank tank = with_level(level_J);
    return 4 - step(tank, v, wanted_N, 1).withheld_N;
  };
  double last_N = 0;
  for (double level_J = 0.0005; level_J < 0.1; level_J *= 1.1) {
    const double force_N = given_N(level_J);
    const double braking_J = force_N * force_N * 0.5 / (2 * kRate_N_per_s) +
                             std::pow(force_N, 4) / (8 * 0.4 * kRate_N_per_s * kRate_N_per_s);
    EXPECT_LE(braking_J, level_J);
    EXPECT_GE(force_N, last_N);
    last_N = force_N;
  }
  EXPECT_NEAR(last_N, 4, 1e-12) << "enough is there";
  EXPECT_NEAR(given_N(0), 0, 1e-9);
  EXPECT_NEAR(given_N(-0.01), 0, 1e-9);
}

TEST(EnergyTank, EmptyItBrakes) {
  const Vector3d v(0.2, -0.1, 0.3);
  EnergyTank empty = with_level(0), reserve = with_level(kReserve_J);
  EXPECT_TRUE(step(empty, v, Vector3d::Zero(), 0).force_N.isApprox(-3 * v, 1e-12));
  EXPECT_EQ(step(reserve, v, Vector3d::Zero(), 0).force_N, Vector3d::Zero()) << "not while something is left";
}

TEST(EnergyTank, WhatItsDamperTakesIsLost) {
  EnergyTank tank = with_level(0);
  const Vector3d v(0.2, 0, 0);
  Vector3d held_N = Vector3d::Zero();
  for (int n = 0; n < 200; ++n)
    held_N = tank.step(Vector3d::UnitX() + kPeriod_s * n * v, v, held_N, Vector3d::Zero(), 0).force_N;
  EXPECT_NEAR(held_N.x(), -0.6, 1e-9);
  EXPECT_NEAR(tank.level_J(), 0, 1e-9);
}

TEST(EnergyTank, OnlyObservingItLetsEverythingThroughAndCounts) {
  EnergyTank::Config config = kConfig;
  config.active = false;
  Master master(config);
  Motion hand;
  hand.v_m_per_s = {0.2, 0, 0};
  for (int n = 0; n < 1000; ++n) {
    const auto output = master.step(hand.p_m, hand.v_m_per_s, {5, 1, 0}, 0);
    ASSERT_EQ(output.force_N, Vector3d(5, 1, 0));
    ASSERT_EQ(output.withheld_N, 0);
    hand.step(Vector3d::Zero(), 1);
  }
  EXPECT_GT(master.given.energy_J(), 0.9);
  EXPECT_NEAR(master.tank.level_J(), kReserve_J - master.given.energy_J(), 1e-9);
}

TEST(EnergyTank, RefusesWhatIsOutOfRangeByName) {
  using Config = EnergyTank::Config;
  const auto refusal = [](const Config& config) -> std::string {
    try {
      const EnergyTank tank(config);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "none";
  };
  for (const double bad : {-1.0, std::numeric_limits<double>::quiet_NaN()})
    for (const auto& [name, member] : {std::pair{"reserve_J", &Config::reserve_J},
                                       std::pair{"damping_N_s_per_m", &Config::damping_N_s_per_m},
                                       std::pair{"force_rate_N_per_s", &Config::force_rate_N_per_s},
                                       std::pair{"device_mass_kg", &Config::device_mass_kg},
                                       std::pair{"against_speed_m_per_s", &Config::against_speed_m_per_s}}) {
      Config config = kConfig;
      config.*member = bad;
      EXPECT_NE(refusal(config).find(name), std::string::npos) << refusal(config);
    }
  Config undamped = kConfig;
  undamped.damping_N_s_per_m = 0;
  EXPECT_EQ(refusal(undamped), "none");
}

TEST(EnergyTank, DoesNotAllocateOrLock) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc";
  EnergyTank tank(kConfig);
  const support::NoAllocGuard guard;
  tank.reset();
  for (int n = 0; n < 10; ++n) tank.step({0.001 * n, 0, 0}, {1, 0, 0}, {3, 0, 0}, {3, 0, 0}, 0.1);
  EXPECT_EQ(guard.violations(), 0);
}

}  // namespace energy_tank_test
