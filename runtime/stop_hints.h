/// @file
/// Advice for stops common to base and arm; appended to what happened.
#pragma once

namespace runtime {

inline constexpr const char* kNotEnabledHint =
    ": check the emergency stop and the 24 V; youbot-bench scan lists the boards that answer";
inline constexpr const char* kStalledHint = ": end other programs that keep it from running";

}  // namespace runtime
