/// @file
/// The variants of the youBot, and their names in options, configuration and reports.
#pragma once
#include <array>
#include <cstdint>
#include <string_view>
#include <utility>

namespace drivers::tmcl {

enum class YoubotKind : std::uint8_t { kBase, kArm, kBaseAndArm, kBaseAndTwoArms };

inline constexpr std::array<std::pair<std::string_view, YoubotKind>, 4> kYoubotKinds{
    {{"base", YoubotKind::kBase},
     {"arm", YoubotKind::kArm},
     {"base+arm", YoubotKind::kBaseAndArm},
     {"base+two-arms", YoubotKind::kBaseAndTwoArms}}};

constexpr std::string_view name_of(YoubotKind kind) noexcept {
  for (const auto& [name, named] : kYoubotKinds)
    if (named == kind) return name;
  return {};
}

}  // namespace drivers::tmcl
