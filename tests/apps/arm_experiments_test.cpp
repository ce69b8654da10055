// Experiments on joints with end stops, compared with the simulated robot's true state.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <numbers>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "apps/youbot_bench/experiment_recording.h"
#include "apps/youbot_bench/experiment_runner.h"
#include "apps/youbot_bench/experiment_task.h"
#include "hal/youbot_axes.h"
#include "identification/experiments/compensation.h"
#include "identification/experiments/dahl.h"
#include "identification/experiments/reversals.h"
#include "identification/experiments/staircase.h"
#include "identification/experiments/steady_state.h"
#include "identification/experiments/stick_slip.h"
#include "identification/experiments/torque_ramp.h"
#include "identification/experiments/torque_wave.h"
#include "model/friction/any_law.h"
#include "model/friction/law_compensator.h"
#include "model/friction/sliding_table.h"
#include "runtime/open_robot.h"
#include "runtime/recording/recording_reader.h"
#include "sim/mobile_manipulator.h"
#include "tests/hal/can_bench.h"
#include "tests/support/built_paths.h"
#include "tests/support/no_alloc_guard.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/watched_robot.h"

namespace youbot_bench {
namespace arm_experiments_test {

using namespace std::chrono_literals;
namespace ex = identification::experiments;
namespace fs = std::filesystem;
using Make = std::function<std::unique_ptr<ex::JointExperiment>(const hal::JointInfo&, double period_s)>;

// Robot description: end stops in degrees from where homing ends, effort limits.
constexpr std::array<double, 5> kEnd_deg{338, 155, -297, 205, 335};
constexpr std::array<double, 5> kEffort_Nm{9.5, 9.5, 6, 2, 1};

std::vector<hal::JointInfo> base_and_arm() {
  std::vector<hal::JointInfo> all;
  for (int i = 1; i <= 4; ++i) all.push_back(hal::joint_info("wheel-" + std::to_string(i), hal::kWheelAxis));
  for (std::size_t i = 0; i < 5; ++i)
    all.push_back(hal::joint_info("arm-" + std::to_string(i + 1), hal::kArmAxes[i]));
  return all;
}

/// What links and motors of an arm did.
struct ArmRecord {
  explicit ArmRecord(const sim::MobileManipulator& robot)
      : lowest_rad(robot.arm_rad()), highest_rad(robot.arm_rad()) {}

  void add(const sim::MobileManipulator& robot) {
    for (int i = 0; i < 5; ++i)
      if (std::abs(robot.joint(i).drive().motor_torque_Nm()) > kEffort_Nm[static_cast<std::size_t>(i)])
        ++overloaded_ms[static_cast<std::size_t>(i)];
    lowest_rad = lowest_rad.cwiseMin(robot.arm_rad());
    highest_rad = highest_rad.cwiseMax(robot.arm_rad());
  }
  /// `pressed_rad`: homing leaves joints pressed into their stops by so much. `overload_ms`: above their
  /// effort limit.
  void expect_unharmed(double pressed_rad = 0.0, int overload_ms = 0) const {
    for (int i = 0; i < 5; ++i) {
      const auto joint = static_cast<std::size_t>(i);
      const double end_rad = kEnd_deg[joint] * std::numbers::pi / 180;
      EXPECT_GT(lowest_rad[i], std::min(0.0, end_rad) - pressed_rad) << "arm-" << i + 1;
      EXPECT_LT(highest_rad[i], std::max(0.0, end_rad) + pressed_rad) << "arm-" << i + 1;
      EXPECT_LE(overloaded_ms[joint], overload_ms) << "arm-" << i + 1;
    }
  }

  control::ArmVector lowest_rad;
  control::ArmVector highest_rad;
  std::array<int, 5> overloaded_ms{};
};

/// Base off the ground, arm in a given pose; it records while the drives are on.
class JudgedRobot final : public hal::Robot {
  sim::MobileManipulator manipulator_;

 public:
  explicit JudgedRobot(const sim::MobileManipulatorParameters& parameters)
      : manipulator_(parameters), record(manipulator_), robot_(manipulator_, clock, 1ms, base_and_arm()) {}

