/// @file
/// Independent tasks on all cores.
#pragma once
#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

namespace identification::gap {

/// Calls work(i) for each i below `count`, each once, in any order; its outputs must not be shared. The
/// result is that of a loop, on as many threads as the system provides. @throws the first exception of
/// `work`, once all threads have ended.
template <class Work>
void in_parallel(std::size_t count, const Work& work) {
  std::atomic<std::size_t> next{0};
  std::exception_ptr failure;
  std::mutex failing;
  const auto run = [&] {
    try {
      for (std::size_t i = next++; i < count; i = next++) work(i);
    } catch (...) {
      const std::lock_guard lock(failing);
      if (!failure) failure = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> others;
    const std::size_t cores = std::max(1U, std::thread::hardware_concurrency());
    try {
      for (std::size_t i = 1; i < std::min(cores, count); ++i) others.emplace_back(run);
    } catch (const std::system_error&) {
      // The threads that started, and this one, do all the work.
    }
    run();
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace identification::gap
