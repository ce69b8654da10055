#include "apps/youbot_bench/transparency.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <set>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "apps/youbot_bench/transparency_report.h"
#include "control/master_frame.h"
#include "operation/config.h"
#include "operation/teleop_task.h"
#include "runtime/configuration/finite_range.h"
#include "runtime/log.h"
#include "runtime/open_haptic.h"
#include "runtime/program/exit_code.h"
#include "runtime/program/progress_line.h"
#include "runtime/program/stop_on_signals.h"
#include "runtime/recording/output_directory.h"
#include "runtime/robot_session.h"

namespace youbot_bench {
namespace {

namespace two_port = identification::two_port;
using control::TeleopPhase;
using Eigen::Vector3d;
using std::chrono::nanoseconds;

constexpr std::chrono::milliseconds kPeriod{1};
constexpr double kPeriod_s = 1e-3;
/// After the start-up, and after a change at the end effector.
constexpr int kRestCycles = 3000;
/// Duration of the start-up, for the progress display only.
constexpr double kStartUp_s = 35.0;
constexpr int kCyclesPerTelling = 200;

operation::TeleopCycle::Config cycle_config(const TransparencyPlan& plan,
                                            const TransparencyCondition& condition) {
  operation::TeleopCycle::Config config;
  config.control = plan.control;
  control::Teleoperation::Config& control = config.control;
  control.stiff.translation_N_per_m = condition.stiffness_N_per_m;
  control.soft.translation_N_per_m = std::min(control.soft.translation_N_per_m, condition.stiffness_N_per_m);
  control.force_feedback = condition.feedback != Feedback::kNone;
  control.feedback.contact_share = condition.feedback == Feedback::kContact ? 1.0
                                   : condition.feedback == Feedback::kMixed ? 0.5
                                                                            : 0.0;
  control.detect_release = false;
  control.feedback.force_limit_N = std::min(control.feedback.force_limit_N, plan.force_limit_N);
  return config;
}

runtime::HapticOptions haptic_options(const TransparencyPlan& plan) {
  runtime::HapticOptions options;
  options.force_limit_N = plan.force_limit_N;
  options.limits.slew_N_per_s = plan.slew_N_per_s;
  options.hand = plan.hand;
  return options;
}

/// Robot, handle and the loop between them, for one condition.
class Measurement {
 public:
  Measurement(const TransparencyPlan& plan, const TransparencyCondition& condition,
              const RobotMaker& make_robot, const std::function<bool(double)>& tell)
      : plan_(plan),
        tell_(tell),
        direction_W_(Vector3d::Unit(plan.axis)),
        direction_H_(control::turned_H_W(direction_W_)),
        robot_(make_robot(clock_, kPeriod)),
        master_(runtime::open_haptic(haptic_options(plan), clock_, kPeriod)),
        cycle_(cycle_config(plan, condition), *robot_.robot, *master_.device),
        activation_(*robot_.robot) {
    if (plan.realizations < 2)
      throw std::invalid_argument("transparency: realizations is " + std::to_string(plan.realizations) +
                                  ", must be two or more: friction repeats with the period");
    for (int i = 0; i < plan.realizations; ++i)
      excitations_.emplace_back(plan.excitation, kPeriod_s, static_cast<std::uint64_t>(i + 1));
    whole_s_ = kStartUp_s + 4.0 * plan.realizations * plan.excitation.period_s;
    result_.condition = condition;
    master_.device->activate();
  }

  /// Empty if it was asked to stop.
  std::optional<TransparencyResult> run() {
    std::vector<two_port::PortExperiment> experiments;
    const bool measured =
        start() && measure("free", experiments) && tether() && measure("tethered", experiments);
    if (stopped_) return std::nullopt;
    if (!measured) {
      result_.fault =
          describe(cycle_.stop_reason(), cycle_.cut_short_by(), *robot_.robot, master_.device.get());
      return result_;
    }
    for (double* share : {&result_.passive_share, &result_.limited_share, &result_.rate_share})
      *share /= static_cast<double>(counted_);
    const two_port::Excitation& excitation = excitations_.front();
    result_.points = two_port::estimate_hybrid_matrix(experiments, excitation.harmonics(),
                                                      excitation.samples_per_period(), kPeriod_s);
    if (std::ranges::count_if(result_.points, &two_port::HybridPoint::ok) >= 3)
      result_.measures = two_port::measure(result_.points, two_port::usual_environments());
    return result_;
  }

