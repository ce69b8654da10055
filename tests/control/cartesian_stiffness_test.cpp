// The spring and damper at the end effector against closed forms, and rotations against Eigen's.
#include "control/cartesian_stiffness.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>

#include "tests/support/no_alloc_guard.h"

namespace cartesian_stiffness_test {

using control::CartesianSpring;
using control::Mobility;
using control::rotation_between;
using control::TipSetpoint;
using control::Wrench;
using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;

class Any {
 public:
  double between(double lower, double upper) {
    return std::uniform_real_distribution<double>(lower, upper)(random_);
  }
  Vector3d vector(double size) {
    return Vector3d::NullaryExpr([&] { return between(-size, size); });
  }
  Vector3d direction() { return vector(1).normalized(); }
  Quaterniond orientation() { return Quaterniond(AngleAxisd(between(-kPi, kPi), direction())); }

 private:
  std::mt19937 random_{11};
};

TipSetpoint rest_at(const Vector3d& p_WT_m, const Quaterniond& q_WT) {
  return {{p_WT_m, q_WT}, Vector3d::Zero()};
}

Quaterniond turned_by(const Vector3d& turn_rad) {
  const double angle_rad = turn_rad.norm();
  return Quaterniond(
      AngleAxisd(angle_rad, angle_rad > 0 ? Vector3d(turn_rad / angle_rad) : Vector3d::UnitX()));
}

/// No limit within reach.
const CartesianSpring::Config kFree{.damping_ratio = 0.5, .force_limit_N = 1e6, .moment_limit_Nm = 1e6};

/// Of a body whose apparent mass and inertia are the same in every direction: 4 kg and 0.25 kg·m² have simple
/// roots.
Mobility mobility_of(double mass_kg, double inertia_kg_m2) {
  Wrench diagonal;
  diagonal << Vector3d::Constant(1 / mass_kg), Vector3d::Constant(1 / inertia_kg_m2);
  return diagonal.asDiagonal();
}
const Mobility kBody = mobility_of(4, 0.25);

TEST(RotationBetween, IsEigensAngleAxisOfTheRotationFromOneToTheOther) {
  Any any;
  for (int n = 0; n < 2000; ++n) {
    const Quaterniond from = any.orientation(), to = any.orientation();
    const AngleAxisd expected(to.toRotationMatrix() * from.toRotationMatrix().transpose());
    const Vector3d turn_rad = rotation_between(from, to);
    ASSERT_NEAR((turn_rad - expected.angle() * expected.axis()).norm(), 0, 1e-6)
        << turn_rad.transpose() << " of " << expected.angle() << " rad";
    ASSERT_LE(turn_rad.norm(), kPi + 1e-12);
    ASSERT_LT((turned_by(turn_rad) * from).angularDistance(to), 1e-7) << "it leads from one to the other";
  }
}

TEST(RotationBetween, IsExactNextToNothing) {
  Any any;
  for (double angle_rad = 1e-14; angle_rad < 1; angle_rad *= 3) {
    const Vector3d turn_rad = angle_rad * any.direction();
    const Vector3d found_rad = rotation_between(Quaterniond::Identity(), turned_by(turn_rad));
    ASSERT_LT((found_rad - turn_rad).norm(), 1e-9 * angle_rad) << angle_rad;
  }
  EXPECT_EQ(rotation_between(Quaterniond::Identity(), Quaterniond::Identity()), Vector3d::Zero());
}

TEST(RotationBetween, TakesTheShorterArcUpToHalfATurn) {
  Any any;
  for (const double angle_rad : {kPi - 1e-3, kPi - 1e-6, kPi - 1e-9}) {
    const Vector3d axis = any.direction();
    EXPECT_LT(
        (rotation_between(Quaterniond::Identity(), turned_by(angle_rad * axis)) - angle_rad * axis).norm(),
        1e-12);
    // A little more one way is a little less the other way.
    const double longer_rad = 2 * kPi - angle_rad;
    EXPECT_LT(
        (rotation_between(Quaterniond::Identity(), turned_by(longer_rad * axis)) + angle_rad * axis).norm(),
        1e-12);
  }
  const Vector3d half = rotation_between(Quaterniond::Identity(), Quaterniond(0, 0.6, 0, -0.8));
  EXPECT_NEAR(half.norm(), kPi, 1e-12);
  EXPECT_NEAR(half.cross(Vector3d(0.6, 0, -0.8)).norm(), 0, 1e-12);
}

TEST(RotationBetween, DoesNotCareForTheSignOfAQuaternion) {
  Any any;
  for (int n = 0; n < 100; ++n) {
    const Quaterniond from = any.orientation(), to = any.orientation();
    const Quaterniond opposite(-to.w(), -to.x(), -to.y(), -to.z());
    EXPECT_LT((rotation_between(from, to) - rotation_between(from, opposite)).norm(), 1e-12);
  }
}

TEST(CartesianSpring, PullsTheTipToItsSetPointAndTurnsItThere) {
  const CartesianSpring spring(kFree);
  Eigen::Isometry3d X_WT = Eigen::Isometry3d::Identity();
  X_WT.translation() = Vector3d(0.1, 0.2, 0.3);
  X_WT.linear() = turned_by({0, 0, 0.5}).toRotationMatrix();
  const auto output = spring.wrench({200, 8}, rest_at({0.2, 0.2, 0.25}, turned_by({0, 0, 0.75})), X_WT,
                                    Wrench::Zero(), kBody);
  EXPECT_TRUE(output.wrench_W.isApprox((Wrench() << 20, 0, -10, 0, 0, 2).finished(), 1e-12))
      << output.wrench_W.transpose();
  EXPECT_TRUE(output.spring_W_N.isApprox(Vector3d(20, 0, -10), 1e-12));
  EXPECT_FALSE(output.limited);
}

TEST(CartesianSpring, ItsMomentIsGivenInWHoweverTheTipIsTurned) {
  const CartesianSpring spring(kFree);
  Any any;
  for (int n = 0; n < 100; ++n) {
    const Quaterniond at = any.orientation();
    const Vector3d turn_W_rad = any.vector(1);
    Eigen::Isometry3d X_WT = Eigen::Isometry3d::Identity();
    X_WT.linear() = at.toRotationMatrix();
    const auto output = spring.wrench({100, 3}, rest_at(Vector3d::Zero(), turned_by(turn_W_rad) * at), X_WT,
                                      Wrench::Zero(), kBody);
    EXPECT_LT((output.wrench_W.tail<3>() - 3 * turn_W_rad).norm(), 1e-9);
    EXPECT_LT(output.wrench_W.head<3>().norm(), 1e-12);
  }
}

TEST(CartesianSpring, DampsAsAMassOnThatSpringNeedsIt) {
  const CartesianSpring spring(kFree);
  const Wrench velocity = (Wrench() << 0.1, -0.2, 0.3, 1, 0, -2).finished();
  const auto output = spring.wrench({400, 16}, {}, Eigen::Isometry3d::Identity(), velocity, kBody);
  // 2ζ·√(k·m) = 40 N·s/m, 2ζ·√(κ·J) = 2 N·m·s/rad.
  EXPECT_TRUE(output.wrench_W.isApprox((Wrench() << -4, 8, -12, -2, 0, 4).finished(), 1e-12))
      << output.wrench_W.transpose();
  EXPECT_EQ(output.spring_W_N, Vector3d::Zero()) << "the damper is no part of it";
}

TEST(CartesianSpring, ATipThatGoesAlongWithItsSetPointIsNotHeldBack) {
  const CartesianSpring spring(kFree);
  const auto output = spring.wrench({400, 16}, {{}, {0.1, -0.2, 0.3}}, Eigen::Isometry3d::Identity(),
                                    (Wrench() << 0.1, -0.2, 0.3, 0, 0, 0).finished(), kBody);
  EXPECT_LT(output.wrench_W.norm(), 1e-12);
}

TEST(CartesianSpring, AMassOnItOvershootsAsItsDampingRatioSays) {
  // A free mass let go off the set-point: with ζ = 0.5 the first overshoot is exp(−π·ζ/√(1−ζ²)) = 16.3 %.
  const CartesianSpring spring(kFree);
  Eigen::Isometry3d X_WT = Eigen::Isometry3d::Identity();
  X_WT.translation().x() = 0.1;
  double v_m_per_s = 0, lowest_m = 1;
  for (int n = 0; n < 40'000; ++n) {
    const Wrench velocity = (Wrench() << v_m_per_s, 0, 0, 0, 0, 0).finished();
    v_m_per_s += 2e-5 / 4 * spring.wrench({400, 0}, {}, X_WT, velocity, kBody).wrench_W[0];
    X_WT.translation().x() += 2e-5 * v_m_per_s;
    lowest_m = std::min(lowest_m, X_WT.translation().x());
  }
  EXPECT_NEAR(lowest_m, -0.1 * std::exp(-kPi * 0.5 / std::sqrt(0.75)), 1e-5);
}

TEST(CartesianSpring, EveryDirectionHasTheDampingRatioWhateverItsApparentMass) {
  // 1 and 9 kg along two directions in the plane, 4 kg along the third. Each is let go off the set-point and
  // must overshoot by exp(−π·ζ/√(1−ζ²)) = 16.3 %.
  const CartesianSpring spring(kFree);
  const Eigen::Matrix3d turned = turned_by({0.3, -0.2, 0.6}).toRotationMatrix();
  const Vector3d masses_kg(1, 9, 4);
  Mobility mobility_W = kBody;
  mobility_W.topLeftCorner<3, 3>() = turned * masses_kg.cwiseInverse().asDiagonal() * turned.transpose();
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d direction = turned.col(axis);
    Eigen::Isometry3d X_WT = Eigen::Isometry3d::Identity();
    X_WT.translation() = 0.1 * direction;
    Wrench velocity_W = Wrench::Zero();
    double lowest_m = 1;
    for (int n = 0; n < 40'000; ++n) {
      const Wrench wrench_W = spring.wrench({400, 0}, {}, X_WT, velocity_W, mobility_W).wrench_W;
      velocity_W.head<3>() += 2e-5 * mobility_W.topLeftCorner<3, 3>() * wrench_W.head<3>();
      X_WT.translation() += 2e-5 * velocity_W.head<3>();
      lowest_m = std::min(lowest_m, X_WT.translation().dot(direction));
    }
    EXPECT_NEAR(lowest_m, -0.1 * std::exp(-kPi * 0.5 / std::sqrt(0.75)), 2e-5) << masses_kg[axis] << " kg";
    EXPECT_NEAR((X_WT.translation() - X_WT.translation().dot(direction) * direction).norm(), 0, 1e-12);
  }
}

