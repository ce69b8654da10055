/// @file
#pragma once
#include <cerrno>

namespace drivers {

/// Repeats a system call that a signal interrupted. Not for close(): Linux has closed the descriptor by then.
template <typename Call>
auto uninterrupted(Call call) noexcept {
  auto result = call();
  while (result < 0 && errno == EINTR) result = call();
  return result;
}

}  // namespace drivers
