/// @file
/// What page, stream and ROS 2 topics show of the cycle, on its way to their threads.
#pragma once
#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <type_traits>
#include <variant>
#include <vector>

#include "hal/clock.h"
#include "hal/robot.h"
#include "operation/cycle_record.h"
#include "operation/teleop_record.h"
#include "runtime/spsc_ring.h"

namespace operation {

struct LiveSample {
  std::uint64_t time_ns = 0;  ///< LiveFeed::now_ns()
  bool running = true;        ///< false: the drives are off, and only what the joints measure is valid
  std::variant<CycleRecord, TeleopRecord> record;
};
static_assert(std::is_trivially_copyable_v<LiveSample>);

/// Counts of durations, written by the cycle and read by any thread.
class LiveHistogram {
 public:
  static constexpr std::size_t kBuckets = 18;
  /// Upper bounds in µs; the last bucket has none.
  static constexpr std::array<int, kBuckets - 1> kBounds_us{
      1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10000, 20000, 50000, 100000, 1000000};

  void add(std::chrono::nanoseconds duration) noexcept {
    std::size_t bucket = 0;
    while (bucket < kBounds_us.size() && duration > std::chrono::microseconds(kBounds_us[bucket])) ++bucket;
    counts_[bucket].store(counts_[bucket].load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }
  std::array<std::uint64_t, kBuckets> counts() const noexcept {
    std::array<std::uint64_t, kBuckets> counts{};
    for (std::size_t i = 0; i < kBuckets; ++i) counts[i] = counts_[i].load(std::memory_order_relaxed);
    return counts;
  }

 private:
  std::array<std::atomic<std::uint64_t>, kBuckets> counts_{};
};

/// From the cycle to its readers, which never delay the cycle: what one does not read in time is lost for it,
/// and counted.
class LiveFeed {
 public:
  /// One thread reads it.
  class Reader {
   public:
    /// False if there is nothing new.
    bool take(LiveSample& sample) noexcept { return ring_.pop(sample); }
    std::uint64_t lost() const noexcept { return lost_.load(std::memory_order_relaxed); }

   private:
    friend class LiveFeed;
    static constexpr std::size_t kCapacity = 256;  // 2.5 s

    void add(const LiveSample& sample) noexcept {
      if (!ring_.push(sample))
        lost_.store(lost_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    }
    runtime::SpscRing<LiveSample> ring_{kCapacity};
    std::atomic<std::uint64_t> lost_{0};
  };

  /// The cycle passes on one record in this time.
  static constexpr std::chrono::milliseconds kPeriod{10};

  /// `clock` must outlive it; several threads read it.
  explicit LiveFeed(const hal::Clock& clock)
      : clock_(clock), epoch_(std::chrono::system_clock::now().time_since_epoch() - clock.now()) {}

  /// Set-up, before the first cycle. It lives as long as the feed.
  Reader& add_reader() { return *readers_.emplace_back(std::make_unique<Reader>()); }

  /// Cycle: wait-free.
  template <typename Record>
  void add(const Record& record, bool running = true) noexcept {
    wake_up_.add(record.wake_up);
    step_.add(record.step);
    const std::chrono::nanoseconds now = clock_.now();
    if (last_ && now - *last_ < kPeriod) return;
    last_ = now;
    const LiveSample sample{
        .time_ns = static_cast<std::uint64_t>((epoch_ + now).count()), .running = running, .record = record};
    for (const std::unique_ptr<Reader>& reader : readers_) reader->add(sample);
  }

  /// Any thread: time since 1970 by a clock that is set once, at the start.
  std::uint64_t now_ns() const noexcept {
    return static_cast<std::uint64_t>((epoch_ + clock_.now()).count());
  }

  const LiveHistogram& wake_up() const noexcept { return wake_up_; }
  const LiveHistogram& step() const noexcept { return step_; }

  /// Set-up, of a run without a service: the active robot, or null when it ends, for with_robot().
  void show(const hal::Robot* robot) {
    const std::lock_guard lock(mutex_);
    robot_ = robot;
  }
  /// A reader's thread: calls `look(robot)` if there is one. It may call what hal::Robot allows
  /// concurrently.
  template <typename Look>
  void with_robot(const Look& look) const {
    const std::lock_guard lock(mutex_);
    if (robot_ != nullptr) look(*robot_);
  }

 private:
  const hal::Clock& clock_;
  std::chrono::nanoseconds epoch_;
  std::optional<std::chrono::nanoseconds> last_;
  LiveHistogram wake_up_;
  LiveHistogram step_;
  std::vector<std::unique_ptr<Reader>> readers_;
  mutable std::mutex mutex_;
  const hal::Robot* robot_ = nullptr;
};

}  // namespace operation
