// Recordings as MCAP: there and back, and files of other writers.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "hal/setup_error.h"
#include "runtime/mcap/convert.h"
#include "runtime/mcap/decimals.h"
#include "runtime/mcap/mcap_file.h"
#include "runtime/mcap/mcap_reader.h"
#include "runtime/mcap/recording_rows.h"
#include "runtime/mcap/recording_writer.h"
#include "runtime/mcap/recover.h"
#include "runtime/mcap/ros_messages.h"
#include "runtime/recording/recording_file.h"
#include "runtime/recording/recording_reader.h"
#include "tests/support/built_paths.h"
#include "tests/support/file_size_limit.h"
#include "tests/support/temporary_directory.h"

namespace mcap_recording_test {

using namespace runtime::mcap;
using runtime::ConfigError;
using runtime::RecordingError;

std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  EXPECT_TRUE(file) << path;
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

/// What there is in an MCAP file.
struct Contents : Visitor {
  std::vector<std::string> topics;
  std::vector<std::string> attachments;
  std::vector<std::uint64_t> times_ns;
  std::vector<JointState> joint_states;
  std::string profile;
  StringMap recording;
  std::uint16_t joint_channel = 0;
  std::uint16_t record_channel = 0;

  explicit Contents(const std::filesystem::path& path) { read_mcap(read_file(path), path.string(), *this); }
  void header(std::string_view text, std::string_view) override { profile = text; }
  void channel(const Channel& channel) override {
    topics.emplace_back(channel.topic);
    if (channel.topic == "/joint_states") joint_channel = channel.id;
    if (channel.topic == "/record") record_channel = channel.id;
  }
  void message(const Message& message) override {
    if (message.channel == joint_channel) joint_states.push_back(read_joint_state(message.data));
    if (message.channel == record_channel) times_ns.push_back(message.log_time_ns);
  }
  void metadata(std::string_view, const StringMap& map) override { recording = map; }
  bool wants_attachments() const override { return true; }
  void attachment(const Attachment& attachment) override {
    attachments.push_back(attachment.name + ": " + attachment.data);
  }
};

/// Whatever reads a file gives an error with all of these parts.
template <typename Call>
void expect_problem(Call call, const std::vector<std::string>& parts) {
  try {
    call();
    ADD_FAILURE() << "no error, expected " << parts.front();
  } catch (const std::exception& error) {
    for (const std::string& part : parts)
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << part << " in: " << error.what();
  }
}

const std::string kBase =
    "# youbot recording v1\n# rig: base\n# started: 2026-11-26T22:03:08Z\n# note: a: b, c\n# rig: again\n"
    "time_s,phase,x_m,wheel_1_position_rad,wheel_1_velocity_rad_per_s,wheel_1_torque_measured_Nm,free\n"
    "0.000000,0,nan,-0.0000604,0.000000,-0.000000,1e-300\n"
    "0.001000,1,0.1,123.4567891,-1.000001,0.999999,0.1\n"
    "0.009000,1,0.25,123.4567892,-1.000002,0.000001,-5\n"
    "0.011500,1,123456789.125,450359962.3704959,0.000003,0.500000,0\n";

struct Conversion : testing::Test {
  support::TemporaryDirectory folder;
  std::filesystem::path csv(const std::string& text) { return folder.write("in.csv", text); }
  /// The text of a recording that was converted to MCAP and back.
  std::string there_and_back(const std::string& text) {
    convert(csv(text), folder / "a.mcap");
    convert(folder / "a.mcap", folder / "b.csv");
    return text_of(folder / "b.csv");
  }
};

TEST_F(Conversion, ThereAndBackGivesTheSameText) { EXPECT_EQ(there_and_back(kBase), kBase); }

TEST_F(Conversion, RandomNumbersComeBackAsTheSameText) {
  std::mt19937_64 random(1);
  std::string text = "# youbot recording v1\ntime_s";
  constexpr int kColumns = 12;
  for (int c = 1; c < kColumns; ++c) text += ",c" + std::to_string(c);
  text += '\n';
  runtime::RecordingFile::Column column;
  for (int row = 0; row < 200; ++row) {
    text += std::to_string(row);
    for (int c = 1; c < kColumns; ++c) {
      const double size = std::pow(10.0, static_cast<double>(random() % 14) - 6);
      const double value = std::uniform_real_distribution<>(-size, size)(random);
      char number[64];
      std::snprintf(number, sizeof number, ",%.*f", c, value);
      text += number;
    }
    text += '\n';
  }
  EXPECT_EQ(there_and_back(text), text);
}

TEST_F(Conversion, AColumnWithoutFixedDecimalsKeepsItsValues) {
  const std::string text =
      "# youbot recording "
      "v1\ntime_s,x\n0,0.1\n1,12345.678901234567\n2,5e-324\n3,inf\n4,1.7976931348623157e+308\n";
  EXPECT_EQ(there_and_back(text), text);
}

TEST_F(Conversion, ATornLastLineIsLeftOutAndReported) {
  EXPECT_EQ(there_and_back(kBase + "0.02"), kBase);
  const Converted converted = convert(csv(kBase + "0.02"), folder / "c.mcap");
  ASSERT_EQ(converted.warnings.size(), 1U);
  EXPECT_NE(converted.warnings[0].find("in.csv:11: the last line is torn"), std::string::npos)
      << converted.warnings[0];
}

TEST_F(Conversion, TimesAndValuesThatNoRecordingHasAreKeptAndReportedWithTheirLine) {
  const std::string text =
      "# youbot recording v1\ntime_s,x\n0.001,0.1\n0.001,0.2\n0.002,-inf\n0.001,0.3\n0.001,inf\n0.000,0.4\n";
  const Converted converted = convert(csv(text), folder / "c.mcap");
  const std::string in = folder / "in.csv";
  EXPECT_EQ(converted.rows, 6U);
  EXPECT_EQ(
      converted.warnings,
      (std::vector<std::string>{in + ":4: time_s = 0.001 is that of the row before", in + ":5: x is infinite",
                                in + ":6: time_s = 0.001 is less than 0.002 in the row before"}));
  EXPECT_EQ(there_and_back(text), text);
}

// The decimals of a column are those of the rows that were there at the beginning.
TEST_F(Conversion, RowsThatAreAppendedMeanwhileAreLeftOut) {
  const auto in = csv("# youbot recording v1\ntime_s,flag\n0.000,0\n0.001,0\n");
  std::vector<std::string> warnings;
  std::vector<double> flags;
  read_csv_rows(in,
                {.head = [&](const RecordingHead&) { std::ofstream(in, std::ios::app) << "0.002,0.25\n"; },
                 .row = [&](std::span<const double> row) { flags.push_back(row[1]); },
                 .warning = [&](const std::string& text) { warnings.push_back(text); }});
  EXPECT_EQ(flags, (std::vector<double>{0, 0}));
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("grows while it is read"), std::string::npos);
}

