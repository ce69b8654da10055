// The thesis' force on the hand (3.4.5: divided by k_f = 10, z reversed), and the energy that its spring
// stores.
#include "control/force_feedback.h"

#include <gtest/gtest.h>

#include "control/haptic_mapping.h"
#include "control/master_frame.h"

namespace force_feedback_test {

using control::ForceFeedback;
using Eigen::Vector3d;

TEST(ForceFeedback, HasTheThesisSignsAndScale) {
  const ForceFeedback feedback{.force_scale = 10, .force_limit_N = 8};
  EXPECT_TRUE(feedback.force_H_N({10, 20, 30}).isApprox(Vector3d(1, 2, -3), 1e-15));
  EXPECT_EQ(feedback.force_H_N(Vector3d::Zero()), Vector3d::Zero());
}

TEST(ForceFeedback, PullsTheGripToWhereTheTipIs) {
  // The hand leads the end effector in each direction in turn: the spring pulls the end effector forward, and
  // the hand back.
  const ForceFeedback feedback{.force_scale = 10, .force_limit_N = 8};
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {-1.0, 1.0}) {
      const Vector3d hand_ahead_H_m = sign * 0.01 * Vector3d::Unit(axis);
      const Vector3d spring_W_N = 700 * control::turned_H_W(hand_ahead_H_m);
      EXPECT_TRUE(feedback.force_H_N(spring_W_N).isApprox(-70 * hand_ahead_H_m, 1e-12));
    }
}

TEST(ForceFeedback, LimitKeepsDirection) {
  const ForceFeedback feedback{.force_scale = 2, .force_limit_N = 5};
  EXPECT_TRUE(feedback.force_H_N({6, 0, -8}).isApprox(Vector3d(3, 0, 4), 1e-12)) << "at the limit";
  EXPECT_TRUE(feedback.force_H_N({600, 0, -800}).isApprox(Vector3d(3, 0, 4), 1e-12));
  EXPECT_TRUE(feedback.force_H_N({3, 0, -4}).isApprox(Vector3d(1.5, 0, 2), 1e-12));
}

TEST(ForceFeedback, WhatIsStoredIsTheForceOverTheWayOfTheHand) {
  constexpr double kStiffness_N_per_m = 700;
  for (const double motion_scale : {0.5, 1.0, 2.0})
    for (const double force_limit_N : {2.0, 8.0}) {
      const ForceFeedback feedback{.force_scale = 10, .force_limit_N = force_limit_N};
      // The hand yields to the force, and the end effector's set-point follows the hand, from slack outwards.
      constexpr int kSteps = 20'000;
      constexpr double kStretch_m = 0.25;
      double energy_J = 0;
      for (int n = 0; n < kSteps; ++n) {
        const double middle_m = (n + 0.5) / kSteps * kStretch_m;
        energy_J += feedback.force_H_N({0, kStiffness_N_per_m * middle_m, 0}).norm() * kStretch_m / kSteps /
                    motion_scale;
        const double stretch_m = (n + 1.0) / kSteps * kStretch_m;
        if (n % 1000 == 999) {
          ASSERT_NEAR(feedback.stored_J(stretch_m, kStiffness_N_per_m, motion_scale), energy_J,
                      1e-6 * energy_J)
              << stretch_m;
        }
      }
    }
}

TEST(ForceFeedback, WithoutStretchOrStiffnessNothingIsStored) {
  const ForceFeedback feedback;
  EXPECT_EQ(feedback.stored_J(0, 700, 1), 0);
  EXPECT_EQ(feedback.stored_J(0.1, 0, 1), 0);
}

}  // namespace force_feedback_test
