// A SpaceMouse in the kernel's HID layer: the driver reads it through hidapi, our rules give access.
#include "drivers/haptic/space_mouse.h"

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <deque>
#include <filesystem>
#include <mutex>
#include <ostream>
#include <span>
#include <string>
#include <thread>
#include <utility>

#include "sim/devices/emulated_space_mouse.h"
#include "tests/guest_kernel/device_node.h"
#include "tests/guest_kernel/uhid_device.h"
#include "tests/guest_kernel/usbip_device.h"
#include "tests/guest_kernel/wait_until.h"

namespace guest {
namespace space_mouse_test {

using drivers::haptic::HapticFault;
using drivers::haptic::SpaceMouse;
using drivers::haptic::SpaceMouseSample;
using sim::devices::EmulatedSpaceMouse;
using sim::devices::SpaceMouseCap;
using sim::devices::SpaceMouseLayout;
using std::chrono::steady_clock;

const NodeAccess kOurs{0660, "plugdev"};
const NodeAccess kKernels{0600, "root"};
constexpr double kStep = 1.0 / 350;  // of what it reports
constexpr HidIdentity kCompact{.vendor = 0x256f, .product = 0xc635};

/// Plugged in; time passes in it as it does outside.
class PluggedMouse {
 public:
  explicit PluggedMouse(SpaceMouseLayout layout)
      : mouse_({.layout = layout}, [this](auto) { return cap_; }),
        device_(kCompact, mouse_.report_descriptor(),
                [this](std::span<const std::uint8_t> report) {
                  const std::scoped_lock lock(mutex_);
                  understood_ = mouse_.take_output(report) && understood_;
                }),
        thread_([this](const std::stop_token& stop) {
          const auto begin = steady_clock::now();
          while (!stop.stop_requested()) {
            std::this_thread::sleep_for(mouse_.period());
            const std::scoped_lock lock(mutex_);
            for (const auto& report : mouse_.advance(steady_clock::now() - begin)) device_.send(report.bytes);
          }
        }) {}

  void hold(const SpaceMouseCap& cap) {
    const std::scoped_lock lock(mutex_);
    cap_ = cap;
  }
  void press(std::uint32_t buttons) {
    const std::scoped_lock lock(mutex_);
    mouse_.press(buttons);
  }
  bool lit() {
    const std::scoped_lock lock(mutex_);
    return mouse_.lit();
  }
  bool understood_all() {
    const std::scoped_lock lock(mutex_);
    return understood_;
  }
  void unplug() {
    thread_ = {};
    device_.unplug();
  }

 private:
  std::mutex mutex_;
  SpaceMouseCap cap_;
  bool understood_ = true;
  EmulatedSpaceMouse mouse_;
  UhidDevice device_;
  std::jthread thread_;
};

/// Opens it when udev is done with it.
SpaceMouse open() {
  const auto node = wait_for([] { return find_hidraw_node(kCompact.vendor, kCompact.product); });
  EXPECT_TRUE(node && access_by_udev(*node));
  return SpaceMouse();
}

class SpaceMouseInKernel : public testing::TestWithParam<SpaceMouseLayout> {
 protected:
  bool poll_until(auto&& condition) {
    return wait_until([&] {
      status_ = driver_.poll(steady_clock::now().time_since_epoch(), sample_);
      return !status_.ok() || condition();
    });
  }

  PluggedMouse mouse_{GetParam()};
  SpaceMouse driver_{open()};
  SpaceMouseSample sample_;
  drivers::haptic::SpaceMouseStatus status_;
};

TEST_P(SpaceMouseInKernel, DeflectionAndButtonsArriveAndRestIsRest) {
  mouse_.hold({.translation = {0.5, -1.0, 0.25}, .rotation = {-0.5, 0.75, 1.0}});
  EXPECT_TRUE(poll_until(
      [&] { return sample_.deflection.translation[0] != 0 && sample_.deflection.rotation[0] != 0; }));
  const drivers::haptic::SpaceMouseDeflection held = sample_.deflection;
  const std::array<double, 3> translation{0.5, -1.0, 0.25};
  const std::array<double, 3> rotation{-0.5, 0.75, 1.0};
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(held.translation[k], translation[k], kStep) << "xyz"[k];
    EXPECT_NEAR(held.rotation[k], rotation[k], kStep) << "xyz"[k];
  }
  mouse_.press(0b10);
  EXPECT_TRUE(poll_until([&] { return sample_.buttons == 0b10; }));
  mouse_.hold({});
  EXPECT_TRUE(poll_until([&] { return sample_.deflection == drivers::haptic::SpaceMouseDeflection{}; }));
  EXPECT_TRUE(status_.ok());
  EXPECT_EQ(driver_.unknown_reports(), 0U);
}

TEST_P(SpaceMouseInKernel, LightIsOnWhileItIsOpen) {
  EXPECT_TRUE(wait_until([&] { return mouse_.lit(); }));
  EXPECT_TRUE(mouse_.understood_all());
}

TEST_P(SpaceMouseInKernel, UnpluggedIsReportedAndStays) {
  mouse_.unplug();
  EXPECT_TRUE(poll_until([] { return false; }));
  EXPECT_EQ(status_.fault, HapticFault::kUnplugged);
  EXPECT_EQ(driver_.poll({}, sample_).fault, HapticFault::kUnplugged);
  EXPECT_THROW(SpaceMouse(), drivers::SetupError);
}

INSTANTIATE_TEST_SUITE_P(Layouts, SpaceMouseInKernel,
                         testing::Values(SpaceMouseLayout::kTwoReports, SpaceMouseLayout::kOneReport),
                         [](const auto& test) {
                           return std::string(test.param == SpaceMouseLayout::kTwoReports ? "TwoReports"
                                                                                          : "OneReport");
                         });

/// A SpaceNavigator on a cable. The kernel gives it to its driver for Logitech's devices, which takes real
/// USB only.
class NavigatorFunction final : public UsbFunction {
 public:
  Handshake control(const UsbSetup& setup, Bytes& data) override {
    // Requests of a HID device (HID 1.11, 7.1 and 7.2).
    constexpr std::uint8_t kFromInterface = 0x81;
    constexpr std::uint8_t kToInterface = 0x21;
    constexpr std::uint8_t kGetDescriptor = 6;
    constexpr std::uint8_t kSetReport = 9;
    const std::scoped_lock lock(mutex_);
    if (setup.request_type == kFromInterface && setup.request == kGetDescriptor && setup.value == 0x2200) {
      data = mouse_.report_descriptor();
      return Handshake::kAck;
    }
    const bool taken =
        setup.request_type == kToInterface && setup.request == kSetReport && mouse_.take_output(data);
    return taken ? Handshake::kAck : Handshake::kStall;
  }
  Handshake out(std::uint8_t /*endpoint*/, std::span<const std::uint8_t> /*bytes*/) override {
    return Handshake::kStall;
  }
  Handshake in(std::uint8_t /*endpoint*/, Bytes& packet) override {
    const std::scoped_lock lock(mutex_);
    for (auto& report : mouse_.advance(steady_clock::now() - begin_))
      reports_.push_back(std::move(report.bytes));
    if (reports_.empty()) return Handshake::kNak;
    packet = std::move(reports_.front());
    reports_.pop_front();
    return Handshake::kAck;
  }

