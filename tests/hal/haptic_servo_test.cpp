// The safety layer of every haptic device: limits, and the reasons to switch the force off. A scripted link,
// virtual time.
#include "hal/haptic_servo.h"

#include <gtest/gtest.h>

#include <chrono>
#include <limits>
#include <string>
#include <vector>

#include "hal/setup_error.h"
#include "tests/support/no_alloc_guard.h"

namespace haptic_servo_test {

using namespace std::chrono_literals;
using Eigen::Vector3d;
using hal::HapticCommand;
using hal::HapticFault;
using hal::HapticLimits;
using hal::HapticSample;
using hal::HapticStatus;
using std::chrono::nanoseconds;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Answers as scripted.
class ScriptedLink final : public hal::HapticLink {
 public:
  const hal::HapticInfo& info() const noexcept override { return info_; }
  void open() override {}
  bool close() noexcept override { return true; }
  HapticStatus exchange(const HapticCommand& command, nanoseconds now,
                        HapticSample& sample) noexcept override {
    enable = command.enable;
    force_N = command.f_D_H_N;
    if (fresh) {
      sample.stamp = now;
      sample.p_HD_m = position_m;
      sample.q_HD = rotation;
      sample.buttons = 5;
    }
    return answer;
  }

  bool fresh = true;
  Vector3d position_m = {0.1, 0.2, 0.3};
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  HapticStatus answer;

  bool enable = false;
  Vector3d force_N = Vector3d::Zero();

  hal::HapticInfo info_{.name = "scripted", .force_limit_N = 8.0};
};

HapticCommand push(double x, double y = 0, double z = 0) { return {true, Vector3d(x, y, z)}; }

struct HapticServoTest : testing::Test {
  const HapticStatus& step(const HapticCommand& command, nanoseconds after = 1ms) {
    now += after;
    return status = servo.step(command, now - command_age, now, sample);
  }
  /// Until the ramp and the slew are over.
  void fade_in(const HapticCommand& command) {
    for (int i = 0; i < 1100; ++i) ASSERT_TRUE(step(command).ok());
  }

