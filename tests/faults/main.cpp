// fault_campaign: the whole daemon under random faults in virtual time; `./dev faults` runs it.
#include <malloc.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "runtime/log.h"
#include "runtime/program/build_info.h"
#include "runtime/program/run_app.h"
#include "tests/faults/campaign.h"
#include "tests/support/temporary_directory.h"

namespace {

using faults::Outcome;
using faults::Script;
using std::chrono::milliseconds;

struct Arguments {
  std::uint64_t seed = 1;
  std::uint64_t count = 100;
  /// Two for each processor: a script sometimes waits for the writer of its recording.
  unsigned jobs = 2 * std::max(1U, std::thread::hardware_concurrency());
  std::string script;
  std::string kind;
  bool each_kind = false;
  bool verbose = false;
  bool no_shrink = false;
};

struct Verdict {
  bool crashed = false;
  std::uint64_t digest = 0;
  double emulated_s = 0.0;
  long last_torque_ms = -1;  // -1: it went on
  double travel_m = 0.0;
  std::string fault{};
  std::string violations{};  // a line each
};

std::string one_line(std::string text) {
  std::ranges::replace(text, '\n', ' ');
  std::ranges::replace(text, '\t', ' ');
  return text;
}

void report(std::FILE* pipe, std::size_t number, const Outcome& outcome) {
  std::fprintf(pipe, "%zu\t%llu\t%.3f\t%ld\t%.3f\t%s\t", number,
               static_cast<unsigned long long>(outcome.digest),
               std::chrono::duration<double>(outcome.emulated).count(),
               outcome.last_torque_after ? static_cast<long>(outcome.last_torque_after->count()) : -1L,
               outcome.travel_m, one_line(outcome.fault).c_str());
  for (const std::string& violation : outcome.violations)
    std::fprintf(pipe, "%s | ", one_line(violation).c_str());
  std::fprintf(pipe, "\n");
  std::fflush(pipe);
}

/// None if the line is not a report.
std::optional<Verdict> read_verdict(const std::string& line) {
  if (std::ranges::count(line, '\t') != 6) return std::nullopt;
  std::vector<std::string> fields;
  for (std::size_t begin = 0; fields.size() < 7;) {
    const std::size_t end = std::min(line.find('\t', begin), line.size());
    fields.push_back(line.substr(begin, end - begin));
    begin = std::min(end + 1, line.size());
  }
  Verdict verdict{.fault = fields[5], .violations = fields[6]};
  try {
    verdict.digest = std::stoull(fields[1]);
    verdict.emulated_s = std::stod(fields[2]);
    verdict.last_torque_ms = std::stol(fields[3]);
    verdict.travel_m = std::stod(fields[4]);
  } catch (const std::logic_error&) {
    return std::nullopt;
  }
  while (!verdict.violations.empty() && verdict.violations.back() == ' ') verdict.violations.pop_back();
  return verdict;
}

/// A script that takes longer hangs, also on a busy machine under a sanitizer.
constexpr unsigned kLongest_s = 300;

void require(bool condition, const char* call) {
  if (!condition) throw std::system_error(errno, std::generic_category(), call);
}

Outcome outcome_of(const Script& script) {
  try {
    return faults::run(script);
  } catch (const std::exception& error) {
    return {.violations = {std::string("an exception leaves the daemon: ") + error.what()}};
  }
}

/// Runs each script in one of `jobs` processes, so that a crash is an outcome as well: a script that ends its
/// process is the one after the last report, and the others of that process go on in a new one. One thread
/// forks them all: a child that another thread's lock was copied into waits for it forever, and a sanitizer's
/// memory allocator has such locks.
class Pool {
 public:
  explicit Pool(const std::vector<Script>& scripts) : scripts_(scripts), verdicts_(scripts.size()) {}

