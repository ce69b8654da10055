#include "sim/devices/emulated_space_mouse.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sim::devices {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr int kRoundsOfZeros = 3;

std::int16_t raw(double part) noexcept {
  return static_cast<std::int16_t>(std::lround(350.0 * std::clamp(part, -1.0, 1.0)));
}

/// The device's axes point to the right, towards the user and down.
std::array<std::int16_t, 6> raw_axes(const SpaceMouseCap& cap) noexcept {
  const auto& t = cap.translation;
  const auto& r = cap.rotation;
  return {raw(t[0]), raw(-t[1]), raw(-t[2]), raw(r[0]), raw(-r[1]), raw(-r[2])};
}

Bytes axes_report(std::uint8_t number, std::span<const std::int16_t> axes) {
  Bytes bytes{number};
  for (const std::int16_t axis : axes) {
    const auto bits = static_cast<std::uint16_t>(axis);
    bytes.push_back(static_cast<std::uint8_t>(bits & 0xffU));
    bytes.push_back(static_cast<std::uint8_t>(bits >> 8U));
  }
  return bytes;
}

// Parts of the report descriptor (HID 1.11, section 6.2.2): an item's first byte is its type and the number
// of bytes that follow.
constexpr auto kBegin = std::to_array<std::uint8_t>({0x05, 0x01,    // usage page: generic desktop
                                                     0x09, 0x08,    // usage: multi-axis controller
                                                     0xa1, 0x01});  // application collection
constexpr std::uint8_t kEnd = 0xc0;                                 // of a collection
constexpr auto kTranslation = std::to_array<std::uint8_t>({0xa1, 0x00, 0x85, 0x01,  // report 1
                                                           0x16, 0xa2, 0xfe,        // from -350
                                                           0x26, 0x5e, 0x01,        // to 350
                                                           0x36, 0x88, 0xfa,        // which are -1400
                                                           0x46, 0x78, 0x05,        // to 1400
                                                           0x55, 0x0c, 0x65, 0x11,  // times 1e-4 cm
                                                           0x09, 0x30, 0x09, 0x31, 0x09, 0x32,  // x, y, z
                                                           0x75, 0x10});                        // 16 bits
constexpr auto kReportTwo = std::to_array<std::uint8_t>({0xa1, 0x00, 0x85, 0x02});
constexpr auto kRotation = std::to_array<std::uint8_t>({0x09, 0x33, 0x09, 0x34, 0x09, 0x35});
// The SpaceNavigator declares its axes as relative, although they are not.
constexpr auto kThreeRelative = std::to_array<std::uint8_t>({0x95, 0x03, 0x81, 0x06});
constexpr auto kSixAbsolute = std::to_array<std::uint8_t>({0x95, 0x06, 0x81, 0x02});
constexpr auto kButtons = std::to_array<std::uint8_t>({0xa1, 0x02, 0x85, 0x03,  // report 3
                                                       0x15, 0x00, 0x25, 0x01,  // 0 or 1
                                                       0x35, 0x00, 0x45, 0x01,  // which mean that
                                                       0x55, 0x00, 0x65, 0x00,  // and have no unit
                                                       0x75, 0x01, 0x05, 0x09, 0x19, 0x01});  // from button 1
constexpr auto kTwoOfSixteen = std::to_array<std::uint8_t>({0x29, 0x02, 0x95, 0x02, 0x81, 0x02,  // to 2
                                                            0x95, 0x0e, 0x81, 0x03});            // no more
constexpr auto kThirtyTwo = std::to_array<std::uint8_t>({0x29, 0x20, 0x95, 0x20, 0x81, 0x02});
constexpr auto kLight = std::to_array<std::uint8_t>({0xa1, 0x02, 0x85, 0x04,  // report 4
                                                     0x05, 0x08, 0x09, 0x4b,  // generic indicator
                                                     0x95, 0x01, 0x91, 0x02,  // one bit of output
                                                     0x75, 0x07, 0x91, 0x03,  // and no more
                                                     kEnd});