TEST_F(Conversion, MistakesNameFileAndLine) {
  const auto problem = [&](const std::string& text, const std::string& part) {
    expect_problem([&] { convert(csv(text), folder / "new.mcap"); }, {part});
    EXPECT_FALSE(std::filesystem::exists(folder / "new.mcap.part"));
  };
  problem("time_s,x\n0,1\nnan,2\n", "in.csv:3: time_s is nan");
  problem("time_s,x\n1e300,1\n", "in.csv:2: time_s is 1e+300");
  problem("time_s,my x\n0,1\n", "in.csv:1: column 'my x'");
  problem("time_s,x,x\n0,1,2\n", "in.csv:1: column x is there twice");
  problem("# youbot recording v2\ntime_s,x\n0,1\n", "in.csv:1: this is 'youbot recording v2'");
  problem("", "in.csv: no row of column names");
}

TEST_F(Conversion, AByteOrderMarkIsNoPartOfAName) {
  convert(csv("\xEF\xBB\xBFtime_s,x\n0,1\n"), folder / "a.mcap");
  EXPECT_EQ(runtime::read_recording(folder / "a.mcap").recording.columns[0].name, "time_s");
}

TEST(RecordingStart, IsUtcOrUnknown) {
  const auto start = [](const char* text) { return RecordingHead{{{"started", text}}, {}}.start_ns(); };
  EXPECT_EQ(start("2026-11-26T22:03:08Z"), 1'795'730'588'000'000'000U);
  EXPECT_EQ(start("2026-11-26T22:03:08.25Z"), 1'795'730'588'250'000'000U);
  EXPECT_EQ(start("2026-11-26T22:03:08.1234567891Z"), 1'795'730'588'123'456'789U);
  EXPECT_EQ(start("2026-11-26T22:03:08+01:00"), 0U) << "not UTC";
  EXPECT_EQ(start("2026-11-26T22:03:08.25"), 0U) << "not UTC";
  EXPECT_EQ(start("2026-11-26T22:03:08Z or so"), 0U);
  EXPECT_EQ(start("2700-01-01T00:00:00Z"), 0U) << "does not fit";
  EXPECT_EQ(start(""), 0U);
}

