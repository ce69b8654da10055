/// @file
/// How programs talk to a running youbotd: a Unix socket of whole messages (SOCK_SEQPACKET). A request is a
/// line of words, "set limits.force_N 4"; each is answered by one JSON object with "ok" and, where that is
/// false, "error".
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
/// Who commands says something at least this often; `alive` will do. After that long without a word the
/// robot comes to rest. The default of youbotd's loop.commander_timeout_s.
inline constexpr std::chrono::milliseconds kCommanderTimeout{500};

/// @throws std::invalid_argument when the path is too long for a socket's.
sockaddr_un control_address(const std::filesystem::path& path);

}  // namespace runtime
