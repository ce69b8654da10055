// Data from a Falcon: USB packets with modem status, replies anywhere in them.
#include <algorithm>
#include <string_view>

#include "drivers/haptic/falcon_kinematics.h"
#include "drivers/haptic/falcon_packet.h"
#include "drivers/usb/ftdi_serial.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

using drivers::haptic::falcon::decode_reply;
using drivers::haptic::falcon::kPacketBytes;
using drivers::haptic::falcon::Reply;
using drivers::haptic::falcon::ReplyStream;
using fuzz::Bytes;
using fuzz::require;

constexpr std::string_view kReply =
    "<EGAAMJPPAAAA\x93"
    "A>";
constexpr Reply kMeaning{{100, -100, 0}, 0b0010, 0b101};

void append(Bytes& bytes, std::string_view more) { bytes.insert(bytes.end(), more.begin(), more.end()); }

/// Its first byte says how long the chunks are; see below.
Bytes input(std::uint8_t chunk, int replies) {
  Bytes bytes{chunk};
  for (int i = 0; i < replies; ++i) append(bytes, kReply);
  return bytes;
}

}  // namespace

std::vector<Bytes> fuzz::seeds() {
  Bytes usb{63, 0x01, 0x60};
  append(usb, kReply);
  return {input(15, 1), input(0, 3), input(6, 5), usb};
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  const std::size_t chunk_bytes = 1U + input.byte();
  Bytes rest = input.rest();

  // One packet on its own.
  const auto alone = decode_reply(std::span(rest).first(std::min(kPacketBytes, rest.size())));
  require(!alone || rest.size() >= kPacketBytes);
  if (alone) {
    const auto grip = drivers::haptic::falcon::grip_position(
        drivers::haptic::falcon::angles_rad(alone->counts), drivers::haptic::falcon::kMiddle_m);
    require(!grip.converged || grip.residual_rad <= 1e-9);
    require(alone->buttons <= 0b1111 && alone->homed <= 0b111);
  }

  ReplyStream stream;
  std::size_t bytes_fed = 0;
  std::optional<Reply> chunked;
  for (std::size_t begin = 0; begin < rest.size(); begin += chunk_bytes) {
    const std::size_t count = std::min(chunk_bytes, rest.size() - begin);
    if (const auto reply = stream.feed(std::span(rest).subspan(begin, count))) chunked = reply;
    bytes_fed += count;
  }
  require(stream.discarded_bytes() <= bytes_fed);
  ReplyStream whole;
  require(whole.feed(rest) == chunked);
  require(whole.discarded_bytes() == stream.discarded_bytes());

  // Whatever came before: the next whole reply is found.
  const Bytes good(kReply.begin(), kReply.end());
  require(stream.feed(good) == kMeaning);

  const auto data_bytes = drivers::usb::ftdi::strip_modem_status(rest);
  require(data_bytes.size() <= rest.size());
  require(data_bytes.empty() || data_bytes.data() == rest.data());
  require(rest.size() - data_bytes.size() <= 2 * ((rest.size() + 63) / 64));
  (void)ReplyStream().feed(data_bytes);
  return 0;
}
