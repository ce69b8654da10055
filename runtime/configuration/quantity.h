/// @file
/// Names that end with their unit, in readable form.
#pragma once
#include <string>
#include <string_view>

namespace runtime {

struct Quantity {
  std::string name;  ///< "static" of "static_Nm", words separated
  std::string unit;  ///< "N·m"; empty if the name has none
};

/// "viscous_Nm_s_per_rad" → {"viscous", "N·m·s/rad"}.
Quantity quantity_of(std::string_view name_with_unit);

/// Name of the command-line option: "settle_s" → "--settle", "max_speed_rad_per_s" → "--max-speed". A list,
/// such as "joints", becomes singular: one element at a time.
std::string option_name(std::string_view name_with_unit);

}  // namespace runtime
