// Real drivers behind hal::HapticLink: axes, texts of codes, and rejections.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <numbers>
#include <stdexcept>
#include <string>

#include "drivers/setup_error.h"
#include "hal/haptic/falcon_link.h"
#include "hal/haptic/force_dimension_link.h"
#include "hal/setup_error.h"
#include "sim/devices/emulated_falcon.h"
#include "tests/drivers/falcon_fakes.h"
#include "tests/drivers/force_dimension_fakes.h"

namespace haptic_links_test {

using namespace std::chrono_literals;
using Eigen::Vector3d;
using hal::HapticFault;
using hal::HapticSample;
using hal::HapticStatus;

bool says(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

/// What opening refused with.
std::string refusal_of(hal::HapticLink& link) {
  try {
    link.open();
  } catch (const hal::SetupError& error) {
    return error.what();
  }
  return "opened";
}

struct FalconLinkTest : testing::Test {
  void open_and_home() {
    link.open();
    for (int i = 0; i < 5; ++i) (void)exchange();
    falcon.pull_and_push();
    for (int i = 0; i < 5; ++i) (void)exchange();
  }
  const HapticStatus& exchange(const Vector3d& force_N = Vector3d::Zero(), bool enable = true) {
    now += 1ms;
    return status = link.exchange({enable, force_N}, now, sample);
  }

  sim::devices::EmulatedFalcon falcon{{.firmware_running = true}};
  std::chrono::nanoseconds now = 5s;
  HapticSample sample;
  HapticStatus status;
  hal::FalconLink link{
      [this] { return std::make_unique<drivers::haptic::tests::WatchedPort>(falcon); }, {}, {}};
};

TEST_F(FalconLinkTest, BeforeItsEndsAreFoundThereIsNoPositionAndItSaysWhatToDo) {
  link.open();
  EXPECT_EQ(exchange().fault, HapticFault::kNotReady);
  EXPECT_EQ(sample.stamp, 0ns);
  EXPECT_TRUE(says(link.describe(status), "pull the handle all the way out"));
  EXPECT_TRUE(says(link.info().warnings.at(0), "watchdog"));
}

TEST_F(FalconLinkTest, ItsAxesAreTowardsTheUserRightAndUp) {
  open_and_home();
  // The Falcon's: x right, y up, z towards the user, with the origin 0.13 m before its base.
  falcon.move_grip({0.010, -0.005, 0.150});
  (void)exchange();
  ASSERT_TRUE(exchange().ok());
  EXPECT_EQ(sample.stamp, now);
  // An encoder count is 0.05 mm.
  EXPECT_TRUE((sample.p_HD_m - Vector3d(0.020, 0.010, -0.005)).norm() < 1e-4) << sample.p_HD_m.transpose();
}

TEST_F(FalconLinkTest, AForceArrivesInTheSameDirection) {
  open_and_home();
  const Vector3d wanted_N(1.0, -2.0, 0.5);
  ASSERT_TRUE(exchange(wanted_N).ok());
  const auto made_N = falcon.force_N();
  EXPECT_TRUE((Vector3d(made_N[2], made_N[0], made_N[1]) - wanted_N).norm() < 0.02);
  EXPECT_TRUE((status.f_D_H_N - wanted_N).norm() < 1e-6) << status.f_D_H_N.transpose();
  (void)exchange(wanted_N, false);
  EXPECT_EQ(falcon.motors(), (std::array<std::int16_t, 3>{}));
  EXPECT_EQ(status.f_D_H_N, Vector3d::Zero());
}

TEST_F(FalconLinkTest, AMissingReplyIsNothingNewAndSeveralAreALostDevice) {
  open_and_home();
  ASSERT_TRUE(exchange().ok());
  const auto stamp = sample.stamp;
  falcon.drop_replies(1);
  EXPECT_EQ(exchange({3, 0, 0}).fault, HapticFault::kMissed);
  EXPECT_EQ(sample.stamp, stamp);
  EXPECT_NEAR(status.f_D_H_N.x(), 3.0, 1e-6) << "it went out all the same";
  falcon.drop_replies(100);
  for (int i = 0; i < 3; ++i) (void)exchange();
  EXPECT_EQ(status.fault, HapticFault::kLost);
  EXPECT_TRUE(hal::needs_reopening(status.fault));
  EXPECT_TRUE(says(link.describe(status), "several replies missing")) << link.describe(status);
}

TEST_F(FalconLinkTest, CountsThatFitNoPositionAreABadSampleWithoutForce) {
  open_and_home();
  ASSERT_TRUE(exchange({3, 0, 0}).ok());
  falcon.send_counts(2, {30'000, -30'000, 30'000});
  EXPECT_EQ(exchange({3, 0, 0}).fault, HapticFault::kBadSample);
  EXPECT_TRUE(says(link.describe(status), "counts")) << link.describe(status);
  EXPECT_EQ(exchange({3, 0, 0}).f_D_H_N, Vector3d::Zero());
}

TEST_F(FalconLinkTest, UnpluggedItSaysSo) {
  open_and_home();
  falcon.unplug();
  EXPECT_EQ(exchange().fault, HapticFault::kUnplugged);
  EXPECT_TRUE(link.close());
  EXPECT_EQ(exchange().fault, HapticFault::kNotActive);
}

TEST(FalconLink, WhatThePortRefusesIsToldAsASetupErrorAndNothingStaysOpen) {
  hal::FalconLink link(
      []() -> std::unique_ptr<drivers::usb::UsbPort> {
        throw drivers::SetupError({"Novint Falcon", "open", "access", "mode 0600", "install the rule"});
      },
      {}, {});
  const std::string text = refusal_of(link);
  EXPECT_TRUE(says(text, "Novint Falcon: open") && says(text, "install the rule")) << text;
  HapticSample sample;
  EXPECT_EQ(link.exchange({}, 0ns, sample).fault, HapticFault::kNotActive);
}

struct ForceDimensionLinkTest : testing::Test {
  void make() {
    config.sdk.file = stand_in.path();
    config.device.wait = [this](std::chrono::nanoseconds time) { pass(time); };
    link = std::make_unique<hal::ForceDimensionLink>(config);
  }
  void pass(std::chrono::nanoseconds time) {
    now += time;
    stand_in.control().advance(std::chrono::duration<double>(time).count());
  }
  const HapticStatus& exchange(const Vector3d& force_N = Vector3d::Zero(), bool enable = true) {
    status = link->exchange({enable, force_N}, now, sample);
    pass(1ms);
    return status;
  }

  support::TemporaryDirectory folder;
  drivers::haptic::StandIn stand_in{folder, "library.so"};
  hal::ForceDimensionLinkConfig config;
  std::chrono::nanoseconds now = 1s;
  std::unique_ptr<hal::ForceDimensionLink> link;
  HapticSample sample;
  HapticStatus status;
};

TEST_F(ForceDimensionLinkTest, TellsWhatItIsAndWhereThePenIs) {
  make();
  link->open();
  EXPECT_TRUE(says(link->info().name, "omega.6"));
  EXPECT_TRUE(says(link->info().name, "4711"));
  EXPECT_EQ(link->info().force_limit_N, 8.0);
  EXPECT_TRUE(link->info().senses_rotation);
  EXPECT_FALSE(link->info().rate_only);
  stand_in.script().hand_holds = true;
  stand_in.script().hand_m = {0.01, -0.02, 0.03};
  stand_in.script().wrist_rad = {0.3, 0, 0};
  stand_in.script().buttons = 1;
  for (int i = 0; i < 3000; ++i) (void)exchange();
  ASSERT_TRUE(status.ok()) << link->describe(status);
  EXPECT_TRUE((sample.p_HD_m - Vector3d(0.01, -0.02, 0.03)).norm() < 2e-3) << sample.p_HD_m.transpose();
  EXPECT_EQ(sample.buttons, 1u);
  EXPECT_NEAR(sample.q_HD.norm(), 1.0, 1e-12);
  EXPECT_NEAR(sample.q_HD.angularDistance(Eigen::Quaterniond::Identity()), 0.3,
              0.09 * std::numbers::pi / 180);
}

TEST_F(ForceDimensionLinkTest, TheReportedForceIsTheOneThatIsOn) {
  make();
  link->open();
  stand_in.script().hand_holds = true;
  ASSERT_TRUE(exchange({0, 4, 0}).ok());
  EXPECT_TRUE(status.withheld) << "the device settles";
  EXPECT_EQ(status.f_D_H_N, Vector3d::Zero());
  for (int i = 0; i < 200; ++i) ASSERT_TRUE(exchange({0, 4, 0}).ok());
  EXPECT_FALSE(status.withheld);
  EXPECT_EQ(status.f_D_H_N.y(), 4.0);
  EXPECT_EQ(stand_in.state().command_N[1], 4.0);
}

TEST_F(ForceDimensionLinkTest, HasTheDevicesReasonInWords) {
  make();
  link->open();
  stand_in.script().hand_holds = true;
  for (int i = 0; i < 200; ++i) ASSERT_TRUE(exchange({0, 1, 0}).ok()) << link->describe(status);
  stand_in.script().hand_holds = false;
  stand_in.script().hand_N = {0, -60, 0};
  for (int i = 0; i < 200 && status.ok(); ++i) (void)exchange({0, 1, 0});
  EXPECT_EQ(status.fault, HapticFault::kForceOff);
  EXPECT_TRUE(says(link->describe(status), "fast")) << link->describe(status);
  EXPECT_EQ(link->describe({HapticFault::kTooFast}), hal::describe(HapticFault::kTooFast))
      << "from the servo";
}

TEST_F(ForceDimensionLinkTest, LooksAtTheBusFirst) {
  bool looked = false;
  config.look_at_bus = [&looked] {
    looked = true;
    throw drivers::SetupError({"Force Dimension device", "look for it", "a device", "none", "plug it in"});
  };
  make();
  const std::string text = refusal_of(*link);
  EXPECT_TRUE(looked);
  EXPECT_TRUE(says(text, "plug it in")) << text;
  EXPECT_FALSE(stand_in.state().open);
}

TEST_F(ForceDimensionLinkTest, DirectlyOverUsbItIsNotSupportedAndSaysWhy) {
  config.transport = hal::ForceDimensionTransport::kUsb;
  make();
  const std::string text = refusal_of(*link);
  EXPECT_TRUE(says(text, "not supported")) << text;
  EXPECT_TRUE(says(text, "publishes")) << text;
  EXPECT_FALSE(stand_in.state().open);
}

}  // namespace haptic_links_test
