// The simulated haptic device, in lock-step with a hand.
#include <gtest/gtest.h>

#include <chrono>
#include <limits>
#include <memory>

#include "hal/lockstep_haptic_device.h"
#include "hal/loopback_haptic_link.h"
#include "hal/setup_error.h"
#include "sim/hand.h"
#include "tests/support/no_alloc_guard.h"

namespace loopback_haptic_device_test {

using namespace std::chrono_literals;
using Eigen::Vector3d;
using hal::HapticCommand;
using hal::HapticFault;
using hal::HapticInfo;
using hal::HapticSample;
using hal::HapticStatus;
using hal::LoopbackHapticLink;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Shows what it is given and records the force.
class FakeHand final : public hal::HandPlant {
 public:
  void measure(HapticSample& sample) noexcept override {
    sample.p_HD_m = position_m;
    sample.q_HD = rotation;
    sample.buttons = 5;
  }
  void advance(const Vector3d& f_D_H_N, std::chrono::nanoseconds duration) noexcept override {
    force_N = f_D_H_N;
    time += duration;
  }

  Vector3d position_m = {0.1, 0.2, 0.3};
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Vector3d force_N = Vector3d::Zero();
  std::chrono::nanoseconds time{};
};

HapticCommand force(double x, double y, double z) { return {true, Vector3d(x, y, z)}; }

std::unique_ptr<hal::HapticLink> over(hal::HandPlant& hand) {
  return std::make_unique<LoopbackHapticLink>(hand, 1ms, HapticInfo{.name = "fake", .force_limit_N = 12.0});
}

TEST(LoopbackHapticLink, RefusesAPeriodThatIsNotPositive) {
  FakeHand hand;
  EXPECT_THROW(LoopbackHapticLink(hand, 0ns, {}), hal::SetupError);
  EXPECT_THROW(LoopbackHapticLink(hand, -1ms, {}), hal::SetupError);
}

TEST(LoopbackHapticLink, AppliesTheForceOnlyWhileEnabledWithAKnownHandPosition) {
  FakeHand hand;
  const auto link = over(hand);
  link->open();
  HapticSample sample;
  EXPECT_TRUE(link->exchange(force(1, -2, 3), 33ms, sample).ok());
  EXPECT_EQ(hand.force_N, Vector3d(1, -2, 3));
  EXPECT_EQ(hand.time, 1ms);
  EXPECT_EQ(sample.stamp, 33ms);
  EXPECT_EQ(sample.p_HD_m, Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(sample.buttons, 5u);
  EXPECT_TRUE(link->exchange({false, Vector3d(1, 2, 3)}, 34ms, sample).ok());
  EXPECT_EQ(hand.force_N, Vector3d::Zero());

  hand.position_m[2] = kNaN;
  EXPECT_EQ(link->exchange(force(1, 0, 0), 35ms, sample).fault, HapticFault::kBadSample);
  EXPECT_EQ(hand.force_N, Vector3d::Zero()) << "in the same exchange";
  EXPECT_EQ(sample.stamp, 34ms);
  hand.position_m[2] = 0;
  hand.rotation.x() = kNaN;
  EXPECT_EQ(link->exchange(force(1, 0, 0), 36ms, sample).fault, HapticFault::kBadSample);
}

TEST(LockstepHapticDevice, DoesNothingWhileNotActive) {
  FakeHand hand;
  hal::VirtualClock clock;
  clock.sleep_until(1s);
  hal::LockstepHapticDevice device(over(hand), clock);
  HapticSample sample;
  EXPECT_EQ(device.info().name, "fake");
  EXPECT_EQ(device.exchange(force(1, 0, 0), sample).fault, HapticFault::kNotActive);
  device.activate();
  EXPECT_TRUE(device.exchange({}, sample).ok());
  EXPECT_TRUE(device.deactivate());
  const auto time = hand.time;
  EXPECT_EQ(device.exchange(force(1, 0, 0), sample).fault, HapticFault::kNotActive);
  EXPECT_EQ(hand.time, time);
  EXPECT_EQ(sample.stamp, 1s);
}

TEST(LockstepHapticDevice, ActivatedAgainItHasForgottenTheFault) {
  FakeHand hand;
  hal::VirtualClock clock;
  hal::LockstepHapticDevice device(over(hand), clock);
  device.activate();
  HapticSample sample;
  ASSERT_EQ(device.exchange(force(kNaN, 0, 0), sample).fault, HapticFault::kBadCommand);
  ASSERT_EQ(device.exchange(force(1, 0, 0), sample).fault, HapticFault::kBadCommand);
  device.activate();
  EXPECT_TRUE(device.exchange(force(1, 0, 0), sample).ok());
}

TEST(LockstepHapticDevice, AHeldHandGivesWayByForceOverStiffness) {
  sim::Hand held({.hand_stiffness_N_per_m = 300});
  hal::VirtualClock clock;
  hal::LockstepHapticDevice omega(over(held), clock);
  omega.activate();
  HapticSample sample;
  for (int i = 0; i < 4000; ++i) {
    ASSERT_TRUE(omega.exchange(force(0, 6, 0), sample).ok());
    clock.sleep_until(clock.now() + 1ms);
  }
  EXPECT_NEAR(sample.p_HD_m[1], 6.0 / 300, 1e-9);  // oscillation decayed by e^-23 after 3 s
}

TEST(LockstepHapticDevice, ExchangeDoesNotAllocateOrLock) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc";
  sim::Hand held{sim::HandParameters{}};
  hal::VirtualClock clock;
  hal::LockstepHapticDevice omega(over(held), clock);
  omega.activate();
  HapticSample sample;
  bool ok = true;
  const support::NoAllocGuard guard;
  for (int i = 0; i < 10; ++i) ok = omega.exchange(force(0, 100, 0), sample).ok() && ok;
  ok = !omega.exchange(force(kNaN, 0, 0), sample).ok() && ok;
  const long violations = guard.violations();
  EXPECT_EQ(violations, 0);
  EXPECT_TRUE(ok);
}

}  // namespace loopback_haptic_device_test
