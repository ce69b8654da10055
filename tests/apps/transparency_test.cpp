// The two-port of teleoperation: measured on a robot without friction and compared with its closed form, and
// the command `youbot-bench transparency`.
#include "apps/youbot_bench/transparency.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <complex>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <numbers>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "control/arm_posture.h"
#include "control/robot_model.h"
#include "tests/operation/teleop_rig.h"
#include "tests/support/built_paths.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/watched_robot.h"

namespace transparency_test {

using Complex = std::complex<double>;
using identification::two_port::HybridPoint;
using youbot_bench::Feedback;
using youbot_bench::TransparencyCondition;
using youbot_bench::TransparencyPlan;
using youbot_bench::TransparencyResult;

bool says(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

/// Nonlinear parts of teleoperation are off or negligible: friction and its compensation, the energy tank.
/// Gears are stiff, because behind a compliant one the encoders do not measure the end effector.
runtime::OpenedRobot linear_robot(const hal::Clock& clock, std::chrono::nanoseconds period) {
  sim::MobileManipulatorParameters parameters = teleop_rig::unfolded_scene().robot;
  parameters.masses = {};
  parameters.gear.stiffness_Nm_per_rad = 4e4;
  parameters.wheels.loaded_friction_scale.fill(1e-3);
  parameters.wheels.roller_resistance = 0.0;
  for (sim::bus::ArmJointData& joint : parameters.arm) joint.coulomb_Nm = joint.viscous_Nm_s_per_rad = 1e-4;
  runtime::OpenedRobot opened;
  opened.manipulator = std::make_unique<sim::MobileManipulator>(parameters);
  opened.robot =
      std::make_unique<support::WatchedLoopback>(*opened.manipulator, clock, period, teleop_rig::joints());
  return opened;
}

TransparencyPlan linear_plan() {
  TransparencyPlan plan{
      .excitation = {.period_s = 10.0, .lowest_Hz = 0.3, .highest_Hz = 2.5, .lines = 9, .peak_N = 1.0},
      .realizations = 2,
      .control = teleop_rig::quick_config().control,
      .hand = youbot_bench::soft_hand()};
  plan.control.robot.base.compensate_friction = false;
  plan.control.robot.arm_compensator.margin = 0.0;
  plan.control.robot.settled_fade_s = 0.5;
  plan.control.tank.active = false;
  return plan;
}

TransparencyResult measured(const TransparencyPlan& plan, const TransparencyCondition& condition) {
  const auto result = youbot_bench::measure_transparency(plan, condition, linear_robot);
  if (!result || !result->fault.empty())
    throw std::runtime_error(result ? result->fault : "no stop was requested");
  return *result;
}

/// J·M⁻¹·Jᵀ of the end effector where teleoperation starts, from the robot's model.
Eigen::Matrix<double, 6, 6> mobility_at_start(const TransparencyPlan& plan) {
  control::RobotModel model;
  const Eigen::Quaterniond hand_down(
      Eigen::AngleAxisd(plan.control.start_pitch_rad, Eigen::Vector3d::UnitY()));
  const auto arm_rad =
      control::arm_posture_for({plan.control.start_p_WT_m, hand_down}, plan.control.unfolded_rad, model);
  control::ChainVector position;
  position << 0, 0, 0, arm_rad.value();
  model.update(position);
  control::ChainMatrix mass = model.mass();
  // Wheels and their rotors as the floor feels them, and rotors of 1.35e-5 kg·m² behind the arm's gears.
  mass.diagonal() += (control::ChainVector() << 18.8, 18.8, 2.8, 0.33, 0.33, 0.135, 0.068, 0.068).finished();
  return model.J_WT() * mass.inverse() * model.J_WT().transpose();
}

/// Of the coupling along the plan's axis: 2ζ·√k·Λ^½, with Λ the inverse of the translation's mobility.
double damping_N_s_per_m(const TransparencyPlan& plan, double stiffness_N_per_m) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(mobility_at_start(plan).topLeftCorner<3, 3>());
  return 2 * plan.control.robot.spring.damping_ratio * std::sqrt(stiffness_N_per_m) *
         axes.operatorInverseSqrt()(plan.axis, plan.axis);
}

/// The coupling as computed by control: the spring at the hand; spring and damper at the end effector, which
/// is driven by the low-passed velocity of the set-point, and braked by its own.
struct Coupling {
  Complex at_hand, drawing, braking;

