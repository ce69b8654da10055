/// @file
/// Waiting for the kernel and for udev, which do their work when they come to it.
#pragma once
#include <chrono>
#include <thread>

namespace guest {

/// Looks again and again until `condition` holds. False when it does not for far longer than an emulated
/// processor on a busy machine needs: a failure, never a measure.
template <typename Condition>
bool wait_until(Condition&& condition) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

/// What `find` finds at last: an optional, empty when it never does.
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