TEST_F(Conversion, HasTopicsTimesMetadataAndConfiguration) {
  folder.write("config.toml", "a = 1\n");
  convert(csv(kBase), folder / "a.mcap");
  const Contents contents(folder / "a.mcap");
  EXPECT_EQ(contents.profile, "ros2");
  EXPECT_EQ(contents.topics, (std::vector<std::string>{"/rows", "/record", "/joint_states"}));
  EXPECT_EQ(contents.attachments, std::vector<std::string>{"config.toml: a = 1\n"});
  EXPECT_EQ(contents.recording.at("rig"), "base");
  constexpr std::uint64_t kStart = 1'795'730'588'000'000'000;  // date --date 2026-11-26T22:03:08Z +%s
  EXPECT_EQ(contents.times_ns, (std::vector<std::uint64_t>{kStart, kStart + 11'500'000}))
      << "at most one in 10 ms";
  ASSERT_EQ(contents.joint_states.size(), 2U) << "at most one in 10 ms";
  EXPECT_EQ(contents.joint_states[1].name, std::vector<std::string>{"wheel_1"});
  EXPECT_EQ(contents.joint_states[1].stamp.sec, 1'795'730'588);
  EXPECT_EQ(contents.joint_states[1].stamp.nanosec, 11'500'000U);
  EXPECT_NEAR(contents.joint_states[1].velocity_rad_per_s.at(0), 0.000003, 5e-7);
  EXPECT_NEAR(contents.joint_states[1].effort_Nm.at(0), 0.5, 5e-7);
}

TEST_F(Conversion, NothingIsReplacedAndNothingIsLeftOfAFailure) {
  const auto in = csv(kBase);
  const auto there = folder.write("there.mcap", "precious");
  EXPECT_THROW(convert(in, there), hal::SetupError);
  EXPECT_EQ(text_of(there), "precious");
  EXPECT_THROW(convert(csv("# youbot recording v1\ntime_s,x\n0,1\n1,one\n"), folder / "new.mcap"),
               ConfigError);
  EXPECT_FALSE(std::filesystem::exists(folder / "new.mcap"));
  EXPECT_THROW(convert(folder.write("bad.mcap", "no MCAP"), folder / "new.csv"), ConfigError);
  EXPECT_FALSE(std::filesystem::exists(folder / "new.csv"));
  EXPECT_THROW(convert(in, folder / "new.txt"), std::invalid_argument);
  expect_problem([&] { convert(csv("a,b\n1,2\n"), folder / "new.mcap"); }, {"in.csv:1", "time_s"});
  expect_problem([&] { convert(csv("time_s,b\n1,2,3\n"), folder / "new.mcap"); }, {"in.csv:2", "2 values"});
}

TEST_F(Conversion, AFileOfNumbersWithTooManyColumnsIsRefused) {
  std::string names = "time_s";
  for (std::size_t i = 1; i <= runtime::kMaxRecordingColumns; ++i) names += ",c" + std::to_string(i);
  expect_problem([&] { convert(csv(names + "\n"), folder / "new.mcap"); }, {"more than 1000 columns"});
}

TEST(Decimals, TheStoredDoubleStandsForTheSameNumberAndHasFewBits) {
  for (int decimals = 0; decimals <= runtime::RecordingFile::kMaxDecimals; ++decimals) {
    const double unit = std::pow(10.0, -decimals);
    for (const double count : {0.0, 1.0, -3.0, 7.0, 999'999.0, -12'345'678.0}) {
      const double value = count / std::pow(10.0, decimals);
      const double stored = rounded_to_binary(value, decimals);
      EXPECT_LT(std::abs(stored - value), 0.5 * unit);
      EXPECT_EQ(in_half_units(stored, decimals), in_half_units(value, decimals)) << decimals << " " << count;
      const double steps = stored * std::exp2(std::ceil(std::log2(1 / unit)) + 1);
      EXPECT_EQ(steps, std::nearbyint(steps)) << "a multiple of a power of two near the last decimal";
    }
  }
  EXPECT_TRUE(std::isnan(rounded_to_binary(std::nan(""), 3)));
  EXPECT_TRUE(std::signbit(rounded_to_binary(-0.0, 3)));
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(rounded_to_binary(infinity, 3), infinity);
}

// The text of the number, with that many decimals, is the judge.
TEST(Decimals, HalfUnitsAreTheNumberThatTheTextHas) {
  EXPECT_EQ(in_half_units(0.123457, 6), 246914);
  EXPECT_EQ(in_half_units(-1.5, 0), -4) << "printf rounds this half to even";
  EXPECT_EQ(in_half_units(-0.0000001, 6), -1) << "the text is -0.000000";
  EXPECT_EQ(in_half_units(0.0, 6), 0);
  EXPECT_FALSE(in_half_units(std::nan(""), 6));
  EXPECT_FALSE(in_half_units(std::numeric_limits<double>::infinity(), 6));
  EXPECT_FALSE(in_half_units(1e12, 6)) << "too large to be certain of the last digit";
  EXPECT_TRUE(std::signbit(from_half_units(-1, 6)));
  EXPECT_EQ(from_half_units(246914, 6), 0.123457);
  std::mt19937_64 random(2);
  for (int i = 0; i < 20'000; ++i) {
    const int decimals = static_cast<int>(random() % 10);
    double value = std::uniform_real_distribution<>(-1000, 1000)(random);
    if (i % 3 == 0) value = std::nearbyint(value * 8) / 8;                                   // exact ties
    if (i % 3 == 1) value = std::nextafter((std::floor(value * 1000) + 0.5) / 1000, value);  // and nearly
    char text[64];
    std::snprintf(text, sizeof text, "%.*f", decimals, value);
    const auto half_units = in_half_units(value, decimals);
    ASSERT_TRUE(half_units);
    EXPECT_EQ(from_half_units(*half_units, decimals), std::strtod(text, nullptr)) << text;
  }
}

TEST_F(Conversion, TheRecordingReaderGetsTheSameRecording) {
  const std::string text =
      "# youbot recording v1\n# rig: wheel-1\n# experiment: staircase\n# sample_rate_Hz: 1000\n"
      "time_s,torque_command_Nm,position_rad,mood\n0.000,0.01,1.5,1\n0.001,-0.02,0.125,2\n";
  convert(csv(text), folder / "a.mcap");
  const auto a = runtime::read_recording(folder / "in.csv");
  const auto b = runtime::read_recording(folder / "a.mcap");
  EXPECT_EQ(b.recording.rig, "wheel-1");
  EXPECT_EQ(b.recording.experiment, "staircase");
  EXPECT_EQ(b.recording.sample_rate_Hz, 1000);
  EXPECT_EQ(b.recording.comments, a.recording.comments);
  ASSERT_EQ(b.recording.columns.size(), a.recording.columns.size());
  for (std::size_t i = 0; i < a.recording.columns.size(); ++i) {
    EXPECT_EQ(b.recording.columns[i].name, a.recording.columns[i].name);
    EXPECT_EQ(b.recording.columns[i].values, a.recording.columns[i].values);
  }
  EXPECT_EQ(b.warnings.size(), a.warnings.size()) << "the unknown column";
}

TEST_F(Conversion, TheRecordingReaderChecksRowsOfMcapAsThoseOfCsv) {
  const auto read = [&](const std::string& text) {
    std::filesystem::remove(folder / "a.mcap");
    convert(csv(text), folder / "a.mcap");
    return runtime::read_recording(folder / "a.mcap", runtime::NotMeasured::kTaken);
  };
  expect_problem([&] { read("time_s,position_rad\n0,1\n1,nan\n"); }, {"a.mcap:2", "position_rad 'nan'"});
  expect_problem([&] { read("time_s,position_rad\n0,1\n0,2\n"); }, {"a.mcap:2", "time_s repeats 0"});
  expect_problem([&] { read("time_s,position_deg\n0,1\n"); }, {"position_deg", "must be position_rad"});
  expect_problem([&] { read("time_s,position_rad\n"); }, {"no rows"});
  const auto declared = read("# not_measured: position_rad: it never moved\ntime_s,position_rad\n0,nan\n");
  ASSERT_EQ(declared.warnings.size(), 1U);
  EXPECT_TRUE(std::isnan(declared.recording.column("position_rad")[0]));
}

TEST_F(Conversion, OnlyOneOfTheSameRecordingInBothFormatsCounts) {
  const auto in = csv(kBase);
  convert(in, folder / "in.mcap");
  EXPECT_TRUE(runtime::is_recording(in));
  EXPECT_FALSE(runtime::is_recording(folder / "in.mcap"));
  std::filesystem::remove(in);
  EXPECT_TRUE(runtime::is_recording(folder / "in.mcap"));
  EXPECT_FALSE(runtime::is_recording(folder / "report.html"));
}

using runtime::RecordingFile;

const std::vector<RecordingFile::Column> kWheels{{"time_s", 3},
                                                 {"phase", 0},
                                                 {"wheel_1_torque_measured_Nm", 6},
                                                 {"wheel_1_position_rad", 7},
                                                 {"wheel_1_reported_velocity_rad_per_s", 6},
                                                 {"wheel_2_position_rad", 7}};
std::array<double, 6> wheels(int i) { return {0.001 * i, 1, 0.125 * i, 0.5 * i, 7, -0.5 * i}; }

struct RecordingAsMcap : testing::Test {
  support::TemporaryDirectory folder;
  std::filesystem::path path() const { return folder / "run.mcap"; }
  std::vector<double> times_s() const {
    const runtime::ReadRecording read = runtime::read_recording(path());
    const auto time = read.recording.column("time_s");
    return {time.begin(), time.end()};
  }
};

TEST_F(RecordingAsMcap, IsTheRecordingThatCsvIs) {
  const std::vector<RecordingFile::Comment> comments{{"rig", "base"},
                                                     {"started", "2026-11-26T22:03:08.250Z"}};
  RecordingFile mcap(path(), comments, kWheels, RecordingFile::Existing::kRefuse, {{"config.toml", "a = 1"}});
  RecordingFile csv(folder / "run.csv", comments, kWheels);
  for (int i = 0; i < 2500; ++i) {
    auto row = wheels(i);
    if (i > 700 && i < 1300) row[2] = std::nan("");  // within blocks and in all of one
    if (i == 1400) row[3] = std::numeric_limits<double>::infinity();
    if (i == 1500) row[4] = 1e300;
    if (i % 2 == 0) row[5] = -0.0;
    mcap.append_row(row);
    csv.append_row(row);
  }
  mcap.close();
  csv.close();
  EXPECT_EQ(mcap.rows_written(), 2500U);
  EXPECT_EQ(mcap.error(), "");
  convert(path(), folder / "again.csv");
  EXPECT_EQ(text_of(folder / "again.csv"), text_of(folder / "run.csv"));
  const Contents contents(path());
  EXPECT_EQ(contents.attachments, std::vector<std::string>{"config.toml: a = 1"});
  EXPECT_EQ(contents.times_ns.size(), 250U);
  EXPECT_EQ(contents.times_ns[1], 1'795'730'588'260'000'000U);
}

TEST_F(RecordingAsMcap, AJointIsReadAloneByEitherSpelling) {
  {
    RecordingFile file(path(), {{"rig", "base"}}, kWheels);
    for (int i = 0; i < 3; ++i) file.append_row(wheels(i));
  }
  for (const char* joint : {"wheel_1", "wheel-1"}) {
    const auto recording = runtime::read_recording(path(), {.joint = joint}).recording;
    EXPECT_EQ(recording.rig, "wheel-1");
    ASSERT_EQ(recording.columns.size(), 3U) << "those of the recording contract";
    EXPECT_EQ(recording.column("torque_measured_Nm")[2], 0.25);
    EXPECT_EQ(recording.column("position_rad")[2], 1);
  }
  EXPECT_EQ(runtime::read_recording(path()).recording.columns.size(), kWheels.size());
  expect_problem([&] { runtime::read_recording(path(), {.joint = "arm_1"}); },
                 {"'arm_1'", "wheel_1, wheel_2"});
  expect_problem([&] { runtime::read_recording(path(), {.one_drive = true}); },
                 {"wheel_1, wheel_2", "--joint"});
  convert(path(), folder / "w.csv", "wheel_2");
  EXPECT_EQ(text_of(folder / "w.csv"),
            "# youbot recording v1\n# rig: wheel-2\ntime_s,position_rad\n"
            "0.000,-0.0000000\n0.001,-0.5000000\n0.002,-1.0000000\n");
}

/// The program is killed in the middle; what it flushed is there, to the last row.
TEST_F(RecordingAsMcap, AKilledProgramLeavesWhatItFlushed) {
  const pid_t child = fork();
  if (child == 0) {
    RecordingFile file(path(), {{"rig", "base"}}, kWheels);
    for (int i = 0; i < 1230; ++i) {
      file.append_row(wheels(i));
      if (i % 50 == 49) file.flush();
    }
    raise(SIGKILL);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status));
  const auto read = runtime::read_recording(path());
  EXPECT_EQ(read.recording.rows(), 1200U);
  const auto is_reported = [](const std::string& warning) {
    return warning.find("run.mcap: byte ") != warning.npos &&
           warning.find("youbotctl recover") != warning.npos;
  };
  EXPECT_TRUE(std::ranges::any_of(read.warnings, is_reported));
  recover(path(), folder / "whole.mcap");
  const auto whole = runtime::read_recording(folder / "whole.mcap");
  EXPECT_EQ(whole.recording.rows(), 1200U);
  EXPECT_TRUE(std::ranges::none_of(whole.warnings, is_reported));
}

/// A program reads the file of another one that still writes it.
TEST_F(RecordingAsMcap, IsReadWhileItIsWritten) {
  RecordingFile file(path(), {{"rig", "base"}}, kWheels);
  for (int i = 0; i < 10; ++i) file.append_row(wheels(i));
  file.flush();
  file.append_row(wheels(10));
  EXPECT_EQ(times_s().size(), 10U);
  file.close();
  EXPECT_EQ(times_s().size(), 11U);
}

TEST_F(RecordingAsMcap, GoesOnWithWholeChunksWhenTheDiskHasRoomAgain) {
  RecordingFile file(path(), {{"rig", "base"}}, kWheels);
  const auto flush_rows = [&](int from) {
    for (int i = from; i < from + 50; ++i) file.append_row(wheels(i));
    file.flush();
  };
  flush_rows(0);
  {
    // The next chunk reaches the disk in part.
    const support::FileSizeLimit full(std::filesystem::file_size(path()) + 100);
    flush_rows(50);
  }
  flush_rows(100);
  file.close();
  EXPECT_EQ(file.rows_written(), 100U);
  EXPECT_EQ(file.rows_lost(), 50U);
  EXPECT_NE(file.error().find("File too large"), std::string::npos) << file.error();
  const std::vector<double> times = times_s();
  ASSERT_EQ(times.size(), 100U);
  EXPECT_EQ(times[49], 0.049);
  EXPECT_EQ(times[50], 0.1);
  // Index and statistics are those of the chunks that are there.
  const Recovered whole = recover(path(), folder / "whole.mcap");
  EXPECT_TRUE(whole.complete());
  EXPECT_EQ(whole.messages, 2U + 10U + 10U) << "of rows, record and joint states";
}

TEST_F(RecordingAsMcap, AFullBlockIsWritten) {
  RecordingFile file(path(), {{"rig", "base"}}, kWheels);
  for (int i = 0; i < 1000; ++i) file.append_row(wheels(i));
  EXPECT_EQ(file.rows_written(), 0U);
  file.append_row(wheels(1000));
  EXPECT_EQ(file.rows_written(), 1000U);
  EXPECT_EQ(times_s().size(), 1000U) << "a reader finds them";
}

TEST_F(RecordingAsMcap, ARowWithoutATimeIsCountedAsLost) {
  RecordingFile file(path(), {{"rig", "base"}}, kWheels);
  auto row = wheels(1);
  row[0] = std::nan("");
  file.append_row(row);
  file.append_row(wheels(2));
  file.close();
  EXPECT_EQ(file.rows_written(), 1U);
  EXPECT_EQ(file.rows_lost(), 1U);
  EXPECT_THROW(RecordingFile(folder / "no_time.mcap", {}, {{"x", 1}}), std::invalid_argument);
}

/// Written by @mcap/core, without chunks and summary.
const std::filesystem::path kForeign = support::source_dir() + "/tests/data/mcap/joint_states.mcap";

TEST(FilesOfOthers, AJointIsReadByItsName) {
  const auto read = runtime::read_recording(kForeign, {.joint = "wheel_2"});
  EXPECT_EQ(read.recording.rig, "wheel_2");
  const auto& recording = read.recording;
  ASSERT_EQ(recording.rows(), 3U);
  EXPECT_FALSE(recording.has("velocity_rad_per_s")) << "no message has any";
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(recording.column("time_s")[i], 0.001 * static_cast<double>(i), 1e-12);
    EXPECT_EQ(recording.column("position_rad")[i], -2);
    EXPECT_EQ(recording.column("torque_measured_Nm")[i], 1e-3 * static_cast<double>(i));
  }
}

