/// @file
#pragma once
#include <string_view>

namespace youbotd {

extern const std::string_view kDemoConfig;  ///< the text of demo.toml

}  // namespace youbotd
