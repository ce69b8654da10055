// Each device that starts or stops making force of its own accord, behind the servo: whatever made it stop,
// the force starts from zero and fades in.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <memory>

#include "hal/haptic/falcon_link.h"
#include "hal/haptic/force_dimension_link.h"
#include "hal/haptic_servo.h"
#include "sim/devices/emulated_falcon.h"
#include "tests/drivers/force_dimension_fakes.h"
#include "tests/support/mock_falcon.h"

namespace haptic_fade_in_test {

using namespace std::chrono_literals;
using hal::HapticFault;
using std::chrono::nanoseconds;

constexpr double kForce_N = 3.0;
/// Rounding to motor counts.
constexpr double kRounding_N = 0.03;

class FadeIn : public testing::Test {
 protected:
  void TearDown() override {  // while the device is still there
    servo_.reset();
    link_.reset();
  }
  /// As an application that wants this force all the time.
  const hal::HapticStatus& step() {
    status_ = servo_->step({enable_, {kForce_N, 0, 0}}, now(), now(), sample_);
    return status_;
  }
  /// From the next step on, over the ramp.
  void expect_fade_in() {
    const nanoseconds begin = now();
    while (now() < begin + 1100ms) {
      const double share = std::clamp(std::chrono::duration<double>(now() - begin).count(), 0.0, 1.0);
      ASSERT_TRUE(step().ok()) << link_->describe(status_);
      // An exchange or two, of 1 ms, pass before the force may be made.
      ASSERT_LE(made_N(), kForce_N * share + kRounding_N);
      ASSERT_GE(made_N(), kForce_N * (share - 0.003) - kRounding_N);
    }
    EXPECT_NEAR(made_N(), kForce_N, kRounding_N);
  }
  virtual nanoseconds now() = 0;
  virtual double made_N() const = 0;

  std::unique_ptr<hal::HapticLink> link_;
  std::unique_ptr<hal::HapticServo> servo_;
  hal::HapticSample sample_;
  hal::HapticStatus status_;
  bool enable_ = true;
};

class FalconFadesIn : public FadeIn {
 protected:
  FalconFadesIn() {
    link_ =
        std::make_unique<hal::FalconLink>([this] { return std::make_unique<support::BorrowedPort>(falcon_); },
                                          drivers::haptic::FalconConfig{}, std::vector<std::uint8_t>{});
    // Longer than the pause after which the driver calls its position too old.
    servo_ = std::make_unique<hal::HapticServo>(*link_, hal::HapticLimits{.stale_after = 50ms});
    link_->open();
  }
  // An exchange takes a millisecond of the device's time.
  nanoseconds now() override { return 1s + falcon_.now(); }
  double made_N() const override { return falcon_.force_N()[2]; }
  void home() {
    EXPECT_EQ(step().fault, HapticFault::kNotReady);
    EXPECT_NEAR(made_N(), 0.0, 1e-9);
    falcon_.pull_and_push();
  }

