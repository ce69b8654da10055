// hal::HapticDevice over a hand: force limits, faults and stamps.
#include "hal/loopback_haptic_device.h"

#include <gtest/gtest.h>

#include <chrono>
#include <limits>

#include "hal/setup_error.h"
#include "sim/hand.h"
#include "tests/support/no_alloc_guard.h"

namespace {

using namespace std::chrono_literals;
using Eigen::Vector3d;
using hal::HapticCommand;
using hal::HapticFault;
using hal::HapticSample;
using hal::HapticStatus;
using hal::LoopbackHapticDevice;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Shows what it is given and records the force.
class FakeHand final : public hal::HandPlant {
 public:
  void measure(HapticSample& sample) noexcept override {
    sample.p_HD_m = position_m;
    sample.v_HD_H_m_per_s = velocity_m_per_s;
    sample.q_HD = rotation;
    sample.buttons = 5;
  }
  void advance(const Vector3d& f_D_H_N, std::chrono::nanoseconds duration) noexcept override {
    force_N = f_D_H_N;
    time += duration;
    ++advances;
  }

  Vector3d position_m = {0.1, 0.2, 0.3};
  Vector3d velocity_m_per_s = {1, 2, 3};
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Vector3d force_N = Vector3d::Zero();
  std::chrono::nanoseconds time{};
  int advances = 0;
};

HapticCommand force(double x, double y, double z) { return {true, Vector3d(x, y, z)}; }
HapticCommand disabled() { return {}; }

class LoopbackHapticDeviceTest : public testing::Test {
 protected:
  HapticStatus exchange(const HapticCommand& command) { return device.exchange(command, sample); }

