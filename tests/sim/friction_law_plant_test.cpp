// Friction laws as what a simulated drive does: closed forms of presliding loops and drift, an independent
// integration, and combination with other effects.
#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "model/effects/any_effect.h"
#include "model/effects/drive_model.h"
#include "model/effects/effect_chain.h"
#include "model/effects/resistance.h"
#include "model/friction/any_law.h"
#include "sim/base.h"
#include "sim/model_drive.h"
#include "tests/support/no_alloc_guard.h"

namespace friction_law_plant_test {

using model::effects::AnyEffect;
using model::effects::DriveModel;
using model::effects::make_effect;
using sim::ModelDrive;

constexpr double kJ = 0.0106;
constexpr double kStep_s = 1e-3;
// Thesis, table 4 and 2.5.2.
constexpr double kFc = 0.03718, kFs = 0.08976, kVs = 0.1516, kDelta = 1.047, kViscous = 0.01898;
constexpr double kStiffness = 250, kDamping = 0.127;

DriveModel drive_of(std::vector<AnyEffect> effects) {
  return {.name = "wheel", .inertia_kg_m2 = kJ, .effects = std::move(effects)};
}

/// Work per cycle of a slow sine of torque around `mean_Nm`, and by how much the joint moves on in one.
struct Cycle {
  double work_J = 0;
  double drift_rad = 0;
};
Cycle cycle_of(const DriveModel& model, double amplitude_Nm, double mean_Nm = 0) {
  constexpr int kSteps = 20000, kCycles = 4;
  ModelDrive drive(model, kStep_s);
  Cycle last;
  for (int n = 0; n < kCycles; ++n) {
    last = {};
    for (int i = 0; i < kSteps; ++i) {
      const double raised = n == 0 ? std::min(1.0, 4.0 * i / kSteps) : 1;
      const double torque_Nm =
          raised * (mean_Nm + amplitude_Nm * std::sin(2 * std::numbers::pi * i / kSteps));
      const double before = drive.position_rad();
      drive.step(torque_Nm);
      last.work_J += torque_Nm * (drive.position_rad() - before);
      last.drift_rad += drive.position_rad() - before;
    }
  }
  return last;
}

/// Far below the Stribeck velocity LuGre is dF/dx = σ0·(1 − F·sgn(v)/Fs): Dahl's equation with α = 1, whose
/// loop between ±A loses 2·F/σ0·(F·ln((F + A)/(F − A)) − 2·A) with F its level.
double loop_J(double level_Nm, double stiffness, double amplitude_Nm) {
  return 2 * level_Nm / stiffness *
         (level_Nm * std::log((level_Nm + amplitude_Nm) / (level_Nm - amplitude_Nm)) - 2 * amplitude_Nm);
}

TEST(FrictionLawPlant, PreslidingLoopsLoseWhatTheirEquationsSay) {
  const DriveModel lugre = drive_of({make_effect("lugre")});
  for (const double amplitude : {0.03, 0.045, 0.06})
    EXPECT_NEAR(cycle_of(lugre, amplitude).work_J, loop_J(kFs, kStiffness, amplitude),
                0.02 * loop_J(kFs, kStiffness, amplitude))
        << amplitude;
  const double dahl = loop_J(kFc, kStiffness, 0.03);
  EXPECT_NEAR(cycle_of(drive_of({make_effect("dahl")}), 0.03).work_J, dahl, 0.02 * dahl);
}

// Masing: from -A to A a Maxwell-slip element with slip force W and stiffness k loses 4·W·(X − W/k), where
// 2·X is the way between the ends, if it slips, and nothing otherwise. Of these two, the first slips.
TEST(FrictionLawPlant, AMaxwellSlipLoopLosesWhatItsSlippingElementsDo) {
  const DriveModel model = drive_of({make_effect("gms", {{"coulomb_Nm", 0.09},
                                                         {"static_Nm", 0.09},
                                                         {"viscous_Nm_s_per_rad", 0},
                                                         {"share_1", 0.4},
                                                         {"share_2", 0.6},
                                                         {"share_3", 0},
                                                         {"share_4", 0},
                                                         {"stiffness_1_Nm_per_rad", 200},
                                                         {"stiffness_2_Nm_per_rad", 50},
                                                         {"damping_1_Nm_s_per_rad", 0.1}})});
  const double amplitude = 0.06, slips = 0.036;
  const double half_way = (amplitude - slips) / 50;
  EXPECT_NEAR(cycle_of(model, amplitude).work_J, 4 * slips * (half_way - slips / 200), 2e-7);
}

// Thesis figure 24: the minima creep under a torque that swings below the breakaway torque. For LuGre, up:
// dx = (Fs/σ0)·ln((Fs − F1)/(Fs − F2)); back: (Fs/σ0)·ln((Fs + F2)/(Fs + F1)). The elasto-plastic law was
// made to have none.
TEST(FrictionLawPlant, LuGreCreepsBelowBreakawayAndTheElastoPlasticLawDoesNot) {
  const double low = 0.03, high = 0.07;
  const double creep_rad =
      kFs / kStiffness * (std::log((kFs - low) / (kFs - high)) - std::log((kFs + high) / (kFs + low)));
  const double middle = 0.5 * (low + high), swing = 0.5 * (high - low);
  EXPECT_NEAR(cycle_of(drive_of({make_effect("lugre")}), swing, middle).drift_rad, creep_rad,
              0.03 * creep_rad);
  const DriveModel elastic =
      drive_of({make_effect("elasto_plastic", {{"coulomb_Nm", kFs}, {"breakaway_share", 0.9}})});
  EXPECT_NEAR(cycle_of(elastic, swing, middle).drift_rad, 0, 1e-3 * creep_rad);
}

// The equations of LuGre with J·dv/dt = τ − F, by Runge and Kutta with a step of 5 us.
TEST(FrictionLawPlant, ALuGreDriveFollowsAnIndependentIntegration) {
  struct Values {
    double x = 0, v = 0, z = 0;
  };
  const auto torque = [](double t) { return 0.12 * std::sin(2 * std::numbers::pi * 0.7 * t); };
  const auto rate = [&](const Values& s, double tau) {
    const double g = kFc + (kFs - kFc) * std::exp(-std::pow(std::abs(s.v) / kVs, kDelta));
    const double z_per_s = s.v - kStiffness * std::abs(s.v) / g * s.z;
    const double friction = kStiffness * s.z + kDamping * z_per_s + kViscous * s.v;
    return Values{s.v, (tau - friction) / kJ, z_per_s};
  };
  const auto plus = [](const Values& s, const Values& d, double h) {
    return Values{s.x + h * d.x, s.v + h * d.v, s.z + h * d.z};
  };
  Values s;
  ModelDrive drive(drive_of({make_effect("lugre")}), kStep_s, 20);
  constexpr int kFine = 200;
  const double h = kStep_s / kFine;
  double worst = 0, farthest = 0;
  for (int n = 0; n < 3000; ++n) {
    const double tau = torque(n * kStep_s);  // held over the step
    for (int i = 0; i < kFine; ++i) {
      const Values a = rate(s, tau), b = rate(plus(s, a, h / 2), tau), c = rate(plus(s, b, h / 2), tau),
                   d = rate(plus(s, c, h), tau);
      s = plus(plus(plus(plus(s, a, h / 6), b, h / 3), c, h / 3), d, h / 6);
    }
    drive.step(tau);
    worst = std::max(worst, std::abs(drive.position_rad() - s.x));
    farthest = std::max(farthest, std::abs(s.x));
  }
  EXPECT_GT(farthest, 0.5);
  EXPECT_LT(worst, 0.01 * farthest);
}

/// Acceleration of a drive that has slid for a while at about `velocity`.
double acceleration(const DriveModel& model, double velocity, double torque_Nm) {
  ModelDrive drive(model, kStep_s);
  drive.set_velocity(velocity);
  for (int i = 0; i < 100; ++i) drive.step(torque_Nm);
  const double before = drive.velocity_rad_per_s();
  for (int i = 0; i < 200; ++i) drive.step(torque_Nm);
  return (drive.velocity_rad_per_s() - before) / 0.2;
}

// A law's friction in sliding is its steady one, whether the contact carries it or it is stepped itself. The
// speed hardly changes under a torque of the friction's size.
TEST(FrictionLawPlant, EveryLawBrakesASlidingDriveAtItsSteadyLevel) {
  for (const auto& effect : model::effects::friction_law_effects()) {
    const model::friction::AnyLaw law = model::friction::make_law(effect.name);
    for (const double velocity : {-6.0, 3.0}) {
      const double friction = law.steady_Nm(velocity);
      EXPECT_NEAR(acceleration(drive_of({make_effect(effect.name)}), velocity, friction), 0,
                  0.03 * std::abs(friction) / kJ)
          << effect.name << " at " << velocity;
    }
  }
}

TEST(FrictionLawPlant, OtherEffectsAddToALawAndReduceIt) {
  const double steady = model::friction::make_law("lugre").steady_Nm(3);
  const auto moves_on = [&](const AnyEffect& effect, double friction_Nm) {
    EXPECT_NEAR(acceleration(drive_of({make_effect("lugre"), effect}), 3, friction_Nm), 0, 0.02 / kJ * 0.03)
        << name_of(effect);
  };
  moves_on(make_effect("coulomb", {{"torque_Nm", 0.02}}), steady + 0.02);
  moves_on(make_effect("direction_asymmetry", {{"coulomb_Nm", -0.02}}), steady - 0.02);
  moves_on(make_effect("torque_offset", {{"torque_Nm", 0.02}}), steady + 0.02);
}

// A loaded joint rings on the springs of its law: reducing effects must not feed it.
TEST(FrictionLawPlant, ReducedFrictionLetsAStuckJointRingOut) {
  const DriveModel model = drive_of(
      {make_effect("lugre"), make_effect("direction_asymmetry", {{"coulomb_Nm", 0.02}}),
       make_effect("midspeed_dip", {{"depth_Nm", 0.02}, {"centre_rad_per_s", 0}, {"width_rad_per_s", 1}})});
  ModelDrive drive(model, kStep_s);
  for (int i = 0; i < 2000; ++i) drive.step(0.02);
  EXPECT_LT(std::abs(drive.velocity_rad_per_s()), 1e-3);
}

TEST(FrictionLawPlant, BehindAGapAndASpringTheSharesOfALawAddUp) {
  const std::vector<AnyEffect> effects{
      make_effect("gms"), make_effect("elasticity", {{"stiffness_Nm_per_rad", 200}, {"load_share", 0.4}})};
  const double friction = model::friction::make_law("gms").steady_Nm(5);
  EXPECT_NEAR(acceleration(drive_of(effects), 5, friction), 0, 0.05 * friction / kJ);
}

TEST(FrictionLawPlant, ACompensatorSeesTheSteadyCurveAndTheBreakaway) {
  const auto resistance =
      model::effects::resistance_of(drive_of({make_effect("lugre"), make_effect("measured_wheel")}));
  const double both = model::friction::make_law("lugre").steady_Nm(2) +
                      model::friction::make_law("measured_wheel").steady_Nm(2);
  EXPECT_NEAR(resistance.sliding.level_Nm(2.0), both, 1e-4);
  EXPECT_GT(resistance.sliding.breakaway_Nm(1), kFs);
}

sim::BaseParameters lifted(std::vector<DriveModel> models) {
  sim::BaseParameters parameters;
  parameters.on_ground = false;
  parameters.models = std::move(models);
  return parameters;
}

TEST(FrictionLawPlant, EachWheelFollowsItsOwnModel) {
  std::vector<DriveModel> models;
  for (const double wheel : {1.0, 2.0, 3.0, 4.0})
    models.push_back(drive_of({make_effect("measured_wheel", {{"wheel", wheel}})}));
  sim::Base base(lifted(models));
  for (int i = 0; i < 4; ++i)
    EXPECT_EQ(base.wheel(i).breakaway_Nm(-1),
              -model::friction::make_law("measured_wheel", {{"wheel", i + 1.0}}).steady_Nm(-0.0));
  models.pop_back();
  EXPECT_THROW(sim::Base(lifted(models)), std::invalid_argument);
}

TEST(FrictionLawPlant, AStepTooLongForALawIsRefused) {
  const DriveModel stiff = drive_of({make_effect("lugre", {{"stiffness_Nm_per_rad", 1e8}})});
  try {
    const sim::Base base(lifted({stiff}));
    FAIL() << "unstable";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("its friction law needs steps below 20.5"), std::string::npos)
        << error.what();
  }
  ModelDrive drive(stiff, kStep_s);  // takes as many steps as it needs
  for (int i = 0; i < 200; ++i) drive.step(0.05);
  EXPECT_LT(std::abs(drive.position_rad()), 1e-6);
}

TEST(FrictionLawPlant, SteppingNeitherAllocatesNorLocks) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc";
  std::vector<AnyEffect> all;
  for (const auto& law : model::effects::friction_law_effects()) all.push_back(make_effect(law.name));
  ModelDrive drive(drive_of(all), kStep_s);
  const support::NoAllocGuard guard;
  for (int i = 0; i < 100; ++i) drive.step(0.1);
  EXPECT_EQ(guard.violations(), 0);
}

}  // namespace friction_law_plant_test
