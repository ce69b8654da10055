// Notifications to a service manager, on a socket like the manager's.
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <string>

#include "runtime/program/service_manager.h"
#include "tests/support/temporary_directory.h"

namespace service_manager_test {

using namespace std::chrono_literals;

class Listener {
 public:
  enum class Name { kFile, kAbstract };
  explicit Listener(Name kind = Name::kFile) {
    const std::string path = directory_ / "notify";
    const bool is_abstract = kind == Name::kAbstract;
    const std::string name = is_abstract ? '\0' + path : path;
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    name.copy(address.sun_path, sizeof address.sun_path - 1);
    const std::size_t size = offsetof(sockaddr_un, sun_path) + name.size() + (is_abstract ? 0 : 1);
    EXPECT_EQ(bind(socket_, reinterpret_cast<const sockaddr*>(&address), static_cast<socklen_t>(size)), 0);
    setenv("NOTIFY_SOCKET", ((is_abstract ? "@" : "") + path).c_str(), 1);
  }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;
  ~Listener() {
    unsetenv("NOTIFY_SOCKET");
    close(socket_);
  }
  /// The next message, empty when there is none: they arrive as they are sent.
  std::string heard() const {
    std::array<char, 512> text{};
    const ssize_t size = recv(socket_, text.data(), text.size(), MSG_DONTWAIT);
    return size > 0 ? std::string(text.data(), static_cast<std::size_t>(size)) : std::string();
  }

 private:
  support::TemporaryDirectory directory_;
  int socket_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
};

/// As the manager sets them for a service whose unit says WatchdogSec=.
class Watchdog {
 public:
  Watchdog(const char* limit_us, const std::string& pid) {
    setenv("WATCHDOG_USEC", limit_us, 1);
    setenv("WATCHDOG_PID", pid.c_str(), 1);
  }
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;
  ~Watchdog() {
    unsetenv("WATCHDOG_USEC");
    unsetenv("WATCHDOG_PID");
  }
};

TEST(ServiceManager, HearsOfTheStartTheStateTheHeartbeatAndTheEnd) {
  const Listener manager;
  const runtime::ServiceManager service;
  service.ready("waiting for enable");
  EXPECT_EQ(manager.heard(), "READY=1\nSTATUS=waiting for enable");
  service.status("running");
  EXPECT_EQ(manager.heard(), "STATUS=running");
  service.watchdog();
  EXPECT_EQ(manager.heard(), "WATCHDOG=1");
  service.stopping();
  EXPECT_EQ(manager.heard(), "STOPPING=1");
  EXPECT_EQ(manager.heard(), "") << "each is sent once";
}

TEST(ServiceManager, HearsOnAnAbstractSocketAsInAContainer) {
  const Listener manager(Listener::Name::kAbstract);
  runtime::ServiceManager().ready("running");
  EXPECT_EQ(manager.heard(), "READY=1\nSTATUS=running");
}

TEST(ServiceManager, AStatusOfSeveralLinesStaysAStatus) {
  const Listener manager;
  const runtime::ServiceManager service;
  service.status("slave 3:\nSTOPPING=1");
  EXPECT_EQ(manager.heard(), "STATUS=slave 3: STOPPING=1");
}

TEST(ServiceManager, IsNotMissedInAShell) {
  unsetenv("NOTIFY_SOCKET");
  const runtime::ServiceManager service;
  service.ready("running");
  service.status("running");
  service.watchdog();
  service.stopping();
  EXPECT_EQ(service.watchdog_interval(), std::nullopt);
}

TEST(ServiceManager, GetsTwoSignsOfLifePerTimeout) {
  const runtime::ServiceManager service;
  {
    const Watchdog watchdog("5000000", std::to_string(getpid()));
    EXPECT_EQ(service.watchdog_interval(), 2500ms);
  }
  {
    const Watchdog watchdog("5000000", std::to_string(getppid()));
    EXPECT_EQ(service.watchdog_interval(), std::nullopt) << "it waits for another process";
  }
  for (const char* limit_us : {"", "0", "soon", "-1", "5000000s", "99999999999999999999"}) {
    const Watchdog watchdog(limit_us, std::to_string(getpid()));
    EXPECT_EQ(service.watchdog_interval(), std::nullopt) << limit_us;
  }
}

}  // namespace service_manager_test
