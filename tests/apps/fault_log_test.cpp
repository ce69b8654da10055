#include "apps/youbotd/fault_log.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace youbotd {
namespace fault_log_test {

using Lines = std::vector<std::string>;

const std::string kLost = "slave 5 (TMCM-1632): does not answer";
const std::string kStopped = "slave 5 (TMCM-1632): answers, but is not in OP; it refused OP";
const std::string kResuming = "slave 5 (TMCM-1632): on its way to OP; it refused OP";

struct FaultLogTest : testing::Test {
  /// Lines logged in this many beats.
  Lines warnings(const Lines& faults, int beats) {
    Lines logged;
    for (int i = 0; i < beats; ++i)
      for (const std::string& line : log.update(faults).faults) logged.push_back(line);
    return logged;
  }
  FaultLog log;
};

TEST_F(FaultLogTest, ALastingFaultIsLoggedOnceAndItsEndOnce) {
  EXPECT_EQ(warnings({kLost}, FaultLog::kPatience - 1), Lines{});
  EXPECT_EQ(warnings({kLost}, 1), Lines{kLost});
  EXPECT_EQ(warnings({kLost}, 1000), Lines{});
  EXPECT_EQ(log.update({}).works_again, Lines{"slave 5 (TMCM-1632)"});
  EXPECT_EQ(log.update({}).works_again, Lines{});
  EXPECT_EQ(warnings({kLost}, FaultLog::kPatience), Lines{kLost}) << "and another loss is reported again";
}

TEST_F(FaultLogTest, AFaultThatPassesAtOnceIsNotLoggedNorItsEnd) {
  for (int again = 0; again < 100; ++again) {
    EXPECT_EQ(warnings({kLost}, 1), Lines{});
    EXPECT_EQ(warnings({kResuming}, FaultLog::kPatience - 2), Lines{});
    EXPECT_EQ(log.update({}).works_again, Lines{});
  }
}

TEST_F(FaultLogTest, ADeviceThatRepeatsTheSameStatesIsLoggedOnce) {
  EXPECT_EQ(warnings({kLost}, 10), Lines{kLost});
  EXPECT_EQ(warnings({kResuming}, 1), Lines{kResuming}) << "what refused it is new";
  EXPECT_EQ(warnings({kStopped}, 1), Lines{kStopped});
  for (int turn = 0; turn < 100; ++turn) {
    EXPECT_EQ(warnings({kResuming}, 2), Lines{});
    EXPECT_EQ(warnings({kStopped}, 1), Lines{});
  }
}

TEST_F(FaultLogTest, EachDeviceHasItsOwnFaults) {
  const std::string other = "wheel-1: could not find its commutation";
  EXPECT_EQ(warnings({kLost}, 10), Lines{kLost});
  EXPECT_EQ(warnings({kLost, other}, FaultLog::kPatience), Lines{other});
  const FaultLog::News news = log.update({other});
  EXPECT_EQ(news.works_again, Lines{"slave 5 (TMCM-1632)"});
  EXPECT_EQ(news.faults, Lines{});
}

TEST_F(FaultLogTest, ADeviceWithANewTextEachTimeIsLoggedTenTimes) {
  const auto text = [](int after_ms) { return "slave 5: no answer for " + std::to_string(after_ms) + " ms"; };
  Lines logged = warnings({text(0)}, FaultLog::kPatience);
  for (int i = 1; i < 1000; ++i)
    for (const std::string& line : warnings({text(i)}, 1)) logged.push_back(line);
  ASSERT_EQ(logged.size(), 10U);
  EXPECT_EQ(logged.back(), text(9));
  EXPECT_EQ(log.update({}).works_again, Lines{"slave 5"});
  EXPECT_EQ(warnings({text(10)}, FaultLog::kPatience), Lines{text(10)}) << "and another fault is logged";
}

}  // namespace fault_log_test
}  // namespace youbotd