  std::span<const hal::JointInfo> joints() const noexcept override { return robot_.joints(); }
  void activate() override { robot_.activate(); }
  void deactivate() noexcept override { robot_.deactivate(); }
  hal::CycleStatus exchange(const hal::RobotCommand& command, hal::RobotSample& sample) noexcept override {
    hal::RobotCommand acting = command;
    for (hal::JointCommand& joint : std::span(acting.joints).subspan(4, 5)) {
      moved = moved || (command.enable && joint.target != 0);
      if (loses_sign) joint.target = std::abs(joint.target);
    }
    const hal::CycleStatus status = robot_.exchange(acting, sample);
    if (command.enable) record.add(manipulator_);
    if (forgets_homing >= 0) sample.joints[static_cast<std::size_t>(4 + forgets_homing)].homed = false;
    return status;
  }

  hal::VirtualClock clock;
  bool moved = false;       ///< a command asked it to
  int forgets_homing = -1;  ///< joint of the arm, from 0
  bool loses_sign = false;  ///< its arm only turns one way
  ArmRecord record;

 private:
  support::WatchedLoopback robot_;
};

/// Records what becomes of the arm once it is homed.
class JudgedBus final : public hal::RobotWrapper {
 public:
  JudgedBus(hal::Robot& robot, const sim::MobileManipulator& manipulator)
      : RobotWrapper(robot), manipulator_(manipulator) {}
  hal::CycleStatus exchange(const hal::RobotCommand& command, hal::RobotSample& sample) noexcept override {
    const hal::CycleStatus status = RobotWrapper::exchange(command, sample);
    if (sample.enabled && !record) record.emplace(manipulator_);
    if (record) record->add(manipulator_);
    return status;
  }
  std::optional<ArmRecord> record;

 private:
  const sim::MobileManipulator& manipulator_;
};

/// A joint on a bench rig, whose cable carries frames while time passes.
class PumpedBench final : public hal::Robot {
 public:
  explicit PumpedBench(hal::test::CanBench& bench) : bench_(bench) {}
  std::span<const hal::JointInfo> joints() const noexcept override { return bench_.robot->joints(); }
  void activate() override { bench_.robot->activate(); }
  void deactivate() noexcept override { bench_.robot->deactivate(); }
  hal::CycleStatus exchange(const hal::RobotCommand& command, hal::RobotSample& sample) noexcept override {
    const hal::CycleStatus status = bench_.robot->exchange(command, sample);
    bench_.cable.wait(bench_.period);
    return status;
  }

