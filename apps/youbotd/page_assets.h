/// @file
/// Contents of the page, embedded from apps/youbotd/page/ at build time (report/embed.cmake).
#pragma once
#include <string_view>

namespace youbotd {

extern const std::string_view kPageHtml;
extern const std::string_view kPageStyle;
extern const std::string_view kPageScript;
extern const std::string_view kStopScript;
extern const std::string_view kStreamScript;
extern const std::string_view kRobotScript;
extern const std::string_view kPlotsScript;
extern const std::string_view kThreeScript;
extern const std::string_view kOrbitScript;
extern const std::string_view kThreeLicense;

}  // namespace youbotd
