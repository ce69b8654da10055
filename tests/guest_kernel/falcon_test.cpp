// The Falcon's driver on libusb and the kernel's USB: everything except the hardware. The emulated device is
// behind the kernel's virtual host controller.
#include "drivers/haptic/falcon.h"

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "drivers/usb/ftdi_serial.h"
#include "drivers/usb/libusb_port.h"
#include "drivers/usb/usb_devices.h"
#include "sim/devices/emulated_falcon.h"
#include "tests/guest_kernel/device_node.h"
#include "tests/guest_kernel/usbip_device.h"
#include "tests/guest_kernel/wait_until.h"
#include "tests/support/slow_port.h"

namespace guest {
namespace falcon_test {

using namespace std::chrono_literals;
using drivers::haptic::Falcon;
using drivers::haptic::FalconConfig;
using drivers::haptic::HapticFault;
using drivers::usb::LibusbPort;
using drivers::usb::TransferStatus;
using drivers::usb::UsbArrival;
using drivers::usb::UsbContext;
using drivers::usb::UsbDevice;
using sim::devices::EmulatedFalcon;
using std::chrono::steady_clock;

constexpr std::uint16_t kVendor = 0x0403;
constexpr std::uint16_t kProduct = 0xcb48;
constexpr drivers::usb::UsbPipes kPipes{.interface = 0, .out = 0x02, .in = 0x81};

/// The emulated device's USB side. Its own time runs ahead as fast as it is asked; here each packet that says
/// "nothing received" takes as long as in the chip.
class FalconFunction final : public UsbFunction {
 public:
  explicit FalconFunction(sim::devices::EmulatedFalconOptions options = {}) : device_(std::move(options)) {}

  Handshake control(const UsbSetup& setup, Bytes& /*data*/) override {
    constexpr std::uint8_t kVendorOut = 0x40;
    if (setup.request_type != kVendorOut) return Handshake::kStall;
    const std::scoped_lock lock(mutex_);
    if (setup.request == static_cast<std::uint8_t>(drivers::usb::ftdi::Request::kLatencyTimer))
      latency_ = std::chrono::milliseconds(setup.value);
    return handshake(device_.control_out(setup.request, setup.value, setup.index));
  }
  Handshake out(std::uint8_t /*endpoint*/, std::span<const std::uint8_t> bytes) override {
    const std::scoped_lock lock(mutex_);
    return handshake(device_.write(bytes, 1s));
  }
  Handshake in(std::uint8_t /*endpoint*/, Bytes& packet) override {
    const std::scoped_lock lock(mutex_);
    const auto now = steady_clock::now();
    const bool chip_reports = now - last_packet_ >= latency_;
    packet.resize(drivers::usb::ftdi::kPacketBytes);
    const auto result = device_.read(packet, chip_reports ? latency_ : latency_ - 1ns);
    packet.resize(result.size);
    if (result.ok()) last_packet_ = now;
    return handshake(result);
  }

  /// Any thread.
  template <typename Action>
  auto with_device(Action&& action) {
    const std::scoped_lock lock(mutex_);
    return action(device_);
  }

 private:
  static Handshake handshake(const drivers::usb::TransferResult& result) {
    if (result.ok()) return Handshake::kAck;
    return result.status == TransferStatus::kTimeout ? Handshake::kNak : Handshake::kStall;
  }

