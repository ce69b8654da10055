// A serving youbotd keeps its haptic device when it is unplugged and plugged in again.
#ifdef YOUBOT_HAVE_PROGRAMS  // which are not built for the thread sanitizer
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "sim/devices/emulated_space_mouse.h"
#include "tests/support/built_paths.h"
#include "tests/support/mock_hidraw_device.h"
#include "tests/support/mock_usb_device.h"
#include "tests/support/process.h"
#include "tests/support/skip.h"
#include "tests/support/temporary_directory.h"

namespace served_master_test {

using namespace std::chrono_literals;
using support::CommandResult;
using support::Process;

/// What youbotd answers while a busy machine does not let its loop run.
constexpr const char* kHeldUp = "the loop does not answer";

TEST(ServedMaster, IsReopenedByTheEnableAfterItWasPluggedInAgain) {
  SKIP_UNLESS(support::in_mock_kernel(), "needs umockdev's library loaded first");
  const support::TemporaryDirectory folder;
  const std::string socket = folder / "s";
  const auto ctl = [&socket](std::vector<std::string> words) {
    words.insert(words.begin(), {support::program("youbotctl"), "--socket", socket});
    return words;
  };
  const auto tell = [&](std::vector<std::string> words) { return Process(ctl(std::move(words))).finish(); };
  const auto master_comes_to = [&](const char* state) {
    for (const auto end = std::chrono::steady_clock::now() + 60s; std::chrono::steady_clock::now() < end;
         std::this_thread::sleep_for(20ms))
      if (tell({"status"}).said(state)) return testing::AssertionSuccess();
    return testing::AssertionFailure() << tell({"status"}).output;
  };
  const support::MockHidrawOptions mouse{
      .vendor = 0x256f,
      .product = 0xc635,
      .report_descriptor = sim::devices::EmulatedSpaceMouse({}, {}).report_descriptor()};

  support::MockHidrawBus bus;
  support::MockHidrawDevice& first = bus.plug(mouse);
  // Fault reports go to the directory for temporary files.
  std::ostringstream as_shipped;
  as_shipped << std::ifstream(support::source_dir() + "/apps/youbotd/teleop.toml").rdbuf();
  const std::string config =
      folder.write("teleop.toml", as_shipped.str() + "\n[loop]\ncommander_timeout_s = 5.0\n");
  Process youbotd({"/usr/bin/env", "TMPDIR=" + folder.path().string(), support::program("youbotd"),
                   "--config", config, "--haptic", "spacemouse", "--control", socket, "--allow-non-rt"});
  ASSERT_TRUE(youbotd.wait_for("waiting for commands"));
  EXPECT_TRUE(master_comes_to("hidraw0): ready"));

  first.unplug();
  EXPECT_TRUE(master_comes_to("unplugged"));
  CommandResult refused = tell({"enable"});
  while (refused.said(kHeldUp)) refused = tell({"enable"});
  EXPECT_EQ(refused.exit_code, 2) << refused.output;
  EXPECT_TRUE(refused.said("SpaceMouse")) << refused.output;

  bus.plug(mouse);
  // On a busy machine the loop or the master's thread may miss its deadline, which ends the run with a fault;
  // or the master opens so slowly that youbotd asks for another enable. Both are right, and the operator
  // enables again.
  bool unfolds = false;
  for (int attempt = 0; attempt < 20 && !unfolds; ++attempt) {
    Process commander(ctl({"enable"}));
    unfolds = commander.wait_for("unfolding");
    commander.signal(SIGINT);
    const CommandResult ended = commander.finish();
    ASSERT_TRUE((unfolds && ended.exit_code == 0) ||
                (ended.exit_code == 4 && ended.said("stopped by a fault")) ||
                (ended.exit_code == 2 && (ended.said("is ready now: enable again") || ended.said(kHeldUp))))
        << ended.output;
    EXPECT_EQ(tell({"acknowledge"}).exit_code, 0);
  }
  EXPECT_TRUE(unfolds);
}

}  // namespace served_master_test
#endif