TEST(FilesOfOthers, SeveralJointsAreListedWithoutAChoice) {
  expect_problem([] { runtime::read_recording(kForeign); },
                 {"joint_states.mcap", "a, wheel_2", "choose one"});
  expect_problem([] { runtime::read_recording(kForeign, {.joint = "elbow"}); }, {"'elbow'", "a, wheel_2"});
}

TEST_F(Conversion, AllJointsOfOthersBecomeColumns) {
  convert(kForeign, folder / "out.csv");
  EXPECT_EQ(text_of(folder / "out.csv"),
            "# youbot recording v1\n# converted_from: /joint_states, written by other\n"
            "time_s,a_position_rad,a_torque_measured_Nm,wheel_2_position_rad,wheel_2_torque_measured_Nm\n"
            "0,1.5,0.25,-2,0\n0.001,2.5,0.25,-2,0.001\n0.002,3.5,0.25,-2,0.002\n");
}

/// Joint states of two channels on one topic, at 0 and 10 ms by their stamps, logged at another time.
TEST(FilesOfOthers, ChannelsOfOneTopicAreOneAndAStampMayBeZero) {
  std::string file;
  McapWriter writer([&file](std::string_view part) { file += part; }, {.library = "test"});
  const std::uint16_t schema = writer.add_schema(kJointStateType, "ros2msg", kJointStateDefinition);
  for (std::uint32_t i = 0; i < 4; ++i) {
    const std::uint16_t channel =
        writer.add_channel(schema, "/joint_states", "cdr", {{"publisher", std::to_string(i % 2)}});
    const JointState state{{0, i / 2 * 10'000'000}, "", {i % 2 == 0 ? "a" : "b"}, {1.0 * i}, {}, {2}};
    CdrWriter cdr;
    write(cdr, state);
    const std::uint64_t logged_ns = 1'700'000'000'000'000'000 + i;
    writer.add_message({channel, 0, logged_ns, logged_ns, cdr.payload()});
  }
  writer.finish();
  for (const char* joint : {"a", "b"}) {
    const auto recording = runtime::parse_mcap_recording(file, "f.mcap", {.joint = joint}).recording;
    ASSERT_EQ(recording.rows(), 2U) << joint;
    EXPECT_EQ(recording.column("time_s")[0], 0);
    EXPECT_EQ(recording.column("time_s")[1], 0.01);
  }
}

