#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "drivers/haptic/falcon.h"
#include "drivers/setup_error.h"
#include "sim/devices/emulated_falcon.h"
#include "sim/devices/falcon_legs.h"
#include "tests/drivers/falcon_fakes.h"
#include "tests/support/no_alloc_guard.h"

namespace drivers::haptic {
namespace falcon_exchange_test {

using sim::devices::EmulatedFalcon;
using std::chrono::microseconds;
using std::chrono::milliseconds;
using Vector = std::array<double, 3>;
using Motors = std::array<std::int16_t, 3>;

constexpr Vector kPlace_m{0.01, -0.02, 0.12};
constexpr Vector kOrigin_m{0.0, 0.0, 0.13};
constexpr Motors kAtRest{};
/// Two counts in one leg move the handle by about 0.1 mm.
constexpr double kEncoder_m = 1e-4;

double magnitude(const Vector& v) { return std::hypot(v[0], v[1], v[2]); }
void expect_near(const Vector& found, const Vector& expected, double tolerance) {
  for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(found[k], expected[k], tolerance) << "xyz"[k];
}

// Between frames H and F, in which the emulated device has its handle and its motors.
Vector in_H(const Vector& v) { return {v[2], v[0], v[1]}; }
Vector in_F(const Vector& v) { return {v[1], v[2], v[0]}; }

class FalconExchange : public testing::Test {
 protected:
  FalconExchange() {
    (void)falcon_.activate();
    device_.move_grip(kPlace_m);
  }
  const DeviceStatus& exchange(Falcon& falcon, const Vector& force_F_N = {}) {
    return status_ = falcon.exchange(in_H(force_F_N), sample_);
  }
  const DeviceStatus& exchange(const Vector& force_F_N = {}) { return exchange(falcon_, force_F_N); }
  void home() {
    (void)exchange();
    device_.pull_and_push();
    EXPECT_TRUE(exchange().ok());
  }
  void run(milliseconds time, const Vector& force_F_N = {}) {
    for (const auto end = device_.now() + time; device_.now() < end;) ASSERT_TRUE(exchange(force_F_N).ok());
  }
  /// From the origin, and the force that was sent; in F.
  Vector place_m() const { return in_F(sample_.p_HD_m); }
  Vector sent_N() const { return in_F(status_.f_D_H_N); }
  void expect_withheld(Falcon& falcon) {
    EXPECT_TRUE(exchange(falcon, {0, 0, 3}).ok());
    EXPECT_TRUE(status_.withheld);
    EXPECT_TRUE(status_.fresh);
    EXPECT_EQ(sent_N(), Vector{});
    EXPECT_EQ(device_.motors(), kAtRest);
  }
  void expect_made(Falcon& falcon) {
    EXPECT_TRUE(exchange(falcon, {0, 0, 3}).ok());
    EXPECT_FALSE(status_.withheld);
    EXPECT_EQ(sent_N(), (Vector{0, 0, 3}));
    expect_near(device_.force_N(), {0, 0, 3}, 0.03);
  }
  void forget_homing() {
    // Another program's packet without the homing bit.
    const std::vector<std::uint8_t> packet{'<', 'A', 'A', 'A', 'A', 'A', 'A', 'A',
                                           'A', 'A', 'A', 'A', 'A', 'A', 'A', '>'};
    EXPECT_TRUE(device_.write(packet, milliseconds(1)).ok());
  }

