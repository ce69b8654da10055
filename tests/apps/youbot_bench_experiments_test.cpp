// Experiments end to end: measurements, files on disk, and stops.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "apps/youbot_bench/experiment_recording.h"
#include "apps/youbot_bench/experiment_runner.h"
#include "apps/youbot_bench/experiment_task.h"
#include "identification/experiments/staircase.h"
#include "identification/experiments/steady_state.h"
#include "identification/experiments/torque_ramp.h"
#include "model/friction/wheel_curve.h"
#include "runtime/recording/recording_reader.h"
#include "sim/joint_sensors.h"
#include "tests/hal/can_bench.h"
#include "tests/support/built_paths.h"
#include "tests/support/held_up_robot.h"
#include "tests/support/no_alloc_guard.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/without_start.h"

namespace youbot_bench {
namespace youbot_bench_experiments_test {

using namespace std::chrono_literals;
namespace fs = std::filesystem;
using Rows = std::vector<std::vector<double>>;

/// Rows of numbers below the header of a recording.
Rows rows(const fs::path& path) {
  std::ifstream file(path);
  Rows result;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("#") || line.starts_with("time_s")) continue;
    std::vector<double> row;
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) row.push_back(std::stod(cell));
    result.push_back(row);
  }
  return result;
}

std::string text_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Passes everything on; a hook sees each exchange and may turn it into a fault.
class HookedRobot final : public hal::RobotWrapper {
 public:
  using Hook =
      std::function<hal::CycleStatus(std::uint64_t cycle, const hal::RobotCommand&, hal::CycleStatus)>;
  HookedRobot(hal::Robot& robot, Hook hook) : RobotWrapper(robot), hook_(std::move(hook)) {}

  void deactivate() noexcept override {
    RobotWrapper::deactivate();
    deactivated = true;
  }
  hal::CycleStatus exchange(const hal::RobotCommand& command, hal::RobotSample& sample) noexcept override {
    last_command = command;
    return hook_(cycle_++, command, RobotWrapper::exchange(command, sample));
  }
  std::vector<std::string> report() const override { return {"a finding"}; }

  hal::RobotCommand last_command{};
  bool deactivated = false;

 private:
  Hook hook_;
  std::uint64_t cycle_ = 0;
};

class BenchExperiment : public ::testing::Test {
 protected:
  BenchExperiment() {
    options.directory = directory / "run";
    options.virtual_time = true;
    options.quiet = true;
    options.record_rate_Hz = 10;
    loopback.simulation.on_ground = false;
  }

  /// A map at these velocities, 3 s each, of all wheels.
  static ExperimentPlan map_at(std::vector<double> velocities) {
    return {
        .name = "steady-state",
        .result = "steady-state-map",
        .make =
            [velocities](const hal::JointInfo&, double period_s) {
              return std::make_unique<identification::experiments::SteadyState>(
                  identification::experiments::SteadyStateConfig{.settle_s = 1, .measure_s = 2, .extra_s = 0},
                  velocities, period_s);
            },
        .configuration = "experiment = \"steady-state\"\n"};
  }
  /// Likewise, slow ramps of torque with two measurements for each of `repeats`.
  static ExperimentPlan ramps(identification::experiments::TorqueRampConfig config) {
    return {.name = "torque-ramp",
            .result = "torque-ramp-result",
            .make =
                [config](const hal::JointInfo&, double period_s) {
                  return std::make_unique<identification::experiments::TorqueRamp>(
                      config, sim::SensorParameters{}.position_resolution_rad, period_s);
                },
            .configuration = "experiment = \"torque-ramp\"\n"};
  }
  ExperimentOutcome run(const ExperimentPlan& plan, HookedRobot::Hook hook = pass_on()) {
    hal::VirtualClock clock;
    const runtime::OpenedRobot opened = runtime::open_robot(loopback, clock, options.period);
    return run_on(*opened.robot, clock, plan, std::move(hook));
  }
  ExperimentOutcome run_on(hal::Robot& watched, hal::Clock& clock, const ExperimentPlan& plan,
                           HookedRobot::Hook hook = pass_on()) {
    HookedRobot robot(watched, std::move(hook));
    const ExperimentOutcome outcome = run_experiment(plan, options, robot, clock, stop);
    EXPECT_TRUE(robot.deactivated);
    last_command = robot.last_command;
    return outcome;
  }
  /// Without a robot that is watched, for runs that never get to move it.
  ExperimentOutcome run_unchecked(const ExperimentPlan& plan) {
    return run_experiment(plan, options, loopback, stop);
  }
  static HookedRobot::Hook pass_on() {
    return [](std::uint64_t, const hal::RobotCommand&, hal::CycleStatus status) { return status; };
  }
  HookedRobot::Hook stop_after(std::uint64_t cycles) {
    return [this, cycles](std::uint64_t cycle, const hal::RobotCommand&, hal::CycleStatus status) {
      if (cycle == cycles) stop = true;
      return status;
    };
  }
  /// In one go on one robot, and on another that is stopped after `cycles` and resumes there. Directories
  /// "run" and "in-parts".
  void run_whole_and_in_parts(const ExperimentPlan& plan, std::uint64_t cycles) {
    EXPECT_TRUE(run(plan).fault.empty());
    options.directory = directory / "in-parts";
    hal::VirtualClock clock;
    const runtime::OpenedRobot opened = runtime::open_robot(loopback, clock, options.period);
    EXPECT_TRUE(run_on(*opened.robot, clock, plan, stop_after(cycles)).interrupted);
    stop = false;
    options.resume = true;
    const ExperimentOutcome rest = run_on(*opened.robot, clock, plan);
    EXPECT_EQ(rest.finished, rest.planned);
    EXPECT_TRUE(rest.fault.empty()) << rest.fault;
  }
  fs::path map(int wheel) const {
    return options.directory / "steady-state-map" / ("wheel-" + std::to_string(wheel) + ".csv");
  }
  fs::path raw(int wheel) const {
    return options.directory / "steady-state" / ("wheel-" + std::to_string(wheel) + ".csv");
  }

