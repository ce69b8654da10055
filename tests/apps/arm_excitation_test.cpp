// youbot-bench arm-excitation: on the simulated robot its hidden truth comes back.
#include "apps/youbot_bench/arm_excitation.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "apps/youbot_bench/arm_motion_task.h"
#include "apps/youbot_bench/arm_space.h"
#include "apps/youbot_bench/arm_tour.h"
#include "apps/youbot_bench/given_arm.h"
#include "hal/clock.h"
#include "hal/youbot_axes.h"
#include "identification/robot_gap/base_parameters.h"
#include "runtime/configuration/arm_model.h"
#include "runtime/configuration/toml_reader.h"
#include "sim/bus/axis_data.h"
#include "sim/mobile_manipulator.h"
#include "tests/support/built_paths.h"
#include "tests/support/no_alloc_guard.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/watched_robot.h"

namespace youbot_bench {
namespace arm_excitation_test {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using control::ArmVector;
using nlohmann::json;

const std::atomic<bool> kGoesOn{false};
const ArmVector kFolded{0.2, 0.2, -0.2, 0.2, 0.2};
const ArmVector kUpright{2.95, 1.13, -2.55, 1.79, 2.92};

ArmExcitationOptions short_motions(const fs::path& out) {
  ArmExcitationOptions options;
  options.out = out;
  options.plan.motions = 3;
  options.plan.motion_s = 15;
  options.plan.tries = 60;
  options.quiet = true;
  return options;
}

json read_json(const fs::path& path) {
  std::ifstream file(path);
  return json::parse(file);
}

/// What sim::built_robot() is, as a description.
control::ArmDescription built_arm() {
  control::ArmDescription arm = described_arm().arm;
  const control::ModelChanges built = sim::built_robot();
  for (std::size_t i = 0; i < arm.arm.links.size(); ++i) {
    const control::ModelChanges::LinkChange& change = built.links[i + 1];
    control::LinkInertia& body = arm.arm.links[i].inertia;
    body.mass_kg *= change.mass_factor;
    body.p_LC_m += change.com_shift_m;
    body.about_C_kg_m2 = change.mass_factor * body.about_C_kg_m2 + change.inertia_change_kg_m2;
    const sim::bus::ArmJointData& joint = sim::bus::kArmJointData[i];
    const double gear = joint.axis.gear_ratio;
    arm.drives[i].rotor_inertia_kg_m2 = joint.rotor_inertia_kg_m2 * gear * gear;
  }
  return arm;
}

TEST(ArmExcitationCommand, TheHiddenTruthOfTheSimulatedArmComesBack) {
  const support::TemporaryDirectory folder;
  const fs::path out = folder / "arm";
  ASSERT_EQ(arm_excitation(short_motions(out), kGoesOn), 0);
  const json fit = read_json(out / "fit.json");

  // A held-out motion is predicted to within the sensors' noise.
  for (const json& joint : fit["gap"]["joints"])
    EXPECT_LT(joint["after_Nm"].get<double>(), 1.5 * joint["noise_floor_Nm"].get<double>()) << joint;
  EXPECT_LT(fit["gap"]["after_Nm"].get<double>(), 0.15 * fit["gap"]["before_Nm"].get<double>());

  // Friction: within its interval, or 1 %, which gears that give and noise of filters may cost.
  const auto expect_number = [&fit](const std::string& name, double truth) {
    for (const json& one : fit["drives"]) {
      if (one["name"] != name) continue;
      const double value = one["value"].get<double>();
      const double half = (one["ci95"][1].get<double>() - one["ci95"][0].get<double>()) / 2;
      EXPECT_NEAR(value, truth, std::max(1.5 * half, 0.01 * truth)) << one;
      EXPECT_LT(half, 0.1 * truth) << one;
      return;
    }
    ADD_FAILURE() << name << " is missing";
  };
  for (std::size_t i = 0; i < 5; ++i) {
    const std::string joint = " of arm_joint_" + std::to_string(i + 1);
    expect_number("coulomb_Nm" + joint, sim::bus::kArmJointData[i].coulomb_Nm);
    expect_number("viscous_Nm_s_per_rad" + joint, sim::bus::kArmJointData[i].viscous_Nm_s_per_rad);
  }

  const Eigen::VectorXd truth =
      identification::robot_gap::BaseParameters(described_arm().arm).of(built_arm());
  ASSERT_EQ(static_cast<Eigen::Index>(fit["base_parameters"].size()), truth.size());
  int within = 0;
  for (Eigen::Index k = 0; k < truth.size(); ++k) {
    const json& ci95 = fit["base_parameters"][static_cast<std::size_t>(k)]["ci95"];
    if (ci95[0].get<double>() <= truth[k] && truth[k] <= ci95[1].get<double>()) ++within;
  }
  RecordProperty("within", within);
  EXPECT_GE(within, 0.8 * static_cast<double>(truth.size())) << within << " of " << truth.size();

  // Control takes the model as it is.
  const runtime::ArmModelFile model = runtime::read_arm_model(out / "robot.toml");
  EXPECT_NEAR(model.model.friction.coulomb_Nm[1], sim::bus::kArmJointData[1].coulomb_Nm, 0.02);
  EXPECT_TRUE(fs::exists(out / "report.html"));
}

TEST(ArmExcitationCommand, AModelWinsWhoseRivalIsWrong) {
  const support::TemporaryDirectory folder;
  runtime::RobotFile robot = described_arm();
  const auto written = [&](const char* name, const auto& change) {
    control::ArmDescription arm = described_arm().arm;
    change(arm);
    runtime::RobotFile file = robot;
    file.arm = arm;
    folder.write("youbot.urdf", std::string(control::youbot_urdf()));
    return folder.write(name, runtime::robot_file_text(file, "youbot.urdf", robot.arm, {}, {})).string();
  };
  const std::string loaded =
      written("loaded.toml", [](control::ArmDescription& arm) { arm.payload_kg = 0.3; });
  const std::string heavier =
      written("heavier.toml", [](control::ArmDescription& arm) { arm.arm.links[3].inertia.mass_kg += 0.35; });
  ArmExcitationOptions options = short_motions(folder / "arm");
  options.plan.motions = 2;
  options.plan.motion_s = 10;
  options.model = heavier;
  options.against = loaded;
  options.simulated = runtime::read_arm_model(loaded).model;
  ASSERT_EQ(arm_excitation(options, kGoesOn), 0);
  const json fit = read_json(folder / "arm" / "fit.json");
  EXPECT_LT(fit["rivals"]["against_Nm"].get<double>(), 0.5 * fit["rivals"]["model_Nm"].get<double>());
}

TEST(ArmExcitationCommand, ThePlanAloneMovesAndWritesNothing) {
  const support::TemporaryDirectory folder;
  const auto result = support::run_command(support::program("youbot-bench") +
                                           " arm-excitation --plan-only --motions 2 --tries 30 --out " +
                                           (folder / "arm").string());
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_TRUE(result.said("motion 2: 20 s around")) << result.output;
  EXPECT_FALSE(fs::exists(folder / "arm"));
}

TEST(ArmExcitationCommand, IsStoppedBeforeItMovesWhereItsZeroIsUnknown) {
  const support::TemporaryDirectory folder;
  ArmExcitationOptions options = short_motions(folder / "arm");
  options.robot = "wire";
  options.plan.tries = 30;
  EXPECT_EQ(arm_excitation(options, kGoesOn), 4);
  EXPECT_FALSE(fs::exists(folder / "arm")) << "nothing was recorded";
}

// The motions know nothing of it.
TEST(ArmExcitationCommand, AWallInItsWayStopsTheTour) {
  const support::TemporaryDirectory folder;
  ArmExcitationOptions options = short_motions(folder / "arm");
  options.plan.tries = 30;
  options.scene.walls.push_back({{0.32, 0, 0}, {-1, 0, 0}});
  testing::internal::CaptureStdout();
  const int code = arm_excitation(options, kGoesOn);
  testing::internal::GetCapturedStdout();
  EXPECT_EQ(code, 4);
  EXPECT_FALSE(fs::exists(folder / "arm" / "robot.toml"));
}

TEST(ArmExcitationCommand, AnInterruptEndsItWithoutAModel) {
  const support::TemporaryDirectory folder;
  const std::atomic<bool> at_once{true};
  ArmExcitationOptions options = short_motions(folder / "arm");
  options.plan.tries = 30;
  EXPECT_EQ(arm_excitation(options, at_once), 130);
  EXPECT_FALSE(fs::exists(folder / "arm")) << "nothing was recorded";
}

TEST(ArmExcitationCommand, RefusesWhatDoesNotFit) {
  const support::TemporaryDirectory folder;
  ArmExcitationOptions options = short_motions(folder / "arm");
  options.kind = "base";
  EXPECT_THROW(arm_excitation(options, kGoesOn), std::invalid_argument);
  options.kind = "base+arm";
  options.given = "x.toml";
  EXPECT_THROW(arm_excitation(options, kGoesOn), std::invalid_argument);  // without --against
  options.given.clear();
  fs::create_directory(folder / "arm");
  std::ofstream(folder / "arm" / "motion-1.csv") << "kept\n";
  EXPECT_THROW(arm_excitation(options, kGoesOn), std::invalid_argument);
  EXPECT_TRUE(fs::exists(folder / "arm" / "motion-1.csv"));
}

TEST(ArmMotionCycle, NeitherAllocatesNorLocks) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the allocation guard is off under a sanitizer";
  sim::MobileManipulatorParameters parameters;
  parameters.wheels.on_ground = false;
  parameters.start_rad = kUpright;
  sim::MobileManipulator plant(parameters);
  std::vector<hal::JointInfo> joints;
  for (int i = 1; i <= 4; ++i)
    joints.push_back(hal::joint_info("wheel-" + std::to_string(i), hal::kWheelAxis));
  for (std::size_t i = 0; i < 5; ++i)
    joints.push_back(hal::joint_info("arm-" + std::to_string(i + 1), hal::kArmAxes[i]));
  hal::VirtualClock clock;
  support::WatchedLoopback robot(plant, clock, 1ms, joints);
  robot.watch.allow_enables(1);

