// The strict reader of recordings: for any file, a usable recording or the reason for the rejection.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "runtime/recording/recording_file.h"
#include "runtime/recording/recording_reader.h"
#include "tests/support/processor_time.h"
#include "tests/support/temporary_directory.h"

namespace recording_reader_test {

using runtime::parse_recording;
using runtime::RecordingError;

const std::string kHead =
    "# youbot recording v1\n# rig: wheel-1\n# experiment: staircase\n# sample_rate_Hz: 1000\n";
const std::string kValid = kHead +
                           "time_s,torque_command_Nm,position_rad\n"
                           "0.000,0.01,1.5\n"
                           "0.001,-0.02,1.25e-1\n";

const std::string kMapIt =
    "; a column map says which column is what, in which unit: youbot-gap --columns MAP, or youbotctl convert "
    "TABLE OUT --columns MAP";

/// All problems in one text; "" when there are none.
std::string problems(const std::string& text) {
  try {
    parse_recording(text, "f.csv");
    return "";
  } catch (const RecordingError& error) {
    return error.what();
  }
}
void expect_problem(const std::string& text, const std::string& part) {
  const std::string all = problems(text);
  EXPECT_NE(all.find(part), std::string::npos) << "expected '" << part << "' in: " << all;
}

TEST(RecordingReader, ReadsColumnsAndWhatIsSaidOfThem) {
  const auto read = parse_recording(kValid, "f.csv");
  EXPECT_TRUE(read.warnings.empty());
  EXPECT_EQ(read.recording.rig, "wheel-1");
  EXPECT_EQ(read.recording.experiment, "staircase");
  EXPECT_EQ(read.recording.sample_rate_Hz, 1000);
  EXPECT_EQ(read.recording.comments.size(), 3u);
  ASSERT_EQ(read.recording.rows(), 2u);
  EXPECT_EQ(read.recording.column("position_rad")[1], 0.125);
  EXPECT_EQ(read.recording.column("torque_command_Nm")[1], -0.02);
  EXPECT_FALSE(read.recording.has("velocity_rad_per_s"));
  EXPECT_THROW(static_cast<void>(read.recording.column("velocity_rad_per_s")), std::invalid_argument);
}

TEST(RecordingReader, TakesAnyOrderCarriageReturnsBlanksAndAByteOrderMark) {
  const auto read = parse_recording(
      "\xEF\xBB\xBF# youbot recording v1\r\n# a remark\r\n position_rad , time_s\r\n 1.5 , "
      "0\r\n2,\t0.5\r\n\r\n",
      "f.csv");
  EXPECT_TRUE(read.warnings.empty());
  EXPECT_EQ(read.recording.column("time_s")[1], 0.5);
  EXPECT_EQ(read.recording.column("position_rad")[0], 1.5);
}

TEST(RecordingReader, KeepsUnknownColumnsAndSaysSo) {
  const auto read = parse_recording(kHead + "time_s,mood,wake_up_us\n0,1,2\n", "f.csv");
  ASSERT_EQ(read.warnings.size(), 2u);
  EXPECT_EQ(read.warnings[0], "f.csv:5: column 'mood' is not part of the format; kept as it is");
  EXPECT_EQ(read.recording.column("mood")[0], 1);
}

TEST(RecordingReader, LeavesOutATornLastLineAndSaysSo) {
  const auto read = parse_recording(kValid + "0.002,0.0", "f.csv");
  EXPECT_EQ(read.recording.rows(), 2u);
  ASSERT_EQ(read.warnings.size(), 1u);
  EXPECT_NE(read.warnings[0].find("f.csv:8: the last line is torn"), std::string::npos);
}

TEST(RecordingReader, EveryPrefixIsReadOrRefusedAndNeverMore) {
  for (std::size_t length = 0; length < kValid.size(); ++length) {
    try {
      const auto read = parse_recording(kValid.substr(0, length), "f.csv");
      EXPECT_EQ(read.recording.rows(), 1u) << length;
      for (const auto& column : read.recording.columns) EXPECT_EQ(column.values.size(), 1u) << length;
      EXPECT_EQ(read.recording.column("position_rad")[0], 1.5);
    } catch (const RecordingError& error) {
      EXPECT_LE(error.problems().size(), 2u) << error.what();
    }
  }
}

TEST(RecordingReader, SaysWhatAColumnWithAnotherUnitMustBe) {
  for (const auto& [wrong, right] : std::vector<std::pair<std::string, std::string>>{
           {"position_deg", "position_rad"},
           {"torque_measured_mNm", "torque_measured_Nm"},
           {"torque_measured_nm", "torque_measured_Nm"},
           {"velocity_rpm", "velocity_rad_per_s"},
           {"velocity_rad_s", "velocity_rad_per_s"},
           {"velocity_command_deg_per_s", "velocity_command_rad_per_s"},
           {"position_command", "position_command_rad"},
           {"current_mA", "current_A"},
           {"temperature_K", "temperature_C"}}) {
    expect_problem("# youbot recording v1\ntime_s," + wrong + "\n0,1\n",
                   "f.csv:2: column '" + wrong + "' must be " + right);
  }
  expect_problem("# youbot recording v1\ntime_ms,position_rad\n0,1\n", "column 'time_ms' must be time_s");
}

TEST(RecordingReader, RefusesWithFileLineAndRemedy) {
  expect_problem("", "f.csv: the file is empty");
  expect_problem(kHead, "no row of column names");
  expect_problem(kHead + "time_s,position_rad\n", "no data rows");
  EXPECT_EQ(problems("# Some text\n\nabout, something\nelse\n"),
            "f.csv:3: this is not a recording: neither its first line nor any column name is known" + kMapIt);
  expect_problem(kHead + "0,1\n1,2\n", "f.csv:5: data begin here, but no row of column names");
  expect_problem(kHead + "position_rad\n1\n", "column time_s is missing");
  expect_problem(kHead + "time_s,time_s\n0,1\n", "is there twice");
  expect_problem(kHead + "time_s,,position_rad\n0,1,2\n", "column 2 has no name");
  expect_problem(kHead + "time_s,position_rad\n0,1\n1\n", "f.csv:7: 1 values for 2 columns");
  expect_problem(kHead + "time_s,position_rad\n0,1\n1,nan\n",
                 "f.csv:7: position_rad 'nan' is not a finite number");
  expect_problem(kHead + "time_s,position_rad\n0,-inf\n", "not a finite number");
  expect_problem(kHead + "time_s,position_rad\n0,1e999\n", "position_rad '1e999'");
  expect_problem(kHead + "time_s,position_rad\n0,\n", "position_rad is empty");
  expect_problem(kHead + "time_s,position_rad\n0,1x\n", "'1x' is not a number");
  expect_problem(kHead + "time_s,position_rad\n0,1\n0,2\n", "f.csv:7: time_s repeats 0");
  expect_problem(kHead + "time_s,position_rad\n0.5,1\n0.25,2\n", "time_s runs backward, from 0.5 to 0.25");
  expect_problem(kHead + "time_s,position_rad\n0,001,0,5\n", "decimal commas");
  expect_problem(kHead + "time_s,position_rad\n0;1\n", "decimal commas");
  expect_problem("# youbot recording v2\ntime_s\n0\n", "f.csv:1: 'youbot recording v2'");
  expect_problem("# youbot recording v1\n# sample_rate_Hz: fast\ntime_s\n0\n",
                 "f.csv:2: sample_rate_Hz is 'fast'");
}

TEST(RecordingReader, NamesAnotherSeparatorAndTheRemedy) {
  EXPECT_EQ(problems(kHead + "time_s;position_rad\n0,5;1,5\n"),
            "f.csv:5: columns are separated by ';', not by commas, and the decimal point is a comma; export "
            "with ',' between and '.' as decimal point, or read the table with a column map that has decimal "
            "= \",\": youbot-gap --columns MAP, or youbotctl convert TABLE OUT --columns MAP");
  EXPECT_EQ(
      problems(kHead + "time_s\tposition_rad\n0.5\t1.5\n"),
      "f.csv:5: columns are separated by tabs, not by commas; export with ',' between and '.' as decimal "
      "point, or read the table with a column map: youbot-gap --columns MAP, or youbotctl convert TABLE "
      "OUT --columns MAP");
  const std::string export_it = ", not by commas; export with ',' between and '.' as decimal point";
  EXPECT_EQ(problems(kHead + "time_s|position_rad\n0|1\n"),
            "f.csv:5: columns are separated by '|'" + export_it);
  EXPECT_EQ(problems("time_s position_rad\n0 1\n"), "f.csv:1: columns are separated by blanks" + export_it);
  expect_problem("about something\nelse\n", "this is not a recording");
  expect_problem(kHead + "Zeit;Winkel\n0;1\n", "columns are separated by ';'");
}

TEST(RecordingReader, NamesTheColumnThatAMissingOneMayBe) {
  EXPECT_EQ(problems(kHead + "Time_s,position_rad\n0,1\n"),
            "f.csv:5: column 'Time_s' must be time_s, in this case: rename it, or name it in a column map: "
            "youbot-gap --columns MAP, or youbotctl convert TABLE OUT --columns MAP");
  expect_problem(kHead + "time_s,Position_Rad\n0,1\n",
                 "column 'Position_Rad' must be position_rad, in this case");
  for (const std::string name : {"t", "T", "Time", "Timestamp", "t_ms", "elapsed_s"})
    EXPECT_EQ(problems(kHead + name + ",q\n0,1\n"),
              "f.csv:5: column time_s is missing; every recording needs it. If it is '" + name +
                  "' and in seconds, rename it" + kMapIt);
  EXPECT_EQ(
      problems("t,q,qd,tau\n0,1,2,3\n"),
      "f.csv:1: column time_s is missing; every recording needs it. If it is 't' and in seconds, rename "
      "it" +
          kMapIt);
  expect_problem(kHead + "x,position_rad\n0,1\n",
                 "column time_s is missing; every recording needs it" + kMapIt);
  for (const auto& [name, likely] :
       std::vector<std::pair<std::string, std::string>>{{"q", "position_rad"},
                                                        {"theta_deg", "position_rad"},
                                                        {"qd", "velocity_rad_per_s"},
                                                        {"Velocity", "velocity_rad_per_s"},
                                                        {"tau", "torque_measured_Nm"}}) {
    const auto warnings = parse_recording(kHead + "time_s," + name + "\n0,1\n", "f.csv").warnings;
    ASSERT_EQ(warnings.size(), 1u) << name;
    EXPECT_EQ(warnings[0], "f.csv:5: column '" + name +
                               "' is not part of the format; kept as it is. If it is " + likely +
                               ", rename it" + kMapIt);
  }
  const auto both = parse_recording(kHead + "time_s,t,position_rad,q\n0,1,2,3\n", "f.csv");
  EXPECT_EQ(both.warnings.size(), 2u);
  EXPECT_EQ(both.warnings[1], "f.csv:5: column 'q' is not part of the format; kept as it is");
}

/// Rows `period_s` apart with times of two decimals.
std::string rounded_rows(double period_s, double first_s = 0) {
  std::string text = "time_s,position_rad\n";
  char row[64];
  for (int i = 0; i < 500; ++i)
    text.append(row, static_cast<std::size_t>(
                         std::snprintf(row, sizeof row, "%.2f,%d\n", first_s + i * period_s, i)));
  return text;
}
const std::string kTitle = "# youbot recording v1\n";

TEST(RecordingReader, TimesWithTooFewDecimalsAreNamedAsRounded) {
  EXPECT_EQ(
      problems(kTitle + rounded_rows(1e-3)),
      "f.csv: time_s is the same as in the row before in 449 rows, because it is rounded to 0.01 s while "
      "rows are 0.001 s apart; export it with more decimals or, if the rows come at an even rate, state it "
      "above the column names of a CSV file: # sample_rate_Hz: 1000");
  // Also at a rate that is no divisor of the rounding, and in seconds since 1970.
  expect_problem(kTitle + rounded_rows(0.007), "is rounded to 0.01 s while rows are 0.007 s apart");
  expect_problem(kTitle + rounded_rows(1e-3, 1.7e9), "sample_rate_Hz: 1000");
  expect_problem(kTitle + "# sample_rate_Hz: 500\n" + rounded_rows(1e-3),
                 "which is 1000 Hz, not the stated sample_rate_Hz of 500; correct one of them");
}

TEST(RecordingReader, AStatedRateGivesRoundedTimesBack) {
  for (const double first_s : {0.0, 1.7e9}) {
    const auto read =
        parse_recording(kTitle + "# sample_rate_Hz: 1000\n" + rounded_rows(1e-3, first_s), "f.csv");
    ASSERT_EQ(read.recording.rows(), 500U);
    ASSERT_EQ(read.warnings.size(), 1U);
    EXPECT_NE(read.warnings[0].find("as sample_rate_Hz is stated, rows are taken as even, at 1000 Hz"),
              std::string::npos)
        << read.warnings[0];
    const auto time_s = read.recording.column("time_s");
    for (std::size_t i = 1; i < 500; ++i) ASSERT_NEAR(time_s[i] - time_s[i - 1], 1e-3, 2e-6);
  }
}

TEST(RecordingReader, TimesThatRepeatForAnotherReasonAreNotCalledRounded) {
  // Each row twice.
  std::string twice = kTitle + "# sample_rate_Hz: 1000\ntime_s,position_rad\n";
  for (int i = 0; i < 100; ++i)
    for (int copy = 0; copy < 2; ++copy) twice += std::to_string(0.001 * i) + "," + std::to_string(i) + "\n";
  expect_problem(twice, "f.csv:5: time_s repeats 0; split the file there or delete the line");
  // A time that stops and goes on is not even.
  std::string stops = kTitle + "# sample_rate_Hz: 1000\ntime_s,position_rad\n";
  for (int i = 0; i < 500; ++i)
    stops += std::to_string(i < 300   ? 0.001 * i
                            : i < 450 ? 0.3
                                      : 0.001 * (i - 150)) +
             "," + std::to_string(i) + "\n";
  EXPECT_EQ(problems(stops).find("as sample_rate_Hz is stated"), std::string::npos);
  EXPECT_NE(problems(stops), "");
}

TEST(RecordingReader, ListsTheFirstTenProblemsAndCountsTheRest) {
  std::string text = kHead + "time_s,position_deg\n";
  for (int i = 0; i < 50; ++i) text += "0,1\n";
  try {
    parse_recording(text, "f.csv");
    FAIL();
  } catch (const RecordingError& error) {
    ASSERT_EQ(error.problems().size(), 11u);
    EXPECT_EQ(error.problems()[10], "f.csv: and 40 more problems");
  }
}

TEST(RecordingReader, ReadsWhatTheRecorderWrites) {
  const support::TemporaryDirectory directory;
  const auto path = directory / "run.csv";
  {
    runtime::RecordingFile file(path, {{"rig", "wheel-2"}}, {{"time_s", 6}, {"position_rad"}});
    for (int i = 0; i < 100; ++i) file.append_row(std::vector{i * 1e-3, 0.1 * i});
  }
  const auto read = runtime::read_recording(path);
  EXPECT_EQ(read.recording.rows(), 100u);
  EXPECT_EQ(read.recording.column("position_rad")[7], 0.1 * 7);
  EXPECT_TRUE(read.warnings.empty());
  std::filesystem::remove(path);
  EXPECT_THROW(runtime::read_recording(path), RecordingError);
  EXPECT_THROW(runtime::read_recording(directory.path()), RecordingError);
}

TEST(RecordingReader, ReadsAMillionRowsWellWithinASecondOrTwo) {
  std::string text = kHead + "time_s,torque_command_Nm,torque_measured_Nm,position_rad\n";
  constexpr int kRows = 1'000'000;
  char row[96];
  for (int i = 0; i < kRows; ++i) {
    const int length =
        std::snprintf(row, sizeof row, "%d.%03d,0.012345,-0.0%06d,1.%07d\n", i / 1000, i % 1000, i, i);
    text.append(row, static_cast<std::size_t>(length));
  }
  const auto start = support::processor_time();
  const auto read = parse_recording(text, "f.csv");
  const std::chrono::duration<double> took = support::processor_time() - start;
  EXPECT_EQ(read.recording.rows(), static_cast<std::size_t>(kRows));
  RecordProperty("milliseconds", static_cast<int>(1e3 * took.count()));
  std::printf("read 1 M rows of 4 columns in %.0f ms\n", 1e3 * took.count());
  EXPECT_LT(took.count(), 20);  // under a sanitizer
}

TEST(RecordingReader, AFileIsUpTo2GibibytesLong) {
  const support::TemporaryDirectory directory;
  const std::filesystem::path path = directory.write("f.csv", kValid);
  std::filesystem::resize_file(path, (std::uintmax_t{2} << 30) + 1);  // takes no room on the disk
  try {
    (void)runtime::read_recording(path);
    FAIL() << "read";
  } catch (const RecordingError& error) {
    EXPECT_EQ(std::string(error.what()),
              path.string() + ": has 2147483649 bytes, but at most 2147483648 are read; split it");
  }
}

TEST(RecordingReader, AFileHasUpToAThousandColumns) {
  const auto columns = [](int count) {
    std::string names = "time_s";
    std::string row = "0";
    for (int i = 1; i < count; ++i) {
      names += ",x" + std::to_string(i);
      row += ",0";
    }
    return kHead + names + "\n" + row + "\n";
  };
  EXPECT_EQ(parse_recording(columns(1000), "f.csv").recording.columns.size(), 1000U);
  EXPECT_EQ(problems(columns(1001)),
            "f.csv:5: 1001 columns, but at most 1000 are read; is this the row of column names?");
}

TEST(RecordingReader, ListsTheFirstThousandWarningsAndCountsTheRest) {
  const auto rows_without_a_result = [](int count) {
    std::string text = kHead + "# not_measured: position_rad: the joint never moved\ntime_s,position_rad\n";
    for (int i = 0; i < count; ++i) text += std::to_string(i) + ",nan\n";
    return parse_recording(text, "f.csv", runtime::NotMeasured::kTaken).warnings;
  };
  EXPECT_EQ(rows_without_a_result(1000).size(), 1000U);
  const std::vector<std::string> warnings = rows_without_a_result(1002);
  ASSERT_EQ(warnings.size(), 1001U);
  EXPECT_EQ(warnings.back(), "f.csv: and 2 more warnings");
}

// A file is read in pieces: wherever a piece ends, the result equals that of the text in memory.
TEST(RecordingReader, ReadsALongFileLikeItsText) {
  const support::TemporaryDirectory directory;
  std::string text = kHead + "time_s,position_rad\r\n";
  for (int i = 0; i < 60'000; ++i)
    text += std::to_string(i) + "," + std::string(static_cast<std::size_t>(i) % 7, ' ') +
            std::to_string(2 * i) + "\r\n";
  const std::string end = "\r\n\n\r\n";
  const auto whole = runtime::read_recording(directory.write("whole.csv", text + end));
  EXPECT_TRUE(whole.warnings.empty());
  ASSERT_EQ(whole.recording.rows(), 60'000u);
  for (std::size_t i = 0; i < 60'000; ++i)
    ASSERT_EQ(whole.recording.column("position_rad")[i], 2 * static_cast<double>(i));

  const auto torn = runtime::read_recording(directory.write("torn.csv", text + "60000,1"));
  EXPECT_EQ(torn.recording.rows(), 60'000u);
  EXPECT_EQ(torn.warnings.size(), 1u);

  const auto path = directory.write("blank.csv", text + end + "60000,1\n");
  try {
    runtime::read_recording(path);
    FAIL();
  } catch (const RecordingError& error) {
    ASSERT_EQ(error.problems().size(),
              6u);  // of each of the three lines, that it has one value, which is empty
    EXPECT_NE(error.problems()[0].find("blank.csv:60006: time_s is empty"), std::string::npos)
        << error.problems()[0];
  }
}

}  // namespace recording_reader_test
