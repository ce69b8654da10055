// youbotctl convert and recover, on a recording of the simulated base.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "tests/support/built_paths.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_directory.h"

namespace youbotctl_files_test {

namespace fs = std::filesystem;
using support::CommandResult;
using support::run_command;

std::string text_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

class YoubotctlFiles : public testing::Test {
 protected:
  CommandResult ctl(const std::string& arguments) const {
    return run_command("cd " + folder_.path().string() + " && " + support::program("youbotctl") + " " +
                       arguments);
  }
  /// Records some seconds of the base.
  void record(const std::string& option) const {
    const CommandResult run = run_command(support::program("youbotd") + " --config " + support::source_dir() +
                                          "/apps/youbotd/demo.toml --virtual-time --duration 12 " + option +
                                          " " + (folder_ / "run").string());
    ASSERT_EQ(run.exit_code, 0) << run.output;
  }
  support::TemporaryDirectory folder_;
};

TEST_F(YoubotctlFiles, ARecordingIsAFifthOfItsSizeAsMcapAndTheSameTextBack) {
  record("--record-csv");
  const CommandResult there = ctl("convert run/base.csv base.mcap");
  ASSERT_EQ(there.exit_code, 0) << there.output;
  EXPECT_TRUE(there.said("base.mcap: ")) << there.output;
  const CommandResult back = ctl("convert base.mcap base.csv");
  ASSERT_EQ(back.exit_code, 0) << back.output;
  EXPECT_TRUE(text_of(folder_ / "run/base.csv") == text_of(folder_ / "base.csv"));

  const auto size = static_cast<double>(fs::file_size(folder_ / "base.mcap"));
  EXPECT_LT(size, 0.2 * static_cast<double>(fs::file_size(folder_ / "run/base.csv")));
  // base.csv repeats every column of the wheels' files, so one MCAP file replaces all of them.
  double all = 0;
  for (const char* name : {"base", "wheel-1", "wheel-2", "wheel-3", "wheel-4"})
    all += static_cast<double>(fs::file_size(folder_ / "run" / (std::string(name) + ".csv")));
  EXPECT_LT(size, 0.125 * all);
}

TEST_F(YoubotctlFiles, AWheelOfARecordingIsWrittenAlone) {
  record("--record");
  ASSERT_EQ(ctl("convert --joint wheel-2 run/base.mcap wheel-2.csv").exit_code, 0);
  const std::string text = text_of(folder_ / "wheel-2.csv");
  EXPECT_TRUE(text.starts_with("# youbot recording v1\n# rig: wheel-2\n# experiment: path\n"));
  EXPECT_NE(text.find("\ntime_s,torque_command_Nm,torque_measured_Nm,position_rad,velocity_rad_per_s\n"),
            std::string::npos);
  EXPECT_EQ(ctl("convert --joint wheel-5 run/base.mcap wheel-5.csv").exit_code, 2);
  EXPECT_EQ(ctl("convert --joint wheel-2 wheel-2.csv wheel-2.mcap").exit_code, 2);
}

TEST_F(YoubotctlFiles, ATableHasItsNameOnceItIsComplete) {
  std::string table = "t,q\n";
  for (int i = 0; i < 20000; ++i) table += std::to_string(i) + "," + std::to_string(i % 7) + ".5\n";
  folder_.write("table.csv", table);
  folder_.write("map.toml",
                "format = \"youbot-column-map/1\"\n[time_s]\ncolumn = \"t\"\nunit = \"ms\"\n"
                "[position_rad]\ncolumn = \"q\"\nunit = \"deg\"\n");
  for (const std::string out : {"out.csv", "out.mcap"}) {
    const CommandResult full =
        run_command("cd " + folder_.path().string() + " && ulimit -f 20; " + support::program("youbotctl") +
                    " convert table.csv " + out + " --columns map.toml");
    EXPECT_EQ(full.exit_code, 3) << full.output;
    EXPECT_FALSE(fs::exists(folder_ / out)) << full.output;
    const CommandResult done = ctl("convert table.csv " + out + " --columns map.toml");
    EXPECT_EQ(done.exit_code, 0) << done.output;
    EXPECT_TRUE(done.said("20000 rows")) << done.output;
    EXPECT_EQ(ctl("convert table.csv " + out + " --columns map.toml").exit_code, 3) << "it is replaced";
  }
  std::size_t left = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_.path()))
    left += entry.path().string().find(".part") != std::string::npos ? 1 : 0;
  EXPECT_EQ(left, 0U);
  const CommandResult other = ctl("convert table.csv out.json --columns map.toml");
  EXPECT_EQ(other.exit_code, 2) << other.output;
  EXPECT_TRUE(other.said("expected a .csv or an .mcap file")) << other.output;
}

