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

class FalconExchange : public testing::Test {
 protected:
  FalconExchange() {
    (void)falcon_.activate();
    device_.move_grip(kPlace_m);
  }
  FalconStatus exchange(const Vector& force_N = {}) { return falcon_.exchange(force_N, sample_); }
  void home() {
    EXPECT_TRUE(exchange().ok());
    device_.pull_and_push();
    EXPECT_TRUE(exchange().ok());
    ASSERT_TRUE(sample_.homed);
    end_ramp(falcon_);
  }
  /// As a program does that wants this force all the time; an exchange takes a millisecond.
  void run(Falcon& falcon, milliseconds time, const Vector& force_N = {}) {
    for (const auto end = device_.now() + time; device_.now() < end;) {
      ASSERT_TRUE(falcon.exchange(force_N, sample_).ok());
    }
  }
  void run(milliseconds time, const Vector& force_N = {}) { run(falcon_, time, force_N); }
  void end_ramp(Falcon& falcon) {
    EXPECT_TRUE(falcon.exchange({}, sample_).ok());  // a position: the ramp begins
    run(falcon, milliseconds(1010));
  }
  void forget_homing() {
    // Another program's packet without the homing bit.
    const std::vector<std::uint8_t> packet{'<', 'A', 'A', 'A', 'A', 'A', 'A', 'A',
                                           'A', 'A', 'A', 'A', 'A', 'A', 'A', '>'};
    EXPECT_TRUE(device_.write(packet, milliseconds(1)).ok());
  }

  EmulatedFalcon device_{{.firmware_running = true}};
  Falcon falcon_{device_};
  FalconSample sample_;
};

TEST_F(FalconExchange, IdleUntilActivatedAndAfterDeactivation) {
  Falcon other(device_);
  const int before = device_.commands();
  EXPECT_EQ(other.exchange({}, sample_).fault, FalconFault::kIdle);
  EXPECT_EQ(device_.commands(), before);
  falcon_.deactivate();
  EXPECT_EQ(exchange().fault, FalconFault::kIdle);
}

TEST_F(FalconExchange, ColdDeviceIsBootedByActivation) {
  EmulatedFalcon cold;
  Falcon falcon(cold);
  EXPECT_THROW((void)falcon.activate(), SetupError);
  EXPECT_EQ(falcon.exchange({}, sample_).fault, FalconFault::kIdle);
  EXPECT_EQ(falcon.activate(std::vector<std::uint8_t>(300, 0x55)), falcon::Firmware::kLoaded);
  EXPECT_TRUE(falcon.exchange({}, sample_).ok());
}

TEST_F(FalconExchange, BeforeHomingThereIsNoForceAndNoPosition) {
  for (int i = 0; i < 10; ++i) {
    EXPECT_TRUE(exchange({0, 0, 5}).ok());
    EXPECT_FALSE(sample_.homed);
    EXPECT_EQ(device_.motors(), kAtRest);
    EXPECT_EQ(sample_.f_G_F_N, Vector{});
    EXPECT_EQ(sample_.p_OG_m, Vector{});
  }
}

TEST_F(FalconExchange, PushingInWithoutPullingOutDoesNotHome) {
  EXPECT_TRUE(exchange().ok());
  device_.move_grip({0, 0, 0.09});
  EXPECT_TRUE(exchange().ok());
  EXPECT_FALSE(sample_.homed);
  device_.move_grip({0, 0, 0.17});
  EXPECT_TRUE(exchange().ok());
  EXPECT_FALSE(sample_.homed);
}

TEST_F(FalconExchange, OneAxisHomedIsNotEnoughForForce) {
  EXPECT_TRUE(exchange().ok());
  device_.move_grip({0, 0, 0.17});
  // Here leg 0 is at its inner end and the others are not.
  const Vector aside{-0.014, 0.04, 0.11};
  device_.move_grip(aside);
  EXPECT_TRUE(exchange({0, 0, 3}).ok());
  EXPECT_EQ(sample_.axis_homed, (std::array{true, false, false}));
  EXPECT_FALSE(sample_.homed);
  EXPECT_TRUE(exchange({0, 0, 3}).ok());
  EXPECT_EQ(device_.motors(), kAtRest);
}