  Coupling(const TransparencyPlan& plan, double stiffness_N_per_m, Complex s) {
    const double damping = damping_N_s_per_m(plan, stiffness_N_per_m);
    const Complex low_pass =
        1.0 / (1.0 + s / (2 * std::numbers::pi * plan.control.smoothing.velocity_cutoff_Hz));
    // From a sample at the beginning of a cycle to a force that acts through the next.
    const Complex delay = std::exp(-1.5e-3 * s);
    at_hand = delay * stiffness_N_per_m / s / plan.control.feedback.force_scale;
    drawing = delay * (stiffness_N_per_m / s + damping * low_pass);
    braking = delay * (stiffness_N_per_m / s + damping);
  }
};

Complex laplace(const HybridPoint& point) { return {0.0, 2 * std::numbers::pi * point.frequency_Hz}; }

double relative_error(Complex is, Complex expected) { return std::abs(is - expected) / std::abs(expected); }

/// Position-error force feedback: with any mechanics Z_s of the end effector,
///   h22 = 1/(Z_s + C_braking), h21 = -λ·C_drawing·h22, h12 = C_hand·h22, h11 = Z_m + C_hand·(λ + h21).
void expect_closed_form(const TransparencyPlan& plan, const TransparencyCondition& condition) {
  const TransparencyResult result = measured(plan, condition);
  EXPECT_EQ(result.limited_share + result.passive_share + result.rate_share, 0.0) << "not linear";
  ASSERT_GE(result.points.size(), 6U);
  const double motion_scale = plan.control.mapping.motion_scale;
  for (const HybridPoint& point : result.points) {
    SCOPED_TRACE(std::to_string(point.frequency_Hz) + " Hz");
    EXPECT_TRUE(point.ok);
    EXPECT_GT(*std::ranges::min_element(point.coherence), 0.98);
    const Complex s = laplace(point);
    const Coupling coupling(plan, condition.stiffness_N_per_m, s);
    const Eigen::Matrix2cd& H = point.H;
    const Complex pen = plan.hand.device_mass_kg * s + plan.hand.device_drag_N_s_per_m;
    EXPECT_LT(relative_error(H(0, 1), coupling.at_hand * H(1, 1)), 0.02);
    // The end effector's own velocity comes from encoders through a filter, which is visible near the highest
    // line; and its damping couples the axes a little, because its apparent mass does.
    EXPECT_LT(relative_error(H(1, 0), -motion_scale * coupling.drawing * H(1, 1)), 0.11);
    EXPECT_LT(relative_error(H(0, 0), pen + coupling.at_hand * (motion_scale + H(1, 0))), 0.02);
  }
}

TEST(Transparency, WithoutFrictionTheTwoPortIsThatOfPositionErrorFeedback) {
  expect_closed_form(linear_plan(), {Feedback::kPositionError, 400.0});
}

TEST(Transparency, ScalesStandWhereTheClosedFormHasThem) {
  TransparencyPlan plan = linear_plan();
  plan.axis = 2;  // the one that has the same direction at both ends
  plan.hand.device_mass_kg = 0.4;
  plan.hand.device_drag_N_s_per_m = 1.0;
  plan.control.mapping.motion_scale = 0.5;
  plan.control.feedback.force_scale = 5.0;
  expect_closed_form(plan, {Feedback::kPositionError, 250.0});
}

TEST(Transparency, AtLowFrequenciesNothingButTheScalesIsLeft) {
  TransparencyPlan plan = linear_plan();
  plan.excitation.lowest_Hz = 0.1;
  plan.control.mapping.motion_scale = 0.8;
  const TransparencyResult result = measured(plan, {Feedback::kPositionError, 700.0});
  const HybridPoint& lowest = result.points.front();
  ASSERT_LE(lowest.frequency_Hz, 0.1);
  // The spring and the mass on it, in resonance above 1 Hz, make 1 % of it.
  EXPECT_NEAR(-lowest.H(1, 0).real(), 0.8, 0.02);
  EXPECT_NEAR(lowest.H(0, 1).real(), 0.1, 0.005);
  ASSERT_TRUE(result.measures);
  EXPECT_NEAR(result.measures->position.low_frequency_gain, 0.8, 0.05);
  EXPECT_NEAR(result.measures->force.low_frequency_gain, 0.1, 0.005);
  EXPECT_NEAR(result.measures->scaling_product, 0.08, 0.008);
}

TEST(Transparency, TheTipIsAsHeavyAsTheRobotModelSays) {
  const TransparencyPlan plan = linear_plan();
  const TransparencyCondition condition{Feedback::kPositionError, 400.0};
  const TransparencyResult result = measured(plan, condition);
  const Eigen::Matrix<double, 6, 6> mobility =
      mobility_at_start(plan) + 1e-9 * Eigen::Matrix<double, 6, 6>::Identity();
  const double turning_freely_kg = 1 / mobility(0, 0);
  const double not_turning_kg = mobility.inverse()(0, 0);
  for (const HybridPoint& point : result.points) {
    if (point.frequency_Hz < 0.5) continue;  // where the spring has to give nearly all of h22
    const Complex s = laplace(point);
    const Complex Z_s = 1.0 / point.H(1, 1) - Coupling(plan, condition.stiffness_N_per_m, s).braking;
    EXPECT_GT((Z_s / s).real(), turning_freely_kg) << point.frequency_Hz;
    EXPECT_LT((Z_s / s).real(), not_turning_kg) << point.frequency_Hz;
  }
}

TEST(Transparency, WithoutFeedbackTheHandFeelsThePenAlone) {
  TransparencyPlan plan = linear_plan();
  plan.excitation.period_s = 5.0;
  plan.excitation.lowest_Hz = 0.2;
  const TransparencyResult result = measured(plan, {Feedback::kNone, 400.0});
  for (const HybridPoint& point : result.points) {
    const Complex pen = plan.hand.device_mass_kg * laplace(point) + plan.hand.device_drag_N_s_per_m;
    EXPECT_LT(relative_error(point.H(0, 0), pen), 0.005) << point.frequency_Hz;
    EXPECT_LT(std::abs(point.H(0, 1)), 1e-6) << point.frequency_Hz;
  }
}

TEST(Transparency, SaysWhatEndedItAndEndsWhenAsked) {
  TransparencyPlan plan = linear_plan();
  int calls = 0;
  EXPECT_FALSE(youbot_bench::measure_transparency(plan, {}, linear_robot, [&calls](double done) {
    EXPECT_GE(done, 0.0);
    EXPECT_LE(done, 1.0);
    return ++calls < 3;
  }));
  EXPECT_EQ(calls, 3);
  plan.control.approach_timeout_s = 0.5;
  const auto result = youbot_bench::measure_transparency(plan, {}, linear_robot);
  ASSERT_TRUE(result);
  EXPECT_TRUE(says(result->fault, "did not come to rest in front of the robot")) << result->fault;
  EXPECT_FALSE(result->measures);
  plan.realizations = 1;
  EXPECT_THROW((void)youbot_bench::measure_transparency(plan, {}, linear_robot), std::invalid_argument);
}

std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// The numbers below the column names.
std::vector<std::vector<double>> rows_of(const std::string& csv) {
  std::vector<std::vector<double>> rows;
  std::istringstream lines(csv);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with('#') || line.starts_with("frequency_Hz")) continue;
    std::vector<double>& row = rows.emplace_back();
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) row.push_back(std::stod(cell));
  }
  return rows;
}

