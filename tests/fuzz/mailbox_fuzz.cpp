// A slave with arbitrary answers to a mailbox line. First byte: the line's initial state; then, for each
// frame, a byte for its fate and the returned data.
#include <algorithm>

#include "drivers/ethercat/mailbox_line.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

using drivers::ethercat::Datagram;
using drivers::ethercat::FrameReader;
using drivers::ethercat::FrameWriter;
using drivers::ethercat::MailboxLine;
using fuzz::require;
using Status = MailboxLine::Status;

constexpr std::size_t kBytes = 16;
constexpr std::chrono::milliseconds kPatience{50};

}  // namespace

std::vector<fuzz::Bytes> fuzz::seeds() {
  const auto with_mail = [](Bytes start) {
    start.push_back(1);  // the frame that reads the mail
    for (std::uint8_t i = 0; i < kBytes; ++i) start.push_back(i);
    return start;
  };
  // Fates: 0 lost, 1 answered with the following bytes, 2 unanswered. Status 8: full.
  Bytes written{0, 1};
  written.resize(2 + kBytes);
  Bytes replied = written;
  replied.insert(replied.end(), {1, 0, 1, 8});
  Bytes refused{0, 2, 1, 8, 1, 8};
  Bytes lost = replied;
  lost.insert(lost.end(), {0, 1, 0, 0, 0, 1, 0, 1, 2, 1, 8});
  return {with_mail(replied), with_mail({1, 1, 8}), with_mail(refused), with_mail(lost)};
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  drivers::ethercat::Slave slave;
  slave.position = 1;
  slave.station = 0x1001;
  slave.sii.mailbox_out = {0x1000, kBytes};
  slave.sii.mailbox_in = {0x1080, kBytes};
  slave.mailbox_fits = true;
  MailboxLine line(slave);
  std::chrono::milliseconds now{0};
  const auto begin = [&](bool listen) {
    require(listen ? line.listen(kPatience) : line.post(std::vector<std::uint8_t>(8, 6), kPatience));
  };
  begin((input.byte() & 1) != 0);
  while (!input.empty()) {
    FrameWriter writer;
    require(line.add(writer, 1, now += std::chrono::milliseconds(1)) == (line.status() == Status::kBusy));
    if (line.status() != Status::kBusy) {
      require((line.status() == Status::kReplied) == (line.reply().size() == kBytes));
      begin((input.byte() & 1) != 0);
      continue;
    }
    const std::span<const std::uint8_t> sent = writer.bytes();
    fuzz::Bytes frame(sent.begin(), sent.end());
    FrameReader reader;
    Datagram datagram;
    require(reader.parse(frame) == drivers::ethercat::FrameError::kNone && reader.next(datagram));
    const std::uint8_t fate = input.byte();
    if (fate % 3 == 0) {
      line.frame_lost();
      continue;
    }
    const fuzz::Bytes back = input.bytes(fate % 3 == 1 ? datagram.data.size() : 0);
    std::copy(back.begin(), back.end(), datagram.data.begin());
    drivers::ethercat::store_le<std::uint16_t>(datagram.counter, fate % 3 == 1 ? 1 : 0);
    line.answer(datagram);
    if (line.status() == Status::kReplied)
      require(std::ranges::equal(line.reply(), datagram.data) && line.reply().size() == kBytes);
  }
  return 0;
}
