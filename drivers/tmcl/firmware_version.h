/// @file
/// Identity of a controller: the text answer to TMCL command 136.
#pragma once
#include <cstdint>
#include <optional>
#include <span>

namespace drivers::tmcl {

struct FirmwareVersion {
  int controller = 0;  ///< 174 or 1632: wheel; 841 or 1610: arm joint; 842: gripper
  int version = 0;     ///< hundredths: 148 is 1.48, 200 is 2.0
  friend bool operator==(const FirmwareVersion&, const FirmwareVersion&) = default;
};

/// The two generations the official driver supports. They differ in process data and commutation start-up.
enum class Firmware : std::uint8_t { k148, k200 };
constexpr std::optional<Firmware> supported_firmware(const FirmwareVersion& version) noexcept {
  if (version.version == 148) return Firmware::k148;
  if (version.version == 200) return Firmware::k200;
  return std::nullopt;
}

enum class VersionText : std::uint8_t {
  kValid,
  kNoAnswerYet,  ///< all zero: real boards send such replies before the text; ask again
  kMalformed,
};

/// Reads "1610V148", "174V1.48", "841V1.48", "1610V200": number, 'V', three digits with or without a dot. The
/// gripper's format is unconfirmed ("KR842V20", the first byte possibly the host address), so for it a
/// non-text byte, the letters "KR" and a two-digit version are accepted. Sets `version` only if valid.
/// Cycle-safe.
VersionText parse_version(std::span<const std::uint8_t> text, FirmwareVersion& version) noexcept;

}  // namespace drivers::tmcl