support::CommandResult transparency(const std::string& arguments) {
  return support::run_command(support::program("youbot-bench") + " transparency " + arguments);
}

TEST(TransparencyCommand, WritesTablesAndReport) {
  const support::TemporaryDirectory folder;
  const std::string out = (folder.path() / "out").string();
  const std::string tiny =
      "--feedback position-error --stiffness 500 --period 2 --lowest 0.5 --highest 3 --lines 4 "
      "--realizations 2 --out " +
      out;
  const auto result = transparency(tiny);
  ASSERT_EQ(result.exit_code, 0) << result.output;
  for (const char* part : {"position tracking", "scaling product", "felt in free air", "Z-width",
                           "transparency error", "fidelity", "Llewellyn", "discarded", "report: "})
    EXPECT_TRUE(result.said(part)) << part << "\n" << result.output;

  const std::string csv = text_of(out + "/position-error-500.csv");
  for (const char* part : {"# feedback: position-error\n", "# stiffness_N_per_m: 500\n", "# software: ",
                           "\nfrequency_Hz,h11_re_N_s_per_m,", ",coherence_slave_velocity,condition,ok\n"})
    EXPECT_TRUE(says(csv, part)) << part << "\n" << csv;
  const std::vector<std::vector<double>> rows = rows_of(csv);
  ASSERT_GE(rows.size(), 2U);
  EXPECT_GE(rows.front().front(), 0.5);
  EXPECT_LE(rows.back().front(), 3.0);
  for (const std::vector<double>& row : rows) {
    ASSERT_EQ(row.size(), 15U);
    for (std::size_t channel = 9; channel < 13; ++channel) {
      EXPECT_GE(row[channel], 0.0);
      EXPECT_LE(row[channel], 1.0 + 1e-6);
    }
  }
  // Despite friction, the end effector follows the hand.
  EXPECT_LT(rows.front()[5], -0.3) << "real part of h21";

  const std::string html = text_of(out + "/report.html");
  for (const char* part : {"The hybrid matrix", "Coherence", "position-error, 500 N/m"})
    EXPECT_TRUE(says(html, part)) << part;

  const auto again = transparency(tiny);
  EXPECT_EQ(again.exit_code, 2) << "results are never replaced";
  EXPECT_TRUE(again.said("not empty")) << again.output;
}