  std::vector<Verdict> run(unsigned jobs) {
    stride_ = jobs;
    for (std::size_t job = 0; job < std::min<std::size_t>(jobs, scripts_.size()); ++job) start(job);
    while (!children_.empty()) {
      std::vector<pollfd> reports;
      for (const Child& child : children_)
        reports.push_back({.fd = child.reports, .events = POLLIN, .revents = 0});
      require(poll(reports.data(), reports.size(), -1) > 0 || errno == EINTR, "poll");
      for (std::size_t i = reports.size(); i-- > 0;)
        if (reports[i].revents != 0 && !read_reports(children_[i])) finish(i);
    }
    return std::move(verdicts_);
  }

 private:
  struct Child {
    pid_t process = -1;
    int reports = -1;      // reading end
    std::size_t next = 0;  // the first script that is not judged yet
    std::string unread;    // start of an incomplete line
    bool malformed = false;
  };

  void start(std::size_t first) {
    std::array<int, 2> ends{};
    require(pipe(ends.data()) == 0, "pipe");
    const pid_t process = fork();
    require(process >= 0, "fork");
    if (process == 0) {
      std::FILE* out = fdopen(ends[1], "w");
      for (std::size_t number = first; number < scripts_.size(); number += stride_) {
        alarm(kLongest_s);
        report(out, number, outcome_of(scripts_[number]));
      }
      std::_Exit(0);
    }
    close(ends[1]);
    children_.push_back(
        {.process = process, .reports = ends[0], .next = first, .unread = {}, .malformed = false});
  }

  /// False: the process ended.
  bool read_reports(Child& child) {
    std::array<char, 4096> text{};
    const ssize_t size = read(child.reports, text.data(), text.size());
    require(size >= 0 || errno == EINTR, "read");
    if (size == 0) return false;
    if (size > 0) child.unread.append(text.data(), static_cast<std::size_t>(size));
    for (std::size_t end = 0; (end = child.unread.find('\n')) != std::string::npos;) {
      const std::optional<Verdict> verdict = read_verdict(child.unread.substr(0, end));
      if (!verdict) {
        child.malformed = true;
        kill(child.process, SIGKILL);
        return false;
      }
      verdicts_[child.next] = *verdict;
      child.next += stride_;
      child.unread.erase(0, end + 1);
    }
    return true;
  }

  void finish(std::size_t index) {
    const Child child = std::move(children_[index]);
    children_.erase(children_.begin() + static_cast<std::ptrdiff_t>(index));
    close(child.reports);
    int status = 0;
    require(waitpid(child.process, &status, 0) == child.process, "waitpid");
    if (child.next >= scripts_.size()) return;
    verdicts_[child.next].crashed = true;
    verdicts_[child.next].violations =
        child.malformed       ? "sent a malformed report: " + child.unread.substr(0, child.unread.find('\n'))
        : WIFSIGNALED(status) ? std::string("ended by signal ") + strsignal(WTERMSIG(status))
                              : "ended with exit code " + std::to_string(WEXITSTATUS(status));
    if (child.next + stride_ < scripts_.size()) start(child.next + stride_);
  }

