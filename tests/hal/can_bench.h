/// @file
/// The CAN backend on the simulated bench rig: a socket pair instead of an interface, virtual time.
#pragma once
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <memory>
#include <vector>

#include "drivers/can/socket_can.h"
#include "drivers/tmcl/transport.h"
#include "hal/can_robot.h"
#include "sim/can/bench_rig.h"
#include "tests/support/watched_robot.h"

namespace hal::test {

using namespace std::chrono_literals;

/// Transfers frames between a socket and the rig while time passes.
class CanCable final : public drivers::tmcl::Clock {
 public:
  explicit CanCable(sim::can::BenchRig& rig) : rig_(rig) {}
  ~CanCable() override { close_bus(); }

  /// May be called for each activation.
  drivers::can::SocketCan open() {
    close_bus();
    std::array<int, 2> ends{};
    EXPECT_EQ(::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK, 0, ends.data()), 0);
    bus_ = ends[1];
    return {ends[0], "bench0"};
  }

  std::chrono::nanoseconds now() noexcept override { return rig_.now(); }
  void wait(std::chrono::nanoseconds duration) noexcept override {
    pump();
    rig_.advance(duration);
    pump();
  }

  /// Sends a frame that is not the module's.
  void inject(const can_frame& frame) noexcept {
    (void)!::send(bus_, &frame, sizeof(frame), MSG_DONTWAIT | MSG_NOSIGNAL);
  }
  /// Records the host's frames from now on.
  void record(bool on = true) { recording_ = on; }
  const std::vector<can_frame>& recorded() const noexcept { return recorded_; }

 private:
  void pump() noexcept {
    can_frame frame{};
    while (::recv(bus_, &frame, sizeof(frame), MSG_DONTWAIT) == sizeof(frame)) {
      if (recording_) recorded_.push_back(frame);
      (void)rig_.send(frame);  // a full queue loses it, which the kernel would report as ENOBUFS
    }
    while (rig_.receive(frame)) (void)!::send(bus_, &frame, sizeof(frame), MSG_DONTWAIT | MSG_NOSIGNAL);
  }
  void close_bus() noexcept {
    if (bus_ >= 0) ::close(bus_);
    bus_ = -1;
  }

  sim::can::BenchRig& rig_;
  int bus_ = -1;
  bool recording_ = false;
  std::vector<can_frame> recorded_;
};

struct CanBench {
  explicit CanBench(const CanOptions& options = {}, const sim::can::BenchRigOptions& rig_options = {},
                    std::chrono::nanoseconds cycle = 1ms)
      : period(cycle),
        rig(rig_options),
        watch(rig, {.name = options.joint_name,
                    .torque_Nm = support::torque_limit_Nm(rig_options.joint.axis),
                    .speed_rad_per_s = options.axis.speed_limit_rad_per_s,
                    .range = {rig_options.joint.lower_stop_rad, rig_options.joint.upper_stop_rad}}),
        robot(watch.over(make_can_robot([this] { return cable.open(); }, options, clock, period, &cable))) {}

  CycleStatus step() {
    clock.sleep_until(clock.now() + period);
    status = robot->exchange(command, sample);
    cable.wait(period);
    return status;
  }
  void run(std::chrono::nanoseconds duration) {
    for (auto left = duration; left > 0ms; left -= period) (void)step();
  }
  /// Cycles until `condition`, at most `limit`; returns the duration.
  template <typename Condition>
  std::chrono::nanoseconds run_until(Condition&& condition, std::chrono::nanoseconds limit = 10s) {
    std::chrono::nanoseconds passed{0};
    for (; passed < limit && !condition(); passed += period) (void)step();
    return passed;
  }
  void enable() {
    command.enable = true;
    (void)step();
    run_until([this] { return sample.enabled || !status.ok(); });
    ASSERT_TRUE(sample.enabled) << describe_can(status);
  }
  double velocity_rad_per_s() const { return rig.joint().velocity_rad_per_s(); }

  std::chrono::nanoseconds period;
  VirtualClock clock;
  sim::can::BenchRig rig;
  support::CanWatch watch;
  CanCable cable{rig};
  std::unique_ptr<Robot> robot;
  RobotCommand command;
  RobotSample sample;
  CycleStatus status;
};

}  // namespace hal::test
