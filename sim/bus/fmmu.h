/// @file
/// A fieldbus memory management unit: maps bits of the logical image to bits of a slave's memory (ESC data
/// sheet section I, chapter 7; ETG.1000.4 section 6.6).
#pragma once
#include <cstdint>
#include <span>

namespace sim::bus {

/// Part of a datagram that an FMMU maps.
struct MappedBits {
  std::uint32_t first = 0;           ///< bit within the datagram's data
  std::uint32_t count = 0;           ///< 0: nothing mapped
  std::uint32_t physical_first = 0;  ///< bit address in the slave

  bool whole_bytes() const noexcept { return first % 8 == 0 && count % 8 == 0 && physical_first % 8 == 0; }
  /// First byte of the slave that holds these bits.
  std::uint32_t physical_byte() const noexcept { return physical_first / 8; }
  std::uint32_t physical_bytes() const noexcept {
    return (physical_first + count - 1) / 8 - physical_first / 8 + 1;
  }
};

class Fmmu {
 public:
  /// From its sixteen registers; inactive ones map nothing.
  void configure(std::span<const std::uint8_t> registers) noexcept;

  bool reads() const noexcept { return reads_; }    ///< inputs: slave to master
  bool writes() const noexcept { return writes_; }  ///< outputs
  std::uint32_t physical_first() const noexcept { return physical_first_; }
  std::uint64_t bits() const noexcept { return end_ - begin_; }

  /// Overlap with a datagram of `bytes` bytes at `logical_address`.
  MappedBits match(std::uint32_t logical_address, std::size_t bytes) const noexcept;

 private:
  std::uint64_t begin_ = 0;  // logical bits
  std::uint64_t end_ = 0;
  std::uint32_t physical_first_ = 0;
  bool reads_ = false;
  bool writes_ = false;
};

/// Copies between the data of a datagram and `physical`, the bytes from MappedBits::physical_byte() on. Bits
/// outside the mapping keep their value in the datagram.
void copy_bits_to_datagram(const MappedBits& bits, std::span<const std::uint8_t> physical,
                           std::span<std::uint8_t> datagram) noexcept;
/// Bits outside the mapping are written as 0: the data sheet calls them undefined (chapter 7,
/// "Restrictions on FMMU settings").
void copy_bits_from_datagram(const MappedBits& bits, std::span<const std::uint8_t> datagram,
                             std::span<std::uint8_t> physical) noexcept;

}  // namespace sim::bus
