// Covariance of the base's odometry: against errors that are drawn and integrated here, and against slip.
#include "control/odometry_covariance.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>
#include <vector>

#include "control/base_odometry.h"
#include "tests/support/no_alloc_guard.h"

namespace odometry_covariance_test {

using namespace control;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using std::numbers::pi;

constexpr double kStep_m = 0.005;

const LinkMap& map() {
  static const LinkMap kMap = LinkMap::with_geometry({});
  return kMap;
}

/// Displacements of steps that follow each other, each of about kStep_m.
std::vector<PlanarVector> steps_of(const std::vector<PlanarVector>& legs) {
  std::vector<PlanarVector> steps;
  for (const PlanarVector& leg : legs) {
    const double way_m = leg.head<2>().norm() + 0.385 * std::abs(leg[2]);
    const int count = static_cast<int>(std::lround(way_m / kStep_m));
    steps.insert(steps.end(), static_cast<std::size_t>(count), leg / count);
  }
  return steps;
}

Vector3d as_vector(const PlanarPose& pose) { return {pose.x_m, pose.y_m, pose.yaw_rad}; }

struct Driven {
  PlanarPose X_WB;
  Matrix3d covariance_W;
};

Driven driven(const std::vector<PlanarVector>& steps) {
  BaseOdometry odometry(map());
  OdometryCovariance covariance{BaseGeometry{}};
  WheelVector wheels{5, -3, 100, 0.1};
  covariance.step(wheels, odometry.step(wheels));
  for (const PlanarVector& step : steps) {
    wheels += map().wheel_velocity(step);
    covariance.step(wheels, odometry.step(wheels));
  }
  return {odometry.pose(), covariance.pose_W()};
}

/// Second moment of the true pose around that of the odometry: each wheel's contact moves by 1 + e times what
/// it shows, with e of 1 %, correlated over half a metre of way (an Ornstein-Uhlenbeck process).
Matrix3d drawn(const std::vector<PlanarVector>& steps, int draws) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  const Vector3d odometry = as_vector(driven(steps).X_WB);
  Matrix3d moment = Matrix3d::Zero();
  for (int draw = 0; draw < draws; ++draw) {
    Eigen::Vector4d error;
    for (double& e : error) e = 0.01 * normal(random);
    PlanarPose truth;
    for (const PlanarVector& step : steps) {
      const WheelVector shown = map().wheel_velocity(step);
      const double kept = std::exp(-0.0475 * shown.cwiseAbs().maxCoeff() / 0.5);
      for (double& e : error) e = kept * e + 0.01 * std::sqrt(1 - kept * kept) * normal(random);
      truth = moved_by(truth, map().twist(shown.cwiseProduct((1 + error.array()).matrix())));
    }
    const Vector3d apart = as_vector(truth) - odometry;
    moment += apart * apart.transpose() / draws;
  }
  return moment;
}

void expect_covariance(const Matrix3d& covariance, const Matrix3d& expected) {
  const Vector3d scale = expected.diagonal().cwiseSqrt();
  const Matrix3d difference =
      scale.cwiseInverse().asDiagonal() * (covariance - expected) * scale.cwiseInverse().asDiagonal();
  EXPECT_LT(difference.cwiseAbs().maxCoeff(), 0.15) << covariance << "\n\n" << expected;
}

TEST(OdometryCovariance, IsThatOfErrorsThatAreDrawn) {
  // Straight, sideways, an arc, and a square with turns on the spot.
  const std::vector<std::vector<PlanarVector>> paths{
      {{3, 0, 0}},
      {{0, 2, 0}},
      {{3, 0, 1.5 * pi}},
      {{1, 0, 0}, {0, 0, pi / 2}, {1, 0, 0}, {0, 0, pi / 2}, {1, 0, 0}, {0, 0, pi / 2}, {1, 0, 0}}};
  for (const auto& path : paths) {
    const std::vector<PlanarVector> steps = steps_of(path);
    expect_covariance(driven(steps).covariance_W, drawn(steps, 3000));
  }
}

TEST(OdometryCovariance, IsTheSameInFewAndManySteps) {
  std::vector<PlanarVector> fine;
  for (const PlanarVector& step : steps_of({{2, 0.5, 1}})) fine.insert(fine.end(), 5, step / 5);
  expect_covariance(driven(steps_of({{2, 0.5, 1}})).covariance_W, driven(fine).covariance_W);
}

