/// @file
/// Which system calls fail at which number, and a program that meets such a failure.
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/failing_calls.h"
#include "tests/support/run_command.h"

namespace nth_failure {

/// One call that fails, as tests/support/failing_calls.h describes it.
struct Failure {
  std::string call;
  std::uint64_t at = 1;
  int error = 0;
  bool for_ever = false;

  /// Legal at any time and no failure at all: an interrupted call, a transfer of less than was asked for, a
  /// socket that has nothing yet. The program does what it does without.
  bool is_silent() const;
};
std::string describe(const Failure& failure);

/// What is wrong with how a program ended that ends with `expected` otherwise: a crash, a code that is not
/// documented, or an error that does not name its cause: what the system said, and the file, socket,
/// interface, memory or thread that is concerned.
std::vector<std::string> flaws_of_end(const Failure& failure, const support::CommandResult& result,
                                      int expected);

/// The program and its arguments, with the library that counts its calls into `counts` and lets one fail.
/// Its temporary files, fault reports among them, go into the folder `tmp` beside `counts`. It is killed
/// after `patience_s`.
std::vector<std::string> with_failure(const std::filesystem::path& counts,
                                      const std::optional<Failure>& failure,
                                      const std::vector<std::string>& words, int patience_s = 20);

/// Zero for all when the program did not get as far as main().
support::CallCounts read_counts(const std::filesystem::path& counts);
std::uint64_t count_of(const support::CallCounts& counts, const std::string& call);

/// Each errno that fits each call that a run has made, once and from then on. Of many calls of one name the
/// first, the last and some between fail, or all of them with YOUBOT_NTH_FAILURE_ALL in the environment;
/// calls that a run repeats for ever, like a poll(), need `at_most` nevertheless.
std::vector<Failure> failures_of(const support::CallCounts& counts, std::size_t some,
                                 std::size_t at_most = SIZE_MAX);

/// As many of them as a short test has time for, evenly spread; all with YOUBOT_NTH_FAILURE_ALL.
std::vector<Failure> some_of(const std::vector<Failure>& all, std::size_t count);

/// Fails the test for each flaw. With YOUBOT_NTH_FAILURE_SHOW in the environment it also prints what the
/// program said.
void report(const Failure& failure, const support::CommandResult& result,
            const std::vector<std::string>& flaws);

}  // namespace nth_failure
