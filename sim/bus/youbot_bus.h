/// @file
/// The complete emulated robot: boards on their bus, in bus order, and their mechanics.
#pragma once
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/tmcl/youbot_kind.h"
#include "sim/base.h"
#include "sim/bus/arm_joint.h"
#include "sim/bus/axis_data.h"
#include "sim/bus/bus_link.h"
#include "sim/bus/emulated_bus.h"
#include "sim/bus/emulated_wire.h"
#include "sim/bus/gripper_board.h"
#include "sim/bus/manipulator_mechanics.h"
#include "sim/bus/tmcm_board.h"
#include "sim/bus/wheel_mechanics.h"
#include "sim/environment.h"

namespace sim::bus {

using drivers::tmcl::YoubotKind;

/// Boards were renamed: TMCM-174 and -KR-841, later TMCM-1632 and -1610.
enum class Hardware : std::uint8_t { kFirst, kLater };

struct YoubotBusOptions {
  YoubotKind robot = YoubotKind::kBase;
  Hardware hardware = Hardware::kLater;
  /// For every board, except its axis data: `controller` and `axis` are filled in.
  TmcmOptions board = {};
  BoardAxis wheel = kWheelBoardAxis;
  std::array<ArmJointData, 5> arm = kArmJointData;
  std::array<double, 5> arm_start_rad{0.2, 0.2, -0.2, 0.2, 0.2};  ///< nearly folded
  std::uint16_t process_data_bytes = 40;                          ///< each direction; see youbot_bus.cpp
  bool gripper = true;
  GripperOptions gripper_options = {};
  BaseParameters base = {};
  /// Only for kBaseAndArm: base and arm are one body with weight (sim/mobile_manipulator.h), and the arm
  /// sinks without power. Otherwise each arm joint is independent, as tests of boards and bus need.
  bool coupled = false;
  control::ModelChanges masses = built_robot();  ///< of the coupled robot, from the description
  EnvironmentParameters scene = {};  ///< objects that the end effector of the coupled arm can touch
  /// Timed: a master in the process that waits for a reply advances emulated time; otherwise no mailbox would
  /// ever be due.
  WireOptions wire = {.timed = true, .faults = {}};
  SlaveOptions slave = {};
  /// Mark of the slaves in their EEPROMs, drivers/ethercat/simulated_bus.h; empty as on a robot, so that a
  /// master treats them like a robot.
  std::string mark = {};
  std::uint64_t noise_seed = 1;  ///< of the arms; the base has its own, which a coupled robot uses
};

/// Bus order (official driver): KR-845 and wheels 1 to 4, then per arm KR-843 and joints 1 to 5. Power boards
/// are slaves without process data. Joints are numbered as in the official driver: wheels, then arm by arm.
///
/// In the process: `BusLink link(robot.wire(), &robot)`. Behind a socket: wire().send() and receive() for the
/// frames, advance() for the time. One thread; advance() does not allocate. Mechanics and boards advance in
/// periods of a millisecond, however small the steps.
class YoubotBus final : public EmulatedTime {
 public:
  /// @throws std::invalid_argument for invalid options.
  explicit YoubotBus(const YoubotBusOptions& options = {});

  void advance(std::chrono::nanoseconds step) noexcept;
  void wait(std::chrono::nanoseconds step) noexcept override { advance(step); }
  /// Time until the end of this period, when mechanics and boards advance.
  std::chrono::nanoseconds until_period() const noexcept { return until_period_; }
  /// Setup: called at the end of each period, after mechanics and boards.
  void after_each_period(std::function<void()> look) noexcept { look_ = std::move(look); }
  /// Lifts a base off the ground, or sets it down.
  void set_on_ground(bool on_ground) noexcept;

  EmulatedBus& bus() noexcept { return bus_; }
  EmulatedWire& wire() noexcept { return *wire_; }
  std::size_t joint_count() const noexcept { return joints_.size(); }
  TmcmBoard& board(std::size_t joint) noexcept { return *joints_[joint].board; }
  EmulatedSlave& slave(std::size_t joint) noexcept { return bus_.slave(joints_[joint].position); }
  /// Position of a joint on the bus, from 0.
  std::size_t position(std::size_t joint) const noexcept { return joints_[joint].position; }
  GripperBoard& gripper(std::size_t arm) noexcept { return *grippers_[arm]; }
  std::size_t gripper_count() const noexcept { return grippers_.size(); }

  std::size_t arm_count() const noexcept { return (joints_.size() - wheel_count()) / 5; }
  bool has_base() const noexcept { return wheels_ || manipulator_; }

  /// True pose of the base, if there is one.
  const control::PlanarPose& pose() noexcept {
    return manipulator_ ? manipulator_->pose() : wheels_->base().pose();
  }
  double position_rad(std::size_t joint) noexcept;
  /// The complete coupled robot; null for others.
  MobileManipulator* manipulator() noexcept { return manipulator_ ? &manipulator_->robot() : nullptr; }
  /// Not for a coupled robot.
  Base& base() noexcept { return wheels_->base(); }
  ArmJoint& arm_joint(std::size_t arm, std::size_t joint) noexcept { return *arm_joints_[5 * arm + joint]; }

 private:
  struct Joint {
    std::size_t position;
    std::unique_ptr<TmcmBoard> board;
  };
  void add_base(const YoubotBusOptions& options);
  void add_arm(const YoubotBusOptions& options);
  BoardDrive& arm_drive(const YoubotBusOptions& options, std::size_t joint);
  EmulatedSlave& add_slave(const YoubotBusOptions& options, SlaveDescription description);
  void add_power_board(const YoubotBusOptions& options, const char* name, int number);
  void add_board(const YoubotBusOptions& options, const char* name, int controller, const BoardAxis& axis,
                 BoardDrive& drive);
  std::size_t wheel_count() const noexcept { return has_base() ? MecanumWheels::kCount : 0; }
  void advance_mechanics() noexcept;

  EmulatedBus bus_;
  std::unique_ptr<ManipulatorMechanics> manipulator_;  // replaces the following two
  std::unique_ptr<WheelMechanics> wheels_;
  std::vector<std::unique_ptr<ArmJoint>> arm_joints_;
  std::vector<std::unique_ptr<GripperBoard>> grippers_;
  std::vector<Joint> joints_;
  std::optional<EmulatedWire> wire_;
  std::chrono::nanoseconds until_period_ = TmcmBoard::kPeriod;
  std::function<void()> look_;
};

}  // namespace sim::bus