  sim::devices::EmulatedFalcon falcon_{{.firmware_running = true}};
};

TEST_F(FalconFadesIn, AfterItsEndsAreFound) {
  home();
  expect_fade_in();
}

TEST_F(FalconFadesIn, AfterAPauseAndTheRunGoesOn) {
  home();
  expect_fade_in();
  falcon_.pass(30ms);
  falcon_.move_grip({0.02, 0.01, 0.14});
  expect_fade_in();
}

TEST_F(FalconFadesIn, AfterItForgotItsEnds) {
  home();
  expect_fade_in();
  // Another program's packet without the homing bit.
  const std::vector<std::uint8_t> packet{'<', 'A', 'A', 'A', 'A', 'A', 'A', 'A',
                                         'A', 'A', 'A', 'A', 'A', 'A', 'A', '>'};
  ASSERT_TRUE(falcon_.write(packet, 1ms).ok());
  EXPECT_EQ(step().fault, HapticFault::kNotReady);
  home();
  expect_fade_in();
}

TEST_F(FalconFadesIn, AfterCountsThatFitNoPositionOnceItIsEnabledAgain) {
  home();
  expect_fade_in();
  falcon_.send_counts(1, {5000, -3000, 5000});
  EXPECT_EQ(step().fault, HapticFault::kBadSample);
  for (int i = 0; i < 50; ++i) {
    EXPECT_EQ(step().fault, HapticFault::kBadSample) << "latched";
    ASSERT_NEAR(made_N(), 0.0, 1e-9);
  }
  enable_ = false;
  EXPECT_TRUE(step().ok());
  enable_ = true;
  expect_fade_in();
}

TEST_F(FalconFadesIn, AfterItWasLostAndOpenedAgain) {
  home();
  expect_fade_in();
  falcon_.drop_replies(4);
  for (int i = 0; i < 3; ++i) (void)step();
  EXPECT_EQ(status_.fault, HapticFault::kLost);
  EXPECT_NEAR(made_N(), 0.0, 1e-9);
  link_->open();
  servo_->reset();
  expect_fade_in();
}

class OmegaFadesIn : public FadeIn {
 protected:
  OmegaFadesIn() {
    hal::ForceDimensionLinkConfig config;
    config.sdk.file = stand_in_.path();
    config.device.wait = [this](nanoseconds time) { pass(time); };
    link_ = std::make_unique<hal::ForceDimensionLink>(config);
    servo_ = std::make_unique<hal::HapticServo>(*link_, hal::HapticLimits{});
  }
  void open() {
    link_->open();
    servo_->reset();
    script().hand_holds = true;
  }
  const hal::HapticStatus& cycle() {
    (void)step();
    pass(1ms);
    return status_;
  }
  void settle_and_fade_in() {
    nanoseconds settling = 0ms;
    for (; settling < 150ms && (settling == 0ms || status_.withheld); settling += 1ms) {
      ASSERT_TRUE(cycle().ok()) << link_->describe(status_);
      EXPECT_EQ(sample_.stamp, now() - 1ms) << "its pose is there all the same";
      ASSERT_LE(made_N(), kForce_N * 1e-3 + 1e-9);
    }
    EXPECT_EQ(settling, 101ms) << "zero force for 100 ms, while it may show its brakes";
    for (int i = 2; i <= 1000; ++i) {
      ASSERT_TRUE(cycle().ok()) << link_->describe(status_);
      ASSERT_NEAR(made_N(), kForce_N * 1e-3 * i, 1e-9);
    }
  }
  void pass(nanoseconds time) {
    now_ += time;
    stand_in_.control().advance(std::chrono::duration<double>(time).count());
  }
  nanoseconds now() override { return now_; }
  double made_N() const override { return stand_in_.state().command_N[0]; }
  sim::devices::ForceDimensionScript& script() { return stand_in_.script(); }
  bool brakes() const { return stand_in_.state().mode == sim::devices::ForceDimensionMode::kBrake; }

  support::TemporaryDirectory folder_;
  drivers::haptic::StandIn stand_in_{folder_, "library.so"};
  nanoseconds now_ = 1s;
};

TEST_F(OmegaFadesIn, AfterItHasSettled) {
  open();
  settle_and_fade_in();
}

TEST_F(OmegaFadesIn, AfterItsWatchdogTookTheForceOnceItIsEnabledAgain) {
  open();
  settle_and_fade_in();
  pass(20ms);  // with the millisecond of the last cycle: longer than the watchdog waits
  EXPECT_TRUE(brakes());
  for (int i = 0; i < 50; ++i) {
    EXPECT_FALSE(cycle().ok());
    ASSERT_TRUE(brakes()) << "it does not come back by itself";
  }
  enable_ = false;
  EXPECT_TRUE(cycle().ok());
  EXPECT_TRUE(brakes());
  enable_ = true;
  settle_and_fade_in();
}

TEST_F(OmegaFadesIn, APauseWithoutAWatchdogEndsTheForceInTheNextExchange) {
  script().firmware = 2.4;
  open();
  settle_and_fade_in();
  pass(500ms);
  EXPECT_NEAR(made_N(), kForce_N, 1e-9) << "this is what the warning is about";
  EXPECT_EQ(cycle().fault, HapticFault::kStale);
  EXPECT_EQ(made_N(), 0.0);
  EXPECT_EQ(cycle().fault, HapticFault::kStale);
}

TEST_F(OmegaFadesIn, APoseThatIsNeverNewAgainIsStaleWithoutForce) {
  open();
  settle_and_fade_in();
  script().pose_is_stuck = true;
  for (int i = 0; i < 22; ++i) (void)cycle();
  EXPECT_EQ(status_.fault, HapticFault::kStale);
  (void)cycle();
  EXPECT_EQ(made_N(), 0.0);
}

TEST_F(OmegaFadesIn, APoseThatStandsStillSinceBeforeEnablingNeverComesToAForce) {
  open();
  enable_ = false;
  for (int i = 0; i < 200; ++i) ASSERT_TRUE(cycle().ok());
  script().pose_is_stuck = true;
  enable_ = true;
  for (int i = 0; i < 300; ++i) {
    (void)cycle();
    ASSERT_EQ(made_N(), 0.0);
  }
  EXPECT_EQ(status_.fault, HapticFault::kStale);
}

}  // namespace haptic_fade_in_test
