/// @file
/// Passes records from the cycle to a writer thread.
#pragma once
#include <pthread.h>
#include <sched.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <mutex>
#include <new>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "runtime/spsc_ring.h"
#include "runtime/start_thread.h"

namespace runtime {

struct RecorderStatistics {
  std::uint64_t pushed = 0;         ///< records accepted for writing
  std::uint64_t dropped = 0;        ///< records rejected: ring full, or pushed after stop()
  std::uint64_t sink_failures = 0;  ///< exceptions from the sink; each cost one record or flush
};

/// A ring buffer and the thread that empties it into a sink.
///
///     RecordingFile file(...);  // outlives the recorder, whose thread uses it
///     Recorder<CycleRecord> recorder(
///         8192, [&](const CycleRecord& r) { file.append_row(to_row(r)); }, [&] { file.flush(); });
///     ... recorder.push(record), once per cycle ...
///     recorder.stop();
///     file.close();
///
/// push() never wakes the writer, because that is a system call; the writer polls every kPollInterval. Choose
/// the capacity for the longest stall of the disk: 8192 records are 8 s at 1 kHz.
template <typename Record>
class Recorder {
 public:
  static constexpr std::chrono::milliseconds kPollInterval{5};
  /// With the time a disk takes, well within the 0.1 s that a killed program may lose
  /// (apps/youbotd/README.md).
  static constexpr std::chrono::milliseconds kFlushInterval{50};

  /// Setup: starts the writer thread. `write` gets each record in order; `flush` follows about every
  /// kFlushInterval and after the last record. Both run on the writer thread only and may throw: the
  /// exception is caught and counted. The writer is SCHED_OTHER whatever the caller is, but it inherits the
  /// caller's CPU affinity: pin the cycle to its core after this.
  /// @throws std::invalid_argument for a capacity SpscRing rejects or an empty function; hal::SetupError if
  /// the thread cannot be started or given normal priority.
  Recorder(std::size_t capacity, std::function<void(const Record&)> write, std::function<void()> flush)
      : ring_(capacity), write_(std::move(write)), flush_(std::move(flush)) {
    if (!write_ || !flush_) throw std::invalid_argument("Recorder: write and flush must be given");
    writer_ = start_thread("the recording", [this]() noexcept { run(); });
    // A thread starts with its creator's policy, and a SCHED_FIFO writer would compete with the cycle.
    const sched_param normal{};
    if (const int error = pthread_setschedparam(writer_.native_handle(), SCHED_OTHER, &normal)) {
      stop();
      throw hal::SetupError("thread for the recording",
                            "take normal priority: " + std::generic_category().message(error),
                            "start this program with less priority");
    }
  }
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;
  ~Recorder() { stop(); }

  /// Cycle, one thread: wait-free, no allocation, lock or system call. False if the record was dropped, which
  /// is counted.
  bool push(const Record& record) noexcept {
    const bool taken = !stop_requested_.load(std::memory_order_relaxed) && ring_.push(record);
    count_one(taken ? pushed_ : dropped_);
    return taken;
  }

  /// Not for a real-time cycle: waits, without a time limit, until push() has room. For loops in virtual
  /// time, which are faster than any disk.
  void wait_for_room() const noexcept {
    while (ring_.full()) std::this_thread::sleep_for(kPollInterval / 5);
  }

  /// Writes everything pushed so far, flushes and joins; blocks as long as the sink needs. Call after the
  /// last push() has returned, from the owner's thread and never from the sink. Further calls do nothing.
  void stop() noexcept {
    if (!writer_.joinable()) return;
    {
      const std::scoped_lock lock(mutex_);
      stop_requested_.store(true, std::memory_order_relaxed);
    }
    stop_signal_.notify_one();
    writer_.join();
  }

  /// Any thread, any time. Each count is exact, but they are read one after the other.
  RecorderStatistics statistics() const noexcept {
    return {.pushed = pushed_.load(std::memory_order_relaxed),
            .dropped = dropped_.load(std::memory_order_relaxed),
            .sink_failures = sink_failures_.load(std::memory_order_relaxed)};
  }

  /// Texts on what was lost; empty if nothing was. Not for the cycle.
  std::vector<std::string> problems() const {
    std::vector<std::string> problems;
    if (const auto dropped = statistics().dropped; dropped > 0)
      problems.push_back("the disk was too slow: " + std::to_string(dropped) + " cycles dropped");
    if (std::string failure = first_sink_failure(); !failure.empty()) problems.push_back(std::move(failure));
    return problems;
  }

  /// Message of the first exception from the sink; empty if there was none. Any thread except the cycle's: it
  /// locks and allocates.
  std::string first_sink_failure() const {
    const std::scoped_lock lock(mutex_);
    return first_sink_failure_;
  }

 private:
  /// Each counter has one writing thread, so it needs no locked instruction.
  static void count_one(std::atomic<std::uint64_t>& counter) noexcept {
    counter.store(counter.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }

  void run() noexcept {
    auto flush_due = std::chrono::steady_clock::now() + kFlushInterval;
    for (bool stopping = false; !stopping;) {
      {
        std::unique_lock lock(mutex_);
        stopping = stop_signal_.wait_for(lock, kPollInterval,
                                         [this] { return stop_requested_.load(std::memory_order_relaxed); });
      }
      drain();
      if (const auto now = std::chrono::steady_clock::now(); stopping || now >= flush_due) {
        guarded([this] { flush_(); });
        flush_due = now + kFlushInterval;
      }
    }
  }

  /// At most one full ring: all there can be after the last push, and a bound before it, so that a producer
  /// faster than the sink cannot delay the flush.
  void drain() noexcept {
    Record record{};
    for (std::size_t left = ring_.capacity(); left > 0 && ring_.pop(record); --left) {
      guarded([this, &record] { write_(record); });
    }
  }

  template <typename Call>
  void guarded(Call call) noexcept {
    try {
      call();
    } catch (const std::exception& error) {
      note_sink_failure(error.what());
    } catch (...) {
      note_sink_failure("an exception that is not a std::exception");
    }
  }

  void note_sink_failure(const char* message) noexcept {
    if (sink_failures_.load(std::memory_order_relaxed) == 0) {
      try {
        const std::scoped_lock lock(mutex_);
        first_sink_failure_ = message;
      } catch (const std::bad_alloc&) {
        // The count is still correct; out of memory must not stop the robot.
      }
    }
    count_one(sink_failures_);
  }

  SpscRing<Record> ring_;
  // Apart from the ring's indices, the cycle only touches these; the ring's alignment keeps them off the
  // writer's cache lines.
  std::atomic<std::uint64_t> pushed_{0};
  std::atomic<std::uint64_t> dropped_{0};
  std::atomic<bool> stop_requested_{false};

  alignas(64) std::atomic<std::uint64_t> sink_failures_{0};
  const std::function<void(const Record&)> write_;
  const std::function<void()> flush_;
  mutable std::mutex mutex_;  // never taken by push()
  std::condition_variable stop_signal_;
  std::string first_sink_failure_;
  std::jthread writer_;
};

}  // namespace runtime
