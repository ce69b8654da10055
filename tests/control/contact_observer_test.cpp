// The contact observer on an arm whose motion is integrated here, from the model's own terms.
#include "control/contact_observer.h"

#include "control/arm_posture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "tests/support/no_alloc_guard.h"

namespace contact_observer_test {

using control::ArmVector;
using control::ChainMatrix;
using control::ChainVector;
using control::ContactObserver;
using control::kArmJoints;
using control::kBaseAxes;
using Eigen::Vector3d;

constexpr double kPeriod_s = 1e-3;
const ChainVector kRotors = (ChainVector() << 20, 20, 2, 0.33, 0.33, 0.135, 0.068, 0.068).finished();

/// Base and arm without friction, under torques and a force on the end effector.
class Arm {
 public:
  /// As teleoperation starts: where every direction has a lever at some joint.
  Arm() {
    const control::TipPose pose{{0.35, 0, 0.35},
                                Eigen::Quaterniond(Eigen::AngleAxisd(2.0944, Vector3d::UnitY()))};
    const ArmVector unfolded_rad = (ArmVector() << 2.94961, 1.13446, -2.54818, 1.78896, 2.92343).finished();
    q << 0, 0, 0, control::arm_posture_for(pose, unfolded_rad, model).value();
  }

  /// One period, in which the torques are constant; its midpoint rule has an error of second order.
  void step(const ArmVector& torque_Nm, const Vector3d& force_W_N) {
    const ChainVector a = acceleration(q + kPeriod_s / 2 * v, v, torque_Nm, force_W_N);
    q += kPeriod_s * (v + kPeriod_s / 2 * a);
    v += kPeriod_s * a;
  }

  ContactObserver::Input seen(const ArmVector& torque_Nm) {
    model.update(q);
    ContactObserver::Input input{.elapsed_s = kPeriod_s, .mass = model.mass(), .velocity = v};
    input.mass.diagonal() += kRotors;
    input.coriolis_Nm = model.coriolis_Nm(v).tail<kArmJoints>();
    input.gravity_Nm = model.gravity_Nm().tail<kArmJoints>();
    input.position_rad = q.tail<kArmJoints>();
    input.torque_Nm = torque_Nm;
    input.J_WT = model.J_WT().topRightCorner<3, kArmJoints>();
    return input;
  }
  ArmVector gravity_Nm() {
    model.update(q);
    return model.gravity_Nm().tail<kArmJoints>();
  }
  ArmVector torque_of(const Vector3d& force_W_N) {
    model.update(q);
    return model.J_WT().topRightCorner<3, kArmJoints>().transpose() * force_W_N;
  }

  control::RobotModel model;
  ChainVector q;
  ChainVector v = ChainVector::Zero();