/// A file in memory with messages of JointState; a joint state for each name of a message.
std::string joint_file(const std::vector<std::pair<std::string, std::vector<std::string>>>& messages,
                       Compression compression) {
  std::string file;
  McapWriter writer([&file](std::string_view part) { file += part; },
                    {.library = "test", .compression = compression});
  const std::uint16_t schema = writer.add_schema(kJointStateType, "ros2msg", kJointStateDefinition);
  std::map<std::string, std::uint16_t> channels;
  std::uint64_t time_ns = 0;
  for (const auto& [topic, names] : messages) {
    if (!channels.contains(topic)) channels[topic] = writer.add_channel(schema, topic, "cdr", {});
    JointState state;
    state.name = names;
    state.position_rad.assign(names.size(), 1);
    state.effort_Nm.assign(names.size(), 2);
    CdrWriter cdr;
    write(cdr, state);
    writer.add_message({channels[topic], 0, time_ns, time_ns, cdr.payload()});
    time_ns += 1'000'000;
  }
  writer.finish();
  return file;
}

TEST(FilesOfOthers, EachCompressionIsRead) {
  for (const Compression compression : {Compression::kNone, Compression::kLz4, Compression::kZstd}) {
    const std::string file = joint_file(
        std::vector<std::pair<std::string, std::vector<std::string>>>(500, {"/joints", {"a"}}), compression);
    EXPECT_EQ(runtime::parse_mcap_recording(file, "f.mcap").recording.rows(), 500U);
    EXPECT_EQ(file.size() < 30000, compression != Compression::kNone) << file.size();
  }
}