  FakeHand hand;
  hal::VirtualClock clock;
  LoopbackHapticDevice device{hand, clock, 1ms, {"fake", 12.0, true}};
  HapticSample sample;
};

TEST_F(LoopbackHapticDeviceTest, RefusesAPeriodThatIsNotPositive) {
  EXPECT_THROW(LoopbackHapticDevice(hand, clock, 0ns, {}), hal::SetupError);
  EXPECT_THROW(LoopbackHapticDevice(hand, clock, -1ms, {}), hal::SetupError);
}

TEST_F(LoopbackHapticDeviceTest, SaysWhatItIs) {
  EXPECT_EQ(device.info().name, "fake");
  EXPECT_EQ(device.info().force_limit_N, 12.0);
  EXPECT_TRUE(device.info().senses_rotation);
}

TEST_F(LoopbackHapticDeviceTest, DoesNothingWhileNotActive) {
  sample.stamp = 42ns;
  EXPECT_EQ(exchange(force(1, 0, 0)).fault, HapticFault::kNotActive);
  device.activate();
  ASSERT_TRUE(exchange(disabled()).ok());
  device.deactivate();
  const int advances = hand.advances;
  sample.stamp = 42ns;
  EXPECT_EQ(exchange(force(1, 0, 0)).fault, HapticFault::kNotActive);
  EXPECT_EQ(hand.advances, advances);
  EXPECT_EQ(sample.stamp, 42ns);
}

TEST_F(LoopbackHapticDeviceTest, PassesTheHandOnWithTheTimeOfReading) {
  device.activate();
  clock.sleep_until(33ms);
  ASSERT_TRUE(exchange(disabled()).ok());
  EXPECT_EQ(sample.stamp, 33ms);
  EXPECT_EQ(sample.p_HD_m, Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(sample.v_HD_H_m_per_s, Vector3d(1, 2, 3));
  EXPECT_EQ(sample.buttons, 5u);
  EXPECT_EQ(hand.time, 1ms);
}

TEST_F(LoopbackHapticDeviceTest, RendersForcesOnlyWhileEnabled) {
  device.activate();
  HapticStatus status = exchange(force(1, -2, 3));
  EXPECT_TRUE(status.ok());
  EXPECT_FALSE(status.saturated);
  EXPECT_EQ(hand.force_N, Vector3d(1, -2, 3));
  HapticCommand off = force(1, -2, 3);
  off.enable = false;
  EXPECT_TRUE(exchange(off).ok());
  EXPECT_EQ(hand.force_N, Vector3d::Zero());
}

TEST_F(LoopbackHapticDeviceTest, ScalesAForceBeyondTheLimitAlongItsDirectionAndSaysSo) {
  device.activate();
  const HapticStatus status = exchange(force(30, 0, -40));  // 50 N at a limit of 12 N
  EXPECT_TRUE(status.ok()) << "limiting is not a fault";
  EXPECT_TRUE(status.saturated);
  EXPECT_TRUE(hand.force_N.isApprox(Vector3d(7.2, 0, -9.6), 1e-12)) << hand.force_N.transpose();
  EXPECT_FALSE(exchange(force(0, 12, 0)).saturated) << "the limit itself can be rendered";
}

TEST_F(LoopbackHapticDeviceTest, WithoutForceFeedbackEveryForceIsSaturatedToZero) {
  LoopbackHapticDevice mouse(hand, clock, 1ms, {"mouse", 0.0, true});
  mouse.activate();
  const HapticStatus status = mouse.exchange(force(1, 0, 0), sample);
  EXPECT_TRUE(status.saturated);
  EXPECT_EQ(hand.force_N, Vector3d::Zero());
  EXPECT_FALSE(mouse.exchange(force(0, 0, 0), sample).saturated);
  EXPECT_EQ(hand.force_N, Vector3d::Zero());
}

TEST_F(LoopbackHapticDeviceTest, AForceThatIsNotANumberIsRefusedUntilDisabledOnce) {
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    device.activate();
    ASSERT_TRUE(exchange(force(1, 0, 0)).ok());
    EXPECT_EQ(exchange(force(0, bad, 0)).fault, HapticFault::kBadCommand);
    EXPECT_EQ(hand.force_N, Vector3d::Zero());
    for (int i = 0; i < 3; ++i) {
      EXPECT_EQ(exchange(force(1, 0, 0)).fault, HapticFault::kBadCommand);
      EXPECT_EQ(hand.force_N, Vector3d::Zero());
    }
    EXPECT_TRUE(exchange(disabled()).ok());
    EXPECT_EQ(hand.force_N, Vector3d::Zero());
    EXPECT_TRUE(exchange(force(1, 0, 0)).ok());
    EXPECT_EQ(hand.force_N, Vector3d(1, 0, 0));
  }
}

TEST_F(LoopbackHapticDeviceTest, AMeasurementThatIsNotANumberMeansZeroForceAndKeepsTheLastGoodSample) {
  device.activate();
  clock.sleep_until(10ms);
  ASSERT_TRUE(exchange(force(1, 0, 0)).ok());
  clock.sleep_until(11ms);
  hand.position_m[2] = kNaN;
  EXPECT_EQ(exchange(force(1, 0, 0)).fault, HapticFault::kBadSample);
  EXPECT_EQ(hand.force_N, Vector3d::Zero());
  EXPECT_EQ(sample.p_HD_m[2], 0.3);
  EXPECT_EQ(sample.stamp, 10ms) << "the stamp shows the age";
}

TEST_F(LoopbackHapticDeviceTest, EveryMeasuredQuantityIsChecked) {
  device.activate();
  hand.velocity_m_per_s[0] = kInfinity;
  EXPECT_EQ(exchange(force(1, 0, 0)).fault, HapticFault::kBadSample);
  hand.velocity_m_per_s[0] = 0;
  EXPECT_TRUE(exchange(disabled()).ok());
  hand.rotation.w() = kNaN;
  EXPECT_EQ(exchange(force(1, 0, 0)).fault, HapticFault::kBadSample);
  EXPECT_EQ(hand.force_N, Vector3d::Zero());
}

TEST_F(LoopbackHapticDeviceTest, NeverHandsOutAMeasurementThatIsNotANumber) {
  device.activate();
  ASSERT_TRUE(exchange(force(1, 0, 0)).ok());
  ASSERT_EQ(exchange(force(kNaN, 0, 0)).fault, HapticFault::kBadCommand);
  hand.position_m[0] = kNaN;  // a second fault while the first one is latched
  EXPECT_FALSE(exchange(force(1, 0, 0)).ok());
  EXPECT_TRUE(sample.p_HD_m.allFinite()) << sample.p_HD_m.transpose();
}

TEST_F(LoopbackHapticDeviceTest, FreshSamplesComeThroughAgainWhileABadOneIsStillLatched) {
  device.activate();
  hand.position_m[0] = kNaN;
  ASSERT_EQ(exchange(force(1, 0, 0)).fault, HapticFault::kBadSample);
  hand.position_m[0] = 0.7;
  clock.sleep_until(5ms);
  EXPECT_EQ(exchange(force(1, 0, 0)).fault, HapticFault::kBadSample) << "latched until disabled";
  EXPECT_EQ(hand.force_N, Vector3d::Zero());
  EXPECT_EQ(sample.p_HD_m[0], 0.7);
  EXPECT_EQ(sample.stamp, 5ms);
}

TEST_F(LoopbackHapticDeviceTest, AHeldHandGivesWayByForceOverStiffness) {
  sim::Hand held({.hand_stiffness_N_per_m = 300});
  LoopbackHapticDevice omega(held, clock, 1ms, {"omega", 12.0, true});
  omega.activate();
  for (int i = 0; i < 3000; ++i) ASSERT_TRUE(omega.exchange(force(0, 6, 0), sample).ok());
  EXPECT_NEAR(sample.p_HD_m[1], 6.0 / 300, 1e-9);  // oscillation decayed by e^-23 after 3 s
}

TEST_F(LoopbackHapticDeviceTest, ExchangeDoesNotAllocateOrLock) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc";
  sim::Hand held{sim::HandParameters{}};
  LoopbackHapticDevice omega(held, clock, 1ms, {"omega", 12.0, true});
  omega.activate();
  bool ok = true;
  const support::NoAllocGuard guard;
  for (int i = 0; i < 10; ++i) ok = omega.exchange(force(0, 100, 0), sample).ok() && ok;
  ok = !omega.exchange(force(kNaN, 0, 0), sample).ok() && ok;
  const long violations = guard.violations();
  EXPECT_EQ(violations, 0);
  EXPECT_TRUE(ok);
}

}  // namespace
