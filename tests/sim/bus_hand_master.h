/// @file
/// Hand-written datagrams, one frame each, for tests of the emulated bus, without any logic of the real
/// master.
#pragma once
#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <vector>

#include "drivers/ethercat/al_status.h"
#include "drivers/ethercat/frame.h"
#include "drivers/ethercat/registers.h"
#include "sim/bus/emulated_bus.h"

namespace sim::bus::test {

namespace reg = drivers::ethercat::reg;
using drivers::ethercat::AlState;
using drivers::ethercat::Command;
using Bytes = std::vector<std::uint8_t>;
using namespace std::chrono_literals;

inline constexpr std::uint16_t kStation = 0x1001;  // of the first slave, counted up
inline constexpr std::uint32_t kLogical = 0x0001'0000;

/// A drive: mailbox of 32 bytes, 5 bytes out, 20 bytes in.
inline SlaveDescription drive() {
  SlaveDescription description;
  description.name = "TMCM-1610";
  description.vendor = 0x0000'0286;
  description.product = 0x0000'0011;
  description.revision = 0x0002'0001;
  description.serial = 0x1234'5678;
  description.mailbox_out = {.start = 0x1000, .length = 32};
  description.mailbox_in = {.start = 0x1040, .length = 32};
  description.outputs = {.start = 0x1100, .bytes = 5};
  description.inputs = {.start = 0x1180, .bytes = 20};
  description.has_distributed_clock = true;
  return description;
}

/// A power board: nothing but a controller.
inline SlaveDescription power_board() {
  SlaveDescription description;
  description.name = "KR-845";
  description.vendor = 0x0000'0286;
  return description;
}

inline SlaveDescription only_outputs() {
  SlaveDescription description = drive();
  description.inputs = {};
  return description;
}

inline SlaveDescription only_inputs() {
  SlaveDescription description = drive();
  description.outputs = {};
  return description;
}

struct Answer {
  bool returned = false;
  std::uint16_t counter = 0;
  std::uint16_t slave = 0;
  std::uint16_t interrupt = 0;
  Bytes data;

  std::uint64_t number() const {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < data.size() && i < 8; ++i) value |= std::uint64_t{data[i]} << (8 * i);
    return value;
  }
};

inline Bytes bytes_of(std::uint64_t value, std::size_t count) {
  Bytes bytes(count);
  for (std::size_t i = 0; i < count; ++i) bytes[i] = static_cast<std::uint8_t>(value >> (8 * i));
  return bytes;
}

/// A frame of several datagrams.
class HandFrame {
 public:
  HandFrame& add(Command command, std::uint32_t address, const Bytes& data) {
    const drivers::ethercat::Datagram datagram = writer_.add(command, 0x5A, address, data.size());
    std::ranges::copy(data, datagram.data.begin());
    return *this;
  }
  Bytes bytes() {
    const std::span<const std::uint8_t> frame = writer_.bytes();
    return {frame.begin(), frame.end()};
  }

 private:
  drivers::ethercat::FrameWriter writer_;
};

inline std::vector<Answer> answers_in(Bytes frame, bool returned) {
  std::vector<Answer> answers;
  drivers::ethercat::FrameReader reader;
  drivers::ethercat::Datagram datagram;
  reader.parse(frame);
  while (reader.next(datagram)) {
    answers.push_back({.returned = returned,
                       .counter = datagram.working_counter(),
                       .slave = datagram.slave(),
                       .interrupt = datagram.interrupt,
                       .data = Bytes(datagram.data.begin(), datagram.data.end())});
  }
  return answers;
}

class HandMaster {
 public:
  explicit HandMaster(EmulatedBus& bus) : bus_(bus) {}

  std::vector<Answer> run(HandFrame frame) {
    Bytes bytes = frame.bytes();
    const bool returned = bus_.process(bytes);
    return answers_in(bytes, returned);
  }
  Answer run(Command command, std::uint32_t address, const Bytes& data) {
    return run(HandFrame().add(command, address, data)).front();
  }
  Answer run(Command command, std::uint16_t slave, std::uint16_t offset, const Bytes& data) {
    return run(command, drivers::ethercat::address_of(slave, offset), data);
  }

  // `slave`: place on the bus, from 0.
  Answer read(std::size_t slave, std::uint16_t offset, std::size_t count) {
    return run(Command::kAprd, position(slave), offset, Bytes(count));
  }
  Answer write(std::size_t slave, std::uint16_t offset, const Bytes& data) {
    return run(Command::kApwr, position(slave), offset, data);
  }
  Answer write(std::size_t slave, std::uint16_t offset, std::uint64_t value, std::size_t count) {
    return write(slave, offset, bytes_of(value, count));
  }
  Answer exchange(const Bytes& image) { return run(Command::kLrw, kLogical, image); }