  EmulatedFalcon device_{{.firmware_running = true}};
  Falcon falcon_{device_};
  DeviceSample sample_;
  DeviceStatus status_;
};

TEST_F(FalconExchange, IdleUntilActivatedAndAfterDeactivation) {
  Falcon other(device_);
  const int before = device_.commands();
  EXPECT_EQ(exchange(other).fault, HapticFault::kNotActive);
  EXPECT_EQ(device_.commands(), before);
  falcon_.deactivate();
  EXPECT_EQ(exchange().fault, HapticFault::kNotActive);
}

TEST_F(FalconExchange, ColdDeviceIsBootedByActivation) {
  EmulatedFalcon cold;
  Falcon falcon(cold);
  EXPECT_THROW((void)falcon.activate(), SetupError);
  EXPECT_EQ(exchange(falcon).fault, HapticFault::kNotActive);
  EXPECT_EQ(falcon.activate(std::vector<std::uint8_t>(300, 0x55)), falcon::Firmware::kLoaded);
  EXPECT_EQ(exchange(falcon).fault, HapticFault::kNotReady);
}

TEST_F(FalconExchange, BeforeHomingThereIsNoForceAndNoPosition) {
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(exchange({0, 0, 5}).fault, HapticFault::kNotReady);
    EXPECT_EQ(device_.motors(), kAtRest);
    EXPECT_EQ(sent_N(), Vector{});
    EXPECT_FALSE(status_.fresh);
    EXPECT_EQ(place_m(), Vector{});
  }
}

TEST_F(FalconExchange, PushingInWithoutPullingOutDoesNotHome) {
  EXPECT_EQ(exchange().fault, HapticFault::kNotReady);
  device_.move_grip({0, 0, 0.09});
  EXPECT_EQ(exchange().fault, HapticFault::kNotReady);
  device_.move_grip({0, 0, 0.17});
  EXPECT_EQ(exchange().fault, HapticFault::kNotReady);
}

TEST_F(FalconExchange, OneAxisHomedIsNotEnoughForForce) {
  (void)exchange();
  device_.move_grip({0, 0, 0.17});
  // Here leg 0 is at its inner end and the others are not.
  const Vector aside{-0.014, 0.04, 0.11};
  device_.move_grip(aside);
  for (int i = 0; i < 2; ++i) EXPECT_EQ(exchange({0, 0, 3}).fault, HapticFault::kNotReady);
  EXPECT_EQ(device_.homed_axes(), 0b001U);
  EXPECT_EQ(device_.motors(), kAtRest);
}

// The encoders jump when their ends are found: the force waits for a position from after the jump.
TEST_F(FalconExchange, ForceIsWithheldUntilTheReplyThatIsHomed) {
  EXPECT_EQ(exchange({0, 0, 3}).fault, HapticFault::kNotReady);
  device_.pull_and_push();
  expect_withheld(falcon_);
  expect_made(falcon_);
}

TEST_F(FalconExchange, ActivationForgetsWhereTheHandleWas) {
  home();
  expect_made(falcon_);
  (void)falcon_.activate();
  expect_withheld(falcon_);
  expect_made(falcon_);
}

TEST_F(FalconExchange, ActivationLeavesNoForceToTakeAway) {
  tests::WatchedPort port(device_);
  Falcon falcon(port);
  (void)falcon.activate();
  const std::size_t before = port.writes.size();
  EXPECT_TRUE(falcon.deactivate());
  EXPECT_EQ(port.writes.size(), before);
}

// The torques of a force depend on the position.
TEST_F(FalconExchange, AfterAPauseTheForceIsWithheldUntilThereIsANewPosition) {
  home();
  const Vector corner{0.03, 0.02, 0.15};
  EXPECT_TRUE(exchange({0, 0, 8}).ok());
  EXPECT_GT(device_.force_N()[2], 7.9);
  device_.pass(milliseconds(15));  // three deadlines
  EXPECT_TRUE(exchange({0, 0, 8}).ok());
  EXPECT_GT(device_.force_N()[2], 7.9) << "not yet a pause";
  device_.pass(milliseconds(15) + microseconds(1));
  device_.move_grip(corner);
  expect_withheld(falcon_);
  expect_near(place_m(), {0.03, 0.02, 0.02}, kEncoder_m);
  EXPECT_TRUE(exchange({0, 0, 8}).ok());
  EXPECT_FALSE(status_.withheld);
  expect_near(device_.force_N(), sent_N(), 0.03);
}

TEST_F(FalconExchange, ClockThatStepsBackWithholdsTheForce) {
  tests::WatchedPort port(device_);
  home();
  Falcon falcon(port);
  (void)falcon.activate();
  expect_withheld(falcon);
  expect_made(falcon);
  for (const auto shift : {-milliseconds(5000), milliseconds(0)}) {
    port.shift = shift;
    expect_withheld(falcon);
    expect_made(falcon);
  }
}

TEST_F(FalconExchange, HomingBitIsInEveryPacket) {
  home();
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(exchange({1, 0, 0}).ok());
  falcon_.deactivate();
  EXPECT_GT(device_.commands(), 20);
  EXPECT_EQ(device_.commands_without_homing(), 0);
  EXPECT_EQ(device_.malformed_commands(), 0);
  EXPECT_TRUE(device_.homed());
}

TEST_F(FalconExchange, LightIsRedUntilHomedThenGreen) {
  (void)exchange();
  EXPECT_TRUE(device_.red());
  EXPECT_FALSE(device_.green());
  home();
  EXPECT_TRUE(exchange().ok());
  EXPECT_FALSE(device_.red());
  EXPECT_TRUE(device_.green());
}

TEST_F(FalconExchange, PositionIsTheHandlesToTheEncodersResolution) {
  home();
  for (const Vector& place :
       {kPlace_m, Vector{0, 0, 0.13}, Vector{-0.03, 0.02, 0.10}, Vector{0.02, 0.02, 0.16}}) {
    device_.move_grip(place);
    EXPECT_TRUE(exchange().ok());
    expect_near(place_m(), {place[0] - kOrigin_m[0], place[1] - kOrigin_m[1], place[2] - kOrigin_m[2]},
                kEncoder_m);
  }
}

TEST_F(FalconExchange, OriginIsConfigurable) {
  home();
  falcon_.deactivate();
  Falcon other(device_, {.p_FO_m = {0.01, 0.02, 0.15}});
  (void)other.activate();
  EXPECT_TRUE(exchange(other).ok()) << "was homed before and is still";
  expect_near(place_m(), {0.0, -0.04, -0.03}, kEncoder_m);
}

// Rounding of the commands: half of 1e-4 N·m on each thigh, about 0.02 N a leg; position: a count.
TEST_F(FalconExchange, HandFeelsTheForceThatWasAskedForAllOverTheWorkspace) {
  home();
  for (const Vector& place :
       {kPlace_m, Vector{0, 0, 0.13}, Vector{-0.03, 0.02, 0.11}, Vector{0.02, 0.02, 0.15}}) {
    device_.move_grip(place);
    for (const Vector& force : {Vector{4, 0, 0}, Vector{0, -4, 0}, Vector{0, 0, 4}, Vector{1, 2, -3}}) {
      EXPECT_TRUE(exchange().ok());  // its position
      EXPECT_TRUE(exchange(force).ok());
      EXPECT_FALSE(status_.saturated);
      expect_near(device_.force_N(), force, 0.03);
      expect_near(sent_N(), force, 1e-12);
    }
  }
}

TEST_F(FalconExchange, OneNewtonOutwardsAtCountZeroIsTheKnownCommand) {
  home();
  device_.move_grip({0, 0, 0.13460});
  EXPECT_TRUE(exchange().ok());
  EXPECT_TRUE(exchange({0, 0, 1}).ok());
  EXPECT_EQ(device_.motors(), (Motors{-249, -249, -249}));
}

TEST_F(FalconExchange, GainIsConfigurable) {
  home();
  falcon_.deactivate();
  Falcon other(device_, {.command_per_Nm = 5000.0});
  (void)other.activate();
  EXPECT_TRUE(exchange(other).ok());  // its position
  device_.move_grip({0, 0, 0.13460});
  EXPECT_TRUE(exchange(other).ok());
  EXPECT_TRUE(exchange(other, {0, 0, 1}).ok());
  EXPECT_EQ(device_.motors(), (Motors{125, 125, 125}));
}

TEST_F(FalconExchange, ForceBeyondTheLimitKeepsItsDirection) {
  home();
  device_.move_grip(kOrigin_m);
  EXPECT_TRUE(exchange().ok());
  EXPECT_TRUE(exchange({0, 7.2, 9.6}).ok());
  EXPECT_TRUE(status_.saturated);
  expect_near(sent_N(), {0, 4.8, 6.4}, 1e-12);
  expect_near(device_.force_N(), {0, 4.8, 6.4}, 0.03);
  EXPECT_TRUE(exchange({0, 0, 8}).ok());
  EXPECT_FALSE(status_.saturated);
  constexpr double kHuge = std::numeric_limits<double>::max();
  EXPECT_TRUE(exchange({kHuge, kHuge, kHuge}).ok());
  EXPECT_TRUE(status_.saturated);
  EXPECT_LE(magnitude(sent_N()), 8.0 + 1e-9);
}

TEST_F(FalconExchange, MotorAtItsEndScalesAllThreeAndSaysSo) {
  home();
  falcon_.deactivate();
  Falcon other(device_, {.force_limit_N = 12.0, .command_per_Nm = -20000.0});
  (void)other.activate();
  EXPECT_TRUE(exchange(other).ok());  // its position
  EXPECT_TRUE(exchange(other, {2, -3, 11}).ok());
  EXPECT_TRUE(status_.saturated);
  int largest = 0;
  for (const int motor : device_.motors()) largest = std::max(largest, std::abs(motor));
  EXPECT_EQ(largest, 4096);
  const Vector felt = device_.force_N();
  const double share = sent_N()[2] / 11;
  EXPECT_LT(share, 1.0);
  // The device's own gain is half of the one that is configured here.
  expect_near(felt, {2 * 2 * share, -3 * 2 * share, 11 * 2 * share}, 0.1);
}

TEST_F(FalconExchange, ForceThatIsNotFiniteIsAFaultAndSendsZero) {
  home();
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
                           -std::numeric_limits<double>::infinity()}) {
    for (std::size_t k = 0; k < 3; ++k) {
      expect_made(falcon_);
      Vector force{1, 1, 1};
      force[k] = bad;
      EXPECT_EQ(exchange(force).fault, HapticFault::kBadCommand);
      EXPECT_EQ(device_.motors(), kAtRest);
      EXPECT_TRUE(status_.fresh) << "the reply counts all the same";
      EXPECT_EQ(sent_N(), Vector{});
    }
  }
}

