// The command `youbot-bench haptic-hold` on each device of a mocked kernel. In real time, on a machine that
// may be busy: a run may end with a late sample, and reports it then.
#ifdef YOUBOT_HAVE_PROGRAMS  // which are not built for the thread sanitizer
#include <gtest/gtest.h>

#include <sys/utsname.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "sim/devices/emulated_space_mouse.h"
#include "tests/support/built_paths.h"
#include "tests/support/mock_falcon.h"
#include "tests/support/mock_hidraw_device.h"
#include "tests/support/mock_usb_device.h"
#include "tests/support/skip.h"
#include "tests/support/spawn.h"
#include "tests/support/temporary_directory.h"

namespace haptic_hold_test {

using namespace std::chrono_literals;
using support::SpawnResult;

constexpr int kDone = 0;
constexpr int kSetup = 3;
constexpr int kFault = 4;

struct HapticHoldOnADevice : testing::Test {
  void SetUp() override { SKIP_UNLESS(support::in_mock_kernel(), "needs umockdev's library loaded first"); }
  SpawnResult hold(std::vector<std::string> arguments) {
    const auto config =
        folder.write("haptic.toml", "[haptic]\nstale_after_s = 0.1\ncommand_timeout_s = 0.1\n" + more);
    std::vector<std::string> words{support::program("youbot-bench"), "haptic-hold", "--allow-non-rt",
                                   "--config", config.string()};
    words.insert(words.end(), arguments.begin(), arguments.end());
    return support::spawn(std::move(words));
  }
  /// Runs it to its end; again when this machine held it up, which is a fault.
  SpawnResult hold_to_the_end(const std::vector<std::string>& arguments) {
    SpawnResult result;
    for (int attempt = 0; attempt < 20; ++attempt) {
      result = hold(arguments);
      if (result.exit_code != kFault || !result.said("stopped by a fault")) break;
    }
    EXPECT_EQ(result.exit_code, kDone) << result.output;
    return result;
  }
  template <typename Happened>
  static bool wait_until(Happened happened) {
    const auto deadline = std::chrono::steady_clock::now() + 60s;
    while (!happened() && std::chrono::steady_clock::now() < deadline) std::this_thread::sleep_for(2ms);
    return happened();
  }

  support::TemporaryDirectory folder;
  std::string more;  ///< of the configuration
};

TEST_F(HapticHoldOnADevice, ASpaceMouseFromPluggedInToUnplugged) {
  support::MockHidrawBus bus;
  support::MockHidrawDevice& mouse =
      bus.plug({.vendor = 0x256f,
                .product = 0xc635,
                .report_descriptor = sim::devices::EmulatedSpaceMouse({}, {}).report_descriptor()});
  const SpawnResult short_run = hold_to_the_end({"--haptic", "spacemouse", "--duration", "1"});
  EXPECT_TRUE(short_run.said("SpaceMouse Compact")) << short_run.output;
  EXPECT_TRUE(short_run.said("samples a second")) << short_run.output;

  const int openers = mouse.openers();
  auto run = std::async(std::launch::async, [this] {
    return hold({"--haptic", "spacemouse", "--duration", "60"});
  });
  ASSERT_TRUE(wait_until([&] { return mouse.openers() > openers && mouse.outputs().size() > 2; }));
  mouse.unplug();
  const SpawnResult result = run.get();
  EXPECT_EQ(result.exit_code, kFault) << result.output;
  EXPECT_TRUE(result.said("stopped by a fault")) << result.output;
}

TEST_F(HapticHoldOnADevice, AFalconThatIsHomedByHand) {
  support::MockUsbBus bus;
  support::MockFalcon far(bus, {.firmware_running = true});
  auto run = std::async(std::launch::async, [this] {
    return hold_to_the_end({"--haptic", "falcon", "--duration", "1"});
  });
  // Red until its ends were found.
  ASSERT_TRUE(wait_until(
      [&] { return far.with([](sim::devices::EmulatedFalcon& device) { return device.red(); }); }));
  far.with([](sim::devices::EmulatedFalcon& device) { device.pull_and_push(); });
  const SpawnResult result = run.get();
  EXPECT_TRUE(result.said("no watchdog")) << result.output;
  EXPECT_EQ(far.with([](sim::devices::EmulatedFalcon& device) { return device.motors(); }),
            (std::array<std::int16_t, 3>{}));
}

TEST_F(HapticHoldOnADevice, AnOmegaThroughALibraryNamedInTheConfiguration) {
  support::MockUsbBus bus;
  const support::MockUsbDevice omega(
      bus, {.vendor = 0x1451, .product = 0x0402, .product_name = "omega.x haptic device"});
  more = "[haptic.force_dimension]\nwatchdog_s = 0.0318\nlibrary = \"" + support::stand_in_library() + "\"\n";
  const SpawnResult result = hold_to_the_end({"--haptic", "force-dimension", "--duration", "1"});
  EXPECT_TRUE(result.said("omega.6")) << result.output;
}

TEST_F(HapticHoldOnADevice, WithoutAConfigurationTheLibraryIsThatOfTheEnvironment) {
  support::MockUsbBus bus;
  const support::MockUsbDevice omega(
      bus, {.vendor = 0x1451, .product = 0x0402, .product_name = "omega.x haptic device"});
  utsname machine{};
  ASSERT_EQ(::uname(&machine), 0);
  const std::filesystem::path libraries =
      folder.path() / "lib/release" / (std::string("lin-") + machine.machine + "-gcc");
  std::filesystem::create_directories(libraries);
  std::filesystem::create_symlink(support::stand_in_library(), libraries / "libdrd.so.3.17.5");
  ::setenv("FDSDK", folder.path().c_str(), 1);
  const SpawnResult result =
      support::spawn({support::program("youbot-bench"), "haptic-hold", "--allow-non-rt", "--haptic",
                      "force-dimension", "--duration", "0.1"});
  ::unsetenv("FDSDK");
  EXPECT_TRUE(result.said("omega.6") && result.said("serial 4711")) << result.output;
}

TEST_F(HapticHoldOnADevice, WhatIsNotThereOrNotSupportedIsToldInWords) {
  support::MockUsbBus bus;
  const SpawnResult falcon = hold({"--haptic", "falcon"});
  EXPECT_EQ(falcon.exit_code, kSetup);
  EXPECT_TRUE(falcon.said("no 0403:cb48 on the bus")) << falcon.output;
  const SpawnResult omega = hold({"--haptic", "force-dimension"});
  EXPECT_EQ(omega.exit_code, kSetup);
  EXPECT_TRUE(omega.said("no device of vendor 1451 on the bus")) << omega.output;
  more = "[haptic.force_dimension]\ntransport = \"usb\"\n";
  const SpawnResult direct = hold({"--haptic", "force-dimension"});
  EXPECT_EQ(direct.exit_code, kSetup);
  EXPECT_TRUE(direct.said("not supported")) << direct.output;
}

}  // namespace haptic_hold_test
#endif