  support::TemporaryDirectory directory;
  ExperimentOptions options;
  runtime::RobotOptions loopback;
  std::atomic<bool> stop{false};
  hal::RobotCommand last_command{};
};

TEST_F(BenchExperiment, TheMapAgreesWithThePublishedWheelCurves) {
  // The check values of the thesis notes: wheel, rad/s, N·m.
  constexpr double kPublished[][3] = {{1, 1.0, 0.0536847}, {1, 3.2, 0.122475},   {1, -9.0, -0.310798},
                                      {2, 2.0, 0.0549988}, {2, -4.0, -0.123525}, {3, 5.0, 0.149057},
                                      {4, -7.0, -0.299831}};
  const std::vector<double> velocities{1.0, 2.0, 3.2, 5.0, -4.0, -7.0, -9.0};
  const ExperimentOutcome outcome = run(map_at(velocities));
  EXPECT_TRUE(outcome.fault.empty()) << outcome.fault;
  EXPECT_TRUE(outcome.recording_problems.empty());
  EXPECT_EQ(outcome.finished, 7);
  for (const auto& [wheel, velocity, torque_Nm] : kPublished) {
    const Rows measured = rows(map(static_cast<int>(wheel)));
    ASSERT_EQ(measured.size(), velocities.size());
    for (const auto& row : measured) {
      if (row[4] != velocity) continue;
      // A wheel turns a whole number of encoder steps in 2 s, give or take one, and the filter's memory.
      EXPECT_NEAR(row[1], velocity, 0.01);
      // Half a count of the current, 8.7e-4 N·m, beside the interval; the mean speed is not quite the
      // nominal.
      const double off_Nm = model::friction::wheel_curve_Nm(static_cast<int>(wheel), row[1]) -
                            model::friction::wheel_curve_Nm(static_cast<int>(wheel), velocity);
      EXPECT_NEAR(row[2], torque_Nm + off_Nm, row[3] + 4.4e-4) << "wheel " << wheel << " at " << velocity;
      EXPECT_LT(row[3], 1e-3);
    }
  }
}

TEST_F(BenchExperiment, MapAndRecordingHaveTheContractsFormat) {
  (void)run(map_at({1.0, -1.0}));
  std::ifstream head(map(3));
  std::string line;
  for (const char* expected : {"# youbot recording v1", "# rig: wheel-3", "# experiment: steady-state-map"}) {
    std::getline(head, line);
    EXPECT_EQ(line, expected);
  }
  while (line.starts_with("#")) std::getline(head, line);
  EXPECT_EQ(line, "time_s,velocity_rad_per_s,torque_measured_Nm,torque_ci95_Nm,velocity_command_rad_per_s");
  const std::string text = text_of(raw(3));
  EXPECT_NE(text.find("# experiment: steady-state\n# sample_rate_Hz: 10\n"), std::string::npos);
  EXPECT_NE(
      text.find("\ntime_s,torque_measured_Nm,position_rad,velocity_rad_per_s,velocity_command_rad_per_s\n"),
      std::string::npos);
  const Rows recorded = rows(raw(3));
  ASSERT_EQ(recorded.size(), 60U);  // 2·3 s at 10 Hz
  for (std::size_t i = 1; i < recorded.size(); ++i)
    EXPECT_NEAR(recorded[i][0] - recorded[i - 1][0], 0.1, 1e-9);
  EXPECT_EQ(text_of(options.directory / "steady-state/experiment.toml"), "experiment = \"steady-state\"\n");
}