constexpr auto kBattery = std::to_array<std::uint8_t>({0xa1, 0x02, 0x85, 0x17,  // report 23
                                                       0x05, 0x06, 0x09, 0x20,  // battery strength
                                                       0x15, 0x00, 0x25, 0x64, 0x75, 0x08,  // to 100, a byte
                                                       0x95, 0x01, 0x81, 0x02,              // and one byte
                                                       0x81, 0x03, kEnd});  // without a meaning

}  // namespace

std::chrono::milliseconds EmulatedSpaceMouse::period() const noexcept {
  return std::chrono::milliseconds(options_.layout == SpaceMouseLayout::kTwoReports ? 8 : 16);
}

std::vector<SpaceMouseReport> EmulatedSpaceMouse::advance(std::chrono::nanoseconds now) {
  std::vector<SpaceMouseReport> sent;
  for (; next_ <= now; next_ += period()) {
    send_axes(sent);
    if (const auto buttons = std::exchange(buttons_to_tell_, {})) {
      Bytes bytes{3};
      for (unsigned i = 0; i < (options_.pro_buttons ? 4U : 2U); ++i)
        bytes.push_back(static_cast<std::uint8_t>(*buttons >> 8U * i & 0xffU));
      send(sent, std::move(bytes));
    }
    if (const auto battery = std::exchange(battery_to_tell_, {})) send(sent, {0x17, *battery, 1});
  }
  return sent;
}

void EmulatedSpaceMouse::send(std::vector<SpaceMouseReport>& sent, std::vector<std::uint8_t> bytes) const {
  sent.push_back({next_, std::move(bytes)});
}

void EmulatedSpaceMouse::send_axes(std::vector<SpaceMouseReport>& sent) {
  const auto send_unless_lost = [&](std::uint8_t number, std::span<const std::int16_t> axes) {
    if (lost_ > 0)
      --lost_;
    else
      send(sent, axes_report(number, axes));
  };
  if (std::exchange(rotation_is_next_, false)) {
    send_unless_lost(2, std::span(axes_).subspan(3));
    return;
  }
  axes_ = raw_axes(motion_(next_));
  const bool deflected = std::ranges::any_of(axes_, [](std::int16_t axis) { return axis != 0; });
  if (deflected)
    zeros_to_send_ = kRoundsOfZeros;
  else if (zeros_to_send_ == 0)
    return;
  else
    --zeros_to_send_;
  if (options_.layout == SpaceMouseLayout::kOneReport) {
    send_unless_lost(1, axes_);
  } else {
    send_unless_lost(1, std::span(axes_).first(3));
    rotation_is_next_ = true;
  }
}

bool EmulatedSpaceMouse::take_output(std::span<const std::uint8_t> report) {
  if (report.size() != 2 || report[0] != 4 || report[1] > 1) return false;
  lit_ = report[1] == 1;
  return true;
}

std::vector<std::uint8_t> EmulatedSpaceMouse::report_descriptor() const {
  Bytes all;
  const auto add = [&all](std::span<const std::uint8_t> part) {
    all.insert(all.end(), part.begin(), part.end());
  };
  add(kBegin);
  add(kTranslation);
  if (options_.layout == SpaceMouseLayout::kTwoReports) {
    add(kThreeRelative);
    all.push_back(kEnd);
    add(kReportTwo);
    add(kRotation);
    add(kThreeRelative);
  } else {
    add(kRotation);
    add(kSixAbsolute);
  }
  all.push_back(kEnd);
  add(kButtons);
  if (options_.pro_buttons)
    add(kThirtyTwo);
  else
    add(kTwoOfSixteen);
  all.push_back(kEnd);
  add(kLight);
  if (options_.layout == SpaceMouseLayout::kOneReport) add(kBattery);
  all.push_back(kEnd);
  return all;
}

}  // namespace sim::devices
