// Both ends of a teleoperation from another computer: cycles without allocation, and what the operator's
// station refuses.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "hal/clock.h"
#include "hal/lockstep_haptic_device.h"
#include "hal/loopback_haptic_link.h"
#include "hal/setup_error.h"
#include "runtime/station/operator_cycle.h"
#include "runtime/station/remote_haptic_link.h"
#include "runtime/station/station_values.h"
#include "sim/hand.h"
#include "tests/support/channel_port.h"
#include "tests/support/direct_port.h"
#include "tests/support/no_alloc_guard.h"

namespace station_test {

using namespace runtime;
using namespace std::chrono_literals;
using std::chrono::nanoseconds;

drivers::station::Key key() { return drivers::station::Key({1}); }

/// The port that the test keeps.
class Borrowed final : public drivers::station::DatagramPort {
 public:
  explicit Borrowed(DatagramPort& port) : port_(port) {}
  std::size_t receive(std::span<std::uint8_t> buffer) noexcept override { return port_.receive(buffer); }
  void send(std::span<const std::uint8_t> datagram) noexcept override { port_.send(datagram); }
  void answer(std::span<const std::uint8_t> datagram) noexcept override { port_.answer(datagram); }
  void adopt_sender() noexcept override { port_.adopt_sender(); }

 private:
  DatagramPort& port_;
};

/// A handle that may lose its home.
class HomedHandle final : public hal::HapticLink {
 public:
  HomedHandle(sim::Hand& hand, const bool& homed)
      : handle_(hand, 1ms, hal::HapticInfo{.name = "pen", .force_limit_N = 8.0, .senses_rotation = true}),
        homed_(homed) {}
  const hal::HapticInfo& info() const noexcept override { return handle_.info(); }
  void open() override { handle_.open(); }
  bool close() noexcept override { return handle_.close(); }
  hal::HapticStatus exchange(const hal::HapticCommand& command, nanoseconds now,
                             hal::HapticSample& sample) noexcept override {
    const hal::HapticStatus status = handle_.exchange(command, now, sample);
    return homed_ ? status : hal::HapticStatus{hal::HapticFault::kNotReady};
  }
  std::string describe(const hal::HapticStatus& status) const override { return handle_.describe(status); }

