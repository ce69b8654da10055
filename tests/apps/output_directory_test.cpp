// Output directories: checked before the work, one message, one exit code, nothing overwritten.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>

#include "hal/setup_error.h"
#include "runtime/recording/output_directory.h"
#include "tests/support/built_paths.h"
#include "tests/support/run_command.h"
#include "tests/support/skip.h"
#include "tests/support/temporary_directory.h"

namespace output_directory_test {

namespace fs = std::filesystem;

TEST(OutputDirectory, IsMadeWithItsParentsAndReportsWhichWereMissing) {
  const support::TemporaryDirectory folder;
  const fs::path deep = folder / "a/b";
  EXPECT_EQ(runtime::make_output_directory(deep), (std::vector<fs::path>{folder / "a", deep}));
  EXPECT_TRUE(fs::is_directory(deep));
  EXPECT_TRUE(runtime::make_output_directory(deep).empty());
}

TEST(OutputDirectory, ThatCannotBeMadeLeavesNothingBehind) {
  const support::TemporaryDirectory folder;
  const fs::path file = folder.write("file", "x");
  for (const fs::path& path :
       {file, file / "below", folder / std::string(300, 'x'), folder / "new" / std::string(300, 'x')})
    EXPECT_THROW(runtime::make_output_directory(path), hal::SetupError) << path;
  EXPECT_FALSE(fs::exists(folder / "new"));
}

TEST(OutputDirectory, ThatCannotBeMadeIsReportedWithTheFirstCause) {
  const support::TemporaryDirectory folder;
  fs::create_symlink(folder / "missing", folder / "link");
  try {
    runtime::make_output_directory(folder / "link/below");
    FAIL();
  } catch (const hal::SetupError& error) {
    EXPECT_NE(std::string(error.what()).find("File exists"), std::string::npos) << error.what();
  }
}

TEST(OutputDirectory, IsTriedWithAFileAsRightsAloneMayLie) {
  const support::TemporaryDirectory folder;
  EXPECT_EQ(runtime::why_not_writable(folder.path()), "");
  EXPECT_TRUE(fs::is_empty(folder.path()));
  // Even root cannot create a file there.
  EXPECT_THROW(runtime::make_output_directory("/proc"), hal::SetupError);
}

TEST(OutputDirectory, ThatIsOnlyTriedIsTakenAwayAgain) {
  const support::TemporaryDirectory folder;
  runtime::try_output_directory(folder / "a/b");
  EXPECT_TRUE(fs::is_empty(folder.path()));
  runtime::try_output_directory(folder.path());
  EXPECT_TRUE(fs::exists(folder.path())) << "it was there before";
  EXPECT_THROW(runtime::try_output_directory(folder.write("file", "x")), hal::SetupError);
}

TEST(OutputDirectory, IsRefusedAlikeByAllCommandsThatNeedNoData) {
  const support::TemporaryDirectory folder;
  const fs::path file = folder.write("file", "x");
  for (const std::string command :
       {"transparency --quiet", "arm-excitation --quiet --tries 30",
        "haptic-hold --quiet --virtual-time --duration 1", "steady-state --quiet --sets 9 --joint wheel-1",
        "improve --quiet --hidden-effect 1"}) {
    const auto result = support::run_command(support::program("youbot-bench") + " " + command + " --out " +
                                             (file / "below").string());
    EXPECT_EQ(result.exit_code, 3) << command << "\n" << result.output;
    EXPECT_TRUE(result.said("cannot be the directory for the results")) << result.output;
  }
}

TEST(OutputDirectory, AFileSystemWithoutNewDirectoriesIsNamedAsTheCause) {
  SKIP_UNLESS(geteuid() == 0, "needs root: others may not write in /proc");
  try {
    (void)runtime::make_output_directory("/proc/results");
    FAIL();
  } catch (const hal::SetupError& error) {
    EXPECT_NE(std::string(error.what()).find("the file system there takes no new directory"),
              std::string::npos)
        << error.what();
  }
}

TEST(OutputDirectory, IsRefusedByYoubotdBeforeItLooksForARobot) {
  const support::TemporaryDirectory folder;
  const fs::path file = folder.write("file", "x");
  const std::string app = support::source_dir() + "/apps/youbotd/";
  for (const std::string& command :
       {"--config " + app + "demo.toml", "--config " + app + "demo.toml --demo",
        "--config " + app + "teleop.toml",
        "--config " + app + "demo.toml --control " + (folder / "socket").string()})
    for (const fs::path& directory : {file, file / "below", fs::path("/proc")}) {
      const auto result = support::run_command(support::program("youbotd") +
                                               " --quiet --allow-non-rt --robot ethercat:nosuch " + command +
                                               " --record " + directory.string());
      EXPECT_EQ(result.exit_code, 3) << command << "\n" << result.output;
      EXPECT_TRUE(result.said(directory.string()) && result.said(": cannot be the directory for the results"))
          << command << "\n"
          << result.output;
      EXPECT_FALSE(result.said("nosuch")) << result.output;
    }
}

}  // namespace output_directory_test
