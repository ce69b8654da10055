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
    config.adaptation = adaptation;
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

TEST(FrictionAdaptation, FollowsThePathAtAnyLoadAndLearnsItOfEachWheel) {
  const std::array<std::array<double, 4>, 6> loads{{{0.6, 0.6, 0.6, 0.6},
                                                    {1, 1, 1, 1},
                                                    {1.15, 1.30, 1.10, 1.25},
                                                    {2.4, 0.8, 1.2, 1.0},
                                                    {3, 3, 3, 3},
                                                    {3, 2, 3, 2.5}}};
  for (const std::array<double, 4>& load : loads) {
    SCOPED_TRACE(load[0]);
    Driven driven(load);
    // The spring alone lags by 14 mm at the speed of the path.
    EXPECT_LT(worst_m(driven, a_path()), 0.016);
    for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(driven.factors()[i], load[i], 0.05 * load[i]) << i;
  }
  Driven believing({3, 3, 3, 3}, std::nullopt);
  EXPECT_GT(worst_m(believing, a_path()), 0.3) << "the load is no matter without adaptation";
}

TEST(FrictionAdaptation, FollowsALoadThatChangesUnderWay) {
  // Of all four wheels together, friction is 6 N; this drag of the floor comes on top.
  const Push drag = [](double time_s, const sim::Base& base) {
    const PlanarVector v = control::rotated(base.twist(), base.pose().yaw_rad);
    const double speed = std::hypot(v[0], v[1]);
    const double force_N = time_s > 5 ? 10 : 0;
    return PlanarVector(-force_N * v[0] / (speed + 1e-3), -force_N * v[1] / (speed + 1e-3), 0);
  };
  Driven learning({1, 1, 1, 1});
  Driven believing({1, 1, 1, 1}, std::nullopt);
  EXPECT_LT(worst_m(learning, a_path(), drag), 0.03);
  EXPECT_GT(worst_m(believing, a_path(), drag), 0.1);
}

TEST(FrictionAdaptation, AtItsGoalTheBaseRests) {
  for (const double load : {0.6, 1.2, 3.0}) {
    SCOPED_TRACE(load);
    Driven driven({load, load, load, load});
    worst_m(driven, a_path());
    const control::BaseReference goal = a_path().at(1e9);
    for (int ms = 0; ms < 8000; ++ms) driven.step(goal);
    const PlanarPose settled = driven.base().pose();
    double moved_m = 0;
    for (int ms = 0; ms < 10'000; ++ms) {
      driven.step(goal);
      const PlanarPose& pose = driven.base().pose();
      moved_m = std::max(moved_m, std::hypot(pose.x_m - settled.x_m, pose.y_m - settled.y_m));
    }
    EXPECT_LT(moved_m, 1e-4);
  }
}

/// Fastest motion after a hand that held the base for five seconds has let go.
double released_m_per_s(std::optional<FrictionAdaptation::Config> adaptation) {
  Driven driven({1.2, 1.2, 1.2, 1.2}, adaptation);
  control::BaseReference ahead;
  ahead.X_WB.x_m = 0.1;  // as far as the reference of a velocity goes before it waits
  const auto hand = [](const sim::Base& base) {
    return PlanarVector(-5000 * base.pose().x_m - 300 * base.twist()[0],
                        -5000 * base.pose().y_m - 300 * base.twist()[1], 0);
  };
  for (int ms = 0; ms < 5000; ++ms) driven.step(ahead, hand(driven.base()));
  EXPECT_LT(std::abs(driven.base().pose().x_m), 0.02);
  EXPECT_EQ(driven.factors()[0] > 3, adaptation.has_value()) << "the hand looks like friction";
  double fastest_m_per_s = 0;
  for (int ms = 0; ms < 5000; ++ms) {
    driven.step(ahead);
    fastest_m_per_s = std::max(fastest_m_per_s, driven.base().twist()[0]);
  }
  return fastest_m_per_s;
}

TEST(FrictionAdaptation, ABaseThatWasHeldDoesNotLeapWhenItIsReleased) {
  EXPECT_LT(released_m_per_s(FrictionAdaptation::Config{}), 1.1 * released_m_per_s(std::nullopt));
}

TEST(FrictionAdaptation, NothingIsLearnedAtRestOrFromAHandWithoutACommand) {
  Driven driven({1, 1, 1, 1});
  for (int ms = 0; ms < 3000; ++ms) driven.step({}, {3.0 * std::sin(0.01 * ms), 0, 0});
  for (const double factor : driven.factors()) EXPECT_NEAR(factor, 1, 0.01);
}

TEST(FrictionAdaptation, StaysWithinItsBounds) {
  const FrictionAdaptation::Config narrow{.least = 0.9, .greatest = 1.5};
  Driven heavy({3, 3, 3, 3}, narrow);
  Driven light({0.3, 0.3, 0.3, 0.3}, narrow);
  for (int ms = 0; ms < 6000; ++ms) {
    heavy.step(a_path().at(kPeriod_s * ms));
    light.step(a_path().at(kPeriod_s * ms));
    for (std::size_t i = 0; i < 4; ++i) {
      ASSERT_LE(heavy.factors()[i], 1.5);
      ASSERT_GE(light.factors()[i], 0.9);
    }
  }
  EXPECT_EQ(heavy.factors()[0], 1.5);
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
  refuses([](Config& c) { c.breakaway_per_s = -1; });
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
