#include "sim/bus/youbot_bus.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace sim::bus {
namespace {

using drivers::tmcl::Firmware;
using std::chrono::nanoseconds;

// Identity: the vendor is confirmed; process data addresses and sizes are from the device table of an old
// SOEM, plausible but unconfirmed. Mailbox addresses and lengths are ours. Any master reads all of them from
// the SII. The product codes are not known, except that they differ between boards: SOEM assumes that a slave
// with known vendor, product and revision is of the same kind and does not read its SII again, and drivers
// based on it distinguish the boards by their names. Here the product code is the number in the name.
constexpr std::uint32_t kVendor = 0x286;

SlaveDescription power_board(const char* name, int number) {
  return {.name = name, .vendor = kVendor, .product = static_cast<std::uint32_t>(number)};
}

SlaveDescription motor_board(const char* name, int number, Firmware firmware,
                             std::uint16_t process_data_bytes) {
  SlaveDescription description = power_board(name, number);
  description.outputs = {
      .start = 0x1000, .bytes = process_data_bytes, .entries = {{0x7000, 1, 32}, {0x7000, 2, 8}}};
  description.inputs = {.start = 0x1100, .bytes = process_data_bytes};
  const unsigned inputs = firmware == Firmware::k148 ? 5 : 8;  // 32 bits each
  for (unsigned i = 1; i <= std::min(inputs, process_data_bytes / 4U); ++i)
    description.inputs.entries.push_back({0x6000, static_cast<std::uint8_t>(i), 32});
  description.mailbox_out = {.start = 0x1800, .length = 64};
  description.mailbox_in = {.start = 0x1880, .length = 64};
  return description;
}

MobileManipulatorParameters manipulator_parameters(const YoubotBusOptions& options) {
  MobileManipulatorParameters parameters;
  parameters.wheels = static_cast<const MecanumWheelParameters&>(options.base);
  parameters.step = options.base.step;
  parameters.arm = options.arm;
  parameters.masses = options.masses;
  parameters.start_rad = control::ArmVector(options.arm_start_rad.data());
  return parameters;
}

}  // namespace

YoubotBus::YoubotBus(const YoubotBusOptions& options) {
  const bool base = options.robot != YoubotKind::kArm;
  const int arms = options.robot == YoubotKind::kBase             ? 0
                   : options.robot == YoubotKind::kBaseAndTwoArms ? 2
                                                                  : 1;
  if (options.coupled && options.robot != YoubotKind::kBaseAndArm)
    throw std::invalid_argument("emulated robot: coupled needs a base and one arm");
  if (options.coupled)
    manipulator_ = std::make_unique<ManipulatorMechanics>(manipulator_parameters(options), options.scene);
  else if (base)
    wheels_ = std::make_unique<WheelMechanics>(options.base);
  if (base) add_base(options);
  for (int i = 0; i < arms; ++i) add_arm(options);
  wire_.emplace(bus_, options.wire);
}

void YoubotBus::add_base(const YoubotBusOptions& options) {
  add_power_board(options, "KR-845", 845);
  const bool later = options.hardware == Hardware::kLater;
  for (std::size_t i = 0; i < 4; ++i)
    add_board(options, later ? "TMCM-1632" : "TMCM-174", later ? 1632 : 174, options.wheel,
              manipulator_ ? manipulator_->drive(i) : wheels_->drive(i));
}

void YoubotBus::add_arm(const YoubotBusOptions& options) {
  add_power_board(options, "KR-843", 843);
  const bool later = options.hardware == Hardware::kLater;
  for (std::size_t i = 0; i < options.arm.size(); ++i)
    add_board(options, later ? "TMCM-1610" : "TMCM-KR-841", later ? 1610 : 841, options.arm[i].axis,
              arm_drive(options, i));
  if (!options.gripper) return;
  grippers_.push_back(std::make_unique<GripperBoard>(options.gripper_options));
  joints_.back().board->attach(*grippers_.back());
}

BoardDrive& YoubotBus::arm_drive(const YoubotBusOptions& options, std::size_t joint) {
  if (manipulator_) return manipulator_->drive(wheel_count() + joint);
  arm_joints_.push_back(std::make_unique<ArmJoint>(options.arm[joint], options.arm_start_rad[joint],
                                                   options.noise_seed + 100 + arm_joints_.size()));
  return *arm_joints_.back();
}

EmulatedSlave& YoubotBus::add_slave(const YoubotBusOptions& options, SlaveDescription description) {
  description.group = options.mark;
  return bus_.add(std::move(description), options.slave);
}

void YoubotBus::add_power_board(const YoubotBusOptions& options, const char* name, int number) {
  add_slave(options, power_board(name, number));
}

void YoubotBus::add_board(const YoubotBusOptions& options, const char* name, int controller,
                          const BoardAxis& axis, BoardDrive& drive) {
  TmcmOptions board = options.board;
  board.controller = controller;
  board.axis = axis;
  EmulatedSlave& slave =
      add_slave(options, motor_board(name, controller, board.firmware, options.process_data_bytes));
  joints_.push_back({bus_.size() - 1, std::make_unique<TmcmBoard>(slave, drive, board)});
}

void YoubotBus::advance(nanoseconds step) noexcept {
  while (step.count() > 0) {
    const nanoseconds part = std::min(step, until_period_);
    step -= part;
    until_period_ -= part;
    // First completes the period that ends now, so that the boards read its result.
    const bool ends = until_period_.count() == 0;
    if (ends) {
      advance_mechanics();
      until_period_ = TmcmBoard::kPeriod;
    }
    wire_->advance(part);
    if (ends && look_) look_();
  }
}

void YoubotBus::set_on_ground(bool on_ground) noexcept {
  if (manipulator_) manipulator_->robot().set_on_ground(on_ground);
  if (wheels_) wheels_->base().set_on_ground(on_ground);
}

void YoubotBus::advance_mechanics() noexcept {
  if (manipulator_) manipulator_->advance(TmcmBoard::kPeriod);
  if (wheels_) wheels_->advance(TmcmBoard::kPeriod);
  for (const auto& joint : arm_joints_) joint->advance(TmcmBoard::kPeriod);
}

double YoubotBus::position_rad(std::size_t joint) noexcept {
  const std::size_t arm_joint = joint - wheel_count();  // for an unused wheel
  if (manipulator_)
    return joint < wheel_count() ? manipulator_->robot().wheel(static_cast<int>(joint)).position_rad()
                                 : manipulator_->robot().arm_rad()[static_cast<Eigen::Index>(arm_joint)];
  return joint < wheel_count() ? base().wheel(static_cast<int>(joint)).position_rad()
                               : arm_joints_[arm_joint]->position_rad();
}

}  // namespace sim::bus
