// From the handle to the end effector: signs, scale, index, and rate control against the thesis' own
// equations (3.4.3).
#include "control/haptic_mapping.h"
#include "control/master_frame.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>

#include "tests/support/no_alloc_guard.h"

namespace haptic_mapping_test {

using control::Grip;
using control::HapticMapping;
using control::TipPose;
using control::turned_H_W;
using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;
constexpr double kPeriod_s = 1e-3;
const Vector3d kCentre_m(-0.08, 0, 0.008);

HapticMapping::Config config_with(double rate_speed_m_per_s) {
  HapticMapping::Config config;
  config.period_s = kPeriod_s;
  config.rate_speed_m_per_s = rate_speed_m_per_s;
  config.leash_m = 0.05;
  return config;
}
HapticMapping::Config rate_only() {
  HapticMapping::Config config = config_with(0.1);
  config.rate_only = true;
  config.rest_deflection_m = 0.005;
  config.full_deflection_m = 0.050;
  config.rest_turn_rad = 0.05;
  config.full_turn_rad = 0.50;
  config.rate_turn_rad_per_s = 0.2;
  return config;
}

Grip at(const Vector3d& p_HD_m) { return {.p_HD_m = p_HD_m}; }
Grip turned(const Quaterniond& q_HD) { return {.q_HD = q_HD}; }
Quaterniond about(const Vector3d& axis, double angle_rad) {
  return Quaterniond(AngleAxisd(angle_rad, axis.normalized()));
}
const TipPose kStart{.p_WT_m = {0.35, 0, 0.35}, .q_WT = about({0, 1, 0}, 2.1)};

/// With the end effector always at its set-point.
const TipPose& step(HapticMapping& mapping, const Grip& grip) { return mapping.step(grip, mapping.target()); }

/// A little longer than a master of speeds has to be before it drives.
void rest(HapticMapping& mapping) {
  for (int n = 0; n < 210; ++n) step(mapping, at({0.004, 0, 0}));  // at rest, within the resolution
}

TEST(HapticMapping, TheTipGoesWhereTheOperatorsHandGoesAsHeSeesIt) {
  HapticMapping mapping(config_with(0.1));
  mapping.index(at(Vector3d::Zero()), kStart);
  const auto way_m = [&](const Vector3d& p_HD_m) {
    return Vector3d(step(mapping, at(p_HD_m)).p_WT_m - kStart.p_WT_m);
  };
  EXPECT_LT((way_m({-0.01, 0, 0}) - Vector3d(0.01, 0, 0)).norm(), 1e-15) << "away from him is forward";
  EXPECT_LT((way_m({0, 0.01, 0}) - Vector3d(0, -0.01, 0)).norm(), 1e-15) << "to his right is not left";
  EXPECT_LT((way_m({0, 0, 0.01}) - Vector3d(0, 0, 0.01)).norm(), 1e-15) << "up is up";
}

TEST(HapticMapping, ScalesTheWay) {
  HapticMapping::Config config = config_with(0.1);
  config.motion_scale = 2.5;
  HapticMapping mapping(config);
  mapping.index(at({-0.01, 0.02, 0.01}), kStart);
  EXPECT_LT((step(mapping, at({-0.03, 0.02, 0.02})).p_WT_m - kStart.p_WT_m - Vector3d(0.05, 0, 0.025)).norm(),
            1e-15);
}

TEST(HapticMapping, TheTipTurnsAboutTheAxisTheOperatorSeesThePenTurnAbout) {
  // For any orientation of handle and end effector at the index: a rotation about an axis of H turns the end
  // effector about that axis, as seen from W.
  const Quaterniond pen = about({1, 2, 3}, 0.7);
  for (const Vector3d& axis_H :
       {Vector3d(1, 0, 0), Vector3d(0, 1, 0), Vector3d(0, 0, 1), Vector3d(1, -2, 0.5)}) {
    HapticMapping mapping(config_with(0.1));
    mapping.index(turned(pen), kStart);
    const Vector3d axis_W(-axis_H.x(), -axis_H.y(), axis_H.z());
    const TipPose& target = step(mapping, turned(about(axis_H, 0.4) * pen));
    EXPECT_LT(target.q_WT.angularDistance(about(axis_W, 0.4) * kStart.q_WT), 1e-12);
    EXPECT_EQ(target.p_WT_m, kStart.p_WT_m);
  }
}

TEST(HapticMapping, RotationsAndVectorsTurnTheSameWay) {
  const Quaterniond q = about({0.3, -1, 2}, 1.1);
  const Vector3d v(0.4, 0.5, -0.6);
  EXPECT_LT((turned_H_W(q) * turned_H_W(v) - turned_H_W(Vector3d(q * v))).norm(), 1e-15);
  EXPECT_EQ(turned_H_W(turned_H_W(v)), v) << "either way";
}

TEST(HapticMapping, WithoutRotationTheTipKeepsItsOrientation) {
  HapticMapping::Config config = config_with(0.1);
  config.follow_rotation = false;
  HapticMapping mapping(config);
  mapping.index(at(Vector3d::Zero()), kStart);
  EXPECT_EQ(step(mapping, turned(about({1, 1, 0}, 1))).q_WT.coeffs(), kStart.q_WT.coeffs());
}

TEST(HapticMapping, AnIndexMakesNoJumpWhereverTheGripIs) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-1, 1);
  const auto vector = [&](double size) {
    return Vector3d(Vector3d::NullaryExpr([&] { return size * any(random); }));
  };
  for (const HapticMapping::Config& config : {config_with(0.1), rate_only()}) {
    HapticMapping mapping(config);
    for (int n = 0; n < 1000; ++n) {
      const Grip grip{.p_HD_m = vector(0.2), .q_HD = about(vector(1), kPi * any(random))};
      const TipPose here{.p_WT_m = vector(1), .q_WT = about(vector(1), kPi * any(random))};
      mapping.index(grip, here);
      const TipPose& target = step(mapping, grip);
      ASSERT_LE((target.p_WT_m - here.p_WT_m).norm(), 0.1 * kPeriod_s + 1e-12);
      ASSERT_LE(target.q_WT.angularDistance(here.q_WT), 0.2 * kPeriod_s + 1e-7);
    }
  }
}

