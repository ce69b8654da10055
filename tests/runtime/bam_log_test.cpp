// Logs of bam: entries become rows, the values of the run become comments, and a log that is damaged is
// named. The keys are those that its record.py writes (Rhoban/bam, commit 1b5a1ce).
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <utility>

#include "runtime/recording/bam_log.h"
#include "tests/support/temporary_directory.h"

namespace bam_log_test {

using runtime::parse_bam_log;
using runtime::RecordingError;

std::string entry(double time, double position, double goal, bool on = true) {
  return "{\"position\": " + std::to_string(position) +
         ", \"speed\": 0.1, \"load\": 3, \"input_volts\": 7.3, " +
         "\"temp\": 29, \"timestamp\": " + std::to_string(time) +
         ", \"goal_position\": " + std::to_string(goal) + ", \"torque_enable\": " + (on ? "true" : "false") +
         "}";
}
std::string log(const std::string& entries) {
  return "{\"mass\": 0.49, \"arm-mass\": 0.02, \"length\": 0.1, \"kp\": 200, \"vin\": 7.4, \"motor\": "
         "\"xl330\", "
         "\"trajectory\": \"sin_sin\", \"entries\": [" +
         entries + "]}";
}

std::string problem(const std::string& text, const runtime::ColumnMap* columns = nullptr) {
  try {
    parse_bam_log(text, "f.json", columns);
    return "";
  } catch (const RecordingError& error) {
    return error.what();
  }
}

TEST(BamLog, EntriesBecomeRowsAndTheRunsValuesComments) {
  const auto read =
      parse_bam_log(log(entry(2.5, 0.1, 0.2) + "," + entry(2.505, 0.11, 0.21)), "f.json", nullptr);
  ASSERT_EQ(read.recording.rows(), 2U);
  EXPECT_NEAR(read.recording.column("time_s")[1], 0.005, 1e-9);
  EXPECT_EQ(read.recording.column("position_rad")[1], 0.11);
  EXPECT_EQ(read.recording.column("position_command_rad")[0], 0.2);
  EXPECT_EQ(read.recording.column("temperature_C")[0], 29);
  EXPECT_FALSE(read.recording.has("torque_measured_Nm"));
  EXPECT_EQ(read.recording.rig, "xl330");
  EXPECT_EQ(read.recording.experiment, "sin_sin");
  EXPECT_NE(std::ranges::find(read.recording.comments, std::pair<std::string, std::string>("kp", "200")),
            read.recording.comments.end());
}

TEST(BamLog, ANumberThatIsTooLargeIsAnErrorOfTheFile) {
  const std::string whole = log(entry(0, 0.1, 0.2));
  const std::string message = problem("{\"kp\": 1e999, " + whole.substr(1));
  EXPECT_NE(message.find("f.json"), std::string::npos) << message;
  EXPECT_NE(message.find("has a number beyond"), std::string::npos) << message;
}

TEST(BamLog, ADeeplyNestedValueIsLeftOut) {
  const std::string deep = std::string(200'000, '[') + std::string(200'000, ']');
  const std::string whole = log(entry(0, 0.1, 0.2) + "," + entry(0.005, 0.2, 0.2));
  const auto read = parse_bam_log("{\"notes\": " + deep + ", " + whole.substr(1), "f.json", nullptr);
  EXPECT_EQ(read.recording.rows(), 2U);
}

TEST(BamLog, RowsWithTheTorqueOffAreLeftOut) {
  const auto read = parse_bam_log(
      log(entry(0, 0.1, 0.2) + "," + entry(0.005, 0.2, 0.2, false) + "," + entry(0.01, 0.3, 0.2)), "f.json",
      nullptr);
  EXPECT_EQ(read.recording.rows(), 2U);
  ASSERT_FALSE(read.warnings.empty());
  EXPECT_NE(read.warnings.back().find("1 row was left out"), std::string::npos);
}

TEST(BamLog, AColumnMapGivesTheTorqueFromTheServosLawWithTheLogsGainAndSupply) {
  const support::TemporaryDirectory directory;
  const auto columns = runtime::read_column_map(
      directory.write("map.toml",
                      "format = \"youbot-column-map/1\"\n[time_s]\ncolumn = \"timestamp\"\nunit = \"s\"\n"
                      "[position_rad]\ncolumn = \"position\"\nunit = \"rad\"\n"
                      "[position_command_rad]\ncolumn = \"goal_position\"\nunit = \"rad\"\n"
                      "[torque_command_Nm.servo]\nerror_gain_per_rad = 2.8775e-3\n"
                      "torque_constant_Nm_per_A = 0.354\nresistance_ohm = 3.4\n"));
  const auto read = parse_bam_log(log(entry(0, 0.1, 0.2) + "," + entry(0.005, 0.1, 0.3)), "f.json", &columns);
  // kt/R · vin · gain · kp · error
  EXPECT_NEAR(read.recording.column("torque_command_Nm")[0], 0.354 / 3.4 * 7.4 * 2.8775e-3 * 200 * 0.1, 1e-9);
  std::string without_kp = log(entry(0, 0.1, 0.2));
  without_kp.replace(without_kp.find("\"kp\""), 4, "\"kd\"");
  EXPECT_NE(problem(without_kp, &columns).find("the servo's kp is not in the log"), std::string::npos);
}

TEST(BamLog, EveryDamageIsNamed) {
  const std::string whole = log(entry(0, 0.1, 0.2) + "," + entry(0.005, 0.1, 0.2));
  for (std::size_t length = 0; length < whole.size(); length += 7)
    EXPECT_NE(problem(whole.substr(0, length)).find("f.json: is torn, or no JSON"), std::string::npos)
        << length;
  EXPECT_NE(problem("[]").find("is no log of bam"), std::string::npos);
  EXPECT_NE(problem("{\"entries\": 3}").find("is no log of bam"), std::string::npos);
  EXPECT_NE(problem("{\"entries\": []}").find("has no entries"), std::string::npos);
  EXPECT_NE(problem(log("3")).find("has no entries"), std::string::npos);
  EXPECT_NE(problem(log(entry(0, 0.1, 0.2) + ",{}"))
                .find("f.json:2: the entry does not have the keys of the first"),
            std::string::npos);
  EXPECT_NE(problem(log("{\"timestamp\": 0, \"pos\": 1}")).find("there is no column 'position'"),
            std::string::npos);
  EXPECT_NE(problem(log(entry(0, 0.1, 0.2) + "," + entry(0, 0.1, 0.2))).find("f.json:2: time_s repeats"),
            std::string::npos);
  EXPECT_NE(problem(log("{\"timestamp\": null, \"position\": 1}")).find("'null' is not a number"),
            std::string::npos);
  EXPECT_NE(
      problem(log("{\"timestamp\": \"x\", \"position\": [1]}")).find("f.json:1: column 'timestamp' 'x'"),
      std::string::npos);
}

TEST(BamLog, AFileIsUpTo64MebibytesLong) {
  const support::TemporaryDirectory directory;
  const auto path = directory.write("log.json", log(entry(0, 0.1, 0.2) + "," + entry(0.005, 0.1, 0.2)));
  EXPECT_EQ(runtime::read_recording_or_log(path, {}).recording.rows(), 2U);
  std::filesystem::resize_file(path, runtime::kMaxBamLog_bytes + 1);  // sparse
  EXPECT_THROW(runtime::read_recording_or_log(path, {}), RecordingError);
  EXPECT_THROW(runtime::read_recording_or_log(directory / "none.json", {}), RecordingError);
}

}  // namespace bam_log_test
