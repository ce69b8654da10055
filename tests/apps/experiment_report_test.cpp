// The report of an experiment: its data from the recording, and that a failure of the report has no other
// effect. tests/browser checks what a reader sees.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>

#include "apps/youbot_bench/experiment_data.h"
#include "apps/youbot_bench/experiment_report.h"
#include "apps/youbot_bench/experiment_runner.h"
#include "identification/experiments/torque_ramp.h"
#include "identification/fit/statistics.h"
#include "runtime/configuration/quantity.h"
#include "runtime/program/wording.h"
#include "tests/support/temporary_directory.h"

namespace youbot_bench {
namespace experiment_report_test {

namespace fs = std::filesystem;

std::string text_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

class ExperimentReport : public ::testing::Test {
 protected:
  ExperimentReport() {
    options = {.joints = {"wheel-1", "wheel-2"},
               .directory = directory.path(),
               .virtual_time = true,
               .quiet = true,
               .record_rate_Hz = 100};
    loopback.simulation.on_ground = false;
  }

  std::string page() const { return text_of(directory / "report.html"); }
  bool says(const std::string& part) const { return page().find(part) != std::string::npos; }

  /// Ramps of some 6 s; `stop` asks for the end in the `stop_in`-th of them, counted from 1, 0: never.
  ExperimentOutcome ramps(int repeats, int stop_in = 0) {
    class StopsIn final : public hal::Clock {
     public:
      StopsIn(std::atomic<bool>& stop, std::chrono::nanoseconds when) : stop_(stop), when_(when) {}
      std::chrono::nanoseconds now() const noexcept override { return clock_.now(); }
      void sleep_until(std::chrono::nanoseconds time) noexcept override {
        clock_.sleep_until(time);
        if (clock_.now() > when_) stop_ = true;
      }

     private:
      hal::VirtualClock clock_;
      std::atomic<bool>& stop_;
      std::chrono::nanoseconds when_;
    };
    stop = false;
    StopsIn clock(stop, stop_in > 0 ? std::chrono::seconds(6 * stop_in - 1) : std::chrono::hours(1));
    const runtime::OpenedRobot opened = runtime::open_robot(loopback, clock, options.period);
    return run_experiment({.name = "torque-ramp",
                           .result = "torque-ramp-result",
                           .make =
                               [repeats](const hal::JointInfo&, double period_s) {
                                 return std::make_unique<identification::experiments::TorqueRamp>(
                                     identification::experiments::TorqueRampConfig{
                                         .rest_s = 1, .rate_Nm_per_s = 0.0155, .repeats = repeats},
                                     6.08e-5, period_s);
                               },
                           .configuration = "experiment = \"torque-ramp\"\nrest_s = 1  # <without> torque\n"},
                          options, *opened.robot, clock, stop);
  }

