/// @file
/// The runtime::open_robot() that watch_opened_robots (tests/CMakeLists.txt) gives to a test program.
#pragma once

namespace support {

/// How many robots it has opened and watched so far.
int watched_robots_opened();

}  // namespace support
