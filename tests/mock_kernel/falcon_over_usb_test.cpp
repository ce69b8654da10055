// The Falcon's driver on the real port and the real libusb, with the emulated device behind a mocked kernel.
#include <gtest/gtest.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "drivers/haptic/falcon.h"
#include "drivers/usb/libusb_port.h"
#include "drivers/usb/usb_devices.h"
#include "sim/devices/emulated_falcon.h"
#include "tests/support/mock_falcon.h"
#include "tests/support/mock_usb_device.h"
#include "tests/support/skip.h"
#include "tests/support/slow_port.h"

namespace drivers::haptic {
namespace falcon_over_usb_test {

using namespace std::chrono_literals;
using sim::devices::EmulatedFalcon;
using sim::devices::EmulatedFalconOptions;
using support::UsbBytes;
using usb::TransferResult;
using usb::TransferStatus;

constexpr int kIn = 0x81;

UsbBytes image() {
  UsbBytes bytes(5 * 62 + 7);
  std::uint8_t value = 0x5A;
  for (std::uint8_t& byte : bytes) byte = value = static_cast<std::uint8_t>(value * 5 + 17);
  return bytes;
}

/// The longest times that are allowed, and ten times as long on the slow port: this machine may be busy.
FalconConfig patient() {
  FalconConfig config;
  config.reply_deadline = 20ms;
  config.lost_after_misses = 10;
  config.boot.alive_packets = 40;
  config.boot.alive_timeout = 5ms;
  config.boot.query_timeout = 2s;
  config.boot.echo_timeout = 2s;
  config.boot.write_timeout = 5s;
  return config;
}

class FalconOverUsb : public testing::Test {
 protected:
  void SetUp() override {
    SKIP_UNLESS(support::in_mock_kernel(), "needs umockdev's library loaded first");
    bus_ = std::make_unique<support::MockUsbBus>();
  }
  void TearDown() override {
    falcon_.reset();
    port_.reset();
  }

  void plug_in(EmulatedFalconOptions options = {}) {
    far_ = std::make_unique<support::MockFalcon>(*bus_, std::move(options));
    context_ = std::make_unique<usb::UsbContext>();
    const auto found = context_->devices({.vendor = 0x0403, .product = 0xcb48});
    ASSERT_EQ(found.size(), 1U);
    auto opened = usb::LibusbPort::open(*context_, found[0], {.interface = 0, .out = 0x02, .in = kIn}, "");
    ASSERT_TRUE(opened.port) << opened.refusal.found;
    port_ = std::make_unique<support::SlowPort>(std::move(opened.port));
    falcon_ = std::make_unique<Falcon>(*port_, patient());
  }
  /// Running, with the ends of its encoders found.
  void plug_in_homed() {
    plug_in({.firmware_running = true});
    ASSERT_NO_FATAL_FAILURE();
    EXPECT_EQ(falcon_->activate(), falcon::Firmware::kWasRunning);
    far_->with([](EmulatedFalcon& device) { device.pull_and_push(); });
    DeviceSample sample;
    ASSERT_TRUE(exchange_until({}, sample, [] { return true; }));
  }

  /// Exchanges until there is a position and the samples are as wanted; a late reply is no failure here.
  /// False when it takes too long or the device is lost.
  bool exchange_until(
      const Vector3& force_N, DeviceSample& sample, const std::function<bool()>& wanted,
      const std::function<bool()>& over = [] { return false; }) {
    const auto deadline = std::chrono::steady_clock::now() + 60s;
    while (std::chrono::steady_clock::now() < deadline) {
      status_ = falcon_->exchange(force_N, sample);
      if (status_.ok() && wanted()) return true;
      if (over()) return false;
      if (status_.fault == HapticFault::kLost) (void)falcon_->activate();
      if (status_.fault == HapticFault::kUnplugged) return false;
    }
    return false;
  }

  std::unique_ptr<support::MockUsbBus> bus_;
  std::unique_ptr<support::MockFalcon> far_;
  std::unique_ptr<usb::UsbContext> context_;
  std::unique_ptr<support::SlowPort> port_;
  std::unique_ptr<Falcon> falcon_;
  DeviceStatus status_;
};

TEST_F(FalconOverUsb, ColdDeviceBootsHomesPushesAndIsLeftAtZero) {
  ASSERT_NO_FATAL_FAILURE(plug_in({.image = image()}));
  EXPECT_EQ(falcon_->activate(image()), falcon::Firmware::kLoaded);
  EXPECT_EQ(far_->with([](EmulatedFalcon& device) { return device.loaded(); }), image());

  DeviceSample sample;
  EXPECT_FALSE(exchange_until(
      {1, 0, 0}, sample, [] { return true; }, [&] { return status_.fault == HapticFault::kNotReady; }));
  EXPECT_EQ(status_.fault, HapticFault::kNotReady);
  EXPECT_EQ(status_.f_D_H_N, Vector3{}) << "no force before the ends were found";

  far_->with([](EmulatedFalcon& device) {
    device.pull_and_push();
    device.move_grip({0.01, -0.02, 0.14});
    device.press(0b0101);
  });
  const Vector3 force_N{1.0, -0.5, 2.0};
  const auto at_full_force = [&] { return status_.f_D_H_N == force_N; };
  ASSERT_TRUE(exchange_until(force_N, sample, at_full_force));
  EXPECT_EQ(sample.buttons, 0b0101U);
  // The encoders resolve about 0.05 mm, and the force is rounded to motor counts of some 5 mN.
  // Frame H is the device's own with x towards the user, y right and z up.
  const Vector3 place_m{0.14 - patient().p_FO_m[2], 0.01, -0.02};
  const auto made_N = far_->with([](EmulatedFalcon& device) { return device.force_N(); });
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(sample.p_HD_m[k], place_m[k], 1e-4) << k;
    EXPECT_NEAR(made_N[k], force_N[(k + 1) % 3], 0.05) << k;
  }

