/// @file
/// What every page carries, as files at build time (embed.cmake).
#pragma once
#include <string_view>

namespace report {

extern const std::string_view kUPlotScript;
extern const std::string_view kUPlotStyle;
extern const std::string_view kUPlotLicense;
extern const std::string_view kPageScript;
extern const std::string_view kPageStyle;

}  // namespace report