TEST(CartesianSpring, ADirectionThatCannotMoveHasABoundedDamping) {
  const CartesianSpring spring(kFree);
  Mobility mobility_W = kBody;
  mobility_W.col(2).setZero();
  mobility_W.row(2).setZero();
  mobility_W(4, 4) = -1e-12;  // rounding
  const auto output = spring.wrench({400, 16}, {}, Eigen::Isometry3d::Identity(),
                                    (Wrench() << 0, 0, 1, 0, 1, 0).finished(), mobility_W);
  EXPECT_NEAR(output.wrench_W[2], -std::sqrt(400 * CartesianSpring::kMaxApparentMass_kg), 1e-9);
  EXPECT_NEAR(output.wrench_W[4], -std::sqrt(16 * CartesianSpring::kMaxApparentInertia_kg_m2), 1e-9);
}

TEST(CartesianSpring, LimitsShortenForceAndMomentEachAlongItsDirection) {
  CartesianSpring::Config config = kFree;
  config.force_limit_N = 5;
  config.moment_limit_Nm = 0.5;
  const CartesianSpring spring(config);
  const Eigen::Isometry3d here = Eigen::Isometry3d::Identity();

  const auto both =
      spring.wrench({100, 10}, rest_at({0.3, 0, -0.4}, turned_by({0, 0.1, 0})), here, Wrench::Zero(), kBody);
  EXPECT_TRUE(both.wrench_W.isApprox((Wrench() << 3, 0, -4, 0, 0.5, 0).finished(), 1e-12));
  EXPECT_TRUE(both.limited);
  EXPECT_TRUE(both.spring_W_N.isApprox(Vector3d(30, 0, -40), 1e-12))
      << "the spring's force is reported without the limit";

  const auto moment =
      spring.wrench({100, 10}, rest_at({0.03, 0, 0}, turned_by({0, 0.3, 0})), here, Wrench::Zero(), kBody);
  EXPECT_TRUE(moment.wrench_W.isApprox((Wrench() << 3, 0, 0, 0, 0.5, 0).finished(), 1e-12));
  EXPECT_TRUE(moment.limited);

  const auto neither =
      spring.wrench({100, 10}, rest_at({0.04, 0, 0}, turned_by({0, 0.04, 0})), here, Wrench::Zero(), kBody);
  EXPECT_TRUE(neither.wrench_W.isApprox((Wrench() << 4, 0, 0, 0, 0.4, 0).finished(), 1e-12));
  EXPECT_FALSE(neither.limited);
}