TEST(TransparencyCommand, AStartUpThatFailsIsReportedForItsConditionAndIsAFault) {
  const support::TemporaryDirectory folder;
  const auto file = folder.write("teleop.toml", R"(
[ethercat]
kind = "base+arm"
[teleoperation.start]
unfolding_timeout_s = 1
)");
  const std::string out = (folder.path() / "out").string();
  const auto result =
      transparency("--stiffness 500 --feedback none --out " + out + " --config " + file.string());
  EXPECT_EQ(result.exit_code, 4) << result.output;
  EXPECT_TRUE(result.said("none, 500 N/m")) << result.output;
  EXPECT_TRUE(result.said("did not come to its unfolded pose")) << result.output;
  EXPECT_TRUE(std::filesystem::exists(out + "/report.html"));
}

TEST(TransparencyCommand, WrongUseIsReportedAndNothingIsWritten) {
  const support::TemporaryDirectory folder;
  const std::filesystem::path out = folder.path() / "out";
  const auto base_alone = folder.write("base.toml", "[ethercat]\nkind = \"base\"\n");
  const auto active = folder.write(
      "active.toml", "[ethercat]\nkind = \"base+arm\"\n[teleoperation.feedback]\npassivity = false\n");
  const std::pair<std::string, const char*> wrong[] = {
      {"--feedback position-error,contact --config " + active.string(), "passivity"},
      {"--robot wire", "no force sensor"},
      {"--robot ethercat:eth0", "no force sensor"},
      {"--haptic falcon", "no force sensor"},
      {"--feedback force", "position-error, contact, mixed, none"},
      {"--stiffness 0", "1 to 5000"},
      {"--stiffness 300,300", "twice"},
      {"--axis w", "x, y, z"},
      {"--highest 200", "tenth of the sampling rate"},
      {"--period 2.00005", "whole number"},
      {"--lowest nan", "--lowest: should be"},
      {"--realizations 1", "realizations"},
      {"--config " + (folder.path() / "none.toml").string(), "none.toml"},
      {"--config " + base_alone.string(), "base+arm"},
  };
  for (const auto& [arguments, calls] : wrong) {
    const auto result = transparency(arguments + " --out " + out.string());
    EXPECT_EQ(result.exit_code, 2) << arguments << "\n" << result.output;
    EXPECT_TRUE(result.said(calls)) << arguments << "\n" << result.output;
    EXPECT_FALSE(std::filesystem::exists(out)) << arguments;
  }
  EXPECT_EQ(transparency("").exit_code, 2) << "--out is required";
}

}  // namespace transparency_test
