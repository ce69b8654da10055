/// @file
/// Constants of MCAP version 1 (https://mcap.dev/spec) and our limits on files of others.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace runtime::mcap {

inline constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};

enum class Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kAttachment = 0x09,
  kAttachmentIndex = 0x0A,
  kStatistics = 0x0B,
  kMetadata = 0x0C,
  kMetadataIndex = 0x0D,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

/// Opcode and length.
inline constexpr std::size_t kRecordHeadBytes = 9;
/// A record that is held in memory, and the contents of a chunk. Others write chunks of 1 to 16 MB.
inline constexpr std::uint64_t kMaxRecordBytes = std::uint64_t{256} << 20;

}  // namespace runtime::mcap
