/// @file
/// Tests that depend on the machine: namespaces, a program, a device.
#pragma once
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>

namespace support {

/// `./dev test` installs what the tests need, so as root none of them may be skipped.
inline bool must_run() { return std::getenv("YOUBOT_TESTS_MUST_RUN") != nullptr && ::geteuid() == 0; }

}  // namespace support

/// Without `condition` the test ends here: skipped, or failed if it must run.
#define SKIP_UNLESS(condition, reason)         \
  do {                                         \
    if (condition) break;                      \
    if (support::must_run()) FAIL() << reason; \
    GTEST_SKIP() << reason;                    \
  } while (false)
