/// @file
/// Names that reader and writer of base files share.
#pragma once
#include <array>
#include <string_view>
#include <utility>

#include "control/base_description.h"

namespace runtime {

inline constexpr std::string_view kBaseFormat = "youbot-robot-model/1";

inline constexpr std::array<std::pair<std::string_view, control::BaseKinematics>, 4> kBaseKinematics{
    {{"differential", control::BaseKinematics::kDifferential},
     {"tricycle", control::BaseKinematics::kTricycle},
     {"omni", control::BaseKinematics::kOmni},
     {"mecanum", control::BaseKinematics::kMecanum}}};

}  // namespace runtime
