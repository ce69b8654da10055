/// @file
/// Notifications to the service manager that started the service (systemd, Type=notify).
#pragma once
#include <chrono>
#include <optional>
#include <string>

namespace runtime {

/// Does nothing without a NOTIFY_SOCKET, as in a shell. Not for a cycle. A message that cannot be delivered
/// is ignored: the manager has its own time-outs.
class ServiceManager {
 public:
  /// Set-up is over; `status` as status().
  void ready(const std::string& status) const noexcept;
  /// One line on the current activity, as shown by `systemctl status`.
  void status(const std::string& text) const noexcept;
  /// The service is shutting down.
  void stopping() const noexcept;

  /// Call every watchdog_interval(), from the thread whose hang must be detected.
  void watchdog() const noexcept;
  /// Half the time after which the manager ends a silent service; empty: no watchdog.
  std::optional<std::chrono::microseconds> watchdog_interval() const noexcept;
};

}  // namespace runtime