  UsbDescription description() const {
    const auto size = static_cast<std::uint16_t>(mouse_.report_descriptor().size());
    return {.identity = {.vendor = 0x046d,
                         .product = 0xc626,
                         .manufacturer_name = "3Dconnexion",
                         .product_name = "SpaceNavigator"},
            .speed = UsbSpeed::kFull,
            .interface_class = 3,
            .class_descriptor = {9, 0x21, 0x11, 0x01, 0, 1, 0x22, static_cast<std::uint8_t>(size),
                                 static_cast<std::uint8_t>(size >> 8U)},
            .endpoints = {{.address = 0x81, .packet_bytes = 8, .interrupt = true}}};
  }
  bool lit() {
    const std::scoped_lock lock(mutex_);
    return mouse_.lit();
  }

 private:
  std::mutex mutex_;
  EmulatedSpaceMouse mouse_{{}, [](auto) { return SpaceMouseCap{.translation = {0, 0, -0.5}}; }};
  steady_clock::time_point begin_ = steady_clock::now();
  std::deque<Bytes> reports_;
};

TEST(SpaceNavigatorInKernel, IsReadThroughItsOwnDriverAndMissedWhenUnplugged) {
  NavigatorFunction function;
  UsbipDevice cable(function.description(), function);
  const auto node = wait_for([] { return find_hidraw_node(0x046d, 0xc626); });
  ASSERT_TRUE(node) << "the kernel did not find it";
  const auto driver = "/sys/class/hidraw" / node->filename() / "device/driver";
  EXPECT_EQ(std::filesystem::read_symlink(driver).filename(), "logitech");
  EXPECT_EQ(access_by_udev(*node), kOurs);
  EXPECT_TRUE(opens_for_a_user(*node, "plugdev"));
  SpaceMouse mouse;
  EXPECT_EQ(mouse.info().model, "SpaceNavigator");
  EXPECT_EQ(mouse.info().path, *node);
  EXPECT_TRUE(mouse.info().warnings.empty()) << mouse.info().warnings.front();
  EXPECT_TRUE(wait_until([&] { return function.lit(); }));
  SpaceMouseSample sample;
  const auto poll = [&] { return mouse.poll(steady_clock::now().time_since_epoch(), sample).ok(); };
  EXPECT_TRUE(wait_until([&] { return poll() && sample.deflection.translation[2] != 0; }));
  EXPECT_NEAR(sample.deflection.translation[2], -0.5, kStep);
  cable.unplug();
  EXPECT_TRUE(wait_until([&] { return !poll(); }));
}

struct Case {
  const char* name;
  HidIdentity identity;
  NodeAccess access;
};
void PrintTo(const Case& device, std::ostream* stream) { *stream << device.name; }

class HidAccess : public testing::TestWithParam<Case> {};

TEST_P(HidAccess, IsForPlugdevWhenTheDeviceIsASpaceMouse) {
  const auto& [name, identity, access] = GetParam();
  const EmulatedSpaceMouse mouse({}, [](auto) { return SpaceMouseCap{}; });
  const UhidDevice device(identity, mouse.report_descriptor(), [](auto) {});
  const auto node = wait_for([&] { return find_hidraw_node(identity.vendor, identity.product); });
  ASSERT_TRUE(node) << "the kernel did not find it";
  EXPECT_EQ(access_by_udev(*node), access) << *node;
  EXPECT_FALSE(opens_for_a_user(*node));
  EXPECT_EQ(opens_for_a_user(*node, "plugdev"), access == kOurs);
}

INSTANTIATE_TEST_SUITE_P(Devices, HidAccess,
                         testing::Values(Case{"Compact", kCompact, kOurs},
                                         Case{"OfLogitechs", {0x046d, 0xc62b}, kOurs},
                                         Case{"Bluetooth", {0x256f, 0xc63a, HidBus::kBluetooth}, kOurs},
                                         Case{"KeyboardOfLogitechs", {0x046d, 0xc31c}, kKernels},
                                         Case{"AnotherVendor", {0x1d6b, 0x0104}, kKernels}),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace space_mouse_test
}  // namespace guest
