// Properties of every friction law: the interface, faults, finite numbers, energy, step sizes.
#include <gtest/gtest.h>

#include <limits>
#include <set>
#include <stdexcept>
#include <string>

#include "model/friction/any_law.h"
#include "tests/model/friction_joint.h"
#include "tests/support/no_alloc_guard.h"

namespace friction_law_test {

using namespace model::friction;  // NOLINT(google-build-using-namespace)
using friction_test::Chance;
using friction_test::Joint;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

static_assert(Law<LuGre> && StoresEnergy<LuGre> && !HoldsRigidly<LuGre>);
static_assert(Law<Kfm> && !StoresEnergy<Kfm> && HoldsRigidly<Kfm>);
static_assert(std::is_trivially_copyable_v<State>);

std::string message_of(const auto& action) {
  try {
    action();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "nothing was thrown";
}

class EveryLaw : public testing::TestWithParam<LawDescription> {
 protected:
  const LawDescription& description = GetParam();
  const AnyLaw law = make_law(GetParam().name);
};
const auto kNameOfLaw = [](const auto& law) { return std::string(law.param.name); };
template <typename Wanted>
auto laws(Wanted&& wanted) {
  std::vector<LawDescription> chosen;
  for (const LawDescription& law : law_descriptions())
    if (wanted(law)) chosen.push_back(law);
  return testing::ValuesIn(chosen);
}
INSTANTIATE_TEST_SUITE_P(, EveryLaw, laws([](const LawDescription&) { return true; }), kNameOfLaw);

/// The measured wheels differ by direction.
class SymmetricLaw : public EveryLaw {};
INSTANTIATE_TEST_SUITE_P(, SymmetricLaw,
                         laws([](const LawDescription& law) { return law.name != "measured_wheel"; }),
                         kNameOfLaw);

/// Bristles have random places: friction_bristle_test.cpp tests means and distributions.
class CertainLaw : public EveryLaw {};
INSTANTIATE_TEST_SUITE_P(, CertainLaw, laws([](const LawDescription& law) { return law.name != "bristle"; }),
                         kNameOfLaw);

class IntegratedLaw : public EveryLaw {};
INSTANTIATE_TEST_SUITE_P(, IntegratedLaw, laws([](const LawDescription& law) {
                           return law.has_memory && law.name != "bristle";
                         }),
                         kNameOfLaw);

TEST(FrictionLaws, AreTheFifteenOfTheLiteratureAndTheMeasuredCurves) {
  std::vector<std::string_view> names;
  for (const LawDescription& law : law_descriptions()) names.push_back(law.name);
  EXPECT_EQ(names,
            (std::vector<std::string_view>{"coulomb", "viscous", "stiction", "kfm", "regularised", "karnopp",
                                           "armstrong", "dahl", "bristle", "reset_integrator", "lugre",
                                           "elasto_plastic", "leuven", "gms", "measured_wheel"}));
  EXPECT_EQ(law_description("armstrong").parameters.size(), 7U);
  EXPECT_TRUE(law_description("dahl").has_memory);
  EXPECT_FALSE(law_description("karnopp").has_memory);
}

TEST(FrictionLaws, AreMadeByNameWithParametersByName) {
  const AnyLaw law = make_law("lugre", {{"coulomb_Nm", 0.5}, {"stribeck_exponent", 2}});
  EXPECT_EQ(law.name(), "lugre");
  EXPECT_EQ(law.parameter("coulomb_Nm"), 0.5);
  EXPECT_EQ(law.parameter("stribeck_exponent"), 2);
  EXPECT_EQ(law.parameter("static_Nm"), LuGre::Parameters{}.static_Nm);
  EXPECT_EQ(law.with("static_Nm", 0.7).parameter("static_Nm"), 0.7);
  EXPECT_EQ(law.with("static_Nm", 0.7).parameter("coulomb_Nm"), 0.5);
  const AnyLaw gms = make_law("gms", {{"share_3", 0.5}, {"stiffness_10_Nm_per_rad", 7}});
  EXPECT_EQ(std::get<Gms>(gms.variant()).parameters().share[2], 0.5);
  EXPECT_EQ(std::get<Gms>(gms.variant()).parameters().stiffness_Nm_per_rad[9], 7);
}

TEST(FrictionLaws, AnEleventhElementIsRefused) {
  const std::string refusal = message_of([] { static_cast<void>(make_law("gms", {{"share_11", 0.1}})); });
  EXPECT_NE(refusal.find("share_11"), std::string::npos) << refusal;
}

TEST(FrictionLaws, NamesWhatExistsWhenANameIsUnknown) {
  const std::string law = message_of([] { static_cast<void>(make_law("lugree")); });
  EXPECT_NE(law.find("lugree"), std::string::npos) << law;
  EXPECT_NE(law.find("reset_integrator, lugre, elasto_plastic"), std::string::npos) << law;
  const std::string parameter = message_of([] { static_cast<void>(make_law("dahl", {{"coulomb_N", 1}})); });
  EXPECT_NE(parameter.find("coulomb_N is unknown; it has coulomb_Nm, stiffness_Nm_per_rad, exponent"),
            std::string::npos)
      << parameter;
  EXPECT_THROW(static_cast<void>(make_law("dahl").parameter("static_Nm")), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(law_description("")), std::invalid_argument);
  const std::string twice = message_of([] {
    static_cast<void>(make_law("dahl", {{"exponent", 1}, {"exponent", 2}}));
  });
  EXPECT_NE(twice.find("exponent is given twice"), std::string::npos) << twice;
}

TEST(FrictionLaws, RefuseElementsWithoutAnyShareAndBrokenWheels) {
  for (const char* name : {"gms", "leuven"}) {
    const std::string message = message_of([&] {
      static_cast<void>(make_law(name, {{"share_1", 0}, {"share_2", 0}, {"share_3", 0}, {"share_4", 0}}));
    });
    EXPECT_NE(message.find("share_1 to share_10 are all 0"), std::string::npos) << message;
  }
  EXPECT_THROW(static_cast<void>(make_law("measured_wheel", {{"wheel", 1.5}})), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(make_law("measured_wheel", {{"wheel", 5}})), std::invalid_argument);
}

TEST_P(EveryLaw, DescribesEachParameterOnceWithDefaultsWithinBounds) {
  std::set<std::string_view> names;
  for (const ParameterDescription& parameter : description.parameters) {
    EXPECT_TRUE(names.insert(parameter.name).second) << parameter.name;
    EXPECT_LE(parameter.lower, parameter.initial) << parameter.name;
    EXPECT_LE(parameter.initial, parameter.upper) << parameter.name;
    EXPECT_EQ(law.parameter(parameter.name), parameter.initial) << parameter.name;
  }
}

TEST_P(EveryLaw, RefusesEachValueOutOfBoundsByNameValueAndBounds) {
  for (const ParameterDescription& parameter : description.parameters)
    for (const double bad : {parameter.lower - 1, parameter.upper * 1.001 + 1, kNaN, kInfinity, -kInfinity}) {
      const std::string message = message_of([&] {
        static_cast<void>(make_law(description.name, {{parameter.name, bad}}));
      });
      EXPECT_NE(message.find(std::string(description.name)), std::string::npos) << message;
      EXPECT_NE(message.find(std::string(parameter.name) + " = "), std::string::npos) << message;
      EXPECT_NE(message.find("expected"), std::string::npos) << message;
    }
}

TEST_P(EveryLaw, IsMadeFromTheValuesOfAFit) {
  std::vector<double> values;
  for (const ParameterDescription& parameter : description.parameters) values.push_back(parameter.initial);
  EXPECT_EQ(make_law_from_values(description.name, values).steady_Nm(0.3), law.steady_Nm(0.3));
  values.push_back(1);
  EXPECT_THROW(static_cast<void>(make_law_from_values(description.name, values)), std::invalid_argument);
}

TEST_P(EveryLaw, TakesAFaultySampleForNothingAndForgetsIt) {
  State state;
  for (int n = 0; n < 30; ++n) static_cast<void>(law.step(state, {0.01 * n, 0.02}, 1e-3));
  const State before = state;
  for (const Contact& contact : {Contact{kNaN, 0}, Contact{kInfinity, 0}, Contact{-kInfinity, 0},
                                 Contact{0.1, kNaN}, Contact{0.1, kInfinity}, Contact{2e9, 0}})
    EXPECT_EQ(law.step(state, contact, 1e-3), 0.0);
  for (const double dt : {-1e-3, kNaN, kInfinity, 1e7}) EXPECT_EQ(law.step(state, {0.1, 0}, dt), 0.0);
  EXPECT_EQ(state.x, before.x);
}

TEST_P(EveryLaw, IsRelaxedInAZeroState) {
  State state;
  EXPECT_EQ(law.step(state, {0, 0}, 1e-3), 0.0);
  EXPECT_EQ(law.stored_energy_J(State{}), 0.0);
}

TEST_P(SymmetricLaw, ActsAlikeInBothDirections) {
  Chance chance(1);
  State forward, backward;
  for (int n = 0; n < 2000; ++n) {
    const double velocity = chance.sign() * chance.log_between(1e-4, 1);
    const double applied = chance.between(-0.2, 0.2);
    ASSERT_EQ(law.step(forward, {velocity, applied}, 1e-3), -law.step(backward, {-velocity, -applied}, 1e-3));
  }
}

TEST_P(CertainLaw, SettlesAtItsSteadyCurve) {
  for (const double velocity : {-9.0, -0.4, -0.02, 0.02, 0.4, 9.0}) {
    State state;
    double friction = 0;
    for (int n = 0; n < 5000; ++n) friction = law.step(state, {velocity, 0}, 1e-3);
    EXPECT_NEAR(friction, law.steady_Nm(velocity), 1e-9) << velocity;
  }
}

TEST_P(EveryLaw, StaysANumberAnywhereWithinItsBounds) {
  Chance chance(2);
  for (int draw = 0; draw < 300; ++draw) {
    std::vector<double> values;
    for (const ParameterDescription& parameter : description.parameters) {
      const double low = parameter.lower, high = parameter.upper;
      const double kind = chance.between(0, 4);
      values.push_back(kind < 1   ? low
                       : kind < 2 ? high
                       : kind < 3 ? chance.log_between(std::max(low, 1e-9 * high), high)
                                  : chance.between(low, high));
      if (parameter.name == "wheel") values.back() = std::round(values.back());
      if (parameter.name == "share_7") values.back() = std::max(values.back(), 0.01);
    }
    const AnyLaw drawn = make_law_from_values(description.name, values);
    State state;
    for (int n = 0; n < 200; ++n) {
      const double velocity = chance.sign() * chance.log_between(1e-12, 1e9) * (n % 7 == 0 ? 0 : 1);
      const double dt = n % 11 == 0 ? 0 : chance.log_between(1e-9, 1e3);
      ASSERT_TRUE(std::isfinite(drawn.step(state, {velocity, chance.between(-1e6, 1e6)}, dt)))
          << "draw " << draw << " step " << n << " at " << velocity << " for " << dt;
      for (const double value : state.x) ASSERT_TRUE(std::isfinite(value));
      ASSERT_TRUE(std::isfinite(drawn.stored_energy_J(state)));
      ASSERT_TRUE(std::isfinite(drawn.steady_Nm(velocity)));
    }
    ASSERT_GT(drawn.max_step_s(0.01), 0.0);
  }
}

// W = ∫F·v dt taken from the joint is never less than what the springs hold: whatever the motion, no more
// energy comes back than went in. Without σ1, whose own condition is tested with LuGre, and for GMS without
// the Stribeck effect, which breaks it (gms.h).
TEST_P(EveryLaw, NeverReturnsMoreEnergyThanItTook) {
  Chance chance(3);
  for (int draw = 0; draw < 100; ++draw) {
    AnyLaw drawn = friction_test::varied(description, chance, 5);
    for (const ParameterDescription& parameter : description.parameters)
      if (parameter.name == "damping_Nm_s_per_rad" && description.name != "reset_integrator")
        drawn = drawn.with(parameter.name, 0);
    if (description.name == "gms") drawn = drawn.with("static_Nm", drawn.parameter("coulomb_Nm"));
    State state;
    double taken_J = 0;
    for (int n = 0; n < 3000; ++n) {
      double velocity = chance.sign() * chance.log_between(1e-4, 10);
      // Karnopp's second half: in its band the joint is at rest.
      if (description.name == "karnopp" && std::abs(velocity) < drawn.parameter("rest_band_rad_per_s"))
        velocity = 0;
      const double dt = chance.log_between(1e-5, 1e-2);
      taken_J += drawn.step(state, {velocity, chance.between(-1, 1)}, dt) * velocity * dt;
      ASSERT_GE(taken_J, drawn.stored_energy_J(state) - 1e-12 * (1 + taken_J))
          << "draw " << draw << " step " << n;
    }
  }
}

// A commanded velocity, 1 ms against 10 µs, through sliding, reversal and pre-sliding: apart from up to three
// steps at each of the seven reversals, where a law jumps or nearly does, no step differs by more than 1 %.
TEST_P(IntegratedLaw, GivesTheSameAtAMillisecondAsAtTenMicroseconds) {
  State coarse, fine;
  const double largest = std::abs(law.steady_Nm(0.0)) + std::abs(law.steady_Nm(0.25));
  int different = 0;
  for (int n = 0; n < 6000; ++n) {
    // The mean of 0.2·sin(3.5·t) over the step, so that both go the same way.
    const auto mean = [](double begin, double dt) {
      return 0.2 * (std::cos(3.5 * begin) - std::cos(3.5 * (begin + dt))) / (3.5 * dt);
    };
    const double begin = 1e-3 * n;
    const double slow = law.step(coarse, {mean(begin, 1e-3), 0}, 1e-3);
    double quick = 0;
    for (int k = 0; k < 100; ++k) quick = law.step(fine, {mean(begin + 1e-5 * k, 1e-5), 0}, 1e-5);
    different += std::abs(slow - quick) > 0.01 * largest ? 1 : 0;
  }
  RecordProperty("different", different);
  EXPECT_LE(different, 7 * 3);
}

// A wheel's inertia, swung through sliding and pre-sliding by torques: semi-implicit Euler is of first order,
// and at the 153 rad/s of the stuck wheel a millisecond is worth 15 %; what it costs is 2 % of the way.
TEST_P(IntegratedLaw, MovesAJointTheSameAtAMillisecondAsAtTenMicroseconds) {
  Joint coarse(law, 0.0107), fine(law, 0.0107);
  double apart = 0, furthest = 0;
  for (int n = 0; n < 6000; ++n) {
    const auto torque = [](double t) { return 0.15 * std::sin(3 * t); };
    coarse.step(torque(1e-3 * n), 1e-3);
    for (int k = 0; k < 100; ++k) fine.step(torque(1e-3 * n + 1e-5 * k), 1e-5);
    apart = std::max(apart, std::abs(coarse.position() - fine.position()));
    furthest = std::max(furthest, std::abs(fine.position()));
  }
  EXPECT_GT(furthest, 0.1);
  EXPECT_LT(apart, 0.02 * furthest);
}

TEST_P(EveryLaw, HoldsAJointStablyUpToItsStepLimit) {
  constexpr double kInertia = 0.0107;  // a wheel with its rotor, sim/drive.h
  const double dt = std::min(0.98 * law.max_step_s(kInertia), 0.05);
  Joint joint(law, kInertia);
  joint.push(1e-5);  // as far as pre-sliding goes, if there is any
  double early = 0, late = 0;
  for (int n = 0; n < 4000; ++n) {
    joint.step(0, dt);
    double& largest = n < 400 ? early : late;
    largest = std::max(largest, std::abs(joint.velocity()));
  }
  // Laws that jump at rest chatter by dt·2·F/J; the others must not grow.
  const bool jumps = law.holds({0, 0});
  EXPECT_LE(late, jumps ? dt * 2 * std::abs(law.steady_Nm(0.0)) / kInertia + 1e-5 : 1.0001 * early);
}

TEST(FrictionLaws, StepLimitIsWhereAStuckJointBeginsToGrow) {
  constexpr double kInertia = 0.0107;
  for (const char* name : {"viscous", "regularised", "armstrong", "bristle", "reset_integrator", "lugre",
                           "elasto_plastic", "leuven", "gms"}) {
    const AnyLaw law = make_law(name);
    Joint joint(law, kInertia);
    joint.push(1e-12);
    for (int n = 0; n < 400; ++n) joint.step(0, 1.05 * law.max_step_s(kInertia));
    EXPECT_GT(std::abs(joint.velocity()), 1e-11) << name;
  }
}

TEST_P(EveryLaw, StepsWithoutAllocatingOrLocking) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc";
  State state;
  double sum = 0;
  const support::NoAllocGuard guard;
  for (int n = 0; n < 100; ++n)
    sum += law.step(state, {0.01 * (50 - n), 0.1}, 1e-3) + law.steady_Nm(n) + law.stored_energy_J(state) +
           law.max_step_s(1) + (law.holds({0, 0}) ? 1 : 0);
  EXPECT_EQ(guard.violations(), 0);
  EXPECT_NE(sum, 0.0);
}

}  // namespace friction_law_test
