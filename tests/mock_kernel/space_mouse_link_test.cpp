// The SpaceMouse as a haptic device: real hidapi on a mocked node, with and without the transport thread.
#include "hal/haptic/space_mouse_link.h"

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <thread>

#include "hal/setup_error.h"
#include "hal/threaded_haptic_device.h"
#include "sim/devices/emulated_space_mouse.h"
#include "tests/support/mock_hidraw_device.h"
#include "tests/support/skip.h"

namespace space_mouse_link_test {

using namespace std::chrono_literals;
using Eigen::Vector3d;
using hal::HapticFault;
using hal::HapticSample;

struct SpaceMouseLinkTest : testing::Test {
  void SetUp() override {
    SKIP_UNLESS(support::runs_under_umockdev(), "needs umockdev's preload");
    bus = std::make_unique<support::MockHidrawBus>();
    mouse = &bus->plug({.vendor = 0x256f,
                        .product = 0xc635,
                        .report_descriptor = sim::devices::EmulatedSpaceMouse({}, {}).report_descriptor()});
  }
  /// Signed, little endian, ±350 at the stop; raw axes: x right, y towards the user, z down.
  void push_cap(std::int16_t x, std::int16_t y, std::int16_t z) { send(1, x, y, z); }
  void turn_cap(std::int16_t x, std::int16_t y, std::int16_t z) { send(2, x, y, z); }
  void send(std::uint8_t id, std::int16_t x, std::int16_t y, std::int16_t z) {
    std::vector<std::uint8_t> report{id};
    for (const std::int16_t axis : {x, y, z}) {
      const auto raw = static_cast<std::uint16_t>(axis);
      report.push_back(static_cast<std::uint8_t>(raw & 0xFFU));
      report.push_back(static_cast<std::uint8_t>(raw >> 8U));
    }
    mouse->send(report);
  }

  std::unique_ptr<support::MockHidrawBus> bus;
  support::MockHidrawDevice* mouse = nullptr;
};

TEST_F(SpaceMouseLinkTest, ThePushedCapIsAGripThatWasMoved) {
  hal::SpaceMouseLink link({.travel_m = 0.1, .turn_rad = 0.5});
  link.open();
  EXPECT_TRUE(link.info().rate_only);
  EXPECT_EQ(link.info().force_limit_N, 0.0);
  EXPECT_NE(link.info().name.find("SpaceMouse Compact"), std::string::npos) << link.info().name;

  HapticSample sample;
  ASSERT_TRUE(link.exchange({true, Vector3d(5, 0, 0)}, 10ms, sample).ok());
  EXPECT_EQ(sample.p_HD_m, Vector3d::Zero()) << "silence is rest";
  EXPECT_EQ(sample.stamp, 10ms) << "and fresh";

  push_cap(350, 0, 0);
  ASSERT_TRUE(link.exchange({}, 20ms, sample).ok());
  EXPECT_TRUE(sample.p_HD_m.isApprox(Vector3d(0, 0.1, 0), 1e-9)) << "right: " << sample.p_HD_m.transpose();
  push_cap(0, 175, 0);
  ASSERT_TRUE(link.exchange({}, 30ms, sample).ok());
  EXPECT_TRUE(sample.p_HD_m.isApprox(Vector3d(0.05, 0, 0), 1e-9))
      << "towards the user: " << sample.p_HD_m.transpose();
  push_cap(0, 0, 350);
  ASSERT_TRUE(link.exchange({}, 40ms, sample).ok());
  EXPECT_TRUE(sample.p_HD_m.isApprox(Vector3d(0, 0, -0.1), 1e-9)) << "down: " << sample.p_HD_m.transpose();

  // About the axis to the right: the far side of the cap goes up, as a right-handed turn has it.
  turn_cap(350, 0, 0);
  ASSERT_TRUE(link.exchange({}, 50ms, sample).ok());
  EXPECT_NEAR(Eigen::AngleAxisd(sample.q_HD).angle(), 0.5, 1e-9);
  EXPECT_NEAR(std::abs(Eigen::AngleAxisd(sample.q_HD).axis().y()), 1.0, 1e-9);
}

TEST_F(SpaceMouseLinkTest, UnpluggedTheCapIsNotHeldByAnybody) {
  hal::SpaceMouseLink link({});
  link.open();
  push_cap(350, 0, 0);
  HapticSample sample;
  ASSERT_TRUE(link.exchange({}, 10ms, sample).ok());
  mouse->unplug();
  EXPECT_EQ(link.exchange({}, 20ms, sample).fault, HapticFault::kUnplugged);
  EXPECT_TRUE(link.close());
  EXPECT_EQ(link.exchange({}, 30ms, sample).fault, HapticFault::kNotActive);
  EXPECT_THROW(link.open(), hal::SetupError);
}

TEST_F(SpaceMouseLinkTest, ThroughTheTransportThreadToo) {
  hal::ThreadedHapticDevice device(std::make_unique<hal::SpaceMouseLink>(hal::SpaceMouseLinkConfig{}),
                                   {.stale_after = 100ms, .command_timeout = 100ms});
  device.activate();
  push_cap(0, -350, 0);
  HapticSample sample;
  const auto deadline = std::chrono::steady_clock::now() + 60s;
  // It goes back to rest after 150 ms of silence, so a busy machine may need the report again.
  while (sample.p_HD_m.x() > -0.04 && std::chrono::steady_clock::now() < deadline) {
    (void)device.exchange({}, sample);
    push_cap(0, -350, 0);
    std::this_thread::sleep_for(1ms);
  }
  EXPECT_NEAR(sample.p_HD_m.x(), -0.05, 1e-9);
  mouse->unplug();
  hal::HapticStatus status;
  while (status.fault != HapticFault::kUnplugged && std::chrono::steady_clock::now() < deadline) {
    status = device.exchange({}, sample);
    std::this_thread::sleep_for(1ms);
  }
  EXPECT_EQ(status.fault, HapticFault::kUnplugged);
  EXPECT_TRUE(device.deactivate());
}

TEST(SpaceMouseLink, RefusesScalesThatMakeNoSense) {
  EXPECT_THROW(hal::SpaceMouseLink({.travel_m = 0.0}), hal::SetupError);
  EXPECT_THROW(hal::SpaceMouseLink({.turn_rad = 4.0}), hal::SetupError);
}

}  // namespace space_mouse_link_test
