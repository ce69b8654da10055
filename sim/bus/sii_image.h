/// @file
/// The SII EEPROM image of a slave: 16-bit words, little-endian (ETG.1000.6 section 5.4, ETG.2010).
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/bus/slave_description.h"

namespace sim::bus {

/// Bytes of the configuration area covered by its checksum, which is in the next word.
inline constexpr std::size_t kSiiChecksummedBytes = 14;

/// A complete EEPROM (2 KiB, or the next power of two that holds the categories), unused words 0xFFFF.
/// Categories: STRINGS, GENERAL, FMMU, SYNCM, TXPDO, RXPDO and, with a distributed clock, DC.
/// @throws std::invalid_argument see validate()
std::vector<std::uint8_t> build_sii_image(const SlaveDescription& description);

/// Remainder by x^8 + x^2 + x + 1, start value 0xFF (ESC data sheet section I, table 37).
std::uint8_t sii_checksum(std::span<const std::uint8_t, kSiiChecksummedBytes> configuration) noexcept;

}  // namespace sim::bus