TEST_F(BenchExperiment, InterruptedAndResumedItHasTheSameMeasurementsAsInOneGo) {
  const ExperimentPlan plan = map_at({0.5, 1.0, 2.0, -1.0, -3.0});
  const ExperimentOutcome whole = run(plan);
  EXPECT_EQ(whole.finished, 5);
  const fs::path in_one_go = options.directory;

  options.directory = directory / "in-parts";
  const ExperimentOutcome first = run(plan, stop_after(7500));  // into the third
  EXPECT_TRUE(first.interrupted);
  EXPECT_TRUE(first.fault.empty()) << first.fault;
  EXPECT_EQ(first.finished, 2);
  EXPECT_FALSE(last_command.enable);
  options.resume = true;
  stop = false;
  EXPECT_EQ(run(plan, stop_after(100)).finished, 2);  // before anything was finished
  stop = false;
  EXPECT_EQ(run(plan, stop_after(4000)).finished, 3);
  stop = false;
  const ExperimentOutcome last = run(plan);
  EXPECT_EQ(last.finished, 5);
  EXPECT_FALSE(last.interrupted);

  for (int wheel = 1; wheel <= 4; ++wheel) {
    const Rows once = rows(in_one_go / "steady-state-map" / ("wheel-" + std::to_string(wheel) + ".csv"));
    const Rows parts = rows(map(wheel));
    ASSERT_EQ(parts.size(), once.size());
    for (std::size_t i = 0; i < once.size(); ++i) {
      EXPECT_NEAR(parts[i][0], once[i][0], 0.01);  // a cycle more or less at each seam
      EXPECT_EQ(parts[i][4], once[i][4]);
      EXPECT_NEAR(parts[i][2], once[i][2], parts[i][3] + once[i][3] + 8.7e-4);
    }
    const Rows recorded = rows(raw(wheel));
    EXPECT_NEAR(static_cast<double>(recorded.size()), 150, 2);  // nothing twice, nothing missing
    for (std::size_t i = 1; i < recorded.size(); ++i) EXPECT_GT(recorded[i][0], recorded[i - 1][0]);
  }
  for (const auto& entry : fs::recursive_directory_iterator(options.directory))
    EXPECT_NE(entry.path().extension(), ".resumed") << entry.path();

  const std::string before = support::without_start(text_of(map(1)));
  EXPECT_EQ(run_unchecked(plan).finished, 5);  // nothing left to do
  EXPECT_EQ(support::without_start(text_of(map(1))), before);
}

TEST_F(BenchExperiment, TheMeasurementThatIsMadeAgainAfterAnInterruptionForgetsIt) {
  // The shortest time to settle that the filters allow, and speeds so far apart that what came before would
  // show: before an interruption the wheel turns the other way, after it it stands.
  identification::experiments::SteadyStateConfig config{.settle_s = 1, .measure_s = 2, .extra_s = 0};
  const std::vector<double> velocities{4.0, -4.0, 8.0, -1.0};
  run_whole_and_in_parts(map_at(velocities), 4000);  // into the second
  for (int wheel = 1; wheel <= 4; ++wheel) {
    const Rows once = rows(directory / "run/steady-state-map" / ("wheel-" + std::to_string(wheel) + ".csv"));
    const Rows parts = rows(map(wheel));
    ASSERT_EQ(parts.size(), velocities.size());
    for (std::size_t i = 0; i < parts.size(); ++i) {
      // The drives regulate to a revolution a minute of the motor.
      EXPECT_NEAR(parts[i][1], once[i][1], 4e-3) << "wheel " << wheel << " at " << velocities[i];
      EXPECT_NEAR(parts[i][2], once[i][2], std::hypot(parts[i][3], once[i][3]))
          << "wheel " << wheel << " at " << velocities[i];
    }
  }

  config.settle_s = 0.1;
  EXPECT_THROW(identification::experiments::SteadyState(config, velocities, 1e-3), std::invalid_argument)
      << "the low-pass on the torque remembers for longer";
  options = {.directory = directory / "slow-filter", .virtual_time = true, .quiet = true};
  options.filter_cutoff_rad_per_s = 5;
  EXPECT_THROW((void)run_unchecked(map_at(velocities)), std::invalid_argument) << "the velocity's likewise";
  EXPECT_FALSE(fs::exists(options.directory));
}

TEST_F(BenchExperiment, RampsAfterAnInterruptionFindTheSameStiffnessAndBreakAway) {
  options.joints = {"wheel-1", "wheel-3"};
  run_whole_and_in_parts(ramps({.rest_s = 1, .rate_Nm_per_s = 0.02, .repeats = 2}), 7000);
  for (const char* file : {"torque-ramp-result/wheel-1.csv", "torque-ramp-result/wheel-3.csv"}) {
    const Rows once = rows(directory / "run" / file);
    const Rows parts = rows(directory / "in-parts" / file);
    ASSERT_EQ(once.size(), 4U);
    ASSERT_EQ(parts.size(), 4U);
    for (std::size_t i = 0; i < parts.size(); ++i) {
      EXPECT_EQ(parts[i][1], once[i][1]);
      EXPECT_NEAR(parts[i][7], once[i][7], 0.03 * once[i][7]);
      EXPECT_NEAR(parts[i][10], once[i][10], 2e-3);  // it keeps rising until the wheel is detected to slide
    }
  }
}