  support::TemporaryDirectory directory;
  ExperimentOptions options;
  runtime::RobotOptions loopback;
  std::atomic<bool> stop{false};
};

TEST_F(ExperimentReport, IsWrittenAfterARunAndAgainAfterAnInterruptedOneWasResumed) {
  EXPECT_LT(ramps(2, 2).finished, 4);
  EXPECT_TRUE(says("<h1>Torque ramp: wheel-1 and wheel-2 break away at "));
  EXPECT_TRUE(says("Not finished: 1 of 4 measurements"));
  EXPECT_TRUE(says("torque-ramp --resume " + directory.path().string()));
  EXPECT_FALSE(says("backward"));

  options.resume = true;
  const ExperimentOutcome whole = ramps(2);
  EXPECT_EQ(whole.finished, 4);
  EXPECT_TRUE(whole.recording_problems.empty());
  EXPECT_FALSE(says("Not finished"));
  EXPECT_TRUE(says("backward"));
  EXPECT_TRUE(says("<td>&lt;without&gt; torque</td>"));

  fs::remove(directory / "report.html");
  EXPECT_EQ(ramps(2).finished, 4);  // nothing to measure, but a page to write
  EXPECT_TRUE(says("backward"));
}

TEST_F(ExperimentReport, ThatCannotBeWrittenIsAProblemAndLosesNothing) {
  fs::create_directories(directory / "report.html");
  const ExperimentOutcome outcome = ramps(1);
  EXPECT_EQ(outcome.finished, 2);
  ASSERT_EQ(outcome.recording_problems.size(), 1U);
  EXPECT_NE(outcome.recording_problems[0].find("report.html"), std::string::npos);
  EXPECT_NE(outcome.recording_problems[0].find("not a regular file"), std::string::npos);
  const MeasuredExperiment measured =
      read_experiment(directory.path(), "torque-ramp", "torque-ramp-result", true);
  EXPECT_TRUE(measured.problems.empty());
  EXPECT_EQ(measured.joints.at(1).results.rows(), 2U);
}

TEST_F(ExperimentReport, ReportsAFaultAndWhatWasRecordedBeforeIt) {
  options.max_travel_rad = 1e-4;
  const ExperimentOutcome outcome = ramps(1);
  EXPECT_NE(outcome.fault, "");
  EXPECT_EQ(outcome.finished, 0);
  EXPECT_TRUE(says("<h1>Torque ramp: no ramp was finished</h1>"));
  EXPECT_TRUE(says("Stopped by a fault at measurement 1"));
  EXPECT_TRUE(says(R"("name":"wheel-2")"));
}

TEST_F(ExperimentReport, ShowsAllExperimentsOfADirectory) {
  (void)ramps(1);
  directory.write("steady-state/progress", "# youbot recording v1\ntime_s,measurement\n2.0,0\n4.0,1\n");
  directory.write("steady-state/wheel-3.csv", "");
  directory.write("steady-state-map/wheel-3.csv",
                  "# youbot recording v1\ntime_s,velocity_rad_per_s,torque_measured_Nm,torque_ci95_Nm\n"
                  "2.0,1.0,0.05,0.001\n4.0,-1.0,-0.06,0.001\n");
  write_experiment_report(directory.path(), {.experiment = "steady-state", .finished = 2, .planned = 2});
  EXPECT_TRUE(says("<h1>2 experiments on one robot</h1>"));
  EXPECT_TRUE(says(">Friction of wheel-3: 0.05 to 0.06 N·m at speeds of 1 rad/s</h2>"));
  EXPECT_TRUE(says(">Torque ramp: wheel-1 and wheel-2"));
}

TEST_F(ExperimentReport, SaysWhatOfARecordingCannotBeUsedAndShowsTheRest) {
  (void)ramps(1);
  directory.write("torque-ramp/wheel-1.csv", "# youbot recording v1\ntime_s,position_deg\n0,1\n");
  write_experiment_report(directory.path(), {.experiment = "torque-ramp", .finished = 2, .planned = 2});
  EXPECT_TRUE(says("wheel-1.csv:2: column &#39;position_deg&#39; must be position_rad"))
      << page().substr(0, 500);
  EXPECT_TRUE(says(R"("name":"wheel-2")"));
}

TEST_F(ExperimentReport, AResultThatCouldNotBeMeasuredIsADashWithItsReason) {
  directory.write("dahl/progress", "# youbot recording v1\ntime_s,measurement\n2.0,0\n");
  directory.write(
      "dahl/wheel-1.csv",
      "# youbot recording v1\ntime_s,torque_command_Nm,torque_measured_Nm,position_rad,velocity_rad_per_s\n"
      "1.0,0,0,0,0\n2.0,0,0,0,0\n");
  directory.write(
      "dahl-result/wheel-1.csv",
      "# youbot recording v1\n# not_measured: stiffness_command_Nm_per_rad,stiffness_measured_Nm_per_rad,"
      "stiffness_command_ci95_Nm_per_rad,stiffness_measured_ci95_Nm_per_rad: "
      "wheel-1 never moved up to 0.03 N·m\ntime_s,stiffness_command_Nm_per_rad,"
      "stiffness_measured_Nm_per_rad,lowest_displacement_rad,highest_displacement_rad,"
      "stiffness_command_ci95_Nm_per_rad,stiffness_measured_ci95_Nm_per_rad,encoder_steps\n"
      "2.0,nan,nan,0,0,nan,nan,0\n");
  write_experiment_report(directory.path(), {.experiment = "dahl", .finished = 1, .planned = 1});
  EXPECT_TRUE(says("A dash in the table: wheel-1 never moved up to 0.03 N·m."));
  EXPECT_TRUE(says(R"(<td class="number">–</td>)"));
}

TEST_F(ExperimentReport, TracesAreTheMeasurementsFromTheEndOfTheirRestOn) {
  MeasuredExperiment measured;
  measured.finished_until_s = {0.4, 0.8};
  measured.settings = {{"rest_s", "0.1", ""}};
  MeasuredJoint joint{.name = "wheel-1", .rows = {}, .results = {}};
  joint.rows.columns = {{"time_s", {}}, {"position_rad", {}}};
  for (int i = 1; i <= 10; ++i) {  // 0.1 s … 1.0 s, the last two of a measurement that was not finished
    joint.rows.columns[0].values.push_back(0.1 * i);
    joint.rows.columns[1].values.push_back(i);
  }
  const std::vector<Trace> all = traces(measured, joint, 1000);
  ASSERT_EQ(all.size(), 3U);
  EXPECT_EQ(all[0].displacement_rad(), (std::vector<double>{0, 1, 2}));
  EXPECT_EQ(all[1].displacement_rad(), (std::vector<double>{0, 1, 2}));
  EXPECT_NEAR(all[1].time_s()[2], 0.2, 1e-12);
  EXPECT_EQ(all[2].displacement_rad(), (std::vector<double>{0}));

  // Rests until there is a command, a row more in the first and for good in the last.
  joint.rows.columns.push_back({"torque_command_Nm", {0, 0, 1, 1, 0, 1, 1, 1, 0, 0}});
  const std::vector<Trace> longer = traces(measured, joint, 1000);
  ASSERT_EQ(longer.size(), 2U);
  EXPECT_EQ(longer[0].displacement_rad(), (std::vector<double>{0, 1}));
  EXPECT_EQ(longer[1].displacement_rad(), (std::vector<double>{0, 1, 2}));
  EXPECT_EQ(longer[1].measurement(), 1U);
  joint.rows.columns.pop_back();

  const std::vector<Trace> thinned = traces(measured, joint, 4);  // two for each finished measurement
  EXPECT_EQ(thinned[0].displacement_rad(), (std::vector<double>{0.5, 2}));
  EXPECT_NEAR(thinned[0].mean_over_s(), 0.2, 1e-12);
}

TEST(Wording, NamesAreListedAsPeopleDo) {
  const auto list = [](std::vector<std::string> names) { return runtime::list_text(names); };
  EXPECT_EQ(list({"wheel-2"}), "wheel-2");
  EXPECT_EQ(list({"wheel-1", "wheel-2"}), "wheel-1 and wheel-2");
  EXPECT_EQ(list({"wheel-1", "wheel-2", "wheel-3"}), "wheel-1 to wheel-3");
  EXPECT_EQ(list({"wheel-1", "wheel-2", "wheel-4"}), "wheel-1, wheel-2 and wheel-4");
  EXPECT_EQ(list({"left", "right", "rear"}), "left, right and rear");
}

TEST(Wording, RangesLeaveOutWhatIsNoNumber) {
  const double nan = std::nan("");
  EXPECT_EQ(runtime::range_text(std::array{nan, 0.0721, 0.10355}, "N·m"), "0.0721 to 0.104 N·m");
  EXPECT_EQ(runtime::range_text(std::array{280.0, 280.01}), "280");
  EXPECT_EQ(runtime::range_text(std::array{nan}, "N·m"), "–");
}

TEST(Wording, MeansHaveTheirInterval) {
  const identification::fit::MeanOf mean =
      identification::fit::mean_of(std::array{1.0, 2.0, std::nan(""), 3.0});
  EXPECT_DOUBLE_EQ(mean.mean, 2.0);
  EXPECT_NEAR(mean.ci95, 4.3027 / std::sqrt(3.0), 1e-3);  // t(0.975; 2) = 4.3027
  EXPECT_TRUE(std::isnan(identification::fit::mean_of(std::array{1.0}).ci95));
  EXPECT_TRUE(std::isnan(identification::fit::mean_of({}).mean));
}

TEST(Wording, UnitsAreTakenFromTheNames) {
  EXPECT_EQ(runtime::quantity_of("viscous_Nm_s_per_rad").name, "viscous");
  EXPECT_EQ(runtime::quantity_of("viscous_Nm_s_per_rad").unit, "N·m·s/rad");
  EXPECT_EQ(runtime::quantity_of("stribeck_exponent").name, "stribeck exponent");
  EXPECT_EQ(runtime::quantity_of("stribeck_exponent").unit, "");
  EXPECT_EQ(runtime::quantity_of("rest_s").unit, "s");
}

}  // namespace experiment_report_test
}  // namespace youbot_bench
