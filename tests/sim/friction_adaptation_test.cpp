// What the base's controller learns about its wheels' friction, on a base whose friction the models do not
// know.
#include "control/friction_adaptation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>

#include "control/base_controller.h"
#include "control/base_path.h"
#include "sim/base.h"
#include "tests/support/no_alloc_guard.h"

namespace friction_adaptation_test {

using control::BaseController;
using control::FrictionAdaptation;
using control::PlanarPose;
using control::PlanarVector;
using control::WheelVector;

constexpr double kPeriod_s = 1e-3;
constexpr double kRest_s = 1.0;  // before each part of the path

/// A simulated base with its controller, in steps of a millisecond.
class Driven {
 public:
  explicit Driven(std::array<double, 4> load,
                  std::optional<FrictionAdaptation::Config> adaptation = FrictionAdaptation::Config{})
      : base_(parameters(load)), controller_(config(adaptation)) {
    controller_.reset(positions());
  }

  /// `push_W`: on the body. Returns the distance to the reference [m].
  double step(const control::BaseReference& reference, const PlanarVector& push_W = PlanarVector::Zero()) {
    base_.push(control::rotated(push_W, -base_.pose().yaw_rad));
    last_ = controller_.step(positions(), reference);
    std::array<hal::JointCommand, 4> commands;
    for (std::size_t i = 0; i < 4; ++i)
      commands[i] = hal::JointCommand::torque_Nm(last_.torque_Nm[static_cast<Eigen::Index>(i)]);
    base_.advance(commands, true, std::chrono::milliseconds(1));
    return std::hypot(reference.X_WB.x_m - base_.pose().x_m, reference.X_WB.y_m - base_.pose().y_m);
  }

  /// The drives are off.
  void observe(const PlanarVector& push_B) {
    base_.push(push_B);
    last_ = controller_.observe(positions());
    base_.advance(std::array<hal::JointCommand, 4>{}, false, std::chrono::milliseconds(1));
  }

  sim::Base& base() { return base_; }
  const std::array<double, 4>& factors() const { return last_.friction_factor; }

 private:
  static sim::BaseParameters parameters(std::array<double, 4> load) {
    sim::BaseParameters parameters;
    parameters.loaded_friction_scale = load;
    return parameters;
  }
  static BaseController::Config config(std::optional<FrictionAdaptation::Config> adaptation) {
    BaseController::Config config;
    config.wrench_limits = {.force_N = 6, .moment_Nm = 1};
    config.adapt = adaptation.has_value();
    if (adaptation) config.adaptation = *adaptation;
    return config;
  }
  WheelVector positions() {
    std::array<hal::JointSample, 4> samples;
    base_.measure(samples);
    return {samples[0].position_rad, samples[1].position_rad, samples[2].position_rad,
            samples[3].position_rad};
  }