  identification::experiments::FourierMotion motion;
  motion.centre_rad = kUpright + ArmVector::Constant(0.2);
  motion.sine_rad = Eigen::MatrixXd::Constant(5, 2, 0.1);
  motion.cosine_rad = Eigen::MatrixXd::Constant(5, 2, -0.05);
  const support::TemporaryDirectory folder;
  fs::create_directory(folder / "arm");
  runtime::MadePaths made;
  ArmMotionRecording recording(folder / "arm", 1, made);
  ArmMotionCycle cycle({}, robot, ArmTour({motion}, kUpright), recording);
  robot.activate();
  {
    const support::NoAllocGuard guard;
    while (!cycle.finished()) {
      clock.sleep_until(clock.now() + 1ms);
      cycle.step(clock.now());
    }
    EXPECT_EQ(guard.violations(), 0);
  }
  EXPECT_FALSE(cycle.stop_reason());
  EXPECT_GE(cycle.task().progress(), 1.0);
  recording.close();
}

TEST(ArmSpace, IsWhereTheArmTouchesNeitherItsRobotNorTheFloor) {
  const ArmSpace space;
  EXPECT_TRUE(space.is_clear(kUpright));
  // Stretched forward and down: the end effector would be below the floor.
  EXPECT_FALSE(space.is_clear(ArmVector(2.95, 2.6, -1.5, 1.79, 2.92)));
  // The end effector hangs 0.16 m above the floor: in front there is nothing, behind there is the base.
  EXPECT_TRUE(space.is_clear(ArmVector(2.95, 2.4, -2.55, 3.0, 2.92)));
  EXPECT_FALSE(space.is_clear(ArmVector(2.95 + std::numbers::pi, 2.4, -2.55, 3.0, 2.92)));
}

TEST(ArmTour, IsContinuousAndReturnsToItsStart) {
  std::vector<identification::experiments::FourierMotion> motions(2);
  for (std::size_t m = 0; m < 2; ++m) {
    motions[m].centre_rad = kUpright + ArmVector::Constant(m == 0 ? 0.3 : -0.4);
    motions[m].sine_rad = Eigen::MatrixXd::Constant(5, 2, 0.2);
    motions[m].cosine_rad = Eigen::MatrixXd::Constant(5, 2, -0.1);
  }
  ArmTour tour(motions, kUpright);
  tour.start_at(kFolded);
  ArmTour::State before = tour.at(0);
  EXPECT_LT((before.position_rad - kFolded).norm(), 1e-12);
  constexpr double kCycle_s = 1e-3;
  double driven_s = 0;
  for (double t = kCycle_s; t <= tour.duration_s(); t += kCycle_s) {
    const ArmTour::State now = tour.at(t);
    // The mean of two velocities, to a third derivative of some 10 rad/s³.
    const ArmVector moved = (now.velocity_rad_per_s + before.velocity_rad_per_s) / 2 * kCycle_s;
    EXPECT_LT((now.position_rad - before.position_rad - moved).cwiseAbs().maxCoeff(), 1e-8) << t;
    if (now.motion < 0) {
      EXPECT_LE(now.velocity_rad_per_s.cwiseAbs().maxCoeff(), 0.5001) << t;
    }
    if (now.motion >= 0) driven_s += kCycle_s;
    before = now;
  }
  EXPECT_NEAR(driven_s, 40, 0.01);
  EXPECT_LT((tour.at(tour.duration_s() + 1).position_rad - kFolded).norm(), 1e-12);
  EXPECT_EQ(tour.at(tour.duration_s() + 1).velocity_rad_per_s.norm(), 0);
}

}  // namespace arm_excitation_test
}  // namespace youbot_bench
