/// @file
/// Locations of this build and its sources. Functions of one generated source file, because a path in a
/// compiler option would make the same source different in each clone, also for the compiler cache.
#pragma once
#include <string>
#include <string_view>

namespace support {

/// The root of the source tree.
std::string source_dir();

/// The folder of the built programs.
std::string program_dir();

/// The path of a built program, such as "youbotd".
inline std::string program(std::string_view name) { return program_dir() + "/" + std::string(name); }

/// The library that stands in for the vendor's libdrd.
std::string stand_in_library();

/// The program that relays datagrams like a bad network.
std::string udp_relay();

}  // namespace support
