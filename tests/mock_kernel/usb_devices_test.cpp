// Discovery and hot-plug through real libusb, and the probe based on it.
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/usb/usb_access.h"
#include "drivers/usb/usb_devices.h"
#include "tests/support/built_paths.h"
#include "tests/support/mock_usb_device.h"
#include "tests/support/skip.h"
#include "tests/support/spawn.h"
#include "tests/support/temporary_directory.h"

namespace drivers::usb {
namespace usb_devices_test {

using namespace std::chrono_literals;
using support::MockUsbDevice;

const support::MockUsbOptions kOmega{.vendor = 0x1451,
                                     .product = 0x0402,
                                     .port = 2,
                                     .address = 7,
                                     .manufacturer = "FD 3.0",
                                     .product_name = "omega.x haptic device",
                                     .speed_Mbit_per_s = 480};

class UsbDevicesTest : public testing::Test {
 protected:
  void SetUp() override {
    SKIP_UNLESS(support::in_mock_kernel(), "needs umockdev's library loaded first");
    bus_ = std::make_unique<support::MockUsbBus>();
  }
  /// Polls until something matching came or went, or seconds are over.
  static std::vector<UsbArrival> next(UsbWatch& watch) {
    const auto deadline = std::chrono::steady_clock::now() + 60s;
    std::vector<UsbArrival> arrivals;
    while (arrivals.empty() && std::chrono::steady_clock::now() < deadline) arrivals = watch.poll(100ms);
    return arrivals;
  }

  std::unique_ptr<support::MockUsbBus> bus_;
};

TEST_F(UsbDevicesTest, ListsWhatTheKernelKnowsWithoutOpeningAnything) {
  const MockUsbDevice falcon(*bus_, {.serial = "F1"});
  const MockUsbDevice omega(*bus_, kOmega);
  const UsbContext context;
  const auto all = context.devices();
  ASSERT_EQ(all.size(), 3U);
  EXPECT_EQ(all[0], (UsbDevice{.vendor = 0x0403,
                               .product = 0xcb48,
                               .bus = 1,
                               .address = 2,
                               .port_path = "1-1",
                               .speed = UsbSpeed::kFull,
                               .manufacturer = "NOVINT",
                               .product_name = "FALCON HAPTIC",
                               .serial = "F1"}));
  EXPECT_EQ(name_of(all[1]), "omega.x haptic device (1451:0402) at 1-2");
  EXPECT_EQ(all[1].speed, UsbSpeed::kHigh);
  EXPECT_EQ(all[2].port_path, "usb1");
  EXPECT_EQ(falcon.counts().opens + omega.counts().opens, 0);
}

TEST_F(UsbDevicesTest, FindsByNumbersAndDistinguishesTwoEqualDevicesByPort) {
  const MockUsbDevice one(*bus_, {.port = 1, .address = 2});
  const MockUsbDevice two(*bus_, {.port = 2, .address = 3});
  const UsbContext context;
  EXPECT_EQ(context.devices({.vendor = 0x0403, .product = 0xcb48}).size(), 2U);
  const auto found = context.devices({.vendor = 0x0403, .product = 0xcb48, .port_path = "1-2"});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].address, 3);
  EXPECT_TRUE(context.devices({.vendor = 0x1451}).empty());
  EXPECT_TRUE(context.devices({.vendor = 0x0403, .product = 1}).empty());
}

TEST_F(UsbDevicesTest, ComingAndGoingIsReportedWhenPolled) {
  auto first = std::make_unique<MockUsbDevice>(*bus_, support::MockUsbOptions{});
  UsbWatch watch({.vendor = 0x0403, .product = 0xcb48});
  auto seen = next(watch);
  ASSERT_EQ(seen.size(), 1U) << "what is there already";
  EXPECT_EQ(seen[0].kind, UsbArrival::Kind::kCame);
  EXPECT_EQ(seen[0].device.product_name, "FALCON HAPTIC");
  EXPECT_TRUE(watch.poll().empty());

  first->unplug();
  seen = next(watch);
  ASSERT_EQ(seen.size(), 1U);
  EXPECT_EQ(seen[0].kind, UsbArrival::Kind::kWent);
  EXPECT_EQ(seen[0].device.port_path, "1-1");

  const MockUsbDevice another(*bus_, kOmega);
  const MockUsbDevice again(*bus_, {.address = 3});
  seen = next(watch);
  ASSERT_EQ(seen.size(), 1U) << "the omega is not asked for";
  EXPECT_EQ(seen[0].kind, UsbArrival::Kind::kCame);
  EXPECT_EQ(seen[0].device.address, 3);
}

TEST_F(UsbDevicesTest, DescriptorsAreTheKernelsCopy) {
  const MockUsbDevice falcon(*bus_, {});
  const UsbContext context;
  EXPECT_EQ(descriptors_of(context.devices({.vendor = 0x0403}).at(0), context.paths()),
            support::bulk_pair_descriptors(0x0403, 0xcb48));
  EXPECT_EQ(falcon.counts().opens, 0);
}

