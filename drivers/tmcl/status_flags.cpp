#include "drivers/tmcl/status_flags.h"

#include <cstddef>

namespace drivers::tmcl {
namespace {

constexpr bool in_order() noexcept {
  for (std::size_t bit = 0; bit < kStatusFlags.size(); ++bit) {
    if (static_cast<std::size_t>(kStatusFlags[bit].flag) != bit) return false;
  }
  return true;
}
static_assert(in_order(), "info() indexes by bit");

}  // namespace

const char* describe(FlagReset reset) noexcept {
  switch (reset) {
    case FlagReset::kAutomatic: return "clears itself when its cause is gone";
    case FlagReset::kClearTimeout: return "clear it with SAP 158 once process data flow again";
    case FlagReset::kClearI2t:
      return "let the motor cool for the thermal winding time, then clear it with SAP 29";
  }
  return "unknown reset";
}

}  // namespace drivers::tmcl
