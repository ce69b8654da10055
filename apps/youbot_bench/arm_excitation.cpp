#include "apps/youbot_bench/arm_excitation.h"

#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <system_error>
#include <utility>
#include <vector>

#include "analysis/robot_tables.h"
#include "apps/youbot_bench/arm_fit_report.h"
#include "apps/youbot_bench/arm_motion_task.h"
#include "apps/youbot_bench/arm_space.h"
#include "apps/youbot_bench/confirm.h"
#include "apps/youbot_bench/given_arm.h"
#include "apps/youbot_bench/progress.h"
#include "hal/seconds.h"
#include "hal/setup_error.h"
#include "identification/experiments/rehearsal.h"
#include "runtime/configuration/ethercat_config.h"
#include "runtime/configuration/finite_range.h"
#include "runtime/configuration/plausibility_config.h"
#include "runtime/configuration/shared_tables.h"
#include "runtime/configuration/toml_reader.h"
#include "runtime/configuration/whole_file.h"
#include "runtime/open_robot.h"
#include "runtime/program/exit_code.h"
#include "runtime/program/stop_on_signals.h"
#include "runtime/recording/made_paths.h"
#include "runtime/recording/output_directory.h"
#include "runtime/robot_session.h"

namespace youbot_bench {
namespace {

namespace fs = std::filesystem;
using control::kArmJoints;
using identification::robot_gap::ExcitationLimits;
using identification::robot_gap::ExcitationPlan;

constexpr std::chrono::milliseconds kTourPeriod{1};
/// Upright, bent at no joint: every other pose is reached from here without touching the robot.
const control::ArmVector kUpright{2.9496, 1.1345, -2.5482, 1.7890, 2.9234};
/// From the ends of a joint's range: farther than the guard that stops the tour.
constexpr double kRangeMargin_rad = 0.12;
constexpr double kSpeedShare = 0.75;
/// The rest is for what the model does not know.
constexpr double kTorqueShare = 0.75;

constexpr const char* kModelFile = "robot.toml";
constexpr const char* kUrdfFile = "youbot.urdf";
constexpr const char* kGivenFile = "given.toml";
constexpr const char* kJsonFile = "fit.json";
constexpr const char* kPageFile = "report.html";

ExcitationLimits limits_of(std::span<const hal::JointInfo> joints, const ArmSpace& space) {
  ExcitationLimits limits;
  const auto indices = ArmMotionTask::arm_joints(joints);
  for (Eigen::VectorXd* vector : {&limits.motion.lower_rad, &limits.motion.upper_rad,
                                  &limits.motion.speed_rad_per_s, &limits.torque_Nm})
    vector->resize(kArmJoints);
  limits.motion.acceleration_rad_per_s2.setConstant(kArmJoints,
                                                    identification::experiments::kGentle_rad_per_s2);
  for (Eigen::Index i = 0; i < kArmJoints; ++i) {
    const hal::JointInfo& joint = joints[indices[static_cast<std::size_t>(i)]];
    limits.motion.lower_rad[i] = joint.range.lower_rad + kRangeMargin_rad;
    limits.motion.upper_rad[i] = joint.range.upper_rad - kRangeMargin_rad;
    limits.motion.speed_rad_per_s[i] = kSpeedShare * joint.speed_limit_rad_per_s;
    limits.torque_Nm[i] = kTorqueShare * std::min(joint.rated_torque_Nm, joint.torque_limit_Nm);
  }
  limits.is_clear = [&space](const Eigen::VectorXd& q_rad) { return space.is_clear(q_rad); };
  limits.ready_rad = kUpright;
  return limits;
}

/// Robot and bus, as the command line and the file of --config say.
struct ExcitationRig {
  runtime::RobotOptions robot;
  control::ChecksOff checks_off{};
  bool is_simulated = false;
  bool virtual_time = false;
};
ExcitationRig rig_of(const ArmExcitationOptions& options) {
  ExcitationRig rig;
  rig.robot.name = options.robot;
  if (!options.config.empty()) {
    runtime::TomlFile file = runtime::TomlFile::parse(options.config);
    runtime::TomlTable root = file.root();
    runtime::TomlTable ethercat = root.table("ethercat");
    runtime::read_ethercat(ethercat, kTourPeriod, rig.robot.ethercat);
    runtime::read_plausibility(root.table("plausibility"), rig.checks_off);
    runtime::leave_to_others(root, {"ethercat", "plausibility"});
    file.finish();
  }
  rig.robot.ethercat.kind = runtime::ethercat_kind(options.kind);
  rig.robot.simulation.on_ground = false;
  rig.robot.arm = options.simulated;
  rig.robot.scene = options.scene;
  rig.is_simulated = runtime::is_simulated(options.robot);
  rig.virtual_time = options.virtual_time || (rig.is_simulated && !options.real_time);
  if (rig.virtual_time) runtime::check_virtual_time(options.robot);
  return rig;
}

ExcitationPlan planned(const ArmExcitationOptions& options, const runtime::RobotFile& model,
                       const ExcitationLimits& limits) {
  namespace robot_gap = identification::robot_gap;
  if (options.against.empty()) {
    if (!options.given.empty()) throw std::invalid_argument("--given: is for --against, a rival of --model");
    return robot_gap::plan_for_information(model.arm, limits, options.plan);
  }
  const runtime::RobotFile rival = read_given_arm(options.against, "--against");
  const runtime::RobotFile given =
      options.given.empty() ? described_arm() : read_given_arm(options.given, "--given");
  return robot_gap::plan_for_separation(given.arm, model.arm, rival.arm, limits, options.plan);
}

/// Text of the stop; empty if the tour was driven to its end.
struct Driven {
  std::string fault;
  bool interrupted = false;
  std::vector<std::string> problems;
  std::vector<std::string> robot_report;
};
Driven drive(const ArmExcitationOptions& options, const ExcitationRig& rig, const ExcitationPlan& plan,
             hal::Robot& robot, hal::Clock& clock, ArmMotionRecording& recording,
             const std::atomic<bool>& stop) {
  Driven driven;
  ArmMotionCycle::Config config;
  config.period = kTourPeriod;
  config.checks_off = rig.checks_off;
  config.wheels = control::PlausibilityMonitor::Wheels::kFree;
  config.wait_for_recording = rig.virtual_time;
  if (rig.robot.ethercat.home_arms) config.enable_timeout = runtime::kHomingTimeout;
  runtime::warn_of(rig.checks_off);
  ArmMotionCycle cycle(config, robot, ArmTour(plan.motions, kUpright), recording);
  {
    const runtime::RobotActivation activation(robot);
    runtime::RealTimeThread real_time;
    if (!rig.virtual_time)
      for (const std::string& problem :
           runtime::enter_real_time(real_time, {}, options.allow_non_real_time, "youbot-bench"))
        spdlog::warn("not real-time: {}", problem);
    runtime::LoopStatistics loop;
    runtime::run_loop(
        clock, kTourPeriod, cycle,
        [&](std::chrono::nanoseconds /*elapsed*/) noexcept {
          driven.interrupted = driven.interrupted || stop.load(std::memory_order_relaxed);
          return driven.interrupted;
        },
        [](const runtime::CycleTimes&) noexcept {}, loop);
    driven.robot_report = robot.report();
  }
  recording.close();
  driven.problems = recording.problems();
  if (const runtime::StopReason& reason = cycle.stop_reason())
    driven.fault = runtime::describe(reason, cycle.cut_short_by(), robot);
  return driven;
}

/// As youbot-gap reads them.
std::vector<identification::robot_gap::ArmRecording> read_back(const runtime::RobotFile& model,
                                                               const std::vector<fs::path>& files) {
  analysis::RobotGapOptions read;
  read.data = files;
  return analysis::read_arm_recordings(model, read).data;
}

ArmFindings analysed(const ArmExcitationOptions& options, const runtime::RobotFile& model,
                     ExcitationPlan plan) {
  ArmFindings findings;
  findings.robot = options.robot;
  findings.model = options.model.empty() ? "control/youbot.urdf with control's friction" : options.model;
  findings.seed = options.plan.seed;
  findings.plan = std::move(plan);
  std::vector<fs::path> files;
  for (int m = 0; m < options.plan.motions; ++m) {
    files.push_back(options.out / ArmMotionRecording::file_name(m));
    findings.fitted.push_back(ArmMotionRecording::file_name(m));
  }
  findings.held_out = findings.fitted.back();
  findings.fitted.pop_back();
  const std::vector<fs::path> held_out{files.back()};
  files.pop_back();
  const auto data = read_back(model, files);
  const auto judging = read_back(model, held_out);
  findings.fit = identification::robot_gap::fit_arm(model.arm, data, judging, model.band_Hz);
  if (!options.against.empty()) {
    auto all = data;
    all.insert(all.end(), judging.begin(), judging.end());
    const control::ArmDescription rival = read_given_arm(options.against, "--against").arm;
    findings.rivals = RivalGaps{findings.model, options.against,
                                identification::robot_gap::residual_Nm(model.arm, all, model.band_Hz),
                                identification::robot_gap::residual_Nm(rival, all, model.band_Hz)};
  }
  return findings;
}

/// As a file in `out` names it.
fs::path urdf_from(const fs::path& out, const runtime::RobotFile& model) {
  std::error_code error;
  const fs::path near = fs::proximate(model.urdf, out, error);
  return error ? fs::absolute(model.urdf) : near;
}

void confirm_tour(const ArmExcitationOptions& options, const ExcitationRig& rig) {
  if (rig.virtual_time || rig.is_simulated || options.yes) return;
  confirm({.robot = options.robot,
           .what = rig.robot.ethercat.home_arms
                       ? "all joints of the arm will move far, and the arm goes to its end stops first"
                       : "all joints of the arm will move far",
           .question = "Is the arm free to move, with no person within its reach?",
           .answer = "free to move",
           .otherwise = "Clear the arm's reach and add --yes"});
}

/// Control has no model of an offset, for example, and of no arm that is far from a youBot's.
void warn_if_control_refuses(const fs::path& model) {
  try {
    (void)runtime::read_arm_model(model);
  } catch (const runtime::ConfigError& error) {
    for (const std::string& problem : error.problems())
      spdlog::warn("[teleoperation.arm] robot_file would refuse this model: {}", problem);
  }
}

int exit_code_of(const ArmExcitationOptions& options, const Driven& driven) {
  for (const std::string& problem : driven.problems) spdlog::error("recording: {}", problem);
  if (!driven.fault.empty()) {
    spdlog::error("stopped by a fault: {}", driven.fault);
    for (const std::string& finding : driven.robot_report) spdlog::error("robot: {}", finding);
    return runtime::kExitFault;
  }
  if (!driven.problems.empty()) return runtime::kExitSetup;
  if (driven.interrupted) {
    spdlog::warn("interrupted: the recordings in {} are not complete, and nothing is fitted",
                 options.out.string());
    return runtime::kExitInterrupted;
  }
  return runtime::kExitOk;
}

}  // namespace

int arm_excitation(const ArmExcitationOptions& options, const std::atomic<bool>& stop) {
  if (options.out.empty() && !options.plan_only)
    throw std::invalid_argument("--out DIR is missing: where to record");
  runtime::RobotFile model =
      options.model.empty() ? described_arm() : read_given_arm(options.model, "--model");
  const ExcitationRig rig = rig_of(options);
  const std::unique_ptr<hal::Clock> clock = runtime::make_clock(rig.virtual_time);
  const runtime::OpenedRobot opened = runtime::open_robot(rig.robot, *clock, kTourPeriod);
  runtime::MadePaths made;
  if (!options.plan_only) {
    made.add(runtime::make_output_directory(options.out));
    runtime::require_empty(options.out);
  }
  const ArmSpace space;
  const auto begin = std::chrono::steady_clock::now();
  ExcitationPlan plan = planned(options, model, limits_of(opened.robot->joints(), space));
  if (!options.quiet)
    std::fputs(arm_plan_text(plan, hal::seconds(std::chrono::steady_clock::now() - begin)).c_str(), stdout);
  if (options.plan_only) return runtime::kExitOk;

  confirm_tour(options, rig);
  ArmMotionRecording recording(options.out, options.plan.motions, made);
  const Driven driven = drive(options, rig, plan, *opened.robot, *clock, recording, stop);
  if (const int code = exit_code_of(options, driven); code != runtime::kExitOk) return code;

  if (options.model.empty()) {
    model.urdf = options.out / kUrdfFile;
    runtime::write_whole_file(model.urdf, control::youbot_urdf());
  }
  const fs::path urdf = urdf_from(options.out, model);
  const ArmFindings findings = analysed(options, model, std::move(plan));
  runtime::write_whole_file(options.out / kGivenFile,
                            runtime::robot_file_text(model, urdf, model.arm, {}, {}));
  runtime::write_whole_file(options.out / kModelFile, arm_fit_model_text(findings, model, urdf));
  warn_if_control_refuses(options.out / kModelFile);
  runtime::write_whole_file(options.out / kJsonFile, arm_fit_json(findings));
  arm_fit_page(findings).write(options.out / kPageFile);
  if (!options.quiet) {
    std::fputs(arm_fit_text(findings).c_str(), stdout);
    std::printf("model: %s\nreport: %s\n", (options.out / kModelFile).c_str(),
                (options.out / kPageFile).c_str());
  }
  return runtime::kExitOk;
}

Subcommand add_arm_excitation(CLI::App& app) {
  const auto options = std::make_shared<ArmExcitationOptions>();
  CLI::App* const command = app.add_subcommand(
      "arm-excitation", "compute motions that identify the arm, drive them, and fit the arm's model");
  command->footer(
      "The recordings are OUT/motion-N.csv; OUT/given.toml describes them to youbot-gap. The fitted model "
      "is\n"
      "OUT/robot.toml, for [teleoperation.arm] and [simulation] robot_file. The last motion is held out.\n"
      "Exit codes: 0 done, 130 interrupted, 2 usage or configuration, 3 device, set-up or disk, 4 stopped by "
      "a "
      "fault.");
  command->add_option("--out", options->out, "directory for recordings, model and report, new or empty");
  command->add_option("--robot", options->robot, "loopback, wire, ethercat:IFACE")->capture_default_str();
  command->add_option("--kind", options->kind, "kind of robot on the bus: base+arm, arm")
      ->capture_default_str();
  command->add_option("--config", options->config,
                      "youbotd's TOML file, of which [ethercat] and [plausibility] are read");
  command->add_option("--model", options->model,
                      "robot file of the arm to start from; none: the description that control has");
  command->add_option("--against", options->against,
                      "robot file of a rival of --model: compute the motions that separate the two best");
  command->add_option("--given", options->given,
                      "with --against: robot file that both rivals change; none: the description");
  command->add_option("--motions", options->plan.motions, "number of motions, the last one held out")
      ->check(runtime::finite_range(2, 20))
      ->capture_default_str();
  command->add_option("--duration", options->plan.motion_s, "of a motion, s")
      ->check(runtime::finite_range(5, 300))
      ->capture_default_str();
  command->add_option("--period", options->plan.period_s, "of the Fourier series, s")
      ->check(runtime::finite_range(2, 100))
      ->capture_default_str();
  command->add_option("--harmonics", options->plan.harmonics, "of the Fourier series")
      ->check(runtime::finite_range(1, 20))
      ->capture_default_str();
  command->add_option("--tries", options->plan.tries, "motions that are tried for each one that is driven")
      ->check(runtime::finite_range(1, 100'000))
      ->capture_default_str();
  command->add_option("--seed", options->plan.seed, "of the tries")
      ->check(runtime::finite_range(0, 2e9))
      ->capture_default_str();
  command->add_flag("--plan-only", options->plan_only,
                    "print the motions; nothing moves and nothing is written");
  CLI::Option* const real_time =
      command->add_flag("--real-time", options->real_time, "run a simulated robot in real time");
  command
      ->add_flag("--virtual-time", options->virtual_time,
                 "virtual time for a simulated robot on a bus: youbot-sim --lock-step")
      ->excludes(real_time);
  command->add_flag("--allow-non-rt", options->allow_non_real_time,
                    "continue when the system refuses real-time scheduling or memory locking");
  command->add_flag("--yes", options->yes, "the arm is free to move: do not ask");
  command->add_flag("--quiet", options->quiet, "print problems only");
  return {command, [options] {
            runtime::stop_on_signals();
            return arm_excitation(*options, runtime::stop_requested);
          }};
}

}  // namespace youbot_bench
