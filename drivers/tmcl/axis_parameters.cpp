#include "drivers/tmcl/axis_parameters.h"

#include <algorithm>

namespace drivers::tmcl {
namespace {

template <typename Table>
constexpr bool is_sound(const Table& table) {
  const bool ordered = std::adjacent_find(table.begin(), table.end(), [](const auto& a, const auto& b) {
                         return a.number >= b.number;
                       }) == table.end();
  return ordered && std::all_of(table.begin(), table.end(), [&](const AxisParameter& row) {
           return row.min < row.max && &row == detail::find(table, row.name);
         });
}
static_assert(is_sound(kDriveParameters) && is_sound(kGripperParameters), "numbers rise, names are unique");

}  // namespace

const char* name(Unit unit) noexcept {
  switch (unit) {
    case Unit::kNone: return "";
    case Unit::kTicks: return "ticks";
    case Unit::kRpm: return "rpm";
    case Unit::kRpmPerSecond: return "rpm/s";
    case Unit::kMilliampere: return "mA";
    case Unit::kMilliohm: return "mOhm";
    case Unit::kCentivolt: return "0.01 V";
    case Unit::kMillisecond: return "ms";
    case Unit::kFiftyMicroseconds: return "50 us";
    case Unit::kMinute: return "min";
    case Unit::kPerMille: return "per mille";
    case Unit::kAdcCounts: return "ADC counts";
    case Unit::kPwmCounts: return "PWM counts";
    case Unit::kSwitch: return "off/on";
    case Unit::kMicrosteps: return "microsteps";
  }
  return "unknown unit";
}

}  // namespace drivers::tmcl