 private:
  hal::test::CanBench& bench_;
};

struct Pose {
  const char* name;
  control::ArmVector arm_rad;
};
const std::array<Pose, 4> kPoses{{{"folded", {0.2, 0.2, -0.2, 0.2, 0.2}},
                                  {"straight up", {2.9496, 1.1345, -2.5482, 1.7890, 2.9234}},
                                  {"stretched forward", {2.9496, 2.3, -2.5482, 1.7890, 2.9234}},
                                  {"near the other ends", {5.6, 2.4, -4.8, 3.2, 5.4}}}};

struct Experiment {
  const char* name;
  Make make;
  double max_travel_rad = 0.0;
};

/// All there are, as they are for a wheel.
std::vector<Experiment> for_wheels() {
  return {
      {"steady-state",
       [](const auto&, double period_s) {
         return std::make_unique<ex::SteadyState>(ex::SteadyStateConfig{.sets = "1,9"}, period_s);
       }},
      {"torque-ramp",
       [](const auto&, double period_s) {
         return std::make_unique<ex::TorqueRamp>(ex::TorqueRampConfig{}, 1e-5, period_s);
       },
       3},
      {"dahl", [](const auto&, double) { return std::make_unique<ex::Dahl>(ex::DahlConfig{}, 1e-5); }, 0.5},
      {"presliding",
       [](const auto&, double period_s) {
         return std::make_unique<ex::TorqueWave>(ex::PreslidingConfig{}, period_s);
       },
       0.5},
      {"stick-slip",
       [](const auto&, double) { return std::make_unique<ex::StickSlip>(ex::StickSlipConfig{}); }, 20},
      {"staircase",
       [](const auto&, double) { return std::make_unique<ex::Staircase>(ex::StaircaseConfig{}); }},
      {"reversals",
       [](const auto&, double) { return std::make_unique<ex::Reversals>(ex::ReversalsConfig{}); }},
      {"multisine",
       [](const auto&, double period_s) {
         return std::make_unique<ex::TorqueWave>(ex::MultisineConfig{}, period_s);
       }},
  };
}

/// The same, chosen for an arm.
std::vector<Experiment> for_arms() {
  return {
      {"steady-state",
       [](const auto&, double period_s) {
         return std::make_unique<ex::SteadyState>(
             ex::SteadyStateConfig{.settle_s = 1, .measure_s = 0.5, .extra_s = 0},
             std::vector<double>{0.1, -0.1, 0.2, -0.2}, period_s);
       }},
      {"torque-ramp",
       [](const auto&, double period_s) {
         return std::make_unique<ex::TorqueRamp>(
             ex::TorqueRampConfig{
                 .rest_s = 0.5, .rate_Nm_per_s = 0.5, .highest_torque_Nm = 0.9, .repeats = 1},
             1e-5, period_s);
       },
       0.1},
      {"dahl",
       [](const auto&, double) {
         return std::make_unique<ex::Dahl>(
             ex::DahlConfig{.amplitude_Nm = 0.2, .frequency_Hz = 1, .cycles = 3, .rest_s = 0.5}, 1e-5);
       },
       0.1},
      {"presliding",
       [](const auto&, double period_s) {
         return std::make_unique<ex::TorqueWave>(
             ex::PreslidingConfig{.peak_Nm = 0.2, .lowest_Hz = 0.5, .period_s = 2, .periods = 1}, period_s);
       },
       0.1},
      {"stick-slip",
       [](const auto&, double) {
         return std::make_unique<ex::StickSlip>(ex::StickSlipConfig{
             .stiffness_Nm_per_rad = 5, .torque_limit_Nm = 0.9, .duration_s = 5, .rest_s = 0.5});
       },
       0.5},
      {"compensation",
       [](const auto&, double period_s) {
         return std::make_unique<ex::Compensation>(
             ex::CompensationConfig{.push_Nm = 0.9, .torque_limit_Nm = 0.9, .duration_s = 4, .rest_s = 0.5},
             model::friction::law_table(model::friction::make_law("coulomb")), 1.0, period_s);
       },
       0.5},
      {"staircase",  // drives joint 5 against the limit of its travel
       [](const auto&, double) {
         return std::make_unique<ex::Staircase>(
             ex::StaircaseConfig{.step = 0.45, .highest = 0.9, .hold_s = 0.5});
       },
       0.5},
      {"staircase",
       [](const auto&, double) {
         return std::make_unique<ex::Staircase>(
             ex::StaircaseConfig{.quantity = "velocity", .step = 0.1, .highest = 0.2, .hold_s = 0.2});
       }},
      {"reversals",
       [](const auto&, double) {
         return std::make_unique<ex::Reversals>(
             ex::ReversalsConfig{.highest_rad_per_s = 0.4, .lowest_rad_per_s = 0.1, .period_s = 1});
       }},
      {"multisine",
       [](const auto&, double period_s) {
         return std::make_unique<ex::TorqueWave>(
             ex::MultisineConfig{
                 .peak_Nm = 0.9, .lowest_Hz = 0.5, .period_s = 2, .rest_s = 0.5, .periods = 2},
             period_s);
       },
       0.5},
  };
}

class ArmExperiment : public ::testing::Test {
 protected:
  struct Result {
    std::string refused;
    ExperimentOutcome outcome;
    std::unique_ptr<JudgedRobot> robot;
    fs::path directory;
  };

  static sim::MobileManipulatorParameters in_pose(const control::ArmVector& arm_rad) {
    sim::MobileManipulatorParameters parameters;
    parameters.wheels.on_ground = false;
    parameters.start_rad = arm_rad;
    return parameters;
  }

