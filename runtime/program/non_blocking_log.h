/// @file
/// A log that never blocks the thread that logs.
#pragma once
#include <spdlog/logger.h>

#include <cstddef>
#include <memory>

namespace runtime {

class NonBlockingSink;

/// While it exists, the default logger writes to standard error without ever waiting: if a full pipe, a
/// stopped terminal or a hung journal has no room for a line, the line stays in a queue of this size, and is
/// lost if the queue is full. The number of lost lines is logged before the next line that fits. Any thread
/// may log; not in a cycle. The logger's flush() writes what there is room for: call it regularly, because
/// the return of a reader is not noticed otherwise.
class NonBlockingLog {
 public:
  explicit NonBlockingLog(std::size_t queue_bytes = 65536);
  NonBlockingLog(const NonBlockingLog&) = delete;
  NonBlockingLog& operator=(const NonBlockingLog&) = delete;
  /// Waits at most half a second to write the rest of the queue.
  ~NonBlockingLog();

 private:
  std::shared_ptr<spdlog::logger> former_;
  std::shared_ptr<NonBlockingSink> sink_;
};

}  // namespace runtime
