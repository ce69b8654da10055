// Effects of the hand on a haptic device, and its faults, in virtual time on each backend: the force stays
// bounded, and where it must end it does so within one watchdog period.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "control/point_spring.h"
#include "hal/haptic/falcon_link.h"
#include "hal/haptic/force_dimension_link.h"
#include "hal/haptic_servo.h"
#include "hal/loopback_haptic_link.h"
#include "sim/devices/emulated_falcon.h"
#include "sim/hand.h"
#include "tests/drivers/force_dimension_fakes.h"
#include "tests/support/mock_falcon.h"

namespace haptic_safety_test {

using namespace std::chrono_literals;
using Eigen::Vector3d;
using hal::HapticFault;
using hal::HapticSample;
using hal::HapticStatus;
using std::chrono::nanoseconds;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kForceLimit_N = 8.0;
constexpr nanoseconds kWatchdog = 20ms;

Vector3d in_our_axes(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

/// A device of one kind with a hand on it.
class Rig {
 public:
  Rig() = default;
  Rig(const Rig&) = delete;
  Rig& operator=(const Rig&) = delete;
  virtual ~Rig() = default;

  virtual hal::HapticLink& link() = 0;
  /// What the user does until there is a position, while exchanges go on.
  virtual void make_ready() {}
  virtual void pass(nanoseconds time) = 0;
  virtual void hold_at(const Vector3d& p_HD_m) = 0;
  virtual void let_go() = 0;
  virtual void push(const Vector3d& force_N) = 0;
  virtual void unplug() = 0;
  virtual void measure_nothing() = 0;  ///< its positions are not numbers any more, or none at all
  virtual Vector3d place_m() const = 0;
  /// What the motors do to the hand beside carrying the handle; braked motors only resist.
  virtual Vector3d made_N() const = 0;
  /// Nothing but its own firmware's watchdog can take the force away when the cable is pulled.
  virtual bool has_watchdog() const { return true; }
  virtual bool has_cable() const { return true; }
  /// What ends the force first when the handle is too fast.
  virtual HapticFault too_fast() const { return HapticFault::kTooFast; }
};

class LoopbackRig final : public Rig, private hal::HandPlant {
 public:
  hal::HapticLink& link() override { return link_; }
  /// An exchange lets it pass.
  void pass(nanoseconds) override {
    if (!std::exchange(exchanged_, false)) made_N_.setZero();
  }
  void hold_at(const Vector3d& p_HD_m) override { hand_.hold_at(p_HD_m); }
  void let_go() override { hand_.let_go(); }
  void push(const Vector3d& force_N) override { hand_.push(force_N); }
  void unplug() override {}
  bool has_cable() const override { return false; }
  void measure_nothing() override { blind_ = true; }
  Vector3d place_m() const override { return place_m_; }
  Vector3d made_N() const override { return made_N_; }

 private:
  void measure(HapticSample& sample) noexcept override {
    hand_.measure(sample);
    place_m_ = sample.p_HD_m;
    if (blind_) sample.p_HD_m.y() = kNaN;
  }
  void advance(const Vector3d& f_D_H_N, nanoseconds duration) noexcept override {
    made_N_ = f_D_H_N;
    exchanged_ = true;
    hand_.advance(f_D_H_N, duration);
  }

  sim::Hand hand_{{}};
  bool blind_ = false;
  bool exchanged_ = false;
  Vector3d place_m_ = Vector3d::Zero();
  Vector3d made_N_ = Vector3d::Zero();
  hal::LoopbackHapticLink link_{*this, 1ms, {.name = "loopback", .force_limit_N = kForceLimit_N}};
};

class ForceDimensionRig final : public Rig {
 public:
  ForceDimensionRig() {
    hal::ForceDimensionLinkConfig config;
    config.sdk.file = stand_in_.path();
    config.device.max_force_N = kForceLimit_N;
    config.device.wait = [this](nanoseconds time) { pass(time); };
    link_.emplace(config);
  }
  hal::HapticLink& link() override { return *link_; }
  void pass(nanoseconds time) override {
    stand_in_.control().advance(std::chrono::duration<double>(time).count());
  }
  void hold_at(const Vector3d& p_HD_m) override {
    script().hand_holds = true;
    script().hand_m = {p_HD_m.x(), p_HD_m.y(), p_HD_m.z()};
  }
  void let_go() override { script().hand_holds = false; }
  void push(const Vector3d& force_N) override { script().hand_N = {force_N.x(), force_N.y(), force_N.z()}; }
  void unplug() override { script().connected = false; }
  void measure_nothing() override { script().pose_is_nan = true; }
  Vector3d place_m() const override { return in_our_axes(state().position_m); }
  Vector3d made_N() const override {
    if (state().mode != sim::devices::ForceDimensionMode::kForce) return Vector3d::Zero();
    return in_our_axes(state().motor_N) - Vector3d(0, 0, kWeight_N);
  }
  HapticFault too_fast() const override { return HapticFault::kForceOff; }  // its firmware, at 1.5 m/s [G]

 private:
  static constexpr double kWeight_N = 0.25 * 9.81;
  sim::devices::ForceDimensionScript& script() { return stand_in_.script(); }
  const sim::devices::ForceDimensionState& state() const { return stand_in_.state(); }

  support::TemporaryDirectory folder_;
  drivers::haptic::StandIn stand_in_{folder_, "library.so"};
  std::optional<hal::ForceDimensionLink> link_;
};

/// Falcon's own axes: x right, y up, z towards the user.
class FalconRig final : public Rig {
 public:
  hal::HapticLink& link() override { return link_; }
  void make_ready() override { falcon_.pull_and_push(); }
  void pass(nanoseconds time) override {
    hand_.advance(made_N(), time);
    HapticSample sample;
    hand_.measure(sample);
    place_m_ = sample.p_HD_m;
    // Within the handle's reach.
    const Vector3d p_m = place_m_.cwiseMax(-0.04).cwiseMin(0.04);
    falcon_.move_grip({p_m.y(), p_m.z(), p_m.x() + 0.13});
  }
  void hold_at(const Vector3d& p_HD_m) override { hand_.hold_at(p_HD_m); }
  void let_go() override { hand_.let_go(); }
  void push(const Vector3d& force_N) override { hand_.push(force_N); }
  void unplug() override { falcon_.unplug(); }
  void measure_nothing() override { falcon_.send_counts(1'000'000, {30'000, -30'000, 30'000}); }
  Vector3d place_m() const override { return place_m_; }
  Vector3d made_N() const override {
    const sim::devices::FalconVector f_N = falcon_.force_N();
    return {f_N[2], f_N[0], f_N[1]};
  }
  bool has_watchdog() const override { return false; }

 private:
  sim::devices::EmulatedFalcon falcon_{{.firmware_running = true}};
  sim::Hand hand_{{}};
  Vector3d place_m_ = Vector3d::Zero();
  hal::FalconLink link_{[this] { return std::make_unique<support::BorrowedPort>(falcon_); },
                        {.force_limit_N = kForceLimit_N},
                        {}};
};

struct Kind {
  const char* name;
  std::unique_ptr<Rig> (*make)();
};

class HapticSafety : public testing::TestWithParam<Kind> {
 protected:
  void SetUp() override {
    rig->link().open();
    servo.emplace(rig->link(), hal::HapticLimits{});
    for (int i = 0; i < 5; ++i) (void)step(hal::HapticCommand{});
    rig->make_ready();
    rig->hold_at(Vector3d::Zero());
    for (int i = 0; i < 2000; ++i) (void)step(hal::HapticCommand{});
    ASSERT_TRUE(status.ok()) << rig->link().describe(status);
  }
  void TearDown() override { rig->link().close(); }

  const HapticStatus& step(const hal::HapticCommand& command) {
    status = servo->step(command, now - command_age, now, sample);
    rig->pass(1ms);
    now += 1ms;
    largest_N = std::max(largest_N, rig->made_N().norm());
    // The motors may turn a torque too coarsely, and nothing else.
    EXPECT_LE(rig->made_N().norm(), kForceLimit_N + 0.05);
    return status;
  }
  /// Like an application: a spring to a point, whatever it gets.
  const HapticStatus& spring_step() {
    return step({true, spring.force_N(point_m, sample.p_HD_m, sample.v_HD_H_m_per_s)});
  }
  void run(nanoseconds time) {
    for (const nanoseconds end = now + time; now < end;) (void)spring_step();
  }
  /// Held beside the point until the spring's whole force is there.
  void hold_beside_the_point(double distance_m) {
    rig->hold_at({0, distance_m, 0});
    run(4s);
    ASSERT_TRUE(status.ok()) << rig->link().describe(status);
    ASSERT_GT(rig->made_N().norm(), 3.0);
  }
  void expect_no_force_after(nanoseconds time, HapticFault fault) {
    run(time);
    EXPECT_EQ(status.fault, fault) << rig->link().describe(status);
    for (int i = 0; i < 300; ++i) {
      (void)spring_step();
      ASSERT_LT(rig->made_N().norm(), 0.02) << i;
    }
    EXPECT_FALSE(status.ok()) << "it does not come back by itself";
  }

  std::unique_ptr<Rig> rig = GetParam().make();
  std::optional<hal::HapticServo> servo;
  control::PointSpring spring{.stiffness_N_per_m = 200, .damping_N_s_per_m = 0.5};
  Vector3d point_m = Vector3d::Zero();
  nanoseconds now = 1s;
  nanoseconds command_age{};
  HapticSample sample;
  HapticStatus status;
  double largest_N = 0.0;
};

TEST_P(HapticSafety, LetGoThePenComesToRestAtThePoint) {
  hold_beside_the_point(0.035);
  const double start_m = rig->place_m().norm();
  rig->let_go();
  double farthest_m = 0.0;
  for (int i = 0; i < 4000; ++i) {
    (void)spring_step();
    ASSERT_TRUE(status.ok()) << rig->link().describe(status);
    farthest_m = std::max(farthest_m, rig->place_m().norm());
  }
  EXPECT_LE(farthest_m, start_m * 1.001) << "it swings back no farther than it came from";
  // Coulomb friction of 0.15 N on each axis against 200 N/m.
  EXPECT_LT(rig->place_m().norm(), 0.0015);
}

TEST_P(HapticSafety, HeldAgainstAPointFarAwayTheForceIsTheLimit) {
  point_m = {-0.2, 0, 0};  // away from the user, where the Falcon's motors reach the limit, too
  rig->hold_at(Vector3d::Zero());
  run(4s);
  EXPECT_TRUE(status.ok()) << rig->link().describe(status);
  EXPECT_TRUE(status.saturated);
  EXPECT_NEAR(rig->made_N().norm(), kForceLimit_N, 0.1);
  EXPECT_NEAR(rig->made_N().x(), -kForceLimit_N, 0.1) << "towards the point";
  EXPECT_TRUE(status.f_D_H_N.isApprox(rig->made_N(), 0.02));
}

TEST_P(HapticSafety, PushedFastItLetsGo) {
  hold_beside_the_point(0.03);
  rig->let_go();
  rig->push({0, -40, 0});
  double speed_m_per_s = 0.0;
  for (int i = 0; i < 100 && speed_m_per_s <= hal::HapticLimits{}.speed_m_per_s; ++i) {
    const Vector3d before_m = rig->place_m();
    (void)spring_step();
    speed_m_per_s = (rig->place_m() - before_m).norm() / 1e-3;
  }
  ASSERT_GT(speed_m_per_s, hal::HapticLimits{}.speed_m_per_s);
  expect_no_force_after(kWatchdog, rig->too_fast());
}

TEST_P(HapticSafety, UnpluggedTheForceEndsOrIsTheLastOne) {
  if (!rig->has_cable()) GTEST_SKIP() << "there is none to pull";
  hold_beside_the_point(0.03);
  const double last_N = rig->made_N().norm();
  rig->unplug();
  if (rig->has_watchdog()) {
    run(kWatchdog);
    expect_no_force_after(0ms, HapticFault::kUnplugged);
  } else {
    run(1s);
    EXPECT_EQ(status.fault, HapticFault::kUnplugged);
    EXPECT_NEAR(rig->made_N().norm(), last_N, 0.05 * last_N) << "no watchdog is known";
    EXPECT_TRUE(status.f_D_H_N.isApprox(rig->made_N(), 0.02)) << "and it is told";
    EXPECT_FALSE(rig->link().close()) << "nothing confirmed that it ended";
    EXPECT_FALSE(rig->link().close()) << "nor by asking again";
  }
}

TEST_P(HapticSafety, ACommandThatIsNotANumberEndsTheForce) {
  hold_beside_the_point(0.03);
  (void)step({true, Vector3d(kNaN, 0, 0)});
  expect_no_force_after(kWatchdog, HapticFault::kBadCommand);
}

TEST_P(HapticSafety, PositionsThatAreNoneEndTheForce) {
  hold_beside_the_point(0.03);
  rig->measure_nothing();
  run(kWatchdog + 2ms);  // the last good one is that old before it is called stale
  EXPECT_TRUE(status.fault == HapticFault::kBadSample || status.fault == HapticFault::kStale)
      << rig->link().describe(status);
  EXPECT_TRUE(sample.p_HD_m.allFinite());
  expect_no_force_after(0ms, status.fault);
}

TEST_P(HapticSafety, ALoopThatStopsEndsTheForce) {
  hold_beside_the_point(0.03);
  const hal::HapticCommand last{true, status.f_D_H_N};
  // The transport thread continues with the last command, as it becomes stale.
  for (int i = 0; i < 25; ++i) {
    command_age += 1ms;
    (void)step(last);
  }
  EXPECT_EQ(status.fault, HapticFault::kNoCommand);
  (void)step(last);
  (void)step(last);
  EXPECT_LT(rig->made_N().norm(), 0.02);
}

TEST_P(HapticSafety, ClosedThereIsNoForce) {
  hold_beside_the_point(0.03);
  EXPECT_TRUE(rig->link().close());
  rig->pass(kWatchdog);
  EXPECT_LT(rig->made_N().norm(), 0.02);
  (void)spring_step();
  EXPECT_EQ(status.fault, HapticFault::kNotActive);
}

INSTANTIATE_TEST_SUITE_P(
    Backends, HapticSafety,
    testing::Values(Kind{"Loopback", [] { return std::unique_ptr<Rig>(new LoopbackRig); }},
                    Kind{"ForceDimension", [] { return std::unique_ptr<Rig>(new ForceDimensionRig); }},
                    Kind{"Falcon", [] { return std::unique_ptr<Rig>(new FalconRig); }}),
    [](const auto& instance) { return std::string(instance.param.name); });

}  // namespace haptic_safety_test
