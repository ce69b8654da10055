#include "tests/nth_failure/failures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <map>
#include <regex>
#include <set>

#include "tests/support/built_paths.h"

namespace nth_failure {
namespace {

using support::CallCounts;
using support::kFailingCalls;
using support::kShort;

/// What can happen to each call on a machine that runs out of something, or whose disk or cable fails.
const std::map<std::string, std::vector<int>>& errors() {
  static const std::map<std::string, std::vector<int>> kErrors{
      {"accept4", {EMFILE, EINTR, ECONNABORTED}},
      {"bind", {EADDRINUSE}},
      {"chmod", {EPERM}},
      {"clock_nanosleep", {EINTR}},
      {"close", {EIO, EINTR}},
      {"connect", {ECONNREFUSED, EINTR}},
      {"epoll_create1", {EMFILE}},
      {"epoll_ctl", {ENOMEM}},
      {"epoll_wait", {EINTR}},
      {"eventfd", {EMFILE}},
      {"fchmod", {EPERM}},
      {"fcntl", {ENOLCK}},
      {"fdatasync", {EIO}},
      {"flock", {EWOULDBLOCK, ENOLCK}},
      {"fopen", {EMFILE}},
      {"fstat", {EIO}},
      {"fsync", {EIO, EINTR}},
      {"ftruncate", {EIO, EINTR}},
      {"getifaddrs", {ENOBUFS}},
      {"getsockopt", {ENOBUFS}},
      {"ioctl", {ENODEV}},
      {"link", {EPERM}},
      {"listen", {EADDRINUSE}},
      {"lstat", {EIO}},
      {"mkdir", {ENOSPC}},
      {"mkstemp", {ENOSPC}},
      {"mlockall", {ENOMEM}},
      {"mmap", {ENOMEM}},
      {"nanosleep", {EINTR}},
      {"open", {EMFILE, EINTR}},
      {"openat", {EMFILE, EINTR}},
      {"opendir", {EMFILE}},
      {"pipe2", {EMFILE}},
      {"poll", {ENOMEM, EINTR}},
      {"ppoll", {ENOMEM, EINTR}},
      {"pthread_create", {EAGAIN}},
      {"pthread_setaffinity_np", {EINVAL}},
      {"pthread_setschedparam", {EPERM}},
      {"read", {EIO, EINTR, kShort}},
      {"recv", {ECONNRESET, EINTR}},
      {"recvfrom", {ENETDOWN, EINTR}},
      {"recvmsg", {ENETDOWN, EINTR}},
      {"remove", {EBUSY}},
      {"rename", {EIO}},
      {"rmdir", {EBUSY}},
      {"send", {ENOBUFS, EINTR}},
      {"sendfile", {ENOSPC}},
      {"sendmsg", {ENOBUFS, EINTR}},
      {"sendto", {ENOBUFS, EINTR}},
      {"setsockopt", {ENOMEM}},
      {"socket", {EMFILE}},
      {"stat", {EIO}},
      {"statvfs", {EIO}},
      {"timerfd_create", {EMFILE}},
      {"timerfd_settime", {ECANCELED}},
      {"unlink", {EBUSY}},
      {"write", {ENOSPC, EIO, EINTR, kShort}},
      {"writev", {ENOSPC, EINTR}},
  };
  return kErrors;
}

/// 1 to `count`, or `some` of them spread evenly with both ends.
std::vector<std::uint64_t> numbers_up_to(std::uint64_t count, std::size_t some) {
  std::set<std::uint64_t> chosen;
  if (count <= some)
    for (std::uint64_t n = 1; n <= count; ++n) chosen.insert(n);
  else
    for (std::size_t i = 0; i < some; ++i) chosen.insert(1 + (count - 1) * i / (some > 1 ? some - 1 : 1));
  return {chosen.begin(), chosen.end()};
}

bool names_cause(const Failure& failure, const std::string& message) {
  // In our words, which say what to do.
  static const std::map<std::pair<std::string, int>, std::string> kInOurWords{
      {{"flock", EWOULDBLOCK}, "another recording is being written to the file"},
      {{"connect", ECONNREFUSED}, "no youbotd serves there"},
      {{"bind", EADDRINUSE}, "found another program"},
      {{"listen", EADDRINUSE}, "found another program"},
  };
  static const std::map<std::string, std::string> kObjects{
      {"mlockall", "memory"},
      {"pthread_create", "thread"},
      {"pthread_setaffinity_np", "core"},
      {"pthread_setschedparam", "(priority|scheduling)"},
  };
  const auto object = kObjects.find(failure.call);
  const auto ours = kInOurWords.find({failure.call, failure.error});
  const std::string name = object != kObjects.end() ? object->second : "(/[a-z]+/[^ ]+|veth)";
  return std::regex_search(message, std::regex("error: [^\n]*" + name)) &&
         (message.find(std::strerror(failure.error)) != std::string::npos ||
          (ours != kInOurWords.end() && message.find(ours->second) != std::string::npos));
}

/// Whether the test run is the long one.
bool try_all() { return std::getenv("YOUBOT_NTH_FAILURE_ALL") != nullptr; }

}  // namespace

bool Failure::is_silent() const { return error == EINTR || error == kShort || error == ECONNABORTED; }

std::vector<std::string> flaws_of_end(const Failure& failure, const support::CommandResult& result,
                                      int expected) {
  static const std::set<int> kDocumented{0, 2, 3, 4};
  if (!kDocumented.contains(result.exit_code)) return {"ended with " + std::to_string(result.exit_code)};
  std::vector<std::string> flaws;
  if (result.exit_code == expected) return flaws;
  if (failure.is_silent()) flaws.emplace_back("is no reason to end");
  if (!names_cause(failure, result.output))
    flaws.emplace_back("ended without the system's error and its object in the message");
  return flaws;
}

std::string describe(const Failure& failure) {
  return failure.call + " number " + std::to_string(failure.at) +
         (failure.for_ever ? " and all after it" : "") + ": " +
         (failure.error == kShort ? "less than asked for" : std::strerror(failure.error));
}

std::vector<std::string> with_failure(const std::filesystem::path& counts,
                                      const std::optional<Failure>& failure,
                                      const std::vector<std::string>& words, int patience_s) {
  // Behind ours stays what this test runs with: a mocked kernel's library.
  const char* const behind = std::getenv("LD_PRELOAD");
  std::vector<std::string> all{"/usr/bin/timeout",
                               "--signal=KILL",
                               std::to_string(patience_s),
                               "/usr/bin/env",
                               "LD_PRELOAD=" + support::program_dir() + "/../tests/libfailing_calls.so" +
                                   (behind != nullptr ? std::string(":") + behind : ""),
                               "TMPDIR=" + (counts.parent_path() / "tmp").string(),
                               "YOUBOT_FAIL_PROGRAM=" + words.front(),
                               "YOUBOT_FAIL_COUNTS=" + counts.string()};
  if (failure) {
    all.push_back("YOUBOT_FAIL_CALL=" + failure->call);
    all.push_back("YOUBOT_FAIL_AT=" + std::to_string(failure->at));
    all.push_back("YOUBOT_FAIL_ERRNO=" + std::to_string(failure->error));
    if (failure->for_ever) all.emplace_back("YOUBOT_FAIL_FOR_EVER=1");
  }
  all.insert(all.end(), words.begin(), words.end());
  return all;
}

CallCounts read_counts(const std::filesystem::path& counts) {
  CallCounts read{};
  std::ifstream file(counts, std::ios::binary);
  file.read(reinterpret_cast<char*>(read.data()), sizeof read);
  return read;
}

std::uint64_t count_of(const CallCounts& counts, const std::string& call) {
  return counts.at(static_cast<std::size_t>(std::find(kFailingCalls.begin(), kFailingCalls.end(), call) -
                                            kFailingCalls.begin()));
}

std::vector<Failure> some_of(const std::vector<Failure>& all, std::size_t count) {
  if (try_all() || all.size() <= count) return all;
  std::vector<Failure> some;
  for (std::size_t i = 0; i < count; ++i) some.push_back(all[i * all.size() / count]);
  return some;
}

void report(const Failure& failure, const support::CommandResult& result,
            const std::vector<std::string>& flaws) {
  for (const std::string& flaw : flaws)
    ADD_FAILURE() << describe(failure) << ": " << flaw << "\n" << result.output;
  if (std::getenv("YOUBOT_NTH_FAILURE_SHOW") != nullptr)
    std::printf("-- %s: %d\n%s", describe(failure).c_str(), result.exit_code, result.output.c_str());
}

std::vector<Failure> failures_of(const CallCounts& counts, std::size_t some, std::size_t at_most) {
  std::vector<Failure> all;
  for (const std::string_view name : kFailingCalls) {
    const std::string call(name);
    const std::uint64_t count = count_of(counts, call);
    for (const int error : count > 0 ? errors().at(call) : std::vector<int>{})
      for (const std::uint64_t at : numbers_up_to(count, try_all() ? at_most : some)) {
        const Failure once{.call = call, .at = at, .error = error};
        all.push_back(once);
        // From the last one on is the same as once; and a read reports an interface that goes down once.
        if (!once.is_silent() && at < count && error != ENETDOWN)
          all.push_back({.call = call, .at = at, .error = error, .for_ever = true});
      }
  }
  return all;
}

}  // namespace nth_failure