TEST(CartesianSpring, WithoutStiffnessThereIsNeitherSpringNorDamper) {
  const auto output = CartesianSpring(kFree).wrench({0, 0}, rest_at({1, 2, 3}, turned_by({1, 0, 0})),
                                                    Eigen::Isometry3d::Identity(), Wrench::Ones(), kBody);
  EXPECT_EQ(output.wrench_W, Wrench::Zero());
}

TEST(CartesianSpring, RefusesWhatIsNotPositiveByName) {
  for (const double bad :
       {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    for (const auto& [name, member] :
         {std::pair{"damping_ratio", &CartesianSpring::Config::damping_ratio},
          std::pair{"force_limit_N", &CartesianSpring::Config::force_limit_N},
          std::pair{"moment_limit_Nm", &CartesianSpring::Config::moment_limit_Nm}}) {
      CartesianSpring::Config config;
      config.*member = bad;
      try {
        const CartesianSpring spring(config);
        FAIL() << name << " = " << bad;
      } catch (const std::invalid_argument& error) {
        EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
      }
    }
}

TEST(CartesianSpring, DoesNotAllocateOrLock) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc";
  const CartesianSpring spring(kFree);
  const support::NoAllocGuard guard;
  const auto output = spring.wrench({700, 30}, rest_at({1, 0, 0}, Quaterniond::Identity()),
                                    Eigen::Isometry3d::Identity(), Wrench::Ones(), kBody);
  EXPECT_EQ(guard.violations(), 0);
  EXPECT_NE(output.wrench_W[0], 0);
}

}  // namespace cartesian_stiffness_test