  Result run(const Experiment& experiment, int joint, const sim::MobileManipulatorParameters& parameters,
             std::optional<double> start_rad = {}) {
    Result result{.refused = {},
                  .outcome = {},
                  .robot = std::make_unique<JudgedRobot>(parameters),
                  .directory = directory / std::to_string(++runs_)};
    const ExperimentPlan plan{.name = experiment.name,
                              .result = experiment.make({}, 1e-3)->result_columns().empty()
                                            ? ""
                                            : experiment.name + std::string("-result"),
                              .make = experiment.make,
                              .configuration = ""};
    const ExperimentOptions options{.joints = {"arm-" + std::to_string(joint)},
                                    .directory = result.directory,
                                    .virtual_time = true,
                                    .quiet = true,
                                    .record_rate_Hz = 100,
                                    .max_travel_rad = experiment.max_travel_rad,
                                    .start_rad = start_rad};
    try {
      result.outcome = run_experiment(plan, options, *result.robot, result.robot->clock, stop);
    } catch (const std::invalid_argument& error) {
      result.refused = error.what();
    }
    return result;
  }

  /// Refused before it moves, or it ends without harm; says why, and holds no result that is not a number
  /// without a reason.
  static void judge(const Result& result, int joint) {
    const std::string name = "arm-" + std::to_string(joint);
    result.robot->record.expect_unharmed();
    if (!result.refused.empty()) {
      EXPECT_NE(result.refused.find(name), std::string::npos) << result.refused;
      EXPECT_FALSE(result.robot->moved) << result.refused;
      EXPECT_FALSE(fs::exists(result.directory)) << result.refused;
      return;
    }
    if (result.outcome.fault.empty())
      EXPECT_EQ(result.outcome.finished, result.outcome.planned);
    else
      EXPECT_NE(result.outcome.fault.find(name), std::string::npos) << result.outcome.fault;
    EXPECT_TRUE(result.outcome.recording_problems.empty()) << result.outcome.recording_problems.front();
    bool has_nan = false;
    for (const auto& file : fs::recursive_directory_iterator(result.directory))
      if (file.path().extension() == ".csv") has_nan = has_nan || rows_with_nan(file.path()) > 0;
    EXPECT_EQ(has_nan, !result.outcome.not_measured.empty());
  }

  static int rows_with_nan(const fs::path& path) {
    std::ifstream file(path);
    int count = 0;
    for (std::string line; std::getline(file, line);)
      if (!line.starts_with("#") && line.find("nan") != std::string::npos) ++count;
    return count;
  }
  static std::size_t lines(const fs::path& path) {
    std::ifstream file(path);
    std::size_t count = 0;
    for (std::string line; std::getline(file, line);) ++count;
    return count;
  }

  support::TemporaryDirectory directory;
  std::atomic<bool> stop{false};
  std::vector<std::unique_ptr<hal::test::CanBench>> benches;