 private:
  hal::LoopbackHapticLink handle_;
  const bool& homed_;
};

struct Stations {
  explicit Stations(const RemoteHapticLink::Limits& limits = {.force_N = 8.0})
      : device(std::make_unique<HomedHandle>(hand, homed), clock, {}),
        remote([this] { return std::make_unique<Borrowed>(at_robot); }, key(), {}, limits, monitor) {
    at_robot.other = &at_operator;
    at_operator.other = &at_robot;
    device.activate();
    remote.open();
    station.emplace(device, at_operator, key(), LinkOptions{}, nullptr);
  }
  void step(const hal::HapticCommand& command) {
    clock.sleep_until(clock.now() + 1ms);
    station->step(clock.now());
    status = remote.exchange(command, clock.now(), sample);
  }
  hal::VirtualClock clock;
  sim::Hand hand{sim::HandParameters{}};
  bool homed = true;
  support::DirectPort at_operator;
  support::DirectPort at_robot;
  std::shared_ptr<LinkMonitor> monitor = std::make_shared<LinkMonitor>();
  hal::LockstepHapticDevice device;
  RemoteHapticLink remote;
  std::optional<OperatorCycle> station;
  hal::HapticSample sample;
  hal::HapticStatus status{};
};

TEST(Stations, NeitherEndAllocatesOrLocksInACycle) {
  Stations stations;
  long violations = 0;
  {
    const support::NoAllocGuard guard;
    for (int i = 0; i < 2000; ++i) stations.step({i > 500, {1, 0, 0}});
    violations = guard.violations();
  }
  EXPECT_EQ(violations, 0);
  EXPECT_TRUE(stations.status.ok());
}

TEST(Stations, TheForceArrivesAtTheHandAndItsMotionAtTheRobot) {
  Stations stations;
  for (int i = 0; i < 3000; ++i) stations.step({true, {0.5, 0, 0}});
  // 300 N/m of the hand's spring.
  EXPECT_NEAR(stations.hand.p_HD_m().x(), 0.5 / 300, 1e-4);
  EXPECT_NEAR(stations.sample.p_HD_m.x(), stations.hand.p_HD_m().x(), 1e-6);
  ASSERT_TRUE(stations.sample.felt_f_D_H_N);
  EXPECT_NEAR(stations.sample.felt_f_D_H_N->x(), 0.5, 1e-6);
  drivers::station::LinkReport report;
  ASSERT_TRUE(stations.monitor->take(report));
  EXPECT_TRUE(report.connected);
}

TEST(Stations, AMissingStationReadsOtherwiseThanAFaultOfItsDevice) {
  Stations stations;
  support::DirectPort nowhere;
  stations.at_operator.other = &nowhere;
  stations.step({});
  EXPECT_EQ(stations.status.fault, hal::HapticFault::kNotReady);
  EXPECT_EQ(stations.remote.describe(stations.status),
            "no operator's station with a ready haptic device is connected");
}

TEST(Stations, AfterAShortFaultThatTheRobotMissedTheForceStaysOffUntilItAsksForNone) {
  const hal::HapticCommand force{true, {0.5, 0, 0}};
  Stations stations;
  for (int i = 0; i < 3000; ++i) stations.step(force);
  ASSERT_GT(stations.station->force_N().norm(), 0.4);
  support::DirectPort nowhere;
  stations.at_operator.other = &nowhere;  // the messages of the fault are lost
  stations.homed = false;
  for (int i = 0; i < 5; ++i) stations.step(force);
  stations.homed = true;
  stations.step(force);
  stations.at_operator.other = &stations.at_robot;
  for (int i = 0; i < 3000; ++i) {
    stations.step(force);
    EXPECT_EQ(stations.status.fault, hal::HapticFault::kNotReady);
    ASSERT_EQ(stations.station->force_N().norm(), 0) << i;
  }
  EXPECT_EQ(stations.remote.describe(stations.status), "operator's haptic device: no position yet");
  for (int i = 0; i < 200; ++i) stations.step({});
  for (int i = 0; i < 3000; ++i) stations.step(force);
  EXPECT_GT(stations.station->force_N().norm(), 0.4);
}

TEST(Stations, TheRobotFollowsMoreSlowlyThanItsServoAllows) {
  Stations stations({.force_N = 8.0, .speed_m_per_s = 0.2});
  for (int i = 0; i < 1000; ++i) stations.step({});
  stations.hand.move_to({0.03, 0, 0}, 100ms);
  double most_m = 0;
  for (int i = 0; i < 1000; ++i) {
    const double before_m = stations.sample.p_HD_m.x();
    stations.step({});
    most_m = std::max(most_m, stations.sample.p_HD_m.x() - before_m);
  }
  EXPECT_LT(most_m, 0.2 * 1e-3);
  EXPECT_NEAR(stations.sample.p_HD_m.x(), 0.03, 1e-4) << "it arrives";
}

/// As Stations, over a simulated network with 50 ms of jitter.
struct DistantStations {
  explicit DistantStations(std::uint64_t seed)
      : network({.delay = 50ms, .jitter = 50ms}, seed, clock),
        device(std::make_unique<hal::LoopbackHapticLink>(
                   hand, 1ms, hal::HapticInfo{.name = "pen", .force_limit_N = 8.0, .senses_rotation = true}),
               clock, {}),
        remote([this] { return std::make_unique<Borrowed>(network.at_robot); }, key(), options,
               {.force_N = 8.0}, nullptr) {
    device.activate();
    remote.open();
    station.emplace(device, network.at_operator, key(), options, nullptr);
  }
  void run(nanoseconds duration, const hal::HapticCommand& command) {
    largest_N = 0;
    for (nanoseconds t{}; t < duration; t += 1ms) {
      clock.sleep_until(clock.now() + 1ms);
      station->step(clock.now());
      status = remote.exchange(command, clock.now(), sample);
      no_command_seen = no_command_seen || status.fault == hal::HapticFault::kNoCommand;
      largest_N = std::max(largest_N, station->force_N().norm());
    }
  }
  LinkOptions options;
  hal::VirtualClock clock;
  support::ChannelPair network;
  sim::Hand hand{sim::HandParameters{}};
  hal::LockstepHapticDevice device;
  RemoteHapticLink remote;
  std::optional<OperatorCycle> station;
  hal::HapticSample sample;
  hal::HapticStatus status{};
  bool no_command_seen = false;
  double largest_N = 0;
};

// A report in a few messages only would come to nothing: later ones overtake them on the way.
TEST(Stations, AfterAShortSilenceTheForceStaysOffUntilTheRobotAsksForNone) {
  const hal::HapticCommand force{true, {0.5, 0, 0}};
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    DistantStations stations(seed);
    stations.run(3s, force);
    ASSERT_GT(stations.largest_N, 0.4) << "seed " << seed;
    ASSERT_FALSE(stations.no_command_seen) << "seed " << seed;
    stations.network.to_operator.set_silent(true);
    for (int n = 0; n < 400 && stations.largest_N > 0; ++n) stations.run(1ms, force);
    stations.run(2ms, force);
    stations.network.to_operator.set_silent(false);
    stations.run(150ms, force);
    EXPECT_TRUE(stations.no_command_seen) << "seed " << seed;
    stations.run(3s, force);
    EXPECT_EQ(stations.largest_N, 0) << "seed " << seed;
    EXPECT_EQ(stations.station->report(stations.clock.now()).sessions, 1U) << "seed " << seed;
    // A restart: the robot's station first asks for no force.
    stations.run(200ms, {});
    stations.run(3s, force);
    EXPECT_GT(stations.largest_N, 0.4) << "seed " << seed;
  }
}

