// Preloaded into a program: its n-th system call of a given name fails; see failing_calls.h.
#include "tests/support/failing_calls.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <climits>
#include <cstddef>
#include <cstdlib>
#include <string>
#include <string_view>

namespace {

using support::CallCounts;
using support::kFailingCalls;
using support::kShort;

template <typename Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

constexpr std::size_t index_of(std::string_view name) {
  for (std::size_t i = 0; i < kFailingCalls.size(); ++i)
    if (kFailingCalls[i] == name) return i;
  return kFailingCalls.size();  // no constant expression can use it
}

/// Set once, before main().
struct Plan {
  CallCounts* counts = nullptr;  // null: this is another program
  std::size_t call = kFailingCalls.size();
  std::uint64_t at = 0;
  int error = 0;
  bool for_ever = false;
} plan;
std::atomic<bool> armed{false};

bool this_is(const char* program) {
  char self[PATH_MAX];
  char wanted[PATH_MAX];
  const ssize_t size = readlink("/proc/self/exe", self, sizeof self - 1);
  if (size < 0 || realpath(program, wanted) == nullptr) return false;
  return std::string_view(self, static_cast<std::size_t>(size)) == wanted;
}

void read_plan() {
  const char* const program = std::getenv("YOUBOT_FAIL_PROGRAM");
  const char* const counts = std::getenv("YOUBOT_FAIL_COUNTS");
  if (program == nullptr || counts == nullptr || !this_is(program)) return;
  const int file = next<decltype(::open)>("open")(counts, O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (file < 0 || next<decltype(::ftruncate)>("ftruncate")(file, sizeof(CallCounts)) != 0) std::abort();
  void* const memory = next<decltype(::mmap)>("mmap")(nullptr, sizeof(CallCounts), PROT_READ | PROT_WRITE,
                                                      MAP_SHARED, file, 0);
  if (memory == MAP_FAILED) std::abort();
  (void)next<decltype(::close)>("close")(file);
  plan.counts = static_cast<CallCounts*>(memory);
  if (const char* const call = std::getenv("YOUBOT_FAIL_CALL")) {
    plan.call = index_of(call);
    if (plan.call == kFailingCalls.size()) std::abort();
    plan.at = std::strtoull(std::getenv("YOUBOT_FAIL_AT"), nullptr, 10);
    plan.error = std::atoi(std::getenv("YOUBOT_FAIL_ERRNO"));
    plan.for_ever = std::getenv("YOUBOT_FAIL_FOR_EVER") != nullptr;
  }
}

/// Counts a call. Its errno, or 0 when it has to go through.
int planned_error(std::size_t call) noexcept {
  if (!armed.load(std::memory_order_relaxed)) return 0;
  const std::uint64_t number =
      std::atomic_ref((*plan.counts)[call]).fetch_add(1, std::memory_order_relaxed) + 1;
  const bool meant = call == plan.call && (number == plan.at || (plan.for_ever && number > plan.at));
  return meant ? plan.error : 0;
}

int (*real_main)(int, char**, char**) = nullptr;

int armed_main(int count, char** arguments, char** environment) {
  armed.store(plan.counts != nullptr, std::memory_order_relaxed);
  return real_main(count, arguments, environment);
}

}  // namespace

// Each function here has the name of the call only for the linker: the system's headers declare the calls in
// their own ways. Variable arguments are passed on as the one that there may be: the ABI allows it.

using Main = int(int, char**, char**);
int starting(Main* main, int count, char** arguments, void (*init)(), void (*fini)(), void (*end)(),
             void* stack_end) __asm__("__libc_start_main");
int starting(Main* main, int count, char** arguments, void (*init)(), void (*fini)(), void (*end)(),
             void* stack_end) {
  read_plan();
  real_main = main;
  return next<decltype(starting)>("__libc_start_main")(armed_main, count, arguments, init, fini, end,
                                                       stack_end);
}

// A call that returns `failure` and sets errno. Some have a second name, for large files.
#define WRAP_AS(symbol, name, failure, Result, parameters, arguments) \
  Result failing_##symbol parameters __asm__(#symbol);                \
  Result failing_##symbol parameters {                                \
    static auto* const original = next<Result parameters>(#symbol);   \
    if (const int error = planned_error(index_of(name))) {            \
      errno = error;                                                  \
      return failure;                                                 \
    }                                                                 \
    return original arguments;                                        \
  }
#define WRAP(symbol, parameters, arguments) WRAP_AS(symbol, #symbol, -1, int, parameters, arguments)
#define WRAP_LARGE(symbol, parameters, arguments) \
  WRAP(symbol, parameters, arguments)             \
  WRAP_AS(symbol##64, #symbol, -1, int, parameters, arguments)

// Those return the error's number.
#define WRAP_NUMBER(symbol, parameters, arguments)                        \
  int failing_##symbol parameters __asm__(#symbol);                       \
  int failing_##symbol parameters {                                       \
    static auto* const original = next<int parameters>(#symbol);          \
    if (const int error = planned_error(index_of(#symbol))) return error; \
    return original arguments;                                            \
  }

// Those can also transfer less than they were asked for.
#define WRAP_TRANSFER(symbol, Buffer, can_fail)                                          \
  ssize_t failing_##symbol(int file, Buffer* buffer, std::size_t size) __asm__(#symbol); \
  ssize_t failing_##symbol(int file, Buffer* buffer, std::size_t size) {                 \
    static auto* const original = next<ssize_t(int, Buffer*, std::size_t)>(#symbol);     \
    const int error = can_fail ? planned_error(index_of(#symbol)) : 0;                   \
    if (error == 0) return original(file, buffer, size);                                 \
    if (error == kShort) return original(file, buffer, size > 1 ? size - 1 : size);      \
    errno = error;                                                                       \
    return -1;                                                                           \
  }

/// The counter that wakes a thread. Writing to one fails only when it is full, which takes 2^64 - 2 wake-ups.
bool is_eventfd(int file) noexcept {
  char target[sizeof "anon_inode:[eventfd]"];
  const ssize_t size = readlink(("/proc/self/fd/" + std::to_string(file)).c_str(), target, sizeof target);
  return size > 0 && std::string_view(target, static_cast<std::size_t>(size)) == "anon_inode:[eventfd]";
}

WRAP_TRANSFER(read, void, true)
WRAP_TRANSFER(write, const void, !is_eventfd(file))

/// Closes the descriptor anyway, as Linux does.
int failing_close(int file) __asm__("close");
int failing_close(int file) {
  static auto* const original = next<int(int)>("close");
  const int result = original(file);
  if (const int error = planned_error(index_of("close"))) {
    errno = error;
    return -1;
  }
  return result;
}

WRAP_LARGE(open, (const char* path, int flags, unsigned mode), (path, flags, mode))
WRAP_LARGE(openat, (int at, const char* path, int flags, unsigned mode), (at, path, flags, mode))
WRAP_AS(fopen, "fopen", nullptr, void*, (const char* path, const char* mode), (path, mode))
WRAP_AS(fopen64, "fopen", nullptr, void*, (const char* path, const char* mode), (path, mode))
WRAP_AS(opendir, "opendir", nullptr, void*, (const char* path), (path))
WRAP_LARGE(stat, (const char* path, void* status), (path, status))
WRAP_LARGE(lstat, (const char* path, void* status), (path, status))
WRAP_LARGE(fstat, (int file, void* status), (file, status))
WRAP_LARGE(statvfs, (const char* path, void* status), (path, status))
WRAP_LARGE(ftruncate, (int file, off_t size), (file, size))
WRAP_LARGE(mkstemp, (char* name), (name))
WRAP_LARGE(fcntl, (int file, int command, void* argument), (file, command, argument))
WRAP_AS(writev, "writev", -1, ssize_t, (int file, const void* parts, int count), (file, parts, count))
WRAP_AS(sendfile, "sendfile", -1, ssize_t, (int to, int from, off_t* offset, std::size_t size),
        (to, from, offset, size))
WRAP_AS(sendfile64, "sendfile", -1, ssize_t, (int to, int from, off_t* offset, std::size_t size),
        (to, from, offset, size))
WRAP(chmod, (const char* path, unsigned mode), (path, mode))
WRAP(fchmod, (int file, unsigned mode), (file, mode))
WRAP(fsync, (int file), (file))
WRAP(fdatasync, (int file), (file))
WRAP(flock, (int file, int operation), (file, operation))
WRAP(link, (const char* from, const char* to), (from, to))
WRAP(mkdir, (const char* path, unsigned mode), (path, mode))
WRAP(rename, (const char* from, const char* to), (from, to))
WRAP(rmdir, (const char* path), (path))
WRAP(unlink, (const char* path), (path))
WRAP(remove, (const char* path), (path))
WRAP(ioctl, (int file, unsigned long request, void* argument), (file, request, argument))
WRAP(pipe2, (int* ends, int flags), (ends, flags))
WRAP(eventfd, (unsigned start, int flags), (start, flags))
WRAP(timerfd_create, (int clock, int flags), (clock, flags))
WRAP(timerfd_settime, (int file, int flags, const void* time, void* old), (file, flags, time, old))

WRAP(socket, (int domain, int type, int protocol), (domain, type, protocol))
WRAP(bind, (int file, const void* address, unsigned size), (file, address, size))
WRAP(connect, (int file, const void* address, unsigned size), (file, address, size))
WRAP(listen, (int file, int backlog), (file, backlog))
WRAP(accept4, (int file, void* address, unsigned* size, int flags), (file, address, size, flags))
WRAP(getsockopt, (int file, int level, int option, void* value, unsigned* size),
     (file, level, option, value, size))
WRAP(setsockopt, (int file, int level, int option, const void* value, unsigned size),
     (file, level, option, value, size))
WRAP(getifaddrs, (void** list), (list))
WRAP_AS(send, "send", -1, ssize_t, (int file, const void* data, std::size_t size, int flags),
        (file, data, size, flags))
WRAP_AS(sendto, "sendto", -1, ssize_t,
        (int file, const void* data, std::size_t size, int flags, const void* address, unsigned length),
        (file, data, size, flags, address, length))
WRAP_AS(sendmsg, "sendmsg", -1, ssize_t, (int file, const void* message, int flags), (file, message, flags))
WRAP_AS(recv, "recv", -1, ssize_t, (int file, void* data, std::size_t size, int flags),
        (file, data, size, flags))
WRAP_AS(recvfrom, "recvfrom", -1, ssize_t,
        (int file, void* data, std::size_t size, int flags, void* address, unsigned* length),
        (file, data, size, flags, address, length))
WRAP_AS(recvmsg, "recvmsg", -1, ssize_t, (int file, void* message, int flags), (file, message, flags))

WRAP(poll, (void* files, unsigned long count, int timeout), (files, count, timeout))
WRAP(ppoll, (void* files, unsigned long count, const void* timeout, const void* signals),
     (files, count, timeout, signals))
WRAP(epoll_create1, (int flags), (flags))
WRAP(epoll_ctl, (int file, int operation, int other, void* event), (file, operation, other, event))
WRAP(epoll_wait, (int file, void* events, int count, int timeout), (file, events, count, timeout))
WRAP(nanosleep, (const void* time, void* left), (time, left))
WRAP_NUMBER(clock_nanosleep, (int clock, int flags, const void* time, void* left), (clock, flags, time, left))

WRAP(mlockall, (int flags), (flags))
WRAP_NUMBER(pthread_create, (void* thread, const void* attributes, void* (*start)(void*), void* argument),
            (thread, attributes, start, argument))
WRAP_NUMBER(pthread_setschedparam, (unsigned long thread, int policy, const void* parameters),
            (thread, policy, parameters))
WRAP_NUMBER(pthread_setaffinity_np, (unsigned long thread, std::size_t size, const void* cpus),
            (thread, size, cpus))
WRAP_AS(mmap, "mmap", MAP_FAILED, void*,
        (void* at, std::size_t size, int prot, int flags, int file, off_t from),
        (at, size, prot, flags, file, from))
WRAP_AS(mmap64, "mmap", MAP_FAILED, void*,
        (void* at, std::size_t size, int prot, int flags, int file, off_t from),
        (at, size, prot, flags, file, from))