// The encoders jump when their ends are found: the force has to wait for a position from behind the jump.
TEST_F(FalconExchange, ForceFadesInAfterTheReplyThatIsHomed) {
  EXPECT_TRUE(exchange({0, 0, 3}).ok());
  device_.pull_and_push();
  EXPECT_TRUE(exchange({0, 0, 3}).ok());
  EXPECT_TRUE(sample_.homed);
  EXPECT_EQ(device_.motors(), kAtRest);
  EXPECT_EQ(sample_.f_G_F_N, Vector{});
  EXPECT_TRUE(exchange({0, 0, 3}).ok());
  EXPECT_EQ(device_.motors(), kAtRest) << "gain 0";
  double previous_N = 0.0;
  for (int i = 1; i < 10; ++i) {
    run(milliseconds(100), {0, 0, 3});
    EXPECT_NEAR(sample_.f_G_F_N[2], 0.3 * i, 0.02);
    EXPECT_NEAR(device_.force_N()[2], 0.3 * i, 0.05);
    EXPECT_GT(sample_.f_G_F_N[2], previous_N);
    EXPECT_FALSE(sample_.limited);
    previous_N = sample_.f_G_F_N[2];
  }
  run(milliseconds(101), {0, 0, 3});
  EXPECT_EQ(sample_.f_G_F_N, (Vector{0, 0, 3}));
}

TEST_F(FalconExchange, ActivationFadesInAgainAndTheRampIsConfigurable) {
  home();
  falcon_.deactivate();
  Falcon other(device_, {.ramp = milliseconds(4000)});
  for (int round = 0; round < 2; ++round) {
    (void)other.activate();
    EXPECT_TRUE(other.exchange({0, 0, 3}, sample_).ok());
    EXPECT_TRUE(other.exchange({0, 0, 3}, sample_).ok());
    EXPECT_EQ(device_.motors(), kAtRest);
    run(other, milliseconds(2000), {0, 0, 3});
    EXPECT_NEAR(sample_.f_G_F_N[2], 1.5, 0.01);
    run(other, milliseconds(2001), {0, 0, 3});
    EXPECT_EQ(sample_.f_G_F_N[2], 3.0);
  }
}

TEST_F(FalconExchange, ActivationForgetsWhereTheGripWas) {
  home();
  run(milliseconds(10), {0, 0, 5});
  (void)falcon_.activate();
  EXPECT_TRUE(exchange({0, 0, 5}).ok());
  device_.pass(milliseconds(10));
  EXPECT_TRUE(exchange({0, 0, 5}).ok());
  EXPECT_EQ(device_.motors(), kAtRest) << "the ramp begins only now";
}

TEST_F(FalconExchange, ActivationLeavesNoForceToTakeAway) {
  tests::WatchedPort port(device_);
  Falcon falcon(port);
  (void)falcon.activate();
  const std::size_t before = port.writes.size();
  EXPECT_TRUE(falcon.deactivate());
  EXPECT_EQ(port.writes.size(), before);
}

// Otherwise a fault would be the short way to full force.
TEST_F(FalconExchange, FaultInTheFirstRampBeginsItAfresh) {
  EXPECT_TRUE(exchange().ok());
  device_.pull_and_push();
  for (int i = 0; i < 2; ++i) EXPECT_TRUE(exchange().ok());
  run(milliseconds(300));
  EXPECT_EQ(exchange({std::numeric_limits<double>::quiet_NaN(), 0, 0}).fault, FalconFault::kBadForce);
  EXPECT_TRUE(exchange({0, 0, 3}).ok());
  run(milliseconds(500), {0, 0, 3});
  EXPECT_NEAR(sample_.f_G_F_N[2], 1.5, 0.01);
}

// The position it was learnt at is all that the force of a packet is turned into torques by.
TEST_F(FalconExchange, AfterAPauseZeroGoesOutFirstAndThenTheForceFadesIn) {
  home();
  const Vector corner{0.03, 0.02, 0.15};
  run(milliseconds(10), {0, 0, 8});
  EXPECT_GT(device_.force_N()[2], 7.9);
  device_.pass(milliseconds(15));  // three deadlines
  EXPECT_TRUE(exchange({0, 0, 8}).ok());
  EXPECT_GT(device_.force_N()[2], 7.9) << "not yet a pause";
  device_.pass(milliseconds(15) + microseconds(1));
  device_.move_grip(corner);
  EXPECT_TRUE(exchange({0, 0, 8}).ok());
  EXPECT_EQ(device_.motors(), kAtRest);
  EXPECT_EQ(sample_.f_G_F_N, Vector{});
  expect_near(sample_.p_OG_m, {0.03, 0.02, 0.02}, kEncoder_m);
  EXPECT_TRUE(exchange({0, 0, 8}).ok());
  EXPECT_EQ(device_.motors(), kAtRest) << "gain 0";
  run(milliseconds(50), {0, 0, 8});
  EXPECT_NEAR(sample_.f_G_F_N[2], 4.0, 0.1);
  expect_near(device_.force_N(), sample_.f_G_F_N, 0.03);
}

