#include "drivers/ethercat/register_access.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

#include "drivers/ethercat/bus_error.h"

namespace drivers::ethercat {

void RegisterAccess::exchange_or_throw(const std::function<void(FrameWriter&, std::uint8_t)>& fill) {
  for (int left = options_.tries; left > 0; --left) {
    FrameWriter& writer = transceiver_.begin();
    fill(writer, transceiver_.index());
    const bool answered = transceiver_.exchange(options_.frame_timeout);
    require_no_other_master();
    if (answered) return;
  }
  const int error = transceiver_.link().last_error();
  throw BusError(transceiver_.link().name(), "exchange frames",
                 "no frame comes back (" + std::to_string(options_.tries) + " tries" +
                     (error != 0 ? std::string(", ") + std::strerror(error) : std::string()) +
                     "); is the cable in, and the first device powered?");
}

void RegisterAccess::require_no_other_master() const {
  Link& link = transceiver_.link();
  if (transceiver_.other_master().present(link.now()))
    throw AnotherMaster(link.name(), "exchange frames", transceiver_.other_master().describe());
}

std::uint16_t RegisterAccess::broadcast_read(std::uint16_t address, std::span<std::uint8_t> data) {
  exchange_or_throw([&](FrameWriter& writer, std::uint8_t index) {
    writer.add(Command::kBrd, index, address_of(0, address), data.size());
  });
  Datagram datagram;
  FrameReader answer = transceiver_.answer();
  (void)answer.next(datagram);
  std::copy(datagram.data.begin(), datagram.data.end(), data.begin());
  return datagram.working_counter();
}

std::uint16_t RegisterAccess::broadcast_write(std::uint16_t address, std::span<const std::uint8_t> data) {
  exchange_or_throw([&](FrameWriter& writer, std::uint8_t index) {
    const Datagram datagram = writer.add(Command::kBwr, index, address_of(0, address), data.size());
    std::copy(data.begin(), data.end(), datagram.data.begin());
  });
  Datagram datagram;
  FrameReader answer = transceiver_.answer();
  (void)answer.next(datagram);
  return datagram.working_counter();
}

void RegisterAccess::each(std::size_t count, const std::function<bool(std::size_t)>& skip,
                          const std::function<bool(FrameWriter&, std::uint8_t, std::size_t)>& add,
                          const std::function<void(const Datagram&, std::size_t)>& take) {
  std::vector<std::size_t> in_frame;
  for (std::size_t begin = 0; begin < count;) {
    std::size_t end = begin;
    exchange_or_throw([&](FrameWriter& writer, std::uint8_t index) {
      in_frame.clear();
      for (end = begin; end < count; ++end) {
        if (skip(end)) continue;
        if (!add(writer, index, end)) break;
        in_frame.push_back(end);
      }
      if (in_frame.empty()) writer.add(Command::kNop, index, 0, 0);  // nothing to ask for
    });
    FrameReader answer = transceiver_.answer();
    Datagram datagram;
    for (const std::size_t i : in_frame)
      if (answer.next(datagram)) take(datagram, i);
    if (end == begin)
      throw BusError(transceiver_.link().name(), "build a frame", "one datagram does not fit");
    begin = end;
  }
}

}  // namespace drivers::ethercat
