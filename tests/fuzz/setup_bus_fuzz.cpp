// A bus of slaves with wrong answers (lies) while the master scans and starts them. Input: a sequence of lies
// of six bytes each: the number of frames before it, its kind, slave, address, value. A persistent lie ends
// with its kLieFrames-th frame, which is longer than any wait of the master below.
#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "drivers/ethercat/bus_error.h"
#include "drivers/ethercat/pre_op_bus.h"
#include "drivers/ethercat/registers.h"
#include "sim/bus/bus_link.h"
#include "sim/bus/emulated_bus.h"
#include "sim/bus/emulated_wire.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

using namespace std::chrono_literals;
using drivers::ethercat::AlState;
using drivers::ethercat::BusError;
using drivers::ethercat::Command;
using drivers::ethercat::Datagram;
using drivers::ethercat::FrameError;
using drivers::ethercat::FrameReader;
using drivers::ethercat::Link;
using drivers::ethercat::PreOpBus;
using fuzz::require;
namespace reg = drivers::ethercat::reg;

constexpr std::size_t kSlaves = 3;
constexpr std::size_t kMaxLies = 8;
constexpr int kLieFrames = 3000;
/// Every lie may hold the master up for as long as it lasts; the rest is the set-up with three tries for each
/// frame.
constexpr int kMaxFrames = 3 * 2000 + static_cast<int>(kMaxLies) * kLieFrames;

enum class Lie : std::uint8_t { kRegister, kByte, kCounter, kCounters, kLoss, kState, kPower, kEeprom };

struct TimedLie {
  int frame = 0;
  Lie kind = Lie::kRegister;
  std::size_t slave = 0;
  std::uint16_t where = 0;
  std::uint8_t what = 0;
};

/// Replies in the mailbox, and demands that nothing is ever commanded.
class Board final : public sim::bus::Application {
 public:
  explicit Board(sim::bus::EmulatedSlave& slave) : slave_(slave) { slave.attach(*this); }
  bool mailbox_received(std::span<const std::uint8_t>) noexcept override {
    (void)slave_.post_mailbox(std::array<std::uint8_t, 8>{2, 1, 100});
    return true;
  }
  void outputs_changed(std::span<const std::uint8_t> outputs) noexcept override {
    require(std::ranges::all_of(outputs, [](std::uint8_t byte) { return byte == 0; }));
  }

 private:
  sim::bus::EmulatedSlave& slave_;
};

class LyingLink final : public Link {
 public:
  LyingLink(sim::bus::EmulatedBus& bus, Link& link, std::vector<TimedLie> lies)
      : bus_(bus), link_(link), lies_(std::move(lies)) {}

  bool send(std::span<const std::uint8_t> frame) noexcept override {
    require(++frames_ <= kMaxFrames);
    for (const TimedLie& lie : lies_)
      if (lie.frame == frames_) act(lie);
    return link_.send(frame);
  }
  std::size_t receive(std::span<std::uint8_t> buffer, std::chrono::nanoseconds timeout) noexcept override {
    const std::size_t size = link_.receive(buffer, timeout);
    FrameReader reader;
    if (size == 0 || reader.parse(buffer.first(size)) != FrameError::kNone) return size;
    Datagram datagram;
    while (reader.next(datagram))
      for (const TimedLie& lie : lies_)
        if (lie.frame <= frames_ && frames_ < lie.frame + kLieFrames) spoil(lie, datagram);
    return lost_until_ >= frames_ ? 0 : size;
  }
  std::chrono::nanoseconds now() const noexcept override { return link_.now(); }
  void wait(std::chrono::nanoseconds duration) override { link_.wait(duration); }
  int last_error() const noexcept override { return 0; }
  const std::string& name() const noexcept override { return link_.name(); }

 private:
  /// Lies in the behaviour of the slave.
  void act(const TimedLie& lie) noexcept {
    sim::bus::EmulatedSlave& slave = bus_.slave(lie.slave);
    if (lie.kind == Lie::kLoss) lost_until_ = frames_ + lie.what;
    if (lie.kind == Lie::kState) slave.report_error(static_cast<AlState>(lie.what & 0x0F), lie.where);
    if (lie.kind == Lie::kPower) bus_.set_power(lie.slave, (lie.what & 1) != 0);
  }
  /// Lies in its answers: a register and the counters while the lie lasts, a byte and a counter once.
  void spoil(const TimedLie& lie, Datagram& datagram) const noexcept {
    const bool now = lie.frame == frames_;
    const auto station = static_cast<std::uint16_t>(datagram.address);
    const auto offset = static_cast<std::uint16_t>(datagram.address >> 16);
    const bool reads = datagram.command == Command::kFprd && station == 0x1001 + lie.slave;
    if (lie.kind == Lie::kRegister && (reads || datagram.command == Command::kBrd) && lie.where >= offset &&
        lie.where < offset + datagram.data.size())
      datagram.data[lie.where - offset] = lie.what;
    if (lie.kind == Lie::kByte && now && lie.where < datagram.data.size())
      datagram.data[lie.where] = lie.what;
    if (lie.kind == Lie::kCounters || (lie.kind == Lie::kCounter && now))
      drivers::ethercat::store_le<std::uint16_t>(
          datagram.counter, static_cast<std::uint16_t>((lie.where & 0xFF00U) | lie.what));
  }