 private:
  int runs_ = 0;
};

TEST_F(ArmExperiment, ThoseForWheelsAreRefusedOrEndWithinRangeAndTorque) {
  for (const Pose& pose : {kPoses[0], kPoses[1]})
    for (const Experiment& experiment : for_wheels())
      for (int joint = 1; joint <= 5; ++joint) {
        SCOPED_TRACE(std::string(pose.name) + ", " + experiment.name + ", arm-" + std::to_string(joint));
        judge(run(experiment, joint, in_pose(pose.arm_rad)), joint);
      }
}

TEST_F(ArmExperiment, ThoseForArmsAreRefusedOrEndWithinRangeAndTorque) {
  for (const Pose& pose : kPoses)
    for (const Experiment& experiment : for_arms())
      for (int joint = 1; joint <= 5; ++joint) {
        SCOPED_TRACE(std::string(pose.name) + ", " + experiment.name + ", arm-" + std::to_string(joint));
        judge(run(experiment, joint, in_pose(pose.arm_rad)), joint);
      }
}

TEST_F(ArmExperiment, WhatFitsIsMeasured) {
  // Friction of the simulated joints: Coulomb and viscous, sim/bus/axis_data.h.
  const std::vector<Experiment> experiments = for_arms();
  for (int joint = 1; joint <= 5; ++joint) {
    SCOPED_TRACE("arm-" + std::to_string(joint));
    const Result map = run(experiments[0], joint, in_pose(kPoses[1].arm_rad));
    EXPECT_EQ(map.refused, "");
    EXPECT_EQ(map.outcome.fault, "");
    EXPECT_EQ(map.outcome.finished, 4);
    EXPECT_TRUE(map.outcome.not_measured.empty());
    if (joint != 1 && joint != 5) continue;  // the others bear weight, too
    const fs::path file = map.directory / "steady-state-result" / ("arm-" + std::to_string(joint) + ".csv");
    const sim::bus::ArmJointData& data = sim::bus::kArmJointData[static_cast<std::size_t>(joint - 1)];
    const runtime::ReadRecording read = runtime::read_recording(file, runtime::NotMeasured::kTaken);
    for (std::size_t i = 0; i < read.recording.rows(); ++i) {
      const double velocity = read.recording.column("velocity_rad_per_s")[i];
      const double friction_Nm = data.coulomb_Nm + data.viscous_Nm_s_per_rad * std::abs(velocity);
      EXPECT_NEAR(read.recording.column("torque_measured_Nm")[i], std::copysign(friction_Nm, velocity),
                  0.03 * friction_Nm);
    }
  }
  // A joint that bears weight, with so little travel that the weight hardly grows on it.
  const Experiment ramp{"torque-ramp",
                        [](const auto&, double period_s) {
                          return std::make_unique<ex::TorqueRamp>(
                              ex::TorqueRampConfig{.rest_s = 0.5,
                                                   .rate_Nm_per_s = 0.5,
                                                   .highest_torque_Nm = 4,
                                                   .breakaway_travel_rad = 0.005,
                                                   .repeats = 1},
                              1e-5, period_s);
                        },
                        0.03};
  const Result broke = run(ramp, 2, in_pose(kPoses[1].arm_rad));
  EXPECT_EQ(broke.refused, "");
  EXPECT_EQ(broke.outcome.fault, "");
  EXPECT_TRUE(broke.outcome.not_measured.empty());
  broke.robot->record.expect_unharmed();
}

TEST_F(ArmExperiment, ARefusalNamesNeedAndLimitAndWhatToDo) {
  const auto refused = [&](const Experiment& experiment, int joint, const control::ArmVector& arm_rad,
                           std::optional<double> start_rad = {}) {
    return run(experiment, joint, in_pose(arm_rad), start_rad).refused;
  };
  const control::ArmVector up = kPoses[1].arm_rad;
  const auto steady = [](std::vector<double> velocities, double settle_s) {
    return Experiment{"steady-state", [=](const auto&, double period_s) {
                        return std::make_unique<ex::SteadyState>(
                            ex::SteadyStateConfig{.settle_s = settle_s, .measure_s = 1, .extra_s = 0},
                            velocities, period_s);
                      }};
  };
  const auto push = [](double torque_Nm, double max_travel_rad) {
    return Experiment{"staircase",
                      [=](const auto&, double) {
                        return std::make_unique<ex::Staircase>(
                            ex::StaircaseConfig{.step = torque_Nm, .highest = torque_Nm, .hold_s = 0.1});
                      },
                      max_travel_rad};
  };
  EXPECT_EQ(
      refused(steady({2.0}, 1), 2, up),
      "--joint arm-2: steady-state turns it at up to 2 rad/s, and its limit is 1.57 rad/s: choose lower "
      "speeds");
  // 0.5 rad/s for 50 s and 31 s, as in the thesis for a wheel.
  EXPECT_EQ(
      refused(steady({0.5}, 50), 2, up),
      "--joint arm-2: steady-state may turn it by 25.5 rad, and it has 2.51 rad: choose fewer, slower or "
      "shorter runs, or reversals, which come back");
  EXPECT_EQ(refused(push(10, 0.1), 1, up),
            "--joint arm-1: staircase pushes it with up to 10 N·m, and its limit is 9.5 N·m: choose a lower "
            "torque");
  EXPECT_EQ(refused(push(1.1, 0.1), 5, up),
            "--joint arm-5: staircase pushes it with up to 1.1 N·m, and its limit is 1 N·m: choose a lower "
            "torque");
  EXPECT_EQ(
      refused(push(1, 0), 1, up),
      "--joint arm-1: staircase pushes it freely, and it has 5.73 rad to turn: say with --max-travel how "
      "far it may go");
  EXPECT_EQ(refused(push(1, 3), 1, up),
            "--joint arm-1: staircase may turn it by 6 rad, and it has 5.73 rad: lower --max-travel");
  EXPECT_EQ(refused(push(0.5, 0.3), 5, kPoses[0].arm_rad),
            "--joint arm-5: staircase needs 0.35 rad below where it begins, and there are 0.0894 rad: begin "
            "higher up, with --start, or lower --max-travel");
  EXPECT_EQ(refused(push(0.5, 0.3), 5, up, 6.0),
            "--joint arm-5: staircase cannot begin at --start 6 rad, outside 0.161 to 5.59 rad");
  // Stretched out, first moments about joint 2 are 0.478, 0.276 and 0.108 kg·m (youbot.urdf).
  const std::string heavy = refused(steady({0.1}, 1), 2, kPoses[2].arm_rad);
  EXPECT_NE(heavy.find("of the arm's weight on its way, and 7.12 N·m leave enough"), std::string::npos)
      << heavy;
  const std::string falls = refused(push(0.5, 0.1), 2, up);
  EXPECT_NE(falls.find("leaves it without torque"), std::string::npos) << falls;
}

TEST_F(ArmExperiment, SeveralJointsOfAnArmOrOneThatIsNotHomedAreRefused) {
  JudgedRobot robot(in_pose(kPoses[1].arm_rad));
  const Experiment reversals = for_arms()[8];
  const ExperimentPlan plan{.name = "reversals", .result = "", .make = reversals.make, .configuration = ""};
  ExperimentOptions options{
      .joints = {"arm-1", "arm-2"}, .directory = directory / "run", .virtual_time = true, .quiet = true};
  EXPECT_THROW((void)run_experiment(plan, options, robot, robot.clock, stop), std::invalid_argument);
  options.joints = {"arm-1", "wheel-1"};
  EXPECT_THROW((void)run_experiment(plan, options, robot, robot.clock, stop), std::invalid_argument);
  robot.forgets_homing = 3;
  options.joints = {"arm-2"};
  try {
    (void)run_experiment(plan, options, robot, robot.clock, stop);
    FAIL() << "a joint moves whose weight is not known";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("arm-4 does not know where it stands"), std::string::npos)
        << error.what();
  }
  EXPECT_FALSE(robot.moved);
  EXPECT_FALSE(fs::exists(options.directory));
}

TEST_F(ArmExperiment, AnObstacleStopsItAndWhatWasRecordedStays) {
  const Experiment reversals{
      "reversals", [](const auto&, double) {
        return std::make_unique<ex::Reversals>(ex::ReversalsConfig{.highest_rad_per_s = 0.4, .period_s = 4});
      }};
  for (int joint = 1; joint <= 5; ++joint) {
    SCOPED_TRACE("arm-" + std::to_string(joint));
    sim::MobileManipulatorParameters parameters = in_pose(kPoses[1].arm_rad);
    parameters.arm[static_cast<std::size_t>(joint - 1)].upper_stop_rad =
        parameters.start_rad[joint - 1] + 0.2;
    const Result result = run(reversals, joint, parameters);
    EXPECT_EQ(result.refused, "");
    const std::string fault = result.outcome.fault;
    EXPECT_NE(fault.find("arm-" + std::to_string(joint) + " "), std::string::npos) << fault;
    EXPECT_TRUE(fault.find("is blocked") != std::string::npos ||
                fault.find("more than the") != std::string::npos)
        << fault;
    // The drive's own velocity loop pushes before the contact can be detected.
    result.robot->record.expect_unharmed(0, 40);
    EXPECT_GT(lines(result.directory / "reversals" / ("arm-" + std::to_string(joint) + ".csv")), 50U);
    EXPECT_TRUE(fs::exists(result.directory / "report.html"));
  }
}

TEST_F(ArmExperiment, AJointThatDoesNotStopAsItShouldIsStoppedBeforeItsEnd) {
  // Its commands come back to where they began.
  JudgedRobot robot(in_pose(kPoses[1].arm_rad));
  robot.loses_sign = true;
  const Experiment reversals{"reversals", [](const auto&, double) {
                               return std::make_unique<ex::Reversals>(ex::ReversalsConfig{
                                   .highest_rad_per_s = 0.8, .period_s = 4, .periods = 9});
                             }};
  const ExperimentOutcome outcome = run_experiment(
      {.name = "reversals", .result = "", .make = reversals.make, .configuration = ""},
      {.joints = {"arm-2"}, .directory = directory / "run", .virtual_time = true, .quiet = true}, robot,
      robot.clock, stop);
  EXPECT_NE(outcome.fault.find("arm-2 came near the end of its range"), std::string::npos) << outcome.fault;
  robot.record.expect_unharmed();
}

TEST_F(ArmExperiment, ItIsTakenToItsStartFirst) {
  const Experiment reversals = for_arms()[8];
  for (int joint = 1; joint <= 5; ++joint) {
    SCOPED_TRACE("arm-" + std::to_string(joint));
    const double start_rad = joint == 3 ? -1.2 : 1.2;
    const Result result = run(reversals, joint, in_pose(kPoses[0].arm_rad), start_rad);
    EXPECT_EQ(result.refused, "");
    EXPECT_EQ(result.outcome.fault, "");
    result.robot->record.expect_unharmed();
    std::ifstream file(result.directory / "reversals" / ("arm-" + std::to_string(joint) + ".csv"));
    std::string line;
    while (std::getline(file, line) && (line.starts_with("#") || line.starts_with("time_s"))) {
    }
    std::istringstream cells(line);
    std::array<std::string, 3> cell;  // time, torque, position
    for (std::string& each : cell) std::getline(cells, each, ',');
    EXPECT_NEAR(std::stod(cell[2]), start_rad, 0.006);
  }
}

TEST_F(ArmExperiment, TheCycleDoesNotAllocateOrLock) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the allocation guard is off under a sanitizer";
  JudgedRobot robot(in_pose(kPoses[0].arm_rad));
  const Experiment reversals = for_arms()[8];
  constexpr std::size_t kArm2 = 5;
  std::vector<ExperimentTask::Joint> joints;
  joints.push_back({kArm2, reversals.make(robot.joints()[kArm2], 1e-3)});
  const auto rehearsed = reversals.make(robot.joints()[kArm2], 1e-3);
  joints.front().fit.emplace(
      JointFit::Plan{
          .experiment = "reversals", .demand = ex::rehearse(*rehearsed, 0, 1e-3), .start_rad = 1.0},
      robot.joints(), kArm2);
  ExperimentRecording recording({.directory = directory / "run",
                                 .experiment = "reversals",
                                 .result = "",
                                 .joints = {"arm-2"},
                                 .commands = {.velocity = true}},
                                false);
  ExperimentCycle cycle({}, robot, std::move(joints), recording);
  robot.activate();
  {
    const support::NoAllocGuard guard;
    while (!cycle.finished()) {
      robot.clock.sleep_until(robot.clock.now() + 1ms);
      cycle.step(robot.clock.now());
    }
    EXPECT_EQ(guard.violations(), 0);
  }
  EXPECT_FALSE(cycle.stop_reason());
  recording.close();
}

