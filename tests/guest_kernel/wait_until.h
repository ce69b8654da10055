/// @file
/// Waits for the kernel and for udev, which work asynchronously.
#pragma once
#include <chrono>
#include <thread>

namespace guest {

/// Polls until `condition` holds. False if it does not for far longer than an emulated processor on a busy
/// machine needs: a failure, never a measurement.
template <typename Condition>
bool wait_until(Condition&& condition) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

/// The final result of `find`: an optional, empty if it never finds anything.
template <typename Find>
auto wait_for(Find&& find) {
  auto found = find();
  wait_until([&] {
    found = find();
    return found.has_value();
  });
  return found;
}

}  // namespace guest