  sim::bus::EmulatedBus& bus_;
  Link& link_;
  std::vector<TimedLie> lies_;
  int frames_ = 0;
  int lost_until_ = -1;
};

sim::bus::SlaveDescription described(std::size_t position) {
  sim::bus::SlaveDescription slave{.name = position == 0 ? "KR-845" : "TMCM-1632", .vendor = 0x286};
  if (position == 0) return slave;
  slave.mailbox_out = {.start = 0x1000, .length = 32};
  slave.mailbox_in = {.start = 0x1040, .length = 32};
  slave.outputs = {.start = 0x1100, .bytes = 5};
  slave.inputs = {.start = 0x1180, .bytes = 20};
  return slave;
}

std::vector<TimedLie> lies_in(fuzz::Input input) {
  std::vector<TimedLie> lies;
  int frame = 0;
  while (!input.empty() && lies.size() < kMaxLies) {
    TimedLie lie;
    lie.frame = frame += input.byte();
    lie.kind = static_cast<Lie>(input.byte() % 8);
    lie.slave = input.byte() % kSlaves;
    lie.where = input.byte();
    lie.where = static_cast<std::uint16_t>(lie.where | input.byte() << 8);
    lie.what = input.byte();
    lies.push_back(lie);
  }
  return lies;
}

/// Whose it is, and nothing that a terminal would obey.
void check(const BusError& error, const Link& link) {
  const std::string& device = error.device();
  require(device.starts_with("slave ") || device == link.name() || device == "the bus");
  require(!error.step().empty());
  require(std::ranges::none_of(std::string_view(error.what()), [](char letter) {
    return static_cast<unsigned char>(letter) < 0x20 || letter == 0x7F;
  }));
}

}  // namespace

/// The truth is the empty prefix of each.
std::vector<fuzz::Bytes> fuzz::seeds() {
  const auto kind = [](Lie lie) { return static_cast<std::uint8_t>(lie); };
  return {
      {1, kind(Lie::kCounter), 0, 0, 0xFF, 0xFF},
      {1, kind(Lie::kCounters), 0, 0, 0, 9},
      {1, kind(Lie::kCounters), 0, 0, 0xFF, 0xFF},
      {9, kind(Lie::kRegister), 1, 0x30, 0x01, 0x04},    // AL status: SAFE-OP
      {200, kind(Lie::kRegister), 1, 0x30, 0x01, 0x12},  // PRE-OP with an error
      {5, kind(Lie::kRegister), 2, 0x03, 0x05, 0x80},    // SII busy
      {5, kind(Lie::kRegister), 2, 0x03, 0x05, 0x40},    // SII with errors
      {0, kind(Lie::kEeprom), 1, 0x84, 0, 0xFF},         // the length of a category
      {60, kind(Lie::kLoss), 0, 0, 0, 2, 90, kind(Lie::kPower), 1, 0, 0, 0},
      {150, kind(Lie::kState), 2, 0x1B, 0, 4, 20, kind(Lie::kByte), 0, 3, 0, 0xFF},
      {0, kind(Lie::kEeprom), 2, 0x80, 0, 1, 0, kind(Lie::kEeprom), 2, 0x90, 0, 0x1B},
  };
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::vector<TimedLie> lies = lies_in({data, size});
  sim::bus::EmulatedBus bus;
  std::vector<std::unique_ptr<Board>> boards;
  for (std::size_t i = 0; i < kSlaves; ++i) boards.push_back(std::make_unique<Board>(bus.add(described(i))));
  for (const TimedLie& lie : lies) {
    const auto image = bus.slave(lie.slave).controller().sii().image();
    if (lie.kind == Lie::kEeprom && lie.where < image.size()) image[lie.where] = lie.what;
  }
  sim::bus::EmulatedWire wire(bus, {.timed = true});
  sim::bus::BusLink honest(wire);
  LyingLink link(bus, honest, lies);
  PreOpBus::Options options;
  options.access = {.frame_timeout = 1ms, .tries = 3};
  options.state_timeout = 20ms;
  options.mailbox_timeout = 10ms;
  try {
    PreOpBus setup(link, nullptr, options);
    require(!setup.slaves().empty());
    setup.enter_pre_op();
    const bool honest_slaves = lies.empty();
    for (std::size_t i = 0; honest_slaves && i < kSlaves; ++i)
      require(bus.slave(i).state() == AlState::kPreOp);
    for (std::size_t i = 0; i < setup.slaves().size() && i < kSlaves; ++i) {
      const drivers::ethercat::Slave& slave = setup.slaves()[i];
      if (!slave.mailbox_fits || slave.sii.mailbox_out.length < 8) continue;
      const std::array<std::uint8_t, 8> request{1, 6, 1};
      require(setup.mailbox_exchange(i, request).size() == slave.sii.mailbox_in.length);
    }
    const drivers::ethercat::OpBus running = std::move(setup).start();
    for (std::size_t i = 0; i < running.size(); ++i)
      require(running.health(i).condition == drivers::ethercat::SlaveCondition::kOperational);
    for (std::size_t i = 0; honest_slaves && i < kSlaves; ++i) require(bus.slave(i).state() == AlState::kOp);
  } catch (const BusError& error) {
    require(!lies.empty());
    check(error, link);
  }
  return 0;
}
