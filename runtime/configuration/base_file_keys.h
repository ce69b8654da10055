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

inline const char* base_turning_key(control::BaseKinematics kinematics) {
  switch (kinematics) {
    case control::BaseKinematics::kDifferential: return "track_m";
    case control::BaseKinematics::kTricycle: return "wheelbase_m";
    case control::BaseKinematics::kOmni: return "radius_m";
    case control::BaseKinematics::kMecanum: return "turning_length_m";
  }
  return "";
}

}  // namespace runtime
