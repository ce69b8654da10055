// Teleoperation of the simulated robot by a simulated hand, in virtual time: each requirement of the source
// thesis' chapter 3, and each hazard.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <span>
#include <utility>

#include "tests/operation/teleop_expectations.h"
#include "tests/operation/teleop_rig.h"
#include "tests/support/no_alloc_guard.h"

namespace teleoperation_test {

using namespace std::chrono_literals;
using control::TeleopEnd;
using control::TeleopPhase;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using teleop_rig::expect_no_jump;
using teleop_rig::expect_passive;
using teleop_rig::in_phase;
using teleop_rig::kReserve_J;
using teleop_rig::kStep_m;
using teleop_rig::kThreshold_m;
using teleop_rig::largest_port_energy_J;
using teleop_rig::Rig;
using teleop_rig::rotation;
using teleop_rig::Scene;
using teleop_rig::TeleopCycle;
using teleop_rig::TeleopRecord;
using teleop_rig::vector;

double contact_N(const TeleopRecord& r) { return vector(r.contact_force_W_N).norm(); }

// --- Start-up and stop (thesis 3.4.4) ---

TEST(Teleoperation, StartsUpInTheOrderOfTheThesis) {
  Rig rig(teleop_rig::config(), Scene{});
  ASSERT_TRUE(rig.run_until(TeleopPhase::kOperating)) << control::name(rig.cycle.task().phase());
  std::vector<TeleopPhase> order;
  for (const TeleopRecord& r : rig.records)
    if (order.empty() || order.back() != r.phase) order.push_back(r.phase);
  EXPECT_EQ(order, (std::vector{TeleopPhase::kCentring, TeleopPhase::kUnfolding, TeleopPhase::kApproaching,
                                TeleopPhase::kStiffening, TeleopPhase::kOperating}));

  // Unfolded to 169, 65, -146, 102.5 and 167.5 degrees, within the two that are asked for.
  const TeleopRecord& unfolded = in_phase(rig, TeleopPhase::kUnfolding).back();
  const std::array<double, 5> pose_deg{169, 65, -146, 102.5, 167.5};
  for (std::size_t i = 0; i < 5; ++i)
    EXPECT_NEAR(unfolded.position_rad[4 + i] * 180 / std::numbers::pi, pose_deg[i], 2.0) << "arm " << i + 1;

  // In front of the robot, softly, with a slack spring, before the hand has any say.
  for (const TeleopRecord& r : in_phase(rig, TeleopPhase::kApproaching)) {
    EXPECT_EQ(r.stiffness_N_per_m, 100);
    EXPECT_EQ(vector(r.held_force_H_N).norm() > 0.05, false) << "the pen lies centred";
  }
  const TeleopRecord& mapped = in_phase(rig, TeleopPhase::kStiffening).front();
  EXPECT_TRUE(vector(mapped.setpoint_p_WT_m).isApprox(Vector3d(0.35, 0, 0.35), 0.03))
      << vector(mapped.setpoint_p_WT_m).transpose();
  EXPECT_LT((vector(mapped.true_tip_p_WT_m) - Vector3d(0.35, 0, 0.35)).norm(), 0.015);
  EXPECT_LT(vector(mapped.spring_W_N).norm(), 0.1 + 0.05);
  expect_passive(rig);
}

TEST(Teleoperation, BecomesStiffByATenthOfANewtonPerMetreEachMillisecond) {
  Rig rig(teleop_rig::config(), teleop_rig::unfolded_scene());
  ASSERT_TRUE(rig.run_until(TeleopPhase::kOperating));
  const auto stiffening = in_phase(rig, TeleopPhase::kStiffening);
  ASSERT_NEAR(static_cast<double>(stiffening.size()), 6000, 2);  // 100 to 700 N/m
  for (std::size_t i = 1; i < stiffening.size(); ++i)
    EXPECT_NEAR(stiffening[i].stiffness_N_per_m - stiffening[i - 1].stiffness_N_per_m, 0.1, 1e-9);
  EXPECT_NEAR(rig.last().stiffness_N_per_m, 700, 0.11);
}

TEST(Teleoperation, TheMasterIsHeldByItsCentringSpringAloneUntilTipAndGripAreMapped) {
  Rig rig;
  rig.hand.hold_at({0.03, -0.02, 0.01});
  rig.run(3s);  // the hand does not give way
  ASSERT_EQ(rig.cycle.task().phase(), TeleopPhase::kCentring);
  const Vector3d p_m = vector(rig.last().grip_p_HD_m);
  EXPECT_LT((vector(rig.last().held_force_H_N) + 40 * p_m).norm(), 0.02) << p_m.transpose();
  for (const TeleopRecord& r : rig.records)  // the arm waits
    EXPECT_NEAR(r.position_rad[5], rig.records.front().position_rad[5], 0.05);

  rig.hand.move_to(Vector3d::Zero(), 500ms);
  ASSERT_TRUE(rig.run_until(TeleopPhase::kStiffening));
  for (const TeleopRecord& r : in_phase(rig, TeleopPhase::kApproaching))
    EXPECT_LT((vector(r.held_force_H_N) + 40 * vector(r.grip_p_HD_m)).norm(), 0.05);
}

TEST(Teleoperation, APenLetGoBeforeTheStartIsBroughtToItsOrigin) {
  Rig rig;
  rig.hand.hold_at({0.04, 0.03, -0.02});
  rig.run(1s);
  rig.hand.let_go();
  ASSERT_TRUE(rig.run_until(TeleopPhase::kUnfolding, 15s));
  EXPECT_LT(vector(rig.last().grip_p_HD_m).norm(), 0.01);
  const Vector3d from_m(0.04, 0.03, -0.02);
  expect_passive(rig, 40 * from_m.squaredNorm() / 2);
}

TEST(Teleoperation, AMasterThatDoesNotComeToItsOriginEndsTheStart) {
  Rig rig;
  rig.hand.hold_at({0.05, 0, 0});
  ASSERT_TRUE(rig.run_until(TeleopPhase::kOff, 30s));
  EXPECT_EQ(rig.cycle.task().end(), TeleopEnd::kNotCentred);
  EXPECT_TRUE(rig.cycle.stop_reason());
  EXPECT_NEAR(std::chrono::duration<double>(rig.cycle.stop_reason().time).count(), 15, 0.1);
  for (const TeleopRecord& r : rig.records)
    EXPECT_NE(r.phase, TeleopPhase::kLowering) << "nothing was lifted";
}

/// At the end effector of the folded arm. The tether also pulls the base back, which the sensors' checks
/// would report first.
std::pair<TeleopCycle::Config, Scene> tethered() {
  std::pair<TeleopCycle::Config, Scene> rig{teleop_rig::quick_config(), {}};
  rig.first.checks_off.add(control::PlausibilityCheck::kOpposedMotion);
  rig.second.environment.spring = sim::TetherSpring{{0.17, 0, 0.57}, 1e4, 50};
  return rig;
}

TEST(Teleoperation, AnArmThatIsHeldUpEndsTheStart) {
  auto [config, scene] = tethered();
  config.control.unfolding_timeout_s = 8;
  config.control.joint_following_error_rad = 3;
  Rig rig(config, scene);
  ASSERT_TRUE(rig.run_until(TeleopPhase::kOff, 30s)) << control::name(rig.cycle.task().phase());
  EXPECT_EQ(rig.cycle.task().end(), TeleopEnd::kNotUnfolded);
}

TEST(Teleoperation, AJointThatFallsBehindWhileItUnfoldsStopsTheArmAndIsNamed) {
  const auto [config, scene] = tethered();
  Rig rig(config, scene);
  ASSERT_TRUE(rig.run_until(TeleopPhase::kStopping, 30s));
  EXPECT_EQ(rig.cycle.task().end(), TeleopEnd::kJointBehind);
  // Which is furthest, by the last commands and what the joints did.
  std::size_t furthest = 4;
  const auto off_rad = [&](std::size_t joint) {
    const TeleopRecord& r = rig.records[rig.records.size() - 2];
    return std::abs(r.command[joint] - r.position_rad[joint]);
  };
  for (std::size_t i = 5; i < 9; ++i)
    if (off_rad(i) > off_rad(furthest)) furthest = i;
  EXPECT_GT(off_rad(furthest), 0.4);
  const std::string text = describe(rig.cycle.stop_reason(), rig.robot, &rig.master);
  EXPECT_NE(text.find(": arm-" + std::to_string(furthest - 3) + " was 0."), std::string::npos) << text;
  EXPECT_NE(text.find("(teleoperation.arm.following_error_rad = 0.4)"), std::string::npos) << text;
  EXPECT_TRUE(rig.run_until(TeleopPhase::kOff, 30s)) << "lowered";
}

TEST(Teleoperation, AStopBrakesAndSwitchesOffFromAnyPhase) {
  for (const TeleopPhase phase : {TeleopPhase::kCentring, TeleopPhase::kUnfolding, TeleopPhase::kApproaching,
                                  TeleopPhase::kStiffening, TeleopPhase::kOperating}) {
    SCOPED_TRACE(control::name(phase));
    Rig rig;
    ASSERT_TRUE(rig.run_until(phase)) << control::name(phase);
    rig.run(100ms);
    rig.cycle.request_stop();
    rig.run(12s);
    EXPECT_TRUE(rig.cycle.finished()) << control::name(phase);
    EXPECT_EQ(rig.cycle.task().end(), TeleopEnd::kRequested);
    EXPECT_FALSE(rig.cycle.stop_reason());
    EXPECT_EQ(vector(rig.last().held_force_H_N).norm(), 0) << control::name(phase);
    EXPECT_EQ(rig.last().phase, TeleopPhase::kOff);
    rig.run(500ms);
    EXPECT_LT(rig.plant.velocity().norm(), 0.05) << "nothing is left to fall";
  }
}

// --- Mapping (3.4.1 to 3.4.3) ---

TEST(Teleoperation, TheTipFollowsTheGripWithXAndYChangingSign) {
  Rig rig;
  ASSERT_TRUE(rig.run_until(TeleopPhase::kOperating));
  rig.run(500ms);
  const Vector3d start_m = vector(rig.last().true_tip_p_WT_m);
  rig.hand.move_to({-0.02, 0.04, 0.03}, 1s);
  rig.run(4s);
  const Vector3d way_m = vector(rig.last().true_tip_p_WT_m) - start_m;
  const Vector3d grip_m = vector(rig.last().grip_p_HD_m);
  // To within what friction and an imperfect model leave of the 700 N/m.
  EXPECT_LT((way_m - Vector3d(-grip_m.x(), -grip_m.y(), grip_m.z())).norm(), 0.012) << way_m.transpose();
  // The hand is pulled towards the end effector.
  const Vector3d spring_N = vector(rig.last().spring_W_N);
  EXPECT_LT(
      (vector(rig.last().held_force_H_N) - Vector3d(spring_N.x(), spring_N.y(), -spring_N.z()) / 10.0).norm(),
      0.02);
  expect_no_jump(rig);
  expect_passive(rig);
}

TEST(Teleoperation, AnOrientationIsFollowedByArmAndBaseTogether) {
  Rig rig;
  ASSERT_TRUE(rig.run_until(TeleopPhase::kOperating));
  rig.run(500ms);
  const Quaterniond before = rotation(rig.last().tip_q_WT);
  // The handle turned by 30 degrees about its upright axis: the end effector turns to the left with it.
  rig.hand.turn_to(Quaterniond(Eigen::AngleAxisd(std::numbers::pi / 6, Vector3d::UnitZ())), 1s);
  rig.run(6s);
  const Eigen::AngleAxisd turn(rotation(rig.last().tip_q_WT) * before.conjugate());
  EXPECT_NEAR(turn.angle(), std::numbers::pi / 6, 0.06);
  EXPECT_GT(turn.axis().z(), 0.98);
  EXPECT_LT((vector(rig.last().true_tip_p_WT_m) - vector(rig.last().setpoint_p_WT_m)).norm(), 0.012);
  expect_no_jump(rig);
  expect_passive(rig);
}

TEST(Teleoperation, RateControlDrivesOnAndComesBackWithoutAJump) {
  Rig rig;
  ASSERT_TRUE(rig.run_until(TeleopPhase::kOperating));
  rig.run(500ms);
  const double begin_m = rig.last().setpoint_p_WT_m[0];
  rig.hand.move_to({-0.055, 0, 0}, 1s);
  rig.run(8s);
  ASSERT_TRUE(rig.last().rate_control);
  const double at_m = rig.last().setpoint_p_WT_m[0];
  rig.run(1s);
  EXPECT_NEAR(rig.last().setpoint_p_WT_m[0] - at_m, 0.1, 0.005);  // m/s
  EXPECT_GT(rig.last().base_W[0], 0.4) << "the base came along";
  rig.hand.move_to(Vector3d::Zero(), 1s);
  rig.run(3s);
  EXPECT_FALSE(rig.last().rate_control);
  EXPECT_GT(rig.last().setpoint_p_WT_m[0] - begin_m, 0.6);
  EXPECT_LT((vector(rig.last().true_tip_p_WT_m) - vector(rig.last().setpoint_p_WT_m)).norm(), 0.02);
  expect_no_jump(rig);
  expect_passive(rig);
}

TEST(Teleoperation, TheClutchLetsTheHandMoveAlone) {
  Rig rig;
  ASSERT_TRUE(rig.run_until(TeleopPhase::kOperating));
  rig.run(500ms);
  rig.hand.press(1U << 1);
  rig.run(100ms);
  const Vector3d held_m = vector(rig.last().setpoint_p_WT_m);
  rig.hand.move_to({0, 0.05, 0.04}, 1s);
  rig.run(2s);
  EXPECT_TRUE(rig.last().clutched);
  EXPECT_EQ(vector(rig.last().setpoint_p_WT_m), held_m);
  EXPECT_EQ(vector(rig.last().held_force_H_N).norm(), 0);
  rig.hand.release(1U << 1);
  rig.run(1s);
  EXPECT_LT((vector(rig.last().setpoint_p_WT_m) - held_m).norm(), 0.003) << "nothing but the hand's own give";
  rig.hand.move_to({0, 0.03, 0.04}, 1s);
  rig.run(2s);
  EXPECT_NEAR(rig.last().setpoint_p_WT_m[1] - held_m.y(), 0.02, 0.003);
  expect_no_jump(rig);
  expect_passive(rig);
}

TEST(Teleoperation, TheButtonClosesTheGripper) {
  Rig rig;
  ASSERT_TRUE(rig.run_until(TeleopPhase::kUnfolding));
  EXPECT_TRUE(std::isnan(rig.last().gripper_opening_m))
      << "nothing is commanded before the handle is coupled";
  ASSERT_TRUE(rig.run_until(TeleopPhase::kOperating));
  EXPECT_EQ(rig.last().gripper_opening_m, 0.020);
  rig.hand.press(1);
  rig.run(10ms);
  EXPECT_EQ(rig.last().gripper_opening_m, 0.010);
  rig.hand.release(1);
  rig.run(10ms);
  EXPECT_EQ(rig.last().gripper_opening_m, 0.020);
}

TEST(Teleoperation, AMasterOfSpeedsThatIsHeldDeflectedThroughTheStartUpDrivesNothing) {
  auto config = teleop_rig::quick_config();
  config.control.mapping.rate_only = true;
  config.control.master_has_force = false;
  Rig rig(config);
  ASSERT_TRUE(rig.run_until(TeleopPhase::kApproaching));
  rig.hand.hold_at({-0.05, 0, 0});
  ASSERT_TRUE(rig.run_until(TeleopPhase::kOperating));
  const Vector3d at_m = vector(rig.last().setpoint_p_WT_m);
  rig.run(2s);
  EXPECT_EQ(vector(rig.last().setpoint_p_WT_m), at_m);
  EXPECT_FALSE(rig.last().rate_control);
  rig.hand.move_to(Vector3d::Zero(), 300ms);
  rig.run(500ms);
  rig.hand.move_to({-0.05, 0, 0}, 300ms);
  rig.run(2s);
  EXPECT_GT(rig.last().setpoint_p_WT_m[0], at_m.x() + 0.05) << "now it is meant";
  expect_no_jump(rig);
}

TEST(Teleoperation, AnEndEffectorThatDoesNotFollowARotationEndsItBeforeTheSpringTurnsRound) {
  auto config = teleop_rig::quick_config();
  config.control.smoothing.turn_speed_rad_per_s = 6;  // faster than any arm
  config.control.setpoint_turn_limit_rad = 1.0;
  config.control.joint_speed_limit_rad_per_s = 10;  // which would end it, too
  Rig rig(config);
  ASSERT_TRUE(rig.run_until(TeleopPhase::kOperating));
  rig.hand.turn_to(Quaterniond(Eigen::AngleAxisd(3.0, Vector3d::UnitX())), 300ms);
  rig.run(1s);
  EXPECT_EQ(rig.cycle.task().end(), TeleopEnd::kSetpointTurnedTooFar);
  EXPECT_TRUE(rig.cycle.task().phase() == TeleopPhase::kStopping ||
              rig.cycle.task().phase() == TeleopPhase::kLowering)
      << control::name(rig.cycle.task().phase());
}

// --- The danger of 3.4.5: the handle released, and only its orientation changed ---

struct Release {
  double tip_way_m = 0;              ///< furthest from where it was
  double largest_speed_m_per_s = 0;  ///< of the handle
  double given_J = 0;
  TeleopPhase phase = TeleopPhase::kOff;
};

Release release_and_flip(bool protect, bool arm_alone, const Eigen::AngleAxisd& flip) {
  auto config = teleop_rig::quick_config();
  config.control.tank.active = config.control.detect_release = protect;
  Scene scene = teleop_rig::unfolded_scene();
  if (arm_alone) {
    scene.robot.wheels.on_ground = false;
    config.control.robot.base.wrench_limits = {0, 0};
    config.control.robot.base.compensate_friction = false;
  }
  Rig rig(config, scene);
  if (!rig.run_until(TeleopPhase::kOperating)) {
    ADD_FAILURE() << "no start";
    return {};
  }
  rig.run(1s);
  const Vector3d start_m = vector(rig.last().true_tip_p_WT_m);
  rig.hand.let_go();
  rig.hand.flip(Quaterniond(flip), 500ms);
  Release seen;
  for (int n = 0; n < 15000 && !rig.cycle.finished(); ++n) {
    rig.step();
    const TeleopRecord& r = rig.last();
    seen.tip_way_m = std::max(seen.tip_way_m, (vector(r.true_tip_p_WT_m) - start_m).norm());
    seen.largest_speed_m_per_s = std::max(seen.largest_speed_m_per_s, vector(r.grip_v_HD_m_per_s).norm());
  }
  seen.given_J = largest_port_energy_J(rig);
  seen.phase = rig.cycle.task().phase();
  return seen;
}

const std::array<Eigen::AngleAxisd, 4> kFlips{Eigen::AngleAxisd(std::numbers::pi / 2, Vector3d::UnitY()),
                                              Eigen::AngleAxisd(-std::numbers::pi / 2, Vector3d::UnitY()),
                                              Eigen::AngleAxisd(std::numbers::pi / 2, Vector3d::UnitZ()),
                                              Eigen::AngleAxisd(3.0, Vector3d::UnitX())};

TEST(Teleoperation, AReleasedPenThatIsFlippedRunsAwayWithoutProtection) {
  Release worst;
  for (const Eigen::AngleAxisd& flip : kFlips) {
    const Release seen = release_and_flip(false, false, flip);
    EXPECT_GT(seen.given_J, 2 * kReserve_J) << flip.angle() << " rad about " << flip.axis().transpose();
    worst.given_J = std::max(worst.given_J, seen.given_J);
    worst.largest_speed_m_per_s = std::max(worst.largest_speed_m_per_s, seen.largest_speed_m_per_s);
    worst.tip_way_m = std::max(worst.tip_way_m, seen.tip_way_m);
  }
  EXPECT_GT(worst.given_J, 50 * kReserve_J) << "the pen is thrown about";
  EXPECT_GT(worst.largest_speed_m_per_s, 0.9) << "until it is too fast for the device";
  EXPECT_GT(worst.tip_way_m, 0.25) << "and takes the robot along";
}

TEST(Teleoperation, AReleasedPenThatIsFlippedDoesNotRunAwayWithProtection) {
  for (const bool arm_alone : {false, true})
    for (const Eigen::AngleAxisd& flip : kFlips) {
      SCOPED_TRACE(testing::Message() << (arm_alone ? "arm alone, " : "with the base, ") << flip.angle()
                                      << " rad about " << flip.axis().transpose());
      const Release seen = release_and_flip(true, arm_alone, flip);
      EXPECT_LE(seen.given_J, kReserve_J);
      // What 5 mJ can do to 0.3 kg.
      EXPECT_LT(seen.largest_speed_m_per_s, std::sqrt(2 * kReserve_J / 0.3));
      // No further than the handle reaches: it is not driven away.
      EXPECT_LT(seen.tip_way_m, 0.2);
    }
}

TEST(Teleoperation, ALetGoPenMovesNothingUntilAButtonIsPressed) {
  Rig rig;
  ASSERT_TRUE(rig.run_until(TeleopPhase::kOperating));
  rig.run(500ms);
  rig.hand.let_go();
  rig.hand.flip(Quaterniond(Eigen::AngleAxisd(1.5, Vector3d::UnitY())), 500ms);
  ASSERT_TRUE(rig.run_until(TeleopPhase::kLetGo, 20s));
  rig.run(2s);
  const Vector3d held_m = vector(rig.last().setpoint_p_WT_m);
  rig.hand.take_hold();
  rig.hand.move_to({0.02, 0.02, 0}, 1s);
  rig.hand.turn_to(Quaterniond::Identity(), 1s);
  rig.run(2s);
  EXPECT_EQ(rig.cycle.task().phase(), TeleopPhase::kLetGo);
  EXPECT_EQ(vector(rig.last().setpoint_p_WT_m), held_m);
  EXPECT_EQ(vector(rig.last().held_force_H_N).norm(), 0);

  rig.hand.press(1);
  rig.run(100ms);
  EXPECT_EQ(rig.cycle.task().phase(), TeleopPhase::kOperating);
  EXPECT_EQ(rig.last().gripper_opening_m, 0.020) << "this press is not for the gripper";
  rig.hand.release(1);
  rig.run(1s);
  EXPECT_LT((vector(rig.last().setpoint_p_WT_m) - held_m).norm(), 0.005) << "nothing but the hand's own give";
  rig.hand.move_to({0.02, 0.0, 0}, 1s);
  rig.run(2s);
  EXPECT_NEAR(rig.last().setpoint_p_WT_m[1] - held_m.y(), 0.02, 0.004);
  expect_no_jump(rig);
  expect_passive(rig, kReserve_J);  // each press of the button adds another
}

TEST(Teleoperation, APenThatIsLetGoWhilePressedOnAWallDoesNotFly) {
  Scene scene = teleop_rig::unfolded_scene();
  scene.environment.walls.push_back({{0.37, 0, 0}, {-1, 0, 0}});
  auto config = teleop_rig::quick_config();
  config.control.feedback.force_scale = 3;  // a strong one: the spring holds 0.1 J
  Rig rig(config, scene);
  ASSERT_TRUE(rig.run_until(TeleopPhase::kOperating));
  rig.hand.move_to({-0.05, 0, 0}, 1s);
  rig.run(3s);
  ASSERT_GT(vector(rig.last().held_force_H_N).norm(), 2.0);
  rig.hand.let_go();
  const auto begin = rig.records.size();
  ASSERT_TRUE(rig.run_until(TeleopPhase::kLetGo, 1s));
  double fastest_m_per_s = 0;
  rig.run(1s);
  for (std::size_t i = begin; i < rig.records.size(); ++i)
    fastest_m_per_s = std::max(fastest_m_per_s, vector(rig.records[i].grip_v_HD_m_per_s).norm());
  EXPECT_LT(fastest_m_per_s, 0.8);
  EXPECT_EQ(rig.cycle.task().phase(), TeleopPhase::kLetGo);
  expect_passive(rig);
}

TEST(Teleoperation, AHandThatFollowsItsTasksIsNeverTakenForNone) {
  Rig rig;
  ASSERT_TRUE(rig.run_until(TeleopPhase::kOperating));
  const std::array<Vector3d, 8> places{Vector3d(0, 0.07, 0.05),     Vector3d(-0.03, -0.07, 0.06),
                                       Vector3d(0.04, 0.02, -0.05), Vector3d(-0.03, 0.05, 0),
                                       Vector3d(0.02, -0.06, 0.03), Vector3d(0, 0, 0.07),
                                       Vector3d(0, 0, -0.05),       Vector3d(0.03, 0.07, -0.03)};
  for (const Vector3d& place_m : places)
    for (const auto duration : {400ms, 1500ms}) {
      rig.hand.move_to(place_m, duration);
      rig.run(duration + 300ms);
      rig.hand.move_to(-0.3 * place_m, duration);
      rig.run(duration);
      ASSERT_EQ(rig.cycle.task().phase(), TeleopPhase::kOperating) << "on the way to " << place_m.transpose();
    }
  expect_no_jump(rig);
  expect_passive(rig);
}

TEST(Teleoperation, TheSetPointIsHeldAtAWallOfTheWorkspaceAndFollowsThePenBack) {
  auto config = teleop_rig::quick_config();
  config.control.workspace.tip_W_m.max().x() = config.control.start_p_WT_m.x() + 0.02;
  const double wall_m = config.control.workspace.tip_W_m.max().x();
  Rig rig(config);
  ASSERT_TRUE(rig.run_until(TeleopPhase::kOperating));
  rig.run(1s);
  rig.hand.move_to({-0.05, 0, 0}, 1500ms);
  rig.run(3s);
  EXPECT_EQ(rig.cycle.task().phase(), TeleopPhase::kOperating);
  EXPECT_TRUE(std::none_of(rig.records.begin(), rig.records.end(), [wall_m](const TeleopRecord& r) {
    return r.phase == TeleopPhase::kOperating && r.setpoint_p_WT_m[0] > wall_m + 1e-12;
  }));
  EXPECT_NEAR(rig.last().setpoint_p_WT_m[0], wall_m, 1e-9);
  EXPECT_NE(rig.last().limited & operation::limiter::kWorkspace, 0);
  rig.hand.move_to({0, 0, 0}, 1500ms);
  rig.run(3s);
  EXPECT_LT(rig.last().setpoint_p_WT_m[0], wall_m - 0.01);
  EXPECT_EQ(rig.last().limited & operation::limiter::kWorkspace, 0);
}

/// By a force that grows for 10 s: a joint that is pushed through fast is taken for one whose sensor lies.
bool pushed_until_it_stops(Rig& rig, const Eigen::Vector3d& force_N) {
  for (int n = 0; n < 10'000; ++n) {
    rig.plant.push_tip(n / 10'000.0 * force_N);
    rig.step();
    if (rig.cycle.task().phase() == TeleopPhase::kStopping) return true;
  }
  return false;
}

TEST(Teleoperation, ATipThatIsPushedOutOfItsWorkspaceStops) {
  auto config = teleop_rig::quick_config();
  config.control.workspace.tip_W_m.max().y() = 0.02;
  Rig rig(config);
  ASSERT_TRUE(rig.run_until(TeleopPhase::kOperating));
  ASSERT_TRUE(pushed_until_it_stops(rig, {0, 60, 0}));
  EXPECT_EQ(rig.cycle.task().end(), TeleopEnd::kTipOutside);
  const std::string text = describe(rig.cycle.stop_reason(), rig.robot, &rig.master);
  EXPECT_NE(text.find("the end effector was 0.05"), std::string::npos) << text;
  EXPECT_NE(text.find("the next start brings it back"), std::string::npos) << text;
}

TEST(Teleoperation, ABaseThatIsPulledOutOfItsWorkspaceStops) {
  auto config = teleop_rig::quick_config();
  config.control.workspace.base_W_m.max().x() = 0.0;
  Rig rig(config);
  ASSERT_TRUE(rig.run_until(TeleopPhase::kOperating));
  ASSERT_TRUE(pushed_until_it_stops(rig, {60, 0, 0})) << rig.last().base_W[0];
  EXPECT_EQ(rig.cycle.task().end(), TeleopEnd::kBaseOutside);
  const std::string text = describe(rig.cycle.stop_reason(), rig.robot, &rig.master);
  EXPECT_NE(text.find("push it back inside"), std::string::npos) << text;
}

TEST(Teleoperation, AStartOutsideTheWorkspaceIsRefused) {
  auto config = teleop_rig::quick_config();
  config.control.workspace.tip_W_m.max().x() = 0.1;
  EXPECT_THROW(Rig{config}, std::invalid_argument);
}

// --- Contact ---

/// Contact of a weakly damped hand with a wall under strong feedback.
struct Pressed {
  double swing_m = 0;  ///< of the handle, at the end
  double given_J = 0;
  bool ended = false;
};

Pressed press_on_wall(double wall_N_per_m, bool passivity) {
  Scene scene = teleop_rig::unfolded_scene();
  scene.environment.walls.push_back({{0.38, 0, 0}, {-1, 0, 0}, {.stiffness_N_per_m = wall_N_per_m}});
  scene.hand.hand_stiffness_N_per_m = 200;
  scene.hand.hand_damping_N_s_per_m = 0.3;
  auto config = teleop_rig::quick_config();
  config.control.feedback.force_scale = 0.35;       // the hand feels 2000 N/m
  config.control.robot.spring.damping_ratio = 0.2;  // more keeps the end effector on the wall by itself
  config.control.tank.active = passivity;
  config.control.detect_release = false;  // it is the passivity that is looked at,
  config.torque_rate_per_s = 1000;        // and a torque rate takes some of the instability
  Rig rig(config, scene);
  if (!rig.run_until(TeleopPhase::kOperating)) {
    ADD_FAILURE() << "no start";
    return {};
  }
  rig.run(1s);
  rig.hand.move_to({-0.035, 0, 0}, 800ms);
  rig.run(8s);
  Pressed pressed;
  double least_m = 1, most_m = -1;
  for (int n = 0; n < 3000 && !rig.cycle.finished(); ++n) {
    rig.step();
    least_m = std::min(least_m, rig.last().grip_p_HD_m[0]);
    most_m = std::max(most_m, rig.last().grip_p_HD_m[0]);
  }
  pressed.swing_m = most_m - least_m;
  pressed.given_J = largest_port_energy_J(rig);
  pressed.ended =
      static_cast<bool>(rig.cycle.stop_reason());  // lowering the arm may take longer than this test
  return pressed;
}

TEST(Teleoperation, IsStableOnStifferWallsThanTheSameLoopWithoutPassivityControl) {
  const Pressed without = press_on_wall(2e4, false);
  EXPECT_TRUE(without.ended) << "too fast a grip ends it; stable by itself, this shows nothing";
  EXPECT_GT(without.given_J, 10 * kReserve_J);
  for (const double wall_N_per_m : {2e3, 2e4, 4e4}) {
    const Pressed with = press_on_wall(wall_N_per_m, true);
    EXPECT_FALSE(with.ended) << wall_N_per_m;
    EXPECT_LT(with.swing_m, 0.003) << wall_N_per_m << ": what there was dies away";
    EXPECT_LE(with.given_J, kReserve_J) << wall_N_per_m;
  }
}

TEST(Teleoperation, AWallMetAtFullSpeedIsFeltWithinTheForceLimit) {
  Scene scene = teleop_rig::unfolded_scene();
  scene.environment.walls.push_back({{0.80, 0, 0}, {-1, 0, 0}});
  auto config = teleop_rig::quick_config();
  config.control.mapping.rate_speed_m_per_s = 0.25;  // as fast as the set-point goes at all
  Rig rig(config, scene);
  ASSERT_TRUE(rig.run_until(TeleopPhase::kOperating));
  rig.hand.move_to({-0.055, 0, 0}, 500ms);
  rig.run(6s);
  double hardest_N = 0, strongest_N = 0;
  for (const TeleopRecord& r : rig.records) {
    hardest_N = std::max(hardest_N, contact_N(r));
    strongest_N = std::max(strongest_N, vector(r.held_force_H_N).norm());
  }
  EXPECT_EQ(rig.cycle.task().phase(), TeleopPhase::kOperating);
  EXPECT_GT(hardest_N, 5) << "it was not met";
  // 0.25 m/s of base and arm, 50 kg, cannot be stopped by nothing; the arm's give is what softens it.
  EXPECT_LT(hardest_N, 150);
  EXPECT_LE(strongest_N, 8.0);
  // Pressed on, not hammered on: steady in the end.
  double least_N = 1e9, most_N = 0;
  for (std::size_t i = rig.records.size() - 1000; i < rig.records.size(); ++i) {
    least_N = std::min(least_N, contact_N(rig.records[i]));
    most_N = std::max(most_N, contact_N(rig.records[i]));
  }
  EXPECT_GT(least_N, 1);
  EXPECT_LT(most_N - least_N, 5);
  expect_no_jump(rig);
  expect_passive(rig);
}

/// The handle presses the end effector against a wall.
void press(Rig& rig) {
  ASSERT_TRUE(rig.run_until(TeleopPhase::kOperating));
  rig.run(500ms);
  rig.hand.move_to({-0.04, 0, 0}, 1s);
  rig.run(3s);
  ASSERT_GT(contact_N(rig.last()), 3);
}

double commanded_N(const TeleopRecord& r) { return vector(r.grip_force_H_N).norm(); }

/// Largest change of the force on the hand between two cycles, from record `first` on.
double steepest_N(const Rig& rig, std::size_t first) {
  double steepest = 0;
  for (std::size_t i = first + 1; i < rig.records.size(); ++i)
    steepest = std::max(
        steepest, (vector(rig.records[i].grip_force_H_N) - vector(rig.records[i - 1].grip_force_H_N)).norm());
  return steepest;
}

TEST(Teleoperation, WhatIsTunedOnAWallActsByRamps) {
  Scene scene = teleop_rig::unfolded_scene();
  scene.environment.walls.push_back({{0.38, 0, 0}, {-1, 0, 0}});
  auto config = teleop_rig::quick_config();
  config.control.stiffening_per_s = {600, 30};
  config.control.feedback_fade_s = 0.5;
  Rig rig(config, scene);
  press(rig);
  const auto share_of_spring = [&] { return commanded_N(rig.last()) / vector(rig.last().spring_W_N).norm(); };
  ASSERT_NEAR(share_of_spring(), 0.1, 0.01);
  control::TeleopTuning tuning = control::Teleoperation::tuning_of(config.control);

  // Softer: 0.6 N/m per millisecond.
  std::size_t first = rig.records.size();
  tuning.stiff = {400, 20};
  rig.cycle.task().tune(tuning);
  rig.run(200ms);
  EXPECT_NEAR(rig.last().stiffness_N_per_m, 700 - 0.6 * 200, 0.7);
  rig.run(1s);
  EXPECT_EQ(rig.last().stiffness_N_per_m, 400);

  // Half the force on the hand, then the whole again.
  for (const double scale : {20.0, 10.0}) {
    tuning.force_scale = scale;
    rig.cycle.task().tune(tuning);
    rig.run(2s);
    EXPECT_NEAR(share_of_spring(), 1 / scale, 0.1 / scale);
  }

  // Without feedback nothing is felt; with it, the same as before.
  const double before_N = commanded_N(rig.last());
  tuning.force_feedback = false;
  rig.cycle.task().tune(tuning);
  rig.run(250ms);
  EXPECT_NEAR(commanded_N(rig.last()), before_N / 2, before_N / 5) << "half-way down";
  rig.run(500ms);
  EXPECT_EQ(commanded_N(rig.last()), 0);
  tuning.force_feedback = true;
  rig.cycle.task().tune(tuning);
  rig.run(3s);
  EXPECT_NEAR(share_of_spring(), 0.1, 0.01);

  EXPECT_LT(steepest_N(rig, first), 0.02) << "1 N within 0.5 s is 0.002 N a millisecond";
  EXPECT_EQ(rig.cycle.task().phase(), TeleopPhase::kOperating);
  expect_no_jump(rig);
  expect_passive(rig);
}

TEST(Teleoperation, WithTheWholeContactShareTheHandFeelsTheObservedContact) {
  Scene scene = teleop_rig::unfolded_scene();
  scene.environment.walls.push_back({{0.38, 0, 0}, {-1, 0, 0}});
  auto config = teleop_rig::quick_config();
  config.control.feedback_fade_s = 0.5;
  Rig rig(config, scene);
  press(rig);
  const std::size_t first = rig.records.size();
  control::TeleopTuning tuning = control::Teleoperation::tuning_of(config.control);
  tuning.contact_share = 1;
  rig.cycle.task().tune(tuning);
  rig.run(3s);
  const TeleopRecord& r = rig.last();
  const Eigen::Vector3d contact_N = vector(r.contact_force_W_N);
  const Eigen::Vector3d estimate_N = vector(r.contact_estimate_W_N);
  EXPECT_LT(contact_N.x(), -3) << "the wall pushes the end effector back";
  EXPECT_NEAR(estimate_N.x(), contact_N.x(), 0.4 * std::abs(contact_N.x()));
  // The wall's x is against that of the handle's frame.
  EXPECT_NEAR(r.grip_force_H_N[0], -0.1 * estimate_N.x(), 0.02 * std::abs(estimate_N.x()));
  EXPECT_LT(steepest_N(rig, first), 0.05);
  EXPECT_EQ(rig.cycle.task().phase(), TeleopPhase::kOperating);
  expect_no_jump(rig);
  expect_passive(rig);
}

/// Mean force on the hand while it moves through free air.
double drag_N(double contact_share) {
  auto config = teleop_rig::quick_config();
  config.control.feedback.contact_share = contact_share;
  Rig rig(config);
  EXPECT_TRUE(rig.run_until(TeleopPhase::kOperating));
  rig.run(1s);
  const std::size_t first = rig.records.size();
  rig.hand.move_to({-0.04, 0, 0}, 500ms);
  rig.run(500ms);
  double sum_N = 0;
  for (std::size_t i = first; i < rig.records.size(); ++i) sum_N += commanded_N(rig.records[i]);
  expect_passive(rig);
  return sum_N / static_cast<double>(rig.records.size() - first);
}

TEST(Teleoperation, WithTheWholeContactShareTheHandMovesMoreFreely) {
  const double by_spring_N = drag_N(0);
  EXPECT_GT(by_spring_N, 0.05) << "there is nothing to improve";
  EXPECT_LT(drag_N(1), 0.6 * by_spring_N);
}

TEST(Teleoperation, ATunedScaleMovesNothingByItself) {
  Rig rig;
  ASSERT_TRUE(rig.run_until(TeleopPhase::kOperating));
  rig.hand.move_to({-0.02, 0, 0}, 1s);
  rig.run(3s);
  const double begin_m = rig.last().setpoint_p_WT_m[0];
  control::TeleopTuning tuning = control::Teleoperation::tuning_of(teleop_rig::quick_config().control);
  tuning.motion_scale = 0.5;
  rig.cycle.task().tune(tuning);
  rig.run(1s);
  EXPECT_NEAR(rig.last().setpoint_p_WT_m[0], begin_m, kThreshold_m);
  const double grip_m = rig.last().grip_p_HD_m[0];
  rig.hand.move_to({-0.04, 0, 0}, 1s);
  rig.run(3s);
  EXPECT_NEAR(rig.last().setpoint_p_WT_m[0] - begin_m, 0.5 * (grip_m - rig.last().grip_p_HD_m[0]),
              2 * kThreshold_m);
  expect_no_jump(rig);
}

TEST(Teleoperation, ATunedRateSpeedIsThatOfTheSetPoint) {
  Rig rig;
  ASSERT_TRUE(rig.run_until(TeleopPhase::kOperating));
  rig.run(500ms);
  rig.hand.move_to({-0.055, 0, 0}, 1s);
  rig.run(4s);
  ASSERT_TRUE(rig.last().rate_control);
  control::TeleopTuning tuning = control::Teleoperation::tuning_of(teleop_rig::quick_config().control);
  tuning.rate_speed_m_per_s = 0.05;
  rig.cycle.task().tune(tuning);
  rig.run(2s);
  const double at_m = rig.last().setpoint_p_WT_m[0];
  rig.run(1s);
  EXPECT_NEAR(rig.last().setpoint_p_WT_m[0] - at_m, 0.05, 0.003);
}

TEST(Teleoperation, AFreeBoxIsPushedOverATable) {
  Scene scene = teleop_rig::unfolded_scene();
  scene.environment.tables.push_back({.centre_W_m = {0.90, 0, 0.14}, .size_m = {0.9, 1.0, 0.28}});
  scene.environment.box =
      sim::FreeBox{.block = {.centre_W_m = {0.50, 0, 0.35}, .size_m = {0.06, 0.06, 0.14}}, .mass_kg = 0.5};
  Rig rig(teleop_rig::quick_config(), scene);
  ASSERT_TRUE(rig.run_until(TeleopPhase::kOperating));
  const double begin_m = rig.plant.environment().box_p_W_m().x();
  rig.hand.move_to({-0.055, 0, 0}, 1s);
  rig.run(4s);
  constexpr std::size_t kLast = 1000;
  double pushed_N = 0;
  for (std::size_t i = rig.records.size() - kLast; i < rig.records.size(); ++i)
    pushed_N -= rig.records[i].contact_force_W_N[0] / static_cast<double>(kLast);
  EXPECT_EQ(rig.cycle.task().phase(), TeleopPhase::kOperating);
  EXPECT_GT(rig.plant.environment().box_p_W_m().x() - begin_m, 0.1);
  EXPECT_NEAR(rig.plant.environment().box_p_W_m().z(), 0.35, 0.005) << "still on the table";
  // At a steady pace the end effector carries the box' friction, 0.3 of 0.5 kg, on average over its small
  // impacts.
  EXPECT_NEAR(pushed_N, 0.3 * 0.5 * 9.81, 0.15);
  expect_no_jump(rig);
  expect_passive(rig);
}

TEST(Teleoperation, NoJointIsDrivenOntoItsStop) {
  for (const Vector3d& far_m :
       {Vector3d(0, 0, 0.09), Vector3d(0, 0, -0.06), Vector3d(0.05, 0.09, 0), Vector3d(-0.035, -0.09, 0.02)})
    for (const double turn_rad : {0.0, 1.2, -1.2}) {
      SCOPED_TRACE(testing::Message() << far_m.transpose() << ", " << turn_rad);
      Scene scene = teleop_rig::unfolded_scene();
      scene.robot.wheels.on_ground = false;  // the base cannot help
      auto config = teleop_rig::quick_config();
      config.control.mapping.motion_scale = 4;  // half a metre
      Rig rig(config, scene);
      ASSERT_TRUE(rig.run_until(TeleopPhase::kOperating));
      rig.hand.move_to(far_m, 2s);
      rig.hand.turn_to(Quaterniond(Eigen::AngleAxisd(turn_rad, Vector3d::UnitY())), 2s);
      const control::RobotModel model;
      for (int n = 0; n < 8000; ++n) {
        rig.step();
        const control::ArmVector q = rig.plant.arm_rad();
        for (int j = 0; j < 5; ++j) {
          const control::JointRange& range = model.ranges()[static_cast<std::size_t>(j)];
          ASSERT_GT(q[j], range.lower_rad) << "joint " << j + 1 << " at " << n << " ms";
          ASSERT_LT(q[j], range.upper_rad) << "joint " << j + 1 << " at " << n << " ms";
        }
      }
      expect_passive(rig);
    }
}

TEST(Teleoperation, AnArmThatIsHomedAtTheStartIsHeldWhereItIsThen) {
  control::Teleoperation teleoperation(teleop_rig::quick_config().control);
  control::TeleopInput input;
  input.master_ready = input.grip_fresh = true;
  input.grip.p_HD_m = {0.05, 0, 0};  // not yet centred
  teleoperation.request_start();
  input.arm_position_rad.setConstant(1.0);
  for (int n = 0; n < 100; ++n) EXPECT_TRUE(teleoperation.step(input).enable_drives);
  input.arm_position_rad << 0.01, 0.01, -0.02, 0.02, 0.11;  // homing set the angles, and is done
  EXPECT_EQ(teleoperation.step(input).phase, TeleopPhase::kCentring) << "no joint was that fast";
  input.drives_obey = true;
  for (int n = 0; n < 100; ++n) {
    const control::TeleopOutput& output = teleoperation.step(input);
    EXPECT_EQ(output.arm, control::TeleopOutput::Arm::kPosition);
    EXPECT_EQ(output.arm_target, input.arm_position_rad);
  }
}

TEST(Teleoperation, TheClutchReleasedBeyondTheRimDrivesNothingAndGivesNothing) {
  Rig rig;
  ASSERT_TRUE(rig.run_until(TeleopPhase::kOperating));
  rig.run(500ms);
  rig.hand.press(1U << 1);
  rig.hand.move_to({-0.058, 0, 0}, 500ms);
  rig.run(1s);
  const double at_m = rig.last().setpoint_p_WT_m[0];
  rig.hand.release(1U << 1);
  rig.run(2s);
  EXPECT_NEAR(rig.last().setpoint_p_WT_m[0], at_m, 0.003);
  rig.hand.move_to({0, 0, 0}, 500ms);
  rig.run(1s);
  EXPECT_LT(rig.last().setpoint_p_WT_m[0], at_m - 0.03) << "it follows the hand again";
  rig.hand.move_to({-0.055, 0, 0}, 500ms);
  rig.run(2s);
  EXPECT_GT(rig.last().setpoint_p_WT_m[0], at_m + 0.05) << "and drives";
  expect_no_jump(rig);
  expect_passive(rig);
}

TEST(Teleoperation, WithoutForceFeedbackAPenLetGoBeyondTheRimComesBack) {
  auto config = teleop_rig::quick_config();
  config.control.force_feedback = false;
  Rig rig(config);
  ASSERT_TRUE(rig.run_until(TeleopPhase::kOperating));
  rig.hand.move_to({-0.055, 0, 0}, 500ms);
  rig.run(2s);
  rig.hand.let_go();
  rig.run(3s);
  const double at_m = rig.last().setpoint_p_WT_m[0];
  rig.run(3s);
  EXPECT_LT(rig.last().setpoint_p_WT_m[0] - at_m, 0.1) << "rate control ends, or comes and goes at the rim";
  expect_passive(rig);
}

TEST(Teleoperation, TheWholeCycleNeitherAllocatesNorLocks) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns the allocator";
  Rig rig;
  rig.records.reserve(100'000);
  const support::NoAllocGuard guard;
  ASSERT_TRUE(rig.run_until(TeleopPhase::kOperating));
  rig.hand.move_to({-0.055, 0, 0}, 500ms);
  rig.run(1s);
  rig.clock.sleep_until(rig.clock.now() + 15ms);  // what a pause takes, too
  rig.run(1s);
  rig.hand.let_go();
  rig.run(500ms);
  EXPECT_EQ(guard.violations(), 0);
}

}  // namespace teleoperation_test
