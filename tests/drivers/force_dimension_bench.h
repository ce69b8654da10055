/// @file
/// The Force Dimension driver in virtual time with the stand-in for the vendor's library.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "drivers/haptic/force_dimension.h"
#include "drivers/setup_error.h"
#include "tests/drivers/force_dimension_fakes.h"

namespace drivers::haptic {

using namespace std::chrono_literals;
using sim::devices::ForceDimensionMode;
using std::chrono::nanoseconds;
using Fault = HapticFault;

inline constexpr ForceDimensionCommand kOff{};
/// Enabled, without a force.
inline constexpr ForceDimensionCommand kHold{.enable = true, .f_D_H_N = {}};
inline constexpr Vector3 kZero_N{};
inline constexpr double kWeight_N = 0.25 * 9.81;
inline constexpr std::chrono::milliseconds kCycle{1};
inline constexpr std::chrono::milliseconds kWatchdog{20};
/// The settling, and the cycle at its end.
inline constexpr std::chrono::milliseconds kUntilFullForce{101};

inline bool says(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}
inline ForceDimensionCommand push(double x_N, double y_N = 0.0, double z_N = 0.0) {
  return {.enable = true, .f_D_H_N = {x_N, y_N, z_N}};
}
inline double norm(const sim::devices::Axes& v) { return std::hypot(v[0], v[1], v[2]); }

/// The driver with a stand-in; time advances by cycles, pass(), and waits of the driver.
struct ForceDimensionBench : testing::Test {
  ForceDimensionBench() {
    config.wait = [this](nanoseconds time) { pass(time); };
  }

  void load(const std::vector<std::string>& without) {
    device.reset();
    // Never overwrites a loaded file.
    stand_in = std::make_unique<StandIn>(folder, std::to_string(++loaded) + ".so", without);
  }
  void open() {
    device.reset();
    const ForceDimensionLibrary library({.file = stand_in->path(), .sdk_folder = {}});
    device = std::make_unique<ForceDimension>(library, config);
  }
  std::string refusal() {
    try {
      open();
      return "opened " + device->info().name;
    } catch (const SetupError& error) {
      return error.what();
    }
  }
  bool warned(const std::string& part) const {
    const auto& warnings = device->info().warnings;
    return std::any_of(warnings.begin(), warnings.end(), [&](const auto& text) { return says(text, part); });
  }

  void pass(nanoseconds time) {
    now += time;
    stand_in->control().advance(std::chrono::duration<double>(time).count());
  }
  const DeviceStatus& cycle(const ForceDimensionCommand& command) {
    const double begin_s = state().time_s;
    status = device->exchange(command, now, sample);
    // Duration of the calls.
    now += std::chrono::duration_cast<nanoseconds>(std::chrono::duration<double>(state().time_s - begin_s));
    pass(kCycle);
    return status;
  }
  /// Cycles for `time`; gives the last status.
  const DeviceStatus& run(nanoseconds time, const ForceDimensionCommand& command) {
    for (const nanoseconds end = now + time; now < end;) {
      cycle(command);
      if (!status.ok()) faults += 1;
    }
    return status;
  }
  /// Cycles until a fault; false if `time` was over first.
  bool faults_within(nanoseconds time, const ForceDimensionCommand& command) {
    for (const nanoseconds end = now + time; now < end;) {
      if (!cycle(command).ok()) return true;
    }
    return false;
  }
  /// Opened, enabled, settled.
  void start(const ForceDimensionCommand& command = kHold) {
    open();
    faults = 0;
    ASSERT_TRUE(run(kUntilFullForce, command).ok()) << words();
    ASSERT_EQ(faults, 0);
  }

  std::string words() const { return describe_force_dimension(status.fault, status.detail); }
  const sim::devices::ForceDimensionState& state() const { return stand_in->state(); }
  sim::devices::ForceDimensionCalls& calls() const { return stand_in->calls(); }
  sim::devices::ForceDimensionScript& script() const { return stand_in->script(); }
  /// Force of the motors on the hand, without the handle's weight.
  double felt_N() const {
    if (state().mode != ForceDimensionMode::kForce) return norm(state().motor_N);
    return std::hypot(state().motor_N[0], state().motor_N[1], state().motor_N[2] - kWeight_N);
  }

  support::TemporaryDirectory folder;
  int loaded = 0;
  std::unique_ptr<StandIn> stand_in = std::make_unique<StandIn>(folder, "library.so");
  ForceDimensionConfig config;
  nanoseconds now = std::chrono::seconds(1);
  DeviceSample sample;
  DeviceStatus status;
  int faults = 0;
  std::unique_ptr<ForceDimension> device;  // last: its destructor uses the members above
};

}  // namespace drivers::haptic
