#include "runtime/configuration/quantity.h"

#include <algorithm>
#include <array>

namespace runtime {
namespace {

struct Unit {
  std::string_view suffix;
  std::string_view unit;
};
/// Longer units before those they end with.
constexpr auto kUnits = std::to_array<Unit>({{"_Nm_s2_per_rad2", "N·m·s²/rad²"},
                                             {"_rad_per_s2", "rad/s²"},
                                             {"_Nm_s_per_rad", "N·m·s/rad"},
                                             {"_Nm_per_rad", "N·m/rad"},
                                             {"_Nm_per_s", "N·m/s"},
                                             {"_rad_per_s", "rad/s"},
                                             {"_s_per_rad", "s/rad"},
                                             {"_kg_m2", "kg·m²"},
                                             {"_rad", "rad"},
                                             {"_Nm", "N·m"},
                                             {"_Hz", "Hz"},
                                             {"_s", "s"}});

}  // namespace

Quantity quantity_of(std::string_view name_with_unit) {
  Quantity quantity;
  for (const auto& [suffix, unit] : kUnits) {
    if (!name_with_unit.ends_with(suffix)) continue;
    name_with_unit.remove_suffix(suffix.size());
    quantity.unit = unit;
    break;
  }
  quantity.name = name_with_unit;
  std::ranges::replace(quantity.name, '_', ' ');
  return quantity;
}

std::string option_name(std::string_view name_with_unit) {
  const std::string name = quantity_of(name_with_unit).name;
  std::string option = "--" + (name == "joints" ? "joint" : name);
  std::ranges::replace(option, ' ', '-');
  return option;
}

}  // namespace runtime
