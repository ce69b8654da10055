/// @file
/// Robots with watched motors: a test fails if a rule of RobotWatch is broken.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "hal/clock.h"
#include "hal/loopback_robot.h"
#include "hal/plant.h"
#include "hal/robot.h"
#include "hal/robot_wrapper.h"
#include "sim/bus/youbot_bus.h"
#include "sim/can/bench_rig.h"
#include "tests/support/robot_watch.h"

namespace support {

/// Reports in its destructor.
class TestWatch : public RobotWatch {
 public:
  using RobotWatch::RobotWatch;
  TestWatch(const TestWatch&) = delete;
  TestWatch& operator=(const TestWatch&) = delete;
  ~TestWatch() {
    for (const std::string& violation : violations())
      EXPECT_TRUE(std::ranges::any_of(expected_, [&](const std::string& part) {
        return has(violation, part);
      })) << violation;
    for (const std::string& part : expected_)
      EXPECT_TRUE(std::ranges::any_of(violations(), [&](const auto& found) { return has(found, part); }))
          << "no violation: " << part;
  }

  /// The robot whose enables and disables count.
  std::unique_ptr<hal::Robot> over(std::unique_ptr<hal::Robot> robot);
  /// The test breaks a rule on purpose: a violation must contain this text.
  void expect_violation(std::string part) { expected_.push_back(std::move(part)); }
  /// Permission follows the enables of the robot's HAL interface; limited to this many, if given.
  void allow_enables(int count) { enables_left_ = count; }
  void enable() {
    if (enables_left_ && --*enables_left_ < 0) violate("the robot is enabled by itself");
    permit();
  }

 private:
  static bool has(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
  }
  std::vector<std::string> expected_;
  std::optional<int> enables_left_;
};

/// Wraps the HAL interface and reports enable, disable and fault to the watch.
class WatchedRobot final : public hal::RobotWrapper {
 public:
  WatchedRobot(std::unique_ptr<hal::Robot> robot, TestWatch& watch)
      : RobotWrapper(std::move(robot)), watch_(watch) {}
  ~WatchedRobot() override { watch_.forbid(); }

  void activate() override {
    enable_ = false;
    RobotWrapper::activate();
  }
  void deactivate() noexcept override {
    RobotWrapper::deactivate();
    watch_.forbid();
  }
  hal::CycleStatus exchange(const hal::RobotCommand& command, hal::RobotSample& sample) noexcept override {
    if (command.enable && !enable_) watch_.enable();
    enable_ = command.enable;
    const hal::CycleStatus status = RobotWrapper::exchange(command, sample);
    // Making up for missed time still belongs to the previous command: after the exchange.
    if (!command.enable || !status.ok())
      watch_.forbid();
    else if (sample.enabled)
      watch_.obeys();
    return status;
  }

 private:
  TestWatch& watch_;
  bool enable_ = false;
};

inline std::unique_ptr<hal::Robot> TestWatch::over(std::unique_ptr<hal::Robot> robot) {
  return std::make_unique<WatchedRobot>(std::move(robot), *this);
}

/// For an emulated robot on a bus, which must outlive it.
class BusWatch final : public TestWatch {
 public:
  explicit BusWatch(sim::bus::YoubotBus& bus)
      : TestWatch(robot_limits(bus.has_base(), bus.arm_count())), bus_(bus) {
    bus_.after_each_period([this] { look(); });
  }
  ~BusWatch() { bus_.after_each_period(nullptr); }

 private:
  void look() {
    std::array<FollowedDrive, hal::kMaxJoints> drives;
    const std::span joints(drives.data(), bus_.joint_count());
    look_at(bus_, joints);
    RobotWatch::look(bus_.wire().now(), joints);
  }

  sim::bus::YoubotBus& bus_;
};

/// For the bench rig, which must outlive it. Its module has no watchdog, and requests get lost: repetitions
/// until the acknowledgement come later.
class CanWatch final : public TestWatch {
 public:
  CanWatch(sim::can::BenchRig& rig, DriveLimits limits)
      : TestWatch({std::move(limits)}, {.until_heard = std::chrono::milliseconds(20), .watchdog = false}),
        rig_(rig) {
    rig_.after_each_period([this] { look(); });
  }
  ~CanWatch() { rig_.after_each_period(nullptr); }

 private:
  void look() {
    FollowedDrive drive = followed_by(rig_.board(), rig_.joint().position_rad());
    drive.unheard = rig_.unheard();
    RobotWatch::look(rig_.now(), std::span(&drive, 1));
  }
  sim::can::BenchRig& rig_;
};

/// A watched loopback robot.
class WatchedLoopback final : public hal::Robot {
 public:
  /// Like hal::LoopbackRobot. The limits are those of `joints`.
  WatchedLoopback(hal::Plant& plant, const hal::Clock& clock, nanoseconds period,
                  const std::vector<hal::JointInfo>& joints)
      : watch(limits_of(joints)),
        plant_(plant, watch),
        robot_(std::make_unique<hal::LoopbackRobot>(plant_, clock, period, joints), watch) {}

  std::span<const hal::JointInfo> joints() const noexcept override { return robot_.joints(); }
  void activate() override { robot_.activate(); }
  void deactivate() noexcept override { robot_.deactivate(); }
  hal::CycleStatus exchange(const hal::RobotCommand& command, hal::RobotSample& sample) noexcept override {
    return robot_.exchange(command, sample);
  }

  TestWatch watch;

 private:
  class Plant final : public hal::Plant {
   public:
    Plant(hal::Plant& plant, TestWatch& watch) : plant_(plant), watch_(watch) {}
    int joint_count() const noexcept override { return plant_.joint_count(); }
    void measure(std::span<hal::JointSample> samples) noexcept override {
      plant_.measure(samples);
      for (std::size_t i = 0; i < samples.size(); ++i) homed_[i] = samples[i].homed;
    }
    void advance(std::span<const hal::JointCommand> commands, bool powered,
                 nanoseconds duration) noexcept override {
      plant_.advance(commands, powered, duration);
      now_ += duration;
      std::array<FollowedDrive, hal::kMaxJoints> drives;
      // In the period that enables, there is no sample with the joints' positions yet.
      for (std::size_t i = 0; powered && i < commands.size(); ++i)
        drives[i] = {.mode = mode_of(commands[i].mode),
                     .target = commands[i].target,
                     .homed = homed_[i] && watch_.obeying()};
      watch_.look(now_, std::span(drives).first(commands.size()));
    }

   private:
    static FollowedDrive::Mode mode_of(hal::CommandMode mode) {
      using enum FollowedDrive::Mode;
      return mode == hal::CommandMode::kTorque     ? kCurrent
             : mode == hal::CommandMode::kVelocity ? kVelocity
                                                   : kPosition;
    }
    hal::Plant& plant_;
    TestWatch& watch_;
    nanoseconds now_{};
    std::array<bool, hal::kMaxJoints> homed_{};
  };

  static std::vector<DriveLimits> limits_of(const std::vector<hal::JointInfo>& joints) {
    std::vector<DriveLimits> limits;
    for (const hal::JointInfo& joint : joints)
      limits.push_back({joint.name, joint.torque_limit_Nm, joint.speed_limit_rad_per_s, joint.range});
    return limits;
  }

  Plant plant_;
  WatchedRobot robot_;
};

}  // namespace support