TEST_F(FalconExchange, ClockThatStepsBackTakesTheForceAwayAndLetsItFadeIn) {
  tests::WatchedPort port(device_);
  home();
  Falcon falcon(port);
  (void)falcon.activate();
  end_ramp(falcon);
  run(falcon, milliseconds(10), {0, 0, 3});
  ASSERT_NE(device_.motors(), kAtRest);
  for (const auto shift : {-milliseconds(5000), milliseconds(0)}) {
    port.shift = shift;
    EXPECT_TRUE(falcon.exchange({0, 0, 3}, sample_).ok());
    EXPECT_EQ(device_.motors(), kAtRest) << shift.count();
    run(falcon, milliseconds(50), {0, 0, 3});
    EXPECT_GT(sample_.f_G_F_N[2], 0.0) << shift.count();
    EXPECT_LT(sample_.f_G_F_N[2], 1.6) << shift.count();
  }
}

// Else the ramp would be at less than nothing, and the force would point the other way.
TEST_F(FalconExchange, ClockThatStepsBackWhileTheRampBeginsDoesNotTurnTheForceAround) {
  tests::WatchedPort port(device_);
  home();
  Falcon falcon(port);
  (void)falcon.activate();
  EXPECT_TRUE(falcon.exchange({0, 0, 3}, sample_).ok());
  port.shift = -milliseconds(5000);
  port.shift_from = port.transfers + 1;  // behind the write of the packet in which the ramp begins
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(falcon.exchange({0, 0, 3}, sample_).ok());
    EXPECT_EQ(device_.motors(), kAtRest) << i;
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
  EXPECT_TRUE(exchange().ok());
  EXPECT_TRUE(device_.red());
  EXPECT_FALSE(device_.green());
  home();
  EXPECT_TRUE(exchange().ok());
  EXPECT_FALSE(device_.red());
  EXPECT_TRUE(device_.green());
}

TEST_F(FalconExchange, PositionIsTheGripsToTheEncodersResolution) {
  home();
  for (const Vector& place :
       {kPlace_m, Vector{0, 0, 0.13}, Vector{-0.03, 0.02, 0.10}, Vector{0.02, 0.02, 0.16}}) {
    device_.move_grip(place);
    EXPECT_TRUE(exchange().ok());
    expect_near(sample_.p_OG_m, {place[0] - kOrigin_m[0], place[1] - kOrigin_m[1], place[2] - kOrigin_m[2]},
                kEncoder_m);
  }
}

TEST_F(FalconExchange, CountsAreTheEncoders) {
  home();
  device_.move_grip({-0.00412, -0.02165, 0.13232});
  EXPECT_TRUE(exchange().ok());
  // The place is known to 5 um, a quarter of a count.
  const std::array<int, 3> expected{300, 0, -300};
  for (std::size_t axis = 0; axis < 3; ++axis) EXPECT_NEAR(sample_.counts[axis], expected[axis], 1) << axis;
}

TEST_F(FalconExchange, OriginIsConfigurable) {
  home();
  falcon_.deactivate();
  Falcon other(device_, {.p_FO_m = {0.01, 0.02, 0.15}});
  (void)other.activate();
  EXPECT_TRUE(other.exchange({}, sample_).ok());
  EXPECT_TRUE(sample_.homed) << "was homed before and is still";
  expect_near(sample_.p_OG_m, {0.0, -0.04, -0.03}, kEncoder_m);
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
      EXPECT_FALSE(sample_.limited);
      expect_near(device_.force_N(), force, 0.03);
      expect_near(sample_.f_G_F_N, force, 1e-12);
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
  end_ramp(other);
  device_.move_grip({0, 0, 0.13460});
  EXPECT_TRUE(other.exchange({}, sample_).ok());
  EXPECT_TRUE(other.exchange({0, 0, 1}, sample_).ok());
  EXPECT_EQ(device_.motors(), (Motors{125, 125, 125}));
}