TEST_F(BenchExperiment, AResultThatThereIsNoneOfIsSaidInWordsAndReadAgain) {
  // Half an encoder step takes some 7 mN·m.
  const ExperimentPlan plan =
      ramps({.rest_s = 0.1, .rate_Nm_per_s = 0.01, .highest_torque_Nm = 0.002, .repeats = 1});
  options.joints = {"wheel-3"};
  EXPECT_EQ(run(plan, stop_after(350)).finished, 1);
  stop = false;
  options.resume = true;
  const std::vector<std::string> reasons{"wheel-3, measurement 1: never moved up to 0.002 N·m",
                                         "wheel-3, measurement 2: never moved up to 0.002 N·m"};
  EXPECT_EQ(run(plan).not_measured, reasons);
  EXPECT_EQ(run_unchecked(plan).not_measured, reasons) << "with nothing left to do";

  const fs::path result = options.directory / "torque-ramp-result/wheel-3.csv";
  const runtime::ReadRecording read = runtime::read_recording(result, runtime::NotMeasured::kTaken);
  ASSERT_EQ(read.recording.rows(), 2U);
  EXPECT_EQ(read.recording.column("direction")[1], -1.0);
  EXPECT_TRUE(std::isnan(read.recording.column("breakaway_command_Nm")[1]));
  ASSERT_GE(read.warnings.size(), 2U);
  EXPECT_NE(
      read.warnings.back().find("first_step_rad and 9 more were not measured: wheel-3 never moved up to "
                                "0.002 N·m"),
      std::string::npos)
      << read.warnings.back();
  try {
    (void)runtime::read_recording(result);
    FAIL() << "taken as a recording of motion";
  } catch (const runtime::RecordingError& error) {
    EXPECT_NE(std::string(error.what()).find("wheel-3 never moved up to 0.002 N·m"), std::string::npos)
        << error.what();
  }
}

TEST_F(BenchExperiment, ASetUpThatFailsLeavesNothingBehind) {
  loopback.name = "ethercat:nosuch0";
  options.virtual_time = false;
  options.directory = directory / "some/where";
  EXPECT_THROW((void)run_unchecked(map_at({1.0})), std::exception);
  EXPECT_FALSE(fs::exists(directory / "some"));
  // An existing directory stays with its contents.
  fs::create_directories(options.directory / "steady-state");
  directory.write("some/where/notes.txt", "mine");
  EXPECT_THROW((void)run_unchecked(map_at({1.0})), std::exception);
  EXPECT_EQ(text_of(options.directory / "notes.txt"), "mine");
  EXPECT_TRUE(fs::is_empty(options.directory / "steady-state"));
  EXPECT_FALSE(fs::exists(options.directory / "steady-state-map"));
  // Nor does a failure take from a recording that is to go on.
  options.directory = directory / "run";
  options.virtual_time = true;
  loopback.name = "loopback";
  EXPECT_EQ(run(map_at({1.0, 2.0}), stop_after(4000)).finished, 1);
  const std::string before = support::without_start(text_of(map(2)));
  stop = false;
  options.resume = true;
  options.virtual_time = false;
  loopback.name = "ethercat:nosuch0";
  EXPECT_THROW((void)run_unchecked(map_at({1.0, 2.0})), std::exception);
  EXPECT_EQ(support::without_start(text_of(map(2))), before);
  for (const auto& entry : fs::recursive_directory_iterator(directory.path()))
    EXPECT_NE(entry.path().extension(), ".resumed") << entry.path();
}

TEST_F(BenchExperiment, MeasuresTheJointOfABenchRigOverCan) {
  hal::test::CanBench bench({.joint_name = "wheel-3"});
  const auto cable = [&bench](std::uint64_t, const hal::RobotCommand&, hal::CycleStatus status) {
    bench.cable.wait(bench.period);
    return status;
  };
  const ExperimentOutcome outcome = run_on(*bench.robot, bench.clock, map_at({3.0, -2.0}), cable);
  EXPECT_TRUE(outcome.fault.empty()) << outcome.fault;
  EXPECT_EQ(outcome.finished, 2);
  EXPECT_FALSE(fs::exists(map(1)));
  const Rows measured = rows(map(3));
  ASSERT_EQ(measured.size(), 2U);
  const sim::bus::ArmJointData& joint = sim::can::kBenchWheel;
  for (const auto& row : measured) {
    const double friction_Nm = std::copysign(joint.coulomb_Nm, row[1]) + joint.viscous_Nm_s_per_rad * row[1];
    EXPECT_NEAR(row[1], row[4], 0.02);  // the module takes whole revolutions a minute
    EXPECT_NEAR(row[2], friction_Nm, row[3] + 4.4e-3) << row[1];  // 5 mA are a count of the module's current
  }
}

TEST_F(BenchExperiment, AFaultStopsTheMotorsAndKeepsWhatWasMeasured) {
  bool enabled_after = false;
  const ExperimentOutcome outcome =
      run(map_at({1.0, 2.0}),
          [&](std::uint64_t cycle, const hal::RobotCommand& command, hal::CycleStatus status) {
            if (cycle < 4000) return status;
            enabled_after = enabled_after || (cycle > 4000 && command.enable);
            return hal::CycleStatus{hal::Fault::kJointFault, 1,
                                    static_cast<std::uint32_t>(hal::JointFault::kOvertemperature)};
          });
  EXPECT_NE(outcome.fault.find("measurement 2"), std::string::npos) << outcome.fault;
  EXPECT_NE(outcome.fault.find("wheel-2"), std::string::npos) << outcome.fault;
  EXPECT_EQ(outcome.robot_report, std::vector<std::string>{"a finding"});
  EXPECT_FALSE(enabled_after);
  EXPECT_FALSE(last_command.enable);
  EXPECT_EQ(outcome.finished, 1);
  EXPECT_EQ(rows(map(1)).size(), 1U);
}

