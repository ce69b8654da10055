#include "runtime/program/service_manager.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

namespace runtime {
namespace {

std::string_view environment(const char* name) noexcept {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}

std::optional<std::uint64_t> number(std::string_view text) noexcept {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// The protocol of sd_notify(3), which its manual declares stable: one datagram per message. libsystemd is
/// not used, because its development package must match the running systemd: installing it upgrades systemd.
void notify(std::string_view message) noexcept {
  const std::string_view path = environment("NOTIFY_SOCKET");
  sockaddr_un address{};
  const bool is_abstract = path.starts_with('@');
  if (!(is_abstract || path.starts_with('/')) || path.size() >= sizeof address.sun_path) return;
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, path.size());
  if (is_abstract) address.sun_path[0] = '\0';
  const int socket = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (socket < 0) return;
  // An abstract name has no terminating zero, and each byte of the length counts.
  const auto size =
      static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + path.size() + (is_abstract ? 0 : 1));
  (void)sendto(socket, message.data(), message.size(), MSG_NOSIGNAL,
               reinterpret_cast<const sockaddr*>(&address), size);
  close(socket);
}

/// A message consists of lines NAME=VALUE: a line break would start another assignment.
std::string status_line(std::string text) {
  std::ranges::replace(text, '\n', ' ');
  return "STATUS=" + text;
}

}  // namespace

void ServiceManager::ready(const std::string& status) const noexcept {
  notify("READY=1\n" + status_line(status));
}

void ServiceManager::status(const std::string& text) const noexcept { notify(status_line(text)); }

void ServiceManager::stopping() const noexcept { notify("STOPPING=1"); }

void ServiceManager::watchdog() const noexcept { notify("WATCHDOG=1"); }

std::optional<std::chrono::microseconds> ServiceManager::watchdog_interval() const noexcept {
  constexpr auto kLongest_us = static_cast<std::uint64_t>(std::chrono::microseconds::max().count());
  const std::optional<std::uint64_t> limit_us = number(environment("WATCHDOG_USEC"));
  // Without a process id it applies to every process that inherits the variable (sd_watchdog_enabled(3)).
  const std::string_view pid = environment("WATCHDOG_PID");
  const bool is_ours = pid.empty() || number(pid) == static_cast<std::uint64_t>(getpid());
  if (!limit_us || *limit_us == 0 || *limit_us > kLongest_us || !is_ours) return std::nullopt;
  return std::chrono::microseconds(*limit_us / 2);
}

}  // namespace runtime
