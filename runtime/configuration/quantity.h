/// @file
/// Names that end with their unit, as people read them.
#pragma once
#include <string>
#include <string_view>

namespace runtime {

struct Quantity {
  std::string name;  ///< "static" of "static_Nm", words apart
  std::string unit;  ///< "N·m"; empty when the name has none
};

/// "viscous_Nm_s_per_rad" → {"viscous", "N·m·s/rad"}.
Quantity quantity_of(std::string_view name_with_unit);

/// How a command line calls it: "settle_s" → "--settle", "max_speed_rad_per_s" → "--max-speed"; of several,
/// such as "joints", one is given at a time.
std::string option_name(std::string_view name_with_unit);

}  // namespace runtime
