/// @file
/// Compression of chunks, by the names that MCAP gives them.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>

namespace runtime::mcap {

enum class Compression : std::uint8_t { kNone, kLz4, kZstd };

/// "", "lz4" or "zstd".
std::string_view name(Compression compression) noexcept;

/// @throws std::runtime_error if the library fails.
std::string compress(Compression compression, std::string_view bytes);

/// What `bytes` contain, at most `limit`. Of a torn chunk the result is a prefix.
/// @throws std::runtime_error if the name is unknown, the data are damaged or the result exceeds `limit`.
std::string decompress(std::string_view compression_name, std::string_view bytes, std::uint64_t limit);

}  // namespace runtime::mcap
