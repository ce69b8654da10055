// The Falcon as a haptic device, starting at the bus: found, claimed, homed, loaded, unplugged.
#include "hal/haptic/falcon_link.h"

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>

#include "drivers/haptic/haptic_usb.h"
#include "drivers/setup_error.h"
#include "hal/setup_error.h"
#include "tests/support/mock_falcon.h"
#include "tests/support/mock_usb_device.h"
#include "tests/support/skip.h"
#include "tests/support/slow_port.h"

namespace falcon_link_test {

using namespace std::chrono_literals;
using Eigen::Vector3d;
using hal::HapticFault;
using hal::HapticSample;
using hal::HapticStatus;

struct FalconLinkOnTheBus : testing::Test {
  void SetUp() override {
    SKIP_UNLESS(support::in_mock_kernel(), "needs umockdev's library loaded first");
    bus = std::make_unique<support::MockUsbBus>();
    drivers::haptic::FalconConfig config;
    // The longest that is allowed, and ten times as long on the slow port: this machine may be busy.
    config.reply_deadline = 20ms;
    config.boot.alive_packets = 40;
    config.boot.alive_timeout = 5ms;
    link = std::make_unique<hal::FalconLink>(
        [this] {
          context = std::make_unique<drivers::usb::UsbContext>();
          return std::make_unique<support::SlowPort>(drivers::haptic::open_falcon_port(*context));
        },
        config, std::vector<std::uint8_t>{});
  }
  std::string refusal() {
    try {
      link->open();
    } catch (const hal::SetupError& error) {
      return error.what();
    }
    return "opened";
  }
  /// Exchanges until the status is as wanted; false when that takes too long.
  template <typename Wanted>
  bool exchange_until(const Vector3d& force_N, Wanted wanted) {
    const auto deadline = std::chrono::steady_clock::now() + 60s;
    while (std::chrono::steady_clock::now() < deadline) {
      now += 1ms;
      status = link->exchange({true, force_N}, now, sample);
      if (wanted()) return true;
    }
    return false;
  }

  std::unique_ptr<support::MockUsbBus> bus;
  std::unique_ptr<drivers::usb::UsbContext> context;  // outlives the link
  std::unique_ptr<hal::FalconLink> link;
  std::chrono::nanoseconds now = 1s;
  HapticSample sample;
  HapticStatus status;
};

TEST_F(FalconLinkOnTheBus, FromTheBusToAForceAndBack) {
  support::MockFalcon far(*bus, {.firmware_running = true});
  link->open();
  ASSERT_TRUE(exchange_until(Vector3d::Zero(), [&] { return status.fault == HapticFault::kNotReady; }));
  far.with([](sim::devices::EmulatedFalcon& device) { device.pull_and_push(); });
  ASSERT_TRUE(exchange_until(Vector3d::Zero(), [&] { return status.ok() && sample.stamp == now; }));

  // Towards the user, which is the Falcon's own z.
  ASSERT_TRUE(exchange_until({2, 0, 0}, [&] { return status.f_D_H_N.x() > 1.999; }));
  const auto made_N = far.with([](sim::devices::EmulatedFalcon& device) { return device.force_N(); });
  EXPECT_NEAR(made_N[2], 2.0, 0.02);
  EXPECT_NEAR(made_N[0], 0.0, 0.02);

  EXPECT_TRUE(link->close());
  EXPECT_EQ(far.with([](sim::devices::EmulatedFalcon& device) { return device.motors(); }),
            (std::array<std::int16_t, 3>{}));
  link->open();  // and once more
  EXPECT_TRUE(exchange_until(Vector3d::Zero(), [&] { return status.ok() && sample.stamp == now; }));
}

TEST_F(FalconLinkOnTheBus, LostItIsOpenedAgainAndReportsTheCurrentPosition) {
  support::MockFalcon far(*bus, {.firmware_running = true});
  link->open();
  far.with([](sim::devices::EmulatedFalcon& device) { device.pull_and_push(); });
  ASSERT_TRUE(exchange_until(Vector3d::Zero(), [&] { return status.ok() && sample.stamp == now; }));
  far.usb().hold_out();
  ASSERT_TRUE(exchange_until(Vector3d::Zero(), [&] { return status.fault == HapticFault::kLost; }));
  far.usb().release_out();
  // Lost, it asks on for zero force and reads no reply.
  for (int i = 0; i < 100; ++i) (void)link->exchange({true, Vector3d::Zero()}, now, sample);
  far.with([](sim::devices::EmulatedFalcon& device) { device.move_grip({0.02, 0.0, 0.13}); });
  link->open();
  ASSERT_TRUE(exchange_until(Vector3d::Zero(), [&] { return status.ok() && sample.stamp == now; }));
  EXPECT_NEAR(sample.p_HD_m.y(), 0.02, 1e-3);
}

TEST_F(FalconLinkOnTheBus, UnpluggedItSaysSoAndCannotBeOpened) {
  {
    support::MockFalcon far(*bus, {.firmware_running = true});
    link->open();
    ASSERT_TRUE(exchange_until(Vector3d::Zero(), [&] { return status.fault == HapticFault::kNotReady; }));
    far.usb().unplug();
    EXPECT_TRUE(exchange_until(Vector3d::Zero(), [&] { return status.fault == HapticFault::kUnplugged; }));
  }
  const std::string text = refusal();
  EXPECT_NE(text.find("no 0403:cb48 on the bus"), std::string::npos) << text;
}

TEST_F(FalconLinkOnTheBus, HeldByAnotherProgramItSaysSo) {
  support::MockFalcon far(*bus, {.firmware_running = true});
  far.usb().refuse_claims(true);
  const std::string text = refusal();
  EXPECT_NE(text.find("in use by"), std::string::npos) << text;
}

TEST_F(FalconLinkOnTheBus, ColdAndWithoutAnImageItAsksForOne) {
  support::MockFalcon far(*bus, {});
  const std::string text = refusal();
  EXPECT_NE(text.find("firmware"), std::string::npos) << text;
}

}  // namespace falcon_link_test
