/// @file
/// The drive models of apps/youbot_sim/thesis, as the files' texts.
#pragma once
#include <string_view>

namespace youbot_bench::thesis {

extern const std::string_view kWheel1;
extern const std::string_view kWheel2;
extern const std::string_view kWheel3;
extern const std::string_view kWheel4;

}  // namespace youbot_bench::thesis