TEST_F(ArmExperiment, OnTheEmulatedBusItIsHomedTakenToItsStartAndMeasured) {
  for (int joint = 1; joint <= 5; ++joint) {
    SCOPED_TRACE("arm-" + std::to_string(joint));
    runtime::RobotOptions options;
    options.name = "wire";
    options.ethercat.kind = hal::YoubotKind::kBaseAndArm;
    options.ethercat.home_arms = true;
    options.simulation.on_ground = false;
    hal::VirtualClock clock;
    const runtime::OpenedRobot opened = runtime::open_robot(options, clock, 1ms);
    JudgedBus robot(*opened.robot, *opened.manipulator);
    const Experiment reversals = for_arms()[8];
    const ExperimentOutcome outcome =
        run_experiment({.name = "reversals", .result = "", .make = reversals.make, .configuration = ""},
                       {.joints = {"arm-" + std::to_string(joint)},
                        .directory = directory / std::to_string(joint),
                        .virtual_time = true,
                        .quiet = true,
                        .start_rad = joint == 3 ? -1.0 : 1.0},
                       robot, clock, stop);
    EXPECT_EQ(outcome.fault, "");
    EXPECT_EQ(outcome.finished, 1);
    ASSERT_TRUE(robot.record);
    robot.record->expect_unharmed(2e-3);
    EXPECT_GT((robot.record->highest_rad - robot.record->lowest_rad)[joint - 1], 0.9) << "it did not move";
  }
}