TEST_F(FalconExchange, ForceBeyondTheLimitKeepsItsDirection) {
  home();
  device_.move_grip(kOrigin_m);
  EXPECT_TRUE(exchange().ok());
  EXPECT_TRUE(exchange({0, 7.2, 9.6}).ok());
  EXPECT_TRUE(sample_.limited);
  expect_near(sample_.f_G_F_N, {0, 4.8, 6.4}, 1e-12);
  expect_near(device_.force_N(), {0, 4.8, 6.4}, 0.03);
  EXPECT_TRUE(exchange({0, 0, 8}).ok());
  EXPECT_FALSE(sample_.limited);
  constexpr double kHuge = std::numeric_limits<double>::max();
  EXPECT_TRUE(exchange({kHuge, kHuge, kHuge}).ok());
  EXPECT_TRUE(sample_.limited);
  EXPECT_LE(magnitude(sample_.f_G_F_N), 8.0 + 1e-9);
}

TEST_F(FalconExchange, MotorAtItsEndScalesAllThreeAndSaysSo) {
  home();
  falcon_.deactivate();
  Falcon other(device_, {.force_limit_N = 12.0, .command_per_Nm = -20000.0});
  (void)other.activate();
  end_ramp(other);
  EXPECT_TRUE(other.exchange({2, -3, 11}, sample_).ok());
  EXPECT_TRUE(sample_.limited);
  int largest = 0;
  for (const int motor : device_.motors()) largest = std::max(largest, std::abs(motor));
  EXPECT_EQ(largest, 4096);
  const Vector felt = device_.force_N();
  const double share = sample_.f_G_F_N[2] / 11;
  EXPECT_LT(share, 1.0);
  // The device's own gain is half of the one that is configured here.
  expect_near(felt, {2 * 2 * share, -3 * 2 * share, 11 * 2 * share}, 0.1);
}

TEST_F(FalconExchange, ForceThatIsNotFiniteIsAFaultAndSendsZero) {
  home();
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
                           -std::numeric_limits<double>::infinity()}) {
    for (std::size_t k = 0; k < 3; ++k) {
      run(milliseconds(110), {0, 0, 3});
      EXPECT_NE(device_.motors(), kAtRest);
      const auto before = sample_.stamp;
      Vector force{1, 1, 1};
      force[k] = bad;
      EXPECT_EQ(exchange(force).fault, FalconFault::kBadForce);
      EXPECT_EQ(device_.motors(), kAtRest);
      EXPECT_GT(sample_.stamp, before) << "the reply counts all the same";
      EXPECT_EQ(sample_.f_G_F_N, Vector{});
      EXPECT_TRUE(exchange({0, 0, 3}).ok());
      EXPECT_EQ(device_.motors(), kAtRest) << "fades in";
      run(milliseconds(50), {0, 0, 3});
      EXPECT_NEAR(sample_.f_G_F_N[2], 1.5, 0.031) << "an exchange more or less";
    }
  }
}

TEST_F(FalconExchange, ButtonsAreReported) {
  device_.press(0b1001);
  EXPECT_TRUE(exchange().ok());
  EXPECT_EQ(sample_.buttons, 0b1001);
  device_.press(0);
  EXPECT_TRUE(exchange().ok());
  EXPECT_EQ(sample_.buttons, 0);
}

TEST_F(FalconExchange, MissedReplyLeavesTheSampleAndCostsTheDeadline) {
  home();
  const FalconSample before = sample_;
  device_.move_grip({0, 0, 0.14});
  device_.drop_replies(1);
  const auto start = device_.now();
  EXPECT_EQ(exchange().fault, FalconFault::kMissed);
  EXPECT_GE(device_.now() - start, milliseconds(5));
  EXPECT_LT(device_.now() - start, milliseconds(6));
  EXPECT_EQ(sample_.stamp, before.stamp);
  EXPECT_EQ(sample_.p_OG_m, before.p_OG_m);
  EXPECT_TRUE(exchange().ok());
  EXPECT_NEAR(sample_.p_OG_m[2], 0.01, kEncoder_m);
}

TEST_F(FalconExchange, MissesThatAreNotInARowAreNotALoss) {
  home();
  for (int i = 0; i < 10; ++i) {
    device_.drop_replies(2);
    EXPECT_EQ(exchange().fault, FalconFault::kMissed);
    EXPECT_EQ(exchange().fault, FalconFault::kMissed);
    EXPECT_TRUE(exchange().ok());
  }
}

