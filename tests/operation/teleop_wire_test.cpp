// Teleoperation of base and arm behind emulated motor controllers: every byte of the EtherCAT master between
// hand and mechanics, in virtual time.
#include <gtest/gtest.h>

#include <memory>

#include "runtime/open_robot.h"
#include "tests/operation/teleop_rig.h"

namespace teleop_wire_test {

using namespace std::chrono_literals;
using control::TeleopPhase;
using Eigen::Vector3d;

constexpr double kDegree_rad = 0.01745;

Vector3d vector(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

/// The robot of `--robot wire`, its arm folded and without a zero, as after power-up.
class WireRig {
 public:
  explicit WireRig(const sim::EnvironmentParameters& scene)
      : robot(runtime::open_robot({.name = "wire",
                                   .ethercat = {.kind = hal::YoubotKind::kBaseAndArm, .home_arms = true},
                                   .can = {},
                                   .simulation = {},
                                   .scene = scene},
                                  clock, teleop_rig::kPeriod)),
        hand({.travel = sim::GripTravel{}}),
        master(std::make_unique<hal::LoopbackHapticLink>(
                   hand, teleop_rig::kPeriod,
                   hal::HapticInfo{.name = "pen", .force_limit_N = 8.0, .senses_rotation = true}),
               clock),
        cycle(teleop_rig::quick_config(), *robot.robot, master) {
    robot.robot->activate();
    master.activate();
  }

  void step() {
    clock.sleep_until(clock.now() + teleop_rig::kPeriod);
    cycle.step(clock.now());
    operation::add_truth(cycle.record(), robot.manipulator->X_WT().translation(),
                         robot.manipulator->contact_force_W_N());
  }
  void run(std::chrono::nanoseconds duration) {
    for (std::chrono::nanoseconds t{}; t < duration; t += teleop_rig::kPeriod) step();
  }
  bool run_until(TeleopPhase phase, std::chrono::nanoseconds limit) {
    for (std::chrono::nanoseconds t{}; t < limit; t += teleop_rig::kPeriod) {
      step();
      if (cycle.task().phase() == phase) return true;
    }
    return false;
  }
  const operation::TeleopRecord& last() { return cycle.record(); }

  hal::VirtualClock clock;
  runtime::OpenedRobot robot;
  sim::Hand hand;
  hal::LockstepHapticDevice master;
  operation::TeleopCycle cycle;
};

TEST(TeleopOverTheWire, AnArmThatHomedUnderItsOwnWeightFollowsTheHandAndFeelsTheWall) {
  constexpr double kWall_m = 0.40;
  WireRig rig({.walls = {{.p_W_m = {kWall_m, 0, 0}, .normal_W = -Vector3d::UnitX()}}});
  ASSERT_TRUE(rig.run_until(TeleopPhase::kUnfolding, 60s))
      << control::name(rig.cycle.task().phase()) << ": "
      << describe(rig.cycle.stop_reason(), *rig.robot.robot, &rig.master)
      << ::testing::PrintToString(rig.robot.robot->report());
  // The encoders sit on the motors; gears bend under the weight.
  for (int i = 0; i < 5; ++i)
    EXPECT_NEAR(rig.last().position_rad[static_cast<std::size_t>(4 + i)], rig.robot.manipulator->arm_rad()[i],
                kDegree_rad)
        << "arm " << i + 1;

  ASSERT_TRUE(rig.run_until(TeleopPhase::kOperating, 60s))
      << control::name(rig.cycle.task().phase()) << ": "
      << describe(rig.cycle.stop_reason(), *rig.robot.robot, &rig.master);
  rig.run(500ms);
  EXPECT_EQ(vector(rig.last().contact_force_W_N).norm(), 0);
  const Vector3d start_m = vector(rig.last().true_tip_p_WT_m);
  rig.hand.move_to({0.01, 0.04, 0.03}, 1s);
  rig.run(4s);
  const Vector3d way_m = vector(rig.last().true_tip_p_WT_m) - start_m;
  const Vector3d grip_m = vector(rig.last().grip_p_HD_m);
  // To within what friction, an imperfect model and zeros off by a degree leave of the 700 N/m.
  EXPECT_LT((way_m - Vector3d(-grip_m.x(), -grip_m.y(), grip_m.z())).norm(), 0.015) << way_m.transpose();
  EXPECT_GT(way_m.norm(), 0.03);

  rig.hand.move_to({-0.06, 0.04, 0.03}, 1s);
  rig.run(4s);
  EXPECT_LT(vector(rig.last().contact_force_W_N).x(), -2.0);
  EXPECT_LT(rig.last().true_tip_p_WT_m[0], kWall_m);
  // The end effector's spring acts on the hand, a tenth of it and with x changing sign.
  EXPECT_GT(vector(rig.last().held_force_H_N).x(), 0.2);
  EXPECT_EQ(rig.cycle.task().phase(), TeleopPhase::kOperating);
}

}  // namespace teleop_wire_test
