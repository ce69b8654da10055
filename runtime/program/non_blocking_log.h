/// @file
/// A log that never blocks its writer.
#pragma once
#include <spdlog/logger.h>

#include <cstddef>
#include <memory>

namespace runtime {

class NonBlockingSink;

/// While it lives, the default logger writes to standard error without ever waiting for it: a line for which
/// a full pipe, a stopped terminal or a hung journal has no room stays in a queue of this size, and is lost
/// when that is full. The number of lost lines is a line of the log, before the next one that fits. Any
/// thread may log; not in a cycle. The logger's flush() writes what there is room for: to be called now and
/// then, as a reader that is back is not noticed otherwise.
class NonBlockingLog {
 public:
  explicit NonBlockingLog(std::size_t queue_bytes = 65536);
  NonBlockingLog(const NonBlockingLog&) = delete;
  NonBlockingLog& operator=(const NonBlockingLog&) = delete;
  /// Waits no longer than half a second for what is left in the queue.
  ~NonBlockingLog();

 private:
  std::shared_ptr<spdlog::logger> former_;
  std::shared_ptr<NonBlockingSink> sink_;
};

}  // namespace runtime
