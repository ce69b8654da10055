// The recording of youbotd compared with the simulated robot's, with the bus between them: youbot-sim
// --record in lock-step, so that each row of the robot is one frame.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/built_paths.h"
#include "tests/support/recorded_robot.h"
#include "tests/support/recording.h"
#include "tests/support/run_command.h"
#include "tests/support/skip.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/veth.h"

namespace robot_recording_over_veth_test {

namespace fs = std::filesystem;
using Column = std::vector<double>;

double furthest_apart(const Column& a, const Column& b, std::size_t shift) {
  double furthest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) furthest = std::max(furthest, std::abs(a[i] - b.at(i + shift)));
  return furthest;
}

TEST(RobotRecordingOverVeth, IsWhatTheDaemonRecorded) {
  const support::Namespaces namespaces;
  SKIP_UNLESS(namespaces.usable(), "needs root and network namespaces");
  const support::TemporaryDirectory folder;
  const fs::path config = folder.write("path.toml", "[[path.leg]]\nforward_m = 0.1\n");
  const fs::path seen = folder / "seen.csv";
  {
    const support::Simulator simulator(namespaces, "--robot base --lock-step --record " + seen.string());
    ASSERT_TRUE(simulator.ready());
    const support::CommandResult run = support::run_command(
        support::program("youbotd") + " --robot ethercat:veth-c --virtual-time --config " + config.string() +
        " --record-csv " + (folder / "run").string());
    ASSERT_EQ(run.exit_code, 0) << run.output;
    EXPECT_TRUE(run.said(" 0 lost")) << run.output;
  }  // which ends it, and its file

  // Motor controllers take whole milliamperes: torque constant and gear ratio of the wheels (datasheet).
  constexpr double kHalfStep_Nm = 0.5e-3 * 0.0335 * 26;
  const support::Recording robot(seen);
  EXPECT_EQ(support::violations_of_record(robot, 1), std::vector<std::string>{});
  std::optional<std::size_t> shift;  // frames of the start-up
  for (const std::string wheel : {"1", "2", "3", "4"}) {
    const support::Recording daemon(folder / "run" / ("wheel-" + wheel + ".csv"));
    const Column& recorded_rad = daemon["position_rad"];
    const Column& recorded_Nm = daemon["torque_command_Nm"];
    const Column& seen_rad = robot["wheel_" + wheel + "_encoder_rad"];
    const Column& seen_Nm = robot["wheel_" + wheel + "_target"];
    ASSERT_GT(recorded_rad.size(), 5000U);
    ASSERT_EQ(seen_rad.size(), seen_Nm.size());
    EXPECT_GT(std::abs(recorded_rad.back()), 1.0) << "wheel " << wheel << " did not turn";
    for (std::size_t s = 0; !shift && recorded_rad.size() + s < seen_rad.size(); ++s)
      if (furthest_apart(recorded_rad, seen_rad, s) < 1e-6) shift = s;
    ASSERT_TRUE(shift) << "no row of the robot's fits the daemon's";
    EXPECT_LT(furthest_apart(recorded_rad, seen_rad, *shift), 1e-6) << "wheel " << wheel;
    // A command acts from its row on, and the robot's row of that frame was written before it came.
    EXPECT_LT(furthest_apart(recorded_Nm, seen_Nm, *shift + 1), kHalfStep_Nm + 1e-6) << "wheel " << wheel;
    EXPECT_GT(*std::max_element(recorded_Nm.begin(), recorded_Nm.end()) -
                  *std::min_element(recorded_Nm.begin(), recorded_Nm.end()),
              20 * kHalfStep_Nm);
  }
}

/// youbot-sim on its interface without a master, until it ends by itself.
support::CommandResult serve_without_client(const support::Namespaces& namespaces,
                                            const std::string& record) {
  return support::run_command("timeout 20 ip netns exec " + namespaces.sim_namespace() + " " +
                              support::program("youbot-sim") +
                              " --interface veth-s --duration 0.05 --record " + record);
}

TEST(RobotRecordingOverVeth, GoesToANewFileOnly) {
  const support::Namespaces namespaces;
  SKIP_UNLESS(namespaces.usable(), "needs root and network namespaces");
  const support::TemporaryDirectory folder;
  const fs::path earlier = folder.write("earlier.csv", "earlier\n");
  const fs::path pipe = folder / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  for (const auto& [path, why] : std::vector<std::pair<fs::path, std::string>>{
           {earlier, "cannot create the file: File exists"},
           {pipe, "not a regular file"},
           {folder.path(), "not a regular file"},
           {"/dev/full", "not a regular file"},
           {"/proc/seen.csv", "cannot create the file: No such file or directory"}}) {
    const support::CommandResult result = serve_without_client(namespaces, path.string());
    EXPECT_EQ(result.exit_code, 3) << result.output;
    EXPECT_TRUE(result.said("recording " + path.string() + ": " + why)) << result.output;
    EXPECT_FALSE(result.said("serving")) << result.output;
  }
  EXPECT_EQ(fs::file_size(earlier), 8U);
  EXPECT_TRUE(fs::is_fifo(pipe));
  EXPECT_EQ(serve_without_client(namespaces, (folder / "new.csv").string()).exit_code, 0);
  EXPECT_GT(support::Recording(folder / "new.csv").rows(), 10U);
}

}  // namespace robot_recording_over_veth_test