  const std::vector<Script>& scripts_;
  std::vector<Verdict> verdicts_;
  std::size_t stride_ = 1;
  std::vector<Child> children_;
};

/// Of the processes that ran scripts until now: it does not depend on what else the machine does.
double processor_s() {
  rusage used{};
  require(getrusage(RUSAGE_CHILDREN, &used) == 0, "getrusage");
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(used.ru_utime) + seconds(used.ru_stime);
}

Verdict judge(const Script& script) {
  const std::vector<Script> one{script};
  return Pool(one).run(1).front();
}

bool failed(const Verdict& verdict) { return verdict.crashed || !verdict.violations.empty(); }

void print_failure(const Script& script, const Verdict& verdict, bool shrink) {
  std::printf("FAILED %s\n  %s\n", faults::text(script).c_str(), verdict.violations.c_str());
  if (!shrink) return;
  const Script least = faults::shrunk(script, [](const Script& s) { return failed(judge(s)); });
  std::printf("  again, with the least that fails: ./dev faults --script '%s'\n  %s\n",
              faults::text(least).c_str(), judge(least).violations.c_str());
  std::fflush(stdout);
}

/// The reason only: without the time before it, the joint, and the text after a semicolon.
std::string without_numbers(const std::string& fault) {
  const std::size_t cycle = fault.find("): ");
  const std::size_t time = fault.find(": ");
  std::string reason = cycle != fault.npos  ? fault.substr(cycle + 3)
                       : time != fault.npos ? fault.substr(time + 2)
                                            : fault;
  reason = reason.substr(0, reason.find(';'));
  std::erase_if(reason, [](char c) { return c >= '0' && c <= '9'; });
  return reason.substr(0, 90);
}

/// A line for each kind: what one fault of it alone leads to.
int run_each_kind(const Arguments& arguments) {
  std::vector<Script> scripts;
  for (const faults::Kind& kind : faults::kinds()) {
    if (!arguments.kind.empty() && kind.name != arguments.kind) continue;
    for (const auto machine : {faults::Machine::kBase, faults::Machine::kManipulator}) {
      const bool base = machine == faults::Machine::kBase;
      if (kind.on != faults::Kind::On::kAnyMachine && (kind.on == faults::Kind::On::kBase) != base) continue;
      for (std::uint64_t i = 0; i < (base ? arguments.count : (arguments.count + 3) / 4); ++i)
        scripts.push_back(faults::script_of(kind, machine, arguments.seed + i));
    }
  }
  const std::vector<Verdict> verdicts = Pool(scripts).run(arguments.jobs);
  std::printf("%-36s %4s %6s %5s %5s  %-19s %6s  %s\n", "kind", "runs", "unsafe", "ended", "named",
              "last torque, ms", "way, m", "most frequent reason");
  bool good = true;
  for (const faults::Kind& kind : faults::kinds()) {
    int runs = 0;
    int unsafe = 0;
    std::vector<long> times;
    std::map<std::string, int> reasons;
    double travel_m = 0.0;
    int named = 0;
    for (std::size_t i = 0; i < scripts.size(); ++i) {
      if (scripts[i].events[0].kind != &kind) continue;
      ++runs;
      unsafe += failed(verdicts[i]) ? 1 : 0;
      if (verdicts[i].last_torque_ms < 0) continue;
      times.push_back(verdicts[i].last_torque_ms);
      travel_m = std::max(travel_m, verdicts[i].travel_m);
      const std::string& fault = verdicts[i].fault;
      const std::size_t place = scripts[i].events[0].place;
      const std::string joint =
          place < 4 ? "wheel-" + std::to_string(place + 1) : "arm-" + std::to_string(place - 3);
      named += fault.find(joint + ":") != fault.npos || fault.find(joint + " ") != fault.npos ? 1 : 0;
      if (!fault.empty()) ++reasons[without_numbers(fault)];
    }
    if (runs == 0) continue;
    std::ranges::sort(times);
    std::string span = times.empty()
                           ? "-"
                           : std::to_string(times[times.size() / 2]) + " (" + std::to_string(times.front()) +
                                 " to " + std::to_string(times.back()) + ")";
    std::string reason;
    int most = 0;
    for (const auto& [text, count] : reasons)
      if (count > most) {
        most = count;
        reason = std::to_string(count) + "x " + text;
      }
    if (reasons.size() > 1) reason += " (and " + std::to_string(reasons.size() - 1) + " others)";
    const std::string right =
        kind.where == faults::Kind::Where::kJoint && !times.empty() ? std::to_string(named) : "-";
    std::printf("%-36s %4d %6d %5zu %5s  %-19s %6.2f  %s\n", std::string(kind.name).c_str(), runs, unsafe,
                times.size(), right.c_str(), span.c_str(), travel_m, reason.c_str());
    good = good && unsafe == 0;
  }
  for (std::size_t i = 0; i < scripts.size(); ++i)
    if (failed(verdicts[i])) print_failure(scripts[i], verdicts[i], false);
  return good ? 0 : 1;
}

int run_campaign(const Arguments& arguments) {
  std::vector<Script> scripts;
  if (!arguments.script.empty())
    scripts.push_back(faults::parsed_script(arguments.script));
  else
    for (std::uint64_t i = 0; i < arguments.count; ++i)
      scripts.push_back(faults::drawn_script(arguments.seed + i));
  const auto begin = std::chrono::steady_clock::now();
  const std::vector<Verdict> verdicts = Pool(scripts).run(arguments.jobs);
  const double took_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const double used_s = processor_s();
  double emulated_s = 0.0;
  std::uint64_t digest = 0;
  std::size_t failures = 0;
  for (std::size_t i = 0; i < scripts.size(); ++i) {
    emulated_s += verdicts[i].emulated_s;
    digest = digest * 31 + verdicts[i].digest;
    if (!failed(verdicts[i])) continue;
    ++failures;
    // Shrinking takes many runs: the first ones are enough to work on.
    print_failure(scripts[i], verdicts[i], !arguments.no_shrink && failures <= 5);
  }
  std::printf(
      "%s: seeds from %llu: %zu scripts of %zu kinds of fault, %zu failed; %.0f s of emulated time in "
      "%.1f s (%.0f times real time on %u processes) and %.1f s of processor time (%.0f times); "
      "digest %016llx\n",
      runtime::build_version(), static_cast<unsigned long long>(arguments.seed), scripts.size(),
      faults::kinds().size(), failures, emulated_s, took_s, emulated_s / took_s, arguments.jobs, used_s,
      emulated_s / used_s, static_cast<unsigned long long>(digest));
  return failures == 0 ? 0 : 1;
}

int run(const Arguments& arguments) {
  if (!arguments.verbose) spdlog::set_level(spdlog::level::off);
  if (!arguments.kind.empty()) (void)faults::kind_of(arguments.kind);
  // In memory where the system has a place for it: waiting for a disk is no part of a script.
  if (access("/dev/shm", W_OK) == 0) require(setenv("TMPDIR", "/dev/shm", 0) == 0, "setenv");
  // Fault reports go where temporary files live: not among the user's own.
  const support::TemporaryDirectory temporary;
  require(setenv("TMPDIR", temporary.path().c_str(), 1) == 0, "setenv");
  // What one daemon gives back the next one takes: rings of megabytes, which else are mapped and cleared
  // again.
  mallopt(M_MMAP_THRESHOLD, 1 << 30);
  mallopt(M_TRIM_THRESHOLD, 1 << 30);
  // The limit on files is one of the faults; a write beyond it fails with EFBIG.
  std::signal(SIGXFSZ, SIG_IGN);
  return arguments.each_kind ? run_each_kind(arguments) : run_campaign(arguments);
}

}  // namespace

// NOLINTNEXTLINE(bugprone-exception-escape): out of memory before the first message may end the process.
int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app(
      "Runs daemon, bus, boards, robot, haptic device and clients in one process and virtual time, lets "
      "random faults "
      "come and go, and judges what boards and mechanics do.",
      "fault_campaign");
  app.add_option("--seed", arguments.seed, "of the first script; the others follow")->capture_default_str();
  app.add_option("--count", arguments.count, "scripts, or runs of each kind")
      ->check(CLI::Range(1, 10'000'000))
      ->capture_default_str();
  app.add_option("--jobs", arguments.jobs, "processes")->check(CLI::Range(1, 256))->capture_default_str();
  CLI::Option* each = app.add_flag("--each-kind", arguments.each_kind,
                                   "each kind of fault alone, and a table of what it leads to");
  app.add_option("--script", arguments.script, "one script, as a failure prints it")->excludes(each);
  app.add_option("--kind", arguments.kind, "only this one")->needs(each);
  app.add_flag("--no-shrink", arguments.no_shrink, "print failing scripts as they were drawn");
  app.add_flag("--verbose", arguments.verbose, "with the daemon's log");
  return runtime::run_app(app, argc, argv, [&] { return run(arguments); });
}
