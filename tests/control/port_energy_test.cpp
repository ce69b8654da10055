// The energy at a haptic device's port, and the spring that holds a handle: closed forms.
#include "control/port_energy.h"

#include <gtest/gtest.h>

#include "control/point_spring.h"

namespace port_energy_test {

using control::PointSpring;
using control::PortEnergy;
using Eigen::Vector3d;

TEST(PortEnergy, IsForceTimesWayWithTheForceHeldBetweenSamples) {
  PortEnergy energy;
  energy.update({0, 0, 0}, {2, 0, 0});
  EXPECT_EQ(energy.energy_J(), 0.0);
  energy.update({0.5, 3, 0}, {0, -1, 4});
  EXPECT_DOUBLE_EQ(energy.energy_J(), 1.0) << "the force before the way counts, not the one after";
  energy.update({0.5, 5, 1}, {100, 100, 100});
  EXPECT_DOUBLE_EQ(energy.energy_J(), 1.0 - 2.0 + 4.0);
}

TEST(PortEnergy, TheFirstSampleIsNoWay) {
  PortEnergy energy;
  energy.update({7, 7, 7}, {1, 1, 1});
  EXPECT_EQ(energy.energy_J(), 0.0);
}

TEST(PointSpring, PullsToThePointAndBrakes) {
  const PointSpring spring{.stiffness_N_per_m = 200, .damping_N_s_per_m = 3};
  const Vector3d f = spring.force_N({0.01, 0, 0}, {0, 0.02, 0}, {0, 0, 0.5});
  EXPECT_TRUE(f.isApprox(Vector3d(2, -4, -1.5), 1e-12)) << f.transpose();
}

TEST(PointSpring, HeldFromSampleToSampleItGivesHalfAPeriodsWayAsEnergy) {
  // Moved at constant speed past the point and back to where it was, a sampled spring gives k v T per way
  // (Colgate): each held force is half a step old, so the energy is k/2 (v T) times the whole way.
  const PointSpring spring{.stiffness_N_per_m = 500, .damping_N_s_per_m = 0};
  PortEnergy energy;
  constexpr double kStep_m = 1e-4;
  constexpr int kSteps = 300;
  double p = 0;
  for (int i = 0; i <= 2 * kSteps; ++i) {
    const Vector3d at(p, 0, 0);
    energy.update(at, spring.force_N(Vector3d::Zero(), at, Vector3d::Zero()));
    p += i < kSteps ? kStep_m : -kStep_m;
  }
  const double way_m = 2 * kSteps * kStep_m;
  EXPECT_NEAR(energy.energy_J(), 0.5 * 500 * kStep_m * way_m, 1e-12);
}

}  // namespace port_energy_test