TEST_F(BenchExperiment, ReportsAStretchInWhichLateAnswersSilencedACheck) {
  using control::PlausibilityCheck;
  hal::VirtualClock clock;
  const runtime::OpenedRobot opened = runtime::open_robot(loopback, clock, options.period);
  support::HeldUpRobot bus(*opened.robot, clock);
  int cycle = 0;
  bus.hold_up([&] {
    const bool late = cycle > 2000 && cycle < 4000;
    ++cycle;
    return support::HeldUpRobot::Delay{.answer = late ? 2500us : 0us};
  });
  const ExperimentOutcome outcome = run_on(bus, clock, map_at({1.0, 2.0}));
  EXPECT_TRUE(outcome.fault.empty()) << outcome.fault;
  EXPECT_TRUE(outcome.once_silent_checks.has(PlausibilityCheck::kVelocityStep));
  options.directory = directory / "in time";
  EXPECT_TRUE(run(map_at({1.0})).once_silent_checks.none());
}

TEST_F(BenchExperiment, TooMuchSpeedOrTravelSwitchesOff) {
  options.max_speed_rad_per_s = 1.5;
  EXPECT_NE(run(map_at({1.0, 2.0})).fault.find("more than --max-speed"), std::string::npos);
  EXPECT_FALSE(last_command.enable);
  options.directory = directory / "far";
  options.max_travel_rad = 2.0;
  EXPECT_NE(run(map_at({1.0})).fault.find("more than --max-travel"), std::string::npos);
  EXPECT_FALSE(last_command.enable);
}

TEST_F(BenchExperiment, AFullDiskStopsTheExperimentAndItGoesOnWhenThereIsRoom) {
  const ExperimentPlan plan = map_at({0.5, 1.0, 2.0, 3.0});
  options.record_rate_Hz = 100;
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit full{40'000, before.rlim_max};  // some 800 of 1200 rows
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &full), 0);
  const ExperimentOutcome outcome = run(plan);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  EXPECT_FALSE(outcome.recording_problems.empty());
  EXPECT_TRUE(outcome.fault.empty()) << outcome.fault;
  EXPECT_FALSE(last_command.enable);
  EXPECT_GE(outcome.finished, 1);
  EXPECT_LT(outcome.finished, 4);
  EXPECT_EQ(rows(map(2)).size(), static_cast<std::size_t>(outcome.finished));

  options.resume = true;
  EXPECT_EQ(run(plan).finished, 4);
  EXPECT_EQ(rows(map(2)).size(), 4U);
  EXPECT_NEAR(static_cast<double>(rows(raw(2)).size()), 1200, 2);
}

TEST_F(BenchExperiment, NothingRecordedIsEverReplaced) {
  (void)run(map_at({1.0}));
  const std::string before = text_of(map(1));
  EXPECT_THROW((void)run_unchecked(map_at({2.0})), std::invalid_argument);
  EXPECT_EQ(text_of(map(1)), before);
  options.directory = directory / "nothing-there";
  options.resume = true;
  EXPECT_THROW((void)run_unchecked(map_at({2.0})), std::invalid_argument);
  EXPECT_FALSE(fs::exists(options.directory));
}

TEST_F(BenchExperiment, ResumingNamesTheLineOfADamagedRow) {
  (void)run(map_at({0.5, 1.0, 2.0}));
  const std::string whole = text_of(map(2));
  std::string damaged = whole;
  const std::size_t last = damaged.rfind('\n', damaged.size() - 2);
  damaged[damaged.rfind('\n', last - 1) + 1] = '?';  // of the row before the last
  std::ofstream(map(2)) << damaged;
  const auto line = std::count(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(last), '\n') + 1;
  options.resume = true;
  try {
    (void)run_unchecked(map_at({0.5, 1.0, 2.0, 3.0}));
    FAIL() << "the result of the third measurement was taken for the second's";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("wheel-2.csv:" + std::to_string(line) + ": no row"),
              std::string::npos)
        << error.what();
  }
  EXPECT_EQ(text_of(map(2)), damaged);
}

TEST_F(BenchExperiment, ResumingReadsFilesOfUpTo2Gibibytes) {
  const ExperimentPlan plan = map_at({0.5});
  (void)run(plan);
  options.resume = true;
  fs::resize_file(raw(1), (std::uintmax_t{2} << 30) + 1);  // takes no room on the disk
  try {
    (void)run_unchecked(plan);
    FAIL() << "read";
  } catch (const std::invalid_argument& error) {
    EXPECT_EQ(std::string(error.what()),
              "--resume: " + raw(1).string() + " has 2147483649 bytes, but at most 2147483648 are read");
  }
}

