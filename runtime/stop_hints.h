/// @file
/// What to do about stops that base and arm have in common; behind what happened.
#pragma once

namespace runtime {

inline constexpr const char* kNotEnabledHint =
    ": check the emergency stop and the 24 V; youbot-bench scan lists the boards that answer";
inline constexpr const char* kStalledHint = ": end other programs that keep it from running";

}  // namespace runtime