struct Outside {
  const char* where;
  Vector3d p_HD_m;
};
class RateControl : public testing::TestWithParam<Outside> {};

TEST_P(RateControl, MovesTheTargetAtItsSpeedAlongTheGripsDirectionFromTheOrigin) {
  HapticMapping mapping(config_with(0.2));
  mapping.index(at(Vector3d::Zero()), kStart);
  const Vector3d p = GetParam().p_HD_m;
  step(mapping, at(0.1 * p));
  EXPECT_EQ(mapping.mode(), HapticMapping::Mode::kPosition);
  const Vector3d before_m = mapping.target().p_WT_m;
  for (int n = 0; n < 500; ++n) step(mapping, at(p));
  EXPECT_EQ(mapping.mode(), HapticMapping::Mode::kRate);
  const Vector3d expected_m = before_m + 0.2 * 0.5 * Vector3d(-p.x(), -p.y(), p.z()) / p.norm();
  EXPECT_LT((mapping.target().p_WT_m - expected_m).norm(), 1e-12);
}

INSTANTIATE_TEST_SUITE_P(Outside, RateControl,
                         testing::Values(Outside{"BehindTheSpheroid", {-0.221, 0, 0.008}},
                                         Outside{"RightOfIt", {-0.08 + 1e-3, 0.101, 0}},
                                         Outside{"LeftOfIt", {-0.03, -0.101, 0.008}},
                                         Outside{"AboveIt", {-0.06, 0, 0.109}},
                                         Outside{"BehindThePlaneOfX", {-0.0421, 0.001, 0}},
                                         Outside{"BelowThePlaneOfZ", {0, 0, -0.0661}}),
                         [](const auto& tested) { return tested.param.where; });

