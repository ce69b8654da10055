/// @file
/// Contents of every page, embedded from files at build time (embed.cmake).
#pragma once
#include <string_view>

namespace report {

extern const std::string_view kDygraphsScript;
extern const std::string_view kDygraphsStyle;
extern const std::string_view kDygraphsLicense;
extern const std::string_view kPageScript;
extern const std::string_view kPageStyle;

}  // namespace report
