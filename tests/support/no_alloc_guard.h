/// @file
/// Proves that a scope neither allocates nor locks. Link into test binaries only.
#pragma once

namespace support {

/// Counts calls of malloc and related functions, free, and pthread_mutex_lock by this thread during the
/// lifetime of a guard (C++ new, containers, strings and std::mutex all end there). The interposed functions
/// of no_alloc_guard.cpp replace libc's for the whole binary; under a sanitizer, which has its own, the guard
/// counts nothing and kActive is false.
class NoAllocGuard {
 public:
#ifdef YOUBOT_SANITIZED
  static constexpr bool kActive = false;
#else
  static constexpr bool kActive = true;
#endif
  NoAllocGuard() noexcept;
  ~NoAllocGuard();
  NoAllocGuard(const NoAllocGuard&) = delete;
  NoAllocGuard& operator=(const NoAllocGuard&) = delete;

  /// Since construction.
  long violations() const noexcept;
};

}  // namespace support