  std::mutex mutex_;
  EmulatedFalcon device_;
  std::chrono::nanoseconds latency_ = 16ms;  // as after power-on
  steady_clock::time_point last_packet_;
};

UsbDescription falcon_description() {
  return {.identity = {.vendor = kVendor,
                       .product = kProduct,
                       .manufacturer_name = "Novint",
                       .product_name = "FALCON HAPTIC"},
          .speed = UsbSpeed::kFull,
          .endpoints = {{.address = kPipes.in}, {.address = kPipes.out}}};
}

std::vector<std::uint8_t> image() {
  std::vector<std::uint8_t> bytes(62 * 6 + 14);  // full chunks, whose echo fills a packet, and a rest
  std::uint8_t value = 0x3C;
  for (std::uint8_t& byte : bytes) byte = value = static_cast<std::uint8_t>(value * 5 + 17);
  return bytes;
}

/// The longest times that are allowed, and ten times as long on the slow port: the processor is emulated, and
/// shared.
FalconConfig patient() {
  return {
      .reply_deadline = 20ms, .lost_after_misses = 10, .boot = {.alive_packets = 20, .alive_timeout = 5ms}};
}

class FalconInKernel : public testing::Test {
 protected:
  void plug_in(sim::devices::EmulatedFalconOptions options = {}) {
    function_ = std::make_unique<FalconFunction>(std::move(options));
    cable_ = std::make_unique<UsbipDevice>(falcon_description(), *function_);
    const auto node = wait_for([] { return find_usb_node(kVendor, kProduct); });
    ASSERT_TRUE(node && access_by_udev(*node));
    // udev notifies libusb last.
    std::vector<UsbDevice> found;
    ASSERT_TRUE(wait_until([&] {
      found = context_.devices({.vendor = kVendor, .product = kProduct});
      return !found.empty();
    }));
    EXPECT_EQ(found[0].product_name, "FALCON HAPTIC");
    EXPECT_EQ(found[0].speed, drivers::usb::UsbSpeed::kFull);
    const auto open = [&] { return LibusbPort::open(context_, found[0], kPipes, "60-novint-falcon.rules"); };
    auto opened = open();
    // The kernel may announce a device before it has configured it.
    wait_until([&] {
      if (!opened.port) opened = open();
      return opened.port != nullptr;
    });
    ASSERT_TRUE(opened.port) << opened.refusal.found << "; " << opened.refusal.hint;
    port_ = std::make_unique<support::SlowPort>(std::move(opened.port));
  }
  bool exchange_until(Falcon& falcon, const std::array<double, 3>& force_N, auto&& condition) {
    return wait_until([&] {
      status_ = falcon.exchange(force_N, sample_);
      const bool over = status_.fault == HapticFault::kLost || status_.fault == HapticFault::kUnplugged;
      return over || (status_.ok() && condition());
    });
  }

