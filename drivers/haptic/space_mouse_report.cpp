#include "drivers/haptic/space_mouse_report.h"

#include <algorithm>
#include <cstddef>

namespace drivers::haptic {
namespace {

constexpr std::size_t kAxisBytes = 6;
constexpr double kStop = 350;

/// Three axes as the device has them (x right, y towards the user, z down) in our frame.
std::array<double, 3> axes(std::span<const std::uint8_t> bytes) noexcept {
  std::array<double, 3> result{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto raw =
        static_cast<std::int16_t>(static_cast<std::uint16_t>(bytes[2 * i] | bytes[2 * i + 1] << 8));
    result[i] = std::clamp((i == 0 ? 1 : -1) * static_cast<double>(raw) / kStop, -1.0, 1.0);
  }
  return result;
}

bool recent(std::chrono::nanoseconds age) noexcept {
  return age >= std::chrono::nanoseconds(0) && age <= SpaceMouseReports::kSilence;
}

}  // namespace

bool SpaceMouseReports::take(std::span<const std::uint8_t> report, std::chrono::nanoseconds now) noexcept {
  const std::uint8_t number = report.empty() ? 0 : report[0];
  const std::span<const std::uint8_t> bytes = report.subspan(report.empty() ? 0 : 1);
  if (number == 1 && (bytes.size() == kAxisBytes || bytes.size() == 2 * kAxisBytes)) {
    deflection_.translation = axes(bytes);
    translated_at_ = now;
    if (bytes.size() == 2 * kAxisBytes) {
      deflection_.rotation = axes(bytes.subspan(kAxisBytes));
      rotated_at_ = now;
    }
  } else if (number == 2 && bytes.size() == kAxisBytes) {
    deflection_.rotation = axes(bytes);
    rotated_at_ = now;
  } else if (number == 3 && !bytes.empty() && bytes.size() <= 6) {
    buttons_ = 0;
    for (std::size_t i = 0; i < std::min<std::size_t>(bytes.size(), 4); ++i)
      buttons_ |= std::uint32_t{bytes[i]} << 8 * i;
  } else if (number == 23 && !bytes.empty()) {
    battery_percent_ = bytes[0];
  } else {
    ++unknown_;
    return false;
  }
  return true;
}

SpaceMouseDeflection SpaceMouseReports::deflection(std::chrono::nanoseconds now) const noexcept {
  SpaceMouseDeflection result = deflection_;
  if (!recent(now - translated_at_)) result.translation = {};
  if (!recent(now - rotated_at_)) result.rotation = {};
  return result;
}

void SpaceMouseReports::release() noexcept { deflection_ = {}; }

}  // namespace drivers::haptic