TEST(HapticMapping, ChangesToRateControlAtTheThesisBoundaryAndNotBefore) {
  HapticMapping mapping(config_with(0.1));
  const auto mode_at = [&](const Vector3d& p_HD_m) {
    step(mapping, at(p_HD_m));
    return mapping.mode();
  };
  for (const auto& [inside, outside] : {std::pair{Vector3d(-0.0419, 0, 0), Vector3d(-0.0421, 0, 0)},
                                        std::pair{Vector3d(0, 0, -0.0659), Vector3d(0, 0, -0.0661)},
                                        std::pair{Vector3d(0.0599, 0, 0.008), Vector3d(0.0601, 0, 0.008)}}) {
    EXPECT_EQ(mode_at(inside), HapticMapping::Mode::kPosition) << inside.transpose();
    EXPECT_EQ(mode_at(outside), HapticMapping::Mode::kRate) << outside.transpose();
  }
  // On the spheroid in any direction that the planes leave.
  std::mt19937 random(8);
  std::normal_distribution<double> normal;
  int seen = 0;
  for (int n = 0; n < 2000; ++n) {
    const Vector3d u = Vector3d(Vector3d::NullaryExpr([&] { return normal(random); })).normalized();
    const Vector3d to_surface_m(0.14 * u.x(), 0.10 * u.y(), 0.10 * u.z());
    const Vector3d inside = kCentre_m + 0.999 * to_surface_m;
    if (inside.x() <= -0.042 || inside.z() <= -0.066) continue;
    ++seen;
    ASSERT_EQ(mode_at(inside), HapticMapping::Mode::kPosition) << inside.transpose();
    ASSERT_EQ(mode_at(kCentre_m + 1.001 * to_surface_m), HapticMapping::Mode::kRate) << inside.transpose();
  }
  EXPECT_GT(seen, 300);
}

TEST(RateBoundary, ItsRimPushesBackAsTheSlopeOfAPotential) {
  const control::RateBoundary boundary{.rim_N_per_m = 60};
  const auto stored_J = [](const Vector3d& p) {
    const double rho = Vector3d((p - kCentre_m).cwiseQuotient(Vector3d(0.14, 0.1, 0.1))).norm();
    double sum_J = 0;
    for (const double depth_m : {0.1 * (rho - 1), -0.042 - p.x(), -0.066 - p.z()})
      if (depth_m > 0) sum_J += 60 * depth_m * depth_m / 2;
    return sum_J;
  };
  std::mt19937 random(9);
  std::uniform_real_distribution<double> any(-0.12, 0.12);
  int outside = 0;
  for (int n = 0; n < 2000; ++n) {
    const Vector3d p = Vector3d::NullaryExpr([&] { return any(random); });
    const Vector3d force_N = boundary.rim_force_H_N(p);
    EXPECT_EQ(force_N.norm() > 0, !boundary.inside(p)) << p.transpose();
    if (boundary.inside(p)) continue;
    ++outside;
    constexpr double kStep_m = 1e-6;
    for (int i = 0; i < 3; ++i) {
      const Vector3d way_m = kStep_m * Vector3d::Unit(i);
      EXPECT_NEAR(force_N[i], (stored_J(p - way_m) - stored_J(p + way_m)) / (2 * kStep_m), 1e-4)
          << p.transpose();
    }
  }
  EXPECT_GT(outside, 500);
  EXPECT_LT(outside, 1900);
}

/// The thesis' drift, old positions and flag, implemented as published. Its stored handle position at the
/// start of rate control is a cycle newer than its stored target.
class ThesisBookkeeping {
 public:
  ThesisBookkeeping(const Vector3d& p_HD_m, const Vector3d& start_W_m, double speed_m_per_s)
      : position_(start_W_m), drift_(start_W_m - mirrored(p_HD_m)), step_(speed_m_per_s * kPeriod_s) {}

  Vector3d step(const Vector3d& p_HD_m) {
    const Vector3d h = mirrored(p_HD_m);
    const double modulus = std::sqrt(std::pow((-h.x() + 0.08) / 0.14, 2) + std::pow(-h.y() / 0.1, 2) +
                                     std::pow((h.z() - 0.008) / 0.1, 2));
    const bool outside = modulus >= 1 || h.x() >= 0.042 || h.z() <= -0.066;
    if (outside) {
      if (!rate_control_) {
        position_old_ = position_;
        drift_old_ = drift_;
        h_old_ = h;
        rate_control_ = true;
      }
      position_ += step_ / h.norm() * h;
    } else if (rate_control_) {
      drift_ = (position_ - position_old_) + drift_old_ - (h - h_old_);
      position_ = h + drift_;
      rate_control_ = false;
    } else {
      position_ = h + drift_;
    }
    return position_;
  }

