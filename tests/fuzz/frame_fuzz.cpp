// Frames from the wire: the master's reader, the transceiver that searches for its answer, and emulated
// slaves.
#include <algorithm>
#include <string>

#include "drivers/ethercat/frame.h"
#include "drivers/ethercat/transceiver.h"
#include "sim/bus/passing_frame.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

using drivers::ethercat::address_of;
using drivers::ethercat::Command;
using drivers::ethercat::Datagram;
using drivers::ethercat::FrameError;
using drivers::ethercat::FrameReader;
using drivers::ethercat::FrameWriter;
using drivers::ethercat::kDatagramOverheadBytes;
using drivers::ethercat::kFrameHeaderBytes;
using drivers::ethercat::kMaxDatagramBytes;
using drivers::ethercat::Link;
using drivers::ethercat::Transceiver;
using fuzz::require;

/// Hands out one frame.
class OneFrame final : public Link {
 public:
  explicit OneFrame(const fuzz::Bytes& frame) : frame_(frame) {}
  bool send(std::span<const std::uint8_t>) noexcept override { return true; }
  std::size_t receive(std::span<std::uint8_t> buffer, std::chrono::nanoseconds) noexcept override {
    const std::size_t size = std::min(left_ ? frame_.size() : 0, buffer.size());
    std::copy_n(frame_.begin(), size, buffer.begin());
    left_ = false;
    return size;
  }
  int last_error() const noexcept override { return 0; }
  const std::string& name() const noexcept override { return name_; }

 private:
  const fuzz::Bytes& frame_;
  bool left_ = true;
  std::string name_ = "fuzz";
};

void read(fuzz::Bytes frame) {
  FrameReader reader;
  const FrameError error = reader.parse(frame);
  require(describe(error) != nullptr);
  FrameWriter writer;
  bool fits = true;
  std::size_t count = 0;
  std::size_t bytes = kFrameHeaderBytes;
  Datagram datagram;
  while (reader.next(datagram)) {
    require(error == FrameError::kNone);
    ++count;
    bytes += kDatagramOverheadBytes + datagram.data.size();
    require(bytes <= frame.size());
    require(datagram.header >= frame.data() && datagram.counter + 2 <= frame.data() + frame.size());
    std::ranges::fill(datagram.data, std::uint8_t{0xA5});  // all of it is ours to change
    const Datagram copy =
        writer.add(datagram.command, datagram.index, datagram.address, datagram.data.size());
    fits = fits && copy.counter != nullptr;
    if (copy.counter != nullptr) std::ranges::copy(datagram.data, copy.data.begin());
  }
  require(error != FrameError::kNone || count > 0);
  if (!fits || count == 0) return;

  // Data that was read can be written, and reads back equal.
  const std::span<const std::uint8_t> again = writer.bytes();
  fuzz::Bytes written(again.begin(), again.end());
  FrameReader first;
  FrameReader second;
  Datagram a;
  Datagram b;
  require(first.parse(frame) == FrameError::kNone);
  require(second.parse(written) == FrameError::kNone);
  while (first.next(a)) {
    require(second.next(b));
    require(a.command == b.command && a.index == b.index && a.address == b.address);
    require(std::ranges::equal(a.data, b.data));
  }
  require(!second.next(b));
}

/// Slaves have their own rules, but a frame that the master accepts is valid for them, with equal content.
void pass(fuzz::Bytes frame) {
  sim::bus::PassingFrame passing(frame);
  const std::span<Datagram> datagrams = passing.datagrams();
  require(!passing.valid() || !datagrams.empty());
  const std::uint8_t* end = frame.data();
  for (const Datagram& datagram : datagrams) {
    require(datagram.header >= end && datagram.counter >= datagram.header);
    end = datagram.counter + 2;
    require(end <= frame.data() + frame.size());
    require(datagram.data.data() + datagram.data.size() == datagram.counter);
  }
  FrameReader reader;
  if (frame.size() > drivers::ethercat::kMaxFrameBytes || reader.parse(frame) != FrameError::kNone) return;
  require(passing.valid());
  Datagram datagram;
  for (const Datagram& passed : datagrams) {
    require(reader.next(datagram));
    require(passed.header == datagram.header && passed.counter == datagram.counter);
  }
  require(!reader.next(datagram));
}

void answer(const fuzz::Bytes& frame) {
  OneFrame link(frame);
  Transceiver transceiver(link);
  FrameWriter& writer = transceiver.begin();
  (void)writer.add(Command::kLrw, transceiver.index(), 0, 16);
  (void)writer.add(Command::kBrd, transceiver.index(), 0x01300000, 2);
  if (!transceiver.exchange({})) return;
  FrameReader reader = transceiver.answer();
  Datagram datagram;
  require(reader.next(datagram) && datagram.command == Command::kLrw && datagram.data.size() == 16);
  require(reader.next(datagram) && datagram.command == Command::kBrd && datagram.data.size() == 2);
  require(!reader.next(datagram));
}

}  // namespace

std::vector<fuzz::Bytes> fuzz::seeds() {
  FrameWriter writer;
  const auto bytes = [&] {
    const auto frame = writer.bytes();
    return Bytes(frame.begin(), frame.end());
  };
  std::vector<Bytes> result;
  (void)writer.add(Command::kLrw, 1, 0, 16);  // the answer Transceiver waits for above
  (void)writer.add(Command::kBrd, 1, 0x01300000, 2);
  result.push_back(bytes());
  (void)writer.add(Command::kFprd, 1, address_of(0x1001, 0x0300), 20);
  (void)writer.add(Command::kFrmw, 1, address_of(0x1001, 0x0910), 8);
  (void)writer.add(Command::kNop, 1, 0, 0);
  result.push_back(bytes());
  Bytes other = result.back();  // of a master that leaves the header's length empty and tags its frames
  other[14] = 0;
  other.insert(other.begin() + 12, {0x81, 0x00, 0x00, 0x00});
  result.push_back(other);
  writer.clear();
  (void)writer.add(Command::kLrd, 0, 0x10000, kMaxDatagramBytes);
  result.push_back(bytes());
  return result;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const fuzz::Bytes frame(data, data + size);
  read(frame);
  pass(frame);
  answer(frame);
  return 0;
}
