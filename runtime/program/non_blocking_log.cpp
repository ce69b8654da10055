#include "runtime/program/non_blocking_log.h"

#include <fcntl.h>
#include <poll.h>
#include <spdlog/fmt/fmt.h>
#include <spdlog/sinks/base_sink.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <climits>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include "runtime/log.h"
#include "runtime/program/log_format.h"
#include "runtime/program/wording.h"

namespace runtime {
class NonBlockingSink final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  explicit NonBlockingSink(std::size_t queue_bytes) : queue_bytes_(queue_bytes) {}

  /// Writes as much as there is room for; true if nothing is left.
  bool write_all() {
    const std::lock_guard lock(mutex_);
    write();
    return queue_.empty();
  }

 private:
  /// Standard error, written without waiting. O_NONBLOCK on it would also affect other processes that write
  /// there.
  class StandardError {
   public:
    StandardError() {
      struct stat status {};
      if (::fstat(STDERR_FILENO, &status) != 0) return;
      is_socket_ = S_ISSOCK(status.st_mode);
      if (S_ISFIFO(status.st_mode) || S_ISCHR(status.st_mode))
        own_ = ::open("/proc/self/fd/2", O_WRONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
    }
    StandardError(const StandardError&) = delete;
    StandardError& operator=(const StandardError&) = delete;
    ~StandardError() {
      if (own_ >= 0) ::close(own_);
    }
    ssize_t write(const std::string& text) const {
      if (is_socket_) return ::send(STDERR_FILENO, text.data(), text.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
      if (own_ >= 0) return ::write(own_, text.data(), text.size());
      // It may have been opened by another user: if poll() reports it writable, a pipe takes PIPE_BUF bytes.
      pollfd error{STDERR_FILENO, POLLOUT, 0};
      if (poll(&error, 1, 0) > 0)
        return ::write(STDERR_FILENO, text.data(), std::min<std::size_t>(text.size(), PIPE_BUF));
      errno = EAGAIN;
      return -1;
    }

   private:
    bool is_socket_ = false;
    int own_ = -1;
  };

  void sink_it_(const spdlog::details::log_msg& message) override {
    write();
    spdlog::memory_buf_t line;
    formatter_->format(message, line);
    std::string text(line.data(), line.size());
    if (lost_ > 0)
      text.insert(0,
                  fmt::format("{}: warning: {} of the log lost, because standard error did not take them\n",
                              message.logger_name, count_text(lost_, "line")));
    if (queue_.size() + text.size() > queue_bytes_) {
      ++lost_;
      return;
    }
    queue_ += text;
    lost_ = 0;
    write();
  }
  void flush_() override { write(); }

  void write() {
    while (!queue_.empty()) {
      const ssize_t count = error_.write(queue_);
      if (count > 0) {
        queue_.erase(0, static_cast<std::size_t>(count));
      } else if (errno != EINTR) {
        if (errno == EAGAIN) return;
        // The reader is gone for good, or the disk is full.
        lost_ += std::count(queue_.begin(), queue_.end(), '\n');
        queue_.clear();
      }
    }
  }

  const std::size_t queue_bytes_;
  const StandardError error_;
  std::string queue_;
  long long lost_ = 0;
};

NonBlockingLog::NonBlockingLog(std::size_t queue_bytes)
    : former_(spdlog::default_logger()), sink_(std::make_shared<NonBlockingSink>(queue_bytes)) {
  auto logger = std::make_shared<spdlog::logger>(former_->name(), sink_);
  logger->set_level(former_->level());
  logger->set_formatter(log_format());
  spdlog::set_default_logger(std::move(logger));
}

NonBlockingLog::~NonBlockingLog() {
  for (int left = 50; !sink_->write_all() && left > 0; --left)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  spdlog::set_default_logger(former_);
}

}  // namespace runtime
