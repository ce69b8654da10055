#include "apps/common/service_manager.h"

#include <systemd/sd-daemon.h>

#include <algorithm>
#include <cstdint>

namespace apps {
namespace {

constexpr int kKeepEnvironment = 0;  // it is read again with each message

/// A message is lines of NAME=VALUE: another line would be taken for one.
std::string status_line(std::string text) {
  std::ranges::replace(text, '\n', ' ');
  return "STATUS=" + text;
}

}  // namespace

void ServiceManager::ready(const std::string& status) const noexcept {
  sd_notify(kKeepEnvironment, ("READY=1\n" + status_line(status)).c_str());
}

void ServiceManager::status(const std::string& text) const noexcept {
  sd_notify(kKeepEnvironment, status_line(text).c_str());
}

void ServiceManager::stopping() const noexcept { sd_notify(kKeepEnvironment, "STOPPING=1"); }

void ServiceManager::watchdog() const noexcept { sd_notify(kKeepEnvironment, "WATCHDOG=1"); }

std::optional<std::chrono::microseconds> ServiceManager::watchdog_interval() const noexcept {
  std::uint64_t limit_us = 0;
  if (sd_watchdog_enabled(kKeepEnvironment, &limit_us) <= 0) return std::nullopt;
  return std::chrono::microseconds(limit_us / 2);
}

}  // namespace apps
