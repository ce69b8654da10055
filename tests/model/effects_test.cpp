// Effect of each model element on a drive, compared with its definition and closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <functional>
#include <initializer_list>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "model/effects/any_effect.h"
#include "model/effects/basis.h"
#include "model/effects/drive_model.h"
#include "model/effects/effect_chain.h"
#include "sim/model_drive.h"
#include "tests/support/no_alloc_guard.h"

namespace model::effects {
namespace effects_test {

constexpr double kPi = std::numbers::pi;

EffectChain chain(std::vector<AnyEffect> effects) { return EffectChain(effects); }

double level(const std::vector<AnyEffect>& effects, double speed, double direction = 1, double running_s = 0,
             double load_Nm = 0) {
  return chain(effects).level_Nm(
      {.speed_rad_per_s = speed, .direction = direction, .running_s = running_s, .load_Nm = load_Nm});
}

std::string message_of(std::string_view effect, std::vector<NamedValue> values) {
  try {
    (void)make_effect(effect, values);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(Effects, TheLibraryHasEveryNameOfTheContract) {
  for (const char* name : {"coulomb",
                           "viscous",
                           "stribeck",
                           "direction_asymmetry",
                           "midspeed_dip",
                           "quadratic_drag",
                           "presliding",
                           "cogging",
                           "imbalance",
                           "spring",
                           "inertia",
                           "backlash",
                           "elasticity",
                           "thermal_drift",
                           "torque_offset",
                           "torque_deadband",
                           "transport_delay",
                           "unsigned_current",
                           "load_friction",
                           "position_friction",
                           "torque_saturation",
                           "torque_lag",
                           "torque_ripple",
                           "encoder_eccentricity",
                           "actuator_gain",
                           "actuator_offset",
                           "torque_sensor_offset"}) {
    EXPECT_EQ(name_of(make_effect(name)), name);
    EXPECT_FALSE(effect_description(name).shows.empty()) << name;
  }
}

TEST(Effects, WhatDoesNotExistIsNamedWithWhatDoes) {
  EXPECT_NE(message_of("stickiness", {}).find("there are coulomb, viscous, stribeck"), std::string::npos);
  EXPECT_NE(message_of("coulomb", {{"torque", 1}}).find("it has torque_Nm"), std::string::npos);
  EXPECT_NE(message_of("coulomb", {{"torque_Nm", -1}}).find("is not within 0"), std::string::npos);
  EXPECT_NE(message_of("coulomb", {{"torque_Nm", std::nan("")}}).find("torque_Nm"), std::string::npos);
  EXPECT_NE(message_of("unsigned_current", {{"gain", 1}}).find("it has none"), std::string::npos);
}

CustomEffect log_friction() {
  return {.name = "log_friction",
          .shows = "friction that grows with the logarithm of the speed",
          .amplitude = {"torque_Nm", 0, 10, 0.01},
          .shape = {{"velocity_rad_per_s", 1e-3, 10, 0.1}},
          .tried_shapes = {0.1},
          .level = [](const Sliding& s, double v0) noexcept { return std::log1p(s.speed_rad_per_s / v0); }};
}

/// Once for all tests of this process, since it stays.
AnyEffect added_log_friction(std::initializer_list<NamedValue> values) {
  static const bool kAdded = (add_custom_effect(log_friction()), true);
  EXPECT_TRUE(kAdded);
  return make_effect("log_friction", values);
}

TEST(Effects, AFrictionLawIsAnEffectByItsName) {
  const AnyEffect law = make_effect("lugre", {{"coulomb_Nm", 0.05}});
  EXPECT_EQ(name_of(law), "lugre");
  EXPECT_EQ(parameter_of(law, "coulomb_Nm"), 0.05);
  EXPECT_NEAR(level({law}, 100.0), 0.05 + 0.01898 * 100, 1e-9) << "its steady level";
  EXPECT_EQ(sliding_torque_Nm(chain({law}), -2.0), -level({law}, 2.0));
  EXPECT_TRUE(amplitudes_of(law).empty());
  EXPECT_NE(message_of("lugre", {{"torque", 1}}).find("it has coulomb_Nm"), std::string::npos);
  EXPECT_NE(message_of("lugre", {{"coulomb_Nm", -1}}).find("coulomb_Nm = -1"), std::string::npos);
  EXPECT_EQ(make_effect("coulomb").index(), 0U) << "of the same name: the effect";
  for (const EffectDescription& each : friction_law_effects()) EXPECT_FALSE(each.shows.empty()) << each.name;
}

TEST(CustomEffects, OneActsAndIsDescribedAsTheLibrarysDo) {
  const AnyEffect effect = added_log_friction({{"torque_Nm", 0.02}});
  EXPECT_EQ(name_of(effect), "log_friction");
  EXPECT_EQ(parameter_of(effect, "velocity_rad_per_s"), 0.1);
  EXPECT_NEAR(level({make_effect("coulomb", {{"torque_Nm", 0.04}}), effect}, 0.3),
              0.04 + 0.02 * std::log(4.0), 1e-12);
  EXPECT_EQ(amplitudes_of(effect).front(), "torque_Nm");
  EXPECT_NEAR(sliding_torque_Nm(chain({basis_of(effect, "torque_Nm")}), -0.1), -std::log(2.0), 1e-12);
  EXPECT_NE(message_of("log_friction", {{"torque_Nm", -1}}).find("torque_Nm = -1.000000 is not within 0"),
            std::string::npos);
  EXPECT_NE(message_of("log_friction", {{"gain", 1}}).find("it has torque_Nm, velocity_rad_per_s"),
            std::string::npos);
}

TEST(CustomEffects, ItsColumnHasTheAmplitudeOneEvenBeyondItsBounds) {
  static const bool kAdded =
      (add_custom_effect({.name = "bounded_below_one",
                          .shows = "a constant torque of less than half a newton metre",
                          .amplitude = {"torque_Nm", 0, 0.5, 0.01},
                          .level = [](const Sliding&, double) noexcept { return 2.0; }}),
       true);
  EXPECT_TRUE(kAdded);
  const AnyEffect column = basis_of(make_effect("bounded_below_one"), "torque_Nm");
  EXPECT_EQ(sliding_torque_Nm(chain({column}), 1.0), 2.0);
  EXPECT_NE(message_of("bounded_below_one", {{"torque_Nm", 1}}).find("not within 0"), std::string::npos);
}

TEST(CustomEffects, WhatIsWrongWithOneIsSaid) {
  (void)added_log_friction({});
  const auto problem_with = [](const std::function<void(CustomEffect&)>& change) -> std::string {
    CustomEffect effect = log_friction();
    effect.name = "another";
    change(effect);
    try {
      add_custom_effect(std::move(effect));
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(problem_with([](CustomEffect& e) { e.name = "log_friction"; }),
            "custom effect log_friction: there is an effect of that name");
  EXPECT_EQ(problem_with([](CustomEffect& e) { e.name = "coulomb"; }),
            "custom effect coulomb: there is an effect of that name");
  EXPECT_NE(problem_with([](CustomEffect& e) { e.name = "Log friction"; }).find("lower-case"),
            std::string::npos);
  EXPECT_NE(problem_with([](CustomEffect& e) { e.level = nullptr; }).find("neither level nor load"),
            std::string::npos);
  EXPECT_NE(problem_with([](CustomEffect& e) { e.amplitude.initial = -1; }).find("default within"),
            std::string::npos);
  EXPECT_NE(problem_with([](CustomEffect& e) { e.amplitude.upper = std::nan(""); }).find("finite bounds"),
            std::string::npos);
  EXPECT_NE(problem_with([](CustomEffect& e) { e.tried_shapes = {20}; }).find("not within the bounds"),
            std::string::npos);
  EXPECT_NE(problem_with([](CustomEffect& e) { e.amplitude.name = "k [N·m]"; }).find("name of letters"),
            std::string::npos);
  EXPECT_NE(problem_with([](CustomEffect& e) { e.shape->name = "type"; }).find("name of letters"),
            std::string::npos);
  EXPECT_NE(problem_with([](CustomEffect& e) { e.shape.reset(); }).find("no shape"), std::string::npos);
  EXPECT_NE(problem_with([](CustomEffect& e) { e.shape->name = "torque_Nm"; }).find("one name"),
            std::string::npos);
}

// In a process of its own, since they stay.
TEST(CustomEffects, AProgramAddsUpTo32) {
  const auto fill = [] {
    std::size_t added = custom_effects().size();  // those of the other tests
    try {
      for (;; ++added) {
        CustomEffect effect = log_friction();
        effect.name = "custom_" + std::to_string(added);
        add_custom_effect(std::move(effect));
      }
    } catch (const std::invalid_argument& error) {
      const bool is_named = std::string(error.what()).find("which is the maximum") != std::string::npos;
      std::exit(is_named && added == kMaxCustomEffects ? 0 : 1);
    }
  };
  EXPECT_EXIT(fill(), testing::ExitedWithCode(0), "");
}

TEST(EffectBasis, AmplitudesTimesTheirColumnsAreTheEffect) {
  int linear = 0;
  for (const EffectDescription& description :
       effect_descriptions().first(std::variant_size_v<Effects::Library>)) {
    const AnyEffect effect = make_effect(description.name);
    if (amplitudes_of(effect).empty()) continue;
    ++linear;
    for (const double v : {-4.0, -0.2, 0.05, 1.0}) {
      double sum = 0;
      for (const std::string_view amplitude : amplitudes_of(effect))
        sum += parameter_of(effect, amplitude) * sliding_torque_Nm(chain({basis_of(effect, amplitude)}), v);
      EXPECT_NEAR(sum, sliding_torque_Nm(chain({effect}), v), 1e-12) << description.name << " at " << v;
    }
  }
  EXPECT_EQ(linear, 6);
  EXPECT_THROW((void)basis_of(make_effect("stribeck"), "velocity_rad_per_s"), std::invalid_argument);
}

TEST(Effects, ParametersComeBackAsTheyWentIn) {
  for (const EffectDescription& description : effect_descriptions()) {
    std::vector<NamedValue> values;
    for (const ParameterDescription& parameter : description.parameters)
      values.push_back({parameter.name, 0.5 * parameter.initial + 0.5 * std::min(parameter.upper, 2.0)});
    const AnyEffect effect = make_effect(description.name, values);
    for (const NamedValue& value : values)
      EXPECT_EQ(parameter_of(effect, value.name), value.value) << description.name;
  }
}

// Table 4 of the thesis: Fc 0.03718, Fs 0.08976 N·m, vs 0.1516 rad/s, δ 1.047, σ2 0.01898 N·m·s/rad.
TEST(Effects, CoulombStribeckAndViscousMakeTheKineticFrictionModel) {
  const std::vector<AnyEffect> wheel = {
      make_effect("coulomb", {{"torque_Nm", 0.03718}}),
      make_effect("viscous", {{"coefficient_Nm_s_per_rad", 0.01898}}),
      make_effect("stribeck",
                  {{"static_torque_Nm", 0.08976}, {"velocity_rad_per_s", 0.1516}, {"exponent", 1.047}})};
  EXPECT_DOUBLE_EQ(level(wheel, 0), 0.08976);
  EXPECT_NEAR(level(wheel, 0.1516), 0.03718 + (0.08976 - 0.03718) / std::numbers::e + 0.01898 * 0.1516,
              1e-12);
  EXPECT_NEAR(level(wheel, 10), 0.03718 + 0.1898, 1e-12);
}

// Hess and Soom: half of it is left at vs, a fifth at twice and a tenth at three times that with an exponent
// of 2. Towards no tail at all the curve becomes the exponential one.
TEST(Effects, AStribeckCurveMayFallSlowly) {
  using model::effects::Stribeck;
  EXPECT_DOUBLE_EQ(Stribeck::shape(0.3, 0.3, 2, 1), 0.5);
  EXPECT_DOUBLE_EQ(Stribeck::shape(0.6, 0.3, 2, 1), 0.2);
  EXPECT_NEAR(Stribeck::shape(0.9, 0.3, 2, 1), 0.1, 1e-12);
  EXPECT_DOUBLE_EQ(Stribeck::shape(0, 0.3, 2, 1), 1);
  EXPECT_NEAR(Stribeck::shape(0.5, 0.3, 1.3, 1e-6), Stribeck::shape(0.5, 0.3, 1.3), 1e-5);
}

TEST(Effects, AnAsymmetryIsHalfTheDifferenceBetweenTheDirections) {
  const std::vector<AnyEffect> drive = {
      make_effect("coulomb", {{"torque_Nm", 0.04}}),
      make_effect("direction_asymmetry", {{"coulomb_Nm", 0.005}, {"viscous_Nm_s_per_rad", 0.001}})};
  EXPECT_NEAR(level(drive, 2, +1) - level(drive, 2, -1), 2 * (0.005 + 0.002), 1e-12);
  EXPECT_NEAR(0.5 * (level(drive, 2, +1) + level(drive, 2, -1)), 0.04, 1e-12);
}

TEST(Effects, ADipTakesItsDepthInItsMiddleAndNothingFarAway) {
  const std::vector<AnyEffect> drive = {
      make_effect("coulomb", {{"torque_Nm", 0.04}}),
      make_effect("midspeed_dip", {{"depth_Nm", 0.01}, {"centre_rad_per_s", 2.5}, {"width_rad_per_s", 0.5}})};
  EXPECT_DOUBLE_EQ(level(drive, 2.5), 0.03);
  EXPECT_NEAR(level(drive, 0), 0.04, 1e-9);
  EXPECT_NEAR(level(drive, 5), 0.04, 1e-9);
}

TEST(Effects, FrictionNeverPushes) {
  EXPECT_EQ(level({make_effect("quadratic_drag", {{"coefficient_Nm_s2_per_rad2", -1}})}, 3), 0);
}

TEST(Effects, WarmthArrivesWithItsTimeConstant) {
  const std::vector<AnyEffect> drive = {
      make_effect("coulomb", {{"torque_Nm", 0.04}}),
      make_effect("thermal_drift", {{"coulomb_change_Nm", -0.01}, {"time_constant_s", 30}})};
  EXPECT_DOUBLE_EQ(level(drive, 1, 1, 0), 0.04);
  EXPECT_NEAR(level(drive, 1, 1, 30), 0.04 - 0.01 * (1 - 1 / std::numbers::e), 1e-12);
  EXPECT_NEAR(level(drive, 1, 1, 1000), 0.03, 1e-12);
}

TEST(Effects, LoadFrictionIsAShareOfWhatTheGearCarries) {
  EXPECT_DOUBLE_EQ(level({make_effect("load_friction", {{"share", 0.1}})}, 1, 1, 0, 0.5), 0.05);
}

// A gear of efficiency 0.8 in driving and 0.7 in back-driving lifts 1 N·m with 1/0.8 and holds it back with
// 0.7.
TEST(Effects, AGearTakesMoreFromTheMotorThanItGivesAndGivesLessBack) {
  const std::vector<AnyEffect> gear = {
      make_effect("load_friction", {{"share", 0.25}, {"backdriving_ratio", 1.2}})};
  EXPECT_NEAR(1 + level(gear, 1, +1, 0, 1), 1 / 0.8, 1e-12);
  EXPECT_NEAR(1 - level(gear, 1, -1, 0, 1), 0.7, 1e-12);
  EXPECT_NEAR(1 + level(gear, 1, -1, 0, -1), 1 / 0.8, 1e-12);  // the same load the other way
}

// The same motion whether the acceleration is known or the motor's torque.
TEST(Effects, TheLossOfAGearIsTheSameFromTorqueAndFromAcceleration) {
  for (const double load_share : {0.0, 0.4, 1.0}) {
    const EffectChain drive =
        chain({make_effect("coulomb", {{"torque_Nm", 0.05}}),
               make_effect("load_friction",
                           {{"share", 0.3}, {"backdriving_ratio", 0.5}, {"load_share", load_share}})});
    for (const double direction : {+1.0, -1.0})
      for (const double load_Nm : {-0.4, 0.0, 0.2})
        for (const double inertial_Nm : {-0.9, -0.05, 0.0, 0.3}) {
          const Slide slide{.direction = direction, .load_Nm = load_Nm, .inertial_Nm = inertial_Nm};
          const double level_Nm = drive.level_Nm(slide);
          const double motor_Nm = inertial_Nm + load_Nm + direction * level_Nm;
          EXPECT_NEAR(drive.contact_level_under_Nm(slide, motor_Nm), level_Nm, 1e-12)
              << load_share << ' ' << direction << ' ' << load_Nm << ' ' << inertial_Nm;
        }
  }
}

TEST(Effects, ATightSpotBrakesInBothDirections) {
  const EffectChain drive = chain({make_effect("coulomb", {{"torque_Nm", 0.05}}),
                                   make_effect("position_friction", {{"amplitude_Nm", 0.02}})});
  for (const double direction : {+1.0, -1.0}) {
    EXPECT_NEAR(drive.level_Nm({.direction = direction, .position_rad = 0.5 * kPi}), 0.07, 1e-12);
    EXPECT_NEAR(drive.level_Nm({.direction = direction, .position_rad = -0.5 * kPi}), 0.03, 1e-12);
  }
}

TEST(Effects, PositionTorquesRepeatAsOftenAsTheySay) {
  const EffectChain drive =
      chain({make_effect("cogging", {{"amplitude_Nm", 0.01}, {"periods_per_rev", 7}, {"phase_rad", 0.3}}),
             make_effect("imbalance", {{"torque_Nm", 0.02}, {"rest_position_rad", 0.5}})});
  for (const double theta : {-3.0, 0.0, 0.7, 12.0}) {
    // Magnets are on the motor, a weight on the load.
    EXPECT_NEAR(drive.motor_load_Nm(theta), 0.01 * std::sin(7 * theta + 0.3), 1e-15);
    EXPECT_NEAR(drive.load_Nm(theta), 0.02 * std::sin(theta - 0.5), 1e-15);
  }
  // It hangs at its rest position: pulled back from both sides.
  const EffectChain weight =
      chain({make_effect("imbalance", {{"torque_Nm", 0.02}, {"rest_position_rad", 0.5}})});
  EXPECT_GT(weight.load_Nm(0.6), 0);
  EXPECT_LT(weight.load_Nm(0.4), 0);
}

TEST(Effects, ASpringPullsBackFromBothSidesInProportion) {
  const EffectChain drive =
      chain({make_effect("spring", {{"stiffness_Nm_per_rad", 0.5}, {"rest_position_rad", 0.2}})});
  EXPECT_NEAR(drive.load_Nm(1.2), 0.5, 1e-15);
  EXPECT_NEAR(drive.load_Nm(-1.8), -1, 1e-15);
  EXPECT_EQ(drive.motor_load_Nm(1.2), 0) << "on the load";
}

TEST(Effects, SmallCommandsAreDeliveredAtTheThreshold) {
  EffectChain drive = chain({make_effect("torque_deadband", {{"threshold_Nm", 0.03}})});
  EXPECT_EQ(drive.deliver(0.01, 1e-3), 0.03);
  EXPECT_EQ(drive.deliver(-0.01, 1e-3), -0.03);
  EXPECT_EQ(drive.deliver(0.05, 1e-3), 0.05);
  EXPECT_EQ(drive.deliver(0, 1e-3), 0);
}

TEST(Effects, ALimitIsNotExceeded) {
  EffectChain drive = chain({make_effect("torque_saturation", {{"limit_Nm", 0.3}})});
  EXPECT_EQ(drive.deliver(0.2, 1e-3), 0.2);
  EXPECT_EQ(drive.deliver(0.5, 1e-3), 0.3);
  EXPECT_EQ(drive.deliver(-0.5, 1e-3), -0.3);
}

TEST(Effects, ALagLeavesOneOverEAfterItsTimeConstant) {
  EffectChain drive = chain({make_effect("torque_lag", {{"time_constant_s", 0.05}})});
  double torque = 0;
  for (int i = 0; i < 50; ++i) torque = drive.deliver(1, 1e-3);
  EXPECT_NEAR(torque, 1 - 1 / std::numbers::e, 1e-12);
}

// Of an encoder that is 0.01 rad off once a turn, by differences.
TEST(Effects, TheMotionBehindAnEncoderIsTheOneThatItReports) {
  const EffectChain drive = chain({make_effect(
      "encoder_eccentricity", {{"amplitude_rad", 0.01}, {"periods_per_rev", 3}, {"phase_rad", 1}})});
  const auto position = [](double t) { return 2 * t + 0.5 * std::sin(3 * t); };
  const auto reported = [&](double t) { return position(t) + 0.01 * std::sin(3 * position(t) + 1); };
  constexpr double kStep = 1e-4;
  for (const double t : {0.1, 0.7, 2.0}) {
    const EffectChain::Motion motion = drive.motion_behind(
        {reported(t), (reported(t + kStep) - reported(t - kStep)) / (2 * kStep),
         (reported(t + kStep) - 2 * reported(t) + reported(t - kStep)) / (kStep * kStep)});
    EXPECT_NEAR(motion.position_rad, position(t), 1e-12);
    EXPECT_NEAR(motion.velocity_rad_per_s, 2 + 1.5 * std::cos(3 * t), 1e-6);
    EXPECT_NEAR(motion.acceleration_rad_per_s2, -4.5 * std::sin(3 * t), 1e-5);
  }
}

TEST(Effects, ADelayDeliversEachCommandThatMuchLater) {
  EffectChain drive = chain({make_effect("transport_delay", {{"delay_s", 0.0125}})});
  std::vector<double> delivered;
  for (int i = 0; i < 40; ++i) delivered.push_back(drive.deliver(i, 1e-3));
  EXPECT_EQ(delivered[11], 0);
  EXPECT_NEAR(delivered[30], 17.5, 1e-12);  // half way between two commands
}

TEST(Effects, AGainAndAnOffsetActBeforeTheMotorAndASensorsOffsetBehindIt) {
  EffectChain scaled = chain({make_effect("actuator_gain", {{"gain", 0.8}}),
                              make_effect("actuator_offset", {{"torque_Nm", -0.01}})});
  EXPECT_DOUBLE_EQ(scaled.deliver(0.5, 1e-3), 0.39);
  EXPECT_DOUBLE_EQ(chain({make_effect("torque_sensor_offset", {{"torque_Nm", 0.03}})}).report_Nm(-0.1),
                   -0.07);
}

TEST(Effects, ALostSignLeavesTheMagnitude) {
  const EffectChain sensor = chain({make_effect("unsigned_current")});
  EXPECT_EQ(sensor.report_Nm(-0.2), 0.2);
  EXPECT_EQ(sensor.report_Nm(0.2), 0.2);
}

TEST(Effects, NoInertiaIsNoDrive) {
  EXPECT_THROW(
      (void)chain({make_effect("inertia", {{"difference_kg_m2", -0.02}})}).arranged({.inertia_kg_m2 = 0.01}),
      std::invalid_argument);
}

DriveModel model(std::vector<AnyEffect> effects, double inertia = 0.01) {
  return {.name = "test", .inertia_kg_m2 = inertia, .effects = std::move(effects)};
}

/// Simulated seconds at 1 kHz under `torque(t)`.
template <class Torque>
void run(sim::ModelDrive& drive, double seconds, const Torque& torque) {
  for (int i = 0; i < static_cast<int>(std::lround(seconds * 1000)); ++i) drive.step(torque(i * 1e-3));
}

TEST(ModelDrive, AccelerationIsTorqueOverInertiaDifferenceIncluded) {
  sim::ModelDrive drive(model({make_effect("inertia", {{"difference_kg_m2", 0.005}})}), 1e-3);
  run(drive, 1.0, [](double) { return 0.03; });
  EXPECT_NEAR(drive.velocity_rad_per_s(), 0.03 / 0.015, 1e-9);
}

TEST(ModelDrive, ItRestsBelowBreakAwayAndSlidesAboveIt) {
  const DriveModel wheel =
      model({make_effect("coulomb", {{"torque_Nm", 0.04}}),
             make_effect("stribeck", {{"static_torque_Nm", 0.08}, {"velocity_rad_per_s", 0.1}})});
  sim::ModelDrive below(wheel, 1e-3);
  run(below, 2.0, [](double t) { return 0.079 * std::min(t, 1.0); });
  EXPECT_LT(std::abs(below.position_rad()), 1e-4);
  EXPECT_NEAR(below.velocity_rad_per_s(), 0, 1e-9);
  sim::ModelDrive above(wheel, 1e-3);
  run(above, 2.0, [](double) { return 0.081; });
  // Free of the Stribeck peak, J·dv/dt = τ − Fc.
  EXPECT_NEAR(above.velocity_rad_per_s(), (0.081 - 0.04) / 0.01 * 2, 1.0);
}

TEST(ModelDrive, TheContactGivesLikeItsSpring) {
  sim::ModelDrive drive(
      model({make_effect("coulomb", {{"torque_Nm", 0.08}}),
             make_effect("presliding", {{"stiffness_Nm_per_rad", 250}, {"damping_Nm_s_per_rad", 0.3}})}),
      1e-3);
  run(drive, 3.0, [](double t) { return 0.05 * std::min(t, 1.0); });
  EXPECT_NEAR(drive.position_rad(), 0.05 / 250, 1e-6);
}

// Two masses on a spring, free: they swing against each other with ω² = k·(1/Jm + 1/Jl).
TEST(ModelDrive, ASpringSwingsAtItsResonance) {
  const double stiffness = 100;
  const double share = 0.3;
  const double inertia = 0.01;
  sim::ModelDrive drive(
      model({make_effect("elasticity", {{"stiffness_Nm_per_rad", stiffness}, {"load_share", share}})},
            inertia),
      1e-4, 4);
  drive.step(5.0);  // a knock
  std::vector<double> crossings;
  double last = 0;
  const double mean = 5.0 * 1e-4 / inertia;  // what momentum is left with
  for (int i = 1; i < 4000; ++i) {
    drive.step(0);
    const double swing = drive.velocity_rad_per_s() - mean;
    if (last < 0 && swing >= 0) crossings.push_back(i * 1e-4 - 1e-4 * swing / (swing - last));
    last = swing;
  }
  ASSERT_GT(crossings.size(), 5U);
  const double period = (crossings.back() - crossings.front()) / static_cast<double>(crossings.size() - 1);
  const double expected = std::sqrt(stiffness / inertia * (1 / (1 - share) + 1 / share));
  EXPECT_NEAR(2 * kPi / period, expected, 0.01 * expected);
}

// The motor alone accelerates through the gap, then both masses.
TEST(ModelDrive, AGapIsCrossedWithTheMotorsInertiaAlone) {
  const double share = 0.4;
  const double gap = 0.05;
  const double torque = 0.02;
  const double inertia = 0.01;
  sim::ModelDrive drive(model({make_effect("backlash", {{"gap_rad", gap}, {"load_share", share}})}, inertia),
                        1e-4, 4);
  // It begins in the middle of the gap.
  const double crossing_s = std::sqrt(gap * (1 - share) * inertia / torque);
  for (int i = 0; i < static_cast<int>(0.9 * crossing_s / 1e-4); ++i) drive.step(torque);
  EXPECT_NEAR(drive.velocity_rad_per_s(), torque / ((1 - share) * inertia) * 0.9 * crossing_s, 0.01);
  for (int i = 0; i < 20000; ++i) drive.step(torque);
  // Momentum: all that was pushed in is in both masses now.
  const double pushed = torque * (std::floor(0.9 * crossing_s / 1e-4) + 20000) * 1e-4;
  EXPECT_NEAR(drive.velocity_rad_per_s(), pushed / inertia, 0.02 * pushed / inertia);
}

// Hunt and Crossley: flanks that meet at a low speed v part with (1 − α·v)·v, and no momentum is lost.
TEST(ModelDrive, FlanksBounce) {
  const double share = 0.4;
  const double gap = 0.05;
  for (const double loss : {0.0, 1.0, 2.0}) {
    const double closing = 0.1;
    sim::ModelDrive drive(
        model({make_effect("backlash",
                           {{"gap_rad", gap}, {"load_share", share}, {"impact_loss_s_per_rad", loss}})},
              0.01),
        1e-4, 4);
    drive.set_velocity(closing);
    drive.set_load(0, 0);
    // Time to meet, and half of the way back at the speed at which they part.
    for (int i = 0; i < 4000; ++i) drive.step(0);
    const double parting = closing * (1 - loss * closing);
    EXPECT_NEAR(drive.velocity_rad_per_s(), closing * (1 - share) - share * parting, 0.02 * closing) << loss;
  }
}

TEST(ModelDrive, AMotorWithoutFrictionCoastsThroughTheGap) {
  sim::ModelDrive drive(
      model({make_effect("coulomb", {{"torque_Nm", 0.05}}),
             make_effect("backlash", {{"gap_rad", 2.0}, {"load_share", 0.5}, {"friction_ratio", 2}})},
            0.01),
      1e-4, 4);
  // All friction is the load's: the motor keeps moving.
  drive.set_velocity(1.0);
  for (int i = 0; i < 2000; ++i) drive.step(0);
  EXPECT_NEAR(drive.velocity_rad_per_s(), 1.0, 0.01);
}

TEST(ModelDrive, SteppingNeitherAllocatesNorLocks) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc";
  std::vector<AnyEffect> all;
  for (const EffectDescription& description : effect_descriptions())
    all.push_back(make_effect(description.name));
  sim::ModelDrive drive(model(all), 1e-3);
  const support::NoAllocGuard guard;
  for (int i = 0; i < 100; ++i) drive.step(0.1);
  EXPECT_EQ(guard.violations(), 0);
}

}  // namespace effects_test
}  // namespace model::effects
