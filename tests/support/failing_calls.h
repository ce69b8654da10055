/// @file
/// Common definitions of failing_calls.cpp, a library to preload, and the tests that use it: the calls that
/// can fail and the file with their counts.
///
/// The environment controls the library:
///   YOUBOT_FAIL_PROGRAM  path of the program concerned; in all others the library does nothing
///   YOUBOT_FAIL_COUNTS   a file for the counts, one std::uint64_t for each of kFailingCalls; mapped,
///                        so that they survive any end of the program
///   YOUBOT_FAIL_CALL     one of kFailingCalls; without it calls are only counted
///   YOUBOT_FAIL_AT       fails at the n-th call, from 1 on
///   YOUBOT_FAIL_ERRNO    with this errno; kShort makes a read or write transfer one byte less than requested
///   YOUBOT_FAIL_FOR_EVER if set, every later call of that name fails, too
///
/// Counts calls from main() on, of the program and the libraries it loads, in all its threads. Not covered:
/// internal calls of the C library (stdio's writes, malloc's mmap, a new thread's stack), the dynamic loader,
/// and calls whose failures a program cannot meet (clock_gettime, a write to an eventfd).
#pragma once
#include <array>
#include <cstdint>
#include <string_view>

namespace support {

inline constexpr int kShort = -1;

inline constexpr std::array<std::string_view, 58> kFailingCalls{
    "accept4",
    "bind",
    "chmod",
    "clock_nanosleep",
    "close",
    "connect",
    "epoll_create1",
    "epoll_ctl",
    "epoll_wait",
    "eventfd",
    "fchmod",
    "fcntl",
    "fdatasync",
    "flock",
    "fopen",
    "fstat",
    "fsync",
    "ftruncate",
    "getifaddrs",
    "getsockopt",
    "ioctl",
    "link",
    "listen",
    "lstat",
    "mkdir",
    "mkstemp",
    "mlockall",
    "mmap",
    "nanosleep",
    "open",
    "openat",
    "opendir",
    "pipe2",
    "poll",
    "ppoll",
    "pthread_create",
    "pthread_setaffinity_np",
    "pthread_setschedparam",
    "read",
    "recv",
    "recvfrom",
    "recvmsg",
    "remove",
    "rename",
    "rmdir",
    "send",
    "sendfile",
    "sendmsg",
    "sendto",
    "setsockopt",
    "socket",
    "stat",
    "statvfs",
    "timerfd_create",
    "timerfd_settime",
    "unlink",
    "write",
    "writev",
};

using CallCounts = std::array<std::uint64_t, kFailingCalls.size()>;

}  // namespace support
