// The log of a service with a reader that hangs and recovers.
#include "runtime/program/non_blocking_log.h"
#include "runtime/log.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <string>

namespace non_blocking_log_test {

/// Standard error is a small pipe meanwhile.
struct NonBlockingLogTest : testing::Test {
  NonBlockingLogTest() : error_(dup(STDERR_FILENO)) {
    std::array<int, 2> ends{};
    if (pipe2(ends.data(), O_CLOEXEC) != 0) return;
    (void)fcntl(ends[0], F_SETPIPE_SZ, kPipe_bytes);
    (void)fcntl(ends[0], F_SETFL, O_NONBLOCK);
    dup2(ends[1], STDERR_FILENO);
    close(ends[1]);
    reader_ = ends[0];
  }
  ~NonBlockingLogTest() override {
    dup2(error_, STDERR_FILENO);
    close(error_);
    close(reader_);
  }
  std::string read_all() const {
    std::string text;
    std::array<char, 4096> some{};
    for (ssize_t count = 0; (count = read(reader_, some.data(), some.size())) > 0;)
      text.append(some.data(), static_cast<std::size_t>(count));
    return text;
  }
  static long lines_in(const std::string& text) { return std::ranges::count(text, '\n'); }

  static constexpr int kPipe_bytes = 4096;
  int error_;
  int reader_ = -1;
};

TEST_F(NonBlockingLogTest, ALineIsThereAtOnce) {
  const runtime::NonBlockingLog log;
  spdlog::warn("wheel {} is lost", 3);
  EXPECT_NE(read_all().find("warning: wheel 3 is lost\n"), std::string::npos);
}

TEST_F(NonBlockingLogTest, WhatIsQuotedIsPrintable) {
  const runtime::NonBlockingLog log;
  spdlog::info("{} is refused", "\x1b[2J\xff\nyoubotd: error: a fault");
  EXPECT_NE(read_all().find("info: \\x1b[2J\\xff\n  youbotd: error: a fault is refused\n"),
            std::string::npos);
}

TEST_F(NonBlockingLogTest, WhatWaitsIsKeptInOrder) {
  const runtime::NonBlockingLog log(1 << 20);
  for (int i = 0; i < 1000; ++i) spdlog::info("line {}", i);
  std::string text;
  for (int i = 0; i < 100; ++i, spdlog::default_logger()->flush()) text += read_all();
  EXPECT_EQ(lines_in(text), 1000);
  EXPECT_LT(text.find("line 7\n"), text.find("line 999\n"));
}

TEST_F(NonBlockingLogTest, WhatIsLostIsCounted) {
  const runtime::NonBlockingLog log(1000);
  for (int i = 0; i < 1000; ++i) spdlog::info("line {}", i);  // returns
  std::string text;
  for (int i = 0; i < 10; ++i, spdlog::default_logger()->flush()) text += read_all();
  const long kept = lines_in(text);
  EXPECT_LT(kept, 1000);
  spdlog::info("the reader is back");
  text = read_all();
  EXPECT_NE(text.find(std::to_string(1000 - kept) + " lines of the log lost"), std::string::npos) << text;
  EXPECT_NE(text.find("the reader is back\n"), std::string::npos);
}

TEST_F(NonBlockingLogTest, ItsEndWaitsForNoReader) {
  {
    const runtime::NonBlockingLog log(1 << 20);
    for (int i = 0; i < 1000; ++i) spdlog::info("line {}", i);
  }
  EXPECT_LT(lines_in(read_all()), 1000);
}

}  // namespace non_blocking_log_test
