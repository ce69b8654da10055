/// @file
/// Counterparts of the EtherCAT master in tests: scripted links, and the emulated youBot with observable
/// boards.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "drivers/ethercat/bus_error.h"
#include "drivers/ethercat/frame.h"
#include "drivers/ethercat/link.h"
#include "drivers/ethercat/pre_op_bus.h"
#include "drivers/ethercat/registers.h"
#include "sim/bus/bus_link.h"
#include "sim/bus/emulated_bus.h"
#include "sim/bus/emulated_wire.h"
#include "tests/support/no_alloc_guard.h"

namespace drivers::ethercat::test {

using Bytes = std::vector<std::uint8_t>;
using namespace std::chrono_literals;
using sim::bus::BoardFault;
using sim::bus::EmulatedBus;
using sim::bus::EmulatedSlave;
using sim::bus::EmulatedWire;
using sim::bus::FaultEvent;
using sim::bus::FaultKind;
using sim::bus::SlaveDescription;
using sim::bus::SlaveOptions;

/// The text of the BusError that `action` throws; empty if it does not throw.
template <typename Action>
std::string error_of(Action&& action) {
  try {
    action();
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return {};
}

inline ::testing::AssertionResult contains(const std::string& text, const std::string& part) {
  if (text.find(part) != std::string::npos) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << "no \"" << part << "\" in \"" << text << "\"";
}

/// Answers each frame with the frames that `respond` puts into `incoming`; takes no time.
class ScriptedLink final : public Link {
 public:
  bool send(std::span<const std::uint8_t> frame) noexcept override {
    sent.emplace_back(frame.begin(), frame.end());
    if (refuse_errno != 0) return false;
    if (respond) respond(sent.back());
    return true;
  }
  std::size_t receive(std::span<std::uint8_t> buffer, std::chrono::nanoseconds) noexcept override {
    ++receives;
    if (incoming.empty()) return 0;
    const Bytes frame = incoming.front();
    incoming.pop_front();
    const std::size_t size = std::min(frame.size(), buffer.size());
    std::copy_n(frame.begin(), size, buffer.begin());
    return size;
  }
  int last_error() const noexcept override { return refuse_errno; }
  const std::string& name() const noexcept override { return name_; }
  std::chrono::nanoseconds now() const noexcept override { return time; }

  std::chrono::nanoseconds time{};
  std::deque<Bytes> incoming;
  std::vector<Bytes> sent;
  std::function<void(const Bytes&)> respond;
  int refuse_errno = 0;
  int receives = 0;

 private:
  const std::string name_ = "scripted";
};

/// Forwards frames. Both hooks may change them; on_send drops the frame before the slaves by returning true,
/// on_receive behind them by returning false.
class MeddlingLink final : public Link {
 public:
  explicit MeddlingLink(Link& link) : link_(link) {}
  bool send(std::span<const std::uint8_t> frame) noexcept override {
    ++frames;
    if (refused != 0) return false;
    longest = std::max(longest, frame.size());
    if (!on_send) return link_.send(frame);
    Bytes copy(frame.begin(), frame.end());
    return on_send(copy) || link_.send(copy);
  }
  std::size_t receive(std::span<std::uint8_t> buffer, std::chrono::nanoseconds timeout) noexcept override {
    const std::size_t size = link_.receive(buffer, timeout);
    if (size > 0 && on_receive && !on_receive(buffer.first(size))) return 0;
    return size;
  }
  std::chrono::nanoseconds now() const noexcept override { return link_.now(); }
  void wait(std::chrono::nanoseconds duration) override { link_.wait(duration); }
  int last_error() const noexcept override { return refused != 0 ? refused : link_.last_error(); }
  const std::string& name() const noexcept override { return link_.name(); }

  int refused = 0;  // errno with which it refuses all frames
  std::function<bool(Bytes&)> on_send;
  std::function<bool(std::span<std::uint8_t>)> on_receive;
  int frames = 0;
  std::size_t longest = 0;

 private:
  Link& link_;
};

/// SOEM's source address.
inline constexpr MacAddress kSoem{0x01, 0x01, 0x01, 0x01, 0x01, 0x01};

/// A frame of one datagram that another master sends.
inline Bytes frame_of_another_master(Command command, std::uint32_t address, std::uint16_t value = 0) {
  FrameWriter writer(kSoem);
  store_le(writer.add(command, 0x21, address, 2).data.data(), value);
  return {writer.bytes().begin(), writer.bytes().end()};
}

/// The first datagram of a frame for which `wanted` holds.
template <typename Wanted>
std::optional<Datagram> find_datagram(std::span<std::uint8_t> frame, Wanted&& wanted) {
  FrameReader reader;
  Datagram datagram;
  if (reader.parse(frame) != FrameError::kNone) return std::nullopt;
  while (reader.next(datagram))
    if (wanted(datagram)) return datagram;
  return std::nullopt;
}

// ---- the youBot ----

inline constexpr std::uint16_t kMailboxOut = 0x1000;
inline constexpr std::uint16_t kMailboxIn = 0x1040;
inline constexpr std::uint16_t kMailboxBytes = 32;
inline constexpr std::uint16_t kOutputBytes = 5;
inline constexpr std::uint16_t kInputBytes = 20;

inline SlaveDescription drive(const std::string& name, std::uint32_t product = 0x11) {
  SlaveDescription description;
  description.name = name;
  description.vendor = 0x286;
  description.product = product;
  description.mailbox_out = {.start = kMailboxOut, .length = kMailboxBytes};
  description.mailbox_in = {.start = kMailboxIn, .length = kMailboxBytes};
  description.outputs = {.start = 0x1100, .bytes = kOutputBytes};
  description.inputs = {.start = 0x1180, .bytes = kInputBytes};
  return description;
}

inline SlaveDescription power_board(const std::string& name) {
  SlaveDescription description;
  description.name = name;
  description.vendor = 0x286;
  return description;
}

inline std::vector<SlaveDescription> youbot() {
  std::vector<SlaveDescription> slaves{power_board("KR-845")};
  for (int i = 0; i < 4; ++i) slaves.push_back(drive("TMCM-1632"));
  slaves.push_back(power_board("KR-843"));
  for (int i = 0; i < 5; ++i) slaves.push_back(drive("TMCM-1610", 0x12));
  return slaves;
}

inline std::vector<ExpectedSlave> expected_youbot() {
  std::vector<ExpectedSlave> expected{{"base power board", {"KR-845"}}};
  for (int i = 1; i < 5; ++i) expected.push_back({"wheel " + std::to_string(i), {"TMCM-174", "TMCM-1632"}});
  expected.push_back({"arm power board", {"KR-843"}});
  for (int i = 1; i < 6; ++i)
    expected.push_back({"joint " + std::to_string(i), {"TMCM-KR-841", "TMCM-1610"}});
  return expected;
}

/// A headerless TMCL request or reply as the first 8 bytes of a mailbox.
inline Bytes tmcl(std::uint8_t b0, std::uint8_t b1, std::uint8_t b2, std::uint8_t b3, std::int32_t value) {
  const auto bits = static_cast<std::uint32_t>(value);
  return {b0,
          b1,
          b2,
          b3,
          static_cast<std::uint8_t>(bits >> 24),
          static_cast<std::uint8_t>(bits >> 16),
          static_cast<std::uint8_t>(bits >> 8),
          static_cast<std::uint8_t>(bits)};
}
inline std::int32_t tmcl_value(std::span<const std::uint8_t> mailbox) {
  return static_cast<std::int32_t>(std::uint32_t{mailbox[4]} << 24 | std::uint32_t{mailbox[5]} << 16 |
                                   std::uint32_t{mailbox[6]} << 8 | std::uint32_t{mailbox[7]});
}

/// Counts its calls; the inputs show how often they were refreshed. Never allocates.
class TestBoard final : public sim::bus::Application {
 public:
  explicit TestBoard(EmulatedSlave& slave) : slave_(slave) { slave.attach(*this); }

  void power_changed(bool on) noexcept override {
    if (!on) due_in_ = {}, pending_ = false;
  }
  bool mailbox_received(std::span<const std::uint8_t> message) noexcept override {
    if (busy || pending_) return false;
    ++executed;
    last_type = message[2];
    const std::int32_t answer = value ? *value : 1000 * message[2] + executed;
    for (std::size_t i = 0; i < 4; ++i)
      reply_[4 + i] = static_cast<std::uint8_t>(static_cast<std::uint32_t>(answer) >> (24 - 8 * i));
    reply_[0] = 2;
    reply_[2] = 100;
    reply_[3] = message[1];
    pending_ = true;
    due_in_ = reply_time;
    if (due_in_.count() <= 0) post();
    return true;
  }
  void outputs_changed(std::span<const std::uint8_t> data) noexcept override {
    std::copy_n(data.begin(), std::min(data.size(), outputs.size()), outputs.begin());
    if (std::any_of(data.begin(), data.end(), [](std::uint8_t byte) { return byte != 0; })) ++set_values;
    ++output_writes;
  }
  void inputs(std::span<std::uint8_t> data) noexcept override {
    if (data.size() < 6) return;
    ++refreshes;
    store_le(data.data(), refreshes);
    data[5] = mark;
  }
  void advance(std::chrono::nanoseconds step) noexcept override {
    if (pending_ && (due_in_ -= step).count() <= 0) post();
  }
  void watchdog_expired() noexcept override { ++watchdogs; }
  void fault(BoardFault, bool present) noexcept override { faulty = present; }

  std::array<std::uint8_t, kOutputBytes> outputs{};
  std::uint32_t refreshes = 0;
  std::uint8_t mark = 0;
  int output_writes = 0;
  int set_values = 0;  // number of non-zero outputs
  int watchdogs = 0;
  bool faulty = false;
  bool busy = false;  // leaves requests in the mailbox
  int executed = 0;
  std::uint8_t last_type = 0;
  std::optional<std::int32_t> value;  // answer; default: 1000 times the type plus the number of the request
  std::chrono::nanoseconds reply_time{};

 private:
  void post() noexcept {
    if (slave_.post_mailbox(reply_)) pending_ = false;
  }
  EmulatedSlave& slave_;
  std::array<std::uint8_t, 8> reply_{};
  bool pending_ = false;
  std::chrono::nanoseconds due_in_{};
};

/// Emulated slaves with a board on each, and a wire to them.
class EmulatedRobot {
 public:
  explicit EmulatedRobot(const std::vector<SlaveDescription>& slaves, const SlaveOptions& options = {}) {
    for (const SlaveDescription& slave : slaves)
      boards.push_back(std::make_unique<TestBoard>(bus.add(slave, options)));
  }
  Link& connect(sim::bus::WireOptions options = {}) {
    wire_link.reset();
    wire.emplace(bus, std::move(options));
    return wire_link.emplace(*wire);
  }
  TestBoard& board(std::size_t i) { return *boards[i]; }
  AlState state(std::size_t i) { return bus.slave(i).state(); }

  EmulatedBus bus;
  std::vector<std::unique_ptr<TestBoard>> boards;
  std::optional<EmulatedWire> wire;
  std::optional<sim::bus::BusLink> wire_link;
};

/// Set-up with short time-outs, for tests in which they expire. The time-out of a state change is unchanged
/// unless a test needs a state that a slave never reaches.
inline PreOpBus::Options impatient(std::chrono::nanoseconds state_timeout = 3s) {
  PreOpBus::Options options;
  options.access.frame_timeout = 2ms;
  options.state_timeout = state_timeout;
  options.mailbox_timeout = 20ms;
  return options;
}

}  // namespace drivers::ethercat::test