 private:
  static Vector3d mirrored(const Vector3d& p) { return {-p.x(), -p.y(), p.z()}; }

  bool rate_control_ = false;
  Vector3d position_, drift_;
  double step_;
  Vector3d position_old_, drift_old_, h_old_;
};

TEST(HapticMapping, GoesWhereTheThesisBookkeepingGoesOnAnyWayOfTheHand) {
  std::mt19937 random(12);
  std::normal_distribution<double> normal;
  constexpr double kSpeed_m_per_s = 0.3;
  Vector3d p = Vector3d::Zero(), aim = Vector3d::Zero();
  HapticMapping mapping(config_with(kSpeed_m_per_s));
  mapping.index(at(p), kStart);
  ThesisBookkeeping thesis(p, kStart.p_WT_m, kSpeed_m_per_s);
  // With that cycle the thesis makes a jump on return: by the way on which the hand left.
  Vector3d left_W_m = Vector3d::Zero(), jumps_W_m = Vector3d::Zero();
  int changes = 0;
  for (int n = 0; n < 100'000; ++n) {
    if (n % 150 == 0) aim = Vector3d::NullaryExpr([&] { return 0.08 * normal(random); });
    const Vector3d hand_step_m = 0.01 * (aim - p);
    p += hand_step_m;
    const HapticMapping::Mode mode = mapping.mode();
    const Vector3d before_m = mapping.target().p_WT_m;
    const Vector3d target_m = step(mapping, at(p)).p_WT_m;
    if (mapping.mode() != mode) {
      ++changes;
      if (mapping.mode() == HapticMapping::Mode::kRate)
        left_W_m = turned_H_W(hand_step_m);
      else
        jumps_W_m += left_W_m;
    }
    ASSERT_LT((thesis.step(p) - target_m - jumps_W_m).norm(), 1e-9) << "cycle " << n;
    ASSERT_LE((target_m - before_m).norm(), std::max(hand_step_m.norm(), kSpeed_m_per_s * kPeriod_s) + 1e-9)
        << "a jump";
  }
  EXPECT_GT(changes, 200);
}

TEST(HapticMapping, ComingBackMovesNothingAndThenFollowsAgain) {
  HapticMapping::Config config = config_with(0.1);
  config.motion_scale = 2;
  HapticMapping mapping(config);
  mapping.index(at(Vector3d::Zero()), kStart);
  for (int n = 0; n < 100; ++n) step(mapping, at({0, 0, -0.07}));
  const Vector3d there_m = mapping.target().p_WT_m;
  EXPECT_LT((step(mapping, at({0, 0, -0.06})).p_WT_m - there_m).norm(), 1e-15);
  EXPECT_LT((step(mapping, at({0, 0.01, -0.05})).p_WT_m - there_m - Vector3d(0, -0.02, 0.02)).norm(), 1e-12);
}

TEST(HapticMapping, ANewScaleActsFromTheHandlesPositionOn) {
  HapticMapping mapping(config_with(0.1));
  mapping.index(at(Vector3d::Zero()), kStart);
  const Grip grip = at({0, 0.02, -0.03});
  const Vector3d before_m = step(mapping, grip).p_WT_m;
  mapping.set_motion_scale(0.5, grip);
  EXPECT_LT((step(mapping, grip).p_WT_m - before_m).norm(), 1e-15) << "no jump";
  // x and y change sign between H and W.
  EXPECT_LT((step(mapping, at({0.01, 0.02, -0.01})).p_WT_m - before_m - Vector3d(-0.005, 0, 0.01)).norm(),
            1e-12);

  // Outside the boundary, and back inside.
  for (int n = 0; n < 100; ++n) step(mapping, at({0, 0, -0.07}));
  const Vector3d there_m = mapping.target().p_WT_m;
  mapping.set_motion_scale(2, at({0, 0, -0.07}));
  EXPECT_LT((step(mapping, at({0, 0, -0.06})).p_WT_m - there_m).norm(), 1e-15);
  EXPECT_LT((step(mapping, at({0, 0.01, -0.05})).p_WT_m - there_m - Vector3d(0, -0.02, 0.02)).norm(), 1e-12);
}