 private:
  ChainVector acceleration(const ChainVector& at, const ChainVector& velocity, const ArmVector& torque_Nm,
                           const Vector3d& force_W_N) {
    model.update(at);
    ChainMatrix mass = model.mass();
    mass.diagonal() += kRotors;
    ChainVector force =
        model.J_WT().topRows<3>().transpose() * force_W_N - model.coriolis_Nm(velocity) - model.gravity_Nm();
    force.tail<kArmJoints>() += torque_Nm;
    return mass.llt().solve(force);
  }
};

TEST(ContactObserver, SeesNoForceInFreeMotionOfBaseAndArm) {
  Arm arm;
  arm.v << 0.3, -0.2, 0.4, 0.5, -0.6, 0.4, 0.7, 0.5;
  ContactObserver observer({});
  double largest_N = 0;
  for (int ms = 0; ms < 1500; ++ms) {
    const ArmVector torque_Nm = arm.gravity_Nm() + ArmVector::Constant(0.5 * std::sin(0.006 * ms));
    arm.step(torque_Nm, Vector3d::Zero());
    observer.step(arm.seen(torque_Nm));
    largest_N = std::max(largest_N, observer.force_W_N().norm());
  }
  EXPECT_GT(arm.v.tail<kArmJoints>().norm(), 0.3) << "it moves";
  EXPECT_LT(largest_N, 0.4) << "from the step of the integration, in motions of 0.5 rad/s";
}

TEST(ContactObserver, FollowsAForceAsALagOfItsRate) {
  Arm arm;
  ContactObserver::Config config;
  config.rate_per_s = 50;
  ContactObserver observer(config);
  const Vector3d force_W_N(-8, 3, 5);
  observer.step(arm.seen(arm.gravity_Nm()));
  for (int ms = 1; ms <= 200; ++ms) {
    const ArmVector torque_Nm = arm.gravity_Nm() - arm.torque_of(force_W_N);  // holds against it
    arm.step(torque_Nm, force_W_N);
    observer.step(arm.seen(torque_Nm));
    const double share = 1 - std::pow(1 - 50 * kPeriod_s, ms);
    EXPECT_LT((observer.torque_Nm() - share * arm.torque_of(force_W_N)).norm(), 0.03) << ms;
  }
  EXPECT_LT((observer.force_W_N() - force_W_N).norm(), 0.1);
}

TEST(ContactObserver, FrictionTurnsRoundWithTheMotion) {
  // A joint that is dragged forward by 1 N·m over its friction of 1 N·m at constant speed, and then rests.
  Arm arm;
  ContactObserver::Config config;
  config.presliding_Nm_per_rad = 1000;
  ContactObserver observer(config);
  ContactObserver::Input input = arm.seen(arm.gravity_Nm());
  const ArmVector held_Nm = arm.gravity_Nm();
  input.sliding_Nm = ArmVector::Constant(1);
  observer.step(input);
  const auto slide = [&](double way_rad, double torque_Nm) {
    for (int ms = 0; ms < 1000; ++ms) {
      input.position_rad[1] += way_rad / 1000;
      input.torque_Nm = held_Nm;
      input.torque_Nm[1] += torque_Nm;
      observer.step(input);
    }
    return observer.torque_Nm()[1];
  };
  EXPECT_NEAR(slide(0.1, 1), 0, 1e-6) << "friction takes all of it";
  EXPECT_NEAR(slide(0, 1), 0, 1e-6) << "and holds it at rest";
  EXPECT_NEAR(slide(0, 0), 1, 1e-6) << "relaxed without motion, something else pushes forward";
  EXPECT_NEAR(slide(-0.1, -1), 0, 1e-6);
}

TEST(ContactObserver, BeginsAgainWithoutAForce) {
  Arm arm;
  ContactObserver observer({});
  const ArmVector held_Nm = arm.gravity_Nm();
  observer.step(arm.seen(held_Nm));
  const ArmVector pushed_Nm = held_Nm - arm.torque_of({-8, 0, 0});
  for (int ms = 0; ms < 100; ++ms) observer.step(arm.seen(pushed_Nm));
  ASSERT_GT(observer.force_W_N().norm(), 5);
  observer.reset();
  EXPECT_EQ(observer.force_W_N(), Vector3d::Zero());
  observer.step(arm.seen(pushed_Nm));
  EXPECT_EQ(observer.force_W_N(), Vector3d::Zero());
}

TEST(ContactObserver, StaysStableOverLongSteps) {
  Arm arm;
  ContactObserver observer({});
  ContactObserver::Input input = arm.seen(arm.gravity_Nm() - arm.torque_of({-8, 0, 0}));
  input.elapsed_s = 0.1;
  for (int n = 0; n < 100; ++n) observer.step(input);
  EXPECT_LT((observer.force_W_N() - Vector3d(-8, 0, 0)).norm(), 0.1);
}

TEST(ContactObserver, RefusesWhatIsNotPositiveByName) {
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()})
    for (const auto& [name, change] :
         {std::pair<const char*, void (*)(ContactObserver::Config&, double)>{
              "rate_per_s", [](ContactObserver::Config&c, double value) { c.rate_per_s = value; }},
          {"presliding_Nm_per_rad",
           [](ContactObserver::Config&c, double value) { c.presliding_Nm_per_rad = value; }},
          {"uncertainty_Nm", [](ContactObserver::Config&c, double value) { c.uncertainty_Nm[3] = value; }}}) {
      ContactObserver::Config config;
      change(config, bad);
      try {
        const ContactObserver observer(config);
        FAIL() << name;
      } catch (const std::invalid_argument& error) {
        EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
      }
    }
}

TEST(ContactObserver, DoesNotAllocateOrLock) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc";
  Arm arm;
  ContactObserver observer({});
  const ContactObserver::Input input = arm.seen(arm.gravity_Nm());
  observer.step(input);
  const support::NoAllocGuard guard;
  observer.step(input);
  EXPECT_EQ(guard.violations(), 0);
}

}  // namespace contact_observer_test
