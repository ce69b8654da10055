#include "drivers/tmcl/firmware_version.h"

#include <algorithm>
#include <cstddef>

namespace drivers::tmcl {
namespace {

constexpr int kGripperController = 842;
constexpr int kMaxControllerDigits = 4;

bool is_digit(std::uint8_t c) noexcept { return c >= '0' && c <= '9'; }

}  // namespace

VersionText parse_version(std::span<const std::uint8_t> text, FirmwareVersion& version) noexcept {
  const auto is_zero = [](std::uint8_t c) { return c == 0; };
  if (!text.empty() && std::all_of(text.begin(), text.end(), is_zero)) return VersionText::kNoAnswerYet;

  std::size_t i = 0;
  const auto at_end = [&] { return i >= text.size(); };
  if (!at_end() && text[i] < ' ') ++i;  // a host address
  const bool named = text.size() >= i + 2 && text[i] == 'K' && text[i + 1] == 'R';
  if (named) i += 2;

  FirmwareVersion found;
  int digits = 0;
  for (; !at_end() && is_digit(text[i]) && digits < kMaxControllerDigits; ++i, ++digits) {
    found.controller = 10 * found.controller + (text[i] - '0');
  }
  if (found.controller == 0 || at_end() || text[i] != 'V') return VersionText::kMalformed;
  ++i;

  digits = 0;
  for (; !at_end() && digits < 3; ++i) {
    if (text[i] == '.' && digits == 1 && text[i - 1] != '.') continue;
    if (!is_digit(text[i])) break;
    found.version = 10 * found.version + (text[i] - '0');
    ++digits;
  }
  if (digits == 2 && found.controller == kGripperController) {
    found.version *= 10;
    ++digits;
  }
  const bool padded = std::all_of(text.begin() + static_cast<std::ptrdiff_t>(i), text.end(),
                                  [](std::uint8_t c) { return c == 0 || c == ' '; });
  if (digits != 3 || !padded) return VersionText::kMalformed;
  version = found;
  return VersionText::kValid;
}

}  // namespace drivers::tmcl