TEST_F(ArmExperiment, AnArmJointOnABenchRigNeedsItsRangeInTheConfiguration) {
  const auto run_there = [&](const hal::CanOptions& can, hal::test::CanBench*& kept) {
    sim::bus::ArmJointData joint = sim::bus::kArmJointData[4];
    joint.lower_stop_rad = -2;
    joint.upper_stop_rad = 2;
    sim::can::BenchRigOptions rig{.joint = joint};
    rig.board.axis = joint.axis;
    benches.push_back(std::make_unique<hal::test::CanBench>(can, rig));
    kept = benches.back().get();
    const Experiment reversals = for_arms()[8];
    PumpedBench robot(*kept);
    return run_experiment({.name = "reversals", .result = "", .make = reversals.make, .configuration = ""},
                          {.joints = {"arm-5"},
                           .directory = directory / std::to_string(benches.size()),
                           .virtual_time = true,
                           .quiet = true},
                          robot, kept->clock, stop);
  };
  hal::CanOptions can{.joint_name = "arm-5", .axis = hal::kArmAxes[4]};
  hal::test::CanBench* bench = nullptr;
  try {
    (void)run_there(can, bench);
    FAIL() << "its position is not known";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("range_rad in [can]"), std::string::npos) << error.what();
  }
  EXPECT_NEAR(bench->rig.joint().position_rad(), 0, 0.01);
  can.axis.range = {-1, 1};
  can.range_is_stated = true;
  EXPECT_EQ(run_there(can, bench).fault, "");
  can.axis.range = {-0.02, 1};
  EXPECT_THROW((void)run_there(can, bench), std::invalid_argument);
}