// It may hear us although we do not hear it: the motors must not keep the last force.
TEST_F(FalconExchange, ThirdMissInARowIsALossAndZeroForceIsSent) {
  home();
  EXPECT_TRUE(exchange({0, 0, 5}).ok());
  device_.drop_replies(1000);
  EXPECT_EQ(exchange({0, 0, 5}).fault, FalconFault::kMissed);
  EXPECT_EQ(exchange({0, 0, 5}).fault, FalconFault::kMissed);
  EXPECT_NE(device_.motors(), kAtRest);
  EXPECT_EQ(exchange({0, 0, 5}).fault, FalconFault::kLost);
  EXPECT_EQ(device_.motors(), kAtRest);
  device_.drop_replies(0);
  const int commands = device_.commands();
  EXPECT_EQ(exchange({0, 0, 5}).fault, FalconFault::kLost) << "latched";
  EXPECT_EQ(device_.commands(), commands + 2) << "twice, see send_zero()";
  EXPECT_EQ(device_.motors(), kAtRest);
}

TEST_F(FalconExchange, ActivationBringsALostDeviceBackStillHomed) {
  home();
  device_.drop_replies(4);
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(exchange().ok());
  EXPECT_EQ(falcon_.activate(), falcon::Firmware::kWasRunning);
  EXPECT_TRUE(exchange({0, 0, 5}).ok());
  EXPECT_TRUE(sample_.homed);
  EXPECT_EQ(device_.motors(), kAtRest) << "no force on the first packet";
  EXPECT_TRUE(device_.red()) << "not known to be homed";
}