TEST_F(FalconExchange, ButtonsAreReported) {
  home();
  device_.press(0b1001);
  EXPECT_TRUE(exchange().ok());
  EXPECT_EQ(sample_.buttons, 0b1001U);
  device_.press(0);
  EXPECT_TRUE(exchange().ok());
  EXPECT_EQ(sample_.buttons, 0U);
}

TEST_F(FalconExchange, MissedReplyLeavesTheSampleAndCostsTheDeadline) {
  home();
  const Vector before_m = place_m();
  device_.move_grip({0, 0, 0.14});
  device_.drop_replies(1);
  const auto start = device_.now();
  EXPECT_EQ(exchange().fault, HapticFault::kMissed);
  EXPECT_GE(device_.now() - start, milliseconds(5));
  EXPECT_LT(device_.now() - start, milliseconds(6));
  EXPECT_FALSE(status_.fresh);
  EXPECT_EQ(place_m(), before_m);
  EXPECT_TRUE(exchange().ok());
  EXPECT_NEAR(place_m()[2], 0.01, kEncoder_m);
}

TEST_F(FalconExchange, MissesThatAreNotInARowAreNotALoss) {
  home();
  for (int i = 0; i < 10; ++i) {
    device_.drop_replies(2);
    EXPECT_EQ(exchange().fault, HapticFault::kMissed);
    EXPECT_EQ(exchange().fault, HapticFault::kMissed);
    EXPECT_TRUE(exchange().ok());
  }
}

