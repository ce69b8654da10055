/// @file
/// youbot.urdf, embedded.
#pragma once
#include <string_view>

namespace control {

extern const std::string_view kYoubotUrdf;

}  // namespace control
