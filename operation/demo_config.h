/// @file
#pragma once
#include <string_view>

namespace operation {

extern const std::string_view kDemoConfig;  ///< the text of demo.toml

}  // namespace operation
