#include "operation/session.h"
#include "operation/report.h"

#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <fstream>
#include <map>
#include <sstream>
#include <utility>

#include "hal/setup_error.h"
#include "operation/base_recording.h"
#include "runtime/configuration/toml_reader.h"
#include "runtime/mcap/convert.h"
#include "runtime/mcap/mcap_file.h"
#include "runtime/mcap/recording_head.h"
#include "runtime/recording/recording_reader.h"
#include "tests/support/built_paths.h"
#include "tests/support/file_size_limit.h"
#include "tests/support/temporary_directory.h"

namespace operation {
namespace session_test {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

const fs::path kDemo = support::source_dir() + "/apps/youbotd/demo.toml";

class Session : public ::testing::Test {
 protected:
  Session() {
    options.config_file = kDemo;
    options.virtual_time = true;
    options.record_format = runtime::RecordingFormat::kCsv;
  }

  support::TemporaryDirectory directory;
  SessionOptions options;
  std::atomic<bool> stop{false};
  Config config = load_config(kDemo);
};

/// Rows of numbers below the header of a recording; fails the test on a row of another width.
std::vector<std::vector<double>> rows(const fs::path& path, std::size_t width) {
  std::ifstream file(path);
  std::vector<std::vector<double>> result;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("#") || line.starts_with("time_s")) continue;
    std::vector<double> row;
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) row.push_back(std::stod(cell));
    EXPECT_EQ(row.size(), width) << path << ": " << line;
    result.push_back(row);
  }
  return result;
}

TEST_F(Session, TheDemoBaseFollowsItsPathWithCompensationOnly) {
  // Thesis 2.7.2: without compensation the wrench could not start the base, with it the base followed its
  // path.
  const Summary with = run_session(config, options, stop);
  EXPECT_TRUE(with.stop_reason.empty()) << with.stop_reason;
  ASSERT_TRUE(with.path.first_motion().has_value());
  EXPECT_TRUE(with.path.on_truth());
  EXPECT_LT(with.path.rms_m(), 0.02);    // a fiftieth of the path's size
  EXPECT_LT(with.path.final_m(), 0.02);  // friction left over by the margin, against 150 N/m: 2 N is 13 mm
  EXPECT_LT(with.path.final_rad(), 0.03);
  EXPECT_EQ(with.cycles_torque_rate_limited, 0U) << "of reversals of friction, too";

  EXPECT_EQ(with.cycles_setpoint_limited, 0U);

  config.cycle.controller.compensate_friction = false;
  const Summary without = run_session(config, options, stop);
  EXPECT_FALSE(without.path.first_motion().has_value());
  EXPECT_TRUE(without.fell_behind) << without.stop_reason;
  EXPECT_LT(without.path.worst_m(), 0.18) << "it was 1.2 m off before there was a limit";
}