// It may hear us although we do not hear it: the motors must not keep the last force.
TEST_F(FalconExchange, ThirdMissInARowIsALossAndZeroForceIsSent) {
  home();
  EXPECT_TRUE(exchange({0, 0, 5}).ok());
  device_.drop_replies(1000);
  EXPECT_EQ(exchange({0, 0, 5}).fault, HapticFault::kMissed);
  EXPECT_EQ(exchange({0, 0, 5}).fault, HapticFault::kMissed);
  EXPECT_NE(device_.motors(), kAtRest);
  EXPECT_EQ(exchange({0, 0, 5}).fault, HapticFault::kLost);
  EXPECT_EQ(device_.motors(), kAtRest);
  device_.drop_replies(0);
  const int commands = device_.commands();
  EXPECT_EQ(exchange({0, 0, 5}).fault, HapticFault::kLost) << "latched";
  EXPECT_EQ(device_.commands(), commands + 2) << "twice, see send_zero()";
  EXPECT_EQ(device_.motors(), kAtRest);
}

TEST_F(FalconExchange, ActivationBringsALostDeviceBackStillHomed) {
  home();
  device_.drop_replies(4);
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(exchange().ok());
  EXPECT_EQ(falcon_.activate(), falcon::Firmware::kWasRunning);
  expect_withheld(falcon_);
  EXPECT_TRUE(device_.red()) << "not known to be homed";
}

TEST_F(FalconExchange, MissesBeforeAnActivationDoNotCount) {
  home();
  for (int round = 0; round < 2; ++round) {
    device_.drop_replies(2);
    for (int i = 0; i < 2; ++i) EXPECT_EQ(exchange().fault, HapticFault::kMissed);
    (void)falcon_.activate();
  }
}