  std::uint16_t al_status(std::size_t slave) {
    return static_cast<std::uint16_t>(read(slave, reg::kAlStatus, 2).number());
  }
  std::uint16_t al_code(std::size_t slave) {
    return static_cast<std::uint16_t>(read(slave, reg::kAlStatusCode, 2).number());
  }
  std::uint16_t request(std::size_t slave, std::uint16_t control) {
    write(slave, reg::kAlControl, control, 2);
    return al_status(slave);
  }
  std::uint16_t request(std::size_t slave, AlState state) {
    return request(slave, static_cast<std::uint16_t>(state));
  }

  void write_manager(std::size_t slave, std::size_t manager, const SyncManagerSetting& setting) {
    Bytes registers = bytes_of(setting.start | std::uint32_t{setting.length} << 16, 4);
    registers.insert(registers.end(),
                     {setting.control, 0, static_cast<std::uint8_t>(setting.length > 0 ? 1 : 0), 0});
    write(slave, static_cast<std::uint16_t>(reg::kSyncManager + 8 * manager), registers);
  }
  void write_fmmu(std::size_t slave, std::size_t fmmu, std::uint32_t logical, std::uint16_t length,
                  std::uint8_t start_bit, std::uint8_t stop_bit, std::uint16_t physical,
                  std::uint8_t physical_bit, std::uint8_t type) {
    Bytes registers = bytes_of(logical, 4);
    const Bytes bytes = bytes_of(length, 2);
    registers.insert(registers.end(), bytes.begin(), bytes.end());
    registers.insert(registers.end(),
                     {start_bit, stop_bit, static_cast<std::uint8_t>(physical),
                      static_cast<std::uint8_t>(physical >> 8), physical_bit, type, 1, 0, 0, 0});
    write(slave, static_cast<std::uint16_t>(reg::kFmmu + 16 * fmmu), registers);
  }

  /// Station addresses, sync managers and FMMUs for everything; all outputs, then all inputs, from kLogical.
  void configure() {
    std::uint32_t logical = kLogical;
    for (const SyncManagerUse use : {SyncManagerUse::kOutputs, SyncManagerUse::kInputs}) {
      for (std::size_t i = 0; i < bus_.size(); ++i) {
        write(i, reg::kStationAddress, kStation + i, 2);
        const std::vector<SyncManagerSetting> managers = sync_managers_of(bus_.slave(i).description());
        for (std::size_t k = 0; k < managers.size(); ++k) {
          write_manager(i, k, managers[k]);
          if (managers[k].use != use || managers[k].length == 0) continue;
          const bool outputs = use == SyncManagerUse::kOutputs;
          write_fmmu(i, outputs ? 0 : 1, logical, managers[k].length, 0, 7, managers[k].start, 0,
                     outputs ? 2 : 1);
          logical += managers[k].length;
        }
      }
    }
    image_bytes_ = logical - kLogical;
  }
  std::size_t image_bytes() const { return image_bytes_; }

  /// All slaves to `state`, with outputs of zero on the way to OP.
  void bring_up(AlState state) {
    configure();
    for (const AlState step : {AlState::kPreOp, AlState::kSafeOp, AlState::kOp}) {
      if (step > state) break;
      if (step == AlState::kOp && image_bytes_ > 0) exchange(Bytes(image_bytes_));
      for (std::size_t i = 0; i < bus_.size(); ++i) request(i, step);
    }
  }

  static std::uint16_t position(std::size_t slave) {
    return drivers::ethercat::position_address(static_cast<std::uint16_t>(slave));
  }

 private:
  EmulatedBus& bus_;
  std::size_t image_bytes_ = 0;
};

/// Records its slave's calls; answers mailboxes with `reply` if that is not empty.
class RecordingBoard : public Application {
 public:
  explicit RecordingBoard(EmulatedSlave& slave) : slave_(slave) { slave.attach(*this); }

  void power_changed(bool on) noexcept override { powered = on; }
  void state_changed(AlState state) noexcept override { states.push_back(state); }
  bool mailbox_received(std::span<const std::uint8_t> message) noexcept override {
    if (busy) return false;
    request.assign(message.begin(), message.end());
    if (!reply.empty()) posted = slave_.post_mailbox(reply);
    return true;
  }
  void outputs_changed(std::span<const std::uint8_t> data) noexcept override {
    outputs.assign(data.begin(), data.end());
    ++output_writes;
  }
  void inputs(std::span<std::uint8_t> data) noexcept override {
    std::copy_n(input_data.begin(), std::min(input_data.size(), data.size()), data.begin());
  }
  void watchdog_expired() noexcept override { ++watchdogs; }
  void advance(std::chrono::nanoseconds step) noexcept override { time += step; }
  void fault(BoardFault fault, bool present) noexcept override {
    stuck = fault == BoardFault::kStuckEncoder && present;
  }

  std::vector<AlState> states;
  Bytes request;
  Bytes reply;
  Bytes outputs;
  Bytes input_data;
  bool busy = false;
  bool posted = false;
  bool powered = true;
  bool stuck = false;
  int output_writes = 0;
  int watchdogs = 0;
  std::chrono::nanoseconds time{};

 private:
  EmulatedSlave& slave_;
};

}  // namespace sim::bus::test
