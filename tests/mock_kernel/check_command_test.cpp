// `youbotd --check` with connected haptic devices.
#ifdef YOUBOT_HAVE_PROGRAMS  // which are not built for the thread sanitizer
#include <gtest/gtest.h>

#include <string>

#include "tests/support/built_paths.h"
#include "tests/support/mock_usb_device.h"
#include "tests/support/skip.h"
#include "tests/support/spawn.h"
#include "tests/support/temporary_directory.h"

namespace check_command_test {

support::SpawnResult check(const std::string& master) {
  const support::TemporaryDirectory folder;
  const std::string config = folder.write("teleop.toml", R"(
[ethercat]
kind = "base+arm"
[haptic.force_dimension]
library = "/nowhere/libdrd.so.3"
)");
  return support::spawn(
      {support::program("youbotd"), "--check", "--allow-non-rt", "--config", config, "--haptic", master});
}

TEST(CheckWithMasters, AFalconIsFoundAndLeftAlone) {
  SKIP_UNLESS(support::in_mock_kernel(), "needs umockdev's library loaded first");
  support::MockUsbBus bus;
  const support::MockUsbDevice falcon(bus, {.driver = "ftdi_sio"});
  const support::SpawnResult result = check("falcon");
  EXPECT_TRUE(result.said("ok    Novint Falcon: the kernel's driver ftdi_sio bound to interface 0"))
      << result.output;
  EXPECT_EQ(falcon.counts().opens, 0);
}

TEST(CheckWithMasters, AnOmegaWithoutItsLibraryFailsForThatAlone) {
  SKIP_UNLESS(support::in_mock_kernel(), "needs umockdev's library loaded first");
  support::MockUsbBus bus;
  const support::MockUsbDevice omega(bus, {.vendor = 0x1451, .product = 0x0402});
  const support::SpawnResult result = check("force-dimension");
  EXPECT_EQ(result.exit_code, 3) << result.output;
  EXPECT_TRUE(result.said("FAIL  Force Dimension SDK: /nowhere/libdrd.so.3")) << result.output;
  EXPECT_TRUE(result.said("ok    Force Dimension device: there")) << result.output;
  EXPECT_EQ(omega.counts().opens, 0);
}

}  // namespace check_command_test
#endif