// Replies carry no number: a late one would pass for the next one's, and all that follow would be one behind.
TEST_F(FalconExchange, LateReplyIsNotTakenForTheNext) {
  for (const auto usual : {microseconds(0), microseconds(900), microseconds(1500)}) {
    for (auto late = microseconds(4850); late < microseconds(13'000); late += microseconds(250)) {
      (void)falcon_.activate();
      home();
      device_.delay_replies(1, late);
      EXPECT_EQ(exchange().fault, HapticFault::kMissed) << late.count();
      device_.delay_replies(1000, usual);
      int good = 0;
      for (const double z : {0.15, 0.14, 0.13, 0.12, 0.11}) {
        device_.move_grip({0, 0, z});
        if (!exchange().ok()) continue;
        EXPECT_NEAR(place_m()[2], z - kOrigin_m[2], kEncoder_m) << usual.count() << ' ' << late.count();
        ++good;
      }
      EXPECT_GE(good, 3) << usual.count() << ' ' << late.count();
      device_.delay_replies(0, {});
    }
  }
}

TEST_F(FalconExchange, LateAnswersToActivationAreNotTakenForTheFirstReplies) {
  home();
  Falcon other(device_);
  // The first is taken as the answer when it comes, the second question is asked before that.
  device_.delay_replies(2, microseconds(5650));
  (void)other.activate();
  device_.delay_replies(1, microseconds(900));
  for (const double z : {0.15, 0.14, 0.11}) {
    device_.move_grip({0, 0, z});
    EXPECT_TRUE(exchange(other).ok());
    EXPECT_NEAR(place_m()[2], z - kOrigin_m[2], kEncoder_m);
  }
}

TEST_F(FalconExchange, LostReplyIsWaitedForHalfADeadlineBehindTheNextAndNoLonger) {
  home();
  device_.drop_replies(1);
  EXPECT_EQ(exchange().fault, HapticFault::kMissed);
  const auto took = [&] {
    const auto start = device_.now();
    EXPECT_TRUE(exchange().ok());
    return device_.now() - start;
  };
  EXPECT_EQ(took(), milliseconds(1) + microseconds(2500));
  (void)took();
  EXPECT_EQ(took(), milliseconds(1));
}

// A reply is 0.11 ms on the wire, as is its command before it; the chip sends on each millisecond.
TEST_F(FalconExchange, LateReplyMayShareItsPacketWithTheNext) {
  home();
  for (const auto& [late, share] : {std::pair(microseconds(4850), true), {microseconds(5740), false}}) {
    device_.delay_replies(1, late);
    EXPECT_EQ(exchange().fault, HapticFault::kMissed);
    const auto start = device_.now();
    EXPECT_TRUE(exchange().ok());
    EXPECT_EQ(device_.now() - start, milliseconds(share ? 1 : 2)) << "none is owed any more";
  }
}

TEST_F(FalconExchange, ReplyToAnotherProgramsPacketIsThrownAway) {
  home();
  EXPECT_TRUE(device_.write(falcon::encode({}), milliseconds(1)).ok());
  device_.pass(milliseconds(1));
  device_.move_grip({0, 0, 0.15});
  EXPECT_TRUE(exchange().ok());
  EXPECT_NEAR(place_m()[2], 0.02, kEncoder_m);
}

TEST_F(FalconExchange, ReplyThatCameBetweenTwoCyclesIsThrownAway) {
  home();
  device_.delay_replies(1, milliseconds(5));
  EXPECT_EQ(exchange().fault, HapticFault::kMissed);
  device_.pass(milliseconds(5));
  device_.move_grip({0, 0, 0.15});
  const auto start = device_.now();
  EXPECT_TRUE(exchange().ok());
  EXPECT_NEAR(place_m()[2], 0.02, kEncoder_m);
  EXPECT_EQ(device_.now() - start, milliseconds(1)) << "none is owed any more";
}

TEST_F(FalconExchange, SplitReplyIsPutTogether) {
  home();
  for (std::size_t first = 1; first < 16; ++first) {
    device_.move_grip({0, 0, 0.12 + 0.001 * static_cast<double>(first)});
    device_.split_replies(1, first);
    EXPECT_TRUE(exchange().ok()) << first;
    EXPECT_NEAR(place_m()[2], -0.01 + 0.001 * static_cast<double>(first), kEncoder_m);
  }
}

TEST_F(FalconExchange, SecondHalfThatComesTooLateIsNotJoinedToTheFirst) {
  home();
  device_.split_replies(1, 8);
  device_.delay_replies(1, microseconds(4500));  // the other half follows 1 ms after the first
  EXPECT_EQ(exchange().fault, HapticFault::kMissed);
  device_.move_grip({0, 0, 0.15});
  EXPECT_TRUE(exchange().ok());
  EXPECT_NEAR(place_m()[2], 0.02, kEncoder_m);
}

TEST_F(FalconExchange, GarbageCostsAtMostTheReplyItSitsIn) {
  home();
  for (const std::uint8_t garbage : std::vector<std::uint8_t>{0x00, '<', '>', 'A', 0xFF}) {
    for (std::size_t place = 0; place <= 16; ++place) {
      device_.insert_into_replies(1, place, garbage);
      const DeviceStatus status = exchange();
      const bool outside = place == 0 || place == 16;
      EXPECT_TRUE(status.ok() || (!outside && status.fault == HapticFault::kMissed)) << place;
      device_.move_grip({0, 0, 0.12 + 0.001 * static_cast<double>(place)});
      EXPECT_TRUE(exchange().ok()) << place;
      EXPECT_NEAR(place_m()[2], -0.01 + 0.001 * static_cast<double>(place), kEncoder_m);
    }
  }
}

TEST_F(FalconExchange, CountsThatFitNoPlaceTakeTheForceAway) {
  home();
  expect_made(falcon_);
  const Vector before_m = place_m();
  device_.send_counts(1, {5000, -3000, 5000});
  EXPECT_EQ(exchange({0, 0, 3}).fault, HapticFault::kBadSample);
  EXPECT_FALSE(status_.fresh);
  expect_withheld(falcon_);
  expect_near(place_m(), before_m, 1e-9);
  expect_made(falcon_);
}

// Places that the legs' equations reach and no hand does.
TEST_F(FalconExchange, PositionOutOfTheWorkspaceIsNone) {
  home();
  for (const Vector& place : {Vector{-0.1, 0, 0.06}, Vector{0.03, -0.08, 0.04}}) {
    ASSERT_TRUE(falcon::leg_angles_rad(place));
    device_.move_grip(place);
    EXPECT_EQ(exchange({0, 0, 3}).fault, HapticFault::kBadSample) << place[0] << ' ' << place[2];
    EXPECT_FALSE(status_.fresh);
    EXPECT_EQ(exchange({0, 0, 3}).fault, HapticFault::kBadSample);
    EXPECT_EQ(device_.motors(), kAtRest);
    device_.move_grip(kPlace_m);
    EXPECT_TRUE(exchange({0, 0, 3}).ok());
  }
}

TEST_F(FalconExchange, WorkspaceEndsAtARadiusAndAtALowerEdge) {
  struct Edge {
    Vector inside_m, outside_m;
  };
  home();
  for (const Edge& edge :
       {Edge{{0.0895, 0, 0.12}, {0.0905, 0, 0.12}}, Edge{{-0.0633, 0.0633, 0.10}, {-0.0640, 0.0640, 0.10}},
        Edge{{0.07, 0, 0.0505}, {0.07, 0, 0.0495}}}) {
    device_.move_grip(edge.inside_m);
    EXPECT_TRUE(exchange().ok()) << edge.inside_m[0];
    device_.move_grip(edge.outside_m);
    EXPECT_EQ(exchange().fault, HapticFault::kBadSample) << edge.outside_m[0];
  }
  device_.move_grip({0, 0, 0.18});  // nearly stretched
  EXPECT_TRUE(exchange().ok());
  EXPECT_NEAR(place_m()[2], 0.05, kEncoder_m);
}

TEST_F(FalconExchange, StallIsAMissWithItsKind) {
  home();
  device_.stall(1);
  EXPECT_EQ(exchange().fault, HapticFault::kMissed);
  EXPECT_EQ(status_.detail, static_cast<int>(usb::TransferStatus::kStalled));
  EXPECT_TRUE(exchange().ok());
  device_.stall(1000);
  EXPECT_EQ(exchange().fault, HapticFault::kMissed);
  EXPECT_EQ(exchange().fault, HapticFault::kMissed);
  EXPECT_EQ(exchange().fault, HapticFault::kLost);
}

// Each exchange is a look for late replies, a write and a read.
TEST_F(FalconExchange, TransferThatFailsIsAMissWithItsKindWhicheverItIs) {
  for (const usb::TransferStatus kind : {usb::TransferStatus::kOther, usb::TransferStatus::kStalled}) {
    for (int which = 0; which < 3; ++which) {
      tests::WatchedPort port(device_);
      Falcon falcon(port);
      (void)falcon.activate();
      port.failure = {kind, 0, -99};
      port.fail_at = port.transfers + which;
      EXPECT_EQ(exchange(falcon).fault, HapticFault::kMissed) << which;
      EXPECT_EQ(status_.detail, static_cast<int>(kind));
      EXPECT_EQ(exchange(falcon).fault, HapticFault::kNotReady);
    }
  }
}

TEST_F(FalconExchange, WritesThatTimeOutAreALossAfterThree) {
  tests::WatchedPort port(device_);
  Falcon falcon(port);
  (void)falcon.activate();
  port.failure = {usb::TransferStatus::kTimeout, 0, -7};
  port.fail_at = port.transfers;
  port.fail_count = 1000;
  EXPECT_EQ(exchange(falcon).fault, HapticFault::kMissed);
  EXPECT_EQ(exchange(falcon).fault, HapticFault::kMissed);
  EXPECT_EQ(exchange(falcon).fault, HapticFault::kLost);
  EXPECT_EQ(status_.detail, static_cast<int>(usb::TransferStatus::kTimeout));
}

TEST(FalconFlood, EmptyPacketsWithoutEndDoNotHoldTheCycle) {
  tests::FloodingPort port;
  Falcon falcon(port);
  (void)falcon.activate();
  DeviceSample sample;
  port.reads = 0;
  EXPECT_EQ(falcon.exchange({}, sample).fault, HapticFault::kMissed);
  EXPECT_LE(port.reads, 64);
}

TEST_F(FalconExchange, UnplugIsKnownAtOnceAndStays) {
  home();
  const auto before = device_.now();
  device_.unplug();
  EXPECT_EQ(exchange({0, 0, 3}).fault, HapticFault::kUnplugged);
  EXPECT_EQ(exchange({0, 0, 3}).fault, HapticFault::kUnplugged);
  EXPECT_EQ(device_.now(), before);
  EXPECT_THROW((void)falcon_.activate(), SetupError);
  EXPECT_EQ(exchange().fault, HapticFault::kNotActive);
}

TEST_F(FalconExchange, DeviceThatIsNoLongerHomedGetsNoForce) {
  home();
  expect_made(falcon_);
  const Vector before_m = place_m();
  forget_homing();
  EXPECT_EQ(exchange({0, 0, 3}).fault, HapticFault::kNotReady);
  EXPECT_EQ(place_m(), before_m) << "the last one known";
  EXPECT_EQ(exchange({0, 0, 3}).fault, HapticFault::kNotReady);
  EXPECT_EQ(device_.motors(), kAtRest);
  EXPECT_TRUE(device_.red());

  device_.pull_and_push();
  expect_withheld(falcon_);
  expect_made(falcon_);
}

TEST_F(FalconExchange, MotorsAreAtZeroAfterDeactivationAndDestruction) {
  home();
  EXPECT_TRUE(exchange({0, 0, 3}).ok());
  EXPECT_NE(device_.motors(), kAtRest);
  falcon_.deactivate();
  EXPECT_EQ(device_.motors(), kAtRest);
  {
    Falcon other(device_);
    (void)other.activate();
    EXPECT_TRUE(exchange(other).ok());  // its position
    EXPECT_TRUE(exchange(other, {0, 0, 3}).ok());
    EXPECT_NE(device_.motors(), kAtRest);
  }
  EXPECT_EQ(device_.motors(), kAtRest);
}

/// A separate Falcon on a port that can fail, exerting a force.
struct FalconThatPushes : FalconExchange {
  void push() {
    home();
    pushing_.emplace(port_);
    (void)pushing_->activate();
    EXPECT_TRUE(exchange(*pushing_).ok());
    EXPECT_TRUE(exchange(*pushing_, {0, 0, 3}).ok());
    ASSERT_NE(device_.motors(), kAtRest);
  }
  void fail_next(int transfers, usb::TransferStatus kind = usb::TransferStatus::kStalled) {
    port_.failure = {kind, 0, -9};
    port_.fail_at = port_.transfers;
    port_.fail_count = transfers;
  }
  tests::WatchedPort port_{device_};
  std::optional<Falcon> pushing_;
};

TEST_F(FalconThatPushes, ActivationThatFailsLeavesTheMotorsAtRest) {
  push();
  const std::size_t controls = port_.controls.size();
  fail_next(0);
  port_.fail_at += 2;  // behind the two packets of zero
  port_.fail_count = 1;
  EXPECT_THROW((void)pushing_->activate(), SetupError);
  EXPECT_EQ(port_.controls.size(), controls + 1) << "the first request";
  EXPECT_EQ(device_.motors(), kAtRest);
  pushing_.reset();
  EXPECT_EQ(device_.motors(), kAtRest);
}

TEST_F(FalconThatPushes, DestructionZeroesWhatAFailedActivationCouldNot) {
  push();
  fail_next(5 + 1 + 5);
  EXPECT_THROW((void)pushing_->activate(), SetupError);
  EXPECT_NE(device_.motors(), kAtRest) << "no packet went out";
  EXPECT_EQ(exchange(*pushing_).fault, HapticFault::kNotActive);
  pushing_.reset();
  EXPECT_EQ(device_.motors(), kAtRest);
}

// It may carry the zero that ends a force.
TEST_F(FalconThatPushes, PacketGoesOutAlsoWhenTheLookForLateRepliesFails) {
  push();
  fail_next(1);
  EXPECT_EQ(exchange(*pushing_).fault, HapticFault::kMissed);
  EXPECT_EQ(status_.detail, static_cast<int>(usb::TransferStatus::kStalled));
  EXPECT_EQ(device_.motors(), kAtRest);
}

TEST_F(FalconThatPushes, ForceWhoseWriteOnlySeemedToFailIsTakenAway) {
  home();
  pushing_.emplace(port_);
  (void)pushing_->activate();
  EXPECT_TRUE(exchange(*pushing_).ok());
  fail_next(1, usb::TransferStatus::kTimeout);
  port_.fail_at += 1;  // behind the look for late replies
  port_.only_says_so = true;
  EXPECT_EQ(exchange(*pushing_, {0, 0, 3}).fault, HapticFault::kMissed);
  ASSERT_NE(device_.motors(), kAtRest);
  EXPECT_TRUE(pushing_->deactivate());
  EXPECT_EQ(device_.motors(), kAtRest);
}

TEST_F(FalconThatPushes, ZeroIsTriedAgainAndSentTwice) {
  push();
  port_.writes.clear();
  fail_next(3);
  EXPECT_TRUE(pushing_->deactivate());
  EXPECT_EQ(device_.motors(), kAtRest);
  EXPECT_EQ(port_.writes.size(), 3U + 2U);
  EXPECT_TRUE(pushing_->deactivate());
  EXPECT_EQ(port_.writes.size(), 5U) << "nothing left to do";
}

TEST_F(FalconThatPushes, ZeroThatCannotBeWrittenIsToldAndStaysOwed) {
  push();
  port_.writes.clear();
  fail_next(1000, usb::TransferStatus::kTimeout);
  EXPECT_FALSE(pushing_->deactivate());
  EXPECT_EQ(port_.writes.size(), 5U) << "not for ever";
  fail_next(0);
  EXPECT_NE(device_.motors(), kAtRest);
  EXPECT_TRUE(pushing_->deactivate());
  EXPECT_EQ(device_.motors(), kAtRest);
}

TEST_F(FalconThatPushes, LossTriesZeroAgainAtOnceAndInEachCycle) {
  push();
  for (int i = 0; i < 2; ++i) {
    fail_next(1);
    EXPECT_EQ(exchange(*pushing_, {0, 0, 3}).fault, HapticFault::kMissed);
  }
  fail_next(2 + 3);
  EXPECT_EQ(exchange(*pushing_, {0, 0, 3}).fault, HapticFault::kLost);
  EXPECT_EQ(device_.motors(), kAtRest);
}

TEST_F(FalconThatPushes, LostDeviceGetsZeroAsSoonAsItHears) {
  push();
  fail_next(2 + 2 + 2 + 5);  // three times a look for late replies and a packet
  for (int i = 0; i < 2; ++i) EXPECT_FALSE(exchange(*pushing_, {0, 0, 3}).ok());
  EXPECT_EQ(exchange(*pushing_, {0, 0, 3}).fault, HapticFault::kLost);
  EXPECT_NE(device_.motors(), kAtRest);
  fail_next(2);
  EXPECT_EQ(exchange(*pushing_, {0, 0, 3}).fault, HapticFault::kLost);
  EXPECT_EQ(device_.motors(), kAtRest);
}

TEST_F(FalconThatPushes, UnpluggedDeviceIsNotTriedAgain) {
  push();
  port_.writes.clear();
  device_.unplug();
  EXPECT_FALSE(pushing_->deactivate());
  EXPECT_EQ(port_.writes.size(), 1U);
}

/// Left behind by a program that was killed.
struct FalconLeftPushing : testing::Test {
  FalconLeftPushing() {
    EXPECT_TRUE(device_.control_out(3, 2, 0).ok());  // 1.5 MBd
    const std::vector<std::uint8_t> packet{'<', 'A', 'A', 'B', 'A', 'A', 'A', 'B',
                                           'A', 'A', 'A', 'B', 'A', 'B', 'A', '>'};
    EXPECT_TRUE(device_.write(packet, milliseconds(1)).ok());
    EXPECT_EQ(device_.motors(), (Motors{256, 256, 256}));
    port_.failure = {usb::TransferStatus::kStalled, 0, -9};
    port_.fail_at = 0;
  }
  EmulatedFalcon device_{{.firmware_running = true}};
  tests::WatchedPort port_{device_};
  Falcon falcon_{port_};
};

TEST_F(FalconLeftPushing, ActivationThatFailsTakesTheForceAwayAllTheSame) {
  EXPECT_THROW((void)falcon_.activate(), SetupError);
  EXPECT_EQ(port_.controls.size(), 1U) << "the first request";
  EXPECT_EQ(device_.motors(), kAtRest);
  EXPECT_TRUE(falcon_.deactivate());
}

TEST_F(FalconLeftPushing, ActivationThatCannotTakeTheForceAwaySaysSoAndOwesIt) {
  port_.fail_count = 1 + 5 + 5;
  EXPECT_THROW((void)falcon_.activate(), SetupError);
  EXPECT_FALSE(falcon_.deactivate());
  EXPECT_NE(device_.motors(), kAtRest);
  EXPECT_TRUE(falcon_.deactivate());
  EXPECT_EQ(device_.motors(), kAtRest);
}

// As far as the emulated device's latency timer runs as the real one; see there.
TEST_F(FalconExchange, ExchangesKeepTheRhythmOfTheChipsLatencyTimer) {
  home();
  const auto start = device_.now();
  for (int i = 0; i < 100; ++i) EXPECT_TRUE(exchange().ok());
  EXPECT_EQ(device_.now() - start, 100 * milliseconds(1));
}

TEST_F(FalconExchange, DoesNotAllocateOrLock) {
  home();
  const support::NoAllocGuard guard;
  bool good = true;
  for (int i = 0; i < 10; ++i) good = exchange({1, 2, 3}).ok() && good;
  device_.drop_replies(3);
  for (int i = 0; i < 4; ++i) good = !exchange({1, 2, 3}).ok() && good;
  const long violations = guard.violations();
  EXPECT_TRUE(good);
  EXPECT_EQ(violations, 0);
}

TEST(FalconConfig, DefaultIsSound) { EXPECT_TRUE(FalconConfig{}.problems().empty()); }

TEST(FalconConfig, AllProblemsAreNamedAtOnce) {
  FalconConfig config;
  config.force_limit_N = -1;
  config.command_per_Nm = std::numeric_limits<double>::quiet_NaN();
  config.p_FO_m[1] = std::numeric_limits<double>::infinity();
  config.reply_deadline = {};
  config.lost_after_misses = 0;
  config.boot.load_attempts = 0;
  EXPECT_EQ(config.problems().size(), 6U);
  EmulatedFalcon device;
  EXPECT_THROW(Falcon(device, config), SetupError);
}

TEST(FalconConfig, BoundsAreKept) {
  const auto sound = [](auto change) {
    FalconConfig config;
    change(config);
    return config.problems().empty();
  };
  EXPECT_TRUE(sound([](auto& c) { c.reply_deadline = milliseconds(20); }));
  EXPECT_FALSE(sound([](auto& c) { c.reply_deadline = microseconds(20'001); }));
  EXPECT_TRUE(sound([](auto& c) { c.reply_deadline = milliseconds(3); }));
  EXPECT_FALSE(sound([](auto& c) { c.reply_deadline = microseconds(2'999); }));
  EXPECT_TRUE(sound([](auto& c) { c.force_limit_N = 12.0; }));
  EXPECT_FALSE(sound([](auto& c) { c.force_limit_N = 12.001; }));
  EXPECT_FALSE(sound([](auto& c) { c.force_limit_N = 0.0; }));
  EXPECT_TRUE(sound([](auto& c) { c.lost_after_misses = 10; }));
  EXPECT_FALSE(sound([](auto& c) { c.lost_after_misses = 11; }));
  EXPECT_TRUE(sound([](auto& c) { c.command_per_Nm = -5e4; }));
  EXPECT_FALSE(sound([](auto& c) { c.command_per_Nm = -50'001.0; }));
  EXPECT_FALSE(sound([](auto& c) { c.command_per_Nm = 0.0; }));
  EXPECT_FALSE(sound([](auto& c) { c.boot.alive_timeout = {}; }));
  EXPECT_FALSE(sound([](auto& c) { c.boot.query_timeout = {}; }));
  EXPECT_FALSE(sound([](auto& c) { c.boot.echo_timeout = {}; }));
  EXPECT_FALSE(sound([](auto& c) { c.boot.write_timeout = milliseconds(-1); }));
}

// Two derivations that share nothing: the sheet's closed form and the half-angle form.
TEST(EmulatedFalconLegs, AgreeWithTheDriversKinematics) {
  for (double x = -0.03; x <= 0.031; x += 0.015) {
    for (double y = -0.03; y <= 0.031; y += 0.015) {
      for (double z = 0.10; z <= 0.161; z += 0.015) {
        const Vector own = sim::devices::falcon_thigh_angles_rad({x, y, z});
        const auto drivers_own = falcon::leg_angles_rad({x, y, z});
        ASSERT_TRUE(drivers_own);
        expect_near(own, *drivers_own, 1e-12);
        const auto torques = falcon::leg_torques_Nm({x, y, z}, {1, -2, 3});
        ASSERT_TRUE(torques);
        expect_near(sim::devices::falcon_force_N({x, y, z}, *torques), {1, -2, 3}, 1e-6);
      }
    }
  }
}

}  // namespace falcon_exchange_test
}  // namespace drivers::haptic