TEST_F(Session, RunsWithTheSameSeedGiveEqualRecordings) {
  options.duration = 3s;
  const auto recorded = [&](const char* name, std::uint64_t seed) {
    options.record_directory = directory / name;
    config.robot.simulation.noise_seed = seed;
    (void)run_session(config, options, stop);
    std::ifstream file(directory / name / "wheel-1.csv");
    std::string text(std::istreambuf_iterator<char>(file), {});
    const std::size_t started = text.find("# started: ");
    return text.erase(started, text.find('\n', started) + 1 - started);
  };
  const std::string first = recorded("first", 1);
  EXPECT_GT(first.size(), 100'000U);
  EXPECT_EQ(recorded("second", 1), first);
  EXPECT_NE(recorded("third", 7), first);
}

TEST_F(Session, RecordsEveryCycleOfEveryWheelInTheContractsFormat) {
  options.duration = 4s;
  options.record_directory = directory / "new" / "run";
  const Summary summary = run_session(config, options, stop);
  EXPECT_EQ(summary.cycles_lost, 0U);
  EXPECT_EQ(summary.cycles_recorded, summary.loop.cycles);
  EXPECT_TRUE(summary.recording_problems.empty());

  std::ifstream head(*options.record_directory / "wheel-2.csv");
  std::string text;
  for (const char* expected : {"# youbot recording v1", "# rig: wheel-2", "# experiment: path",
                               "# sample_rate_Hz: 1000", "# friction_compensation: true"}) {
    std::getline(head, text);
    EXPECT_EQ(text, expected);
  }
  const auto wheel = rows(*options.record_directory / "wheel-2.csv", 5);
  ASSERT_EQ(wheel.size(), summary.loop.cycles);
  for (std::size_t i = 1; i < wheel.size(); ++i) EXPECT_NEAR(wheel[i][0] - wheel[i - 1][0], 1e-3, 1e-9);
  // The base has begun to drive forward: wheel 2 turns forward under positive torque.
  EXPECT_GT(wheel.back()[3], 0.05);
  EXPECT_GT(wheel[wheel.size() / 2][1], 0.02);
  EXPECT_TRUE(fs::exists(*options.record_directory / "config.toml"));
  EXPECT_EQ(rows(*options.record_directory / "base.csv", 41).size(), summary.loop.cycles);
}

TEST_F(Session, RecordsOneFileAsMcapWithEverythingThatTheTextFilesHave) {
  options.duration = 4s;
  options.record_directory = directory / "csv";
  (void)run_session(config, options, stop);
  options.record_format = {};
  options.record_directory = directory / "mcap";
  const Summary summary = run_session(config, options, stop);
  EXPECT_EQ(summary.cycles_recorded, summary.loop.cycles);
  EXPECT_TRUE(summary.recording_problems.empty());
  EXPECT_FALSE(fs::exists(directory / "mcap/wheel-1.mcap"));
  EXPECT_TRUE(fs::exists(directory / "mcap/config.toml"));
  // How long a cycle took is not a property of the run.
  const auto text_of = [](const fs::path& path, bool with_times) {
    std::ifstream file(path);
    std::string text;
    for (std::string line; std::getline(file, line);) {
      if (line.starts_with("# started: ")) continue;
      if (with_times && !line.starts_with('#')) line.resize(line.rfind(',', line.rfind(',') - 1));
      text += line + '\n';
    }
    return text;
  };
  for (const auto& [name, joint] : {std::pair{"base", ""}, {"wheel-1", "wheel-1"}, {"wheel-4", "wheel_4"}}) {
    const std::string file = std::string(name) + ".csv";
    const auto converted = runtime::mcap::convert(directory / "mcap/base.mcap", directory / file, joint);
    EXPECT_EQ(converted.rows, summary.loop.cycles);
    const bool with_times = file == "base.csv";
    EXPECT_TRUE(text_of(directory / file, with_times) == text_of(directory / "csv" / file, with_times))
        << file;
  }
}

TEST_F(Session, TheStartIsInTheHeaderAlsoInVirtualTime) {
  options.duration = 100ms;
  options.record_directory = directory / "run";
  const auto before = std::chrono::system_clock::now();
  (void)run_session(config, options, stop);
  const auto after = std::chrono::system_clock::now();
  const auto recording = runtime::read_recording(directory / "run/wheel-1.csv").recording;
  const auto started =
      std::ranges::find(recording.comments, "started", &std::pair<std::string, std::string>::first);
  ASSERT_NE(started, recording.comments.end());
  const std::uint64_t start_ns = runtime::mcap::RecordingHead{{{"started", started->second}}, {}}.start_ns();
  const std::chrono::system_clock::time_point start{std::chrono::nanoseconds(start_ns)};
  EXPECT_GE(start, std::chrono::floor<std::chrono::milliseconds>(before));
  EXPECT_LE(start, after);
}

TEST_F(Session, ModelsThatTheConfigurationNamesAreInTheRecording) {
  const std::string model =
      "format = \"youbot-drive-model/1\"\nname = \"w\"\ninertia_kg_m2 = 0.01\n[[effect]]\n"
      "type = \"coulomb\"\ntorque_Nm = 0.04375\n";
  directory.write("a.toml", model);
  const fs::path file = directory.write(
      "c.toml", "[compensation]\nmodels = [\"a.toml\", \"a.toml\", \"a.toml\", \"a.toml\"]\n");
  config = load_config(file);
  ASSERT_EQ(config.models.size(), 1U);
  EXPECT_EQ(config.models[0].name, "a.toml");
  options.config_file = file;
  options.settings = "limits.force_N = 4\n";
  options.duration = 100ms;
  options.record_format = {};
  options.record_directory = directory / "run";
  (void)run_session(config, options, stop);
  struct : runtime::mcap::Visitor {
    std::map<std::string, std::string> texts;
    bool wants_attachments() const override { return true; }
    void attachment(const runtime::mcap::Attachment& attachment) override {
      texts[attachment.name] = attachment.data;
    }
  } attachments;
  runtime::mcap::read_mcap(runtime::mcap::read_file(directory / "run/base.mcap"), "base.mcap", attachments);
  EXPECT_EQ(attachments.texts.size(), 3U);
  EXPECT_NE(attachments.texts["a.toml"].find("0.04375"), std::string::npos);
  EXPECT_NE(attachments.texts["config.toml"].find("[compensation]"), std::string::npos);
  EXPECT_EQ(attachments.texts["settings.toml"], options.settings);
}

TEST_F(Session, TheWorkspaceIsInTheRecordingsHeader) {
  const fs::path file = directory.write("walls.toml", "[workspace]\nbase_x_m = [-0.5, 1.5]\n");
  config = load_config(file);
  options.config_file = file;
  options.duration = 100ms;
  options.record_directory = directory / "run";
  (void)run_session(config, options, stop);
  std::ifstream base(directory / "run/base.csv");
  const std::string text(std::istreambuf_iterator<char>(base), {});
  EXPECT_NE(text.find("# workspace_base_x_m: -0.5 1.5\n"), std::string::npos) << text.substr(0, 400);
  EXPECT_EQ(text.find("workspace_base_y_m"), std::string::npos) << "no wall there";
}

TEST_F(Session, TheReportBesideARecordingDrawsTheWayAndTheWallsAndCountsWhatWasLimited) {
  const std::string legs =
      "[path]\nspeed_m_per_s = 0.4\nacceleration_m_per_s2 = 0.3\n[[path.leg]]\nforward_m = 0.1\n";
  const fs::path file = directory.write(
      "walls.toml", "[limits]\nsetpoint_m_per_s2 = 0.2\n[workspace]\nbase_x_m = [-0.5, 1.5]\n" + legs);
  config = load_config(file);
  options.config_file = file;
  options.record_directory = directory / "run";
  const Summary summary = run_session(config, options, stop);
  EXPECT_TRUE(summary.stop_reason.empty()) << summary.stop_reason;
  EXPECT_TRUE(summary.recording_problems.empty());
  EXPECT_GT(summary.cycles_setpoint_limited, 0U);
  std::ifstream page(directory / "run/report.html");
  const std::string text(std::istreambuf_iterator<char>(page), {});
  EXPECT_NE(text.find("workspace of the base's centre"), std::string::npos);
  EXPECT_NE(text.find("From above"), std::string::npos);
  // Two limits, over the driven range plus a tenth of a metre.
  EXPECT_NE(text.find("[-0.5,-0.5,-0.5,1.5,1.5,1.5]"), std::string::npos);
  const std::size_t row = text.find("set-point at its limit of speed, acceleration or jerk");
  ASSERT_NE(row, std::string::npos);
  EXPECT_NE(text.substr(row, 120).find(">" + std::to_string(summary.cycles_setpoint_limited) + "<"),
            std::string::npos)
      << text.substr(row, 120);
}

TEST_F(Session, TheReportOfAFaultGivesTimeAndCauseAndLinksTheLastSecond) {
  config.cycle.controller.compensate_friction = false;
  options.record_directory = directory / "run";
  const Summary summary = run_session(config, options, stop);
  ASSERT_TRUE(summary.fell_behind);
  ASSERT_TRUE(summary.fault_report);
  std::ifstream page(directory / "run/report.html");
  const std::string text(std::istreambuf_iterator<char>(page), {});
  EXPECT_NE(text.find(", stopped by a fault</h1>"), std::string::npos);
  const std::string cause = summary.stop_reason.substr(0, summary.stop_reason.find('\''));
  EXPECT_NE(text.find("<td>cause</td><td>" + cause), std::string::npos) << cause;
  const std::string file = summary.fault_report->filename().string();
  EXPECT_NE(text.find("href=\"" + file + "\""), std::string::npos) << file;
  const double fault_s = std::chrono::duration<double>(summary.stop_time).count();
  EXPECT_GT(fault_s, 0.2) << "the window of the following error";
  EXPECT_NE(text.find(fmt::format("<td>time</td><td>{:.3f} s</td>", fault_s)), std::string::npos) << fault_s;
  EXPECT_NE(text.find("\"name\":\"fault\",\"from\":"), std::string::npos);
}

TEST_F(Session, AWorkspaceThatCannotBeIsRefused) {
  const auto refusal = [&](const std::string& text) {
    try {
      (void)load_config(directory.write("walls.toml", text));
    } catch (const runtime::ConfigError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  const std::string leg = "[[path.leg]]\nforward_m = 1\n";
  EXPECT_NE(refusal("[workspace]\nbase_x_m = [-1, 0.9]\n" + leg).find("leads out of [workspace], at x = 0.9"),
            std::string::npos);
  EXPECT_EQ(refusal("[workspace]\nbase_x_m = [-1, 1.1]\n" + leg), "accepted");
  EXPECT_NE(
      refusal("[workspace]\nbase_y_m = [0.5, 1]\n").find(":2: 'workspace.base_y_m' leaves out the origin"),
      std::string::npos);
  EXPECT_NE(refusal("[workspace]\ntip_z_m = [1, 0]\n").find("no room"), std::string::npos);
}

TEST_F(Session, ALegThatIsRejectedIsReportedOnce) {
  try {
    (void)load_config(
        directory.write("leg.toml", "[[path.leg]]\nforward_m = nan\n[[path.leg]]\nleft_m = 0\n"));
    FAIL();
  } catch (const runtime::ConfigError& error) {
    ASSERT_EQ(error.problems().size(), 2U) << error.what();
    EXPECT_NE(error.problems()[0].find(":2: 'path.leg[0].forward_m' is nan"), std::string::npos);
    EXPECT_NE(error.problems()[1].find(":3: 'path.leg[1].forward_m' and 'left_m'"), std::string::npos);
  }
}

TEST_F(Session, APathThatWouldTurnAWheelTooFastIsRefused) {
  const auto problem = [&](const std::string& leg) {
    try {
      (void)load_config(directory.write(
          "fast.toml",
          "[limits]\nwheel_speed_rad_per_s = 9\n[path]\nspeed_m_per_s = 0.4\nacceleration_m_per_s2 = 1\n"
          "[[path.leg]]\n" +
              leg));
    } catch (const runtime::ConfigError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  // 0.4 m/s on wheels of 0.0475 m are 8.4 rad/s straight ahead, and times √2 diagonally.
  EXPECT_EQ(problem("forward_m = 2\n"), "");
  EXPECT_NE(problem("forward_m = 2\nleft_m = 2\n").find("turns a wheel at 11.9 rad/s"), std::string::npos);
}

TEST_F(Session, ARecordingIsNeverReplaced) {
  options.duration = 100ms;
  options.record_directory = directory.path();
  (void)run_session(config, options, stop);
  EXPECT_THROW((void)run_session(config, options, stop), std::invalid_argument);
}

TEST_F(Session, APlaceThatCannotBeRecordedToIsRefusedBeforeTheRobotIsOpened) {
  directory.write("file", "not a directory");
  options.record_directory = directory / "file" / "run";
  config.robot.name = "toaster";
  try {
    (void)run_session(config, options, stop);
    FAIL();
  } catch (const hal::SetupError& error) {
    EXPECT_NE(std::string(error.what()).find((directory / "file/run").string() + ": cannot be the directory"),
              std::string::npos)
        << error.what();
  }
}

TEST_F(Session, OneFileThatCannotBeMadeRefusesTheRunAndLeavesNothingBehind) {
  fs::create_symlink(directory / "missing/wheel-2.csv", directory / "wheel-2.csv");
  options.record_directory = directory.path();
  try {
    (void)run_session(config, options, stop);
    FAIL();
  } catch (const hal::SetupError& error) {
    EXPECT_NE(std::string(error.what()).find((directory / "wheel-2.csv").string()), std::string::npos)
        << error.what();
  }
  EXPECT_FALSE(holds_recording(directory.path()));
  EXPECT_TRUE(fs::is_symlink(directory / "wheel-2.csv")) << "it was not ours";
}

TEST_F(Session, ADiskWithoutRoomForTheHeadersRefusesTheRunAndLeavesNothingBehind) {
  options.record_directory = directory / "run";
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit full{16, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &full), 0);
  std::string refusal;
  try {
    (void)run_session(config, options, stop);
  } catch (const hal::SetupError& error) {
    refusal = error.what();
  }
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  EXPECT_NE(refusal.find("cannot write the header"), std::string::npos) << refusal;
  EXPECT_FALSE(fs::exists(directory / "run"));
}

TEST_F(Session, AStartThatIsRefusedAfterTheRecordingWasOpenedLeavesNothingBehind) {
  options.virtual_time = false;
  options.record_directory = directory / "new/run";
  config.real_time.cpu = 1023;  // no machine has it
  EXPECT_THROW((void)run_session(config, options, stop), hal::SetupError);
  EXPECT_FALSE(fs::exists(directory / "new"));
}

TEST_F(Session, ARunThatEndsBeforeItsFirstCycleLeavesNothingOfItsRecording) {
  {
    BaseRecording recording(base_recording({.directory = directory / "new/run",
                                            .config = {options.config_file, "limits.force_N = 4\n"},
                                            .experiment = "velocity",
                                            .period = 1ms}));
    EXPECT_TRUE(recording.problems().empty());
    std::ifstream settings(directory / "new/run/settings.toml");
    std::string line;
    EXPECT_TRUE(std::getline(settings, line) && line == "limits.force_N = 4") << line;
    recording.close();
  }
  EXPECT_FALSE(fs::exists(directory / "new"));
}

TEST_F(Session, ADiskThatFillsUpCostsRowsButNotTheRunAndFilesStayReadable) {
  options.duration = 5s;
  options.record_directory = directory.path();
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit full{64 * 1024, before.rlim_max};  // the kernel refuses to grow a file beyond this
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &full), 0);
  const Summary summary = run_session(config, options, stop);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);

  EXPECT_TRUE(summary.stop_reason.empty());
  EXPECT_GT(summary.cycles_recorded, 100U);
  EXPECT_EQ(summary.cycles_recorded + summary.cycles_lost, summary.loop.cycles);
  EXPECT_FALSE(summary.recording_problems.empty());
  EXPECT_GT(rows(directory / "wheel-1.csv", 5).size(), 100U);
  EXPECT_GT(rows(directory / "base.csv", 41).size(), 100U);
}

TEST_F(Session, ADiskThatFillsUpCostsTheRestOfAnMcapFile) {
  options.duration = 5s;
  options.record_format = {};
  options.record_directory = directory / "run";
  Summary summary;
  {
    const support::FileSizeLimit full(128 * 1024);
    summary = run_session(config, options, stop);
  }
  EXPECT_TRUE(summary.stop_reason.empty());
  EXPECT_GT(summary.cycles_recorded, 100U);
  EXPECT_GT(summary.cycles_lost, 0U);
  EXPECT_EQ(summary.cycles_recorded + summary.cycles_lost, summary.loop.cycles);
  const auto read = runtime::read_recording(directory / "run/base.mcap", {.joint = "wheel_1"});
  EXPECT_EQ(read.recording.rows(), summary.cycles_recorded);
}

TEST_F(Session, AFaultLeavesTheLastSecondBehind) {
  config.cycle.wheel_speed_limit_rad_per_s = 0.5;  // the path is faster
  options.record_directory = directory.path();
  const Summary summary = run_session(config, options, stop);
  EXPECT_NE(summary.stop_reason.find("more than allowed"), std::string::npos) << summary.stop_reason;
  ASSERT_TRUE(summary.fault_report.has_value());
  const auto last = rows(*summary.fault_report, 41);
  EXPECT_EQ(last.size(), 1000U);
  EXPECT_NEAR(last.back()[0] - last.front()[0], 0.999, 1e-6);
  EXPECT_EQ(last.back()[1], static_cast<double>(Phase::kFaulted));
}

TEST_F(Session, StoppedInMidMotionItBrakesToRestBeforeTheDrivesGoOff) {
  options.duration = 8s;  // the base is on its way
  options.record_directory = directory.path();
  const Summary summary = run_session(config, options, stop);
  EXPECT_TRUE(summary.stop_reason.empty()) << summary.stop_reason;
  EXPECT_TRUE(summary.cut_short);
  const auto base = rows(directory / "base.csv", 41);
  const auto truth_x_m = [&](std::size_t i) { return base[i][9]; };
  const std::size_t asked = 8000;
  EXPECT_GT(truth_x_m(asked) - truth_x_m(asked - 100), 0.1 * 0.02) << "it was not moving";
  const std::size_t last = base.size() - 1;
  // Wheels below 0.02 rad/s for 10 ms, and the recording's last digit.
  EXPECT_LT(std::abs(truth_x_m(last) - truth_x_m(last - 10)), 0.02 * 0.0475 * 0.010 + 2e-6)
      << "it is not at rest";
}

TEST_F(Session, StopsAtOnceWhenAskedBeforeItBegan) {
  stop = true;
  const Summary summary = run_session(config, options, stop);
  EXPECT_TRUE(summary.stop_reason.empty());
  EXPECT_LT(summary.loop.robot_time, 100ms);
}

TEST_F(Session, OnTheWireAFaultLeavesTheFramesOfTheLastSecondToo) {
  config.robot.name = "wire";
  config.cycle.wheel_speed_limit_rad_per_s = 0.5;
  options.record_directory = directory.path();
  const Summary summary = run_session(config, options, stop);
  ASSERT_TRUE(summary.fault_report.has_value());
  std::ifstream capture(fs::path(*summary.fault_report).replace_extension(".pcapng"), std::ios::binary);
  std::uint32_t section_header = 0;
  capture.read(reinterpret_cast<char*>(&section_header), sizeof section_header);
  EXPECT_EQ(section_header, 0x0A0D0D0AU);  // pcapng, section header block
}

TEST_F(Session, TheDemoBaseFollowsItsPathThroughEveryByteOfTheEthercatMasterToo) {
  config.robot.name = "wire";
  const Summary summary = run_session(config, options, stop);
  EXPECT_TRUE(summary.stop_reason.empty()) << summary.stop_reason;
  EXPECT_LT(summary.path.rms_m(), 0.02);
  EXPECT_LT(summary.path.final_m(), 0.02);
}

TEST_F(Session, AFaultReportFindsAnotherPlaceWhenTheRecordingHasLostItsOwn) {
  options.record_directory = directory / "run";
  options.after_cycle = [&](const CycleRecord&) { fs::remove_all(directory / "run"); };
  config.cycle.wheel_speed_limit_rad_per_s = 0.5;
  const Summary summary = run_session(config, options, stop);
  ASSERT_TRUE(summary.fault_report.has_value());
  EXPECT_EQ(rows(*summary.fault_report, 41).size(), 1000U);
  fs::remove(*summary.fault_report);
}

TEST_F(Session, AnUnknownRobotIsRefusedByName) {
  config.robot.name = "toaster";
  try {
    (void)run_session(config, options, stop);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("toaster"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("loopback"), std::string::npos);
  }
}

TEST_F(Session, TheDemoFileIsTheDefaultConfiguration) {
  // The values in the file and the defaults in the code must be equal.
  const Config defaults = load_config(directory.write("plain.toml", "robot = \"loopback\"\n"));
  const auto& demo = config.cycle.controller;
  const auto& code = defaults.cycle.controller;
  EXPECT_EQ(demo.stiffness, code.stiffness);
  EXPECT_EQ(demo.damping, code.damping);
  EXPECT_EQ(demo.feedforward_inertia, code.feedforward_inertia);
  EXPECT_EQ(demo.wrench_limits.force_N, code.wrench_limits.force_N);
  EXPECT_EQ(demo.wrench_limits.moment_Nm, code.wrench_limits.moment_Nm);
  EXPECT_EQ(demo.torque_limit_Nm, code.torque_limit_Nm);
  EXPECT_EQ(demo.compensator.margin, code.compensator.margin);
  EXPECT_EQ(demo.compensator.full_command_Nm, code.compensator.full_command_Nm);
  EXPECT_EQ(demo.observer.blend_speed_rad_per_s, code.observer.blend_speed_rad_per_s);
  EXPECT_EQ(demo.observer.filter.cutoff_rad_per_s, code.observer.filter.cutoff_rad_per_s);
  EXPECT_EQ(demo.observer.filter.damping, code.observer.filter.damping);
  EXPECT_EQ(demo.geometry.wheel_radius_m, code.geometry.wheel_radius_m);
  EXPECT_EQ(demo.geometry.wheelbase_m, code.geometry.wheelbase_m);
  EXPECT_EQ(demo.geometry.track_m, code.geometry.track_m);
  EXPECT_EQ(config.cycle.period, defaults.cycle.period);
  EXPECT_EQ(config.cycle.command_timeout, defaults.cycle.command_timeout);
  EXPECT_EQ(config.cycle.wheel_speed_limit_rad_per_s, defaults.cycle.wheel_speed_limit_rad_per_s);
  EXPECT_NEAR(config.cycle.torque_rate_per_s, defaults.cycle.torque_rate_per_s, 1e-3);
  EXPECT_EQ(config.cycle.setpoint.linear.speed, defaults.cycle.setpoint.linear.speed);
  EXPECT_EQ(config.cycle.setpoint.linear.acceleration, defaults.cycle.setpoint.linear.acceleration);
  EXPECT_EQ(config.cycle.setpoint.linear.jerk, defaults.cycle.setpoint.linear.jerk);
  EXPECT_EQ(config.cycle.setpoint.turning.speed, defaults.cycle.setpoint.turning.speed);
  EXPECT_EQ(config.cycle.setpoint.turning.acceleration, defaults.cycle.setpoint.turning.acceleration);
  EXPECT_EQ(config.cycle.setpoint.turning.jerk, defaults.cycle.setpoint.turning.jerk);
  EXPECT_EQ(config.cycle.following_error_m, defaults.cycle.following_error_m);
  EXPECT_EQ(config.cycle.following_error_rad, defaults.cycle.following_error_rad);
  EXPECT_EQ(config.real_time.priority, defaults.real_time.priority);
  EXPECT_EQ(config.path.limits.speed_m_per_s, defaults.path.limits.speed_m_per_s);
  EXPECT_EQ(config.path.limits.turn_speed_rad_per_s, defaults.path.limits.turn_speed_rad_per_s);
  EXPECT_EQ(config.path.rest_s, defaults.path.rest_s);
  EXPECT_EQ(config.robot.simulation.mass_kg, defaults.robot.simulation.mass_kg);
  EXPECT_EQ(config.robot.simulation.yaw_inertia_kg_m2, defaults.robot.simulation.yaw_inertia_kg_m2);
  EXPECT_EQ(config.robot.simulation.drive.load_inertia_kg_m2,
            defaults.robot.simulation.drive.load_inertia_kg_m2);
  EXPECT_EQ(config.robot.simulation.loaded_friction_scale, defaults.robot.simulation.loaded_friction_scale);
  EXPECT_EQ(config.robot.simulation.roller_grip, defaults.robot.simulation.roller_grip);
  EXPECT_EQ(config.robot.simulation.roller_resistance, defaults.robot.simulation.roller_resistance);
  EXPECT_EQ(config.robot.simulation.centre_of_mass_height_m,
            defaults.robot.simulation.centre_of_mass_height_m);
  EXPECT_EQ(config.robot.simulation.floor.slope_W, defaults.robot.simulation.floor.slope_W);
  EXPECT_EQ(config.robot.simulation.step, defaults.robot.simulation.step);
  EXPECT_EQ(config.robot.simulation.noise_seed, defaults.robot.simulation.noise_seed);
  EXPECT_TRUE(defaults.path.displacements_B.empty());
}

TEST_F(Session, WhatTheCompensationLearnsIsReportedAndRecorded) {
  constexpr std::array kLoad{1.6, 1.8, 1.7, 1.9};
  constexpr std::size_t kFactor = 20;  // column of wheel 1's
  config = load_config(directory.write(
      "adapt.toml",
      // Forward only: sideways the rollers add their resistance.
      "[compensation]\nadapt = true\nfactors = [1.2, 1.2, 1.2, 1.2]\n\n[[path.leg]]\nforward_m = 0.5\n\n"
      "[simulation]\nloaded_friction_scale = [1.6, 1.8, 1.7, 1.9]\n"));
  options.record_directory = directory.path();
  const Summary summary = run_session(config, options, stop);
  EXPECT_LT(summary.path.worst_m(), 0.02);
  ASSERT_TRUE(summary.learned_factors.has_value());
  const auto base = rows(directory / "base.csv", 41);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(base.front()[kFactor + 6 * i], 1.2);
    EXPECT_NEAR(base.back()[kFactor + 6 * i], (*summary.learned_factors)[i], 0.02) << "later, it slid slowly";
    EXPECT_NEAR((*summary.learned_factors)[i], kLoad[i], 0.05 * kLoad[i]);
  }
  EXPECT_NE(operation::report(summary).find("factors = [1."), std::string::npos)
      << operation::report(summary);
}

