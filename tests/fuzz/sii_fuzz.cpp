// EEPROMs: the input is the image after a byte that selects the slave's read width and whether it is
// repeated.
#include "drivers/ethercat/sii.h"
#include "sim/bus/sii_image.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

using drivers::ethercat::SiiInfo;
using drivers::ethercat::SiiReader;
using fuzz::require;

/// The address space, and a last category of 0x1000 words that begins at its end.
constexpr std::size_t kMaxWords = 0x10000 + 8;

}  // namespace

std::vector<fuzz::Bytes> fuzz::seeds() {
  sim::bus::SlaveDescription drive;
  drive.name = "TMCM-1610";
  drive.vendor = 0x286;
  drive.mailbox_out = {.start = 0x1000, .length = 32};
  drive.mailbox_in = {.start = 0x1040, .length = 32};
  drive.outputs = {.start = 0x1100, .bytes = 5};
  drive.inputs = {.start = 0x1180, .bytes = 20, .entries = {{.index = 0x6000, .subindex = 1, .bits = 16}}};
  std::vector<Bytes> result;
  for (const bool has_clock : {false, true}) {
    drive.has_distributed_clock = has_clock;
    Bytes image = sim::bus::build_sii_image(drive);
    image.insert(image.begin(), has_clock ? 1 : 0);
    image.resize(400);  // past the last category; shorter inputs are mutated where it matters
    result.push_back(image);
  }
  return result;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  const std::uint8_t options = input.byte();
  const std::size_t width = (options & 1) != 0 ? 8 : 4;
  const bool repeated = (options & 2) != 0;  // a memory that answers to every address: chains without end
  const fuzz::Bytes image = input.rest();
  SiiReader reader;
  std::size_t words = 0;
  while (const auto word = reader.next_word()) {
    std::array<std::uint8_t, 8> bytes{};
    for (std::size_t i = 0; i < width; ++i) {
      const std::size_t at = 2 * std::size_t{*word} + i;
      if (image.empty() || (!repeated && at >= image.size()))
        bytes[i] = 0xFF;
      else
        bytes[i] = image[at % image.size()];
    }
    reader.store(std::span(bytes).first(width));
    words += width / 2;
    require(words <= kMaxWords);
  }
  const SiiInfo info = reader.info();
  require(info.name.size() <= 255);
  require(info.sync_managers.size() <= 0x1000 * 2 / 8);
  if (info.has_mailbox()) require(info.mailbox_out.length > 0 && info.mailbox_in.length > 0);
  return 0;
}
