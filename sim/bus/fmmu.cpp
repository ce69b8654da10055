#include "sim/bus/fmmu.h"

#include <algorithm>

#include "drivers/ethercat/frame.h"

namespace sim::bus {
namespace {

bool bit(std::span<const std::uint8_t> bytes, std::uint32_t index) noexcept {
  return (bytes[index / 8] >> (index % 8) & 1) != 0;
}

void set_bit(std::span<std::uint8_t> bytes, std::uint32_t index, bool value) noexcept {
  const auto mask = static_cast<std::uint8_t>(1U << (index % 8));
  std::uint8_t& byte = bytes[index / 8];
  byte = static_cast<std::uint8_t>(value ? byte | mask : byte & ~mask);
}

}  // namespace

void Fmmu::configure(std::span<const std::uint8_t> registers) noexcept {
  using drivers::ethercat::load_le;
  *this = Fmmu{};
  const std::uint64_t start = load_le<std::uint32_t>(registers.data());
  const std::uint64_t length = load_le<std::uint16_t>(registers.data() + 4);
  const bool active = (registers[12] & 0x01) != 0;
  if (!active || length == 0) return;
  const std::uint64_t begin = 8 * start + (registers[6] & 7U);
  const std::uint64_t end = 8 * (start + length - 1) + (registers[7] & 7U) + 1;
  if (end <= begin) return;
  begin_ = begin;
  end_ = end;
  physical_first_ = 8U * load_le<std::uint16_t>(registers.data() + 8) + (registers[10] & 7U);
  reads_ = (registers[11] & 0x01) != 0;
  writes_ = (registers[11] & 0x02) != 0;
}

MappedBits Fmmu::match(std::uint32_t logical_address, std::size_t bytes) const noexcept {
  const std::uint64_t datagram = 8ULL * logical_address;
  const std::uint64_t first = std::max(begin_, datagram);
  const std::uint64_t last = std::min(end_, datagram + 8 * bytes);
  if (first >= last) return {};
  return {.first = static_cast<std::uint32_t>(first - datagram),
          .count = static_cast<std::uint32_t>(last - first),
          .physical_first = physical_first_ + static_cast<std::uint32_t>(first - begin_)};
}

void copy_bits_to_datagram(const MappedBits& bits, std::span<const std::uint8_t> physical,
                           std::span<std::uint8_t> datagram) noexcept {
  for (std::uint32_t i = 0; i < bits.count; ++i) {
    set_bit(datagram, bits.first + i, bit(physical, bits.physical_first % 8 + i));
  }
}

void copy_bits_from_datagram(const MappedBits& bits, std::span<const std::uint8_t> datagram,
                             std::span<std::uint8_t> physical) noexcept {
  std::ranges::fill(physical, std::uint8_t{0});
  for (std::uint32_t i = 0; i < bits.count; ++i) {
    set_bit(physical, bits.physical_first % 8 + i, bit(datagram, bits.first + i));
  }
}

}  // namespace sim::bus