  std::unique_ptr<FalconFunction> function_;
  std::unique_ptr<UsbipDevice> cable_;
  UsbContext context_;
  std::unique_ptr<support::SlowPort> port_;
  drivers::haptic::DeviceSample sample_;
  drivers::haptic::DeviceStatus status_;
};

TEST_F(FalconInKernel, ColdDeviceIsBootedHomedAndPushes) {
  ASSERT_NO_FATAL_FAILURE(plug_in({.image = image()}));
  Falcon falcon(*port_, patient());
  EXPECT_EQ(falcon.activate(image()), drivers::haptic::falcon::Firmware::kLoaded);
  EXPECT_EQ(function_->with_device([](auto& device) { return device.loaded(); }), image());

  ASSERT_TRUE(wait_until([&] { return falcon.exchange({}, sample_).fault == HapticFault::kNotReady; }));
  function_->with_device([](auto& device) {
    device.pull_and_push();
    device.move_grip({0.01, -0.02, 0.12});
  });
  ASSERT_TRUE(exchange_until(falcon, {}, [] { return true; }));
  EXPECT_TRUE(status_.ok()) << describe(status_.fault);
  // The origin is 0.13 m in front of the base; two counts are less than 0.1 mm.
  EXPECT_NEAR(sample_.p_HD_m[0], -0.01, 1e-4);
  EXPECT_NEAR(sample_.p_HD_m[1], 0.01, 1e-4);
  EXPECT_NEAR(sample_.p_HD_m[2], -0.02, 1e-4);

  EXPECT_TRUE(exchange_until(falcon, {2, 0, 0}, [&] { return status_.f_D_H_N[0] == 2; }));
  EXPECT_TRUE(status_.ok()) << describe(status_.fault);
  EXPECT_NEAR(function_->with_device([](auto& device) { return device.force_N()[2]; }), 2, 0.05);
  EXPECT_TRUE(falcon.deactivate());
  EXPECT_TRUE(wait_until([&] {
    return function_->with_device(
        [](auto& device) { return device.motors() == decltype(device.motors()){}; });
  }));
  EXPECT_EQ(function_->with_device([](auto& device) { return device.malformed_commands(); }), 0);
}

TEST_F(FalconInKernel, CablePulledBetweenExchangesIsReportedAndStays) {
  ASSERT_NO_FATAL_FAILURE(plug_in({.firmware_running = true}));
  Falcon falcon(*port_, patient());
  (void)falcon.activate();
  ASSERT_TRUE(wait_until([&] { return falcon.exchange({}, sample_).fault == HapticFault::kNotReady; }));
  cable_->unplug();
  // Before the kernel has noticed, replies are only missing.
  ASSERT_TRUE(wait_until([] { return !find_usb_node(kVendor, kProduct); }));
  EXPECT_EQ(falcon.exchange({}, sample_).fault, HapticFault::kUnplugged);
  EXPECT_EQ(falcon.exchange({}, sample_).fault, HapticFault::kUnplugged);
}

TEST_F(FalconInKernel, CablePulledInMidTransferEndsIt) {
  ASSERT_NO_FATAL_FAILURE(plug_in({.powered = false}));
  // The chip says "nothing received" now and then: a read ends, the next one waits.
  std::jthread hand([this] {
    std::this_thread::sleep_for(50ms);
    cable_->unplug();
  });
  std::vector<std::uint8_t> buffer(64);
  drivers::usb::TransferResult result;
  EXPECT_TRUE(wait_until([&] {
    result = port_->read(buffer, 10s);
    return !result.ok();
  }));
  EXPECT_EQ(result.status, TransferStatus::kUnplugged);
  EXPECT_EQ(port_->write(buffer, 1s).status, TransferStatus::kUnplugged);
  EXPECT_EQ(port_->control_out(0, 0, 0).status, TransferStatus::kUnplugged);
}

TEST_F(FalconInKernel, StallsAreReportedAndCleared) {
  ASSERT_NO_FATAL_FAILURE(plug_in({.firmware_running = true}));
  std::vector<std::uint8_t> buffer(64);
  function_->with_device([](auto& device) { device.stall(1); });
  drivers::usb::TransferResult result;
  EXPECT_TRUE(wait_until([&] {
    result = port_->read(buffer, 1s);
    return !result.ok() && result.status != TransferStatus::kTimeout;
  }));
  EXPECT_EQ(result.status, TransferStatus::kStalled);
  EXPECT_TRUE(wait_until([&] { return port_->read(buffer, 1s).ok(); }));
  constexpr std::uint8_t kNoRequestOfTheChip = 99;
  EXPECT_EQ(port_->control_out(kNoRequestOfTheChip, 0, 0).status, TransferStatus::kStalled);
  EXPECT_TRUE(port_->control_out(0, 0, 0).ok());
}

TEST_F(FalconInKernel, ComingAndGoingIsSeen) {
  drivers::usb::UsbWatch watch({.vendor = kVendor, .product = kProduct});
  std::vector<UsbArrival> seen;
  const auto poll = [&] {
    for (UsbArrival& arrival : watch.poll(10ms)) seen.push_back(std::move(arrival));
    return !seen.empty();
  };
  EXPECT_TRUE(watch.poll().empty());
  ASSERT_NO_FATAL_FAILURE(plug_in());
  ASSERT_TRUE(wait_until(poll));
  ASSERT_EQ(seen.size(), 1U);
  EXPECT_EQ(seen[0].kind, UsbArrival::Kind::kCame);
  EXPECT_EQ(seen[0].device.vendor, kVendor);
  const std::string place = seen[0].device.port_path;
  EXPECT_FALSE(place.empty());
  seen.clear();
  cable_->unplug();
  ASSERT_TRUE(wait_until(poll));
  ASSERT_EQ(seen.size(), 1U);
  EXPECT_EQ(seen[0].kind, UsbArrival::Kind::kWent);
  EXPECT_EQ(seen[0].device.port_path, place);
}

}  // namespace falcon_test
}  // namespace guest
