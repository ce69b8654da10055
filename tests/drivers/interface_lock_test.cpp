#include "drivers/interface_lock.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <optional>
#include <string>
#include <utility>

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
  const std::string us = "test_drivers (process " + std::to_string(getpid()) + ")";
  for (const End held : {End::kEthercatMaster, End::kEthercatSlaves, End::kCanMaster}) {
    const InterfaceLock lock("can0", index(), held);
    for (const End end : {End::kEthercatMaster, End::kEthercatSlaves, End::kCanMaster}) {
      const std::string told = refusal(end);
      if (end != held)
        EXPECT_EQ(told, "");
      else
        EXPECT_NE(told.find("can0: lock the interface: "), std::string::npos) << told;
      EXPECT_EQ(told.find(us) != std::string::npos, end == held) << told;
    }
    EXPECT_NO_THROW(InterfaceLock("can1", index() + 1, held)) << "another interface";
  }
  EXPECT_EQ(refusal(End::kCanMaster), "");
}

TEST(InterfaceLock, IsHeldByWhoeverItWasMovedTo) {
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

}  // namespace interface_lock_test
}  // namespace drivers
