// The operator, on a robot reduced to what the operator sees: a lag, the thesis' rate control, a wall.
#include "sim/simulated_operator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/no_alloc_guard.h"

namespace simulated_operator_test {

using namespace std::chrono_literals;
using Eigen::Vector3d;
using sim::Hand;
using sim::OperatorParameters;
using sim::SimulatedOperator;
using sim::Task;
using sim::TaskOutcome;
using sim::TaskResult;
namespace tasks = sim::tasks;

constexpr double kPeriod_s = 1e-3;
const Vector3d kStart_m(0.35, 0.0, 0.35);

Vector3d across(const Vector3d& v) { return {-v.x(), -v.y(), v.z()}; }  // half a turn about z

/// The end effector follows its set-point with a lag, or creeps if it is pulled against the wall; a tenth of
/// the coupling spring's force acts on the hand.
struct Robot {
  double lag_s = 0.15;
  double rate_m_per_s = 0.15;
  double scale = 1.0;
  std::optional<double> wall_x_m{};
  Vector3d target_m = kStart_m;
  Vector3d tip_m = kStart_m;

  void step(const Vector3d& p_HD_m) {
    // Thesis 3.4.3, in its order; x and y have changed sign.
    const Vector3d h = across(p_HD_m);
    const double spheroid = std::sqrt(std::pow((-h.x() + 0.08) / 0.14, 2) + std::pow(h.y() / 0.1, 2) +
                                      std::pow((h.z() - 0.008) / 0.1, 2));
    drives = spheroid >= 1 || h.x() >= 0.042 || h.z() <= -0.066;
    if (drives) {
      target_m += rate_m_per_s * kPeriod_s * h.normalized();
      drift_m = target_m - scale * h;
    } else {
      target_m = scale * h + drift_m;
    }
    tip_m += kPeriod_s / lag_s * (target_m - tip_m);
    if (wall_x_m) tip_m.x() = std::min(tip_m.x(), *wall_x_m);
  }
  Vector3d f_D_H_N() const {
    const Vector3d force_N = across(70.0 * (tip_m - target_m));
    return force_N * std::min(1.0, 8.0 / std::max(1e-9, force_N.norm()));
  }

  bool drives = false;
  Vector3d drift_m = kStart_m;
};

class OperatorAtWork : public testing::Test {
 public:
  void give(std::vector<Task> what, const OperatorParameters& parameters = {}) {
    person.emplace(hand, std::move(what), parameters);
  }
  void cycle() {
    Eigen::Isometry3d X_WT = Eigen::Isometry3d::Identity();
    X_WT.translation() = robot.tip_m;
    person->step(1ms, X_WT);
    hand.advance(robot.f_D_H_N(), 1ms);
    robot.step(hand.p_HD_m());
    time_s += kPeriod_s;
  }
  void work(double limit_s = 60) {
    for (const double end_s = time_s + limit_s; !person->finished() && time_s < end_s;) cycle();
    ASSERT_TRUE(person->finished());
  }
  void run(double duration_s) {
    for (const double end_s = time_s + duration_s; time_s < end_s;) cycle();
  }
  const TaskOutcome& outcome(std::size_t i = 0) const { return person->outcomes()[i]; }