using support::CommandResult;

TEST_F(ArmExperiment, TheProgramEndsWithTwoOrFourAndSaysWhy) {
  const auto bench = [&](const std::string& arguments, const char* out) {
    return support::run_command(support::program("youbot-bench") + " " + arguments +
                                " --quiet --kind base+arm --out " + (directory / out).string());
  };
  const CommandResult steady = bench("steady-state --joint arm-2", "a");
  EXPECT_EQ(steady.exit_code, 2);
  EXPECT_NE(steady.output.find("arm-2"), std::string::npos) << steady.output;
  EXPECT_FALSE(fs::exists(directory / "a"));
  EXPECT_EQ(bench("reversals --joint arm-2 --highest 0.3 --start soon", "a").exit_code, 2);
  EXPECT_EQ(bench("reversals --joint wheel-2 --highest 0.3 --start 1", "a").exit_code, 2);
  const CommandResult fits = bench("reversals --joint arm-2 --highest 0.3 --start 1.1", "b");
  EXPECT_EQ(fits.exit_code, 0) << fits.output;
  const CommandResult far =
      bench("staircase --joint arm-5 --start 2.9 --max-travel 0.4 --highest 0.9 --step 0.9", "c");
  EXPECT_EQ(far.exit_code, 4) << far.output;
  EXPECT_NE(far.output.find("arm-5 moved by"), std::string::npos) << far.output;
  EXPECT_NE(far.output.find("recorded until then is in " + (directory / "c/staircase").string()),
            std::string::npos)
      << far.output;
  const CommandResult still =
      bench("torque-ramp --joint arm-1 --start 2.9 --max-travel 0.1 --repeats 1", "d");
  EXPECT_EQ(still.exit_code, 0) << still.output;
  EXPECT_NE(still.output.find("not measured: arm-1, measurement 1: did not break away up to 0.3 N·m"),
            std::string::npos)
      << still.output;
}

}  // namespace arm_experiments_test
}  // namespace youbot_bench
