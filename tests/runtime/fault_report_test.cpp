// Locations of fault reports, and that they overwrite nothing.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "runtime/recording/flight_recorder.h"
#include "runtime/robot_session.h"
#include "tests/support/temporary_directory.h"

namespace runtime {
namespace fault_report_test {

namespace fs = std::filesystem;

struct Record {
  double time_s = 0;
};
template <typename Column>
void visit(const Record& record, Column&& column) {
  column("time_s", "", record.time_s, 3);
}

struct FaultReport : testing::Test {
  FaultReport() {
    if (const char* before = std::getenv("TMPDIR")) before_ = before;
    setenv("TMPDIR", directory.path().c_str(), 1);
  }
  ~FaultReport() override { before_ ? setenv("TMPDIR", before_->c_str(), 1) : unsetenv("TMPDIR"); }
  std::optional<fs::path> report(const std::optional<fs::path>& record_directory = {}) {
    return write_fault_report(
        record_directory,
        [](const fs::path& path) {
          FlightRecorder<Record> recorder(2);
          recorder.add({.time_s = 0.5});
          recorder.write(path, "base", {"started", "2026-11-26T22:03:08Z"}, "a test");
        },
        &frames, "a test", problems);
  }
  fs::path folder() const { return directory / ("youbotd-faults-" + std::to_string(geteuid())); }
  std::vector<std::string> files(const std::string& extension) const {
    std::vector<std::string> names;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder()))
      if (entry.path().extension() == extension) names.push_back(entry.path().filename());
    return names;
  }

  support::TemporaryDirectory directory;
  drivers::ethercat::PcapRing frames{{.interface = "eth7", .frames = 4}};
  std::vector<std::string> problems;

 private:
  std::optional<std::string> before_;
};

TEST_F(FaultReport, GoesIntoAFolderThatOnlyThisUserCanWriteTo) {
  const std::optional<fs::path> path = report();
  ASSERT_TRUE(path) << problems.at(0);
  EXPECT_EQ(path->parent_path(), folder());
  EXPECT_TRUE(fs::exists(fs::path(*path).replace_extension(".pcapng")));
  EXPECT_EQ(fs::status(folder()).permissions() & (fs::perms::group_write | fs::perms::others_write),
            fs::perms::none);
}

TEST_F(FaultReport, GoesBesideTheRecording) {
  fs::create_directory(directory / "run");
  const std::optional<fs::path> path = report(directory / "run");
  ASSERT_TRUE(path);
  EXPECT_EQ(path->parent_path(), directory / "run");
  EXPECT_FALSE(fs::exists(folder()));
}

TEST_F(FaultReport, TheNewestTwentyAreKeptWithTheirCaptures) {
  std::vector<fs::path> written;
  for (int i = 0; i < 23; ++i) {
    written.push_back(report().value());
    // A file system's time may be coarse.
    fs::last_write_time(written.back(), fs::file_time_type::clock::now() - std::chrono::hours(100 - i));
  }
  EXPECT_EQ(files(".csv").size(), 20U);
  EXPECT_EQ(files(".pcapng").size(), 20U);
  for (std::size_t i = 0; i < written.size(); ++i) EXPECT_EQ(fs::exists(written[i]), i >= 3) << i;
}

TEST_F(FaultReport, NeverGoesThroughALinkIntoAForeignFolder) {
  fs::create_directory(directory / "elsewhere");
  fs::create_symlink(directory / "elsewhere", folder());
  EXPECT_FALSE(report());
  EXPECT_TRUE(fs::is_empty(directory / "elsewhere"));
  ASSERT_EQ(problems.size(), 1U);
  EXPECT_NE(problems[0].find("it is not this user's own folder"), std::string::npos) << problems[0];
}

TEST_F(FaultReport, AFolderThatOthersCanWriteToIsNotUsed) {
  fs::create_directory(folder());
  ASSERT_EQ(chmod(folder().c_str(), 0777), 0);
  EXPECT_FALSE(report());
}

TEST_F(FaultReport, IsNeverWrittenThroughALinkOrOverAFile) {
  const fs::path victim = directory.write("victim", "precious");
  fs::create_symlink(victim, directory / "report.csv");
  const FlightRecorder<Record> recorder(2);
  for (const fs::path& path : {directory / "report.csv", victim})
    EXPECT_THROW(recorder.write(path, "base", {"started", "2026-11-26T22:03:08Z"}, "a test"),
                 hal::SetupError);
  EXPECT_EQ(fs::file_size(victim), 8U);
}

}  // namespace fault_report_test
}  // namespace runtime