TEST(HapticMapping, ANewRateSpeedActsFromTheNextStepOn) {
  HapticMapping mapping(config_with(0.1));
  mapping.index(at(Vector3d::Zero()), kStart);
  const Grip outside = at({0, 0, -0.07});
  step(mapping, outside);
  const Vector3d before_m = mapping.target().p_WT_m;
  mapping.set_rate_speed(0.03);
  EXPECT_NEAR((step(mapping, outside).p_WT_m - before_m).norm(), 0.03 * kPeriod_s, 1e-12);
}

TEST(HapticMapping, UnderRateControlTheTargetWaitsForATipThatIsALeashBehind) {
  HapticMapping mapping(config_with(0.1));
  mapping.index(at(Vector3d::Zero()), kStart);
  const Grip down = at({0, 0, -0.07});
  for (int n = 0; n < 5000; ++n) mapping.step(down, kStart);
  const double ahead_m = (mapping.target().p_WT_m - kStart.p_WT_m).norm();
  EXPECT_GT(ahead_m, 0.05);
  EXPECT_LE(ahead_m, 0.05 + 0.1 * kPeriod_s + 1e-12);

  const Vector3d waiting_m = mapping.target().p_WT_m;
  mapping.step(down, {waiting_m + Vector3d(0, 0, 0.02), kStart.q_WT});
  EXPECT_NEAR(waiting_m.z() - mapping.target().p_WT_m.z(), 0.1 * kPeriod_s, 1e-12) << "the tip has caught up";
}

TEST(HapticMapping, BackToATipThatIsFarBehindTheTargetGoesAtOnce) {
  HapticMapping mapping(config_with(0.1));
  mapping.index(at(Vector3d::Zero()), kStart);
  const Vector3d before_m = mapping.target().p_WT_m;
  mapping.step(at({0, 0, -0.07}), {before_m - Vector3d(0, 0, 0.2), kStart.q_WT});
  EXPECT_NEAR(before_m.z() - mapping.target().p_WT_m.z(), 0.1 * kPeriod_s, 1e-12);
}

TEST(HapticMapping, ATipThatIsHeldUpOneWayDoesNotHoldUpTheOthers) {
  HapticMapping mapping(config_with(0.1));
  mapping.index(at(Vector3d::Zero()), kStart);
  const Vector3d tip_m = kStart.p_WT_m - Vector3d(0.2, 0, 0);
  mapping.step(at({0, 0, -0.07}), {tip_m, kStart.q_WT});
  EXPECT_NEAR(kStart.p_WT_m.z() - mapping.target().p_WT_m.z(), 0.1 * kPeriod_s, 1e-12);
}

TEST(HapticMapping, NothingMovesByRateControlThatMayNotDrive) {
  for (const HapticMapping::Config& config : {config_with(0.1), rate_only()}) {
    HapticMapping mapping(config);
    mapping.index(at(Vector3d::Zero()), kStart);
    const Grip outside{.p_HD_m = {0, 0, -0.08}, .q_HD = about({1, 0, 0}, 0.6)};
    for (int n = 0; n < 210; ++n) mapping.step(at(Vector3d::Zero()), kStart, /*may_drive=*/false);
    for (int n = 0; n < 100; ++n) mapping.step(outside, kStart, /*may_drive=*/false);
    EXPECT_EQ(mapping.target().p_WT_m, kStart.p_WT_m);
    mapping.step(outside, kStart);
    EXPECT_LT(mapping.target().p_WT_m.z(), kStart.p_WT_m.z()) << "and then it may";
  }
}

TEST(HapticMapping, AMasterThatReportsOnlySpeedsMovesTheTargetByItsDeflection) {
  for (const auto& [deflection_m, pace] :
       {std::pair{0.004, 0.0}, std::pair{0.0275, 0.5}, std::pair{0.05, 1.0}, std::pair{0.2, 1.0}}) {
    HapticMapping mapping(rate_only());
    mapping.index(at({0.3, 0, 0}), kStart);
    rest(mapping);
    for (int n = 0; n < 1000; ++n) step(mapping, at(deflection_m * Vector3d(-0.6, 0.8, 0)));
    EXPECT_LT((mapping.target().p_WT_m - kStart.p_WT_m - 0.1 * pace * Vector3d(0.6, -0.8, 0)).norm(), 1e-9)
        << deflection_m;
    EXPECT_LT(mapping.target().q_WT.angularDistance(kStart.q_WT), 1e-9);
    EXPECT_EQ(mapping.mode(), pace > 0 ? HapticMapping::Mode::kRate : HapticMapping::Mode::kPosition);
  }
}

