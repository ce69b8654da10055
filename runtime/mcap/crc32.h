/// @file
#pragma once
#include <cstdint>
#include <string_view>

namespace runtime::mcap {

/// CRC-32 of IEEE 802.3 and zlib: polynomial 0x04C11DB7, reflected. Continues from the CRC of earlier bytes.
std::uint32_t crc32(std::string_view bytes, std::uint32_t earlier = 0) noexcept;

}  // namespace runtime::mcap
