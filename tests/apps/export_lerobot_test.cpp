// youbotctl export lerobot: the command and the files of a dataset. tests/lerobot reads their contents.
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "apps/youbotctl/export_lerobot.h"
#include "runtime/mcap/convert.h"
#include "tests/support/built_paths.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_directory.h"

namespace export_lerobot_test {

namespace fs = std::filesystem;
using support::CommandResult;
using support::run_command;

class ExportLerobot : public testing::Test {
 protected:
  CommandResult ctl(const std::string& arguments) const {
    return run_command("cd " + folder_.path().string() + " && " + support::program("youbotctl") + " export " +
                       arguments);
  }
  /// `rows` at 1 kHz that operate with everything at rest.
  std::string recording(const std::string& name, int rows) const {
    std::string head = "# youbot recording v1\ntime_s,phase";
    std::string rest = ",5";
    for (const youbotctl::Feature& feature : youbotctl::teleoperation_features())
      for (const std::string& column : feature.columns) {
        head += "," + column;
        rest += youbotctl::may_be_missing(column) ? ",nan" : ",0.5";
      }
    std::string text = head + "\n";
    for (int i = 0; i < rows; ++i) text += std::to_string(i / 1000.0) + rest + "\n";
    folder_.write(name, text);
    return name;
  }
  std::vector<std::string> entries() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_.path())) names.push_back(entry.path().filename());
    return names;
  }
  support::TemporaryDirectory folder_;
};

TEST_F(ExportLerobot, PrintsWhichRecordingAnEpisodeIsFrom) {
  recording("a.csv", 2000);
  recording("b.csv", 1000);
  const CommandResult result = ctl("lerobot a.csv b.csv set --fps 10 --task 'open the door'");
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.output,
            "episode 0: a.csv from 0.000 s: 20 frames\n"
            "episode 1: b.csv from 0.000 s: 10 frames\n"
            "set: 2 episodes, 30 frames at 10 Hz\n");
  EXPECT_TRUE(fs::exists(folder_ / "set/meta/info.json"));
}

TEST_F(ExportLerobot, AnExistingDatasetIsNotReplaced) {
  recording("a.csv", 1000);
  ASSERT_EQ(ctl("lerobot a.csv set").exit_code, 0);
  const auto written = fs::last_write_time(folder_ / "set/meta/info.json");
  const CommandResult again = ctl("lerobot a.csv set");
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_TRUE(again.said("set")) << again.output;
  EXPECT_EQ(fs::last_write_time(folder_ / "set/meta/info.json"), written);
}

TEST_F(ExportLerobot, WrongUsageIsRefusedAndLeavesNothingBehind) {
  recording("a.csv", 1000);
  folder_.write("wheel.csv", "# youbot recording v1\ntime_s,position_rad\n0,1\n");
  const auto before = entries();
  const auto refused = [&](const std::string& arguments, const std::string& reason) {
    const CommandResult result = ctl(arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments;
    EXPECT_TRUE(result.said(reason)) << arguments << "\n" << result.output;
  };
  for (const std::string fps : {"0", "-30", "nan", "29.97", "1e9"})
    refused("lerobot a.csv set --fps=" + fps, "--fps");
  refused("lerobot a.csv set --fps=1001", "--fps");
  refused("lerobot a.csv set --task ''", "--task is empty");
  refused("lerobot a.csv set --task \"$(printf 'd\\374nn')\"", "--task: is not UTF-8");
  refused("lerobot a.csv", "paths");
  refused("rlds a.csv set", "rlds");
  // The first one is in order, the second is not.
  refused("lerobot a.csv wheel.csv set", "wheel.csv: is no recording of a teleoperation");
  refused("lerobot a.csv ./a.csv set", "./a.csv is given twice");
  fs::create_directory(folder_ / "run");
  recording("run/teleoperation.csv", 1000);
  refused("lerobot run run/teleoperation.csv set", "run/teleoperation.csv is given twice");
  (void)runtime::mcap::convert(folder_ / "run/teleoperation.csv", folder_ / "run/teleoperation.mcap");
  refused("lerobot run ./run/teleoperation.mcap set",
          "run/teleoperation.csv and ./run/teleoperation.mcap are one recording");
  fs::remove_all(folder_ / "run");
  refused("lerobot a.csv missing.mcap set", "missing.mcap");
  EXPECT_EQ(entries(), before);
  EXPECT_EQ(ctl("lerobot a.csv a.csv/set").exit_code, 3) << "no directory";
}

TEST_F(ExportLerobot, WhatPrecedesATearIsExportedWithAWarning) {
  recording("a.csv", 3000);
  const std::string program = support::program("youbotctl");
  ASSERT_EQ(
      run_command("cd " + folder_.path().string() + " && " + program + " convert a.csv a.mcap").exit_code, 0);
  fs::resize_file(folder_ / "a.mcap", fs::file_size(folder_ / "a.mcap") / 2);
  const CommandResult torn = ctl("lerobot a.mcap set");
  EXPECT_EQ(torn.exit_code, 0) << torn.output;
  EXPECT_TRUE(torn.said("what precedes was read; youbotctl recover completes the file")) << torn.output;

  fs::resize_file(folder_ / "a.csv", fs::file_size(folder_ / "a.csv") - 3);
  const CommandResult result = ctl("lerobot a.csv set-2 --fps 1000");
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_TRUE(result.said("the last line is torn")) << result.output;
  EXPECT_TRUE(result.said("2999 frames")) << result.output;
}

TEST_F(ExportLerobot, WhatOnlySomeFramesHaveIsLeftOutWithAWarning) {
  const std::string name = recording("a.csv", 100);
  const std::string program = support::program("youbotctl");
  // The gripper gets its first command half-way, in the last of the columns.
  ASSERT_EQ(run_command("cd " + folder_.path().string() + " && awk -F, -v OFS=, 'NR > 52 { $NF = 0.02 } 1' " +
                        name + " >b.csv")
                .exit_code,
            0);
  const CommandResult result = ctl("lerobot b.csv set --fps 100");
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_TRUE(result.said("gripper_opening_m is left out: 5 of 10 frames have none")) << result.output;
}

TEST_F(ExportLerobot, AFileOfFramesEndsWithTheEpisodeThatExceedsItsSize) {
  recording("a.csv", 1000);
  youbotctl::Demonstrations demonstrations = youbotctl::read_demonstrations(folder_ / "a.csv", {});
  demonstrations.episodes.resize(3, demonstrations.episodes.front());
  youbotctl::LerobotOptions options;
  options.data_file_bytes = 1;
  write_lerobot(demonstrations, folder_ / "set", options);
  for (const char* name : {"file-000", "file-001", "file-002"})
    EXPECT_TRUE(fs::exists(folder_ / "set/data/chunk-000" / (std::string(name) + ".parquet"))) << name;
  EXPECT_FALSE(fs::exists(folder_ / "set/data/chunk-000/file-003.parquet"));
}

}  // namespace export_lerobot_test