TEST(HapticMapping, AMasterThatReportsOnlySpeedsTurnsTheTargetByItsTurn) {
  for (const auto& [turn_rad, pace] :
       {std::pair{0.04, 0.0}, std::pair{0.275, 0.5}, std::pair{0.5, 1.0}, std::pair{2.0, 1.0}})
    for (const Vector3d& axis_H : {Vector3d(1, 0, 0), Vector3d(0, 1, 0), Vector3d(0, 0, -1)}) {
      HapticMapping mapping(rate_only());
      mapping.index(at(Vector3d::Zero()), kStart);
      rest(mapping);
      for (int n = 0; n < 1000; ++n) step(mapping, turned(about(axis_H, turn_rad)));
      const Vector3d axis_W(-axis_H.x(), -axis_H.y(), axis_H.z());
      EXPECT_LT(mapping.target().q_WT.angularDistance(about(axis_W, 0.2 * pace) * kStart.q_WT), 1e-7)
          << turn_rad;
      EXPECT_EQ(mapping.target().p_WT_m, kStart.p_WT_m);
    }
}

TEST(HapticMapping, AMasterThatReportsOnlySpeedsMovesNothingBeforeItWasAtRest) {
  const Grip pushed{.p_HD_m = {-0.05, 0, 0}}, twisted{.q_HD = about({0, 0, 1}, 0.5)};
  for (const Grip& held : {pushed, twisted}) {
    HapticMapping mapping(rate_only());
    mapping.index(held, kStart);
    for (int n = 0; n < 1000; ++n) step(mapping, held);
    EXPECT_EQ(mapping.target().p_WT_m, kStart.p_WT_m);
    EXPECT_EQ(mapping.target().q_WT.coeffs(), kStart.q_WT.coeffs());
    EXPECT_EQ(mapping.mode(), HapticMapping::Mode::kPosition);
    rest(mapping);
    for (int n = 0; n < 1000; ++n) step(mapping, held);
    const bool moved = (mapping.target().p_WT_m - kStart.p_WT_m).norm() > 0.09 ||
                       mapping.target().q_WT.angularDistance(kStart.q_WT) > 0.19;
    EXPECT_TRUE(moved) << "and then it does";
    mapping.index(held, mapping.target());
    const TipPose there = mapping.target();
    for (int n = 0; n < 10; ++n) step(mapping, held);
    EXPECT_EQ(mapping.target().p_WT_m, there.p_WT_m) << "each index starts from zero";
    EXPECT_EQ(mapping.target().q_WT.coeffs(), there.q_WT.coeffs());
  }
}

TEST(HapticMapping, AMasterThatReportsOnlySpeedsIsAtRestForAWhileInFreshSamplesBeforeItDrives) {
  const Grip resting{}, pushed{.p_HD_m = {-0.05, 0, 0}};
  struct Step {
    Grip grip;
    bool fresh;
    int cycles;
  };
  const auto drives_after = [&](std::initializer_list<Step> steps) {
    HapticMapping mapping(rate_only());
    mapping.index(pushed, kStart);
    for (const Step& each : steps)
      for (int n = 0; n < each.cycles; ++n) mapping.step(each.grip, kStart, /*may_drive=*/true, each.fresh);
    mapping.step(pushed, kStart);
    return mapping.target().p_WT_m != kStart.p_WT_m;
  };
  EXPECT_FALSE(drives_after({{resting, true, 1}})) << "it has only passed its middle";
  EXPECT_FALSE(drives_after({{resting, true, 195}}));
  EXPECT_TRUE(drives_after({{resting, true, 205}}));
  EXPECT_FALSE(drives_after({{resting, false, 5000}})) << "one sample, and old";
  EXPECT_FALSE(drives_after({{resting, true, 150}, {pushed, true, 1}, {resting, true, 150}})) << "no rest";
  EXPECT_FALSE(drives_after({{resting, true, 150}, {resting, false, 1}, {resting, true, 150}}))
      << "its motion is unknown";
}