TEST_F(BenchExperiment, ResumingRefusesAPipeAndDoesNotWaitForIt) {
  const ExperimentPlan plan = map_at({0.5});
  (void)run(plan);
  options.resume = true;
  fs::remove(raw(1));
  ASSERT_EQ(mkfifo(raw(1).c_str(), 0600), 0);
  try {
    (void)run_unchecked(plan);
    FAIL() << "read";
  } catch (const hal::SetupError& error) {
    EXPECT_NE(std::string(error.what()).find(raw(1).string() + ": is a device or pipe"), std::string::npos)
        << error.what();
  }
}

TEST_F(BenchExperiment, WhatAPowerCutTookFromTheMapIsMeasuredAgain) {
  const ExperimentPlan plan = map_at({0.5, 1.0, 2.0});
  (void)run(plan);
  const std::string text = text_of(map(2));  // as if the last row of one wheel had not reached the disk
  fs::resize_file(map(2), text.rfind('\n', text.size() - 2) + 5);
  options.resume = true;
  EXPECT_EQ(run(plan).finished, 3);
  for (int wheel = 1; wheel <= 4; ++wheel) {
    const Rows measured = rows(map(wheel));
    ASSERT_EQ(measured.size(), 3U);
    EXPECT_EQ(measured[2][4], 2.0);
    EXPECT_NEAR(measured[2][0], 9.0, 0.01);
    EXPECT_NEAR(static_cast<double>(rows(raw(wheel)).size()), 90, 1);
  }
}

TEST_F(BenchExperiment, RunsOnOneChosenJointAndRefusesOneThatIsNotThere) {
  options.joints = {"wheel-2"};
  (void)run(map_at({1.0}));
  EXPECT_FALSE(fs::exists(map(1)));
  EXPECT_EQ(rows(map(2)).size(), 1U);
  options.directory = directory / "other";
  options.joints = {"wheel-5"};
  EXPECT_THROW((void)run_unchecked(map_at({1.0})), std::invalid_argument);
}

TEST_F(BenchExperiment, RowsOfATorqueExperimentShowTheCommandThatActsFromThenOn) {
  options.record_rate_Hz = 1000;
  std::vector<double> sent;
  (void)run(
      {.name = "staircase",
       .result = "",
       .make =
           [](const hal::JointInfo&, double) {
             return std::make_unique<identification::experiments::Staircase>(
                 identification::experiments::StaircaseConfig{.step = 0.02, .highest = 0.04, .hold_s = 0.05});
           },
       .configuration = ""},
      [&](std::uint64_t, const hal::RobotCommand& command, hal::CycleStatus status) {
        if (command.enable && command.joints[0].mode == hal::CommandMode::kTorque)
          sent.push_back(command.joints[0].target);
        return status;
      });
  const Rows recorded = rows(options.directory / "staircase/wheel-1.csv");
  ASSERT_GT(recorded.size(), 400U);
  // The first exchange with the drives enabled comes before the first row.
  for (std::size_t i = 0; i < recorded.size(); ++i) EXPECT_NEAR(recorded[i][1], sent[i + 1], 1e-6) << i;
}

TEST_F(BenchExperiment, TheCycleDoesNotAllocateOrLock) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the allocation guard is off under a sanitizer";
  hal::VirtualClock clock;
  const runtime::OpenedRobot opened = runtime::open_robot(loopback, clock, options.period);
  std::vector<ExperimentTask::Joint> joints;
  joints.push_back({2, map_at({0.5, 1.0}).make(opened.robot->joints()[2], 1e-3)});
  ExperimentRecording recording({.directory = options.directory,
                                 .experiment = "steady-state",
                                 .result = "steady-state-map",
                                 .joints = {"wheel-3"},
                                 .commands = {.velocity = true},
                                 .result_columns = {"a", "b", "c", "d"}},
                                false);
  ExperimentCycle cycle({}, *opened.robot, std::move(joints), recording);
  opened.robot->activate();
  {
    const support::NoAllocGuard guard;
    while (!cycle.finished()) {
      clock.sleep_until(clock.now() + 1ms);
      cycle.step(clock.now());
    }
    EXPECT_EQ(guard.violations(), 0);
  }
  EXPECT_FALSE(cycle.stop_reason());
  recording.close();
}

using support::CommandResult;

CommandResult bench(const std::string& arguments) {
  return support::run_command(support::program("youbot-bench") + " " + arguments);
}

class BenchCommand : public BenchExperiment {
 protected:
  std::string out(const char* name) const { return " --out " + (directory / name).string() + " "; }
};

TEST_F(BenchCommand, EveryExperimentRunsAndIsMadeAgainByTheConfigurationItLeaves) {
  const std::vector<std::pair<std::string, std::string>> short_runs{
      {"steady-state", "--sets 9 --settle 0.2 --measure 0.3 --extra 0.1 --noise-seed 7"},
      {"torque-ramp", "--repeats 1 --rate 0.05 --rest 1"},
      {"dahl", "--cycles 2 --frequency 2"},
      {"presliding", "--periods 1 --period 2 --lowest 0.5"},
      {"stick-slip", "--duration 3 --speed 0.5"},
      {"compensation", "--duration 4"},
      {"staircase", "--hold 0.1"},
      {"multisine", "--periods 1 --period 2 --lowest 0.5"}};
  for (const auto& [name, arguments] : short_runs) {
    const CommandResult first =
        bench(name + out("a") + "--quiet --joint wheel-1 --joint wheel-4 " + arguments);
    EXPECT_EQ(first.exit_code, 0) << name << ": " << first.output;
    EXPECT_EQ(first.output, "") << name;
    const std::string config = (directory / "a" / name / "experiment.toml").string();
    const CommandResult again = bench(name + out("b") + "--quiet --config " + config);
    EXPECT_EQ(again.exit_code, 0) << name << ": " << again.output;
    for (const char* joint : {"wheel-1.csv", "wheel-4.csv", "experiment.toml"}) {
      const std::string text = support::without_start(text_of(directory / "a" / name / joint));
      EXPECT_GT(text.size(), 200U);
      EXPECT_EQ(text, support::without_start(text_of(directory / "b" / name / joint)))
          << name << "/" << joint;
    }
  }
}

