#include "drivers/interface_lock.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>

#include "tests/support/skip.h"

namespace drivers {
namespace interface_lock_test {

using End = InterfaceLock::End;

/// No interface has it. A test uses index() and index() + 1, and tests that run at the same time have
/// neighbouring process ids: hence two indices for each process.
int index() { return 1'000'000 + 2 * getpid(); }

std::string refusal(End end) {
  try {
    const InterfaceLock lock("can0", index(), end);
  } catch (const InterfaceInUse& error) {
    return error.what();
  }
  return {};
}

TEST(InterfaceLock, HasOneHolderForEachEndWhoIsNamedToTheNext) {
  const std::string us = "test_drivers (process " + std::to_string(getpid()) + " of " +
                         (geteuid() == 0 ? "root" : "user " + std::to_string(geteuid())) + ")";
  for (const End held : {End::kEthercatMaster, End::kEthercatSlaves, End::kCanMaster}) {
    const InterfaceLock lock("can0", index(), held);
    for (const End end : {End::kEthercatMaster, End::kEthercatSlaves, End::kCanMaster}) {
      const std::string message = refusal(end);
      if (end != held)
        EXPECT_EQ(message, "");
      else
        EXPECT_NE(message.find("can0: lock the interface: "), std::string::npos) << message;
      EXPECT_EQ(message.find(us) != std::string::npos, end == held) << message;
    }
    EXPECT_NO_THROW(InterfaceLock("can1", index() + 1, held)) << "another interface";
  }
  EXPECT_EQ(refusal(End::kCanMaster), "");
}

TEST(InterfaceLock, IsHeldByTheObjectItWasMovedTo) {
  std::optional<InterfaceLock> first(std::in_place, "can0", index(), End::kCanMaster);
  std::optional<InterfaceLock> second(std::move(*first));
  first.reset();
  EXPECT_NE(refusal(End::kCanMaster), "");
  InterfaceLock third("can1", index() + 1, End::kCanMaster);
  third = std::move(*second);
  EXPECT_NE(refusal(End::kCanMaster), "");
  second.reset();
  EXPECT_NO_THROW(InterfaceLock("can1", index() + 1, End::kCanMaster));
  EXPECT_NE(refusal(End::kCanMaster), "");
}

TEST(InterfaceLock, AHolderOfAnotherUserIsNamedWithIt) {
  SKIP_UNLESS(geteuid() == 0, "only root can become another user");
  std::array<int, 2> ready{};
  ASSERT_EQ(pipe(ready.data()), 0);
  const pid_t stranger = fork();
  if (stranger == 0) {
    constexpr unsigned kNobody = 65534;
    if (setgid(kNobody) != 0 || setuid(kNobody) != 0) _exit(2);
    // The parent's index.
    const InterfaceLock lock("can0", 1'000'000 + 2 * getppid(), End::kCanMaster);
    if (write(ready[1], "x", 1) == 1) pause();
    _exit(1);
  }
  close(ready[1]);
  char byte = 0;
  ASSERT_EQ(read(ready[0], &byte, 1), 1);
  const std::string message = refusal(End::kCanMaster);
  EXPECT_NE(message.find("(process " + std::to_string(stranger) + " of user 65534)"), std::string::npos)
      << message;
  kill(stranger, SIGKILL);
  waitpid(stranger, nullptr, 0);
  close(ready[0]);
  EXPECT_EQ(refusal(End::kCanMaster), "");
}

TEST(InterfaceLock, AHolderThatDoesNotListenIsLookedForWithSs) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string name = "youbot-hal/can-master/" + std::to_string(index());
  name.copy(address.sun_path + 1, name.size());
  const int squatter = socket(AF_UNIX, SOCK_STREAM, 0);
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
  ASSERT_EQ(bind(squatter, reinterpret_cast<const sockaddr*>(&address), size), 0);
  EXPECT_NE(refusal(End::kCanMaster).find("another program, which 'ss --unix --all --processes' shows"),
            std::string::npos);
  close(squatter);
}

}  // namespace interface_lock_test
}  // namespace drivers
