/// @file
/// Protocol between programs and a running youbotd: a Unix socket with message boundaries (SOCK_SEQPACKET). A
/// request is a line of words, "set limits.force_N 4"; each is answered by one JSON object with "ok" and, if
/// that is false, "error".
#pragma once
#include <sys/un.h>

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <string>

namespace runtime {

inline constexpr const char* kControlSocket = "/run/youbotd/control";
inline constexpr std::size_t kLongestRequest = 4096;
inline constexpr std::size_t kLongestAnswer = 65536;
/// The commanding client must send a request at least this often; `alive` is enough. After this time without
/// one the robot comes to rest. The default of youbotd's loop.commander_timeout_s.
inline constexpr std::chrono::milliseconds kCommanderTimeout{500};

/// @throws std::invalid_argument if the path is too long for a socket.
sockaddr_un control_address(const std::filesystem::path& path);

}  // namespace runtime