  ScriptedLink link;
  HapticLimits limits;
  hal::HapticServo servo{link, limits};
  nanoseconds now = 1s;
  nanoseconds command_age{};
  HapticSample sample;
  HapticStatus status;
};

TEST_F(HapticServoTest, ListsAllThatIsWrongWithItsLimits) {
  const HapticLimits wrong{.slew_N_per_s = kNaN,
                           .speed_m_per_s = -1,
                           .ramp_in = -1ms,
                           .stale_after = 0ms,
                           .command_timeout = 1s,
                           .velocity_cutoff_Hz = kInfinity};
  EXPECT_EQ(wrong.problems().size(), 6u);
  EXPECT_TRUE(HapticLimits{}.problems().empty());
  try {
    const hal::HapticServo refused(link, wrong);
    FAIL();
  } catch (const hal::SetupError& error) {
    for (const char* name :
         {"slew_N_per_s", "speed_m_per_s", "ramp_in", "stale_after", "command_timeout", "velocity_cutoff_Hz"})
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << name;
  }
}

TEST_F(HapticServoTest, RefusesAnAgeAboveTheLongestOfALink) {
  EXPECT_TRUE(HapticLimits{.stale_after = 500ms}.problems().empty());
  EXPECT_EQ(HapticLimits{.stale_after = 501ms}.problems().size(), 1u);
}

TEST_F(HapticServoTest, PassesTheSampleOnWithAVelocityAndItsAge) {
  ASSERT_TRUE(step({}).ok());
  EXPECT_EQ(sample.p_HD_m, Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(sample.buttons, 5u);
  EXPECT_EQ(sample.stamp, now);
  for (int i = 0; i < 200; ++i) {
    link.position_m.x() += 0.2e-3;
    EXPECT_EQ(step({}).age, 0ns);
  }
  EXPECT_NEAR(sample.v_HD_H_m_per_s.x(), 0.2, 1e-9);
  link.fresh = false;
  step({});
  EXPECT_EQ(step({}).age, 2ms);
  EXPECT_EQ(sample.stamp, now - 2ms);
}

TEST_F(HapticServoTest, TheForceFadesInOverTheRampAndIsThenExact) {
  nanoseconds begin{};
  double last_N = 0;
  for (int i = 0; i < 1100; ++i) {
    ASSERT_TRUE(step(push(0, -6, 0)).ok());
    if (i == 0) begin = now;
    const double share = std::min(1.0, std::chrono::duration<double>(now - begin).count());
    EXPECT_NEAR(link.force_N.y(), -6 * share, 1e-12);
    EXPECT_LE(std::abs(link.force_N.y() - last_N), 0.2 + 1e-12) << "200 N/s";
    last_N = link.force_N.y();
  }
  EXPECT_TRUE(link.force_N.isApprox(Vector3d(0, -6, 0), 1e-12));
}

TEST_F(HapticServoTest, AForceThatTurnsAroundDoesSoAtTheSlewRate) {
  fade_in(push(6));
  for (int i = 1; i <= 60; ++i) {
    ASSERT_TRUE(step(push(-6)).ok());
    EXPECT_NEAR(link.force_N.x(), 6 - 0.2 * i, 1e-9);
  }
  step(push(-6));
  EXPECT_NEAR(link.force_N.x(), -6, 1e-9);
}

TEST_F(HapticServoTest, ALongerStepMaySlewFurther) {
  fade_in(push(0));
  step(push(6), 5ms);
  EXPECT_NEAR(link.force_N.x(), 1.0, 1e-12);
}

TEST_F(HapticServoTest, AForceBeyondTheLimitIsScaledAlongItsDirectionAndSaysSo) {
  fade_in(push(30, 0, -40));
  step(push(30, 0, -40));
  EXPECT_TRUE(status.ok()) << "limiting is not a fault";
  EXPECT_TRUE(status.saturated);
  EXPECT_TRUE(link.force_N.isApprox(Vector3d(4.8, 0, -6.4), 1e-9)) << link.force_N.transpose();
  EXPECT_FALSE(step(push(0, 8, 0)).saturated) << "the limit itself can be rendered";
  // Finite numbers whose magnitude is none.
  for (int i = 0; i < 100; ++i) EXPECT_TRUE(step(push(1e308, 1e308, 1e308)).ok());
  EXPECT_NEAR(link.force_N.norm(), 8.0, 1e-6);
}

TEST_F(HapticServoTest, DisablingEndsTheForceAtOnceAndEnablingFadesInAgain) {
  fade_in(push(6));
  EXPECT_TRUE(step({false, Vector3d(6, 0, 0)}).ok());
  EXPECT_FALSE(link.enable);
  EXPECT_EQ(link.force_N, Vector3d::Zero());
  step(push(6));
  EXPECT_EQ(link.force_N.norm(), 0.0);
  step(push(6));
  EXPECT_NEAR(link.force_N.x(), 6e-3, 1e-12);
}

/// Each reason to let go: what brings it about, and what takes it away.
struct Reason {
  const char* name;
  HapticFault fault;
  void (*begin)(HapticServoTest&, HapticCommand&);
  void (*end)(HapticServoTest&, HapticCommand&);
  int steps;  // until it shows
};

class HapticServoLetsGo : public HapticServoTest, public testing::WithParamInterface<Reason> {};

TEST_P(HapticServoLetsGo, UntilDisabledOnceAndThenFadesIn) {
  const Reason& reason = GetParam();
  HapticCommand command = push(3);
  fade_in(command);
  ASSERT_NEAR(link.force_N.x(), 3, 1e-9);

  reason.begin(*this, command);
  for (int i = 0; i < reason.steps; ++i) step(command);
  EXPECT_EQ(status.fault, reason.fault);
  step(command);
  EXPECT_EQ(link.force_N, Vector3d::Zero());
  EXPECT_FALSE(link.enable);

  reason.end(*this, command);
  for (int i = 0; i < 50; ++i) {
    EXPECT_EQ(step(command).fault, reason.fault) << "latched";
    ASSERT_EQ(link.force_N, Vector3d::Zero());
  }
  EXPECT_TRUE(step({}).ok());
  EXPECT_TRUE(step(command).ok());
  EXPECT_EQ(link.force_N, Vector3d::Zero());
  EXPECT_TRUE(step(command).ok());
  EXPECT_NEAR(link.force_N.x(), 3e-3, 1e-12);
}

void keep(HapticServoTest&, HapticCommand&) {}

INSTANTIATE_TEST_SUITE_P(
    Reasons, HapticServoLetsGo,
    testing::Values(
        Reason{"BadCommand", HapticFault::kBadCommand,
               [](HapticServoTest&, HapticCommand& command) { command.f_D_H_N.z() = kNaN; },
               [](HapticServoTest&, HapticCommand& command) { command.f_D_H_N.z() = 0; }, 1},
        Reason{"InfiniteCommand", HapticFault::kBadCommand,
               [](HapticServoTest&, HapticCommand& command) { command.f_D_H_N.y() = -kInfinity; },
               [](HapticServoTest&, HapticCommand& command) { command.f_D_H_N.y() = 0; }, 1},
        Reason{"BadPosition", HapticFault::kBadSample,
               [](HapticServoTest& test, HapticCommand&) { test.link.position_m.y() = kNaN; },
               [](HapticServoTest& test, HapticCommand&) { test.link.position_m.y() = 0.2; }, 1},
        Reason{"BadRotation", HapticFault::kBadSample,
               [](HapticServoTest& test, HapticCommand&) { test.link.rotation.w() = kInfinity; },
               [](HapticServoTest& test, HapticCommand&) { test.link.rotation.w() = 1; }, 1},
        Reason{"SilentDevice", HapticFault::kStale,
               [](HapticServoTest& test, HapticCommand&) { test.link.fresh = false; },
               [](HapticServoTest& test, HapticCommand&) { test.link.fresh = true; }, 21},
        Reason{"LateExchange", HapticFault::kStale,
               [](HapticServoTest& test, HapticCommand&) { test.now += 20ms; }, keep, 1},
        Reason{"TimeRunsBackwards", HapticFault::kStale,
               [](HapticServoTest& test, HapticCommand&) { test.now -= 5ms; }, keep, 1},
        Reason{"NoCommand", HapticFault::kNoCommand,
               [](HapticServoTest& test, HapticCommand&) { test.command_age = 21ms; },
               [](HapticServoTest& test, HapticCommand&) { test.command_age = 0ms; }, 1},
        Reason{"TooFast", HapticFault::kTooFast,
               // One sample 20 mm away: 20 m/s through the filter's first 22 %.
               [](HapticServoTest& test, HapticCommand&) { test.link.position_m.x() += 0.02; }, keep, 1},
        Reason{"Unplugged", HapticFault::kUnplugged,
               [](HapticServoTest& test, HapticCommand&) { test.link.answer = {HapticFault::kUnplugged}; },
               [](HapticServoTest& test, HapticCommand&) { test.link.answer = {}; }, 1},
        Reason{"DeviceFault", HapticFault::kDeviceFault,
               [](HapticServoTest& test, HapticCommand&) { test.link.answer = {HapticFault::kDeviceFault}; },
               [](HapticServoTest& test, HapticCommand&) { test.link.answer = {}; }, 1}),
    [](const auto& instance) { return std::string(instance.param.name); });

TEST_F(HapticServoTest, SteadyButSlowHandsAndDevicesAreNoReason) {
  const HapticCommand command = push(3);
  fade_in(command);
  for (int i = 0; i < 500; ++i) {
    link.position_m.x() += 0.9e-3;  // 0.9 m/s
    command_age = 20ms;
    ASSERT_TRUE(step(command).ok());
  }
  link.fresh = false;
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(step(command).ok());
  link.fresh = true;
  ASSERT_TRUE(step(command, 20ms).ok());
}

TEST_F(HapticServoTest, WithoutForceFeedbackEveryForceIsSaturatedToZeroAndNoSpeedIsTooMuch) {
  link.info_.force_limit_N = 0.0;
  for (int i = 0; i < 1100; ++i) {
    link.position_m.x() = i % 16 < 8 ? 0.05 : -0.05;
    ASSERT_TRUE(step(push(1)).ok());
    EXPECT_TRUE(status.saturated);
    ASSERT_EQ(link.force_N, Vector3d::Zero());
  }
  EXPECT_FALSE(step(push(0)).saturated);
}

TEST_F(HapticServoTest, NeverHandsOutAMeasurementThatIsNotANumber) {
  ASSERT_TRUE(step(push(1)).ok());
  ASSERT_EQ(step(push(kNaN)).fault, HapticFault::kBadCommand);
  const nanoseconds good = now;
  link.position_m[0] = kNaN;  // a second fault while the first one is latched
  EXPECT_FALSE(step(push(1)).ok());
  EXPECT_TRUE(sample.p_HD_m.allFinite());
  EXPECT_EQ(sample.stamp, good) << "the stamp shows the age";
  link.position_m[0] = 0.7;
  EXPECT_FALSE(step(push(1)).ok());
  EXPECT_EQ(sample.p_HD_m[0], 0.7) << "fresh ones come through again while the fault is latched";
}

TEST_F(HapticServoTest, TheFirstFaultIsTheOneThatIsTold) {
  fade_in(push(1));
  link.answer = {.fault = HapticFault::kDeviceFault, .detail = 77};
  step(push(1));
  link.answer = {HapticFault::kUnplugged};
  step(push(kNaN));
  EXPECT_EQ(status.fault, HapticFault::kDeviceFault);
  EXPECT_EQ(status.detail, 77u);
}

TEST_F(HapticServoTest, WithoutAPositionThereIsNoForceAndThenItFadesInAndTheJumpIsNoSpeed) {
  link.answer = {HapticFault::kNotReady};
  link.fresh = false;
  for (int i = 0; i < 2000; ++i) {
    ASSERT_EQ(step(push(3)).fault, HapticFault::kNotReady);
    ASSERT_EQ(link.force_N, Vector3d::Zero());
  }
  link.answer = {};
  link.fresh = true;
  ASSERT_TRUE(step(push(3)).ok()) << "it ends by itself";
  link.answer = {HapticFault::kNotReady};  // lost again, found elsewhere
  link.fresh = false;
  step(push(3));
  link.answer = {};
  link.fresh = true;
  link.position_m.setConstant(-0.1);
  ASSERT_TRUE(step(push(3)).ok());
  EXPECT_EQ(sample.v_HD_H_m_per_s.norm(), 0.0);
  EXPECT_EQ(link.force_N, Vector3d::Zero());
  ASSERT_TRUE(step(push(3)).ok());
  EXPECT_NEAR(link.force_N.x(), 3e-3, 1e-12);
}

TEST_F(HapticServoTest, AForceThatTheDeviceWithheldFadesInAgainWithoutAFault) {
  fade_in(push(3));
  link.answer.withheld = true;
  for (int i = 0; i < 2; ++i) {
    ASSERT_TRUE(step(push(3)).ok());
    EXPECT_EQ(sample.stamp, now) << "it has a position";
  }
  link.answer.withheld = false;
  for (int i = 1; i < 1000; ++i) {
    ASSERT_TRUE(step(push(3)).ok());
    ASSERT_NEAR(link.force_N.x(), 3e-3 * i, 1e-9);
  }
}

TEST_F(HapticServoTest, APoseThatStandsStillSinceEnablingIsStaleBeforeThereIsAForce) {
  ASSERT_TRUE(step({}).ok());
  link.fresh = false;
  link.answer.withheld = true;
  for (int i = 0; i < 21; ++i) {
    ASSERT_TRUE(step(push(3)).ok());
    ASSERT_LE(link.force_N.norm(), 3e-3 + 1e-12);
  }
  EXPECT_EQ(step(push(3)).fault, HapticFault::kStale);
  link.answer.withheld = false;
  EXPECT_EQ(step(push(3)).fault, HapticFault::kStale);
  EXPECT_EQ(link.force_N, Vector3d::Zero());
}

TEST_F(HapticServoTest, AReplyThatIsMissedIsNoFaultButASampleThatAges) {
  fade_in(push(3));
  link.answer = {HapticFault::kMissed};
  link.fresh = false;
  for (int i = 1; i <= 20; ++i) {
    ASSERT_TRUE(step(push(3)).ok());
    EXPECT_EQ(status.age, i * 1ms);
    EXPECT_NEAR(link.force_N.x(), 3, 1e-9);
  }
  EXPECT_EQ(step(push(3)).fault, HapticFault::kStale);
}

TEST_F(HapticServoTest, WhatTheClockDidBeforeEnablingMakesNoForce) {
  for (const nanoseconds gap : {-1ms, -10ms, 0ms, 1000ms}) {
    limits.ramp_in = 0ms;
    hal::HapticServo quick(link, limits);
    HapticCommand off;
    (void)quick.step(off, now, now, sample);
    now += gap;
    EXPECT_TRUE(quick.step(push(8), now, now, sample).ok());
    EXPECT_EQ(link.force_N, Vector3d::Zero()) << gap.count();
    now += 1ms;
    EXPECT_TRUE(quick.step(push(8), now, now, sample).ok());
    EXPECT_NEAR(link.force_N.x(), 0.2, 1e-12) << gap.count();
  }
}

TEST_F(HapticServoTest, BeforeTheFirstSampleItsAgeIsNone) {
  link.fresh = false;
  EXPECT_EQ(step({}).age, nanoseconds::max());
  link.fresh = true;
  EXPECT_EQ(step({}).age, 0ns);
}

TEST_F(HapticServoTest, OpenedAnewItKnowsNothing) {
  fade_in(push(6));
  ASSERT_FALSE(step(push(kNaN)).ok());
  servo.reset();
  now -= 500ms;  // another clock
  link.position_m.setConstant(9);
  EXPECT_TRUE(step(push(6)).ok());
  EXPECT_EQ(link.force_N, Vector3d::Zero());
  EXPECT_EQ(sample.v_HD_H_m_per_s, Vector3d::Zero());
}

TEST_F(HapticServoTest, AStepNeitherAllocatesNorLocks) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc";
  bool ok = true;
  const support::NoAllocGuard guard;
  for (int i = 0; i < 10; ++i) ok = step(push(0, 100, 0)).ok() && ok;
  ok = !step(push(kNaN)).ok() && ok;
  link.answer = {HapticFault::kUnplugged};
  ok = !step(push(1)).ok() && ok;
  const long violations = guard.violations();
  EXPECT_EQ(violations, 0);
  EXPECT_TRUE(ok);
}

}  // namespace haptic_servo_test
