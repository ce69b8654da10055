#include "runtime/real_time.h"

#include <malloc.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>

#include <array>
#include <cerrno>
#include <cstring>

namespace runtime {
namespace {

constexpr std::size_t kStack_bytes = 256 * 1024;
constexpr std::size_t kPage_bytes = 4096;

/// The cycle must not be the first to touch its stack pages.
void touch_stack() noexcept {
  std::array<volatile char, kStack_bytes> stack;
  for (std::size_t i = 0; i < stack.size(); i += kPage_bytes) stack[i] = 0;
}

std::string refused(const char* what, int error, const char* remedy) {
  return std::string(what) + " refused: " + std::strerror(error) + "; " + remedy;
}

}  // namespace

RealTimeThread::RealTimeThread() {
  pthread_getschedparam(pthread_self(), &policy_, &parameters_);
  pthread_getaffinity_np(pthread_self(), sizeof cpus_, &cpus_);
}

RealTimeThread::~RealTimeThread() {
  pthread_setschedparam(pthread_self(), policy_, &parameters_);
  pthread_setaffinity_np(pthread_self(), sizeof cpus_, &cpus_);
}

std::vector<std::string> RealTimeThread::enter(const RealTimeConfig& config) {
  std::vector<std::string> problems;
  // Freed memory stays with the process: returning it and allocating again would fault.
  mallopt(M_TRIM_THRESHOLD, -1);
  mallopt(M_MMAP_MAX, 0);
  if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0)
    problems.push_back(
        refused("locking memory", errno,
                "raise 'memlock' for the user in /etc/security/limits.conf or give CAP_IPC_LOCK"));
  touch_stack();

  if (config.cpu) {
    cpu_set_t cpus;
    CPU_ZERO(&cpus);
    CPU_SET(static_cast<unsigned>(*config.cpu), &cpus);
    if (const int error = pthread_setaffinity_np(pthread_self(), sizeof cpus, &cpus))
      problems.push_back(refused("pinning to the core", error, "choose a core that exists as 'cpu'"));
  }
  const sched_param parameters{config.priority};
  if (const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters))
    problems.push_back(
        refused("real-time scheduling (SCHED_FIFO)", error,
                "raise 'rtprio' for the user in /etc/security/limits.conf or give CAP_SYS_NICE"));
  return problems;
}

Disturbances Disturbances::of_this_thread() noexcept {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return {usage.ru_minflt, usage.ru_majflt, usage.ru_nvcsw, usage.ru_nivcsw};
}

Disturbances Disturbances::since(const Disturbances& earlier) const noexcept {
  return {minor_faults - earlier.minor_faults, major_faults - earlier.major_faults,
          voluntary_switches - earlier.voluntary_switches,
          involuntary_switches - earlier.involuntary_switches};
}

}  // namespace runtime