TEST_F(BenchCommand, CompensationReportsWhetherItsTorqueStaysBelowTheMeasuredFriction) {
  const auto passive_gain = [&](const char* name, const std::string& compensator) {
    const CommandResult result =
        bench("compensation --quiet --duration 4 --joint wheel-1 " + compensator + out(name));
    EXPECT_EQ(result.exit_code, 0) << result.output;
    return rows(directory / name / "compensation-result/wheel-1.csv").at(0).back();
  };
  // Its own curve, of which 95 % are helped; 3 % for how the two tables sample it.
  EXPECT_NEAR(passive_gain("measured", ""), 1 / 0.95, 0.03);
  // The curve's minimum is about 0.048 N·m, at 0.45 rad/s and in its dip.
  const std::string model =
      directory.write("strong.toml",
                      "format = \"youbot-drive-model/1\"\ninertia_kg_m2 = 0.011\n[[effect]]\n"
                      "type = \"coulomb\"\ntorque_Nm = 0.096\n");
  const double strong = passive_gain("strong", "--compensator " + model);
  EXPECT_LT(strong, 0.6);
  EXPECT_NE(text_of(directory / "strong/report.html").find("is not passive"), std::string::npos);
  EXPECT_NE(text_of(directory / "strong/compensation/experiment.toml").find(model), std::string::npos);
  EXPECT_GT(passive_gain("weak", "--compensator coulomb --margin 0.1"), 1);
  EXPECT_NE(text_of(directory / "weak/report.html").find("is passive: it supplies no energy"),
            std::string::npos);
  const CommandResult none = bench("compensation --compensator nosuch" + out("none"));
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_NE(none.output.find("nosuch is neither a file nor a law"), std::string::npos) << none.output;
  // From 2 rad/s on, less than nothing is left of this friction.
  const std::string driving =
      directory.write("driving.toml",
                      "format = \"youbot-drive-model/1\"\ninertia_kg_m2 = 0.011\n[[effect]]\ntype = "
                      "\"coulomb\"\ntorque_Nm = 0.04\n"
                      "[[effect]]\ntype = \"quadratic_drag\"\ncoefficient_Nm_s2_per_rad2 = -0.01\n");
  const CommandResult drives = bench("compensation --compensator " + driving + out("none"));
  EXPECT_EQ(drives.exit_code, 2);
  EXPECT_NE(drives.output.find("drives the joint from 2 rad/s on"), std::string::npos) << drives.output;
  EXPECT_FALSE(fs::exists(directory / "none"));
}

TEST_F(BenchCommand, AFaultExitsWithFourAndSaysWhyEvenWhenQuiet) {
  const CommandResult result =
      bench("steady-state --quiet --sets 6 --settle 1 --measure 1 --max-speed 3.7" + out("run"));
  EXPECT_EQ(result.exit_code, 4) << result.output;
  EXPECT_NE(result.output.find("more than --max-speed"), std::string::npos) << result.output;
  EXPECT_NE(result.output.find("--resume"), std::string::npos) << result.output;
}

TEST_F(BenchCommand, WrongUseExitsWithTwoAndMovesNothing) {
  EXPECT_EQ(bench("steady-state").exit_code, 2);
  EXPECT_EQ(bench("steady-state --sets 10" + out("x")).exit_code, 2);
  EXPECT_EQ(bench("steady-state --settle -1" + out("x")).exit_code, 2);
  EXPECT_EQ(bench("steady-state --settle soon" + out("x")).exit_code, 2);
  EXPECT_EQ(bench("steady-state --robot toaster" + out("x")).exit_code, 2);
  EXPECT_EQ(bench("steady-state --resume " + (directory / "x").string()).exit_code, 2);
  const CommandResult unasked = bench("torque-ramp --robot ethercat:nosuch0" + out("x"));
  EXPECT_EQ(unasked.exit_code, 2);
  EXPECT_NE(unasked.output.find("--yes"), std::string::npos) << unasked.output;
  EXPECT_EQ(bench("torque-ramp --yes --robot ethercat:nosuch0" + out("x")).exit_code, 3);
  const CommandResult no_can = bench("torque-ramp --yes --robot can:nosuch0" + out("x"));
  EXPECT_EQ(no_can.exit_code, 3);
  EXPECT_NE(no_can.output.find("nosuch0"), std::string::npos) << no_can.output;
  EXPECT_FALSE(fs::exists(directory / "x"));
}

