/// @file
/// Failures of system calls by number, and a program that is subject to one.
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/failing_calls.h"
#include "tests/support/run_command.h"

namespace nth_failure {

/// One failing call, see tests/support/failing_calls.h.
struct Failure {
  std::string call;
  std::uint64_t at = 1;
  int error = 0;
  bool for_ever = false;

  /// Legal at any time and not a failure: an interrupted call, a shorter transfer than requested, a socket
  /// without data. The program must behave as without it.
  bool is_silent() const;
};
std::string describe(const Failure& failure);

/// Flaws in the end of a program that otherwise ends with `expected`: a crash, an undocumented code, or an
/// error that does not name its cause: the system's message, and the file, socket, interface, memory or
/// thread concerned.
std::vector<std::string> flaws_of_end(const Failure& failure, const support::CommandResult& result,
                                      int expected);

/// The program and its arguments, with the library that counts its calls into `counts` and lets one fail. Its
/// temporary files, including fault reports, go to the directory `tmp` next to `counts`. It is killed after
/// `patience_s`.
std::vector<std::string> with_failure(const std::filesystem::path& counts,
                                      const std::optional<Failure>& failure,
                                      const std::vector<std::string>& words, int patience_s = 20);

/// Zero for all if the program did not reach main().
support::CallCounts read_counts(const std::filesystem::path& counts);
std::uint64_t count_of(const support::CallCounts& counts, const std::string& call);

/// Each errno that fits each call of a run, once and from then on. Of many calls of one name the first, the
/// last and some between fail, or all of them with YOUBOT_NTH_FAILURE_ALL in the environment; calls that a
/// run repeats endlessly, such as poll(), are limited to `at_most`.
std::vector<Failure> failures_of(const support::CallCounts& counts, std::size_t some,
                                 std::size_t at_most = SIZE_MAX);

/// As many of them as a short test allows, evenly spread; all with YOUBOT_NTH_FAILURE_ALL.
std::vector<Failure> some_of(const std::vector<Failure>& all, std::size_t count);

/// Fails the test for each flaw. With YOUBOT_NTH_FAILURE_SHOW in the environment it also prints the program's
/// output.
void report(const Failure& failure, const support::CommandResult& result,
            const std::vector<std::string>& flaws);

}  // namespace nth_failure
