/// @file
#pragma once

namespace runtime {

/// Release and commit the binary was built from, for logs and recordings: "0.1.0 (9320dc8)".
const char* build_version() noexcept;

}  // namespace runtime