 private:
  bool start() {
    while (cycle_.task().phase() != TeleopPhase::kOperating)
      if (cycle_.finished() || !step(0.0)) return false;
    return rest();
  }
  bool rest() {
    for (int i = 0; i < kRestCycles; ++i)
      if (!step_operating(0.0)) return false;
    return true;
  }
  /// Slack at the present position, so that it pulls only when the hand moves the end effector away.
  bool tether() {
    tethered_at_m_ = direction_W_.dot(tip_W_m());
    return rest();
  }
  /// Only in one direction: across it the end effector stays as free as without, or there would be more than
  /// two ports. Held during a cycle, so that the recorded value is the one that acts.
  double environment_force_N() const {
    if (!tethered_at_m_) return 0.0;
    return plan_.tether_N_per_m * (direction_W_.dot(tip_W_m()) - *tethered_at_m_) +
           plan_.tether_N_s_per_m * tip_velocity_m_per_s();
  }

  bool measure(const std::string& environment, std::vector<two_port::PortExperiment>& experiments) {
    two_port::PortExperiment& experiment = experiments.emplace_back();
    experiment.environment = environment;
    const Vector3d begin_W_m = tip_W_m();
    for (const two_port::Excitation& excitation : excitations_) {
      const std::size_t samples = excitation.samples_per_period();
      for (std::size_t n = 0; n < samples; ++n)
        if (!step_operating(excitation.force_N(n))) return false;
      two_port::PortRecord& record = experiment.records.emplace_back();
      for (std::size_t n = 0; n < samples; ++n) {
        if (!step_operating(excitation.force_N(n))) return false;
        keep(excitation.force_N(n), begin_W_m, record);
      }
    }
    return true;
  }

  /// Means between the last two samples: displacements for the velocities.
  void keep(double excitation_N, const Vector3d& begin_W_m, two_port::PortRecord& record) {
    record.excitation_N.push_back(excitation_N);
    record.hand_force_N.push_back(direction_H_.dot(master_.hand->grip_force_N()));
    record.master_velocity_m_per_s.push_back(direction_H_.dot(master_.hand->p_HD_m() - last_H_m_) /
                                             kPeriod_s);
    record.environment_force_N.push_back(environment_N_);
    record.slave_velocity_m_per_s.push_back(tip_velocity_m_per_s());
    const operation::TeleopRecord& cycle = cycle_.record();
    ++counted_;
    result_.passive_share += cycle.withheld_N > 0.0 ? 1.0 : 0.0;
    result_.limited_share += cycle.limited ? 1.0 : 0.0;
    result_.rate_share += cycle.rate_control ? 1.0 : 0.0;
    result_.furthest_pen_m =
        std::max(result_.furthest_pen_m, std::abs(direction_H_.dot(master_.hand->p_HD_m())));
    result_.furthest_tip_m =
        std::max(result_.furthest_tip_m, std::abs(direction_W_.dot(tip_W_m() - begin_W_m)));
  }

  Vector3d tip_W_m() const { return robot_.manipulator->X_WT().translation(); }
  double tip_velocity_m_per_s() const { return direction_W_.dot(tip_W_m() - last_W_m_) / kPeriod_s; }
  bool step_operating(double excitation_N) {
    return step(excitation_N) && cycle_.task().phase() == TeleopPhase::kOperating;
  }
  /// One cycle with this force on the hand. False if it was asked to stop.
  bool step(double excitation_N) {
    master_.hand->push(excitation_N * direction_H_);
    environment_N_ = environment_force_N();
    robot_.manipulator->push_tip(-environment_N_ * direction_W_);
    last_H_m_ = master_.hand->p_HD_m();
    last_W_m_ = tip_W_m();
    clock_.sleep_until(clock_.now() + kPeriod);
    cycle_.step(clock_.now());
    ++cycles_;
    if (tell_ && cycles_ % kCyclesPerTelling == 0)
      stopped_ = !tell_(std::min(1.0, static_cast<double>(cycles_) * kPeriod_s / whole_s_));
    return !stopped_;
  }

