#include "drivers/haptic/haptic_fault.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

namespace drivers::haptic {
namespace haptic_fault_test {

TEST(HapticFaultInWords, EachHasItsOwn) {
  std::set<std::string> words;
  const int last = static_cast<int>(HapticFault::kDeviceFault);
  for (int i = 0; i <= last; ++i) words.insert(describe(static_cast<HapticFault>(i)));
  EXPECT_EQ(words.size(), static_cast<std::size_t>(last + 1));
  EXPECT_EQ(words.count("unknown fault"), 0U);
}

}  // namespace haptic_fault_test
}  // namespace drivers::haptic
