#include "apps/youbotd/check_parts.h"

#include <linux/capability.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <filesystem>
#include <system_error>
#include <thread>

namespace youbotd {
namespace {

using Mark = Finding::Mark;

std::string words(int error) { return std::generic_category().message(error); }

bool has_capability(unsigned capability) noexcept {
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  std::array<__user_cap_data_struct, _LINUX_CAPABILITY_U32S_3> data{};
  if (syscall(SYS_capget, &header, data.data()) != 0) return false;
  return (data[capability / 32].effective >> capability % 32 & 1U) != 0;
}

/// Result of `action` in its own thread.
template <typename Action>
int in_a_thread(Action action) {
  int result = 0;
  std::thread([&result, action] { result = action(); }).join();
  return result;
}

}  // namespace

std::string how_to_give_rights() {
  std::error_code unknown;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", unknown);
  return "sudo setcap cap_net_raw,cap_sys_nice,cap_ipc_lock+ep " +
         (unknown ? std::string("\"$(command -v youbotd)\"") : program.string());
}

Finding check_memory_lock(Mark refused) {
  if (mlockall(MCL_CURRENT) != 0) return {refused, "memory lock: " + words(errno), how_to_give_rights()};
  munlockall();
  rlimit limit{};
  getrlimit(RLIMIT_MEMLOCK, &limit);
  if (limit.rlim_cur == RLIM_INFINITY || has_capability(CAP_IPC_LOCK))
    return {Mark::kOk, "memory lock: allowed"};
  // The memory locked now is less than a run needs.
  return {Mark::kWarn,
          "memory lock: up to " + std::to_string(limit.rlim_cur >> 20U) + " MiB, which a run may exceed",
          how_to_give_rights()};
}

Finding check_priority(const std::string& who, int priority, Mark refused) {
  const int error = in_a_thread([priority] {
    const sched_param parameters{priority};
    return pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
  });
  const std::string wanted = "priority: SCHED_FIFO " + std::to_string(priority) + " for " + who;
  if (error != 0) return {refused, wanted + ": " + words(error), how_to_give_rights()};
  return {Mark::kOk, wanted};
}

Finding check_core(int cpu, Mark refused) {
  const int error = in_a_thread([cpu] {
    cpu_set_t cpus;
    CPU_ZERO(&cpus);
    CPU_SET(static_cast<unsigned>(cpu), &cpus);
    return pthread_setaffinity_np(pthread_self(), sizeof cpus, &cpus);
  });
  const std::string wanted = "core: " + std::to_string(cpu) + " for the cycle";
  if (error != 0)
    return {refused, wanted + ": " + words(error), "lscpu --online --extended; choose one as loop.cpu"};
  return {Mark::kOk, wanted};
}

}  // namespace youbotd
