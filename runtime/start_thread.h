/// @file
/// Starts a thread, or throws an error that names it.
#pragma once
#include <string>
#include <system_error>
#include <thread>
#include <utility>

#include "hal/setup_error.h"

namespace runtime {

/// Set-up. `what` is the thread's work, for the message. @throws hal::SetupError if the system cannot create
/// a thread.
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
