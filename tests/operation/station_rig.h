/// @file
/// Teleoperation from another computer in virtual time: the operator's station with a simulated hand, a
/// simulated network, and the robot's station with the daemon's own cycle and a simulated robot.
#pragma once
#include <chrono>
#include <cstdint>
#include <memory>
#include <vector>

#include "runtime/station/operator_cycle.h"
#include "runtime/station/remote_haptic_link.h"
#include "tests/operation/teleop_expectations.h"
#include "tests/operation/teleop_rig.h"
#include "tests/support/channel_port.h"

namespace teleop_rig {

/// A port that the rig owns.
class BorrowedPort final : public drivers::station::DatagramPort {
 public:
  explicit BorrowedPort(drivers::station::DatagramPort& port) : port_(port) {}
  std::size_t receive(std::span<std::uint8_t> buffer) noexcept override { return port_.receive(buffer); }
  void send(std::span<const std::uint8_t> datagram) noexcept override { port_.send(datagram); }
  void answer(std::span<const std::uint8_t> datagram) noexcept override { port_.answer(datagram); }
  void adopt_sender() noexcept override { port_.adopt_sender(); }

 private:
  drivers::station::DatagramPort& port_;
};

/// Of the operator's station, in each cycle.
struct HandRecord {
  Eigen::Vector3d p_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d v_m_per_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d force_N = Eigen::Vector3d::Zero();  ///< on the hand
};

class StationRig {
 public:
  struct Options {
    sim::NetworkConditions network{};
    std::uint64_t seed = 1;
    runtime::LinkOptions link{};
    TeleopCycle::Config control = quick_config();
    Scene scene = unfolded_scene();
  };

  explicit StationRig(const Options& options)
      : network(options.network, options.seed, clock),
        plant(options.scene.robot, options.scene.environment),
        hand(options.scene.hand),
        robot(plant, clock, kPeriod, joints()),
        device(
            std::make_unique<hal::LoopbackHapticLink>(
                hand, kPeriod, hal::HapticInfo{.name = "pen", .force_limit_N = 8.0, .senses_rotation = true}),
            clock, {}),
        remote(std::make_unique<runtime::RemoteHapticLink>(
                   [this] { return std::make_unique<BorrowedPort>(network.at_robot); }, key(), options.link,
                   runtime::RemoteHapticLink::Limits{.force_N = 8.0}, nullptr),
               clock, robot_limits(options.link)),
        config_(options.control) {
    robot.watch.allow_enables(1);
    robot.activate();
    device.activate();
    remote.activate();
    station.emplace(device, network.at_operator, key(), options.link, nullptr);
    cycle.emplace(config_, robot, remote);
  }

  /// One cycle of both stations.
  void step() {
    clock.sleep_until(clock.now() + kPeriod);
    station->step(clock.now());
    cycle->step(clock.now());
    records.push_back(cycle->record());
    hands.push_back({hand.p_HD_m(), hand.v_HD_H_m_per_s(), hand.device_force_N()});
  }
  void run(std::chrono::nanoseconds duration) {
    for (std::chrono::nanoseconds t{}; t < duration; t += kPeriod) step();
  }
  bool run_until(control::TeleopPhase phase, std::chrono::nanoseconds limit = std::chrono::seconds(90)) {
    for (std::chrono::nanoseconds t{}; t < limit; t += kPeriod) {
      step();
      if (cycle->task().phase() == phase) return true;
    }
    return false;
  }
  /// The operator enables it again, after a fault.
  void start_again() {
    robot.watch.allow_enables(1);
    cycle.emplace(config_, robot, remote);
  }
  control::TeleopPhase phase() const { return cycle->task().phase(); }

  static drivers::station::Key key() { return drivers::station::Key({1, 2, 3}); }
  static hal::HapticLimits robot_limits(const runtime::LinkOptions& link) {
    hal::HapticLimits limits;
    limits.stale_after = std::chrono::duration_cast<std::chrono::milliseconds>(link.endpoint.silence);
    return limits;
  }

  hal::VirtualClock clock;
  support::ChannelPair network;
  sim::MobileManipulator plant;
  sim::Hand hand;
  support::WatchedLoopback robot;
  hal::LockstepHapticDevice device;  ///< at the operator's station
  hal::LockstepHapticDevice remote;  ///< at the robot's
  std::optional<runtime::OperatorCycle> station;
  std::optional<TeleopCycle> cycle;
  std::vector<TeleopRecord> records;
  std::vector<HandRecord> hands;

 private:
  TeleopCycle::Config config_;
};

}  // namespace teleop_rig
