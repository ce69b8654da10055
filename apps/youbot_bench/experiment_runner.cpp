#include "apps/youbot_bench/experiment_runner.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "apps/youbot_bench/experiment_recording.h"
#include "apps/youbot_bench/experiment_report.h"
#include "apps/youbot_bench/experiment_task.h"
#include "apps/youbot_bench/progress.h"
#include "hal/seconds.h"
#include "identification/experiments/low_pass.h"
#include "identification/experiments/parameter.h"
#include "identification/experiments/rehearsal.h"
#include "runtime/configuration/plausibility_config.h"
#include "runtime/loop.h"
#include "runtime/robot_session.h"

namespace youbot_bench {
namespace {

using hal::seconds;

using std::chrono::nanoseconds;

std::vector<std::size_t> choose_joints(const std::vector<std::string>& names, const hal::Robot& robot) {
  const auto all = robot.joints();
  std::vector<std::size_t> chosen;
  std::string known;
  for (std::size_t i = 0; i < all.size(); ++i) {
    known += (known.empty() ? "" : ", ") + all[i].name;
    if (names.empty() ? all[i].name.starts_with("wheel") : std::ranges::count(names, all[i].name) > 0)
      chosen.push_back(i);
  }
  for (const std::string& name : names)
    if (std::ranges::count(all, name, &hal::JointInfo::name) == 0)
      throw std::invalid_argument("--joint: there is no '" + name + "' on this robot, but " + known);
  if (chosen.empty()) throw std::invalid_argument("--joint: this robot has no wheels; name one of " + known);
  return chosen;
}

/// Remaining robot time from each measurement on; a joint that takes longer delays the others.
std::vector<double> time_left_from(const std::vector<ExperimentTask::Joint>& joints) {
  const int count = joints.front().experiment->measurement_count();
  std::vector<double> left(static_cast<std::size_t>(count) + 1, 0.0);
  for (int i = count - 1; i >= 0; --i) {
    double longest_s = 0.0;
    for (const auto& joint : joints) longest_s = std::max(longest_s, joint.experiment->duration_s(i));
    left[static_cast<std::size_t>(i)] = left[static_cast<std::size_t>(i) + 1] + longest_s;
  }
  return left;
}

/// Fits the plan to each joint with end stops; each moves the load of others, so they go one at a time.
void fit_to_end_stops(const ExperimentPlan& plan, const ExperimentOptions& options, const hal::Robot& robot,
                      int first_measurement, std::vector<ExperimentTask::Joint>& joints) {
  const auto all = robot.joints();
  const auto limited = std::ranges::count_if(
      joints, [&](const ExperimentTask::Joint& joint) { return all[joint.index].range.limited(); });
  if (limited > 0 && joints.size() > 1)
    throw std::invalid_argument("--joint: joints of an arm are measured one at a time, without others");
  if (limited == 0 && options.start_rad)
    throw std::invalid_argument("--start: only a joint with end stops is taken to a place");
  for (ExperimentTask::Joint& joint : joints) {
    if (!all[joint.index].range.limited()) continue;
    const double period_s = seconds(options.period);
    const auto rehearsed = plan.make(all[joint.index], period_s);
    const identification::experiments::Demand demand =
        identification::experiments::rehearse(*rehearsed, first_measurement, period_s);
    joint.fit.emplace(JointFit::Plan{.experiment = plan.name,
                                     .demand = demand,
                                     .max_travel_rad = options.max_travel_rad,
                                     .start_rad = options.start_rad},
                      all, joint.index);
  }
}

/// Otherwise earlier events would affect a measurement.
void require_memory_shorter_than(double settle_s, double cutoff_rad_per_s) {
  const double memory_s = identification::experiments::kForgotten / cutoff_rad_per_s;
  if (settle_s < memory_s)
    throw std::invalid_argument("the filter of the velocity remembers " +
                                identification::experiments::number_text(memory_s) + " s, but only " +
                                identification::experiments::number_text(settle_s) +
                                " s are waited before a measurement: raise --settle, --rest or "
                                "--filter-cutoff");
}

/// Writes the last frames on the bus next to the recording, under a unique name.
void keep_frames(const drivers::ethercat::PcapRing& frames, const ExperimentPlan& plan,
                 const ExperimentOptions& options, ExperimentOutcome& outcome) {
  std::error_code unknown;
  std::filesystem::path file;
  for (int number = 1; file.empty() || std::filesystem::exists(file, unknown); ++number)
    file = options.directory / plan.name / ("fault-" + std::to_string(number) + ".pcapng");
  try {
    frames.write(file.string(), outcome.fault);
    outcome.frames = file;
  } catch (const std::exception& error) {
    outcome.recording_problems.emplace_back(error.what());
  }
}

/// The motors are off and the recording is closed: a failure here only costs the page.
void write_report(const ExperimentPlan& plan, const ExperimentOptions& options, ExperimentOutcome& outcome) {
  try {
    write_experiment_report(options.directory, {.experiment = plan.name,
                                                .finished = outcome.finished,
                                                .planned = outcome.planned,
                                                .fault = outcome.fault});
  } catch (const std::exception& error) {
    outcome.recording_problems.emplace_back(error.what());
  }
}

}  // namespace

ExperimentOutcome run_experiment(const ExperimentPlan& plan, const ExperimentOptions& options,
                                 hal::Robot& robot, hal::Clock& clock, const std::atomic<bool>& stop) {
  const double period_s = seconds(options.period);
  std::vector<ExperimentTask::Joint> joints;
  ExperimentRecording::Description description{.directory = options.directory,
                                               .experiment = plan.name,
                                               .result = plan.result,
                                               .configuration = plan.configuration};
  for (const std::size_t index : choose_joints(options.joints, robot)) {
    joints.push_back({index, plan.make(robot.joints()[index], period_s)});
    description.joints.push_back(robot.joints()[index].name);
  }
  const identification::experiments::JointExperiment& first = *joints.front().experiment;
  description.commands = first.recorded_commands();
  description.result_columns.assign(first.result_columns().begin(), first.result_columns().end());
  for (std::size_t i = 0; i < first.result_columns().size(); ++i)
    description.not_measured.push_back(first.not_measured(i));
  require_memory_shorter_than(first.settle_s(), options.filter_cutoff_rad_per_s);
  const int cycles_per_row =
      std::max(1, static_cast<int>(std::lround(1 / (options.record_rate_Hz * period_s))));
  description.rate_Hz = 1 / (cycles_per_row * period_s);

  ExperimentOutcome outcome;
  outcome.planned = first.measurement_count();
  const std::vector<double> left_s = time_left_from(joints);
  Progress progress(plan.name, outcome.planned, options.quiet);
  description.about_every_100_ms = [&progress] { progress.show(); };
  ExperimentRecording recording(description, options.resume);
  const int done_before = recording.finished_measurements();
  outcome.finished = done_before;
  outcome.not_measured = recording.not_measured();
  if (done_before > outcome.planned)
    throw std::invalid_argument("--resume: more measurements are finished than this experiment has");
  if (done_before == outcome.planned) {
    recording.close();
    write_report(plan, options, outcome);
    return outcome;
  }

  fit_to_end_stops(plan, options, robot, done_before, joints);
  runtime::warn_of(options.checks_off);
  ExperimentCycle::Config config;
  config.period = options.period;
  config.enable_timeout = options.enable_timeout;
  config.checks_off = options.checks_off;
  config.max_speed_rad_per_s = options.max_speed_rad_per_s;
  config.max_travel_rad = options.max_travel_rad;
  config.filter_cutoff_rad_per_s = options.filter_cutoff_rad_per_s;
  config.cycles_per_row = cycles_per_row;
  config.first_measurement = done_before;
  config.first_time_s = std::max(0.0, recording.finished_until_s());
  config.wait_for_recording = options.virtual_time;
  ExperimentCycle cycle(config, robot, std::move(joints), recording);
  const double planned_s = left_s[static_cast<std::size_t>(done_before)];
  runtime::LoopStatistics loop;
  {
    const runtime::RobotActivation activation(robot);
    runtime::RealTimeThread
        real_time;  // entered last, when everything is allocated and all other threads run
    if (!options.virtual_time)
      outcome.not_real_time =
          runtime::enter_real_time(real_time, options.real_time, options.allow_non_real_time, "youbot-bench");
    runtime::run_loop(
        clock, options.period, cycle,
        [&](nanoseconds /*elapsed*/) noexcept {
          outcome.interrupted = outcome.interrupted || stop.load(std::memory_order_relaxed);
          return outcome.interrupted || recording.failed();
        },
        [&](const runtime::CycleTimes&) noexcept {
          const ExperimentTask& task = cycle.task();
          const auto next = static_cast<std::size_t>(std::min(task.measurement(), outcome.planned - 1));
          const double ahead_s = std::max(0.0, left_s[next] - task.measurement_time_s());
          progress.set(static_cast<int>(next), planned_s - ahead_s, ahead_s);
        },
        loop);
    if (const std::string misfit = cycle.task().misfit(); !misfit.empty())
      throw std::invalid_argument(misfit);
    recording.keep();
    outcome.robot_report = robot.report();
  }
  outcome.robot_time = loop.robot_time;
  outcome.wall_time = loop.wall_time;
  outcome.overruns = loop.overruns;
  recording.close();
  progress.finish();
  outcome.finished = recording.measurements_on_disk();
  outcome.recording_problems = recording.problems();
  outcome.not_measured = recording.not_measured();
  outcome.once_silent_checks = cycle.once_silent_checks();
  if (const runtime::StopReason& reason = cycle.stop_reason())
    outcome.fault = fmt::format("measurement {}, {:.3f} s: {}", cycle.task().measurement() + 1,
                                seconds(reason.time), what(reason, cycle.cut_short_by(), robot));
  write_report(plan, options, outcome);
  return outcome;
}

ExperimentOutcome run_experiment(const ExperimentPlan& plan, const ExperimentOptions& options,
                                 const runtime::RobotOptions& robot, const std::atomic<bool>& stop) {
  if (options.virtual_time) runtime::check_virtual_time(robot.name);
  std::unique_ptr<hal::Clock> clock;
  if (options.virtual_time)
    clock = std::make_unique<hal::VirtualClock>();
  else
    clock = std::make_unique<hal::SteadyClock>();
  const runtime::OpenedRobot opened = runtime::open_robot(robot, *clock, options.period);
  ExperimentOutcome outcome = run_experiment(plan, options, *opened.robot, *clock, stop);
  if (!outcome.fault.empty() && opened.capture) keep_frames(*opened.capture, plan, options, outcome);
  return outcome;
}

}  // namespace youbot_bench
