/// @file
/// A thread, or an error that says which one is missing.
#pragma once
#include <string>
#include <system_error>
#include <thread>
#include <utility>

#include "hal/setup_error.h"

namespace runtime {

/// Set-up. `what` is the thread's work, for the message. @throws hal::SetupError when the system has no
/// thread to give.
template <typename Body>
std::jthread start_thread(const std::string& what, Body&& body) {
  try {
    return std::jthread(std::forward<Body>(body));
  } catch (const std::system_error& error) {
    throw hal::SetupError("thread for " + what, "start: " + error.code().message(),
                          "end other programs, or allow more processes (ulimit -u, TasksMax of the service)");
  }
}

}  // namespace runtime
