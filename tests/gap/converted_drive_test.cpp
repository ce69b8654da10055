// A damaged published file: no drive is made from it, and the command's exit code reports it.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>

#include "tests/gap/real/source_table.h"
#include "tests/support/built_paths.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_directory.h"

namespace converted_drive_test {

namespace fs = std::filesystem;
using real_recordings::SourceTable;

std::string error_of(const std::function<void()>& use) {
  try {
    use();
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

TEST(SourceTable, NamesTheLineOfWhatIsNoNumber) {
  const support::TemporaryDirectory folder;
  for (const std::string wrong : {"nan", "inf", "x", "1x", ""}) {
    const std::string path = folder.write("table.csv", "t,v\n0,1\n1," + wrong + "\n2,3\n").string();
    const SourceTable table(path);
    EXPECT_EQ(table.column("t").size(), 3U);
    EXPECT_EQ(error_of([&] { (void)table.column("v"); }), path + ":3: '" + wrong + "' is no number");
  }
}

TEST(SourceTable, OfLessThanTwoRowsIsNone) {
  const support::TemporaryDirectory folder;
  for (const char* text : {"", "t,v\n", "t,v\n0,1\n"}) {
    const fs::path path = folder.write("table.csv", text);
    EXPECT_NE(error_of([&] { (void)SourceTable(path); }), "") << text;
  }
}

TEST(ConvertRecordings, ADamagedFileIsNamedAndLeavesNothingBehind) {
  const support::TemporaryDirectory folder;
  const fs::path data = folder / "data";
  fs::copy(support::source_dir() + "/tests/data", data, fs::copy_options::recursive);
  // The last that is read.
  const fs::path file = data / "bam_xl330/xl330_kp800_up_and_down.csv";
  std::ifstream whole(file);
  std::string text{std::istreambuf_iterator<char>(whole), {}};
  whole.close();
  for (const std::string& damaged :
       {text.substr(0, text.find('\n') + 1), text.substr(0, text.size() / 2), std::string()}) {
    std::ofstream(file, std::ios::binary | std::ios::trunc) << damaged;
    const support::CommandResult result = support::run_command(
        support::program("convert_recordings") + " " + data.string() + " " + (folder / "out").string());
    EXPECT_EQ(result.exit_code, 3) << result.output;
    EXPECT_TRUE(result.said(file.string())) << result.output;
    EXPECT_FALSE(fs::exists(folder / "out")) << "half a conversion looks like a whole one";
  }
}

}  // namespace converted_drive_test
