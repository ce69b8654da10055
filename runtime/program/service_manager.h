/// @file
/// What a service tells the service manager that started it (systemd, Type=notify).
#pragma once
#include <chrono>
#include <optional>
#include <string>

namespace runtime {

/// Does nothing where nobody listens: in a shell there is no NOTIFY_SOCKET. Nothing here is for a cycle, and
/// a message that cannot be delivered is nobody's fault: the manager acts by its own time-outs.
class ServiceManager {
 public:
  /// Set-up is over; `status` as status().
  void ready(const std::string& status) const noexcept;
  /// One line about what is done now, as `systemctl status` shows it.
  void status(const std::string& text) const noexcept;
  /// The service is on its way down.
  void stopping() const noexcept;

  /// Still alive. To be called every watchdog_interval(), by the thread whose hanging would be the failure.
  void watchdog() const noexcept;
  /// Half the time after which the manager ends a service that it does not hear of; none: it does not wait.
  std::optional<std::chrono::microseconds> watchdog_interval() const noexcept;
};

}  // namespace runtime