TEST(HapticMapping, TheTurningTargetWaitsForATipThatIsALeashBehind) {
  HapticMapping::Config config = rate_only();
  config.turn_leash_rad = 0.15;
  HapticMapping mapping(config);
  mapping.index(at(Vector3d::Zero()), kStart);
  rest(mapping);
  const Grip left = turned(about({0, 0, 1}, 0.5)), right = turned(about({0, 0, 1}, -0.5));
  const double step_rad = 0.2 * kPeriod_s;
  // More than half a turn, would it go on.
  for (int n = 0; n < 20000; ++n) mapping.step(left, kStart);
  const double ahead_rad = mapping.target().q_WT.angularDistance(kStart.q_WT);
  EXPECT_GT(ahead_rad, 0.15 - 1e-6);
  EXPECT_LE(ahead_rad, 0.15 + step_rad + 1e-6);

  const Quaterniond waiting = mapping.target().q_WT;
  mapping.step(left, {kStart.p_WT_m, about({0, 0, 1}, 0.05) * kStart.q_WT});
  EXPECT_NEAR(mapping.target().q_WT.angularDistance(waiting), step_rad, 1e-6) << "the tip has caught up";
  mapping.step(turned(about({1, 0, 0}, 0.5)), kStart);
  EXPECT_GT(mapping.target().q_WT.angularDistance(waiting), 1.2 * step_rad)
      << "held up one way, not the others";
  const double furthest_rad = mapping.target().q_WT.angularDistance(kStart.q_WT);
  for (int n = 0; n < 100; ++n) mapping.step(right, kStart);
  EXPECT_LT(mapping.target().q_WT.angularDistance(kStart.q_WT), furthest_rad - 50 * step_rad)
      << "back it goes at once";
}

TEST(HapticMapping, RefusesWhatIsOutOfRangeByName) {
  using Config = HapticMapping::Config;
  const auto refusal = [](const Config& config) -> std::string {
    try {
      const HapticMapping mapping(config);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "none";
  };
  EXPECT_EQ(refusal({}), "none");
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()})
    for (const auto& [name, member] :
         {std::pair{"period_s", &Config::period_s}, std::pair{"motion_scale", &Config::motion_scale},
          std::pair{"rate_speed_m_per_s", &Config::rate_speed_m_per_s},
          std::pair{"rate_turn_rad_per_s", &Config::rate_turn_rad_per_s},
          std::pair{"leash_m", &Config::leash_m}, std::pair{"turn_leash_rad", &Config::turn_leash_rad}}) {
      Config config;
      config.*member = bad;
      EXPECT_NE(refusal(config).find(name), std::string::npos) << refusal(config);
    }
  Config config;
  config.turn_leash_rad = kPi;
  EXPECT_NE(refusal(config).find("turn_leash_rad"), std::string::npos);
  config = {};
  config.boundary.half_axes_m.y() = 0;
  EXPECT_NE(refusal(config).find("half axis"), std::string::npos);
  config = {};
  config.full_deflection_m = config.rest_deflection_m;
  EXPECT_NE(refusal(config).find("deflection"), std::string::npos);
  config = {};
  config.rest_turn_rad = -0.1;
  EXPECT_NE(refusal(config), "none");
}

TEST(HapticMapping, RefusesABoundaryThatTheOriginIsNotInside) {
  using Config = HapticMapping::Config;
  Config behind, above, beside;
  behind.boundary.least_x_m = 0.001;
  above.boundary.least_z_m = 0;
  beside.boundary.half_axes_m.x() = 0.08;
  for (const Config& config : {behind, above, beside})
    EXPECT_THROW(HapticMapping{config}, std::invalid_argument);
}

TEST(HapticMapping, DoesNotAllocateOrLock) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc";
  HapticMapping mapping(config_with(0.1)), stick(rate_only());
  const support::NoAllocGuard guard;
  for (HapticMapping* each : {&mapping, &stick}) {
    each->index(at({0, 0, 0}), kStart);
    step(*each, at({0, 0, -0.02}));
    step(*each, at({0, 0, -0.2}));
    step(*each, turned(Quaterniond(0.8, 0.6, 0, 0)));
  }
  EXPECT_EQ(guard.violations(), 0);
}

}  // namespace haptic_mapping_test