  sim::HandParameters with_stops{.travel = sim::GripTravel{}};
  Hand hand{with_stops};
  Robot robot;
  std::optional<SimulatedOperator> person;
  double time_s = 0;
};

TEST_F(OperatorAtWork, ReachesWhateverTheRobotsLagAndScale) {
  for (const double lag_s : {0.01, 0.15, 0.5, 1.0})
    for (const double scale : {0.5, 1.0, 2.0}) {
      hand.let_go();  // and grasps it wherever the last robot left it
      robot = {.lag_s = lag_s, .scale = scale};
      robot.drift_m = kStart_m - scale * across(hand.p_HD_m());
      const Vector3d there_m = kStart_m + scale * Vector3d(0.02, 0.03, -0.02);
      give({{tasks::Reach{.p_WT_m = there_m}}, {tasks::Reach{.p_WT_m = kStart_m}}}, {.motion_scale = scale});
      while (person->current() == 0) cycle();
      // The operator saw it 0.2 s ago; a slow robot has moved on.
      const double near_m = lag_s < 0.5 ? 0.006 : 0.01;
      EXPECT_LT((robot.tip_m - there_m).norm(), near_m) << lag_s << ' ' << scale;
      work();
      EXPECT_LT((robot.tip_m - kStart_m).norm(), near_m) << lag_s << ' ' << scale;
      for (const TaskOutcome& each : person->outcomes()) {
        EXPECT_EQ(each.result, TaskResult::kDone) << lag_s << ' ' << scale;
        EXPECT_LT(each.duration, lag_s < 0.5 ? 4s : 12s) << lag_s << ' ' << scale;
        EXPECT_TRUE(std::isnan(each.mean_path_error_m));
      }
    }
}

TEST_F(OperatorAtWork, WhatHeSeesHeAnswersAfterHisReactionTime) {
  for (const auto reaction : {100ms, 200ms, 350ms}) {
    hand.hold_at(Vector3d::Zero());
    robot = {};
    give({{tasks::Reach{.p_WT_m = kStart_m, .settle = 10s}}}, {.reaction = reaction});
    run(1.0);
    EXPECT_EQ(hand.intended_p_HD_m(), Vector3d::Zero());  // the end effector is at its target
    robot.drift_m.y() += 0.03;                            // a push moves it to the left
    robot.tip_m.y() += 0.03;
    const double moved_s = time_s;
    while (hand.intended_p_HD_m().isZero(1e-9) && time_s < moved_s + 2) cycle();
    const double reaction_s = std::chrono::duration<double>(reaction).count();
    EXPECT_GE(time_s - moved_s, reaction_s);
    EXPECT_LE(time_s - moved_s, reaction_s + 0.015);  // of a glance each 10 ms, and the start of minimum jerk
    run(0.1);
    EXPECT_GT(hand.intended_p_HD_m().y(), 0.0);  // the operator's right is the robot's right
  }
}

TEST_F(OperatorAtWork, CorrectsInMovementsWithRestsBetween) {
  // An immovable end effector: each correction adds to the last.
  robot.lag_s = 1e6;
  give({{tasks::Reach{.p_WT_m = kStart_m + Vector3d(0, 0.01, 0)}, 4s}});
  std::vector<double> begun_s;
  bool still = true;
  while (!person->finished()) {
    const Vector3d before_m = hand.intended_p_HD_m();
    cycle();
    const bool rests = (hand.intended_p_HD_m() - before_m).norm() < 1e-9;
    if (still && !rests) begun_s.push_back(time_s);
    still = rests;
  }
  EXPECT_EQ(outcome().result, TaskResult::kTimedOut);
  EXPECT_EQ(outcome().duration, 4s);
  ASSERT_GE(begun_s.size(), 8U);
  for (std::size_t i = 1; i < begun_s.size(); ++i) EXPECT_NEAR(begun_s[i] - begun_s[i - 1], 0.45, 0.003);
  // The handle stays in the range of position control, however large the error.
  run(20);
  EXPECT_FALSE(robot.drives);
}

TEST_F(OperatorAtWork, FollowsAPathAndKnowsHowFarOffTheTipWas) {
  // A square of 6 cm in the vertical plane.
  const auto corner = [](double y_m, double z_m) -> Vector3d { return kStart_m + Vector3d(0, y_m, z_m); };
  give({{tasks::Follow{{corner(-0.03, -0.03), corner(0.03, -0.03), corner(0.03, 0.03), corner(-0.03, 0.03),
                        corner(-0.03, -0.03)},
                       0.03}}});
  double largest_m = 0;
  while (!person->finished()) {
    cycle();
    if (time_s < 3) continue;  // at the first corner by then, and not yet on the way for long
    const Vector3d p_m = robot.tip_m - kStart_m;
    const double aside_m =
        std::abs(std::max(std::abs(p_m.y()), std::abs(p_m.z())) - 0.03);  // of the nearest side, near enough
    largest_m = std::max({largest_m, aside_m, std::abs(p_m.x())});
  }
  EXPECT_EQ(outcome().result, TaskResult::kDone);
  EXPECT_GT(outcome().duration, 8s);  // 24 cm at 3 cm/s
  EXPECT_LT(outcome().duration, 14s);
  EXPECT_LT(outcome().mean_path_error_m, 0.004);
  EXPECT_GT(outcome().mean_path_error_m, 0.0);
  EXPECT_NEAR(outcome().largest_path_error_m, largest_m, 0.003);
  EXPECT_LT((robot.tip_m - corner(-0.03, -0.03)).norm(), 0.011);
}

TEST_F(OperatorAtWork, ATouchedWallIsFeltHeldAndLeft) {
  robot.wall_x_m = kStart_m.x() + 0.01;
  give({{tasks::Touch{.direction_W = {2, 0, 0}, .felt_N = 1.0, .hold = 2s, .back_off_m = 0.02}}});
  double touching_s = 0;
  while (!person->finished()) {
    cycle();
    touching_s += robot.f_D_H_N().x() > 0.5 ? kPeriod_s : 0;  // towards the operator
  }
  EXPECT_EQ(outcome().result, TaskResult::kDone);
  EXPECT_GE(outcome().largest_force_N, 1.0);
  EXPECT_LT(outcome().largest_force_N, 3.0);  // without leaning on it
  EXPECT_GT(touching_s, 2.0);
  EXPECT_NEAR(robot.tip_m.x(), *robot.wall_x_m - 0.02, 0.006);
}

TEST_F(OperatorAtWork, WhatOnlyDragsIsNoWall) {
  // Fast through free space the lag pulls with more than the touch threshold, until the motion stops.
  robot.lag_s = 0.4;
  give({{tasks::Touch{.felt_N = 0.8, .speed_m_per_s = 0.1}, 5s}});
  work();
  EXPECT_GT(outcome().largest_force_N, 0.8);
  EXPECT_EQ(outcome().result, TaskResult::kTimedOut);
}

TEST_F(OperatorAtWork, PushesTheTipAsFarAsAsked) {
  give({{tasks::Push{.direction_W = {0, -1, 0}, .distance_m = 0.05}}});
  work();
  EXPECT_EQ(outcome().result, TaskResult::kDone);
  EXPECT_LT(robot.tip_m.y(), -0.046);
  EXPECT_GT(robot.tip_m.y(), -0.065);
  EXPECT_NEAR(robot.tip_m.z(), kStart_m.z(), 0.003);
}

TEST_F(OperatorAtWork, DrivesFarByRateControlInEveryDirection) {
  for (const double lag_s : {0.1, 0.6})
    for (const Vector3d& way_m : {Vector3d(1.0, 0, 0), Vector3d(-0.8, 0, 0), Vector3d(0, 1.2, 0),
                                  Vector3d(0.7, -0.7, 0.1), Vector3d(0, 0, 0.3), Vector3d(0, 0, -0.25)}) {
      hand.hold_at(Vector3d::Zero());
      robot = {.lag_s = lag_s};
      const Vector3d there_m = kStart_m + way_m;
      give({{tasks::DriveFar{.p_WT_m = there_m}, 40s}});
      bool drove = false;
      while (!person->finished()) {
        cycle();
        drove |= robot.drives;
      }
      EXPECT_TRUE(drove);
      EXPECT_EQ(outcome().result, TaskResult::kDone) << lag_s << ": " << way_m.transpose();
      EXPECT_LT((robot.tip_m - there_m).norm(), 0.011) << lag_s << ": " << way_m.transpose();
      // Once there and back, no hunting: the way at 0.15 m/s, some seconds of reaching.
      EXPECT_LT(outcome().duration, std::chrono::duration<double>(way_m.norm() / 0.15 + 8))
          << way_m.transpose();
      EXPECT_FALSE(robot.drives);
    }
}

TEST_F(OperatorAtWork, GivingUpADriveHeBringsThePenBack) {
  give({{tasks::DriveFar{.p_WT_m = {50, 0, 0.35}}, 3s}, {tasks::Wait{2s}}});
  while (person->current() == 0) cycle();
  EXPECT_TRUE(robot.drives);
  work();
  EXPECT_EQ(outcome(0).result, TaskResult::kTimedOut);
  EXPECT_FALSE(robot.drives);
  EXPECT_LT(hand.p_HD_m().norm(), 0.01);
}

TEST_F(OperatorAtWork, TurnsThePenAsTheTipIsToTurn) {
  // The robot's end effector rolls to its right about x: about -x of H.
  give({{tasks::Turn{{0.5, 0, 0}, 1s}}, {tasks::Turn{{0, 0, 0.3}, 500ms}}});
  while (person->current() == 0) cycle();
  const Eigen::Quaterniond rolled(Eigen::AngleAxisd(-0.5, Vector3d::UnitX()));
  EXPECT_LT(hand.q_HD().angularDistance(rolled), 1e-5);
  EXPECT_EQ(outcome(0).duration, 1s);
  work();
  EXPECT_LT(hand.q_HD().angularDistance(Eigen::AngleAxisd(0.3, Vector3d::UnitZ()) * rolled), 1e-5);
}

TEST_F(OperatorAtWork, DoesTheRestAtOnceAndInOrder) {
  give({{tasks::Button{0, true}},
        {tasks::Button{3, true}},
        {tasks::Button{0, false}},
        {tasks::LetGo{}},
        {tasks::Wait{50ms}},
        {tasks::TakeHold{}}});
  hal::HapticSample sample;
  std::vector<std::uint32_t> buttons;
  std::vector<bool> holds;
  for (int i = 0; i < 5; ++i) {
    cycle();
    hand.measure(sample);
    buttons.push_back(sample.buttons);
    holds.push_back(hand.holds());
  }
  EXPECT_EQ(buttons, (std::vector<std::uint32_t>{1, 9, 8, 8, 8}));
  EXPECT_EQ(holds, (std::vector<bool>{true, true, true, false, false}));
  EXPECT_EQ(outcome(4).result, TaskResult::kUnderWay);
  EXPECT_EQ(outcome(5).result, TaskResult::kNotBegun);
  work();
  EXPECT_TRUE(hand.holds());
  EXPECT_EQ(outcome(4).duration, 50ms);
  EXPECT_EQ(name_of(person->tasks()[5]), "take hold");
}

TEST_F(OperatorAtWork, EqualRunsAreEqualToTheLastBit) {
  struct Again : OperatorAtWork {
    void TestBody() override {
      robot.wall_x_m = 0.36;
      give({{tasks::Touch{}}, {tasks::Reach{.p_WT_m = kStart_m}}});
      work();
    }
  };
  Again one, other;
  one.TestBody();
  other.TestBody();
  EXPECT_EQ(one.robot.tip_m, other.robot.tip_m);
  EXPECT_EQ(one.outcome(1).duration, other.outcome(1).duration);
  EXPECT_GT(one.outcome(1).duration, 0s);
}

TEST_F(OperatorAtWork, RefusesWhatMakesNoSenseAndSaysWhere) {
  const auto refusal = [this](Task task, const OperatorParameters& parameters = {}) -> std::string {
    try {
      give({{tasks::LetGo{}}, std::move(task)}, parameters);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return {};
  };
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refusal({tasks::Wait{}}), "");
  EXPECT_EQ(refusal({tasks::Button{32, true}}), "task 2 (button): index is 32, must be 0 to 31");
  EXPECT_EQ(refusal({tasks::Push{.distance_m = -1}}),
            "task 2 (push): distance_m is -1.000000, must be finite and positive");
  EXPECT_EQ(refusal({tasks::Follow{{kStart_m}}}), "task 2 (follow): points_W_m needs two points or more");
  EXPECT_NE(refusal({tasks::Reach{.p_WT_m = {0, kNaN, 0}}}), "");
  EXPECT_NE(refusal({tasks::Touch{.direction_W = Vector3d::Zero()}}), "");
  EXPECT_NE(refusal({tasks::DriveFar{.tolerance_m = 0}}), "");
  EXPECT_NE(refusal({tasks::Turn{.duration = -1s}}), "");
  EXPECT_NE(refusal({tasks::Wait{}, 0s}), "");
  EXPECT_EQ(refusal({tasks::Wait{}}, {.reaction = -200ms}),
            "operator: reaction is -0.200000 s, must not be negative");
  OperatorParameters outside;
  outside.boundary.least_z_m = 0.01;
  EXPECT_NE(refusal({tasks::Wait{}}, outside), "");
}

TEST_F(OperatorAtWork, AStepDoesNotAllocateOrLock) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc";
  robot.wall_x_m = 0.36;
  give({{tasks::Reach{.p_WT_m = kStart_m}},
        {tasks::Follow{{kStart_m, kStart_m + Vector3d(0, 0.02, 0)}}},
        {tasks::Touch{}},
        {tasks::DriveFar{.p_WT_m = kStart_m + Vector3d(-0.5, 0, 0)}},
        {tasks::Turn{{1, 0, 0}}},
        {tasks::LetGo{}},
        {tasks::TakeHold{}}});
  const support::NoAllocGuard guard;
  for (int i = 0; i < 60'000; ++i) cycle();
  EXPECT_EQ(guard.violations(), 0);
  EXPECT_TRUE(person->finished());
  for (const TaskOutcome& each : person->outcomes()) EXPECT_EQ(each.result, TaskResult::kDone);
}

}  // namespace simulated_operator_test