  sim::Base base_;
  BaseController controller_;
  BaseController::Output last_{};
};

control::BasePath a_path() {
  return control::BasePath({.start = {},
                            .displacements_B = {{0.5, 0, 0}, {0, 0.3, 0}, {0, 0, 1.2}, {-0.3, 0, 0}},
                            .rest_s = kRest_s,
                            .limits = {}});
}

/// Hands that act on the body, in W.
using Push = std::function<PlanarVector(double time_s, const sim::Base& base)>;

/// Largest distance from the reference [m], from two seconds of motion on.
double worst_m(Driven& driven, const control::BasePath& path, const Push& push = {}) {
  constexpr double kLearned_s = kRest_s + 2.0;
  double worst_m = 0;
  for (int ms = 0; ms < static_cast<int>(1000 * path.duration_s()); ++ms) {
    const double time_s = kPeriod_s * ms;
    const PlanarVector hand_W = push ? push(time_s, driven.base()) : PlanarVector::Zero();
    const double error_m = driven.step(path.at(time_s), hand_W);
    if (time_s > kLearned_s) worst_m = std::max(worst_m, error_m);
  }
  return worst_m;
}

const FrictionAdaptation::Config kAnyLoad{.greatest = 3.5};

TEST(FrictionAdaptation, FollowsThePathAtAnyLoadAndLearnsItOfEachWheel) {
  const std::array<std::array<double, 4>, 6> loads{{{0.6, 0.6, 0.6, 0.6},
                                                    {1, 1, 1, 1},
                                                    {1.15, 1.30, 1.10, 1.25},
                                                    {2.4, 0.8, 1.2, 1.0},
                                                    {3, 3, 3, 3},
                                                    {3, 2, 3, 2.5}}};
  for (const std::array<double, 4>& load : loads) {
    SCOPED_TRACE(load[0]);
    Driven driven(load, kAnyLoad);
    // The spring alone lags by 14 mm at the speed of the path.
    EXPECT_LT(worst_m(driven, a_path()), 0.016);
    for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(driven.factors()[i], load[i], 0.05 * load[i]) << i;
  }
  Driven believing({3, 3, 3, 3}, std::nullopt);
  EXPECT_GT(worst_m(believing, a_path()), 0.3) << "this load stops no base, adapted or not";
}

TEST(FrictionAdaptation, FollowsALoadThatChangesUnderWay) {
  // Of all four wheels together, friction is 6 N; this drag of the floor comes on top.
  const Push drag = [](double time_s, const sim::Base& base) {
    const PlanarVector v = control::rotated(base.twist(), base.pose().yaw_rad);
    const double speed = std::hypot(v[0], v[1]);
    const double force_N = time_s > 5 ? 10 : 0;
    return PlanarVector(-force_N * v[0] / (speed + 1e-3), -force_N * v[1] / (speed + 1e-3), 0);
  };
  Driven learning({1, 1, 1, 1}, kAnyLoad);
  Driven believing({1, 1, 1, 1}, std::nullopt);
  EXPECT_LT(worst_m(learning, a_path(), drag), 0.03);
  EXPECT_GT(worst_m(believing, a_path(), drag), 0.1);
}

TEST(FrictionAdaptation, AtItsGoalTheBaseRests) {
  const std::array<std::array<double, 4>, 4> loads{
      {{0.6, 0.6, 0.6, 0.6}, {1.15, 1.30, 1.10, 1.25}, {3, 3, 3, 3}, {3, 2, 3, 2.5}}};
  for (const std::array<double, 4>& load : loads) {
    SCOPED_TRACE(load[0]);
    Driven driven(load, kAnyLoad);
    worst_m(driven, a_path());
    const control::BaseReference goal = a_path().at(1e9);
    for (int ms = 0; ms < 25'000; ++ms) driven.step(goal);
    const PlanarPose settled = driven.base().pose();
    double moved_m = 0;
    for (int ms = 0; ms < 10'000; ++ms) {
      driven.step(goal);
      const PlanarPose& pose = driven.base().pose();
      moved_m = std::max(moved_m, std::hypot(pose.x_m - settled.x_m, pose.y_m - settled.y_m));
    }
    // It creeps towards the distance at which its command is too small for a rise.
    EXPECT_LT(moved_m, 3e-4);
  }
}

struct Held {
  double hand_N = 0;  ///< that the hand needs, at most
  double turned_rad = 0;
  double released_m_per_s = 0;  ///< fastest after the hand has let go
  double factor = 0;            ///< largest, while it is held
};
/// A hand holds the base at its start for eight seconds, but not its heading; the reference is ahead.
Held held(double load, double ahead_m, std::optional<FrictionAdaptation::Config> adaptation) {
  Driven driven({load, load, load, load}, adaptation);
  control::BaseReference ahead;
  ahead.X_WB.x_m = ahead_m;
  Held held;
  for (int ms = 0; ms < 8000; ++ms) {
    const PlanarVector v_W = control::rotated(driven.base().twist(), driven.base().pose().yaw_rad);
    const PlanarPose& pose = driven.base().pose();
    const PlanarVector hand_W(-5000 * pose.x_m - 300 * v_W[0], -5000 * pose.y_m - 300 * v_W[1], 0);
    driven.step(ahead, hand_W);
    held.hand_N = std::max(held.hand_N, hand_W.head<2>().norm());
    held.factor = std::max(held.factor, *std::ranges::max_element(driven.factors()));
  }
  held.turned_rad = std::abs(driven.base().pose().yaw_rad);
  for (int ms = 0; ms < 5000; ++ms) {
    driven.step(ahead);
    held.released_m_per_s = std::max(held.released_m_per_s, driven.base().twist().head<2>().norm());
  }
  return held;
}

TEST(FrictionAdaptation, ABaseThatIsHeldDoesNotTurnAndDoesNotLeapWhenItIsReleased) {
  for (const double load : {0.6, 1.0, 1.2, 1.5})
    for (const double ahead_m : {0.02, 0.1}) {
      SCOPED_TRACE(std::to_string(load) + ", " + std::to_string(ahead_m));
      const Held adapted = held(load, ahead_m, FrictionAdaptation::Config{});
      EXPECT_GT(adapted.factor, 1.9) << "the hand looks like friction";
      EXPECT_LT(adapted.turned_rad, 0.01);
      // The command of 6 N, and the help for twice the friction of the models, 5.7 N.
      EXPECT_LT(adapted.hand_N, 6 + 2 * 5.7);
      // The spring against its damper: without friction, (150 N/m)/(150 N·s/m) times the distance.
      EXPECT_LT(adapted.released_m_per_s, 0.7 * ahead_m + 0.01);
    }
}

TEST(FrictionAdaptation, AHandIsTakenForFrictionUntilItLetsGo) {
  // 3 N do not move the wheels; 14 N shake the base, at rest as far as it is commanded.
  Driven resting({1, 1, 1, 1});
  for (int ms = 0; ms < 3000; ++ms) resting.step({}, {3.0 * std::sin(0.01 * ms), 0, 0});
  for (const double factor : resting.factors()) EXPECT_NEAR(factor, 1, 0.01);
  Driven shaken({1, 1, 1, 1});
  for (int ms = 0; ms < 3000; ++ms) shaken.step({}, {14.0 * std::sin(0.01 * ms), 0, 0});
  for (const double factor : shaken.factors()) EXPECT_LT(factor, 1) << "a hand that drives is no friction";
  worst_m(shaken, a_path());
  for (const double factor : shaken.factors()) EXPECT_NEAR(factor, 1, 0.1);
}

TEST(FrictionAdaptation, NothingIsLearnedWhileTheDrivesAreOff) {
  Driven driven({1, 1, 1, 1});
  for (int ms = 0; ms < 2000; ++ms) driven.observe({20.0 * std::sin(0.005 * ms), 0, 0});
  for (const double factor : driven.factors()) EXPECT_EQ(factor, 1);
}

/// Restarts the observer, no more.
TEST(FrictionAdaptation, AGapOrAValueThatIsNotANumberDoesNotEndTheLearning) {
  const control::LinkMap map = control::LinkMap::with_geometry({});
  FrictionAdaptation adaptation({}, map, {1, 1, 1, 1});
  const WheelVector forward = map.wheel_velocity({0.1, 0, 0}).cwiseSign();
  std::array<control::FrictionEstimate, 4> estimates;
  for (std::size_t i = 0; i < 4; ++i)
    estimates[i] = {2 * forward[static_cast<Eigen::Index>(i)], 0.07 * forward[static_cast<Eigen::Index>(i)],
                    0, 0};
  const WheelVector torque_Nm = 1.5 * 0.07 * forward;  // at constant speed: friction is half as large again
  const PlanarVector twist(0.1, 0, 0);
  adaptation.step(torque_Nm, torque_Nm, estimates, twist, 1e-3);
  adaptation.step(std::numeric_limits<double>::quiet_NaN() * torque_Nm, torque_Nm, estimates, twist, 1e-3);
  adaptation.step(torque_Nm, torque_Nm, estimates, twist, 0.1);
  EXPECT_EQ(adaptation.factors(), (std::array<double, 4>{1, 1, 1, 1}));
  for (int ms = 0; ms < 4000; ++ms) adaptation.step(torque_Nm, torque_Nm, estimates, twist, 1e-3);
  for (const double factor : adaptation.factors()) EXPECT_NEAR(factor, 1.5, 1e-3);
}

TEST(FrictionAdaptation, StaysWithinItsBounds) {
  const FrictionAdaptation::Config narrow{.least = 0.9, .greatest = 1.5};
  Driven heavy({3, 3, 3, 3}, narrow);
  Driven light({0.3, 0.3, 0.3, 0.3}, narrow);
  double greatest = 0;
  for (int ms = 0; ms < 6000; ++ms) {
    heavy.step(a_path().at(kPeriod_s * ms));
    light.step(a_path().at(kPeriod_s * ms));
    for (std::size_t i = 0; i < 4; ++i) {
      greatest = std::max(greatest, heavy.factors()[i]);
      ASSERT_GE(light.factors()[i], 0.9);
    }
  }
  EXPECT_EQ(greatest, 1.5);
  EXPECT_EQ(heavy.factors()[0], 1) << "what does not move with the greatest factor is held";
  EXPECT_EQ(light.factors()[0], 0.9);
}

TEST(FrictionAdaptation, RefusesWhatIsOutOfRange) {
  const control::LinkMap map = control::LinkMap::with_geometry({});
  const auto refuses = [&](const auto& change, std::array<double, 4> start = {1, 1, 1, 1}) {
    FrictionAdaptation::Config config;
    change(config);
    EXPECT_THROW(FrictionAdaptation(config, map, start), std::invalid_argument);
  };
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  using Config = FrictionAdaptation::Config;
  refuses([](Config& c) { c.inertia[2] = 0; });
  refuses([](Config& c) { c.least = 0; });
  refuses([](Config& c) { c.least = 1.1; });
  refuses([](Config& c) { c.greatest = 0.9; });
  refuses([](Config& c) { c.observer_s = 0; });
  refuses([](Config& c) { c.learning_s = kNaN; });
  refuses([](Config& c) { c.rise_per_s = -1; });
  refuses([](Config& c) { c.full_command_Nm = 0; });
  refuses([](Config&) {}, {1, 1, 4, 1});
  refuses([](Config&) {}, {1, kNaN, 1, 1});
}

TEST(FrictionAdaptation, ACycleDoesNotAllocate) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc";
  Driven driven({1, 1, 1, 1});
  control::BaseReference ahead;
  ahead.X_WB.x_m = 0.1;
  const support::NoAllocGuard guard;
  for (int ms = 0; ms < 2000; ++ms) driven.step(ahead);
  EXPECT_EQ(guard.violations(), 0);
}

}  // namespace friction_adaptation_test