TEST_F(Session, AnAdaptationNeedsTheInertiaOfTheBase) {
  try {
    (void)load_config(directory.write(
        "bad.toml", "[controller]\nfeedforward_mass_kg = 0\n\n[compensation]\nadapt = true\n"));
    FAIL();
  } catch (const runtime::ConfigError& error) {
    ASSERT_EQ(error.problems().size(), 1U) << error.what();
    EXPECT_NE(error.problems()[0].find("bad.toml:5: 'compensation.adapt'"), std::string::npos)
        << error.what();
    EXPECT_NE(error.problems()[0].find("feedforward_mass_kg"), std::string::npos) << error.what();
  }
}

TEST_F(Session, ConfigurationMistakesAreAllListedWithTheirLines) {
  const fs::path bad =
      directory.write("bad.toml",
                      "[loop]\nperiod_s = 1\npriorty = 80\n\n[simulation]\nmass_g = 29500\n"
                      "loaded_friction_scale = [1, 2]\n\n[compensation]\nmargin = nan\nenabled = \"yes\"\n");
  try {
    (void)load_config(bad);
    FAIL();
  } catch (const runtime::ConfigError& error) {
    ASSERT_EQ(error.problems().size(), 6U) << error.what();
    const std::vector<std::pair<int, const char*>> expected{{2, "period_s"}, {3, "priority"},
                                                            {6, "mass_kg"},  {7, "loaded_friction_scale"},
                                                            {10, "margin"},  {11, "enabled"}};
    for (std::size_t i = 0; i < expected.size(); ++i) {
      const std::string& problem = error.problems()[i];
      EXPECT_NE(problem.find("bad.toml:" + std::to_string(expected[i].first) + ":"), std::string::npos)
          << problem;
      EXPECT_NE(problem.find(expected[i].second), std::string::npos) << problem;
    }
  }
}

/// Such a base would be enabled and never move.
TEST_F(Session, ACeilingOfZeroOrLessIsRefusedWithItsLine) {
  const std::vector<const char*> keys{"setpoint_m_per_s",  "setpoint_rad_per_s", "force_N",
                                      "moment_Nm",         "wheel_torque_Nm",    "wheel_speed_rad_per_s",
                                      "torque_rate_per_s", "following_error_m",  "following_error_rad"};
  for (const std::string key : keys)
    for (const std::string value : {"0", "-0.0", "-1", "nan", "1e-300", "-inf"}) {
      const std::string refused = "bad.toml:3: 'limits." + key + "'";
      try {
        (void)load_config(directory.write("bad.toml", "# nothing\n[limits]\n" + key + " = " + value + "\n"));
        ADD_FAILURE() << key << " = " << value << " is taken";
      } catch (const runtime::ConfigError& error) {
        ASSERT_EQ(error.problems().size(), 1U) << error.what();
        EXPECT_NE(error.problems()[0].find(refused), std::string::npos) << error.what();
      }
    }
}

}  // namespace session_test
}  // namespace operation
