// Real-time rights that a PREEMPT_RT kernel gives to root. Not its latency: the processor is emulated.
#include "runtime/real_time.h"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/utsname.h>

#include <fstream>
#include <string>

namespace guest {
namespace real_time_test {

int locked_kB() {
  std::ifstream status("/proc/self/status");
  std::string word;
  int size_kB = 0;
  while (status >> word) {
    if (word == "VmLck:") status >> size_kB;
  }
  return size_kB;
}

TEST(RealTime, KernelIsFullyPreemptible) {
  utsname name{};
  ASSERT_EQ(::uname(&name), 0);
  EXPECT_NE(std::string(name.version).find("PREEMPT_RT"), std::string::npos) << name.version;
}

TEST(RealTime, ThreadGetsWhatItAsksForAndGivesItBack) {
  ASSERT_EQ(locked_kB(), 0);
  {
    runtime::RealTimeThread thread;
    for (const std::string& refused : thread.enter({.priority = 80, .cpu = 1})) ADD_FAILURE() << refused;
    sched_param parameters{};
    ASSERT_EQ(::sched_getparam(0, &parameters), 0);
    EXPECT_EQ(::sched_getscheduler(0), SCHED_FIFO);
    EXPECT_EQ(parameters.sched_priority, 80);
    EXPECT_EQ(::sched_getcpu(), 1);
    EXPECT_GT(locked_kB(), 256) << "its stack alone is as large";
  }
  EXPECT_EQ(::sched_getscheduler(0), SCHED_OTHER);
}

TEST(RealTime, CoreThatIsNotThereIsRefusedAloneAndInWords) {
  runtime::RealTimeThread thread;
  const auto refused = thread.enter({.priority = 80, .cpu = 63});
  ASSERT_EQ(refused.size(), 1U);
  EXPECT_NE(refused[0].find("pinning to the core refused"), std::string::npos) << refused[0];
}

}  // namespace real_time_test
}  // namespace guest