  const TransparencyPlan& plan_;
  const std::function<bool(double)>& tell_;
  Vector3d direction_W_;
  Vector3d direction_H_;
  std::vector<two_port::Excitation> excitations_;
  hal::VirtualClock clock_;
  runtime::OpenedRobot robot_;
  runtime::OpenedHaptic master_;
  operation::TeleopCycle cycle_;
  runtime::RobotActivation activation_;
  Vector3d last_H_m_ = Vector3d::Zero();
  Vector3d last_W_m_ = Vector3d::Zero();
  std::optional<double> tethered_at_m_{};
  double environment_N_ = 0.0;  // of the end effector on its environment, in this cycle
  TransparencyResult result_;
  std::int64_t cycles_ = 0;
  std::int64_t counted_ = 0;
  double whole_s_ = 0.0;
  bool stopped_ = false;
};

int axis_from(const std::string& name) {
  for (int axis = 0; axis < 3; ++axis)
    if (name == std::string(1, static_cast<char>('x' + axis))) return axis;
  throw std::invalid_argument("--axis: there is no '" + name + "'; known: x, y, z");
}

/// Each feedback with each stiffness.
std::vector<TransparencyCondition> conditions_of(const TransparencyOptions& options) {
  std::vector<TransparencyCondition> conditions;
  std::set<std::pair<Feedback, double>> seen;
  for (const std::string& name : options.feedback)
    for (const double stiffness_N_per_m : options.stiffness_N_per_m) {
      if (!(stiffness_N_per_m >= 1.0 && stiffness_N_per_m <= kMaxCoupling_N_per_m))
        throw std::invalid_argument("--stiffness: " + std::to_string(stiffness_N_per_m) +
                                    " N/m is not within 1 to " +
                                    std::to_string(static_cast<int>(kMaxCoupling_N_per_m)));
      if (!seen.emplace(feedback_from(name), stiffness_N_per_m).second)
        throw std::invalid_argument("--feedback " + name + " with --stiffness " +
                                    std::to_string(stiffness_N_per_m) + " is asked for twice");
      conditions.push_back({feedback_from(name), stiffness_N_per_m});
    }
  if (conditions.empty())
    throw std::invalid_argument("--feedback and --stiffness: at least one of each is needed");
  return conditions;
}

void require_simulation(const char* option, const std::string& name) {
  if (name == "loopback") return;
  throw std::invalid_argument(std::string(option) + ": the forces at both ends have to be known, and '" +
                              name +
                              "' has no force sensors at hand and end effector; only the simulated robot and "
                              "handle have them: loopback");
}

operation::Config load(const TransparencyOptions& options) {
  operation::Config config;
  if (options.config.empty()) {
    config.robot.ethercat.kind = hal::YoubotKind::kBaseAndArm;
    config.teleoperation.robot.base.wrench_limits = {.force_N = 60.0, .moment_Nm = 20.0};
  } else {
    config = operation::load_config(options.config);
  }
  if (!options.robot.empty()) config.robot.name = options.robot;
  if (!options.haptic.empty()) config.haptic.name = options.haptic;
  require_simulation("--robot", config.robot.name);
  require_simulation("--haptic", config.haptic.name);
  if (config.robot.ethercat.kind != hal::YoubotKind::kBaseAndArm)
    throw std::invalid_argument("--config: " + options.config +
                                " is of a robot without an arm; set ethercat.kind = \"base+arm\"");
  if (config.cycle.period != kPeriod)
    throw std::invalid_argument("--config: " + options.config + ": loop.period_s has to be 0.001 here");
  config.robot.scene = {};  // without other objects
  return config;
}

}  // namespace

const char* name_of(Feedback feedback) noexcept {
  switch (feedback) {
    case Feedback::kPositionError: return "position-error";
    case Feedback::kContact: return "contact";
    case Feedback::kMixed: return "mixed";
    case Feedback::kNone: return "none";
  }
  return "unknown";
}

Feedback feedback_from(const std::string& name) {
  for (const Feedback feedback :
       {Feedback::kPositionError, Feedback::kContact, Feedback::kMixed, Feedback::kNone})
    if (name == name_of(feedback)) return feedback;
  throw std::invalid_argument("--feedback: there is no '" + name +
                              "'; known: position-error, contact, mixed, none");
}

sim::HandParameters soft_hand() {
  return {.hand_mass_kg = 0.1, .hand_stiffness_N_per_m = 40.0, .hand_damping_N_s_per_m = 4.0};
}

std::optional<TransparencyResult> measure_transparency(const TransparencyPlan& plan,
                                                       const TransparencyCondition& condition,
                                                       const RobotMaker& make_robot,
                                                       const std::function<bool(double)>& tell) {
  return Measurement(plan, condition, make_robot, tell).run();
}

int transparency(const TransparencyOptions& options, const std::atomic<bool>& stop) {
  const std::vector<TransparencyCondition> conditions = conditions_of(options);
  const operation::Config config = load(options);
  for (const TransparencyCondition& condition : conditions)
    if ((condition.feedback == Feedback::kContact || condition.feedback == Feedback::kMixed) &&
        !config.teleoperation.tank.active)
      throw std::invalid_argument(std::string("--feedback ") + name_of(condition.feedback) +
                                  ": needs 'teleoperation.feedback.passivity', which is off in --config " +
                                  options.config + ": the observed force comes late");
  TransparencyPlan plan{.axis = axis_from(options.axis),
                        .excitation = options.excitation,
                        .realizations = options.realizations,
                        .control = config.teleoperation,
                        .hand = soft_hand(),
                        .force_limit_N = config.haptic.force_limit_N,
                        .slew_N_per_s = config.haptic.limits.slew_N_per_s};
  plan.hand.device_mass_kg = config.haptic.hand.device_mass_kg;
  plan.hand.device_drag_N_s_per_m = config.haptic.hand.device_drag_N_s_per_m;
  const two_port::Excitation would_throw_before_anything_is_written(plan.excitation, kPeriod_s, 1);
  const std::filesystem::path out(options.out);
  runtime::make_output_directory(out);
  runtime::require_empty(out);

  const RobotMaker make_robot = [&config](const hal::Clock& clock, nanoseconds period) {
    return runtime::open_robot(config.robot, clock, period);
  };
  runtime::ProgressLine progress("youbot-bench transparency", options.quiet);
  std::vector<TransparencyResult> results;
  for (const TransparencyCondition& condition : conditions) {
    const std::optional<TransparencyResult> result =
        measure_transparency(plan, condition, make_robot, [&](double done) {
          progress.show(condition_text(condition), (static_cast<double>(results.size()) + done) /
                                                       static_cast<double>(conditions.size()));
          return !stop.load(std::memory_order_relaxed);
        });
    if (!result) {
      spdlog::info("stopped on request, nothing to report");
      return runtime::kExitInterrupted;
    }
    write_transparency_csv(out, plan, *result, options.config);
    results.push_back(*result);
  }
  progress.show("done", 1);
  progress.finish();

  transparency_page(plan, results).write(out / "report.html");
  if (!options.quiet) {
    std::fputs(transparency_text(plan, results).c_str(), stdout);
    std::printf("report: %s\n", (out / "report.html").c_str());
  }
  int code = runtime::kExitOk;
  for (const TransparencyResult& result : results) {
    if (result.fault.empty()) continue;
    spdlog::error("{}: ended by a fault at {}", condition_text(result.condition), result.fault);
    code = runtime::kExitFault;
  }
  return code;
}

Subcommand add_transparency(CLI::App& app) {
  const auto options = std::make_shared<TransparencyOptions>();
  CLI::App* const command =
      app.add_subcommand("transparency", "measure transparency and tracking of teleoperation, in simulation");
  command->add_option("--config", options->config, "youbotd's TOML file, such as teleop.toml");
  command->add_option("--robot", options->robot, "loopback; none: the file's");
  command->add_option("--haptic", options->haptic, "loopback; none: the file's");
  command
      ->add_option("--feedback", options->feedback,
                   "position-error, contact, mixed or none; several with commas between")
      ->delimiter(',')
      ->capture_default_str();
  command
      ->add_option("--stiffness", options->stiffness_N_per_m,
                   "of the coupling, N/m; several with commas between")
      ->delimiter(',')
      ->check(runtime::finite_range(1.0, kMaxCoupling_N_per_m))
      ->capture_default_str();
  command->add_option("--axis", options->axis, "x forward, y left, z up")->capture_default_str();
  command->add_option("--peak", options->excitation.peak_N, "largest force of the excitation, N")
      ->check(runtime::finite_range(1e-3, 100.0))
      ->capture_default_str();
  command->add_option("--lowest", options->excitation.lowest_Hz, "lowest frequency, Hz")
      ->check(runtime::finite_range(1e-3, 500.0))
      ->capture_default_str();
  command->add_option("--highest", options->excitation.highest_Hz, "highest frequency, Hz")
      ->check(runtime::finite_range(1e-3, 500.0))
      ->capture_default_str();
  command->add_option("--lines", options->excitation.lines, "number of frequencies")
      ->check(runtime::finite_range(3, 500))
      ->capture_default_str();
  command->add_option("--period", options->excitation.period_s, "of the excitation, s")
      ->check(runtime::finite_range(0.1, 1000.0))
      ->capture_default_str();
  command->add_option("--realizations", options->realizations, "excitations with other phases")
      ->check(runtime::finite_range(2, 100))
      ->capture_default_str();
  command->add_option("--out", options->out, "directory for a CSV file of each condition, and report.html")
      ->required();
  command->add_flag("--quiet", options->quiet, "print problems only");
  return {command, [options] {
            runtime::stop_on_signals();
            return transparency(*options, runtime::stop_requested);
          }};
}

}  // namespace youbot_bench
