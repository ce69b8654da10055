#include "sim/bus/emulated_bus.h"

#include <algorithm>
#include <array>
#include <utility>

#include "drivers/ethercat/frame.h"

namespace sim::bus {
namespace {

using drivers::ethercat::Datagram;
using drivers::ethercat::kReturnedBit;
using std::chrono::nanoseconds;

constexpr std::size_t kSourceMac = 6;

}  // namespace

EmulatedSlave& EmulatedBus::add(SlaveDescription description, SlaveOptions options) {
  nodes_.push_back({.slave = std::make_unique<EmulatedSlave>(std::move(description), options)});
  nodes_.back().slave->advance(now_);  // to the time of all others
  update_links();
  return *nodes_.back().slave;
}

bool EmulatedBus::process(std::span<std::uint8_t> frame) noexcept {
  const std::size_t slaves = reached();
  if (slaves == 0) return false;
  // Forced open without a link. Uses the present value: this frame's own writes take effect behind it.
  const bool falls_out = nodes_[slaves - 1].slave->controller().port_open(1);

  passing_.look_at(frame);
  bool good = passing_.valid();
  for (std::size_t i = 0; i < slaves; ++i) {
    EmulatedSlave& slave = *nodes_[i].slave;
    if (nodes_[i].damaged_frames > 0) {
      --nodes_[i].damaged_frames;
      slave.controller().count_invalid_frame(0, !good);
      good = false;
    } else if (!good && i == 0) {
      slave.controller().count_processing_error();
    } else if (!good) {
      slave.controller().count_invalid_frame(0, true);
    }
    slave.controller().begin_frame(times_at(i, slaves));
    for (Datagram& datagram : passing_.datagrams()) slave.controller().process(datagram);
    slave.end_frame(good);
  }
  for (std::size_t i = 0; !good && i + 1 < slaves; ++i) {  // already marked, it comes back through all of
                                                           // them
    nodes_[i].slave->controller().count_invalid_frame(1, true);
  }
  if (!good || falls_out) return false;
  frame[kSourceMac] |= kReturnedBit;
  return true;
}

void EmulatedBus::write_as_another_master(std::size_t position, std::uint16_t first_register,
                                          std::uint16_t value, std::size_t count) noexcept {
  namespace ethercat = drivers::ethercat;
  ethercat::FrameWriter writer;
  const std::uint16_t place = ethercat::position_address(static_cast<std::uint16_t>(position));
  const Datagram datagram =
      writer.add(ethercat::Command::kApwr, 0, ethercat::address_of(place, first_register), 2 * count);
  if (datagram.counter == nullptr) return;
  for (std::size_t i = 0; i < count; ++i) ethercat::store_le(&datagram.data[2 * i], value);
  std::array<std::uint8_t, ethercat::kMaxFrameBytes> frame{};
  const std::span<const std::uint8_t> bytes = writer.bytes();
  std::ranges::copy(bytes, frame.begin());
  (void)process(std::span(frame).first(bytes.size()));
}

void EmulatedBus::advance(nanoseconds step) noexcept {
  now_ += step;
  for (Node& node : nodes_) node.slave->advance(step);
}

nanoseconds EmulatedBus::round_trip(std::size_t frame_bytes) const noexcept {
  constexpr std::size_t kPreambleCheckAndGap = 8 + 4 + 12;
  constexpr nanoseconds kByte{80};
  const auto hops = static_cast<nanoseconds::rep>(reached());
  return kByte * static_cast<nanoseconds::rep>(frame_bytes + kPreambleCheckAndGap) +
         2 * hops * (kCableDelay + kPassDelay);
}

// There and back: one forward pass for each slave, one backward pass for each except the last, where it
// returns.
FrameTimes EmulatedBus::times_at(std::size_t position, std::size_t slaves) const noexcept {
  const auto before = static_cast<nanoseconds::rep>(position);
  const auto behind = static_cast<nanoseconds::rep>(slaves - 1 - position);
  FrameTimes times;
  times.port0 = now_ + kCableDelay + before * (kPassDelay + kCableDelay);
  times.through_port1 = behind > 0;
  times.port1 = times.port0 + 2 * behind * (kPassDelay + kCableDelay);
  return times;
}

std::size_t EmulatedBus::reached() const noexcept {
  std::size_t slaves = 0;
  while (slaves < nodes_.size() && nodes_[slaves].plugged && nodes_[slaves].slave->powered() &&
         (slaves == 0 || nodes_[slaves - 1].slave->controller().port_open(1))) {
    ++slaves;
  }
  return slaves;
}

void EmulatedBus::update_links() noexcept {
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    EmulatedSlave& slave = *nodes_[i].slave;
    const bool upstream = nodes_[i].plugged && (i == 0 || nodes_[i - 1].slave->powered());
    const bool downstream = i + 1 < nodes_.size() && nodes_[i + 1].plugged && nodes_[i + 1].slave->powered();
    slave.controller().set_link(0, upstream);
    slave.controller().set_link(1, downstream);
  }
}

void EmulatedBus::set_cable(std::size_t position, bool plugged) noexcept {
  nodes_[position].plugged = plugged;
  update_links();
}

void EmulatedBus::set_power(std::size_t position, bool on) noexcept {
  nodes_[position].slave->set_power(on);
  update_links();
}

}  // namespace sim::bus
