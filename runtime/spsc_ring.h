/// @file
/// A bounded queue from exactly one producer thread to exactly one consumer thread.
#pragma once
#include <atomic>
#include <bit>
#include <cstddef>
#include <limits>
#include <memory>
#include <stdexcept>
#include <type_traits>

namespace runtime {

/// Passes records from the cycle to a slower thread; neither waits for the other.
///
/// One thread may push() and one other may pop(); nothing else is synchronised. Both are wait-free: a bounded
/// number of instructions, no allocation, lock or system call.
template <typename T>
class SpscRing {
  static_assert(std::is_trivially_copyable_v<T>, "a slot is copied while no lock protects it");
  static_assert(std::is_default_constructible_v<T> && std::is_copy_assignable_v<T>);

 public:
  /// Setup: allocates every slot, for `capacity` rounded up to a power of two.
  /// @throws std::invalid_argument if `capacity` is 0 or there is no power of two above it; std::bad_alloc.
  explicit SpscRing(std::size_t capacity)
      : mask_(round_up(capacity) - 1),
        // Value-initialised, so every page is touched now and not in the first lap of the cycle.
        slots_(std::make_unique<T[]>(mask_ + 1)) {}

  SpscRing(const SpscRing&) = delete;
  SpscRing& operator=(const SpscRing&) = delete;

  /// Cycle, producer thread: false, with nothing stored, if the ring is full.
  [[nodiscard]] bool push(const T& value) noexcept {
    const std::size_t tail = tail_.load(std::memory_order_relaxed);
    if (tail - head_seen_ > mask_) {
      head_seen_ = head_.load(std::memory_order_acquire);
      if (tail - head_seen_ > mask_) return false;
    }
    slots_[tail & mask_] = value;
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }

  /// Consumer thread: false, with `value` unchanged, if the ring is empty.
  [[nodiscard]] bool pop(T& value) noexcept {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    if (head == tail_seen_) {
      tail_seen_ = tail_.load(std::memory_order_acquire);
      if (head == tail_seen_) return false;
    }
    value = slots_[head & mask_];
    head_.store(head + 1, std::memory_order_release);
    return true;
  }

  /// Producer thread: the next push() would fail.
  bool full() const noexcept {
    return tail_.load(std::memory_order_relaxed) - head_.load(std::memory_order_acquire) > mask_;
  }

  std::size_t capacity() const noexcept { return mask_ + 1; }

 private:
  static std::size_t round_up(std::size_t capacity) {
    constexpr std::size_t kLargest = std::numeric_limits<std::size_t>::max() / 2 + 1;
    if (capacity == 0 || capacity > kLargest) {
      throw std::invalid_argument("SpscRing: capacity must be 1 or more and fit a power of two");
    }
    return std::bit_ceil(capacity);
  }

  static_assert(std::atomic<std::size_t>::is_always_lock_free);
  // Not std::hardware_destructive_interference_size: g++ 12 warns that it varies with -mtune.
  static constexpr std::size_t kCacheLineBytes = 64;

  const std::size_t mask_;
  const std::unique_ptr<T[]> slots_;
  // Indices count up forever and wrap as unsigned numbers; `& mask_` makes them slots. Each side caches the
  // other's index and reads the other's cache line only if the cached value says full or empty.
  alignas(kCacheLineBytes) std::atomic<std::size_t> tail_{0};  ///< producer writes
  std::size_t head_seen_ = 0;
  alignas(kCacheLineBytes) std::atomic<std::size_t> head_{0};  ///< consumer writes
  std::size_t tail_seen_ = 0;
};

}  // namespace runtime