TEST_F(BenchCommand, OneFileServesTheDaemonAndTheBench) {
  // Every key of youbotd is in it.
  std::string text = text_of(support::source_dir() + "/apps/youbotd/demo.toml");
  text.replace(text.find("robot = \"loopback\""), 18, "robot = \"wire\"");
  text.replace(text.find("unsigned_current = false"), 24, "unsigned_current = true");
  text.replace(text.find("off = []"), 8, "off = [\"velocity_step\"]");
  text += "\n[[ethercat.parameter]]\njoint = \"wheel-1\"\nname = \"motor_acceleration\"\nvalue = 2000\n";
  const std::string config = directory.write("lab.toml", text);
  const std::string experiment = "staircase --quiet --hold 0.02 --kind base+arm --config ";
  const CommandResult first = bench(experiment + config + out("a"));
  EXPECT_EQ(first.exit_code, 0) << first.output;
  const std::string effective = text_of(directory / "a/staircase/experiment.toml");
  for (const char* line :
       {"\nrobot = \"wire\"", "\n[ethercat]\nkind = \"base+arm\"\n", "\nunsigned_current = true\n",
        "\n[plausibility]\noff = [\"velocity_step\"]\n", "\nname = \"motor_acceleration\"\nvalue = 2000\n"})
    EXPECT_NE(effective.find(line), std::string::npos) << line << "\nin\n" << effective;

  // The written configuration reproduces the experiment and contains nothing that resuming does not read.
  const CommandResult again =
      bench("staircase --quiet --config " + (directory / "a/staircase/experiment.toml").string() + out("b"));
  EXPECT_EQ(again.exit_code, 0) << again.output;
  EXPECT_EQ(text_of(directory / "b/staircase/experiment.toml"), effective);
  EXPECT_EQ(support::without_start(text_of(directory / "b/staircase/wheel-1.csv")),
            support::without_start(text_of(directory / "a/staircase/wheel-1.csv")));
  EXPECT_EQ(bench("staircase --quiet --resume " + (directory / "a").string()).exit_code, 0);
  // From both files `parameters` reads the CAN settings; only the bus itself is missing here.
  for (const fs::path& file : {directory / "a/staircase/experiment.toml", fs::path(config)}) {
    const CommandResult parameters = bench("parameters --robot can:nosuch0 --config " + file.string());
    EXPECT_EQ(parameters.exit_code, 3) << parameters.output;
    EXPECT_NE(parameters.output.find("nosuch0"), std::string::npos) << parameters.output;
  }

  directory.write("lab.toml",
                  "[ethercat]\ntolerated_cycles = 101\nbusy = true\n[[ethercat.parameter]]\n"
                  "joint = \"wheel-1\"\nname = \"no_such\"\nvalue = 1\n[loops]\n");
  const CommandResult refused = bench(experiment + config + out("c"));
  EXPECT_EQ(refused.exit_code, 2);
  for (const char* problem :
       {"lab.toml:2: ", "unknown key 'ethercat.busy'", "no_such", "unknown key 'loops'"})
    EXPECT_NE(refused.output.find(problem), std::string::npos) << problem << "\nin\n" << refused.output;
  EXPECT_NE(bench("parameters --robot can:nosuch0 --config " + config).output.find("unknown key 'loops'"),
            std::string::npos);
  EXPECT_EQ(bench("staircase --kind table" + out("c")).exit_code, 2);
  EXPECT_FALSE(fs::exists(directory / "c"));
}

TEST_F(BenchCommand, ARampOnTheWireFindsWhatItFindsWithoutOne) {
  const std::string ramp = "torque-ramp --quiet --joint wheel-2 --repeats 1 --rate 0.02 --rest 1 --robot ";
  std::array<Rows, 2> results;
  for (const std::string robot : {"loopback", "wire"}) {
    const CommandResult result = bench(ramp + robot + out(robot.c_str()));
    EXPECT_EQ(result.exit_code, 0) << result.output;
    Rows& into = results[robot == "wire" ? 1 : 0];
    into = rows(directory / robot / "torque-ramp-result/wheel-2.csv");
    ASSERT_EQ(into.size(), 2U);
  }
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_NEAR(results[1][i][7], results[0][i][7], 0.05 * results[0][i][7]);
    EXPECT_NEAR(results[1][i][10], results[0][i][10], 3e-3);
  }
}

TEST_F(BenchCommand, TheWireRobotGivesTheSameMap) {
  const CommandResult result =
      bench("steady-state --robot wire --quiet --sets 9 --settle 0.5 --measure 0.5 --extra 0" + out("run"));
  EXPECT_EQ(result.exit_code, 0) << result.output;
  options.directory = directory / "run";
  const Rows measured = rows(map(1));
  ASSERT_EQ(measured.size(), 13U);
  for (const auto& row : measured)  // half a second: the velocity loop has not quite settled
    EXPECT_NEAR(row[2], model::friction::wheel_curve_Nm(1, row[1]), 0.02) << row[4];
}

}  // namespace youbot_bench_experiments_test
}  // namespace youbot_bench
