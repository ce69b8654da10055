/// @file
#pragma once

namespace runtime {

/// Release and commit of the binary, for logs and recordings: "0.1.0 (9320dc8)".
const char* build_version() noexcept;

}  // namespace runtime
