#include "tests/support/capture_file.h"

#include <cstddef>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "drivers/ethercat/frame.h"

namespace support {
namespace {

using drivers::ethercat::Direction;
using drivers::ethercat::load_le;

// pcapng, draft-ietf-opsawg-pcapng: what PcapRing uses of it.
constexpr std::uint32_t kSectionHeader = 0x0A0D0D0A;
constexpr std::uint32_t kEnhancedPacket = 6;
constexpr std::uint32_t kInbound = 1;
constexpr std::size_t kShortestBlock_bytes = 12;  // type, length, length again
constexpr std::size_t kPacketAt = 28;   // in an enhanced packet: behind interface, stamp and lengths
constexpr std::size_t kFlagsBytes = 8;  // option 2: code, length, value

std::size_t padded(std::size_t bytes) { return (bytes + 3) / 4 * 4; }

}  // namespace

std::vector<CapturedFrame> read_capture(const std::filesystem::path& path) {
  const auto require = [&path](bool condition, const char* problem) {
    if (!condition) throw std::runtime_error(path.string() + ": " + problem);
  };
  std::ifstream file(path, std::ios::binary);
  const std::vector<char> text{std::istreambuf_iterator<char>(file), {}};
  const std::vector<std::uint8_t> bytes(text.begin(), text.end());
  const auto word = [&](std::size_t at) {
    require(at + 4 <= bytes.size(), "is cut off");
    return load_le<std::uint32_t>(&bytes[at]);
  };
  require(!bytes.empty() && word(0) == kSectionHeader, "is no capture in pcapng");
  std::vector<CapturedFrame> frames;
  for (std::size_t at = 0; at < bytes.size(); at += word(at + 4)) {
    require(word(at + 4) >= kShortestBlock_bytes && at + word(at + 4) <= bytes.size(), "is cut off");
    if (word(at) != kEnhancedPacket) continue;
    const std::size_t size = word(at + 20);
    const std::size_t flags = at + kPacketAt + padded(size);
    require(flags + kFlagsBytes <= at + word(at + 4), "has a frame without its direction");
    frames.push_back(
        {.stamp = std::chrono::nanoseconds(std::int64_t{word(at + 12)} << 32 | std::int64_t{word(at + 16)}),
         .direction = word(flags + 4) == kInbound ? Direction::kReceived : Direction::kSent,
         .bytes = {bytes.begin() + static_cast<std::ptrdiff_t>(at + kPacketAt),
                   bytes.begin() + static_cast<std::ptrdiff_t>(at + kPacketAt + size)}});
  }
  return frames;
}

}  // namespace support
