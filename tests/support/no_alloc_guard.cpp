#include "tests/support/no_alloc_guard.h"

#include <dlfcn.h>
#include <pthread.h>

#include <cerrno>
#include <cstddef>

namespace {

thread_local int guards = 0;
thread_local long count = 0;

#ifndef YOUBOT_SANITIZED
void note() noexcept {
  if (guards > 0) ++count;
}
#endif

}  // namespace

namespace support {

NoAllocGuard::NoAllocGuard() noexcept {
  ++guards;
  count = 0;
}
NoAllocGuard::~NoAllocGuard() { --guards; }
long NoAllocGuard::violations() const noexcept { return count; }

}  // namespace support

#ifndef YOUBOT_SANITIZED
// glibc keeps its own allocator reachable under these names for interposers like this one.
extern "C" {
// NOLINTBEGIN(bugprone-reserved-identifier,readability-identifier-naming)
void* __libc_malloc(std::size_t);
void __libc_free(void*);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
// NOLINTEND(bugprone-reserved-identifier,readability-identifier-naming)

void* malloc(std::size_t size) {
  note();
  return __libc_malloc(size);
}
void free(void* block) {
  if (block != nullptr) note();
  __libc_free(block);
}
void* calloc(std::size_t members, std::size_t size) {
  note();
  return __libc_calloc(members, size);
}
void* realloc(void* block, std::size_t size) {
  note();
  return __libc_realloc(block, size);
}
void* memalign(std::size_t alignment, std::size_t size) {
  note();
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  note();
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** block, std::size_t alignment, std::size_t size) {
  note();
  *block = __libc_memalign(alignment, size);
  return *block == nullptr ? ENOMEM : 0;
}

int pthread_mutex_lock(pthread_mutex_t* mutex) {
  note();
  using Lock = int (*)(pthread_mutex_t*);
  static const Lock next = reinterpret_cast<Lock>(dlsym(RTLD_NEXT, "pthread_mutex_lock"));
  return next(mutex);
}
}
#endif