TEST_F(YoubotctlFiles, ATornFileIsRecovered) {
  folder_.write("a.csv", [] {
    std::string text = "# youbot recording v1\n# rig: wheel-1\ntime_s,position_rad\n";
    for (int i = 0; i < 3000; ++i) text += std::to_string(i / 1000.0) + ",1.0\n";
    return text;
  }());
  ASSERT_EQ(ctl("convert a.csv a.mcap").exit_code, 0);
  const std::string whole = text_of(folder_ / "a.mcap");
  folder_.write("torn.mcap", whole.substr(0, whole.size() / 2));

  const CommandResult as_it_is = ctl("convert torn.mcap as_it_is.csv");
  EXPECT_EQ(as_it_is.exit_code, 0) << as_it_is.output;
  EXPECT_TRUE(as_it_is.said("warning: torn.mcap: byte ")) << as_it_is.output;
  EXPECT_TRUE(as_it_is.said("youbotctl recover completes the file")) << as_it_is.output;

  const CommandResult recovered = ctl("recover torn.mcap b.mcap");
  EXPECT_EQ(recovered.exit_code, 0) << recovered.output;
  EXPECT_TRUE(recovered.said("warning: torn.mcap: byte ")) << recovered.output;
  EXPECT_TRUE(recovered.said(" of " + std::to_string(whole.size() / 2) + "\n")) << recovered.output;
  EXPECT_EQ(ctl("convert b.mcap b.csv").exit_code, 0);
  const std::string text = text_of(folder_ / "b.csv");
  EXPECT_EQ(text, text_of(folder_ / "as_it_is.csv"));
  EXPECT_TRUE(text_of(folder_ / "a.csv").starts_with(text));
  EXPECT_GT(text.size(), text_of(folder_ / "a.csv").size() / 4);

  EXPECT_TRUE(ctl("recover a.mcap c.mcap").said("nothing was lost"));
  EXPECT_EQ(ctl("recover a.csv d.mcap").exit_code, 2);
  EXPECT_EQ(ctl("recover a.mcap c.mcap").exit_code, 3) << "it exists";
  EXPECT_EQ(ctl("convert a.csv a.mcap").exit_code, 3) << "it exists";
  EXPECT_EQ(ctl("convert a.csv a.txt").exit_code, 2);
}

TEST_F(YoubotctlFiles, TheSearchForMissingEffectsReadsMcap) {
  record("--record");
  ASSERT_EQ(ctl("convert --joint wheel-1 run/base.mcap wheel-1.csv").exit_code, 0);
  const auto gap = [&](const std::string& more) {
    return run_command(support::program("youbot-gap") + " --model " + support::source_dir() +
                       "/apps/youbot_gap/known_wheel.toml --data " + (folder_ / "run/base.mcap").string() +
                       " --out " + (folder_ / "gap").string() + more);
  };
  const CommandResult choice = gap("");
  EXPECT_EQ(choice.exit_code, 2);
  EXPECT_TRUE(choice.said("wheel_1, wheel_2, wheel_3, wheel_4; choose one of them (--joint)"))
      << choice.output;
  const CommandResult result = gap(" --joint wheel-2 --held-out " + (folder_ / "wheel-1.csv").string());
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_TRUE(result.said("of rig 'wheel-2'")) << "both files were read: " << result.output;
}

}  // namespace youbotctl_files_test
