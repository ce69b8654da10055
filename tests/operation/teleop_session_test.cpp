// One run of teleoperation as in the daemon, in virtual time: its results, messages and files.
#include "operation/teleop_session.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "operation/report.h"
#include "operation/teleop_demo.h"
#include "operation/teleop_recording.h"
#include "runtime/recording/recording_reader.h"
#include "tests/support/built_paths.h"
#include "tests/support/temporary_directory.h"

namespace operation {
namespace teleop_session_test {

using namespace std::chrono_literals;
namespace fs = std::filesystem;
using control::TeleopPhase;

const fs::path kTeleop = support::source_dir() + "/apps/youbotd/teleop.toml";
constexpr std::size_t kColumns = 96;

bool says(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

std::string text_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// A recording read with an independent parser; fails the test on a row of another width.
struct Recorded {
  explicit Recorded(const fs::path& path) {
    std::ifstream file(path);
    for (std::string line; std::getline(file, line);) {
      if (line.starts_with("#")) {
        comments.push_back(line);
      } else if (columns.empty()) {
        std::istringstream cells(line);
        for (std::string cell; std::getline(cells, cell, ',');) columns.push_back(cell);
      } else {
        std::vector<double> row;
        std::istringstream cells(line);
        for (std::string cell; std::getline(cells, cell, ',');) row.push_back(std::stod(cell));
        EXPECT_EQ(row.size(), columns.size()) << path << ": " << line;
        rows.push_back(std::move(row));
      }
    }
  }
  double at(std::size_t row, const std::string& column) const {
    const auto found = std::find(columns.begin(), columns.end(), column);
    if (found == columns.end()) throw std::invalid_argument("no column " + column);
    return rows.at(row).at(static_cast<std::size_t>(found - columns.begin()));
  }

  std::vector<std::string> comments, columns;
  std::vector<std::vector<double>> rows;
};

class TeleopSession : public ::testing::Test {
 protected:
  TeleopSession() {
    options.config_file = kTeleop;
    options.virtual_time = true;
    options.record_format = runtime::RecordingFormat::kCsv;
    options.after_cycle = [this](const TeleopRecord& record) { seen.push_back(record); };
  }
  TeleopSummary run() { return run_teleop_session(config, options, stop); }
  /// Problems of the configuration.
  std::string refusal() {
    try {
      (void)run();
    } catch (const std::invalid_argument& error) {
      EXPECT_TRUE(seen.empty()) << "it ran";
      return error.what();
    }
    ADD_FAILURE() << "was accepted";
    return "";
  }
  /// Through the start-up and down again in a few seconds.
  void be_quick() {
    control::Teleoperation::Config& quick = config.teleoperation;
    quick.unfolding_speed_rad_per_s = 1.0;
    quick.approach_s = 4.0;
    quick.stiffening_per_s = {6000, 300};
    quick.feedback_fade_s = 0.2;
    quick.lowering_s = 1.0;
  }
  std::vector<std::pair<TeleopPhase, std::chrono::nanoseconds>> phases_seen() const {
    std::vector<std::pair<TeleopPhase, std::chrono::nanoseconds>> phases;
    for (const TeleopRecord& record : seen)
      if (phases.empty() || phases.back().first != record.phase)
        phases.emplace_back(record.phase, record.time);
    return phases;
  }
  /// The maximum of `value` over the cycles so far.
  template <typename Value>
  double largest(Value&& value) const {
    double most = 0;
    for (const TeleopRecord& record : seen) most = std::max(most, value(record));
    return most;
  }

  support::TemporaryDirectory directory;
  TeleopOptions options;
  std::atomic<bool> stop{false};
  Config config = load_config(kTeleop);
  std::vector<TeleopRecord> seen;
};

double norm(const std::array<double, 3>& v) { return std::hypot(v[0], v[1], v[2]); }

std::vector<TeleopPhase> names(const std::vector<std::pair<TeleopPhase, std::chrono::nanoseconds>>& phases) {
  std::vector<TeleopPhase> names;
  for (const auto& [phase, begin] : phases) names.push_back(phase);
  return names;
}

// --- The demo ---

TEST_F(TeleopSession, TheDemoDoesAllItsTasksAndTheSummaryIsThatOfItsCycles) {
  options.tasks = demo_tasks();
  const TeleopSummary summary = run();
  EXPECT_EQ(summary.stop_reason, "");
  EXPECT_FALSE(summary.cut_short);
  EXPECT_FALSE(summary.fault_report.has_value());
  EXPECT_FALSE(summary.recorded);
  EXPECT_EQ(summary.robot, "loopback");
  EXPECT_EQ(summary.master, "simulated handle");
  ASSERT_EQ(summary.tasks.size(), options.tasks.size());
  for (std::size_t i = 0; i < summary.tasks.size(); ++i) {
    EXPECT_EQ(summary.tasks[i].name, sim::name_of(options.tasks[i]));
    EXPECT_EQ(summary.tasks[i].outcome.result, sim::TaskResult::kDone) << i << ": " << summary.tasks[i].name;
  }

  // Each cycle was seen, one a millisecond.
  EXPECT_EQ(seen.size(), summary.loop.cycles);
  EXPECT_EQ(summary.loop.robot_time, static_cast<int>(seen.size()) * 1ms);
  for (std::size_t i = 0; i < seen.size(); ++i) ASSERT_EQ(seen[i].time, static_cast<int>(i) * 1ms);
  EXPECT_EQ(summary.phases, phases_seen());
  EXPECT_EQ(names(summary.phases),
            (std::vector{TeleopPhase::kCentring, TeleopPhase::kUnfolding, TeleopPhase::kApproaching,
                         TeleopPhase::kStiffening, TeleopPhase::kOperating, TeleopPhase::kStopping,
                         TeleopPhase::kLowering, TeleopPhase::kOff}));

  // The hand.
  EXPECT_EQ(summary.largest_grip_force_N, largest([](const auto& r) { return norm(r.held_force_H_N); }));
  EXPECT_GE(summary.largest_grip_force_N, 0.6) << "what he goes on the wall for";
  EXPECT_LE(summary.largest_grip_force_N, config.haptic.force_limit_N);
  EXPECT_EQ(summary.most_energy_given_J, largest([](const auto& r) { return r.port_energy_J; }));
  EXPECT_LE(summary.most_energy_given_J, config.teleoperation.tank.reserve_J);
  EXPECT_LT(seen.back().port_energy_J, 0) << "moving a robot takes energy";
  EXPECT_NE(std::count_if(seen.begin(), seen.end(),
                          [&](const auto& r) {
                            return r.buttons == 1 &&
                                   r.gripper_opening_m == config.teleoperation.gripper_closed_m;
                          }),
            0);

  // Limits that are for what goes wrong: some leaps of the arm's friction compensation on its way to the
  // start.
  const auto cut = [](const auto& r) { return (r.limited & limiter::kTorqueRate) != 0; };
  EXPECT_EQ(summary.cycles_torque_rate_limited,
            static_cast<std::uint64_t>(std::count_if(seen.begin(), seen.end(), cut)));
  EXPECT_LT(summary.cycles_torque_rate_limited, seen.size() / 1000);
  EXPECT_TRUE(std::none_of(seen.begin(), seen.end(),
                           [&](const auto& r) { return r.phase == TeleopPhase::kOperating && cut(r); }));

  // The robot: the arm alone reaches 0.35 m, the wall is at 1.08 m.
  EXPECT_EQ(summary.furthest_base_m,
            largest([](const auto& r) { return std::hypot(r.base_W[0], r.base_W[1]); }));
  EXPECT_GT(summary.furthest_base_m, 0.5);
  EXPECT_LT(summary.furthest_base_m, 1.08);
  EXPECT_EQ(summary.largest_tip_error_m, largest([](const auto& r) {
              const auto &setpoint = r.setpoint_p_WT_m, &tip = r.tip_p_WT_m;
              return r.phase != TeleopPhase::kOperating
                         ? 0.0
                         : norm({setpoint[0] - tip[0], setpoint[1] - tip[1], setpoint[2] - tip[2]});
            }));
  EXPECT_GT(summary.largest_tip_error_m, 0.005) << "6 N against 700 N/m";
  EXPECT_LT(summary.largest_tip_error_m, 0.05);
  EXPECT_GT(largest([](const auto& r) { return -r.contact_force_W_N[0]; }), 4.0) << "the wall pushes back";
  EXPECT_NEAR(largest([](const auto& r) { return r.true_tip_p_WT_m[0]; }), 1.07, 0.003)
      << "a ball of 10 mm on the wall";
  // None of it remains.
  EXPECT_EQ(seen.back().held_force_H_N, (std::array<double, 3>{}));
  EXPECT_LT(std::abs(seen.back().true_tip_p_WT_m[0] - seen[seen.size() - 10].true_tip_p_WT_m[0]), 1e-4);
}

TEST_F(TeleopSession, TheSameRunTwiceIsTheSame) {
  be_quick();
  options.duration = 3s;
  (void)run();
  const std::vector<TeleopRecord> first = std::exchange(seen, {});
  (void)run();
  ASSERT_EQ(seen.size(), first.size());
  for (std::size_t i = 0; i < seen.size(); ++i) {
    ASSERT_EQ(seen[i].position_rad, first[i].position_rad) << i;
    ASSERT_EQ(seen[i].command, first[i].command) << i;
    ASSERT_EQ(seen[i].held_force_H_N, first[i].held_force_H_N) << i;
  }
}

// --- Ending ---

TEST_F(TeleopSession, AStartThatIsRefusedAfterTheRecordingWasOpenedLeavesNothingBehind) {
  options.virtual_time = false;
  options.record_directory = directory / "new/run";
  config.real_time.cpu = 1023;  // no machine has it
  EXPECT_THROW((void)run(), hal::SetupError);
  EXPECT_FALSE(fs::exists(directory / "new"));
}

TEST_F(TeleopSession, TheDurationEndsItAtRestWhateverIsLeftToDo) {
  be_quick();
  config.teleoperation.approach_s = 1.5;
  options.tasks = {{sim::tasks::Wait{200ms}}, {sim::tasks::Wait{1h}, 2h}, {sim::tasks::LetGo{}}};
  options.duration = 12s;
  const TeleopSummary summary = run();
  EXPECT_EQ(summary.stop_reason, "");
  EXPECT_TRUE(summary.cut_short);
  ASSERT_EQ(summary.tasks.size(), 3U);
  EXPECT_EQ(summary.tasks[0].outcome.result, sim::TaskResult::kDone);
  EXPECT_EQ(summary.tasks[1].outcome.result, sim::TaskResult::kUnderWay);
  EXPECT_EQ(summary.tasks[2].outcome.result, sim::TaskResult::kNotBegun);
  ASSERT_GE(summary.phases.size(), 3U);
  const auto& stopping = summary.phases[summary.phases.size() - 3];
  EXPECT_EQ(stopping.first, TeleopPhase::kStopping);
  EXPECT_EQ(stopping.second, 12s - 1ms) << "time counts from the first cycle, one period after the start";
  EXPECT_EQ(seen.back().phase, TeleopPhase::kOff);
}

TEST_F(TeleopSession, StopsAtOnceWhenAskedBeforeItBegan) {
  be_quick();
  stop = true;
  options.tasks = demo_tasks();
  const TeleopSummary summary = run();
  EXPECT_EQ(summary.stop_reason, "");
  EXPECT_TRUE(summary.cut_short);
  for (const TaskReport& task : summary.tasks)
    EXPECT_EQ(task.outcome.result, sim::TaskResult::kNotBegun) << task.name;
  EXPECT_EQ(summary.largest_grip_force_N, 0.0);
  for (const TeleopRecord& record : seen)
    EXPECT_TRUE(record.phase != TeleopPhase::kUnfolding && record.phase != TeleopPhase::kApproaching);
  EXPECT_LT(summary.loop.robot_time, 5s) << "braked, lowered, off";
}

TEST_F(TeleopSession, AskedToStopInMidMotionItComesToRestBeforeTheDrivesGoOff) {
  be_quick();
  options.tasks = {{sim::tasks::DriveFar{{1.05, 0.0, 0.35}}, 60s}};
  std::size_t asked = 0;
  options.after_cycle = [&](const TeleopRecord& record) {
    seen.push_back(record);
    if (asked > 0 || record.base_W[0] < 0.1) return;
    asked = seen.size();
    stop = true;
  };
  const TeleopSummary summary = run();
  EXPECT_EQ(summary.stop_reason, "");
  EXPECT_TRUE(summary.cut_short);
  ASSERT_GT(asked, 100U) << "the base never drove";
  const auto speed_m_per_s = [&](std::size_t i) {
    return (seen[i].base_W[0] - seen[i - 100].base_W[0]) / 0.1;
  };
  EXPECT_GT(speed_m_per_s(asked), 0.02);
  EXPECT_EQ(seen[asked].phase, TeleopPhase::kStopping) << "from the next cycle on";
  EXPECT_EQ(norm(seen[asked].grip_force_H_N), 0.0);
  EXPECT_LT(std::abs(speed_m_per_s(seen.size() - 1)), 1e-3);
  EXPECT_LT(seen.back().base_W[0], 0.15);
}

// --- What cannot be run ---

TEST_F(TeleopSession, ARobotThatIsNotABaseWithOneArmIsRefusedWithWhatToDo) {
  using Kind = hal::YoubotKind;
  for (const auto& [name, kind, joints] : {std::tuple("loopback", Kind::kBase, 4),
                                           {"wire", Kind::kArm, 5},
                                           {"wire", Kind::kBaseAndTwoArms, 14}}) {
    config.robot.name = name;
    config.robot.ethercat.kind = kind;
    const std::string message = refusal();
    EXPECT_TRUE(says(message, "this robot has " + std::to_string(joints))) << message;
    EXPECT_TRUE(says(message, "set ethercat.kind = \"base+arm\"")) << message;
  }
}

TEST_F(TeleopSession, WhatLivesInRealTimeIsRefusedInVirtualTimeByItsName) {
  config.robot.name = "can:can9";
  EXPECT_EQ(refusal(), "--virtual-time: can:can9 lives in real time");
  config.robot.name = "loopback";
  for (const char* master : {"falcon", "force-dimension", "spacemouse"}) {
    config.haptic.name = master;
    EXPECT_EQ(refusal(), std::string("--virtual-time: ") + master + " lives in real time");
  }
}

TEST_F(TeleopSession, TheSimulatedOperatorTouchesNoRealMaster) {
  config.haptic.name = "falcon";
  options.virtual_time = false;
  options.tasks = demo_tasks();
  EXPECT_TRUE(says(refusal(), "--demo: the simulated operator needs the simulated handle"));
}

TEST_F(TeleopSession, AStartThatTheArmCannotReachIsRefusedWithTheStart) {
  config.teleoperation.start_p_WT_m = {0.95, 0.0, 0.35};
  const std::string message = refusal();
  EXPECT_TRUE(says(message, "the arm cannot reach the start at (0.95")) << message;
}

TEST_F(TeleopSession, AStiffSpringIsNotSofterThanTheSoftOne) {
  config.teleoperation.stiff.translation_N_per_m = 50;
  const std::string message = refusal();
  EXPECT_TRUE(says(message, "stiff translation stiffness = 50")) << message;
}

TEST_F(TeleopSession, AnObservedForceNeedsPassivity) {
  config.teleoperation.feedback.contact_share = 0.5;
  config.teleoperation.tank.active = false;
  const std::string message = refusal();
  EXPECT_TRUE(says(message, "contact_share needs the energy tank")) << message;
}

// --- Recording ---

TEST(TeleopRecording, EachColumnHoldsWhatItsNameSays) {
  TeleopRecord record;
  std::map<std::string, double> expected;
  double next = 1.25;
  const auto one = [&](double& field, const std::string& name) { field = expected[name] = next++; };
  const auto many = [&](auto& fields, const std::string& name, const std::vector<std::string>& ends) {
    ASSERT_EQ(fields.size(), ends.size());
    for (std::size_t i = 0; i < ends.size(); ++i) one(fields[i], name + ends[i]);
  };
  const std::vector<std::string> metres{"_x_m", "_y_m", "_z_m"}, newtons{"_x_N", "_y_N", "_z_N"},
      rotation{"_qw", "_qx", "_qy", "_qz"};
  record.time = 1500ms;
  expected["time_s"] = 1.5;
  record.phase = TeleopPhase::kLetGo;
  expected["phase"] = 6;
  many(record.setpoint_p_WT_m, "setpoint", metres);
  many(record.setpoint_q_WT, "setpoint", rotation);
  many(record.tip_p_WT_m, "tip", metres);
  many(record.tip_q_WT, "tip", rotation);
  many(record.true_tip_p_WT_m, "true_tip", metres);
  many(record.contact_force_W_N, "contact_force", newtons);
  many(record.contact_estimate_W_N, "contact_estimate", newtons);
  many(record.base_W, "base", {"_x_m", "_y_m", "_yaw_rad"});
  one(record.stiffness_N_per_m, "stiffness_N_per_m");
  one(record.force_scale, "force_scale");
  one(record.motion_scale, "motion_scale");
  many(record.spring_W_N, "spring", newtons);
  many(record.wrench_W, "wrench",
       {"_force_x_N", "_force_y_N", "_force_z_N", "_moment_x_Nm", "_moment_y_Nm", "_moment_z_Nm"});
  many(record.grip_p_HD_m, "grip", metres);
  many(record.grip_q_HD, "grip", rotation);
  many(record.grip_v_HD_m_per_s, "grip_velocity", {"_x_m_per_s", "_y_m_per_s", "_z_m_per_s"});
  many(record.grip_force_H_N, "grip_force_command", newtons);
  many(record.held_force_H_N, "grip_force_held", newtons);
  one(record.grip_age_s, "grip_age_s");
  record.buttons = 5;
  expected["buttons"] = 5;
  one(record.tank_J, "tank_J");
  one(record.withheld_N, "withheld_N");
  one(record.port_energy_J, "port_energy_J");
  one(record.gripper_opening_m, "gripper_opening_m");
  record.arm_mode = 1;
  expected["arm_mode"] = 1;
  const std::vector<std::string> joints{"wheel_1", "wheel_2", "wheel_3", "wheel_4", "arm_1",
                                        "arm_2",   "arm_3",   "arm_4",   "arm_5"};
  for (std::size_t i = 0; i < joints.size(); ++i) {
    one(record.command[i], joints[i] + (i < 4 ? "_torque_command_Nm" : "_command"));
    one(record.torque_measured_Nm[i], joints[i] + "_torque_measured_Nm");
    one(record.position_rad[i], joints[i] + "_position_rad");
  }
  record.wake_up = 12us;
  expected["wake_up_us"] = 12;
  record.step = 34us;
  expected["step_us"] = 34;
  for (const char* flag : {"rate_control", "clutched", "limited", "protecting"}) {
    record.rate_control = flag == std::string("rate_control");
    record.clutched = flag == std::string("clutched");
    record.limited = flag == std::string("limited");
    record.protecting = flag == std::string("protecting");
    for (const char* name : {"rate_control", "clutched", "limited", "protecting"})
      expected[name] = name == std::string(flag);

    const support::TemporaryDirectory directory;
    const fs::path path = directory / "one.csv";
    runtime::RecordingFile file(path, {}, runtime::columns_of(record));
    runtime::append_record(file, record);
    file.close();
    const Recorded recorded(path);
    EXPECT_EQ(expected.size(), kColumns);
    ASSERT_EQ(recorded.columns.size(), kColumns);
    for (const auto& [name, value] : expected) EXPECT_EQ(recorded.at(0, name), value) << name;
  }
}

TEST_F(TeleopSession, TheReportHasTheSummarysNumbersTasksAndLimits) {
  options.tasks = demo_tasks();
  options.record_directory = directory / "run";
  const TeleopSummary summary = run_teleop_session(config, options, stop);
  EXPECT_TRUE(summary.recording_problems.empty());
  const std::string page = text_of(*options.record_directory / "report.html");
  const auto says = [&page](const std::string& text) { return page.find(text) != std::string::npos; };
  EXPECT_TRUE(says(fmt::format("up to {:.2f} N on the hand", summary.largest_grip_force_N)));
  EXPECT_TRUE(says("<p>No fault.</p>"));
  for (const TaskReport& task : summary.tasks)
    EXPECT_TRUE(says(fmt::format("<td>{}</td><td>done</td><td class=\"number\">{:.1f}</td>", task.name,
                                 std::chrono::duration<double>(task.outcome.duration).count())))
        << task.name;
  EXPECT_TRUE(
      says(fmt::format("set-point at its limit of speed, acceleration or jerk</td><td "
                       "class=\"number\">{}</td>",
                       summary.cycles_setpoint_limited)));
  // The end stops of joint 1 are 338° apart (youBot data sheet, axis 1: ±169°).
  EXPECT_TRUE(says("<td class=\"number\">5.899</td>"));
  for (const char* title : {"From above", "From the right side", "Force on the hand", "Energy", "Phases",
                            "Arm, between the end stops", "Limits touched"})
    EXPECT_TRUE(says(title)) << title;
  EXPECT_TRUE(says("\"name\":\"drive far\",\"from\":")) << "tasks are marked in the plots over time";
  EXPECT_LT(page.size(), 1'200'000U);
}

TEST_F(TeleopSession, RecordsEveryCycleInTheContractsFormatAndTheConfigurationThatMadeIt) {
  be_quick();
  options.tasks = {{sim::tasks::Reach{{0.37, 0.05, 0.38}}}};
  options.record_directory = directory / "new" / "run";
  const TeleopSummary summary = run();
  EXPECT_EQ(summary.stop_reason, "");
  EXPECT_TRUE(summary.recorded);
  EXPECT_EQ(summary.recording_problems, std::vector<std::string>{});
  EXPECT_EQ(summary.cycles_lost, 0U);
  EXPECT_EQ(summary.cycles_recorded, summary.loop.cycles);
  EXPECT_EQ(text_of(*options.record_directory / "config.toml"), text_of(kTeleop));

  const Recorded recorded(*options.record_directory / "teleoperation.csv");
  ASSERT_GE(recorded.comments.size(), 4U);
  EXPECT_EQ(recorded.comments[0], "# youbot recording v1");
  EXPECT_EQ(recorded.comments[1], "# rig: base+arm");
  EXPECT_EQ(recorded.comments[2], "# experiment: teleoperation");
  EXPECT_EQ(recorded.comments[3], "# sample_rate_Hz: 1000");
  EXPECT_EQ(recorded.columns.front(), "time_s");
  EXPECT_EQ(recorded.columns.size(), kColumns);
  ASSERT_EQ(recorded.rows.size(), seen.size());
  double furthest_m = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const TeleopRecord& record = seen[i];
    ASSERT_NEAR(recorded.at(i, "time_s"), 1e-3 * static_cast<double>(i), 1e-9);
    ASSERT_EQ(recorded.at(i, "phase"), static_cast<double>(record.phase)) << i;
    ASSERT_NEAR(recorded.at(i, "true_tip_y_m"), record.true_tip_p_WT_m[1], 1e-6) << i;
    ASSERT_NEAR(recorded.at(i, "grip_force_held_y_N"), record.held_force_H_N[1], 1e-4) << i;
    ASSERT_NEAR(recorded.at(i, "arm_3_position_rad"), record.position_rad[6], 1e-7) << i;
    furthest_m = std::max(furthest_m, record.true_tip_p_WT_m[1]);
  }
  EXPECT_NEAR(furthest_m, 0.05, 0.02) << "a run in which something happened";
}

TEST_F(TeleopSession, ItsRecordingReadsAsOneWithColumnsOfItsOwn) {
  stop = true;
  be_quick();
  options.record_directory = directory.path();
  (void)run();
  const runtime::ReadRecording read =
      runtime::read_recording(directory / "teleoperation.csv", runtime::NotMeasured::kTaken);
  EXPECT_EQ(read.recording.rig, "base+arm");
  EXPECT_EQ(read.recording.experiment, "teleoperation");
  EXPECT_EQ(read.recording.rows(), seen.size());
  EXPECT_EQ(read.recording.columns.size(), kColumns);
  const auto message = [&](const std::string& part) {
    return std::any_of(read.warnings.begin(), read.warnings.end(),
                       [&](const std::string& warning) { return says(warning, part); });
  };
  EXPECT_TRUE(message("column 'tank_J' is not part of the format; kept as it is"));
  EXPECT_TRUE(message("gripper_opening_m was not measured: "));
  EXPECT_FALSE(message("true_tip_x_m was not measured: ")) << "the simulation knows";
}

TEST_F(TeleopSession, AsMcapItTakesAFifthOfTheTextAtMost) {
  be_quick();
  options.tasks = {{sim::tasks::Reach{{0.37, 0.05, 0.38}}}};
  options.record_directory = directory / "csv";
  (void)run();
  options.record_format = {};
  options.record_directory = directory / "mcap";
  const TeleopSummary summary = run();
  EXPECT_EQ(summary.recording_problems, std::vector<std::string>{});
  const auto recording =
      runtime::read_recording(directory / "mcap/teleoperation.mcap", runtime::NotMeasured::kTaken).recording;
  EXPECT_EQ(recording.rows(), summary.loop.cycles);
  EXPECT_EQ(recording.columns.size(), kColumns);
  EXPECT_LT(static_cast<double>(fs::file_size(directory / "mcap/teleoperation.mcap")),
            0.2 * static_cast<double>(fs::file_size(directory / "csv/teleoperation.csv")));
  seen.clear();
  EXPECT_TRUE(says(refusal(), "holds a recording already"));
}

TEST_F(TeleopSession, ARecordingIsNeverReplaced) {
  stop = true;
  be_quick();
  options.record_directory = directory.path();
  (void)run();
  const std::string before = text_of(directory / "teleoperation.csv");
  seen.clear();
  const std::string message = refusal();
  EXPECT_TRUE(says(message, directory.path().string() + " holds a recording already; name a new directory"))
      << message;
  EXPECT_EQ(text_of(directory / "teleoperation.csv"), before);
}

TEST_F(TeleopSession, AnExistingConfigurationIsNotReplacedEither) {
  directory.write("config.toml", "robot = \"loopback\"\n");
  options.record_directory = directory.path();
  EXPECT_TRUE(says(refusal(), "holds a recording already"));
  EXPECT_EQ(text_of(directory / "config.toml"), "robot = \"loopback\"\n");
}

TEST_F(TeleopSession, APlaceThatCannotBeRecordedToIsRefusedBeforeAnythingIsOpened) {
  directory.write("file", "not a directory");
  options.record_directory = directory / "file" / "run";
  config.robot.name = "toaster";
  config.haptic.name = "toaster";
  try {
    (void)run();
    FAIL();
  } catch (const hal::SetupError& error) {
    EXPECT_TRUE(says(error.what(), (directory / "file/run").string() + ": cannot be the directory"))
        << error.what();
  }
}

TEST_F(TeleopSession, AFileThatCannotBeMadeRefusesTheRunAndLeavesNothingBehind) {
  fs::create_symlink(directory / "missing/teleoperation.csv", directory / "teleoperation.csv");
  options.record_directory = directory.path();
  EXPECT_THROW((void)run_teleop_session(config, options, stop), hal::SetupError);
  EXPECT_TRUE(fs::is_symlink(directory / "teleoperation.csv")) << "it was not ours";
  EXPECT_FALSE(fs::exists(directory / "config.toml"));
}

// --- Faults ---

TEST_F(TeleopSession, AStartThatFailsLeavesItsLastSecondBesideTheRecording) {
  be_quick();
  config.teleoperation.unfolding_timeout_s = 1.0;  // it takes 3
  options.record_directory = directory.path();
  options.tasks = demo_tasks();
  const TeleopSummary summary = run();
  for (const TaskReport& task : summary.tasks)
    EXPECT_EQ(task.outcome.result, sim::TaskResult::kNotBegun) << task.name;
  EXPECT_TRUE(says(summary.stop_reason, "the arm did not come to its unfolded pose in time"))
      << summary.stop_reason;
  EXPECT_TRUE(says(summary.stop_reason, "braked, arm lowered, switched off")) << summary.stop_reason;
  EXPECT_FALSE(summary.cut_short);
  EXPECT_EQ(summary.cycles_recorded, summary.loop.cycles);
  ASSERT_TRUE(summary.fault_report.has_value());
  EXPECT_EQ(summary.fault_report->parent_path(), directory.path());

  const Recorded last(*summary.fault_report);
  EXPECT_EQ(last.comments[0], "# youbot recording v1");
  EXPECT_EQ(last.comments[1], "# rig: base+arm");
  EXPECT_EQ(last.comments[2], "# experiment: fault report");
  EXPECT_EQ(last.comments[3], "# reason: " + summary.stop_reason);
  EXPECT_EQ(last.columns, Recorded(directory / "teleoperation.csv").columns);
  // A second without a gap, with the end of the start in it.
  ASSERT_EQ(last.rows.size(), 1000U);
  const auto first = static_cast<std::size_t>(std::lround(1e3 * last.at(0, "time_s")));
  ASSERT_LE(first + last.rows.size(), seen.size());
  for (std::size_t i = 0; i < last.rows.size(); ++i) {
    EXPECT_NEAR(last.at(i, "time_s"), 1e-3 * static_cast<double>(first + i), 1e-9);
    EXPECT_EQ(last.at(i, "phase"), static_cast<double>(seen[first + i].phase));
  }
  EXPECT_EQ(last.at(0, "phase"), static_cast<double>(TeleopPhase::kUnfolding));
  EXPECT_GE(last.at(999, "phase"), static_cast<double>(TeleopPhase::kStopping));
}

TEST_F(TeleopSession, AFaultReportFindsAnotherPlaceWhenTheRecordingHasLostItsOwn) {
  be_quick();
  config.teleoperation.unfolding_timeout_s = 1.0;
  options.record_directory = directory / "run";
  options.after_cycle = [&](const TeleopRecord&) { fs::remove_all(directory / "run"); };
  const TeleopSummary summary = run();
  ASSERT_TRUE(summary.fault_report.has_value());
  EXPECT_EQ(Recorded(*summary.fault_report).rows.size(), 1000U);
  fs::remove(*summary.fault_report);
}

TEST_F(TeleopSession, AnArmThatDoesNotKnowItsAnglesIsNotMoved) {
  config.robot.name = "wire";
  config.robot.ethercat.home_arms = false;
  options.record_directory = directory.path();
  const TeleopSummary summary = run();
  EXPECT_TRUE(says(summary.stop_reason, "set ethercat.home_arms = true")) << summary.stop_reason;
  for (const TeleopRecord& record : seen)
    ASSERT_TRUE(record.phase != TeleopPhase::kUnfolding && record.phase != TeleopPhase::kApproaching);
  ASSERT_TRUE(summary.fault_report.has_value());
  EXPECT_TRUE(fs::exists(fs::path(*summary.fault_report).replace_extension(".pcapng")));
}

// --- Messages ---

TEST(TeleopReport, ReportsHowEachTaskEndedAndTheForceOnTheHand) {
  TeleopSummary summary;
  summary.robot = "loopback";
  summary.master = "simulated handle";
  summary.virtual_time = true;
  summary.phases = {{TeleopPhase::kCentring, 0s}, {TeleopPhase::kLetGo, 12300ms}};
  summary.tasks = {
      {"follow", {sim::TaskResult::kDone, 7200ms, 1.31, 0.0029, 0.0095}},
      {"touch", {.result = sim::TaskResult::kTimedOut, .duration = 20s, .largest_force_N = 0.26}},
      {"reach", {.result = sim::TaskResult::kUnderWay}},
      {"let go", {}},
  };
  summary.largest_grip_force_N = 1.56;
  summary.most_energy_given_J = 0.0032;
  summary.furthest_base_m = 0.71;
  summary.largest_tip_error_m = 0.022;
  const std::string text = report(summary);
  for (const char* line :
       {"phases       centring 0.0 s, let go 12.3 s\n",
        "follow       done           7.2 s   felt up to 1.31 N, off the path 2.9 mm on average, 9.5 mm at "
        "most\n",
        "touch        given up      20.0 s   felt up to 0.26 N\n", "reach        not finished",
        "let go       not begun", "force up to 1.56 N", "no more than 3.2 mJ net", "base up to 0.71 m",
        "within 22 mm of its set-point", "(virtual time)"})
    EXPECT_TRUE(says(text, line)) << line << "in\n" << text;
  EXPECT_FALSE(says(text, "recording")) << text;
}

TEST(TeleopReport, ReportsMasterRobotAndSystem) {
  TeleopSummary summary;
  summary.master_warnings = {"its firmware is old"};
  summary.robot_report = {"arm-2 was still moving"};
  summary.not_real_time = {"no SCHED_FIFO"};
  summary.once_silent_checks.add(control::PlausibilityCheck::kWheelAgreement);
  summary.recorded = true;
  summary.cycles_recorded = 40;
  summary.cycles_lost = 2;
  const std::string text = report(summary);
  for (const char* line :
       {"device says  its firmware is old\n", "robot says   arm-2 was still moving\n",
        "NOT REAL-TIME: no SCHED_FIFO\n",
        "NOT CHECKED: for a second or more too few samples came in time for the check 'wheel_agreement'",
        "recording    40 cycles written, 2 lost\n"})
    EXPECT_TRUE(says(text, line)) << line << "in\n" << text;
  EXPECT_FALSE(says(text, "operator")) << text;
}

}  // namespace teleop_session_test
}  // namespace operation