  EXPECT_TRUE(falcon_->deactivate());
  EXPECT_EQ(far_->with([](EmulatedFalcon& device) { return device.motors(); }),
            (std::array<std::int16_t, 3>{}));
}

TEST_F(FalconOverUsb, WrongEchoIsMendedByAnotherLoad) {
  ASSERT_NO_FATAL_FAILURE(plug_in({.image = image()}));
  far_->with([](EmulatedFalcon& device) { device.spoil_echo(1, 2); });
  EXPECT_EQ(falcon_->activate(image()), falcon::Firmware::kLoaded);
  EXPECT_EQ(far_->with([](EmulatedFalcon& device) { return device.boots(); }), 2);
  EXPECT_EQ(far_->with([](EmulatedFalcon& device) { return device.loaded(); }), image());
}

TEST_F(FalconOverUsb, MissingReplyIsMissedAndTheNextOneComes) {
  ASSERT_NO_FATAL_FAILURE(plug_in_homed());
  far_->with([](EmulatedFalcon& device) { device.drop_replies(1); });
  DeviceSample sample;
  status_ = falcon_->exchange({}, sample);
  EXPECT_EQ(status_.fault, HapticFault::kMissed);
  EXPECT_EQ(status_.detail, static_cast<int>(TransferStatus::kTimeout));
  EXPECT_TRUE(exchange_until({}, sample, [] { return true; }));
}

TEST_F(FalconOverUsb, GarbageInAReplyIsSkipped) {
  ASSERT_NO_FATAL_FAILURE(plug_in_homed());
  DeviceSample sample;
  far_->with([](EmulatedFalcon& device) { device.insert_into_replies(1, 5, 'x'); });
  EXPECT_EQ(falcon_->exchange({}, sample).fault, HapticFault::kMissed) << "a reply that was spoilt is none";
  far_->with([](EmulatedFalcon& device) { device.press(0b1000); });
  ASSERT_TRUE(exchange_until({}, sample, [] { return true; }));
  EXPECT_EQ(sample.buttons, 0b1000U);
}

TEST_F(FalconOverUsb, StallIsOneMissAndThePipesGoOn) {
  ASSERT_NO_FATAL_FAILURE(plug_in_homed());
  DeviceSample sample;
  far_->with([](EmulatedFalcon& device) { device.stall(1); });
  status_ = falcon_->exchange({}, sample);
  EXPECT_EQ(status_.fault, HapticFault::kMissed);
  EXPECT_EQ(status_.detail, static_cast<int>(TransferStatus::kStalled));
  EXPECT_TRUE(exchange_until({}, sample, [] { return true; }));

  far_->usb().fail_in(kIn, -EPIPE);
  status_ = falcon_->exchange({}, sample);
  EXPECT_EQ(status_.fault, HapticFault::kMissed);
  EXPECT_EQ(status_.detail, static_cast<int>(TransferStatus::kStalled));
  EXPECT_TRUE(exchange_until({}, sample, [] { return true; }));
  EXPECT_EQ(far_->usb().counts().clear_halts, 2);
}

TEST_F(FalconOverUsb, UnpluggedInMidTransferIsUnpluggedForEver) {
  ASSERT_NO_FATAL_FAILURE(plug_in_homed());
  DeviceSample sample;
  far_->usb().hold_out();
  const int written = far_->usb().counts().out_submitted;
  std::thread hand([&] {
    const auto deadline = std::chrono::steady_clock::now() + 60s;
    while (far_->usb().counts().out_submitted == written && std::chrono::steady_clock::now() < deadline) {
    }
    far_->usb().unplug();
  });
  EXPECT_FALSE(exchange_until({}, sample, [] { return true; }));
  EXPECT_EQ(status_.fault, HapticFault::kUnplugged);
  hand.join();
  EXPECT_EQ(falcon_->exchange({}, sample).fault, HapticFault::kUnplugged);
  EXPECT_TRUE(falcon_->deactivate()) << "no force was on";
}

TEST_F(FalconOverUsb, UnpluggedUnderForceSaysThatItMayStillBeOn) {
  ASSERT_NO_FATAL_FAILURE(plug_in_homed());
  DeviceSample sample;
  ASSERT_TRUE(exchange_until({2, 0, 0}, sample, [&] { return status_.f_D_H_N[0] > 1.0; }));
  far_->usb().unplug();
  EXPECT_FALSE(exchange_until({}, sample, [] { return false; }));
  EXPECT_EQ(status_.fault, HapticFault::kUnplugged);
  EXPECT_FALSE(falcon_->deactivate());
}

}  // namespace falcon_over_usb_test
}  // namespace drivers::haptic