TEST_F(FalconExchange, MissesBeforeAnActivationDoNotCount) {
  home();
  for (int round = 0; round < 2; ++round) {
    device_.drop_replies(2);
    for (int i = 0; i < 2; ++i) EXPECT_EQ(exchange().fault, FalconFault::kMissed);
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
      EXPECT_EQ(exchange().fault, FalconFault::kMissed) << late.count();
      device_.delay_replies(1000, usual);
      int good = 0;
      for (const double z : {0.15, 0.14, 0.13, 0.12, 0.11}) {
        device_.move_grip({0, 0, z});
        if (!exchange().ok()) continue;
        EXPECT_NEAR(sample_.p_OG_m[2], z - kOrigin_m[2], kEncoder_m) << usual.count() << ' ' << late.count();
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
    EXPECT_TRUE(other.exchange({}, sample_).ok());
    EXPECT_NEAR(sample_.p_OG_m[2], z - kOrigin_m[2], kEncoder_m);
  }
}

TEST_F(FalconExchange, LostReplyIsWaitedForHalfADeadlineBehindTheNextAndNoLonger) {
  home();
  device_.drop_replies(1);
  EXPECT_EQ(exchange().fault, FalconFault::kMissed);
  const auto took = [&] {
    const auto start = device_.now();
    EXPECT_TRUE(exchange().ok());
    return device_.now() - start;
  };
  EXPECT_EQ(took(), milliseconds(1) + microseconds(2500));
  EXPECT_EQ(sample_.stamp, device_.now() - microseconds(2500)) << "when it was there";
  (void)took();
  EXPECT_EQ(took(), milliseconds(1));
}

// A reply is 0.11 ms on the wire, as is its command before it; the chip sends on each millisecond.
TEST_F(FalconExchange, LateReplyMayShareItsPacketWithTheNext) {
  home();
  for (const auto& [late, share] : {std::pair(microseconds(4850), true), {microseconds(5740), false}}) {
    device_.delay_replies(1, late);
    EXPECT_EQ(exchange().fault, FalconFault::kMissed);
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
  EXPECT_NEAR(sample_.p_OG_m[2], 0.02, kEncoder_m);
}

TEST_F(FalconExchange, ReplyThatCameBetweenTwoCyclesIsThrownAway) {
  home();
  device_.delay_replies(1, milliseconds(5));
  EXPECT_EQ(exchange().fault, FalconFault::kMissed);
  device_.pass(milliseconds(5));
  device_.move_grip({0, 0, 0.15});
  const auto start = device_.now();
  EXPECT_TRUE(exchange().ok());
  EXPECT_NEAR(sample_.p_OG_m[2], 0.02, kEncoder_m);
  EXPECT_EQ(device_.now() - start, milliseconds(1)) << "none is owed any more";
}

TEST_F(FalconExchange, SplitReplyIsPutTogether) {
  home();
  for (std::size_t first = 1; first < 16; ++first) {
    device_.move_grip({0, 0, 0.12 + 0.001 * static_cast<double>(first)});
    device_.split_replies(1, first);
    EXPECT_TRUE(exchange().ok()) << first;
    EXPECT_NEAR(sample_.p_OG_m[2], -0.01 + 0.001 * static_cast<double>(first), kEncoder_m);
  }
}

TEST_F(FalconExchange, SecondHalfThatComesTooLateIsNotJoinedToTheFirst) {
  home();
  device_.split_replies(1, 8);
  device_.delay_replies(1, microseconds(4500));  // the other half follows 1 ms after the first
  EXPECT_EQ(exchange().fault, FalconFault::kMissed);
  device_.move_grip({0, 0, 0.15});
  EXPECT_TRUE(exchange().ok());
  EXPECT_NEAR(sample_.p_OG_m[2], 0.02, kEncoder_m);
}

TEST_F(FalconExchange, GarbageCostsAtMostTheReplyItSitsIn) {
  home();
  for (const std::uint8_t garbage : std::vector<std::uint8_t>{0x00, '<', '>', 'A', 0xFF}) {
    for (std::size_t place = 0; place <= 16; ++place) {
      device_.insert_into_replies(1, place, garbage);
      const FalconStatus status = exchange();
      const bool outside = place == 0 || place == 16;
      EXPECT_TRUE(status.ok() || (!outside && status.fault == FalconFault::kMissed)) << place;
      device_.move_grip({0, 0, 0.12 + 0.001 * static_cast<double>(place)});
      EXPECT_TRUE(exchange().ok()) << place;
      EXPECT_NEAR(sample_.p_OG_m[2], -0.01 + 0.001 * static_cast<double>(place), kEncoder_m);
    }
  }
}

TEST_F(FalconExchange, CountsThatFitNoPlaceTakeTheForceAway) {
  home();
  EXPECT_TRUE(exchange({0, 0, 3}).ok());
  const FalconSample before = sample_;
  device_.send_counts(1, {5000, -3000, 5000});
  EXPECT_EQ(exchange({0, 0, 3}).fault, FalconFault::kNoPosition);
  EXPECT_EQ(sample_.stamp, before.stamp);
  EXPECT_TRUE(exchange({0, 0, 3}).ok());
  EXPECT_EQ(device_.motors(), kAtRest);
  expect_near(sample_.p_OG_m, before.p_OG_m, 1e-9);
  EXPECT_TRUE(exchange({0, 0, 3}).ok());
  EXPECT_EQ(device_.motors(), kAtRest) << "fades in";
  run(milliseconds(50), {0, 0, 3});
  EXPECT_NEAR(sample_.f_G_F_N[2], 1.5, 0.031) << "an exchange more or less";
  run(milliseconds(51), {0, 0, 3});
  EXPECT_EQ(sample_.f_G_F_N, (Vector{0, 0, 3}));
}

// Places that the legs' equations reach and no hand does.
TEST_F(FalconExchange, PositionOutOfTheWorkspaceIsNone) {
  home();
  for (const Vector& place : {Vector{-0.1, 0, 0.06}, Vector{0.03, -0.08, 0.04}}) {
    ASSERT_TRUE(falcon::leg_angles_rad(place));
    device_.move_grip(place);
    const FalconSample before = sample_;
    EXPECT_EQ(exchange({0, 0, 3}).fault, FalconFault::kNoPosition) << place[0] << ' ' << place[2];
    EXPECT_EQ(sample_.stamp, before.stamp);
    EXPECT_EQ(exchange({0, 0, 3}).fault, FalconFault::kNoPosition);
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
    EXPECT_EQ(exchange().fault, FalconFault::kNoPosition) << edge.outside_m[0];
  }
  device_.move_grip({0, 0, 0.18});  // nearly stretched
  EXPECT_TRUE(exchange().ok());
  EXPECT_NEAR(sample_.p_OG_m[2], 0.05, kEncoder_m);
}

TEST_F(FalconExchange, StallIsAMissWithItsKind) {
  home();
  device_.stall(1);
  const FalconStatus status = exchange();
  EXPECT_EQ(status.fault, FalconFault::kMissed);
  EXPECT_EQ(status.transfer, usb::TransferStatus::kStalled);
  EXPECT_NE(status.detail, 0);
  EXPECT_TRUE(exchange().ok());
  device_.stall(1000);
  EXPECT_EQ(exchange().fault, FalconFault::kMissed);
  EXPECT_EQ(exchange().fault, FalconFault::kMissed);
  EXPECT_EQ(exchange().fault, FalconFault::kLost);
}

// Each exchange is a look for late replies, a write and a read.
TEST_F(FalconExchange, TransferThatFailsIsAMissWithItsCodeWhicheverItIs) {
  for (const usb::TransferStatus kind : {usb::TransferStatus::kOther, usb::TransferStatus::kStalled}) {
    for (int which = 0; which < 3; ++which) {
      tests::WatchedPort port(device_);
      Falcon falcon(port);
      (void)falcon.activate();
      port.failure = {kind, 0, -99};
      port.fail_at = port.transfers + which;
      const FalconStatus status = falcon.exchange({}, sample_);
      EXPECT_EQ(status.fault, FalconFault::kMissed) << which;
      EXPECT_EQ(status.transfer, kind);
      EXPECT_EQ(status.detail, -99);
      EXPECT_TRUE(falcon.exchange({}, sample_).ok());
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
  EXPECT_EQ(falcon.exchange({}, sample_).fault, FalconFault::kMissed);
  EXPECT_EQ(falcon.exchange({}, sample_).fault, FalconFault::kMissed);
  const FalconStatus status = falcon.exchange({}, sample_);
  EXPECT_EQ(status.fault, FalconFault::kLost);
  EXPECT_EQ(status.transfer, usb::TransferStatus::kTimeout);
}

TEST(FalconFlood, EmptyPacketsWithoutEndDoNotHoldTheCycle) {
  tests::FloodingPort port;
  Falcon falcon(port);
  (void)falcon.activate();
  FalconSample sample;
  port.reads = 0;
  EXPECT_EQ(falcon.exchange({}, sample).fault, FalconFault::kMissed);
  EXPECT_LE(port.reads, 64);
}

TEST_F(FalconExchange, UnplugIsKnownAtOnceAndStays) {
  home();
  const auto before = device_.now();
  device_.unplug();
  EXPECT_EQ(exchange({0, 0, 3}).fault, FalconFault::kUnplugged);
  EXPECT_EQ(exchange({0, 0, 3}).fault, FalconFault::kUnplugged);
  EXPECT_EQ(device_.now(), before);
  EXPECT_THROW((void)falcon_.activate(), SetupError);
  EXPECT_EQ(exchange().fault, FalconFault::kIdle);
}

TEST_F(FalconExchange, DeviceThatIsNoMoreHomedGetsNoForce) {
  home();
  EXPECT_TRUE(exchange({0, 0, 3}).ok());
  const Vector before = sample_.p_OG_m;
  forget_homing();
  EXPECT_TRUE(exchange({0, 0, 3}).ok());
  EXPECT_FALSE(sample_.homed);
  EXPECT_EQ(sample_.p_OG_m, before) << "the last one known";
  EXPECT_TRUE(exchange({0, 0, 3}).ok());
  EXPECT_EQ(device_.motors(), kAtRest);
  EXPECT_TRUE(device_.red());

  device_.pull_and_push();
  for (int i = 0; i < 2; ++i) EXPECT_TRUE(exchange({0, 0, 3}).ok());
  EXPECT_TRUE(sample_.homed);
  EXPECT_EQ(device_.motors(), kAtRest) << "fades in, all over again";
  run(milliseconds(500), {0, 0, 3});
  EXPECT_NEAR(sample_.f_G_F_N[2], 1.5, 0.01);
}

TEST_F(FalconExchange, HomingAnewTakesTheLongRampAlsoBehindAFault) {
  home();
  EXPECT_EQ(exchange({std::numeric_limits<double>::quiet_NaN(), 0, 0}).fault, FalconFault::kBadForce);
  forget_homing();
  run(milliseconds(5));
  EXPECT_FALSE(sample_.homed);
  device_.pull_and_push();
  for (int i = 0; i < 2; ++i) EXPECT_TRUE(exchange().ok());
  EXPECT_TRUE(sample_.homed);
  run(milliseconds(500), {0, 0, 3});
  EXPECT_NEAR(sample_.f_G_F_N[2], 1.5, 0.01);
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
    end_ramp(other);
    EXPECT_TRUE(other.exchange({0, 0, 3}, sample_).ok());
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
    end_ramp(*pushing_);
    EXPECT_TRUE(pushing_->exchange({0, 0, 3}, sample_).ok());
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
  EXPECT_EQ(pushing_->exchange({}, sample_).fault, FalconFault::kIdle);
  pushing_.reset();
  EXPECT_EQ(device_.motors(), kAtRest);
}

// This may be the zero-force packet.
TEST_F(FalconThatPushes, PacketGoesOutAlsoWhenTheLookForLateRepliesFails) {
  push();
  fail_next(1);
  const FalconStatus status = pushing_->exchange({}, sample_);
  EXPECT_EQ(status.fault, FalconFault::kMissed);
  EXPECT_EQ(status.transfer, usb::TransferStatus::kStalled);
  EXPECT_EQ(device_.motors(), kAtRest);
}

TEST_F(FalconThatPushes, ForceWhoseWriteOnlySeemedToFailIsTakenAway) {
  home();
  pushing_.emplace(port_);
  (void)pushing_->activate();
  end_ramp(*pushing_);
  fail_next(1, usb::TransferStatus::kTimeout);
  port_.fail_at += 1;  // behind the look for late replies
  port_.only_says_so = true;
  EXPECT_EQ(pushing_->exchange({0, 0, 3}, sample_).fault, FalconFault::kMissed);
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
    EXPECT_EQ(pushing_->exchange({0, 0, 3}, sample_).fault, FalconFault::kMissed);
  }
  fail_next(2 + 3);
  EXPECT_EQ(pushing_->exchange({0, 0, 3}, sample_).fault, FalconFault::kLost);
  EXPECT_EQ(device_.motors(), kAtRest);
}

TEST_F(FalconThatPushes, LostDeviceGetsZeroAsSoonAsItHears) {
  push();
  fail_next(2 + 2 + 2 + 5);  // three times a look for late replies and a packet
  for (int i = 0; i < 2; ++i) EXPECT_FALSE(pushing_->exchange({0, 0, 3}, sample_).ok());
  EXPECT_EQ(pushing_->exchange({0, 0, 3}, sample_).fault, FalconFault::kLost);
  EXPECT_NE(device_.motors(), kAtRest);
  fail_next(2);
  EXPECT_EQ(pushing_->exchange({0, 0, 3}, sample_).fault, FalconFault::kLost);
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
  EXPECT_TRUE(sound([](auto& c) { c.ramp = c.ramp_again = milliseconds(60'000); }));
  EXPECT_FALSE(sound([](auto& c) { c.ramp = milliseconds(60'001); }));
  EXPECT_FALSE(sound([](auto& c) { c.ramp_again = milliseconds(60'001); }));
  EXPECT_TRUE(sound([](auto& c) { c.lost_after_misses = 10; }));
  EXPECT_FALSE(sound([](auto& c) { c.lost_after_misses = 11; }));
  EXPECT_TRUE(sound([](auto& c) { c.command_per_Nm = -5e4; }));
  EXPECT_FALSE(sound([](auto& c) { c.command_per_Nm = -50'001.0; }));
  EXPECT_FALSE(sound([](auto& c) { c.command_per_Nm = 0.0; }));
  EXPECT_FALSE(sound([](auto& c) { c.ramp = milliseconds(99); }));
  EXPECT_FALSE(sound([](auto& c) { c.ramp_again = milliseconds(99); }));
  EXPECT_FALSE(sound([](auto& c) { c.boot.alive_timeout = {}; }));
  EXPECT_FALSE(sound([](auto& c) { c.boot.query_timeout = {}; }));
  EXPECT_FALSE(sound([](auto& c) { c.boot.echo_timeout = {}; }));
  EXPECT_FALSE(sound([](auto& c) { c.boot.write_timeout = milliseconds(-1); }));
}

TEST(FalconFault, EachHasItsOwnWords) {
  std::vector<std::string> words;
  for (int i = 0; i <= static_cast<int>(FalconFault::kUnplugged); ++i) {
    words.emplace_back(describe(static_cast<FalconFault>(i)));
    EXPECT_NE(words.back(), "unknown fault");
    for (int k = 0; k < i; ++k) EXPECT_NE(words[static_cast<std::size_t>(k)], words.back());
  }
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