TEST(OdometryCovariance, DoesNotGrowAtRestOrByWheelsThatGiveWay) {
  OdometryCovariance covariance{BaseGeometry{}};
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> count(-6e-5, 6e-5);
  for (int i = 0; i < 100'000; ++i) {
    // A grip of 10 N bends gears and rollers to and fro by a tenth of a millimetre.
    const double give_rad = 0.1e-3 / 0.0475 * std::sin(0.01 * i);
    covariance.step(WheelVector(count(random) + give_rad, count(random), count(random), count(random)), {});
  }
  EXPECT_EQ(covariance.slipped_m(), 0);
  EXPECT_EQ(covariance.pose_W(), Matrix3d::Zero());
  // A wheel's speed at rest is known to 1 mm/s, so the base's to half of that.
  EXPECT_NEAR(std::sqrt(covariance.twist_B(1.0)(0, 0)), 0.5e-3, 0.1e-3);
}

// One wheel spins on the spot: the odometry believes in a quarter of its way along x, y and yaw.
TEST(OdometryCovariance, CoversAWheelThatSpins) {
  BaseOdometry odometry(map());
  OdometryCovariance covariance{BaseGeometry{}};
  WheelVector wheels = WheelVector::Zero();
  covariance.step(wheels, odometry.step(wheels));
  for (int i = 0; i < 100; ++i) {
    wheels[1] += 0.2 / 100 / 0.0475;  // on the spot
    covariance.step(wheels, odometry.step(wheels));
  }
  EXPECT_NEAR(covariance.slipped_m(), 0.1, 0.001) << "half of 0.2 m in each wheel";
  const Vector3d error = as_vector(odometry.pose());
  EXPECT_GT(error.x(), 0.045);
  const Matrix3d pose = covariance.pose_W();
  EXPECT_LT(error.dot(pose.ldlt().solve(error)), 7.8) << "95 % of three freedoms";
  EXPECT_LT(std::sqrt(pose(0, 0)), 2 * error.x());
}

TEST(OdometryCovariance, OfAMirroredMotionIsTheMirroredOne) {
  // Turns on the spot, to the left and to the right, while one wheel slips by a tenth of its way.
  const auto turned = [](double sign) {
    BaseOdometry odometry(map());
    OdometryCovariance covariance{BaseGeometry{}};
    WheelVector wheels = WheelVector::Zero();
    covariance.step(wheels, odometry.step(wheels));
    for (int i = 0; i < 400; ++i) {
      wheels += sign * map().wheel_velocity({0, 0, 0.01});
      wheels[0] += sign * 0.1 * map().wheel_velocity({0, 0, 0.01})[0];
      covariance.step(wheels, odometry.step(wheels));
    }
    return covariance.pose_W();
  };
  const Matrix3d left = turned(1), right = turned(-1);
  EXPECT_NEAR(left(2, 2), right(2, 2), 1e-9 * left(2, 2));
  EXPECT_GT(std::sqrt(left(2, 2)), 0.02);
}

TEST(OdometryCovariance, BeginsAgainAfterAReset) {
  OdometryCovariance covariance{BaseGeometry{}};
  covariance.step(WheelVector::Zero(), {});
  covariance.step(WheelVector::Constant(1), {0, 0, 0.1});
  EXPECT_GT(covariance.pose_W()(2, 2), 0);
  covariance.reset();
  EXPECT_EQ(covariance.pose_W(), Matrix3d::Zero());
  covariance.step(WheelVector::Constant(50), {7, 7, 7});
  EXPECT_EQ(covariance.pose_W(), Matrix3d::Zero());
}

TEST(OdometryCovariance, IgnoresWhatIsNotANumber) {
  OdometryCovariance covariance{BaseGeometry{}};
  covariance.step(WheelVector::Zero(), {});
  covariance.step(WheelVector::Constant(std::nan("")), {});
  covariance.step(WheelVector::Zero(), {std::nan(""), 0, 0});
  covariance.step(WheelVector::Constant(1), {0, 0, 0.12});
  EXPECT_GT(covariance.pose_W()(2, 2), 0);
  EXPECT_TRUE(covariance.pose_W().allFinite());
}

TEST(OdometryCovariance, RefusesWhatIsNotPositive) {
  EXPECT_THROW(OdometryCovariance({}, {.share = 0}), std::invalid_argument);
  EXPECT_THROW(OdometryCovariance({}, {.correlation_m = std::nan("")}), std::invalid_argument);
  EXPECT_THROW(OdometryCovariance({}, {.give_m = -1}), std::invalid_argument);
  EXPECT_THROW(OdometryCovariance(BaseGeometry{.wheel_radius_m = 0}), std::invalid_argument);
}

TEST(OdometryCovariance, StepDoesNotAllocateOrLock) {
  OdometryCovariance covariance{BaseGeometry{}};
  double sum = 0;
  long violations = 0;
  {
    const support::NoAllocGuard guard;
    for (int i = 0; i < 100; ++i) {
      covariance.step(WheelVector::Constant(0.1 * i), {0, 0, 0.01 * i});
      sum += covariance.twist_B(0.001)(2, 2);
    }
    violations = guard.violations();
  }
  EXPECT_EQ(violations, 0);
  EXPECT_GT(sum, 0);
}

}  // namespace odometry_covariance_test