TEST(Stations, ADeviceThatIsNoHandleIsRefused) {
  sim::Hand hand{sim::HandParameters{}};
  const hal::VirtualClock clock;
  hal::LockstepHapticDevice cap(
      std::make_unique<hal::LoopbackHapticLink>(hand, 1ms, hal::HapticInfo{.name = "cap", .rate_only = true}),
      clock, {});
  support::DirectPort port;
  EXPECT_THROW(OperatorCycle(cap, port, key(), {}, nullptr), hal::SetupError);
}

TEST(StationValues, SurviveTheLink) {
  hal::HapticSample sample;
  sample.p_HD_m = {0.012345678, -0.5, 2};
  sample.q_HD = Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5);
  sample.buttons = 5;
  hal::HapticSample read;
  from_link(to_link(sample, {1, -2, 3}, 2ms), read);
  EXPECT_LT((read.p_HD_m - sample.p_HD_m).norm(), 1e-9);
  EXPECT_LT(read.q_HD.angularDistance(sample.q_HD), 1e-8);
  EXPECT_EQ(read.buttons, 5U);
  EXPECT_EQ(to_link(sample, {1, -2, 3}, 2ms).age_us, 2000U);
  EXPECT_NEAR(energy_from_link(energy_to_link(0.123456789)), 0.123456789, 1e-9);
}

TEST(StationValues, WhatDoesNotFitIsClamped) {
  EXPECT_EQ(to_link(Eigen::Vector3d(1e9, -1e9, NAN)).force_uN,
            (std::array<std::int32_t, 3>{INT32_MAX, -INT32_MAX, 0}));
  EXPECT_EQ(energy_to_link(1e300), std::int64_t{1} << 62);
}

}  // namespace station_test
