/// @file
/// One motor controller board on its own bus, with ideal mechanics.
#pragma once
#include <array>
#include <cstdint>
#include <span>

#include "drivers/tmcl/process_data.h"
#include "drivers/tmcl/telegram.h"
#include "sim/bus/tmcm_board.h"
#include "tests/sim/bus_hand_master.h"

namespace sim::bus::test {

using drivers::tmcl::ControllerMode;
using drivers::tmcl::DriveInput;
using drivers::tmcl::DriveOutput;
using drivers::tmcl::Firmware;
using drivers::tmcl::Status;
using drivers::tmcl::StatusFlag;

/// Follows a velocity at once; a torque acts on a locked joint. No noise.
class IdealJoint final : public BoardDrive {
 public:
  void command(const hal::JointCommand& command, bool powered) noexcept override {
    last = command;
    enabled = powered;
  }
  hal::JointSample measured() const noexcept override {
    return {position_rad, velocity_rad_per_s, torque_Nm};
  }
  void advance(double seconds) noexcept {
    velocity_rad_per_s = torque_Nm = 0.0;
    if (!enabled || blocked) return;
    if (last.mode == hal::CommandMode::kVelocity) velocity_rad_per_s = last.target;
    if (last.mode == hal::CommandMode::kTorque) torque_Nm = last.target;
    position_rad += velocity_rad_per_s * seconds;
  }

  hal::JointCommand last;
  bool enabled = false;
  bool blocked = false;
  double position_rad = 0.0;
  double velocity_rad_per_s = 0.0;
  double torque_Nm = 0.0;
};

using Telegram = std::array<std::uint8_t, 8>;

class TmcmBench {
 public:
  /// A joint turn is ten motor turns; 1 A is 1 N·m at the joint.
  static BoardAxis axis() { return {.gear_ratio = 10, .torque_constant_Nm_per_A = 0.1}; }
  static TmcmOptions options_for(Firmware version) {
    TmcmOptions options;
    options.firmware = version;
    options.axis = axis();
    return options;
  }

  explicit TmcmBench(Firmware version) : TmcmBench(options_for(version)) {}
  explicit TmcmBench(const TmcmOptions& options) : firmware(options.firmware), board(slave, joint, options) {}

  void bring_up(AlState state = AlState::kOp) { master.bring_up(state); }

  /// Cycles of a millisecond with this output.
  void run(int cycles, const DriveOutput& output) {
    for (int i = 0; i < cycles; ++i) {
      Bytes image(master.image_bytes());
      pack(output, std::span(image).first(40));
      const Answer answer = master.exchange(image);
      if (answer.counter == 3) unpack(firmware, std::span(answer.data).subspan(40), input);
      pass(1);
    }
  }
  /// Time without frames.
  void pass(int milliseconds) {
    for (int i = 0; i < milliseconds; ++i) {
      joint.advance(0.001);
      bus.advance(1ms);
    }
  }
  /// Through the mailbox, without process data meanwhile. All zero: no reply within 50 ms.
  Telegram ask(const Telegram& request) {
    Bytes mailbox(kMailbox);
    std::ranges::copy(request, mailbox.begin());
    if (master.write(0, 0x1000, mailbox).counter != 1) return {};
    for (int i = 0; i < 50; ++i) {
      pass(1);
      const Answer answer = master.read(0, 0x1040, kMailbox);
      if (answer.counter != 1) continue;
      Telegram reply;
      std::copy_n(answer.data.begin(), reply.size(), reply.begin());
      return reply;
    }
    return {};
  }
  drivers::tmcl::Reply ask(drivers::tmcl::Command command, std::uint8_t type, std::int32_t value = 0,
                           std::uint8_t motor = 0, std::uint8_t module = 0) {
    return *drivers::tmcl::decode_mailbox_reply(ask(encode_mailbox(drivers::tmcl::Request{
        .module = module, .command = command, .type = type, .motor = motor, .value = value})));
  }
  Status set(std::uint8_t number, std::int32_t value) {
    return ask(drivers::tmcl::Command::kSetAxisParameter, number, value).status;
  }
  std::int32_t get(std::uint8_t number) {
    return ask(drivers::tmcl::Command::kGetAxisParameter, number).value;
  }
  bool has(StatusFlag flag) const { return input.flags.has(flag); }

  /// In OP with known commutation, standing.
  void start() {
    bring_up();
    if (firmware == Firmware::k148) {
      run(510, {ControllerMode::kInitialize, 0});
    } else {
      run(200, {ControllerMode::kVelocity, 100});
    }
    run(100, {ControllerMode::kVelocity, 0});
  }

  static constexpr std::size_t kMailbox = 32;
  static SlaveDescription description() {
    SlaveDescription result = drive();
    result.outputs = {.start = 0x1100, .bytes = 40};
    result.inputs = {.start = 0x1200, .bytes = 40};
    return result;
  }

  Firmware firmware;
  EmulatedBus bus;
  EmulatedSlave& slave = bus.add(description());
  HandMaster master{bus};
  IdealJoint joint;
  TmcmBoard board;
  DriveInput input;
};

}  // namespace sim::bus::test
