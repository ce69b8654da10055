/// @file
/// The runtime::open_robot() that watch_opened_robots (tests/CMakeLists.txt) links into a test program.
#pragma once

namespace support {

/// Number of robots opened and watched so far.
int watched_robots_opened();

}  // namespace support