#ifdef YOUBOT_HAVE_PROGRAMS  // which are not built for the thread sanitizer
support::SpawnResult probe(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {support::program("youbot-bench"), "usb-probe"});
  return support::spawn(std::move(arguments));
}

TEST_F(UsbDevicesTest, ProbeReportsMastersAndLeavesThemAlone) {
  const MockUsbDevice falcon(*bus_, {.driver = "ftdi_sio"});
  const MockUsbDevice omega(*bus_, kOmega);
  const MockUsbDevice stick(*bus_, {.vendor = 0x0781, .product = 0x5567, .port = 3, .address = 9});
  const support::TemporaryDirectory directory;
  const std::filesystem::path file = directory / "report.txt";
  const support::SpawnResult result = probe({"--out", file.string()});
  EXPECT_EQ(result.exit_code, 0) << result.output;
  for (const char* part :
       {"Novint Falcon: FALCON HAPTIC (0403:cb48) at 1-1", "full speed, 12 Mbit/s", "manufacturer: NOVINT",
        "node: /dev/bus/usb/001/002", "kernel driver of interface 0: ftdi_sio",
        "the kernel's driver ftdi_sio bound to interface 0",
        "endpoint 0x81 IN: bulk, packets of 64 bytes, interval 0",
        "Force Dimension haptic device: omega.x haptic device (1451:0402) at 1-2", "high speed, 480 Mbit/s",
        "the vendor's library (libdrd)", "/dev/bus/usb/001/007 may be read and written"}) {
    EXPECT_TRUE(result.said(part)) << part << "\n" << result.output;
  }
  EXPECT_FALSE(result.said("0781")) << result.output;
  std::ifstream written(file);
  EXPECT_EQ((std::string{std::istreambuf_iterator<char>(written), {}}), result.output);
  EXPECT_EQ(falcon.counts().opens + omega.counts().opens + stick.counts().opens, 0);
}

TEST_F(UsbDevicesTest, ProbeShowsWhatIsAskedFor) {
  const MockUsbDevice omega(*bus_, kOmega);
  const MockUsbDevice stick(*bus_, {.vendor = 0x0781, .product = 0x5567, .port = 3, .address = 9});
  EXPECT_TRUE(probe({"--vendor", "0781"}).said("(0781:5567) at 1-3"));
  EXPECT_FALSE(probe({"--vendor", "0781"}).said("1451"));
  EXPECT_TRUE(probe({"--vendor", "0x1451", "--product", "402"}).said("(1451:0402)"));
  const support::SpawnResult all = probe({"--all"});
  EXPECT_TRUE(all.said("(0781:5567)") && all.said("(1451:0402)") && all.said("at usb1")) << all.output;
  EXPECT_EQ(probe({"--vendor", "falcon"}).exit_code, 2);
}

TEST_F(UsbDevicesTest, ProbeThatFindsNothingSaysWhatToCheck) {
  const MockUsbDevice stick(*bus_, {.vendor = 0x1451, .product = 0x9999});
  const std::vector<std::vector<std::string>> questions{{"--vendor", "0403"},
                                                        {"--vendor", "1451", "--product", "0402"}};
  for (const std::vector<std::string>& question : questions) {
    const support::SpawnResult result = probe(question);
    EXPECT_EQ(result.exit_code, 3) << result.output;
    EXPECT_TRUE(result.said("cable")) << result.output;
  }
  EXPECT_TRUE(probe({"--vendor", "1451", "--product", "0402"})
                  .said("of this vendor there is FALCON HAPTIC (1451:9999) at 1-1"));
}

TEST_F(UsbDevicesTest, ProbeSaysWhichVendorIsMissing) {
  EXPECT_TRUE(probe({"--vendor", "1451"}).said("look for devices"));
  EXPECT_EQ(judge_access(absence_facts(UsbContext(), {.vendor = 0x1451})).found,
            "no device of vendor 1451 on the bus");
}

TEST_F(UsbDevicesTest, ProbeFindsNoMasterAmongOthers) {
  const MockUsbDevice stick(*bus_, {.vendor = 0x0781, .product = 0x5567});
  const support::SpawnResult result = probe({});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_TRUE(result.said("expected a haptic device, found none among 2 devices")) << result.output;
}

TEST_F(UsbDevicesTest, MalformedDescriptorsAreReportedAndNotFatal) {
  support::UsbBytes torn = support::bulk_pair_descriptors(0x1451, 0x0402);
  support::MockUsbOptions options = kOmega;
  torn.resize(torn.size() - 3);
  options.descriptors = torn;
  const MockUsbDevice omega(*bus_, options);
  const support::SpawnResult result = probe({"--all"});
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_TRUE(result.said("malformed, byte 43: a length of 7 where 4 bytes are left")) << result.output;
}

#endif

}  // namespace usb_devices_test
}  // namespace drivers::usb
