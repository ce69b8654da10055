/// @file
/// Common fixture of the tests of the EtherCAT robot.
#pragma once
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <memory>
#include <vector>

#include "hal/clock.h"
#include "hal/ethercat_robot.h"
#include "sim/bus/bus_link.h"
#include "sim/bus/youbot_bus.h"
#include "tests/support/watched_robot.h"

namespace hal::test {

using namespace std::chrono_literals;
using drivers::tmcl::Firmware;
using sim::bus::FaultEvent;

/// The robot and its emulated boards in one process, a millisecond per step.
struct EthercatRig {
  explicit EthercatRig(YoubotKind kind = YoubotKind::kBase, Firmware firmware = Firmware::k148,
                       std::vector<FaultEvent> faults = {})
      : EthercatRig(options(kind, firmware, std::move(faults)), {.kind = kind}) {}

  /// `sabotage` wraps the true robot for the test's calls.
  EthercatRig(
      const sim::bus::YoubotBusOptions& bus, const EthercatOptions& ethercat,
      const std::function<std::unique_ptr<Robot>(std::unique_ptr<Robot>)>& sabotage =
          [](auto whole) { return whole; })
      : emulation(bus),
        robot(watch.over(sabotage(make_ethercat_robot(
            [this]() -> std::unique_ptr<drivers::ethercat::Link> {
              return std::make_unique<sim::bus::BusLink>(emulation.wire(), &emulation);
            },
            ethercat, clock, 1ms)))) {}

  static sim::bus::YoubotBusOptions options(YoubotKind kind, Firmware firmware = Firmware::k148,
                                            std::vector<FaultEvent> faults = {}) {
    sim::bus::YoubotBusOptions options;
    options.robot = kind == YoubotKind::kBase         ? sim::bus::YoubotKind::kBase
                    : kind == YoubotKind::kArm        ? sim::bus::YoubotKind::kArm
                    : kind == YoubotKind::kBaseAndArm ? sim::bus::YoubotKind::kBaseAndArm
                                                      : sim::bus::YoubotKind::kBaseAndTwoArms;
    options.board.firmware = firmware;
    options.base.on_ground = false;
    options.wire.faults = std::move(faults);
    return options;
  }

  CycleStatus step() {
    clock.sleep_until(clock.now() + 1ms);
    const std::chrono::nanoseconds due = emulation.wire().now() + 1ms;
    status = robot->exchange(command, sample);
    if (due > emulation.wire().now()) emulation.advance(due - emulation.wire().now());
    return status;
  }
  void run(std::chrono::milliseconds duration) {
    for (auto left = duration; left > 0ms; left -= 1ms) (void)step();
  }
  /// Cycles until `condition`, at most `limit`; returns the duration.
  template <typename Condition>
  std::chrono::milliseconds run_until(Condition&& condition, std::chrono::milliseconds limit = 20s) {
    std::chrono::milliseconds passed{0};
    for (; passed < limit && !condition(); passed += 1ms) (void)step();
    return passed;
  }
  void enable() {
    command.enable = true;
    run_until([this] { return sample.enabled; });
    ASSERT_TRUE(sample.enabled) << describe(status.fault);
  }
  void command_all_velocity(double velocity_rad_per_s) {
    for (JointCommand& joint : command.joints) joint = JointCommand::velocity_rad_per_s(velocity_rad_per_s);
  }

  VirtualClock clock;
  sim::bus::YoubotBus emulation;
  support::BusWatch watch{emulation};
  std::unique_ptr<Robot> robot;
  RobotCommand command;
  RobotSample sample;
  CycleStatus status;
};

}  // namespace hal::test