TEST(FilesOfOthers, PublishersThatShareATopicAreKeptApart) {
  const std::string file = joint_file(
      {{"/joint_states", {"a"}}, {"/joint_states", {"b"}}, {"/joint_states", {"a"}}}, Compression::kZstd);
  EXPECT_EQ(runtime::parse_mcap_recording(file, "f.mcap", {.joint = "a"}).recording.rows(), 2U);
  EXPECT_EQ(runtime::parse_mcap_recording(file, "f.mcap", {.joint = "b"}).recording.rows(), 1U);
}

TEST(FilesOfOthers, OfSeveralTopicsTheUsualOneIsRead) {
  EXPECT_EQ(
      runtime::parse_mcap_recording(
          joint_file({{"/goal", {"a"}}, {"/joint_states", {"a"}}, {"/goal", {"a"}}}, Compression::kNone),
          "f.mcap")
          .recording.rows(),
      1U);
  expect_problem(
      [] {
        runtime::parse_mcap_recording(joint_file({{"/goal", {"a"}}, {"/real", {"a"}}}, Compression::kNone),
                                      "f.mcap");
      },
      {"/goal, /real"});
  expect_problem([] { runtime::parse_mcap_recording(joint_file({}, Compression::kNone), "f.mcap"); },
                 {"neither a recording"});
}

TEST(FilesOfOthers, MoreThan300JointNamesAreRefused) {
  std::vector<std::string> names;
  for (int i = 0; i < 300; ++i) names.push_back("j" + std::to_string(i));
  const auto read = [&] {
    return runtime::parse_mcap_recording(joint_file({{"/joint_states", names}}, Compression::kNone), "f.mcap",
                                         {.joint = "j7"});
  };
  EXPECT_EQ(read().recording.rows(), 1U);
  names.emplace_back("one more");
  expect_problem(read, {"more than 300 joint names"});
}

}  // namespace mcap_recording_test
